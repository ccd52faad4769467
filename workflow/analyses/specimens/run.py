"""Runs of two specimens: reduced, fretted and worn under each normal force, and compared.

The reduced pair wears in cycle blocks. On the unworn and the worn shape, the same contact is solved
on a half-space. On the unworn shape, the same cycle is also computed with pressure and both
directions of shear coupled, which the uncoupled method and Masing's rule neglect.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fe_models.joints.reduced_contact import FrettingConditions, ReducedPair, VirginCurve
from fe_models.meshes.structure_mesh import MeshError
from sa_solver.steps import Steps
from sa_solver.types import Array, ElasticPair
from wear.contact.link import LARGEST_RESIDUAL
from wear.coupled_state import CoupledState, Observer
from wear.steps.steppers import StabilityError
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.half_space import HalfSpaceState, PadHalfSpace, bulk_compliance
from workflow.analyses.specimens.memory import memory
from workflow.analyses.specimens.model import fretted_specimens, reduced_pair
from workflow.analyses.specimens.outcome import (
    LoadOutcome,
    MarchedCycle,
    SpecimensOutcome,
    SpecimensState,
)
from workflow.analyses.specimens.results import write_specimens_output
from workflow.case.text.readable import percent
from workflow.errors import MethodFailed, UserError
from workflow.messages.warning_kinds import WarningKind
from workflow.models.specimens.reduced import ReducedSpecimens
from workflow.models.specimens.wear import BlockState
from workflow.shell.analysis import Run
from workflow.shell.few_cells import check_cells
from workflow.shell.folders.steps import resumable_steps
from workflow.shell.terminal.reporter import Reporter

# Number of states of each force that are stored with their fields: the unworn one, the last, and
# others evenly spaced in the logarithm of the cycles.
MOST_STORED_STATES = 13
# Points of first loading, denser at its beginning (a power of even steps).
CURVE_POINTS, CURVE_POWER = 61, 2.0
HALF_SPACE_POINTS = 13
# End of the message on measured surfaces finer than the nodes of the pad.
FINER = "these wear, and only the half-space for comparison resolves what its grid does"
# Increments of the coupled cycle in a quarter of it: with 16, the energy of Masing's loop has an
# error of 2e-3.
QUARTER = 16
# Share of the wear in the work for a force; the rest are the half-space and the coupled cycle.
WEAR = 0.7
# First motion of the coupled cycle as a share of half the stroke: nearly all nodes stick.
SMALL_MOTION = 1e-3


@dataclass(frozen=True)
class BlockProgress(Observer):
    """Progress of the wear under one normal force."""

    reporter: Reporter

    def remaining(self, state: CoupledState[Any], jumps: int) -> None:
        done, blocks = state.jump, state.jump + jumps
        self.reporter.reached(done / blocks, f"cycle block {done} of about {blocks}")


def run_specimens(run: Run[SpecimensCase]) -> None:
    """Run a case of specimens to its end.

    Raises UserError where meshing fails or a cycle block would be unstable, MethodFailed where a
    contact does not converge.
    """
    try:
        with resumable_steps(run) as steps:
            outcome = _compute(run.case, run.reporter, steps)
    except MeshError as error:
        raise UserError(f"{run.folder.case}: {error}") from error
    except StabilityError as error:
        raise UserError(f"{run.folder.case}: wear.step.cycles: {error}") from error
    write_specimens_output(outcome, run)


def _compute(case: SpecimensCase, reporter: Reporter, steps: Steps) -> SpecimensOutcome:
    reporter.warn_each(case.surface_warnings())
    model = reduced_pair(case)
    with reporter.stage("mesh"):
        nodes = model.node_count()
    for finer in case.finer_than_nodes(FINER):
        reporter.say(finer)
    memory(case, nodes).check()
    with reporter.stage("reduction", "steps") as reported:
        model.prepare(reported)
        pair = model.pair
    if model.from_cache:
        reporter.log("reduction: from the cache")
    half_space = PadHalfSpace(
        model.face,
        case.contact.grid,
        ElasticPair(*case.elastic),
        case.friction.coefficient,
        case.contact.tolerance,
    )
    forces = case.load_path.normal_forces
    with reporter.course("specimens"):
        loads = tuple(
            _fret(case, model, half_space, force, reporter, steps)
            for force in reporter.parts(forces, "{:g} N".format)
        )
    with reporter.stage("half-space"):
        bulk = steps("tied pad", lambda: bulk_compliance(pair, half_space))
    return SpecimensOutcome(case, model, half_space, bulk, loads)


def _fret(
    case: SpecimensCase,
    model: ReducedSpecimens,
    half_space: PadHalfSpace,
    force: float,
    reporter: Reporter,
    steps: Steps,
) -> LoadOutcome:
    pair = model.pair
    fretted = fretted_specimens(case, force)
    conditions = fretted.conditions
    with reporter.part(0.0, WEAR), reporter.stage("wear"):
        reporter.doing(f"{force:g} N: the unworn cycle")
        blocks = tuple(fretted.blocks(model, steps, [BlockProgress(reporter)]))
        curves = (
            steps("first loading", partial(first_loading, pair, state, conditions))
            for state in _chosen(blocks)
        )
        kept = tuple(map(SpecimensState, _chosen(blocks), curves))
    grid = half_space.grid
    height = model.gap(grid)
    path = 0.5 * conditions.stroke * rising(HALF_SPACE_POINTS)
    linked = pair if case.contact.link == "corrected" else None
    with reporter.stage("half-space"):
        first, last = (
            steps(
                "half-space",
                partial(_beside, linked, half_space, height, force, path, state),
            )
            for state in (blocks[0], blocks[-1])
        )
    name = f"the half-space under {force:g} N"
    for state in (first, last):
        if state.misfit is not None and state.misfit > LARGEST_RESIDUAL:
            reporter.warn(
                WarningKind.UNCERTAIN_LINK,
                f"{name}: the link to the specimens has an error of {percent(state.misfit)} of the "
                "deformation of half-spaces, and its pressures may be wrong by as much: raise "
                "mesh.pad_elements (no mesh is fine enough for the sharp border of unworn flat "
                "pads)",
            )
    check_cells(name, case.contact, grid, first.pressure, reporter)
    check_cells(name, case.contact, grid, last.pressure, reporter, worn=True)
    with reporter.stage("coupled cycle"):
        cycle = partial(marched_cycle, pair, model.face.gap, conditions)
        marched = steps("coupled cycle", cycle)
    end = blocks[-1]
    reporter.say(f"  {force:g} N: {end.cycles:.4g} cycles in {len(blocks) - 1} cycle blocks")
    return LoadOutcome(force, blocks, kept, (first, last), marched)


def _beside(
    linked: ReducedPair | None,
    half_space: PadHalfSpace,
    height: Array,
    force: float,
    path: Array,
    state: BlockState,
) -> HalfSpaceState:
    """Return the half-space under the shape of a state, linked to a pair of specimens if given."""
    link = None
    if linked is not None:
        link = half_space.link(linked, state.contact.normal, path)
    return half_space.fretting_cycle(height, state.depths.sum(axis=0), force, path, link)


def _chosen(blocks: tuple[BlockState, ...]) -> list[BlockState]:
    """Return the states to store with their fields."""
    if len(blocks) <= MOST_STORED_STATES:
        return list(blocks)
    cycles = np.array([state.cycles for state in blocks])
    wanted = np.geomspace(cycles[1], cycles[-1], MOST_STORED_STATES - 1)
    places = np.unique([0, *(int(np.abs(cycles - value).argmin()) for value in wanted)])
    return [blocks[place] for place in places]


def rising(points: int) -> Array:
    """Return shares ``(points,)`` from 0 to 1, denser near 0."""
    return np.linspace(0.0, 1.0, points) ** CURVE_POWER


def first_loading(
    pair: ReducedPair, state: BlockState, conditions: FrettingConditions
) -> VirginCurve:
    """Return first loading to half the stroke on a worn shape."""
    path = 0.5 * conditions.stroke * rising(CURVE_POINTS)
    curve = pair.virgin_curve(state.contact.normal, path, conditions.friction)
    if not curve.converged:
        raise MethodFailed(
            f"first loading at {conditions.force:g} N did not converge after {state.cycles:.4g} "
            "cycles; change mesh.pad_elements"
        )
    return curve


def marched_cycle(pair: ReducedPair, gap: Array, conditions: FrettingConditions) -> MarchedCycle:
    """Solve the coupled cycle in increments, and compare with the uncoupled method."""
    small = 0.5 * SMALL_MOTION * conditions.stroke
    cycle = pair.coupled_cycle(gap, conditions, QUARTER, small)
    if not cycle.converged:
        raise MethodFailed(
            f"the coupled cycle at {conditions.force:g} N did not converge; lower "
            "friction.coefficient"
        )
    pressed, moved = cycle.loading[:2]
    pressure = np.array([state.force[2] for state in cycle.states]) / pair.areas
    largest = float((pressed.force[2] / pair.areas).max())
    uncoupled = pair.tangential(pair.normal(gap, conditions.force), small, conditions.friction)
    return MarchedCycle(
        displacement=cycle.loop.displacement,
        force=cycle.loop.force,
        energy=(float(cycle.energy.sum()), pair.fretting_cycle(gap, conditions).energy),
        secant_stiffness=(
            float(pressed.force[0].sum() - moved.force[0].sum()) / small,
            uncoupled.force / small,
        ),
        pressure_change=float(np.ptp(pressure, axis=0).max()) / largest,
    )
