"""Scripts that show a run in ParaView, and the file to open first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib import resources
from pathlib import Path
from pprint import pformat

from workflow.shell.folders.store import write_text

FIRST = "view.py"
PLACEHOLDER = "SCENE: dict[str, Any] = {}\n"


@dataclass(frozen=True)
class Shown:
    """Series in a view: its ``file``, and the arrays, with units, for colours and motion.

    With a ``factor`` of 0 the motion is scaled to be well visible.
    """

    file: str
    colour: str = ""
    warp: str = ""
    factor: float = 0.0


@dataclass(frozen=True)
class View:
    """View of the window; everything in ``shown`` has the times of the first series."""

    title: str
    shown: Sequence[Shown]


@dataclass(frozen=True)
class PictureScene:
    """One to four ``views``; ``time`` names their times, and ``begin`` is the first one shown."""

    title: str
    time: str
    begin: float
    views: Sequence[View]


def write_view(scene: PictureScene, path: Path) -> Path:
    """Write the script that shows a scene; return its path."""
    script = resources.files("workflow.pictures").joinpath("view_script.py")
    text = script.read_text(encoding="utf-8")
    what = pformat(asdict(scene), width=98, sort_dicts=False)
    assert PLACEHOLDER in text
    write_text(path, text.replace(PLACEHOLDER, f"SCENE: dict[str, Any] = {what}\n"))
    return path


def first_file(run: Path) -> Path | None:
    """Return the file of a run that should be opened first in ParaView, if there is one."""
    path = run / "paraview" / FIRST
    return path if path.exists() else None
