"""Forces on a structure: constant, harmonic, a hammer's blow, a recorded signal, and their sums.

An excitation is called with times ``(t,)`` [s] and answers with forces ``(t, n)`` [N]. Every one
of them is, between its :attr:`breaks`, a straight line and harmonics, which the event-driven
integrator follows exactly.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sa_solver.errors import InputError
from sa_solver.types import Array

Excitation = Callable[[Array], Array]


class ExcitationError(InputError):
    """A signal that no force can have."""


@dataclass(frozen=True)
class Wave:
    """``amplitude`` sin(``angular`` t + ``phase``), with the angular frequency in rad/s."""

    amplitude: float
    angular: float
    phase: float


@dataclass(frozen=True)
class Signal:
    """A smooth stretch: ``value`` + ``slope`` (t - ``origin``) [N] and waves."""

    origin: float = 0.0
    value: float = 0.0
    slope: float = 0.0
    waves: tuple[Wave, ...] = ()


@dataclass(frozen=True)
class Force(ABC):
    """One signal in time along ``shape`` ``(n,)``, the forces per unit of it."""

    shape: Array

    def __call__(self, times: Array) -> Array:
        return np.multiply.outer(self.value(np.asarray(times, dtype=float)), self.shape)

    @property
    def forces(self) -> tuple[Force, ...]:
        return (self,)

    @property
    @abstractmethod
    def breaks(self) -> tuple[float, ...]:
        """Times at which the signal is not smooth."""

    @abstractmethod
    def value(self, times: Array) -> Array:
        """The signal [N], of the shape of ``times``."""

    @abstractmethod
    def signal(self, time: float) -> Signal:
        """The smooth stretch around a time between two breaks."""


@dataclass(frozen=True)
class Constant(Force):
    """A signal that is always 1: ``shape`` is the force [N]."""

    @property
    def breaks(self) -> tuple[float, ...]:
        return ()

    def value(self, times: Array) -> Array:
        return np.ones_like(times)

    def signal(self, time: float) -> Signal:
        return Signal(value=1.0)


@dataclass(frozen=True)
class Harmonic(Force):
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

    @property
    def breaks(self) -> tuple[float, ...]:
        return (0.0, self.ramp) if self.ramp > 0.0 else ()

    def value(self, times: Array) -> Array:
        wave = self.amplitude * np.sin(2.0 * np.pi * self.frequency * times + self.phase)
        if self.ramp > 0.0:
            wave = wave * 0.5 * (1.0 - np.cos(np.pi * np.clip(times / self.ramp, 0.0, 1.0)))
        return np.asarray(wave)

    def signal(self, time: float) -> Signal:
        a, angular = self.amplitude, 2.0 * np.pi * self.frequency
        if time >= self.ramp or self.ramp == 0.0:
            return Signal(waves=(Wave(a, angular, self.phase),))
        if time < 0.0:
            return Signal()
        # The product of the ramp's cosine and the wave, as sum and difference.
        ramp = np.pi / self.ramp
        shares = ((0.5 * a, angular), (-0.25 * a, angular + ramp), (-0.25 * a, angular - ramp))
        return Signal(waves=tuple(Wave(*share, self.phase) for share in shares))


@dataclass(frozen=True)
class HammerBlow(Force):
    """Half a sine of height ``peak`` [N] from ``start`` on for ``duration`` [s].

    Raises :class:`ExcitationError` for a duration that is not above zero.
    """

    peak: float
    duration: float
    start: float = 0.0

    def __post_init__(self) -> None:
        if not self.duration > 0.0:
            raise ExcitationError(f"a blow of {self.duration:g} s: give a duration above 0")

    @property
    def breaks(self) -> tuple[float, ...]:
        return (self.start, self.start + self.duration)

    def value(self, times: Array) -> Array:
        share = (times - self.start) / self.duration
        touching = (share > 0.0) & (share < 1.0)
        return np.where(touching, self.peak * np.sin(np.pi * share), 0.0)

    def signal(self, time: float) -> Signal:
        if not self.start < time < self.start + self.duration:
            return Signal()
        angular = np.pi / self.duration
        return Signal(waves=(Wave(self.peak, angular, -angular * self.start),))


@dataclass(frozen=True)
class Recorded(Force):
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

    @property
    def breaks(self) -> tuple[float, ...]:
        return tuple(float(time) for time in self.times)

    def value(self, times: Array) -> Array:
        return np.asarray(np.interp(times, self.times, self.force))

    def signal(self, time: float) -> Signal:
        after = int(np.searchsorted(self.times, time))
        if after in (0, len(self.times)):
            return Signal(value=float(self.force[min(after, len(self.times) - 1)]))
        (t0, t1), (f0, f1) = (values[after - 1 : after + 1] for values in (self.times, self.force))
        return Signal(origin=float(t0), value=float(f0), slope=float((f1 - f0) / (t1 - t0)))


@dataclass(frozen=True)
class Together:
    """The sum of one or more forces."""

    forces: tuple[Force, ...]

    def __call__(self, times: Array) -> Array:
        return np.asarray(sum(force(times) for force in self.forces))

    @property
    def breaks(self) -> tuple[float, ...]:
        return tuple(sorted({time for force in self.forces for time in force.breaks}))
