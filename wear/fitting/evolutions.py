"""Fits of joint parameters as functions of the dissipated energy, as in :mod:`wear.joints`.

Each quantity is an initial value times a function of the energy E. For given rates the product is
linear in the other parameters, so that no initial guess is needed: rates are tried on a grid of
powers of ten, and the other parameters follow in closed form (variable projection of Golub and
Pereyra 1973, SIAM J. Numer. Anal. 10, 413, on a grid). The solver starts from the best few.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

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
from wear.joints.evolution import (
    ArrheniusEvolution,
    ExponentialEvolution,
    LinearEvolution,
    LogarithmicEvolution,
    WearFunction,
)

STARTS = 4
"""Number of the best rates from which the solver starts."""

PER_DECADE = 2
"""Number of rates tried in each power of ten."""

DECADES = {"scale": (-3.0, 2.0), "rate": (-2.0, 2.0), "second_rate": (-2.0, 2.0)}
"""Powers of ten by which the range of rates that are tried exceeds that of the energies: from the
inverse of the largest energy to that of the smallest, and for a scale that of the energies."""

LATE = 13.0
"""Additional powers of ten that are tried for a logarithm, which still rises far beyond 1/rate."""

REACH = 1e6
"""Factor by which the bounds of a rate exceed the rates that are tried."""

HELD_WEIGHT = 1e3
"""Weight of a held initial value relative to the data, in the search for initial values."""

INITIAL = "initial"
"""Name of the value at zero energy, which every function has in addition to its parameters."""


@dataclass(frozen=True)
class EvolutionForm:
    """Form of a function of the energy for the fit.

    Attributes
    ----------
    function
        Function of the energy for given parameters by name.
    bounds
        Bounds of its linear parameters by name.
    rates
        Names of its other parameters.
    columns
        Functions of E, for given rates, of which it is a linear combination.
    parts
        Linear parameters from the coefficients of this combination.
    """

    function: Callable[[Mapping[str, float]], WearFunction]
    bounds: Mapping[str, tuple[float, float]]
    rates: tuple[str, ...]
    columns: Callable[[Array, Mapping[str, float]], tuple[Array, ...]]
    parts: Callable[[Array], dict[str, float]]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return *self.bounds, *self.rates


def _change(coefficients: Array) -> dict[str, float]:
    first, second = coefficients
    return {INITIAL: first, "change": second / first}


def _slope(coefficients: Array) -> dict[str, float]:
    first, second = coefficients
    return {INITIAL: first, "slope": second / first}


def _exponentials(coefficients: Array) -> dict[str, float]:
    final, first, second = coefficients
    initial, decays = coefficients.sum(), first + second
    share = first / decays if decays else 0.5
    return {INITIAL: initial, "final": final / initial, "share": share}


def _single(coefficients: Array) -> dict[str, float]:
    initial = coefficients.sum()
    return {INITIAL: initial, "final": coefficients[0] / initial}


def _arrhenius(energy: Array, rates: Mapping[str, float]) -> Array:
    return ArrheniusEvolution(1.0, rates["scale"])(energy) - 1.0


def _decay(energy: Array, rate: float) -> Array:
    return np.asarray(np.exp(-rate * energy))


ANY, NOT_NEGATIVE, SHARE = (-np.inf, np.inf), (0.0, np.inf), (0.0, 1.0)
# Below -1 the final value of the parameter would be negative.
CHANGE = (-1.0, np.inf)

FORMS: Mapping[str, EvolutionForm] = {
    "logarithmic": EvolutionForm(
        lambda values: LogarithmicEvolution(values["change"], values["rate"]),
        {"change": CHANGE},
        ("rate",),
        lambda energy, rates: (np.ones_like(energy), np.log1p(rates["rate"] * energy)),
        _change,
    ),
    "arrhenius": EvolutionForm(
        lambda values: ArrheniusEvolution(values["change"], values["scale"]),
        {"change": CHANGE},
        ("scale",),
        lambda energy, rates: (np.ones_like(energy), _arrhenius(energy, rates)),
        _change,
    ),
    "linear": EvolutionForm(
        lambda values: LinearEvolution(values["slope"]),
        {"slope": ANY},
        (),
        lambda energy, rates: (np.ones_like(energy), energy),
        _slope,
    ),
    "exponential": EvolutionForm(
        lambda values: ExponentialEvolution(
            values["final"],
            -values["rate"],
            values.get("share", 1.0),
            -values.get("second_rate", 0.0),
        ),
        {"final": NOT_NEGATIVE, "share": SHARE},
        ("rate", "second_rate"),
        lambda energy, rates: (
            np.ones_like(energy),
            _decay(energy, rates["rate"]),
            _decay(energy, rates["second_rate"]),
        ),
        _exponentials,
    ),
}
"""Forms by the names that a case uses; rates are 0 or above, as in a case."""

SINGLE = EvolutionForm(
    FORMS["exponential"].function,
    {"final": NOT_NEGATIVE},
    ("rate",),
    lambda energy, rates: (np.ones_like(energy), _decay(energy, rates["rate"])),
    _single,
)
"""Form of a single exponential, without the second term."""


@dataclass(frozen=True)
class EvolutionData:
    """Measured values of one joint parameter against energy.

    Parameters
    ----------
    name
        Name of the joint parameter.
    energy
        Dissipated energy ``(n,)`` [N mm], 0 or above.
    values
        Values of the parameter ``(n,)``.
    form
        Function of the energy, a key of ``FORMS``.
    held
        Values of parameters of the function that are not free, by name; ``initial`` is the value at
        zero energy.
    deviations
        Standard deviations of the values ``(n,)``, if they are known.

    Examples
    --------
    Friction with a known initial value:

    >>> import numpy as np
    >>> from wear.fitting import EvolutionData
    >>> energy, friction = np.array([1e3, 1e4, 1e5]), np.array([0.3, 0.5, 0.7])
    >>> rising = EvolutionData("friction", energy, friction, "logarithmic", {"initial": 0.1})
    >>> rising.free
    ('change', 'rate')
    """

    name: str
    energy: Array
    values: Array
    form: str
    held: Mapping[str, float] = field(default_factory=dict)
    deviations: Array | None = None

    def __post_init__(self) -> None:
        settle_columns(self, self.name, ("energy", "values"), ("deviations",))
        if len(self.energy) != len(self.values):
            raise FitError(
                f"{self.name}: {len(self.energy)} energies and {len(self.values)} values; allowed: "
                "as many of both"
            )
        checks.choice(f"form of {self.name}", self.form, list(FORMS), FitError)
        for name, value in self.held.items():
            checks.choice(
                f"held of {self.name}", name, (INITIAL, *FORMS[self.form].names), FitError
            )
            checks.number(f"{self.name}.{name}", value, error=FitError)

    @property
    def shape(self) -> EvolutionForm:
        """Form of the function, without terms that are held at 0."""
        if self.form == "exponential" and self.held.get("share") == 1.0:
            return SINGLE
        return FORMS[self.form]

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free parameters."""
        return tuple(name for name in (INITIAL, *self.shape.names) if name not in self.held)

    def at(self, energy: Array, values: Mapping[str, float]) -> Array:
        """Return the joint parameter at an ``energy``, for ``values`` of the free parameters."""
        all_values = {**self.held, **values}
        return np.asarray(all_values[INITIAL] * self.shape.function(all_values)(energy))


