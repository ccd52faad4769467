"""Translation of a case of loads from a file into a model: nothing to solve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fe_models.meshes.structure_mesh import Face
from sa_solver.types import Frame, Grid
from wear.contact.drive import Drive
from wear.contact.face_loads import CycleLoads
from workflow.analyses.wear.gaps import gap_over, with_measured
from workflow.analyses.wear.structures.resultants.case import Resultants, ResultantsCase
from workflow.analyses.wear.structures.resultants.imported import ImportedLoads
from workflow.analyses.wear.worn.worn_nodes import read_nodes
from workflow.models.loads import (
    BODIES,
    COARSER,
    ContactFace,
    UserFace,
    coarse_cells,
    nominal_face,
)
from workflow.models.uncoupled.given_loads import GivenLoads, no_slip

REMEDY = "enlarge structure.size, and contact.grid with it"


def given_loads(case: ResultantsCase) -> GivenLoads:
    """Return the interfaces of the file with their loads."""
    pairs, user_nodes = [], []
    for name, imported in case.loads().items():
        face = _contact_face(case, name, imported)
        pairs.append((face, _cycle(face, imported)))
        user_nodes.append(_user_nodes(case.structure, name, imported))
    return GivenLoads(pairs, user_nodes)


def _cycle(face: ContactFace, imported: ImportedLoads) -> CycleLoads:
    """Return the loads of a face with what the file says of its nodes."""
    slip = no_slip(face, imported.loads) if imported.slip is None else imported.slip
    return CycleLoads(imported.loads, slip, imported.force, imported.displacement)


def _user_nodes(structure: Resultants, name: str, imported: ImportedLoads) -> tuple[UserFace, ...]:
    """Return the user's nodes from the case's tables, or else from the file of loads."""
    frame, tables = _frame(structure, name, imported), structure.nodes_of(name)
    if frame is None:
        return ()
    faces = []
    for body, numbers in zip(BODIES, (imported.nodes_1, imported.nodes_2), strict=True):
        if body in tables:
            table = read_nodes(tables[body])
            faces.append(UserFace(body, table.numbers, frame, table.points))
        elif numbers is not None:
            faces.append(UserFace(body, numbers, frame))
    return tuple(faces)


def _contact_face(case: ResultantsCase, name: str, imported: ImportedLoads) -> ContactFace:
    structure = case.structure
    grid = Grid.over(structure.size_of(name), case.contact.grid, structure.line)
    form = gap_over(structure.gap_of(name), imported.height, grid)
    return ContactFace(
        _face(structure, name, imported, grid.size),
        grid.size,
        with_measured(form, structure.surfaces_of(name), grid),
        _coarse(imported, grid),
        REMEDY,
        drive=Drive.by_forces(imported.tilt),
    )


def _frame(structure: Resultants, name: str, imported: ImportedLoads) -> Frame | None:
    """Return the frame of a face in the user's axes, or None if it is unknown."""
    return structure.frame_of(name) or imported.frame


def _face(
    structure: Resultants, name: str, imported: ImportedLoads, size: tuple[float, float]
) -> Face:
    """Return the face of the file, or the corners of the nominal one."""
    frame, face = _frame(structure, name, imported), imported.face(name)
    if face is None:
        return nominal_face(name, size, structure.line, frame)
    return replace(face, frame=frame or face.frame)


def _coarse(imported: ImportedLoads, grid: Grid) -> tuple[int, int]:
    """Return about as many squarish cells as the face has nodes; larger ones without nodes."""
    if imported.coordinates is None:
        coarse = grid.shape[0] / COARSER, grid.shape[1] / COARSER
    elif grid.line:
        coarse = float(len(imported.coordinates)), 1.0
    else:
        pitch = np.sqrt(grid.size[0] * grid.size[1] / len(imported.coordinates))
        coarse = grid.size[0] / pitch, grid.size[1] / pitch
    return coarse_cells(*coarse, grid.line)
