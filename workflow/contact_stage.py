"""The contact stage of one interface: its grid, its loads and slips, its wear."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.mesh import Interface
from fe_models.structure import InterfaceHistory
from fe_models.transfer import FaceTransfer
from sa_solver.normal import NormalContact, NormalStart
from sa_solver.types import Array, Grid, LoadHistory, contact_modulus
from wear.laws import Archard, Energy, EnergyAmplitude, WearLaw
from wear.stepping import CycleResult, Starts, WearingContact
from wear.surfaces import Surfaces
from workflow.case import Case


@dataclass(frozen=True)
class InterfaceState:
    """What an interface must remember between two jumps.

    ``loads`` and nodal ``slip`` ``(t, 2, n)`` are those of the last structural solution, ``energy``
    [N mm] is dissipated so far, ``depth_rate`` [mm] and ``volume_rate`` [mm³] are per cycle,
    ``starts`` the solver's, by increment.
    """

    surfaces: Surfaces
    loads: LoadHistory
    slip: Array
    energy: float
    depth_rate: float
    volume_rate: float
    starts: Starts


@dataclass(frozen=True)
class StageSettings:
    """What a contact stage is made from.

    ``size`` of the face (mm, mm) and ``gap`` the unworn gap [mm] at x and y of the face.
    """

    case: Case
    interface: Interface
    size: tuple[float, float]
    gap: Callable[[Array, Array], Array]


@dataclass(frozen=True)
class FirstContact:
    """What the contact of the unworn cycle says: see :class:`wear.stepping.CycleResult`.

    ``energy`` ``(t,)`` [N mm]; ``highest_pressure`` [MPa] of all increments.
    """

    energy: Array
    highest_pressure: float
    touches_border: bool
    largest_residual: float
    convolutions: int


class ContactStage:
    """One interface on its grid."""

    def __init__(self, settings: StageSettings) -> None:
        self._case = case = settings.case
        self._gap = settings.gap
        self.interface = settings.interface
        self.grid = Grid.covering(settings.size, case.contact.grid)
        self.transfer = FaceTransfer.between(settings.interface, self.grid)
        blade, disk = case.materials.blade.elastic(), case.materials.disk.elastic()
        self.modulus = contact_modulus(disk, blade)
        self._contact = NormalContact(self.grid, self.modulus)
        self._laws = _law(case, "disk"), _law(case, "blade")
        self._current: tuple[tuple[Array, Array], WearingContact] | None = None

    @property
    def name(self) -> str:
        return self.interface.name

    def begin(self, history: InterfaceHistory) -> tuple[InterfaceState, FirstContact]:
        """The unworn state, and the contact at every loaded increment of the first cycle."""
        surfaces = Surfaces.unworn(self._gap(self.grid.x, self.grid.y))
        state = InterfaceState(surfaces, history.loads, history.slip, 0.0, 0.0, 0.0, {})
        loaded = np.flatnonzero(history.loads.P > 0.0).tolist()
        result = self._wearing(state).cycle(surfaces, {}, loaded)
        states = result.states.values()
        first = FirstContact(
            energy=result.energy,
            highest_pressure=max((float(s.pressure.max()) for s in states), default=0.0),
            touches_border=any(s.touches_border for s in states),
            largest_residual=max((s.residuals.largest for s in states), default=0.0),
            convolutions=result.convolutions,
        )
        return self._after(state, surfaces, result, 0.0), first

    def jump(self, state: InterfaceState, cycles: float) -> tuple[InterfaceState, int]:
        """Wear ``cycles`` cycles in one step; also the convolutions it took."""
        wearing = self._wearing(state)
        implicit = self._case.wear.step.kind == "implicit"
        step = wearing.implicit_step if implicit else wearing.explicit_step
        surfaces, result = step(state.surfaces, state.starts, cycles)
        return self._after(state, surfaces, result, cycles), result.convolutions

    def stable_cycles(self, state: InterfaceState) -> float:
        """Largest stable explicit jump."""
        return self._wearing(state).stable_cycles()

    def peak_fields(self, state: InterfaceState, peak: int) -> dict[str, Array]:
        """Pressure, shear and slip at peak load on the present surfaces, for the record."""
        slip = self.transfer.to_cells(state.slip[peak])
        size = np.hypot(*slip)
        opposing = np.divide(-slip, size, out=np.zeros_like(slip), where=size > 0.0)
        wearing = self._wearing(state)
        pressure = wearing.solve(state.surfaces, peak, state.starts.get(peak)).pressure
        shear = self._case.friction.coefficient * pressure * opposing
        return {"pressure": pressure, "shear": shear, "slip": slip}

    def coarse_pressure(self, loads: LoadHistory, peak: int) -> Array:
        """Unworn peak pressure on a grid as coarse as the mesh of the structure."""
        grid = self.coarse_grid
        at_peak = (float(column[peak]) for column in (loads.P, loads.Mx, loads.My))
        return NormalContact(grid, self.modulus).solve(self._gap(grid.x, grid.y), *at_peak).pressure

    @property
    def coarse_grid(self) -> Grid:
        """A grid with as many cells as the flank has nodes."""
        return Grid.covering(self.grid.size, self._case.mesh.flank_nodes)

    def nodal_depths(self, state: InterfaceState) -> tuple[Array, Array]:
        """Worn depths of body 1 and body 2 at the nodes of the face, volumes kept."""
        surfaces = state.surfaces
        return self.transfer.to_nodes(surfaces.depth_1), self.transfer.to_nodes(surfaces.depth_2)

    def _wearing(self, state: InterfaceState) -> WearingContact:
        """The contact under the state's loads and slips, kept until a structural solution."""
        key = np.array([*vars(state.loads).values()], dtype=float), state.slip
        if self._current is not None and all(map(np.array_equal, self._current[0], key)):
            return self._current[1]
        wearing = WearingContact(
            self._contact,
            self._laws,
            self._case.friction.coefficient,
            state.loads,
            np.hypot(*np.moveaxis(self.transfer.to_cells(state.slip), 1, 0)),
            self._case.contact.tolerance,
        )
        self._current = key, wearing
        return wearing

    def _after(
        self, state: InterfaceState, surfaces: Surfaces, result: CycleResult, cycles: float
    ) -> InterfaceState:
        depth_rate, volume_rate = result.per_cycle(self.grid.cell_area)
        starts: dict[int, NormalStart] = {t: s.start for t, s in result.states.items()}
        return replace(
            state,
            surfaces=surfaces,
            energy=state.energy + float(result.energy.sum()) * cycles,
            depth_rate=depth_rate,
            volume_rate=volume_rate,
            starts=state.starts | starts,
        )


def _law(case: Case, body: str) -> WearLaw:
    own = getattr(case.wear, body)
    if case.wear.law == "archard":
        return Archard(own.coefficient, own.hardness)
    if case.wear.law == "energy_amplitude":
        return EnergyAmplitude(own.coefficient, case.wear.reference_amplitude)
    return Energy(own.coefficient)
