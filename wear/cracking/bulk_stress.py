"""Stress that a structure carries past its contact, in either body, on and just below the face.

A structure that has been solved knows how far either body's face moves, u, at its nodes. Had the
body been a half-space, the nodal contact forces f, carried to the grid (Π), would have moved it by
K Π f. The rest

    r = u - K Π f

is the motion that goes with all stress which is not the contact's own: of the load that passes
under it, of bending, of corners. Like the link of two scales (:mod:`wear.contact.link`), which is
the difference of those of both bodies, r is smooth and fitted by polynomials of low order. Its
stress leaves the face free of tractions, so that derivatives along the face are all there is to
know:

    σ_ab = E/(1 - ν²) [(1 - ν) ε_ab + ν ε_cc δ_ab],   ε_ab = ½(r_a,b + r_b,a) - z r_z,ab
    σ_az = -z σ_ab,b,   σ_zz = 0                       (a, b, c: x and y)

up to terms in z², by the plane stress of a free face, ∂r_a/∂z = -r_z,a there, and equilibrium. What
is to be added is the stress of half-spaces under the tractions as they are on the fine grid.

Where a temperature expands the body by θ, strains make stress less θ: from σ_xx and σ_yy go
E θ/(1 - ν), with θ linear in z.

The stress of elements would be wrong next to the face, where it changes within one of them:
displacements of nodes are not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sa_solver.half_space.operator import HalfSpace
from sa_solver.half_space.subsurface_influence import XX, XY, YY, YZ, ZX
from sa_solver.types import Array, ElasticPair, Grid, LoadHistory, Material
from wear.contact.link import Link, fitted_alike, linked
from wear.contact.transfer import Transfer

RIGID = Material(np.inf, 0.0)

SECOND = ((2, 0), (1, 1), (0, 2))
"""Orders along x and y of second derivatives."""

SIDE: dict[int, float] = {1: -1.0, 2: 1.0}
"""Of the face on which a body lies, along z; the motion of body 2 relative to body 1 has it too."""


@dataclass(frozen=True)
class BulkStress:
    """That of one ``body`` and its ``material`` over a closed cycle.

    ``rest`` is r of every increment, times the side of the face on which the body lies. The first
    component of ``expansion`` is θ on the face, the second its slope along z [1/mm]; None where no
    temperature changes.
    """

    rest: Link
    material: Material
    body: Literal[1, 2]
    expansion: Link | None = None

    def increment(self, t: int) -> BulkStress:
        """That of increment ``t`` alone."""
        expansion = self.expansion and self.expansion.increment(t)
        return replace(self, rest=self.rest.increment(t), expansion=expansion)

    def at(self, places: Array, depth: float | Array) -> Array:
        """Stress ``(t, 6, nx, ny)`` [MPa] at ``depth`` below ``places`` ``(2, nx, ny)`` [mm].

        ``depth`` may be an array that makes ``(nx, ny)`` of the shape of the places.
        """
        face = self.along_face(places, depth)
        across = -SIDE[self.body] * depth * self.rest.sums(self._across, places)
        stress = np.zeros((len(face), 6, *face.shape[2:]))
        stress[:, [XX, YY, XY]], stress[:, [YZ, ZX]] = face, across
        return stress

    def along_face(self, places: Array, depth: float | Array) -> Array:
        """Its components xx, yy and xy alone, ``(t, 3, nx, ny)``."""
        z, flat, bent = SIDE[self.body] * depth, self._flat, self._bent
        if np.ndim(z) == 0:
            return self.rest.sums(flat - z * bent, places)
        return self.rest.sums(flat, places) - z * self.rest.sums(bent, places)

    # Coefficients of polynomials like those of r, of expansion too: stress is made of derivatives.

    @property
    def _flat(self) -> Array:
        """Of xx, yy and xy on the face ``(t, 3, a, b)``."""
        x, y = (self._moved(orders) for orders in ((1, 0), (0, 1)))
        return self._plane(x[:, 0], y[:, 1], x[:, 1] + y[:, 0], self._hot((0, 0))[:, 0])

    @property
    def _bent(self) -> Array:
        """By how much these grow along -z ``(t, 3, a, b)``."""
        xx, xy, yy = (self._moved(orders)[:, 2] for orders in SECOND)
        return self._plane(xx, yy, 2.0 * xy, -self._hot((0, 0))[:, 1])

    @property
    def _across(self) -> Array:
        """By how much yz and zx grow along -z ``(t, 2, a, b)``."""
        xx, xy, yy = (self._moved(orders) for orders in SECOND)
        by_x, by_y = (self._hot(orders)[:, 0] for orders in ((1, 0), (0, 1)))
        along_x = self._plane(xx[:, 0], xy[:, 1], xy[:, 0] + xx[:, 1], by_x)
        along_y = self._plane(xy[:, 0], yy[:, 1], yy[:, 0] + xy[:, 1], by_y)
        return np.stack([along_x[:, 2] + along_y[:, 1], along_x[:, 0] + along_y[:, 2]], axis=1)

    def _plane(self, x: Array, y: Array, sheared: Array, hot: Array) -> Array:
        """Plane stress ``(t, 3, a, b)`` of strains along x and y, shear strain and expansion."""
        material = self.material
        plane = material.young / (1.0 - material.poisson**2)
        held = material.young / (1.0 - material.poisson) * hot
        along_x = plane * (x + material.poisson * y) - held
        along_y = plane * (y + material.poisson * x) - held
        return np.stack([along_x, along_y, material.shear_modulus * sheared], axis=1)

    def _moved(self, orders: tuple[int, int]) -> Array:
        """Derivatives of r, on whichever side the body lies ``(t, 3, a, b)``."""
        return SIDE[self.body] * self.rest.derived(orders)

    def _hot(self, orders: tuple[int, int]) -> Array:
        """Derivatives of expansion and of its slope along z, if any ``(t, 2, a, b)``."""
        if self.expansion is None:
            return np.zeros_like(self.rest.coefficients[:, :2])
        return self.expansion.derived(orders)[:, :2]


class BodyFace:
    """The face of one ``body`` on a grid: what is its own of the motion that a structure finds."""

    def __init__(self, grid: Grid, face: Transfer, material: Material, body: Literal[1, 2]) -> None:
        self.face, self.material, self.body = face, material, body
        pair = (material, RIGID) if body == 1 else (RIGID, material)
        self.half_space = HalfSpace(grid, ElasticPair(*pair))

    def bulk_stress(
        self,
        loads: LoadHistory,
        force: Array,
        displacement: Array,
        expansion: Array | None = None,
    ) -> BulkStress | None:
        """Of a solved cycle; a convolution for each of its loaded increments.

        ``force`` ``(t, 3, n)`` on body 2 [N] and the ``displacement`` ``(t, 3, n)`` of this body
        [mm] are those at the nodes, ``expansion`` ``(t, 2, n)`` thermal strains there and their
        slopes along z [1/mm], if there are any. None where too few nodes are near the contact.
        """
        moved = SIDE[self.body] * displacement
        rest = linked(self.half_space, self.face, loads, force, moved, shear=True)
        if not rest.corrects:
            return None
        if expansion is None:
            return BulkStress(rest, self.material, self.body)
        nodal = np.pad(expansion, ((0, 0), (0, 1), (0, 0)))
        thermal = fitted_alike(rest, self.face, nodal)
        return BulkStress(rest, self.material, self.body, thermal)
