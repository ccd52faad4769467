"""Two bodies that slide to and fro on each other as a load source: nothing to solve."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from sa_solver.types import Array, Grid, LoadHistory
from wear.face_loads import CycleLoads
from workflow.analyses.contact.case import Heights, Shape
from workflow.analyses.wear.gaps import GapFunction, GridHeights
from workflow.analyses.wear.load_source import (
    COARSER,
    ContactFace,
    UncoupledSource,
    UserFace,
    coarse_cells,
    nominal_face,
)
from workflow.analyses.wear.structures.bodies.case import BodiesWearCase, LineBodiesWearCase
from workflow.case.input_files import read_heights

NAME = "interface"
REMEDY = "enlarge contact.size, and contact.grid with it"


class BodiesSource(UncoupledSource):
    """Two bodies as load source of a wear run: forces of gross sliding over the whole stroke.

    Its moments are 0: those that are imposed where the tilt is free.
    """

    def __init__(self, case: BodiesWearCase | LineBodiesWearCase) -> None:
        self._case, self.line = case, isinstance(case, LineBodiesWearCase)
        # The increment that passes the middle on the way there: all are loaded alike.
        self.peak = case.load_path.increments // 2

    @cached_property
    def faces(self) -> tuple[ContactFace, ...]:
        grid = self._grid
        return (
            ContactFace(
                nominal_face(NAME, grid.size, self.line),
                grid.size,
                gap_of(self._case.structure, grid),
                coarse_cells(grid.shape[0] // COARSER, grid.shape[1] // COARSER, self.line),
                REMEDY,
                driven=True,
                tilt=self._case.load_path.tilt,
            ),
        )

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
        slip = np.repeat(self.motion[:, :, None], len(self.faces[0].face), axis=2)
        return (CycleLoads(self._loads(friction), slip),)

    def _loads(self, friction: float) -> LoadHistory:
        """Friction against the motion, and what it dissipates."""
        motion, P = self.motion, self._case.load_path.P
        shear = -friction * P * motion / np.hypot(motion[:, 0], motion[:, 1])[:, None]
        one, zero = np.ones(len(motion)), np.zeros(len(motion))
        (Qx, Qy), (Edx, Edy) = shear.T, (-shear * motion).T
        return LoadHistory(P * one, Qx, Qy, zero, zero, zero, Edx, Edy, sliding=one > 0.0)

    @property
    def _grid(self) -> Grid:
        contact = self._case.contact
        size = contact.size if isinstance(contact.size, tuple) else (contact.size, 1.0)
        return Grid.over(size, contact.grid, self.line)


def gap_of(shape: Shape | Heights, grid: Grid) -> GapFunction:
    """Gap [mm] of the unloaded bodies at x and y of the face that ``grid`` covers."""
    if isinstance(shape, Heights):
        return GridHeights(grid, read_heights(shape.file))
    return shape.height
