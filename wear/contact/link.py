"""The link of two scales: what a structure adds to the half-space under its contact.

A structure that has been solved knows on the nodes of a contact face, for every increment, the
contact forces f and the relative displacement w. Carried to the grid (Π), the forces would move two
half-spaces by K Π f, so that

    d = w - K Π f

is all that the two bodies do beyond these: bending, corners, finite depth, strain of their bulk.
The singular parts cancel, d is smooth, and what is left of the mesh's own graininess is taken out
by a least-squares fit of low order. With the gap widened by d_z, and the surfaces moved by d_x and
d_y before they touch, the half-space finds the structure's own contact at the mesh's resolution,
and below it what the mesh cannot: a defect correction (Stetter 1978, doi:10.1007/BF01432879).

Polynomials are Legendre's, products along x and y, over the nodes near the contact, and constant
beyond but for what is linear. d may hold rigid motions: they do no harm where resultants are
imposed, and are the tilt of the structure where the tilt is held.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.polynomial.legendre import legder, legvander

from sa_solver.half_space.operator import HalfSpace
from sa_solver.ties import first_largest
from sa_solver.types import Array, Grid, LoadHistory, Mask

MARGIN = 0.5
"""How far beyond its loaded nodes a contact is fitted, in sizes of these, where the face has nodes.
Displacements are known there as well, and the ends of the contact are where the mesh is poorest."""

FEWEST_ACROSS = 8.0
"""Facets along x and along y over which a link is fitted whose fit about the contact leaves too
much. Spheres and cylinders that press one to three nodes had peak pressures 3 to 5 % too high; over
6 facets they are 0.2 to 2 % off, over 8 or 12 up to 0.9 %, with elements of second order 1.6 %."""

LEAST_DETERMINED = 1e-3
"""Singular values of the fit below this share of the largest are left out: shapes that the nodes
hardly tell apart, as the corners of a square about a round face are."""

FEWEST_NODES = 4
"""Nodes near a contact below which nothing can be told from them but a rigid motion."""

LARGEST_RESIDUAL = 0.03
"""Residual of a fit, over the deflection of the half-spaces, that may pass. Pressures are wrong by
one to three times as much: by 6 % and 7 % where a cylinder on a layer left 5 % and 4 %, by 1.5 %
where it left 0.6 %, by 0.3 % where the default dovetail left 1.3 % in the plane, on elements of
first order."""

SMOOTH = 1.8
"""Ratio of the smooth part of a residual to the rest from which it is no graininess. That of noise
from node to node is 1.7 on a line and 1.1 on a face, less once it is fitted; of waves eight nodes
long 9."""


class Transfer(Protocol):
    """Between the ``n`` nodes of a face and the ``(nx, ny)`` cells of the grid over it."""

    @property
    def nodes(self) -> Array:
        """Coordinates ``(n, 2)`` of the nodes [mm]."""
        ...

    @property
    def areas(self) -> Array:
        """Area of each node ``(n,)`` [mm²]; in a line contact [mm]."""
        ...

    @property
    def opposed(self) -> Array:
        """What the other body's face covers of the ``areas``: 0 where nothing is opposite."""
        ...

    def spacing(self, region: Array) -> Array:
        """Distance of neighbouring nodes along x and along y ``(2,)`` [mm]; 0 along y on a line.

        Those in a ``region`` ``(2, 2)``, between least and largest x and y.
        """
        ...

    @property
    def per_facet(self) -> int:
        """Of these distances along a facet: 2 with midsides."""
        ...

    @property
    def places(self) -> Array:
        """Where each cell lies on the face, or next to it on that, ``(2, nx, ny)`` [mm]."""
        ...

    def spread(self, forces: Array) -> Array:
        """Tractions ``(..., nx, ny)`` [MPa] of nodal ``forces`` ``(..., n)`` [N], sums kept."""
        ...

    @property
    def reached(self) -> Mask:
        """Nodes ``(n,)`` of which the grid tells all that :meth:`sample` takes."""
        ...

    def sample(self, cells: Array) -> Array:
        """Values ``(..., n)`` of fields ``(..., nx, ny)`` at the nodes, or means about them."""
        ...

    def means(self, nodal: Array) -> Array:
        """What :meth:`sample` gives of a field with ``nodal`` values ``(..., n)``."""
        ...

    def to_cells(self, nodal: Array) -> Array:
        """Cell values ``(..., nx, ny)`` of nodal values ``(..., n)``."""
        ...

    def to_nodes(self, cells: Array) -> Array:
        """Nodal values ``(n,)`` of cell values ``(nx, ny)``, volumes kept."""
        ...


