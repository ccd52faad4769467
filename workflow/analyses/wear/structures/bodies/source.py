"""Two bodies that slide to and fro on each other as a load source: nothing to solve."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from fe_models.mesh import Face
from sa_solver.types import Array, Frame, Grid, LoadHistory
from wear.interface import CycleLoads
from workflow.analyses.contact.case import Heights, Shape
from workflow.analyses.wear.gaps import GapFunction, GridHeights
from workflow.analyses.wear.load_source import ContactFace, UserFace
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase, LineBodiesWearCase
from workflow.case.input_files import read_heights

NAME = "interface"
# The grid that shows what a coarse one misses has cells so many times larger.
COARSER = 4
# Cells below which a contact is hardly one.
FEWEST = 8
REMEDY = "enlarge contact.size, and contact.grid with it"


class BodiesSource:
    """Two bodies as load source of a wear run: forces of gross sliding over the whole stroke."""

    def __init__(self, case: BodiesWearCase | LineBodiesWearCase) -> None:
        self._case = case
        self.line = isinstance(case, LineBodiesWearCase)

    @cached_property
    def faces(self) -> tuple[ContactFace, ...]:
        grid = self._grid
        coarse = tuple(max(FEWEST, cells // COARSER) for cells in grid.shape)
        return (
            ContactFace(
                self._face(grid.size),
                grid.size,
                gap_of(self._case.structure, grid),
                (coarse[0], 1 if self.line else coarse[1]),
                REMEDY,
                driven=True,
            ),
        )

    @property
    def peak(self) -> int:
        """The increment that passes the middle on the way there: all are loaded alike."""
        return self._case.load_path.increments // 2

    def prepare(self) -> None:
        """Nothing is costly."""

    def unworn(self) -> tuple[CycleLoads, ...]:
        return self._sliding(self._case.friction.coefficient)

    def worn(
        self, depths: Sequence[Array], friction: Sequence[float] | None = None
    ) -> tuple[CycleLoads, ...]:
        """As unworn but for the friction: no structure responds to wear."""
        return self._sliding(*friction) if friction else self.unworn()

    def user_faces(self, number: int) -> tuple[UserFace, ...]:
        """None: the bodies have no nodes."""
        return ()

    def probe(self, depths: Sequence[Array], friction: Sequence[float] | None = None) -> Array:
        """Resultants ``(1, 6)``, whatever the wear."""
        loads, t = self.worn(depths, friction)[0].loads, self.peak
        return np.array([[loads.P[t], loads.Qx[t], loads.Qy[t], 0.0, 0.0, 0.0]])

    @property
    def motion(self) -> Array:
        """Motion of body 2 over body 1 in each increment, ``(t, 2)`` [mm]."""
        path = self._case.load_path
        angle = getattr(path, "direction", 0.0)  # line contacts slide along x
        step = path.stroke / path.increments * np.array([np.cos(angle), np.sin(angle)])
        there = np.tile(step, (path.increments, 1))
        return np.concatenate([there, -there])

    def _sliding(self, friction: float) -> tuple[CycleLoads]:
        """The cycle of the only contact."""
        nodes = len(self.faces[0].face)
        return (
            CycleLoads(self._loads(friction), np.repeat(self.motion[:, :, None], nodes, axis=2)),
        )

    def _loads(self, friction: float) -> LoadHistory:
        """Friction against the motion, and what it dissipates."""
        motion, P = self.motion, self._case.load_path.P
        shear = -friction * P * motion / np.hypot(motion[:, 0], motion[:, 1])[:, None]
        energy = -shear * motion
        zero = np.zeros(len(motion))
        return LoadHistory(
            P=np.full(len(motion), P),
            Qx=shear[:, 0],
            Qy=shear[:, 1],
            Mx=zero,
            My=zero,
            Mz=zero,
            Edx=energy[:, 0],
            Edy=energy[:, 1],
            sliding=np.ones(len(motion), dtype=bool),
        )

    @property
    def _grid(self) -> Grid:
        contact = self._case.contact
        size = contact.size if isinstance(contact.size, tuple) else (contact.size, 1.0)
        return Grid.over(size, contact.grid, self.line)

    def _face(self, size: tuple[float, float]) -> Face:
        """The corners of the grid."""
        frame = Frame(np.zeros(3), np.eye(3))
        x, y = 0.5 * size[0], 0.5 * size[1]
        if self.line:
            return Face(NAME, frame, np.array([[-x, 0.0], [x, 0.0]]), np.array([[0, 1]]))
        corners = np.array([[-x, -y], [x, -y], [x, y], [-x, y]])
        return Face(NAME, frame, corners, np.array([[0, 1, 2], [0, 2, 3]]))


def gap_of(shape: Shape | Heights, grid: Grid) -> GapFunction:
    """Gap [mm] of the unloaded bodies at x and y of the face that ``grid`` covers."""
    if isinstance(shape, Heights):
        return GridHeights(grid, read_heights(shape.file))
    return shape.height
