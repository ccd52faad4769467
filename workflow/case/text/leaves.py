"""Single entries of a case: their paths, descriptions and values as text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from workflow.case.fields import File, Quantity
from workflow.case.sections import (
    KINDS_ARE_NAMED_BY,
    LAST,
    Case,
    Section,
    entries_of,
    entry_of,
)
from workflow.case.text.plain import plain
from workflow.case.text.readable import everyday_unit, readable
from workflow.case.text.writing import scalar

# The base unit, which ends the description of an entry.
UNIT = re.compile(r"\s*\[[^\]]*\]$")
# The number of a list item within a path.
NUMBERS = re.compile(r"\.\d+(?=\.|$)")
# Values given in a case have no error, and so are shown with all digits.
GIVEN = 0.0


@dataclass(frozen=True)
class Leaf:
    """Entry that is not a section: its path, description ``what``, ``value`` and value as ``text``.

    ``is_shown`` is whether the value differs from the default, or has no default.
    """

    path: str
    what: str
    value: Any
    text: str
    is_shown: bool


def leaves_of(section: BaseModel, above: str = "") -> Iterator[Leaf]:
    """Yield all entries of a section that are set, in the order in which they are written."""
    for name, field in entries_of(type(section)).items():
        value, path = getattr(section, name), f"{above}{name}"
        quantity = entry_of(field)
        unit = quantity.unit if isinstance(quantity, Quantity) else None
        is_shown = field.is_required() or value != field.default
        for place, item in _items(value, path):
            if isinstance(item, Section):
                yield from leaves_of(item, f"{place}.")
            else:
                what = _what(type(section), name, field)
                text = in_words(item, unit, name)
                if isinstance(quantity, File):  # wherever it is
                    text = PurePath(text).name
                yield Leaf(place, what, item, text, is_shown)


def _what(section: type[BaseModel], name: str, field: FieldInfo) -> str:
    """Return the description of an entry; for the key of a section's kind, that of the kind."""
    kinds = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
    if name in KINDS_ARE_NAMED_BY and len(kinds) == 1:
        return (section.__doc__ or "").partition("\n")[0].rstrip(".").replace("``", "")
    return UNIT.sub("", field.description or "")


def taken(case: Case) -> list[tuple[str, str]]:
    """Return one row with the defaults that a case relies on; no row if it gives every value.

    Equal items of a list appear once. Sections on output and comparison (``LAST``) are left out.
    """
    texts = dict.fromkeys(
        f"{NUMBERS.sub('.*', path)} {scalar(value) if unit is None else plain(value, unit)}"
        for path, value, unit in _not_given(case, "", True)
        if path.partition(".")[0] not in LAST
    )
    return [("defaults", ", ".join(texts))] if texts else []


def _not_given(
    section: BaseModel, above: str, given: bool
) -> Iterator[tuple[str, Any, str | None]]:
    """Yield path, value and unit of all entries that are not given but have a value."""
    for name, field in entries_of(type(section)).items():
        quantity, here = entry_of(field), given and name in section.model_fields_set
        unit = quantity.unit if isinstance(quantity, Quantity) else None
        for place, item in _items(getattr(section, name), f"{above}{name}"):
            if isinstance(item, Section):
                if getattr(item, "wanted", True):  # an unwanted section is not used
                    yield from _not_given(item, f"{place}.", here)
            elif not here and item != ():
                yield place, item, unit if isinstance(item, float) else None


def _items(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Yield a value, or each item of a list of sections with its number; nothing if not set."""
    if value is None:
        return
    if isinstance(value, tuple) and any(isinstance(item, Section | tuple) for item in value):
        for number, item in enumerate(value):
            yield from _items(item, f"{path}.{number}")
    else:
        yield path, value


def in_words(value: Any, unit: str | None, name: str = "") -> str:
    """Return the value of an entry as text, in a unit that suits its size."""
    if isinstance(value, tuple):
        return ", ".join(in_words(item, unit, name) for item in value) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return str(readable(value, unit or "1", GIVEN, everyday_unit(unit, name)))
    return str(value)
