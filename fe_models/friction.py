"""Incremental Coulomb friction between two condensed bodies: stick, slip, separation per node.

At each increment find the relative displacements w and the contact forces f = H w + f0 on body 2
that obey, node by node, unilateral contact with the gap g + w_z and Coulomb's law for the slip
since the previous increment. Solved by splitting: its only parameter ρ comes from the extreme
eigenvalues of H, and there is no penalty.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.reduction import JointResolvent
from sa_solver.contact_law import coulomb
from sa_solver.splitting import SplittingResult, douglas_rachford
from sa_solver.types import Array

# Out-of-balance forces left, relative to the forces of the load at hand.
TOLERANCE = 1e-7
# An unloaded increment is measured against this share of the largest load of the path.
LOAD_FLOOR = 1e-3
# The default joint needs 30 to 50 iterations per increment; hard ones a few hundred.
MAX_ITERATIONS = 5000


@dataclass(frozen=True)
class FrictionState:
    """State at the end of one increment, components in the interface frames.

    ``force`` ``(3, n)`` on body 2 [N]; ``displacement`` ``(3, n)`` of body 2 relative to body 1 and
    ``slip`` ``(2, n)`` its tangential part since the previous increment [mm]; ``state``
    ``(3 n,)`` is the splitting's, to start from again.
    """

    force: Array
    displacement: Array
    slip: Array
    state: Array
    residual: float
    iterations: int
    converged: bool


class FrictionalJoint:
    """A joint with friction coefficient µ, for any gaps and loads."""

    def __init__(self, joint: JointResolvent, friction: float) -> None:
        self._inverse, self._rho, self._loads = joint.inverse, joint.rho, joint.loads
        self._friction = friction

    def march(
        self,
        amplitudes: Array,
        gap: Array,
        previous: Array | None = None,
        guess: Sequence[Array] = (),
    ) -> Iterator[FrictionState]:
        """States along a load path ``(increments, cases)``.

        ``gap`` ``(n,)`` is the distance of the unloaded faces [mm]; ``previous`` the displacement
        ``(3, n)`` that the path starts from, unslipped unless it is given. ``guess`` are the
        ``state`` of every increment of a similar path: they save iterations and change nothing
        else.
        """
        loads = amplitudes @ self._loads.T
        floor = LOAD_FLOOR * np.linalg.norm(loads, axis=1).max()
        displacement = np.zeros((3, len(gap))) if previous is None else previous
        found: list[Array] = []
        for increment, load in enumerate(loads):
            scale = max(float(np.linalg.norm(load)), floor)
            start = _predicted(found, guess, loads[: increment + 1])
            split = self._solve(load, gap, displacement, start, scale)
            state = self._state(split, gap, displacement)
            found.append(state.state)
            displacement = state.displacement
            yield state

    def _solve(
        self, load: Array, gap: Array, previous: Array, start: Array, scale: float
    ) -> SplittingResult:
        rho, inverse = self._rho, self._inverse
        offset = inverse @ load

        def elastic(state: Array) -> Array:
            return rho * (inverse @ state) - offset

        def law(trial: Array) -> Array:
            nodal = trial.reshape(-1, 3).T
            return (nodal + self._force(nodal, gap, previous) / rho).T.ravel()

        return douglas_rachford(
            elastic,
            law,
            start,
            scale=scale / rho,
            tolerance=TOLERANCE,
            max_iterations=MAX_ITERATIONS,
        )

    def _force(self, trial: Array, gap: Array, previous: Array) -> Array:
        """Force that brings a trial displacement ``(3, n)`` back to the law, at stiffness ρ."""
        stick = self._rho * (previous - trial)
        stick[2] = -self._rho * (gap + trial[2])
        return coulomb(stick, self._friction)

    def _state(self, split: SplittingResult, gap: Array, previous: Array) -> FrictionState:
        trial = (2.0 * split.elastic - split.state).reshape(-1, 3).T
        force = self._force(trial, gap, previous)
        displacement = split.solution.reshape(-1, 3).T
        slip = displacement[:2] - previous[:2]
        return FrictionState(
            force,
            displacement,
            slip,
            split.state,
            split.residual,
            split.iterations,
            split.converged,
        )


def _predicted(found: list[Array], guess: Sequence[Array], loads: Array) -> Array:
    """Start of the next increment, whose load is the last of ``loads``.

    It changes by as much as it does in the guess; without one, in proportion to the load as long
    as that goes on in the same sense.
    """
    increment = len(found)
    if increment < len(guess):
        return guess[increment] + (found[-1] - guess[increment - 1] if found else 0.0)
    if increment < 2:
        return found[-1] if found else np.zeros(loads.shape[1])
    step, before = np.diff(loads[-3:], axis=0)[::-1]
    ratio = max(float(step @ before / (before @ before)), 0.0)
    return found[-1] + ratio * (found[-1] - found[-2])
