"""Cheap cases beside one's own, whose short lives differ from each other in one thing only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic

from workflow.analyses.wear.budget.lives import Worn, live, shortened, worn_by
from workflow.analyses.wear.structure import AnyWearCase, Finer
from workflow.case.changing import changed

if TYPE_CHECKING:
    from wear.coupled import CoupledState
    from workflow.analyses.wear.load_source import LoadSource

# Order of what a contact wears in the size of its cells.
ORDER = 2.0
# Cells along a direction of a contact that lives shortly, half of the case's unless it is a line;
# with fewer than the least none lives.
MOST_CELLS, FEWEST = 64, 8


@dataclass(frozen=True)
class Companions(Generic[AnyWearCase]):
    """Cases that live shortly beside ``own``, which stands for the case that is run.

    ``own`` has the ``same`` structure as that case, or a section in its place. ``finer`` is on a
    mesh of which ``mesh_share`` times the difference is the error of ``own``. The contact grid of
    ``coarser`` has half as many cells along each direction, that of the case ``cells`` times as
    many as ``own``. ``linked`` has its contacts linked to the nodes of the structure, which ``own``
    has not. None where there is no such case.
    """

    own: AnyWearCase
    same: bool = True
    finer: AnyWearCase | None = None
    mesh_share: float = 1.0
    coarser: AnyWearCase | None = None
    cells: float = 1.0
    linked: AnyWearCase | None = None

    @classmethod
    def of(
        cls, case: AnyWearCase, finer: Finer[AnyWearCase] | None, line: bool
    ) -> Companions[AnyWearCase]:
        """Those of a case with, or without, a ``finer`` mesh; ``line`` as of its own contacts."""
        section = None if finer is None else finer.section
        line = line or section is not None
        across, along = case.contact.grid
        grid = (min(across, MOST_CELLS), along) if line else (_fewer(across), _fewer(along))
        settings = {"contact.grid": grid, "contact.method": "normal"}
        own = shortened(case if section is None else section, settings)
        linked = own.contact.link == "corrected"
        half = tuple(max(1, count // 2) for count in grid)
        enough = min(half[: 1 if line else 2]) >= FEWEST
        return cls(
            own,
            same=section is None,
            finer=None if finer is None else changed(own, finer.mesh),
            mesh_share=1.0 if finer is None else finer.share,
            coarser=changed(own, {"contact.grid": half}) if enough else None,
            cells=across / grid[0],
            linked=None if linked else changed(own, {"contact.link": "corrected"}),
        )

    def errors(
        self, source: LoadSource, source_of: Callable[[AnyWearCase], LoadSource]
    ) -> dict[str, Worn]:
        """What ``mesh``, ``grid`` and ``link`` leave, relative, of what is worn, and of pressure.

        ``source`` is that of the case itself. Raises what structures and contacts raise.
        """
        shared = source if self.same else source_of(self.own)
        own, errors = _worn(self.own, shared), {}
        if self.finer is not None:
            errors["mesh"] = _apart(own, _worn(self.finer, source_of(self.finer)), self.mesh_share)
        if self.coarser is not None:
            left = 1.0 / (2.0**ORDER - 1.0) / self.cells**ORDER
            errors["grid"] = _apart(own, _worn(self.coarser, shared), left)
        if self.linked is not None:
            errors["link"] = _apart(own, _worn(self.linked, shared), 1.0)
        return errors


def _fewer(cells: int) -> int:
    """Half of the cells along a direction, as long as these are many."""
    return max(min(cells, 2 * FEWEST), min(MOST_CELLS, cells // 2))


def _worn(case: AnyWearCase, source: LoadSource) -> Worn:
    """What a life wears of both bodies together, and its largest pressures."""
    # Where loads follow wear, what the mesh makes of it counts as well.
    coupled = case.recoupling.resultants != "constant"
    stages, (begin, *_, end) = live(case, source, "every" if coupled else "constant")
    pressures = zip(*(_largest_pressures(state) for state in (begin, end)), strict=True)
    return {
        name: numbers | {"peak_pressure": unworn, "worn_peak_pressure": worn}
        for (name, numbers), (unworn, worn) in zip(
            worn_by(stages, end).items(), pressures, strict=True
        )
    }


def _largest_pressures(state: CoupledState) -> list[float]:
    """By interface, in its cycle [MPa]."""
    return [
        max((start.pressure.max() for start in interface.starts.values()), default=0.0)
        for interface in state.interfaces
    ]


def _apart(own: Worn, other: Worn, share: float) -> Worn:
    """So large a share of the relative differences."""
    return {
        name: {
            key: share * abs(value - other[name][key]) / value if value else 0.0
            for key, value in numbers.items()
        }
        for name, numbers in own.items()
    }
