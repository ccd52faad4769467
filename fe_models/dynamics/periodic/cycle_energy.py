"""Energies of a periodic motion: energy lost per period, kinetic energy, equivalent damping.

Let x_k be the complex amplitudes of a motion, Re Σ x_k exp(ikωt). Per period, the damping of the
structure dissipates π ω Σ k² x_kᴴ C x_k + π Σ k x_kᴴ D x_k. The joint law reports what the joints
dissipate. With T the largest kinetic energy in the period, the equivalent damping ratio is

    ζ = (energy lost in the period) / (4π T).

For an oscillator on a dashpot that is driven at its own resonance, this is its damping ratio: it
loses π c ω a² per period, and T is m ω² a² / 2. In a wave that travels round a ring, the points of
a sector do not move in phase. There T is twice the mean kinetic energy of the sector, which is the
same for an oscillator.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray
from sa_solver.types import Array

# Times per period of the highest harmonic at which the kinetic energy is sampled. It contains twice
# that harmonic, so that its largest maximum then lies between two neighbours of a sample.
TIMES_PER_PERIOD = 16
# Tolerance of the time of the largest kinetic energy, in sampling steps: the energy is then exact.
TIME_TOLERANCE = 1e-7


def energy_lost(problem: HarmonicBalance, solution: HarmonicSolution) -> float:
    """Return the energy [N mm] that the joints and the structure's damping dissipate per period.

    The part of the joints is summed along their path from sample to sample. Its balance with the
    work of the forces is therefore as accurate as the samples.
    """
    joints = float(np.sum(solution.cycle.dissipated))
    harmonics = solution.resolution.harmonics
    return joints + energy_damped(problem, solution.motion, harmonics, solution.frequency)


def work_done(problem: HarmonicBalance, solution: HarmonicSolution) -> float:
    """Return the work of the forces per period [N mm]: π Σ k Im(x_kᴴ f_k).

    If the ground moves in a given way, this is the work of its inertia forces on displacements
    relative to the ground. For a solution it equals :func:`energy_lost`.
    """
    harmonics, angular = solution.resolution.harmonics, 2.0 * np.pi * solution.frequency
    load = problem.load
    forces = [(order, wave) for order, wave in load.waves.items()]
    forces += [(order, (angular * order) ** 2 * wave) for order, wave in load.inertial.items()]
    works = (
        order * float(np.vdot(solution.motion[harmonics.index(order)], wave).imag)
        for order, wave in forces
    )
    return np.pi * solution.force * sum(works)


def energy_damped(
    problem: HarmonicBalance, motion: ComplexArray, harmonics: Sequence[int], frequency: float
) -> float:
    """Return the energy [N mm] that the structure's own damping dissipates per period.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    motion
        Complex amplitudes ``(k, n)`` of the motion [mm].
    harmonics
        Numbers ``(k,)`` of the harmonics.
    frequency
        Frequency [Hz].
    """
    orders = np.array(harmonics, dtype=float)
    damping, structural = problem.model.damping, problem.model.structural
    if problem.is_travelling_wave:
        models = [problem.receptance.of(harmonic).model for harmonic in harmonics]
        damping = np.array([model.damping for model in models])
        if structural is not None:
            structural = np.array([model.structural for model in models])
    viscous = 2.0 * np.pi**2 * frequency * float(orders**2 @ _quadratic_form(motion, damping))
    if structural is None:
        return viscous
    return viscous + np.pi * float(orders @ _quadratic_form(motion, structural))


def largest_kinetic_energy(problem: HarmonicBalance, solution: HarmonicSolution) -> float:
    """Return the largest kinetic energy in a period; in a wave, twice the mean one [N mm]."""
    orders, mass = np.array(solution.resolution.harmonics), problem.model.mass
    if problem.is_travelling_wave:
        models = (problem.receptance.of(h).model for h in solution.resolution.harmonics)
        products = _quadratic_form(solution.motion, np.array([model.mass for model in models]))
        return float(0.5 * (2.0 * np.pi * solution.frequency * orders) ** 2 @ products)
    rates = 2j * np.pi * solution.frequency * orders[:, None] * solution.motion
    # As a function of the time τ in periods, the kinetic energy is a series in twice the harmonics,
    # from their sums and differences.
    products, differences = _times_symmetric(rates, mass), orders[:, None] - orders
    cross_products = products @ rates.conj().T
    series = np.zeros(2 * int(orders[-1]) + 1, complex)
    np.add.at(series, orders[:, None] + orders, products @ rates.T)
    np.add.at(
        series,
        np.abs(differences),
        np.where(differences < 0, cross_products.conj(), cross_products),
    )
    turns = 2j * np.pi * np.arange(len(series))

    def energy(turn: float) -> float:
        return float(0.25 * (series @ np.exp(turn * turns)).real)

    times = TIMES_PER_PERIOD * int(orders[-1])
    first_guess = int(np.argmax(np.fft.ifft(series, times).real))
    peak = minimize_scalar(
        lambda step: -energy((first_guess + step) / times),
        bounds=(-1.0, 1.0),
        method="bounded",
        options={"xatol": TIME_TOLERANCE},
    )
    return max(energy(first_guess / times), -float(peak.fun))


def damping_ratio(problem: HarmonicBalance, solution: HarmonicSolution) -> float:
    """Return the equivalent damping ratio ζ of a motion; 0 if nothing moves."""
    kinetic = largest_kinetic_energy(problem, solution)
    loss = energy_lost(problem, solution)
    return loss / (4.0 * np.pi * kinetic) if kinetic > 0.0 else 0.0


def _quadratic_form(motion: ComplexArray, damping: Array) -> Array:
    """Return xᴴ C x ``(k,)`` for each harmonic, with one C or one for each ``(k, n, n)``."""
    if damping.ndim == 3:
        return np.asarray(np.einsum("km,kmn,kn->k", motion.conj(), damping, motion).real)
    return np.asarray((motion.conj() * _times_symmetric(motion, damping)).real.sum(axis=1))


def _times_symmetric(motion: ComplexArray, matrix: Array) -> ComplexArray:
    """Return rows ``(k, n)`` times a symmetric real matrix, without converting it to complex."""
    return motion.real @ matrix + 1j * (motion.imag @ matrix)
