"""Estimate of the time of a wear run: its structure, the wear steps, and the final output."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from math import ceil, prod, sqrt

from workflow.analyses.wear.case.base import WearCase
from workflow.case.text.plain import counted
from workflow.shell.run_time import (
    FRICTIONAL,
    NORMAL,
    NORMAL_LINE,
    RunTime,
    factors,
    solves,
)

# Numbers of automatic steps at 1 %, for pressures alone and for the half-space's friction; of steps
# by depth or volume; and of recorded jumps of explicit steps. Only the first holds for every case.
AUTOMATIC, AUTOMATIC_FULL, BY_SIZE, RECORDED = 15, 40, 30, 10
# Reason for an unknown number of steps.
UNKNOWN = "the number of jumps depends on {}, and is reported during the run"
STICKING = "how far wear moves the stick zone"
# Time to write a jump [s].
JUMP = 0.02
# Contact problems per dissipating increment and step, by kind of step.
PROBLEMS = {"explicit": 1, "implicit": 1, "second_order": 4}
# Share of the increments of a structure's cycle that dissipate.
DISSIPATING = 0.6
# Typical slip path [mm] of a structure's contacts in a cycle.
SLIP = 0.03
# Longest stable explicit step, relative to pitch over E* times the wear per pressure
# (wear.steps.stepping).
STABLE = 1.16
# Friction iterations of the structure per increment; time per entry of its dense matrix in an
# iteration, and in its inversion [s].
ITERATIONS, ENTRY, INVERSE = 24, 5e-10, 1e-10
# Cycles until that of the structure is closed.
CYCLES = 2
# Structural cycles per wear step where nodes wear.
CYCLES_IN_A_STEP = 5
# Branches of a tangential loop until it is closed; each problem is solved quickly.
BRANCHES = 4
# Time of the stress under a contact per cell and increment [s], the factor for a search for the
# worst plane, and the time of the stress that a structure carries past the contact.
STRESS, SEARCHED, CARRIED = 1.2e-6, 10.0, 1e-6
# Probe runs in a worker process for the errors of mesh, grid and coupling: their number, steps and
# largest number of cells per axis; time of mesh and factors of their structures, and of a friction
# iteration in the plane [s].
PROBE_RUNS, PROBE_STEPS, PROBE_CELLS = 4, 6, 64
PLANE, PLANE_ITERATION = 0.5, 1e-4
# Time of stress and mesh of the structure at the end, in sparse factors; of figures and files [s].
WORN, PICTURES = 2.0, 6.0


@dataclass(frozen=True)
class Extent:
    """Size of a structure's loads: ``increments`` of a cycle on a number of ``faces``.

    ``nodes`` are those of both bodies and ``interface_nodes`` those of all faces, 0 without finite
    elements. In a cycle the bodies slip by ``path`` [mm]; ``dissipating`` is the share of its
    increments in which they slide. ``section`` is the extent of the plane section that represents
    the structure in probe runs.
    """

    increments: int
    faces: int = 1
    nodes: float = 0.0
    interface_nodes: float = 0.0
    path: float = SLIP
    dissipating: float = 1.0
    section: Extent | None = None


@dataclass(frozen=True)
class ExpectedSteps:
    """Wear steps of a run, its ``jumps``, and the reason if their number is ``unknown``.

    Unknown numbers are replaced by those of a typical case.
    """

    count: float
    jumps: float
    unknown: str = ""


def run_time(case: WearCase, extent: Extent) -> RunTime:
    """Return the estimated time of a wear case with a structure of this extent."""
    plane = getattr(case.structure, "dimension", 3) == 2 or case.contact.grid[1] == 1
    grids = [terms.grid[:1] if plane else terms.grid for terms in case.every_terms]
    cells = sum(map(prod, grids)) // len(grids)
    shared = extent.faces / min(extent.faces, os.cpu_count() or 1)
    expected = steps_of(case, extent)
    steps, jumps, normal = expected.count, expected.jumps, NORMAL_LINE if plane else NORMAL
    in_a_step = extent.increments * extent.dissipating * PROBLEMS[case.wear.step.kind]
    begun = solves(2 * extent.increments, cells, normal)
    worn = solves(steps * in_a_step, cells, normal)
    if case.contact.method == "full":
        begun += solves(2 * extent.increments, cells, FRICTIONAL)
        worn += solves(steps * extent.increments, cells, FRICTIONAL)
    if case.loops.wanted:
        increments = jumps * BRANCHES * case.loops.increments
        # The errors of a loop need a second one, with half the cells per side and half the
        # increments.
        worn += solves(increments, cells, NORMAL) + solves(increments // 2, cells // 4, NORMAL)
    if case.contact.method == "nodes":
        begun, worn = 0.0, steps * CYCLES_IN_A_STEP * _structural_cycle(extent)
    worn += jumps * JUMP
    again = {"constant": 0.0, "drift": 1.0, "every": jumps}[case.recoupling.resultants]
    cycle = _structural_cycle(extent)
    before = shared * begun + _condensation(extent) + CYCLES * cycle
    after = PICTURES + WORN * factors(extent.nodes) + cycle + _stress(case, extent, cells)
    after += _probe_runs(case, extent, plane)
    assumed = counted(ceil(jumps), "wear jump") if expected.unknown else ""
    return RunTime(before, shared * worn + again * cycle, after, assumed, expected.unknown)


def steps_of(case: WearCase, extent: Extent) -> ExpectedSteps:
    """Return the wear steps of a case, counted where its settings determine their number.

    The number is unknown where a step wears a given depth or volume, unless the run stops at a
    given one, and where automatic steps follow the border of a zone that sticks: a cylinder on 512
    cells took 60 jumps to its end state, other cases with the same tolerance take 20.
    """
    wear, step = case.wear, case.wear.step
    if step.cycles is not None:
        jumps = ceil(wear.cycles / step.cycles)
        return ExpectedSteps(jumps, jumps)
    if step.fraction is not None:
        steps = max(RECORDED, wear.cycles / (step.fraction * _stable(case, extent)))
        return ExpectedSteps(steps, RECORDED)
    for size in ("depth", "volume"):
        if (worn := getattr(step, size)) is not None:
            if (end := getattr(wear.stop, size)) is not None:
                return ExpectedSteps(ceil(end / worn), ceil(end / worn))
            return ExpectedSteps(BY_SIZE, BY_SIZE, UNKNOWN.format(f"the {size} worn"))
    steps, unknown = float(AUTOMATIC), ""
    if case.contact.method == "full":
        steps, unknown = AUTOMATIC_FULL, UNKNOWN.format(STICKING)
    if wear.depth_tolerance is None:
        steps *= max(1.0, sqrt(0.01 / wear.tolerance))
    return ExpectedSteps(steps, 0.5 * steps, unknown)


def _stable(case: WearCase, extent: Extent) -> float:
    """Return an estimate of the longest stable explicit step [cycles]."""
    bodies = [case.material(number) for number in (1, 2)]
    compliance = sum((1.0 - body.poisson**2) / body.young for body in bodies)
    worn = sum(case.wear_of(number).rate(case.friction.coefficient) for number in (1, 2))
    size = getattr(case.contact, "size", None) or getattr(case.structure, "size", None)
    length = size[0] if isinstance(size, tuple) else (size or 10.0)
    pitch = length / case.contact.grid[0]
    return STABLE * pitch * compliance / (worn * extent.path) if worn > 0.0 else case.wear.cycles


def _condensation(extent: Extent) -> float:
    """Return the time of condensing the structure onto its interfaces [s]."""
    return factors(extent.nodes) + INVERSE * (3.0 * extent.interface_nodes) ** 3


def _structural_cycle(extent: Extent) -> float:
    """Return the time of a cycle of the structure with friction [s]."""
    return extent.increments * ITERATIONS * ENTRY * (3.0 * extent.interface_nodes) ** 2


def _stress(case: WearCase, extent: Extent, cells: int) -> float:
    """Return the time of the stress under all contacts, unworn and worn [s]."""
    life = case.stress.life.parameter
    if life == "none":
        return 0.0
    searched = STRESS * (1.0 if life == "ruiz" else SEARCHED)
    carried = CARRIED if extent.interface_nodes else 0.0
    return 2.0 * (searched + carried) * extent.faces * extent.increments * cells


def _probe_runs(case: WearCase, extent: Extent, plane: bool) -> float:
    """Return the time of probe runs for the error budget, one of them on a finer mesh [s]."""
    if case.error_budget == "known" or case.contact.method == "nodes":
        return 0.0
    plane, probed = plane or extent.section is not None, extent.section or extent
    across, along = (min(count, PROBE_CELLS) for count in case.contact.grid)
    cells, kind = (across, NORMAL_LINE) if plane else (across * along // 4, NORMAL)
    runs = PROBE_RUNS if probed.interface_nodes else PROBE_RUNS // 2
    solved = runs * probed.faces * probed.increments * (1.0 + PROBE_STEPS * probed.dissipating)
    contacts = solves(solved, cells, kind)
    if not probed.interface_nodes or case.recoupling.resultants == "constant":
        return contacts
    finer = replace(probed, interface_nodes=2.0 * probed.interface_nodes)
    own, other = (PROBE_STEPS / 2 * _structural_cycle(mesh) for mesh in (probed, finer))
    # In the other probe runs the loads stay constant.
    iterated = PROBE_STEPS * probed.increments * ITERATIONS * PLANE_ITERATION
    return contacts + own + other + 2.0 * PLANE + iterated