@dataclass(frozen=True)
class EvolutionFit:
    """Problem of a fit of :class:`EvolutionData`.

    ``names`` maps data and parameter to the index among the unknowns. A shared parameter has the
    same index for all data.
    """

    problem: FitProblem
    data: tuple[EvolutionData, ...]
    names: Mapping[tuple[str, str], int]

    def values_of(self, data: EvolutionData, values: Array) -> dict[str, float]:
        """Return the free parameters of ``data`` by name, from all ``values`` ``(p,)``."""
        return _named(data, self.names, values)

    def curve(self, data: EvolutionData, energy: Array) -> Callable[[Array], Array]:
        """Return a function from all values ``(p,)`` to the joint parameter ``(m,)``.

        The joint parameter is that of ``data`` at an ``energy`` ``(m,)`` [N mm].
        """
        return lambda values: data.at(energy, self.values_of(data, values))


def evolution_problem(data: Sequence[EvolutionData], shared: Sequence[str] = ()) -> EvolutionFit:
    """Return a problem of :func:`fit` for joint parameters as functions of the energy.

    ``shared`` are the names of parameters that have the same value in all data where they are free,
    as the rates of Li et al. 2020, table A1. Raises FitError for energies below 0, values that are
    not finite, data without energies above 0, and a shared parameter that is free in none of them.

    Examples
    --------
    The loss of preload of a bolt, from data without error:

    >>> import numpy as np
    >>> from wear.fitting import EvolutionData, evolution_problem, fit
    >>> energy = np.linspace(0.0, 8e6, 9)
    >>> preload = 745.0 * (0.72 + 0.28 * np.exp(-0.3e-6 * energy))
    >>> bolt = EvolutionData(
    ...     "normal_load", energy, preload, "exponential", held={"share": 1.0, "second_rate": 0.0}
    ... )
    >>> for estimate in fit(evolution_problem([bolt]).problem).estimates:
    ...     print(f"{estimate.name}: {estimate.value:.4g}")
    normal_load.initial: 745
    normal_load.final: 0.72
    normal_load.rate: 3e-07
    """
    for one in data:
        _check(one)
    require_distinct_names([one.name for one in data])
    names, unknowns = _unknowns(data, shared)
    series = tuple(Series(one.name, one.values, one.deviations) for one in data)

    def predict(values: Array) -> Array:
        return np.concatenate([one.at(one.energy, _named(one, names, values)) for one in data])

    starts = _starts(data, shared, names)
    return EvolutionFit(FitProblem(unknowns, series, predict, starts), tuple(data), names)


