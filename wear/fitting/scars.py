"""Wear coefficients from worn depths and profiles, through a model that computes the scar.

What is measured along x is h = D(x - s; α) + c + t (x - x_m): the depth D that runs of a model have
for a coefficient α, moved by a shift s, a height c and a tilt t of the scan, which nobody knows and
which are fitted with α.

Runs are few, so D has to be known between them. A scar has an area V, a middle m and a half width w
(the root of its second moment about m); laid over each other by these, D = V/w g((x - m)/w), scars
of different α hardly differ, while their edges at one x do. ln V, ln w, m and g are polynomials in
ln α through the runs. A scar that stays similar to itself with V and w going as powers of α, as of
a cylinder or a sphere that wears, is met exactly by two runs. One run makes D proportional to α.

The gap of a contact knows both bodies together: D is that of the sum of their coefficients, of
which each body has lost its share. With a threshold E0 of energy before anything wears, a test that
dissipates E at a constant rate ends as one without it whose coefficients are less by 1 - E0/E: the
surfaces follow dh/dN = α f(h), in which α and the cycles after the threshold are one product.
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
from wear.fitting.problem import FitError, FitProblem, Series, Unknown, column, settle_columns

COEFFICIENT, THRESHOLD = "coefficient", "threshold"
SHIFT, HEIGHT, TILT = "shift", "height", "tilt"

BEYOND = 4.0
"""Factor from the runs on beyond which their powers of the coefficient are a guess: it goes on as
if depth were proportional to it."""

LEAST, MOST = 1e-6, 1e3
"""Coefficient of a body over the smallest and the largest of the runs: far beyond them, so that a
fit that ends there says so of itself."""

LATEST = 0.999
"""Threshold over the least energy of a test: all of them wear."""

SHIFTS = 81
"""Shifts tried to begin with, over the length of the scan to both sides: a few in each scar."""

THRESHOLDS = (0.0, 0.25, 0.5)
"""Tried to begin with, over the least energy of a test."""


@dataclass(frozen=True)
class ComputedScars:
    """What runs of a model have worn along one line.

    ``coefficients`` ``(r,)`` [1/MPa] of the runs, both bodies together, the places ``x`` ``(m,)``
    [mm] in rising order, and ``depth`` ``(r, m)`` [mm] of both; nothing is worn beyond the ends.
    Between places it is monotone cubic. Raises FitError for shapes that do not fit, coefficients
    that are not above 0 or not different, places that do not rise, and depths that are not finite,
    below 0, or 0 all along.

    Examples
    --------
    A cylinder that wears: eight times the coefficient is twice the width and four times the depth.
    Two runs tell it between them.

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
                f"{len(self.x)} places), of which there are at least 2"
            )
        if not (np.isfinite(self.depth).all() and (self.depth >= 0.0).all()):
            raise FitError("a computed depth is not finite or below 0; allowed: 0 or above")
        if not (np.diff(self.x) > 0.0).all():
            raise FitError("computed places do not rise; allowed: rising order")
        known = self.coefficients
        if not (known > 0.0).all() or len(np.unique(known)) < len(known) or not len(known):
            raise FitError("coefficients of runs: one is not above 0 or twice; allowed: unlike")
        if not (self.depth > 0.0).any(axis=1).all():
            raise FitError("a run has worn nothing along the line; allowed: a scar")

    @cached_property
    def _measures(self) -> tuple[Array, Array, Array]:
        """Area, middle and half width of each scar, each ``(r,)``."""
        area = trapezoid(self.depth, self.x)
        middle = trapezoid(self.depth * self.x, self.x) / area
        away = (self.x - middle[:, None]) ** 2
        return area, middle, np.sqrt(trapezoid(self.depth * away, self.x) / area)

    @cached_property
    def _profiles(self) -> list[PchipInterpolator]:
        return [PchipInterpolator(self.x, depth, extrapolate=False) for depth in self.depth]

    def depth_at(self, x: Array, coefficient: float) -> Array:
        """Depth ``(n,)`` [mm] at places ``(n,)`` [mm] for a coefficient [1/MPa]."""
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
        """All but one of the runs."""
        return ComputedScars(
            np.delete(self.coefficients, run), self.x, np.delete(self.depth, run, axis=0)
        )


