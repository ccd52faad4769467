"""Where to look first in the folder of a finished run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

REPORT, FIGURES, PARAVIEW = "report.html", "figures", "paraview"
# What shows all times of a run comes before what shows one.
KINDS = ".pvsm", ".pvd", ".vtm", ".vtp", ".vtu"


def first_look(root: Path, drawn: Sequence[str]) -> Iterator[str]:
    """Lines with the report, one figure and one file for ParaView, of those that there are.

    ``drawn`` are the names of the figures, the first of which is to be looked at.
    """
    found = {
        "report": root / REPORT if (root / REPORT).exists() else None,
        "figure": next(iter(sorted((root / FIGURES).glob(f"{drawn[0]}.*"))), None)
        if drawn
        else None,
        "ParaView": _in_paraview(root / PARAVIEW),
    }
    there = {name: path for name, path in found.items() if path is not None}
    yield f"done: {root}" + ("; look first at" if there else "")
    for name, path in there.items():
        yield f"  {name:<8}  {path}"


def _in_paraview(folder: Path) -> Path | None:
    """The file to open first: by its kind, then by its name."""
    paths = [path for kind in KINDS for path in sorted(folder.glob(f"*{kind}"))]
    return paths[0] if paths else None
