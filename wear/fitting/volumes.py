"""Wear coefficients from worn volumes against dissipated energy.

The law is V = α (δ/δ_ref)^m max(E - E0, 0) + V0, with a coefficient α of each body and a power m of
the slip amplitude δ (0: the energy law; 1: Gallego et al. 2007, eq. 2). The line through the data
may have an offset on one of the axes: a threshold E0 of energy before wear begins (Fouvry et al.
2003, Wear 255, 287), or a volume V0 at zero energy, for surfaces that wear faster at first.
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
    FreeParameter,
    Series,
    require_distinct_names,
    settle_columns,
)

Offset = Literal["none", "threshold", "intercept"]
COEFFICIENT, THRESHOLD, INTERCEPT, EXPONENT = "coefficient", "threshold", "intercept", "exponent"

EXPONENTS = (0.0, 1.0)
"""Initial values of the exponent of the amplitude: those of the two laws."""

LARGEST_EXPONENT = 10.0
"""Bound on the size of the exponent of the amplitude."""

THRESHOLDS = 5
"""Number of initial values of the threshold, from 0 to half of the largest energy."""


@dataclass(frozen=True)
class VolumeData:
    """Worn volumes of one body in several tests.

    Parameters
    ----------
    name
        Name of the body.
    energy
        Dissipated energy of each test ``(n,)`` [N mm].
    volume
        Worn volume of each test ``(n,)`` [mm^3].
    amplitude
        Slip amplitude of each test ``(n,)`` [mm], if the law depends on it.
    deviations
        Standard deviations of the volumes ``(n,)`` [mm^3], if they are known.

    Examples
    --------
    Worn volumes of two bodies in the same tests:

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
    """Form of the wear law.

    Parameters
    ----------
    offset
        Offset of the line: a ``threshold`` of energy, an ``intercept`` of volume, or ``none``.
    exponent
        Exponent m of the amplitude, or None if it is free.
    reference
        Reference amplitude [mm].

    Examples
    --------
    With an exponent of 1, twice the amplitude wears twice as much for the same energy:

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
        """True if the law depends on the amplitude of the tests."""
        return self.exponent != 0.0

    def volume(self, energy: Array, amplitude: Array | None, values: Mapping[str, float]) -> Array:
        """Return the volume ``(n,)`` [mm^3] at an energy and amplitude.

        ``values`` are the parameters of the law by name.
        """
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
    """Problem of a fit of :class:`VolumeData` to a law.

    ``names`` maps body and parameter to the index among the unknowns. All bodies have the same
    exponent of the amplitude.
    """

    problem: FitProblem
    data: tuple[VolumeData, ...]
    law: VolumeLaw
    names: Mapping[tuple[str, str], int]

    def values_of(self, data: VolumeData, values: Array) -> dict[str, float]:
        """Return the parameters of one body by name, from all ``values`` ``(p,)``."""
        return _named(data, self.names, values)

    def curve(
        self, data: VolumeData, energy: Array, amplitude: Array | None
    ) -> Callable[[Array], Array]:
        """Return a function from all values ``(p,)`` to the volume of a body ``(m,)`` [mm^3].

        The volume is that at an ``energy`` ``(m,)`` [N mm] and an ``amplitude``.
        """
        return lambda values: self.law.volume(energy, amplitude, self.values_of(data, values))


def volume_problem(data: Sequence[VolumeData], law: VolumeLaw) -> VolumeFit:
    """Return a problem of :func:`fit` for the wear coefficients of bodies.

    Volumes may be negative, for a body that gains material. Raises FitError for energies below 0,
    numbers that are not finite, a required amplitude that is missing or not above 0, and a free
    exponent with equal amplitudes.

    Examples
    --------
    Fantetti et al. 2019, table 3.1, tests 3 to 5 with 22 µm: the slope of volume against energy,
    with early wear as an intercept.

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
    require_distinct_names([one.name for one in data])
    names: dict[tuple[str, str], int] = {}
    unknowns: dict[str, FreeParameter] = {}
    for one in data:
        for name, unknown in _unknowns(one, law):
            # The exponent has one name for all bodies.
            unknowns.setdefault(unknown.name, unknown)
            names[one.name, name] = list(unknowns).index(unknown.name)
    series = tuple(Series(one.name, one.volume, one.deviations) for one in data)

    def predict(values: Array) -> Array:
        volumes = [
            law.volume(one.energy, one.amplitude, _named(one, names, values)) for one in data
        ]
        return np.concatenate(volumes)

    starts = _starts(data, law, names)
    problem = FitProblem(tuple(unknowns.values()), series, predict, starts)
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


def _unknowns(data: VolumeData, law: VolumeLaw) -> list[tuple[str, FreeParameter]]:
    """Return the free parameters of one body with their names."""
    largest, most = float(data.energy.max()), float(np.abs(data.volume).max())
    unknowns = [(COEFFICIENT, FreeParameter(f"{data.name}.{COEFFICIENT}", lower=0.0))]
    if law.offset == THRESHOLD:
        free = FreeParameter(f"{data.name}.{THRESHOLD}", 0.0, largest, size=largest)
        unknowns.append((THRESHOLD, free))
    if law.offset == INTERCEPT:
        unknowns.append((INTERCEPT, FreeParameter(f"{data.name}.{INTERCEPT}", size=most)))
    if law.exponent is None:
        free = FreeParameter(EXPONENT, -LARGEST_EXPONENT, LARGEST_EXPONENT, size=1.0)
        unknowns.append((EXPONENT, free))
    return unknowns


def _starts(
    data: Sequence[VolumeData], law: VolumeLaw, names: Mapping[tuple[str, str], int]
) -> list[Array]:
    """Return initial values ``(p,)`` for several thresholds and exponents.

    The other parameters follow by linear least squares.
    """
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
    """Return the parameters with the best coefficient and intercept for a ``threshold``."""
    one = law.volume(data.energy, data.amplitude, {COEFFICIENT: 1.0, THRESHOLD: threshold})
    columns = np.stack([one, np.full_like(one, float(law.offset == INTERCEPT))], axis=1)
    size = np.array([one.max(), 1.0])
    found = np.linalg.lstsq(columns / size, data.volume, rcond=None)[0] / size
    coefficient = max(float(found[0]), 0.0)
    return {COEFFICIENT: coefficient, INTERCEPT: float(found[1]), THRESHOLD: threshold}
