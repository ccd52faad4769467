"""Hints on where to look first in the folder of a finished run, or of many."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from workflow.pictures.view import first_file

REPORT, FIGURES = "report.html", "figures"


def first_look(root: Path, drawn: Sequence[str]) -> Iterator[str]:
    """Yield lines with the report, one figure and one file for ParaView, as far as they exist.

    ``drawn`` are the names of the figures; the first one is shown.
    """
    found = {
        "report": root / REPORT if (root / REPORT).exists() else None,
        "figure": next(iter(sorted((root / FIGURES).glob(f"{drawn[0]}.*"))), None)
        if drawn
        else None,
        "ParaView": _paraview(root),
    }
    yield from look_at(root, {name: path for name, path in found.items() if path is not None})


def look_at(root: Path, places: Mapping[str, Path | str]) -> Iterator[str]:
    """Yield lines with the folder of finished work and its most informative ``places``, by name."""
    yield f"done: {root}" + ("; look first at" if places else "")
    for name, path in places.items():
        yield f"  {name:<8}  {path}"


def _paraview(root: Path) -> str | None:
    """Return the command that shows a run in ParaView, or None if it has no such files."""
    script = first_file(root)
    return None if script is None else f"paraview --script={script}"
