"""Probe cases of a wear case: cheap variants whose short runs differ in one setting each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING, Generic, Literal

import numpy as np

from sa_solver.types import Array, Progress, unseen
from workflow.analyses.wear.approximations.approximation import Neighbour
from workflow.analyses.wear.approximations.convergence import share_of_difference
from workflow.analyses.wear.approximations.ladders import GRID_ORDER
from workflow.analyses.wear.approximations.probe_runs import (
    STEPS,
    UNCHECKED_FAILURES,
    Numbers,
    ProbeRun,
    probe_run,
    shortened,
)
from workflow.analyses.wear.case.base import FiniteElementCase
from workflow.analyses.wear.structure import AnyWearCase, WearStructure
from workflow.case.changing import changed

if TYPE_CHECKING:
    from workflow.models.loads import LoadSource

# Cells along a direction of the contact of a probe run: at most half of the case's, and no coarser
# grid has fewer than the least number. Line contacts use the largest number, since they are cheap.
MOST_CELLS, FEWEST = 64, 8
# Below this rate, loads that follow wear have hardly settled by the end of a probe run.
SLOW = 1e-2

Resultants = Literal["constant", "every"]


@dataclass(frozen=True)
class Probed:
    """Errors from probe runs: relative, positive where a result is too large.

    ``errors`` are those of ``mesh``, ``grid`` and ``link`` and, under ``coupling``, of loads that
    do not follow wear at all; loads that follow late cause the share :func:`late` of these. Loads
    settle at the ``rate``. ``failures`` has the reason why a part is missing.
    """

    errors: dict[str, Numbers] = field(default_factory=dict)
    failures: dict[str, str] = field(default_factory=dict)
    rate: float = 0.0


@dataclass(frozen=True)
class ProbeCases(Generic[AnyWearCase]):
    """The case ``own`` that represents that of a run in probe runs, and its neighbours by part.

    ``own`` has the ``same`` structure as the case of the run, or is a plane section. ``coupled``
    says whether the loads come from a structure, so that they can follow wear. The error due to the
    grid is multiplied by ``finer_cells`` for contacts with separate grids.
    """

    own: AnyWearCase
    same: bool
    coupled: bool
    neighbours: Mapping[str, Neighbour]
    finer_cells: Mapping[str, float]

    @classmethod
    def of(
        cls, case: AnyWearCase, structure: WearStructure[AnyWearCase], line: bool
    ) -> ProbeCases[AnyWearCase]:
        """Return the probe cases of a case; ``line`` says whether it has line contacts."""
        section, finer = structure.section(case), structure.finer(case)
        line = line or section is not None
        across, along = case.contact.grid
        grid = (MOST_CELLS, along) if line else (_fewer(across), _fewer(along))
        settings = {"contact.grid": grid, "contact.method": "normal"}
        own = shortened((section or case).on_one_grid(), settings)
        neighbours = {} if finer is None else {"mesh": finer}
        if (other := _other_grid(grid, case.contact.grid, line)) is not None:
            # The error of the case is smaller than that of the probe case by the last factor.
            refined, coarser = other[0] / grid[0], (grid[0] / across) ** GRID_ORDER
            share = share_of_difference(refined, GRID_ORDER) * coarser
            neighbours["grid"] = Neighbour({"contact.grid": other}, share)
        if own.contact.link != "corrected" and not case.half_spaces:
            neighbours["link"] = Neighbour({"contact.link": "corrected"})
        finer_cells = {
            name: (across / case.terms(name).grid[0]) ** GRID_ORDER for name in case.contact_names
        }
        coupled = isinstance(case, FiniteElementCase)
        return cls(own, section is None, coupled, neighbours, finer_cells)

    def probed(
        self,
        source: LoadSource | None,
        source_of: Callable[[AnyWearCase], LoadSource],
        progress: Progress = unseen,
    ) -> Probed:
        """Return the errors from all probe runs, without parts whose probe run fails.

        ``source`` is that of the case itself, not needed where another structure replaces it.
        ``progress`` is called with the number of probe runs done, that of ``own`` first.
        """
        probed = Probed()
        # Where loads follow wear, the effect of the mesh on this counts as well.
        kind: Resultants = "constant" if self.own.recoupling.resultants == "constant" else "every"
        try:
            shared = source if source is not None and self.same else source_of(self.own)
            first = probe_run(self.own, shared, kind)
        except UNCHECKED_FAILURES as failure:
            return Probed(failures={"mesh, grid and coupling": str(failure)})

        @cache
        def own(resultants: Resultants) -> ProbeRun:
            same = resultants == kind
            return first if same else probe_run(self.own, shared, resultants, first)

        def error(part: str) -> Numbers:
            if part == "coupling":
                return _difference(own("constant"), own("every"), 1.0)
            neighbour = self.neighbours[part]
            case = changed(self.own, neighbour.settings)
            if part == "mesh":
                other = probe_run(case, source_of(case), kind)
                return _difference(first, other, neighbour.share)
            # Unworn loads suffice for effects of the contacts.
            return _difference(own("constant"), probe_run(case, shared), neighbour.share)

        parts = [*self.neighbours, *(["coupling"] if self.coupled else [])]
        for done, part in enumerate(parts, 1):
            progress(done, 1 + len(parts))
            try:
                probed.errors[part] = error(part)
            except UNCHECKED_FAILURES as failure:
                probed.failures[part] = str(failure)
        if "grid" in probed.errors:
            probed.errors["grid"] = {
                name: scaled(numbers, self.finer_cells.get(name, 1.0))
                for name, numbers in probed.errors["grid"].items()
            }
        if "coupling" not in probed.errors:
            return probed
        return replace(probed, rate=_settling_rate(own("every")))


def late(rate: float, followed: Array) -> float:
    """Return the error of loads that follow late, relative to that of loads that never follow.

    The effect of wear on the loads, and of these on wear, settles: h' = 1 - z h, with z = ``rate``
    over all cycles, has worn (1 - exp(-z)) / z by the end. With h from the solution before, in
    shares ``followed`` of the cycles, it is (1 - Π(1 - z s)) / z, and 1 with unworn loads.
    """
    z = max(rate, SLOW)
    apart = z - 1.0 + (1.0 - z / STEPS) ** STEPS
    return float((np.exp(-z) - np.prod(1.0 - z * followed)) / apart)


def _settling_rate(run: ProbeRun) -> float:
    """Return the rate at which loads settle, from the smaller drift in the second step."""
    _, first, second, *_ = run.states[-1].drift
    return STEPS * float(np.clip(1.0 - second / first, 0.0, 1.0)) if first > 0.0 else 0.0


Cells = tuple[int, int]


def _other_grid(own: Cells, of_case: Cells, line: bool) -> Cells | None:
    """Return the grid to compare ``own`` with, or None if it would have too few cells.

    Strips are those of the case if these are fewer and resolve edges less, else twice as many. In
    space there are half as many cells along each direction.
    """
    if line:
        return of_case[0] if of_case[0] < own[0] else 2 * own[0], own[1]
    half = own[0] // 2, own[1] // 2
    return half if min(half) >= FEWEST else None


def _fewer(cells: int) -> int:
    """Return half of the cells along a direction, within the limits of probe runs."""
    return max(min(cells, 2 * FEWEST), min(MOST_CELLS, cells // 2))


def _difference(own: ProbeRun, other: ProbeRun, share: float) -> Numbers:
    """Return ``share`` times the relative differences; below 0 if ``own`` is the finer case."""

    def relative(mine: float, others: float) -> float:
        finer = mine if share < 0.0 else others
        return share * float((mine - others) / finer) if finer else 0.0

    results = other.worn_and_pressed
    return {
        name: {key: relative(value, results[name][key]) for key, value in numbers.items()}
        for name, numbers in own.worn_and_pressed.items()
    }


def scaled(numbers: Mapping[str, float], share: float) -> dict[str, float]:
    """Return the numbers multiplied by ``share``."""
    return {key: share * number for key, number in numbers.items()}
