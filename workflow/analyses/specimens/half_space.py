"""Contact of two specimens on a half-space, to compare with their reduced models.

Shape, loads, friction and motions are the same. The normal force is imposed without tilt, then body
2 is moved along x only. Pressure and shear are solved one after the other, as if both materials
were similar. The half-space extends beyond the pad and below it without end; the specimens are
finite and held at the ring. With a link to them (:mod:`wear.contact.link`), the half-space is moved
by the difference of the specimens to it,

    d = A f - K Π f,

for the nodal forces f of each motion, with the rigid approach and motion of the rings included. Its
forces and motions are then at the rings, on a finer grid. The pads are also compared with
half-spaces while tied: c_bulk = 1/k_specimens - 1/k_half-space, along z and x, of either sign.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from fe_models.joints.reduced_contact import NormalSolution, ReducedPair, X, Z
from fe_models.meshes.structure_mesh import Face
from fe_models.meshes.transfer import FaceTransfer
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.normal.state import NormalState
from sa_solver.tangential.contact import TangentialContact, TangentialState
from sa_solver.types import Array, ElasticPair, Grid, Indices
from wear.contact.link import StructureLink, fitted
from workflow.errors import MethodFailed

# For a tied pad: any motion, and a limit that no shear reaches.
UNIT_MOTION, NO_LIMIT = 1e-3, 1e9
# Coordinates of nodes in one row or column differ only by rounding below this [mm].
SAME_PLACE = 1e-9

State = TypeVar("State", NormalState, TangentialState)


@dataclass(frozen=True)
class HalfSpaceState:
    """One cycle on one shape, like :class:`~fe_models.joints.reduced_contact.FrettingCycle`.

    Fields ``(nx, ny)``: ``pressure`` [MPa], ``shear`` along x at the end of first loading [MPa] and
    ``slip`` of body 2 there [mm]; ``nodal_pressure`` and ``nodal_shear`` ``(n,)`` are their means
    over the nodes of the pad. ``displacement`` [mm] and ``force`` [N] are first loading ``(k,)``.
    ``stick_stiffness`` [N/mm] is for all cells in contact stuck, ``energy`` is that of a cycle [N
    mm], and ``misfit`` that of the link, None without a link.
    """

    pressure: Array
    shear: Array
    slip: Array
    nodal_pressure: Array
    nodal_shear: Array
    area: float
    approach: float
    stick_stiffness: float
    displacement: Array
    force: Array
    energy: float
    misfit: float | None


@dataclass(frozen=True)
class PadLink:
    """Correction of the half-space by the specimens: of gap ``(nx, ny)`` and sliding [mm].

    ``moved`` ``(k, 2, nx, ny)`` is for each point of first loading, ``stuck`` ``(2, nx, ny)`` per
    mm of motion where all cells in contact stick. ``misfit`` is the residual of the fit of ``gap``,
    relative to the half-spaces' deflection.
    """

    gap: Array
    moved: Array
    stuck: Array
    misfit: float


@dataclass(frozen=True)
class BulkCompliance:
    """Stiffness of the tied pad of the specimens and of the half-space [N/mm], z and x."""

    specimens: tuple[float, float]
    half_space: tuple[float, float]

    @property
    def normal(self) -> float:
        """Bulk compliance c_bulk along z [mm/N]."""
        return 1.0 / self.specimens[0] - 1.0 / self.half_space[0]

    @property
    def tangential(self) -> float:
        """Bulk compliance c_bulk along x [mm/N]."""
        return 1.0 / self.specimens[1] - 1.0 / self.half_space[1]


@dataclass(frozen=True)
class NodeGrid:
    """Nodes of a pad in rows and columns: numbers ``order`` ``(nx, ny)``, at ``x`` and ``y``."""

    x: Array
    y: Array
    order: Indices

    @classmethod
    def of(cls, face: Face) -> NodeGrid:
        """Return rows and columns of a face that is meshed in squares."""
        digits = np.round(face.coordinates / SAME_PLACE).astype(np.int64)
        (x, row), (y, column) = (np.unique(column, return_inverse=True) for column in digits.T)
        order = np.full((len(x), len(y)), -1)
        order[row, column] = np.arange(len(face))
        assert order.min() >= 0, "the pad is not meshed in rows and columns"
        return cls(SAME_PLACE * x, SAME_PLACE * y, order)

    def smooth(self, nodal: Array) -> RectBivariateSpline:
        """Return a smooth field through nodal values; linear pieces would form ridges."""
        power = min(3, len(self.x) - 1, len(self.y) - 1)
        return RectBivariateSpline(self.x, self.y, nodal[self.order], kx=power, ky=power)


class PadHalfSpace:
    """A half-space on a grid over exactly the pad."""

    def __init__(
        self,
        face: Face,
        cells: tuple[int, int],
        pair: ElasticPair,
        friction: float,
        tolerance: float,
    ) -> None:
        low, high = face.coordinates.min(axis=0), face.coordinates.max(axis=0)
        size = float(high[0] - low[0]), float(high[1] - low[1])
        self.grid = Grid.covering(size, cells)
        self._transfer = FaceTransfer.between(face, self.grid)
        self._to_nodes = self._transfer.to_nodes
        self._nodes = NodeGrid.of(face)
        self._half_space = half_space = HalfSpace(self.grid, pair)
        normal, tangential = NormalContact(half_space), TangentialContact(half_space)
        self._press = partial(normal.solve, tilt_x=0.0, tilt_y=0.0, tolerance=tolerance)
        self._shift = partial(tangential.solve, shift_y=0.0, twist=0.0, tolerance=tolerance)
        self._friction = friction

    def link(self, pair: ReducedPair, normal: NormalSolution, path: Array) -> PadLink:
        """Return the link to specimens pressed as ``normal`` and moved along ``path`` [mm]."""
        shears = [pair.tangential(normal, d, self._friction).shear for d in path]
        pressed = self._linked(pair, normal, normal.force[None], Z)
        sheared = self._linked(pair, normal, np.array([*shears, pair.stuck_shear(normal)]), X)
        *moved, stuck = sheared.fields(self.grid.centres)[:, :2]
        return PadLink(
            gap=pressed.lift(0, self.grid.centres),
            moved=np.array(moved),
            stuck=stuck,
            misfit=pressed.residual,
        )

    def _linked(
        self, pair: ReducedPair, normal: NormalSolution, forces: Array, axis: int
    ) -> StructureLink:
        """Return the link for nodal ``forces`` ``(t, n)`` along one axis, where ``normal`` presses.

        Pressure and shear are not coupled: for shear, only the part along the face is used.
        """
        force = np.zeros((len(forces), 3, len(pair.face)))
        force[:, axis] = forces
        displacement = np.einsum("nkm,tm->tkn", pair.compliance[:, :, :, axis], forces)
        tractions = self._transfer.spread(force)
        moved = np.array([self._half_space.displacement(traction) for traction in tractions])
        deflection = self._transfer.sample(moved)
        defect = self._transfer.means(displacement) - deflection
        return fitted(self._transfer, defect, deflection, normal.force[None], 0)

    def fretting_cycle(
        self, height: Array, depth: Array, force: float, path: Array, link: PadLink | None = None
    ) -> HalfSpaceState:
        """Press the shape ``height`` ``(nx, ny)`` with ``force`` [N] and move along ``path``.

        ``depth`` ``(n,)`` is the wear of both bodies together at the nodes [mm]. ``path`` ``(k,)``
        are rising displacements of body 2 along x [mm]. ``link`` is the link to the specimens on
        the same shape. Raises :class:`MethodFailed` if a solve does not converge.
        """
        worn = self._nodes.smooth(depth)(self.grid.x.ravel(), self.grid.y.ravel())
        shape = height + worn if link is None else height + worn + link.gap
        normal = _converged(self._press(shape, force))
        limit = self._friction * normal.pressure
        moved = [None] * len(path) if link is None else link.moved
        states = [self._move(limit, d, by) for d, by in zip(path, moved, strict=True)]
        last, area = states[-1], self.grid.cell_area
        # In sa_solver, the shift of body 1 against body 2 has the opposite sign of body 2's motion
        # here.
        shear, slip = last.shear[0], last.slip[0]
        return HalfSpaceState(
            pressure=normal.pressure,
            shear=shear,
            slip=slip,
            nodal_pressure=self._to_nodes(normal.pressure),
            nodal_shear=self._to_nodes(shear),
            area=float(np.count_nonzero(normal.pressure > 0.0)) * area,
            approach=normal.approach,
            stick_stiffness=self._stuck(normal.pressure > 0.0, link),
            displacement=path,
            force=np.array([-state.Qx for state in states]),
            energy=-4.0 * float(np.sum(last.shear * last.slip)) * area,
            misfit=None if link is None else link.misfit,
        )

    def tied(self) -> tuple[float, float]:
        """Return the stiffness of the tied pad along z and x [N/mm]."""
        flat = np.zeros(self.grid.shape)
        pressed = self._press(flat, approach=UNIT_MOTION)
        return pressed.P / UNIT_MOTION, self._stuck(np.ones(self.grid.shape, dtype=np.bool_))

    def _move(self, limit: Array, displacement: float, by: Array | None = None) -> TangentialState:
        return _converged(self._shift(limit, by, shift_x=-displacement))

    def _stuck(self, pressed: NDArray[np.bool_], link: PadLink | None = None) -> float:
        """Return the stiffness along x with the cells ``pressed`` stuck [N/mm]."""
        by = None if link is None else UNIT_MOTION * link.stuck
        return -self._move(np.where(pressed, NO_LIMIT, 0.0), UNIT_MOTION, by).Qx / UNIT_MOTION


def bulk_compliance(pair: ReducedPair, half_space: PadHalfSpace) -> BulkCompliance:
    """Return the compliance of the specimens in addition to that of a half-space."""
    tied = np.ones(len(pair.face))
    z, x = (float(np.linalg.solve(pair.block(axis), tied).sum()) for axis in (Z, X))
    return BulkCompliance((z, x), half_space.tied())


def _converged(state: State) -> State:
    if not state.converged:
        raise MethodFailed(f"the half-space for comparison: {state.message}")
    return state
