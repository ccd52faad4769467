"""The case that ``fretscale new`` writes: the examples of a model, each with its description."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, get_origin

from pydantic.fields import FieldInfo

from workflow.case.sections import Case, Section, entries_of, sections_of
from workflow.case.writing import Row, render

HEADER = """\
# A number without a unit is in the base unit, given in brackets. `fretscale check` tells what is
# wrong with a case, `fretscale run` runs it. Entries behind a # are optional.
"""
# Optional entries the template fills in: a material that can yield, the length of a run, legs that
# press, when a speed peaks, a face with all edges rounded, a joint whose friction rises and
# a mass.
FILLED_IN = (
    *("yield_stress", "cycles", "legs", "P", "peak_at", "gap", "end_width", "end_radius"),
    *("friction", "density"),
)


def template(model: type[Case]) -> str:
    """A commented case of a kind, ready to run, with every entry there is."""
    return HEADER + render(_rows(model))


def _rows(model: type[Section]) -> list[Row]:
    filled_in = FILLED_IN if model.filled_in else ()
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
