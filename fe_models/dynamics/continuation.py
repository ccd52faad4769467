"""Solutions of r(u, λ) = 0 and curves of them, also where the curve turns back in λ.

The curve is followed by its length: from a point the tangent is gone along by a step, and Newton's
method leads back to the curve in the plane across the tangent there (Keller 1977; Seydel 2010,
*Practical Bifurcation and Stability Analysis*, 3rd ed., section 4.5). Length is measured in shares
of the unknowns' own norm and of λ, so that a step is a relative change, near a resonance and far
from it. It is adapted to the number of iterations and to how much the tangent turns.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from fe_models.dynamics.bordered import (
    LEFT,
    Bordered,
    LinearMap,
    solve_alone,
    solve_bordered,
)
from sa_solver.types import Array

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
# Share of the residual that an iterative solver may leave. Newton's method squares a small relative
# residual: more digits than that has are lost again.
MOST_LEFT = 1e-2
# The same of a tangent, which only begins the next step.
TANGENT_LEFT = 1e-4


class Linearisation(Protocol):
    """r ``(n,)``, ∂r/∂u, ∂r/∂λ ``(n,)``, and the norm of the terms r is the sum of.

    ∂r/∂u is a matrix ``(n, n)``, or what multiplies like one. ``relative`` is the residual's norm
    over ``size``: 0 if it vanishes, infinite if it is not a number.
    """

    @property
    def residual(self) -> Array: ...
    @property
    def jacobian(self) -> Array | LinearMap: ...
    @property
    def slope(self) -> Array: ...
    @property
    def size(self) -> float: ...
    @property
    def relative(self) -> float: ...


def relative_norm(residual: Array, size: float) -> float:
    """A residual's norm over ``size``: 0 if it vanishes, infinite if it is not a number."""
    norm = float(np.linalg.norm(residual))
    if not np.isfinite(norm):
        return np.inf
    return norm / size if norm > 0.0 else 0.0


L = TypeVar("L", bound=Linearisation)
L_co = TypeVar("L_co", bound=Linearisation, covariant=True)


class Equations(Protocol[L_co]):
    """r(u, λ) and its derivatives, for u ``(n,)``."""

    def __call__(self, unknowns: Array, parameter: float) -> L_co: ...


@dataclass(frozen=True)
class NewtonControl:
    """When Newton's method has converged, and when it is given up.

    ``max_shortened``: how often a correction that does not lower the residual is halved.
    ``patience``: so many iterations in a row without a new least residual end it; None: any number.
    """

    tolerance: float = 1e-10
    max_iterations: int = 25
    max_shortened: int = 5
    patience: int | None = None


@dataclass(frozen=True)
class ContinuationControl:
    """Steps along a curve, as shares of the unknowns and of λ.

    ``first``, ``least`` and ``most`` sizes; ``iterations`` of Newton's method that are wanted, and
    ``max_iterations``, after which a step is halved; ``max_angle`` [degrees] by which the tangent
    may turn in one step; ``max_points`` on one curve.
    """

    first: float = 0.02
    least: float = 1e-6
    most: float = 0.3
    iterations: int = 4
    max_iterations: int = 8
    max_angle: float = 30.0
    max_points: int = 2000
    tolerance: float = 1e-10


@dataclass(frozen=True)
class CurvePoint:
    """A point of a curve, enough to go on from it.

    ``unknowns`` ``(n,)`` and ``parameter``; ``tangent`` ``(n + 1,)``, the direction of both in
    which the curve is followed, and the ``step`` that comes next; ``orientation``, the sign of the
    determinant of the derivatives and the tangent, is the same along a smooth curve, also where it
    folds: another one says that a step has met the curve somewhere else (0: not known).
    ``iterations`` it took to find the point, and what is left of the residual, ``relative``.
    """

    unknowns: Array
    parameter: float
    tangent: Array
    step: float
    orientation: int
    iterations: int
    relative: float


