"""The link of two scales: the correction of a half-space contact for its structure.

A solved structure knows the contact forces f and the relative displacement w at the nodes of a
contact face, for every increment. Carried to the grid (Π), the forces would move two half-spaces by
K Π f, so that

    d = w - K Π f

is the deformation of the two bodies beyond that of half-spaces: bending, corners, finite depth,
strain of their bulk. The singular parts cancel, so that d is smooth, and a least-squares fit of low
order removes the graininess of the mesh. With the gap widened by d_z, and the surfaces moved by d_x
and d_y before they touch, the half-space reproduces the structure's own contact at the resolution
of the mesh, and resolves what the mesh cannot: a defect correction (Stetter 1978,
doi:10.1007/BF01432879).

The polynomials are products of Legendre polynomials along x and y over the nodes near the contact.
Beyond these nodes they are constant, except for the linear terms. d may contain rigid motions: they
have no effect where resultants are imposed, and are the tilt of the structure where the tilt is
held.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.legendre import legder, legvander

from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.ties import first_largest
from sa_solver.types import Array, Mask
from wear.contact.transfer import Transfer

MARGIN = 0.5
"""Width beyond the loaded nodes over which a link is fitted, in sizes of the loaded area, where the
face has nodes. Displacements are known there too, and the mesh is poorest at the ends of the
contact.
"""

FEWEST_ACROSS = 8.0
"""Facets along x and along y over which a link is fitted again if the first fit leaves too large a
residual. Spheres and cylinders that press one to three nodes had peak pressures 3 to 5 % too high;
with a fit over 6 facets they are 0.2 to 2 % off, over 8 or 12 facets up to 0.9 %, and 1.6 % with
elements of second order.
"""

LEAST_DETERMINED = 1e-3
"""Singular values of the fit below this share of the largest are discarded. They belong to shapes
that the nodes can hardly distinguish, as in the corners of a square around a round face.
"""

FEWEST_NODES = 4
"""Least number of nodes near a contact. Fewer nodes determine no more than a rigid motion."""

LARGEST_RESIDUAL = 0.03
"""Largest acceptable residual of a fit, over the deflection of the half-spaces. The relative error
of the pressures is one to three times the residual: 6 % and 7 % where a cylinder on a layer had
residuals of 5 % and 4 %, 1.5 % at 0.6 %, and 0.3 % where the default two-dimensional dovetail had
1.3 % with elements of first order.
"""

SMOOTH = 1.8
"""Ratio of the smooth part of a residual to the rest above which the residual is not graininess of
the mesh. The ratio of node-to-node noise is 1.7 on a line and 1.1 on a face, and less after a fit;
that of waves eight nodes long is 9.
"""


@dataclass(frozen=True)
class StructureLink:
    """The correction d of every increment, by polynomials.

    Without increments a link corrects nothing.

    Parameters
    ----------
    coefficients
        Coefficients of the polynomials of d ``(t, 3, a, b)`` [mm].
    region
        Least and largest x and y of the fit ``(2, 2)`` [mm].
    quality
        Root mean squares of the normal component at the largest load ``(3,)``: of d, of the smooth
        part of the residual, and of the rest of the residual, which is the graininess of the mesh.
        All are relative to the deflection of the half-spaces, and plane parts are left out.
    """

    coefficients: Array
    region: Array
    quality: Array

    @classmethod
    def none(cls) -> StructureLink:
        """Return a link that corrects nothing."""
        return cls(np.empty((0, 3, 0, 0)), np.zeros((2, 2)), np.zeros(3))

    @property
    def corrects(self) -> bool:
        return len(self.coefficients) > 0

    @property
    def degrees(self) -> tuple[int, int]:
        """Degrees of the polynomials along x and y."""
        return self.coefficients.shape[2] - 1, self.coefficients.shape[3] - 1

    @property
    def residual(self) -> float:
        """Residual of the fit, relative to the deflection of the half-spaces."""
        return float(np.hypot(*self.quality[1:]))

    @property
    def coarse(self) -> bool:
        """True if the residual of the fit is too large: pressures have an error of that order."""
        return self.residual > LARGEST_RESIDUAL

    @property
    def grainy(self) -> bool:
        """True if the residual is mostly graininess of the mesh: the fit follows d itself."""
        _, smooth, grain = self.quality
        return bool(smooth <= SMOOTH * grain)

    def fields(self, places: Array) -> Array:
        """Return d ``(t, 3, nx, ny)`` [mm] at places ``(2, nx, ny)`` of the face [mm]."""
        basis = _products(places.reshape(2, -1).T, self.region, self.degrees)
        return _summed(self.coefficients, basis, places)

    def derived(self, orders: tuple[int, int]) -> Array:
        """Return the coefficients ``(t, 3, a, b)`` of derivatives of d along x and y.

        In mm^(1 - sum of orders).
        """
        coefficients, size = self.coefficients, self.region[1] - self.region[0]
        for axis, (order, length) in enumerate(zip(orders, size.tolist(), strict=True), start=2):
            coefficients = _derived(coefficients, axis, order, length)
        return coefficients

    def sums(self, coefficients: Array, places: Array) -> Array:
        """Return the polynomials with other ``coefficients`` ``(t, c, a, b)`` at ``places``.

        The result is ``(t, c, nx, ny)`` at ``places`` ``(2, nx, ny)`` [mm]. Beyond the region it is
        constant.
        """
        scaled = np.clip(_scaled(places.reshape(2, -1).T, self.region), -1.0, 1.0).T
        along_x, along_y = map(legvander, scaled, self.degrees)
        products = along_x[:, :, None] * along_y[:, None, :]
        return _summed(coefficients, products.reshape(len(along_x), -1), places)

    def without_shift(self) -> StructureLink:
        """Return the link without the rigid translation of the bodies, whose size is arbitrary."""
        coefficients = self.coefficients.copy()
        coefficients[:, :, :1, :1] = 0.0
        return replace(self, coefficients=coefficients)

    def level(self) -> StructureLink:
        """Return the link without the tilt of the bodies."""
        coefficients = self.coefficients.copy()
        coefficients[:, 2, 1:2, :1] = coefficients[:, 2, :1, 1:2] = 0.0
        return replace(self, coefficients=coefficients)

    def increment(self, t: int) -> StructureLink:
        """Return the link of increment ``t`` alone."""
        return replace(self, coefficients=self.coefficients[t : t + 1])

    def lift(self, increment: int, places: Array) -> Array:
        """Return the widening of the gap in an increment ``(nx, ny)`` [mm] at ``places``."""
        if not self.corrects:
            return np.zeros(places.shape[1:])
        lift: Array = self.increment(increment).fields(places)[0, 2]
        return lift


def linked(
    half_space: HalfSpace,
    face: Transfer,
    loads: LoadHistory,
    force: Array,
    displacement: Array,
    shear: bool,
) -> StructureLink:
    """Return the link of a solved cycle, or no correction if too few nodes are near the contact.

    It takes a convolution for each loaded increment.

    Parameters
    ----------
    half_space
        Half-space of the contact.
    face
        Transfer between the nodes and the grid.
    loads
        Resultants of the cycle.
    force
        Nodal forces on body 2 ``(t, 3, n)`` [N].
    displacement
        Displacement of body 2 relative to body 1 since both were unloaded ``(t, 3, n)`` [mm].
    shear
        Whether the half-space computes its own friction, so that K includes shear. Without it, the
        deformation by shear is left to d.
    """
    deflection = _deflection(half_space, face, loads, force, shear)
    defect = face.means(displacement) - deflection
    return fitted(face, defect, deflection, force[:, 2], first_largest(loads.P)).without_shift()


def fitted(
    face: Transfer, defect: Array, deflection: Array, pressing: Array, peak: int
) -> StructureLink:
    """Return the link of a ``defect`` at the nodes, or no correction if too few nodes are near.

    On the two or three nodes of a narrow contact d may be mostly graininess. If the residual is too
    large, the fit is repeated over more nodes.

    Parameters
    ----------
    face
        Transfer between the nodes and the grid.
    defect
        The defect d at the nodes ``(t, 3, n)`` [mm], as :meth:`Transfer.means` averages it.
    deflection
        Deflection of the half-spaces at the nodes ``(t, 3, n)`` [mm].
    pressing
        Nodal normal forces ``(t, n)``, which show where the contact is.
    peak
        Increment of which the quality is evaluated.
    """
    region = _region(face, pressing)
    link = _fit(face, defect, deflection, region, peak)
    wider = _region(face, pressing, FEWEST_ACROSS)
    if link.coarse and np.any(wider != region):
        link = _fit(face, defect, deflection, wider, peak)
    return link


def _fit(
    face: Transfer, defect: Array, deflection: Array, region: Array, peak: int
) -> StructureLink:
    """Return the link fitted over a region."""
    near = _near(face, region)
    if near.sum() < FEWEST_NODES:
        return StructureLink.none()
    degrees = _degrees(region, face.spacing(region))
    coefficients, basis = _least_squares(face, defect, region, near, degrees)
    residual = np.zeros(len(near))
    residual[near] = defect[peak, 2, near] - basis @ coefficients[peak, 2].ravel()
    quality = _quality(face, near, defect[peak, 2], deflection[peak, 2], residual)
    return StructureLink(coefficients, region, quality)


def fitted_like(link: StructureLink, face: Transfer, nodal: Array) -> StructureLink:
    """Fit fields with ``nodal`` values ``(t, 3, n)`` as the given ``link`` was fitted.

    The fit has the degrees and the region of that link, and no quality.
    """
    near = _near(face, link.region)
    given = face.means(nodal), link.region, near, link.degrees
    return replace(link, coefficients=_least_squares(face, *given)[0], quality=np.zeros(3))


def _near(face: Transfer, region: Array) -> Mask:
    """Return the nodes ``(n,)`` in a region that have the other body's face opposite."""
    inside = np.all((face.nodes >= region[0]) & (face.nodes <= region[1]), axis=1)
    near: Mask = inside & (face.opposed > 0.0) & face.reached
    return near


