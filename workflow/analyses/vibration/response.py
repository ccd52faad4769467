"""Motions of a structure with joints under one force: curve, resonance and loops."""

from __future__ import annotations

from typing import Any

import numpy as np

from fe_models.dynamics.curves.followed_curve import curve_by_force, curve_by_frequency
from fe_models.dynamics.curves.forced_response import ResponseBranch, along_force
from fe_models.dynamics.curves.further_branches import FurtherBranch
from fe_models.dynamics.curves.phase_resonance import along_phase_resonance, curve_by_phase
from fe_models.dynamics.periodic.cycle_energy import damping_ratio
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from wear.contact.moving import LARGE_STROKE
from wear.joints.periodic.march import SEPARATED, SLIP
from workflow.analyses.vibration.following import VibrationRun
from workflow.analyses.vibration.model import sweep_of
from workflow.analyses.vibration.output.harmonics import harmonics_of
from workflow.analyses.vibration.output.loops import loops_of
from workflow.analyses.vibration.output.outcome import Curves, Response
from workflow.analyses.vibration.stability import stability_along
from workflow.case.text.plain import shares
from workflow.errors import MethodFailed
from workflow.layout.declared import Arrays
from workflow.messages.warning_kinds import WarningKind
from workflow.models.vibration.motions import amplitudes_of, motion_columns, peaks_inside
from workflow.models.vibration.results import LARGEST_ERROR, ForcedResponse
from workflow.models.vibration.structure import VibratingStructure
from workflow.shell.terminal.reporter import Reporter

# Reason why a curve may end at a resonance.
UNBOUNDED = "; without damping, resonances at which the joints do not resist are unbounded"


def response_under(run: VibrationRun, force: float) -> tuple[Response, ResponseBranch]:
    """Return the response under a force, and the branch of motions that it was taken from.

    Raises MethodFailed where there is no motion at all. A curve that ends before its span does
    gives a warning.
    """
    model, reporter = run.structure, run.reporter
    sweep, reported = sweep_of(run.case), run.case.amount.as_text(force)
    watch = run.progress(sweep.span, "Hz", sweep.upward)
    branch = sweep.curve(model, force, run.steps, watch)
    if branch.message:
        unbounded = UNBOUNDED if model.undamped else ""
        reporter.warn(WarningKind.CURVE_ENDS, f"{reported}: {branch.message}{unbounded}")
    curve = curve_by_frequency(branch.problem, force)
    stability = stability_along(run, reported, curve, branch.solutions)
    curves = {**curves_of(run, branch), **stability.columns}
    amplitudes = curves["amplitude"][:, -1]
    if not peaks_inside(amplitudes):
        reporter.warn(
            WarningKind.NO_RESONANCE,
            f"{reported}: no resonance, the largest motion is at an end of the curve",
        )
    reporter.doing(f"{reported}: resonance")
    resonance = sweep.resonance(model, branch, amplitudes, run.steps)
    warn_of_stroke(model, f"{reported}: at resonance", resonance, reporter)
    found = ForcedResponse(branch, curves, resonance)
    response = Response(
        force,
        curves,
        _numbers(run, found) | stability.numbers,
        nodes=_nodes(branch),
        resonance=_cycle(resonance) if model.rig.pressing is not None else None,
        loops=loops_of(run, branch),
        harmonics={"resonance": harmonics_of(model.rig, resonance)},
        bifurcations=stability.bifurcations,
    )
    warn_of_error(run, f"{reported}: the motion", response.numbers["error"])
    return response, branch


def warn_of_error(run: VibrationRun, motion: str, error: float) -> None:
    """Warn of a motion that is less accurate than the case asks for, or than any should be."""
    tolerance = run.case.resolution.tolerance
    if tolerance is None and error > LARGEST_ERROR:
        run.reporter.warn(
            WarningKind.INACCURATE_MOTION,
            f"{motion} has an error of {error:.1e}: give a resolution.tolerance, or more "
            "resolution.harmonics and resolution.samples",
        )
    if tolerance is not None and error > tolerance:
        run.reporter.warn(
            WarningKind.INACCURATE_MOTION,
            f"{motion} has an error of {error:.1e} at the finest resolution, above "
            f"resolution.tolerance {tolerance:g}",
        )


def force_sweep(run: VibrationRun, frequency: float) -> Curves:
    """Return the motions at a frequency from the least force of a case to the largest.

    Raises MethodFailed where there is none under the least force. A curve that ends before the
    largest force gives a warning.
    """
    amount = run.case.amount
    branch = along_force(
        run.structure.problem,
        frequency,
        run.amounts,
        control=run.control(run.amounts, amount.unit),
        accuracy=run.accuracy,
        steps=run.steps,
    )
    if not branch.solutions:
        raise MethodFailed(f"no motion at {frequency:g} Hz: {branch.message}; change force_sweeps")
    if branch.message:
        run.reporter.warn(
            WarningKind.CURVE_ENDS, f"{frequency:g} Hz, along the {amount.name}: {branch.message}"
        )
    curve = curve_by_force(branch.problem, frequency)
    stability = stability_along(run, f"{frequency:g} Hz", curve, branch.solutions)
    curves = curves_of(run, branch)
    shared = ("phase", "damping", "energy_per_cycle", "slip", "left_out")
    arrays = {
        amount.name: branch.forces,
        "amplitude": curves["amplitude"][:, -1],
        **{name: curves[name] for name in shared},
        **stability.columns,
    }
    folds = [float(branch.curve.parameters[place]) for place in branch.curve.folds]
    points = len(branch.solutions)
    numbers = {"frequency": frequency, "points": points, "folds": folds, "message": branch.message}
    return Curves(arrays, numbers | stability.numbers, stability.bifurcations)