@dataclass(frozen=True)
class CellNodes:
    """The transfer of a face whose nodes are the cells of its ``grid``, in the order of C.

    Examples
    --------
    Forces on the cells of a grid are pressures on it:

    >>> import numpy as np
    >>> from sa_solver import Grid
    >>> from wear import CellNodes
    >>> face = CellNodes(Grid.covering((1.0, 1.0), (2, 2)))
    >>> print(face.spread(np.array([10.0, 20.0, 30.0, 40.0])))
    [[ 40.  80.]
     [120. 160.]]
    >>> print(face.areas)
    [0.25 0.25 0.25 0.25]
    """

    grid: Grid

    @property
    def nodes(self) -> Array:
        return self.places.reshape(2, -1).T

    @property
    def areas(self) -> Array:
        return np.full(self.grid.shape[0] * self.grid.shape[1], self.grid.cell_area)

    @property
    def opposed(self) -> Array:
        return self.areas

    def spacing(self, region: Array) -> Array:
        return np.array([self.grid.pitch[0], 0.0 if self.grid.line else self.grid.pitch[1]])

    @property
    def per_facet(self) -> int:
        return 1

    @property
    def places(self) -> Array:
        return self.grid.centres

    def spread(self, forces: Array) -> Array:
        return self.to_cells(forces) / self.grid.cell_area

    @property
    def reached(self) -> Mask:
        return np.ones(self.grid.shape, dtype=np.bool_).ravel()

    def sample(self, cells: Array) -> Array:
        return cells.reshape(*cells.shape[:-2], -1)

    def means(self, nodal: Array) -> Array:
        return nodal

    def to_cells(self, nodal: Array) -> Array:
        return nodal.reshape(*nodal.shape[:-1], *self.grid.shape)

    def to_nodes(self, cells: Array) -> Array:
        return cells.ravel()


