"""The case that ``fretscale new`` writes: the examples of the schema, each with its description."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, get_origin

from pydantic.fields import FieldInfo

from workflow.case.bodies_wear_case import BodiesWearCase, LineBodiesWearCase
from workflow.case.contact_case import ContactCase, LineContactCase
from workflow.case.dovetail_case import DovetailCase
from workflow.case.mesh_case import MeshCase
from workflow.case.resultants_case import ResultantsCase
from workflow.case.sections import Section, entries_of, sections_of
from workflow.case.specimens_case import SpecimensCase
from workflow.case.time_case import JointCase, RigCase, SteadyAgeing
from workflow.case.vibration_case import VibrationCase
from workflow.case.vibration_wear_case import FrictionRigWearCase, VibrationWearCase
from workflow.case.wear_sections import Step
from workflow.case.writing import Row, render

# What `fretscale new` can write.
KINDS: dict[str, type[Section]] = {
    "dovetail": DovetailCase,
    "mesh": MeshCase,
    "resultants": ResultantsCase,
    "specimens": SpecimensCase,
    "bodies_wear": BodiesWearCase,
    "line_wear": LineBodiesWearCase,
    "bodies": ContactCase,
    "line": LineContactCase,
    "joint": JointCase,
    "rig": RigCase,
    "vibration": VibrationCase,
    "vibration_wear": VibrationWearCase,
    "friction_rig_wear": FrictionRigWearCase,
}

HEADER = """\
# A number without a unit is in the base unit, given in brackets. `fretscale check` tells what is
# wrong with a case, `fretscale run` runs it. Entries behind a # are optional.
"""
# Optional entries the template fills in: a material that can yield, the length of a run, legs that
# press, a face that is rounded all round, and a joint whose friction rises.
FILLED_IN = ("yield_stress", "cycles", "legs", "P", "gap", "end_width", "end_radius", "friction")
# And sections in which it does not: wear steps have the length that their error allows, and a rig
# that is shaken need not age.
NOT_FILLED_IN = (Step, SteadyAgeing)


def template(kind: str) -> str:
    """A commented case of ``kind``, ready to run, with every entry there is."""
    if kind not in KINDS:
        raise ValueError(f"{kind}: no such template; allowed: {', '.join(KINDS)}")
    return HEADER + render(_rows(KINDS[kind]))


def _rows(model: type[Section]) -> list[Row]:
    filled_in = () if issubclass(model, NOT_FILLED_IN) else FILLED_IN
    return [_row(name, field, filled_in) for name, field in entries_of(model).items()]


def _row(name: str, field: FieldInfo, filled_in: tuple[str, ...]) -> Row:
    """The entry as one would write it; of several kinds the first."""
    sections = list(sections_of(field.annotation))
    value: Any = _rows(sections[0]) if sections else (field.examples or [None])[0]
    off = not field.is_required() and field.default in (None, ()) and name not in filled_in
    if sections and all(row.off for row in value):
        # A section of nothing but optional entries is optional as a whole.
        value, off = [replace(row, off=False) for row in value], True
    if sections and get_origin(field.annotation) is tuple:
        value = [value]
    return Row(name, value, field.description or "", off)
