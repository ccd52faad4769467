"""Excitation forces: constant, harmonic, a hammer blow, a recorded signal, and their sums.

An excitation is called with times ``(t,)`` [s] and returns forces ``(t, n)`` [N].
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array

# Least number of time steps in a period or a blow: fewer do not resolve the force.
FEWEST_STEPS = 20


class ExcitationError(InputError):
    """Error in the parameters of an excitation force."""


@dataclass(frozen=True)
class ExcitationForce(ABC):
    """Scalar signal in time, applied along ``shape`` ``(n,)``, the force per unit of the signal."""

    shape: Array

    def __post_init__(self) -> None:
        shape = checks.array("forces of a shape", self.shape, (None,), error=ExcitationError)
        checks.settle(self, shape=shape)

    def __call__(self, times: Array) -> Array:
        times = checks.array("times", times, None, error=ExcitationError)
        return np.multiply.outer(self.value(times), self.shape)

    @abstractmethod
    def value(self, times: Array) -> Array:
        """Return the signal [N] in the shape of ``times``."""

    @property
    def longest_step(self) -> float:
        """Longest time step that resolves the signal [s]."""
        return np.inf


@dataclass(frozen=True)
class ConstantForce(ExcitationForce):
    """Constant force; ``shape`` ``(n,)`` is the force itself [N].

    Examples
    --------
    A load of 5 N acts on the first of two points:

    >>> import numpy as np
    >>> from fe_models.dynamics import ConstantForce
    >>> print(ConstantForce(np.array([5.0, 0.0]))(np.array([0.0, 1.0])))
    [[5. 0.]
     [5. 0.]]
    """

    def value(self, times: Array) -> Array:
        return np.ones_like(times)


@dataclass(frozen=True)
class HarmonicForce(ExcitationForce):
    """Sinusoidal force ``amplitude`` sin(2π ``frequency`` t + ``phase``) along ``shape`` ``(n,)``.

    Parameters
    ----------
    shape
        Force ``(n,)`` per unit of the signal.
    amplitude
        Amplitude [N].
    frequency
        Frequency [Hz], above 0.
    phase
        Phase [rad] at t = 0.
    ramp
        Time [s] over which the amplitude grows from zero at t = 0, as (1 - cos(π t / ramp)) / 2; 0
        for no ramp.

    Raises
    ------
    ExcitationError
        If the frequency is not above zero or the ramp is negative.

    Examples
    --------
    A quarter of a period after the end of the ramp the force is at its amplitude:

    >>> import numpy as np
    >>> from fe_models.dynamics import HarmonicForce
    >>> force = HarmonicForce(np.ones(1), amplitude=20.0, frequency=50.0, ramp=0.1)
    >>> print(force(np.array([0.0, 0.105])).ravel())
    [ 0. 20.]
    """

    amplitude: float
    frequency: float
    phase: float = 0.0
    ramp: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        names = ("amplitude", "frequency", "phase", "ramp")
        checks.numbers(self, *names, error=ExcitationError)
        if not (self.frequency > 0.0 and self.ramp >= 0.0):
            raise ExcitationError(
                f"a harmonic force cannot have the frequency {self.frequency:g} Hz and a ramp of "
                f"{self.ramp:g} s: give a frequency above 0 and a ramp of 0 or more"
            )

    def value(self, times: Array) -> Array:
        wave = self.amplitude * np.sin(2.0 * np.pi * self.frequency * times + self.phase)
        if self.ramp > 0.0:
            wave = wave * 0.5 * (1.0 - np.cos(np.pi * np.clip(times / self.ramp, 0.0, 1.0)))
        return np.asarray(wave)

    @property
    def longest_step(self) -> float:
        return 1.0 / (FEWEST_STEPS * self.frequency)


@dataclass(frozen=True)
class HammerBlow(ExcitationForce):
    """Hammer blow: half a sine of height ``peak`` that lasts for ``duration``.

    Parameters
    ----------
    shape
        Force ``(n,)`` per unit of the signal, for example from
        :func:`fe_models.dynamics.unit_force`.
    peak
        Largest force [N].
    duration
        Duration [s], above 0.
    start
        Time [s] at which the blow begins.

    Raises
    ------
    ExcitationError
        If the duration is not above zero.

    Examples
    --------
    The impulse of half a sine is 2/π of its peak times its duration:

    >>> import numpy as np
    >>> from fe_models.dynamics import HammerBlow
    >>> blow = HammerBlow(np.ones(1), peak=100.0, duration=1e-3)
    >>> times = np.linspace(0.0, 2e-3, 2001)
    >>> print(f"{np.trapezoid(blow.value(times), times):.6f} N s of {0.2 / np.pi:.6f}")
    0.063662 N s of 0.063662
    """

    peak: float
    duration: float
    start: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.numbers(self, "peak", "duration", "start", error=ExcitationError)
        if not self.duration > 0.0:
            raise ExcitationError(
                f"a hammer blow cannot last {self.duration:g} s: give a duration above 0"
            )

    def value(self, times: Array) -> Array:
        share = (times - self.start) / self.duration
        touching = (share > 0.0) & (share < 1.0)
        return np.where(touching, self.peak * np.sin(np.pi * share), 0.0)

    @property
    def longest_step(self) -> float:
        return self.duration / FEWEST_STEPS


@dataclass(frozen=True)
class RecordedForce(ExcitationForce):
    """Force from samples: linear between the samples, constant before the first and after the last.

    Parameters
    ----------
    shape
        Force ``(n,)`` per unit of the signal.
    times
        Sample times ``(s,)`` [s], ascending.
    force
        Samples ``(s,)`` [N].

    Raises
    ------
    ExcitationError
        If there are no samples, if times and forces differ in number, if a value is not finite, or
        if the times do not ascend.

    Examples
    --------
    Three samples make a triangle:

    >>> import numpy as np
    >>> from fe_models.dynamics import RecordedForce
    >>> force = RecordedForce(np.ones(1), np.array([0.0, 0.1, 0.2]), np.array([0.0, 10.0, 0.0]))
    >>> print(force(np.array([0.05, 0.1, 0.3])).ravel())
    [ 5. 10.  0.]
    """

    times: Array
    force: Array

    def __post_init__(self) -> None:
        super().__post_init__()
        columns = {
            name: checks.array(
                f"values of {name}",
                getattr(self, name),
                (None,),
                error=ExcitationError,
                finite=False,
            )
            for name in ("times", "force")
        }
        checks.settle(self, **columns)
        if not 0 < len(self.times) == len(self.force):
            raise ExcitationError(
                f"a recorded force has {len(self.times)} times and {len(self.force)} forces: give "
                "one force for each time, and at least one of both"
            )
        if not (np.isfinite(self.times).all() and np.isfinite(self.force).all()):
            raise ExcitationError(
                "a recorded time or force is not a finite number: remove or correct it"
            )
        if np.any(np.diff(self.times) <= 0.0):
            raise ExcitationError("recorded times do not ascend: sort them and remove duplicates")

    def value(self, times: Array) -> Array:
        return np.asarray(np.interp(times, self.times, self.force))

    @property
    def longest_step(self) -> float:
        return float(np.diff(self.times).min(initial=np.inf))


@dataclass(frozen=True)
class CombinedForces:
    """Sum of one or more ``forces``.

    Examples
    --------
    A constant and a harmonic load act together:

    >>> import numpy as np
    >>> from fe_models.dynamics import CombinedForces, ConstantForce, HarmonicForce
    >>> point = np.array([1.0])
    >>> swing = HarmonicForce(point, amplitude=2.0, frequency=50.0)
    >>> force = CombinedForces((ConstantForce(5.0 * point), swing))
    >>> print(force(np.array([0.0, 0.005, 0.015])).ravel())
    [5. 7. 3.]
    """

    forces: tuple[ExcitationForce, ...]

    def __post_init__(self) -> None:
        if not self.forces or not all(callable(force) for force in self.forces):
            raise ExcitationError(f"forces are {self.forces!r}: give one or more")

    def __call__(self, times: Array) -> Array:
        parts = [force(times) for force in self.forces]
        if len({part.shape for part in parts}) > 1:
            raise ExcitationError("forces on structures of different sizes: give all of one")
        return np.asarray(sum(parts))
