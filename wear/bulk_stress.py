"""Stress that a structure carries past its contact, in either body, on and just below the face.

A structure that has been solved knows how far either body's face moves, u, at its nodes. Had the
body been a half-space, the nodal contact forces f, carried to the grid (Π), would have moved it by
K Π f. The rest

    r = u - K Π f

is the motion that goes with all stress which is not the contact's own: of the load that passes
under it, of bending, of corners. Like the link of two scales (:mod:`wear.link`), which is the
difference of those of both bodies, r is smooth and fitted by polynomials of low order. Its stress
leaves the face free of tractions, so that derivatives along the face are all there is to know:

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

from sa_solver.half_space import HalfSpace
from sa_solver.subsurface_influence import XX, XY, YY, YZ, ZX
from sa_solver.types import Array, ElasticPair, Grid, LoadHistory, Material
from wear.link import Link, Transfer, fitted_alike, linked

RIGID = Material(np.inf, 0.0)

FIRST, SECOND = ((1, 0), (0, 1)), ((2, 0), (1, 1), (0, 2))
"""Orders along x and y of the derivatives that are needed."""

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
        rest, z = self._moved, SIDE[self.body] * depth
        xx, xy, yy = (rest.derivative(places, orders, (0, 1)) for orders in SECOND)
        poisson, shear = self.material.poisson, self.material.shear_modulus
        plane = self.material.young / (1.0 - poisson**2)
        face = self.along_face(places, depth)
        stress = np.zeros((len(face), 6, *face.shape[2:]))
        stress[:, [XX, YY, XY]] = face
        along_x = plane * (xx[:, 0] + poisson * xy[:, 1]) + shear * (xy[:, 1] + yy[:, 0])
        along_y = plane * (yy[:, 1] + poisson * xy[:, 0]) + shear * (xy[:, 0] + xx[:, 1])
        if self.expansion is not None:
            by_x, by_y = (self.expansion.derivative(places, orders, (0,)) for orders in FIRST)
            along_x -= self._held * by_x[:, 0]
            along_y -= self._held * by_y[:, 0]
        stress[:, ZX], stress[:, YZ] = -z * along_x, -z * along_y
        return stress

    def along_face(self, places: Array, depth: float | Array) -> Array:
        """Its components xx, yy and xy ``(t, 3, nx, ny)``, which take a third of the time."""
        rest, z = self._moved, SIDE[self.body] * depth
        x, y = (rest.derivative(places, orders, (0, 1)) for orders in FIRST)
        xx, xy, yy = (rest.derivative(places, orders, (2,))[:, 0] for orders in SECOND)
        along_x, along_y = x[:, 0] - z * xx, y[:, 1] - z * yy
        poisson = self.material.poisson
        plane = self.material.young / (1.0 - poisson**2)
        stress = np.empty((len(along_x), 3, *along_x.shape[1:]))
        stress[:, 0] = plane * (along_x + poisson * along_y)
        stress[:, 1] = plane * (along_y + poisson * along_x)
        stress[:, 2] = self.material.shear_modulus * (x[:, 1] + y[:, 0] - 2.0 * z * xy)
        if self.expansion is not None:
            hot, by_z = np.moveaxis(self.expansion.derivative(places, (0, 0), (0, 1)), 1, 0)
            stress[:, :2] -= (self._held * (hot + z * by_z))[:, None]
        return stress

    @property
    def _moved(self) -> Link:
        """r, on whichever side the body lies."""
        return replace(self.rest, coefficients=SIDE[self.body] * self.rest.coefficients)

    @property
    def _held(self) -> float:
        """Stress of a strain that is held along the face [MPa]."""
        return self.material.young / (1.0 - self.material.poisson)


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
