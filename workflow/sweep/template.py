"""Template of the file of a sweep, for ``fretscale new sweep``."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pydantic_core import PydanticUndefined

from workflow.case.sections import Section, entries_of
from workflow.case.text.template import EDITORS
from workflow.case.text.writing import EntryRow, render
from workflow.sweep.schema import LogNormal, Normal, Range, SweepFile, Uniform

SWEEP = "sweep"
ABOUT = "a case many times with other values: all with all, in step, or a random sample"
HEADER = f"""\
{EDITORS}\
# `fretscale sweep` runs it. What varies is named by its keys in the case, joined by dots; each has
# values, a range or a distribution, these with design: sample and samples. Entries behind a # are
# optional: those said to be `or` another kind take the place of the one above.
"""
FRICTION, RADIUS, WEAR = "friction.coefficient", "structure.edge_radius", "wear.blade.coefficient"
DISTRIBUTED = ((WEAR, LogNormal, ""), (RADIUS, Normal, "or: "), (RADIUS, Uniform, "or: "))


def sweep_template() -> str:
    """Return a commented sweep of a case, with every way to vary an entry."""
    rows = {name: _row(SweepFile, name) for name in SweepFile.model_fields}
    rows["case"] = replace(rows["case"], value="my.yaml")
    rows["set"] = replace(rows["set"], value=[EntryRow("output.paraview", False)], off=True)
    spaced = [replace(row, off=False) for row in _rows(Range)]
    vary = [
        EntryRow(FRICTION, [EntryRow("values", [0.3, 0.4, 0.5], "one after the other")]),
        EntryRow(
            RADIUS,
            [EntryRow("range", spaced, "evenly spaced")],
            "also: beside those above",
            off=True,
        ),
        *(
            EntryRow(
                name, [EntryRow("distribution", _rows(kind))], f"{sign}for design: sample", off=True
            )
            for name, kind, sign in DISTRIBUTED
        ),
    ]
    rows["vary"] = replace(rows["vary"], value=vary)
    return HEADER + render(list(rows.values()))


def _rows(model: type[Section]) -> list[EntryRow]:
    return [_row(model, name) for name in entries_of(model)]


def _row(model: type[Section], name: str) -> EntryRow:
    field = model.model_fields[name]
    value: Any = (field.examples or [None])[0]
    off = field.default is not PydanticUndefined and field.default is None
    return EntryRow(name, value, field.description or "", off)
