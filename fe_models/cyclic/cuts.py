"""Cyclic symmetry of a sector: its two cuts have the same displacements, rotated about the axis.

A wheel of N equal sectors under loads that are the same in each, rotated with it, deforms in the
same way in each (nodal diameter 0). With R the rotation by 360°/N that takes the low cut of a
sector to its high cut,

    u_high(R x) = R u_low(x),

and the tractions of the two cuts are each other's reaction. Cuts whose meshes are images of each
other are tied node by node, others by a mortar with dual functions
(:mod:`fe_models.joints.tied_faces`). Nodes on the axis are on both cuts and move along it only. The
ties are included in T, u = T u_free, after the supports. Of the rigid motions, T leaves the
rotation about the axis and the translation along it. Thomas 1979, doi:10.1002/nme.1620140107 (all
nodal diameters).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fe_models.elasticity.body import ElasticBody
from fe_models.joints.tied_faces import tied_projection
from fe_models.loads.constraints import Constraints
from fe_models.meshes.curved_face import EDGES
from fe_models.meshes.structure_mesh import Body, MeshError
from sa_solver.types import Array, Frame, Indices, Mask

# Distance of a node from an image, as a share of the largest distance from the axis, up to which
# they count as the same point: mesh files store six digits.
IMAGE = 2e-6
# Share of either cut that the other may leave uncovered if the meshes do not match: curved outlines
# differ by the sag of their edges.
MOST_UNCOVERED = 0.02
# Entries of a rotation up to this are rounding errors: the cosine of 90° is 6e-17.
ROUNDING = 1e-15


@dataclass(frozen=True)
class Cyclic:
    """One of several equal sectors of a wheel.

    Attributes
    ----------
    low, high
        Boundaries of its two cuts, one or several each.
    axis
        Direction of the axis ``(3,)``.
    through
        Point on the axis ``(3,)`` [mm].
    sectors
        Number of sectors.

    Examples
    --------
    A turn by a quarter about Y takes Z to X:

    >>> import numpy as np
    >>> from fe_models.cyclic.cuts import Cyclic
    >>> quarter = Cyclic(["a"], ["b"], np.array([0.0, 2.0, 0.0]), np.zeros(3), sectors=4)
    >>> print(quarter.turn() @ [0.0, 0.0, 1.0])
    [1. 0. 0.]
    """

    low: Sequence[str]
    high: Sequence[str]
    axis: Array
    through: Array
    sectors: int

    @property
    def direction(self) -> Array:
        """Unit vector of the axis."""
        return np.asarray(self.axis / np.linalg.norm(self.axis))

    @property
    def boundaries(self) -> tuple[str, ...]:
        """Boundaries of both cuts."""
        return *self.low, *self.high

    def radii(self, points: Array) -> Array:
        """Return the distances of points ``(n, 3)`` from the axis ``(n,)`` [mm]."""
        return np.asarray(np.linalg.norm(np.cross(points - self.through, self.direction), axis=1))

    def angle(self, one: Array, other: Array) -> float:
        """Return the angle between two points ``(3,)`` seen from the axis [rad]."""
        first, second = (np.cross(self.direction, place - self.through) for place in (one, other))
        return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))

    def turn(self, sectors: int = 1) -> Array:
        """Return the rotation ``(3, 3)`` by a number of ``sectors`` about the axis."""
        angle, e = 2.0 * np.pi * sectors / self.sectors, self.direction
        along = np.outer(e, e)
        turn = along + np.cos(angle) * (np.eye(3) - along) + np.sin(angle) * np.cross(np.eye(3), e)
        return np.where(np.abs(turn) < ROUNDING, 0.0, turn)


@dataclass(frozen=True)
class Cuts:
    """Two cuts of a body: facets of its mesh, and the rotation from the low to the high cut.

    Attributes
    ----------
    low, high
        Facets of the cuts.
    turn
        Rotation ``(3, 3)`` from low to high.
    through
        Point on the axis ``(3,)`` [mm].
    count
        Number of sectors.
    matched
        Whether the meshes of the cuts are images of each other.
    max_distance
        Largest distance of one cut from the image of the other [mm].

    Examples
    --------
    A quarter of a square, between the planes Z = 0 and X = 0:

    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from fe_models import Body
    >>> from fe_models.cyclic.cuts import Cuts, Cyclic
    >>> mesh = MeshTri().refined(1)
    >>> cuts = {"one": lambda x: x[1] == 0.0, "other": lambda x: x[0] == 0.0}
    >>> quarter = Body("quarter", mesh.with_boundaries(cuts))
    >>> found = Cuts.of(quarter, Cyclic(["one"], ["other"], np.eye(3)[1], np.zeros(3), 4))
    >>> print(found.matched, found.max_distance)
    True 0.0
    """

    low: Indices
    high: Indices
    turn: Array
    through: Array
    count: int
    matched: bool
    max_distance: float

    @classmethod
    def of(cls, body: Body, cyclic: Cyclic) -> Cuts:
        """Return the cuts at named boundaries. Raises as :meth:`between`."""
        return cls.between(
            body, cyclic, *(_facets(body, names) for names in (cyclic.low, cyclic.high))
        )

    @classmethod
    def between(cls, body: Body, cyclic: Cyclic, low: Indices, high: Indices) -> Cuts:
        """Return the cuts with these facets, whatever their boundaries are called.

        Raises :class:`MeshError` unless they are each other's image by the rotation of one sector.
        """
        if len(np.intersect1d(low, high)):
            raise MeshError(
                f"{' and '.join(cyclic.boundaries)} share facets; give boundaries without facets "
                "in common as the two cuts"
            )
        middles = [_middle(body, facets) for facets in (low, high)]
        through, turns = cyclic.through, (cyclic.turn(1), cyclic.turn(-1))
        turn = min(
            turns, key=lambda turn: _distance(turn @ (middles[0] - through), middles[1] - through)
        )
        outward = [body.outward_of(facets).sum(axis=0) for facets in (low, high)]
        if outward[1] @ turn @ outward[0] >= 0.0:
            raise MeshError(f"{_mismatch(cyclic)}: the body lies on the same side of both cuts")
        sector = cls(low, high, turn, through, cyclic.sectors, False, 0.0)
        reach = IMAGE * float(cyclic.radii(body.points).max())
        apart = sector._between_meshes(body)
        if apart <= reach:
            return replace(sector, matched=True, max_distance=apart)
        flat = _plane_of(body, high)
        if np.abs(flat.coordinates(_corners(body, high))[..., 2]).max() > reach:
            raise MeshError(
                f"{_mismatch(cyclic)}: nodes are up to {apart:.3g} mm off; cuts that are not plane "
                "must have matching meshes (in gmsh: setPeriodic)"
            )
        images = sector.images(_corners(body, low).reshape(-1, 3))
        level = float(np.abs(flat.coordinates(images)[:, 2]).max())
        if level > reach:
            angle = np.rad2deg(cyclic.angle(*middles))
            raise MeshError(
                f"{_mismatch(cyclic)}: it is up to {level:.3g} mm off; the centres of both are "
                f"{angle:.6g}° apart, as for {360.0 / max(angle, 1e-9):.4g} sectors"
            )
        return replace(sector, max_distance=level)

    def of_turn(self, body: Body) -> Array:
        """Return the rotation of a body's displacements ``(d, d)``."""
        return self.turn[np.ix_(body.axes, body.axes)]

    def vertices(self, body: Body) -> Indices:
        """Return the vertices of both cuts, each once."""
        return np.unique(body.mesh.facets[:, np.append(self.low, self.high)])

    def images(self, points: Array, sectors: int = 1) -> Array:
        """Return points ``(n, 3)`` rotated by a number of sectors, from the low to the high cut."""
        turn = np.linalg.matrix_power(self.turn if sectors >= 0 else self.turn.T, abs(sectors))
        return (points - self.through) @ turn.T + self.through

    def _between_meshes(self, body: Body) -> float:
        """Return the largest distance of the high cut's facet corners from images of the low cut's.

        It is infinite if the numbers of facets differ.
        """
        if len(self.low) != len(self.high):
            return np.inf
        images = self.images(_corners(body, self.low).reshape(-1, 3)).reshape(len(self.low), -1, 3)
        corners = _corners(body, self.high)
        partner = cKDTree(images.mean(axis=1)).query(corners.mean(axis=1))[1]
        apart = np.linalg.norm(images[partner][:, :, None] - corners[:, None], axis=3)
        return float(apart.min(axis=1).max())

    def tie(self, constraints: Constraints, elastic: ElasticBody) -> None:
        """Tie the nodes of the high cut to those of the low one, after all supports."""
        low, high = (np.unique(elastic.facet_nodes(facets)) for facets in (self.low, self.high))
        turn = self.of_turn(elastic.body)
        shared = np.intersect1d(low, high)
        constraints.tie(shared, shared, sp.identity(len(shared), format="csr"), turn)
        constraints.tie(high, low, self._shares(elastic, low, high), turn)

    def _shares(self, elastic: ElasticBody, low: Indices, high: Indices) -> sp.csr_matrix:
        """Return the matrix ``(n, m)`` by which the nodes ``high`` follow the nodes ``low``."""
        images = self.images(elastic.nodes[low])
        reach = IMAGE * float(np.linalg.norm(elastic.nodes - self.through, axis=1).max())
        if self.matched:
            apart, partner = cKDTree(images).query(elastic.nodes[high])
            self._check_midsides(elastic, float(apart.max()), reach)
            every = np.arange(len(high))
            return sp.csr_matrix((np.ones(len(high)), (every, partner)), (len(high), len(low)))
        if elastic.curved and max(_bent(elastic, side) for side in (self.low, self.high)) > reach:
            raise MeshError(
                f"body {elastic.body.name}: edges of the cuts are curved, and their meshes do not "
                "match; make both meshes match (in gmsh: setPeriodic), or use elements of order 1"
            )
        frame = _plane_of(elastic.body, self.high)
        follows, tied = tied_projection(
            frame.coordinates(elastic.nodes[high]),
            np.searchsorted(high, elastic.facet_nodes(self.high)),
            frame.coordinates(images),
            np.searchsorted(low, elastic.facet_nodes(self.low)),
            elastic.node_order,
        )
        sizes = [_sizes(elastic.body, facets).sum() for facets in (self.low, self.high)]
        uncovered = max(1.0 - tied, 1.0 - tied * sizes[1] / sizes[0])
        if uncovered > MOST_UNCOVERED or np.any(np.diff(follows.indptr) == 0):
            raise MeshError(
                f"body {elastic.body.name}: the cuts lie in planes that are images of each other, "
                f"but {uncovered:.3g} of one cut is not covered by the other; name all boundaries "
                "of both cuts, or refine their curved edges"
            )
        return follows

    def _check_midsides(self, elastic: ElasticBody, apart: float, reach: float) -> None:
        """Raise :class:`MeshError` where cuts match except for midside nodes, ``apart`` [mm]."""
        if elastic.curved and apart > reach:
            raise MeshError(
                f"body {elastic.body.name}: midside nodes of its cuts are up to {apart:.3g} mm off "
                "each other's images; make the meshes of both cuts match (in gmsh: setPeriodic), "
                "or use elements of order 1"
            )

    def whole_normals(self, elastic: ElasticBody, integrals: Array) -> Array:
        """Return integrals of normals ``(nodes, d)`` with the contribution of the next sectors."""
        turn, whole = self.of_turn(elastic.body), integrals.copy()
        low, high = (np.unique(elastic.facet_nodes(facets)) for facets in (self.low, self.high))
        of_low, of_high = self._images_of(elastic.nodes, low, high)
        whole[low] += integrals[of_low] @ turn
        whole[high] += integrals[of_high] @ turn.T
        axis = np.intersect1d(low, high)
        # The mean of a direction over all sectors is its part along the axis.
        shares, directions = np.linalg.eigh(turn + turn.T)
        along = directions[:, shares > 2.0 - ROUNDING**0.5]
        shifted = integrals[axis] @ along @ along.T
        whole[axis] = np.where(np.any(shifted, axis=1)[:, None], shifted, integrals[axis])
        return whole

    def off_images(self, body: Body, vectors: Array) -> float:
        """Return the largest difference of ``vectors`` ``(nodes, d, ...)`` of cuts and images."""
        low, high, of_low, of_high = self._nearest(body)
        turn = self.of_turn(body)
        one = np.einsum("ab,nb...->na...", turn, vectors[low]) - vectors[of_low]
        other = vectors[high] - np.einsum("ab,nb...->na...", turn, vectors[of_high])
        return float(max(np.abs(one).max(), np.abs(other).max()))

    def relative_difference(self, body: Body, values: Array) -> float:
        """Return the relative difference of ``values`` ``(vertices,)`` of both cuts.

        Where meshes do not match, the variation within a facet is subtracted.
        """
        low, high, of_low, of_high = self._nearest(body)
        apart = np.append(values[low] - values[of_low], values[high] - values[of_high])
        within = 0.0
        if not self.matched:
            corners = values[body.mesh.facets[:, np.append(self.low, self.high)]]
            within = float(np.ptp(corners, axis=0).max())
        largest = float(np.abs(values).max())
        return max(float(np.abs(apart).max()) - within, 0.0) / largest if largest else 0.0

    def on_both(self, body: Body, marked: Mask) -> Indices:
        """Return vertices of the cuts that are ``marked`` ``(nodes,)``, or whose images are."""
        low, high, of_low, of_high = self._nearest(body)
        return np.concatenate(
            [low[marked[low] | marked[of_low]], high[marked[high] | marked[of_high]]]
        )

    def led(self, elastic: ElasticBody, nodes: Indices) -> Indices:
        """Return those of ``nodes`` on the high cut that follow the low cut through a mortar.

        The result is empty if the cuts match or no nodes are on the low cut.
        """
        low, high = (np.unique(elastic.facet_nodes(facets)) for facets in (self.low, self.high))
        leading = np.intersect1d(nodes, low)
        if self.matched or not len(leading):
            return np.empty(0, np.int64)
        return np.setdiff1d(np.intersect1d(nodes, high), low)

    def _nearest(self, body: Body) -> tuple[Indices, Indices, Indices, Indices]:
        """Return the vertices of the low and the high cut, and the closest ones to their images."""
        low, high = (np.unique(body.mesh.facets[:, facets]) for facets in (self.low, self.high))
        return low, high, *self._images_of(body.points, low, high)

    def _images_of(self, points: Array, low: Indices, high: Indices) -> tuple[Indices, Indices]:
        """Return the nodes of the other cut closest to the images of ``low`` and of ``high``."""
        of_low = high[cKDTree(points[high]).query(self.images(points[low]))[1]]
        of_high = low[cKDTree(points[low]).query(self.images(points[high], -1))[1]]
        return of_low, of_high


