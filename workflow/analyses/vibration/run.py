"""Runs of vibration cases: steady motions along frequency, force by force."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

from fe_models.dynamics.curves.forced_response import ResponseBranch
from fe_models.dynamics.curves.further_branches import FurtherBranch
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError
from fe_models.dynamics.periodic.receptance import ReceptanceError
from sa_solver.steps import Steps
from wear.joints.parameters import JointError
from workflow.analyses.vibration.answers import answers_under
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.further import further_from
from workflow.analyses.vibration.model import (
    contact_at_rest,
    diameters,
    structure_numbers,
    vibration_model,
)
from workflow.analyses.vibration.modes import mode_of, refuse_missing_modes
from workflow.analyses.vibration.output.harmonics import harmonics_along, names_of
from workflow.analyses.vibration.output.outcome import Curves, Response, VibrationOutcome, trend
from workflow.analyses.vibration.output.results import write_vibration_output
from workflow.analyses.vibration.response import backbone_of, force_sweep, response_under
from workflow.analyses.vibration.stability import looked_for
from workflow.case.text.readable import percent
from workflow.errors import UserError
from workflow.messages.warning_kinds import WarningKind
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.analysis import Run
from workflow.shell.folders.steps import resumable_steps
from workflow.shell.terminal.reporter import Reporter

# Share of a record's force above its highest harmonic that gives a warning.
LEFT_OUT = 0.05


def run_vibration(run: Run[VibrationCase]) -> None:
    """Run a vibration case to its end.

    Raises UserError where a joint or structure is impossible, and MethodFailed where it has no
    state at rest, or a force has no motion at all. A curve that ends before its span does gives a
    warning.
    """
    try:
        with resumable_steps(run) as steps:
            outcome = _outcome(run.case, run.reporter, steps)
    except JointError as error:
        raise UserError(f"{run.folder.case}: joint: {error}") from error
    except (HarmonicBalanceError, ReceptanceError) as error:
        raise UserError(f"{run.folder.case}: structure: {error}") from error
    write_vibration_output(outcome, run)


def _outcome(case: VibrationCase, reporter: Reporter, steps: Steps) -> VibrationOutcome:
    model = vibration_model(case, reporter).structure
    with reporter.stage("rest and linear limits"):
        numbers, contact = structure_numbers(model), contact_at_rest(model)
        _report_omissions(case, model, reporter)
        by_diameters = diameters(model)
        refuse_missing_modes(case, model)
        linear = steps("linear limits", lambda: model.linear(case.frequencies))
    responses: list[Response] = []
    backbone = None
    sweeps: list[Curves] = []
    further: list[Curves] = []
    modes: list[Curves] = []
    numbered = () if case.modes is None else case.modes.numbers
    count = len(case.amounts) + case.backbone + len(case.force_sweeps) + len(numbered)
    curves = _Curves(count, reporter, growing=case.resolution.tolerance is not None)
    following = VibrationRun(case, model, reporter, steps)
    with reporter.course("vibration"):
        for force in case.amounts:
            with curves.next(case.amount.as_text(force)), reporter.stage("response"):
                response, branch = response_under(following, force)
                answers, of_answers = answers_under(following, branch)
                harmonics = {**response.harmonics, **of_answers}
                if case.harmonics_along_curves:
                    harmonics["curve"] = harmonics_along(model.rig, branch, reporter)
            responses.append(replace(response, answers=answers, harmonics=harmonics))
            known: list[ResponseBranch | FurtherBranch] = [branch]
            for start in (start for start in case.further_branches if start.force == force):
                with reporter.stage("further branches"):
                    for other, found in further_from(following, start, known):
                        known.append(other)
                        further.append(found)
            if case.backbone and backbone is None:
                # The backbone starts from the least force that has a phase resonance.
                with curves.next("backbone"), reporter.stage("backbone"):
                    backbone = backbone_of(following, branch)
        for frequency in case.force_sweeps:
            with curves.next(f"{frequency:g} Hz"), reporter.stage("force sweep"):
                sweeps.append(force_sweep(following, frequency))
        for number in numbered:
            with curves.next(f"mode {number}"), reporter.stage("mode"):
                # Use as many harmonics as the largest force needed.
                modes.append(mode_of(following, number, branch.problem))
    return VibrationOutcome(
        case,
        model.rig.labels,
        names_of(model.rig),
        tuple(responses),
        linear,
        numbers | _across(case, responses),
        contact,
        backbone,
        tuple(sweeps),
        tuple(modes),
        tuple(further),
        by_diameters,
    )


def _report_omissions(case: VibrationCase, model: VibratingStructure, reporter: Reporter) -> None:
    """Report the parts of records that are left out, and stability that is not computed."""
    for number, share in enumerate(model.driving.left_out):
        reporter.log(
            f"record {number + 1}: {percent(share)} above its highest harmonic is not used"
        )
        if share > LEFT_OUT:
            reporter.warn(
                WarningKind.LOST_FORCE,
                f"excitation.records.{number}: {percent(share)} of its force is above the highest "
                "harmonic used and is lost: raise highest, or resolution.harmonics",
            )
    if case.stability == "auto" and not looked_for(case, model):
        reporter.say("stability: not computed in so large a structure; `stability: every` does it")


@dataclass
class _Curves:
    """A number of curves, taken as equal parts of the work.

    Where resolutions are ``growing`` with the force, the second counts twice as much as the first,
    the third three times, and so on.
    """

    count: int
    reporter: Reporter
    growing: bool
    begun: int = 0

    def next(self, name: str) -> AbstractContextManager[None]:
        """Return a context for the next curve."""
        begin, self.begun = self.begun, min(self.begun + 1, self.count)
        return self.reporter.part(
            self._share(min(begin, self.count - 1)), self._share(self.begun), name
        )

    def _share(self, begun: int) -> float:
        """Return the share of the work of the first ``begun`` curves."""
        equal = begun / self.count
        return equal * (begun + 1) / (self.count + 1) if self.growing else equal


def _across(case: VibrationCase, responses: list[Response]) -> dict[str, Any]:
    """Return results of all forces together: the lowest receptance, and the trend of resonances."""
    resonances = [response.numbers["resonance"] for response in responses]
    lowest = min(responses, key=lambda response: response.numbers["receptance"])
    return {
        f"least_receptance_{case.amount.name}": lowest.force,
        "trend": {"resonance": trend(resonances)},
    }
