"""A vibration case: the steady motions of a rig along frequency, force by force."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from fe_models.dynamics.continuation import StepControl
from fe_models.dynamics.forced_response import (
    Accuracy,
    Branch,
    along_frequency,
    finer_resolution,
)
from fe_models.dynamics.harmonic_balance import HarmonicBalance, HarmonicSolution, PeriodicLoad
from fe_models.dynamics.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.receptance import ReceptanceError
from sa_solver.types import Array
from wear.joints.parameters import JointError
from wear.joints.periodic import SLIP, PeriodicMarch
from workflow.case import VibrationCase
from workflow.errors import MethodFailed, UserError
from workflow.folder import OutputFolder
from workflow.joint_model import LAWS, Law
from workflow.reporter import Reporter
from workflow.rig_model import RigModel, row_of_masses

# Steps along a curve, as a share of the motion: its points then draw it.
LONGEST_STEP = 0.1
# Times of a period from which amplitudes are taken: between them harmonic 1 is 5e-6 larger.
TIMES = 1024
# Of the frequency at which the amplitude is largest.
RESONANCE_TOLERANCE = 1e-6
# Frequencies of the linear limits, beside their own natural frequencies.
LINEAR_POINTS = 2000


@dataclass(frozen=True)
class Response:
    """The motions under one ``force`` [N].

    ``curves`` by dataset (:data:`DATASETS`), the first axis of each along the curve, and
    ``numbers`` for the summary.
    """

    force: float
    curves: Mapping[str, Array]
    numbers: Mapping[str, Any]


@dataclass(frozen=True)
class VibrationOutcome:
    """Everything a vibration case has found.

    ``linear`` are the limits of a joint that is free and one that is stuck, over frequency;
    ``numbers`` go into the summary as they are.
    """

    case: VibrationCase
    responses: tuple[Response, ...]
    linear: Mapping[str, Array]
    numbers: Mapping[str, Any]


# Unit and description of every dataset, by group and name.
DATASETS: dict[str, dict[str, tuple[str, str]]] = {
    "responses": {
        "frequency": ("Hz", "frequency of the force, in the order of the curve"),
        "amplitude": ("mm", "half of the way to and fro of each mass, from the ground on"),
        "phase": ("rad", "of harmonic 1 of the last mass before the force"),
        "energy_per_cycle": ("N mm", "energy that the joint dissipates in a cycle"),
        "slip": ("1", "share of the cycle in which the joint slips"),
        "left_out": ("1", "estimated share of the joint's vibration in harmonics left out"),
    },
    "linear": {
        "frequency": ("Hz", "frequency of the force"),
        "free": ("mm/N", "amplitude of the last mass over the force, without the joint"),
        "stuck": ("mm/N", "amplitude of the last mass over the force, the joint stuck"),
    },
}


def run_vibration(case: VibrationCase, folder: OutputFolder, reporter: Reporter) -> None:
    """Run a vibration case to its end.

    Raises UserError where joint or rig cannot be what the case says, MethodFailed where a force has
    no motion at all. A curve that ends before its span does is told as a warning.
    """
    from workflow.vibration_output import write_vibration_output

    reporter.say(f"run: {case.title}")
    try:
        outcome = _outcome(case, reporter)
    except JointError as error:
        raise UserError(f"{folder.case}: joint: {error}") from error
    except (HarmonicBalanceError, ReceptanceError) as error:
        raise UserError(f"{folder.case}: structure: {error}") from error
    write_vibration_output(outcome, folder, reporter)


def _outcome(case: VibrationCase, reporter: Reporter) -> VibrationOutcome:
    rig = row_of_masses(case.structure, case.mass)
    law = LAWS[case.joint.law](**case.joint.model_dump(exclude={"law"}))
    # The force is a sine: Re (-i) exp(iωt).
    problem = HarmonicBalance(
        rig.model,
        PeriodicMarch(law),
        PeriodicLoad({1: -1j * rig.driven}),
        Resolution(tuple(case.resolution.harmonics), case.resolution.samples),
    )
    responses = []
    for force in case.forces:
        with reporter.stage("response"):
            responses.append(_response(case, problem, force, reporter))
    numbers = {"free": rig.free(), **rig.modes(law), **_across(responses)}
    return VibrationOutcome(case, tuple(responses), _linear(case, rig, law), numbers)


def _across(responses: list[Response]) -> dict[str, Any]:
    """What the forces show together: where the peak is lowest, and whether resonances move on."""
    resonances = [response.numbers["resonance"] for response in responses]
    signs = {float(np.sign(after - before)) for before, after in pairwise(resonances)}
    lowest = min(responses, key=lambda response: response.numbers["receptance"])
    return {
        "least_receptance_force": lowest.force,
        "trend": {"resonance": signs.pop() if len(signs) == 1 else 0.0},
    }


# --- one force ----------------------------------------------------------------------------------


def _response(
    case: VibrationCase, problem: HarmonicBalance, force: float, reporter: Reporter
) -> Response:
    tolerance, highest = case.resolution.tolerance, problem.resolution.harmonics[-1]
    accuracy = None
    if tolerance is not None:
        allowed = Accuracy(tolerance)
        accuracy = replace(allowed, highest=max(allowed.highest, highest))
    control = StepControl(most=LONGEST_STEP)
    branch = along_frequency(problem, force, case.frequencies, control=control, accuracy=accuracy)
    if not branch.solutions:
        raise MethodFailed(f"no motion under {force:g} N: {branch.message}; change frequencies")
    if branch.message:
        reporter.warn(f"{force:g} N: {branch.message}")
    curves = _curves(branch)
    if int(np.argmax(curves["amplitude"][:, -1])) in (0, len(branch.solutions) - 1):
        reporter.warn(f"{force:g} N: no resonance, the largest motion is at an end of the curve")
    resonance = _accurate(branch.problem, _resonance(branch, curves), accuracy)
    every = (*branch.solutions, resonance)
    left_out = max(own.left_out for own in every)
    sampling = max(own.sampling for own in every if own.sampling is not None)
    error = max(left_out, sampling)
    if tolerance is not None and error > tolerance:
        reporter.warn(
            f"{force:g} N: the finest resolution leaves an error of {error:.1e}, above "
            f"resolution.tolerance {tolerance:g}"
        )
    amplitudes, own = _amplitudes(resonance), resonance.resolution
    numbers = {
        "resonance": resonance.frequency,
        "amplitude": float(amplitudes[-1]),
        "receptance": float(amplitudes[-1]) / force,
        "first_mass_amplitude": float(max(amplitudes[0], curves["amplitude"][:, 0].max())),
        "energy_per_cycle": float(resonance.cycle.dissipated.sum()),
        "slip": _slip(resonance),
        "points": len(branch.solutions),
        "folds": _folds(branch),
        "left_out": left_out,
        "sampling": sampling,
        "harmonics": list(own.harmonics),
        "samples": own.samples,
        "message": branch.message,
    }
    return Response(force, curves, numbers)


def _curves(branch: Branch) -> dict[str, Array]:
    solutions = branch.solutions
    return {
        "frequency": branch.frequencies,
        "amplitude": np.array([_amplitudes(own) for own in solutions]),
        # Over that of the force, -i.
        "phase": np.array([float(np.angle(1j * own.amplitude(-1))) for own in solutions]),
        "energy_per_cycle": np.array([own.cycle.dissipated.sum() for own in solutions]),
        "slip": np.array([_slip(own) for own in solutions]),
        "left_out": np.array([own.left_out for own in solutions]),
    }


def _folds(branch: Branch) -> list[float]:
    """Frequencies at which the curve turns back [Hz]."""
    return [float(branch.curve.parameters[place]) for place in branch.curve.folds]


def _amplitudes(solution: HarmonicSolution) -> Array:
    """Half of the way to and fro ``(n,)`` [mm]."""
    return np.asarray(0.5 * np.ptp(solution.displacement(TIMES), axis=0))


def _slip(solution: HarmonicSolution) -> float:
    return float((solution.cycle.states == SLIP).mean())


def _resonance(branch: Branch, curves: Mapping[str, Array]) -> HarmonicSolution:
    """The motion in which the last mass moves most: between the points beside the largest.

    Where the curve folds there, or ends, the largest point itself.
    """
    sizes = curves["amplitude"][:, -1]
    place = int(np.argmax(sizes))
    best = branch.solutions[place]
    if place in (0, len(sizes) - 1):
        return best
    before, after = sorted(branch.frequencies[[place - 1, place + 1]])
    if not before < best.frequency < after:
        return best

    def found(frequency: float) -> HarmonicSolution:
        return branch.problem.solve(frequency, best.force, best)

    def lowness(frequency: float) -> float:
        solution = found(frequency)
        return -_amplitudes(solution)[-1] if solution.converged else 0.0

    search = minimize_scalar(
        lowness,
        bounds=(before, after),
        method="bounded",
        options={"xatol": RESONANCE_TOLERANCE * best.frequency},
    )
    top = found(float(search.x))
    return top if top.converged and -search.fun > sizes[place] else best


def _accurate(
    problem: HarmonicBalance, motion: HarmonicSolution, accuracy: Accuracy | None
) -> HarmonicSolution:
    """The motion with its error by sampling; as accurate as asked for, if that is asked for."""
    while True:
        sampling = problem.sampling(motion.coefficients.ravel(), motion.frequency, motion.force)
        motion = replace(motion, sampling=sampling)
        finer = finer_resolution(problem, motion, accuracy) if accuracy is not None else None
        if finer is None:
            return motion
        problem = problem.refined(finer)
        found = problem.solve(motion.frequency, motion.force, motion)
        if not found.converged:
            return motion
        motion = found


# --- linear limits ------------------------------------------------------------------------------


def _linear(case: VibrationCase, rig: RigModel, law: Law) -> dict[str, Array]:
    """Amplitude of the last mass over the force with the joint free, and stuck."""
    low, high = case.frequencies
    natural = np.array([*rig.free(), *rig.modes(law)["stuck"]])
    inside = natural[(natural > low) & (natural < high)]
    frequency = np.union1d(np.geomspace(low, high, LINEAR_POINTS), inside)
    still = np.zeros((rig.joints, rig.directions))
    tangent = law.respond(law.rest(rig.joints), still).tangent[0]
    held = rig.model.connection.T @ tangent @ rig.model.connection
    limits = {"free": rig.model.stiffness, "stuck": rig.model.stiffness + held}
    return {"frequency": frequency} | {
        name: _receptance(rig, stiffness, frequency) for name, stiffness in limits.items()
    }


def _receptance(rig: RigModel, stiffness: Array, frequency: Array) -> Array:
    """Amplitude over force of what is looked at ``(f,)`` [mm/N]."""
    angular = 2.0 * np.pi * frequency[:, None, None]
    dynamic = stiffness + 1j * angular * rig.model.damping - angular**2 * rig.model.mass
    moved = np.linalg.solve(
        dynamic, np.broadcast_to(rig.driven[:, None], (len(angular), len(rig.driven), 1))
    )
    return np.abs(moved[..., 0] @ rig.seen[-1])
