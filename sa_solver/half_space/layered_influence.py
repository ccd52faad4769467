"""Influence coefficients of layered bodies: what layers add to those of the outermost material.

Waves much shorter than a layer is thick do not feel what lies below it. The compliances of
:mod:`sa_solver.half_space.layers` less those of the outermost material therefore vanish for short
waves as exp(-2kh), and what they add to the response to a point force is smooth: it changes over
distances of the thickness h at least, and tends to the difference of both materials over r far
away. With D = A - T and the angle φ of the distance to x, 2π times this addition is

    u_x = ½ (H0[A + T] - cos 2φ H2[D]) qx - ½ sin 2φ H2[D] qy - cos φ H1[C] p
    u_y = -½ sin 2φ H2[D] qx + ½ (H0[A + T] + cos 2φ H2[D]) qy - sin φ H1[C] p
    u_z = cos φ H1[C] qx + sin φ H1[C] qy + H0[N] p

where Hn[f] is the integral of f(k) J_n(kr) dk (:mod:`sa_solver.half_space.hankel`). Its means over
the cells are those of a piecewise polynomial (:mod:`sa_solver.half_space.cell_means`). Nothing is
made periodic, so that there is no error of aliasing.

Along a line the additions are integrals of f(k) cos(kx)/πk or f(k) sin(kx)/πk. Those of
F exp(-kd), with F the limit of f at k = 0, are known: -F ln(x² + d²)/2π and F atan(x/d)/π. What
remains is finite at k = 0.
"""

from __future__ import annotations

from dataclasses import fields
from functools import lru_cache

import numpy as np

from sa_solver.half_space.cell_means import CellIntegrals
from sa_solver.half_space.hankel import RadialFunction, WaveNumbers
from sa_solver.half_space.influence import X, Y, Z
from sa_solver.half_space.layers import Compliances, pair_compliances
from sa_solver.types import Array, ElasticPair


@lru_cache
def layered_influence(pair: ElasticPair) -> LayeredInfluence:
    """Return what the layers of a ``pair`` add, computed once."""
    return LayeredInfluence(pair)


class LayeredInfluence:
    """What the layers of a pair add to the influence coefficients of its outermost materials."""

    def __init__(self, pair: ElasticPair) -> None:
        """Transform the compliances of the bodies ``pair``."""
        layers = [body.layers for body in pair.bodies if body.layers]
        self._smooth = min(outermost.thickness for outermost, *_ in layers)
        longest = max(sum(layer.thickness for layer in of_body) for of_body in layers)
        self._waves = WaveNumbers(self._smooth, longest)
        whole, outermost = (pair_compliances(p, self._waves.values) for p in (pair, pair.surface))
        self._added = Compliances(
            *(getattr(whole, f.name) - getattr(outermost, f.name) for f in fields(Compliances))
        )
        self._radial = lru_cache(None)(self._transformed)

    def rectangles(self, edges_x: Array, edges_y: Array, row: int, column: int) -> Array:
        """Return the addition ``(n, m)`` [mm/MPa] for the rectangles between neighbouring edges.

        The arguments are those of :func:`.influence.rectangle_influence`.
        """
        odd = (row == X) != (column == X), (row == Y) != (column == Y)
        along_x, along_y = (
            CellIntegrals(edges, self._smooth, of_odd)
            for edges, of_odd in zip((edges_x, edges_y), odd, strict=True)
        )
        kernel = self._kernel(along_x.points[:, None], along_y.points[None, :], row, column)
        return np.asarray(along_x.weights @ kernel @ along_y.weights.T / (2.0 * np.pi))

    def strips(self, edges: Array, row: int, column: int, datum: float) -> Array:
        """Return the addition ``(n,)`` [mm/MPa] for the strips between neighbouring ``edges``.

        The arguments are those of :func:`.influence.strip_influence`. Far from the layers the
        displacement is that of the bodies below them, with the ``datum`` [mm].
        """
        if (row == Y) != (column == Y):
            return np.zeros(len(edges) - 1)
        odd = row != column
        name = "coupling" if odd else "across" if row == Y else "normal" if row == Z else "along"
        added = getattr(self._added, name)
        # Beyond this depth waves do not feel the layers, and the rest vanishes as the addition.
        depth = 2.0 * self._smooth
        rest = (added - added[0] * np.exp(-self._waves.values * depth)) / self._waves.values
        integrals = CellIntegrals(edges, self._smooth, odd)
        ratio = edges / depth
        if odd:
            known = edges * np.arctan(ratio) - 0.5 * depth * np.log1p(ratio**2)
            smooth, sign = self._waves.sines(rest), 1.0 if row == Z else -1.0
        else:
            logarithm = 0.5 * np.log((edges**2 + depth**2) / datum**2)
            known = -(edges * (logarithm - 1.0) + depth * np.arctan(ratio))
            smooth, sign = self._waves.cosines(rest), 1.0
        added_to = integrals.weights @ smooth(integrals.points) + added[0] * np.diff(known)
        return np.asarray(sign / np.pi * added_to)

    def _kernel(self, x: Array, y: Array, row: int, column: int) -> Array:
        """Return 2π times the addition to the response to a unit point force [1/MPa]."""
        r = np.hypot(x, y)
        if row == column == Z:
            return self._radial("normal", 0)(r)
        if Z in (row, column):
            along = x if X in (row, column) else y
            kernel = (1.0 if row == Z else -1.0) * along / r * self._radial("coupling", 1)(r)
        elif row != column:
            kernel = -x * y / r**2 * self._radial("difference", 2)(r)
        else:
            doubled = (x**2 - y**2) / r**2 * (1.0 if row == X else -1.0)
            both, difference = self._radial("sum", 0)(r), self._radial("difference", 2)(r)
            kernel = 0.5 * (both - doubled * difference)
        return np.asarray(kernel)

    def _transformed(self, name: str, order: int) -> RadialFunction:
        added = self._added
        if name == "sum":
            return self._waves.transform(added.along + added.across, order)
        if name == "difference":
            return self._waves.transform(added.along - added.across, order)
        return self._waves.transform(getattr(added, name), order)
