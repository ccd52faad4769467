"""Mortar tie with dual shape functions, for faces that do not meet node to node.

Pressure and shear are defined on body 2's face, the slave. With φ its linear shape functions, φᵐ
those of body 1's face, the master, and ψ the dual functions, biorthogonal to φ over the part A of
the slave that the master covers,

    D_ij = ∫_A ψ_i φ_j = δ_ij ∫_A φ_i,   M_ik = ∫_A ψ_i φᵐ_k,   N = D⁻¹M,

so N gives a master field at the slave's nodes, the relative displacement is u_2 - N u_1, and forces
f on body 2 are -Nᵀf on body 1. Rows of N add up to one and reproduce linear fields, so the
resultants and moments of both sides are equal, and a uniform pressure is transmitted exactly.

All points are projected along the normal z of the interface frame. Integration is exact on the
polygons that the facets of both faces share. The ψ are built facet by facet on the covered part, so
that an edge where one face ends inside a facet of the other needs no special treatment.

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

# Share of a facet's area below which an overlap is a rounding error: facets share only an edge.
ROUNDING_AREA = 1e-12
# A facet covered by a smaller share of its area is left out: the displacements at its three corners
# can hardly be told apart from their values on a sliver, so its ψ would be ill-conditioned.
SLIVER_SHARE = 1e-6
# A node covered by a smaller share of its area is dropped: N would extrapolate to it over more than
# ten times the width of the covered part.
COVERED_SHARE = 1e-2
# Facets of one face overlap, seen along the normal, when they cover more than this of another.
FOLDED_SHARE = 1.0 + 1e-6
# Gauss points of triangles by the degree for which they are exact: barycentric coordinates, and
# weights as shares of the area (degree 4: Strang & Fix 1973, in closed form as in Dunavant 1985,
# doi:10.1002/nme.1620210612).
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
    """Tie of ``n`` slave and ``n_master`` master nodes, for scalar fields.

    Attributes
    ----------
    projection
        N ``(n, n_master)``.
    areas
        D ``(n,)``: the covered area that belongs to each slave node [mm²], in the plane its length
        [mm].
    covered
        Covered share of each slave node's area ``(n,)``.
    gap
        Distance of the faces along z, weighted by ψ ``(n,)`` [mm]; it includes ``bulged``.
    kept
        Flags ``(n,)`` of the nodes that the master covers enough to carry a pressure. The others
        have no row in N and an infinite gap.
    bulged
        Part of the gap ``(n,)`` [mm] due to the form of the surfaces between vertices.
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

    Parameters
    ----------
    slave_points, master_points
        Points ``(n, 3)`` in the interface frame [mm].
    slave_facets, master_facets
        Triangles ``(m, 3)``, or segments ``(m, 2)`` in the plane y = 0.
    surfaces
        Surfaces that the slave's and the master's mesh approximate; they contribute to the gap.

    Raises
    ------
    MeshError
        If the faces miss each other, have facets edge-on, or fold over themselves.
    """
    slave, master = (
        ProjectedFace(slave_points, slave_facets),
        ProjectedFace(master_points, master_facets),
    )
    # Bulges are of degree 2 and ψ of degree 1, so their product needs a rule of degree 4.
    overlap = overlap_of(slave, master, 2 if surfaces is None else 4)
    shapes = slave.shapes(overlap.slave, overlap.points)
    dual, integrals = dual_functions(shapes, overlap, slave.sizes, SLIVER_SHARE)
    share = float(np.max(integrals.sum(axis=1) / slave.sizes))
    if share > FOLDED_SHARE:
        raise MeshError(
            f"a facet of one face meets the other {share:.3g} times along the contact's normal: a "
            "contact face must not fold over itself"
        )
    areas = slave.scatter(integrals)
    covered = areas / slave.nodal_areas
    kept = covered > COVERED_SHARE
    scale = np.divide(1.0, areas, out=np.zeros_like(areas), where=kept)
    tested = master.shapes(overlap.master, overlap.points)
    shape = slave.nodes, master.nodes
    coupling = coupling_of(overlap, dual, tested, slave.facets, master.facets, shape)
    projection = (sp.diags(scale) @ coupling).tocsr()
    projection.eliminate_zeros()
    gap = np.where(kept, slave_points[:, 2] - projection @ master_points[:, 2], np.inf)
    bulged = None
    if surfaces is not None:
        bulged = scale * _bulge_integrals(slave, master, overlap, dual, surfaces)
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
    """Return the interface of two faces whose meshes do not match.

    Its nodes are those of body 2 that body 1 covers, and its facets those with only such nodes; a
    node without a facet is left out. Of body 1 it has the facets that touch these.

    Parameters
    ----------
    name
        Name of the interface.
    body_1, boundary_1, body_2, boundary_2
        The two bodies, and the boundary of each that is its contact face.
    frame
        Frame of the interface.
    surfaces
        Surfaces that the faces of bodies 1 and 2 approximate, if they are known.

    Raises
    ------
    MeshError
        As :func:`mortar_projection`, and if body 1 covers no facet completely.
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
    # If body 1's face extends beyond body 2, keep only the part that body 2 touches; the rest of
    # the face stays free.
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
    """Return the interface frame of two faces, and the largest tilt of a facet from it [rad].

    The origin is the centroid of the part of body 2's face that body 1's covers; z is the mean
    outward normal of body 1; x is the direction ``(3,)`` given, turned into the plane.

    Parameters
    ----------
    body_1, boundary_1, body_2, boundary_2
        The two bodies, and the boundary of each that is its face.
    x_direction
        Direction ``(3,)`` close to x.

    Raises
    ------
    MeshError
        If the direction is normal to the face, or if a facet faces backwards.
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
    """Face seen along z: its facets in the plane (x, y), or on the line x."""

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
        # Order corners anticlockwise, and segments from left to right.
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
        """Return shape functions ``(q, corners)`` of facets ``(q,)`` at points in their plane."""
        local = np.einsum("qa,qab->qb", points - self.corners[facet, 0], self._inverses[facet])
        return np.column_stack([1.0 - local.sum(axis=1), local])

    def scatter(self, values: Array) -> Array:
        """Return sums at the nodes of values ``(m, corners)`` at the corners of the facets."""
        total = np.bincount(self.facets.ravel(), values.ravel(), minlength=self.nodes)
        return np.asarray(total, dtype=np.float64)


@dataclass(frozen=True)
class Overlap:
    """Gauss points on the parts that facets of both faces share.

    ``slave`` and ``master`` ``(q,)`` are the facets, ``points`` ``(q, d)`` the positions and
    ``weights`` ``(q,)`` the weights.
    """

    slave: Indices
    master: Indices
    points: Array
    weights: Array


def overlap_of(slave: ProjectedFace, master: ProjectedFace, degree: int = 2) -> Overlap:
    """Return points that integrate polynomials exactly over the part that the faces share.

    The polynomials are of a ``degree`` 2 or 4. Raises :class:`MeshError` if the faces have nothing
    in common.
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
    """Return pairs of facets ``(m, corners, d)`` whose bounding boxes touch."""
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
    """Return Gauss points of the intersections of segments ``(n, 2, 1)``: pair, point, weight."""
    low, high = np.maximum(first[:, 0], second[:, 0]), np.minimum(first[:, 1], second[:, 1])
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    places, shares = np.polynomial.legendre.leggauss(degree // 2 + 1)
    points = np.concatenate([middle + half * place for place in places])
    weights = np.concatenate([half[:, 0] * share for share in shares])
    return np.tile(np.arange(len(first)), len(places)), points, weights


def _shared_triangles(first: Array, second: Array, degree: int) -> tuple[Indices, Array, Array]:
    """Return Gauss points of the intersections of triangles ``(n, 3, 2)``: pair, point, weight.

    The intersections are polygons, which are divided into triangles with Gauss points of their own.
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
    """Return the part of convex polygons ``(n, k, 2)`` on the left of lines from start to end.

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
    # A polygon of which no part is left becomes a point.
    clipped[count == 0] = 0.0
    return clipped


def dual_functions(
    shapes: Array, overlap: Overlap, sizes: Array, sliver_share: float
) -> tuple[Array, Array]:
    """Return ψ at the Gauss points ``(q, k)``, and ∫φ over the covered part ``(m, k)``.

    On each facet ψ_i = Σ_j A_ij φ_j with A = diag(∫φ) (∫φφᵀ)⁻¹.

    Parameters
    ----------
    shapes
        Functions φ of the slave ``(q, k)`` at the Gauss points.
    overlap
        Gauss points on the covered part.
    sizes
        Areas of the slave's facets ``(m,)``.
    sliver_share
        Share of its area below which a covered part of a facet is left out.
    """
    mass = np.zeros((len(sizes), shapes.shape[1], shapes.shape[1]))
    np.add.at(mass, overlap.slave, np.einsum("q,qi,qj->qij", overlap.weights, shapes, shapes))
    integrals = mass.sum(axis=2)
    used = integrals.sum(axis=1) > sliver_share * sizes
    integrals[~used] = 0.0
    factors = np.zeros_like(mass)
    factors[used] = np.linalg.solve(mass[used], integrals[used, :, None] * np.eye(mass.shape[1]))
    return np.einsum("qji,qj->qi", factors[overlap.slave], shapes), integrals


def coupling_of(
    overlap: Overlap,
    dual: Array,
    tested: Array,
    slave_nodes: Indices,
    master_nodes: Indices,
    shape: tuple[int, int],
) -> sp.csr_matrix:
    """Return M ``shape`` of the dual functions ``(q, k)`` and the master's functions ``(q, l)``.

    ``slave_nodes`` ``(m, k)`` and ``master_nodes`` ``(n, l)`` are the nodes of the facets.
    """
    values = np.einsum("q,qi,qk->qik", overlap.weights, dual, tested)
    rows = np.broadcast_to(slave_nodes[overlap.slave][:, :, None], values.shape)
    columns = np.broadcast_to(master_nodes[overlap.master][:, None, :], values.shape)
    return sp.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape)


def _bulge_integrals(
    slave: ProjectedFace,
    master: ProjectedFace,
    overlap: Overlap,
    dual: Array,
    surfaces: tuple[Surface, Surface],
) -> Array:
    """Return ∫ψ times the distance that bulges add between the faces ``(n,)`` [mm³]."""
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
    """Return the vertices of a boundary, their coordinates in the frame, and the facets.

    The facets are numbered in these vertices.
    """
    nodes = body.vertices(boundary)
    points = frame.coordinates(body.points[nodes])
    return nodes, points, np.searchsorted(nodes, body.facets(boundary))


def _unit(vectors: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / lengths, dtype=np.float64)
