"""Decisions on the settings of a dovetail, each the cheapest that meets its share of the error.

Every decision takes the case with the earlier decisions applied, and the error that its setting may
cause. Estimates are those of the largest depth and of the volume of either flank.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import ceil
from operator import itemgetter

from fe_models.meshes.structure_mesh import MeshError
from fe_models.meshes.transfer import FaceTransfer
from workflow.analyses.wear.approximations import ladders
from workflow.analyses.wear.approximations.approximation import Settings
from workflow.analyses.wear.case.sections import SIZES
from workflow.analyses.wear.checks.uniformity import sections
from workflow.analyses.wear.choice import Decision
from workflow.analyses.wear.fidelity.probe import (
    NOTCH,
    coupled_wear,
    plane_section,
    resultants_of,
    section_wear,
    slot_wear,
    wear_along_slot,
)
from workflow.analyses.wear.increments import decide_increments
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint, section_joint
from workflow.analyses.wear.translation import structure_loads
from workflow.case.changing import changed
from workflow.case.text.readable import percent
from workflow.errors import MethodFailed
from workflow.models.budget.convergence import GRID_ORDER, MESH_ORDER, richardson
from workflow.models.budget.parts import ERROR_PER_TOLERANCE
from workflow.models.budget.probe_runs import STEPS, Numbers, scales

# Mesh on which two and three dimensions are compared: nodes across a flank, and rows along it per
# width of the flank. On the default joint, meshes from 6 x 16 to 20 x 34 nodes agree on the
# differences within 1 % of the values under the pull alone, and within 2 % under the moment, except
# for slip and energy of the lesser flank, which scatter by 4 %. Fewer rows blur the ends.
NODES_ACROSS, ROWS_PER_WIDTH = 13, 3
DIMENSION = "structure.dimension"
# Elements across a flank: fewer give no useful estimate, and the largest number takes seconds to
# condense in the plane. In space the time grows with the fourth power, so the mesh is never made
# finer than that of the case; meshes up to the last factor estimate its error.
FEWEST_ELEMENTS, MOST_ELEMENTS, FINER_MESH = 7, 160, 4
FLANK_NODES = "mesh.flank_nodes"
# Share of the error of a mesh in space that its section may cause, and the numbers of nodes along
# the slot that are offered, relative to that of the case.
ACROSS = 0.75
FEWER_ALONG = 0.5, 0.7, 1.0
# Cells of a contact grid along one direction. The largest number holds in the plane; in space,
# where each doubling takes four times as long, the limit is this factor times the case's number. No
# grid is coarser than the case's by more than the last factor.
MOST_LINE_CELLS, FINER_SPACE, COARSER = 512, 2, 4
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


# --- dimension ------------------------------------------------------------------------------------


def choose_dimension(case: DovetailCase, allowed: float) -> Decision:
    """Choose plane strain if it gives the mid-slot values of three dimensions accurately.

    The values are P and Qx at peak load, the mean slip and the energy of a closed cycle, all per
    length and in mid-slot, of the unworn structure on coarse meshes with the same section. Wear is
    proportional to that energy.
    """
    if case.structure.skew != 0.0:
        return Decision({DIMENSION: 3}, "the sections of a skewed slot differ")
    try:
        two, three = (_mid_slot(case, dimension) for dimension in (2, 3))
    except (MeshError, MethodFailed) as failure:
        return Decision({DIMENSION: 3}, f"the coarse probe failed: {failure}")
    differences: Numbers = {}
    for flank, relative_to in scales(three).items():
        relative_to["Qx"] = case.friction.coefficient * relative_to["P"]
        differences[flank] = {
            name: abs(two[flank][name] - three[flank][name]) / scale if scale > 0.0 else 0.0
            for name, scale in relative_to.items()
        }
    largest, quantity, flank = max(
        (
            (value, name, flank)
            for flank, named in differences.items()
            for name, value in named.items()
        ),
        key=itemgetter(0),
    )
    why = (
        "in a coarse probe of mid-slot, two dimensions differ from three by at most "
        f"{percent(largest)} ({quantity} on the {flank}); allowed: {percent(allowed)}; the ends of "
        "the slot, which may wear more, are not included"
    )
    dimension, error = (3, 0.0) if largest > allowed else (2, largest)
    probe = {"two": two, "three": three, "differences": differences}
    return Decision({DIMENSION: dimension}, why, allowed, error, probe)


def _mid_slot(case: DovetailCase, dimension: int) -> Numbers:
    """Return the mid-slot values of every flank on a coarse mesh."""
    width, length = case.structure.face_width, case.structure.slot_length
    nodes = NODES_ACROSS, 1 + 2 * ceil(0.5 * ROWS_PER_WIDTH * length / width)
    coarse = {"flank_nodes": nodes, "size": width, "notch": NOTCH, "order": 2}
    settings = {DIMENSION: dimension, **{f"mesh.{key}": value for key, value in coarse.items()}}
    stage = structure_loads(changed(case, settings), dovetail_joint)
    middles = {}
    for contact, history in zip(stage.faces, stage.unworn(), strict=True):
        transfer = FaceTransfer.between(contact.face, contact.grid(contact.coarse))
        rows = sections(transfer, history, stage.peak, case.friction.at(0.0))
        middles[contact.face.name] = rows.middle
    return middles


# --- increments -----------------------------------------------------------------------------------


def choose_increments(case: DovetailCase, allowed: float) -> Decision:
    """Choose the increments that the cycle of the section needs."""
    return decide_increments(case, section_joint, allowed)


# --- ladders of meshes and grids ------------------------------------------------------------------


def choose_mesh(case: DovetailCase, allowed: float) -> Decision:
    """Choose the coarsest mesh whose section wears accurately enough, and layers along the slot.

    All of the mesh is refined with the section's, and in space the layers are then chosen.
    """
    section, written = plane_section(case), case.mesh.flank_nodes[0] - 1
    in_space = case.structure.dimension == 3
    most = written if in_space else max(written, MOST_ELEMENTS)
    numbers = _doublings(written, FEWEST_ELEMENTS, FINER_MESH * written if in_space else most)

    def settings(elements: int) -> Settings:
        return ladders.flank_mesh(case, elements / written)

    def worn(elements: int) -> Numbers:
        return section_wear(changed(section, settings(elements)), resultants_of(case))

    unit, part = "elements across the flank", ACROSS * allowed if in_space else allowed
    across = _climb(unit, numbers, most, settings, worn, part, MESH_ORDER)
    if not in_space:
        return across
    along = _choose_along(case, across.chosen, max(allowed - (across.error or part), 0.0))
    return Decision(
        {**across.chosen, **along.chosen},
        f"{across.why}; {along.why}",
        allowed,
        (across.error or 0.0) + (along.error or 0.0),
        {unit: across.probe, "nodes along the slot": along.probe},
    )


def _choose_along(case: DovetailCase, mesh: Settings, allowed: float) -> Decision:
    """Choose the fewest nodes along the slot that are accurate enough, at most those of the case.

    ``mesh`` are the other settings of the mesh.
    """
    across, along = mesh[FLANK_NODES][0], case.mesh.flank_nodes[1]
    own, other, share = wear_along_slot(case)
    errors = {
        f"{name} on the {flank}": abs(share * (other[flank][name] - own[flank][name])) / scale
        for flank, quantities in scales(own).items()
        for name, scale in quantities.items()
        if scale > 0.0
    }
    worst = max(errors, key=lambda name: errors[name])
    for factor in FEWER_ALONG:
        nodes = ladders.slot_mesh(case, factor)[FLANK_NODES][1]
        error = errors[worst] * ((along - 1) / (nodes - 1)) ** MESH_ORDER
        if error <= allowed:
            break
    why = (
        f"{nodes} nodes along the slot cause an error of {percent(error)}, of "
        f"{percent(allowed)} allowed ({worst})"
    )
    why += "" if error <= allowed else ", the finest available"
    probe = {"own": own, "other": other, "errors": errors}
    return Decision({FLANK_NODES: (across, nodes)}, why, allowed, error, probe)


def choose_grid(case: DovetailCase, allowed: float) -> Decision:
    """Choose the coarsest grids across the flank and along the slot that are accurate enough."""
    section, (across, along) = plane_section(case), case.contact.grid
    in_space = case.structure.dimension == 3
    part = 0.5 * allowed if in_space else allowed

    def climb(unit: str, cells: int, most: int, worn: Callable[[int], Numbers]) -> Decision:
        numbers = _doublings(cells, max(ladders.FEWEST_CELLS, cells // COARSER), most)
        return _climb(unit, numbers, most, lambda number: {unit: number}, worn, part, GRID_ORDER)

    def worn(cells: int) -> Numbers:
        return section_wear(changed(section, {"contact.grid": (cells, cells)}))

    most = FINER_SPACE * across if in_space else max(across, MOST_LINE_CELLS)
    climbs = [climb("cells across the flank", across, most, worn)]
    if in_space:
        most = FINER_SPACE * along
        worn_along = partial(slot_wear, section)
        climbs.append(climb("cells along the slot", along, most, worn_along))
        along = climbs[1].value
    return Decision(
        {"contact.grid": (climbs[0].value, along)},
        "; ".join(climb.why for climb in climbs),
        allowed,
        sum(climb.error or 0.0 for climb in climbs),
        {unit: climb.probe for climb in climbs for unit in climb.chosen},
    )


def _doublings(count: int, fewest: int, most: int) -> list[int]:
    """Return halves and doubles of ``count``, coarse to fine, including itself."""
    numbers = [count]
    while (half := round(0.5 * numbers[0])) >= fewest:
        numbers.insert(0, half)
    while 2 * numbers[-1] <= most:
        numbers.append(2 * numbers[-1])
    return numbers


def _climb(
    unit: str,
    numbers: Sequence[int],
    most: int,
    settings: Callable[[int], Settings],
    worn: Callable[[int], Numbers],
    allowed: float,
    order: float,
) -> Decision:
    """Probe ever larger numbers until one is accurate enough, or else take the largest offered.

    Numbers beyond ``most`` are not offered: they serve to estimate the errors of the others.
    """
    values: list[Numbers] = []
    for number in numbers:
        values.append(worn(number))
        if len(values) < min(LEAST_RUNGS, len(numbers)):
            continue
        by_quantity = estimate(values, [1.0 / n for n in numbers[: len(values)]], order)
        errors = [max(of_rung) for of_rung in zip(*by_quantity.values(), strict=True)]
        offered = [k for k in range(len(values)) if numbers[k] <= most]
        enough = [k for k in offered if errors[k] <= allowed]
        if enough:
            break
    taken = enough[0] if enough else offered[-1]
    worst = max(by_quantity, key=lambda name: by_quantity[name][taken])
    why = (
        f"{numbers[taken]} {unit} cause an error of {percent(errors[taken])}, of "
        f"{percent(allowed)} allowed ({worst})"
    )
    why += "" if enough else ", the finest available"
    probe = {"sizes": list(numbers[: len(values)]), "values": values, "errors": errors}
    return Decision(settings(numbers[taken]), why, allowed, errors[taken], probe)


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
    """Choose the tolerance of the contact solver whose error is the share of the error."""
    tolerance = max(min(allowed / ERROR_PER_TOLERANCE, LOOSEST_TOLERANCE), 1e-12)
    why = f"errors of depth and volume were at most {ERROR_PER_TOLERANCE:g} times the tolerance"
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
    return Decision(
        settings, "its share of the error, for automatic implicit steps", allowed, tolerance
    )


def choose_drift(case: DovetailCase, allowed: float) -> Decision:
    """Choose the drift at which coupled and uncoupled probe runs would differ by the share."""
    coupling = case.coupling
    if coupling.resultants == "constant":
        why = "resultants stay those of the unworn structure, as the case says"
        return Decision({"coupling.drift": coupling.drift}, why)
    section = plane_section(case)
    apart = section_wear(section)
    coupled, drift = coupled_wear(section)
    # Loads updated at the end of each step lag by half a step, one step in all for a steady drift.
    # Two values give their difference, whatever the order.
    largest = max(last for _, last in estimate([apart, coupled], [2.0, 1.0], 1.0).values())
    effect = largest * STEPS / (STEPS - 1)
    bounded = max(LEAST_DRIFT, min(1.0, drift * allowed / effect)) if effect > 0.0 else 1.0
    settings = {"coupling.drift": bounded, "coupling.resultants": "drift"}
    error = effect if drift <= 0.0 else min(effect, effect * bounded / drift)
    why = (
        f"drift of {percent(drift)} over the run changes depth or volume by {percent(effect)}; "
        f"allowed: {percent(allowed)}"
    )
    probe = {"apart": apart, "coupled": coupled, "drift": drift, "effect": effect}
    return Decision(settings, why, allowed, error, probe)
