"""Two cylindrical specimens of a friction rig, end to end with crossed strips.

Each specimen is a cylinder whose end face narrows, by a chamfer on either side, to a flat strip.
The specimens stand end to end along Z and are rotated by 90° to each other, so that the strips
touch over a square, the pad. Body 1 is below (Z < 0) with its strip along X. Body 2 is body 1
rotated by 180° about the line X = Y in the contact plane, which exchanges X with Y and up with
down, so that pads and their triangles match node to node. A quarter is meshed and mirrored twice,
so that symmetric loads give results that are symmetric up to rounding.

The form of the strips is a gap of the interface and not part of the mesh.

Source: the specimens of the friction rig at Imperial College, "Dynamics simulations of fretting
wear for aero-engine applications" (thesis), section 4.2; Fantetti et al. 2019, Tribology
International 138, 111.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from fe_models.geometry.places import places
from fe_models.meshes.gmsh_session import gmsh_model, grow_from
from fe_models.meshes.structure_mesh import (
    Body,
    MeshError,
    StructureMesh,
    matched_interface,
    named_mesh,
)
from fe_models.readers.gmsh_file import EntityGroup, generated_body
from sa_solver import checks
from sa_solver.types import Array, Frame, Indices

# Name of the interface, and of the boundary of both bodies that it joins.
CONTACT = "contact"
# Size of the largest elements [mm]. With quadratic tetrahedra of 1.5, 1.0, 0.8 and 0.6 mm the first
# free-free frequency is 29465, 29592, 29631 and 29656 Hz; the remaining error is due to the circle
# drawn as a polygon.
SIZE = 1.0
# Growth of the mesh size per distance from the pad. With quadratic tetrahedra 0.25 and 0.5 give
# frequencies within 2e-4 and a tangential stiffness within 3e-3 of each other.
SIZE_GROWTH = 0.5
# Two points are one node when they are closer than this share of the diameter.
SAME_POINT = 1e-9
# Tolerance for bounding boxes of gmsh, which are 1e-7 mm too wide; no two entities are this close.
BOX_MARGIN = 1e-5


@dataclass(frozen=True)
class Specimen:
    """Dimensions of one specimen [mm]; both specimens are the same.

    Attributes
    ----------
    diameter, length
        Diameter and length of the cylinder.
    strip_width
        Width of the flat strip and side of the pad.
    chamfer_depth
        Depth by which the chamfers fall from the strip's edge to the cylinder's side (not given in
        the source: assumed).
    ring_distance
        Distance from the contact plane of the ring, the circumference where the holder ends.
    ring_nodes
        Number of points that are kept on the ring.
    pad_elements
        Number of squares along each side of the pad.
    radii
        Radii of the strip's form along and across the strip; None if it is flat.

    Examples
    --------
    The pad is as wide as the strips, and so are the areas of its nodes together:

    >>> from fe_models.geometry import Specimen
    >>> mesh = Specimen(strip_width=1.2, pad_elements=2, length=10.0).mesh(size=4.0)
    >>> (pad,) = mesh.interfaces
    >>> print(len(pad), f"nodes, {pad.nodal_areas.sum():.4f} mm² of {1.2**2:.4f}")
    9 nodes, 1.4400 mm² of 1.4400
    """

    diameter: float = 8.0
    length: float = 33.0
    strip_width: float = 1.0
    chamfer_depth: float = 1.0
    ring_distance: float = 2.0
    ring_nodes: int = 16
    pad_elements: int = 10
    radii: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        lengths = ("diameter", "length", "strip_width", "chamfer_depth", "ring_distance")
        checks.numbers(self, *lengths, error=MeshError)
        for name in ("ring_nodes", "pad_elements"):
            checks.whole(name, getattr(self, name), MeshError)
        if self.radii is not None:
            along, across = checks.array("radii", self.radii, (2,), error=MeshError).tolist()
            checks.settle(self, radii=(along, across))

    def check(self) -> None:
        """Raise :class:`MeshError` if the specimen cannot be drawn or meshed."""
        if not 0.0 < self.strip_width < self.diameter / np.sqrt(2.0):
            raise MeshError(
                f"strip_width {self.strip_width:g} mm: the pad must be wider than 0 and lie within "
                f"the diameter, below {self.diameter / np.sqrt(2.0):.4g} mm"
            )
        if not 0.0 <= self.chamfer_depth < self.ring_distance < self.length:
            raise MeshError(
                f"chamfer_depth {self.chamfer_depth:g}, ring_distance {self.ring_distance:g} and "
                f"length {self.length:g} mm must be at least 0 and grow in this order"
            )
        if self.pad_elements < 2 or self.pad_elements % 2:
            raise MeshError(f"pad_elements {self.pad_elements}: give an even number, at least 2")
        if self.ring_nodes < 4 or self.ring_nodes % 4:
            raise MeshError(f"ring_nodes {self.ring_nodes}: give a multiple of 4")
        if self.radii is not None and min(self.radii) <= 0.5 * self.strip_width:
            raise MeshError(f"radii {self.radii}: each must exceed half of strip_width")

    def gap(self, x: Array, y: Array) -> Array:
        """Return the distance of the unloaded faces at points of the contact plane [mm].

        Body 1's strip lies along x, body 2's along y: with radii R_1 along and R_2 across, the
        crossed strips touch like spheres, at the relative radius R_1 R_2/(R_1 + R_2). Raise
        :class:`MeshError` for points beyond a radius, where there is no face.
        """
        x, y = places(x, y)
        gap = np.zeros(x.shape)
        for radius in self.radii or ():
            if max(np.abs(x).max(initial=0.0), np.abs(y).max(initial=0.0)) > radius:
                raise MeshError(f"places beyond the radius of {radius:g} mm: give nearer ones")
            gap += _sagitta(x, radius) + _sagitta(y, radius)
        return gap

    def mesh(self, size: float = SIZE, growth: float = SIZE_GROWTH) -> StructureMesh:
        """Mesh both specimens with elements that grow from the pad's size to ``size`` [mm].

        Boundaries of both bodies are ``contact`` (the pad), ``gripped`` (the far end) and
        ``holder`` (the side from there to the ring). The interface is ``contact``.
        """
        self.check()
        for name, value in (("size", size), ("growth", growth)):
            checks.number(name, value, above=0.0, error=MeshError)
        body_1 = Body("specimen_1", self._mesh(size, growth))
        turned = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        body_2 = Body("specimen_2", replace(body_1.mesh, doflocs=turned @ body_1.mesh.p))
        frame = Frame(np.zeros(3), np.eye(3))
        face = matched_interface(CONTACT, body_1, body_2, CONTACT, frame)
        face = replace(face, gap=self.gap(*face.coordinates.T))
        return StructureMesh((body_1, body_2), (face,))

    def ring(self, body: Body) -> Indices:
        """Return the vertices of the ring, ``(ring_nodes,)``, by angle from the X axis."""
        angle = 2.0 * np.pi * np.arange(self.ring_nodes) / self.ring_nodes
        side = np.sign(body.mesh.p[2].mean())
        points = 0.5 * self.diameter * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
        points[:, 2] = side * self.ring_distance
        from scipy.spatial import cKDTree

        distance, nodes = cKDTree(body.mesh.p.T).query(points)
        if distance.max() > SAME_POINT * self.diameter:
            raise MeshError(f"{body.name} has no nodes on the ring: mesh it with Specimen.mesh")
        return nodes.astype(np.int64)

    def target(self, body: Body, distance: float) -> Indices:
        """Return the vertex ``(1,)`` closest to X = R, Y = 0 at a distance from the contact plane.

        ``distance`` is in mm. Only vertices on the boundary of the body, and not on the ring, are
        considered.
        """
        side = np.sign(body.mesh.p[2].mean())
        place = np.array([0.5 * self.diameter, 0.0, side * distance])
        free = np.setdiff1d(body.mesh.boundary_nodes(), self.ring(body))
        away = np.linalg.norm(body.mesh.p[:, free].T - place, axis=1)
        return free[[away.argmin()]].astype(np.int64)

    def _mesh(self, size: float, growth: float) -> Any:
        """Return the mesh of body 1: a quarter, mirrored about X = 0 and Y = 0."""
        with gmsh_model("specimen") as gmsh:
            surfaces = _draw_quarter(gmsh.model, self)
            half = 0.5 * self.strip_width
            _mesh_pad(gmsh.model, surfaces[CONTACT], half, self.pad_elements // 2)
            _mesh_ring(gmsh.model, self)
            fine = self.strip_width / self.pad_elements
            grow_from(gmsh, "SurfacesList", [([surfaces[CONTACT]], fine, growth)], size)
            gmsh.model.mesh.generate(3)
            boundaries = [EntityGroup(name, 2, [surface]) for name, surface in surfaces.items()]
            quarter = EntityGroup("quarter", 3, [tag for _, tag in gmsh.model.getEntities(3)])
            points, tets, faces = generated_body(gmsh, quarter, boundaries)
        for axis in (0, 1):
            points, tets, faces = _mirrored(points, tets, faces, axis, SAME_POINT * self.diameter)
        return named_mesh(points, tets, faces)


def _sagitta(distance: Array, radius: float) -> Array:
    """Return the drop of a circular arc at a distance from its top, without cancellation."""
    return distance**2 / (radius + np.sqrt(radius**2 - distance**2))


def _draw_quarter(model: Any, specimen: Specimen) -> dict[str, int]:
    """Draw the quarter X >= 0, Y >= 0 of body 1; return its named surfaces."""
    occ = model.occ
    radius, half = 0.5 * specimen.diameter, 0.5 * specimen.strip_width
    length, ring = specimen.length, specimen.ring_distance
    quarter = 0.5 * np.pi
    inside = occ.addCylinder(0, 0, -length, 0, 0, length - ring, radius, -1, quarter)
    outside = occ.addCylinder(0, 0, -ring, 0, 0, ring, radius, -1, quarter)
    end = [(3, outside)]
    if specimen.chamfer_depth > 0.0:
        end = occ.cut(end, _chamfer(occ, specimen))[0]
    occ.fragment([(3, inside), *end], [(2, occ.addRectangle(0, 0, 0, half, half))])
    occ.synchronize()
    boxes = {
        CONTACT: ((0.0, 0.0, 0.0), (half, half, 0.0)),
        "gripped": ((0.0, 0.0, -length), (radius, radius, -length)),
        "holder": ((0.0, 0.0, -length), (radius, radius, -ring)),
    }
    return {name: _entity(model, 2, *box) for name, box in boxes.items()}


def _chamfer(occ: Any, specimen: Specimen) -> list[tuple[int, int]]:
    """Return the wedge that a chamfer removes; it extends beyond the cylinder."""
    half, radius = 0.5 * specimen.strip_width, 0.5 * specimen.diameter
    # The wedge ends twice as far from the strip's edge as the cylinder's side, and twice as deep.
    far, deep = 2.0 * radius - half, -2.0 * specimen.chamfer_depth
    corners = ((half, 0.0), (far, deep), (far, radius), (half, radius))
    points = [occ.addPoint(-radius, y, z) for y, z in corners]
    lines = [occ.addLine(*pair) for pair in pairwise([*points, points[0]])]
    section = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    swept = occ.extrude([(2, section)], 3.0 * radius, 0.0, 0.0)
    return [(dim, tag) for dim, tag in swept if dim == 3]


def _entity(model: Any, dim: int, low: Sequence[float], high: Sequence[float]) -> int:
    """Return the only entity of that dimension with the bounding box ``low``, ``high``."""
    box = np.array([*low, *high])
    tags = [
        tag
        for _, tag in model.getEntities(dim)
        if np.abs(np.array(model.getBoundingBox(dim, tag)) - box).max() < BOX_MARGIN
    ]
    if len(tags) != 1:
        raise MeshError(f"the specimen has {len(tags)} faces or edges in the box {low}, {high}")
    return int(tags[0])


def _mesh_pad(model: Any, pad: int, half: float, squares: int) -> None:
    """Mesh a quarter of the pad with squares, split along diagonals towards the pad's centre.

    After mirroring, the pattern is unchanged by an exchange of X and Y.
    """
    corners = [(0.0, 0.0), (half, 0.0), (half, half), (0.0, half)]
    for start, end in pairwise([*corners, corners[0]]):
        low, high = np.minimum(start, end), np.maximum(start, end)
        edge = _entity(model, 1, (*low, 0.0), (*high, 0.0))
        model.mesh.setTransfiniteCurve(edge, squares + 1)
    points = [_entity(model, 0, (*corner, 0.0), (*corner, 0.0)) for corner in corners]
    model.mesh.setTransfiniteSurface(pad, "Right", points)


def _mesh_ring(model: Any, specimen: Specimen) -> None:
    """Mesh the ring with one element from each kept node to the next."""
    radius, level = 0.5 * specimen.diameter, -specimen.ring_distance
    arc = _entity(model, 1, (0.0, 0.0, level), (radius, radius, level))
    model.mesh.setTransfiniteCurve(arc, specimen.ring_nodes // 4 + 1)


def _mirrored(
    points: Array, tets: Indices, faces: dict[str, Indices], axis: int, same: float
) -> tuple[Array, Indices, dict[str, Indices]]:
    """Return a mesh together with its mirror image about the plane through zero across an axis."""
    on_plane = np.abs(points[:, axis]) < same
    points = points.copy()
    points[on_plane, axis] = 0.0
    image = np.where(on_plane, np.arange(len(points)), 0)
    image[~on_plane] = len(points) + np.arange(np.sum(~on_plane))
    mirror = np.ones(3)
    mirror[axis] = -1.0

    def both(elements: Indices) -> Indices:
        return np.concatenate([elements, image[elements]])

    named = {name: both(triangles) for name, triangles in faces.items()}
    return np.concatenate([points, mirror * points[~on_plane]]), both(tets), named
