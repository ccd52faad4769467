"""Stress that a structure carries past its contact, in either body, on and just below the face.

A solved structure knows the displacement u of either body's face at its nodes. If the body were a
half-space, the nodal contact forces f, carried to the grid (Π), would have displaced it by K Π f.
The rest

    r = u - K Π f

belongs to all stress that is not the contact's own: of the load that passes under it, of bending,
of corners. Like the link of two scales (:mod:`wear.contact.link`), which is the difference between
those of both bodies, r is smooth and fitted by polynomials of low order. Its stress leaves the face
free of tractions, so that it follows from derivatives along the face alone:

    σ_ab = E/(1 - ν²) [(1 - ν) ε_ab + ν ε_cc δ_ab],   ε_ab = ½(r_a,b + r_b,a) - z r_z,ab
    σ_az = -z σ_ab,b,   σ_zz = 0                       (a, b, c: x and y)

up to terms in z², by the plane stress of a free face, ∂r_a/∂z = -r_z,a there, and equilibrium. The
contact's own stress, to be added, is that of half-spaces under the tractions on the fine grid.

Where a temperature expands the body by θ, only the strain less θ makes stress: σ_xx and σ_yy are
reduced by E θ/(1 - ν), with θ linear in z.

The stress of elements would be wrong next to the face, where it changes within one element; the
displacements of nodes are not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sa_solver.half_space.operator import HalfSpace
from sa_solver.half_space.subsurface_influence import XX, XY, YY, YZ, ZX
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, ElasticPair, Grid, Material
from wear.contact.link import StructureLink, fitted_like, linked
from wear.contact.transfer import Transfer

RIGID = Material(np.inf, 0.0)

SECOND = ((2, 0), (1, 1), (0, 2))
"""Orders along x and y of the second derivatives."""

SIDE: dict[int, float] = {1: -1.0, 2: 1.0}
"""Sign of the side of the face on which a body lies along z. The motion of body 2 relative to body
1 has the same signs.
"""


@dataclass(frozen=True)
class BulkStress:
    """Bulk stress of one ``body`` over a closed cycle.

    Parameters
    ----------
    rest
        r of every increment, times the sign of the side on which the body lies.
    material
        Elastic constants of the body.
    body
        1 or 2.
    expansion
        Thermal expansion: the first component is θ on the face, the second its slope along z
        [1/mm]. None where no temperature changes.
    """

    rest: StructureLink
    material: Material
    body: Literal[1, 2]
    expansion: StructureLink | None = None

    def increment(self, t: int) -> BulkStress:
        """Return the bulk stress of increment ``t`` alone."""
        expansion = self.expansion and self.expansion.increment(t)
        return replace(self, rest=self.rest.increment(t), expansion=expansion)

    def at(self, places: Array, depth: float | Array) -> Array:
        """Return the stress ``(t, 6, nx, ny)`` [MPa] at ``depth`` below ``places``.

        ``places`` is ``(2, nx, ny)`` [mm]; ``depth`` [mm] may be an array that broadcasts to ``(nx,
        ny)``.
        """
        face = self.along_face(places, depth)
        across = -SIDE[self.body] * depth * self.rest.sums(self._across, places)
        stress = np.zeros((len(face), 6, *face.shape[2:]))
        stress[:, [XX, YY, XY]], stress[:, [YZ, ZX]] = face, across
        return stress

    def along_face(self, places: Array, depth: float | Array) -> Array:
        """Return the components xx, yy and xy of the stress alone ``(t, 3, nx, ny)`` [MPa]."""
        z, flat, bent = SIDE[self.body] * depth, self._flat, self._bent
        if np.ndim(z) == 0:
            return self.rest.sums(flat - z * bent, places)
        return self.rest.sums(flat, places) - z * self.rest.sums(bent, places)

    # Stress consists of derivatives of r and of the expansion, and so do its coefficients.

    @property
    def _flat(self) -> Array:
        """Coefficients of xx, yy and xy on the face ``(t, 3, a, b)``."""
        x, y = (self._moved(orders) for orders in ((1, 0), (0, 1)))
        return self._plane(x[:, 0], y[:, 1], x[:, 1] + y[:, 0], self._hot((0, 0))[:, 0])

    @property
    def _bent(self) -> Array:
        """Coefficients of the growth of xx, yy and xy along -z ``(t, 3, a, b)``."""
        xx, xy, yy = (self._moved(orders)[:, 2] for orders in SECOND)
        return self._plane(xx, yy, 2.0 * xy, -self._hot((0, 0))[:, 1])

    @property
    def _across(self) -> Array:
        """Coefficients of the growth of yz and zx along -z ``(t, 2, a, b)``."""
        xx, xy, yy = (self._moved(orders) for orders in SECOND)
        by_x, by_y = (self._hot(orders)[:, 0] for orders in ((1, 0), (0, 1)))
        along_x = self._plane(xx[:, 0], xy[:, 1], xy[:, 0] + xx[:, 1], by_x)
        along_y = self._plane(xy[:, 0], yy[:, 1], yy[:, 0] + xy[:, 1], by_y)
        return np.stack([along_x[:, 2] + along_y[:, 1], along_x[:, 0] + along_y[:, 2]], axis=1)

    def _plane(self, x: Array, y: Array, sheared: Array, hot: Array) -> Array:
        """Return the plane stress ``(t, 3, a, b)`` of normal and shear strains and expansion."""
        material = self.material
        plane = material.young / (1.0 - material.poisson**2)
        held = material.young / (1.0 - material.poisson) * hot
        along_x = plane * (x + material.poisson * y) - held
        along_y = plane * (y + material.poisson * x) - held
        return np.stack([along_x, along_y, material.shear_modulus * sheared], axis=1)

    def _moved(self, orders: tuple[int, int]) -> Array:
        """Return the derivatives of r in the frame of the body ``(t, 3, a, b)``."""
        return SIDE[self.body] * self.rest.derived(orders)

    def _hot(self, orders: tuple[int, int]) -> Array:
        """Return the derivatives of the expansion and of its slope along z ``(t, 2, a, b)``."""
        if self.expansion is None:
            return np.zeros_like(self.rest.coefficients[:, :2])
        return self.expansion.derived(orders)[:, :2]


class BodyFace:
    """The face of one body on a grid, which separates bulk from contact deformation."""

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
        """Return the bulk stress of a solved cycle, or None if too few nodes are near the contact.

        It takes a convolution for each loaded increment.

        Parameters
        ----------
        loads
            Resultants of the cycle.
        force
            Nodal forces on body 2 ``(t, 3, n)`` [N].
        displacement
            Displacement of this body at the nodes ``(t, 3, n)`` [mm].
        expansion
            Thermal strains at the nodes and their slopes along z [1/mm] ``(t, 2, n)``, if any.
        """
        moved = SIDE[self.body] * displacement
        rest = linked(self.half_space, self.face, loads, force, moved, shear=True)
        if not rest.corrects:
            return None
        if expansion is None:
            return BulkStress(rest, self.material, self.body)
        nodal = np.pad(expansion, ((0, 0), (0, 1), (0, 0)))
        thermal = fitted_like(rest, self.face, nodal)
        return BulkStress(rest, self.material, self.body, thermal)
