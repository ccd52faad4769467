"""Energies of a periodic motion: what is lost, what moves, and the damping that this amounts to.

Over a period of a motion with the amplitudes x_k, in the sense of Re (...) exp(ikωt), the
structure's own damping takes π ω Σ k² x_kᴴ C x_k + π Σ k x_kᴴ D x_k; the joints say themselves
what they take.
With T the largest kinetic energy in the period, the equivalent damping ratio is

    ζ = (energy lost in the period) / (4π T),

which is that of an oscillator on a dashpot wherever its own resonance is driven: it then loses
π c ω a², and T is m ω² a² / 2. In a wave that travels round a ring the points of a sector do not
move together: there T is twice the mean kinetic energy of the sector, the same for an oscillator.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray
from sa_solver.types import Array

# Times per period of the highest harmonic at which the kinetic energy is looked at: it has twice
# that harmonic, and its largest maximum is then seen by a sample on either side.
TIMES_PER_PERIOD = 16
# Of the time of the largest kinetic energy, in shares of a step: the energy then is exact.
TIME_TOLERANCE = 1e-7


def energy_lost(problem: HarmonicBalance, solution: HarmonicSolution) -> float:
    """Energy that the joints and the damping of the structure take in a period [N mm].

    What joints take is summed along their path from sample to sample, so that its balance with the
    work of the forces is as good as the samples.
    """
    joints = float(np.sum(solution.cycle.dissipated))
    harmonics = solution.resolution.harmonics
    return joints + energy_damped(problem, solution.motion, harmonics, solution.frequency)


def work_done(problem: HarmonicBalance, solution: HarmonicSolution) -> float:
    """Work of the forces in a period [N mm], π Σ k Im(f_kᴴ x_k) but for its sign.

    That of a ground that moves by a given way is the work of what it does to the masses, on
    displacements relative to it. In balance it is the :func:`energy_lost`.
    """
    harmonics, angular = solution.resolution.harmonics, 2.0 * np.pi * solution.frequency
    load = problem.load
    forces = [(order, wave) for order, wave in load.waves.items()]
    forces += [(order, (angular * order) ** 2 * wave) for order, wave in load.inertial.items()]
    moved = (
        order * float(np.vdot(solution.motion[harmonics.index(order)], wave).imag)
        for order, wave in forces
    )
    return np.pi * solution.force * sum(moved)


def energy_damped(
    problem: HarmonicBalance, motion: ComplexArray, harmonics: Sequence[int], frequency: float
) -> float:
    """What the structure's own damping takes of a motion ``(k, n)`` in a period [N mm]."""
    orders = np.array(harmonics, dtype=float)
    damping, structural = problem.model.damping, problem.model.structural
    if problem.travels:
        models = [problem.receptance.of(harmonic).model for harmonic in harmonics]
        damping = np.array([model.damping for model in models])
        if structural is not None:
            structural = np.array([model.structural for model in models])
    viscous = 2.0 * np.pi**2 * frequency * float(orders**2 @ _taken(motion, damping))
    if structural is None:
        return viscous
    return viscous + np.pi * float(orders @ _taken(motion, structural))


def largest_kinetic_energy(problem: HarmonicBalance, solution: HarmonicSolution) -> float:
    """Largest kinetic energy in the period, in a wave twice the mean one [N mm]."""
    orders, mass = np.array(solution.resolution.harmonics), problem.model.mass
    if problem.travels:
        models = (problem.receptance.of(h).model for h in solution.resolution.harmonics)
        moved = _taken(solution.motion, np.array([model.mass for model in models]))
        return float(0.5 * (2.0 * np.pi * solution.frequency * orders) ** 2 @ moved)
    rates = 2j * np.pi * solution.frequency * orders[:, None] * solution.motion
    # Of the turn τ energy is a series in twice the harmonics, from their sums and differences.
    moved, apart = _times(rates, mass), orders[:, None] - orders
    crossed = moved @ rates.conj().T
    series = np.zeros(2 * int(orders[-1]) + 1, complex)
    np.add.at(series, orders[:, None] + orders, moved @ rates.T)
    np.add.at(series, np.abs(apart), np.where(apart < 0, crossed.conj(), crossed))
    turns = 2j * np.pi * np.arange(len(series))

    def energy(turn: float) -> float:
        return float(0.25 * (series @ np.exp(turn * turns)).real)

    times = TIMES_PER_PERIOD * int(orders[-1])
    best = int(np.argmax(np.fft.ifft(series, times).real))
    peak = minimize_scalar(
        lambda step: -energy((best + step) / times),
        bounds=(-1.0, 1.0),
        method="bounded",
        options={"xatol": TIME_TOLERANCE},
    )
    return max(energy(best / times), -float(peak.fun))


def damping_ratio(problem: HarmonicBalance, solution: HarmonicSolution) -> float:
    """Equivalent damping ratio ζ of a motion; 0 where nothing moves."""
    kinetic = largest_kinetic_energy(problem, solution)
    lost = energy_lost(problem, solution)
    return lost / (4.0 * np.pi * kinetic) if kinetic > 0.0 else 0.0


def _taken(motion: ComplexArray, damping: Array) -> Array:
    """xᴴ C x ``(k,)`` of the harmonics of a motion, with one C or that of each ``(k, n, n)``."""
    if damping.ndim == 3:
        return np.asarray(np.einsum("km,kmn,kn->k", motion.conj(), damping, motion).real)
    return np.asarray((motion.conj() * _times(motion, damping)).real.sum(axis=1))


def _times(motion: ComplexArray, matrix: Array) -> ComplexArray:
    """Rows ``(k, n)`` times a symmetric matrix, which is not made complex for that."""
    return motion.real @ matrix + 1j * (motion.imag @ matrix)
