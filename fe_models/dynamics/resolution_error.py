"""How far a periodic motion is from what more harmonics and samples would make of it.

The equations of a richer resolution are evaluated at the motion, and one step of Newton's method
leads to theirs. It answers for what harmonics left out do to those that are kept, near a resonance
many times what they are themselves, and for corners between samples.

Near a fold of a response there may be no motion at the same frequency: there the motion nearest on
the richer curve is looked for, whose frequency may differ, at a price.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.bordered import solve_alone
from fe_models.dynamics.cycle_energy import energy_lost
from fe_models.dynamics.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.harmonic_solution import HarmonicSolution
from fe_models.dynamics.harmonics import Resolution
from sa_solver.types import Array

# Samples per period of the highest harmonic, at least: a corner of a joint's force is then seen.
SAMPLES_PER_PERIOD = 8
# Where a response is steeper than this (share of the vibration by share of the frequency) what
# counts is how far its curve is, not how far the motion at the same frequency.
STEEPEST = 100.0
# A harmonic is looked at where its forces alone cause this share of the vibration.
LOOKED_AT = 1e-6
# Share of its right-hand side that an iterative solver may leave: an estimate needs no more.
LINEAR_TOLERANCE = 1e-3


@dataclass(frozen=True)
class ResolutionError:
    """By how much a richer resolution would change a motion, to first order.

    ``vibration`` of the joints, as a share of itself, and ``energy`` that the joints take in a
    cycle, as a share of all that is lost. ``harmonics`` ``(k + 1,)`` is the part of the larger of
    them that each harmonic 0, 1, 2, ... left out has, and ``sampling`` that of the samples.
    """

    vibration: float
    energy: float
    harmonics: Array
    sampling: float

    @property
    def largest(self) -> float:
        """The larger of the two."""
        return max(self.vibration, self.energy)


def resolution_error(problem: HarmonicBalance, solution: HarmonicSolution) -> ResolutionError:
    """Error of a motion of the ``problem`` by its harmonics and samples; 0 where nothing vibrates.

    Equations of more harmonics and twice the samples are evaluated twice, and solved once.
    """
    vibration = problem.vibration(solution.coefficients)
    if vibration == 0.0:
        return ResolutionError(0.0, 0.0, np.zeros(1), 0.0)
    richer = _richer(problem, solution)
    coefficients = richer.resolution.adopt(solution.coefficients, problem.resolution)
    at = richer.evaluate(coefficients.ravel(), solution.frequency, solution.force, "frequency")
    change, share, distance = _step(richer, at, solution.frequency, vibration)
    frequency = solution.frequency * (1.0 + share)
    unknowns = coefficients.ravel() + change
    beside = richer.evaluate(unknowns, frequency, solution.force, "frequency")
    motion = richer.describe(unknowns, beside, frequency, solution.force)
    lost = energy_lost(richer, motion)
    difference = float(motion.cycle.dissipated.sum() - solution.cycle.dissipated.sum())
    energy = abs(difference) / lost if lost > 0.0 else 0.0
    by_harmonic, sampling = _causes(problem.resolution, richer, at)
    scale = max(distance, energy) / (float(np.hypot(np.linalg.norm(by_harmonic), sampling)) or 1.0)
    return ResolutionError(distance, energy, scale * by_harmonic, scale * sampling)


def _richer(problem: HarmonicBalance, solution: HarmonicSolution) -> HarmonicBalance:
    """The problem with all harmonics whose forces are seen, and twice the samples."""
    shares = problem.left_out(solution.coefficients, solution.cycle, solution.frequency)
    seen = np.flatnonzero(shares > LOOKED_AT).tolist()
    harmonics = tuple(sorted({*problem.resolution.harmonics, *seen}))
    samples = 2 * problem.resolution.samples
    while samples < SAMPLES_PER_PERIOD * harmonics[-1]:
        samples *= 2
    return problem.refined(Resolution(harmonics, samples))


def _step(
    richer: HarmonicBalance, at: Balance, frequency: float, vibration: float
) -> tuple[Array, float, float]:
    """The step ``(n,)`` [mm] to the nearest motion, the share of the frequency, and its size.

    Along the curve the unknowns u change by the slope with the frequency. Of all u' + slope s the
    one is taken with the least |u' + slope s|² + (STEEPEST s)², in shares.
    """
    change = solve_alone(at.jacobian, -at.residual, LINEAR_TOLERANCE)
    slope = solve_alone(at.jacobian, -frequency * at.slope, LINEAR_TOLERANCE)
    moved, along = (richer.vibrating(rows) / vibration for rows in (change, slope))
    share = -float(moved @ along) / (float(along @ along) + STEEPEST**2)
    size = float(np.hypot(np.linalg.norm(moved + share * along), STEEPEST * share))
    return change + share * slope, share, size


def _causes(coarse: Resolution, richer: HarmonicBalance, at: Balance) -> tuple[Array, float]:
    """Norm of the residual of each harmonic left out, by its order, and of those that are not."""
    rows = richer.transfer.shaped(at.residual)
    norms = np.linalg.norm(rows, axis=(0, 2))
    cosine, sine = richer.resolution.places
    sizes = np.zeros(richer.resolution.harmonics[-1] + 1)
    both = np.hypot(norms[cosine], np.where(sine < 0, 0.0, norms[sine]))
    sizes[list(richer.resolution.harmonics)] = both
    kept = list(coarse.harmonics)
    sampling = float(np.linalg.norm(sizes[kept]))
    sizes[kept] = 0.0
    return sizes, sampling
