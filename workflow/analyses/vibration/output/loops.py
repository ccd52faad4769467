"""Loops of all joints together in periodic motions, with their stick slope and friction."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from fe_models.dynamics.curves.forced_response import ResponseBranch
from fe_models.dynamics.periodic.harmonic_balance import SAMPLES_PER_PERIOD, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.resolution_error import resolution_error
from sa_solver.types import Array
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.measured.loop_record import MeasuredLoopError
from wear.joints.measured.measured_loops import measure_loops
from wear.joints.periodic.march import SLIP, STICK
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.output.outcome import Curves
from workflow.messages.warning_kinds import WarningKind
from workflow.models.rig.laws import grouped
from workflow.models.vibration.structure import VibratingStructure

# A loop counts as stuck where its energy is below this share of stroke times force range.
STUCK_LOOP = 1e-4
# Repetitions of a loop, so that the record holds whole cycles wherever it begins.
REPEATED = 3


def loops_of(run: VibrationRun, branch: ResponseBranch) -> tuple[Curves, ...]:
    """Return loops at the frequency that the case asks for, one per resolution."""
    case, reporter = run.case, run.reporter
    if case.loops is None:
        return ()
    frequency = case.loops.frequency
    nearest = int(np.abs(branch.frequencies - frequency).argmin())
    start, loops = branch.solutions[nearest], []
    reported = case.amount.as_text(start.force)
    for harmonics in case.loops.harmonics or (start.resolution.harmonics,):
        every = case.with_mean(harmonics)
        reporter.doing(f"{reported}: loop at {frequency:g} Hz, {harmonics} harmonics")
        samples = max(case.resolution.samples, SAMPLES_PER_PERIOD * every[-1])
        problem = branch.problem.with_resolution(Resolution(every, samples))
        motion = run.steps("loop", partial(_known, problem, frequency, start))
        if not motion.converged:
            reporter.warn(
                WarningKind.MOTION_NOT_FOUND,
                f"{reported}: no loop at {frequency:g} Hz: {motion.message}",
            )
            continue
        number = None if case.loops.joints is None else case.loops.joints - 1
        load = case.laws[number or 0].normal_load
        loops.append(loop_of(run.structure, motion, load, number))
        start = motion
    return tuple(loops)


def _known(problem: HarmonicBalance, frequency: float, near: HarmonicSolution) -> HarmonicSolution:
    """Return the motion at a frequency, found from a near one, with its error."""
    motion = problem.solve(frequency, near.force, near)
    if not motion.converged:
        return motion
    return replace(motion, error=resolution_error(problem, motion))


def loop_of(
    model: VibratingStructure, motion: HarmonicSolution, load: float, entry: int | None = None
) -> Curves:
    """Return the loop of joints together in a motion, under a normal ``load`` [N].

    The joints are those of an ``entry`` of the case, or all.
    """
    rig = model.rig
    rows, along = rig.of_entry(entry)
    if rig.stretch is None:
        mean = motion.coefficients[rows, :, along].mean(axis=0)
        displacement = motion.resolution.basis @ mean
    else:
        between = replace(motion, motion=(motion.motion @ rig.stretch)[:, None])
        displacement = between.displacement(motion.resolution.samples)[:, 0]
    force = motion.cycle.samples[:, rows, along].sum(axis=1)
    total = motion.cycle.force[rows, :, along].sum(axis=0)
    expansion = motion.resolution.basis @ total
    arrays = {
        "displacement": closed(displacement),
        "force": closed(force),
        "expansion": closed(expansion),
    }
    half = 0.5 * float(np.ptp(force))
    numbers = {
        "frequency": motion.frequency,
        "harmonics": list(motion.resolution.harmonics),
        "stroke": float(np.ptp(displacement)),
        "force_range": float(np.ptp(force)),
        "energy": float(motion.cycle.dissipated[rows].sum()),
        "slip": model.time_share(motion, SLIP, rows),
        "error": None if motion.error is None else motion.error.largest,
        # Largest force missing in the harmonics, over half of the range of the force.
        "deformation": float(np.abs(force - expansion).max()) / half if half > 0.0 else 0.0,
        **_slopes(model, motion, displacement, force, load, rows),
    }
    return Curves(arrays, numbers)


def closed(values: Array) -> Array:
    """Return values ``(t,)`` of a cycle with the first one repeated at the end."""
    return np.append(values, values[:1])


def _slopes(
    model: VibratingStructure,
    motion: HarmonicSolution,
    displacement: Array,
    force: Array,
    load: float,
    rows: slice,
) -> dict[str, float | None]:
    """Return stick slope and friction of a loop, with friction None where it does not slide."""
    slope, friction = _stick_slope(model, motion, displacement, force, rows), None
    with suppress(MeasuredLoopError):
        # The widest loop is wanted: smaller loops inside are due to higher harmonics.
        loop = measure_loops(np.tile(displacement, REPEATED), np.tile(force, REPEATED)).widest
        if loop.energy.mean() > STUCK_LOOP * np.ptp(displacement) * np.ptp(force):
            slope = float(loop.stick_stiffness.mean()) if slope is None else slope
            if loop.slides and load > 0.0:
                friction = float(loop.friction_force.mean()) / load
    return {"stiffness": slope, "friction": friction}


def _stick_slope(
    model: VibratingStructure,
    motion: HarmonicSolution,
    displacement: Array,
    force: Array,
    rows: slice,
) -> float | None:
    """Return the slope over increments in which all touching joints stick, None without any.

    The state belongs to the end of an increment: a joint with one slider that sticks then has stuck
    throughout. Joints of many sliders have such increments only in a loop without slip. Joints that
    are open at rest do not count.
    """
    sticks = (motion.cycle.states[:, rows][:, model.touching[rows]] == STICK).all(axis=1)
    groups = grouped(model.law, model.rig.joints).rows()
    laws = [of.law for of, at in groups if at.start < rows.stop and rows.start < at.stop]
    run_parallel = all(isinstance(law, FrictionContact | Jenkins) for law in laws)
    if not run_parallel and not sticks.all():
        return None
    moved, pulled = ((curve - np.roll(curve, 1))[sticks] for curve in (displacement, force))
    square = float(moved @ moved)
    return float(moved @ pulled) / square if square > 0.0 else None
