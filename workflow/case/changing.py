"""A case with other values at some of its entries, not validated again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from workflow.case.sections import Section

Chosen = TypeVar("Chosen", bound=Section)


def changed(section: Chosen, values: Mapping[str, Any]) -> Chosen:
    """The section with other values at dotted paths; the caller knows which go together."""
    for path, value in values.items():
        name, _, below = path.partition(".")
        inner = changed(getattr(section, name), {below: value}) if below else value
        section = section.model_copy(update={name: inner})
    return section
