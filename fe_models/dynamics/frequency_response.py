"""Frequency responses from blows of a hammer, measured or computed.

Force and response of a blow are recorded from rest. H1 = Σ X F* / Σ F F* over the blows (spectra X
of the response, F of the force, * conjugate) is unbiased by noise of the response; with one blow it
is the ratio of the spectra. Coherence γ² = |Σ X F*|² / (Σ F F* Σ X X*) needs at least two.

No window is applied unless one is asked for: a blow and its whole ring-down begin and end at rest,
and a window would only distort them. ``blow_end`` sets the force to zero after it (the force
window, against noise while nothing strikes). ``decay`` σ multiplies both records by exp(-σ t), for
a response cut off before it is at rest; a linear structure then shows exactly its response at the
complex frequency σ + iω: each mode has its damping rate ζω larger by σ, which :func:`resonances`
takes off again.

Source: Ewins 2000, *Modal Testing*, 2nd ed., chapter 3 (estimators, windows).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.signal import find_peaks

from sa_solver.errors import InputError
from sa_solver.types import Array

Quantity = Literal["receptance", "mobility", "accelerance"]
DERIVATIVES: dict[Quantity, int] = {"receptance": 0, "mobility": 1, "accelerance": 2}
"""Of the displacement in time, over force: mm/N, mm/(s N), mm/(s² N)."""

REST = 0.05
"""Share at the end of a record that is looked at for what is left of the response."""

FINE = 2001
"""Frequencies among which the fitted peak is looked up: 1e-3 of the half-power width."""

HALF_POWER = 0.5
"""A resonance is fitted where the response squared is above this share of its peak."""


class SignalError(InputError):
    """Records that say nothing about a structure."""


@dataclass(frozen=True)
class FrequencyResponse:
    """Response over force by frequency.

    ``frequency`` ``(f,)`` [Hz] above 0; ``value`` ``(f,)`` complex, displacement, velocity or
    acceleration (``quantity``) over force, in mm, s and N; ``coherence`` ``(f,)``, None for a
    single blow; ``decay`` [1/s] of the exponential window; ``remaining``, the largest response in
    the last part ``REST`` of a record over the largest at all, window included: what leaks (a
    hundredth of it or so shows in the response).
    """

    frequency: Array
    value: np.ndarray
    quantity: Quantity
    coherence: Array | None
    decay: float
    remaining: float

    def converted(self, quantity: Quantity) -> FrequencyResponse:
        """The same as another quantity: a factor iω (σ + iω with an exponential window) each."""
        order = DERIVATIVES[quantity] - DERIVATIVES[self.quantity]
        rate = self.decay + 2j * np.pi * self.frequency
        return replace(self, value=self.value * rate**order, quantity=quantity)


@dataclass(frozen=True)
class Resonance:
    """A peak of a frequency response.

    ``frequency`` [Hz] and ``magnitude`` (of the response's quantity) of the peak, and, of the mode
    fitted to it, ``natural_frequency`` [Hz] without damping and ``damping_ratio``.
    """

    frequency: float
    magnitude: float
    natural_frequency: float
    damping_ratio: float


def frequency_response(
    force: Array,
    response: Array,
    step: float,
    quantity: Quantity = "accelerance",
    *,
    blow_end: float | None = None,
    decay: float = 0.0,
) -> FrequencyResponse:
    """H1 of records of blows.

    ``force`` [N] and ``response`` (that ``quantity`` is over force, in mm and s) are ``(t,)`` or
    ``(b, t)`` for ``b`` blows, sampled every ``step`` [s], from rest. ``blow_end`` [s] and
    ``decay`` [1/s] are windows: see the module. The frequencies are those of the transform, up to
    half the sampling rate, without 0; a blow excites those up to about 1 / its duration (a half
    sine has nothing at 1.5 / duration), and beyond them the response is noise. Raises SignalError.
    """
    forces, responses = _records(force, response)
    if not (step > 0.0 and 0.0 <= decay < np.inf):
        raise SignalError(
            f"step {step:g} s, decay {decay:g} 1/s: give a step above 0, a decay >= 0"
        )
    time = step * np.arange(forces.shape[1])
    window = np.exp(-decay * time)
    struck = window if blow_end is None else window * (time <= blow_end)
    if not np.any(forces * struck, axis=1).all():
        raise SignalError("a record has no blow; allowed: forces that are not 0 before blow_end")
    spectra = np.fft.rfft(forces * struck)[:, 1:]
    answers = np.fft.rfft(responses * window)[:, 1:]
    own = np.sum(np.abs(spectra) ** 2, axis=0)
    if not (own > 0.0).all():
        raise SignalError("the force has no part at some frequency; allowed: blows")
    cross = np.sum(answers * spectra.conj(), axis=0)
    coherence = None
    if len(forces) > 1:
        product = own * np.sum(np.abs(answers) ** 2, axis=0)
        coherence = np.divide(np.abs(cross) ** 2, product, where=product > 0.0, out=0.0 * own)
    frequency = np.fft.rfftfreq(forces.shape[1], step)[1:].astype(float)
    remaining = _remaining(responses * window)
    return FrequencyResponse(frequency, cross / own, quantity, coherence, decay, remaining)


def _records(force: Array, response: Array) -> tuple[Array, Array]:
    """Both as ``(b, t)``, checked."""
    forces = np.atleast_2d(np.asarray(force, dtype=float))
    responses = np.atleast_2d(np.asarray(response, dtype=float))
    if forces.ndim != 2 or forces.shape != responses.shape or forces.shape[1] < 4:
        raise SignalError(
            f"force has the shape {np.shape(force)}, the response {np.shape(response)}; allowed: "
            "the same (t,) or (blows, t), of at least 4 samples"
        )
    if not (np.isfinite(forces).all() and np.isfinite(responses).all()):
        raise SignalError("a number of a record is not finite; allowed: finite numbers")
    return forces, responses


def _remaining(responses: Array) -> float:
    """The largest response at the end of a record over the largest."""
    late = int((1.0 - REST) * responses.shape[1])
    largest = float(np.abs(responses).max())
    return float(np.abs(responses[:, late:]).max()) / largest if largest > 0.0 else 0.0


# --- resonances ---------------------------------------------------------------------------------


def resonances(
    response: FrequencyResponse, lowest: float = 0.0, highest: float = np.inf, share: float = 0.05
) -> list[Resonance]:
    """Resonances from ``lowest`` to ``highest`` [Hz], by frequency.

    Peaks that stand out by ``share`` of the highest one. To the samples above half power, or three,
    of each a mode and what other modes add to it is fitted: with s = σ + iω,
    H (s² + 2ζω0 s + ω0²) = b0 + b1 s + b2 s² by least squares (Levy 1959, IRE Trans. Autom.
    Control 4, 37), exact for a single mode beside a constant. A joint struck out of its linear
    range has no mode, and its fit may be none (NaN).
    """
    band = (response.frequency >= lowest) & (response.frequency <= highest)
    size = np.abs(response.value)
    peaks, _ = find_peaks(size, prominence=share * float(size[band].max(initial=0.0)))
    return [_resonance(response, size, int(peak)) for peak in peaks if band[peak]]


def _resonance(response: FrequencyResponse, size: Array, peak: int) -> Resonance:
    """The mode at sample ``peak``."""
    near = _half_power(size, peak)
    # In units of the peak: response and frequency.
    reference = float(response.frequency[peak])
    rate = response.decay / (2.0 * np.pi * reference) + 1j * response.frequency[near] / reference
    value = response.value[near] / size[peak]
    powers = np.vander(rate, 3, increasing=True)
    equations = np.hstack([value[:, None] * powers[:, :2], -powers])
    both = np.vstack([equations.real, equations.imag])
    right = np.concatenate([(-value * rate**2).real, (-value * rate**2).imag])
    own, *_ = np.linalg.lstsq(both, right, rcond=None)
    natural = np.sqrt(own[0]) if own[0] > 0.0 else np.nan
    fine = np.linspace(rate[0], rate[-1], FINE)
    fitted = np.polyval(own[4:1:-1], fine) / (fine**2 + own[1] * fine + own[0])
    top = int(np.abs(fitted).argmax())
    return Resonance(
        reference * float(fine[top].imag),
        float(size[peak] * np.abs(fitted[top])),
        float(reference * natural),
        float(own[1] / (2.0 * natural)),
    )


def _half_power(size: Array, peak: int) -> slice:
    """Samples about the peak above half power, at least its neighbours."""
    below = np.flatnonzero(size**2 < HALF_POWER * size[peak] ** 2)
    first = below[below < peak].max(initial=-1) + 1
    last = below[below > peak].min(initial=len(size)) - 1
    return slice(max(min(first, peak - 1), 0), min(max(last, peak + 1), len(size) - 1) + 1)
