"""Equilibrium of joints over one step of an implicit integrator: u = u_free - A F(u).

``u_free`` is the displacement of the joints at the end of the step without their forces, and A is
their dynamic flexibility over the step. Newton's method uses the tangents T of the joints, (1 + A
T) Δu = -r. An inverse is reused as long as it reduces the residual quickly. A correction with the
current inverse that does not reduce the residual is shortened.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe_models.dynamics.model import IncrementResponse, Joints
from sa_solver.types import Array

# Residual of the equilibrium, relative to the largest force of the joints so far. The last
# iteration of Newton ends far below it; sums over 1e5 steps are still accurate to 1e-6 in the worst
# case.
TOLERANCE = 1e-10
# Where joints slip far in one step, their displacement is resolved to this share only, ten times
# the rounding error of a number.
ROUNDING = 2e-15
# An inverse is reused, also in later steps, while an iteration with it leaves at most this share of
# the residual. Up to SMALL_SIZE unknowns a new inverse is cheaper than a further iteration.
REUSE_RATIO = 0.05
SMALL_SIZE = 12
# Newton needs one to ten iterations; if it takes more, it alternates between two kinks.
MAX_ITERATIONS = 30
# A correction that does not reduce the residual at 1/64 of its length has a useless direction.
MAX_HALVINGS = 6


class JointTrial(NamedTuple):
    """Trial displacements of the joints over a step, and their residual.

    Parameters
    ----------
    increment
        Displacements ``(j d,)`` [mm] over the step.
    response
        Response of the joint law.
    residual
        Residual ``(j d,)`` [mm].
    size
        Largest entry of the residual [mm].
    relative
        ``size`` over the displacement that the largest force of the joints would cause.
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
    """Newton's method for u = u_free - A F(u) with a fixed flexibility A ``(j d, j d)`` [mm/N]."""

    def __init__(self, joints: Joints, flexibility: Array) -> None:
        self._joints, self._flexibility = joints, flexibility
        self._size, self._directions = len(flexibility), joints.directions
        count = self._size // self._directions
        shape = self._size, count, self._directions
        self._by_joint = flexibility.reshape(shape).transpose(1, 0, 2)
        self._weight = float(np.diag(flexibility).max(initial=0.0))
        self._inverse: Array = np.empty((0, 0))

    def solve(self, before: IncrementResponse, free: Array, largest: float) -> JointTrial:
        """Return the best trial found, from the joint state after an earlier response.

        Parameters
        ----------
        before
            Response of the joints at the start of the step.
        free
            Displacements u_free ``(j d,)`` [mm], relative to that state.
        largest
            Largest force of the joints so far [N], to which residuals are relative.
        """
        state = before.state
        scale = self._weight * largest + ROUNDING / TOLERANCE * largest_entry(free)
        guess = free - self._flexibility @ before.force.ravel()
        if self._size <= SMALL_SIZE or not len(self._inverse):
            self._invert(before.tangent)
        at = self._trial(state, free, self._inverse @ guess, scale)
        for _ in range(MAX_ITERATIONS):
            if at.solved:
                break
            improved = self._improved(state, free, at, scale)
            if improved is None:
                break
            at = improved
        return at

    def _improved(
        self, state: Array, free: Array, at: JointTrial, scale: float
    ) -> JointTrial | None:
        """Return a trial with a lower residual, or None if Newton's correction leads to none."""
        if self._size > SMALL_SIZE:
            correction = self._inverse @ at.residual
            trial = self._trial(state, free, at.increment - correction, scale)
            if trial.size <= REUSE_RATIO * at.size:
                return trial
        self._invert(at.response.tangent)
        correction = self._inverse @ at.residual
        for halvings in range(MAX_HALVINGS + 1):
            increment = at.increment - 0.5**halvings * correction
            trial = self._trial(state, free, increment, scale)
            if trial.size < at.size:
                return trial
        return None

    def _trial(self, state: Array, free: Array, increment: Array, scale: float) -> JointTrial:
        response = self._joints.respond(state, increment.reshape(-1, self._directions))
        force = response.force.ravel()
        residual = increment - free + self._flexibility @ force
        size = largest_entry(residual)
        scale = max(scale, self._weight * largest_entry(force))
        relative = size / scale if scale > 0.0 else size
        return JointTrial(increment, response, residual, size, relative)

    def _invert(self, tangent: Array) -> None:
        """Compute (1 + A T)⁻¹ for tangents ``(j, d, d)``."""
        if self._size == 1:
            self._inverse = np.asarray(1.0 / (1.0 + self._flexibility * tangent[0]))
            return
        coupled = (self._by_joint @ tangent).transpose(1, 0, 2).reshape(self._size, self._size)
        try:
            self._inverse = np.asarray(np.linalg.inv(np.eye(self._size) + coupled), float)
        except np.linalg.LinAlgError:
            # Joints that soften exactly as much as the structure resists leave no direction.
            self._inverse = np.eye(self._size)


def largest_entry(values: Array) -> float:
    """Return the largest magnitude of any entry, 0 if empty; faster than numpy for one entry."""
    if values.size == 1:
        return abs(float(values.ravel()[0]))
    return float(np.abs(values).max(initial=0.0))
