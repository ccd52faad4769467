"""Faces that do not meet node to node, tied by a mortar with dual shape functions.

Pressure and shear live on body 2's face (the slave's). With φ its linear shape functions, φᵐ those
of body 1's face (the master's) and ψ the dual functions, biorthogonal to φ over the part A of the
slave that the master covers,

    D_ij = ∫_A ψ_i φ_j = δ_ij ∫_A φ_i,   M_ik = ∫_A ψ_i φᵐ_k,   N = D⁻¹M,

so N gives a master field at the slave's nodes, the relative displacement is u_2 - N u_1, and forces
f on body 2 are -Nᵀf on body 1. Rows of N add up to one and carry linear fields: resultants and
moments of both sides are equal, and a uniform pressure passes.

Everything is projected along the normal z of the interface frame, and integrated exactly on the
polygons that the facets of both faces share. The ψ are built facet by facet on what is covered, so
that an edge where one face ends inside a facet of the other needs nothing more.

Wohlmuth 2000, doi:10.1137/S0036142999350929; Popp, Gitterle, Gee & Wall 2010, doi:10.1002/nme.2866;
covered parts: Cichosz & Bischoff 2011, doi:10.1016/j.cma.2010.11.004.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fe_models.meshes.curved_face import TURNED, Surface, bulge_of
from fe_models.meshes.structure_mesh import Body, Face, Interface, MeshError
from sa_solver.types import Array, Frame, Indices, Mask

# Share of a facet's area below which an overlap is rounding: neighbours that only share an edge.
ROUNDING_AREA = 1e-12
# A facet covered by a smaller share of its area is left out: its ψ would have to tell apart
# displacements at three corners from what they do to a sliver.
SLIVER_SHARE = 1e-6
# A node covered by a smaller share of its area drops out: N would extrapolate to it over more than
# ten times the width of what is covered.
COVERED_SHARE = 1e-2
# Facets of one face overlap, seen along the normal, when they cover more than this of another.
FOLDED_SHARE = 1.0 + 1e-6
# Gauss points of triangles by the degree they are exact for: shares of the corners, and of the area
# (of degree 4: Strang & Fix 1973, in closed form as Dunavant 1985, doi:10.1002/nme.1620210612).
_ROOT_10, _OUTER = np.sqrt(10.0), np.sqrt(38.0 - 44.0 * np.sqrt(0.4))
_NEAR, _FAR = ((8.0 - _ROOT_10 + sign * _OUTER) / 18.0 for sign in (1.0, -1.0))
_OF_NEAR, _OF_FAR = (
    (620.0 + sign * np.sqrt(213125.0 - 53320.0 * _ROOT_10)) / 3720.0 for sign in (1.0, -1.0)
)
GAUSS = {
    2: (np.array([[0.5, 0.0, 0.5], [0.5, 0.5, 0.0], [0.0, 0.5, 0.5]]), np.full(3, 1.0 / 3.0)),
    4: (
        np.concatenate([share + (1.0 - 3.0 * share) * np.eye(3) for share in (_NEAR, _FAR)]),
        np.repeat([_OF_NEAR, _OF_FAR], 3),
    ),
}
# A facet is seen edge-on when its projection is this much smaller than its longest edge allows.
EDGE_ON = 1e-6


@dataclass(frozen=True)
class Mortar:
    """The tie of ``n`` slave and ``n_master`` master nodes, for scalar fields.

    ``projection`` ``(n, n_master)`` is N; ``areas`` ``(n,)`` is D, the covered area that belongs to
    each slave node [mm²], in the plane its length [mm], and ``covered`` ``(n,)`` its share of all
    the node's area; ``gap`` ``(n,)`` the distance of the faces along z, weighted by ψ [mm].
    ``bulged`` ``(n,)`` is what surfaces add to it between vertices, and in it.
    ``kept`` ``(n,)`` marks the nodes that the master covers enough to carry a pressure: the others
    have no row in N and an infinite gap.
    """

    projection: sp.csr_matrix
    areas: Array
    covered: Array
    gap: Array
    kept: NDArray[np.bool_]
    bulged: Array | None = None


def mortar_projection(
    slave_points: Array,
    slave_facets: Indices,
    master_points: Array,
    master_facets: Indices,
    surfaces: tuple[Surface, Surface] | None = None,
) -> Mortar:
    """Tie two faces that lie on each other, seen along z.

    Points ``(n, 3)`` are in the interface frame [mm]; facets are triangles ``(m, 3)``, or segments
    ``(m, 2)`` in the plane y = 0; ``surfaces`` are what both are meshes of, which the gap knows.
    Raises :class:`MeshError` if the faces miss each other, have facets edge-on, or fold over
    themselves.
    """
    slave, master = (
        ProjectedFace(slave_points, slave_facets),
        ProjectedFace(master_points, master_facets),
    )
    # Bulges are of degree 2, and ψ of degree 1.
    overlap = overlap_of(slave, master, 2 if surfaces is None else 4)
    dual, integrals = _dual_functions(slave, overlap)
    areas = slave.scatter(integrals)
    covered = areas / slave.nodal_areas
    kept = covered > COVERED_SHARE
    scale = np.divide(1.0, areas, out=np.zeros_like(areas), where=kept)
    projection = (sp.diags(scale) @ _coupling(slave, master, overlap, dual)).tocsr()
    projection.eliminate_zeros()
    gap = np.where(kept, slave_points[:, 2] - projection @ master_points[:, 2], np.inf)
    bulged = None
    if surfaces is not None:
        bulged = scale * _between(slave, master, overlap, dual, surfaces)
        gap += bulged
    return Mortar(projection, areas, covered, gap, kept, bulged)


def mortar_interface(
    name: str,
    body_1: Body,
    boundary_1: str,
    body_2: Body,
    boundary_2: str,
    frame: Frame,
    surfaces: tuple[Surface, Surface] | None = None,
) -> Interface:
    """Interface of two faces with meshes of their own, of ``surfaces`` 1 and 2 if they are known.

    Its nodes are those of body 2 that body 1 covers, its facets those with such nodes alone; a node
    without a facet is left out. Of body 1 it has the facets that meet these. Raises
    :class:`MeshError` as :func:`mortar_projection` does, and if body 1 covers no facet.
    """
    nodes_1, points_1, facets_1 = _face(body_1, boundary_1, frame)
    nodes_2, points_2, facets_2 = _face(body_2, boundary_2, frame)
    surface_1, surface_2 = surfaces or (None, None)
    turned = surfaces and (surfaces[1], surfaces[0])
    mortar = mortar_projection(points_2, facets_2, points_1, facets_1, turned)
    whole: Mask = np.all(mortar.kept[facets_2], axis=1)
    facets = facets_2[whole]
    if not len(facets):
        raise MeshError(
            f"the faces of interface {name} share less than a facet of {boundary_2}: refine it"
        )
    kept = np.unique(facets)
    # Of a face that goes on beyond body 2, what is beside it alone: it stays as free as elsewhere.
    met = np.zeros(len(nodes_1), bool)
    met[mortar.projection[kept].indices] = True
    near: Mask = np.any(met[facets_1], axis=1)
    near_1 = np.unique(facets_1[near])
    return Interface(
        name=name,
        frame=frame,
        coordinates=points_2[kept, :2],
        facets=np.searchsorted(kept, facets),
        nodes_1=nodes_1[near_1],
        nodes_2=nodes_2[kept],
        gap=mortar.gap[kept],
        projection=mortar.projection[kept][:, near_1],
        face_1=Face(
            name,
            frame,
            points_1[near_1, :2],
            np.searchsorted(near_1, facets_1[near]),
            surface=surface_1 and surface_1.part(near_1, near),
        ),
        areas=mortar.areas[kept],
        bulged=None if mortar.bulged is None else mortar.bulged[kept],
        surface=surface_2 and surface_2.part(kept, whole),
    )


def frame_of_faces(
    body_1: Body, boundary_1: str, body_2: Body, boundary_2: str, x_direction: Array
) -> tuple[Frame, float]:
    """Interface frame of two faces, and the largest angle of their facets to its plane [rad].

    The origin is the centroid of the part of body 2's face that body 1's covers; z the mean outward
    normal of body 1; x the direction ``(3,)`` given, turned into the plane. Raises
    :class:`MeshError` if the direction is normal to the face, or a facet faces backwards.
    """
    normals_1, normals_2 = body_1.outward(boundary_1), body_2.outward(boundary_2)
    z = _unit(normals_1.sum(axis=0))
    given = np.zeros(3)
    given[list(body_1.axes)] = x_direction[list(body_1.axes)]
    along = given - (given @ z) * z
    if np.linalg.norm(along) <= EDGE_ON * np.linalg.norm(x_direction):
        raise MeshError(
            f"x_direction {x_direction} is normal to face {boundary_1}: give one that lies along it"
        )
    x = _unit(along)
    axes = np.array([x, np.cross(z, x), z])
    normals = np.concatenate([normals_1, -normals_2])
    tilt = np.arctan2(np.linalg.norm(np.cross(normals, z), axis=1), normals @ z).max()
    if tilt >= 0.5 * np.pi:
        raise MeshError(
            f"faces {boundary_1} and {boundary_2} do not face each other everywhere: a facet is "
            f"turned by {np.rad2deg(tilt):.3g}° from the contact's normal"
        )
    provisional = Frame(np.zeros(3), axes)
    _, points_1, facets_1 = _face(body_1, boundary_1, provisional)
    nodes_2, points_2, facets_2 = _face(body_2, boundary_2, provisional)
    areas = mortar_projection(points_2, facets_2, points_1, facets_1).areas
    origin = areas @ body_2.points[nodes_2] / areas.sum()
    return Frame(origin, axes), float(tilt)


class ProjectedFace:
    """A face seen along z: its facets in the plane (x, y), or on the line x."""

    def __init__(self, points: Array, facets: Indices) -> None:
        self.facets = facets
        self.nodes = len(points)
        spatial = points[facets]
        self.corners = spatial[:, :, : facets.shape[1] - 1]
        determinants = np.linalg.det(self._edges)
        longest = np.linalg.norm(spatial - np.roll(spatial, 1, axis=1), axis=2).max(axis=1)
        if np.any(np.abs(determinants) <= EDGE_ON * longest ** self._edges.shape[1]):
            raise MeshError(
                "a contact face has a facet that is seen edge-on along the contact's normal or has "
                "no area: leave it out of the face, turn the frame or mend the mesh"
            )
        # Corners anticlockwise, segments from left to right.
        clockwise = determinants < 0.0
        self.clockwise = clockwise
        self.facets = facets.copy()
        self.facets[clockwise] = facets[clockwise][:, ::-1]
        self.corners[clockwise] = self.corners[clockwise][:, ::-1]
        self.sizes = np.abs(determinants) / (facets.shape[1] - 1)

    @property
    def _edges(self) -> Array:
        return np.asarray(self.corners[:, 1:] - self.corners[:, :1])

    @property
    def nodal_areas(self) -> Array:
        """Area that belongs to each node, an equal share of its facets', ``(n,)`` [mm²]."""
        corners = self.facets.shape[1]
        return self.scatter(np.repeat(self.sizes[:, None] / corners, corners, axis=1))

    @cached_property
    def _inverses(self) -> Array:
        return np.asarray(np.linalg.inv(self._edges), dtype=np.float64)

    def shapes(self, facet: Indices, points: Array) -> Array:
        """Shape functions ``(q, corners)`` of the facets ``(q,)`` at points in their plane."""
        local = np.einsum("qa,qab->qb", points - self.corners[facet, 0], self._inverses[facet])
        return np.column_stack([1.0 - local.sum(axis=1), local])

    def scatter(self, values: Array) -> Array:
        """Sums at the nodes of values ``(m, corners)`` at the corners of the facets."""
        total = np.bincount(self.facets.ravel(), values.ravel(), minlength=self.nodes)
        return np.asarray(total, dtype=np.float64)


