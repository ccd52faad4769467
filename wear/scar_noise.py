"""Correlated noise of a scan, estimated from the rim of a scar."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.types import Array, Mask

NEAREST_RINGS = 4
"""Rings of points, the point itself included, whose covariance always counts: a shift by fractions
of a point spreads noise over them, and by chance the first of them may have a negative covariance.
"""

COVARIANCE_RANGE = 1.2
"""Range of the covariance over the distance at which it first falls to 0. The plane and shift
fitted to the rim remove part of the noise, so that its range looks shorter than it is.
"""


@dataclass(frozen=True)
class Noise:
    """Covariance of the noise as a function of distance.

    ``covariance`` ``(r,)`` is that at distances of 0, 1, 2, ... points, and 0 beyond. ``length`` is
    the side, in points, of a square as large as noise is correlated over. ``patches`` is the number
    of independent patches.
    """

    covariance: Array
    length: float
    patches: float

    @classmethod
    def of(cls, depth: Array, rim: Mask, fitted: int) -> Noise | None:
        """Estimate the noise of ``depth`` on a rim to which ``fitted`` parameters were fitted.

        Return None without any noise, as between a scan and itself, or for computed surfaces. The
        covariance is cut off shortly beyond the distance at which it first falls to 0. The variance
        that the fit has removed is added again.
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
        end = max(NEAREST_RINGS, int(COVARIANCE_RANGE * first[0]) if first.size else 0)
        found, of_ring = found[:end], of_ring[:end]
        patch = float(of_ring.sum())
        # Each fitted parameter removes the variance of a mean over the rim from every point.
        mean = float(found @ of_ring) / (1.0 - min(fitted * patch / points, 0.5))
        covariance = found + fitted * mean / points
        if covariance[0] == 0.0:
            return None
        # Noise is correlated over one point at least; estimates below that are due to chance.
        length = float(np.sqrt(max(mean / covariance[0], 1.0)))
        return cls(covariance, length, float(points / patch))

    def bound(self, weights: Array) -> float:
        """Return the 95 % bound of a sum with the ``weights`` ``(nx, ny)``."""
        return _student_t95(self.patches) * float(np.sqrt(self.variance_of(weights)))

    def variance_of(self, weights: Array) -> float:
        """Return the variance of a sum with the ``weights`` ``(nx, ny)``."""
        together = _lags(weights)
        rings = np.rint(_distances(together.shape)).astype(int)
        by_ring = np.bincount(rings.ravel(), together.ravel())[: len(self.covariance)]
        # Covariances of both signs may cancel by chance; noise of independent points does not.
        least = float(self.covariance[0] * np.sum(weights**2))
        return max(float(self.covariance[: len(by_ring)] @ by_ring), least)


def _lags(values: Array) -> Array:
    """Return the sums of products of all pairs of points by offset, on a grid of twice the size."""
    from scipy import fft

    padded = [fft.next_fast_len(2 * n, real=True) for n in values.shape]
    spectrum = fft.rfft2(values, padded)
    return np.asarray(fft.irfft2(np.abs(spectrum) ** 2, padded))


def _distances(shape: tuple[int, ...]) -> Array:
    """Return the distances, in points, of the offsets of :func:`_lags`."""
    x, y = (np.fft.fftfreq(n, 1.0 / n) for n in shape)
    distances: Array = np.hypot(x[:, None], y[None, :])
    return distances


def _student_t95(freedom: float) -> float:
    """Return the two-sided 95 % value of Student's t, for at least one degree of freedom."""
    from scipy import stats

    return float(stats.t.ppf(0.975, max(freedom, 1.0)))
