"""Motions of a structure with joints under one force: curve, resonance and loops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.followed_curve import (
    curve_by_force,
    curve_by_frequency,
    curve_by_phase,
)
from fe_models.dynamics.curves.forced_response import (
    Accuracy,
    ResponseBranch,
    along_force,
    along_frequency,
    finer_resolution,
)
from fe_models.dynamics.curves.further_branches import FurtherBranch
from fe_models.dynamics.curves.phase_resonance import along_phase_resonance
from fe_models.dynamics.periodic.cycle_energy import damping_ratio
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.resolution_error import resolution_error
from sa_solver.steps import Steps
from sa_solver.types import Array
from wear.contact.moving import LARGE_STROKE
from wear.joints.periodic.march import SEPARATED, SLIP
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.model import VibrationModel
from workflow.analyses.vibration.output.harmonics import harmonics_of
from workflow.analyses.vibration.output.loops import loops_of
from workflow.analyses.vibration.output.outcome import DIAMETERS, RESONANCE, Curves, Response
from workflow.analyses.vibration.stability import stability_along
from workflow.case.text.plain import shares
from workflow.errors import MethodFailed
from workflow.shell.output.dataset import Dataset, Datasets
from workflow.shell.terminal.reporter import FORECAST, Reporter

# Times of a period from which amplitudes are taken. The true amplitude of harmonic 1 is at most
# 5e-6 larger.
TIMES = 1024
# Tolerance on the frequency of the largest amplitude, relative to it.
RESONANCE_TOLERANCE = 1e-6
# Error of a motion, due to harmonics and samples, that gives a warning if there is no tolerance.
LARGEST_ERROR = 0.05
# Usual number of points of a curve while the frequency or the force grows by a factor of e. It
# weighs as much as this known share of the curve in predictions.
POINTS, BEGUN = 50, 0.2
# Reason why a curve may end at a resonance.
UNBOUNDED = "; without damping, resonances at which the joints do not resist are unbounded"


def step_control(
    case: VibrationCase, watch: Callable[[float], None] = lambda parameter: None
) -> ContinuationControl:
    """Return the step control of curves that the case asks for; ``watch`` gets each new point."""
    steps = case.continuation
    return ContinuationControl(
        first=steps.first_step,
        least=steps.shortest_step,
        most=steps.longest_step,
        iterations=steps.iterations,
        max_iterations=steps.most_iterations,
        max_angle=float(np.degrees(steps.largest_angle)),
        max_points=steps.most_points,
        tolerance=steps.tolerance,
        watch=watch,
    )


def progress_along(
    span: tuple[float, float], upward: bool, unit: str, reporter: Reporter
) -> Callable[[float], None]:
    """Return a callback that reports the progress of a curve along a ``span``, from its points.

    The rest is assumed to have as many points per logarithm as the part behind. At the beginning,
    the usual number counts. Points that turn back do not reduce the progress.
    """
    begin, end = span if upward else span[::-1]
    length = abs(float(np.log(end / begin)))
    points, farthest = 0, 0.0

    @reporter.isolated(FORECAST)
    def watch(parameter: float) -> None:
        nonlocal points, farthest
        points += 1
        farthest = max(farthest, float(np.log(parameter / begin) / np.log(end / begin)))
        density = (points + BEGUN * POINTS * length) / (farthest + BEGUN)
        left = (1.0 - farthest) * density
        reporter.reached(points / (points + left), f"{parameter:.4g} {unit}")

    return watch


def accuracy_of(case: VibrationCase) -> Accuracy | None:
    """Return the accuracy of motions that the case asks for, None if the resolution is given."""
    tolerance = case.resolution.tolerance
    if tolerance is None:
        return None
    allowed = Accuracy(tolerance)
    return replace(allowed, highest=max(allowed.highest, case.harmonics[-1]))


def response_under(
    case: VibrationCase, model: VibrationModel, force: float, reporter: Reporter, steps: Steps
) -> tuple[Response, ResponseBranch]:
    """Return the response under a force, and the branch of motions that it was taken from.

    Raises MethodFailed where there is no motion at all. A curve that ends before its span does
    gives a warning.
    """
    accuracy, upward = accuracy_of(case), case.continuation.start == "lower"
    told = case.amount.told(force)
    branch = along_frequency(
        model.problem,
        force,
        case.frequencies,
        upward=upward,
        control=step_control(case, progress_along(case.frequencies, upward, "Hz", reporter)),
        accuracy=accuracy,
        steps=steps,
    )
    if not branch.solutions:
        where = case.amount.under(force)
        raise MethodFailed(f"no motion {where}: {branch.message}; change frequencies")
    if branch.message:
        unbounded = UNBOUNDED if model.undamped else ""
        reporter.warn(f"{told}: {branch.message}{unbounded}")
    stability = stability_along(
        case,
        model,
        told,
        curve_by_frequency(branch.problem, force),
        branch.solutions,
        partial(amplitude_of, model),
        reporter,
        steps,
    )
    curves = {**curves_of(case, model, branch), **stability.columns}
    if int(np.argmax(curves["amplitude"].values[:, -1])) in (0, len(branch.solutions) - 1):
        reporter.warn(f"{told}: no resonance, the largest motion is at an end of the curve")
    reporter.doing(f"{told}: resonance")
    peak = steps("resonance", lambda: _resonance(model, branch, curves))
    # The peak may have been found before the resolution was refined.
    problem = branch.problem.refined(peak.resolution)
    resonance = steps("accurate resonance", lambda: accurate(problem, peak, accuracy))
    warn_of_stroke(model, f"{told}: at resonance", resonance, reporter)
    found = problem.refined(resonance.resolution)
    response = Response(
        force,
        curves,
        _numbers(case, model, branch, curves, found, resonance) | stability.numbers,
        nodes=_nodes(branch),
        resonance=_cycle(resonance) if model.rig.pressing is not None else None,
        loops=loops_of(case, model, branch, reporter, steps),
        harmonics={RESONANCE: harmonics_of(model.rig, resonance)},
        bifurcations=stability.bifurcations,
    )
    warn_of_error(f"{told}: the motion", response.numbers["error"], case, reporter)
    return response, branch


def warn_of_error(motion: str, error: float, case: VibrationCase, reporter: Reporter) -> None:
    """Warn of a motion that is less accurate than the case asks for, or than any should be."""
    tolerance = case.resolution.tolerance
    if tolerance is None and error > LARGEST_ERROR:
        reporter.warn(
            f"{motion} has an error of {error:.1e}: give a resolution.tolerance, or more "
            "resolution.harmonics and resolution.samples"
        )
    if tolerance is not None and error > tolerance:
        reporter.warn(
            f"{motion} has an error of {error:.1e} at the finest resolution, above "
            f"resolution.tolerance {tolerance:g}"
        )


def force_sweep(
    case: VibrationCase, model: VibrationModel, frequency: float, reporter: Reporter, steps: Steps
) -> Curves:
    """Return the motions at a frequency from the least force of a case to the largest.

    Raises MethodFailed where there is none under the least force. A curve that ends before the
    largest force gives a warning.
    """
    span = case.amounts[0], case.amounts[-1]
    control = step_control(case, progress_along(span, True, case.amount.unit, reporter))
    branch = along_force(
        model.problem, frequency, span, control=control, accuracy=accuracy_of(case), steps=steps
    )
    if not branch.solutions:
        raise MethodFailed(f"no motion at {frequency:g} Hz: {branch.message}; change force_sweeps")
    if branch.message:
        reporter.warn(f"{frequency:g} Hz, along the {case.amount.name}: {branch.message}")
    stability = stability_along(
        case,
        model,
        f"{frequency:g} Hz",
        curve_by_force(branch.problem, frequency),
        branch.solutions,
        partial(amplitude_of, model),
        reporter,
        steps,
    )
    curves = curves_of(case, model, branch)
    shared = ("phase", "damping", "energy_per_cycle", "slip", "left_out")
    along = f"{case.amount.description}, in the order of the curve"
    datasets = {
        case.amount.name: Dataset(branch.forces, case.amount.unit, along),
        "amplitude": _of_the_last(curves["amplitude"]),
        **{name: curves[name] for name in shared},
        **stability.columns,
    }
    folds = [float(branch.curve.parameters[place]) for place in branch.curve.folds]
    points = len(branch.solutions)
    numbers = {"frequency": frequency, "points": points, "folds": folds, "message": branch.message}
    return Curves(datasets, numbers | stability.numbers, stability.bifurcations)


def backbone_of(
    case: VibrationCase,
    model: VibrationModel,
    branch: ResponseBranch,
    reporter: Reporter,
    steps: Steps,
) -> Curves | None:
    """Return the curve of phase resonance through all forces, from motions under one of them."""
    span = case.amounts[0], case.amounts[-1]
    control = step_control(case, progress_along(span, True, case.amount.unit, reporter))
    backbone = along_phase_resonance(
        model.problem, branch, span, control=control, accuracy=accuracy_of(case), steps=steps
    )
    if backbone.message:
        reporter.warn(f"backbone: {backbone.message}")
    if not backbone.solutions:
        return None
    stability = stability_along(
        case,
        model,
        "backbone",
        curve_by_phase(backbone.problem, backbone.solutions[0]),
        backbone.solutions,
        partial(amplitude_of, model),
        reporter,
        steps,
    )
    columns = motion_columns(model, backbone.problem, backbone.solutions)
    resonance = "phase resonance: the driven point lags the force by 90 degrees"
    datasets = {
        case.amount.name: Dataset(backbone.forces, case.amount.unit, case.amount.description),
        "frequency": Dataset(backbone.frequencies, "Hz", resonance),
        "amplitude": _of_the_last(columns["amplitude"]),
        **{name: columns[name] for name in ("damping", "energy_per_cycle", "slip")},
        **stability.columns,
    }
    numbers = {"message": backbone.message, **stability.numbers}
    return Curves(datasets, numbers, stability.bifurcations)


def _numbers(
    case: VibrationCase,
    model: VibrationModel,
    branch: ResponseBranch,
    curves: Datasets,
    problem: HarmonicBalance,
    resonance: HarmonicSolution,
) -> dict[str, Any]:
    """Return numbers of the response to a force, for the summary."""
    every = (*branch.solutions, resonance)
    amplitudes, resolution = amplitudes_of(model, resonance), resonance.resolution
    return {
        "resonance": resonance.frequency,
        "amplitude": float(amplitudes[-1]),
        "receptance": float(amplitudes[-1]) / resonance.force,
        "first_amplitude": float(max(amplitudes[0], curves["amplitude"].values[:, 0].max())),
        "energy_per_cycle": float(resonance.cycle.dissipated.sum()),
        "damping": damping_ratio(problem, resonance),
        "slip": model.time_share(resonance, SLIP),
        "separated": model.time_share(resonance, SEPARATED),
        "points": len(branch.solutions),
        "folds": [float(branch.curve.parameters[place]) for place in branch.curve.folds],
        "error": max(motion.error.largest for motion in every if motion.error is not None),
        "harmonics": list(resolution.harmonics),
        "samples": resolution.samples,
        "message": branch.message,
        **_beside(case, model, resonance),
    }


def _beside(
    case: VibrationCase, model: VibrationModel, resonance: HarmonicSolution
) -> dict[str, Any]:
    """Return numbers that only a moving ground, an engine or a ring has."""
    numbers: dict[str, Any] = {}
    if model.driving.ground:
        absolute = amplitudes_of(model, model.driving.absolute(resonance))
        numbers["absolute_amplitude"] = float(absolute[-1])
    if case.engine_order is not None:
        numbers["speed"] = case.turning * resonance.frequency
    if model.rig.sector is not None:
        ring, harmonics = model.rig.sector.ring, resonance.resolution.harmonics
        numbers[DIAMETERS] = [ring.diameters(harmonic) for harmonic in harmonics]
    return numbers


def curves_of(
    case: VibrationCase, model: VibrationModel, branch: ResponseBranch | FurtherBranch
) -> dict[str, Dataset]:
    """Return results of structure and joints along a branch, over the frequency."""
    along = "frequency of the force, in the order of the curve"
    frequencies = {"frequency": Dataset(branch.frequencies, "Hz", along)}
    if case.engine_order is not None:
        speed = case.turning * branch.frequencies
        frequencies["speed"] = Dataset(speed, "rad/s", "of the engine, by its order")
    return {**frequencies, **motion_columns(model, branch.problem, branch.solutions)}


def _of_the_last(amplitudes: Dataset) -> Dataset:
    """Return the main observed amplitude ``(n,)`` of all observed ones ``(n, k)``."""
    last = amplitudes.values[:, -1]
    return Dataset(last, "mm", "half the peak-to-peak motion of the reported point")


def motion_columns(
    model: VibrationModel, problem: HarmonicBalance, motions: Sequence[HarmonicSolution]
) -> dict[str, Dataset]:
    """Return results of structure and joints along a curve ``(n,)``, amplitudes ``(n, k)``."""

    def column(of: Callable[[HarmonicSolution], Array | float], unit: str, what: str) -> Dataset:
        return Dataset(np.array([of(motion) for motion in motions]), unit, what)

    moving = bool(model.driving.ground)
    seen = "half the peak-to-peak motion of the reported points, the last being the main one"
    relative = f"{seen}, relative to the moving ground" if moving else seen
    lag = "phase by which harmonic 1 of the reported point leads the force, or a sine at t = 0"
    lost = "energy lost in a cycle over 4π times the largest kinetic energy"
    slips = "share of the cycle in which a joint slips, mean of those that touch at rest"
    apart = "share of the cycle in which they are open"
    beyond = "estimated share of the joints' vibration in harmonics that are not included"
    energy = "energy that the joints dissipate in a cycle"
    absolute = {}
    if moving:
        of_all = f"{seen}, including that of the ground"
        absolute["absolute_amplitude"] = column(
            lambda motion: amplitudes_of(model, model.driving.absolute(motion)), "mm", of_all
        )
    return {
        "amplitude": column(lambda motion: amplitudes_of(model, motion), "mm", relative),
        **absolute,
        "phase": column(lambda motion: _phase(motion, model.rig.seen[-1]), "rad", lag),
        "energy_per_cycle": column(lambda motion: motion.cycle.dissipated.sum(), "N mm", energy),
        "damping": column(lambda motion: damping_ratio(problem, motion), "1", lost),
        "slip": column(lambda motion: model.time_share(motion, SLIP), "1", slips),
        "separated": column(lambda motion: model.time_share(motion, SEPARATED), "1", apart),
        "left_out": column(lambda motion: motion.left_out, "1", beyond),
    }


def _phase(solution: HarmonicSolution, seen: Array) -> float:
    """Return the phase of harmonic 1 relative to a sine, whose coefficient is -i."""
    first = solution.motion[solution.resolution.harmonics.index(1)] @ seen
    return float(np.angle(1j * first))


def amplitudes_of(model: VibrationModel, solution: HarmonicSolution) -> Array:
    """Return observed amplitudes ``(k,)``: half of the peak-to-peak displacement [mm]."""
    seen = replace(solution, motion=solution.motion @ model.rig.seen.T)
    return np.asarray(0.5 * np.ptp(seen.displacement(TIMES), axis=0))


def amplitude_of(model: VibrationModel, solution: HarmonicSolution) -> float:
    """Return the main observed amplitude [mm]."""
    return float(amplitudes_of(model, solution)[-1])


def _nodes(branch: ResponseBranch) -> dict[str, Dataset]:
    """Return results of each joint along the curve."""
    cycles = [motion.cycle for motion in branch.solutions]
    slip = np.array([(cycle.states == SLIP).mean(axis=0) for cycle in cycles])
    separated = np.array([(cycle.states == SEPARATED).mean(axis=0) for cycle in cycles])
    energy = np.array([cycle.dissipated for cycle in cycles])
    share = "share of the cycle in which each joint"
    return {
        "slip": Dataset(slip, "1", f"{share} slips, by point of the curve"),
        "separated": Dataset(separated, "1", f"{share} is open"),
        "energy": Dataset(energy, "N mm", "energy that each joint dissipates in a cycle"),
    }


def _cycle(solution: HarmonicSolution) -> dict[str, Dataset]:
    """Return displacements, forces and states of all joints in a cycle."""
    displacement = (solution.resolution.basis @ solution.coefficients).transpose(1, 0, 2)
    states = solution.cycle.states.astype(np.int8)
    moved = "of each joint along x, y and its closing, at times of a cycle"
    pulled = "of each joint along x, y and its pressure"
    return {
        "displacement": Dataset(displacement, "mm", moved),
        "force": Dataset(solution.cycle.samples, "N", pulled),
        "state": Dataset(states, "1", "state of each joint: 0 sticks, 1 slips, 2 is open"),
    }


def warn_of_stroke(
    model: VibrationModel, told: str, motion: HarmonicSolution, reporter: Reporter
) -> None:
    """Warn if contacts with places slide further than contacts of fixed pairs of nodes may."""
    if not len(model.rig.places):
        return
    moved = motion.resolution.basis @ motion.coefficients
    stroke, width = (
        float(np.ptp(moved[:, :, 0], axis=1).max()),
        float(np.ptp(model.rig.places[:, 0])),
    )
    if stroke > LARGE_STROKE * width:
        reporter.warn(
            f"{told} the pads slide over each other by {stroke:.3g} mm, more than "
            f"{shares(LARGE_STROKE)} of their width: the result neglects that other nodes then meet"
        )


# --- resonance ----------------------------------------------------------------------------------


def _resonance(model: VibrationModel, branch: ResponseBranch, curves: Datasets) -> HarmonicSolution:
    """Return the motion with the largest observed amplitude, searched around the largest point.

    Where the curve folds or ends there, this is the largest point itself.
    """
    sizes = curves["amplitude"].values[:, -1]
    place = int(np.argmax(sizes))
    best = branch.solutions[place]
    if place in (0, len(sizes) - 1):
        return best
    before, after = sorted(branch.frequencies[[place - 1, place + 1]])
    if not before < best.frequency < after:
        return best

    def lowness(frequency: float) -> float:
        solution = branch.problem.solve(frequency, best.force, best)
        return -float(amplitudes_of(model, solution)[-1]) if solution.converged else 0.0

    search = minimize_scalar(
        lowness,
        bounds=(before, after),
        method="bounded",
        options={"xatol": RESONANCE_TOLERANCE * best.frequency},
    )
    top = branch.problem.solve(float(search.x), best.force, best)
    return top if top.converged and -search.fun > sizes[place] else best


def accurate(
    problem: HarmonicBalance, motion: HarmonicSolution, accuracy: Accuracy | None
) -> HarmonicSolution:
    """Return the motion with its error, refined to the accuracy if one is asked for."""
    while True:
        error = resolution_error(problem, motion)
        motion, present = replace(motion, error=error), problem.resolution
        finer = finer_resolution(present, error, accuracy) if accuracy is not None else None
        if finer is None:
            return motion
        refined = problem.refined(finer)
        more_accurate = refined.solve(motion.frequency, motion.force, motion)
        if not more_accurate.converged:
            return motion
        problem, motion = refined, more_accurate
