"""Frequency response functions from hammer blows, measured or computed.

Force and response of a blow are recorded from rest. H1 = Σ X F* / Σ F F* over the blows (spectra X
of the response and F of the force, * conjugate) is not biased by noise of the response. For one
blow it is the ratio of the spectra. Coherence γ² = |Σ X F*|² / (Σ F F* Σ X X*) needs at least two
blows.

By default no window is applied: a blow with its whole ring-down begins and ends at rest, and a
window would only distort the spectra. ``blow_end`` sets the force to zero after that time (force
window, against noise after the blow). ``decay`` σ multiplies both records by exp(-σ t), for a
response that is cut off before it is at rest. For a linear structure the result is then exactly the
response at the complex frequency σ + iω: the damping rate ζω of each mode appears larger by σ.

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
"""Time derivatives of the displacement, over force: mm/N, mm/(s N), mm/(s² N)."""

REST = 0.05
"""Last part of a record in which the remaining response is evaluated, as a share of the record."""


class SignalError(InputError):
    """Error for records from which no property of a structure can be computed."""


@dataclass(frozen=True)
class FrequencyResponse:
    """Frequency response function: response over force.

    Parameters
    ----------
    frequency
        Frequencies ``(f,)`` [Hz], above 0.
    value
        Complex displacement, velocity or acceleration over force ``(f,)`` [mm, s, N].
    quantity
        Receptance, mobility or accelerance.
    coherence
        Coherence ``(f,)``, or None for a single blow.
    decay
        Decay rate [1/s] of the exponential window.
    remaining
        Largest windowed response in the last part ``REST`` of a record, over the largest at all. It
        measures leakage: about a hundredth of it appears in the response function.
    """

    frequency: Array
    value: np.ndarray
    quantity: ResponseQuantity
    coherence: Array | None
    decay: float
    remaining: float

    def converted(self, quantity: ResponseQuantity) -> FrequencyResponse:
        """Return the same response as another quantity.

        Each derivative is a factor iω, or σ + iω with an exponential window.
        """
        derivatives = DERIVATIVES[quantity] - DERIVATIVES[self.quantity]
        rate = self.decay + 2j * np.pi * self.frequency
        return replace(self, value=self.value * rate**derivatives, quantity=quantity)


def frequency_response(
    force: Array,
    response: Array,
    step: float,
    quantity: ResponseQuantity = "accelerance",
    *,
    blow_end: float | None = None,
    decay: float = 0.0,
) -> FrequencyResponse:
    """Return the estimate H1 of the frequency response from records of hammer blows.

    The frequencies are those of the discrete Fourier transform up to half the sampling rate,
    without 0. A blow excites frequencies up to about 1 / duration (the spectrum of half a sine is 0
    at 1.5 / duration); above, the response is noise.

    Parameters
    ----------
    force
        Forces [N], ``(t,)``, or ``(b, t)`` for ``b`` blows, recorded from rest.
    response
        Responses of the same shape, whose ``quantity`` is over force, in mm and s.
    step
        Sampling interval [s].
    quantity
        Receptance, mobility or accelerance.
    blow_end
        Time [s] after which the force is set to zero, or None; see the module.
    decay
        Decay rate [1/s] of the exponential window; see the module.

    Raises
    ------
    SignalError
        If shapes differ, if numbers are not finite, or if a record has no blow.

    Examples
    --------
    The receptance of a rig at 100 Hz from the record of a blow is ``1 / |k - m ω² + i c ω|``:

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
            f"the sampling interval is {step:g} s and the decay {decay:g} 1/s: give a step above 0 "
            "and a decay of 0 or more"
        )
    time = step * np.arange(forces.shape[1])
    window = np.exp(-decay * time)
    force_window = window if blow_end is None else window * (time <= blow_end)
    if not np.any(forces * force_window, axis=1).all():
        raise SignalError("a record has no blow; allowed: forces that are not 0 before blow_end")
    force_spectra = np.fft.rfft(forces * force_window)[:, 1:]
    response_spectra = np.fft.rfft(responses * window)[:, 1:]
    power = np.sum(np.abs(force_spectra) ** 2, axis=0)
    if not (power > 0.0).all():
        raise SignalError("the force has no part at some frequency; allowed: records of blows")
    cross = np.sum(response_spectra * force_spectra.conj(), axis=0)
    coherence = None
    if len(forces) > 1:
        product = power * np.sum(np.abs(response_spectra) ** 2, axis=0)
        coherence = np.divide(np.abs(cross) ** 2, product, where=product > 0.0, out=0.0 * power)
    frequency = np.fft.rfftfreq(forces.shape[1], step)[1:].astype(float)
    remaining = _remaining(responses * window)
    return FrequencyResponse(frequency, cross / power, quantity, coherence, decay, remaining)


def _records(force: Array, response: Array) -> tuple[Array, Array]:
    """Return force and response as ``(b, t)``; raise :class:`SignalError` if they are not valid."""
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
    """Return the largest response in the last part of a record over the largest at all."""
    last_part = int((1.0 - REST) * responses.shape[1])
    largest = float(np.abs(responses).max())
    return float(np.abs(responses[:, last_part:]).max()) / largest if largest > 0.0 else 0.0
