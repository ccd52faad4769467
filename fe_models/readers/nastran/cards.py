"""Entries of Nastran bulk data with their fields, and where they stand.

Small fields of 8 columns, large ones of 16 and free ones between commas, with continuations, as in
the Nastran Quick Reference Guide (Bulk Data Entries, Format of Bulk Data Entries).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import SourceLine
from fe_models.readers.text_files import open_text

SMALL, LARGE = 8, 16
INCLUDE, END = "INCLUDE", "ENDDATA"
# An exponent may follow its sign without a letter: 1.5-3 is 0.0015.
BARE_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")


def fortran_real(text: str) -> float:
    """A number as Fortran writes it: 1.5D-3, 1.5-3, 0.5-101. Raises ``ValueError``."""
    plain = text.strip().upper().replace("D", "E")
    return float(plain if "E" in plain else BARE_EXPONENT.sub(r"E\1", plain))


@dataclass
class Entry:
    """A bulk data entry: its name, its fields without the continuation marks, and its line."""

    place: SourceLine
    name: str
    fields: list[str] = field(default_factory=list)

    def text(self, index: int) -> str:
        """A field, counted from zero behind the name; empty if it is not given."""
        return self.fields[index] if index < len(self.fields) else ""

    def whole(self, index: int) -> int:
        """A field that is a whole number. Raises :class:`MeshError`."""
        try:
            return int(self.text(index))
        except ValueError:
            raise self.wrong(f"{self.text(index)!r} is no whole number") from None

    def real(self, index: int) -> float:
        """A field that is a number; an empty one is 0. Raises :class:`MeshError`."""
        text = self.text(index)
        try:
            return fortran_real(text) if text else 0.0
        except ValueError:
            raise self.wrong(f"{self.text(index)!r} is no number") from None

    def wrong(self, what: str) -> MeshError:
        """What is wrong with it, at its line."""
        return MeshError(f"{self.place}: {self.name}: {what}")


@dataclass
class BulkData:
    """The entries of a file in their order, and the comments, which hold names."""

    entries: list[Entry] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)


def bulk_data(path: Path) -> BulkData:
    """Entries between ``BEGIN BULK`` and ``ENDDATA``, or all; ``INCLUDE`` is followed.

    Raises :class:`MeshError` at what is no entry and at included files that are missing.
    """
    found = BulkData()
    lines = list(_lines(path, ()))
    heads = (text.split()[:2] for _, text in lines)
    begin = next((k for k, head in enumerate(heads) if "".join(head).upper() == "BEGINBULK"), -1)
    for place, text in lines[begin + 1 :]:
        if text.startswith("$"):
            found.comments.append(text)
        elif text.lstrip()[: len(END)].upper() == END:
            break
        else:
            _take(found.entries, place, text)
    return found


def _lines(path: Path, including: tuple[Path, ...]) -> Iterator[tuple[SourceLine, str]]:
    """Lines that are not blank, with spaces for tabs; those of included files in their place."""
    with open_text(path) as file:
        for number, line in enumerate(file, start=1):
            text, place = line.expandtabs(SMALL).rstrip(), SourceLine(path, number)
            if not text:
                continue
            match = None
            if text.lstrip()[: len(INCLUDE)].upper() == INCLUDE:
                match = re.fullmatch(
                    r"['\"]?([^'\"]+?)['\"]?", text.lstrip()[len(INCLUDE) :].strip()
                )
            if match is None:
                yield place, text
                continue
            included = path.parent / match[1]
            if not included.is_file() or included in (*including, path):
                raise MeshError(
                    f"{place}: the included file {match[1]} "
                    + ("is missing" if not included.is_file() else "includes itself")
                )
            yield from _lines(included, (*including, path))


def _take(entries: list[Entry], place: SourceLine, line: str) -> None:
    """Add a line as a new entry, or as the continuation of the last one."""
    text = line if line.startswith("$") else line.partition("$")[0].rstrip()
    if not text:
        return
    head, fields, width = _divided(text)
    if not head or head[0] in "+*":
        if not entries:
            raise MeshError(f"{place}: is no Nastran bulk data; allowed: entries such as GRID")
        entries[-1].fields += _filled(entries[-1].fields, width) + fields
        return
    name = head.rstrip("*").upper()
    if not re.fullmatch(r"[A-Z]\w*", name):
        raise MeshError(
            f"{place}: {head!r} is no entry of Nastran bulk data; allowed: entries written out, "
            "such as GRID"
        )
    entries.append(Entry(place, name, fields))


def _divided(text: str) -> tuple[str, list[str], int]:
    """First field, the data fields of a line, and how many of them a full line has."""
    if "," in text:
        head, *fields = [part.strip() for part in text.split(",")]
        count = 4 if head.endswith("*") or head.startswith("*") else 8
        return head, fields[:count], count
    head = text[:SMALL].strip()
    width, count = (LARGE, 4) if "*" in head else (SMALL, 8)
    body = text[SMALL : SMALL + width * count]
    return head, [body[k : k + width].strip() for k in range(0, len(body), width)], count


def _filled(fields: list[str], width: int) -> list[str]:
    """Empty fields up to the end of the line before: lines of 4 or 8 fields follow each other."""
    return [""] * (-len(fields) % width)


def told(entry: Entry) -> str:
    """An entry in a line: where it stands, and its fields."""
    shown = ", ".join(text for text in entry.fields[:8])
    return (
        f"{entry.place.short}: {entry.name}: {shown.rstrip(', ')}{' ...' * (len(entry.fields) > 8)}"
    )
