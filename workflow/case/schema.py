"""The kinds of case there are."""

from __future__ import annotations

from typing import Any

from pydantic import TypeAdapter

from workflow.case.bodies_wear_case import BodiesWearCase, LineBodiesWearCase
from workflow.case.contact_case import ContactCase, LineContactCase
from workflow.case.dovetail_case import DovetailCase
from workflow.case.mesh_case import MeshCase
from workflow.case.resultants_case import ResultantsCase
from workflow.case.specimens_case import SpecimensCase
from workflow.case.time_case import JointCase, RigCase
from workflow.case.vibration_case import VibrationCase
from workflow.case.vibration_wear_case import FrictionRigWearCase, VibrationWearCase

Case = (
    DovetailCase
    | MeshCase
    | ResultantsCase
    | SpecimensCase
    | BodiesWearCase
    | LineBodiesWearCase
    | ContactCase
    | LineContactCase
    | JointCase
    | RigCase
    | VibrationCase
    | VibrationWearCase
    | FrictionRigWearCase
)


def json_schema() -> dict[str, Any]:
    """JSON schema of a case of any kind."""
    return TypeAdapter[Case](Case).json_schema()
