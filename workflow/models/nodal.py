"""Wear at the nodes of a structure's contact faces, by finite elements without a half-space.

Every wear cycle solves one cycle of the structure on the present surfaces. Half of the slip before
and half of the slip after a solved state count at its pressure
(:mod:`sa_solver.cycles.increments`). Written fields lie on the contact grid, as with a half-space:
cell means of the nodal fields.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_models.meshes.cut_face import whole_values
from fe_models.structure import CycleSolution, InterfaceHistory
from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceState
from wear.contact.link import StructureLink
from wear.contact.nodes import NodalContact, NodalState
from wear.contact.tractions import ContactFields, CycleTractions, acting_slip
from wear.steps.marching import advance_cycles
from wear.steps.stabilised import StabilisedStepper
from wear.steps.steppers import first_cycles
from wear.surfaces import Surfaces
from wear.worn import Cost
from workflow.models.contact import Contact, ContactOf, FaceContact, Wear
from workflow.models.contacts import FaceContacts
from workflow.models.loads import ContactFace
from workflow.models.structure import StructureLoads

# Number of stored cycles: before and after a jump, of the run and of its coarse companion.
KEPT = 4


@dataclass(frozen=True)
class StructureCycle:
    """A closed cycle at the nodes of all interfaces.

    It is a :class:`wear.contact.nodes.NodalCycle`. ``stiffness`` [MPa/mm] bounds the change of
    nodal pressure per change of gap.
    """

    histories: Sequence[InterfaceHistory]
    friction: Array
    areas: Array
    stiffness: float
    start: None = None

    @cached_property
    def slip(self) -> Array:
        """Half of the slip before and half of that after each solved state ``(t, n)`` [mm]."""
        return np.concatenate([acting_slip(h.slip, h.loads) for h in self.histories], axis=1)

    @cached_property
    def pressure(self) -> Array:
        """Pressure at the end of each increment ``(t, n)`` [MPa]."""
        force = np.concatenate([h.force[:, 2] for h in self.histories], axis=1)
        return np.divide(force, self.areas, out=np.zeros_like(force), where=self.areas > 0.0)

    def stable_cycles(self, depth_per_pressure: Array) -> float:
        """Return the stable step 2 / (k w): k bounds the stiffness, w is the largest wear."""
        fastest = self.stiffness * float(depth_per_pressure.max())
        return 2.0 / fastest if fastest > 0.0 else np.inf


class NodalFace(FaceContact):
    """One contact face that wears at its nodes, with surfaces of shape ``(n,)`` in its states.

    ``start`` of a state is the worn depth at the nodes of all faces; it identifies their cycle.
    """

    def __init__(
        self, face: ContactFace, contact: Contact, wear: Wear, cycles: _Cycles, number: int
    ) -> None:
        super().__init__(face, contact, wear)
        self._cycles, self._number = cycles, number

    def history(self, state: InterfaceState) -> InterfaceHistory:
        """Return the cycle of the face on the surfaces of a state."""
        assert isinstance(state.start, np.ndarray)
        return self._cycles.on_faces(self._cycles.at(state.start))[self._number]

    # -- surfaces --------------------------------------------------------------------------------
    def on_grid(self, state: InterfaceState) -> Surfaces:
        worn = state.surfaces
        fields = (worn.depth_1, worn.depth_2, worn.work_1, worn.work_2)
        return Surfaces(self.settings.gap, *map(self.transfer.to_cells, fields))

    @property
    def areas(self) -> Array:
        return self.face.nodal_areas

    def volume(self, depth: Array) -> float:
        return float(depth @ self.areas)

    def nodal_depth(self, state: InterfaceState) -> Array:
        return state.surfaces.depth

    def depths_of_bodies(self, state: InterfaceState) -> tuple[Array, Array]:
        depth_1, depth_2 = state.surfaces.depths
        if (to_1 := self.transfer_of(1)) is not self.transfer:
            depth_1 = to_1.to_nodes(self.transfer.to_cells(depth_1))
        return depth_1, depth_2

    # -- tractions -------------------------------------------------------------------------------
    def fields(self, state: InterfaceState, increment: int) -> ContactFields:
        tractions = self.tractions(state)
        pressure, shear, slip = tractions.pressure, tractions.shear, tractions.slip
        return ContactFields(pressure[increment], shear[increment], slip[increment])

    def tractions(self, state: InterfaceState) -> CycleTractions:
        return _on_cells(self, self.history(state))

    def unworn_tractions(self, history: FaceLoads, first: FirstContact) -> CycleTractions:
        assert isinstance(history, InterfaceHistory)
        return _on_cells(self, history)


class _Cycles:
    """Cycles of the structure on worn surfaces, each determined by the worn depth alone."""

    def __init__(self, source: StructureLoads, faces: Sequence[ContactFace]) -> None:
        self._source, self.on_faces = source, source.on_faces
        self._ends = np.cumsum([len(contact.face) for contact in faces])[:-1]
        self._solved: deque[tuple[Array, CycleSolution]] = deque(maxlen=KEPT)

    def split(self, nodal: Array) -> list[Array]:
        """Return nodal fields ``(..., n)`` split by interface."""
        return np.split(nodal, self._ends, axis=-1)

    def at(self, depth: Array) -> CycleSolution:
        """Return the cycle on surfaces with the worn ``depth`` ``(n,)`` of both bodies [mm]."""
        if not depth.any():
            return self._source.unworn_cycle
        for known, solution in self._solved:
            if np.array_equal(known, depth):
                return solution
        solution = self._source.worn_cycle(self.split(depth))
        self._solved.append((depth, solution))
        return solution

    def near(self, depth: Array, other: CycleSolution) -> CycleSolution:
        """Return the cycle of :meth:`at`, started from ``other`` on similar surfaces: faster."""
        return self._source.worn_cycle(self.split(depth), after=other)


class NodalContacts(FaceContacts):
    """All faces of a structure, which wear at their nodes and advance together."""

    def __init__(
        self,
        faces: Sequence[ContactFace],
        contact: ContactOf,
        wear: Wear,
        source: StructureLoads,
    ) -> None:
        self._cycles = _Cycles(source, faces)
        super().__init__(
            [
                NodalFace(face, contact(face.face.name), wear, self._cycles, number)
                for number, face in enumerate(faces)
            ]
        )
        self._laws = self.stages[0].settings.laws
        self._friction = np.concatenate(
            [np.full(len(stage.face), stage.settings.friction(0.0)) for stage in self.stages]
        )
        meshed = source.mesh.interfaces
        self._gap = np.concatenate([whole_values(face, face.gap) for face in meshed])
        self._areas = np.concatenate([stage.face.nodal_areas for stage in self.stages])
        self._stiffness = source.stiffest(np.concatenate([face.nodal_areas for face in meshed]))
        self._stepper = StabilisedStepper(wear.error_control())

    def begin(
        self, histories: Sequence[FaceLoads], cycles: float
    ) -> list[tuple[InterfaceState, FirstContact]]:
        state = NodalState.unworn(self._gap)
        solution = self._cycles.at(state.surfaces.depth)
        contact = self._contact(solution)
        state = replace(state, next_cycles=first_cycles(contact, state, cycles))
        begun = self._of_interfaces(state, contact.rates(state), solution)
        firsts = self._first_contacts(solution, contact.stable_cycles(state))
        return list(zip(begun, firsts, strict=True))

    def jump(
        self, states: Sequence[InterfaceState], cycles: float, left: float
    ) -> list[tuple[InterfaceState, Cost]]:
        state = self._together(states)
        begun = self._cycles.at(state.surfaces.depth)

        def contact_at(worn: NodalState) -> NodalContact:
            depth = worn.surfaces.depth
            alike = np.array_equal(depth, state.surfaces.depth)
            return self._contact(begun if alike else self._cycles.near(depth, begun))

        result = advance_cycles(self._stepper, state, cycles, left, contact_at)
        cost = result.cost
        cost = replace(cost, contact_solves=cost.contact_solves * len(begun.states))
        lost = _fields(result.state.surfaces) - _fields(state.surfaces)
        after = self._cycles.at(result.state.surfaces.depth)
        worn = self._of_interfaces(result.state, lost / cycles, after)
        # All faces wear together, so the cost counts once.
        return [(face, Cost() if number else cost) for number, face in enumerate(worn)]

    def _contact(self, solution: CycleSolution) -> NodalContact:
        histories = self._cycles.on_faces(solution)
        cycle = StructureCycle(histories, self._friction, self._areas, self._stiffness)
        return NodalContact(self._laws, (cycle,))

    # -- states of all nodes and of single interfaces ----------------------------------------------
    def _together(self, states: Sequence[InterfaceState]) -> NodalState:
        """Return the state of all nodes, with its coarse companion if every face has one."""
        fields = np.concatenate([_fields(state.surfaces) for state in states], axis=-1)
        probe_cases = [state.coarse for state in states if state.coarse is not None]
        first = states[0]
        return NodalState(
            surfaces=Surfaces.unworn(self._gap).worn(*fields[[0, 1, 2, 2]]),
            energy=sum(state.energy for state in states),
            depth_rate=max(state.depth_rate for state in states),
            volume_rate=sum(state.volume_rate for state in states),
            next_cycles=first.next_cycles,
            coarse=self._together(probe_cases) if probe_cases else None,
            order=first.order,
        )

    def _of_interfaces(
        self, state: NodalState, rates: Array, solution: CycleSolution
    ) -> tuple[InterfaceState, ...]:
        """Return the states of the faces; ``rates`` ``(3, n)`` are their losses per cycle.

        ``solution`` is their cycle. The companion gets the same cycle, because its loads are not
        used.
        """
        split, depth = self._cycles.split, state.surfaces.depth
        coarse: Sequence[InterfaceState | None] = [None] * len(self.stages)
        if state.coarse is not None:
            coarse = self._of_interfaces(state.coarse, rates, solution)
        histories = self._cycles.on_faces(solution)
        parts = map(split, (self._gap, _fields(state.surfaces), rates, self._areas))
        faces = []
        for gap, worn, rate, areas, history, coarse_run in zip(
            *parts, histories, coarse, strict=True
        ):
            faces.append(
                InterfaceState(
                    surfaces=Surfaces.unworn(gap).worn(*worn[[0, 1, 2, 2]]),
                    energy=float(worn[2] @ areas),
                    depth_rate=float(rate[:2].max()),
                    volume_rate=float(rate[:2].sum(axis=0) @ areas),
                    next_cycles=state.next_cycles,
                    coarse=coarse_run,
                    order=state.order,
                    start=depth,
                    loads=history.loads,
                    slip=history.slip,
                    link=StructureLink.none(),
                    pressed=np.empty(0),
                    paths=np.empty((0, 3, 2)),
                )
            )
        return tuple(faces)

    def _first_contacts(self, solution: CycleSolution, stable: float) -> list[FirstContact]:
        firsts = []
        columns = zip(self.stages, self._cycles.on_faces(solution), strict=True)
        for number, (stage, history) in enumerate(columns):
            firsts.append(
                FirstContact(
                    energy=history.loads.Edx + history.loads.Edy,
                    pressure=_on_cells(stage, history).pressure,
                    touches_border=False,  # there the body itself ends
                    largest_residual=solution.residual,
                    cost=Cost() if number else Cost(len(history.slip)),
                    stable_cycles=stable,
                    link=StructureLink.none(),
                    cycle=(),
                )
            )
        return firsts


def _fields(surfaces: Surfaces) -> Array:
    """Return the depths of both bodies and the energy per area, common to both ``(3, n)``."""
    return np.stack([surfaces.depth_1, surfaces.depth_2, surfaces.work_2])


def _on_cells(stage: FaceContact, history: InterfaceHistory) -> CycleTractions:
    """Return the cycle of a face on the cells of its grid."""
    areas, force = history.interface.nodal_areas, history.force
    traction = np.divide(force, areas, out=np.zeros_like(force), where=areas > 0.0)
    on_cells, slip = map(stage.transfer.to_cells, (traction, history.slip))
    unknown, friction = np.zeros(len(slip)), stage.settings.friction(0.0)
    return CycleTractions(history.loads, friction, on_cells[:, 2], on_cells[:, :2], slip, unknown)
