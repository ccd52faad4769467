"""Wear of one body between two scans of its surface: depth and volume with their uncertainty.

The two scans are aligned on the rim, the area where nothing was worn: by the plane between them,
and by a shift of fractions of a point where the roughness of both scans can be matched. The
residual on the rim is the noise of instrument, alignment and form together. It is correlated, so
that its points are not independent measurements; its covariance as a function of distance is
estimated from the rim. The volume is a weighted sum over all points, where points of the rim count
through the fitted plane and shift, and its variance is that of such a sum (JCGM 100:2008, eq. 13).
The degrees of freedom of Student's t are the number of patches of the rim, each as large as the
noise is correlated over.

The bounds do not contain the calibration error, which two scans of one instrument cannot show, nor
the effect of stripes: noise is taken to be the same in all directions.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sa_solver.errors import InputError
from sa_solver.surfaces.scans import Scan, filled, levelled, resampled, rms
from sa_solver.types import Array, Grid, Mask
from wear.scar_noise import Noise

MATCHED = 0.5
"""Least correlation of both rims at which their roughness determines the shift. Below it, noise
dominates whatever the shift.
"""

LARGEST_SHIFT = 0.25
"""Largest shift that is tried, over the size of the scans."""

SHIFT_CONVERGED, MOST_SHIFTS = 1e-3, 30
"""Change of the shift, in points, at which the iteration has converged, and the limit of
iterations. The change falls by a factor of ten or more where several points resolve a wave of the
roughness.
"""

DETECTION_SIGMAS = 3.0
"""Standard deviations of smoothed noise above which a depth counts as worn."""

MEAN_WIDTH = 5
"""Width of the moving mean, in points, by which depths are smoothed for this test: a scar is many
points wide.
"""

FIRST_THRESHOLDS = 0.3, 0.1
"""Thresholds of the first passes that detect a scar, over the largest depth. The first plane is
fitted to all points, the scar's too, and bends the rim into a bowl: only the deepest points are
certain at first.
"""

MARGIN = 0.15
"""Width by which a detected worn area is enlarged, over the radius of a disk of its area: the edge
of a scar disappears in the noise.
"""

SLOPE_FILTER = 1.0
"""Standard deviation, in points, of the Gaussian filter applied before slopes of one scan are
taken. It leaves a quarter of white noise and 80 % of waves ten points long.
"""

FEWEST_PATCHES = 5
"""Least number of independent patches of the rim. With fewer the noise is hardly known: Student's t
is 2.6 there.
"""

FEWEST_POINTS = 100
"""Least number of points of a rim."""

MISSING_SHARE = 0.5
"""Share of a coarser point that must be missing for the point to count as missing."""

SAME_PITCH = 1e-6
"""Relative difference of the pitch up to which two scans have the same points."""


@dataclass(frozen=True)
class Scar:
    """Wear of a body between two scans.

    Parameters
    ----------
    depth
        Depth that the body lost ``(nx, ny)`` [mm], NaN where either scan has no point.
    worn
        Points that count as worn ``(nx, ny)``.
    pitch
        Distance of points (dx, dy) [mm].
    volume, volume_error
        Volume lost in the worn area and its 95 % bound [mm³].
    deepest
        Largest mean depth of 3 x 3 points [mm]. The largest of many such means is too large by
        about its noise.
    depth_error
        95 % bound of that mean, which includes the errors of plane and shift [mm].
    noise
        Root mean square of the residual on the rim [mm].
    length
        Length over which the noise is correlated [mm].
    patches
        Number of independent patches of the rim. With fewer than 5 the bounds are hardly known, and
        ``sure`` is false.
    shift
        Position of the second scan on the first [mm], None where the roughness does not determine
        it.
    shift_error
        95 % bounds of the shift [mm].
    missing
        Share of the worn area without a measured depth, which is interpolated from its
        surroundings.

    All bounds, ``length`` and ``patches`` are None where the rim has no noise at all, as in
    computed surfaces.
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
        """True if the rim has noise and enough independent patches to know it."""
        return self.patches is not None and self.patches >= FEWEST_PATCHES

    @property
    def area(self) -> float:
        """Worn area [mm²]."""
        return float(np.count_nonzero(self.worn)) * self.pitch[0] * self.pitch[1]


