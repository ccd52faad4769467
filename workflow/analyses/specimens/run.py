"""Runs of two specimens: reduced, fretted and worn under each normal force, and compared.

The reduced pair wears in cycle blocks. On the unworn and the worn shape, the same contact is solved
on a half-space. On the unworn shape, the same cycle is also computed with pressure and both
directions of shear coupled, which the uncoupled method and Masing's rule neglect.
"""

from __future__ import annotations

from collections.abc import Iterator
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
from wear.steps.marching import rest
from wear.steps.steppers import ExplicitStepper, StabilityError
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.half_space import HalfSpaceState, PadHalfSpace, bulk_compliance
from workflow.analyses.specimens.memory import memory
from workflow.analyses.specimens.model import SpecimensModel
from workflow.analyses.specimens.outcome import (
    LoadOutcome,
    MarchedCycle,
    SpecimensOutcome,
    SpecimensState,
)
from workflow.analyses.specimens.results import write_specimens_output
from workflow.analyses.specimens.wear import BlockState, FrettedPair, wear_in_cycle_blocks
from workflow.case.text.readable import percent
from workflow.errors import MethodFailed, UserError
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
# Limit on cycle blocks, each of which takes milliseconds: more are most likely an error in the
# case.
MOST_BLOCKS = 20_000


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
    for warning in case.surface_warnings():
        reporter.warn(warning)
    model = SpecimensModel(case)
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
            _fret(model, half_space, force, reporter, steps)
            for force in reporter.parts(forces, "{:g} N".format)
        )
    with reporter.stage("half-space"):
        bulk = steps("tied pad", lambda: bulk_compliance(pair, half_space))
    return SpecimensOutcome(model, half_space, bulk, loads)


def _fret(
    model: SpecimensModel,
    half_space: PadHalfSpace,
    force: float,
    reporter: Reporter,
    steps: Steps,
) -> LoadOutcome:
    case, pair = model.case, model.pair
    conditions = FrettingConditions(force, case.load_path.stroke, case.friction.coefficient)
    with reporter.part(0.0, WEAR), reporter.stage("wear"):
        blocks = tuple(_blocks(model, conditions, reporter, steps))
        curves = (
            steps("first loading", partial(first_loading, pair, state, conditions))
            for state in _chosen(blocks)
        )
        kept = tuple(map(SpecimensState, _chosen(blocks), curves))
    grid = half_space.grid
    height = model.gap(grid)
    path = 0.5 * conditions.stroke * rising(HALF_SPACE_POINTS)
    with reporter.stage("half-space"):
        first, last = (
            steps("half-space", partial(_beside, model, half_space, height, force, path, state))
            for state in (blocks[0], blocks[-1])
        )
    name = f"the half-space under {force:g} N"
    for state in (first, last):
        if state.misfit is not None and state.misfit > LARGEST_RESIDUAL:
            reporter.warn(
                f"{name}: the link to the specimens has an error of {percent(state.misfit)} of the "
                "deformation of half-spaces, and its pressures may be wrong by as much: raise "
                "mesh.pad_elements (no mesh is fine enough for the sharp border of unworn flat "
                "pads)"
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
    model: SpecimensModel,
    half_space: PadHalfSpace,
    height: Array,
    force: float,
    path: Array,
    state: BlockState,
) -> HalfSpaceState:
    """Return the half-space under the shape of a state, linked to the specimens if wanted."""
    link = None
    if model.case.contact.link == "corrected":
        link = half_space.link(model.pair, state.contact.normal, path)
    return half_space.fretting_cycle(height, state.depths.sum(axis=0), force, path, link)


def _blocks(
    model: SpecimensModel, conditions: FrettingConditions, reporter: Reporter, steps: Steps
) -> Iterator[BlockState]:
    """Return the states of a worn pair, up to the end that the case asks for."""
    case = model.case
    step = case.wear.step
    stepper = (
        ExplicitStepper(step.fraction)
        if step.cycles is None
        else ExplicitStepper(cycles=step.cycles)
    )

    def to_go(state: BlockState) -> float:
        _check(state, conditions, case)
        return _to_go(case, state)

    fretted = FrettedPair(model.pair, case.laws, conditions, steps)
    reporter.doing(f"{conditions.force:g} N: the unworn cycle")
    observers = [BlockProgress(reporter)]
    return wear_in_cycle_blocks(fretted, model.face.gap, stepper, to_go, observers)


def _to_go(case: SpecimensCase, state: BlockState) -> float:
    """Return the largest number of cycles of the block after ``state``; 0 at the end.

    A run up to an energy ends with the first whole block that reaches it. Where nothing wears yet,
    the block ends as soon as the energy is reached at the present rate.
    """
    wear = case.wear
    if wear.cycles is not None:
        return rest(wear.cycles, state.cycles)
    assert wear.energy is not None
    left = (wear.energy - state.energy) / state.contact.energy
    block = _block(case, state)
    return 0.0 if left <= 0.0 else max(left, block if np.isfinite(block) else 0.0)


def _block(case: SpecimensCase, state: BlockState) -> float:
    """Return the number of cycles of a whole block after ``state``."""
    step = case.wear.step
    return step.fraction * state.stable_cycles if step.cycles is None else step.cycles


def _check(state: BlockState, conditions: FrettingConditions, case: SpecimensCase) -> None:
    """Raise an error unless the state has converged and the run comes to an end."""
    contact, force = state.contact, f"{conditions.force:g} N"
    if not contact.converged:
        raise MethodFailed(
            f"contact at {force} did not converge after {state.cycles:.4g} cycles; change "
            "mesh.pad_elements or lower wear.step.fraction"
        )
    if case.wear.energy is not None and contact.energy == 0.0:
        raise UserError(
            f"wear.energy: nothing slides at {force}, so this energy is never dissipated: raise "
            "load_path.stroke or friction.coefficient, or give wear.cycles"
        )
    if state.wear.any() and np.isinf(state.stable_cycles):
        raise UserError(
            f"mesh.pad_elements: only one node of the pad touches at {force}, too few to wear: "
            "raise it, or load_path.normal_forces"
        )
    # Number of blocks of the run if all are as long as the first one.
    needed = state.number or _to_go(case, state) / _block(case, state)
    if needed > MOST_BLOCKS:
        raise UserError(
            f"wear: more than {MOST_BLOCKS} cycle blocks at {force}: lower the wear coefficients, "
            "the cycles or the energy, or lengthen wear.step"
        )


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
