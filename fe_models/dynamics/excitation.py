"""Forces on a structure: constant, harmonic, a hammer's blow, a recorded signal, and their sums.

An excitation is called with times ``(t,)`` [s] and answers with forces ``(t, n)`` [N].
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from sa_solver.errors import InputError
from sa_solver.types import Array


class ExcitationError(InputError):
    """A signal that no force can have."""


@dataclass(frozen=True)
class ExcitationForce(ABC):
    """One signal in time along ``shape`` ``(n,)``, the forces per unit of it."""

    shape: Array

    def __call__(self, times: Array) -> Array:
        return np.multiply.outer(self.value(np.asarray(times, dtype=float)), self.shape)

    @abstractmethod
    def value(self, times: Array) -> Array:
        """The signal [N], of the shape of ``times``."""


@dataclass(frozen=True)
class ConstantForce(ExcitationForce):
    """A signal that is always 1: ``shape`` is the force [N]."""

    def value(self, times: Array) -> Array:
        return np.ones_like(times)


@dataclass(frozen=True)
class HarmonicForce(ExcitationForce):
    """``amplitude`` sin(2π ``frequency`` t + ``phase``) [N, Hz].

    With a ``ramp`` [s] it grows from zero at t = 0 as (1 - cos(π t / ramp)) / 2. Raises
    :class:`ExcitationError` for a frequency that is not above zero or a negative ramp.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0
    ramp: float = 0.0

    def __post_init__(self) -> None:
        if not (self.frequency > 0.0 and self.ramp >= 0.0):
            raise ExcitationError(
                f"frequency {self.frequency:g} Hz, ramp {self.ramp:g} s: give a frequency above 0 "
                "and a ramp of 0 or more"
            )

    def value(self, times: Array) -> Array:
        wave = self.amplitude * np.sin(2.0 * np.pi * self.frequency * times + self.phase)
        if self.ramp > 0.0:
            wave = wave * 0.5 * (1.0 - np.cos(np.pi * np.clip(times / self.ramp, 0.0, 1.0)))
        return np.asarray(wave)


@dataclass(frozen=True)
class HammerBlow(ExcitationForce):
    """Half a sine of height ``peak`` [N] from ``start`` on for ``duration`` [s].

    Raises :class:`ExcitationError` for a duration that is not above zero.
    """

    peak: float
    duration: float
    start: float = 0.0

    def __post_init__(self) -> None:
        if not self.duration > 0.0:
            raise ExcitationError(f"a blow of {self.duration:g} s: give a duration above 0")

    def value(self, times: Array) -> Array:
        share = (times - self.start) / self.duration
        touching = (share > 0.0) & (share < 1.0)
        return np.where(touching, self.peak * np.sin(np.pi * share), 0.0)


@dataclass(frozen=True)
class RecordedForce(ExcitationForce):
    """Samples ``force`` ``(s,)`` [N] at ``times`` ``(s,)`` [s]: linear between, constant beyond.

    Raises :class:`ExcitationError` for no or unequal samples, for values that are not finite, or
    for times that do not ascend.
    """

    times: Array
    force: Array

    def __post_init__(self) -> None:
        if not 0 < len(self.times) == len(self.force):
            raise ExcitationError(
                f"{len(self.times)} times and {len(self.force)} forces: give one or more, as many "
                "of both"
            )
        if not (np.isfinite(self.times).all() and np.isfinite(self.force).all()):
            raise ExcitationError("a recorded time or force is not a number: give finite ones")
        if np.any(np.diff(self.times) <= 0.0):
            raise ExcitationError("recorded times do not ascend: give each once, earliest first")

    def value(self, times: Array) -> Array:
        return np.asarray(np.interp(times, self.times, self.force))


@dataclass(frozen=True)
class CombinedForces:
    """The sum of one or more forces."""

    forces: tuple[ExcitationForce, ...]

    def __call__(self, times: Array) -> Array:
        return np.asarray(sum(force(times) for force in self.forces))