@dataclass(frozen=True)
class Overlap:
    """Gauss points of what facets of both faces share.

    ``slave`` and ``master`` ``(q,)`` are the facets, ``points`` ``(q, d)``, ``weights`` ``(q,)``.
    """

    slave: Indices
    master: Indices
    points: Array
    weights: Array


def overlap_of(slave: ProjectedFace, master: ProjectedFace, degree: int = 2) -> Overlap:
    """Points that integrate a polynomial of a ``degree``, 2 or 4, over what faces share.

    Raises :class:`MeshError` if the faces have nothing in common.
    """
    first, second = _neighbours(slave.corners, master.corners)
    share = _shared_segments if slave.corners.shape[2] == 1 else _shared_triangles
    pair, points, weights = share(slave.corners[first], master.corners[second], degree)
    real = weights > ROUNDING_AREA * slave.sizes[first[pair]]
    if not real.any():
        raise MeshError("the two contact faces do not lie on each other along the contact's normal")
    pair = pair[real]
    return Overlap(first[pair], second[pair], points[real], weights[real])


def _neighbours(first: Array, second: Array) -> tuple[Indices, Indices]:
    """Pairs of facets ``(m, corners, d)`` whose bounding boxes touch."""
    centres = [corners.mean(axis=1) for corners in (first, second)]
    radii = [
        np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
        for corners, centre in zip((first, second), centres, strict=True)
    ]
    near = cKDTree(centres[1]).query_ball_point(centres[0], radii[0] + radii[1].max())
    one = np.repeat(np.arange(len(first)), [len(neighbours) for neighbours in near])
    other = np.concatenate([np.asarray(neighbours, dtype=np.int64) for neighbours in near])
    low = np.maximum(first.min(axis=1)[one], second.min(axis=1)[other])
    high = np.minimum(first.max(axis=1)[one], second.max(axis=1)[other])
    touch = np.all(low < high, axis=1)
    return one[touch], other[touch]