def _least_squares(
    face: Transfer, given: Array, region: Array, near: Mask, degrees: tuple[int, int]
) -> tuple[Array, Array]:
    """Return the coefficients ``(t, 3, a, b)`` of fields ``(t, 3, n)``, and the basis at nodes.

    Only the nodes ``near`` the contact are fitted.
    """
    basis = face.means(_products(face.nodes, region, degrees).T).T[near]
    weights = np.sqrt(face.opposed[near])
    rows = (given[..., near] * weights).reshape(-1, len(basis))
    fit = np.linalg.lstsq(weights[:, None] * basis, rows.T, rcond=LEAST_DETERMINED)[0].T
    return np.array(fit).reshape(*given.shape[:2], degrees[0] + 1, degrees[1] + 1), basis


def _deflection(
    half_space: HalfSpace, face: Transfer, loads: LoadHistory, force: Array, shear: bool
) -> Array:
    """Return K Π f at the nodes ``(t, 3, n)`` [mm]; without ``shear`` of the pressure alone."""
    deflection = np.zeros(force.shape)
    for t in np.flatnonzero(loads.P > 0.0):
        if shear:
            deflection[t] = face.sample(half_space.displacement(face.spread(force[t])))
        else:
            deflection[t, 2] = face.sample(half_space.normal(face.spread(force[t, 2])))
    return deflection


