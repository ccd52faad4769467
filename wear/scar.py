"""The wear of one body between two scans of it: depth, volume, and how sure they are.

Both scans are laid over each other where nothing was worn, the rim: by a shift of parts of a point,
where the roughness tells it, and by the plane between them. What is left of the rim is noise of the
instrument, alignment and form together. It is correlated, so that its points are no independent
measurements: its covariance over the distance of points is taken from the rim. The volume is a
weighted sum over all points, those of the rim through the plane and the shift, and its variance is
that of such a sum (JCGM 100:2008, eq. 13). Patches of the rim as large as noise is correlated over
are the degrees of freedom of Student's t.

Calibration is not told by two scans of the same instrument, and is not in the error; nor are
stripes: noise is taken to be the same in all directions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sa_solver.errors import InputError
from sa_solver.surfaces.scans import Scan, filled, levelled, resampled, rms
from sa_solver.types import Array, Grid, Mask

RECOGNISED = 0.5
"""Correlation of both rims from which on their roughness tells the shift. Below it, more of what is
seen is noise than surface, and so it is whatever the shift."""

FARTHEST = 0.25
"""Largest shift that is looked for, in the size of the scans."""

SAME_PLACE, MOST_SHIFTS = 1e-3, 30
"""Change of the shift in points at which it is found, and cap on the changes: they fall by a factor
of ten and more where the roughness is seen by several points a wave."""

CLEAR = 3.0
"""Standard deviations of smoothed noise above which a depth is worn."""

SMOOTHED = 5
"""Points across the mean that is held against it: a scar is many points wide."""

BY_AND_BY = 0.3, 0.1
"""Shares of the largest depth that a scar begins to be found with: the first plane goes through all
points, the scar's too, and makes a bowl of the rim."""

MARGIN = 0.15
"""What is added around a worn area that was found, in the radius of a disk as large: its edge runs
out below the noise."""

SOFTENED = 1.0
"""Deviation in points of the mean that slopes of one scan are taken of: of white noise a quarter is
left, of waves of ten points 80 %."""

FEWEST_PATCHES = 5
"""Independent patches of a rim below which its noise is hardly known: t is 2.6 there."""

NEIGHBOURS = 4
"""Rings of points, the one itself included, whose covariance always counts: a shift by parts of a
point spreads noise over them, and less may be found where chance makes the first of them negative.
"""

FARTHER = 1.2
"""How much farther than where it first falls to 0 covariance counts: what is fitted to the rim is
taken off it, and it looks shorter than it is.
"""

FEWEST_POINTS = 100
"""Points of a rim below which nothing is measured."""

MOSTLY = 0.5
"""Share of a larger point that is missing from which on it is."""

ALIKE = 1e-6
"""Share of the pitch by which scans of the same points may differ."""


@dataclass(frozen=True)
class Scar:
    """What a body lost between two scans of ``pitch`` (dx, dy) [mm].

    ``depth`` ``(nx, ny)`` [mm] is what it lost, NaN where either scan has no point, and ``worn``
    the area ``(nx, ny)`` that counts. ``volume`` [mm³] is the sum over it and ``volume_error`` its
    95 % bound; ``deepest`` [mm] the largest mean of 3 x 3 points, ``depth_error`` that of the mean
    there, what plane and shift leave among it: the largest of many is too large by about as much as
    its noise. ``noise`` [mm] is the root mean square
    over the rim, ``length`` [mm] how far it is correlated, and ``patches`` how many independent
    ones the rim has: below 5 (``sure`` is false) errors are hardly known. Where the rim has no
    noise at all, which no two measurements have, all bounds, ``length`` and ``patches`` are None.
    ``shift`` [mm] is where the second scan lies on the first, None where no roughness tells it, and
    ``shift_error`` [mm] its 95 % bounds.
    ``missing`` is the share of the worn area without a depth of its own, which its surroundings
    give.
    """

    depth: Array
    worn: Mask
    pitch: tuple[float, float]
    volume: float
    volume_error: float | None
    deepest: float
    depth_error: float | None
    noise: float
    length: float | None
    patches: float | None
    shift: tuple[float, float] | None
    shift_error: tuple[float, float] | None
    missing: float

    @property
    def sure(self) -> bool:
        """Whether the rim has noise, and is large enough for it to be known."""
        return self.patches is not None and self.patches >= FEWEST_PATCHES

    @property
    def area(self) -> float:
        """Of what counts as worn [mm²]."""
        return float(np.count_nonzero(self.worn)) * self.pitch[0] * self.pitch[1]


