"""Derivatives of contact forces from those of the stretch, over a settled period.

See :mod:`wear.joints.periodic.contact`. Gradients are those of the stretch ``(t + 1, 2, 3, m)``: of
its two components, by the coefficients of three directions and ``m`` functions of time.
"""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array
from wear.joints.compiled import compiled
from wear.joints.periodic.sliders import Period


@compiled(nogil=True, error_model="numpy")
def copy_gradient(gradient: Array, to: Array) -> None:
    """Copy one gradient ``(2, 3, m)`` to another."""
    for memory in range(2):
        for direction in range(3):
            for c in range(gradient.shape[2]):
                to[memory, direction, c] = gradient[memory, direction, c]


@compiled(nogil=True, error_model="numpy")
def project_stuck(
    stiffness: float, period: Period, shares: Array, first: Array, jacobian: Array
) -> None:
    """Write the tangential part of the derivative where all samples stick.

    The stretch at a sample is that at the first one plus the displacement since; ``first`` ``(2, 3,
    m)`` is the derivative of the former.
    """
    basis, weights = period.basis, period.weights
    size = basis.shape[1]
    for row in range(size):
        weight = np.sum(weights[row])
        for direction in range(2):
            for by in range(3):
                for c in range(size):
                    slope = weight * first[direction, by, c]
                    if by == direction:
                        slope += shares[row, c] - weight * basis[0, c]
                    jacobian[row, direction, c, by] = stiffness * slope


@compiled(nogil=True, error_model="numpy")
def project(stiffness: float, weights: Array, gradient: Array, jacobian: Array) -> None:
    """Write the tangential part of the derivative."""
    size, samples = weights.shape
    copy_gradient(gradient[-1], gradient[0])
    slopes = np.dot(weights, gradient[:-1].reshape(samples, 6 * size))
    for row in range(size):
        for direction in range(2):
            for by in range(3):
                for c in range(size):
                    slope = slopes[row, (3 * direction + by) * size + c]
                    jacobian[row, direction, c, by] = stiffness * slope


@compiled(nogil=True, error_model="numpy")
def project_normal(
    stiffness: float, period: Period, shares: Array, states: Array, jacobian: Array
) -> None:
    """Write the normal part of the derivative: kn while there is contact."""
    basis, pressed, apart = period.basis, shares, False
    for state in states:
        apart = apart or state == 2
    if apart:
        touching = np.zeros(basis.shape)
        for t in range(len(basis)):
            if states[t] != 2:
                for c in range(basis.shape[1]):
                    touching[t, c] = basis[t, c]
        pressed = np.dot(period.weights, touching)
    for row in range(len(pressed)):
        for c in range(len(pressed)):
            jacobian[row, 2, c, 0] = jacobian[row, 2, c, 1] = 0.0
            jacobian[row, 2, c, 2] = stiffness * pressed[row, c]
