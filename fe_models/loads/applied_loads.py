"""Loads on bodies of a user's mesh: on named boundaries, and on their mass."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.thermal import Temperature
from fe_models.loads.pretension import Pretension
from sa_solver.types import Array, Mask

# Second moments below this share of the largest count as 0: a boundary in the plane has no depth.
FLAT = 1e-12


@dataclass(frozen=True)
class Pressure:
    """Pressure [MPa] on a boundary, directed into the body."""

    boundary: str
    pressure: float

    def forces(self, elastic: ElasticBody) -> Array:
        """Return the nodal forces ``(size,)``."""
        return self.pressure * elastic.pressure_load(self.boundary)


@dataclass(frozen=True)
class BoundaryForce:
    """Force and moment that are distributed over a boundary.

    They act as the traction t = F/A + ω x r about the centroid, so that the boundary stays free to
    deform. The mean motions of the boundary are those of a point tied to it by least squares (a
    distributing coupling, RBE3). A ``rigid`` boundary keeps its shape instead, and then the
    distribution does not matter.

    Attributes
    ----------
    boundary
        Name of the boundary.
    force
        Force ``(3,)`` [N], per length [N/mm] in the plane.
    at
        Point ``(3,)`` [mm] at which the force acts; by default the boundary's centroid.
    moment
        Moment ``(3,)`` [N mm]; in the plane per length [N], and about y.
    rigid
        Whether the boundary is rigid.
    """

    boundary: str
    force: Array
    at: Array | None = None
    moment: Array = field(default_factory=lambda: np.zeros(3))
    rigid: bool = False

    def forces(self, elastic: ElasticBody) -> Array:
        """Return the nodal forces ``(size,)``."""
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
    """Displacement ``(3,)`` [mm] imposed on a boundary along its direction, and free across it."""

    boundary: str
    displacement: Array


@dataclass(frozen=True)
class RemoteDisplacement:
    """Motion of a point that is tied to a boundary.

    In the plane the motion has three components: along x and z, and about y.

    Attributes
    ----------
    boundary
        Name of the boundary.
    at
        Position of the point ``(3,)`` [mm].
    motion
        Displacement along and rotation about the global axes ``(6,)`` [mm, rad].
    free
        Flags ``(6,)`` of components that are not imposed.
    rigid
        Whether the boundary is rigid and moves with the point. Otherwise it stays free to deform,
        and the motion is imposed on its average by least squares.
    """

    boundary: str
    at: Array
    motion: Array
    free: Mask
    rigid: bool


@dataclass(frozen=True)
class Rotation:
    """Rotation of all bodies at ``speed`` [rad/s] about an axis ``(3,)`` through a point ``(3,)``.

    Its forces are proportional to the square of the speed.
    """

    axis: Array
    through: Array
    speed: float

    @property
    def direction(self) -> Array:
        """Unit vector of the axis."""
        return self.axis / np.linalg.norm(self.axis)

    def forces(self, elastic: ElasticBody) -> Array:
        """Return the nodal forces ``(size,)``."""
        return self.speed**2 * elastic.centrifugal_load(self.direction, self.through)


@dataclass(frozen=True)
class Acceleration:
    """Acceleration ``(3,)`` [mm/s²] of the frame of reference.

    The inertia forces on the bodies are opposite to it.
    """

    acceleration: Array

    def forces(self, elastic: ElasticBody) -> Array:
        """Return the nodal forces ``(size,)``."""
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
    """Return the boundary that a load acts on, or None if it acts on none."""
    return getattr(load, "boundary", None)


def vector_of(load: AppliedLoad) -> Array | None:
    """Return the force, displacement or acceleration of a load, or None if it has none."""
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
    """Return the moment or rotation of a load, or None if it has none."""
    match load:
        case BoundaryForce():
            return load.moment
        case RemoteDisplacement():
            return load.motion[3:]
    return None


def _moments(elastic: ElasticBody, boundary: str) -> tuple[float, Array, Array]:
    """Return a boundary's area, centroid ``(3,)`` and second moments about it ``(3, 3)``."""
    points, areas = elastic.boundary_points(boundary)
    area = float(areas.sum())
    centroid = points @ areas / area
    arms = points - centroid[:, None]
    return area, centroid, (arms * areas) @ arms.T


def _linear(constant: float, slope: Array, origin: Array) -> Callable[[Array], Array]:
    """Return the function ``constant + slope · (x - origin)`` of points x ``(3, ...)``."""

    def linear(points: Array) -> Array:
        value: Array = constant + np.einsum("a,a...->...", slope, points)
        return value - slope @ origin

    return linear
