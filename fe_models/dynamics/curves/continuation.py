"""Continuation of curves of solutions of r(u, λ) = 0 over a span of λ, past folds.

:mod:`fe_models.dynamics.curves.curve_steps` makes the steps. Here they are repeated until the curve
leaves the span, and the equations are refined on the way where a recorder requests it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Generic, Protocol, TypeVar

import numpy as np

# Re-exported for callers that import them together with the continuation.
from fe_models.dynamics.curves.curve_steps import ContinuationControl as ContinuationControl
from fe_models.dynamics.curves.curve_steps import CurvePoint, Scaling, correct, next_point
from fe_models.dynamics.curves.curve_steps import first_point as first_point
from fe_models.dynamics.curves.newton import Equations, L, NewtonControl, solve
from fe_models.dynamics.curves.sizes import norm
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

D = TypeVar("D")


@dataclass(frozen=True)
class SolutionCurve:
    """Points of a curve in their order; ``message`` is empty if the curve reached its end."""

    points: tuple[CurvePoint, ...]
    message: str

    @property
    def parameters(self) -> Array:
        return np.array([point.parameter for point in self.points])

    @property
    def folds(self) -> tuple[int, ...]:
        """Indices of the points before which the curve has turned back in λ."""
        senses = [np.sign(point.tangent[-1]) for point in self.points]
        return tuple(i for i in range(1, len(senses)) if senses[i] != senses[i - 1])


@dataclass(frozen=True)
class Refinement(Generic[L]):
    """Refined equations, and a function ``lift`` that maps unknowns to theirs."""

    equations: Equations[L]
    lift: Callable[[Array], Array]

    def lifted(self, point: CurvePoint) -> CurvePoint:
        """Return a point of the present curve as one near the curve of the refined equations."""
        return replace(
            point,
            unknowns=self.lift(point.unknowns),
            tangent=np.append(self.lift(point.tangent[:-1]), point.tangent[-1]),
        )


class CurveRecorder(Protocol[L, D]):
    """Protocol of an observer that records points of a curve, and can request refined equations."""

    def describe(self, point: CurvePoint, at: L) -> D:
        """Return a description of a point with its equations, without storing it."""
        ...

    def take(self, description: D) -> Refinement[L] | None:
        """Store the description of a new point, or discard it and return refined equations."""
        ...


def follow(
    equations: Equations[L],
    start: CurvePoint,
    span: tuple[float, float],
    control: ContinuationControl | None = None,
    recorder: CurveRecorder[L, D] | None = None,
    origin: Array | None = None,
    rounding: float = 0.0,
    end: float | None = None,
    steps: Steps = COMPUTED,
) -> SolutionCurve:
    """Follow a curve from a point until λ leaves its span.

    The last point is at the end of the span. The start is not repeated among the points. If the
    curve does not reach an end, its message says why.

    Parameters
    ----------
    equations
        Equations of the curve.
    start
        First point.
    span
        Smallest and largest λ.
    control
        Control of the steps.
    recorder
        Observer of every new point. If it returns refined equations, the point is discarded and
        found again with these.
    origin
        Unknowns ``(n,)`` relative to which step lengths are measured; zero if None.
    rounding
        Norm of unknowns less ``origin`` below which they count as equal.
    end
        End of the span that the curve must reach; either one if None.
    steps
        Runner of the steps, each of which finds and describes one point; see
        :class:`sa_solver.steps.Steps`.
    """
    control = control or ContinuationControl()
    scaling, point = Scaling(max(map(abs, span)), origin, rounding), start
    points: list[CurvePoint] = []
    while len(points) < control.max_points:
        scaling.adapt(point)
        following = steps(
            "point of a curve",
            partial(_find_and_describe, equations, point, span, scaling, control, recorder),
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
            project = partial(_projected, equations, point, scaling, control)
            point = steps("point of a finer curve", project)
            continue
        points.append(new)
        control.watch(new.parameter)
        if new.parameter in span:
            return SolutionCurve(tuple(points), _message_if_turned_back(start, points, end))
        point = new
    message = (
        f"the curve has {control.max_points} points and is at {point.parameter:.6g}: continue from "
        "its last point, or allow longer steps"
    )
    return SolutionCurve(tuple(points), message)


def _message_if_turned_back(start: CurvePoint, points: list[CurvePoint], end: float | None) -> str:
    """Return a message if a curve has left its span by the wrong end, else an empty one."""
    last = points[-1].parameter
    if end is None or last == end:
        return ""
    farthest = min((point.parameter for point in (start, *points)), key=lambda at: abs(at - end))
    return (
        f"the curve turns back at {farthest:.6g} and leaves at {last:.6g}, it does not reach "
        f"{end:.6g}: give more harmonics or samples, shorter steps, or start from a solution nearby"
    )


def _projected(
    equations: Equations[L], point: CurvePoint, scaling: Scaling, control: ContinuationControl
) -> CurvePoint:
    """Return a nearby point brought onto the curve, at its λ, or across its tangent if that fails.

    If both fail, the point itself is returned. Its orientation is kept: where refined equations
    have a peak or a fold elsewhere, the tangent may be the opposite of the present one.
    """
    solution = solve(equations, point.unknowns, point.parameter, NewtonControl(control.tolerance))
    if solution.converged:
        upward = bool(point.tangent[-1] > 0.0)
        projected = first_point(solution, point.parameter, upward, point.step)
        return _oriented(projected, point.orientation)
    step = control.least * scaling.direction(point)
    across = correct(equations, point, step, scaling, control)
    if across is None:
        return point
    distance = scaling.scaled(across[0].coordinates - point.coordinates)
    is_near = norm(distance) <= control.most
    return _oriented(across[0], point.orientation) if is_near else point


def _oriented(point: CurvePoint, orientation: int) -> CurvePoint:
    """Return a point with its tangent in the sense that has this orientation; unchanged if 0."""
    return point if point.orientation * orientation >= 0 else point.turned()


def _find_and_describe(
    equations: Equations[L],
    point: CurvePoint,
    span: tuple[float, float],
    scaling: Scaling,
    control: ContinuationControl,
    recorder: CurveRecorder[L, D] | None,
) -> tuple[CurvePoint, D | None] | str:
    """Return the next point with its description, or the reason why there is none."""
    following = _next_within_span(equations, point, span, scaling, control)
    if isinstance(following, str):
        return following
    new, at = following
    return new, None if recorder is None else recorder.describe(new, at)


def _next_within_span(
    equations: Equations[L],
    point: CurvePoint,
    span: tuple[float, float],
    scaling: Scaling,
    control: ContinuationControl,
) -> tuple[CurvePoint, L] | str:
    """Return the next point, moved to the end of the span if it is beyond it."""
    following = next_point(equations, point, scaling, control)
    if isinstance(following, str) or span[0] < following[0].parameter < span[1]:
        return following
    return _solve_at_end(equations, point, following[0], span, control)


def _solve_at_end(
    equations: Equations[L],
    before: CurvePoint,
    beyond: CurvePoint,
    span: tuple[float, float],
    control: ContinuationControl,
) -> tuple[CurvePoint, L] | str:
    """Return the point at the end of the span between two points."""
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
