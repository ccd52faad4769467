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
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array


def acting_slip(slip: Array, loads: LoadHistory) -> Array:
    """Return the size of the slip over which each state of a cycle acts ``(t, ...)`` [mm].

    ``slip`` ``(t, 2, ...)`` [mm] is that of the increments; see :mod:`sa_solver.cycles.increments`.
    """
    sizes = np.hypot(slip[:, 0], slip[:, 1])
    return slip_of_states(sizes, loads.P > 0.0, loads.missions)


@dataclass(frozen=True)
class ContactFields:
    """Tractions and slip of a contact in one increment.

    ``pressure`` is ``(nx, ny)`` [MPa], ``shear`` on body 2 ``(2, nx, ny)`` [MPa] and ``slip``
    ``(2, nx, ny)`` [mm].
    """

    pressure: Array
    shear: Array
    slip: Array


@dataclass(frozen=True)
class CycleTractions:
    """Tractions and slip of one contact over the increments of a closed cycle.

    Parameters
    ----------
    loads
        Resultants of the cycle.
    friction
        Coefficient of friction µ.
    pressure
        Pressure at the end of each increment ``(t, nx, ny)`` [MPa].
    shear
        Shear on body 2 at the end of each increment ``(t, 2, nx, ny)`` [MPa]. Where slip is that of
        the loads (method normal), it is µp against the slip, and set to 0 where nothing slips.
    slip
        Slip during each increment ``(t, 2, nx, ny)`` [mm].
    unknown
        Share of the normal force on cells whose shear is unknown ``(t,)``.
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
        """Friction work per area of a mean cycle on the cells of the grid ``(nx, ny)`` [N/mm]."""
        return np.asarray(np.sum(self.loads.share[:, None, None] * self.work, axis=0))

    @property
    def work_and_error(self) -> tuple[Array, Array] | None:
        """Friction work per area of a cycle, and its error due to the increments.

        Each is ``(nx, ny)`` [N/mm]. It is None without friction work, or if the error is unknown.
        """
        loads, rubbed = self.loads, self.rubbed
        often = loads.share[:, None, None]
        limit = self.friction * often * self.pressure
        errors = errors_of_increments(limit, self.slip, loads.P > 0.0, loads.missions)
        return None if errors is None or not rubbed.any() else (rubbed, errors.sum(axis=0))


def increments_error(cycles: Iterable[CycleTractions]) -> dict[str, float] | None:
    """Return the relative errors of ``depth`` and ``energy`` of cycles due to their increments.

    The energy is too large by its error. The error of the depth is a root mean square, of the work
    of all cycles together: errors that change sign from cycle to cycle cancel, as they do in wear.
    Return None without friction work, or if the errors are unknown.
    """
    known = [left for left in (cycle.work_and_error for cycle in cycles) if left is not None]
    if not known:
        return None
    rubbed, errors = (np.sum(fields, axis=0) for fields in zip(*known, strict=True))
    return _relative(errors, rubbed)


def increments_change(
    cycles: Iterable[CycleTractions], halves: Iterable[CycleTractions]
) -> dict[str, float] | None:
    """Return the same relative errors from ``halves``, the cycles in twice as many increments.

    Friction marched by Backward Euler is of first order in the increments, so that the error is
    twice the change.
    """
    rubbed, finer = (np.sum([cycle.rubbed for cycle in all_], axis=0) for all_ in (cycles, halves))
    return _relative(2.0 * (rubbed - finer), rubbed) if rubbed.any() else None


def _relative(errors: Array, rubbed: Array) -> dict[str, float]:
    depth, _ = depth_and_energy(errors) / depth_and_energy(rubbed)
    return {"depth": float(depth), "energy": float(errors.sum() / rubbed.sum())}
