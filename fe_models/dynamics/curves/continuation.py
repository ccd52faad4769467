"""Curves of solutions of r(u, λ) = 0, also where the curve turns back in λ.

The curve is followed by its length: from a point a step is made along the tangent, and Newton's
method leads back to the curve in the plane across the tangent there (Keller 1977; Seydel 2010,
*Practical Bifurcation and Stability Analysis*, 3rd ed., section 4.5). Length is measured in shares
of the unknowns' own norm and of λ, so that a step is a relative change, near a resonance and far
from it. It is adapted to the number of iterations and to how much the tangent turns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import acos, degrees
from typing import Generic, Protocol, TypeVar

import numpy as np

from fe_models.dynamics.curves.bordered import Bordered, solve_bordered
from fe_models.dynamics.curves.control import ContinuationControl
from fe_models.dynamics.curves.newton import (
    Equations,
    L,
    NewtonControl,
    NewtonSolution,
    iterate,
    linear_tolerance,
    solve,
)
from fe_models.dynamics.curves.sizes import norm
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

D = TypeVar("D")

# Unknowns are measured by their norm, but at least by this share of the largest norm on the curve:
# where all of them pass through zero, no step would be small enough.
LEAST_SHARE = 1e-2
# λ is measured by itself, but at least by this share of the farther end, for curves from λ = 0.
LEAST_PARAMETER = 0.1
# A tangent that turns in a step shorter than this turns at a corner, where a joint changes its
# state: such a step is taken however much it turns.
CORNER = 1e-3
# A tangent whose orientation changes in a step shorter than this has passed where curves cross.
CROSSING = 1e-5
# How often corrections on a curve are halved, and how many in a row may leave a residual above the
# least so far: where that is not enough, a shorter step is cheaper.
MAX_SHORTENED, PATIENCE = 1, 2
# Factor by which a step grows or shrinks at most after a point.
MOST_CHANGE = 2.0
# Share of its right-hand side that an iterative solver may leave of a tangent, which only begins
# the next step.
TANGENT_TOLERANCE = 1e-4


@dataclass(frozen=True)
class CurvePoint:
    """A point of a curve, enough to go on from it.

    ``unknowns`` ``(n,)`` and ``parameter``; ``tangent`` ``(n + 1,)``, the direction of both in
    which the curve is followed, and the ``step`` that comes next; ``orientation``, the sign of the
    determinant of the derivatives and the tangent, is the same along a smooth curve, also where it
    folds: another one says that a step has met the curve somewhere else (0: not known).
    ``iterations`` it took to get to the point, and what is left of the residual, ``relative``.
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


@dataclass(frozen=True)
class SolutionCurve:
    """Points in their order; ``message`` is empty if the curve reached the end that it was to."""

    points: tuple[CurvePoint, ...]
    message: str

    @property
    def parameters(self) -> Array:
        return np.array([point.parameter for point in self.points])

    @property
    def folds(self) -> tuple[int, ...]:
        """Points before which the curve has turned back in λ."""
        senses = [np.sign(point.tangent[-1]) for point in self.points]
        return tuple(i for i in range(1, len(senses)) if senses[i] != senses[i - 1])


class Scaling:
    """In what steps along a curve are measured: shares of the unknowns less ``origin``, and of λ.

    Unknowns of a norm below ``rounding`` have no size.
    """

    def __init__(self, farthest: float, origin: Array | None = None, rounding: float = 0.0) -> None:
        self._rounding = rounding
        self._farthest, self._largest, self.unknowns, self.parameter = farthest, 0.0, 1.0, 1.0
        self.origin = origin

    def adapt(self, point: CurvePoint) -> None:
        """Measure from this point on by the size it has."""
        vibration = point.unknowns if self.origin is None else point.unknowns - self.origin
        size = norm(vibration)
        size = size if size > self._rounding else 0.0
        self._largest = max(self._largest, size)
        self.unknowns = max(size, LEAST_SHARE * self._largest) or 1.0
        self.parameter = max(abs(point.parameter), LEAST_PARAMETER * self._farthest)

    def scaled(self, step: Array) -> Array:
        """A step ``(n + 1,)`` in shares."""
        shares = step / self.unknowns
        shares[-1] = step[-1] / self.parameter
        return np.asarray(shares)

    def unscaled(self, shares: Array) -> Array:
        """The inverse of :meth:`scaled`."""
        step = shares * self.unknowns
        step[-1] = shares[-1] * self.parameter
        return np.asarray(step)

    def column(self, slope: Array) -> Array:
        """∂r/∂λ ``(n,)`` by shares of λ, where ∂r/∂u is by shares of u and r in units of u."""
        return np.asarray(slope * (self.parameter / self.unknowns))

    def direction(self, point: CurvePoint) -> Array:
        """Direction ``(n + 1,)`` of the tangent in shares, of length 1."""
        shares = self.scaled(point.tangent)
        return np.asarray(shares / norm(shares))