@dataclass(frozen=True)
class Link:
    """d of every increment, as ``coefficients`` ``(t, 3, a, b)`` [mm] of its polynomials.

    They are fitted over ``region`` ``(2, 2)``, the least and largest x and y [mm]. ``quality``
    ``(3,)`` says of the normal component at the largest load, each relative to the deflection of
    the half-spaces by root mean square, plane parts left out: d, the smooth part of what the fit
    leaves, and the rest of that, the mesh's graininess. Without increments it corrects nothing.
    """

    coefficients: Array
    region: Array
    quality: Array

    @classmethod
    def none(cls) -> Link:
        """No correction: half-spaces as they are."""
        return cls(np.empty((0, 3, 0, 0)), np.zeros((2, 2)), np.zeros(3))

    @property
    def corrects(self) -> bool:
        return len(self.coefficients) > 0

    @property
    def degrees(self) -> tuple[int, int]:
        """Of the polynomials along x and along y."""
        return self.coefficients.shape[2] - 1, self.coefficients.shape[3] - 1

    @property
    def residual(self) -> float:
        """What the fit leaves, relative to the deflection of the half-spaces."""
        return float(np.hypot(*self.quality[1:]))

    @property
    def coarse(self) -> bool:
        """Whether the fit leaves more than may pass: pressures are wrong by as much."""
        return self.residual > LARGEST_RESIDUAL

    @property
    def grainy(self) -> bool:
        """Whether what the fit leaves is the graininess of the mesh, or it cannot follow d."""
        _, smooth, grain = self.quality
        return bool(smooth <= SMOOTH * grain)

    def fields(self, places: Array) -> Array:
        """d ``(t, 3, nx, ny)`` [mm] at places ``(2, nx, ny)`` of the face [mm]."""
        basis = _products(places.reshape(2, -1).T, self.region, self.degrees)
        return _summed(self.coefficients, basis, places)

    def derived(self, orders: tuple[int, int]) -> Array:
        """Coefficients ``(t, 3, a, b)`` of derivatives of d along x and y [mm^(1 - orders)]."""
        coefficients, size = self.coefficients, self.region[1] - self.region[0]
        for axis, (order, length) in enumerate(zip(orders, size.tolist(), strict=True), start=2):
            coefficients = _derived(coefficients, axis, order, length)
        return coefficients

    def sums(self, coefficients: Array, places: Array) -> Array:
        """The same polynomials with such ``coefficients`` ``(t, c, a, b)``: ``(t, c, nx, ny)``.

        At ``places`` ``(2, nx, ny)`` [mm]; beyond the region those at its border.
        """
        scaled = np.clip(_scaled(places.reshape(2, -1).T, self.region), -1.0, 1.0).T
        along_x, along_y = map(legvander, scaled, self.degrees)
        products = along_x[:, :, None] * along_y[:, None, :]
        return _summed(coefficients, products.reshape(len(along_x), -1), places)

    def without_shift(self) -> Link:
        """The same without what moves the bodies as a whole: far away that may be any length."""
        coefficients = self.coefficients.copy()
        coefficients[:, :, :1, :1] = 0.0
        return replace(self, coefficients=coefficients)

    def level(self) -> Link:
        """The same without what merely tilts the bodies."""
        coefficients = self.coefficients.copy()
        coefficients[:, 2, 1:2, :1] = coefficients[:, 2, :1, 1:2] = 0.0
        return replace(self, coefficients=coefficients)

    def increment(self, t: int) -> Link:
        """That of increment ``t`` alone."""
        return replace(self, coefficients=self.coefficients[t : t + 1])

    def lift(self, increment: int, places: Array) -> Array:
        """What it adds to the gap in an increment ``(nx, ny)`` [mm], at ``places``."""
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
) -> Link:
    """The link that a solved cycle gives; a convolution for each of its loaded increments.

    None where too few nodes are near the contact.

    ``force`` ``(t, 3, n)`` on body 2 [N] and the ``displacement`` ``(t, 3, n)`` [mm] of body 2
    relative to body 1 since both were unloaded are those at the nodes. With ``shear`` the
    half-space has its own friction, and K is all of it; without, what shear does is left to d.
    """
    deflection = _deflection(half_space, face, loads, force, shear)
    defect = face.means(displacement) - deflection
    return fitted(face, defect, deflection, force[:, 2], first_largest(loads.P)).without_shift()


def fitted(face: Transfer, defect: Array, deflection: Array, pressing: Array, peak: int) -> Link:
    """The link of a ``defect`` ``(t, 3, n)`` at the nodes [mm], as :meth:`Transfer.sample` has it.

    ``deflection`` ``(t, 3, n)`` is that of the half-spaces, ``pressing`` ``(t, n)`` the forces that
    say where the contact is; quality is told of increment ``peak``. None where too few nodes are
    near the contact.

    On the two or three nodes of a narrow contact d may be all graininess. A fit that leaves too
    much of it is taken over more of them.
    """
    region = _region(face, pressing)
    link = _fit(face, defect, deflection, region, peak)
    wider = _region(face, pressing, FEWEST_ACROSS)
    if link.coarse and np.any(wider != region):
        link = _fit(face, defect, deflection, wider, peak)
    return link


def _fit(face: Transfer, defect: Array, deflection: Array, region: Array, peak: int) -> Link:
    """The link fitted over a region."""
    near = _near(face, region)
    if near.sum() < FEWEST_NODES:
        return Link.none()
    degrees = _degrees(region, face.spacing(region))
    coefficients, basis = _least_squares(face, defect, region, near, degrees)
    residual = np.zeros(len(near))
    residual[near] = defect[peak, 2, near] - basis @ coefficients[peak, 2].ravel()
    quality = _quality(face, near, defect[peak, 2], deflection[peak, 2], residual)
    return Link(coefficients, region, quality)


