"""A structure, its contacts, how they wear and their stress: the model of a wear analysis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from fe_models.solvers.blas_threads import one_thread
from sa_solver import checks
from sa_solver.errors import InputError
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceContact
from wear.coupled import CoupledWear
from wear.coupled_state import CoupledState, Observer, check_observers, observed
from wear.schedule import CoupledSettings
from wear.steps.steppers import ROUNDING
from wear.steps.stepping import ContactFailure
from workflow.errors import warn_each
from workflow.messages.warning_kinds import Notice
from workflow.models.checks.limits import check_steps, unstable_fraction
from workflow.models.checks.loads import check_loads
from workflow.models.checks.start import check_origin, origin_of
from workflow.models.checks.warnings import (
    dissimilar_warnings,
    friction_step_warnings,
    friction_warnings,
    growth_warnings,
    instability_warnings,
    link_warnings,
    unpressed_warnings,
    yield_warnings,
)
from workflow.models.contact import (
    Contact,
    FaceContact,
    Wear,
    WornFaces,
    border_warnings,
    few_cells_warnings,
)
from workflow.models.contacts import FaceContacts
from workflow.models.loads import LoadSource
from workflow.models.nodal import nodal_contacts
from workflow.models.results import ResultsRecorder, WearResults
from workflow.models.stress.contact_stress import contact_stresses, cycles_of
from workflow.models.stress.results import StressResults
from workflow.models.stress.settings import Stress
from workflow.models.stress.structure_stress import (
    StressedStructure,
    begin_worn_mesh,
    end_cycle,
)
from workflow.models.structure import StructureLoads
from workflow.models.structure_model import StructureModel, StructureStore
from workflow.models.uncoupled.body_pair import BodyPair
from workflow.models.uncoupled.given_loads import GivenLoads
from workflow.models.uncoupled.increments import CycleWork, increment_warnings

if TYPE_CHECKING:
    import xarray as xr

Structure = StructureModel | BodyPair | LoadSource
"""Structure of finite elements, bodies without them, or any other source of loads."""


@dataclass(frozen=True)
class WearModel:
    """A structure, its contacts and how they wear.

    Parameters
    ----------
    structure : StructureModel, BodyPair or LoadSource
        Source of the loads: a structure of finite elements, two bodies without them, or any other.
    contacts : Contact or mapping of str to Contact
        One contact for all faces, or one for each face by its name.
    wear : Wear
        Length and steps of the wear.
    stress : Stress, optional
        Stress of the bodies and under the contacts, unworn and worn; none unless given.

    Examples
    --------
    The model of a case on a coarser grid:

    >>> from dataclasses import replace
    >>> import fretscale
    >>> model = fretscale.wear_model("cases/dovetail.yaml")
    >>> coarse = replace(model, contacts=replace(model.contacts, grid=(64, 128)))
    >>> print(model.contact("intrados").grid, coarse.contact("intrados").grid)
    (96, 192) (64, 128)

    The example of :class:`fretscale.UncoupledSource` runs a model.
    """

    structure: Structure
    contacts: Contact | Mapping[str, Contact]
    wear: Wear
    stress: Stress | None = None

    def __post_init__(self) -> None:
        # Structures of finite elements, pairs of bodies, and other sources of loads.
        if not any(hasattr(self.structure, name) for name in ("meshed", "source", "unworn")):
            raise InputError(
                f"WearModel.structure is {checks.shown(self.structure)}: give a structure of "
                "finite elements, a BodyPair, or a source of loads such as GivenLoads"
            )
        checks.instances(self, contacts=Contact | Mapping, wear=Wear, stress=Stress | None)
        if isinstance(self.contacts, Mapping):
            checks.members(self, contacts=Contact)

    def contact(self, name: str) -> Contact:
        """Return the contact of a face. Raises InputError where the model has none."""
        if isinstance(self.contacts, Contact):
            return self.contacts
        if name not in self.contacts:
            raise InputError(
                f"no contact for the face {name!r}: give one of that name, or one for all faces"
            )
        return self.contacts[name]

    def loads(self, store: StructureStore | None = None) -> LoadSource:
        """Return the loads of the contacts; a structure is condensed, or found in ``store``."""
        if hasattr(self.structure, "meshed"):
            structure = cast("StructureModel", self.structure)
            return StructureLoads(structure, self._unworn_friction, store)
        if isinstance(self.structure, BodyPair):
            return self.structure.source(self.contact(self.structure.name))
        return self.structure

    def _unworn_friction(self, name: str) -> float:
        return self.contact(name).coulomb.at(0.0)

    def face_contacts(self, loads: LoadSource) -> FaceContacts:
        """Return the contacts of all faces, which wear in this process."""
        faces = loads.faces
        contacts = [self.contact(face.face.name) for face in faces]
        methods = {contact.method for contact in contacts}
        if methods == {"nodes"}:
            if not isinstance(loads, StructureLoads):
                raise InputError("method nodes needs a structure of finite elements")
            if _evolves(contacts):
                raise InputError("method nodes needs friction that does not evolve")
            return nodal_contacts(self.contact, self.wear, loads)
        if "nodes" in methods:
            raise InputError("method nodes is for all contacts of a model or for none")
        if "normal" in methods and not loads.slip_known:
            raise InputError(
                "method normal wears by the slips of the loads, but these have none: give slips, "
                "or method full"
            )
        pairs = zip(faces, contacts, strict=True)
        if "normal" in methods and isinstance(loads, GivenLoads) and loads.without_slip:
            lacking = ", ".join(loads.without_slip)
            raise InputError(
                f"method normal wears by the slips of the loads, but {lacking} has none: give "
                "slips for every face, or method full"
            )
        return FaceContacts.half_spaces(
            [FaceContact(face, contact, self.wear, InterfaceContact) for face, contact in pairs]
        )

    def loop(
        self, loads: LoadSource, contacts: FaceContacts, observers: Sequence[Observer] = ()
    ) -> CoupledWear[Any]:
        """Return the coupled loop of loads and contacts."""
        return CoupledWear(self.settings(loads), loads, contacts.wearing, observers)

    def settings(self, loads: LoadSource) -> CoupledSettings:
        """Return the length of the coupled loop, and when it updates the loads."""
        contacts = [self.contact(face.face.name) for face in loads.faces]
        settings = self.wear.coupled("evolving" if _evolves(contacts) else "constant")
        if contacts[0].method == "nodes":
            # There the whole structure is solved in every step.
            return replace(settings, resultants="constant")
        return settings

    def run(
        self,
        observers: Sequence[Observer] = (),
        start: CoupledState | None = None,
        store: StructureStore | None = None,
    ) -> xr.DataTree:
        """Compute the wear and return its results.

        Parameters
        ----------
        observers : sequence of Observer
            Called while the run goes on, such as :class:`fretscale.Progress`.
        start : CoupledState, optional
            State of an earlier run of the same model to resume from, such as that of a
            :class:`fretscale.Checkpoint`. Only ``cycles`` and ``stop`` of its wear may differ.
        store : StructureStore, optional
            Storage of condensed structures between runs.

        Returns
        -------
        xarray.DataTree
            A group for each contact face and one of the run, with units and descriptions as
            attributes. With ``stress``, faces have groups ``section`` and ``life``, and the bodies
            of a structure of finite elements have groups in ``bodies``.

        Warns
        -----
        ModelWarning
            A contact touches the border of its grid, covers too few cells, yields, or is of
            dissimilar bodies whose coupling ``method`` "normal" neglects; explicit steps are
            unstable; increments of two bodies are too long for ``method`` "full"; friction is
            unusual; the structure has an obvious fault, or its stress is not fully known.

        Raises
        ------
        InputError
            The model does not fit together, or ``start`` is of another model.
        MethodFailed, ContactFailure
            A solver did not converge.
        """
        check_observers(observers)
        loads = self.loads(store)
        loads.prepare()
        # The matrices of contacts and increments are small: threads would only cost time.
        with one_thread():
            unworn = loads.unworn()
            check_loads(loads, unworn)
            contacts = self.face_contacts(loads)
            if self.stress is not None:
                for stage in contacts.stages:
                    self.stress.check(stage.grid)
            recorder = ResultsRecorder(contacts, loads.peak)
            watching = [*observers, recorder]
            if self.wear.steps == "explicit" and self.wear.fraction is None:
                watching.append(StabilityWatch(contacts))
            loop = self.loop(loads, contacts, watching)
            state, first = self.begin(loop, unworn, start)
            check_steps(self.settings(loads), self.wear.fraction, state, first)
            warn_each(unstable_fraction(self.wear.fraction))
            warn_each(_warnings(loads, contacts, first))
            warn_each(self._increment_warnings(contacts, unworn, first))
            end, found = loop.run(state), None
            warn_each(_end_warnings(contacts, first, end, recorder))
            if self.stress is not None:
                with observed(observers, "stress"):
                    found = self._stress(self.stress, loads, contacts.faces(end), unworn, first)
                warn_each(found.faults(loads.peak))
            return WearResults(recorder, end, unworn, loads.line, found).tree()

    def begin(
        self, loop: CoupledWear, unworn: Sequence[FaceLoads], start: CoupledState[Any] | None
    ) -> tuple[CoupledState[Any], list[FirstContact]]:
        """Return the state to wear from, which is ``start`` if given, and the first contacts.

        Raises InputError unless ``start`` is a state of this model before its last cycle.
        """
        state, first = loop.begin(unworn)
        names = [face.face.name for face in cast("LoadSource", loop.source).faces]
        of_faces = {name: self.contact(name) for name in names}
        origin = origin_of(of_faces, self.wear, self.structure, unworn)
        state = replace(state, origin=origin)
        if start is None:
            return state, first
        if not isinstance(start, CoupledState):
            raise InputError(
                f"start is {checks.shown(start)}: give a state, such as that of a Checkpoint"
            )
        check_origin(start.origin, origin)
        _check_surfaces(start, state)
        if start.cycles[-1] > self.wear.cycles * (1.0 + ROUNDING):
            raise InputError(
                f"the state to start from has {start.cycles[-1]:g} cycles, the model "
                f"{self.wear.cycles:g}: give the model more"
            )
        return start, first

    def _increment_warnings(
        self,
        contacts: FaceContacts,
        unworn: Sequence[FaceLoads],
        first: Sequence[FirstContact],
    ) -> Sequence[Notice]:
        """Return the warning for long increments of two bodies whose half-space finds the slip."""
        if not isinstance(self.structure, BodyPair) or not first[0].cycle:
            return ()
        halved = replace(self, structure=self.structure.in_parts(2))
        source = halved.loads()
        (loads,), (finer,) = source.unworn(), halved.face_contacts(source).stages
        try:
            _, found = finer.contact.begin(loads, self.wear.cycles)
        except ContactFailure:
            return ()  # nothing is known of the error; the cycle itself has been solved
        (stage,) = contacts.stages
        given = CycleWork.of(stage.contact, unworn[0], first[0])
        return increment_warnings(stage.name, given, CycleWork.of(finer.contact, loads, found))

    def _stress(
        self,
        stress: Stress,
        loads: LoadSource,
        faces: WornFaces,
        unworn: Sequence[FaceLoads],
        first: Sequence[FirstContact],
    ) -> StressResults:
        """Return the stress before any wear and on the surfaces at the end."""
        structure = None
        if isinstance(loads, StructureLoads):
            worn = begin_worn_mesh(loads, faces)
            cycle = end_cycle(loads, faces, self.settings(loads).friction == "evolving")
            structure = StressedStructure.of(loads, worn(), cycle)
        if not stress.under_contacts:
            return StressResults(structure, ())
        cycles = []
        for number, ((face, state), begin, found) in enumerate(
            zip(faces, unworn, first, strict=True)
        ):
            contact = face.contact
            tractions = contact.unworn_tractions(begin, found), contact.tractions(state)
            cycles.append(cycles_of(face, number, tractions, begin, structure))
        return StressResults(structure, contact_stresses(stress, loads.peak, cycles))


def _evolves(contacts: Sequence[Contact]) -> bool:
    """Return whether the friction of any contact changes as it dissipates energy."""
    return any(contact.coulomb.evolution is not None for contact in contacts)


def _warnings(
    loads: LoadSource, contacts: FaceContacts, first: Sequence[FirstContact]
) -> Iterator[Notice]:
    """Return what makes results wrong though all solvers converge."""
    stages = contacts.stages
    if isinstance(loads, StructureLoads):
        yield from (Notice(kind, text) for text, kind in loads.remarks() if kind is not None)
    yield from friction_warnings(stages)
    yield from unpressed_warnings(stages, first, loads.peak)
    yield from border_warnings(stages, first)
    if _half_spaces(contacts):
        yield from few_cells_warnings(stages, [contact.pressure[loads.peak] for contact in first])
    yield from dissimilar_warnings(stages, first)
    for stage, contact in zip(stages, first, strict=True):
        yield from link_warnings(stage.name, contact.link)
        highest = float(contact.pressure.max())
        yield from yield_warnings(highest, stage.pair.bodies, f"{stage.name}: ")


def _end_warnings(
    contacts: FaceContacts,
    first: Sequence[FirstContact],
    end: CoupledState[Any],
    recorder: ResultsRecorder,
) -> Iterator[Notice]:
    """Return what makes the worn surfaces at the end of a run wrong, and was not known before."""
    yield from friction_step_warnings(contacts.stages, first, end)
    if _half_spaces(contacts):
        faces = zip(contacts.faces(end), first, strict=True)
        yield from growth_warnings([face for face, found in faces if not found.touches_border])
        pressures = [fields.pressure for fields in recorder.fields[-1]]
        yield from few_cells_warnings(contacts.stages, pressures, worn=True)


def _half_spaces(contacts: FaceContacts) -> bool:
    """Return whether the contacts are half-spaces, and not nodes that the grid only shows."""
    return all(isinstance(stage.contact, InterfaceContact) for stage in contacts.stages)


@dataclass
class StabilityWatch(Observer):
    """Observer that warns once of explicit steps beyond their stability limit."""

    contacts: FaceContacts
    warned: bool = False

    def jump_started(self, state: CoupledState[Any], cycles: float) -> None:
        if self.warned or not _half_spaces(self.contacts):
            return
        found = list(instability_warnings(self.contacts.faces(state), cycles))
        self.warned = bool(found)
        warn_each(found)


def _check_surfaces(start: CoupledState[Any], unworn: CoupledState[Any]) -> None:
    """Raise InputError unless a state has the gaps of ``unworn`` faces.

    Digests of a model have only the names of functions, which do not tell two gaps apart.
    """
    pairs = zip(start.interfaces, unworn.interfaces, strict=False)
    if len(start.interfaces) != len(unworn.interfaces) or not all(
        np.array_equal(one.surfaces.initial_gap, other.surfaces.initial_gap) for one, other in pairs
    ):
        raise InputError("the state to start from is of another model: its gaps differ")
