"""Loads of two bodies under a cycle of forces and motions, which wear does not change."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.ties import SAME, first_largest
from sa_solver.types import Array, ElasticPair, Grid, LoadHistory
from wear.contact.drive import Drive
from wear.contact.face_loads import CycleLoads
from workflow.analyses.contact.bodies import bulk_strain
from workflow.analyses.contact.case import Heights, Shape
from workflow.analyses.contact.load_table import LoadTable
from workflow.analyses.wear.gaps import with_measured
from workflow.analyses.wear.structures.bodies.case import (
    NAME,
    SHIFTS,
    LineReciprocation,
    Reciprocation,
    TwoBodiesWearCase,
    with_held,
)
from workflow.case.files.input_files import read_heights
from workflow.models.gaps import GapFunction, GridHeights
from workflow.models.loads import (
    COARSER,
    ContactFace,
    UncoupledSource,
    UserFace,
    coarse_cells,
    nominal_face,
)

REMEDY = "enlarge contact.size, and contact.grid with it"


class BodiesSource(UncoupledSource):
    """Loads of a wear run of two bodies: a cycle of forces and motions.

    Loads that are not imposed are those of sliding bodies along the face, and of the unworn contact
    across it. The half-space finds the dissipation under forces alone. Every increment of the case
    is split into ``parts``.
    """

    def __init__(self, case: TwoBodiesWearCase, parts: int = 1) -> None:
        self._case, self.line, self._parts = case, case.line, parts
        self._table = in_parts(with_held(case.load_path), parts)
        bodies = case.material(1), case.material(2)
        strain = bulk_strain(self._table, bodies)
        self.drive = Drive(
            self._table.is_motion, self._table.imposed, strain if strain.any() else None
        )
        self.peak = self._peak()
        self.slip_known = bool(self.motion.any())

    def _peak(self) -> int:
        """Return the increment with the largest shear force among those with the largest P."""
        path = self._case.load_path
        if isinstance(path, Reciprocation | LineReciprocation):
            return self._parts * path.increments // 2  # mid-stroke, on the way there
        heaviest, shear = self._normal_force, np.hypot(self._table["Qx"], self._table["Qy"])
        loaded = heaviest >= (1.0 - SAME) * heaviest.max()
        return first_largest(np.where(loaded, shear, -1.0))

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
                drive=self.drive,
            ),
        )

    def unworn(self) -> tuple[CycleLoads, ...]:
        return self._cycle(self._case.friction.coefficient)

    def worn(
        self, depths: Sequence[Array], friction: Sequence[float] | None = None
    ) -> tuple[CycleLoads, ...]:
        """Return the unworn cycle with the present friction: no structure responds to wear."""
        return self._cycle(*friction) if friction else self.unworn()

    def user_faces(self, number: int) -> tuple[UserFace, ...]:
        """Return no faces: the bodies have no nodes."""
        return ()

    @cached_property
    def motion(self) -> Array:
        """Imposed motion of body 2 over body 1 in each increment ``(t, 2)`` [mm]."""
        shift = np.stack([self._table[name] for name in SHIFTS], axis=1)
        return np.roll(shift, 1, axis=0) - shift

    def _cycle(self, friction: float) -> tuple[CycleLoads]:
        """Return the cycle of the only contact."""
        slip = np.repeat(self.motion[:, :, None], len(self.faces[0].face), axis=2)
        return (CycleLoads(self._loads(friction), slip),)

    def _loads(self, friction: float) -> LoadHistory:
        """Return imposed forces, with friction and dissipation where motions are imposed."""
        table, motion, P = self._table, self.motion, self._normal_force
        Qx, Qy = table["Qx"], table["Qy"]
        sliding = motion.any(axis=1) & (P > 0.0)
        if motion.any():
            length = np.hypot(motion[:, 0], motion[:, 1])[:, None]
            along = np.divide(motion, length, out=np.zeros_like(motion), where=length > 0.0)
            friction_x, friction_y = (-friction * P[:, None] * along).T
            Qx, Qy = Qx + friction_x, Qy + friction_y
        Edx, Edy = np.where(sliding, -np.stack([Qx, Qy]) * motion.T, 0.0)
        Mx, My, Mz = (table[name] for name in ("Mx", "My", "Mz"))
        return LoadHistory(P, Qx, Qy, Mx, My, Mz, Edx, Edy, sliding)

    @cached_property
    def _normal_force(self) -> Array:
        """Normal force per increment ``(t,)``; that of the unworn contact where motions press."""
        table, drive = self._table, self.drive
        if not drive.motion[0]:
            return table["P"]
        grid, zero = self._grid, np.zeros(len(table))
        pair = ElasticPair(self._case.material(1), self._case.material(2))
        contact, gap = NormalContact(HalfSpace(grid, pair)), gap_of(self._case.structure, grid)
        height = np.ascontiguousarray(np.broadcast_to(gap(grid.x, grid.y), grid.shape))
        loads = LoadHistory(
            zero, zero, zero, table["Mx"], table["My"], zero, zero, zero, sliding=zero > 0.0
        )
        pressing = (drive.pressing(loads, t) for t in range(len(table)))
        return np.array(
            [
                contact.solve(height, **imposed, start=None, compliance=None).P
                for imposed in pressing
            ]
        )

    @property
    def _grid(self) -> Grid:
        return self._case.grid


def in_parts(table: LoadTable, parts: int) -> LoadTable:
    """Return a closed cycle with each increment split into equal ``parts``."""
    if parts == 1:
        return table
    shares = np.arange(1, parts + 1) / parts

    def split(column: Array) -> Array:
        before = np.roll(column, 1)[:, None]
        return np.asarray(before + shares * (column[:, None] - before)).ravel()

    return LoadTable({name: split(column) for name, column in table.columns.items()})


def gap_of(bodies: Shape | Heights, grid: Grid) -> GapFunction:
    """Return the gap [mm] of the unloaded bodies over the face that ``grid`` covers."""
    if isinstance(bodies, Heights):
        form: GapFunction = GridHeights(grid, read_heights(bodies.file))
    else:
        form = bodies.height
    return with_measured(form, bodies.surfaces, grid)
