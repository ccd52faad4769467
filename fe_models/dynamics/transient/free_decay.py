"""Frequency and damping against amplitude from a ring-down, measured or computed.

The record is passed through a Butterworth band-pass forwards and backwards (no phase), which leaves
one mode; its analytic signal (Hilbert transform) a exp(iφ) gives the amplitude a(t) and the
frequency φ'/2π. In one period of a slowly varying vibration a' = -ζ ω0 a and φ' = ω0 sqrt(1 - ζ²),
so that with λ = -a'/a

    ω0 = sqrt(φ'² + λ²),    ζ = λ / ω0,

exact for a linear mode. ln a and φ are smoothed, and their slopes taken, by a parabola over
``periods`` periods about each sample (Savitzky-Golay). The amplitude is divided by the filter's
gain at its frequency.

Zeros are put before and after the record, so that neither the filter nor the transform joins its
ends. What its sudden beginning and end leave in the filter dies out as exp(-p t), p the slowest
pole; at both ends the result is cut until that is down to ``FORGOTTEN``, and by half a smoothing
window. It also ends where the amplitude falls below ``FLOOR`` of what it was at the first sample
given: later it may be noise or what is left of the beginning.

The band must be wide against the change of frequency and ``p`` large against ζω, else the filter
shapes what is measured; :func:`ring_down` refuses a band narrower than that.

Source: Feldman 1994, Mech. Syst. Signal Process. 8, 119, doi:10.1006/mssp.1994.1011.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import butter, hilbert, savgol_filter, sosfiltfilt, sosfreqz

from fe_models.dynamics.transient.impact_hammer import SignalError
from sa_solver import checks
from sa_solver.types import Array

ORDER = 2
"""Of the band-pass, before it is doubled by the way back: higher ones ring longer."""

FORGOTTEN = 1e-5
"""What the filter may still hold of the ends of the record where the result begins and ends. It is
of the amplitude; of the damping it is p / ζω times as much, a hundred times if that is small."""

FLOOR = 1e-2
"""Smallest amplitude given, of the first: well above the ``FORGOTTEN`` part of it."""

PERIODS = 6.0
"""Of smoothing: a few, so that what the band lets pass of twice the frequency averages out."""

FEWEST_SAMPLES = 8
"""Of a period of the band's middle."""


@dataclass(frozen=True)
class RingDown:
    """A decaying mode, ``(k,)`` each.

    ``time`` [s] from the record's beginning; ``amplitude`` of the record's quantity (displacement
    [mm] or another); ``frequency`` [Hz] as it vibrates, damped; ``damping_ratio`` ζ.
    """

    time: Array
    amplitude: Array
    frequency: Array
    damping_ratio: Array


def ring_down(
    response: Array, step: float, band: tuple[float, float], periods: float = PERIODS
) -> RingDown:
    """Frequency and damping of the mode of ``response`` ``(t,)`` within ``band`` [Hz].

    ``response`` is displacement, velocity or acceleration (the amplitude is of the same), sampled
    every ``step`` [s], without a force. Raises SignalError for a band outside 0 to half the
    sampling rate, too few samples, a decay too fast for the band, and a record that is over before
    the filter has settled.

    Examples
    --------
    A mode of 100 Hz whose amplitude decays as exp(-ζ ω t) with ζ = 0.01:

    >>> import numpy as np
    >>> from fe_models.dynamics import ring_down
    >>> time, omega = np.arange(4000) / 4000.0, 200.0 * np.pi
    >>> response = np.exp(-0.01 * omega * time) * np.cos(omega * time)
    >>> decay = ring_down(response, step=1 / 4000, band=(50.0, 150.0))
    >>> print(f"{decay.frequency.mean():.2f} Hz, {decay.damping_ratio.mean():.4f}")
    100.00 Hz, 0.0100
    """
    signal = _checked(response, step, band, periods)
    sections = butter(ORDER, band, "bandpass", fs=1.0 / step, output="sos")
    settling = int(np.ceil(np.log(1.0 / FORGOTTEN) / (_slowest(band) * step)))
    half = _half_window(step, band, periods)
    cut = settling + half
    if len(signal) <= 2 * cut + 2:
        raise SignalError(
            f"the record of {step * len(signal):.3g} s is over before the filter has settled at "
            f"both ends; allowed: more than {step * (2 * cut + 2):.3g} s, or a wider band"
        )
    padded = np.pad(signal, 2 * settling)
    filtered = sosfiltfilt(sections, padded, padtype=None)
    analytic = hilbert(filtered)[2 * settling : -2 * settling]
    with np.errstate(divide="ignore"):
        level, phase = np.log(np.abs(analytic)), np.unwrap(np.angle(analytic))
    decay = _measured(level, phase, step, half, cut, band)
    _, gain = sosfreqz(sections, worN=decay.frequency, fs=1.0 / step)
    return replace(decay, amplitude=decay.amplitude / np.abs(gain) ** 2)


