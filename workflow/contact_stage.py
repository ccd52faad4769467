"""The contact stage of one interface: its grid, its loads and slips, its wear."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_models.mesh import Interface
from fe_models.transfer import FaceTransfer
from sa_solver.contact import ContactState, FrictionalContact
from sa_solver.half_space import HalfSpace
from sa_solver.normal import NormalContact, NormalStart
from sa_solver.types import Array, ElasticPair, Grid, LoadHistory
from wear.full_cycle import full_cycle
from wear.laws import Archard, Energy, EnergyAmplitude, WearLaw
from wear.stepping import CycleResult, Starts, WearingContact
from wear.surfaces import Surfaces
from workflow.case import WearCase
from workflow.case.wear_sections import ArchardBody, ContactStress, EnergyAmplitudeLaw
from workflow.errors import UserError
from workflow.load_source import ContactFace, FaceLoads


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
    """What a contact stage is made from."""

    case: WearCase
    contact: ContactFace


@dataclass(frozen=True)
class CycleTractions:
    """Tractions and slip of one contact over the increments of a closed cycle.

    ``pressure`` ``(t, nx, ny)`` and ``shear`` ``(t, 2, nx, ny)`` on body 2 [MPa] are those at the
    end of an increment, ``slip`` ``(t, 2, nx, ny)`` [mm] that during it. Where slip is the
    structure's (method normal), shear is µp against it and, unknown where nothing slips, 0 there:
    ``unknown`` ``(t,)`` is the share of the normal force on such cells.
    """

    pressure: Array
    shear: Array
    slip: Array
    unknown: Array


@dataclass(frozen=True)
class FirstContact:
    """What the contact of the unworn cycle says: see :class:`wear.stepping.CycleResult`.

    ``energy`` ``(t,)`` [N mm]; ``pressure`` ``(t, nx, ny)`` [MPa]; ``cycle`` the states at its
    increments where the half-space has its own friction (method full), else empty.
    """

    energy: Array
    pressure: Array
    touches_border: bool
    largest_residual: float
    convolutions: int
    cycle: tuple[ContactState, ...]

    @property
    def highest_pressure(self) -> float:
        """Largest pressure of all increments [MPa]."""
        return float(self.pressure.max())


@dataclass(frozen=True)
class Wearing:
    """A contact that wears, and the cycle its slips come from (empty: from the structure)."""

    contact: WearingContact
    cycle: tuple[ContactState, ...]


class ContactStage:
    """One interface on its grid."""

    def __init__(self, settings: StageSettings) -> None:
        self._case = case = settings.case
        self._contact_face = settings.contact
        self.face = settings.contact.face
        self.grid = settings.contact.grid(case.contact.grid)
        self.transfer = FaceTransfer.between(self.face, self.grid)
        self.pair = ElasticPair(case.material(1), case.material(2))
        half_space = HalfSpace(self.grid, self.pair)
        self._frictional: FrictionalContact | None = None
        if case.contact.method == "full":
            self._frictional = FrictionalContact(
                half_space,
                case.friction.coefficient,
                case.contact.tolerance,
                case.contact.gross_slip,
            )
        own = self._frictional
        self._contact = NormalContact(half_space) if own is None else own.normal
        self._laws = _law(case, 1), _law(case, 2)
        _check_section(case.stress, self.grid)
        self._current: tuple[tuple[Array, ...], Wearing] | None = None

    @property
    def name(self) -> str:
        return self.face.name

    @property
    def remedy(self) -> str:
        """What to do where the contact reaches the border of the grid."""
        return self._contact_face.remedy

    @property
    def coarse_grid(self) -> Grid:
        """A grid with as many cells as the face has nodes."""
        return self._contact_face.grid(self._contact_face.coarse)

    def _gap(self, grid: Grid) -> Array:
        gap = self._contact_face.gap(grid.x, grid.y)
        return np.ascontiguousarray(np.broadcast_to(gap, grid.shape))

    def begin(self, history: FaceLoads) -> tuple[InterfaceState, FirstContact]:
        """The unworn state, and the contact at every loaded increment of the first cycle."""
        surfaces = Surfaces.unworn(self._gap(self.grid))
        state = InterfaceState(surfaces, history.loads, history.slip, 0.0, 0.0, 0.0, {})
        loaded = np.flatnonzero(history.loads.P > 0.0).tolist()
        wearing = self._wearing(state)
        result = wearing.contact.cycle(surfaces, {}, loaded)
        states = result.states.values()
        first = FirstContact(
            energy=result.energy,
            pressure=self._pressure(result),
            touches_border=any(s.touches_border for s in states),
            largest_residual=max((s.residuals.largest for s in states), default=0.0),
            convolutions=result.convolutions + sum(s.convolutions for s in wearing.cycle),
            cycle=wearing.cycle,
        )
        return self._after(state, surfaces, result, 0.0), first

    def _pressure(self, result: CycleResult) -> Array:
        """Pressure of every increment of a cycle ``(t, nx, ny)``."""
        pressure = np.zeros((len(result.energy), *self.grid.shape))
        for t, state in result.states.items():
            pressure[t] = state.pressure
        return pressure

    def jump(self, state: InterfaceState, cycles: float) -> tuple[InterfaceState, int]:
        """Wear ``cycles`` cycles in one step; also the convolutions it took."""
        wearing = self._wearing(state).contact
        implicit = self._case.wear.step.kind == "implicit"
        step = wearing.implicit_step if implicit else wearing.explicit_step
        surfaces, result = step(state.surfaces, state.starts, cycles)
        after = self._after(state, surfaces, result, cycles)
        # Friction of the half-space on the new surfaces: for the record now, to wear by next.
        following = self._wearing(after).cycle
        spent = result.convolutions + sum(own.convolutions for own in following)
        return after, spent

    def stable_cycles(self, state: InterfaceState) -> float:
        """Largest stable explicit jump."""
        return self._wearing(state).contact.stable_cycles()

    def peak_fields(self, state: InterfaceState, peak: int) -> dict[str, Array]:
        """Pressure, shear and slip at peak load on the present surfaces, for the record."""
        wearing = self._wearing(state)
        if wearing.cycle:
            own = wearing.cycle[peak]
            return {"pressure": own.pressure, "shear": own.shear, "slip": own.slip}
        slip = self.transfer.to_cells(state.slip[peak])
        pressure = wearing.contact.solve(state.surfaces, peak, state.starts.get(peak)).pressure
        return {"pressure": pressure, "shear": self._sliding_shear(pressure, slip), "slip": slip}

    def unworn_tractions(self, history: FaceLoads, first: FirstContact) -> CycleTractions:
        """Tractions of the first cycle, solved already."""
        if first.cycle:
            return _own_tractions(first.cycle)
        return self._structures_tractions(history.slip, first.pressure)

    def tractions(self, state: InterfaceState) -> CycleTractions:
        """Tractions of a cycle on the present surfaces."""
        wearing = self._wearing(state)
        if wearing.cycle:
            return _own_tractions(wearing.cycle)
        loaded = np.flatnonzero(state.loads.P > 0.0).tolist()
        result = wearing.contact.cycle(state.surfaces, state.starts, loaded)
        return self._structures_tractions(state.slip, self._pressure(result))

    def _structures_tractions(self, nodal_slip: Array, pressure: Array) -> CycleTractions:
        """Those where slip is the structure's."""
        slip = self.transfer.to_cells(nodal_slip)
        stuck = ~slip.any(axis=1)
        force = pressure.sum(axis=(1, 2))
        held = np.where(stuck, pressure, 0.0).sum(axis=(1, 2))
        unknown = np.divide(held, force, out=np.zeros_like(force), where=force > 0.0)
        shear = np.stack([self._sliding_shear(p, s) for p, s in zip(pressure, slip, strict=True)])
        return CycleTractions(pressure, shear, slip, unknown)

    def _sliding_shear(self, pressure: Array, slip: Array) -> Array:
        """µp against ``slip`` ``(2, nx, ny)``; 0 where nothing slips."""
        size = np.hypot(*slip)
        opposing = np.divide(-slip, size, out=np.zeros_like(slip), where=size > 0.0)
        shear: Array = self._case.friction.coefficient * pressure * opposing
        return shear

    def coarse_pressure(self, loads: LoadHistory, peak: int) -> Array:
        """Unworn peak pressure on a grid as coarse as the mesh of the structure."""
        grid = self.coarse_grid
        at_peak = (float(column[peak]) for column in (loads.P, loads.Mx, loads.My))
        contact = NormalContact(HalfSpace(grid, self.pair))
        return contact.solve(self._gap(grid), *at_peak).pressure

    def nodal_depth(self, state: InterfaceState) -> Array:
        """Worn depth of both bodies together at the nodes of the face, volume kept."""
        return self.transfer.to_nodes(state.surfaces.depth_1 + state.surfaces.depth_2)

    def depths_of_bodies(self, state: InterfaceState) -> tuple[Array, Array]:
        """Worn depths of body 1 and body 2 at the nodes of their own faces, volumes kept."""
        face_1 = self.face.face(1) if isinstance(self.face, Interface) else self.face
        own = self.transfer if face_1 is self.face else FaceTransfer.between(face_1, self.grid)
        surfaces = state.surfaces
        return own.to_nodes(surfaces.depth_1), self.transfer.to_nodes(surfaces.depth_2)

    def _wearing(self, state: InterfaceState) -> Wearing:
        """The contact under the state's loads and slips, kept until these change.

        Slips of the structure change with its solution, those of the half-space with wear.
        """
        key: tuple[Array, ...] = np.array([*vars(state.loads).values()], dtype=float), state.slip
        if self._frictional is not None:
            key = *key, state.surfaces.gap
        if self._current is not None and all(map(np.array_equal, self._current[0], key)):
            return self._current[1]
        cycle: tuple[ContactState, ...] = ()
        slip, uplift = self.transfer.to_cells(state.slip), None
        if self._frictional is not None:
            cycle = tuple(full_cycle(self._frictional, state.surfaces.gap, state.loads))
            slip = np.stack([own.slip for own in cycle])
            uplift = self._uplift(cycle)
        contact = WearingContact(
            self._contact,
            self._laws,
            self._case.friction.coefficient,
            state.loads,
            np.hypot(slip[:, 0], slip[:, 1]),
            self._case.contact.tolerance,
            uplift,
        )
        self._current = key, Wearing(contact, cycle)
        return self._current[1]

    def _uplift(self, cycle: tuple[ContactState, ...]) -> Array | None:
        """Normal displacement under the shear of each increment; None for similar bodies."""
        if self.pair.similar:
            return None
        half_space = self._contact.half_space
        return np.stack([half_space.normal_under_shear(own.shear) for own in cycle])

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


