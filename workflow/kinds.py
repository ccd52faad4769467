"""Registry of analyses. A new analysis is a folder in ``workflow/analyses`` and a name here.

Each analysis is imported on demand, so that a contact run need not load the vibration entries.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from workflow.case import loading
from workflow.case.sections import Case, Section
from workflow.case.text.json_schema import json_schema as write_schema
from workflow.case.text.template import short_template
from workflow.case.text.template import template as write_template
from workflow.shell.analysis import Analysis

ANALYSES: Mapping[str, str] = {
    "wear": "wear",
    "specimens": "wear",
    "contact": "contact",
    "time": "time",
    "vibration": "vibration",
    "vibration_wear": "vibration",
}
"""Folder of each analysis, and the word for it in the entry ``analysis`` of its cases."""

NOTHING: Mapping[str, tuple[type[Section], str]] = {}


def analyses(called: str | None = None) -> list[Analysis[Any]]:
    """Return the analyses with this word in their cases; all of them if none has it."""
    names = [name for name, word in ANALYSES.items() if word == called] or list(ANALYSES)
    return [import_module(f"workflow.analyses.{name}").ANALYSIS for name in names]


def kinds(called: str | None = None) -> dict[str, type[Case]]:
    """Return the kinds of case of these analyses, by their names in ``fretscale new``."""
    return {name: case for analysis in analyses(called) for name, case in analysis.cases.items()}


def about() -> dict[str, str]:
    """Return what each kind of case is about, in one plain line."""
    return {name: case.about for name, case in kinds().items()}


def analysis_of(case: Case) -> Analysis[Any]:
    """Return the analysis of a case."""
    own = analyses(case.analysis)
    return next(analysis for analysis in own if type(case) in analysis.cases.values())


def kind_of(case: Case) -> str:
    """Return the name of a case's kind."""
    return next(name for name, model in kinds(case.analysis).items() if type(case) is model)


def load_case(path: str | Path, overrides: Sequence[str] = ()) -> Case:
    """Return the case of any kind in a file: see :func:`workflow.case.loading.load_case`."""
    return loading.load_case(path, _those_called, overrides)


def parse_case(text: str, name: str, overrides: Sequence[str] = ()) -> Case:
    """Return the case of any kind in a text."""
    return loading.parse_case(text, name, _those_called, overrides)


def _those_called(called: object) -> list[type[Case]]:
    return list(kinds(called if isinstance(called, str) else None).values())


def template(kind: str, short: bool = False) -> str:
    """Return a commented case of a kind with all entries, or if ``short`` the required ones."""
    model = kinds()[kind]
    return short_template(model) if short else write_template(model)


def json_schema(others: Mapping[str, tuple[type[Section], str]] = NOTHING) -> dict[str, Any]:
    """Return the JSON schema of a case of any kind, and of the files in ``others``.

    ``others`` has a model and a line about it for each name.
    """
    cases = {name: (case, case.about) for name, case in kinds().items()}
    return write_schema({**cases, **others})
