"""Short lives of a case: what its structure and contacts make of all cycles in a few steps.

Lives on settings that differ in one thing share the error of their few steps, nearly, and leave the
difference that this one thing makes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any, Literal

from fe_models.meshes.structure_mesh import MeshError
from sa_solver.normal.contact import NormalContactError
from wear.contact.contacts import Contacts
from wear.contact.interface import MotionError
from wear.coupled import CoupledSettings, CoupledState, CoupledWear, JumpSize
from wear.steps.implicit import ImplicitStepper
from wear.steps.stepping import ContactFailure
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.case.sections import ContactStress, Life, Step
from workflow.analyses.wear.structure import AnyWearCase
from workflow.analyses.wear.translation import face_contact
from workflow.case.changing import changed
from workflow.errors import MethodFailed, UserError
from workflow.models.contact import FaceContact
from workflow.models.loads import LoadSource

Worn = dict[str, dict[str, float]]  # by interface and quantity
Lived = tuple[list[FaceContact], list[CoupledState]]

# What a life may end in.
FAILURES = (MeshError, NormalContactError, ContactFailure, MethodFailed)
# And that of a case that nobody has checked yet.
LIFE_FAILURES = (*FAILURES, MotionError, UserError)
# Implicit steps of a life. On the default joint 3 and 8 give the same errors of increments and
# meshes within 2 %, and of grids within 20 % of these errors.
STEPS = 3
# Of the contact solver: a thousandth of the differences that lives resolve.
TOLERANCE = 1e-5


def shortened(case: AnyWearCase, settings: Mapping[str, Any]) -> AnyWearCase:
    """A case whose life is short, with other ``settings`` by their dotted paths."""
    step = Step.model_construct(kind="implicit", cycles=case.wear.cycles / STEPS)
    return changed(
        case,
        {
            "contact.tolerance": TOLERANCE,
            "wear.step": step,
            "stress": ContactStress(section="none", life=Life(parameter="none")),
            **settings,
        },
    )


def live(
    case: WearCase,
    source: LoadSource,
    resultants: Literal["constant", "every"] = "constant",
    begun: Lived | None = None,
) -> Lived:
    """The contacts of a life under the loads of ``source``, and its states, the unworn one first.

    It goes the other way from the unworn state of one that has ``begun``, if that is given. Raises
    one of :data:`FAILURES` where structure or contacts fail.
    """
    if begun is None:
        # What its steps leave is not asked, nor what loads the structure lays on the last surfaces.
        stages = [face_contact(case, face, ImplicitStepper(alone=True)) for face in source.faces]
    else:
        stages = begun[0]
    cycles, contacts = case.wear.cycles, Contacts(stages)
    settings = CoupledSettings(cycles, JumpSize(cycles / STEPS), resultants=resultants)
    loop = CoupledWear(settings, source, contacts)
    state = loop.begin(source.unworn())[0] if begun is None else begun[1][0]
    states = [state, *islice(loop.march(state), STEPS - 1)]
    last = CoupledWear(replace(settings, resultants="constant"), source, contacts)
    return stages, [*states, *last.march(states[-1])]


def worn_by(stages: Sequence[FaceContact], state: CoupledState) -> Worn:
    """Largest depth [mm] and volume [mm³, per length mm²] of both bodies together."""
    depths = [interface.surfaces.depth for interface in state.interfaces]
    return {
        stage.name: {"depth": float(depth.max()), "volume": stage.volume(depth)}
        for stage, depth in zip(stages, depths, strict=True)
    }
