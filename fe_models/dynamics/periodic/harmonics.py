"""Harmonics of a periodic motion: functions of time, and complex amplitudes.

Coefficients of a motion are ordered by joint, function of time and direction. The functions are 1
for harmonic 0, and cos kωt, sin kωt for each other harmonic k.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numba import njit

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array

ComplexArray = np.ndarray
"""Complex amplitudes."""


@lru_cache(maxsize=8)
def _waves(samples: int) -> tuple[Array, Array]:
    """Cosine and sine at equal times in a period."""
    turns = np.arange(samples) * (2.0 * np.pi / samples)
    return np.cos(turns), np.sin(turns)


def by_function(coefficients: Array) -> Array:
    """Coefficients ``(j, m, d)`` as ``(m, j d)``."""
    return coefficients.transpose(1, 0, 2).reshape(coefficients.shape[1], -1)


def by_joint(rows: Array, directions: int) -> Array:
    """The inverse of :func:`by_function`."""
    return np.ascontiguousarray(rows.reshape(len(rows), -1, directions).transpose(1, 0, 2))


class HarmonicBalanceError(InputError):
    """Harmonics, samples or forces that do not make a problem."""


@dataclass(frozen=True)
class Resolution:
    """``harmonics`` of the motion, ascending from 0 or above, and ``samples`` of a period.

    Raises :class:`HarmonicBalanceError` for harmonics out of order, or for fewer samples than show
    the highest of them: two per period of it, and one more.

    Examples
    --------
    Three harmonics and the mean are seven functions of time; weights bring samples back to them:

    >>> import numpy as np
    >>> from fe_models.dynamics import Resolution
    >>> resolution = Resolution(harmonics=(0, 1, 2, 3), samples=64)
    >>> print(resolution.size, np.allclose(resolution.weights @ resolution.basis, np.eye(7)))
    7 True
    """

    harmonics: tuple[int, ...]
    samples: int

    def __post_init__(self) -> None:
        given = tuple(
            checks.whole("a harmonic", order, HarmonicBalanceError) for order in self.harmonics
        )
        checks.settle(self, harmonics=given)
        checks.whole("samples", self.samples, HarmonicBalanceError)
        if not given or given[0] < 0 or list(given) != sorted(set(given)) or given[-1] == 0:
            raise HarmonicBalanceError(
                f"harmonics {given}: give them ascending, each once, from 0 or above, one above 0"
            )
        if self.samples <= 2 * given[-1]:
            raise HarmonicBalanceError(
                f"{self.samples} samples of a period cannot show harmonic {given[-1]}: give more "
                f"than {2 * given[-1]}, better ten times as many"
            )

    @property
    def size(self) -> int:
        """Functions of time m."""
        return 2 * len(self.harmonics) - (0 in self.harmonics)

    @cached_property
    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Function of time that is the cosine, and the sine, of each harmonic; -1 for no sine."""
        has_mean = int(0 in self.harmonics)
        cosine = 2 * np.arange(len(self.harmonics)) - has_mean
        cosine[0] = 0
        sine = cosine + 1
        if has_mean:
            sine[0] = -1
        return cosine, sine

    def functions(self, samples: int) -> Array:
        """The functions of time ``(t, m)`` at equal times in a period, from its beginning on."""
        return self.functions_at(np.arange(samples), samples)

    def functions_at(self, times: np.ndarray, samples: int) -> Array:
        """The same at some of these times alone, by their numbers ``(t,)``."""
        values = np.empty((len(times), self.size))
        at = np.outer(times, self.harmonics) % samples
        cosine, sine = self.places
        cosines, sines = _waves(samples)
        values[:, cosine] = cosines[at]
        values[:, sine[sine >= 0]] = sines[at[:, sine >= 0]]
        return values

    def functions_during(self, shares: Array) -> Array:
        """Return the motion at any ``shares`` ``(t,)`` of the period."""
        values = np.empty((len(shares), self.size))
        angles = 2.0 * np.pi * np.outer(shares, self.harmonics)
        cosine, sine = self.places
        values[:, cosine] = np.cos(angles)
        values[:, sine[sine >= 0]] = np.sin(angles[:, sine >= 0])
        return values

    @cached_property
    def basis(self) -> Array:
        return self.functions(self.samples)

    @cached_property
    def weights(self) -> Array:
        """From samples to coefficients ``(m, t)``."""
        weights = 2.0 / self.samples * self.basis.T
        if 0 in self.harmonics:
            weights[0] *= 0.5
        return np.ascontiguousarray(weights)

    @cached_property
    def lead(self) -> Array:
        """Joints are marched to the mean displacement first, then to that at the first time."""
        mean = np.eye(1, self.size) if 0 in self.harmonics else self.basis[:0]
        return np.vstack([mean, self.basis[:1]])

    def combined(self, rows: Array) -> ComplexArray:
        """Complex amplitudes ``(k, n)`` of coefficients ``(m, n)``: a cosine less i its sine."""
        cosine, sine = self.places
        has_mean = int(sine[0] < 0)
        amplitudes = np.empty((len(cosine), rows.shape[1]), dtype=complex)
        amplitudes.real = rows[cosine]
        amplitudes.imag[:has_mean] = 0.0
        np.negative(rows[sine[has_mean:]], out=amplitudes.imag[has_mean:])
        return amplitudes

    def separated(self, amplitudes: ComplexArray) -> Array:
        """The inverse of :meth:`combined`."""
        cosine, sine = self.places
        has_mean = int(sine[0] < 0)
        rows = np.empty((self.size, amplitudes.shape[1]))
        rows[cosine] = amplitudes.real
        rows[sine[has_mean:]] = -amplitudes.imag[has_mean:]
        return rows

    def amplitudes(self, coefficients: Array) -> ComplexArray:
        """Complex amplitudes ``(k, j d)`` of coefficients ``(j, m, d)``."""
        return self.combined(by_function(coefficients))

    def coefficients(self, amplitudes: ComplexArray, directions: int) -> Array:
        """The inverse of :meth:`amplitudes`."""
        return by_joint(self.separated(amplitudes), directions)

    def sizes(self, coefficients: Array) -> Array:
        """Norm ``(k,)`` of each harmonic of coefficients ``(j, m, d)``."""
        return _sizes(coefficients, *self.places)

    def adopt(self, coefficients: Array, other: Resolution) -> Array:
        """Coefficients ``(j, m, d)`` for these harmonics of those for others; 0 where it has none.

        Harmonics that only the other has are dropped.
        """
        adopted = np.zeros((len(coefficients), self.size, coefficients.shape[2]))
        for here, there in zip(self.places, other.places, strict=True):
            for place, harmonic in zip(here, self.harmonics, strict=True):
                if place >= 0 and harmonic in other.harmonics:
                    source = there[other.harmonics.index(harmonic)]
                    adopted[:, place] = coefficients[:, source]
        return adopted


@njit(cache=True)
def _sizes(coefficients: Array, cosines: np.ndarray, sines: np.ndarray) -> Array:
    """Norm ``(k,)`` of each harmonic; one without a sine is the mean."""
    sizes = np.zeros(len(cosines))
    for joint in range(len(coefficients)):
        for k in range(len(cosines)):
            for value in coefficients[joint, cosines[k]]:
                sizes[k] += value * value
            if sines[k] >= 0:
                for value in coefficients[joint, sines[k]]:
                    sizes[k] += value * value
    return np.sqrt(sizes)
