"""Steps of pseudo-arclength continuation along a curve of solutions of r(u, λ) = 0.

From a point a step is made along the tangent, and Newton's method leads back to the curve in the
plane perpendicular to the tangent (Keller 1977; Seydel 2010, *Practical Bifurcation and Stability
Analysis*, 3rd ed., section 4.5). Arc length is measured relative to the norm of the unknowns and to
λ, so that a step is a relative change, near a resonance and far from it. The step length is adapted
to the number of iterations and to the angle by which the tangent turns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import acos, degrees

import numpy as np

from fe_models.dynamics.curves.bordered import Bordered, solve_bordered
from fe_models.dynamics.curves.newton import (
    Equations,
    L,
    NewtonControl,
    NewtonSolution,
    iterate,
    linear_tolerance,
)
from fe_models.dynamics.curves.sizes import norm
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array

# Unknowns are measured relative to their norm, but at least to this share of the largest norm on
# the curve: otherwise, where all of them pass through zero, no step would be small enough.
LEAST_SHARE = 1e-2
# λ is measured relative to itself, but at least to this share of the farther end, for curves that
# start at zero.
LEAST_PARAMETER = 0.1
# Step below which a turn of the tangent is a corner, where a joint changes its state. Such a step
# is accepted however much the tangent turns.
CORNER = 1e-3
# Step below which a change of orientation means that the curve has passed a crossing of curves.
CROSSING = 1e-5
# How often a correction on a curve is halved, and how many in a row may leave a residual above the
# smallest so far: if that is not enough, a shorter step is cheaper.
MAX_HALVINGS, PATIENCE = 1, 2
# Largest factor by which the step length grows or shrinks after a point.
LARGEST_STEP_CHANGE = 2.0
# Relative residual of an iterative linear solver for a tangent, which is only the direction of the
# next step.
TANGENT_TOLERANCE = 1e-4


@dataclass(frozen=True)
class ContinuationControl:
    """Control of the steps along a curve, whose lengths are relative.

    Parameters
    ----------
    first, least, most
        First, smallest and largest length of a step.
    iterations
        Number of iterations of Newton's method for which step lengths are chosen.
    max_iterations
        Largest number of iterations, after which a step is halved.
    max_angle
        Largest angle [degrees] by which the tangent may turn in one step.
    max_points
        Largest number of points on a curve.
    tolerance
        Tolerance of Newton's method.
    watch
        Function that is called with λ of each new point.

    Examples
    --------
    A branch with a limited number of points reports that it did not reach its end:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> problem = HarmonicBalance(rig, PeriodicMarch(law), load, Resolution((1,), 64))
    >>> control = ContinuationControl(max_points=3)
    >>> branch = along_frequency(problem, 1.0, (100.0, 300.0), control=control)
    >>> print(branch.message.partition(" and ")[0], branch.frequencies.max() < 300.0)
    the curve has 3 points True
    """

    first: float = 0.02
    least: float = 1e-6
    most: float = 0.3
    iterations: int = 4
    max_iterations: int = 8
    max_angle: float = 30.0
    max_points: int = 2000
    tolerance: float = 1e-10
    watch: Callable[[float], None] = lambda parameter: None

    def __post_init__(self) -> None:
        sizes = ("first", "least", "most", "max_angle", "tolerance")
        checks.numbers(self, *sizes, above=0.0, infinite=True)
        for name in ("iterations", "max_iterations", "max_points"):
            if checks.whole(name, getattr(self, name)) < 1:
                raise InputError(f"{name} = {getattr(self, name)}: give 1 or more")


@dataclass(frozen=True)
class CurvePoint:
    """Point of a curve, from which it can be continued.

    Parameters
    ----------
    unknowns
        Unknowns ``(n,)``.
    parameter
        λ.
    tangent
        Direction ``(n + 1,)`` in which the curve is followed, for unknowns and parameter.
    step
        Length of the next step.
    orientation
        Sign of the determinant of the Jacobian bordered by the tangent, 0 if not known. It is
        constant along a smooth curve, also past folds; a change means that a step has reached the
        curve elsewhere.
    iterations
        Number of iterations that led to the point.
    relative
        Relative residual.
    """

    unknowns: Array
    parameter: float
    tangent: Array
    step: float
    orientation: int
    iterations: int
    relative: float

    @property
    def coordinates(self) -> Array:
        """Unknowns and parameter ``(n + 1,)``."""
        coordinates = np.empty(len(self.unknowns) + 1)
        coordinates[:-1], coordinates[-1] = self.unknowns, self.parameter
        return coordinates

    def turned(self) -> CurvePoint:
        """Return the same point with the opposite direction of the curve."""
        return replace(self, tangent=-self.tangent, orientation=-self.orientation)


class Scaling:
    """Scaling of steps: relative to the norm of the unknowns less ``origin``, and relative to λ.

    Parameters
    ----------
    farthest
        Largest magnitude of λ on the curve.
    origin
        Unknowns ``(n,)`` from which the norm is measured; zero if None.
    rounding
        Norm below which the unknowns count as zero.
    """

    def __init__(self, farthest: float, origin: Array | None = None, rounding: float = 0.0) -> None:
        self._rounding = rounding
        self._farthest, self._largest, self.unknowns, self.parameter = farthest, 0.0, 1.0, 1.0
        self.origin = origin

    def adapt(self, point: CurvePoint) -> None:
        """Set the scales to the size of a point."""
        vibration = point.unknowns if self.origin is None else point.unknowns - self.origin
        size = norm(vibration)
        size = size if size > self._rounding else 0.0
        self._largest = max(self._largest, size)
        self.unknowns = max(size, LEAST_SHARE * self._largest) or 1.0
        self.parameter = max(abs(point.parameter), LEAST_PARAMETER * self._farthest)

    def scaled(self, step: Array) -> Array:
        """Return a step ``(n + 1,)`` in relative terms."""
        shares = step / self.unknowns
        shares[-1] = step[-1] / self.parameter
        return np.asarray(shares)

    def unscaled(self, shares: Array) -> Array:
        """Return the step for a relative one: the inverse of :meth:`scaled`."""
        step = shares * self.unknowns
        step[-1] = shares[-1] * self.parameter
        return np.asarray(step)

    def column(self, slope: Array) -> Array:
        """Return ∂r/∂λ ``(n,)``, scaled so that ∂r/∂u need not be scaled."""
        return np.asarray(slope * (self.parameter / self.unknowns))

    def direction(self, point: CurvePoint) -> Array:
        """Return the unit direction ``(n + 1,)`` of the tangent in relative terms."""
        shares = self.scaled(point.tangent)
        return np.asarray(shares / norm(shares))


def first_point(
    solution: NewtonSolution[L], parameter: float, upward: bool, step: float
) -> CurvePoint:
    """Return the point from which a curve is followed.

    Parameters
    ----------
    solution
        Solution at the first λ.
    parameter
        First λ.
    upward
        Whether λ grows or falls first.
    step
        Length of the first step.
    """
    at, last = solution.at, np.zeros(len(solution.unknowns) + 1)
    last[-1] = 1.0 if upward else -1.0
    tangent, orientation = solve_bordered(at.jacobian, at.slope, last, abs(last)[:, None])
    return CurvePoint(
        unknowns=solution.unknowns,
        parameter=parameter,
        tangent=tangent[:, 0],
        step=step,
        orientation=orientation,
        iterations=solution.iterations,
        relative=at.relative,
    )


def next_point(
    equations: Equations[L], point: CurvePoint, scaling: Scaling, control: ContinuationControl
) -> tuple[CurvePoint, L] | str:
    """Return the next point of a curve and the equations there, or the reason why there is none.

    Parameters
    ----------
    equations
        Equations of the curve.
    point
        Present point.
    scaling
        Scaling of steps, adapted to the point.
    control
        Control of the steps.
    """
    direction = scaling.direction(point)
    following = _try_steps(equations, point, direction, scaling, control)
    length = CORNER
    while following is None and length >= control.least:
        new_direction = _direction_beyond_corner(equations, point, length * direction, scaling)
        if new_direction is not None:
            short_of_corner = replace(point, step=length)
            following = _try_steps(equations, short_of_corner, new_direction, scaling, control)
        length *= 0.1
    if following is not None:
        return following
    return (
        f"the curve ends at {point.parameter:.6g}: Newton's method does not converge with steps "
        f"down to {control.least:g}; give smaller least steps, more samples of the period, or "
        "continue from another point"
    )


def _try_steps(
    equations: Equations[L],
    point: CurvePoint,
    direction: Array,
    scaling: Scaling,
    control: ContinuationControl,
) -> tuple[CurvePoint, L] | None:
    """Return the next point in a relative direction, by the longest step that succeeds."""
    step = min(point.step, control.most)
    while step >= control.least:
        corrected = correct(equations, point, step * direction, scaling, control)
        if corrected is not None:
            new, at, tangent = corrected
            cosine = min(max(float(tangent @ direction), -1.0), 1.0)
            angle = degrees(acos(cosine))
            smooth = angle <= control.max_angle
            same = new.orientation * point.orientation >= 0
            if (same and (smooth or step <= CORNER)) or (smooth and step <= CROSSING):
                return replace(new, step=_next_step(step, new.iterations, angle, control)), at
        step *= 0.5
    return None


def _direction_beyond_corner(
    equations: Equations[L], point: CurvePoint, step: Array, scaling: Scaling
) -> Array | None:
    """Return the relative direction of a curve beyond a corner at which it turns back, or None.

    It is the tangent beyond the corner, in the sense that keeps the orientation.
    """
    predicted = point.coordinates + scaling.unscaled(step)
    at = equations(predicted[:-1], float(predicted[-1]))
    rhs = np.zeros((len(predicted), 1))
    rhs[-1] = 1.0
    try:
        tangent, orientation = solve_bordered(
            at.jacobian, scaling.column(at.slope), step / norm(step), rhs
        )
    except np.linalg.LinAlgError:
        return None
    if orientation * point.orientation >= 0:
        return None
    return np.asarray(-tangent[:, 0] / norm(tangent))


def correct(
    equations: Equations[L],
    point: CurvePoint,
    step: Array,
    scaling: Scaling,
    control: ContinuationControl,
) -> tuple[CurvePoint, L, Array] | None:
    """Correct a step by Newton's method in the plane across it.

    Returns the point, the equations there, and the tangent in relative terms; None if it fails.

    Parameters
    ----------
    equations
        Equations of the curve.
    point
        Point from which the step leads.
    step
        Step ``(n + 1,)`` in relative terms.
    scaling
        Scaling of steps.
    control
        Control of the steps.
    """
    along = step / norm(step)
    system: Bordered | None = None

    def system_of(at: L) -> Bordered:
        return Bordered(at.jacobian, scaling.column(at.slope), along)

    def correction_of(at: L) -> Array:
        nonlocal system
        system = system_of(at)
        rhs = np.zeros(len(along))
        np.divide(at.residual, -scaling.unknowns, out=rhs[:-1])
        return scaling.unscaled(system.solve(rhs, linear_tolerance(at)))

    last = iterate(
        lambda coordinates: equations(coordinates[:-1], float(coordinates[-1])),
        correction_of,
        point.coordinates + scaling.unscaled(step),
        NewtonControl(control.tolerance, control.max_iterations, MAX_HALVINGS, PATIENCE),
    )
    if not last.at.relative <= control.tolerance:
        return None
    try:
        # The tangent is that of the last Jacobian but one: the last correction does not turn it.
        tangent, orientation = _tangent(system or system_of(last.at), len(along))
    except np.linalg.LinAlgError:
        return None
    new = CurvePoint(
        unknowns=last.unknowns[:-1],
        parameter=float(last.unknowns[-1]),
        tangent=scaling.unscaled(tangent),
        step=point.step,
        orientation=orientation,
        iterations=last.iterations,
        relative=last.at.relative,
    )
    return new, last.at, tangent


def _tangent(system: Bordered, size: int) -> tuple[Array, int]:
    """Return the direction ``(size,)`` of the curve and the determinant's sign, 0 if unknown."""
    rhs = np.zeros(size)
    rhs[-1] = 1.0
    tangent = system.solve(rhs, TANGENT_TOLERANCE)
    return tangent / norm(tangent), system.sign


def _next_step(step: float, iterations: int, angle: float, control: ContinuationControl) -> float:
    """Return the length of the next step from the last step, its iterations and its turn."""
    by_iterations = (control.iterations + 1) / (iterations + 1)
    by_angle = 0.5 * control.max_angle / max(angle, 1e-9)
    factor = min(by_iterations, by_angle, LARGEST_STEP_CHANGE)
    return min(max(step * max(factor, 1.0 / LARGEST_STEP_CHANGE), control.least), control.most)
