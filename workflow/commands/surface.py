"""``fretscale surface``: the surface of a worn body as a profilometer would measure it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np

from sa_solver.surfaces.scans import Scan
from sa_solver.types import Array, Grid
from workflow.case.files.input_files import open_hdf5
from workflow.case.files.scan_files import write_scan
from workflow.case.sections import Case
from workflow.errors import FolderTaken, UserError
from workflow.kinds import load_case
from workflow.runs.provenance import case_values
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.store import replacing
from workflow.shell.output.results import grid_of


def write_surface(
    folder: Path, file: Path, body: str, unworn: bool, interface: str | None, force: bool
) -> str:
    """Write the heights of ``body`` 1 or 2, after the last jump or ``unworn``; return a summary.

    Heights are positive out of the body. The upper body is turned over about x, as it lies under an
    instrument. Raises UserError.
    """
    if file.exists() and not force:
        raise FolderTaken(f"{file}: exists; allowed: another name, or --force")
    run = OutputFolder(folder)
    run.check_ended()
    run.check_results(case_values(run))
    with open_hdf5(str(run.results)) as results:
        name, jump = _place(folder, results, interface, unworn)
        grid = grid_of(results[f"grid/{name}"])
        heights = np.asarray(results[f"surfaces/{name}/{jump}/body_{body}"][()])
        cycles = float(results[f"surfaces/{name}/{jump}"].attrs["cycles"])
    if grid.line:
        raise UserError(f"{folder}: a line contact; allowed: a contact over an area")
    lower = _measured_lower(load_case(run.case), name, grid)
    # In this frame body 1 is flat at first, and body 2 has the whole initial gap.
    out = heights + lower if body == "1" else -(heights + lower)
    scan = Scan(out, grid.pitch)
    with replacing(file) as place:
        write_scan(place, scan if body == "1" else scan.turned_over)
    nx, ny = grid.shape
    return f"{file}: {nx} x {ny} points of body {body} of {name}, after {cycles:g} cycles"


def _place(
    folder: Path, results: h5py.File, interface: str | None, unworn: bool
) -> tuple[str, str]:
    """Return the name of the interface and the jump in it; raise UserError."""
    faces = [
        name
        for name, face in results.get("surfaces", {}).items()
        if isinstance(face, h5py.Group) and any("body_1" in jump for jump in _groups(face))
    ]
    if not faces:
        raise UserError(f"{folder}: has no worn surfaces; allowed: a wear run")
    name = _chosen(faces, interface)
    jumps = sorted(results[f"surfaces/{name}"])
    return name, jumps[0 if unworn else -1]


def _groups(face: h5py.Group) -> list[h5py.Group]:
    return [item for item in face.values() if isinstance(item, h5py.Group)]


def _chosen(faces: Sequence[str], interface: str | None) -> str:
    if interface is None and len(faces) == 1:
        return faces[0]
    if interface is None or interface not in faces:
        given = "which of several" if interface is None else f"{interface}: no such"
        raise UserError(f"--interface: {given} interface; allowed: {', '.join(faces)}")
    return interface


def _measured_lower(case: Case, name: str, grid: Grid) -> Array | float:
    """Return the measured heights of body 1 of an interface on the grid [mm], 0 if not measured."""
    for face in getattr(case, "scanned", tuple)():
        if face.name == name and (lower := face.surfaces.of(1, grid)) is not None:
            heights: Array = lower.heights
            return heights
    return 0.0