def fitted_alike(link: Link, face: Transfer, nodal: Array) -> Link:
    """Fields with ``nodal`` values ``(t, 3, n)``, fitted as a ``link`` that corrects was.

    By polynomials of its degrees over its region; of their quality nothing is said.
    """
    near = _near(face, link.region)
    given = face.means(nodal), link.region, near, link.degrees
    return replace(link, coefficients=_least_squares(face, *given)[0], quality=np.zeros(3))


def _near(face: Transfer, region: Array) -> Mask:
    """Nodes ``(n,)`` in a region that tell relative displacements: something is opposite."""
    inside = np.all((face.nodes >= region[0]) & (face.nodes <= region[1]), axis=1)
    near: Mask = inside & (face.opposed > 0.0) & face.reached
    return near


def _least_squares(
    face: Transfer, given: Array, region: Array, near: Mask, degrees: tuple[int, int]
) -> tuple[Array, Array]:
    """Coefficients ``(t, 3, a, b)`` of fields ``(t, 3, n)``, and their basis at nodes ``near``."""
    basis = face.means(_products(face.nodes, region, degrees).T).T[near]
    weights = np.sqrt(face.opposed[near])
    rows = (given[..., near] * weights).reshape(-1, len(basis))
    fit = np.linalg.lstsq(weights[:, None] * basis, rows.T, rcond=LEAST_DETERMINED)[0].T
    return np.array(fit).reshape(*given.shape[:2], degrees[0] + 1, degrees[1] + 1), basis


def _deflection(
    half_space: HalfSpace, face: Transfer, loads: LoadHistory, force: Array, shear: bool
) -> Array:
    """K Π f at the nodes ``(t, 3, n)`` [mm]; of the pressure along z alone without ``shear``."""
    deflection = np.zeros(force.shape)
    for t in np.flatnonzero(loads.P > 0.0):
        if shear:
            deflection[t] = face.sample(half_space.displacement(face.spread(force[t])))
        else:
            deflection[t, 2] = face.sample(half_space.normal(face.spread(force[t, 2])))
    return deflection


def _region(face: Transfer, pressing: Array, fewest: float = 0.0) -> Array:
    """Box about nodes with ``pressing`` force ``(t, n)`` in any increment, and a margin.

    At least so many facets wide, where the face is.
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
    """Degrees along x and y: the root of the number of nodes along either.

    The graininess that a fit lets through grows with its degree over that number, what it leaves
    out falls with the degree.
    """
    size = region[1] - region[0]
    counts = 1.0 + np.divide(size, spacing, out=np.zeros(2), where=spacing > 0.0)
    x, y = (round(np.sqrt(count)) if count > 1.0 else 0 for count in counts.tolist())
    return x, y


def _products(points: Array, region: Array, degrees: tuple[int, int]) -> Array:
    """Products of Legendre polynomials at ``points`` ``(n, 2)``: ``(n, (a + 1) (b + 1))``.

    Constant beyond the ``region`` but for the two that are linear: bodies turn as a whole.
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
    """Points ``(n, 2)`` with -1 and 1 at the ends of the region, 0 where it has no width."""
    size = region[1] - region[0]
    scaled = np.zeros_like(points)
    np.divide(2.0 * (points - region[0]) - size, size, out=scaled, where=size > 0.0)
    return scaled


def _summed(coefficients: Array, basis: Array, places: Array) -> Array:
    """Sums ``(t, c, nx, ny)`` of a ``basis`` ``(nx ny, m)`` at ``places``."""
    rows = coefficients.reshape(-1, basis.shape[1]) @ basis.T
    return rows.reshape(*coefficients.shape[:2], *places.shape[1:])


def _derived(coefficients: Array, axis: int, order: int, length: float) -> Array:
    """Those of derivatives along an ``axis``, of as many of Legendre's polynomials over a length.

    In mm.
    """
    derived, left = np.zeros_like(coefficients), coefficients.shape[axis] - order
    if left > 0:
        lower = np.moveaxis(derived, axis, 0)[:left]
        scale = 2.0 / length if order else 1.0
        lower[:] = np.moveaxis(legder(coefficients, order, scl=scale, axis=axis), axis, 0)
    return derived


def _quality(face: Transfer, near: Mask, d: Array, deflection: Array, residual: Array) -> Array:
    """See :class:`Link`: its ``quality`` from nodal values of the normal component ``(n,)``."""
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
