"""Normal and tangential contact of dissimilar bodies, solved alternately.

This is the plain iteration of the papers: pressure for a given shear, then shear for that pressure,
until the normal displacement under shear no longer changes. Where the contact slides, every round
reduces the change by about µβ (β of Dundurs): the iteration slows down towards µβ = 1 and fails
beyond, where :mod:`sa_solver.dissimilar.contact` still converges.

Source: Gallego, Nélias & Jacq 2006, J. Tribol. 128, 476, doi:10.1115/1.2194914.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.normal.state import NormalState
from sa_solver.rigid_modes import RESULTANTS
from sa_solver.tangential.contact import TangentialContact, TangentialState
from sa_solver.types import Array

TOLERANCE = 1e-8
"""Default bound on the change of the normal displacement in a round, over its largest value."""

INNER = 0.1
"""Tolerance of the problems solved in turns, over that of the iteration."""

ROUNDS = 100
"""A factor of 0.83 still reaches 1e-8 in as many."""

CROSS_TERMS = 2
"""Convolutions of a round besides those of the two problems."""


@dataclass(frozen=True)
class AlternatingState:
    """Outcome of the iteration.

    ``traction`` ``(qx, qy, p)`` [MPa] and ``displacement`` K t [mm] are ``(3, nx, ny)``. For every
    round ``changes`` holds the largest change of the normal displacement under shear in the
    contact, over the largest normal displacement; ``convolutions`` have one or two components.
    """

    traction: Array
    displacement: Array
    changes: tuple[float, ...]
    converged: bool
    message: str
    convolutions: int


class AlternatingContact:
    """Alternating iteration on one grid, with all resultants imposed."""

    def __init__(self, half_space: HalfSpace, friction: float) -> None:
        """Plan for ``half_space`` and the coefficient of friction µ."""
        self.half_space, self.friction = half_space, friction
        self._normal = NormalContact(half_space)
        self._tangential = TangentialContact(half_space)

    def solve(
        self,
        height: Array,
        offset: Array | None,
        values: Array | Sequence[float],
        *,
        tolerance: float = TOLERANCE,
        max_rounds: int = ROUNDS,
    ) -> AlternatingState:
        """Solve one increment, with the arguments of ``CoupledContact.solve``.

        See :meth:`~sa_solver.dissimilar.contact.CoupledContact.solve`. Raises the exceptions of the
        normal and the tangential solver.
        """
        loads = {
            name: float(value)
            for name, value in zip(RESULTANTS, values, strict=True)
            if not (self.half_space.grid.line and name in ("Mx", "Mz") and value == 0.0)
        }
        fixed = np.zeros((2, *height.shape)) if offset is None else offset
        lift = none = np.zeros(height.shape)
        pressed: NormalState | None = None
        sheared: TangentialState | None = None
        changes: list[float] = []
        convolutions = 0
        settled = False
        while not settled and len(changes) < max_rounds:
            pressed = self._press(height + lift, loads, INNER * tolerance, pressed)
            drag = self.half_space.displacement(np.stack([none, none, pressed.pressure]))[:2]
            sheared = self._shear(pressed, fixed + drag, loads, INNER * tolerance, sheared)
            lift, last = self.half_space.normal_under_shear(sheared.shear), lift
            convolutions += pressed.convolutions + sheared.convolutions + CROSS_TERMS
            changes.append(_change(lift, last, pressed))
            settled = changes[-1] <= tolerance
        if pressed is None or sheared is None:
            raise ValueError(f"max_rounds = {max_rounds} leaves nothing to do: give 1 or more")
        converged = settled and pressed.converged and sheared.converged
        return AlternatingState(
            traction=np.stack([*sheared.shear, pressed.pressure]),
            displacement=np.stack([*(sheared.displacement + drag), pressed.displacement + lift]),
            changes=tuple(changes),
            converged=converged,
            message="" if converged else _failure(changes, tolerance, pressed, sheared),
            convolutions=convolutions,
        )

    # -- steps of solve -----------------------------------------------------------------------
    def _press(
        self, height: Array, loads: dict[str, float], tolerance: float, last: NormalState | None
    ) -> NormalState:
        return self._normal.solve(
            height,
            loads["P"],
            loads.get("Mx"),
            loads["My"],
            tolerance=tolerance,
            start=None if last is None else last.start,
        )

    def _shear(
        self,
        pressed: NormalState,
        offset: Array,
        loads: dict[str, float],
        tolerance: float,
        last: TangentialState | None,
    ) -> TangentialState:
        limit = self.friction * pressed.pressure
        return self._tangential.solve(
            limit,
            offset,
            loads["Qx"],
            loads["Qy"],
            loads.get("Mz", 0.0),
            tolerance=tolerance,
            start=None if last is None else last.shear,
        )


def _change(lift: Array, last: Array, pressed: NormalState) -> float:
    """Return the largest change in the contact over the largest displacement."""
    moved = np.abs(lift - last)[pressed.pressure > 0.0].max(initial=0.0)
    return float(moved) / float(np.abs(pressed.displacement + lift).max())


def _failure(
    changes: list[float], tolerance: float, pressed: NormalState, sheared: TangentialState
) -> str:
    inner = pressed.message or sheared.message
    if inner:
        return f"a problem solved in turns did not converge: {inner}"
    return (
        f"pressure and shear still change by {changes[-1]:.1e} of the displacement after "
        f"{len(changes)} rounds, above the tolerance {tolerance:.0e}: solve both together"
    )
