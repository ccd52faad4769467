"""How far a periodic motion is from what more harmonics and samples would make of it.

The equations of a richer resolution are evaluated at the motion, and one step of Newton's method
leads to theirs. It answers for what harmonics left out do to those that are kept, near a resonance
many times what they are themselves, and for corners between samples.

Near a fold of a response there may be no motion at the same frequency: there the motion nearest on
the richer curve is looked for, whose frequency may differ, at a price.
"""

from __future__ import annotations

import numpy as np

from fe_models.dynamics.curves.bordered import solve_alone
from fe_models.dynamics.periodic.cycle_energy import energy_damped
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution, ResolutionError
from fe_models.dynamics.periodic.harmonics import Resolution
from sa_solver.types import Array

# Where a response is steeper than this (share of the vibration by share of the frequency) what
# counts is how far its curve is, not how far the motion at the same frequency.
STEEPEST = 100.0
# A harmonic is looked at where its forces alone cause this share of the vibration.
LOOKED_AT = 1e-6
# Share of its right-hand side that an iterative solver may leave: an estimate needs no more.
LINEAR_TOLERANCE = 1e-3


def resolution_error(problem: HarmonicBalance, solution: HarmonicSolution) -> ResolutionError:
    """Error of a motion of the ``problem`` by its harmonics and samples; 0 where nothing vibrates.

    Equations of more harmonics and twice the samples are evaluated twice, and solved once.
    """
    vibration = problem.vibration(solution.coefficients)
    if vibration == 0.0:
        return ResolutionError(0.0, 0.0, np.zeros(1), 0.0)
    richer = richer_problem(problem, solution)
    coefficients = richer.resolution.adopt(solution.coefficients, problem.resolution)
    at = richer.evaluate(coefficients.ravel(), solution.frequency, solution.force, "frequency")
    change, share, distance = _step(richer, at, solution.frequency, vibration)
    energy = _energy_error(richer, solution, coefficients.ravel() + change, share)
    by_harmonic, sampling = _causes(problem.resolution, richer, at)
    scale = max(distance, energy) / (float(np.hypot(np.linalg.norm(by_harmonic), sampling)) or 1.0)
    return ResolutionError(distance, energy, scale * by_harmonic, scale * sampling)


def richer_problem(problem: HarmonicBalance, solution: HarmonicSolution) -> HarmonicBalance:
    """The problem with what a motion leaves out: it has grown with all that were looked at before.

    Whoever takes an error that was estimated earlier lets it grow by this motion too.
    """
    return problem.richer(set(np.flatnonzero(solution.shares > LOOKED_AT).tolist()))


def _energy_error(
    richer: HarmonicBalance, solution: HarmonicSolution, unknowns: Array, share: float
) -> float:
    """Error of the joints' energy over all that is lost, by the motion nearest to a solution.

    That has these ``unknowns``, and a frequency that is larger by a ``share``.
    """
    frequency = solution.frequency * (1.0 + share)
    nearest = richer.evaluate(unknowns, frequency, solution.force, "frequency")
    dissipated = float(nearest.cycle.dissipated.sum())
    motion = richer.transfer.displacement(nearest.motion)
    damped = energy_damped(richer, motion, richer.resolution.harmonics, frequency)
    difference = abs(dissipated - float(solution.cycle.dissipated.sum()))
    return difference / (dissipated + damped) if difference > 0.0 else 0.0


def _step(
    richer: HarmonicBalance, at: Balance, frequency: float, vibration: float
) -> tuple[Array, float, float]:
    """The step ``(n,)`` [mm] to the nearest motion, the share of the frequency, and its size.

    Along the curve the unknowns u change by the slope with the frequency. Of all u' + slope s the
    one is taken with the least |u' + slope s|² + (STEEPEST s)², in shares.
    """
    sides = -np.stack([at.residual, frequency * at.slope], axis=1)
    change, slope = solve_alone(at.jacobian, sides, LINEAR_TOLERANCE).T
    moved, along = (richer.vibrating(rows) / vibration for rows in (change, slope))
    share = -float(moved @ along) / (float(along @ along) + STEEPEST**2)
    size = float(np.hypot(np.linalg.norm(moved + share * along), STEEPEST * share))
    return change + share * slope, share, size


def _causes(coarse: Resolution, richer: HarmonicBalance, at: Balance) -> tuple[Array, float]:
    """Norm of the residual of each harmonic left out, by its order, and of those that are not."""
    rows = richer.transfer.shaped(at.residual)
    sizes = np.zeros(richer.resolution.harmonics[-1] + 1)
    sizes[list(richer.resolution.harmonics)] = richer.resolution.sizes(rows)
    kept = list(coarse.harmonics)
    sampling = float(np.linalg.norm(sizes[kept]))
    sizes[kept] = 0.0
    return sizes, sampling