def first_point(
    solution: NewtonSolution[L], parameter: float, upward: bool, step: float
) -> CurvePoint:
    """The point from which a curve is followed, with λ growing or falling."""
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
    """The next point of a curve and the equations there, or a message why there is none."""
    direction = scaling.direction(point)
    following = _try_steps(equations, point, direction, scaling, control)
    ahead = CORNER
    while following is None and ahead >= control.least:
        beyond = _direction_beyond_corner(equations, point, ahead * direction, scaling)
        if beyond is not None:
            short = replace(point, step=ahead)
            following = _try_steps(equations, short, beyond, scaling, control)
        ahead *= 0.1
    if following is not None:
        return following
    return (
        f"the curve ends at {point.parameter:.6g}: Newton's method does not converge on it with "
        f"steps down to {control.least:g}; give smaller least steps, more samples of the period, "
        "or go on from another point"
    )


def _try_steps(
    equations: Equations[L],
    point: CurvePoint,
    direction: Array,
    scaling: Scaling,
    control: ContinuationControl,
) -> tuple[CurvePoint, L] | None:
    """Go on in a direction (in shares), by the longest of ever shorter steps that leads on."""
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
                return replace(new, step=_adapted(step, new.iterations, angle, control)), at
        step *= 0.5
    return None


def _direction_beyond_corner(
    equations: Equations[L], point: CurvePoint, step: Array, scaling: Scaling
) -> Array | None:
    """Direction in shares in which a curve that turns back at a corner goes on, or None.

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
    """Newton's method across the tangent: the point, the equations there, its tangent in shares."""
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
        NewtonControl(control.tolerance, control.max_iterations, MAX_SHORTENED, PATIENCE),
    )
    if not last.at.relative <= control.tolerance:
        return None
    try:
        # That of the last Jacobian but one: a last correction does not turn it.
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
    """Direction ``(size,)`` of the curve, and the sign of the determinant, 0 if not known."""
    rhs = np.zeros(size)
    rhs[-1] = 1.0
    tangent = system.solve(rhs, TANGENT_TOLERANCE)
    return tangent / norm(tangent), system.sign


def _adapted(step: float, iterations: int, angle: float, control: ContinuationControl) -> float:
    """The step after one that took so many iterations and turned the tangent so much."""
    by_iterations = (control.iterations + 1) / (iterations + 1)
    by_angle = 0.5 * control.max_angle / max(angle, 1e-9)
    factor = min(by_iterations, by_angle, MOST_CHANGE)
    return min(max(step * max(factor, 1.0 / MOST_CHANGE), control.least), control.most)


@dataclass(frozen=True)
class Refinement(Generic[L]):
    """Finer equations, and how unknowns of the present ones become unknowns of theirs."""

    equations: Equations[L]
    lift: Callable[[Array], Array]

    def lifted(self, point: CurvePoint) -> CurvePoint:
        """A point of the present curve, near the one of the finer equations."""
        return replace(
            point,
            unknowns=self.lift(point.unknowns),
            tangent=np.append(self.lift(point.tangent[:-1]), point.tangent[-1]),
        )


class Recorder(Protocol[L, D]):
    """Whoever keeps what there is at the points of a curve, and has it followed more finely."""

    def describe(self, point: CurvePoint, at: L) -> D:
        """What there is at a point with these equations; nothing is remembered of it."""
        ...

    def take(self, description: D) -> Refinement[L] | None:
        """Keep the description of a new point, or forget it and ask for finer equations."""
        ...


