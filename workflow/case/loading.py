"""A case file to a ``Case``, or to the lines that say why not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pydantic import ValidationError

from workflow.case.bodies_wear_case import FLAT, BodiesWearCase, LineBodiesWearCase
from workflow.case.contact_case import (
    AREA_SHAPES,
    HEIGHTS,
    LINE_SHAPES,
    ContactCase,
    LineContactCase,
)
from workflow.case.dovetail_case import DovetailCase
from workflow.case.explain import lines_about
from workflow.case.fields import shown
from workflow.case.mesh_case import MeshCase
from workflow.case.resultants_case import ResultantsCase
from workflow.case.schema import Case
from workflow.case.source import KeyPath, Source, dotted, read_text
from workflow.case.specimens_case import SpecimensCase
from workflow.case.time_case import JointCase, RigCase
from workflow.case.vibration_case import VibrationCase
from workflow.case.vibration_wear_case import FrictionRigWearCase, VibrationWearCase
from workflow.errors import CaseError


def load_case(path: str | Path, overrides: Sequence[str] = ()) -> Case:
    """The case in file ``path``, with ``overrides`` such as ``"wear.cycles=1e4"`` on top.

    Raises ``CaseError`` with one line ``file:line: key: what is wrong; allowed: ...`` for each
    thing wrong, ``--set key=value`` in the place of file and line where an override is at fault.
    """
    return parse_case(read_text(Path(path)), str(path), overrides)


def parse_case(text: str, name: str, overrides: Sequence[str] = ()) -> Case:
    """As ``load_case``, from ``text``; ``name`` stands for the file in messages.

    Files that the case names are looked for from the folder of ``name``.
    """
    source = Source(name, text, overrides)
    kind = _kind_of_case(source)
    try:
        return kind.model_validate(source.data, context={"folder": str(Path(name).parent)})
    except ValidationError as error:
        raise CaseError("\n".join(lines_about(source, kind, error.errors()))) from None


# Wear cases by their kind of structure; two bodies without one have a shape instead.
WEAR_CASES: dict[str, type[Case]] = {
    "dovetail": DovetailCase,
    "mesh": MeshCase,
    "resultants": ResultantsCase,
    "specimens": SpecimensCase,
}


# Cases in time by what holds the joint.
TIME_CASES: dict[str, type[Case]] = {
    "joint": JointCase,
    "rig": RigCase,
    "reduced": RigCase,
}
# Vibration cases with wear by what holds the contact.
VIBRATION_WEAR_CASES: dict[str, type[Case]] = {
    "rig": VibrationWearCase,
    "friction_rig": FrictionRigWearCase,
}


def _kind_of_case(source: Source) -> type[Case]:
    """The kind that the source means by its analysis and structure, whatever else is wrong."""
    analysis = _choice(source, ("analysis",), ("wear", "contact", "time", "vibration"))
    if analysis == "time":
        return TIME_CASES[_choice(source, ("structure", "kind"), tuple(TIME_CASES))]
    if analysis == "vibration":
        if any(source.at((section,)) is not None for section in ("wear", "contact")):
            return VIBRATION_WEAR_CASES[
                _choice(source, ("structure", "kind"), tuple(VIBRATION_WEAR_CASES))
            ]
        _choice(source, ("structure", "kind"), ("rig", "reduced", "friction_rig"))
        return VibrationCase
    if analysis == "wear":
        kind = _choice(source, ("structure", "kind"), (*WEAR_CASES, "bodies"))
        if kind != "bodies":
            return WEAR_CASES[kind]
        return LineBodiesWearCase if _is_line(source, (HEIGHTS, FLAT)) else BodiesWearCase
    _choice(source, ("structure", "kind"), ("bodies",))
    return LineContactCase if _is_line(source, (HEIGHTS,)) else ContactCase


def _is_line(source: Source, either: tuple[str, ...]) -> bool:
    """Whether two bodies touch along a line: by their shape, or one that may be ``either``.

    Heights and flats know no dimension: a grid of one size is that of a line contact.
    """
    shape = _choice(source, ("structure", "shape"), (*AREA_SHAPES, *LINE_SHAPES, *either))
    one_size = isinstance(source.at(("contact", "size")), str | int | float)
    return one_size if shape in either else shape in LINE_SHAPES


def _choice(source: Source, path: KeyPath, allowed: tuple[str, ...]) -> str:
    """The word at ``path``, one of those ``allowed``; else raises ``CaseError``."""
    value = source.at(path)
    if isinstance(value, str) and value in allowed:
        return value
    wrong = "missing" if value is None else f"{shown(value)}: not known"
    place = source.where(path)[1]
    key = dotted(path)
    named = "" if place.startswith(f"--set {key}=") else f"{key}: "
    raise CaseError(f"{place}: {named}{wrong}; allowed: {', '.join(allowed)}")
