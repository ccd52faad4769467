"""Outcome of a wear run for each of its contacts, with the errors that the run itself knows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sa_solver.load_history import LoadHistory
from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceState
from wear.contact.tractions import CycleTractions, increments_change, increments_error
from wear.kinetics import LinearRegime, linear_regime
from wear.steps.step_errors import step_errors
from wear.steps.stepping import ContactFailure
from wear.steps.stick_border import border_errors
from workflow.models.contact import ContactEnd, FaceContact, FaceState

# Order of convergence of the pressure at worn edges in the length of forward and backward (Strang)
# steps over increments: 4, 8 and 16 implicit ones had errors of 5.5, 1.9 and 0.75 % on a dovetail's
# flank; 2, 4 and 8 of second order 12, 4.2 and 0.8 %.
AT_EDGES = 1.5
# Share of the pressed cells whose pressures estimate the error of the largest one.
HIGHEST = 0.1
# Share of all wear; once less than this is still to come, wear has reached an end state.
STOPPED = 0.01


@dataclass(frozen=True)
class InterfaceOutcome:
    """Outcome of a wear run for one contact.

    ``unworn`` are its loads before wear and ``first`` the contact of that cycle. ``state`` has its
    surfaces at the end, and ``reported`` returns a cycle on them. ``kinetics`` ``(j, 5)`` are those
    at ``cycles`` ``(j,)``. ``finer`` returns both cycles in twice as many increments, or None where
    the loads between increments are unknown.
    """

    stage: FaceContact
    unworn: FaceLoads
    first: FirstContact
    state: FaceState
    reported: Callable[[], ContactEnd]
    cycles: Array
    kinetics: Array
    finer: Callable[[Any], list[CycleTractions] | None] = lambda _: None

    @cached_property
    def regimes(self) -> dict[str, LinearRegime | None]:
        """Linear regimes of depth and volume, sums of both bodies."""
        columns = {"depth": self.kinetics[:, :2], "volume": self.kinetics[:, 2:4]}
        return {
            name: linear_regime(self.cycles, values.sum(axis=1)) for name, values in columns.items()
        }

    @property
    def stopped(self) -> float | None:
        """Cycles after which wear has stopped; None if it goes on, or nothing has worn.

        From then on, depth and volume of both bodies are within :data:`STOPPED` of their final
        values, for at least half of all cycles.
        """
        worn = self.kinetics[:, :4]
        still = np.flatnonzero((worn < (1.0 - STOPPED) * worn[-1]).any(axis=1))
        if not still.size:
            return None
        cycles = float(self.cycles[still[-1] + 1])
        return cycles if cycles <= 0.5 * self.cycles[-1] else None

    @cached_property
    def carried(self) -> dict[str, LoadHistory]:
        """Loads, unworn and worn, with the forces of the pressure where imposed motions press."""
        starts, worn = self.state.starts, np.zeros_like(self.first.pressure)
        for t, start in starts.items():
            worn[t] = start.pressure  # of the last wear step
        still = [t for t in np.flatnonzero(self.state.loads.P > 0.0) if t not in starts]
        if still and self.stage.settings.drive.presses:
            worn[still] = self.end.pressure[still]  # where nothing has worn
        drive, grid = self.stage.settings.drive, self.stage.grid
        return {
            "unworn": drive.carried(grid, self.unworn.loads, self.first.pressure),
            "worn": drive.carried(grid, self.state.loads, worn),
        }

    @property
    def worn_area(self) -> float:
        """Worn area at the end [mm²]."""
        worn = self.stage.on_grid(self.state).depth > 0.0
        return np.count_nonzero(worn) * self.stage.grid.cell_area

    @property
    def slip_per_cycle(self) -> float:
        """Largest slip path [mm] in an unworn cycle; the half-space's if loads have no slip."""
        slip = self.unworn.slip
        if self.first.cycle and not slip.any():
            slip = np.stack([state.slip for state in self.first.cycle])
        path = np.hypot(slip[:, 0], slip[:, 1])
        return float(np.tensordot(self.unworn.loads.share, path, 1).max())

    @cached_property
    def step_error(self) -> dict[str, float] | None:
        """Relative error of depth, volume and pressure due to wear steps; None if it is unknown.

        That of the pressure is the change of its peak due to steps of twice the length
        (:func:`peak_change`), divided by 2^p - 1 with p = :data:`AT_EDGES`. Implicit steps over
        increments in turn have errors of first order, so that their change is not divided.
        """
        left = step_errors(self.state, self.stage.contact.areas)
        other = self.ended.pressure_of_coarse_run
        if left is None or other is None:
            return None
        change = peak_change(self.end.pressure, other, at_rest=not len(self.state.paths))
        share = 1.0 if self.state.order == 1.0 else 1.0 / (2.0**AT_EDGES - 1.0)
        return left | {"pressure": share * change}

    @cached_property
    def increments_error(self) -> dict[str, float] | None:
        """Error of depth and energy due to increments, over the first and the last cycle together.

        It is measured with twice as many increments if the loads between increments, friction
        included, are known, and estimated otherwise; None if it is unknown.
        """
        cycles = [self.begin, self.end]
        try:
            finer = self.finer(self.state)
        except ContactFailure:
            return None
        return increments_error(cycles) if finer is None else increments_change(cycles, finer)

    @cached_property
    def border_error(self) -> dict[str, float] | None:
        """Relative error of depth and volume due to the border of the stick zone.

        It exists for a half-space with its own friction solution; None if it is unknown.
        """
        state, cycles = self.state, float(self.cycles[-1])
        assert isinstance(state, InterfaceState)
        contact = self.stage.contact.wearing(state)
        try:
            return border_errors(contact, state, (self.begin, self.end), cycles)
        except ContactFailure:
            return None

    @cached_property
    def begin(self) -> CycleTractions:
        """Tractions of the unworn cycle."""
        return self.stage.contact.unworn_tractions(self.unworn, self.first)

    @cached_property
    def end(self) -> CycleTractions:
        """Tractions of a cycle at the end."""
        return self.ended.tractions

    @cached_property
    def ended(self) -> ContactEnd:
        """Cycle at the end; reading it waits for the result."""
        return self.reported()


def peak_change(pressure: Array, other: Array, at_rest: bool) -> float:
    """Return how far the peak of ``pressure`` ``(t, nx, ny)`` differs in ``other``, relative.

    In the increment of the peak, the :data:`HIGHEST` share of the pressed cells of both fields are
    compared, sorted by size: the peaks alone may be equal by chance, and a rim that only one
    contact has reached is no change of the peak. For surfaces ``at_rest``, the change at the place
    of the peak counts as well.
    """
    peak, place = float(pressure.max()), int(pressure.argmax())
    if peak <= 0.0:
        return 0.0
    increment = np.unravel_index(place, pressure.shape)[0]
    highest, others = (np.sort(field[increment], axis=None)[::-1] for field in (pressure, other))
    count = int(np.ceil(HIGHEST * np.count_nonzero(highest)))
    change = float(np.abs(highest - others)[:count].max())
    return max(change, abs(peak - float(other.flat[place])) if at_rest else 0.0) / peak
