"""Reading of case files into a ``Case``, with errors that list everything that is wrong."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from workflow.case.fields import NO_CONTEXT, File, shown
from workflow.case.sections import Case, Section, words_of
from workflow.case.source import KeyPath, Source, dotted, read_text
from workflow.case.text.explain import Explanation
from workflow.errors import CaseError

AnyCase = TypeVar("AnyCase", bound=Case)
AnySection = TypeVar("AnySection", bound=Section)
YAML = ".yaml"
# Commands that take a file, and the key by which such a file is recognized.
KNOWN_BY = {"sweep": "case", "fit": "fit", "run": "analysis"}

Kinds = Sequence[type[AnyCase]] | Callable[[object], Sequence[type[AnyCase]]]
"""Kinds of cases, or a function that returns those that belong to the word of an analysis."""


def load_case(
    path: str | Path,
    kinds: Kinds[AnyCase],
    overrides: Sequence[str] = (),
    within: Sequence[str] = (),
) -> AnyCase:
    """Return the case in file ``path``, one of ``kinds``, with overrides applied.

    Overrides are texts such as ``"wear.cycles=1e4"``. Raises ``CaseError`` with one line
    ``file:line: key: what is wrong; allowed: ...`` for each error; ``--set key=value`` replaces
    file and line where an override is at fault. ``within`` are the cases that led to this one,
    each named by the one before.
    """
    return parse_case(read_text(Path(path)), str(path), kinds, overrides, within)


def parse_case(
    text: str,
    name: str,
    kinds: Kinds[AnyCase],
    overrides: Sequence[str] = (),
    within: Sequence[str] = (),
) -> AnyCase:
    """Return the case in ``text``, as ``load_case`` does; ``name`` stands for the file in messages.

    Relative file names in the case start from the folder of ``name``.
    """
    source = Source(name, text, overrides)
    check_command(source, "run")
    known = kinds(source.at(("analysis",))) if callable(kinds) else kinds
    return validated(source, _kind_of_case(source, known), within)


def validated(source: Source, model: type[AnySection], within: Sequence[str] = ()) -> AnySection:
    """Return the source as a ``model``; raise ``CaseError`` with a line for each error."""
    known = (*within, os.path.realpath(source.name))
    context = {"folder": str(Path(source.name).parent), "within": known}
    try:
        return model.model_validate(source.data, context=context)
    except ValidationError as error:
        raise CaseError("\n".join(Explanation(source, model).lines(error.errors()))) from None


class OtherKind(CaseError):
    """Case whose analysis or structure is not one of those that are accepted here."""


@dataclass(frozen=True)
class CaseFile(File):
    """File that, if it is YAML, is a case of one of ``kinds``; messages call it a case of ``what``.

    It is read together with the case that names it, so that its errors are reported before any run.
    """

    kinds: tuple[type[Case], ...]
    what: str
    # Returns why a valid case cannot be used here; empty if it can.
    unfit: Callable[[Any], str] = lambda case: ""

    @property
    def allowed(self) -> str:
        others = "".join(f" or a file {ending}" for ending in self.endings if ending != YAML)
        return f"a case of {self.what}{others}, with its path from the folder of the case"

    def parse(self, value: object, context: Mapping[str, Any] = NO_CONTEXT) -> str:
        path = super().parse(value, context)
        if not path.endswith(YAML):
            return path
        within = context.get("within", ())
        if os.path.realpath(path) in within:
            raise self.refusal(value, "the case itself, or one that names it")
        try:
            case = load_case(path, self.kinds, within=within)
        except OtherKind as error:
            raise self.refusal(value, f"no case of {self.what} ({error})") from error
        except CaseError as error:
            raise self.refusal(value, f"cannot be run ({str(error).splitlines()[0]})") from error
        if wrong := self.unfit(case):
            raise self.refusal(value, wrong)
        return path


def outline_of(file: str, model: type[AnyCase], rows: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return rows of the outline of the case in ``file``, under new names.

    ``rows`` maps the names of the rows to return to their new names.
    """
    found = load_case(file, [model]).outline()
    return [(rows[name], text) for name, text in found if name in rows]


def _kind_of_case(source: Source, kinds: Sequence[type[AnyCase]]) -> type[AnyCase]:
    """Return the kind that the source means by its analysis and structure, despite other errors."""
    for path in (("analysis",), ("structure", "kind")):
        words = dict.fromkeys(word for kind in kinds for word in words_of(kind, *path))
        word = word_at(source, path, tuple(words))
        kinds = [kind for kind in kinds if word in words_of(kind, *path)]
        if path == ("analysis",):
            kinds = [kind for kind in kinds if kind.suits(source)] or kinds
    return kinds[0]


def check_command(source: Source, command: str) -> None:
    """Raise OtherKind if the file is of a type that another command takes."""
    taken_by = next((word for word, key in KNOWN_BY.items() if source.at((key,)) is not None), None)
    if taken_by is not None and taken_by != command:
        raise OtherKind(
            f"{source.name}: this is a {taken_by.replace('run', 'case')}; run it with `fretscale "
            f"{taken_by} {source.name} --out DIR`"
        )


def word_at(source: Source, path: KeyPath, allowed: tuple[str, ...]) -> str:
    """Return the word at ``path``, one of those ``allowed``; else raise :class:`OtherKind`."""
    value = source.at(path)
    if isinstance(value, str) and value in allowed:
        return value
    wrong = "missing" if value is None else f"{shown(value)}: not known"
    place = source.where(path)[1]
    key = dotted(path)
    named = "" if place.startswith(f"--set {key}=") else f"{key}: "
    raise OtherKind(f"{place}: {named}{wrong}; allowed: {', '.join(allowed)}")
