"""Choice of increments of a structure's cycle for an error (``load_path.increments: auto``).

The unworn cycle of the structure is solved in few increments, and the error of worn depth and
energy due to each leg is estimated (:func:`sa_solver.cycles.increments.errors_of_increments`). The
error is of second order: a leg of n increments causes c/n². The smallest total Σ n for a given
Σ c/n² has n in proportion to the cubic root of c, so that legs with much slip under curved pressure
histories get the most. A cycle with twice as many increments then measures the error (Richardson):
where a front of slip passes node by node, the estimate from one cycle is too low, by a factor of up
to five on dovetails.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from math import ceil, inf, isfinite, sqrt
from typing import Any, Generic, TypeVar

import numpy as np

from fe_models.structure import InterfaceHistory
from sa_solver.cycles.increments import depth_and_energy, errors_of_increments, friction_work
from sa_solver.types import Array, Mask
from workflow.analyses.wear.case.base import MOST_INCREMENTS, FiniteElementCase
from workflow.analyses.wear.choice import Decision, record_of
from workflow.analyses.wear.translation import structure_loads
from workflow.case.changing import changed
from workflow.errors import MethodFailed
from workflow.models.budget.convergence import INCREMENTS_ORDER, share_of_difference
from workflow.models.budget.probe_runs import LESSER_INTERFACE
from workflow.models.structure_model import StructureModel

# Least increments of a leg. Two cause 6 % of error in the depth of a dovetail but an estimate of
# 0.2 %, because the estimate sees curvature within an increment only through its neighbours.
FEWEST = 4
# Least and largest factor of refinement from one try to the next: where fronts of slip pass node by
# node, the order is nearer to one than to two.
FINER, FINEST = 1.4, 2.0
# Error of slip whose pressure history cannot be estimated.
UNKNOWN = inf

Counts = tuple[int, ...]
Histories = Sequence[InterfaceHistory]
AnyCase = TypeVar("AnyCase", bound=FiniteElementCase)


def choose_increments(
    case: AnyCase, model: Callable[[AnyCase], StructureModel]
) -> tuple[AnyCase, dict[str, Any]]:
    """Return the case with the increments that ``wear.tolerance`` needs, and a record of why.

    ``model`` returns the structure of such a case, or a substitute. Raises the errors of ``model``.
    """
    begin, allowed = time.perf_counter(), case.wear.tolerance
    decision = decide_increments(case, model, allowed)
    return changed(case, decision.chosen), record_of([decision.timed(begin)], allowed, begin)


def decide_increments(
    case: AnyCase, model: Callable[[AnyCase], StructureModel], allowed: float
) -> Decision:
    """Return the least increments with errors of depth and energy up to ``allowed``, if any."""
    cycle = _Cycle(case, model)
    counts = cycle.expected(allowed)
    tried = [(counts, cycle.error(counts))]
    while tried[-1][1] > allowed and sum(counts) < MOST_INCREMENTS:
        factor = min(max(sqrt(tried[-1][1] / allowed), FINER), FINEST)
        counts = _capped([ceil(factor * count) for count in counts])
        tried.append((counts, cycle.error(counts)))
    error = tried[-1][1]
    why = (
        f"{' + '.join(map(str, counts))} in the legs of a cycle cause an error of "
        f"{100 * error:.2g} %, of {100 * allowed:.2g} % "
        f"allowed{'' if error <= allowed else ', the most available'}"
    )
    if any(case.legs):
        why += f"; the {sum(case.legs)} of the case cause {100 * cycle.error(case.legs):.2g} %"
    known = [error if isfinite(error) else None for _, error in tried]
    probe = {"legs": [legs for legs, _ in tried], "errors": known}
    return Decision(case.divided(counts), why, allowed, error, probe)


class _Cycle(Generic[AnyCase]):
    """The unworn cycle of a structure in any number of increments."""

    def __init__(self, case: AnyCase, model: Callable[[AnyCase], StructureModel]) -> None:
        self._case, self._model, self._few = case, model, (FEWEST,) * len(case.legs)
        self._stage = structure_loads(self._of(self._few), model)

    def _of(self, counts: Counts) -> AnyCase:
        return changed(self._case, self._case.divided(counts))

    def _solved(self, counts: Counts) -> Histories | None:
        """Return the histories of all faces, or None if few increments do not converge.

        Raises MethodFailed if the largest number of increments does not converge.
        """
        try:
            cycles = self._model(self._of(counts)).load_cycles
            return self._stage.cycle_under(cycles).histories
        except MethodFailed:
            if sum(counts) >= MOST_INCREMENTS:
                raise
            return None

    def expected(self, allowed: float) -> Counts:
        """Return the least increments of each leg that coarse cycles predict to be sufficient."""
        counts = self._few
        while sum(counts) < MOST_INCREMENTS:
            histories = self._solved(counts)
            errors = None if histories is None else errors_by_leg(histories, counts)
            if errors is not None:
                weights = [(e * n**2) ** (1 / 3) for e, n in zip(errors, counts, strict=True)]
                needed = [ceil(weight * sqrt(sum(weights) / allowed)) for weight in weights]
                return _capped([max(FEWEST, count) for count in needed])
            counts = _capped([2 * count for count in counts])
        return counts

    def error(self, counts: Counts) -> float:
        """Return the error of ``counts`` increments, by comparison with twice as many."""
        coarse, fine = self._solved(counts), self._solved(tuple(2 * count for count in counts))
        if coarse is None or fine is None:
            return UNKNOWN
        share = share_of_difference(2.0, INCREMENTS_ORDER)
        return share * float(differences(coarse, fine).max())


def _capped(counts: Sequence[int]) -> Counts:
    """Return the counts, scaled down to the largest total if they exceed it.

    The longest leg gets the remainder of the rounding.
    """
    if sum(counts) <= MOST_INCREMENTS:
        return tuple(counts)
    capped = [max(1, MOST_INCREMENTS * count // sum(counts)) for count in counts]
    capped[capped.index(max(capped))] += MOST_INCREMENTS - sum(capped)
    return tuple(capped)


def errors_by_leg(histories: Histories, counts: Counts) -> list[float] | None:
    """Return the estimated error due to each leg's increments, or None if it is unknown.

    Errors are relative to depth and energy of a face, or to a share of those of a face that is
    rubbed much more.
    """
    works = [_work(history).sum(axis=0) for history in histories]
    ends, largest = np.cumsum((0, *counts)), np.zeros(len(counts))
    for history, work, scale in zip(histories, works, _scales(histories, works), strict=True):
        if not work.any():
            continue
        errors = errors_of_increments(*_rubbing(history))
        if errors is None:
            return None
        of_cycle = errors.reshape(-1, ends[-1], errors.shape[1]).sum(axis=0)
        parts = [of_cycle[begin:end].sum(axis=0) for begin, end in pairwise(ends)]
        largest = np.maximum(largest, [np.max(_size(history, part) / scale) for part in parts])
    return [float(error) for error in largest]


def differences(coarse: Histories, fine: Histories) -> Array:
    """Return the largest relative differences ``(2,)`` of depth and energy between two cycles."""
    works = [_work(history).sum(axis=0) for history in fine]
    largest = np.zeros(2)
    for history, other, work, scale in zip(fine, coarse, works, _scales(fine, works), strict=True):
        if scale.all():
            apart = _size(history, _work(other).sum(axis=0) - work) / scale
            largest = np.maximum(largest, apart)
    return largest


def _rubbing(history: InterfaceHistory) -> tuple[Array, Array, Mask, list[slice]]:
    """Return pressure times frequency, slip, and the masks and slices for sums over increments."""
    loads = history.loads
    return loads.share[:, None] * history.pressure, history.slip, loads.P > 0.0, loads.missions


def _work(history: InterfaceHistory) -> Array:
    """Return the work of the increments over µ per area of each node ``(t, n)`` [N/mm]."""
    return friction_work(*_rubbing(history))


def _size(history: InterfaceHistory, work: Array) -> Array:
    return depth_and_energy(work, history.interface.nodal_areas)


def _scales(histories: Histories, works: Sequence[Array]) -> Array:
    """Return the values that errors of each face are relative to ``(faces, 2)``."""
    sizes = np.array([_size(*pair) for pair in zip(histories, works, strict=True)])
    return np.asarray(np.maximum(sizes, LESSER_INTERFACE * sizes.max(axis=0)))