def hold_normal(
    constraints: Constraints, elastic: ElasticBody, boundary: str, cuts: Sequence[Cuts]
) -> None:
    """Let a boundary slide that continues in the next sectors where it meets cuts.

    Its normals there are those of both sectors. Nodes that follow others through a mortar are not
    held, since those that they follow are.
    """

    def whole(integrals: Array) -> Array:
        for pair in cuts:
            integrals = pair.whole_normals(elastic, integrals)
        return integrals

    nodes, normals = elastic.boundary_normals(boundary, whole)
    led = [pair.led(elastic, nodes) for pair in cuts]
    kept = ~np.isin(nodes, np.concatenate(led)) if led else np.ones(len(nodes), bool)
    constraints.slide(nodes[kept], normals[kept])


def _facets(body: Body, names: Sequence[str]) -> Indices:
    """Return the facets of boundaries of a body, each once."""
    return np.unique(np.concatenate([body.mesh.boundaries[name] for name in names]))


def _bent(elastic: ElasticBody, facets: Indices) -> float:
    """Return the largest distance of midside nodes of facets from their edges' middles [mm]."""
    nodes, corners = elastic.facet_nodes(facets), elastic.dimension
    middles = (elastic.nodes[nodes[:, [a, b]]].mean(axis=1) for a, b in EDGES[corners])
    off = np.stack(list(middles), axis=1) - elastic.nodes[nodes[:, corners:]]
    return float(np.linalg.norm(off, axis=2).max())