@dataclass(frozen=True)
class NewtonSolution(Generic[L]):
    """Unknowns found for a parameter; ``message`` is empty, or says why they are not."""

    unknowns: Array
    at: L
    iterations: int
    message: str

    @property
    def converged(self) -> bool:
        return not self.message


@dataclass(frozen=True)
class SolutionCurve:
    """Points in their order; ``message`` is empty if the curve reached an end of its span."""

    points: tuple[CurvePoint, ...]
    message: str

    @property
    def parameters(self) -> Array:
        return np.array([point.parameter for point in self.points])

    @property
    def folds(self) -> tuple[int, ...]:
        """Points before which the curve has turned back in λ."""
        ways = [np.sign(point.tangent[-1]) for point in self.points]
        return tuple(i for i in range(1, len(ways)) if ways[i] != ways[i - 1])


def solve(
    equations: Equations[L],
    unknowns: Array,
    parameter: float,
    control: NewtonControl | None = None,
) -> NewtonSolution[L]:
    """Newton's method at a given λ."""
    control = control or NewtonControl()
    found = _newton(
        lambda place: equations(place, parameter),
        lambda at: solve_alone(at.jacobian, -at.residual, _left(at)),
        unknowns,
        control,
    )
    message = (
        ""
        if found.at.relative <= control.tolerance
        else f"Newton's method leaves a residual of {found.at.relative:.2g} at {parameter:g} after "
        f"{found.iterations} iterations: start from a solution nearby"
    )
    return NewtonSolution(found.unknowns, found.at, found.iterations, message)


def _left(at: Linearisation) -> float:
    """Share of the residual that an iterative solver may leave of it."""
    return min(max(at.relative, LEFT), MOST_LEFT)


def _newton(
    equations_at: Callable[[Array], L],
    correction_of: Callable[[L], Array],
    place: Array,
    control: NewtonControl,
) -> NewtonSolution[L]:
    """Newton's method from a place; what it has when it ends, converged or not.

    A correction that does not lower the residual is shortened. Where shortening does not help, a
    corner of the equations is in the way, and the whole correction leads to its other side.
    """
    at = equations_at(place)
    least, waited = at.relative, 0
    for iteration in range(control.max_iterations):
        if at.relative <= control.tolerance or not np.isfinite(at.relative):
            return NewtonSolution(place, at, iteration, "")
        if waited == control.patience:
            return NewtonSolution(place, at, iteration, "")
        try:
            correction = correction_of(at)
        except np.linalg.LinAlgError:
            return NewtonSolution(place, at, iteration, "")
        norm, whole = np.linalg.norm(at.residual), place + correction
        trial = whole_at = equations_at(whole)
        shortened = 0
        while np.linalg.norm(trial.residual) >= norm and shortened < control.max_shortened:
            shortened += 1
            trial = equations_at(place + 0.5**shortened * correction)
        if np.linalg.norm(trial.residual) < norm:
            place, at = place + 0.5**shortened * correction, trial
        else:
            place, at = whole, whole_at
        waited = 0 if at.relative < least else waited + 1
        least = min(least, at.relative)
    return NewtonSolution(place, at, control.max_iterations, "")


