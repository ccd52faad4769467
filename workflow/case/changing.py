"""Copies of a case with other values at some of its entries, which are not validated again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from workflow.case.sections import Section

Chosen = TypeVar("Chosen", bound=Section)


def changed(section: Chosen, values: Mapping[str, Any]) -> Chosen:
    """Return a copy of the section with other values at dotted paths, ``legs.0.increments``.

    The values are not validated: the caller makes sure that they fit together.
    """
    for path, value in values.items():
        name, _, below = path.partition(".")
        inner = getattr(section, name)
        if below and isinstance(inner, tuple):
            number, _, below = below.partition(".")
            place = int(number)
            inner = (*inner[:place], changed(inner[place], {below: value}), *inner[place + 1 :])
        else:
            inner = changed(inner, {below: value}) if below else value
        section = section.model_copy(update={name: inner})
    return section
