"""Probe models of a wear model: cheap variants whose short runs differ in one setting each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Literal, cast

import numpy as np

from sa_solver.types import Array, Progress, unseen
from workflow.models.budget.convergence import GRID_ORDER, share_of_difference
from workflow.models.budget.probe_runs import (
    STEPS,
    TOLERANCE,
    UNCHECKED_FAILURES,
    Numbers,
    ProbeRun,
    probe_run,
)
from workflow.models.contact import Contact
from workflow.models.loads import LoadSource, UncoupledSource
from workflow.models.structure_model import StructureModel
from workflow.models.uncoupled.body_pair import BodyPair
from workflow.models.wear import WearModel

# Cells along a direction of the contact of a probe run: at most half of the model's, and no coarser
# grid has fewer than the least number. Line contacts use the largest number, since they are cheap.
MOST_CELLS, FEWEST = 64, 8
# Below this rate, loads that follow wear have hardly settled by the end of a probe run.
SLOW = 1e-2
# Cells across and along the faces of probe runs that compare meshes along a slot.
SLOT_CELLS = 32, 64

Resultants = Literal["constant", "every"]


@dataclass(frozen=True)
class Probed:
    """Errors from probe runs: relative, positive where a result is too large.

    ``errors`` are those of ``mesh``, ``slot``, ``grid`` and ``link`` and, under ``coupling``, of
    loads that do not follow wear at all; loads that follow late cause the share :func:`late` of
    these. Loads settle at the ``rate``. ``failures`` has the reason why a part is missing.
    """

    errors: dict[str, Numbers] = field(default_factory=dict)
    failures: dict[str, str] = field(default_factory=dict)
    rate: float = 0.0


@dataclass(frozen=True)
class Neighbour:
    """A finer or coarser ``model`` than ``own``.

    The error of ``own`` is ``share`` times their difference, which is relative to the finer of
    both: a ``share`` below 0 means that ``model`` is the coarser one.
    """

    own: WearModel
    model: WearModel
    share: float = 1.0


@dataclass(frozen=True)
class ProbeModels:
    """The model ``own`` that represents that of a run in probe runs, and its neighbours by part.

    ``own`` has the ``same`` structure as the model of the run, or is a plane section. ``coupled``
    says whether the loads can follow wear. The error due to the grid is multiplied by
    ``finer_cells`` for contacts with separate grids.
    """

    own: WearModel
    same: bool
    coupled: bool
    neighbours: Mapping[str, Neighbour]
    finer_cells: Mapping[str, float]

    @classmethod
    def of(cls, model: WearModel, source: LoadSource) -> ProbeModels:
        """Return the probe models of a model whose loads are ``source``."""
        structure, section, wear = structure_of(model), None, model.wear
        if structure is not None and (section := structure.section()) is not None:
            structure, wear = section, replace(wear, motion="neglect")
        line = source.line or section is not None
        own_grids = _grids(model)
        of_model = _shared_grid(own_grids)
        across, along = of_model
        grid = (MOST_CELLS, along) if line else (_fewer(across), _fewer(along))
        own = WearModel(structure or model.structure, model.contacts, wear)
        own = _with(own, grid=grid, method="normal", tolerance=TOLERANCE)
        neighbours = {}
        if structure is not None and (finer := structure.finer_mesh()) is not None:
            neighbours["mesh"] = Neighbour(
                own, replace(own, structure=finer.structure), finer.share
            )
        if (slot := along_slot(model)) is not None:
            neighbours["slot"] = slot
        if (other := _other_grid(grid, of_model, line)) is not None:
            # The error of the model is smaller than that of the probe model by the last factor.
            refined, coarser = other[0] / grid[0], (grid[0] / across) ** GRID_ORDER
            share = share_of_difference(refined, GRID_ORDER) * coarser
            neighbours["grid"] = Neighbour(own, _with(own, grid=other), share)
        linked = all(contact.link == "corrected" for contact in _contacts(own).values())
        if not linked and not isinstance(model.structure, BodyPair):
            neighbours["link"] = Neighbour(own, _with(own, link="corrected"))
        finer_cells = {name: (across / cells[0]) ** GRID_ORDER for name, cells in own_grids.items()}
        coupled = not isinstance(source, UncoupledSource)
        return cls(own, section is None, coupled, neighbours, finer_cells)

    def probed(
        self,
        source: LoadSource | None,
        source_of: Callable[[WearModel], LoadSource],
        progress: Progress = unseen,
    ) -> Probed:
        """Return the errors from all probe runs, without parts whose probe run fails.

        ``source`` is that of the model itself, not needed where another structure replaces it.
        ``progress`` is called with the number of probe runs done, that of ``own`` first.
        """
        probed = Probed()
        # Where loads follow wear, the effect of the mesh on this counts as well.
        follows = self.coupled and self.own.wear.resultants != "constant"
        kind: Resultants = "every" if follows else "constant"
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
            if part in ("mesh", "slot"):
                mine, other = neighbour.own, neighbour.model
                alike = first if mine is self.own else probe_run(mine, source_of(mine), kind)
                return _difference(alike, probe_run(other, source_of(other), kind), neighbour.share)
            # Unworn loads suffice for effects of the contacts.
            return _difference(own("constant"), probe_run(neighbour.model, shared), neighbour.share)

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


def structure_of(model: WearModel) -> StructureModel | None:
    """Return the structure of finite elements of a model, None where it has none."""
    if hasattr(model.structure, "meshed"):
        return cast("StructureModel", model.structure)
    return None


def along_slot(model: WearModel) -> Neighbour | None:
    """Return the models on meshes that differ along a slot, None without one."""
    structure = structure_of(model)
    if structure is None or (meshes := structure.along_slot()) is None:
        return None
    fewest = np.min([*_grids(model).values(), SLOT_CELLS], axis=0)
    settings = {"grid": tuple(fewest.tolist()), "method": "normal", "tolerance": TOLERANCE}
    own, other = (
        _with(WearModel(meshed, model.contacts, model.wear), **settings)
        for meshed in (meshes.own, meshes.other)
    )
    return Neighbour(own, other, meshes.share)


def _contacts(model: WearModel) -> Mapping[str, Contact]:
    """Return the contacts by name; the only contact of all faces has an empty name."""
    return {"": model.contacts} if isinstance(model.contacts, Contact) else model.contacts


def _with(model: WearModel, **settings: Any) -> WearModel:
    """Return the model with other settings of all its contacts."""
    changed = {name: replace(contact, **settings) for name, contact in _contacts(model).items()}
    return replace(model, contacts=changed[""] if isinstance(model.contacts, Contact) else changed)


def _grids(model: WearModel) -> dict[str, Cells]:
    """Return the cells of each contact by name."""
    return {name: contact.grid for name, contact in _contacts(model).items()}


def _shared_grid(grids: Mapping[str, Cells]) -> Cells:
    """Return the grid of most contacts, and of the first of them where as many have another."""
    cells = list(grids.values())
    return max(cells, key=cells.count)


def _other_grid(own: Cells, of_model: Cells, line: bool) -> Cells | None:
    """Return the grid to compare ``own`` with, or None if it would have too few cells.

    Line contacts have the cells of the model if these are fewer and resolve edges less, else twice
    as many. In 3-D there are half as many cells along each direction.
    """
    if line:
        return of_model[0] if of_model[0] < own[0] else 2 * own[0], own[1]
    half = own[0] // 2, own[1] // 2
    return half if min(half) >= FEWEST else None


def _fewer(cells: int) -> int:
    """Return half of the cells along a direction, within the limits of probe runs."""
    return max(min(cells, 2 * FEWEST), min(MOST_CELLS, cells // 2))


def _difference(own: ProbeRun, other: ProbeRun, share: float) -> Numbers:
    """Return ``share`` times the relative differences; below 0 if ``own`` is the finer model."""

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
