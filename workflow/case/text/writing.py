"""Writer of cases as YAML: every entry with its description, which names its base unit."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from workflow.case.fields import Written
from workflow.case.sections import Case, entries_of

HEADER = """\
# The case as run, every default written out. Base units: mm, N, s, MPa, tonne (t), rad.
# Optional entries that are not set are left out.
"""
# Texts that need no quotes in YAML: words and quantities, but no number, switch, date or null.
PLAIN_TEXT = re.compile(
    r"(?!(?:true|false|yes|no|on|off|y|n|null)$)[A-Za-z][\w./-]*", re.ASCII | re.I
)
QUANTITY_TEXT = re.compile(r"-?[\d.]+(?:e-?\d+)? [A-Za-z%][\w/^*%-]*", re.ASCII)
INDENT = "  "


@dataclass(frozen=True)
class EntryRow:
    """Entry to be written; ``off`` writes it as a comment."""

    key: str
    value: Any  # scalar, list of values, rows of a section, or a list of sections as rows
    comment: str = ""
    off: bool = False


def dump_case(case: Case) -> str:
    """Return ``case`` as YAML in base units; ``parse_case`` of the result equals ``case``."""
    return HEADER + render(rows_of(case))


def rows_of(section: BaseModel) -> list[EntryRow]:
    """Return the entries of ``section`` that are set."""
    fields = entries_of(type(section))
    return [
        EntryRow(name, _value(getattr(section, name)), field.description or "")
        for name, field in fields.items()
        if getattr(section, name) is not None
    ]


def _value(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return rows_of(value) or {}
    if isinstance(value, tuple):
        return [_value(item) for item in value]
    return value


def render(rows: list[EntryRow]) -> str:
    """Return ``rows`` as YAML text, with a blank line before each section."""
    blocks = ["\n".join(_lines([row])) for row in rows]
    spaced = [f"\n{b}" if _is_section(r.value) else b for r, b in zip(rows, blocks, strict=True)]
    return "\n".join(spaced) + "\n"


def _lines(rows: list[EntryRow]) -> Iterator[str]:
    for row in rows:
        for line in _entry_lines(row):
            yield f"# {line}" if row.off else line


def _entry_lines(row: EntryRow) -> Iterator[str]:
    if not _is_section(row.value):
        yield _commented(f"{row.key}: {scalar(row.value)}", row.comment)
        return
    yield _commented(f"{row.key}:", row.comment)
    if isinstance(row.value[0], EntryRow):
        yield from (INDENT + line for line in _lines(row.value))
        return
    for item in row.value:
        other = isinstance(item, EntryRow)  # an item of another kind, written as a comment
        first, *rest = _lines(item.value if other else item)
        sign = "# " if other else ""
        yield _commented(f"{INDENT}{sign}- {first}", item.comment if other else "")
        yield from (f"{INDENT}{sign}{INDENT}{line}" for line in rest)


def _is_section(value: Any) -> bool:
    """Return whether ``value`` is rows, or a list of sections given as rows."""
    if not isinstance(value, list) or not value:
        return False
    return isinstance(value[0], EntryRow) or _is_section(value[0])


def _commented(text: str, comment: str) -> str:
    return f"{text}  # {comment}" if comment else text


def scalar(value: Any) -> str:
    """Return a number, switch, text or list of them, valid in YAML 1.1 and 1.2."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(scalar, value))}]"
    if isinstance(value, Written):
        return scalar(value.text)
    if isinstance(value, float):
        return _float(value)
    if isinstance(value, str) and (PLAIN_TEXT.fullmatch(value) or QUANTITY_TEXT.fullmatch(value)):
        return value
    return json.dumps(value, ensure_ascii=False)


def _float(value: float) -> str:
    """Return the shortest text that reads back as ``value``, with the point that YAML 1.1 needs."""
    mantissa, exponent, power = repr(value).partition("e")
    return mantissa + ("" if "." in mantissa else ".0") * bool(exponent) + exponent + power
