"""Independent small model of Archard wear for a body that slides over a flat without tilting.

Dense half-planes (constant pressure on strips, Flamant), an active set for the contact, explicit
steps in which all places of the stroke wear the surfaces at once. It shares only the physics with
the packages.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def strip_compliance(count: int, pitch: float, modulus: float) -> Array:
    """Return the displacement of strip i per pressure on strip j ``(n, n)`` [mm/MPa].

    It is known up to a constant.
    """
    apart = pitch * np.subtract.outer(np.arange(count), np.arange(count))

    def primitive(x: Array) -> Array:
        return x * (np.log(np.abs(x)) - 1.0)

    integral = primitive(apart + 0.5 * pitch) - primitive(apart - 0.5 * pitch)
    return -2.0 / (np.pi * modulus) * integral


def press(compliance: Array, gap: Array, load: float, pitch: float) -> Array:
    """Return the pressure ``(n,)`` of bodies that approach straight under ``load`` per length."""
    touching = np.ones(len(gap), dtype=bool)
    for _ in range(100):
        on = np.flatnonzero(touching)
        system = np.zeros((len(on) + 1, len(on) + 1))
        system[:-1, :-1] = compliance[np.ix_(on, on)]
        system[:-1, -1], system[-1, :-1] = -1.0, pitch
        solution = np.linalg.solve(system, np.append(-gap[on], load))
        pressure = np.zeros(len(gap))
        pressure[on] = solution[:-1]
        left = gap + compliance @ pressure - solution[-1]
        following = np.where(touching, pressure > 0.0, left < 0.0)
        if np.array_equal(following, touching):
            return pressure
        touching = following
    raise AssertionError("the active set goes round in circles")


def wear_without_tilt(
    gap: Array,
    pitch: float,
    modulus: float,
    load: float,
    increments: int,
    cells: int,
    rate: float,
    steps: int,
) -> tuple[Array, Array]:
    """Return the depths of the flat and of the slider after ``steps`` blocks of cycles.

    The slider passes ``cells``, an even number, in each of the ``increments`` forward and back,
    about the middle. It presses where an increment ends, and either body loses ``rate`` [mm/MPa]
    times that pressure from half an increment before that place to half an increment after it. The
    flat is worn where the slider passes meanwhile: at the ends of that path half as much as
    between.
    """
    compliance = strip_compliance(len(gap), pitch, modulus)
    half = cells * increments // 2
    flat, slider = np.zeros_like(gap), np.zeros_like(gap)
    for _ in range(steps):
        worn_flat, worn_slider = np.zeros_like(gap), np.zeros_like(gap)
        for place in range(-half, half + 1, cells):
            begin, end = max(place - cells // 2, -half), min(place + cells // 2, half)
            weights = np.ones(end - begin + 1)
            weights[[0, -1]] = 0.5
            # There and back press alike; where it turns it comes once, and goes back the same way.
            weights *= 2.0 / cells
            passed = list(zip(weights, range(begin, end + 1), strict=True))
            seen = sum(w * np.roll(flat, -k) for w, k in passed) / weights.sum()
            worn = rate * press(compliance, gap + seen + slider, load, pitch)
            worn_slider += weights.sum() * worn
            for w, k in passed:
                worn_flat += w * np.roll(worn, k)
        flat, slider = flat + worn_flat, slider + worn_slider
    return flat, slider
