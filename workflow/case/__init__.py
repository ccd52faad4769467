"""The case file: YAML with units in, a frozen ``Case`` in base units out, or why not."""

from workflow.case.bodies_wear_case import BodiesWearCase, LineBodiesWearCase
from workflow.case.contact_case import ContactCase, LineContactCase
from workflow.case.dovetail_case import DovetailCase
from workflow.case.loading import load_case, parse_case
from workflow.case.mesh_case import MeshCase
from workflow.case.resultants_case import ResultantsCase
from workflow.case.schema import Case, json_schema
from workflow.case.specimens_case import SpecimensCase
from workflow.case.template import KINDS, template
from workflow.case.time_case import JointCase, RigCase, TimeCase
from workflow.case.vibration_case import VibrationCase
from workflow.case.vibration_wear_case import FrictionRigWearCase, VibrationWearCase
from workflow.case.wear_case import WearCase
from workflow.case.writing import dump_case
from workflow.errors import CaseError

__all__ = [
    "KINDS",
    "BodiesWearCase",
    "Case",
    "CaseError",
    "ContactCase",
    "DovetailCase",
    "FrictionRigWearCase",
    "JointCase",
    "LineBodiesWearCase",
    "LineContactCase",
    "MeshCase",
    "ResultantsCase",
    "RigCase",
    "SpecimensCase",
    "TimeCase",
    "VibrationCase",
    "VibrationWearCase",
    "WearCase",
    "dump_case",
    "json_schema",
    "load_case",
    "parse_case",
    "template",
]
