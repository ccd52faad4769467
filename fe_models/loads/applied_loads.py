"""Loads on bodies of a user's mesh: on boundaries, named by them, and on their mass."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.thermal import Temperature
from fe_models.loads.pretension import Pretension
from sa_solver.types import Array, Mask

# Second moments below this share of the largest are none: a boundary in the plane has no depth.
FLAT = 1e-12


@dataclass(frozen=True)
class Pressure:
    """Pressure [MPa] on a boundary, into the body."""

    boundary: str
    pressure: float

    def forces(self, elastic: ElasticBody) -> Array:
        """Nodal forces ``(size,)``."""
        return self.pressure * elastic.pressure_load(self.boundary)


@dataclass(frozen=True)
class BoundaryForce:
    """Force ``(3,)`` [N] ``at`` a point ``(3,)`` [mm] and ``moment`` ``(3,)`` [N mm] on a boundary.

    The point is the boundary's centroid unless given. In the plane both are per length, N/mm and N,
    and the moment is one about y.

    They are spread as the traction t = F/A + ω x r about the centroid, so that the boundary stays
    free to deform: its mean motions are those of a point tied to it by least squares (a
    distributing coupling, RBE3). A ``rigid`` boundary keeps its form instead: there it does not
    matter how they are spread.
    """

    boundary: str
    force: Array
    at: Array | None = None
    moment: Array = field(default_factory=lambda: np.zeros(3))
    rigid: bool = False

    def forces(self, elastic: ElasticBody) -> Array:
        """Nodal forces ``(size,)``."""
        area, centroid, second = _moments(elastic, self.boundary)
        arm = np.zeros(3) if self.at is None else self.at - centroid
        turning = self.moment + np.cross(arm, self.force)
        turn = np.linalg.pinv(np.trace(second) * np.eye(3) - second, rcond=FLAT) @ turning
        slopes = np.cross(turn, np.eye(3), axisb=0, axisc=0)
        return np.asarray(
            sum(
                elastic.traction_load(
                    self.boundary, _linear(force / area, slope, centroid), direction
                )
                for force, slope, direction in zip(self.force, slopes, np.eye(3), strict=True)
            )
        )


@dataclass(frozen=True)
class Displacement:
    """Displacement ``(3,)`` [mm] imposed on a boundary along its own direction; free across it."""

    boundary: str
    displacement: Array


@dataclass(frozen=True)
class RemoteDisplacement:
    """``motion`` ``(6,)`` of a point ``at`` ``(3,)`` tied to a boundary: displacement, rotation.

    Along and about the global axes [mm, rad]; components that are ``free`` ``(6,)`` are not given.
    The boundary is ``rigid`` and moves with the point, or stays free to deform and has its motion
    on average, by least squares. In the plane there are three components, x, z and about y.
    """

    boundary: str
    at: Array
    motion: Array
    free: Mask
    rigid: bool


@dataclass(frozen=True)
class Rotation:
    """Rotation of both bodies at ``speed`` [rad/s] about an axis ``(3,)`` through a point ``(3,)``.

    Its forces go with the square of the speed.
    """

    axis: Array
    through: Array
    speed: float

    @property
    def direction(self) -> Array:
        """Unit vector of the axis."""
        return self.axis / np.linalg.norm(self.axis)

    def forces(self, elastic: ElasticBody) -> Array:
        """Nodal forces ``(size,)``."""
        return self.speed**2 * elastic.centrifugal_load(self.direction, self.through)


@dataclass(frozen=True)
class Acceleration:
    """Acceleration ``(3,)`` [mm/s²] of the frame of reference: bodies are pulled against it."""

    acceleration: Array

    def forces(self, elastic: ElasticBody) -> Array:
        """Nodal forces ``(size,)``."""
        pull = -elastic.material.density * self.acceleration
        return elastic.body_load(lambda x: np.broadcast_to(pull[:, None, None], x.shape))


AppliedLoad = (
    Pressure
    | BoundaryForce
    | Displacement
    | RemoteDisplacement
    | Rotation
    | Acceleration
    | Temperature
    | Pretension
)


def boundary_of(load: object) -> str | None:
    """The boundary a load acts on, if on one."""
    return getattr(load, "boundary", None)


def vector_of(load: AppliedLoad) -> Array | None:
    """The direction of a load that has one."""
    match load:
        case BoundaryForce():
            return load.force
        case Displacement():
            return load.displacement
        case RemoteDisplacement():
            return load.motion[:3]
        case Acceleration():
            return load.acceleration
    return None


def turning_of(load: AppliedLoad) -> Array | None:
    """The moment or rotation of a load that has one."""
    match load:
        case BoundaryForce():
            return load.moment
        case RemoteDisplacement():
            return load.motion[3:]
    return None


def _moments(elastic: ElasticBody, boundary: str) -> tuple[float, Array, Array]:
    """Area of a boundary, its centroid ``(3,)`` and second moments about that ``(3, 3)``."""
    axes = range(3)
    area = elastic.boundary_integral(boundary, _product(np.zeros(3), ()))
    first = [elastic.boundary_integral(boundary, _product(np.zeros(3), (i,))) for i in axes]
    centroid = np.array(first) / area
    second = [
        [elastic.boundary_integral(boundary, _product(centroid, (i, j))) for j in axes]
        for i in axes
    ]
    return area, centroid, np.array(second)


def _product(origin: Array, axes: Sequence[int]) -> Callable[[Array], Array]:
    """Of coordinates of points ``(3, ...)`` about an origin."""

    def product(points: Array) -> Array:
        value = np.ones_like(points[0])
        for axis in axes:
            value = value * (points[axis] - origin[axis])
        return value

    return product


def _linear(constant: float, slope: Array, origin: Array) -> Callable[[Array], Array]:
    """``constant + slope · (x - origin)`` at points x ``(3, ...)``."""

    def linear(points: Array) -> Array:
        value: Array = constant + np.einsum("a,a...->...", slope, points)
        return value - slope @ origin

    return linear
