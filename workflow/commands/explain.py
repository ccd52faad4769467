"""Explanations of the codes of warnings and errors, for the command ``explain``."""

from __future__ import annotations

from collections.abc import Iterator
from difflib import get_close_matches

from workflow.errors import UserError
from workflow.messages.error_kinds import ErrorKind
from workflow.messages.kinds import MessageKind
from workflow.messages.warning_kinds import WarningKind


def explained(code: str | None) -> Iterator[tuple[str, str]]:
    """Yield the explanation of a code in rows of name and text; without a code, all titles.

    Raises UserError for a code that does not exist.
    """
    kinds: dict[str, MessageKind] = {kind.code: kind for kind in (*WarningKind, *ErrorKind)}
    if code is None:
        yield from ((known, kind.title) for known, kind in kinds.items())
        return
    if code.upper() not in kinds:
        nearest = get_close_matches(code.upper(), kinds, cutoff=0.0)
        raise UserError(f"{code}: no such code; nearest: {', '.join(nearest)}")
    kind = kinds[code.upper()]
    yield kind.code, kind.title
    yield "meaning", kind.meaning
    yield "to do", kind.remedy