def _mismatch(cyclic: Cyclic) -> str:
    """Return the message that the cuts are not images of each other."""
    low, high = (" + ".join(names) for names in (cyclic.low, cyclic.high))
    return (
        f"{high} is not {low} turned about the axis by 360°/{cyclic.sectors} = "
        f"{360.0 / cyclic.sectors:.6g}°"
    )


def _corners(body: Body, facets: Indices) -> Array:
    """Return the corners of facets of the surface ``(m, dim, 3)`` [mm]."""
    return body.points[body.mesh.facets[:, facets].T]


def _distance(one: Array, other: Array) -> float:
    return float(np.linalg.norm(one - other))


def _sizes(body: Body, facets: Indices) -> Array:
    """Return the areas of facets ``(m,)``; in the plane their lengths."""
    return np.asarray(np.linalg.norm(body.outward_of(facets), axis=1))


def _middle(body: Body, facets: Indices) -> Array:
    """Return the centroid of facets ``(3,)`` [mm]."""
    return np.average(_corners(body, facets).mean(axis=1), axis=0, weights=_sizes(body, facets))


def _plane_of(body: Body, facets: Indices) -> Frame:
    """Return a frame whose z is the mean normal of facets; on a line, x is along it."""
    total = body.outward_of(facets).sum(axis=0)
    z = total / np.linalg.norm(total)
    across = np.eye(3)[1] if body.mesh.dim() == 2 else np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(across, z)
    x /= np.linalg.norm(x)
    return Frame(_middle(body, facets), np.array([x, np.cross(z, x), z]))
