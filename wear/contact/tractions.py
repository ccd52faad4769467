"""Tractions of a contact over a closed cycle, and the work of friction in it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sa_solver.cycles.increments import (
    depth_and_energy,
    errors_of_increments,
    friction_work,
    slip_of_states,
)
from sa_solver.types import Array, LoadHistory


def acting_slip(slip: Array, loads: LoadHistory) -> Array:
    """Size of the slip over which each state of a cycle acts ``(t, ...)`` [mm].

    ``slip`` ``(t, 2, ...)`` [mm] is that of the increments; see :mod:`sa_solver.cycles.increments`.
    """
    sizes = np.hypot(slip[:, 0], slip[:, 1])
    return slip_of_states(sizes, loads.P > 0.0, loads.missions)


@dataclass(frozen=True)
class ContactFields:
    """One increment: ``pressure`` ``(nx, ny)``, ``shear`` on body 2 and ``slip`` ``(2, nx, ny)``.

    In MPa and mm.
    """

    pressure: Array
    shear: Array
    slip: Array


@dataclass(frozen=True)
class CycleTractions:
    """Tractions and slip of one contact over the increments of a closed cycle.

    ``pressure`` ``(t, nx, ny)`` and ``shear`` ``(t, 2, nx, ny)`` on body 2 [MPa] are those at the
    end of an increment, ``slip`` ``(t, 2, nx, ny)`` [mm] that during it. Where slip is that of the
    loads (method normal), shear is µp against it and, unknown where nothing slips, 0 there:
    ``unknown`` ``(t,)`` is the share of the normal force on such cells. ``friction`` is µ.
    """

    loads: LoadHistory
    friction: float
    pressure: Array
    shear: Array
    slip: Array
    unknown: Array

    @cached_property
    def work(self) -> Array:
        """Friction work per area of each increment ``(t, nx, ny)`` [N/mm]."""
        loads, limit = self.loads, self.friction * self.pressure
        return friction_work(limit, self.slip, loads.P > 0.0, loads.missions)

    @property
    def rubbed(self) -> Array:
        """What a mean cycle rubs off the places of the grid, per area ``(nx, ny)`` [N/mm]."""
        return np.asarray(np.sum(self.loads.share[:, None, None] * self.work, axis=0))

    @property
    def increments_left(self) -> tuple[Array, Array] | None:
        """What a cycle rubs off the places of the grid, and what its increments leave of that.

        Per area ``(nx, ny)`` [N/mm]; None where nothing is rubbed, or nobody knows.
        """
        loads, rubbed = self.loads, self.rubbed
        often = loads.share[:, None, None]
        limit = self.friction * often * self.pressure
        errors = errors_of_increments(limit, self.slip, loads.P > 0.0, loads.missions)
        return None if errors is None or not rubbed.any() else (rubbed, errors.sum(axis=0))


def increments_error(cycles: Iterable[CycleTractions]) -> dict[str, float] | None:
    """What increments leave of ``depth`` (root mean square) and ``energy`` of cycles, relative.

    The energy is too large by that. The depth is that of what all of them rub: errors that change
    their sign from cycle to cycle cancel, as they do in wear. None where nothing is rubbed, or
    nobody knows.
    """
    known = [left for left in (cycle.increments_left for cycle in cycles) if left is not None]
    if not known:
        return None
    rubbed, errors = (np.sum(fields, axis=0) for fields in zip(*known, strict=True))
    return _relative(errors, rubbed)


def increments_change(
    cycles: Iterable[CycleTractions], halves: Iterable[CycleTractions]
) -> dict[str, float] | None:
    """The same by ``halves``, these cycles in twice as many increments: twice what those change.

    Friction marched by Backward Euler is of first order in its increments.
    """
    rubbed, finer = (np.sum([cycle.rubbed for cycle in all_], axis=0) for all_ in (cycles, halves))
    return _relative(2.0 * (rubbed - finer), rubbed) if rubbed.any() else None


def _relative(errors: Array, rubbed: Array) -> dict[str, float]:
    depth, _ = depth_and_energy(errors) / depth_and_energy(rubbed)
    return {"depth": float(depth), "energy": float(errors.sum() / rubbed.sum())}
