"""Loads from a file as a load source: nothing to solve, and wear does not change them."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from fe_models.meshes.structure_mesh import Face
from sa_solver.ties import first_largest
from sa_solver.types import Array, Frame, Grid
from wear.contact.drive import Drive
from wear.contact.face_loads import CycleLoads
from workflow.analyses.wear.gaps import gap_over, with_measured
from workflow.analyses.wear.structures.resultants.case import ResultantsCase
from workflow.analyses.wear.structures.resultants.imported import ImportedLoads
from workflow.analyses.wear.worn.worn_nodes import read_nodes
from workflow.models.loads import (
    BODIES,
    COARSER,
    ContactFace,
    UncoupledSource,
    UserFace,
    coarse_cells,
    nominal_face,
)

REMEDY = "enlarge structure.size, and contact.grid with it"


class ResultantsSource(UncoupledSource):
    """The interfaces of a file as load source of a wear run."""

    def __init__(self, case: ResultantsCase) -> None:
        self._case = case
        self.line, self.file = case.structure.line, case.structure.file

    @cached_property
    def imported(self) -> dict[str, ImportedLoads]:
        """Data of the file by interface."""
        return self._case.loads()

    @cached_property
    def faces(self) -> tuple[ContactFace, ...]:
        return tuple(self._contact_face(name, imported) for name, imported in self.imported.items())

    @cached_property
    def peak(self) -> int:  # type: ignore[override]
        """First increment in which a face carries the largest P of all faces."""
        heaviest = np.max([imported.loads.P for imported in self.imported.values()], axis=0)
        return first_largest(heaviest)

    def frame(self, name: str) -> Frame | None:
        """Return the frame of a face in the user's axes, or None if it is unknown."""
        return self._case.structure.frame_of(name) or self.imported[name].frame

    def unworn(self) -> tuple[CycleLoads, ...]:
        return tuple(
            CycleLoads(
                imported.loads,
                _slip(imported, len(contact.face)),
                imported.force,
                imported.displacement,
            )
            for imported, contact in zip(self.imported.values(), self.faces, strict=True)
        )

    def user_faces(self, number: int) -> tuple[UserFace, ...]:
        """Return the user's nodes from the case's tables, or else from the file of loads."""
        name, imported = list(self.imported.items())[number]
        frame, tables = self.frame(name), self._case.structure.nodes_of(name)
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

    def _contact_face(self, name: str, imported: ImportedLoads) -> ContactFace:
        structure = self._case.structure
        grid = Grid.over(structure.size_of(name), self._case.contact.grid, self.line)
        face = self._face(name, imported, grid.size)
        form = gap_over(structure.gap_of(name), imported.height, grid)
        gap = with_measured(form, structure.surfaces_of(name), grid)
        coarse = self._coarse(imported, grid)
        return ContactFace(
            face, grid.size, gap, coarse, REMEDY, drive=Drive.by_forces(imported.tilt)
        )

    def _face(self, name: str, imported: ImportedLoads, size: tuple[float, float]) -> Face:
        """Return the face of the file, or the corners of the nominal one."""
        frame, face = self.frame(name), imported.face(name)
        if face is None:
            return nominal_face(name, size, self.line, frame)
        return replace(face, frame=frame or face.frame)

    def _coarse(self, imported: ImportedLoads, grid: Grid) -> tuple[int, int]:
        """Return about as many squarish cells as the face has nodes; larger ones without nodes."""
        if imported.coordinates is None:
            coarse = grid.shape[0] / COARSER, grid.shape[1] / COARSER
        elif self.line:
            coarse = float(len(imported.coordinates)), 1.0
        else:
            pitch = np.sqrt(grid.size[0] * grid.size[1] / len(imported.coordinates))
            coarse = grid.size[0] / pitch, grid.size[1] / pitch
        return coarse_cells(*coarse, self.line)


def _slip(imported: ImportedLoads, nodes: int) -> Array:
    """Return the slip of the file, or zeros."""
    return np.zeros((len(imported.loads), 2, nodes)) if imported.slip is None else imported.slip
