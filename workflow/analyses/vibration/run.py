"""A vibration case: the steady motions of a structure along frequency, force by force."""

from __future__ import annotations

from typing import Any

import numpy as np

from fe_models.dynamics.forced_response import ResponseBranch
from fe_models.dynamics.harmonics import HarmonicBalanceError
from fe_models.dynamics.phase_resonance import along_phase_resonance
from fe_models.dynamics.receptance import ReceptanceError
from wear.joints.parameters import JointError
from workflow.analyses.vibration.case import VibrationCase
from workflow.analyses.vibration.model import VibrationModel
from workflow.analyses.vibration.outcome import Curves, Response, VibrationOutcome, trend
from workflow.analyses.vibration.response import (
    accuracy_of,
    amplitude_column,
    amplitudes_of,
    force_sweep,
    joint_columns,
    response_under,
    step_control,
)
from workflow.analyses.vibration.results import write_vibration_output
from workflow.errors import UserError
from workflow.shell.analysis import Run
from workflow.shell.dataset import Dataset
from workflow.shell.reporter import Reporter


def run_vibration(run: Run[VibrationCase]) -> None:
    """Run a vibration case to its end.

    Raises UserError where joint or structure cannot be what the case says, MethodFailed where it
    does not rest, or a force has no motion at all. A curve that ends before its span does is told
    as a warning.
    """
    run.reporter.say(f"run: {run.case.title}")
    try:
        outcome = _outcome(run.case, run.reporter)
    except JointError as error:
        raise UserError(f"{run.folder.case}: joint: {error}") from error
    except (HarmonicBalanceError, ReceptanceError) as error:
        raise UserError(f"{run.folder.case}: structure: {error}") from error
    write_vibration_output(outcome, run)


def _outcome(case: VibrationCase, reporter: Reporter) -> VibrationOutcome:
    model = VibrationModel.of(case, reporter)
    with reporter.stage("rest and linear limits"):
        numbers, contact = model.numbers(), model.contact()
        linear = model.linear(case.frequencies)
    responses: list[Response] = []
    backbone = None
    for force in case.forces:
        with reporter.stage("response"):
            response, branch = response_under(case, model, force, reporter)
        responses.append(response)
        if case.backbone and backbone is None:
            # From the least force on which there is a phase resonance.
            with reporter.stage("backbone"):
                backbone = _backbone(case, model, branch, reporter)
    sweeps = []
    for frequency in case.force_sweeps:
        with reporter.stage("force sweep"):
            sweeps.append(force_sweep(case, model, frequency, reporter))
    return VibrationOutcome(
        case,
        model.rig.labels,
        tuple(responses),
        linear,
        numbers | _across(responses),
        contact,
        backbone,
        tuple(sweeps),
    )


def _across(responses: list[Response]) -> dict[str, Any]:
    """What the forces show together: where the peak is lowest, and whether resonances move on."""
    resonances = [response.numbers["resonance"] for response in responses]
    lowest = min(responses, key=lambda response: response.numbers["receptance"])
    return {
        "least_receptance_force": lowest.force,
        "trend": {"resonance": trend(resonances)},
    }


def _backbone(
    case: VibrationCase, model: VibrationModel, branch: ResponseBranch, reporter: Reporter
) -> Curves | None:
    """The curve of phase resonance through all forces, from the motions under one of them."""
    span = case.forces[0], case.forces[-1]
    found = along_phase_resonance(
        model.problem, branch, span, control=step_control(case), accuracy=accuracy_of(case)
    )
    if found.message:
        reporter.warn(f"backbone: {found.message}")
    if not found.solutions:
        return None
    amplitude = np.array([amplitudes_of(model, motion)[-1] for motion in found.solutions])
    resonance = "of phase resonance: what is driven lags the force by 90 degrees"
    joints = joint_columns(model, found.problem, found.solutions)
    datasets = {
        "force": Dataset(found.forces, "N", "amplitude of the force"),
        "frequency": Dataset(found.frequencies, "Hz", resonance),
        "amplitude": amplitude_column(amplitude),
        **{name: joints[name] for name in ("damping", "energy_per_cycle", "slip")},
    }
    return Curves(datasets, {"message": found.message})
