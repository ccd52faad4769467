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
from functools import cached_property, partial

import numpy as np

from fe_models.meshes.cut_face import whole_values
from fe_models.structure import CycleSolution, InterfaceHistory
from sa_solver.errors import InputError
from sa_solver.types import Array
from wear.contact.contacts import call_in_turn, kinetics_of
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact
from wear.contact.link import StructureLink
from wear.contact.nodes import NodalContact, NodalFaceState, NodalState
from wear.contact.settings import InterfaceSettings
from wear.contact.tractions import ContactFields, CycleTractions, acting_slip
from wear.steps.marching import advance_cycles
from wear.steps.stabilised import StabilisedStepper
from wear.steps.steppers import first_cycles
from wear.surfaces import Surfaces
from wear.worn import Cost
from workflow.models.contact import ContactOf, FaceContact, Wear
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


@dataclass(frozen=True)
class NodalFace:
    """One face of a structure whose nodes wear.

    It is a :class:`workflow.models.contact.FaceSolution`.

    Parameters
    ----------
    cycles, number
        Cycles of the structure, and the place of the face among all of them.
    areas
        Areas of the nodes of the face ``(n,)`` [mm²].
    settings
        Settings of the contact.
    """

    cycles: _Cycles
    number: int
    areas: Array
    settings: InterfaceSettings

    @property
    def name(self) -> str:
        return self.settings.name

    def view(self, nodes: NodalState) -> NodalFaceState:
        """Return the part of a state of all nodes that belongs to this face."""
        depth = nodes.surfaces.depth
        fields = vars(nodes.surfaces).values()
        surfaces = Surfaces(*(self.cycles.split(field)[self.number] for field in fields))
        return NodalFaceState(
            surfaces=surfaces,
            energy=float(surfaces.work_2 @ self.areas),
            depth_rate=nodes.depth_rate,
            volume_rate=nodes.volume_rate,
            next_cycles=nodes.next_cycles,
            coarse=None if nodes.coarse is None else self.view(nodes.coarse),
            order=nodes.order,
            cycle=lambda: self.cycles.on_faces(self.cycles.at(depth))[self.number],
        )

    def volume(self, depth: Array) -> float:
        """Return the volume of a worn ``depth`` ``(n,)`` [mm³]."""
        return float(depth @ self.areas)

    def on_cells(self, field: Array) -> Array:
        return self.settings.transfer.to_cells(field)

    def at_nodes(self, field: Array) -> Array:
        return field

    def fields(self, state: NodalFaceState, increment: int) -> ContactFields:
        tractions = self.tractions(state)
        pressure, shear, slip = tractions.pressure, tractions.shear, tractions.slip
        return ContactFields(pressure[increment], shear[increment], slip[increment])

    def tractions(self, state: NodalFaceState) -> CycleTractions:
        return self._tractions(state.cycle())

    def unworn_tractions(self, history: FaceLoads, first: FirstContact) -> CycleTractions:
        return self._tractions(history)

    def first(self, history: FaceLoads, solution: CycleSolution, stable: float) -> FirstContact:
        """Return the result of the first cycle of this face, part of a ``solution`` for all."""
        return FirstContact(
            energy=history.loads.Edx + history.loads.Edy,
            pressure=self._tractions(history).pressure,
            touches_border=False,  # there the body itself ends
            largest_residual=solution.residual,
            # All faces are solved together, so the cost counts once.
            cost=Cost() if self.number else Cost(len(history.slip)),
            stable_cycles=stable,
            link=StructureLink.none(),
            cycle=(),
        )

    def _tractions(self, history: FaceLoads) -> CycleTractions:
        """Return the cycle of the face on the cells of its grid."""
        force = history.force
        assert force is not None
        traction = np.divide(force, self.areas, out=np.zeros_like(force), where=self.areas > 0.0)
        on_cells, slip = map(self.on_cells, (traction, history.slip))
        unknown, friction = np.zeros(len(slip)), self.settings.friction(0.0)
        pressure, shear = on_cells[:, 2], on_cells[:, :2]
        return CycleTractions(history.loads, friction, pressure, shear, slip, unknown)