def backbone_of(run: VibrationRun, branch: ResponseBranch) -> Curves | None:
    """Return the curve of phase resonance through all forces, from motions under one of them."""
    model, amount = run.structure, run.case.amount
    backbone = along_phase_resonance(
        model.problem,
        branch,
        run.amounts,
        control=run.control(run.amounts, amount.unit),
        accuracy=run.accuracy,
        steps=run.steps,
    )
    if backbone.message:
        run.reporter.warn(WarningKind.CURVE_ENDS, f"backbone: {backbone.message}")
    if not backbone.solutions:
        return None
    curve = curve_by_phase(backbone.problem, backbone.solutions[0])
    stability = stability_along(run, "backbone", curve, backbone.solutions)
    columns = motion_columns(model, backbone.problem, backbone.solutions)
    arrays = {
        amount.name: backbone.forces,
        "frequency": backbone.frequencies,
        "amplitude": columns["amplitude"][:, -1],
        **{name: columns[name] for name in ("damping", "energy_per_cycle", "slip")},
        **stability.columns,
    }
    numbers = {"message": backbone.message, **stability.numbers}
    return Curves(arrays, numbers, stability.bifurcations)


def _numbers(run: VibrationRun, found: ForcedResponse) -> dict[str, Any]:
    """Return numbers of the response to a force, for the summary."""
    branch, resonance, model = found.branch, found.resonance, run.structure
    amplitudes, resolution = amplitudes_of(model, resonance), resonance.resolution
    return {
        "resonance": resonance.frequency,
        "amplitude": float(amplitudes[-1]),
        "receptance": float(amplitudes[-1]) / resonance.force,
        "first_amplitude": float(max(amplitudes[0], found.columns["amplitude"][:, 0].max())),
        "energy_per_cycle": float(resonance.cycle.dissipated.sum()),
        "damping": damping_ratio(found.problem, resonance),
        "slip": model.time_share(resonance, SLIP),
        "separated": model.time_share(resonance, SEPARATED),
        "points": len(branch.solutions),
        "folds": [float(branch.curve.parameters[place]) for place in branch.curve.folds],
        "error": found.error,
        "harmonics": list(resolution.harmonics),
        "samples": resolution.samples,
        "message": branch.message,
        **_beside(run, resonance),
    }


def _beside(run: VibrationRun, resonance: HarmonicSolution) -> dict[str, Any]:
    """Return numbers that only a moving ground, an engine or a ring has."""
    numbers: dict[str, Any] = {}
    case, model = run.case, run.structure
    if model.driving.ground:
        absolute = amplitudes_of(model, model.driving.absolute(resonance))
        numbers["absolute_amplitude"] = float(absolute[-1])
    if case.engine_order is not None:
        numbers["speed"] = case.turning * resonance.frequency
    if model.rig.sector is not None:
        ring, harmonics = model.rig.sector.ring, resonance.resolution.harmonics
        numbers["nodal_diameters"] = [ring.diameters(harmonic) for harmonic in harmonics]
    return numbers


def curves_of(run: VibrationRun, branch: ResponseBranch | FurtherBranch) -> Arrays:
    """Return results of structure and joints along a branch, over the frequency."""
    frequencies = {"frequency": branch.frequencies}
    if run.case.engine_order is not None:
        frequencies["speed"] = run.case.turning * branch.frequencies
    return {**frequencies, **motion_columns(run.structure, branch.problem, branch.solutions)}


def _nodes(branch: ResponseBranch) -> Arrays:
    """Return results of each joint along the curve."""
    cycles = [motion.cycle for motion in branch.solutions]
    slip = np.array([(cycle.states == SLIP).mean(axis=0) for cycle in cycles])
    separated = np.array([(cycle.states == SEPARATED).mean(axis=0) for cycle in cycles])
    energy = np.array([cycle.dissipated for cycle in cycles])
    return {"slip": slip, "separated": separated, "energy": energy}


def _cycle(solution: HarmonicSolution) -> Arrays:
    """Return displacements, forces and states of all joints in a cycle."""
    displacement = (solution.resolution.basis @ solution.coefficients).transpose(1, 0, 2)
    states = solution.cycle.states.astype(np.int8)
    return {"displacement": displacement, "force": solution.cycle.samples, "state": states}


def warn_of_stroke(
    model: VibratingStructure, reported: str, motion: HarmonicSolution, reporter: Reporter
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
            WarningKind.MOTION_NEGLECTED,
            f"{reported} the pads slide over each other by {stroke:.3g} mm, more than "
            f"{shares(LARGE_STROKE)} of their width: the result neglects that other nodes then "
            "meet",
        )
