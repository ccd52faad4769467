"""``fretscale describe``: names in a mesh or CAD file that a case may use, listed and drawn."""

from __future__ import annotations

import os
from pathlib import Path
from typing import get_args

from fe_models.geometry.imported import ImportedMesh, read_bodies
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.length_unit import SIZES
from workflow.case.fields import quantity_of_option
from workflow.case.sections import Length
from workflow.errors import FolderTaken, UserError
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked
from workflow.shell.folders.store import replacing

FIGURE, PARAVIEW = "assembly.png", "assembly.vtu"


def read_file(file: Path, size: str | None, unit: str | None) -> ImportedMesh:
    """Return the bodies of a mesh or CAD file.

    ``size`` is the element size as text with a unit, ``unit`` the unit of lengths in the file.
    Raises UserError.
    """
    if unit is not None and unit not in SIZES:
        raise UserError(f"--unit: {unit!r}; allowed: {', '.join(SIZES)}")
    length = None if size is None else quantity_of_option(size, get_args(Length)[1], "--size:")
    try:
        return read_bodies(file, length, unit)
    except MeshError as error:
        raise UserError(str(error)) from error


def write_assembly(imported: ImportedMesh, out: Path, title: str, force: bool) -> list[Path]:
    """Draw the bodies of the file ``title`` into a folder, and write them for ParaView."""
    from workflow.commands.assembly import shown_bodies, write_vtu
    from workflow.commands.assembly_figure import write_figure

    with locked(out):
        folder = OutputFolder(out, "bodies of a mesh file")
        paths = folder.replace(dict.fromkeys((FIGURE, PARAVIEW), "described file"), force)
        write_figure(shown_bodies(imported), title, paths[0])
        write_vtu(imported, paths[1])
    return paths


def write_offer(
    imported: ImportedMesh, file: Path, size: str | None, case: Path, force: bool
) -> list[str]:
    """Write a case from the contents of a file; return lines on contents that it leaves out."""
    from workflow.commands.offered_case import offered_case

    if case.exists() and not force:
        raise FolderTaken(f"{case}: exists; take another name, or --force to overwrite it")
    offer = offered_case(imported, os.path.relpath(file, case.parent or "."), size)
    with replacing(case) as partial:
        partial.write_text(offer.text, encoding="utf-8")
    return [*(f"not in the case: {line}" for line in offer.ignored), str(case)]