def measure_scar(before: Scan, after: Scan, worn: Mask | None = None) -> Scar:
    """Depth and volume that a body lost between two scans, with 95 % bounds.

    ``worn`` ``(nx, ny)`` are the points of the second scan where wear is looked for: all of the
    scar, and no more of the rim than need be. Without it, the largest area that is clearly deeper
    than noise, and some more around it. Scans of other points are averaged onto those of the
    coarser one, as far as both reach.

    Raises InputError where nothing clear is found, or not enough rim is left, or where heights are
    so large that their squares are no numbers.

    Examples
    --------
    A spherical cap of 4 µm, from two scans with noise of 0.2 µm and a tilt:

    >>> import numpy as np
    >>> from sa_solver import Grid
    >>> from sa_solver.surfaces.scans import Scan
    >>> from wear.scar import measure_scar
    >>> rng, grid = np.random.default_rng(1), Grid.covering((1.0, 1.0), (100, 100))
    >>> cap = np.maximum(4e-3 - (grid.x**2 + grid.y**2) / 20.0, 0.0)
    >>> before, noise = 2e-4 * rng.normal(size=(2, 100, 100))
    >>> scar = measure_scar(
    ...     Scan(before, grid.pitch), Scan(noise - cap + 0.02 * grid.x, grid.pitch)
    ... )
    >>> exact = np.pi * 10.0 * 4e-3**2
    >>> print(f"{scar.volume * 1e4:.2f} +- {scar.volume_error * 1e4:.2f} of {exact * 1e4:.2f}")
    5.05 +- 0.05 of 5.03
    """
    if before.heights.shape[1] == 1 or after.heights.shape[1] == 1:
        raise InputError("a profile has no volume: give scans of several columns")
    first, second, gone = _on_same_points(before, after, worn is not None)
    if worn is not None and worn.shape != after.heights.shape:
        raise InputError(
            f"a worn area of {worn.shape} points: give one of the second scan's "
            f"{after.heights.shape}"
        )
    overlay = _Overlay(first, second, gone)
    if worn is None:
        worn = overlay.find()
    overlay.align(~worn)
    return _measured(overlay, worn)


def _on_same_points(before: Scan, after: Scan, given: bool) -> tuple[Scan, Scan, tuple[Mask, Mask]]:
    """Both scans on the same points, none missing, and which were, of each."""
    scans = before, after
    alike = before.heights.shape == after.heights.shape and np.allclose(
        before.pitch, after.pitch, rtol=ALIKE
    )
    if alike:
        first, second = map(filled, scans)
        return first, second, (~before.measured, ~after.measured)
    pitch = tuple(map(max, zip(before.pitch, after.pitch, strict=True)))
    if given and not np.allclose(pitch, after.pitch, rtol=ALIKE):
        raise InputError("a worn area on points that are not used: give the coarser scan last")
    sizes = after.size if given else tuple(map(min, zip(before.size, after.size, strict=True)))
    shape = (int(sizes[0] / pitch[0] + ALIKE), int(sizes[1] / pitch[1] + ALIKE))
    if shape[0] * shape[1] < FEWEST_POINTS:
        raise InputError(
            f"{shape[0]} x {shape[1]} points of {pitch[0]:.3g} x {pitch[1]:.3g} mm in both scans: "
            f"give scans of one body, with {FEWEST_POINTS} points or more, each in its own unit"
        )
    grid = Grid(shape, (pitch[0], pitch[1]))
    first, second = (Scan(resampled(filled(scan), grid).heights, grid.pitch) for scan in scans)
    shares = [
        resampled(Scan(np.where(scan.measured, 0.0, 1.0), scan.pitch), grid).heights
        for scan in scans
    ]
    return first, second, (shares[0] > MOSTLY, shares[1] > MOSTLY)