def _check(data: EvolutionData) -> None:
    if not (np.isfinite(data.energy).all() and np.isfinite(data.values).all()):
        raise FitError(f"{data.name}: a number is not finite; allowed: finite numbers")
    if not (data.energy >= 0.0).all():
        raise FitError(f"{data.name}: an energy below 0; allowed: 0 or above")
    if not (data.energy > 0.0).any():
        raise FitError(f"{data.name}: no energy above 0; allowed: data of a joint that wears")


def _named(
    data: EvolutionData, names: Mapping[tuple[str, str], int], values: Array
) -> dict[str, float]:
    return {name: float(values[names[data.name, name]]) for name in data.free}


def _unknowns(
    data: Sequence[EvolutionData], shared: Sequence[str]
) -> tuple[dict[tuple[str, str], int], tuple[FreeParameter, ...]]:
    """Return the index of each free parameter among the unknowns, and the unknowns."""
    for name in shared:
        if not any(name in one.free for one in data):
            raise FitError(f"{name}: shared, but not free in any data; allowed: a free parameter")
    largest = max(one.energy.max() for one in data)
    smallest = min(one.energy[one.energy > 0.0].min() for one in data)
    names: dict[tuple[str, str], int] = {}
    unknowns: dict[str, FreeParameter] = {}
    for one in data:
        for name in one.free:
            full_name = name if name in shared else f"{one.name}.{name}"
            unknowns.setdefault(full_name, _unknown(one, name, full_name, (smallest, largest)))
            names[one.name, name] = list(unknowns).index(full_name)
    return names, tuple(unknowns.values())


def _unknown(
    data: EvolutionData, name: str, full_name: str, energies: tuple[float, float]
) -> FreeParameter:
    if name == INITIAL:
        return FreeParameter(full_name, lower=0.0)
    if name in data.shape.rates:
        lowest, highest = _rate_range(data, name, energies)
        return FreeParameter(full_name, lowest / REACH, highest * REACH, logarithmic=True)
    lower, upper = data.shape.bounds[name]
    return FreeParameter(
        full_name, lower, upper, size=1.0 / energies[1] if name == "slope" else 1.0
    )


def _rate_range(
    data: EvolutionData, name: str, energies: tuple[float, float]
) -> tuple[float, float]:
    """Return the lowest and highest rate that is tried; a scale is an energy."""
    smallest, largest = energies
    below, above = DECADES[name]
    if name == "scale":
        return smallest * 10.0**below, largest * 10.0**above
    more = LATE if data.form == "logarithmic" else 0.0
    return 10.0**below / largest, 10.0 ** (above + more) / smallest


