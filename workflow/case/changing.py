"""A case with other values at some of its entries, not validated again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from workflow.case.sections import Section

Chosen = TypeVar("Chosen", bound=Section)


def changed(section: Chosen, values: Mapping[str, Any]) -> Chosen:
    """The section with other values at dotted paths; the caller knows which go together."""
    for entry, value in values.items():
        section = _changed(section, entry.split("."), value)
    return section


def _changed(section: Chosen, path: list[str], value: Any) -> Chosen:
    name, *rest = path
    if rest:
        value = _changed(getattr(section, name), rest, value)
    return section.model_copy(update={name: value})
