"""Forces in time, described between their breaks as a straight line plus harmonics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.excitation import (
    CombinedForces,
    ConstantForce,
    ExcitationForce,
    HammerBlow,
    HarmonicForce,
    RecordedForce,
)


@dataclass(frozen=True)
class Wave:
    """Harmonic ``amplitude`` sin(``angular`` t + ``phase``), with ``angular`` in rad/s."""

    amplitude: float
    angular: float
    phase: float


@dataclass(frozen=True)
class Signal:
    """Smooth interval: ``value`` + ``slope`` (t - ``origin``) [N] and waves."""

    origin: float = 0.0
    value: float = 0.0
    slope: float = 0.0
    waves: tuple[Wave, ...] = ()


def single_forces(
    excitation: ExcitationForce | CombinedForces | None,
) -> tuple[ExcitationForce, ...]:
    """Return the forces whose sum is an excitation."""
    if excitation is None:
        return ()
    return excitation.forces if isinstance(excitation, CombinedForces) else (excitation,)


def breaks(excitation: ExcitationForce | CombinedForces) -> tuple[float, ...]:
    """Return the times at which an excitation is not smooth, ascending."""
    return tuple(sorted({time for force in single_forces(excitation) for time in _breaks(force)}))


def _breaks(force: ExcitationForce) -> tuple[float, ...]:
    match force:
        case HarmonicForce() if force.ramp > 0.0:
            return (0.0, force.ramp)
        case HammerBlow():
            return (force.start, force.start + force.duration)
        case RecordedForce():
            return tuple(float(time) for time in force.times)
    return ()


def signal_at(force: ExcitationForce, time: float) -> Signal:
    """Return the smooth interval of a force around a time between two of its breaks."""
    match force:
        case ConstantForce():
            return Signal(value=1.0)
        case HarmonicForce():
            return _harmonic(force, time)
        case HammerBlow():
            return _blow(force, time)
        case RecordedForce():
            return _recorded(force, time)
    raise TypeError(f"{force} is not known to be made of lines and harmonics")


def _harmonic(force: HarmonicForce, time: float) -> Signal:
    a, angular = force.amplitude, 2.0 * np.pi * force.frequency
    if time >= force.ramp or force.ramp == 0.0:
        return Signal(waves=(Wave(a, angular, force.phase),))
    if time < 0.0:
        return Signal()
    # The product of the ramp's cosine and the wave, as sum and difference.
    ramp = np.pi / force.ramp
    shares = ((0.5 * a, angular), (-0.25 * a, angular + ramp), (-0.25 * a, angular - ramp))
    return Signal(waves=tuple(Wave(*share, force.phase) for share in shares))


def _blow(force: HammerBlow, time: float) -> Signal:
    if not force.start < time < force.start + force.duration:
        return Signal()
    angular = np.pi / force.duration
    return Signal(waves=(Wave(force.peak, angular, -angular * force.start),))


def _recorded(force: RecordedForce, time: float) -> Signal:
    after = int(np.searchsorted(force.times, time))
    if after in (0, len(force.times)):
        return Signal(value=float(force.force[min(after, len(force.times) - 1)]))
    (t0, t1), (f0, f1) = (values[after - 1 : after + 1] for values in (force.times, force.force))
    return Signal(origin=float(t0), value=float(f0), slope=float((f1 - f0) / (t1 - t0)))
