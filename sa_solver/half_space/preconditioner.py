"""Approximate inverse of the half-space, as preconditioner for conjugate gradients.

The inverse kernel decays as 1/r³, so that periodicity without padding costs few iterations, and the
transform takes a quarter of the time of a convolution.
Source: Vollebregt 2014, J. Comput. Phys. 257, 333, doi:10.1016/j.jcp.2013.10.005.
"""

from __future__ import annotations

import numpy as np

from sa_solver.half_space.influence import Z
from sa_solver.half_space.operator import NORMAL, HalfSpace, fast_lengths, spectral_filter
from sa_solver.transforms.padded import SpectralFilter
from sa_solver.types import Array

SMALLEST_RELATIVE_EIGENVALUE = 1e-6
"""Lower bound of a circulant symbol, relative to its largest value. The true minimum is of the
order of half a cell over the grid's length, far above; the bound only keeps the inverse finite."""

LEVELS = 4
LEVEL_SPACING = 2.0
"""Largest number of levels of local compliance in the preconditioner, and the spacing of their
natural logarithms. Where D varies from 0 to a thousand times the compliance of a cell, one level
needs over 100 iterations and four need 20; more levels save no iterations."""


class NormalPreconditioner:
    """Inverse of K for pressure, on a grid made periodic with almost no padding."""

    def __init__(self, half_space: HalfSpace) -> None:
        """Prepare the inverse of ``half_space``."""
        self.half_space = half_space
        shape = half_space.grid.shape
        period = shape if half_space.periodic else fast_lengths(*shape)
        self._transform = half_space.transform(shape, period, 1)
        symbol = half_space.symbol(Z, Z, period)
        self._symbol = np.maximum(symbol, SMALLEST_RELATIVE_EIGENVALUE * symbol.max())
        if half_space.periodic:
            self._symbol[0, 0] = symbol.max()  # The load decides the mean pressure.
        self._parts: list[tuple[Array | None, SpectralFilter]] = []
        self.include(None)

    def include(self, compliance: Array | None) -> None:
        """Include a local ``compliance`` D ``(nx, ny)`` [mm/MPa]: approximate ``(K + D)⁻¹``.

        Each level j of D has its own inverse symbol and a window χj on the cells near that level,
        with Σ χj² = 1. The inverse is Σ χj (K + Dj)⁻¹ χj. None stands for D = 0.
        """
        if compliance is None:
            self._parts = [(None, self._inverse(0.0))]
            return
        levels, windows = _compliance_levels(compliance, float(self._symbol.min()))
        self._parts = [
            (window, self._inverse(float(level)))
            for level, window in zip(levels, windows, strict=True)
        ]

    def apply(self, displacement: Array) -> Array:
        """Return the approximate pressure ``(nx, ny)`` [MPa] for a ``displacement`` [mm]."""
        total = np.zeros_like(displacement)
        for window, inverse in self._parts:
            if window is None:
                pressure: Array = inverse.apply(displacement[None])[0]
                return pressure
            total += window * inverse.apply((window * displacement)[None])[0]
        return total

    def _inverse(self, level: float) -> SpectralFilter:
        return spectral_filter(self._transform, [[1.0 / (self._symbol + level)]], NORMAL, NORMAL)


def _compliance_levels(compliance: Array, stiffest: float) -> tuple[Array, list[Array | None]]:
    """Return levels of ``compliance`` and a window around each.

    The levels are evenly spaced in log(D + ``stiffest``).
    """
    logarithm = np.log(compliance + stiffest)
    lowest, highest = float(logarithm.min()), float(logarithm.max())
    intervals = min(LEVELS - 1, round((highest - lowest) / LEVEL_SPACING))
    if intervals == 0:
        return np.array([np.mean(compliance)]), [None]
    position = (logarithm - lowest) * (intervals / (highest - lowest))
    hats = [np.maximum(0.0, 1.0 - np.abs(position - j)) for j in range(intervals + 1)]
    centres = np.linspace(lowest, highest, intervals + 1)
    return np.exp(centres) - stiffest, [np.sqrt(hat) for hat in hats]
