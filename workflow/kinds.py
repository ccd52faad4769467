"""The analyses there are. A new one is a folder in ``workflow/analyses`` and a name here.

Each is loaded when it is asked for: to run a contact nobody waits for the entries of vibrations.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from workflow.case import loading
from workflow.case.json_schema import json_schema as write_schema
from workflow.case.sections import Case, Section
from workflow.case.template import short_template
from workflow.case.template import template as write_template
from workflow.shell.analysis import Analysis

ANALYSES: Mapping[str, str] = {
    "wear": "wear",
    "specimens": "wear",
    "contact": "contact",
    "time": "time",
    "vibration": "vibration",
    "vibration_wear": "vibration",
}
"""The folder of each analysis, and how its cases call it in ``analysis``."""

NOTHING: Mapping[str, tuple[type[Section], str]] = {}


def analyses(called: str | None = None) -> list[Analysis[Any]]:
    """Those whose cases call them so; all of them if none does."""
    names = [name for name, word in ANALYSES.items() if word == called] or list(ANALYSES)
    return [import_module(f"workflow.analyses.{name}").ANALYSIS for name in names]


def kinds(called: str | None = None) -> dict[str, type[Case]]:
    """Every kind of case, by the name that ``fretscale new`` has for it, or those so called."""
    return {name: case for analysis in analyses(called) for name, case in analysis.cases.items()}


def about() -> dict[str, str]:
    """What each kind of case is about, in a line of plain words."""
    return {name: case.about for name, case in kinds().items()}


def analysis_of(case: Case) -> Analysis[Any]:
    """The analysis of a case."""
    own = analyses(case.analysis)
    return next(analysis for analysis in own if type(case) in analysis.cases.values())


def kind_of(case: Case) -> str:
    """The name of a case's kind."""
    return next(name for name, model in kinds(case.analysis).items() if type(case) is model)


def load_case(path: str | Path, overrides: Sequence[str] = ()) -> Case:
    """The case of whatever kind in a file: see :func:`workflow.case.loading.load_case`."""
    return loading.load_case(path, _those_called, overrides)


def parse_case(text: str, name: str, overrides: Sequence[str] = ()) -> Case:
    """The same, from text."""
    return loading.parse_case(text, name, _those_called, overrides)


def _those_called(called: object) -> list[type[Case]]:
    return list(kinds(called if isinstance(called, str) else None).values())


def template(kind: str, short: bool = False) -> str:
    """A commented case of a kind, ready to run: with all its entries, or only those it needs."""
    model = kinds()[kind]
    return short_template(model) if short else write_template(model)


def json_schema(others: Mapping[str, tuple[type[Section], str]] = NOTHING) -> dict[str, Any]:
    """JSON schema of a case of any kind, or of other files by name, with a line about each."""
    cases = {name: (case, case.about) for name, case in kinds().items()}
    return write_schema({**cases, **others})
