"""Probe cases of a wear case: cheap variants whose short runs differ in one setting each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Generic, Literal

import numpy as np

from sa_solver.types import Array, Progress, unseen
from workflow.analyses.wear.budget.lives import (
    LIFE_FAILURES,
    STEPS,
    Lived,
    Worn,
    live,
    shortened,
    worn_by,
)
from workflow.analyses.wear.case.base import FiniteElementCase
from workflow.analyses.wear.structure import AnyWearCase, Finer
from workflow.case.changing import changed

if TYPE_CHECKING:
    from wear.coupled import CoupledState
    from workflow.models.loads import LoadSource

# Order of convergence of wear in the size of the contact cells.
ORDER = 2.0
# Cells along a direction of the contact of a probe run: at most half of the case's, and no coarser
# grid has fewer than the least number. Line contacts use the largest number, since they are cheap.
MOST_CELLS, FEWEST = 64, 8
# Below this rate, loads that follow wear have hardly settled by the end of a probe run.
SLOW = 1e-2


@dataclass(frozen=True)
class Companions(Generic[AnyWearCase]):
    """Probe cases that are compared with ``own``, which represents the case of the run.

    ``own`` has the ``same`` structure as that case, or a plane section in its place. ``finer`` has
    a finer mesh; ``mesh_share`` times the difference is the error of ``own``. ``regridded`` has
    another contact grid; ``grid_share`` times the difference is the error of the case, to be
    multiplied by ``finer_cells`` for contacts with separate grids. ``linked`` has its contacts
    linked to the nodes of the structure, if ``own`` does not. Each is None where there is no such
    case. ``coupled`` says whether the loads come from a structure, so that they can follow wear.
    """

    own: AnyWearCase
    same: bool = True
    coupled: bool = False
    finer: AnyWearCase | None = None
    mesh_share: float = 1.0
    regridded: AnyWearCase | None = None
    grid_share: float = 0.0
    finer_cells: Mapping[str, float] = field(default_factory=dict)
    linked: AnyWearCase | None = None

    @classmethod
    def of(
        cls, case: AnyWearCase, finer: Finer[AnyWearCase] | None, line: bool
    ) -> Companions[AnyWearCase]:
        """Return the probe cases of a case; ``line`` says whether it has line contacts."""
        section = None if finer is None else finer.section
        line = line or section is not None
        across, along = case.contact.grid
        grid = (MOST_CELLS, along) if line else (_fewer(across), _fewer(along))
        settings = {"contact.grid": grid, "contact.method": "normal"}
        own = shortened((case if section is None else section).on_one_grid(), settings)
        linked = own.contact.link == "corrected"
        other, share = (_strips if line else _cells)(grid, case.contact.grid)
        return cls(
            own,
            same=section is None,
            coupled=isinstance(case, FiniteElementCase),
            finer=None if finer is None else changed(own, finer.mesh),
            mesh_share=1.0 if finer is None else finer.share,
            regridded=None if other is None else changed(own, {"contact.grid": other}),
            grid_share=share,
            finer_cells={
                name: (across / case.terms(name).grid[0]) ** ORDER for name in case.contact_names
            },
            linked=None if linked else changed(own, {"contact.link": "corrected"}),
        )

    def errors(
        self,
        source: LoadSource | None,
        source_of: Callable[[AnyWearCase], LoadSource],
        failed: Callable[[str, Exception], None],
        progress: Progress = unseen,
    ) -> tuple[dict[str, Worn], float]:
        """Return relative errors of wear and pressures, positive where a result is too large.

        They are the errors due to ``mesh``, ``grid`` and ``link`` and, under ``coupling``, those of
        loads that do not follow wear at all; loads that follow late cause the share :func:`late` of
        these. The second value is the rate at which the loads settle. ``source`` is that of the
        case itself, not needed where another structure replaces it.

        A part whose probe run fails is left out and passed to ``failed``. ``progress`` is called
        with the number of probe runs done, that of ``own`` first. Raises :data:`LIFE_FAILURES` if
        that one fails.
        """
        errors, (parts, following) = {}, self._parts(source, source_of)
        for lived, (part, told) in enumerate(parts.items(), 1):
            progress(lived, 1 + len(parts))
            try:
                errors[part] = told()
            except LIFE_FAILURES as error:
                failed(part, error)
        return errors, _rest(following()) if "coupling" in errors else 0.0

    def _parts(
        self, source: LoadSource | None, source_of: Callable[[AnyWearCase], LoadSource]
    ) -> tuple[dict[str, Callable[[], Worn]], Callable[[], Lived]]:
        """Run ``own``; return a function for each part, and one for its run with updated loads."""
        shared = source if source is not None and self.same else source_of(self.own)
        # Where loads follow wear, the effect of the mesh on this counts as well.
        follows = self.own.recoupling.resultants != "constant"
        kind: Literal["constant", "every"] = "every" if follows else "constant"
        life = live(self.own, shared, kind)
        own = _worn(life)

        @cache
        def apart() -> Worn:
            """Return the results under unworn loads, which suffice for effects of the contacts."""
            return _worn(live(self.own, shared, "constant", life)) if follows else own

        @cache
        def following() -> Lived:
            return life if follows else live(self.own, shared, "every", life)

        parts = dict[str, Callable[[], Worn]]()
        if (finer := self.finer) is not None:
            parts["mesh"] = lambda: _apart(
                own, _worn(live(finer, source_of(finer), kind)), self.mesh_share
            )
        if (regridded := self.regridded) is not None:
            parts["grid"] = lambda: self._of_grids(
                _apart(apart(), _worn(live(regridded, shared)), self.grid_share)
            )
        if (linked := self.linked) is not None:
            parts["link"] = lambda: _apart(apart(), _worn(live(linked, shared)), 1.0)
        if self.coupled and follows:
            parts["coupling"] = lambda: _apart(own, apart(), -1.0)
        elif self.coupled:
            parts["coupling"] = lambda: _apart(own, _worn(following()), 1.0)
        return parts, following

    def _of_grids(self, errors: Worn) -> Worn:
        """Return errors of ``contact.grid`` scaled to the grid of each contact."""
        return {
            name: scaled({name: numbers}, self.finer_cells.get(name, 1.0))[name]
            for name, numbers in errors.items()
        }


def late(rest: float, followed: Array) -> float:
    """Return the error of loads that follow late, relative to that of loads that never follow.

    The effect of wear on the loads, and of these on wear, settles: h' = 1 - z h, with z = ``rest``
    over all cycles, has worn (1 - exp(-z)) / z by the end. With h from the solution before, in
    shares ``followed`` of the cycles, it is (1 - Π(1 - z s)) / z, and 1 with unworn loads.
    """
    z = max(rest, SLOW)
    apart = z - 1.0 + (1.0 - z / STEPS) ** STEPS
    return float((np.exp(-z) - np.prod(1.0 - z * followed)) / apart)


def _rest(life: Lived) -> float:
    """Return the rate at which loads settle, from the smaller drift in the second step."""
    _, first, second, *_ = life[1][-1].drift
    return STEPS * float(np.clip(1.0 - second / first, 0.0, 1.0)) if first > 0.0 else 0.0


Cells = tuple[int, int]


def _strips(own: Cells, of_case: Cells) -> tuple[Cells, float]:
    """Return the strips to compare ``own`` with, and the factor from difference to error.

    They are those of the case if these are fewer and resolve edges less, else twice as many.
    """
    (strips, along), fewer = own, of_case[0] / own[0]
    if fewer < 1.0:
        return (of_case[0], along), -1.0 / (1.0 - fewer**ORDER)
    return (2 * strips, along), 1.0 / (1.0 - 0.5**ORDER) / fewer**ORDER


def _cells(own: Cells, of_case: Cells) -> tuple[Cells | None, float]:
    """Return half as many cells along each direction, if enough, and the factor to the error."""
    half = own[0] // 2, own[1] // 2
    share = -1.0 / (2.0**ORDER - 1.0) * (own[0] / of_case[0]) ** ORDER
    return half if min(half) >= FEWEST else None, share


def _fewer(cells: int) -> int:
    """Return half of the cells along a direction, within the limits of probe runs."""
    return max(min(cells, 2 * FEWEST), min(MOST_CELLS, cells // 2))


def _worn(life: Lived) -> Worn:
    """Return the wear of both bodies in a probe run, and its largest pressures."""
    stages, (begin, *_, end) = life
    pressures = zip(*(_largest_pressures(state) for state in (begin, end)), strict=True)
    return {
        name: numbers | {"peak_pressure": unworn, "worn_peak_pressure": worn}
        for (name, numbers), (unworn, worn) in zip(
            worn_by(stages, end).items(), pressures, strict=True
        )
    }


def _largest_pressures(state: CoupledState) -> list[float]:
    """Return the largest pressure in the cycle of each interface [MPa]."""
    return [
        max((start.pressure.max() for start in interface.starts.values()), default=0.0)
        for interface in state.interfaces
    ]


def _apart(own: Worn, other: Worn, share: float) -> Worn:
    """Return ``share`` times the relative differences; below 0 if ``own`` is the finer case."""
    return {
        name: {
            key: share
            * _relative(value, other[name][key], value if share < 0.0 else other[name][key])
            for key, value in numbers.items()
        }
        for name, numbers in own.items()
    }


def scaled(errors: Worn, share: float) -> Worn:
    """Return the errors multiplied by ``share``."""
    return {
        name: {key: share * error for key, error in numbers.items()}
        for name, numbers in errors.items()
    }


def _relative(value: float, other: float, finer: float) -> float:
    return float((value - other) / finer) if finer else 0.0
