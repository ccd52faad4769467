"""Fourier series of a periodic motion: functions of time, real coefficients, complex amplitudes.

Coefficients of a motion are ordered by joint, function of time and direction. The functions of time
are 1 for harmonic 0, and cos kωt, sin kωt for every other harmonic k.
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
"""Array of complex amplitudes."""


@lru_cache(maxsize=8)
def _waves(samples: int) -> tuple[Array, Array]:
    """Return cosine and sine at equally spaced times of a period."""
    turns = np.arange(samples) * (2.0 * np.pi / samples)
    return np.cos(turns), np.sin(turns)


def by_function(coefficients: Array) -> Array:
    """Return coefficients ``(j, m, d)`` as rows ``(m, j d)``, one per function of time."""
    return coefficients.transpose(1, 0, 2).reshape(coefficients.shape[1], -1)


def by_joint(rows: Array, directions: int) -> Array:
    """Return rows ``(m, j d)`` as coefficients ``(j, m, d)``; inverse of :func:`by_function`."""
    return np.ascontiguousarray(rows.reshape(len(rows), -1, directions).transpose(1, 0, 2))


class HarmonicBalanceError(InputError):
    """Error in the harmonics, samples, forces or frequencies of a harmonic-balance problem."""


@dataclass(frozen=True)
class Resolution:
    """Harmonics of a motion and number of samples of a period.

    Parameters
    ----------
    harmonics
        Numbers of the harmonics, ascending, from 0 or above.
    samples
        Number of equally spaced samples of a period: more than two per period of the highest
        harmonic.

    Raises
    ------
    HarmonicBalanceError
        If the harmonics do not ascend, or if the samples cannot show the highest of them.

    Examples
    --------
    Three harmonics and the mean make seven functions of time. The weights recover their
    coefficients from samples:

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
                f"harmonics {given} are not possible: give them ascending, each once, from 0 or "
                "above, and at least one above 0"
            )
        if self.samples <= 2 * given[-1]:
            raise HarmonicBalanceError(
                f"{self.samples} samples of a period cannot show harmonic {given[-1]}: give more "
                f"than {2 * given[-1]}, better ten times as many"
            )

    @property
    def size(self) -> int:
        """Number m of functions of time."""
        return 2 * len(self.harmonics) - (0 in self.harmonics)

    @cached_property
    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Indices of the cosine and the sine of each harmonic among the functions of time.

        The index of the sine is -1 for harmonic 0, which has none.
        """
        has_mean = int(0 in self.harmonics)
        cosine = 2 * np.arange(len(self.harmonics)) - has_mean
        cosine[0] = 0
        sine = cosine + 1
        if has_mean:
            sine[0] = -1
        return cosine, sine

    def functions(self, samples: int) -> Array:
        """Return the functions of time ``(t, m)`` at equally spaced times of a period."""
        return self.functions_at(np.arange(samples), samples)

    def functions_at(self, times: np.ndarray, samples: int) -> Array:
        """Return the functions of time ``(t, m)`` at some of ``samples`` equally spaced times.

        ``times`` ``(t,)`` are the indices of these times.
        """
        values = np.empty((len(times), self.size))
        at = np.outer(times, self.harmonics) % samples
        cosine, sine = self.places
        cosines, sines = _waves(samples)
        values[:, cosine] = cosines[at]
        values[:, sine[sine >= 0]] = sines[at[:, sine >= 0]]
        return values

    def functions_at_shares(self, shares: Array) -> Array:
        """Return the functions of time ``(t, m)`` at any ``shares`` ``(t,)`` of the period."""
        values = np.empty((len(shares), self.size))
        angles = 2.0 * np.pi * np.outer(shares, self.harmonics)
        cosine, sine = self.places
        values[:, cosine] = np.cos(angles)
        values[:, sine[sine >= 0]] = np.sin(angles[:, sine >= 0])
        return values

    @cached_property
    def basis(self) -> Array:
        """Functions of time ``(t, m)`` at the samples."""
        return self.functions(self.samples)

    @cached_property
    def weights(self) -> Array:
        """Matrix ``(m, t)`` that maps samples to coefficients."""
        weights = 2.0 / self.samples * self.basis.T
        if 0 in self.harmonics:
            weights[0] *= 0.5
        return np.ascontiguousarray(weights)

    @cached_property
    def lead(self) -> Array:
        """Points ``(p, m)`` that joints pass from rest to the first sample: mean, then sample."""
        mean = np.eye(1, self.size) if 0 in self.harmonics else self.basis[:0]
        return np.vstack([mean, self.basis[:1]])

    def complex_from_real(self, rows: Array) -> ComplexArray:
        """Return complex amplitudes ``(k, n)`` for coefficients ``(m, n)``: cosine less i sine."""
        cosine, sine = self.places
        has_mean = int(sine[0] < 0)
        amplitudes = np.empty((len(cosine), rows.shape[1]), dtype=complex)
        amplitudes.real = rows[cosine]
        amplitudes.imag[:has_mean] = 0.0
        np.negative(rows[sine[has_mean:]], out=amplitudes.imag[has_mean:])
        return amplitudes

    def real_from_complex(self, amplitudes: ComplexArray) -> Array:
        """Return coefficients ``(m, n)``: the inverse of :meth:`complex_from_real`."""
        cosine, sine = self.places
        has_mean = int(sine[0] < 0)
        rows = np.empty((self.size, amplitudes.shape[1]))
        rows[cosine] = amplitudes.real
        rows[sine[has_mean:]] = -amplitudes.imag[has_mean:]
        return rows

    def amplitudes(self, coefficients: Array) -> ComplexArray:
        """Return complex amplitudes ``(k, j d)`` of coefficients ``(j, m, d)``."""
        return self.complex_from_real(by_function(coefficients))

    def coefficients(self, amplitudes: ComplexArray, directions: int) -> Array:
        """Return coefficients ``(j, m, d)``: the inverse of :meth:`amplitudes`."""
        return by_joint(self.real_from_complex(amplitudes), directions)

    def sizes(self, coefficients: Array) -> Array:
        """Return the norm ``(k,)`` of each harmonic of coefficients ``(j, m, d)``."""
        return _sizes(coefficients, *self.places)

    def adopt(self, coefficients: Array, other: Resolution) -> Array:
        """Return the coefficients ``(j, m, d)`` of another resolution in terms of this one.

        Harmonics that only the other resolution has are dropped; those that it lacks are 0.
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
    """Return the norm ``(k,)`` of each harmonic; a harmonic without a sine is the mean."""
    sizes = np.zeros(len(cosines))
    for joint in range(len(coefficients)):
        for k in range(len(cosines)):
            for value in coefficients[joint, cosines[k]]:
                sizes[k] += value * value
            if sines[k] >= 0:
                for value in coefficients[joint, sines[k]]:
                    sizes[k] += value * value
    return np.sqrt(sizes)