def _shared_segments(first: Array, second: Array, degree: int) -> tuple[Indices, Array, Array]:
    """Gauss points of the intersections of segments ``(n, 2, 1)``: pair, point, weight."""
    low, high = np.maximum(first[:, 0], second[:, 0]), np.minimum(first[:, 1], second[:, 1])
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    places, shares = np.polynomial.legendre.leggauss(degree // 2 + 1)
    points = np.concatenate([middle + half * place for place in places])
    weights = np.concatenate([half[:, 0] * share for share in shares])
    return np.tile(np.arange(len(first)), len(places)), points, weights


def _shared_triangles(first: Array, second: Array, degree: int) -> tuple[Indices, Array, Array]:
    """Gauss points of the intersections of triangles ``(n, 3, 2)``: pair, point, weight.

    The polygons are cut into triangles, each with Gauss points of its own.
    """
    polygons = first
    for corner in range(3):
        polygons = _clip(polygons, second[:, corner], second[:, (corner + 1) % 3])
    count = polygons.shape[1] - 2
    fans = np.stack(
        [np.repeat(polygons[:, :1], count, axis=1), polygons[:, 1:-1], polygons[:, 2:]], axis=2
    ).reshape(-1, 3, 2)
    areas = 0.5 * np.linalg.det(fans[:, 1:] - fans[:, :1])
    corners, shares = GAUSS[degree]
    points = np.einsum("gc,nca->nga", corners, fans).reshape(-1, 2)
    pairs = np.repeat(np.arange(len(first)), len(shares) * count)
    return pairs, points, np.outer(areas, shares).ravel()


def _clip(polygons: Array, start: Array, end: Array) -> Array:
    """What convex polygons ``(n, k, 2)`` have on the left of the lines from start to end.

    Polygons with fewer corners than others repeat their last one (Sutherland & Hodgman 1974).
    """
    line = (end - start)[:, None]
    from_start = polygons - start[:, None]
    side = line[..., 0] * from_start[..., 1] - line[..., 1] * from_start[..., 0]
    following = np.roll(side, -1, axis=1)
    inside = side >= 0.0
    crosses = inside != (following >= 0.0)
    share = np.divide(side, side - following, out=np.zeros_like(side), where=crosses)
    cuts = polygons + share[..., None] * (np.roll(polygons, -1, axis=1) - polygons)
    shape = len(polygons), 2 * polygons.shape[1]
    corners = np.stack([polygons, cuts], axis=2).reshape(*shape, 2)
    valid = np.stack([inside, crosses], axis=2).reshape(shape)
    count = valid.sum(axis=1)
    order = np.argsort(~valid, axis=1, kind="stable")
    place = np.minimum(np.arange(max(3, count.max(initial=0))), np.maximum(count - 1, 0)[:, None])
    clipped = np.take_along_axis(corners, np.take_along_axis(order, place, 1)[..., None], axis=1)
    # Nothing left: a point.
    clipped[count == 0] = 0.0
    return clipped


def _dual_functions(slave: ProjectedFace, overlap: Overlap) -> tuple[Array, Array]:
    """ψ at the Gauss points ``(q, corners)``, and ∫φ over what is covered ``(m, corners)``.

    On each facet ψ_i = Σ_j A_ij φ_j with A = diag(∫φ) (∫φφᵀ)⁻¹. Raises :class:`MeshError` if a
    facet is covered more than once.
    """
    shapes = slave.shapes(overlap.slave, overlap.points)
    mass = np.zeros((len(slave.facets), shapes.shape[1], shapes.shape[1]))
    np.add.at(mass, overlap.slave, np.einsum("q,qi,qj->qij", overlap.weights, shapes, shapes))
    integrals = mass.sum(axis=2)
    share = integrals.sum(axis=1) / slave.sizes
    if share.max() > FOLDED_SHARE:
        raise MeshError(
            f"a facet of one face meets the other {share.max():.3g} times along the contact's "
            "normal: a contact face must not fold over itself"
        )
    used = share > SLIVER_SHARE
    integrals[~used] = 0.0
    factors = np.zeros_like(mass)
    factors[used] = np.linalg.solve(mass[used], integrals[used, :, None] * np.eye(mass.shape[1]))
    return np.einsum("qji,qj->qi", factors[overlap.slave], shapes), integrals


def _coupling(
    slave: ProjectedFace, master: ProjectedFace, overlap: Overlap, dual: Array
) -> sp.csr_matrix:
    """M ``(n, n_master)`` of the dual functions' values ``(q, corners)``."""
    shapes = master.shapes(overlap.master, overlap.points)
    values = np.einsum("q,qi,qk->qik", overlap.weights, dual, shapes)
    rows = np.broadcast_to(slave.facets[overlap.slave][:, :, None], values.shape)
    columns = np.broadcast_to(master.facets[overlap.master][:, None, :], values.shape)
    places = rows.ravel(), columns.ravel()
    return sp.csr_matrix((values.ravel(), places), shape=(slave.nodes, master.nodes))


def _between(
    slave: ProjectedFace,
    master: ProjectedFace,
    overlap: Overlap,
    dual: Array,
    surfaces: tuple[Surface, Surface],
) -> Array:
    """∫ψ times what bulges of the slave and the master add to their distance ``(n,)`` [mm³]."""
    added = np.zeros(len(overlap.points))
    for side, facet, given, sign in (
        (slave, overlap.slave, surfaces[0].bulges, 1.0),
        (master, overlap.master, surfaces[1].bulges, -1.0),
    ):
        turned = np.where(side.clockwise[:, None], given[:, TURNED[given.shape[1]]], given)
        added += sign * bulge_of(side.shapes(facet, overlap.points), turned[facet])
    values = (overlap.weights * added)[:, None] * dual
    total = np.zeros(slave.nodes)
    np.add.at(total, slave.facets[overlap.slave], values)
    return total


def _face(body: Body, boundary: str, frame: Frame) -> tuple[Indices, Array, Indices]:
    """Vertices of a boundary, their coordinates in the frame, and the facets numbered in them."""
    nodes = body.vertices(boundary)
    points = frame.coordinates(body.points[nodes])
    return nodes, points, np.searchsorted(nodes, body.facets(boundary))


def _unit(vectors: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / lengths, dtype=np.float64)
