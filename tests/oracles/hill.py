"""Hill's method: Floquet's exponents by the Jacobian of harmonic balance, sorted.

A deviation exp(λt) p(t) with p of the motion's period obeys, harmonic by harmonic, a quadratic
eigenvalue problem, in which joints are what they are to periodic changes of the motion (von Groll
and Ewins 2001, doi:10.1006/jsvi.2000.3298). Of its 2 n (2 H + 1) eigenvalues those 2 n are taken
whose imaginary parts are smallest (Moore 2005, doi:10.1137/040612415).
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as sl

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import Resolution
from sa_solver.types import Array


def hill_multipliers(
    problem: HarmonicBalance, motion: HarmonicSolution, highest: int, samples: int
) -> Array:
    """Return exp(λT) of the exponents with the smallest imaginary parts ``(2 n,)``, by size.

    Joints act along one direction; deviations have all harmonics up to the ``highest``.
    """
    every = Resolution(tuple(range(highest + 1)), samples)
    coefficients = every.adopt(motion.coefficients, motion.resolution)
    cycle = problem.joints.settle(coefficients, every.basis, every.weights, every.lead)
    model, omega = problem.model, 2.0 * np.pi * motion.frequency
    size, count = every.size, len(model.mass)
    rate, (cosine, sine) = np.zeros((size, size)), every.places
    for harmonic, (c, s) in enumerate(zip(cosine, sine, strict=True)):
        if harmonic:
            rate[c, s], rate[s, c] = harmonic * omega, -harmonic * omega
    one = np.eye(size)
    stiffness = np.kron(rate @ rate, model.mass) + np.kron(rate, model.damping)
    stiffness += np.kron(one, model.stiffness)
    for joint, row in enumerate(model.connection):
        slopes = cycle.jacobian[joint, :, 0, :, 0]
        stiffness += np.kron(slopes, np.outer(row, row))
    damping = 2.0 * np.kron(rate, model.mass) + np.kron(one, model.damping)
    inverse = sl.inv(np.kron(one, model.mass))
    coarse_run = np.block(
        [
            [np.zeros_like(stiffness), np.eye(len(stiffness))],
            [-inverse @ stiffness, -inverse @ damping],
        ]
    )
    exponents = np.linalg.eigvals(coarse_run)
    central = exponents[np.argsort(np.abs(exponents.imag), kind="stable")[: 2 * count]]
    multipliers = np.exp(central / motion.frequency)
    return multipliers[np.argsort(-np.abs(multipliers), kind="stable")]
