"""Frequency responses from blows of a hammer, measured or computed.

Force and response of a blow are recorded from rest. H1 = Σ X F* / Σ F F* over the blows (spectra X
of the response, F of the force, * conjugate) is unbiased by noise of the response; with one blow it
is the ratio of the spectra. Coherence γ² = |Σ X F*|² / (Σ F F* Σ X X*) needs at least two.

No window is applied unless one is asked for: a blow and its whole ring-down begin and end at rest,
and a window would only distort them. ``blow_end`` sets the force to zero after it (the force
window, against noise while nothing strikes). ``decay`` σ multiplies both records by exp(-σ t), for
a response cut off before it is at rest; a linear structure then shows exactly its response at the
complex frequency σ + iω: each mode has its damping rate ζω larger by σ.

Source: Ewins 2000, *Modal Testing*, 2nd ed., chapter 3 (estimators, windows).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array

ResponseQuantity = Literal["receptance", "mobility", "accelerance"]
DERIVATIVES: dict[ResponseQuantity, int] = {"receptance": 0, "mobility": 1, "accelerance": 2}
"""Of the displacement in time, over force: mm/N, mm/(s N), mm/(s² N)."""

REST = 0.05
"""Share at the end of a record that is looked at for what is left of the response."""


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
    quantity: ResponseQuantity
    coherence: Array | None
    decay: float
    remaining: float

    def converted(self, quantity: ResponseQuantity) -> FrequencyResponse:
        """The same as another quantity: a factor iω (σ + iω with an exponential window) each."""
        order = DERIVATIVES[quantity] - DERIVATIVES[self.quantity]
        rate = self.decay + 2j * np.pi * self.frequency
        return replace(self, value=self.value * rate**order, quantity=quantity)


def frequency_response(
    force: Array,
    response: Array,
    step: float,
    quantity: ResponseQuantity = "accelerance",
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

    Examples
    --------
    The receptance of a rig from the record of a blow, at 100 Hz ``1 / |k - m ω² + i c ω|``:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> blow = HammerBlow(unit_force(rig, "m"), peak=100.0, duration=1e-3)
    >>> motion = integrate(rig, None, blow, 0.5, TimeStepControl(5e-5))
    >>> force = blow.value(motion.times)
    >>> response = frequency_response(force, motion.displacement[:, 0], 5e-5, "receptance")
    >>> measured = np.interp(100.0, response.frequency, np.abs(response.value))
    >>> omega = 200.0 * np.pi
    >>> exact = 1.0 / abs(1e3 - 1e-3 * omega**2 + 0.04j * omega)
    >>> print(f"{1e3 * measured:.3f} um/N of {1e3 * exact:.3f}")
    1.651 um/N of 1.651
    """
    forces, responses = _records(force, response)
    checks.choice("quantity", quantity, list(DERIVATIVES), SignalError)
    for name, value in (("step", step), ("decay", decay), ("blow_end", blow_end or 0.0)):
        checks.number(name, value, error=SignalError)
    if not (step > 0.0 and 0.0 <= decay < np.inf):
        raise SignalError(
            f"step {step:g} s, decay {decay:g} 1/s: give a step above 0, a decay >= 0"
        )
    time = step * np.arange(forces.shape[1])
    window = np.exp(-decay * time)
    struck = window if blow_end is None else window * (time <= blow_end)
    if not np.any(forces * struck, axis=1).all():
        raise SignalError("a record has no blow; allowed: forces that are not 0 before blow_end")
    force_spectra = np.fft.rfft(forces * struck)[:, 1:]
    response_spectra = np.fft.rfft(responses * window)[:, 1:]
    power = np.sum(np.abs(force_spectra) ** 2, axis=0)
    if not (power > 0.0).all():
        raise SignalError("the force has no part at some frequency; allowed: blows")
    cross = np.sum(response_spectra * force_spectra.conj(), axis=0)
    coherence = None
    if len(forces) > 1:
        product = power * np.sum(np.abs(response_spectra) ** 2, axis=0)
        coherence = np.divide(np.abs(cross) ** 2, product, where=product > 0.0, out=0.0 * power)
    frequency = np.fft.rfftfreq(forces.shape[1], step)[1:].astype(float)
    remaining = _remaining(responses * window)
    return FrequencyResponse(frequency, cross / power, quantity, coherence, decay, remaining)


def _records(force: Array, response: Array) -> tuple[Array, Array]:
    """Both as ``(b, t)``, checked."""
    forces, responses = (
        np.atleast_2d(checks.array(name, values, None, error=SignalError, finite=False))
        for name, values in (("forces", force), ("responses", response))
    )
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
