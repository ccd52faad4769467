"""``fretscale check --out``: the contact faces of a structure, drawn before anything is solved."""

from __future__ import annotations

from pathlib import Path

from fe_models.meshes.structure_mesh import MeshError
from workflow.analyses.wear.case.base import WearCase
from workflow.analyses.wear.figures.faces import write_faces
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.structures import structure_of
from workflow.errors import UserError
from workflow.models.structure import StructureLoads
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import locked

FIGURE = "contact_faces.png"


def draw_faces(case: WearCase, name: str, out: Path, force: bool) -> Path:
    """Draw where the contact faces of a case meet into a folder, and return the picture's path.

    ``name`` is the name of the case in messages. Raises UserError where there is no mesh.
    """
    structure = structure_of(case)
    source = loads_of(case)
    if not isinstance(source, StructureLoads):
        raise UserError(
            f"{name}: structure.kind: {structure.name} has no meshed faces to draw; allowed with "
            "--out: mesh or dovetail"
        )
    try:
        mesh = source.mesh
    except MeshError as error:
        raise UserError(f"{name}: structure: {error}") from error
    with locked(out):
        (path,) = OutputFolder(out, "contact faces").replace({FIGURE: "contact faces"}, force)
        write_faces(mesh, case.title, path)
    return path
