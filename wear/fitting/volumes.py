"""Wear coefficients from worn volumes against dissipated energy.

V = α (δ/δ_ref)^m max(E - E0, 0) + V0, with α of each body, the amplitude δ of the slip to a power
m (0: the energy law; 1: Gallego et al. 2007, eq. 2), and what a line through the data leaves on one
of the axes: a threshold E0 of energy before anything wears (Fouvry et al. 2003, Wear 255, 287), or
a volume V0 at no energy, as of a surface that wears faster at first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal, get_args

import numpy as np

from sa_solver import checks
from sa_solver.types import Array
from wear.fitting.problem import (
    FitError,
    FitProblem,
    Series,
    Unknown,
    require_unlike,
    settle_columns,
)

Offset = Literal["none", "threshold", "intercept"]
COEFFICIENT, THRESHOLD, INTERCEPT, EXPONENT = "coefficient", "threshold", "intercept", "exponent"

EXPONENTS = (0.0, 1.0)
"""Of the amplitude, to begin with: those of the two laws."""

LARGEST_EXPONENT = 10.0
"""Of the amplitude, and less than which it may be known to."""

THRESHOLDS = 5
"""Energies tried as a threshold, from none to the middle of the data."""


@dataclass(frozen=True)
class VolumeData:
    """What one body, its ``name``, has lost in some tests.

    ``energy`` ``(n,)`` [N mm] is that of each test, ``volume`` ``(n,)`` [mm^3] what it has worn,
    with standard ``deviations`` ``(n,)`` if they are known, and ``amplitude`` ``(n,)`` [mm] that of
    the slip, where it counts.

    Examples
    --------
    What two bodies lost in the same tests:

    >>> import numpy as np
    >>> from wear.fitting import VolumeData
    >>> energy = np.array([1e6, 4e6])
    >>> lower, upper = (VolumeData(f"body_{k}", energy, k * 1e-9 * energy) for k in (1, 2))
    >>> print(upper.volume)
    [0.002 0.008]
    """

    name: str
    energy: Array
    volume: Array
    amplitude: Array | None = None
    deviations: Array | None = None

    def __post_init__(self) -> None:
        settle_columns(self, self.name, ("energy", "volume"), ("amplitude", "deviations"))
        if len(self.energy) != len(self.volume):
            raise FitError(
                f"{self.name}: {len(self.energy)} energies and {len(self.volume)} volumes; "
                "allowed: as many of both"
            )


@dataclass(frozen=True)
class VolumeLaw:
    """What of the law is asked for beside the coefficients.

    ``offset`` is what the line leaves on an axis. ``exponent`` m of the amplitude over
    ``reference`` [mm] is a number, or None if it is free.

    Examples
    --------
    With an exponent of 1 twice the amplitude wears twice as much for the same energy:

    >>> import numpy as np
    >>> from wear.fitting import VolumeLaw
    >>> law = VolumeLaw(exponent=1.0, reference=0.011)
    >>> print(law.volume(np.array([1e6, 1e6]), np.array([0.011, 0.022]), {"coefficient": 1e-9}))
    [0.001 0.002]
    """

    offset: Offset = "none"
    exponent: float | None = 0.0
    reference: float = 1.0

    def __post_init__(self) -> None:
        checks.choice("offset", self.offset, get_args(Offset), FitError)
        checks.numbers(self, "exponent", error=FitError)
        checks.numbers(self, "reference", above=0.0, error=FitError)

    @property
    def uses_amplitude(self) -> bool:
        """Whether the amplitude of the tests counts."""
        return self.exponent != 0.0

    def volume(self, energy: Array, amplitude: Array | None, values: Mapping[str, float]) -> Array:
        """Volume ``(n,)`` [mm^3] at an energy and amplitude, with the parameters by name."""
        energy = checks.array("energies", energy, None, error=FitError)
        if amplitude is not None:
            amplitude = checks.array("amplitudes", amplitude, energy.shape, error=FitError)
        beyond = np.maximum(energy - values.get(THRESHOLD, 0.0), 0.0)
        rise = values[COEFFICIENT] * beyond + values.get(INTERCEPT, 0.0)
        if not self.uses_amplitude or amplitude is None:
            return np.asarray(rise)
        power = values[EXPONENT] if self.exponent is None else self.exponent
        factor = (amplitude / self.reference) ** power
        return np.asarray(factor * values[COEFFICIENT] * beyond + values.get(INTERCEPT, 0.0))


@dataclass(frozen=True)
class VolumeFit:
    """The problem of some :class:`VolumeData` under a law.

    ``names`` has the place among the unknowns by body and parameter: the exponent of the amplitude
    is one for all bodies.
    """

    problem: FitProblem
    data: tuple[VolumeData, ...]
    law: VolumeLaw
    names: Mapping[tuple[str, str], int]

    def values_of(self, data: VolumeData, values: Array) -> dict[str, float]:
        """The parameters of one body by name, of all values ``(p,)``."""
        return _named(data, self.names, values)

    def curve(
        self, data: VolumeData, energy: Array, amplitude: Array | None
    ) -> Callable[[Array], Array]:
        """What all values ``(p,)`` make of a body's volume at an ``energy`` ``(m,)`` [N mm]."""
        return lambda values: self.law.volume(energy, amplitude, self.values_of(data, values))