def follow(
    equations: Equations[L],
    start: CurvePoint,
    span: tuple[float, float],
    control: ContinuationControl | None = None,
    recorder: Recorder[L, D] | None = None,
    origin: Array | None = None,
    rounding: float = 0.0,
    end: float | None = None,
    steps: Steps = COMPUTED,
) -> SolutionCurve:
    """Follow a curve from a point until λ leaves the ``span``; its last point lies on the end.

    ``end`` is the one of its two ends that the curve is to reach; without it either will do.
    The ``recorder`` takes every new point; where it answers with finer equations, the point is
    forgotten, and found again with these. Each of the ``steps`` finds and describes one; their
    lengths are shares of what the unknowns differ from an ``origin``, zero unless given; below a
    norm of ``rounding`` they do not differ. The start is not repeated among the points. A curve
    that does not reach an end says why.
    """
    control = control or ContinuationControl()
    scaling, point = Scaling(max(map(abs, span)), origin, rounding), start
    points: list[CurvePoint] = []
    while len(points) < control.max_points:
        scaling.adapt(point)
        following = steps(
            "point of a curve",
            partial(_described, equations, point, span, scaling, control, recorder),
        )
        if isinstance(following, str):
            return SolutionCurve(tuple(points), following)
        new, description = following
        finer = None if recorder is None or description is None else recorder.take(description)
        if finer is not None:
            equations = finer.equations
            scaling.origin = None if scaling.origin is None else finer.lift(scaling.origin)
            point = finer.lifted(point)
            scaling.adapt(point)
            refound = partial(_refound, equations, point, scaling, control)
            point = steps("point of a finer curve", refound)
            continue
        points.append(new)
        control.watch(new.parameter)
        if new.parameter in span:
            return SolutionCurve(tuple(points), _turned_back(start, points, end))
        point = new
    message = (
        f"the curve has {control.max_points} points and is at {point.parameter:.6g}: go on from "
        "its last point, or allow longer steps"
    )
    return SolutionCurve(tuple(points), message)


def _turned_back(start: CurvePoint, points: list[CurvePoint], end: float | None) -> str:
    """Message of a curve that left its span by the other end, empty if it did not."""
    last = points[-1].parameter
    if end is None or last == end:
        return ""
    farthest = min((point.parameter for point in (start, *points)), key=lambda at: abs(at - end))
    return (
        f"the curve turns back at {farthest:.6g} and leaves at {last:.6g}, it does not reach "
        f"{end:.6g}: give more harmonics or samples, shorter steps, or start from a solution nearby"
    )


def _refound(
    equations: Equations[L], point: CurvePoint, scaling: Scaling, control: ContinuationControl
) -> CurvePoint:
    """A point near a curve brought onto it at its λ, or nearby across its tangent where none is.

    Itself if that fails. It keeps the orientation: where equations that differ a little have a peak
    or a fold elsewhere, its tangent may be the opposite of the one it came with.
    """
    solution = solve(equations, point.unknowns, point.parameter, NewtonControl(control.tolerance))
    if solution.converged:
        upward = bool(point.tangent[-1] > 0.0)
        beside = first_point(solution, point.parameter, upward, point.step)
        return _oriented(beside, point.orientation)
    step = control.least * scaling.direction(point)
    across = correct(equations, point, step, scaling, control)
    if across is None:
        return point
    way = scaling.scaled(across[0].coordinates - point.coordinates)
    near = norm(way) <= control.most
    return _oriented(across[0], point.orientation) if near else point


def _oriented(point: CurvePoint, orientation: int) -> CurvePoint:
    """A point with the tangent in the sense that has this orientation; as it is where 0."""
    if point.orientation * orientation >= 0:
        return point
    return replace(point, tangent=-point.tangent, orientation=orientation)


def _described(
    equations: Equations[L],
    point: CurvePoint,
    span: tuple[float, float],
    scaling: Scaling,
    control: ContinuationControl,
    recorder: Recorder[L, D] | None,
) -> tuple[CurvePoint, D | None] | str:
    """The next point with what there is, or a message why there is none."""
    following = _next_within(equations, point, span, scaling, control)
    if isinstance(following, str):
        return following
    new, at = following
    return new, None if recorder is None else recorder.describe(new, at)


def _next_within(
    equations: Equations[L],
    point: CurvePoint,
    span: tuple[float, float],
    scaling: Scaling,
    control: ContinuationControl,
) -> tuple[CurvePoint, L] | str:
    """The next point, on the end of the span if it would be beyond."""
    following = next_point(equations, point, scaling, control)
    if isinstance(following, str) or span[0] < following[0].parameter < span[1]:
        return following
    return _end(equations, point, following[0], span, control)


def _end(
    equations: Equations[L],
    before: CurvePoint,
    beyond: CurvePoint,
    span: tuple[float, float],
    control: ContinuationControl,
) -> tuple[CurvePoint, L] | str:
    """The point at the end of the span that lies between two points."""
    end = span[0] if beyond.parameter <= span[0] else span[1]
    share = (end - before.parameter) / (beyond.parameter - before.parameter)
    between = before.unknowns + share * (beyond.unknowns - before.unknowns)
    solution = solve(equations, between, end, NewtonControl(control.tolerance))
    if not solution.converged:
        return solution.message
    new = replace(
        beyond,
        unknowns=solution.unknowns,
        parameter=end,
        iterations=beyond.iterations + solution.iterations,
        relative=solution.at.relative,
    )
    return new, solution.at
