"""Equilibrium of joints over one step of an implicit integrator: u = u_free - A F(u).

``u_free`` is where the joints would go without their forces at the end of the step, and A what
these forces take back. Newton's method with the joints' own tangents T, (1 + A T) Δu = -r; an
inverse is kept as long as it lowers the residual fast, and a correction by the right one that does
not lower it is shortened.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe_models.dynamics.model import IncrementResponse, Joints
from sa_solver.types import Array

# Residual of the joints' equilibrium, relative to the largest force they have had so far. Newton
# ends far below on its last iteration; sums over 1e5 steps still hold to 1e-6 at worst.
TOLERANCE = 1e-10
# Where joints slip far in one step, their displacement is resolved to this share of it only: ten
# times the rounding of a number.
ROUNDING = 2e-15
# An inverse is kept, from step to step too, while an iteration with it leaves at most this share of
# the residual; up to SMALL unknowns a new one is cheaper than a further iteration.
KEPT = 0.05
SMALL = 12
# Newton needs one to ten iterations; where it takes more, it walks between two kinks.
MAX_ITERATIONS = 30
# A correction that does not lower the residual at 1/64 of its size points in a useless direction.
MAX_SHORTENED = 6


class Trial(NamedTuple):
    """Displacements of the joints over a step ``(j d,)`` [mm], and how far they are from the law.

    ``residual`` ``(j d,)`` [mm], its largest entry ``size``, and ``relative`` to what the largest
    force of the joints would move them.
    """

    increment: Array
    response: IncrementResponse
    residual: Array
    size: float
    relative: float

    @property
    def solved(self) -> bool:
        return self.relative <= TOLERANCE


class JointEquilibrium:
    """Newton's method for u = u_free - A F(u), with one A ``(j d, j d)`` [mm/N]."""

    def __init__(self, joints: Joints, flexibility: Array) -> None:
        self._joints, self._flexibility = joints, flexibility
        self._size, self._directions = len(flexibility), joints.directions
        count = self._size // self._directions
        shape = self._size, count, self._directions
        self._by_joint = flexibility.reshape(shape).transpose(1, 0, 2)
        self._weight = float(np.diag(flexibility).max(initial=0.0))
        self._inverse: Array = np.empty((0, 0))

    def solve(self, before: IncrementResponse, free: Array, largest: float) -> Trial:
        """The best found from the state that ``before`` has ended in.

        ``free`` is u_free ``(j d,)`` [mm], relative to that state, and ``largest`` the largest
        force so far [N], which residuals are measured against.
        """
        state = before.state
        scale = self._weight * largest + ROUNDING / TOLERANCE * largest_entry(free)
        guess = free - self._flexibility @ before.force.ravel()
        if self._size <= SMALL or not len(self._inverse):
            self._invert(before.tangent)
        at = self._trial(state, free, self._inverse @ guess, scale)
        for _ in range(MAX_ITERATIONS):
            if at.solved:
                break
            closer = self._closer(state, free, at, scale)
            if closer is None:
                break
            at = closer
        return at

    def _closer(self, state: Array, free: Array, at: Trial, scale: float) -> Trial | None:
        """A trial with a lower residual, None if there is none along Newton's correction."""
        if self._size > SMALL:
            kept = self._inverse @ at.residual
            trial = self._trial(state, free, at.increment - kept, scale)
            if trial.size <= KEPT * at.size:
                return trial
        self._invert(at.response.tangent)
        correction = self._inverse @ at.residual
        for shortened in range(MAX_SHORTENED + 1):
            shorter = at.increment - 0.5**shortened * correction
            trial = self._trial(state, free, shorter, scale)
            if trial.size < at.size:
                return trial
        return None

    def _trial(self, state: Array, free: Array, increment: Array, scale: float) -> Trial:
        response = self._joints.respond(state, increment.reshape(-1, self._directions))
        force = response.force.ravel()
        residual = increment - free + self._flexibility @ force
        size = largest_entry(residual)
        scale = max(scale, self._weight * largest_entry(force))
        relative = size / scale if scale > 0.0 else size
        return Trial(increment, response, residual, size, relative)

    def _invert(self, tangent: Array) -> None:
        """Find (1 + A T)⁻¹ of tangents ``(j, d, d)``."""
        if self._size == 1:
            self._inverse = np.asarray(1.0 / (1.0 + self._flexibility * tangent[0]))
            return
        coupled = (self._by_joint @ tangent).transpose(1, 0, 2).reshape(self._size, self._size)
        try:
            self._inverse = np.asarray(np.linalg.inv(np.eye(self._size) + coupled), float)
        except np.linalg.LinAlgError:
            # Joints that soften by just as much as the structure holds them leave no direction.
            self._inverse = np.eye(self._size)


def largest_entry(values: Array) -> float:
    """Largest magnitude of any entry, 0 of none; faster than numpy's for a few."""
    if values.size == 1:
        return abs(float(values.ravel()[0]))
    return float(np.abs(values).max(initial=0.0))