def _region(face: Transfer, pressing: Array, fewest: float = 0.0) -> Array:
    """Return the box, with a margin, around nodes with a ``pressing`` force ``(t, n)``.

    A force in any increment counts. The box is at least ``fewest`` facets wide where the face is.
    """
    nodes = face.nodes
    pressed = nodes[(pressing > 0.0).any(axis=0)]
    if len(pressed) == 0:
        pressed = nodes
    low, high = pressed.min(axis=0), pressed.max(axis=0)
    facet = face.per_facet * face.spacing(np.stack([low, high]))
    size, least = high - low, fewest * facet
    margin = np.maximum(MARGIN * size, 0.5 * (least - size))
    ends = np.stack([nodes.min(axis=0), nodes.max(axis=0)])
    return np.stack([np.maximum(low - margin, ends[0]), np.minimum(high + margin, ends[1])])


def _degrees(region: Array, spacing: Array) -> tuple[int, int]:
    """Return the degrees along x and y: the square root of the number of nodes along each.

    The graininess that passes the fit grows with the degree over that number, the error of
    truncation falls with the degree.
    """
    size = region[1] - region[0]
    counts = 1.0 + np.divide(size, spacing, out=np.zeros(2), where=spacing > 0.0)
    x, y = (round(np.sqrt(count)) if count > 1.0 else 0 for count in counts.tolist())
    return x, y


