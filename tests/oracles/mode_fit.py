"""Modes fitted to the peaks of a frequency response."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from fe_models.dynamics.transient.impact_hammer import FrequencyResponse
from sa_solver.types import Array

FINE = 2001
"""Frequencies among which the fitted peak is looked up: 1e-3 of the half-power width."""

HALF_POWER = 0.5
"""A resonance is fitted where the response squared is above this share of its peak."""


@dataclass(frozen=True)
class Resonance:
    """Peak of a frequency response.

    ``frequency`` [Hz] and ``magnitude`` (of the response's quantity) of the peak, and, of the mode
    fitted to it, ``natural_frequency`` [Hz] without damping and ``damping_ratio``.
    """

    frequency: float
    magnitude: float
    natural_frequency: float
    damping_ratio: float


def resonances(
    response: FrequencyResponse, lowest: float = 0.0, highest: float = np.inf, share: float = 0.05
) -> list[Resonance]:
    """Return resonances from ``lowest`` to ``highest`` [Hz], by frequency.

    Peaks must stand out by ``share`` of the highest one. A mode and a contribution of other modes
    are fitted to the samples above half power, or three, of each: with s = σ + iω, H (s² + 2ζω0 s +
    ω0²) = b0 + b1 s + b2 s² by least squares (Levy 1959, IRE Trans. Autom. Control 4, 37), exact
    for a single mode plus a constant. A joint struck out of its linear range has no mode, and its
    fit may not exist (NaN).
    """
    band = (response.frequency >= lowest) & (response.frequency <= highest)
    size = np.abs(response.value)
    peaks, _ = find_peaks(size, prominence=share * float(size[band].max(initial=0.0)))
    return [_resonance(response, size, int(peak)) for peak in peaks if band[peak]]


def _resonance(response: FrequencyResponse, size: Array, peak: int) -> Resonance:
    """Return the mode at sample ``peak``."""
    near = _half_power(size, peak)
    # In units of the peak: response and frequency.
    reference = float(response.frequency[peak])
    rate = response.decay / (2.0 * np.pi * reference) + 1j * response.frequency[near] / reference
    value = response.value[near] / size[peak]
    powers = np.vander(rate, 3, increasing=True)
    equations = np.hstack([value[:, None] * powers[:, :2], -powers])
    both = np.vstack([equations.real, equations.imag])
    right = np.concatenate([(-value * rate**2).real, (-value * rate**2).imag])
    coefficients, *_ = np.linalg.lstsq(both, right, rcond=None)
    natural = np.sqrt(coefficients[0]) if coefficients[0] > 0.0 else np.nan
    fine = np.linspace(rate[0], rate[-1], FINE)
    fitted = np.polyval(coefficients[4:1:-1], fine) / (
        fine**2 + coefficients[1] * fine + coefficients[0]
    )
    top = int(np.abs(fitted).argmax())
    return Resonance(
        reference * float(fine[top].imag),
        float(size[peak] * np.abs(fitted[top])),
        float(reference * natural),
        float(coefficients[1] / (2.0 * natural)),
    )


def _half_power(size: Array, peak: int) -> slice:
    """Return the samples about the peak above half power, at least its neighbours."""
    below = np.flatnonzero(size**2 < HALF_POWER * size[peak] ** 2)
    first = below[below < peak].max(initial=-1) + 1
    last = below[below > peak].min(initial=len(size)) - 1
    return slice(max(min(first, peak - 1), 0), min(max(last, peak + 1), len(size) - 1) + 1)
