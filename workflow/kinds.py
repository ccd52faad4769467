"""The analyses there are. A new one is a folder in ``workflow/analyses`` and a name here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from workflow.analyses import contact, specimens, time, vibration, vibration_wear, wear
from workflow.case import loading
from workflow.case.json_schema import json_schema as write_schema
from workflow.case.sections import Case, Section
from workflow.case.template import template as write_template
from workflow.shell.analysis import Analysis

ANALYSES: tuple[Analysis[Any], ...] = (
    wear.ANALYSIS,
    specimens.ANALYSIS,
    contact.ANALYSIS,
    time.ANALYSIS,
    vibration.ANALYSIS,
    vibration_wear.ANALYSIS,
)

NOTHING: Mapping[str, tuple[type[Section], str]] = {}


def kinds() -> dict[str, type[Case]]:
    """Every kind of case, by the name that ``fretscale new`` has for it."""
    return {name: case for analysis in ANALYSES for name, case in analysis.cases.items()}


def about() -> dict[str, str]:
    """What each kind of case is about, in a line of plain words."""
    return {name: case.about for name, case in kinds().items()}


def analysis_of(case: Case) -> Analysis[Any]:
    """The analysis of a case."""
    return next(analysis for analysis in ANALYSES if type(case) in analysis.cases.values())


def kind_of(case: Case) -> str:
    """The name of a case's kind."""
    return next(name for name, model in kinds().items() if type(case) is model)


def load_case(path: str | Path, overrides: Sequence[str] = ()) -> Case:
    """The case of whatever kind in a file: see :func:`workflow.case.loading.load_case`."""
    return loading.load_case(path, list(kinds().values()), overrides)


def parse_case(text: str, name: str, overrides: Sequence[str] = ()) -> Case:
    """The same, from text."""
    return loading.parse_case(text, name, list(kinds().values()), overrides)


def template(kind: str) -> str:
    """A commented case of a kind, ready to run."""
    return write_template(kinds()[kind])


def json_schema(others: Mapping[str, tuple[type[Section], str]] = NOTHING) -> dict[str, Any]:
    """JSON schema of a case of any kind, or of other files by name, with a line about each."""
    cases = {name: (case, case.about) for name, case in kinds().items()}
    return write_schema({**cases, **others})