class _Overlay:
    """Two scans on the same points, and the second as it lies on the first.

    ``depth`` ``(nx, ny)`` [mm] is that of the first less the second, without the plane and shift
    that the rim tells; ``columns`` are what these add to it, and ``told`` ``(c, nx, ny)`` what the
    depth of each point, of the rim, adds to the factor of each column. ``shift`` is in points.

    A shift is told by slopes. Those of either scan have noise, which squares of one scan's would
    take for roughness, and a shift be found too small: products of both have none of it in the mean
    (instrumental variables; Reiersøl 1941, doi:10.2307/1907171).
    """

    def __init__(self, before: Scan, after: Scan, gone: tuple[Mask, Mask]) -> None:
        self.before, self.after, self.gone = before, after, gone
        self.pitch = after.pitch
        nx, ny = after.heights.shape
        x, y = np.linspace(-1.0, 1.0, nx)[:, None], np.linspace(-1.0, 1.0, ny)[None, :]
        self._plane = [np.broadcast_to(one, (nx, ny)) for one in (np.ones((1, 1)), x, y)]
        self.shift = np.zeros(2)
        self.recognised = False
        self.lay(np.ones((nx, ny), dtype=bool))

    @cached_property
    def _smooth_slopes(self) -> list[Array]:
        """Those of the second scan along x and y, with little of their noise."""
        from scipy import ndimage

        smooth = ndimage.gaussian_filter(self.after.heights, SOFTENED)
        return [-np.gradient(smooth, axis=axis) for axis in (0, 1)]

    def lay(self, rim: Mask) -> Array:
        """Lay the scans over each other by ``rim`` as far as it goes; the change of shift.

        Raises InputError where it goes hardly anywhere, as after a shift that left the scan.
        """
        moved, self.seen = _moved(self.before.heights, self.gone[0], self.shift)
        self.seen &= ~self.gone[1]
        self.rim = rim & self.seen
        _check_rim(self.rim)
        columns, others = list(self._plane), list(self._plane)
        if self.recognised:
            columns += [-np.gradient(moved, axis=axis) for axis in (0, 1)]
            others += self._smooth_slopes
        depth = moved - self.after.heights
        rows, by = (np.stack([one[self.rim] for one in each]) for each in (columns, others))
        told = np.linalg.pinv(by @ rows.T) @ by
        factors = told @ depth[self.rim]
        self.columns, self.told = columns, np.zeros((len(columns), *depth.shape))
        self.told[:, self.rim] = told
        self.depth = depth - sum(
            factor * column for factor, column in zip(factors, columns, strict=True)
        )
        return -factors[3:]

    def align(self, rim: Mask) -> None:
        """Shift and plane by the ``rim``: the shift by correlation first, then to parts of a point.

        By Newton's method, on what is left of the rim.
        """
        seen = rim & ~(self.gone[0] | self.gone[1])
        _check_rim(seen)
        self.recognised = False
        self.shift, likeness = _correlated(self.before, self.after, seen)
        if likeness < RECOGNISED:
            self.shift = np.zeros(2)
            self.lay(rim)
            return
        self.recognised = True
        for _ in range(MOST_SHIFTS):
            change = self.lay(rim)
            self.shift = self.shift + change
            if np.abs(change).max() < SAME_PLACE:
                break
        self.lay(rim)

    def find(self) -> Mask:
        """The largest area that is clearly worn, and some more around it. Raises InputError."""
        from scipy import ndimage

        worn = np.zeros_like(self.seen)
        self.align(~worn)
        for share in (*BY_AND_BY, *[0.0] * MOST_SHIFTS):
            depth = np.where(self.seen, self.depth, np.median(self.depth[self.seen]))
            smooth = ndimage.uniform_filter(depth, SMOOTHED)
            rim = smooth[self.seen & ~worn]
            middle = np.median(rim)
            # 1.4826 makes a median deviation that of a normal distribution.
            spread = 1.4826 * np.median(np.abs(rim - middle))
            least = max(CLEAR * spread, share * float(smooth[self.seen].max() - middle))
            clear = ndimage.binary_fill_holes(smooth - middle > least)
            labels, found = ndimage.label(clear)
            if not found:
                raise InputError("no area clearly deeper than noise: give the worn area")
            largest = labels == 1 + np.argmax(np.bincount(labels.ravel())[1:])
            radius = np.sqrt(np.count_nonzero(largest) / np.pi)
            grown = ndimage.distance_transform_edt(~largest) <= SMOOTHED + MARGIN * radius
            if share == 0.0 and np.array_equal(grown, worn):
                break
            worn = grown
            if np.count_nonzero(self.seen & ~worn) < np.count_nonzero(self.seen) // 3:
                raise InputError(
                    "more than two thirds look worn, so that no rim tells where the surface was: "
                    "give the worn area, or scans that reach farther"
                )
            # The scar hides the roughness that both have in common, until it is left out.
            (self.align if share or not self.recognised else self.lay)(~worn)
        return worn


def _check_rim(rim: Mask) -> None:
    """Raise InputError where so few points are left that nothing is measured."""
    if np.count_nonzero(rim) < FEWEST_POINTS:
        raise InputError(
            f"{np.count_nonzero(rim)} points around the worn area: give scans that reach farther"
        )


