"""A case file to a ``Case``, or to the lines that say why not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from workflow.case.explain import Explanation
from workflow.case.fields import shown
from workflow.case.sections import Case, Section, words_of
from workflow.case.source import KeyPath, Source, dotted, read_text
from workflow.errors import CaseError, UserError

AnyCase = TypeVar("AnyCase", bound=Case)
AnySection = TypeVar("AnySection", bound=Section)


def load_case(
    path: str | Path, kinds: Sequence[type[AnyCase]], overrides: Sequence[str] = ()
) -> AnyCase:
    """The case in file ``path``, one of ``kinds``, with overrides (``"wear.cycles=1e4"``) on top.

    Raises ``CaseError`` with one line ``file:line: key: what is wrong; allowed: ...`` for each
    thing wrong, ``--set key=value`` in the place of file and line where an override is at fault.
    """
    return parse_case(read_text(Path(path)), str(path), kinds, overrides)


def parse_case(
    text: str, name: str, kinds: Sequence[type[AnyCase]], overrides: Sequence[str] = ()
) -> AnyCase:
    """As ``load_case``, from ``text``; ``name`` stands for the file in messages.

    Files that the case names are looked for from the folder of ``name``.
    """
    source = Source(name, text, overrides)
    return validated(source, _kind_of_case(source, kinds))


def validated(source: Source, model: type[AnySection]) -> AnySection:
    """What the source says, as a ``model``. Raises ``CaseError``, a line for each thing wrong."""
    try:
        return model.model_validate(source.data, context={"folder": str(Path(source.name).parent)})
    except ValidationError as error:
        raise CaseError("\n".join(Explanation(source, model).lines(error.errors()))) from None


class OtherKind(CaseError):
    """A case whose analysis or structure is none of those asked for."""


def load_named(key: str, file: str, kinds: Sequence[type[AnyCase]], what: str) -> AnyCase:
    """The case in a ``file`` that another case names at ``key``: ``what``, one of ``kinds``.

    Raises UserError.
    """
    try:
        return load_case(file, kinds)
    except OtherKind as error:
        message = f"{key}: {file} is no case of {what}; allowed: such a case ({error})"
        raise UserError(message) from error
    except CaseError as error:
        raise UserError(f"{key}: {error}") from error


def _kind_of_case(source: Source, kinds: Sequence[type[AnyCase]]) -> type[AnyCase]:
    """The kind that the source means by its analysis and structure, whatever else is wrong."""
    for path in (("analysis",), ("structure", "kind")):
        words = dict.fromkeys(word for kind in kinds for word in words_of(kind, *path))
        word = word_at(source, path, tuple(words))
        kinds = [kind for kind in kinds if word in words_of(kind, *path)]
        if path == ("analysis",):
            kinds = [kind for kind in kinds if kind.suits(source)] or kinds
    return kinds[0]


def word_at(source: Source, path: KeyPath, allowed: tuple[str, ...]) -> str:
    """The word at ``path``, one of those ``allowed``; else raises :class:`OtherKind`."""
    value = source.at(path)
    if isinstance(value, str) and value in allowed:
        return value
    wrong = "missing" if value is None else f"{shown(value)}: not known"
    place = source.where(path)[1]
    key = dotted(path)
    named = "" if place.startswith(f"--set {key}=") else f"{key}: "
    raise OtherKind(f"{place}: {named}{wrong}; allowed: {', '.join(allowed)}")
