"""Comparison of the rungs of an axis: their references, errors and efficiency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, nan

from workflow.analyses.wear.approximations.approximation import Approximation, Rung
from workflow.chart.costs import RunCost
from workflow.chart.frontier import Option, efficient
from workflow.models.budget.convergence import Convergence, richardson

# Relative changes of a quantity below this are rounding, and say nothing about convergence.
ROUNDING = 1e-12
# Relative scatter of the run times of the same run, even on an otherwise idle machine.
TIMING = 0.1
# Seconds in a log have two decimals.
SHORTEST = 1e-2


@dataclass(frozen=True)
class Point:
    """Setting of a ladder that has run, with its errors relative to the references.

    ``values`` are by quantity; ``extras`` are only reported. ``baseline`` marks the settings of the
    case itself. ``error`` is the largest relative difference, that of the quantity ``worst``;
    ``bound`` adds the floor of the reference. ``unresolved`` means that the error is smaller than
    the uncertainty of the references. ``seconds`` is the cost that decides: see
    :func:`seconds_by_work`.
    """

    setting: Rung
    baseline: bool
    folder: str
    values: Mapping[str, float]
    cost: RunCost
    extras: Mapping[str, float] = field(default_factory=dict)
    error: float = inf
    worst: str = ""
    bound: float = inf
    seconds: float = inf
    unresolved: bool = False
    by_seconds: bool = False
    by_convolutions: bool = False

    @property
    def name(self) -> str:
        return self.setting.name


@dataclass(frozen=True)
class Reference:
    """Reference value of a quantity: a closed form, or the value of the last rung.

    ``order`` and ``floor`` come from the last rungs: ``floor`` estimates the error of the
    reference, relative to its value; it is 0 for a closed form and for a choice.
    """

    value: float
    exact: bool
    order: float | None
    floor: float

    def error(self, value: float) -> float:
        """Return the relative difference of a value from the reference."""
        return abs(value - self.value) / abs(self.value)


@dataclass(frozen=True)
class Ladder:
    """Approximation with all of its runs; ``failed`` has a message for each that failed."""

    axis: Approximation
    rungs: tuple[Point, ...]
    references: Mapping[str, Reference]
    failed: Mapping[str, str]

    @property
    def floor(self) -> float:
        """Largest uncertainty of the references, relative."""
        return max((reference.floor for reference in self.references.values()), default=nan)

    @property
    def baseline(self) -> Point | None:
        """Rung with the settings of the case itself, or None if it did not run."""
        return next((rung for rung in self.rungs if rung.baseline), None)

    @property
    def scatter(self) -> float:
        """Relative scatter of the times: by how much they contradict the order of the work."""
        excess = [rung.cost.seconds / rung.seconds - 1.0 for rung in self.rungs]
        return max([TIMING, *excess])

    def cheapest(self, accuracy: float) -> Point | None:
        """Return the rung of least cost whose error is certainly at most ``accuracy``.

        On a branch this is the coarsest such rung, whatever the measured times are. Branches are
        compared by seconds, and by convolutions where their seconds differ within the scatter.
        """
        met = [rung for rung in self.rungs if rung.bound <= accuracy]
        met = [rung for rung in met if not any(_finer(rung, other) for other in met)]
        least = min((rung.seconds for rung in met), default=0.0)
        quick = [rung for rung in met if rung.seconds <= (1.0 + self.scatter) * least]
        return min(quick, key=lambda rung: rung.cost.convolutions, default=None)

    def options(self) -> list[Option]:
        """Return the rungs as choices, with costs relative to that of the case's own settings."""
        baseline = self.baseline
        if baseline is None:
            return []
        return [Option(r.name, r.seconds / baseline.seconds, r.bound) for r in self.rungs]


def seconds_by_work(points: Sequence[Point]) -> list[float]:
    """Return the seconds of each rung, at most those of any finer rung of its branch.

    A coarser rung does less of the same work: if it took longer, the machine was busy otherwise.
    Seconds are logged to a hundredth, which is the smallest value returned.
    """
    seconds = [max(point.cost.seconds, SHORTEST) for point in points]
    return [
        min([own, *(s for s, other in zip(seconds, points, strict=True) if _finer(other, point))])
        for own, point in zip(seconds, points, strict=True)
    ]


def _finer(one: Point, other: Point) -> bool:
    """Return whether ``one`` is a finer rung of the branch of ``other``."""
    step, coarser = one.setting.step, other.setting.step
    if one.setting.branch != other.setting.branch or step is None or coarser is None:
        return False
    return step < coarser


def judge(
    axis: Approximation,
    points: Sequence[Point],
    exact: Mapping[str, float],
    failed: Mapping[str, str],
    finest: str = "",
) -> Ladder:
    """Compare the points of an axis, coarse to fine, with the last of them.

    If the axis is a choice and the last point is not the ``finest`` rung, the errors are unknown.

    Quantities in ``exact`` are compared with those values instead, where the axis converges to
    them. Quantities that are 0 in the reference, or that a point does not have, are left out.
    """
    last = points[-1]
    shared = [q for q in last.values if all(q in point.values for point in points)]
    references = {q: _reference(axis, points, q, exact) for q in shared}
    if axis.order is None and finest not in ("", last.setting.name):
        references = {q: replace(reference, floor=inf) for q, reference in references.items()}
    references = {q: reference for q, reference in references.items() if reference.value}
    floor = max((reference.floor for reference in references.values()), default=0.0)
    judged = []
    for point, seconds in zip(points, seconds_by_work(points), strict=True):
        errors = {q: reference.error(point.values[q]) for q, reference in references.items()}
        worst = max(errors, key=errors.__getitem__, default="")
        error = errors.get(worst, inf)
        bound = max((e + references[q].floor for q, e in errors.items()), default=inf)
        point = replace(point, error=error, bound=bound, unresolved=error < floor)
        judged.append(replace(point, seconds=seconds, worst=worst if error > 0.0 else ""))
    bounds = [point.bound for point in judged]
    by_seconds = efficient([point.seconds for point in judged], bounds)
    by_convolutions = efficient([float(point.cost.convolutions) for point in judged], bounds)
    flags = zip(judged, by_seconds, by_convolutions, strict=True)
    rungs = [replace(p, by_seconds=quick, by_convolutions=few) for p, quick, few in flags]
    return Ladder(axis, tuple(rungs), references, failed)


def _reference(
    axis: Approximation, points: Sequence[Point], quantity: str, exact: Mapping[str, float]
) -> Reference:
    """Return the closed form, or the value of the last point with its error on its branch.

    A branch without steps is a choice.
    """
    last = points[-1]
    value, convergence = last.values[quantity], Convergence(None, 0.0)
    branch = {
        step: point.values[quantity]
        for point in points
        if point.setting.branch == last.setting.branch and (step := point.setting.step) is not None
    }
    if axis.order is not None and branch:
        noise = ROUNDING * abs(value)
        convergence = richardson([*branch.values()], [*branch], axis.order, noise)
    if axis.closed_form and quantity in exact:
        return Reference(exact[quantity], True, convergence.order, 0.0)
    floor = convergence.error / abs(value) if value else 0.0
    return Reference(value, False, convergence.order, floor)
