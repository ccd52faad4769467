"""Keywords of an Abaqus input file with their parameters, data lines and places in the file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.text_files import open_text


class SourceLine(NamedTuple):
    """Line of a file, for messages; the number is 0 for files without lines."""

    path: Path
    line: int

    def __str__(self) -> str:
        return f"{self.path}{f':{self.line}' * (self.line > 0)}"

    @property
    def short(self) -> str:
        """Place with the name of the file instead of its path."""
        return f"{self.path.name}:{self.line}"


class DataLine(NamedTuple):
    """Data line: its place in the file and its fields without blanks."""

    place: SourceLine
    fields: list[str]


@dataclass
class Card:
    """Keyword, in upper case and without blanks, with its parameters and data lines."""

    place: SourceLine
    keyword: str
    parameters: dict[str, str] = field(default_factory=dict)
    rows: list[DataLine] = field(default_factory=list)

    def name(self, parameter: str) -> str:
        """Return the value of a required parameter. Raises :class:`MeshError` if it is missing."""
        if not self.parameters.get(parameter):
            raise MeshError(f"{self.place}: *{self.keyword} needs {parameter.lower()}=name")
        return self.parameters[parameter]


def cards(path: Path) -> Iterator[Card]:
    """Yield the keywords of a file in their order; ``*Include`` is followed, comments are skipped.

    Raises :class:`MeshError` if data come before any keyword or an included file is missing.
    """
    card = None
    unfinished = ""
    for place, text in _lines(path, ()):
        if unfinished or text.startswith("*"):
            unfinished += text
            if text.endswith(","):  # It continues in the next line.
                continue
            if card is not None:
                yield card
            card = _card(place, unfinished)
            unfinished = ""
        elif card is None:
            raise MeshError(f"{place}: is not Abaqus input; allowed: keywords that begin with *")
        else:
            card.rows.append(
                DataLine(place, [part.strip() for part in text.rstrip(",").split(",")])
            )
    if card is None:
        raise MeshError(f"{path}: has no keywords")
    yield card


def integer(place: SourceLine, text: str) -> int:
    """Return the number of a node or an element. Raises :class:`MeshError`."""
    try:
        return int(text)
    except ValueError:
        raise MeshError(f"{place}: {text!r} is not a whole number") from None


def real(place: SourceLine, text: str) -> float:
    """Return a coordinate or an angle; an empty field is 0, as in Abaqus."""
    try:
        return float(text.upper().replace("D", "E")) if text else 0.0
    except ValueError:
        raise MeshError(f"{place}: {text!r} is not a number") from None


def _lines(path: Path, including: tuple[Path, ...]) -> Iterator[tuple[SourceLine, str]]:
    """Yield lines that are neither blank nor comments, with included files inserted."""
    # Comments may be in any encoding.
    with open_text(path) as file:
        for number, line in enumerate(file, start=1):
            text = line.strip()
            if not text or text.startswith("**"):
                continue
            if not text.replace(" ", "").upper().startswith("*INCLUDE,"):
                yield SourceLine(path, number), text
                continue
            card = _card(SourceLine(path, number), text)
            yield from _lines(*included_file(card.place, card.name("INPUT"), including))


def included_file(
    place: SourceLine, name: str, including: tuple[Path, ...]
) -> tuple[Path, tuple[Path, ...]]:
    """Return the path of a file that a line includes, and the files that include it.

    Raises :class:`MeshError` if it is missing or includes itself.
    """
    included, including = place.path.parent / name, (*including, place.path)
    if not included.is_file() or included in including:
        why = "includes itself" if included.is_file() else "is missing"
        raise MeshError(f"{place}: the included file {name} {why}")
    return included, including


def _card(place: SourceLine, text: str) -> Card:
    """Return the card of a keyword line; values in quotes may contain commas and blanks."""
    keyword, *parts = re.findall(r'(?:"[^"]*"|[^,"])+', text)
    parameters = {}
    for part in parts:
        key, _, value = part.partition("=")
        parameters[key.strip().upper()] = value.strip().strip('"')
    return Card(place, re.sub(r"\s", "", keyword)[1:].upper(), parameters)