def volume_problem(data: Sequence[VolumeData], law: VolumeLaw) -> VolumeFit:
    """Wear coefficients of bodies as a problem of :func:`fit`.

    Volumes may be below 0, of a body that gains. Raises FitError for energies below 0, numbers
    that are not finite, an amplitude that is needed and
    missing or not above 0, and a free exponent without amplitudes that differ.

    Examples
    --------
    Fantetti et al. 2019, table 3.1, tests 3 to 5 of 22 µm: the slope of volume against energy, with
    what wears early as an intercept.

    >>> import numpy as np
    >>> from wear.fitting import VolumeData, VolumeLaw, fit, volume_problem
    >>> tests = VolumeData(
    ...     "both", 1e3 * np.array([500.0, 2900.0, 7100.0]), 1e-3 * np.array([3.2, 7.3, 12.7])
    ... )
    >>> found = fit(volume_problem([tests], VolumeLaw(offset="intercept")).problem)
    >>> coefficient = found.estimates[0]
    >>> print(f"{1e12 * coefficient.value:.0f} um^3/J, ± {1e12 * coefficient.deviation:.0f}")
    1422 um^3/J, ± 110
    """
    for one in data:
        _check(one, law)
    require_unlike([one.name for one in data])
    names: dict[tuple[str, str], int] = {}
    unknowns: list[Unknown] = []
    for one in data:
        for name, unknown in _unknowns(one, law):
            if name != EXPONENT or (data[0].name, EXPONENT) not in names:
                unknowns.append(unknown)
                names[one.name, name] = len(unknowns) - 1
            else:
                names[one.name, name] = names[data[0].name, EXPONENT]
    series = tuple(Series(one.name, one.volume, one.deviations) for one in data)

    def predict(values: Array) -> Array:
        volumes = [
            law.volume(one.energy, one.amplitude, _named(one, names, values)) for one in data
        ]
        return np.concatenate(volumes)

    starts = _starts(data, law, names)
    problem = FitProblem(tuple(unknowns), series, predict, starts)
    return VolumeFit(problem, tuple(data), law, names)


def _named(
    data: VolumeData, names: Mapping[tuple[str, str], int], values: Array
) -> dict[str, float]:
    return {
        name: float(values[place]) for (body, name), place in names.items() if body == data.name
    }


def _check(data: VolumeData, law: VolumeLaw) -> None:
    if not np.isfinite(data.volume).all():
        raise FitError(f"{data.name}: a volume is not finite; allowed: finite numbers")
    if not (np.isfinite(data.energy).all() and (data.energy >= 0.0).all()):
        raise FitError(f"{data.name}: an energy below 0 or not finite; allowed: 0 or above")
    if not (data.energy > 0.0).any():
        raise FitError(f"{data.name}: no energy above 0; allowed: tests that dissipate")
    if not law.uses_amplitude:
        return
    if data.amplitude is None or not (data.amplitude > 0.0).all():
        raise FitError(f"{data.name}: an amplitude is missing or not above 0; allowed: above 0")
    if law.exponent is None and np.ptp(data.amplitude) == 0.0:
        raise FitError(
            f"{data.name}: one amplitude, which cannot tell its exponent; allowed: tests at several"
        )


def _unknowns(data: VolumeData, law: VolumeLaw) -> list[tuple[str, Unknown]]:
    """The free parameters of one body."""
    largest, most = float(data.energy.max()), float(np.abs(data.volume).max())
    unknowns = [(COEFFICIENT, Unknown(f"{data.name}.{COEFFICIENT}", lower=0.0))]
    if law.offset == THRESHOLD:
        free = Unknown(f"{data.name}.{THRESHOLD}", 0.0, largest, size=largest)
        unknowns.append((THRESHOLD, free))
    if law.offset == INTERCEPT:
        unknowns.append((INTERCEPT, Unknown(f"{data.name}.{INTERCEPT}", size=most)))
    if law.exponent is None:
        free = Unknown(EXPONENT, -LARGEST_EXPONENT, LARGEST_EXPONENT, size=1.0)
        unknowns.append((EXPONENT, free))
    return unknowns


def _starts(
    data: Sequence[VolumeData], law: VolumeLaw, names: Mapping[tuple[str, str], int]
) -> list[Array]:
    """Values ``(p,)`` for some thresholds and exponents, and the coefficients that go with them."""
    shares = np.linspace(0.0, 0.5, THRESHOLDS) if law.offset == THRESHOLD else (0.0,)
    powers = EXPONENTS if law.exponent is None else (law.exponent,)
    starts = []
    for share, power in product(shares, powers):
        start = np.zeros(max(names.values()) + 1)
        for one in data:
            found = _linear(one, replace(law, exponent=power), float(share * one.energy.max()))
            found[EXPONENT] = power
            for (body, name), place in names.items():
                if body == one.name:
                    start[place] = found[name]
        starts.append(start)
    return starts


def _linear(data: VolumeData, law: VolumeLaw, threshold: float) -> dict[str, float]:
    """Coefficient and intercept where all else is known."""
    one = law.volume(data.energy, data.amplitude, {COEFFICIENT: 1.0, THRESHOLD: threshold})
    columns = np.stack([one, np.full_like(one, float(law.offset == INTERCEPT))], axis=1)
    size = np.array([one.max(), 1.0])
    found = np.linalg.lstsq(columns / size, data.volume, rcond=None)[0] / size
    coefficient = max(float(found[0]), 0.0)
    return {COEFFICIENT: coefficient, INTERCEPT: float(found[1]), THRESHOLD: threshold}
