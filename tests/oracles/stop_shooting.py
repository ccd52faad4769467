"""Periodic motions of a structure on an elastic stop by shooting, exact from contact to contact.

Between contacts the structure is linear, and so is the load's oscillator: both are moved by matrix
exponentials. Contacts are located to rounding. As the force of a stop is continuous, the monodromy
matrix is the product of the exponentials.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.linalg as sl
from scipy.optimize import brentq

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from sa_solver.types import Array

STEPS, MOST_SHOTS = 512, 12


class Shot(NamedTuple):
    """Multipliers by size, and the relative distance of the start from that of harmonic balance."""

    multipliers: Array
    distance: float


def shoot(problem: HarmonicBalance, motion: HarmonicSolution, steps: int = STEPS) -> Shot | None:
    """Return the motion near one with a single joint and load harmonic, or None.

    A contact is detected at the end of one of the ``steps``.
    """
    model, law = problem.model, problem.joints.law
    size, omega = len(model.mass), 2.0 * np.pi * motion.frequency
    row = model.connection[0]
    ((order, wave),) = problem.load.waves.items()
    wave, gap = motion.force * np.asarray(wave, complex), float(law.gap)
    rates = []
    for side in (0.0, 1.0):
        pressed = side * float(law.stiffness)
        a = np.zeros((2 * size + 3, 2 * size + 3))
        a[:size, size : 2 * size] = np.eye(size)
        a[size : 2 * size] = np.linalg.solve(
            model.mass,
            np.column_stack(
                [
                    -model.stiffness - pressed * np.outer(row, row),
                    *(-model.damping, wave.real, -wave.imag, pressed * gap * row),
                ]
            ),
        )
        a[2 * size, 2 * size + 1], a[2 * size + 1, 2 * size] = -order * omega, order * omega
        rates.append(a)
    step = 1.0 / (motion.frequency * steps)
    whole = [sl.expm(step * a) for a in rates]
    seen = np.append(row, np.zeros(size + 3))

    def period(start: Array) -> tuple[Array, Array]:
        y, forward = np.concatenate([start, [1.0, 0.0, 1.0]]), np.eye(2 * size + 3)
        for _ in range(steps):
            left = step
            while left > 0.0:
                side = int(seen @ y > gap or (seen @ y == gap and seen @ rates[0] @ y > 0.0))
                a, part = rates[side], whole[side] if left == step else sl.expm(left * rates[side])
                passed = (seen @ part @ y - gap) * (1.0 if side else -1.0) < 0.0
                time = left
                if passed:
                    time = brentq(
                        lambda t, a=a, y=y: seen @ sl.expm(t * a) @ y - gap, 0.0, left, xtol=1e-15
                    )
                    time = min(time + 1e-13 * step, left)
                    part = sl.expm(time * a)
                y, forward, left = part @ y, part @ forward, left - time
        return y[: 2 * size], forward[: 2 * size, : 2 * size]

    begin = np.concatenate([motion.displacement(1)[0], motion.velocity(1)[0]])
    start = begin.copy()
    for _ in range(MOST_SHOTS):
        end, matrix = period(start)
        if np.linalg.norm(end - start) < 1e-9 * np.linalg.norm(start):
            multipliers = np.linalg.eigvals(matrix)
            order_of = np.argsort(-np.abs(multipliers), kind="stable")
            away = np.linalg.norm(start - begin) / np.linalg.norm(start)
            return Shot(multipliers[order_of], float(away))
        start = start + np.linalg.solve(np.eye(2 * size) - matrix, end - start)
    return None