def _checked(response: Array, step: float, band: tuple[float, float], periods: float) -> Array:
    """The record, if it can be filtered."""
    signal = checks.array("responses", response, None, error=SignalError, finite=False)
    low, high = checks.array("ends of the band", band, (2,), error=SignalError)
    for name, value in (("step", step), ("periods", periods)):
        checks.number(name, value, error=SignalError)
    if signal.ndim != 1 or not np.isfinite(signal).all() or not signal.any():
        raise SignalError("the response is to be (t,) finite numbers that are not all 0")
    if not (step > 0.0 and 0.0 < low < high < 0.5 / step):
        raise SignalError(
            f"band {low:g} to {high:g} Hz at a step of {step:g} s; allowed: bands within 0 to half "
            "the sampling rate"
        )
    if 0.5 * (low + high) * step > 1.0 / FEWEST_SAMPLES:
        raise SignalError(f"fewer than {FEWEST_SAMPLES} samples a period; allowed: a smaller step")
    if not periods >= 1.0:
        raise SignalError(f"smoothing over {periods:g} periods; allowed: at least 1")
    return signal


def _slowest(band: tuple[float, float]) -> float:
    """Rate at which the slowest pole of the band-pass decays [1/s]."""
    edges = (2.0 * np.pi * band[0], 2.0 * np.pi * band[1])
    _, poles, _ = butter(ORDER, edges, "bandpass", analog=True, output="zpk")
    return float(-poles.real.max())


def _half_window(step: float, band: tuple[float, float], periods: float) -> int:
    """Samples on each side of a smoothing window."""
    return max(int(0.5 * periods / (0.5 * (band[0] + band[1]) * step)), 2)


def _measured(
    level: Array, phase: Array, step: float, half: int, cut: int, band: tuple[float, float]
) -> RingDown:
    """Slopes of log amplitude and phase, cut at both ends."""
    window = 2 * half + 1
    inner = slice(cut, len(level) - cut)
    smooth = savgol_filter(level, window, 2)[inner]
    decay = -savgol_filter(level, window, 2, deriv=1, delta=step)[inner]
    rate = savgol_filter(phase, window, 2, deriv=1, delta=step)[inner]
    low = np.flatnonzero(~(smooth >= smooth[0] + np.log(FLOOR)))
    end = int(low[0]) if low.size else len(smooth)
    if float(decay[:end].max()) > 0.5 * _slowest(band):
        raise SignalError(
            f"the mode decays at {decay[:end].max():.3g} 1/s, about as fast as the filter of the "
            f"band {band[0]:g} to {band[1]:g} Hz; allowed: a wider band"
        )
    angular = np.hypot(rate[:end], decay[:end])
    return RingDown(
        np.asarray(step * np.arange(cut, cut + end), dtype=float),
        np.exp(smooth[:end]),
        rate[:end] / (2.0 * np.pi),
        decay[:end] / angular,
    )