class Measure:
    """How long ways along a curve are: shares of the unknowns less ``origin``, and of λ.

    Unknowns of a norm below ``rounding`` have no size.
    """

    def __init__(self, farthest: float, origin: Array | None = None, rounding: float = 0.0) -> None:
        self._rounding = rounding
        self._farthest, self._largest, self.unknowns, self.parameter = farthest, 0.0, 1.0, 1.0
        self.origin = origin

    def take(self, point: CurvePoint) -> None:
        """Measure from this point on by the size it has."""
        moved = point.unknowns if self.origin is None else point.unknowns - self.origin
        norm = float(np.linalg.norm(moved))
        norm = norm if norm > self._rounding else 0.0
        self._largest = max(self._largest, norm)
        self.unknowns = max(norm, LEAST_SHARE * self._largest) or 1.0
        self.parameter = max(abs(point.parameter), LEAST_PARAMETER * self._farthest)

    def shares(self, way: Array) -> Array:
        """A way ``(n + 1,)`` in shares."""
        shares = way / self.unknowns
        shares[-1] = way[-1] / self.parameter
        return np.asarray(shares)

    def way(self, shares: Array) -> Array:
        """The inverse of :meth:`shares`."""
        way = shares * self.unknowns
        way[-1] = shares[-1] * self.parameter
        return np.asarray(way)


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
    equations: Equations[L], point: CurvePoint, measure: Measure, control: ContinuationControl
) -> tuple[CurvePoint, L] | str:
    """The next point of a curve and the equations there, or a message why there is none."""
    shares = measure.shares(point.tangent)
    direction = shares / np.linalg.norm(shares)
    found = _try_steps(equations, point, direction, measure, control)
    ahead = CORNER
    while found is None and ahead >= control.least:
        turned = _turned(equations, point, ahead * direction, measure)
        if turned is not None:
            short = replace(point, step=ahead)
            found = _try_steps(equations, short, turned, measure, control)
        ahead *= 0.1
    if found is not None:
        return found
    return (
        f"the curve ends at {point.parameter:.6g}: Newton's method does not converge on it with "
        f"steps down to {control.least:g}; give smaller least steps, more samples of the period, "
        "or go on from another point"
    )


def _try_steps(
    equations: Equations[L],
    point: CurvePoint,
    direction: Array,
    measure: Measure,
    control: ContinuationControl,
) -> tuple[CurvePoint, L] | None:
    """Go on in a direction (in shares), by the longest of ever shorter steps that leads on."""
    step = min(point.step, control.most)
    while step >= control.least:
        found = _correct(equations, point, step * direction, measure, control)
        if found is not None:
            new, at, along = found
            cosine = min(max(float(along @ direction), -1.0), 1.0)
            angle = float(np.degrees(np.arccos(cosine)))
            same = new.orientation * point.orientation >= 0
            if (same and (angle <= control.max_angle or step <= CORNER)) or step <= CROSSING:
                return replace(new, step=_adapted(step, new.iterations, angle, control)), at
        step *= 0.5
    return None


def _turned(
    equations: Equations[L], point: CurvePoint, step: Array, measure: Measure
) -> Array | None:
    """Direction in shares in which a curve that turns back at a corner goes on, or None.

    It is the tangent beyond the corner, in the sense that keeps the orientation.
    """
    place = np.append(point.unknowns, point.parameter) + measure.way(step)
    at = equations(place[:-1], float(place[-1]))
    wanted = np.zeros((len(place), 1))
    wanted[-1] = 1.0
    column = at.slope * (measure.parameter / measure.unknowns)
    try:
        tangent, orientation = solve_bordered(
            at.jacobian, column, step / np.linalg.norm(step), wanted
        )
    except np.linalg.LinAlgError:
        return None
    if orientation * point.orientation >= 0:
        return None
    return np.asarray(-tangent[:, 0] / np.linalg.norm(tangent))