class NodalContacts:
    """All faces of a structure, whose nodes wear together.

    It is a :class:`wear.contact.contacts.LoadedContacts` with a single state, that of all nodes.
    """

    def __init__(
        self, faces: Sequence[NodalFace], source: StructureLoads, cycles: _Cycles, wear: Wear
    ) -> None:
        self._faces, self._cycles = faces, cycles
        self._laws = faces[0].settings.laws
        self._friction = np.concatenate(
            [np.full(len(face.areas), face.settings.friction(0.0)) for face in faces]
        )
        meshed = source.mesh.interfaces
        self._gap = np.concatenate([whole_values(face, face.gap) for face in meshed])
        self._areas = np.concatenate([face.areas for face in faces])
        self._stiffness = source.stiffest(np.concatenate([face.nodal_areas for face in meshed]))
        self._stepper = StabilisedStepper(wear.error_control())

    def begin(
        self, histories: Sequence[FaceLoads], cycles: float
    ) -> tuple[list[NodalState], list[FirstContact]]:
        state = NodalState.unworn(self._gap)
        solution = self._cycles.at(state.surfaces.depth)
        contact = self._contact(solution)
        state = replace(state, next_cycles=first_cycles(contact, state, cycles))
        stable = contact.stable_cycles(state)
        pairs = zip(self._faces, histories, strict=True)
        firsts = [face.first(history, solution, stable) for face, history in pairs]
        # The rates are those of the first cycle; nothing is worn yet.
        worn = contact.worn(state, contact.rates(state), 1.0)
        return [replace(state, depth_rate=worn.depth_rate, volume_rate=worn.volume_rate)], firsts

    def jump(
        self, states: Sequence[NodalState], cycles: float, left: float
    ) -> list[tuple[NodalState, Cost]]:
        state = _of_all_nodes(states)
        begun = self._cycles.at(state.surfaces.depth)

        def contact_at(worn: NodalState) -> NodalContact:
            depth = worn.surfaces.depth
            alike = np.array_equal(depth, state.surfaces.depth)
            return self._contact(begun if alike else self._cycles.near(depth, begun))

        result = advance_cycles(self._stepper, state, cycles, left, contact_at)
        solves = result.cost.contact_solves * len(begun.states)
        return [(result.state, replace(result.cost, contact_solves=solves))]

    def kinetics(self, states: Sequence[NodalState]) -> Array:
        pairs = zip(self._faces, self.views(states), strict=True)
        return np.array([kinetics_of(state, face.volume) for face, state in pairs])

    def nodal_depths(self, states: Sequence[NodalState]) -> list[Array]:
        return self._cycles.split(_of_all_nodes(states).surfaces.depth)

    def views(self, states: Sequence[NodalState]) -> list[NodalFaceState]:
        """Return the state of every face."""
        state = _of_all_nodes(states)
        return [face.view(state) for face in self._faces]

    def _contact(self, solution: CycleSolution) -> NodalContact:
        histories = self._cycles.on_faces(solution)
        cycle = StructureCycle(histories, self._friction, self._areas, self._stiffness)
        return NodalContact(self._laws, (cycle,))


def _of_all_nodes(states: Sequence[NodalState]) -> NodalState:
    """Return the only state. Raises InputError for those of faces, which older versions stored."""
    if len(states) != 1:
        raise InputError("the stored state is of an older version: start the run again")
    return states[0]


def nodal_contacts(contact: ContactOf, wear: Wear, source: StructureLoads) -> FaceContacts:
    """Return the contacts of all faces of a structure, which wear at their nodes."""
    faces = source.faces
    cycles = _Cycles(source, faces)
    stages = [
        FaceContact(
            face,
            contact(face.face.name),
            wear,
            partial(NodalFace, cycles, number, face.face.nodal_areas),
        )
        for number, face in enumerate(faces)
    ]
    contacts = [stage.contact for stage in stages]
    wearing = NodalContacts(contacts, source, cycles, wear)
    return FaceContacts(stages, wearing, partial(call_in_turn, contacts), wearing.views)
