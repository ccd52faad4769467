"""Probe runs of a case: its structure and contacts wear over all cycles in a few steps.

Probe runs with settings that differ in one thing have nearly the same error due to their few steps,
so that their difference is the effect of this setting.
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

# Errors that may end a probe run.
FAILURES = (MeshError, NormalContactError, ContactFailure, MethodFailed)
# Errors that may end a probe run of a case that is not checked yet.
LIFE_FAILURES = (*FAILURES, MotionError, UserError)
# Number of implicit steps. On the default joint, 3 and 8 steps give the same errors of increments
# and meshes within 2 %, and of grids within 20 % of these errors.
STEPS = 3
# Tolerance of the contact solver: a thousandth of the differences that probe runs resolve.
TOLERANCE = 1e-5


def shortened(case: AnyWearCase, settings: Mapping[str, Any]) -> AnyWearCase:
    """Return the case of a probe run, with other ``settings`` by their dotted paths."""
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
    """Return the contacts of a probe run and its states, the unworn one first.

    With ``begun``, it starts from the unworn state of that run and with its contacts. Raises one of
    :data:`FAILURES` if structure or contacts fail.
    """
    if begun is None:
        # The error of its steps and the loads on its last surfaces are not needed.
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
    """Return the largest depth [mm] and the volume [mm³, per length mm²] of both bodies."""
    depths = [interface.surfaces.depth for interface in state.interfaces]
    return {
        stage.name: {"depth": float(depth.max()), "volume": stage.volume(depth)}
        for stage, depth in zip(stages, depths, strict=True)
    }
