"""Decisions on the settings of a dovetail, each the cheapest that meets its share of the error.

Every decision takes the case with the earlier decisions applied, and the error that its setting may
cause. Estimates are those of the largest depth and of the volume of either flank.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from workflow.analyses.wear.approximations.convergence import richardson
from workflow.analyses.wear.approximations.ladders import FEWEST_CELLS, flank_mesh
from workflow.analyses.wear.approximations.probe_runs import STEPS, Numbers, scales
from workflow.analyses.wear.budget.parts import ERROR_PER_TOLERANCE
from workflow.analyses.wear.case.sections import SIZES
from workflow.analyses.wear.choice import Decision
from workflow.analyses.wear.fidelity.probe import (
    coupled_wear,
    plane_section,
    section_wear,
    slot_wear,
)
from workflow.analyses.wear.increments import decide_increments
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.analyses.wear.structures.dovetail.model import section_joint
from workflow.case.changing import changed

# Highest order of convergence of meshes and grids.
ORDER = 2.0
# Elements across a flank: fewer give no useful estimate, and the largest number takes seconds to
# condense in the plane. In space the time grows with the fourth power, so the mesh is never made
# finer than that of the case; meshes up to the last factor estimate its error.
FEWEST_ELEMENTS, MOST_ELEMENTS, FINER_MESH = 7, 160, 4
# Cells of a contact grid along one direction. The largest number holds in the plane; in space,
# where each doubling takes four times as long, the limit is this factor times the case's number. No
# grid is coarser than the case's by more than the last factor.
MOST_STRIPS, FINER_SPACE, COARSER = 512, 2, 4
# Rungs of a ladder that are probed before a choice: an order of convergence needs three.
LEAST_RUNGS = 3
# Loosest tolerance of the contact solver for which the error that it causes was measured.
LOOSEST_TOLERANCE = 1e-3
# Steps with an automatic tolerance of 0.1, 0.01, 0.003 and 0.001 caused errors of 1.2, 0.4, 0.23
# and 0.08 % of the largest depth on the section of the default joint, less of the volume, and 1.4,
# 0.27, 0.13 and 0.07 % where flanks carry different loads over 1e6 cycles: never more than the
# tolerance. Looser tolerances are hardly faster.
LOOSEST_STEPS = 0.1
# A drift below this is rounding of the structure's solver.
LEAST_DRIFT = 1e-4


def choose_increments(case: DovetailCase, allowed: float) -> Decision:
    """Choose the increments that the cycle of the section needs."""
    return decide_increments(case, section_joint, allowed)


# --- ladders of meshes and grids ------------------------------------------------------------------


@dataclass(frozen=True)
class _Climb:
    """The number that was ``taken``, with its error, and the results of the ``probed`` ones."""

    taken: int
    error: float
    worst: str
    probed: dict[str, Any]

    def sentence(self, allowed: float, unit: str) -> str:
        text = f"{self.taken} {unit} leave {self.error:.2%} of {allowed:.2%} allowed"
        beyond = "" if self.error <= allowed else ", the finest that is offered"
        return f"{text} ({self.worst}){beyond}"


def choose_mesh(case: DovetailCase, allowed: float) -> Decision:
    """Choose the coarsest mesh, refined in proportion, whose section wears accurately enough."""
    section, written = plane_section(case), case.mesh.flank_nodes[0] - 1
    in_space = case.structure.dimension == 3
    most = written if in_space else max(written, MOST_ELEMENTS)
    numbers = _doublings(written, FEWEST_ELEMENTS, FINER_MESH * written if in_space else most)

    def worn(elements: int) -> Numbers:
        return section_wear(changed(section, flank_mesh(case, elements / written)))

    climb = _climb(numbers, most, worn, allowed)
    settings = flank_mesh(case, climb.taken / written)
    why = climb.sentence(allowed, "elements across the flank")
    return Decision(settings, why, allowed, climb.error, climb.probed)


def choose_grid(case: DovetailCase, allowed: float) -> Decision:
    """Choose the coarsest grids across the flank and along the slot that are accurate enough."""
    section = plane_section(case)
    across, along = case.contact.grid
    in_space = case.structure.dimension == 3
    most = FINER_SPACE * across if in_space else max(across, MOST_STRIPS)
    part = 0.5 * allowed if in_space else allowed

    def climb(cells: int, most: int, worn: Callable[[int], Numbers]) -> _Climb:
        numbers = _doublings(cells, max(FEWEST_CELLS, cells // COARSER), most)
        return _climb(numbers, most, worn, part)

    def worn(cells: int) -> Numbers:
        return section_wear(changed(section, {"contact.grid": (cells, cells)}))

    climbs = {"strips across the flank": climb(across, most, worn)}
    if in_space:
        climbs["strips along the slot"] = climb(
            along, FINER_SPACE * along, lambda cells: slot_wear(section, cells)
        )
    taken = [climb.taken for climb in climbs.values()]
    settings = {"contact.grid": (taken[0], taken[1] if in_space else along)}
    why = "; ".join(climb.sentence(part, name) for name, climb in climbs.items())
    probe = {name: climb.probed for name, climb in climbs.items()}
    error = sum(climb.error for climb in climbs.values())
    return Decision(settings, why, allowed, error, probe)


def _doublings(count: int, fewest: int, most: int) -> list[int]:
    """Return halves and doubles of ``count``, coarse to fine, including itself."""
    numbers = [count]
    while (half := round(0.5 * numbers[0])) >= fewest:
        numbers.insert(0, half)
    while 2 * numbers[-1] <= most:
        numbers.append(2 * numbers[-1])
    return numbers


def _climb(
    numbers: Sequence[int], most: int, worn: Callable[[int], Numbers], allowed: float
) -> _Climb:
    """Probe ever larger numbers until one is accurate enough, or else take the largest offered.

    Numbers beyond ``most`` are not offered: they serve to estimate the errors of the others.
    """
    values: list[Numbers] = []
    for number in numbers:
        values.append(worn(number))
        if len(values) < min(LEAST_RUNGS, len(numbers)):
            continue
        by_quantity = estimate(values, [1.0 / n for n in numbers[: len(values)]], ORDER)
        errors = [max(of_rung) for of_rung in zip(*by_quantity.values(), strict=True)]
        offered = [k for k in range(len(values)) if numbers[k] <= most]
        enough = [k for k in offered if errors[k] <= allowed]
        if enough:
            break
    taken = enough[0] if enough else offered[-1]
    worst = max(by_quantity, key=lambda name: by_quantity[name][taken])
    probed = {"sizes": list(numbers[: len(values)]), "values": values, "errors": errors}
    return _Climb(numbers[taken], errors[taken], worst, probed)


def estimate(
    values: Sequence[Numbers], steps: Sequence[float], order: float
) -> dict[str, list[float]]:
    """Return the relative errors of each quantity on all rungs, which go from coarse to fine.

    The last error is Richardson's; each other one adds the distance to the last rung, so that an
    early rung that is close by chance has no smaller error than the last.
    """
    errors = {}
    for flank, quantities in scales(values[-1]).items():
        for name, scale in quantities.items():
            series = [rung[flank][name] for rung in values]
            last = richardson(series, steps, order).error
            errors[f"{name} on the {flank}"] = [
                (abs(value - series[-1]) + last) / scale if scale > 0.0 else 0.0 for value in series
            ]
    return errors


# --- without a ladder -----------------------------------------------------------------------------


def choose_tolerance(case: DovetailCase, allowed: float) -> Decision:
    """Choose the share of the error as tolerance of the contact solver, whose error is smaller."""
    tolerance = max(min(allowed, LOOSEST_TOLERANCE), 1e-12)
    why = "its share: depth and volume were found within half of it"
    error = ERROR_PER_TOLERANCE * tolerance
    return Decision({"contact.tolerance": tolerance}, why, allowed, error)


def choose_steps(case: DovetailCase, allowed: float) -> Decision:
    """Choose automatic implicit steps, with the share of the error as their tolerance."""
    tolerance = min(allowed, LOOSEST_STEPS)
    settings = {
        "wear.tolerance": tolerance,
        "wear.depth_tolerance": None,
        "wear.step.kind": "implicit",
        **{f"wear.step.{size}": None for size in SIZES},
    }
    return Decision(settings, "its share, for automatic implicit steps", allowed, tolerance)


def choose_drift(case: DovetailCase, allowed: float) -> Decision:
    """Choose the drift at which coupled and uncoupled probe runs would differ by the share."""
    coupling = case.coupling
    if coupling.resultants == "constant":
        why = "resultants stay those of the unworn structure, as the case has it"
        return Decision({"coupling.drift": coupling.drift}, why)
    section = plane_section(case)
    apart = section_wear(section)
    coupled, drift = coupled_wear(section)
    # Loads updated at the end of each step lag by half a step, one step in all for a steady drift.
    largest = max(last for _, last in estimate([apart, coupled], [2.0, 1.0], ORDER).values())
    effect = largest * STEPS / (STEPS - 1)
    bounded = max(LEAST_DRIFT, min(1.0, drift * allowed / effect)) if effect > 0.0 else 1.0
    settings = {"coupling.drift": bounded, "coupling.resultants": "drift"}
    error = effect if drift <= 0.0 else min(effect, effect * bounded / drift)
    why = (
        f"drift of {drift:.2%} over the run changes depth or volume by {effect:.2%}; "
        f"allowed: {allowed:.2%}"
    )
    probe = {"apart": apart, "coupled": coupled, "drift": drift, "effect": effect}
    return Decision(settings, why, allowed, error, probe)