def _check_section(stress: ContactStress, grid: Grid) -> None:
    """Refuse at once a section that could not be drawn at the end."""
    if stress.section == "none":
        return
    if stress.section == "y" and grid.line:
        raise UserError("stress.section: y: a line contact has no length along y; allowed: x, none")
    reach = 0.5 * grid.size[1 if stress.section == "x" else 0]
    if abs(stress.at) > reach:
        raise UserError(
            f"stress.at: {stress.at:g} mm is off the contact's grid; "
            f"allowed: {-reach:.4g} to {reach:.4g} mm"
        )


def _own_tractions(cycle: tuple[ContactState, ...]) -> CycleTractions:
    """Tractions where the half-space has its own friction: known everywhere."""
    pressure, shear, slip = (
        np.stack([getattr(own, name) for own in cycle]) for name in ("pressure", "shear", "slip")
    )
    return CycleTractions(pressure, shear, slip, np.zeros(len(cycle)))


def _law(case: WearCase, body: int) -> WearLaw:
    own = case.wear_of(body)
    if isinstance(own, ArchardBody):
        return Archard(own.coefficient, own.hardness)
    if isinstance(case.wear, EnergyAmplitudeLaw):
        return EnergyAmplitude(own.coefficient, case.wear.reference_amplitude)
    return Energy(own.coefficient)