def measure_scar(before: Scan, after: Scan, worn: Mask | None = None) -> Scar:
    """Measure the depth and the volume that a body lost between two scans, with 95 % bounds.

    Scans on different points are averaged onto those of the coarser scan, within their common area.

    Parameters
    ----------
    before, after
        Scans of the body before and after wear.
    worn
        Points of the second scan ``(nx, ny)`` in which wear is looked for: all of the scar, and as
        little of the rim as possible. Without it the largest area that is clearly deeper than the
        noise is taken, with a margin.

    Raises
    ------
    InputError
        If no worn area stands out from the noise, the rim is too small, or heights are so large
        that their squares overflow.

    Examples
    --------
    Two scans of a spherical cap of 4 µm have a noise of 0.2 µm and a tilt:

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
        raise InputError("a profile has no volume: give areal scans, of several columns")
    first, second, missing = _on_same_points(before, after, worn is not None)
    if worn is not None and worn.shape != after.heights.shape:
        raise InputError(
            f"the worn area has {worn.shape} points, the second scan {after.heights.shape}: give "
            "the worn area on the points of the second scan"
        )
    overlay = _Overlay(first, second, missing)
    if worn is None:
        worn = overlay.find()
    overlay.align(~worn)
    return _measured(overlay, worn)


def _on_same_points(before: Scan, after: Scan, given: bool) -> tuple[Scan, Scan, tuple[Mask, Mask]]:
    """Return both scans on the same points with gaps filled, and the points missing from each."""
    scans = before, after
    same_points = before.heights.shape == after.heights.shape and np.allclose(
        before.pitch, after.pitch, rtol=SAME_PITCH
    )
    if same_points:
        first, second = map(filled, scans)
        return first, second, (~before.measured, ~after.measured)
    pitch = tuple(map(max, zip(before.pitch, after.pitch, strict=True)))
    if given and not np.allclose(pitch, after.pitch, rtol=SAME_PITCH):
        raise InputError(
            "the worn area is given on the points of the finer scan, which are not used: give the "
            "coarser scan last"
        )
    sizes = after.size if given else tuple(map(min, zip(before.size, after.size, strict=True)))
    shape = (int(sizes[0] / pitch[0] + SAME_PITCH), int(sizes[1] / pitch[1] + SAME_PITCH))
    if shape[0] * shape[1] < FEWEST_POINTS:
        raise InputError(
            f"the scans have {shape[0]} x {shape[1]} points of {pitch[0]:.3g} x {pitch[1]:.3g} mm "
            f"in common: give two scans of one body with at least {FEWEST_POINTS} common points, "
            "and check the units of both"
        )
    grid = Grid(shape, (pitch[0], pitch[1]))
    first, second = (Scan(resampled(filled(scan), grid).heights, grid.pitch) for scan in scans)
    shares = [
        resampled(Scan(np.where(scan.measured, 0.0, 1.0), scan.pitch), grid).heights
        for scan in scans
    ]
    return first, second, (shares[0] > MISSING_SHARE, shares[1] > MISSING_SHARE)


class _Overlay:
    """Two scans on the same points, aligned on their rim.

    ``depth`` ``(nx, ny)`` [mm] is the first scan less the second, without the fitted plane and
    shift. ``columns`` are the shape functions of that fit, and ``fit_weights`` ``(c, nx, ny)`` the
    weight of the depth of each rim point in the factor of each column. ``shift`` is in points.

    The shift is fitted by slopes. The slopes of one scan contain noise, and products of one scan's
    slopes with themselves would count that noise as roughness and make the shift too small.
    Products of the slopes of both scans have no such bias in the mean (instrumental variables;
    Reiersøl 1941, doi:10.2307/1907171).
    """

    def __init__(self, before: Scan, after: Scan, missing: tuple[Mask, Mask]) -> None:
        self.before, self.after, self.missing = before, after, missing
        self.pitch = after.pitch
        nx, ny = after.heights.shape
        x, y = np.linspace(-1.0, 1.0, nx)[:, None], np.linspace(-1.0, 1.0, ny)[None, :]
        self._plane = [np.broadcast_to(one, (nx, ny)) for one in (np.ones((1, 1)), x, y)]
        self.shift = np.zeros(2)
        self.matched = False
        self.fit(np.ones((nx, ny), dtype=bool))

    @cached_property
    def _smooth_slopes(self) -> list[Array]:
        """Slopes of the second scan along x and y, smoothed to reduce their noise."""
        from scipy import ndimage

        smooth = ndimage.gaussian_filter(self.after.heights, SLOPE_FILTER)
        return [-np.gradient(smooth, axis=axis) for axis in (0, 1)]

    def fit(self, rim: Mask) -> Array:
        """Fit the plane, and the change of shift if the roughness was matched, to the ``rim``.

        Return the change of the shift in points. Raise InputError where hardly any common points
        are left, as after a shift that left the scan.
        """
        moved, self.seen = _moved(self.before.heights, self.missing[0], self.shift)
        self.seen &= ~self.missing[1]
        self.rim = rim & self.seen
        _check_rim(self.rim)
        columns, others = list(self._plane), list(self._plane)
        if self.matched:
            columns += [-np.gradient(moved, axis=axis) for axis in (0, 1)]
            others += self._smooth_slopes
        depth = moved - self.after.heights
        rows, by = (np.stack([one[self.rim] for one in each]) for each in (columns, others))
        fit_weights = np.linalg.pinv(by @ rows.T) @ by
        factors = fit_weights @ depth[self.rim]
        self.columns, self.fit_weights = columns, np.zeros((len(columns), *depth.shape))
        self.fit_weights[:, self.rim] = fit_weights
        self.depth = depth - sum(
            factor * column for factor, column in zip(factors, columns, strict=True)
        )
        return -factors[3:]

    def align(self, rim: Mask) -> None:
        """Find the shift by correlation, then shift and plane by Newton's method on the ``rim``."""
        seen = rim & ~(self.missing[0] | self.missing[1])
        _check_rim(seen)
        self.matched = False
        self.shift, correlation = _correlated(self.before, self.after, seen)
        if correlation < MATCHED:
            self.shift = np.zeros(2)
            self.fit(rim)
            return
        self.matched = True
        for _ in range(MOST_SHIFTS):
            change = self.fit(rim)
            self.shift = self.shift + change
            if np.abs(change).max() < SHIFT_CONVERGED:
                break
        self.fit(rim)

    def find(self) -> Mask:
        """Return the largest area that is clearly worn, with a margin around it.

        Raise InputError if there is none, or if too little of the rim is left.
        """
        from scipy import ndimage

        worn = np.zeros_like(self.seen)
        self.align(~worn)
        for share in (*FIRST_THRESHOLDS, *[0.0] * MOST_SHIFTS):
            depth = np.where(self.seen, self.depth, np.median(self.depth[self.seen]))
            smooth = ndimage.uniform_filter(depth, MEAN_WIDTH)
            rim = smooth[self.seen & ~worn]
            middle = np.median(rim)
            # 1.4826 converts a median absolute deviation to a standard deviation of normal noise.
            spread = 1.4826 * np.median(np.abs(rim - middle))
            least = max(DETECTION_SIGMAS * spread, share * float(smooth[self.seen].max() - middle))
            clear = ndimage.binary_fill_holes(smooth - middle > least)
            labels, found = ndimage.label(clear)
            if not found:
                raise InputError("no area is clearly deeper than the noise: give the worn area")
            largest = labels == 1 + np.argmax(np.bincount(labels.ravel())[1:])
            radius = np.sqrt(np.count_nonzero(largest) / np.pi)
            grown = ndimage.distance_transform_edt(~largest) <= MEAN_WIDTH + MARGIN * radius
            if share == 0.0 and np.array_equal(grown, worn):
                break
            worn = grown
            if np.count_nonzero(self.seen & ~worn) < np.count_nonzero(self.seen) // 3:
                raise InputError(
                    "more than two thirds of the points look worn, which leaves too little rim to "
                    "align the scans: give the worn area, or scans that extend farther beyond it"
                )
            # The scar hides the roughness that both scans have in common. Align again until the
            # scar is left out and the roughness is matched.
            (self.align if share or not self.matched else self.fit)(~worn)
        return worn