def _lagrange(nodes: Array, place: float) -> Array:
    """Weights ``(r,)`` of values at nodes ``(r,)`` in their polynomial at a place."""
    own = np.eye(len(nodes), dtype=np.bool_)
    above = np.where(own, 1.0, place - nodes[None, :])
    below = np.where(own, 1.0, nodes[:, None] - nodes[None, :])
    return np.asarray(np.prod(above / below, axis=1))


@dataclass(frozen=True)
class ScarData:
    """A measured profile, its ``name``, and the ``runs`` that compute it.

    ``depth`` ``(n,)`` [mm], positive where something is worn, at ``x`` ``(n,)`` [mm], with standard
    ``deviations`` ``(n,)`` if they are known. It is that of the ``body``: body_1, body_2, or both
    together. Of an ``aligned`` one, such as depths against a face that did not wear, nothing is
    moved: shift, height and tilt are 0. ``held`` [1/MPa] is the coefficient of the other body where
    no profile tells it, ``energy`` [N mm] what the test dissipates, where a threshold is asked for.

    Examples
    --------
    Two depths against a face that did not wear:

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
        """What a height and a tilt add ``(n, 2)``, the tilt about the middle of the scan."""
        return np.stack([np.ones_like(self.x), self.x - 0.5 * (self.x[0] + self.x[-1])], axis=1)


@dataclass(frozen=True)
class ScarFit:
    """The ``problem`` of some ``data``.

    ``bodies`` are those whose coefficients are the first unknowns, in this order; with
    ``threshold`` that is the next.
    """

    problem: FitProblem
    data: tuple[ScarData, ...]
    bodies: tuple[str, ...]
    threshold: bool

    def error_of_runs(self, fit: Fit) -> Array:
        """How far the unknowns ``(p,)`` are off for want of runs, to first order.

        Relative for the coefficients. It is what they change by when each scar goes without the run
        nearest to the fitted coefficient, with the alignment fitted anew: of few runs more than
        their true error. NaN where a scar has one run. Add one at the fitted coefficient until this
        is small beside the deviation.
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
        """What a ``change`` ``(n,)`` [mm] of the computed depths does to the unknowns ``(p,)``.

        Relative for the coefficients, to first order: such as that from runs of other steps or
        another grid.
        """
        slopes = fit.slopes(self.problem.predict) / fit.deviations[:, None]
        inverse, _ = inverse_of(slopes)
        return np.asarray(inverse @ (-change / fit.deviations))

    def effective(self, data: ScarData, values: Array) -> float:
        """Coefficient [1/MPa] of both bodies that a run without a threshold would need."""
        alone = data.held if len(self.bodies) == 1 else 0.0
        total = float(values[: len(self.bodies)].sum()) + alone
        if not self.threshold:
            return total
        assert data.energy is not None
        return total * (1.0 - float(values[len(self.bodies)]) / data.energy)

    def predict(self, values: Array) -> Array:
        """All depths ``(n,)`` [mm] of the unknowns ``(p,)``."""
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
    """Wear coefficients of all profiles as a problem of :func:`fit`.

    The coefficient of each body that has a profile comes first, fitted as its logarithm; then the
    threshold [N mm], if it is asked for; shift [mm], height [mm] and tilt [1] of each profile
    follow. Raises FitError for profiles that are not in rising order or not finite, have less than
    five points or no scar, those of both together beside those of each, and a threshold without
    energies that differ.

    Examples
    --------
    A parabola worn with 2e-9 /MPa, scanned 0.1 mm off its place and tilted:

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
    # The solver's difference step is 6e-6 for whatever is below 1: of 1e-9 /MPa as it is, far too
    # long where depth is not proportional to it. A logarithm has the step of its own size.
    unknowns = [Unknown(f"{b}.{COEFFICIENT}", lower, upper, logarithmic=True) for b in bodies]
    if threshold:
        largest = _largest_threshold(data)
        unknowns.append(Unknown(THRESHOLD, 0.0, largest, size=largest))
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


def _alignment(data: ScarData) -> list[Unknown]:
    """Shift, height and tilt of one profile."""
    if data.aligned:
        return []
    length, most = float(np.ptp(data.x)), float(np.ptp(data.depth))
    return [
        Unknown(f"{data.name}.{SHIFT}", -length, length, size=length),
        Unknown(f"{data.name}.{HEIGHT}", size=most),
        Unknown(f"{data.name}.{TILT}", size=most / length),
    ]


def _check_together(data: Sequence[ScarData], bodies: Sequence[str], threshold: bool) -> None:
    for one in data:
        _check(one)
    if "both" in bodies and len(bodies) > 1:
        raise FitError(
            "profiles of both bodies together beside those of one; allowed: the former, or those "
            "of each"
        )
    energies = [one.energy for one in data]
    if threshold and (None in energies or len(set(energies)) < 2):
        raise FitError(
            "a threshold of energy, and all tests have one energy; allowed: tests that have "
            "dissipated more and less"
        )


def _check(data: ScarData) -> None:
    if len(data.x) < 1 or len(data.x) != len(data.depth):
        raise FitError(f"{data.name}: places and depths do not fit; allowed: as many of both")
    if not data.aligned and len(data.x) <= 4:
        raise FitError(
            f"{data.name}: {len(data.x)} points, which coefficient, shift, height and tilt meet; "
            "allowed: 5 or more"
        )
    if not (np.isfinite(data.x).all() and np.isfinite(data.depth).all()):
        raise FitError(f"{data.name}: a place or depth is not finite; allowed: finite numbers")
    if not (np.diff(data.x) > 0.0).all():
        raise FitError(f"{data.name}: places do not rise; allowed: rising order")


# --- starts -------------------------------------------------------------------------------------


def _starts(data: Sequence[ScarData], bodies: Sequence[str], threshold: bool) -> list[Array]:
    """Values ``(p,)`` as if wear were linear: of each profile the best of some shifts."""
    found = [_best_shift(one) for one in data]
    rest = [number for _, level in found for number in level]
    starts = []
    for share in THRESHOLDS if threshold else (0.0,):
        begun = share * _largest_threshold(data) if threshold else 0.0
        whole = [
            c / (1.0 - begun / (one.energy or 1.0)) for one, (c, _) in zip(data, found, strict=True)
        ]
        coefficients = [
            np.mean([c for one, c in zip(data, whole, strict=True) if one.body == body])
            for body in bodies
        ]
        starts.append(np.array([*coefficients, *[begun] * threshold, *rest]))
    return starts


def _best_shift(data: ScarData) -> tuple[float, list[float]]:
    """Coefficient, and shift, height and tilt if it has them, of the best of some shifts."""
    length = np.ptp(data.x)
    shifts = [0.0] if data.aligned else np.linspace(-length, length, SHIFTS)
    squares, coefficient, level = min(
        (_linear(data, float(shift)) for shift in shifts), key=lambda f: f[0]
    )
    if not np.isfinite(squares):
        raise FitError(
            f"{data.name}: no scar of the runs is in it, wherever they are laid; allowed: depth, "
            "above 0 where something is worn"
        )
    return coefficient, level


def _linear(data: ScarData, shift: float) -> tuple[float, float, list[float]]:
    """Sum of squares, coefficient, and alignment of the best line in α at a shift."""
    middle = float(np.median(data.runs.coefficients))
    worn = data.runs.depth_at(data.x - shift, middle)[:, None]
    columns = worn if data.aligned else np.concatenate([worn, data.alignment], axis=1)
    lengths = np.linalg.norm(columns, axis=0)
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    found = np.linalg.lstsq(columns / lengths, data.depth, rcond=None)[0] / lengths
    # What is not worn but grown is no scar: such a shift has the sum of squares of all.
    squares = np.sum((data.depth - columns @ found) ** 2) if found[0] > 0.0 else np.inf
    coefficient = max(float(found[0]), LEAST) * middle
    return float(squares), coefficient, [] if data.aligned else [shift, *map(float, found[1:])]
