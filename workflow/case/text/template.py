"""Templates that ``fretscale new`` writes: the examples of a model, each with its description."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, get_origin

from pydantic.fields import FieldInfo

from workflow.case.sections import (
    KINDS_ARE_NAMED_BY,
    Section,
    entries_of,
    sections_of,
)
from workflow.case.text.writing import EntryRow, render

EDITORS = """\
# yaml-language-server: $schema=fretscale.schema.json
# Editors complete and check by it: `fretscale schema > fretscale.schema.json` beside this file.
"""
HEADER = f"""\
{EDITORS}\
# A number without a unit is in the base unit, given in brackets. `fretscale check` tells what is
# wrong with a case, `fretscale run` runs it. Entries behind a # are optional: those said to be
# `or` another kind take the place of the section above, those `also` stand below it.
"""
SHORT_HEADER = """\
# What must be given; `fretscale new KIND` shows every entry that there is, and its default.
"""
# Optional entries that the template fills in, so that it describes a material that can yield, the
# length of a run, legs that press, a face with rounded edges, a joint whose friction rises, and a
# body that has mass and expands.
FILLED_IN = (
    *("yield_stress", "cycles", "legs", "P", "gap", "end_width", "end_radius"),
    *("friction", "density", "expansion"),
)


def template(model: type[Section], header: str = HEADER) -> str:
    """Return a commented case or other file, ready to run, with every entry of ``model``."""
    return header + render(_rows(model, set()))


def short_template(model: type[Section]) -> str:
    """Return a case of a kind, ready to run, with required entries only; others have defaults."""
    return SHORT_HEADER + render(_needed(model))


def _needed(model: type[Section]) -> list[EntryRow]:
    """Return the entries of a section that are required, or that its template fills in."""
    filled_in = (*(FILLED_IN if model.filled_in else ()), *model.also_filled_in)
    rows = []
    for name, field in entries_of(model).items():
        given = field.is_required() or name in filled_in
        value: Any = (field.examples or [None])[0]
        if sections := list(sections_of(field.annotation)):
            value = _needed(sections[0])
            within = any(row.key not in KINDS_ARE_NAMED_BY for row in value)
            given = given or (within and field.default not in (None, ()))
            if get_origin(field.annotation) is tuple:
                value = [value]
        if given:
            rows.append(EntryRow(name, value, field.description or ""))
    return rows


def _rows(model: type[Section], shown: set[tuple[type[Section], ...]]) -> list[EntryRow]:
    """Return the entries of a section, each followed by its other kinds that are not yet shown."""
    filled_in = (*(FILLED_IN if model.filled_in else ()), *model.also_filled_in)
    rows = []
    for name, field in entries_of(model).items():
        row = _row(name, field, filled_in, shown)
        sections = tuple(sections_of(field.annotation))
        others = [] if sections in shown else sections[1:]
        shown |= {sections} if others else set()
        kinds = [_other(name, model, sections[0], shown) for model in others]
        if kinds and get_origin(field.annotation) is tuple:
            items = [replace(kind, comment=f"also{kind.comment[2:]}") for kind in kinds]
            rows.append(replace(row, value=[*row.value, *items]))
        else:
            rows += [row, *kinds]
    return rows


def _row(
    name: str,
    field: FieldInfo,
    filled_in: tuple[str, ...],
    shown: set[tuple[type[Section], ...]],
) -> EntryRow:
    """Return the entry as a user would write it; where it has several kinds, the first."""
    sections = list(sections_of(field.annotation))
    value: Any = _rows(sections[0], shown) if sections else (field.examples or [None])[0]
    off = not field.is_required() and field.default in (None, ()) and name not in filled_in
    if sections and all(row.off for row in value):
        # A section with optional entries only is optional as a whole.
        value, off = [replace(row, off=False) for row in value], True
    if sections and get_origin(field.annotation) is tuple:
        value = [value]
    return EntryRow(name, value, field.description or "", off)


def _other(
    name: str,
    model: type[Section],
    first: type[Section],
    shown: set[tuple[type[Section], ...]],
) -> EntryRow:
    """Return an entry of another kind than the ``first``, with its kind and its new entries."""
    rows = _rows(model, shown)
    above = {key: field.description for key, field in first.model_fields.items()}
    named = [replace(row, off=False, comment="") for row in rows if row.key in KINDS_ARE_NAMED_BY]
    new = [
        replace(row, comment="" if row.comment == above.get(row.key) else row.comment)
        for row in rows
        if row.key not in KINDS_ARE_NAMED_BY and not (row.off and row.key in above)
    ]
    reported = (model.__doc__ or "").split("\n")[0].rstrip(".").replace("``", "")
    return EntryRow(name, [*named, *new], f"or: {reported}", off=True)
