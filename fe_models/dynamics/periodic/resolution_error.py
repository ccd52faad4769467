"""Estimate of how much more harmonics and samples would change a periodic motion.

The equations of a richer resolution are evaluated at the motion, and one step of Newton's method
leads towards their solution. The step accounts for the effect of neglected harmonics on those that
are kept, which near a resonance is many times their own size, and for corners of the forces between
samples.

Near a fold of a response, there may be no motion at the same frequency. Therefore the step leads to
the nearest motion on the richer curve: its frequency may differ, but a difference counts as an
error.
"""

from __future__ import annotations

import numpy as np

from fe_models.dynamics.curves.bordered import solve_alone
from fe_models.dynamics.periodic.cycle_energy import energy_damped
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution, ResolutionError
from fe_models.dynamics.periodic.harmonics import Resolution
from sa_solver.types import Array

# Where a response is steeper than this (relative change of the vibration over relative change of
# the frequency), the distance between the curves counts, not that between motions of one frequency.
STEEPEST_RESPONSE = 100.0
# A harmonic is examined if its forces alone cause this share of the vibration.
EXAMINED_SHARE = 1e-6
# Relative residual of the iterative linear solver: an estimate needs no more.
LINEAR_TOLERANCE = 1e-3


def resolution_error(problem: HarmonicBalance, solution: HarmonicSolution) -> ResolutionError:
    """Return the error of a motion due to its harmonics and samples; 0 if nothing vibrates.

    The equations with more harmonics and twice the samples are evaluated twice, and solved once.
    """
    vibration = problem.vibration(solution.coefficients)
    if vibration == 0.0:
        return ResolutionError(0.0, 0.0, np.zeros(1), 0.0)
    extended = extended_problem(problem, solution)
    coefficients = extended.resolution.adopt(solution.coefficients, problem.resolution)
    at = extended.evaluate(coefficients.ravel(), solution.frequency, solution.force, "frequency")
    change, share, distance = _step_to_nearest(extended, at, solution.frequency, vibration)
    energy = _energy_error(extended, solution, coefficients.ravel() + change, share)
    by_harmonic, sampling = _contributions(problem.resolution, extended, at)
    scale = max(distance, energy) / (float(np.hypot(np.linalg.norm(by_harmonic), sampling)) or 1.0)
    return ResolutionError(distance, energy, scale * by_harmonic, scale * sampling)


def extended_problem(problem: HarmonicBalance, solution: HarmonicSolution) -> HarmonicBalance:
    """Return the problem with the harmonics that a motion neglects.

    It also has the harmonics that earlier motions of the same problem neglected. A caller that uses
    a stored error must call this function for its motion too, so that later results are the same.
    """
    return problem.with_harmonics(set(np.flatnonzero(solution.shares > EXAMINED_SHARE).tolist()))


def _energy_error(
    extended: HarmonicBalance, solution: HarmonicSolution, unknowns: Array, share: float
) -> float:
    """Return the error of the joints' energy over all energy lost, from the nearest motion.

    That motion has the given ``unknowns``, and a frequency larger by the factor 1 + ``share``.
    """
    frequency = solution.frequency * (1.0 + share)
    nearest = extended.evaluate(unknowns, frequency, solution.force, "frequency")
    dissipated = float(nearest.cycle.dissipated.sum())
    motion = extended.transfer.displacement(nearest.motion)
    damped = energy_damped(extended, motion, extended.resolution.harmonics, frequency)
    difference = abs(dissipated - float(solution.cycle.dissipated.sum()))
    return difference / (dissipated + damped) if difference > 0.0 else 0.0


def _step_to_nearest(
    extended: HarmonicBalance, at: Balance, frequency: float, vibration: float
) -> tuple[Array, float, float]:
    """Return the step ``(n,)`` [mm] to the nearest motion, its relative frequency, and its size.

    Let Δu be the step of Newton's method at the given frequency, u' the slope of the curve, and s a
    relative change of the frequency. Among all steps Δu + s u', the one with the least |Δu + s u'|²
    + (STEEPEST_RESPONSE s)² is taken, in relative quantities.
    """
    sides = -np.stack([at.residual, frequency * at.slope], axis=1)
    change, slope = solve_alone(at.jacobian, sides, LINEAR_TOLERANCE).T
    by_residual, by_slope = (extended.without_mean(rows) / vibration for rows in (change, slope))
    share = -float(by_residual @ by_slope) / (float(by_slope @ by_slope) + STEEPEST_RESPONSE**2)
    size = float(
        np.hypot(np.linalg.norm(by_residual + share * by_slope), STEEPEST_RESPONSE * share)
    )
    return change + share * slope, share, size


def _contributions(
    coarse: Resolution, extended: HarmonicBalance, at: Balance
) -> tuple[Array, float]:
    """Return the residual norm of each neglected harmonic, and that of all kept harmonics."""
    rows = extended.transfer.shaped(at.residual)
    sizes = np.zeros(extended.resolution.harmonics[-1] + 1)
    sizes[list(extended.resolution.harmonics)] = extended.resolution.sizes(rows)
    kept = list(coarse.harmonics)
    sampling = float(np.linalg.norm(sizes[kept]))
    sizes[kept] = 0.0
    return sizes, sampling