# --- initial values -----------------------------------------------------------------------------


def _starts(
    data: Sequence[EvolutionData],
    shared: Sequence[str],
    names: Mapping[tuple[str, str], int],
) -> list[Array]:
    """Return initial values ``(p,)`` for the best rates of a grid, the best first."""
    common = [name for name in shared if any(name in one.shape.rates for one in data)]
    ranked: list[tuple[float, list[list[dict[str, float]]]]] = []
    for rates in _grid(data, common):
        choices = [_ranked(one, rates) for one in data]
        cost = sum(choice[0][0] for choice in choices)
        ranked.append((cost, [[values for _, values in choice] for choice in choices]))
    ranked.sort(key=lambda one: one[0])
    if common:
        return [_start(data, names, [choice[0] for choice in one]) for _, one in ranked[:STARTS]]
    (_, choices_of), *_ = ranked
    return [
        _start(data, names, [choice[min(k, len(choice) - 1)] for choice in choices_of])
        for k in range(max(min(STARTS, len(choice)) for choice in choices_of))
    ]


def _start(
    data: Sequence[EvolutionData],
    names: Mapping[tuple[str, str], int],
    values: Sequence[Mapping[str, float]],
) -> Array:
    start = np.zeros(max(names.values()) + 1)
    for one, found in zip(data, values, strict=True):
        for name in one.free:
            start[names[one.name, name]] = found[name]
    return start


def _ranked(
    data: EvolutionData, common: Mapping[str, float]
) -> list[tuple[float, dict[str, float]]]:
    """Return cost and values for the rates of ``data`` alone on their grid, the best first.

    ``common`` are the values of shared rates.
    """
    known = {**data.held, **{k: v for k, v in common.items() if k in data.free}}
    own = [name for name in data.shape.rates if name not in known]
    found = [_linear(data, {**known, **rates}) for rates in _grid([data], own)]
    return sorted(found, key=lambda one: one[0])


def _grid(data: Sequence[EvolutionData], names: Sequence[str]) -> Iterator[dict[str, float]]:
    """Yield combinations of rates; the first of two exponentials is the slower one."""
    if not names:
        yield {}
        return
    largest = max(one.energy.max() for one in data)
    smallest = min(one.energy[one.energy > 0.0].min() for one in data)
    lines = []
    for name in names:
        one = next(one for one in data if name in one.shape.rates)
        lowest, highest = _rate_range(one, name, (smallest, largest))
        count = 1 + round(PER_DECADE * np.log10(highest / lowest))
        lines.append(np.geomspace(lowest, highest, count).tolist())
    for values in product(*lines):
        rates = dict(zip(names, values, strict=True))
        if rates.get("rate", 0.0) < rates.get("second_rate", np.inf):
            yield rates


def _linear(data: EvolutionData, known: Mapping[str, float]) -> tuple[float, dict[str, float]]:
    """Return the cost and the values of the free parameters for known rates.

    Of other held parameters only the initial value is used.
    """
    columns = np.stack(data.shape.columns(data.energy, known), axis=1)
    weights = np.ones(len(data.values))
    if data.deviations is not None:
        weights /= data.deviations
    left, right = columns * weights[:, None], data.values * weights
    if INITIAL in known:
        new = np.stack(data.shape.columns(np.zeros(1), known), axis=1)
        left = np.vstack([left, HELD_WEIGHT * weights.max() * new])
        right = np.append(right, HELD_WEIGHT * weights.max() * known[INITIAL])
    coefficients = np.asarray(np.linalg.lstsq(left, right, rcond=None)[0], dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = {**data.shape.parts(coefficients), **known}
    values = {name: _allowed(data, name, parts[name]) for name in data.free}
    residuals = data.at(data.energy, values) - data.values
    size = float(np.abs(data.values).max()) or 1.0
    cost = float(np.sum((residuals * weights) ** 2)) / float(size * weights.max()) ** 2
    return cost, values


def _allowed(data: EvolutionData, name: str, value: float) -> float:
    """Return ``value`` within its bounds, or 1 if it is not finite."""
    lower, upper = data.shape.bounds.get(name, NOT_NEGATIVE)
    return float(np.clip(value, lower, upper)) if np.isfinite(value) else 1.0
