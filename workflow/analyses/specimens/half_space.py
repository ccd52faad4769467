"""The contact of two specimens on a half-space, beside their reduced models.

Same shape, loads, friction and motions: normal force imposed, no tilt, then body 2 moved along x
and nothing else; pressure and shear one after the other, as if both materials were alike. The
half-space goes on beyond the pad and below it without end; the specimens are finite and held at the
ring. Linked to them (:mod:`wear.contact.link`), it moves by what they do beside it,

    d = A f - K Π f,

for the nodal forces f of each motion, the rigid approach and motion of the rings included: its own
forces and motions are then those of the rings, on a finer grid. Beside half-spaces the pads are
compared while tied: c_bulk = 1/k_specimens - 1/k_half-space, along z and x, positive or negative.
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
from sa_solver.normal.contact import NormalContact, NormalState
from sa_solver.tangential.contact import TangentialContact, TangentialState
from sa_solver.types import Array, ElasticPair, Grid, Indices
from wear.contact.link import Link, fitted
from workflow.errors import MethodFailed

# A tied pad: any motion does, and a limit that no shear comes near.
UNIT_MOTION, NO_LIMIT = 1e-3, 1e9
# Coordinates of nodes in one row or column differ by rounding only [mm].
SAME_PLACE = 1e-9

State = TypeVar("State", NormalState, TangentialState)


@dataclass(frozen=True)
class HalfSpaceState:
    """One cycle on one shape, as :class:`~fe_models.joints.reduced_contact.FrettingCycle` has it.

    Fields ``(nx, ny)``: ``pressure`` [MPa], ``shear`` along x at the end of first loading [MPa] and
    ``slip`` of body 2 there [mm]; ``nodal_pressure`` and ``nodal_shear`` ``(n,)`` are their means
    over the nodes of the pad. ``displacement`` [mm] and ``force`` [N] are first loading ``(k,)``,
    ``stick_stiffness`` [N/mm] with all that touches stuck, ``energy`` of a cycle [N mm], ``misfit``
    that of the link, None where there is none.
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
    """What specimens add to the half-space: to its gap ``(nx, ny)``, and to sliding [mm].

    ``moved`` ``(k, 2, nx, ny)`` is that of first loading to each of its points, ``stuck``
    ``(2, nx, ny)`` per mm where all that touches sticks. ``misfit`` is what the fit of ``gap``
    leaves of the half-spaces' deflection.
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
        """c_bulk along z [mm/N]."""
        return 1.0 / self.specimens[0] - 1.0 / self.half_space[0]

    @property
    def tangential(self) -> float:
        """c_bulk along x [mm/N]."""
        return 1.0 / self.specimens[1] - 1.0 / self.half_space[1]


@dataclass(frozen=True)
class NodeGrid:
    """Nodes of a pad in rows and columns: numbers ``order`` ``(nx, ny)``, at ``x`` and ``y``."""

    x: Array
    y: Array
    order: Indices

    @classmethod
    def of(cls, face: Face) -> NodeGrid:
        """Rows and columns of a face that is meshed in squares."""
        digits = np.round(face.coordinates / SAME_PLACE).astype(np.int64)
        (x, row), (y, column) = (np.unique(column, return_inverse=True) for column in digits.T)
        order = np.full((len(x), len(y)), -1)
        order[row, column] = np.arange(len(face))
        assert order.min() >= 0, "the pad is not meshed in rows and columns"
        return cls(SAME_PLACE * x, SAME_PLACE * y, order)

    def smooth(self, nodal: Array) -> RectBivariateSpline:
        """A smooth field through nodal values: straight pieces would leave ridges on a form."""
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
        """The link to specimens pressed as ``normal`` and moved to the points of ``path`` [mm]."""
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

    def _linked(self, pair: ReducedPair, normal: NormalSolution, forces: Array, axis: int) -> Link:
        """That of nodal ``forces`` ``(t, n)`` along one axis, where ``normal`` presses.

        Pressure and shear do not know of each other: of shear it is the part along the face.
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

        ``depth`` ``(n,)`` is worn off both bodies at the nodes [mm], ``path`` ``(k,)`` rising
        displacements of body 2 along x [mm]; ``link`` that of the specimens on the same shape.
        Raises :class:`MethodFailed` if a solve does not converge.
        """
        worn = self._nodes.smooth(depth)(self.grid.x.ravel(), self.grid.y.ravel())
        shape = height + worn if link is None else height + worn + link.gap
        normal = _converged(self._press(shape, force))
        limit = self._friction * normal.pressure
        moved = [None] * len(path) if link is None else link.moved
        states = [self._move(limit, d, by) for d, by in zip(path, moved, strict=True)]
        last, area = states[-1], self.grid.cell_area
        # Body 1's shift against body 2 in sa_solver is body 2's here, backwards.
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
        """Stiffness of the tied pad along z and x [N/mm]."""
        flat = np.zeros(self.grid.shape)
        pressed = self._press(flat, approach=UNIT_MOTION)
        return pressed.P / UNIT_MOTION, self._stuck(np.ones(self.grid.shape, dtype=np.bool_))

    def _move(self, limit: Array, displacement: float, by: Array | None = None) -> TangentialState:
        return _converged(self._shift(limit, by, shift_x=-displacement))

    def _stuck(self, pressed: NDArray[np.bool_], link: PadLink | None = None) -> float:
        """Stiffness along x of the cells ``pressed``, stuck [N/mm]."""
        by = None if link is None else UNIT_MOTION * link.stuck
        return -self._move(np.where(pressed, NO_LIMIT, 0.0), UNIT_MOTION, by).Qx / UNIT_MOTION


def bulk_compliance(pair: ReducedPair, half_space: PadHalfSpace) -> BulkCompliance:
    """What the specimens give way beyond a half-space."""
    tied = np.ones(len(pair.face))
    z, x = (float(np.linalg.solve(pair.block(axis), tied).sum()) for axis in (Z, X))
    return BulkCompliance((z, x), half_space.tied())


def _converged(state: State) -> State:
    if not state.converged:
        raise MethodFailed(f"the half-space beside the specimens: {state.message}")
    return state