def _moved(heights: Array, gone: Mask, shift: Array) -> tuple[Array, Mask]:
    """Heights moved by ``shift`` points, and where they come from points that are not ``gone``."""
    if not shift.any():
        return heights, ~gone
    from scipy import ndimage

    moved = ndimage.shift(heights, shift, order=3, mode="reflect")
    inside = [
        (np.arange(n) - by >= 0.0) & (np.arange(n) - by <= n - 1.0)
        for n, by in zip(heights.shape, shift, strict=True)
    ]
    lost = ndimage.shift(gone.astype(np.float64), shift, order=1, mode="nearest")
    return moved, inside[0][:, None] & inside[1][None, :] & (lost < MOSTLY)


def _correlated(before: Scan, after: Scan, rim: Mask) -> tuple[Array, float]:
    """The shift in whole points that makes both rims most alike, and their correlation there.

    Forms and heights beyond three deviations, which a scar has, do not count.
    """
    from scipy import fft

    padded = [fft.next_fast_len(2 * n, real=True) for n in rim.shape]

    def spectrum(values: Array) -> Array:
        return np.asarray(fft.rfft2(values, padded))

    parts = []
    for scan in (before, after):
        left = levelled(Scan(np.where(rim, scan.heights, np.nan), scan.pitch), "form").heights
        left = np.where(rim, left - np.median(left[rim]), 0.0)
        limit = CLEAR * 1.4826 * np.median(np.abs(left[rim]))
        parts.append(np.clip(left, -limit, limit))
    there = spectrum(rim.astype(np.float64))
    first, second = (spectrum(part) for part in parts)
    squares = [spectrum(part**2) for part in parts]

    def lagged(one: Array, other: Array) -> Array:
        return np.asarray(fft.irfft2(np.conj(one) * other, padded))

    energy = lagged(squares[0], there) * lagged(there, squares[1])
    likeness = np.zeros_like(energy)
    near = np.ones(energy.shape, dtype=bool)
    for axis, n in enumerate(rim.shape):
        lags = np.abs(fft.fftfreq(padded[axis], 1.0 / padded[axis]))
        near &= np.expand_dims(lags <= FARTHEST * n, 1 - axis)
    # Where hardly anything overlaps, rounding is all there is.
    near &= energy > 1e-6 * energy.max()
    likeness[near] = lagged(first, second)[near] / np.sqrt(energy[near])
    best = np.unravel_index(np.argmax(likeness), likeness.shape)
    lag = [int(i) if i <= n // 2 else int(i) - n for i, n in zip(best, padded, strict=True)]
    return np.array(lag, dtype=np.float64), float(likeness[best])


# --- what it comes to ---------------------------------------------------------------------------


def _measured(overlay: _Overlay, worn: Mask) -> Scar:
    from scipy import ndimage

    rim, (dx, dy) = overlay.rim, overlay.pitch
    seen = worn & overlay.seen
    if not seen.any():
        raise InputError("nothing of the worn area is in both scans: give another")
    own = Scan(np.where(overlay.seen, overlay.depth, np.nan), overlay.pitch)
    depth = filled(own).heights
    missing = 1.0 - np.count_nonzero(seen) / np.count_nonzero(worn)
    noise = _Noise.of(overlay.depth, rim, len(overlay.columns))
    means = np.where(worn, ndimage.uniform_filter(depth, 3), -np.inf)
    there = _block(means)
    volume, deepest = float(depth[worn].sum()) * dx * dy, float(means.max())
    bounds = None
    if noise is not None:
        bounds = [noise.bound(_weights(overlay, area)) for area in (worn, there)]
        bounds += [noise.bound(weights) for weights in overlay.told[3:]]
    if not np.isfinite([volume, deepest, *(bounds or ())]).all():
        highest = max(np.abs(heights).max() for heights in (overlay.before.heights, depth))
        raise InputError(f"heights of {highest:.1g} mm: give scans in their unit, or measure again")
    return Scar(
        depth=own.heights,
        worn=worn,
        pitch=overlay.pitch,
        volume=volume,
        volume_error=bounds[0] * dx * dy if bounds else None,
        deepest=deepest,
        depth_error=bounds[1] / np.count_nonzero(there) if bounds else None,
        noise=rms(overlay.depth[rim]),
        length=noise.length * float(np.sqrt(dx * dy)) if noise else None,
        patches=noise.patches if noise else None,
        shift=(overlay.shift[0] * dx, overlay.shift[1] * dy) if overlay.recognised else None,
        shift_error=(bounds[2] * dx, bounds[3] * dy) if bounds and overlay.recognised else None,
        missing=missing,
    )


def _t95(freedom: float) -> float:
    """Student's t of both sides together, 95 %; of at least one degree of freedom."""
    from scipy import stats

    return float(stats.t.ppf(0.975, max(freedom, 1.0)))


def _block(means: Array) -> Mask:
    """The points ``(nx, ny)`` that the largest of ``means`` over 3 x 3 is the mean of."""
    row, column = np.unravel_index(int(np.argmax(means)), means.shape)
    block = np.zeros(means.shape, dtype=bool)
    block[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] = True
    return block


def _weights(overlay: _Overlay, area: Mask) -> Array:
    """What the depth of each point ``(nx, ny)`` adds to the sum over an area.

    Those of the rim count through the plane and shift that are fitted to them, those around a point
    that was filled in for it.
    """
    seen = area & overlay.seen
    own = int(np.count_nonzero(seen))
    weights = np.where(seen, np.count_nonzero(area) / max(own, 1), 0.0)
    sums = np.array([column[area].sum() for column in overlay.columns])
    return np.asarray(weights - np.tensordot(sums, overlay.told, 1))


@dataclass(frozen=True)
class _Noise:
    """Covariance of points by their distance, ``covariance`` ``(r,)`` at 0, 1, 2, ... points.

    It is 0 beyond. ``length`` is that of a square as large as noise is correlated over, in points.
    """

    covariance: Array
    length: float
    patches: float

    @classmethod
    def of(cls, depth: Array, rim: Mask, fitted: int) -> _Noise | None:
        """That of the ``depth`` over a rim to which so many parameters were ``fitted``.

        None where there is none: of a scan and itself, or of surfaces that were computed. It ends
        soon behind where it first falls to 0. What the fit has taken is added again.
        """
        values = _lags(np.where(rim, depth, 0.0))
        pairs = _lags(rim.astype(np.float64))
        rings = np.rint(_distances(values.shape)).astype(int)
        sums = np.bincount(rings.ravel(), values.ravel())
        counts = np.bincount(rings.ravel(), np.maximum(pairs, 0.0).ravel())
        found = sums[counts > 0.5] / counts[counts > 0.5]
        of_ring = np.bincount(rings.ravel())[: len(found)]
        points = np.count_nonzero(rim)
        first = np.flatnonzero(found <= 0.0)
        end = max(NEIGHBOURS, int(FARTHER * first[0]) if first.size else 0)
        found, of_ring = found[:end], of_ring[:end]
        patch = float(of_ring.sum())
        # A parameter takes the variance of a mean over the rim off all of it.
        mean = float(found @ of_ring) / (1.0 - min(fitted * patch / points, 0.5))
        covariance = found + fitted * mean / points
        if covariance[0] == 0.0:
            return None
        # White noise has no less than its own variance, whatever chance makes of its neighbours.
        length = float(np.sqrt(max(mean / covariance[0], 1.0)))
        return cls(covariance, length, float(points / patch))

    def bound(self, weights: Array) -> float:
        """95 % bound of the sum with such ``weights`` ``(nx, ny)``."""
        return _t95(self.patches) * float(np.sqrt(self.variance_of(weights)))

    def variance_of(self, weights: Array) -> float:
        """Variance of the sum with such ``weights`` ``(nx, ny)``."""
        together = _lags(weights)
        rings = np.rint(_distances(together.shape)).astype(int)
        by_ring = np.bincount(rings.ravel(), together.ravel())[: len(self.covariance)]
        # Waves of both signs may cancel by chance; noise of independent points does not.
        least = float(self.covariance[0] * np.sum(weights**2))
        return max(float(self.covariance[: len(by_ring)] @ by_ring), least)


def _lags(values: Array) -> Array:
    """Sums of the products of all pairs of points so far apart, on a grid of twice the points."""
    from scipy import fft

    padded = [fft.next_fast_len(2 * n, real=True) for n in values.shape]
    spectrum = fft.rfft2(values, padded)
    return np.asarray(fft.irfft2(np.abs(spectrum) ** 2, padded))


def _distances(shape: tuple[int, ...]) -> Array:
    """Distances in points that the places of :func:`_lags` are for."""
    x, y = (np.fft.fftfreq(n, 1.0 / n) for n in shape)
    distances: Array = np.hypot(x[:, None], y[None, :])
    return distances
