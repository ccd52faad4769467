"""Linear structure under lines and harmonics, integrated exactly by exponentials: y' = A y.

    y = (x, v, c, w)

holds displacements and velocities ``(n,)``, constant joint forces c ``(j,)``, and the state w of
each force: the value and the slope of its line, then the sine and the cosine of each of its waves.
Energies are integrals of quadratic forms in y and are given by exponentials too
(Van Loan 1978, IEEE Transactions on Automatic Control 23, 395).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.linalg as sl

from fe_models.dynamics.model import DynamicModel
from sa_solver.types import Array
from tests.oracles.signals import Signal


@dataclass(frozen=True)
class Layout:
    """Positions in y of ``size`` displacements, ``joints`` and forces.

    ``waves`` are the angular frequencies [rad/s] of each force.
    """

    size: int
    joints: int
    waves: tuple[tuple[float, ...], ...]

    @property
    def displacement(self) -> slice:
        return slice(0, self.size)

    @property
    def velocity(self) -> slice:
        return slice(self.size, 2 * self.size)

    @property
    def constant(self) -> slice:
        return slice(2 * self.size, 2 * self.size + self.joints)

    @property
    def forces(self) -> list[slice]:
        """Slices of y, one for each force."""
        return [slice(first, last) for first, last in pairwise(self._ends)]

    @property
    def total(self) -> int:
        return self._ends[-1]

    @property
    def _ends(self) -> list[int]:
        ends = [2 * self.size + self.joints]
        for waves in self.waves:
            ends.append(ends[-1] + 2 + 2 * len(waves))
        return ends


class LinearFlow:
    """System of one layout, with springs ``held`` ``(j,)`` [N/mm] in place of the joints.

    ``shapes`` ``(n,)`` are those of the forces.
    """

    def __init__(
        self, model: DynamicModel, held: Array, shapes: Sequence[Array], layout: Layout
    ) -> None:
        loads = np.zeros((layout.size, layout.total))
        self._generator = np.zeros((layout.total, layout.total))
        for place, waves, shape in zip(layout.forces, layout.waves, shapes, strict=True):
            # A value, not its slope, and sines, not cosines, are forces.
            loads[:, place.start : place.stop : 2] = shape[:, None]
            self._generator[place.start, place.start + 1] = 1.0
            for sine, angular in zip(range(place.start + 2, place.stop, 2), waves, strict=True):
                self._generator[sine, sine + 1] = angular
                self._generator[sine + 1, sine] = -angular
        x, v, c = layout.displacement, layout.velocity, layout.constant
        balance = loads.copy()
        balance[:, x] -= model.stiffness + (model.connection.T * held) @ model.connection
        balance[:, v] -= model.damping
        balance[:, c] -= model.connection.T
        self._generator[x, v] = np.eye(layout.size)
        self._generator[v] = np.linalg.solve(model.mass, balance)
        powers = np.zeros((2, layout.total, layout.total))
        powers[0, v], powers[1, v, v] = loads, model.damping
        self._powers = 0.5 * (powers + powers.transpose(0, 2, 1))
        self._known: dict[float, tuple[Array, Array]] = {}

    def rate(self, y: Array) -> Array:
        """Return A y."""
        return np.asarray(self._generator @ y)

    def after(self, time: float, y: Array) -> Array:
        """Return y after a time [s]."""
        return np.asarray(sl.expm(self._generator * time) @ y)

    def over(self, time: float, *, known: bool = False) -> tuple[Array, Array]:
        """Return exp(A t), and the forms ``(2, N, N)`` of the energy supplied and damped meanwhile.

        They are stored if the time will be needed again: ``known``.
        """
        if time in self._known:
            return self._known[time]
        n = len(self._generator)
        # The powers couple exp(-Aᵀ t) above to exp(A t) below: their products are the integrals.
        blocks = np.kron(np.diag([1.0, 1.0, 0.0]), -self._generator.T)
        blocks[: 2 * n, 2 * n :] = self._powers.reshape(2 * n, n)
        blocks[2 * n :, 2 * n :] = self._generator
        grown = sl.expm(blocks * time)[:, 2 * n :].reshape(3, n, n)
        operators = grown[2], grown[2].T @ grown[:2]
        if known:
            self._known[time] = operators
        return operators


def unknowns(layout: Layout, motion: Array, signals: Sequence[Signal], time: float) -> Array:
    """Return y ``(N,)`` of a ``motion`` ``(2 n,)`` at a time, without constant joint forces."""
    y = np.zeros(layout.total)
    y[: len(motion)] = motion
    for place, signal in zip(layout.forces, signals, strict=True):
        values = [signal.value + signal.slope * (time - signal.origin), signal.slope]
        for wave in signal.waves:
            angle = wave.angular * time + wave.phase
            values += [wave.amplitude * np.sin(angle), wave.amplitude * np.cos(angle)]
        y[place] = values
    return y