def _check_rim(rim: Mask) -> None:
    """Raise InputError if too few points of the rim are left for a measurement."""
    if np.count_nonzero(rim) < FEWEST_POINTS:
        raise InputError(
            f"only {np.count_nonzero(rim)} points are left around the worn area, of at least "
            f"{FEWEST_POINTS}: give scans that extend farther beyond it"
        )


def _moved(heights: Array, missing: Mask, shift: Array) -> tuple[Array, Mask]:
    """Return heights moved by ``shift`` points, and which of them come from measured points."""
    if not shift.any():
        return heights, ~missing
    from scipy import ndimage

    moved = ndimage.shift(heights, shift, order=3, mode="reflect")
    inside = [
        (np.arange(n) - by >= 0.0) & (np.arange(n) - by <= n - 1.0)
        for n, by in zip(heights.shape, shift, strict=True)
    ]
    lost = ndimage.shift(missing.astype(np.float64), shift, order=1, mode="nearest")
    return moved, inside[0][:, None] & inside[1][None, :] & (lost < MISSING_SHARE)


def _correlated(before: Scan, after: Scan, rim: Mask) -> tuple[Array, float]:
    """Return the shift in whole points with the largest correlation of both rims, and that value.

    The form is removed, and heights beyond three deviations, as in a scar, are clipped.
    """
    from scipy import fft

    padded = [fft.next_fast_len(2 * n, real=True) for n in rim.shape]

    def spectrum(values: Array) -> Array:
        return np.asarray(fft.rfft2(values, padded))

    parts = []
    for scan in (before, after):
        left = levelled(Scan(np.where(rim, scan.heights, np.nan), scan.pitch), "form").heights
        left = np.where(rim, left - np.median(left[rim]), 0.0)
        limit = DETECTION_SIGMAS * 1.4826 * np.median(np.abs(left[rim]))
        parts.append(np.clip(left, -limit, limit))
    there = spectrum(rim.astype(np.float64))
    first, second = (spectrum(part) for part in parts)
    squares = [spectrum(part**2) for part in parts]

    def lagged(one: Array, other: Array) -> Array:
        return np.asarray(fft.irfft2(np.conj(one) * other, padded))

    energy = lagged(squares[0], there) * lagged(there, squares[1])
    correlation = np.zeros_like(energy)
    near = np.ones(energy.shape, dtype=bool)
    for axis, n in enumerate(rim.shape):
        lags = np.abs(fft.fftfreq(padded[axis], 1.0 / padded[axis]))
        near &= np.expand_dims(lags <= LARGEST_SHIFT * n, 1 - axis)
    # Where the rims hardly overlap, the correlation consists of rounding errors.
    near &= energy > 1e-6 * energy.max()
    correlation[near] = lagged(first, second)[near] / np.sqrt(energy[near])
    best = np.unravel_index(np.argmax(correlation), correlation.shape)
    lag = [int(i) if i <= n // 2 else int(i) - n for i, n in zip(best, padded, strict=True)]
    return np.array(lag, dtype=np.float64), float(correlation[best])


# --- depth, volume and their bounds ---------------------------------------------------------------


def _measured(overlay: _Overlay, worn: Mask) -> Scar:
    from scipy import ndimage

    rim, (dx, dy) = overlay.rim, overlay.pitch
    seen = worn & overlay.seen
    if not seen.any():
        raise InputError("no point of the worn area is in both scans: give another worn area")
    measured = Scan(np.where(overlay.seen, overlay.depth, np.nan), overlay.pitch)
    depth = filled(measured).heights
    missing = 1.0 - np.count_nonzero(seen) / np.count_nonzero(worn)
    noise = Noise.of(overlay.depth, rim, len(overlay.columns))
    means = np.where(worn, ndimage.uniform_filter(depth, 3), -np.inf)
    there = _block(means)
    volume, deepest = float(depth[worn].sum()) * dx * dy, float(means.max())
    bounds = None
    if noise is not None:
        bounds = [noise.bound(_weights(overlay, area)) for area in (worn, there)]
        bounds += [noise.bound(weights) for weights in overlay.fit_weights[3:]]
    if not np.isfinite([volume, deepest, *(bounds or ())]).all():
        highest = max(np.abs(heights).max() for heights in (overlay.before.heights, depth))
        raise InputError(
            f"the scans have heights of {highest:.1g} mm: check their unit, or measure again"
        )
    return Scar(
        depth=measured.heights,
        worn=worn,
        pitch=overlay.pitch,
        volume=volume,
        volume_error=bounds[0] * dx * dy if bounds else None,
        deepest=deepest,
        depth_error=bounds[1] / np.count_nonzero(there) if bounds else None,
        noise=rms(overlay.depth[rim]),
        length=noise.length * float(np.sqrt(dx * dy)) if noise else None,
        patches=noise.patches if noise else None,
        shift=(overlay.shift[0] * dx, overlay.shift[1] * dy) if overlay.matched else None,
        shift_error=(bounds[2] * dx, bounds[3] * dy) if bounds and overlay.matched else None,
        missing=missing,
    )


def _block(means: Array) -> Mask:
    """Return the points ``(nx, ny)`` of the 3 x 3 block with the largest of its ``means``."""
    row, column = np.unravel_index(int(np.argmax(means)), means.shape)
    block = np.zeros(means.shape, dtype=bool)
    block[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2] = True
    return block


def _weights(overlay: _Overlay, area: Mask) -> Array:
    """Return the weight of the depth of each point ``(nx, ny)`` in the sum over an area.

    Points of the rim count through the fitted plane and shift. Measured points of the area count
    more where some points of it are missing.
    """
    seen = area & overlay.seen
    measured = int(np.count_nonzero(seen))
    weights = np.where(seen, np.count_nonzero(area) / max(measured, 1), 0.0)
    sums = np.array([column[area].sum() for column in overlay.columns])
    return np.asarray(weights - np.tensordot(sums, overlay.fit_weights, 1))
