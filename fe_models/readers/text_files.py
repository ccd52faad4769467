"""Text of mesh files, with or without a byte order mark.

Windows programs put a byte order mark before UTF-8, and write UTF-16 on request.
"""

from __future__ import annotations

from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TextIO

MARKS = {BOM_UTF8: "utf-8-sig", BOM_UTF16_LE: "utf-16", BOM_UTF16_BE: "utf-16"}


def open_text(path: Path) -> TextIO:
    """Open a text file for reading; invalid bytes become replacement characters."""
    return path.open(encoding=_marked(path) or "utf-8", errors="replace")


@contextmanager
def unmarked(path: Path) -> Iterator[Path]:
    """Yield the file, or a copy in UTF-8 without a byte order mark if the file begins with one.

    Readers in libraries take a byte order mark for damage.
    """
    if not _marked(path):
        yield path
        return
    with TemporaryDirectory() as folder, open_text(path) as text:
        copy = Path(folder, path.name)
        copy.write_text(text.read(), encoding="utf-8")
        yield copy


def _marked(path: Path) -> str:
    """Return the encoding that a byte order mark indicates; empty if there is none."""
    with path.open("rb") as file:
        head = file.read(len(BOM_UTF8))
    return next((name for mark, name in MARKS.items() if head.startswith(mark)), "")