def _correct(
    equations: Equations[L],
    point: CurvePoint,
    step: Array,
    measure: Measure,
    control: ContinuationControl,
) -> tuple[CurvePoint, L, Array] | None:
    """Newton's method across the tangent: the point, the equations there, its tangent in shares."""
    first = step / np.linalg.norm(step)
    system: Bordered | None = None

    def system_of(at: L) -> Bordered:
        return Bordered(at.jacobian, at.slope * (measure.parameter / measure.unknowns), first)

    def correction_of(at: L) -> Array:
        nonlocal system
        system = system_of(at)
        wanted = np.append(at.residual / -measure.unknowns, 0.0)
        return measure.way(system.solve(wanted, _left(at)))

    found = _newton(
        lambda place: equations(place[:-1], float(place[-1])),
        correction_of,
        np.append(point.unknowns, point.parameter) + measure.way(step),
        NewtonControl(control.tolerance, control.max_iterations, MAX_SHORTENED, PATIENCE),
    )
    if not found.at.relative <= control.tolerance:
        return None
    try:
        # That of the last Jacobian but one: a last correction does not turn it.
        along, orientation = _tangent(system or system_of(found.at), len(first))
    except np.linalg.LinAlgError:
        return None
    place = found.unknowns
    new = CurvePoint(
        unknowns=place[:-1],
        parameter=float(place[-1]),
        tangent=measure.way(along),
        step=point.step,
        orientation=orientation,
        iterations=found.iterations,
        relative=found.at.relative,
    )
    return new, found.at, along


def _tangent(system: Bordered, size: int) -> tuple[Array, int]:
    """Direction ``(size,)`` of the curve, and the sign of the determinant, 0 if not known."""
    wanted = np.zeros(size)
    wanted[-1] = 1.0
    tangent = system.solve(wanted, TANGENT_LEFT)
    return tangent / np.linalg.norm(tangent), system.sign


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
            orientation=0,
        )


def follow(
    equations: Equations[L],
    start: CurvePoint,
    span: tuple[float, float],
    control: ContinuationControl | None = None,
    on_point: Callable[[CurvePoint, L], Refinement[L] | None] | None = None,
    origin: Array | None = None,
    rounding: float = 0.0,
) -> SolutionCurve:
    """Follow a curve from a point until λ leaves the ``span``; its last point lies on the end.

    ``on_point`` is told every new point; where it answers with finer equations, the point is
    forgotten, and found again with these. Steps are shares of what the unknowns differ from an
    ``origin``, zero unless given; below a norm of ``rounding`` they do not differ. The start is not
    repeated among the points. A curve that does not reach an end says why.
    """
    control = control or ContinuationControl()
    measure, point = Measure(max(map(abs, span)), origin, rounding), start
    points: list[CurvePoint] = []
    while len(points) < control.max_points:
        measure.take(point)
        found = _next_within(equations, point, span, measure, control)
        if isinstance(found, str):
            return SolutionCurve(tuple(points), found)
        new, at = found
        finer = on_point(new, at) if on_point is not None else None
        if finer is not None:
            equations = finer.equations
            measure.origin = None if measure.origin is None else finer.lift(measure.origin)
            point = _moved(equations, finer.lifted(point), measure, control)
            continue
        points.append(new)
        if new.parameter in span:
            return SolutionCurve(tuple(points), "")
        point = new
    message = (
        f"the curve has {control.max_points} points and is at {point.parameter:.6g}: go on from "
        "its last point, or allow longer steps"
    )
    return SolutionCurve(tuple(points), message)


def _moved(
    equations: Equations[L], point: CurvePoint, measure: Measure, control: ContinuationControl
) -> CurvePoint:
    """A point near a curve moved onto it, across its tangent or at its λ; itself if that fails."""
    measure.take(point)
    shares = measure.shares(point.tangent)
    direction = shares / np.linalg.norm(shares)
    across = _correct(equations, point, control.least * direction, measure, control)
    if across is not None:
        return across[0]
    solution = solve(equations, point.unknowns, point.parameter, NewtonControl(control.tolerance))
    return replace(point, unknowns=solution.unknowns) if solution.converged else point


def _next_within(
    equations: Equations[L],
    point: CurvePoint,
    span: tuple[float, float],
    measure: Measure,
    control: ContinuationControl,
) -> tuple[CurvePoint, L] | str:
    """The next point, on the end of the span if it would be beyond."""
    found = next_point(equations, point, measure, control)
    if isinstance(found, str) or span[0] < found[0].parameter < span[1]:
        return found
    return _end(equations, point, found[0], span, control)


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
