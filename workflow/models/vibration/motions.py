"""Periodic motions of a structure with joints: amplitudes, columns, resonance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from fe_models.dynamics.curves.forced_response import ResponseBranch
from fe_models.dynamics.curves.motion_recorder import Accuracy, finer_resolution
from fe_models.dynamics.periodic.cycle_energy import damping_ratio
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.resolution_error import resolution_error
from sa_solver.types import Array
from wear.joints.periodic.march import SEPARATED, SLIP
from workflow.models.vibration.structure import VibratingStructure

# Times of a period from which amplitudes are taken. The true amplitude of harmonic 1 is at most
# 5e-6 larger.
TIMES = 1024
# Tolerance on the frequency of the largest amplitude, relative to it.
RESONANCE_TOLERANCE = 1e-6


def motion_columns(
    structure: VibratingStructure, problem: HarmonicBalance, motions: Sequence[HarmonicSolution]
) -> dict[str, Array]:
    """Return the values of motions along a curve: ``(n,)`` each, amplitudes ``(n, k)``.

    They are declared in :mod:`workflow.models.vibration.layout`.
    """

    def column(of: Callable[[HarmonicSolution], Array | float]) -> Array:
        return np.array([of(motion) for motion in motions])

    driving, seen = structure.driving, structure.rig.seen
    columns = {"amplitude": column(lambda motion: amplitudes_of(structure, motion))}
    if driving.ground:
        columns["absolute_amplitude"] = column(
            lambda motion: amplitudes_of(structure, driving.absolute(motion))
        )
    return columns | {
        "phase": column(lambda motion: _phase(motion, seen[-1])),
        "energy_per_cycle": column(lambda motion: motion.cycle.dissipated.sum()),
        "damping": column(lambda motion: damping_ratio(problem, motion)),
        "slip": column(lambda motion: structure.time_share(motion, SLIP)),
        "separated": column(lambda motion: structure.time_share(motion, SEPARATED)),
        "left_out": column(lambda motion: motion.left_out),
    }


def _phase(solution: HarmonicSolution, seen: Array) -> float:
    """Return the phase of harmonic 1 relative to a sine, whose coefficient is -i."""
    first = solution.motion[solution.resolution.harmonics.index(1)] @ seen
    return float(np.angle(1j * first))


def amplitudes_of(structure: VibratingStructure, solution: HarmonicSolution) -> Array:
    """Return observed amplitudes ``(k,)``: half of the peak-to-peak displacement [mm]."""
    seen = replace(solution, motion=solution.motion @ structure.rig.seen.T)
    return np.asarray(0.5 * np.ptp(seen.displacement(TIMES), axis=0))


def amplitude_of(structure: VibratingStructure, solution: HarmonicSolution) -> float:
    """Return the main observed amplitude [mm]."""
    return float(amplitudes_of(structure, solution)[-1])


def peaks_inside(amplitudes: Array) -> bool:
    """Return whether the largest of amplitudes ``(n,)`` is not at an end of the curve."""
    return int(np.argmax(amplitudes)) not in (0, len(amplitudes) - 1)


def largest_motion(
    structure: VibratingStructure, branch: ResponseBranch, amplitudes: Array
) -> HarmonicSolution:
    """Return the motion with the largest observed amplitude, searched around the largest point.

    ``amplitudes`` ``(n,)`` [mm] are those of the points. Where the curve folds or ends at the
    largest point, this is that point itself.
    """
    place = int(np.argmax(amplitudes))
    best = branch.solutions[place]
    if not peaks_inside(amplitudes):
        return best
    before, after = sorted(branch.frequencies[[place - 1, place + 1]])
    if not before < best.frequency < after:
        return best

    def lowness(frequency: float) -> float:
        solution = branch.problem.solve(frequency, best.force, best)
        return -amplitude_of(structure, solution) if solution.converged else 0.0

    search = minimize_scalar(
        lowness,
        bounds=(before, after),
        method="bounded",
        options={"xatol": RESONANCE_TOLERANCE * best.frequency},
    )
    top = branch.problem.solve(float(search.x), best.force, best)
    return top if top.converged and -search.fun > amplitudes[place] else best


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
        refined = problem.with_resolution(finer)
        more_accurate = refined.solve(motion.frequency, motion.force, motion)
        if not more_accurate.converged:
            return motion
        problem, motion = refined, more_accurate
