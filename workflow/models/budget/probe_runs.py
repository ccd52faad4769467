"""Probe runs of a wear model: its structure and contacts wear over all cycles in a few steps.

Probe runs with settings that differ in one thing have nearly the same error due to their few steps,
so that their difference is the effect of this setting.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import islice
from typing import Literal

from fe_models.meshes.structure_mesh import MeshError
from sa_solver.errors import InputError
from sa_solver.normal.contact import NormalContactError
from sa_solver.types import Array
from wear.contact.interface import InterfaceContact, MotionError
from wear.coupled import CoupledWear
from wear.coupled_state import CoupledState
from wear.schedule import CoupledSettings, JumpSize
from wear.steps.implicit import ImplicitStepper
from wear.steps.stepping import ContactFailure
from workflow.errors import MethodFailed, UserError
from workflow.models.contact import FaceContact
from workflow.models.contacts import FaceContacts
from workflow.models.loads import ContactFace, LoadSource
from workflow.models.wear import WearModel

Numbers = dict[str, dict[str, float]]  # by interface and quantity

# Errors that may end a probe run.
FAILURES = (MeshError, NormalContactError, ContactFailure, MethodFailed)
# Errors that may end a probe run of a model that is not checked yet.
UNCHECKED_FAILURES = (*FAILURES, MotionError, UserError, InputError)
# Number of implicit steps. On the default joint, 3 and 8 steps give the same errors of increments
# and meshes within 2 %, and of grids within 20 % of these errors.
STEPS = 3
# Tolerance of the contact solver: a thousandth of the differences that probe runs resolve.
TOLERANCE = 1e-5
# An interface that carries, dissipates or wears less than this share of the largest is measured
# relative to that share.
LESSER_INTERFACE = 0.1


@dataclass(frozen=True)
class ProbeRun:
    """Contacts of a probe run, and its states from the unworn one to the last."""

    contacts: list[FaceContact]
    states: list[CoupledState]

    @property
    def worn(self) -> Numbers:
        """Largest depth [mm] and volume [mm³, per length mm²] of both bodies, by interface."""
        depths = [interface.surfaces.depth for interface in self.states[-1].interfaces]
        return {
            contact.name: {"depth": float(depth.max()), "volume": contact.contact.volume(depth)}
            for contact, depth in zip(self.contacts, depths, strict=True)
        }

    @property
    def nodal_depths(self) -> list[Array]:
        """Worn depth of both bodies at the nodes of every face at the end ``(n,)`` [mm]."""
        pairs = zip(self.contacts, self.states[-1].interfaces, strict=True)
        return [contact.contact.at_nodes(state.surfaces.depth) for contact, state in pairs]

    @property
    def worn_and_pressed(self) -> Numbers:
        """Results of :attr:`worn`, and the largest pressures unworn and worn [MPa]."""
        unworn, worn = (_largest_pressures(self.states[number]) for number in (0, -1))
        return {
            name: numbers | {"peak_pressure": first, "worn_peak_pressure": last}
            for (name, numbers), first, last in zip(self.worn.items(), unworn, worn, strict=True)
        }


def _largest_pressures(state: CoupledState) -> list[float]:
    """Return the largest pressure in the cycle of each interface [MPa]."""
    return [
        max((start.pressure.max() for start in interface.starts.values()), default=0.0)
        for interface in state.interfaces
    ]


def probe_run(
    model: WearModel,
    source: LoadSource,
    resultants: Literal["constant", "every"] = "constant",
    begun: ProbeRun | None = None,
) -> ProbeRun:
    """Run a model over all its cycles in a few steps, whatever the steps of its wear are.

    With ``begun``, it starts from the unworn state of that run and with its contacts. Raises one of
    :data:`FAILURES` if structure or contacts fail.
    """
    if begun is None:
        # The error of its steps and the loads on its last surfaces are not needed.
        stages = [_stage(model, face) for face in source.faces]
    else:
        stages = begun.contacts
    cycles, contacts = model.wear.cycles, FaceContacts.half_spaces(stages).wearing
    settings = CoupledSettings(cycles, JumpSize(cycles / STEPS), resultants=resultants)
    loop = CoupledWear(settings, source, contacts)
    state = loop.begin(source.unworn())[0] if begun is None else begun.states[0]
    states = [state, *islice(loop.march(state), STEPS - 1)]
    last = CoupledWear(replace(settings, resultants="constant"), source, contacts)
    return ProbeRun(stages, [*states, *last.march(states[-1])])


def _stage(model: WearModel, face: ContactFace) -> FaceContact:
    contact = model.contact(face.face.name)
    return FaceContact(face, contact, model.wear, InterfaceContact, ImplicitStepper(alone=True))


def scales(values: Numbers) -> Numbers:
    """Return the values that errors of each interface are relative to."""
    names = next(iter(values.values()))
    largest = {name: max(abs(quantities[name]) for quantities in values.values()) for name in names}
    return {
        interface: {
            name: max(abs(value), LESSER_INTERFACE * largest[name])
            for name, value in quantities.items()
        }
        for interface, quantities in values.items()
    }
