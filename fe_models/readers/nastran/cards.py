"""Entries of Nastran bulk data with their fields and their lines in the file.

Fields may be small ones of 8 columns, large ones of 16 or free ones between commas, with
continuations, as in the Nastran Quick Reference Guide (Bulk Data Entries, Format of Bulk Data
Entries).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.abaqus.cards import SourceLine, included_file
from fe_models.readers.text_files import open_text

SMALL, LARGE = 8, 16
INCLUDE, END = "INCLUDE", "ENDDATA"
# An exponent may follow its sign without a letter: 1.5-3 is 0.0015.
BARE_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")


def fortran_real(text: str) -> float:
    """Return a number written in Fortran's forms: 1.5D-3, 1.5-3, 0.5-101. Raises ``ValueError``."""
    plain = text.strip().upper().replace("D", "E")
    return float(plain if "E" in plain else BARE_EXPONENT.sub(r"E\1", plain))


@dataclass
class BulkEntry:
    """Bulk data entry: its line, its name, and its fields without continuation marks."""

    place: SourceLine
    name: str
    fields: list[str] = field(default_factory=list)

    def text(self, index: int) -> str:
        """Return a field, counted from zero after the name; empty if it is not given."""
        return self.fields[index] if index < len(self.fields) else ""

    def whole(self, index: int) -> int:
        """Return a field that is a whole number. Raises :class:`MeshError`."""
        try:
            return int(self.text(index))
        except ValueError:
            raise self.wrong(f"{self.text(index)!r} is not a whole number") from None

    def real(self, index: int) -> float:
        """Return a field that is a number, 0 if it is empty. Raises :class:`MeshError`."""
        text = self.text(index)
        try:
            return fortran_real(text) if text else 0.0
        except ValueError:
            raise self.wrong(f"{self.text(index)!r} is not a number") from None

    def wrong(self, what: str) -> MeshError:
        """Return the error that names the entry and its line."""
        return MeshError(f"{self.place}: {self.name}: {what}")


@dataclass
class BulkData:
    """Entries of a file in their order, and the comments, which may contain names."""

    entries: list[BulkEntry] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)


def bulk_data(path: Path) -> BulkData:
    """Return the entries between ``BEGIN BULK`` and ``ENDDATA``, or all; ``INCLUDE`` is followed.

    Raises :class:`MeshError` for a line that is not an entry, and for missing included files.
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
    """Yield lines that are not blank, with tabs expanded and included files inserted."""
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
            yield from _lines(*included_file(place, match[1], including))


def _take(entries: list[BulkEntry], place: SourceLine, line: str) -> None:
    """Add a line as a new entry, or as the continuation of the last one."""
    text = line if line.startswith("$") else line.partition("$")[0].rstrip()
    if not text:
        return
    head, fields, width = _divided(text)
    if not head or head[0] in "+*":
        if not entries:
            raise MeshError(f"{place}: is not Nastran bulk data; allowed: entries such as GRID")
        known = entries[-1].fields
        # Empty fields complete the line before, of 4 or 8 fields.
        known += [""] * (-len(known) % width) + fields
        return
    name = head.rstrip("*").upper()
    if not re.fullmatch(r"[A-Z]\w*", name):
        raise MeshError(
            f"{place}: {head!r} is not an entry of Nastran bulk data; allowed: entries written "
            "out, such as GRID"
        )
    entries.append(BulkEntry(place, name, fields))


def _divided(text: str) -> tuple[str, list[str], int]:
    """Return the first field of a line, its data fields, and the number of them in a full line."""
    if "," in text:
        head, *fields = [part.strip() for part in text.split(",")]
        count = 4 if head.endswith("*") or head.startswith("*") else 8
        return head, fields[:count], count
    head = text[:SMALL].strip()
    width, count = (LARGE, 4) if "*" in head else (SMALL, 8)
    body = text[SMALL : SMALL + width * count]
    return head, [body[k : k + width].strip() for k in range(0, len(body), width)], count


def summary_line(entry: BulkEntry) -> str:
    """Return an entry in one line: its place in the file and its fields."""
    shown = ", ".join(text for text in entry.fields[:8])
    return (
        f"{entry.place.short}: {entry.name}: {shown.rstrip(', ')}{' ...' * (len(entry.fields) > 8)}"
    )
