"""Entries of a case one by one: where they are, what they are, and their values in words."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from workflow.case.fields import File, Quantity
from workflow.case.plain import plain
from workflow.case.readable import everyday_unit, readable
from workflow.case.sections import (
    KINDS_ARE_NAMED_BY,
    LAST,
    Case,
    Section,
    entries_of,
    entry_of,
)
from workflow.case.writing import scalar

# At the end of the description of an entry: its base unit.
UNIT = re.compile(r"\s*\[[^\]]*\]$")
# In a path: which one of a list.
NUMBERS = re.compile(r"\.\d+(?=\.|$)")
# What a case gives has no error, and so all its digits.
GIVEN = 0.0


@dataclass(frozen=True)
class Leaf:
    """An entry that is no section: its dotted ``path``, what it is, its value, and that in words.

    ``told`` are values that the case does not take as everybody does who says nothing.
    """

    path: str
    what: str
    value: Any
    text: str
    told: bool


def leaves_of(section: BaseModel, above: str = "") -> Iterator[Leaf]:
    """All entries of a section that are set, in the order in which they are written."""
    for name, field in entries_of(type(section)).items():
        value, path = getattr(section, name), f"{above}{name}"
        quantity = entry_of(field)
        unit = quantity.unit if isinstance(quantity, Quantity) else None
        told = field.is_required() or value != field.default
        for place, item in _items(value, path):
            if isinstance(item, Section):
                yield from leaves_of(item, f"{place}.")
            else:
                what = _what(type(section), name, field)
                text = in_words(item, unit, name)
                if isinstance(quantity, File):  # wherever it is
                    text = PurePath(text).name
                yield Leaf(place, what, item, text, told)


def _what(section: type[BaseModel], name: str, field: FieldInfo) -> str:
    """What an entry is; of that which names the kind of a section, what this kind is."""
    kinds = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
    if name in KINDS_ARE_NAMED_BY and len(kinds) == 1:
        return (section.__doc__ or "").partition("\n")[0].rstrip(".").replace("``", "")
    return UNIT.sub("", field.description or "")


def taken(case: Case) -> list[tuple[str, str]]:
    """A row of what a case takes without being told, as one would write it; none if all is told.

    Of each item of a list alike, once. What is written beside the results is left out.
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
    """Path, value and unit of all entries that are not ``given`` and have a value nevertheless."""
    for name, field in entries_of(type(section)).items():
        quantity, here = entry_of(field), given and name in section.model_fields_set
        unit = quantity.unit if isinstance(quantity, Quantity) else None
        for place, item in _items(getattr(section, name), f"{above}{name}"):
            if isinstance(item, Section):
                if getattr(item, "wanted", True):  # else none of it is used
                    yield from _not_given(item, f"{place}.", here)
            elif not here and item != ():
                yield place, item, unit if isinstance(item, float) else None


def _items(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """A value, or each of a list of sections by its number; nothing where it is not set."""
    if value is None:
        return
    if isinstance(value, tuple) and any(isinstance(item, Section | tuple) for item in value):
        for number, item in enumerate(value):
            yield from _items(item, f"{path}.{number}")
    else:
        yield path, value


def in_words(value: Any, unit: str | None, name: str = "") -> str:
    """A value of an entry, in a unit that suits it."""
    if isinstance(value, tuple):
        return ", ".join(in_words(item, unit, name) for item in value) or "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return str(readable(value, unit or "1", GIVEN, everyday_unit(unit, name)))
    return str(value)
