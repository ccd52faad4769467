"""Wear coefficients from worn depths and profiles, with a model that computes the scar.

The measured profile along x is h = D(x - s; α) + c + t (x - x_m), where D is the depth computed by
runs of a model for a coefficient α. The shift s, the height c and the tilt t of the scan are
unknown and are fitted together with α.

There are few runs, so that D must be interpolated between them. A scar has an area V, a middle m
and a half width w (the root of its second moment about m). Scaled by these, D = V/w g((x - m)/w),
scars of different α hardly differ, although their edges do. ln V, ln w, m and g are interpolated by
polynomials in ln α through the runs. A scar that stays similar to itself, with V and w proportional
to powers of α, as that of a worn cylinder or sphere, is interpolated exactly by two runs. With a
single run D is proportional to α.

The gap of a contact depends on both bodies together: D is the depth for the sum of their
coefficients, of which each body has lost its share. With a threshold E0 of energy before wear
begins, a test that dissipates E at a constant rate ends like a test without threshold whose
coefficients are smaller by the factor 1 - E0/E: the surfaces follow dh/dN = α f(h), which depends
on the product of α and the cycles after the threshold only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.integrate import trapezoid
from scipy.interpolate import PchipInterpolator

from sa_solver import checks
from sa_solver.types import Array
from wear.fitting.estimates import inverse_of
from wear.fitting.least_squares import Fit
from wear.fitting.problem import FitError, FitProblem, FreeParameter, Series, column, settle_columns

COEFFICIENT, THRESHOLD = "coefficient", "threshold"
SHIFT, HEIGHT, TILT = "shift", "height", "tilt"

BEYOND = 4.0
"""Factor outside the range of the runs up to which the coefficient is extrapolated by powers.
Beyond it the depth is taken as proportional to the coefficient."""

LEAST, MOST = 1e-6, 1e3
"""Bounds of the coefficient of a body over the smallest and the largest of the runs. They are so
wide that a fit which ends there is visibly wrong."""

LATEST = 0.999
"""Largest threshold over the least energy of a test, so that all tests wear."""

SHIFTS = 81
"""Number of initial shifts, over the length of the scan in both directions: several per scar."""

THRESHOLDS = (0.0, 0.25, 0.5)
"""Initial values of the threshold over the least energy of a test."""


@dataclass(frozen=True)
class ComputedScars:
    """Worn depths along one line, computed by runs of a model.

    Between the points the depth is interpolated by monotone cubics; beyond the ends it is 0.

    Parameters
    ----------
    coefficients
        Wear coefficients of the runs, as the sum of both bodies ``(r,)`` [1/MPa].
    x
        Coordinates of the points in ascending order ``(m,)`` [mm].
    depth
        Worn depth of both bodies together ``(r, m)`` [mm].

    Raises
    ------
    FitError
        For shapes that do not agree, coefficients that are equal or not above 0, points that are
        not in ascending order, and depths that are not finite, below 0, or 0 along the whole line.

    Examples
    --------
    For a worn cylinder, eight times the coefficient gives twice the width and four times the depth.
    Two runs determine the scar for coefficients between theirs:

    >>> import numpy as np
    >>> from wear.fitting import ComputedScars
    >>> x = np.linspace(-1.0, 1.0, 2001)
    >>> scars = np.stack([np.maximum(b**2 - x**2, 0.0) for b in (0.4, 0.8)])
    >>> runs = ComputedScars(np.array([1e-9, 8e-9]), x, scars)
    >>> between = np.sqrt(8.0) * 1e-9
    >>> print(f"{runs.depth_at(np.array([0.0]), between)[0]:.4f}")
    0.3200
    """

    coefficients: Array
    x: Array
    depth: Array

    def __post_init__(self) -> None:
        settle_columns(self, "runs", ("coefficients", "x"))
        depth = checks.array("depths", self.depth, (None, None), error=FitError, finite=False)
        checks.settle(self, depth=depth)
        if self.depth.shape != (len(self.coefficients), len(self.x)) or len(self.x) < 2:
            raise FitError(
                f"depths of shape {self.depth.shape}; allowed: ({len(self.coefficients)} runs, "
                f"{len(self.x)} places), with at least 2 places"
            )
        if not (np.isfinite(self.depth).all() and (self.depth >= 0.0).all()):
            raise FitError("a computed depth is not finite or below 0; allowed: 0 or above")
        if not (np.diff(self.x) > 0.0).all():
            raise FitError("computed places do not rise; allowed: rising order")
        known = self.coefficients
        if not (known > 0.0).all() or len(np.unique(known)) < len(known) or not len(known):
            raise FitError(
                "coefficients of runs: one is not above 0 or occurs twice; allowed: different "
                "values above 0"
            )
        if not (self.depth > 0.0).any(axis=1).all():
            raise FitError("a run has worn nothing along the line; allowed: a scar")

    @cached_property
    def _measures(self) -> tuple[Array, Array, Array]:
        """Area, middle and half width of the scars, each ``(r,)``."""
        area = trapezoid(self.depth, self.x)
        middle = trapezoid(self.depth * self.x, self.x) / area
        squares = (self.x - middle[:, None]) ** 2
        return area, middle, np.sqrt(trapezoid(self.depth * squares, self.x) / area)

    @cached_property
    def _profiles(self) -> list[PchipInterpolator]:
        return [PchipInterpolator(self.x, depth, extrapolate=False) for depth in self.depth]

    def depth_at(self, x: Array, coefficient: float) -> Array:
        """Return the depth ``(n,)`` [mm] at points ``x`` [mm] for a ``coefficient`` [1/MPa]."""
        x = column("runs", "x", x, finite=True)
        checks.number("coefficient", coefficient, above=0.0, error=FitError)
        areas, middles, widths = self._measures
        known = np.log(self.coefficients)
        room = np.log(BEYOND)
        place = np.clip(np.log(coefficient), known.min() - room, known.max() + room)
        weights = _lagrange(known, float(place))
        area = coefficient * np.exp(weights @ np.log(areas / self.coefficients))
        width = np.exp(weights @ np.log(widths))
        along = (x - weights @ middles) / width
        shape = sum(
            weight * half / size * np.nan_to_num(profile(middle + half * along), nan=0.0)
            for weight, half, size, middle, profile in zip(
                weights, widths, areas, middles, self._profiles, strict=True
            )
        )
        return np.asarray(area / width * shape)

    def without(self, run: int) -> ComputedScars:
        """Return all runs but one."""
        return ComputedScars(
            np.delete(self.coefficients, run), self.x, np.delete(self.depth, run, axis=0)
        )


def _lagrange(nodes: Array, place: float) -> Array:
    """Return the weights ``(r,)`` of values at ``nodes`` in their polynomial at ``place``."""
    own = np.eye(len(nodes), dtype=np.bool_)
    above = np.where(own, 1.0, place - nodes[None, :])
    below = np.where(own, 1.0, nodes[:, None] - nodes[None, :])
    return np.asarray(np.prod(above / below, axis=1))


@dataclass(frozen=True)
class ScarData:
    """Measured profile of a scar, and the runs that compute it.

    Parameters
    ----------
    name
        Name of the profile.
    x
        Coordinates of the points ``(n,)`` [mm].
    depth
        Depth ``(n,)`` [mm], positive where material is worn.
    runs
        Computed scars.
    aligned
        Whether the shift, height and tilt of the profile are 0, as for depths that are measured
        from a face that did not wear.
    deviations
        Standard deviations of the depth ``(n,)`` [mm], if they are known.
    body
        Body of the profile: ``body_1``, ``body_2``, or ``both`` together.
    held
        Coefficient of the other body [1/MPa], if there is no profile of it.
    energy
        Energy that the test dissipates [N mm], required for a threshold.

    Examples
    --------
    Two depths measured from a face that did not wear:

    >>> import numpy as np
    >>> from wear.fitting import ComputedScars, ScarData
    >>> runs = ComputedScars(np.array([1e-9]), np.array([-1.0, 1.0]), np.full((1, 2), 0.01))
    >>> place, depth = np.array([-0.5, 0.5]), np.array([0.021, 0.019])
    >>> depths = ScarData("flat", place, depth, runs, aligned=True)
    """

    name: str
    x: Array
    depth: Array
    runs: ComputedScars
    aligned: bool = False
    deviations: Array | None = None
    body: str = "both"
    held: float = 0.0
    energy: float | None = None

    def __post_init__(self) -> None:
        settle_columns(self, self.name, ("x", "depth"), ("deviations",))
        checks.choice(f"body of {self.name}", self.body, ("body_1", "body_2", "both"), FitError)
        checks.numbers(self, "held", least=0.0, error=FitError)
        checks.numbers(self, "energy", above=0.0, error=FitError)

    @property
    def alignment(self) -> Array:
        """Depth ``(n, 2)`` due to unit height and unit tilt about the middle of the scan."""
        return np.stack([np.ones_like(self.x), self.x - 0.5 * (self.x[0] + self.x[-1])], axis=1)


@dataclass(frozen=True)
class ScarFit:
    """Problem of a fit of :class:`ScarData`.

    The first unknowns are the coefficients of the ``bodies``, in this order. If ``threshold`` is
    true, the next one is the threshold.
    """

    problem: FitProblem
    data: tuple[ScarData, ...]
    bodies: tuple[str, ...]
    threshold: bool

    def error_of_runs(self, fit: Fit) -> Array:
        """Return the error of the unknowns ``(p,)`` due to the small number of runs.

        It is the change of the unknowns, to first order, if the run nearest to the fitted
        coefficient is removed from each scar and the alignment is fitted again. The errors of
        coefficients are relative. For few runs the estimate is larger than the true error; for a
        scar with a single run it is NaN. Add runs at the fitted coefficient until the error is
        small compared with the deviation.
        """
        if any(len(one.runs.coefficients) < 2 for one in self.data):
            return np.full(len(fit.values), np.nan)
        fewer = []
        for one in self.data:
            total = self.effective(one, fit.values)
            nearest = int(np.abs(np.log(one.runs.coefficients / total)).argmin())
            fewer.append(replace(one, runs=one.runs.without(nearest)))
        return self.moved_by(fit, replace(self, data=tuple(fewer)).predict(fit.values) - fit.fitted)

    def moved_by(self, fit: Fit, change: Array) -> Array:
        """Return the change of the unknowns ``(p,)`` by a ``change`` of computed depths [mm].

        ``change`` ``(n,)`` may come from runs with other steps or another grid. The result is of
        first order, and relative for the coefficients.
        """
        slopes = fit.slopes(self.problem.predict) / fit.deviations[:, None]
        inverse, _ = inverse_of(slopes)
        return np.asarray(inverse @ (-change / fit.deviations))

    def effective(self, data: ScarData, values: Array) -> float:
        """Return the coefficient of both bodies [1/MPa] for an equal run without threshold."""
        alone = data.held if len(self.bodies) == 1 else 0.0
        total = float(values[: len(self.bodies)].sum()) + alone
        if not self.threshold:
            return total
        assert data.energy is not None
        return total * (1.0 - float(values[len(self.bodies)]) / data.energy)

    def predict(self, values: Array) -> Array:
        """Return the depths of all data ``(n,)`` [mm] for ``values`` of the unknowns ``(p,)``."""
        depths, place = [], len(self.bodies) + self.threshold
        for one in self.data:
            effective = self.effective(one, values)
            alone = one.held if len(self.bodies) == 1 else 0.0
            own = float(values[self.bodies.index(one.body)])
            share = own / (float(values[: len(self.bodies)].sum()) + alone)
            if one.aligned:
                depths.append(share * one.runs.depth_at(one.x, effective))
                continue
            shift, *level = values[place : place + 3]
            worn = share * one.runs.depth_at(one.x - shift, effective)
            depths.append(worn + one.alignment @ level)
            place += 3
        return np.concatenate(depths)


def scar_problem(data: Sequence[ScarData], threshold: bool = False) -> ScarFit:
    """Return a problem of :func:`fit` for the wear coefficients of profiles.

    The first unknowns are the coefficients of the bodies with a profile, fitted as logarithms.
    Then follow the threshold [N mm], if ``threshold`` is true, and the shift [mm], height [mm] and
    tilt [1] of each profile.

    Raises FitError for profiles that are not in ascending order or not finite, that have less than
    five points or no scar, for profiles of both bodies together in addition to those of one, and
    for a threshold without different energies.

    Examples
    --------
    A parabola worn with 2e-9 /MPa, from a scan that is 0.1 mm off and tilted:

    >>> import numpy as np
    >>> from wear.fitting import ComputedScars, ScarData, fit, scar_problem
    >>> x = np.linspace(-2.0, 2.0, 81)
    >>> scar = 0.01 * np.maximum(1.0 - x**2, 0.0)
    >>> runs = ComputedScars(np.array([3e-9]), x, 1.5 * scar[None, :])
    >>> scan = ScarData("scan", x + 0.1, scar + 2e-3 * x, runs)
    >>> found = fit(scar_problem([scan]).problem)
    >>> coefficient, shift, _, tilt = found.values
    >>> print(f"{coefficient:.3g} /MPa, {shift:.3f} mm, {tilt:.1e}")
    2e-09 /MPa, 0.100 mm, 2.0e-03
    """
    bodies = tuple(dict.fromkeys(one.body for one in data))
    _check_together(data, bodies, threshold)
    known = np.concatenate([one.runs.coefficients for one in data])
    lower, upper = LEAST * known.min(), MOST * known.max()
    # The difference step of the solver is 6e-6 for all values below 1. For a coefficient of 1e-9
    # /MPa this is far too long where the depth is not proportional to it; for its logarithm it is
    # right.
    unknowns = [FreeParameter(f"{b}.{COEFFICIENT}", lower, upper, logarithmic=True) for b in bodies]
    if threshold:
        largest = _largest_threshold(data)
        unknowns.append(FreeParameter(THRESHOLD, 0.0, largest, size=largest))
    for one in data:
        unknowns += _alignment(one)
    series = tuple(Series(one.name, one.depth, one.deviations) for one in data)
    scars = ScarFit(
        FitProblem(
            tuple(unknowns),
            series,
            lambda values: scars.predict(values),
            _starts(data, bodies, threshold),
        ),
        tuple(data),
        bodies,
        threshold,
    )
    return scars


def _largest_threshold(data: Sequence[ScarData]) -> float:
    return LATEST * min(one.energy or 0.0 for one in data)


def _alignment(data: ScarData) -> list[FreeParameter]:
    """Return the shift, height and tilt of one profile as unknowns."""
    if data.aligned:
        return []
    length, most = float(np.ptp(data.x)), float(np.ptp(data.depth))
    return [
        FreeParameter(f"{data.name}.{SHIFT}", -length, length, size=length),
        FreeParameter(f"{data.name}.{HEIGHT}", size=most),
        FreeParameter(f"{data.name}.{TILT}", size=most / length),
    ]


def _check_together(data: Sequence[ScarData], bodies: Sequence[str], threshold: bool) -> None:
    for one in data:
        _check(one)
    if "both" in bodies and len(bodies) > 1:
        raise FitError(
            "profiles of both bodies together and of one of them; allowed: the former, or those of "
            "each body"
        )
    energies = [one.energy for one in data]
    if threshold and (None in energies or len(set(energies)) < 2):
        raise FitError(
            "a threshold of energy, and all tests have one energy; allowed: tests with different "
            "energies"
        )


def _check(data: ScarData) -> None:
    if len(data.x) < 1 or len(data.x) != len(data.depth):
        raise FitError(
            f"{data.name}: {len(data.x)} places and {len(data.depth)} depths; allowed: the same "
            "number of both, at least one"
        )
    if not data.aligned and len(data.x) <= 4:
        raise FitError(
            f"{data.name}: {len(data.x)} points, which coefficient, shift, height and tilt meet; "
            "allowed: 5 or more"
        )
    if not (np.isfinite(data.x).all() and np.isfinite(data.depth).all()):
        raise FitError(f"{data.name}: a place or depth is not finite; allowed: finite numbers")
    if not (np.diff(data.x) > 0.0).all():
        raise FitError(f"{data.name}: places do not rise; allowed: rising order")


# --- initial values -----------------------------------------------------------------------------


def _starts(data: Sequence[ScarData], bodies: Sequence[str], threshold: bool) -> list[Array]:
    """Return initial values ``(p,)`` for linear wear, with the best of several shifts.

    There is one for each initial threshold.
    """
    found = [_best_shift(one) for one in data]
    rest = [number for _, level in found for number in level]
    starts = []
    for share in THRESHOLDS if threshold else (0.0,):
        begin = share * _largest_threshold(data) if threshold else 0.0
        whole = [
            c / (1.0 - begin / (one.energy or 1.0)) for one, (c, _) in zip(data, found, strict=True)
        ]
        coefficients = [
            np.mean([c for one, c in zip(data, whole, strict=True) if one.body == body])
            for body in bodies
        ]
        starts.append(np.array([*coefficients, *[begin] * threshold, *rest]))
    return starts


def _best_shift(data: ScarData) -> tuple[float, list[float]]:
    """Return the coefficient and the alignment of the best of several shifts.

    The alignment is empty for aligned data.
    """
    length = np.ptp(data.x)
    shifts = [0.0] if data.aligned else np.linspace(-length, length, SHIFTS)
    squares, coefficient, level = min(
        (_linear(data, float(shift)) for shift in shifts), key=lambda f: f[0]
    )
    if not np.isfinite(squares):
        raise FitError(
            f"{data.name}: no scar of the runs is in it at any shift; allowed: depth, above 0 "
            "where material is worn"
        )
    return coefficient, level


def _linear(data: ScarData, shift: float) -> tuple[float, float, list[float]]:
    """Return the sum of squares, coefficient and alignment of the best linear fit at a shift."""
    middle = float(np.median(data.runs.coefficients))
    worn = data.runs.depth_at(data.x - shift, middle)[:, None]
    columns = worn if data.aligned else np.concatenate([worn, data.alignment], axis=1)
    lengths = np.linalg.norm(columns, axis=0)
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    found = np.linalg.lstsq(columns / lengths, data.depth, rcond=None)[0] / lengths
    # A negative coefficient is no scar: such a shift is excluded.
    squares = np.sum((data.depth - columns @ found) ** 2) if found[0] > 0.0 else np.inf
    coefficient = max(float(found[0]), LEAST) * middle
    return float(squares), coefficient, [] if data.aligned else [shift, *map(float, found[1:])]
