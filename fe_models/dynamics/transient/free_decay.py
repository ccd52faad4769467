"""Frequency and damping against amplitude from a ring-down, measured or computed.

The record passes a Butterworth band-pass filter forwards and backwards (zero phase), which leaves
one mode. Its analytic signal a exp(iφ) (Hilbert transform) gives the amplitude a(t) and the
frequency φ'/2π. In one period of a slowly varying vibration a' = -ζ ω0 a and φ' = ω0 sqrt(1 - ζ²),
so that with λ = -a'/a

    ω0 = sqrt(φ'² + λ²),    ζ = λ / ω0,

which is exact for a linear mode. A parabola over ``periods`` periods about each sample smooths ln a
and φ and gives their slopes (Savitzky-Golay). The amplitude is divided by the gain of the filter at
its frequency.

Zeros are added before and after the record, so that neither the filter nor the transform connects
its ends. The transients that its abrupt ends cause in the filter decay as exp(-p t), with p the
slowest pole. At both ends the result is cut until they have decayed to ``FILTER_REMAINDER``, and by
half a smoothing window. The result also ends where the amplitude falls below ``SMALLEST_AMPLITUDE``
times the first one: later it may be noise, or a remainder of these transients.

The band must be wide compared with the change of frequency, and ``p`` large compared with ζω.
Otherwise the filter distorts the result; :func:`ring_down` rejects a band that is too narrow.

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
"""Order of the band-pass filter in one direction; higher orders ring longer."""

FILTER_REMAINDER = 1e-5
"""Remainder of the filter's transients where the result begins and ends, relative to the amplitude.
Relative to the damping it is p / ζω times as large, a hundred times for small damping."""

SMALLEST_AMPLITUDE = 1e-2
"""Smallest amplitude of the result over the first one, well above ``FILTER_REMAINDER``."""

PERIODS = 6.0
"""Periods of the smoothing window: a few, to average out twice the frequency within the band."""

FEWEST_SAMPLES = 8
"""Fewest samples per period at the middle frequency of the band."""


@dataclass(frozen=True)
class RingDown:
    """Frequency and damping of a decaying mode against time, ``(k,)`` each.

    Parameters
    ----------
    time
        Time [s] from the beginning of the record.
    amplitude
        Amplitude of the recorded quantity, e.g. displacement [mm].
    frequency
        Frequency [Hz] of the damped vibration.
    damping_ratio
        Damping ratio ζ.
    """

    time: Array
    amplitude: Array
    frequency: Array
    damping_ratio: Array


def ring_down(
    response: Array, step: float, band: tuple[float, float], periods: float = PERIODS
) -> RingDown:
    """Return frequency and damping of the mode of a ring-down that lies in a frequency band.

    Parameters
    ----------
    response
        Displacement, velocity or acceleration ``(t,)`` without a force; the amplitude is of the
        same quantity.
    step
        Sampling interval [s].
    band
        Lower and upper frequency [Hz] of the band.
    periods
        Periods of the smoothing window.

    Raises
    ------
    SignalError
        If the band is outside 0 to half the sampling rate, if there are too few samples, if the
        decay is too fast for the band, or if the record ends before the filter has settled.

    Examples
    --------
    The amplitude of a mode of 100 Hz decays as exp(-ζ ω t) with ζ = 0.01:

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
    settling = int(np.ceil(np.log(1.0 / FILTER_REMAINDER) / (_slowest_decay(band) * step)))
    half_window = _half_window(step, band, periods)
    cut = settling + half_window
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
    decay = _slopes(level, phase, step, half_window, cut, band)
    _, gain = sosfreqz(sections, worN=decay.frequency, fs=1.0 / step)
    return replace(decay, amplitude=decay.amplitude / np.abs(gain) ** 2)


def _checked(response: Array, step: float, band: tuple[float, float], periods: float) -> Array:
    """Return the record as an array; raise :class:`SignalError` if it cannot be filtered."""
    signal = checks.array("responses", response, None, error=SignalError, finite=False)
    low, high = checks.array("ends of the band", band, (2,), error=SignalError)
    for name, value in (("step", step), ("periods", periods)):
        checks.number(name, value, error=SignalError)
    if signal.ndim != 1 or not np.isfinite(signal).all() or not signal.any():
        raise SignalError("the response must be a row (t,) of finite numbers that are not all 0")
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


def _slowest_decay(band: tuple[float, float]) -> float:
    """Return the decay rate [1/s] of the slowest pole of the band-pass filter."""
    edges = (2.0 * np.pi * band[0], 2.0 * np.pi * band[1])
    _, poles, _ = butter(ORDER, edges, "bandpass", analog=True, output="zpk")
    return float(-poles.real.max())


def _half_window(step: float, band: tuple[float, float], periods: float) -> int:
    """Return the number of samples on each side of a smoothing window."""
    return max(int(0.5 * periods / (0.5 * (band[0] + band[1]) * step)), 2)


def _slopes(
    level: Array, phase: Array, step: float, half_window: int, cut: int, band: tuple[float, float]
) -> RingDown:
    """Return the ring-down, from the slopes of log amplitude and phase, cut at both ends."""
    window = 2 * half_window + 1
    kept = slice(cut, len(level) - cut)
    smooth = savgol_filter(level, window, 2)[kept]
    decay = -savgol_filter(level, window, 2, deriv=1, delta=step)[kept]
    rate = savgol_filter(phase, window, 2, deriv=1, delta=step)[kept]
    too_small = np.flatnonzero(~(smooth >= smooth[0] + np.log(SMALLEST_AMPLITUDE)))
    end = int(too_small[0]) if too_small.size else len(smooth)
    if float(decay[:end].max()) > 0.5 * _slowest_decay(band):
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