def _products(points: Array, region: Array, degrees: tuple[int, int]) -> Array:
    """Return products of Legendre polynomials at ``points`` ``(n, 2)``: ``(n, (a + 1) (b + 1))``.

    Beyond the ``region`` they are constant, except for the two linear ones: bodies turn as a whole.
    """
    scaled = _scaled(points, region)
    along_x, along_y = (
        legvander(values, degree)
        for values, degree in zip(np.clip(scaled, -1.0, 1.0).T, degrees, strict=True)
    )
    products: Array = along_x[:, :, None] * along_y[:, None, :]
    products[:, 1:2, 0], products[:, 0, 1:2] = scaled[:, :1], scaled[:, 1:]
    return products.reshape(len(points), -1)


def _scaled(points: Array, region: Array) -> Array:
    """Return points ``(n, 2)`` scaled to ±1 at the ends of the region, 0 where it has no width."""
    size = region[1] - region[0]
    scaled = np.zeros_like(points)
    np.divide(2.0 * (points - region[0]) - size, size, out=scaled, where=size > 0.0)
    return scaled


def _summed(coefficients: Array, basis: Array, places: Array) -> Array:
    """Return the sums ``(t, c, nx, ny)`` of a ``basis`` ``(nx ny, m)`` at ``places``."""
    rows = coefficients.reshape(-1, basis.shape[1]) @ basis.T
    return rows.reshape(*coefficients.shape[:2], *places.shape[1:])


def _derived(coefficients: Array, axis: int, order: int, length: float) -> Array:
    """Return the coefficients of derivatives along an ``axis``, in as many Legendre polynomials.

    ``length`` is the length of their interval [mm].
    """
    derived, left = np.zeros_like(coefficients), coefficients.shape[axis] - order
    if left > 0:
        lower = np.moveaxis(derived, axis, 0)[:left]
        scale = 2.0 / length if order else 1.0
        lower[:] = np.moveaxis(legder(coefficients, order, scl=scale, axis=axis), axis, 0)
    return derived


def _quality(face: Transfer, near: Mask, d: Array, deflection: Array, residual: Array) -> Array:
    """Return the ``quality`` of a :class:`StructureLink` from nodal normal components ``(n,)``."""
    plane = np.column_stack([np.ones(near.sum()), face.nodes[near]])
    bent = [
        values[near] - plane @ np.linalg.lstsq(plane, values[near], rcond=None)[0]
        for values in (deflection, d)
    ]
    smooth = face.to_nodes(face.to_cells(residual))
    parts = (bent[1], smooth[near], (residual - smooth)[near])
    scale = _rms(bent[0])
    return np.array([_rms(part) / scale if scale > 0.0 else 0.0 for part in parts])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
