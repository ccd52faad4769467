"""Blade root and disk sector of a dovetail joint, meshed with gmsh's OpenCASCADE kernel.

Global axes: Z is radial (the load axis), Y the rotor axis, X completes them; the origin is on the
rotor axis, in the middle of the slot. The section lies in planes Y = const and is extruded along
the slot, which ``skew`` turns away from Y. The section and its mesh are mirrored about its middle,
so that a symmetric load gives a result that is symmetric up to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np

from fe_models.geometry.extruded_section import SIZE_GROWTH, SectionCurve, mesh_body
from fe_models.geometry.places import places
from fe_models.meshes.halving import halved
from fe_models.meshes.structure_mesh import (
    Body,
    MeshError,
    StructureMesh,
    matched_interface,
    mesh_edges,
)
from sa_solver import checks
from sa_solver.surfaces.shapes import rounded_edge
from sa_solver.types import Array, Frame

# Default number of elements around a full circle of a fillet. With 20 nodes across the flank and
# order 1 the error of the stress there is 6 % (11 % with 24 elements); with 40 nodes and order 2 it
# is 0.5 %.
NOTCH = 48

# Distance of a vertex from the circle of its fillet, relative to the radius, due to rounding.
ON_ARC = 1e-7


@dataclass(frozen=True)
class Dovetail:
    """Parameters of the joint; lengths in mm, angles in radians.

    Attributes
    ----------
    flank_angle
        Angle between flank and load axis.
    flank_length
        Length of the flat part of the flank.
    edge_radius, edge_width
        Radius and width of the rounded part at either side of the flat.
    neck_width
        Width of the blade's neck.
    neck_fillet
        Radius of the fillet between neck and flank.
    root_depth
        Depth of the blade below the flanks.
    shank_height
        Height of the blade's shank.
    slot_length
        Length of the slot.
    slot_fillet
        Radius of the fillets of the slot.
    slot_clearance
        Clearance under the root.
    lug_height
        Height of the disk above the top of the flanks.
    disk_height
        Height of the disk below the top of the flanks.
    rim_radius
        Radius of the top of the flanks from the rotor axis.
    blades
        Number of blades.
    skew
        Angle of the slots to the axis of rotation.
    end_radius, end_width
        Radius and width of the rounded part at the two slot ends, within ``slot_length``. Without
        them the flank is straight up to the ends.

    Examples
    --------
    Beyond the flat of its flank the gap is that of a circular edge:

    >>> import numpy as np
    >>> from fe_models.geometry import Dovetail
    >>> joint = Dovetail(
    ...     flank_angle=np.radians(45.0), flank_length=3.0, edge_radius=20.0, edge_width=1.0,
    ...     neck_width=8.0, neck_fillet=2.0, root_depth=5.0, shank_height=10.0, slot_length=20.0,
    ...     slot_fillet=2.0, slot_clearance=1.0, lug_height=5.0, disk_height=20.0,
    ...     rim_radius=300.0, blades=60,
    ... )
    >>> gap = joint.flank_gap(np.array([0.0, 2.0]), np.zeros(2), side=1)
    >>> print(gap.round(6), "of", round(20.0 - np.sqrt(20.0**2 - 0.5**2), 6))
    [0.       0.006251] of 0.006251
    """

    flank_angle: float
    flank_length: float
    edge_radius: float
    edge_width: float
    neck_width: float
    neck_fillet: float
    root_depth: float
    shank_height: float
    slot_length: float
    slot_fillet: float
    slot_clearance: float
    lug_height: float
    disk_height: float
    rim_radius: float
    blades: int
    skew: float = 0.0
    end_radius: float | None = None
    end_width: float | None = None

    def __post_init__(self) -> None:
        lengths = {parameter.name for parameter in fields(self)} - {"flank_angle", "skew", "blades"}
        checks.numbers(self, *sorted(lengths), above=0.0, error=MeshError)
        for name in ("flank_angle", "skew"):
            angle = checks.number(f"{name} [rad]", getattr(self, name), error=MeshError)
            if not abs(angle) < 0.5 * np.pi or (name == "flank_angle" and angle <= 0.0):
                least = "above 0 and " if name == "flank_angle" else ""
                raise MeshError(f"{name} = {angle:g} rad: give {least}less than a right angle")
        if checks.whole("blades", self.blades, MeshError) < 2:
            raise MeshError(f"{self.blades} blades: give 2 or more")

    @property
    def flank_width(self) -> float:
        """Width of the flat and both rounded edges, along the flank [mm]."""
        return self.flank_length + 2.0 * self.edge_width

    @property
    def slot_direction(self) -> Array:
        """Unit vector along the slot."""
        return np.array([np.sin(self.skew), np.cos(self.skew), 0.0])

    @property
    def load_axis(self) -> Array:
        """Unit vector of the blade's pull."""
        return np.array([0.0, 0.0, 1.0])

    def flank_ends(self) -> tuple[Array, Array]:
        """Return the top and bottom of the flank in the right half of the section, ``(X, Z)``."""
        sine, cosine = np.sin(self.flank_angle), np.cos(self.flank_angle)
        tangent = self.neck_fillet * np.tan(0.5 * self.flank_angle)
        top = np.array([0.5 * self.neck_width + tangent * sine, self.rim_radius])
        return top, top + self.flank_width * np.array([sine, -cosine])

    def flank_frame(self, side: int) -> Frame:
        """Return the frame of the flank at X > 0 (``side`` 1) or X < 0 (``side`` -1)."""
        if side not in (1, -1):
            raise MeshError(f"side {side!r} of a dovetail: give 1 or -1")
        top, bottom = self.flank_ends()
        middle = 0.5 * (top + bottom)
        uphill = self._uphill(side)
        normal = np.cross(uphill, self.slot_direction)
        normal *= -np.sign(normal[2]) / np.linalg.norm(normal)
        along = self.slot_direction
        x = np.cross(along, normal)
        if x @ self.load_axis < 0.0:
            along, x = -along, -x
        return Frame(np.array([side * middle[0], 0.0, middle[1]]), np.array([x, along, normal]))

    def _uphill(self, side: int) -> Array:
        """Return the unit vector up the flank, within the section."""
        return np.array([-side * np.sin(self.flank_angle), 0.0, np.cos(self.flank_angle)])

    def flank_size(self, side: int = 1) -> tuple[float, float]:
        """Return the extent of the flank along x and y of its frame [mm].

        The flank is a parallelogram if it is skewed.
        """
        frame = self.flank_frame(side)
        edges = np.array(
            [self.flank_width * self._uphill(side), self.slot_length * self.slot_direction]
        )
        extent = np.abs(frame.components(edges)[:, :2]).sum(axis=0)
        return float(extent[0]), float(extent[1])

    def flank_gap(self, x: Array, y: Array, side: int) -> Array:
        """Return the distance of the unloaded, unworn faces at ``x``, ``y`` of the frame [mm].

        It is zero on the flat, follows circular arcs on the rounded edges and ends, and slopes
        beyond them.
        """
        x, y = places(x, y)
        frame = self.flank_frame(side)
        up = frame.components(self._uphill(side))
        # These are oblique coordinates, along the section and along the slot.
        across, along = x / up[0], y - x * up[1] / up[0]
        slant = abs(up[0])
        edges = rounded_edge(
            np.abs(across) * slant, 0.5 * self.flank_width * slant, self.edge_width,
            self.edge_radius,
        )  # fmt: skip
        if self.end_width is None or self.end_radius is None:
            return edges
        return edges + rounded_edge(
            np.abs(along) * slant, 0.5 * self.slot_length * slant, self.end_width, self.end_radius
        )

    def check(self) -> None:
        """Raise :class:`MeshError` if the section cannot be drawn."""
        top, bottom = self.flank_ends()
        slot = bottom[1] - self.root_depth - self.slot_clearance
        wall = bottom[0] + self.slot_fillet * (1.0 - np.cos(self.flank_angle))
        tangent = np.tan(np.pi / self.blades)
        if self.slot_fillet * np.sin(self.flank_angle) + self.slot_fillet > bottom[1] - slot:
            raise MeshError(
                f"slot_fillet {self.slot_fillet:g} mm is too large for root_depth + slot_clearance"
                f" = {bottom[1] - slot:g} mm: make the fillet smaller or the root deeper"
            )
        if slot <= self.rim_radius - self.disk_height:
            raise MeshError(
                f"the slot is deeper ({self.rim_radius - slot:.4g} mm) than disk_height "
                f"{self.disk_height:g} mm: increase disk_height"
            )
        if wall >= slot * tangent or top[0] >= (self.rim_radius + self.lug_height) * tangent:
            raise MeshError(
                f"the slot is wider ({2 * wall:.4g} mm) than the sector at its bottom "
                f"({2 * slot * tangent:.4g} mm): use fewer blades, a larger rim_radius or a "
                "narrower root"
            )
        if (
            self.neck_fillet * np.tan(0.5 * self.flank_angle) * np.cos(self.flank_angle)
            + self.neck_fillet * np.sin(self.flank_angle)
            >= self.shank_height
        ):
            raise MeshError("neck_fillet is taller than the shank: increase shank_height")

    def mesh(
        self,
        flank_nodes: tuple[int, int],
        size: float,
        dimension: Literal[2, 3] = 3,
        notch: int = NOTCH,
        order: Literal[1, 2] = 1,
        *,
        growth: float | None = None,
        curved: bool = False,
    ) -> StructureMesh:
        """Mesh both bodies: the disk is body 1, the blade body 2.

        Boundaries are ``intrados`` (X > 0) and ``extrados`` on both bodies; ``inner`` and ``sides``
        of the disk; ``root_bottom`` and ``shank_top`` of the blade.

        Parameters
        ----------
        flank_nodes
            Numbers of nodes across and along each flank; in 2 dimensions the second has no effect.
        size
            Distance of nodes far from flanks and fillets [mm].
        dimension
            3, or 2 for the section in the middle of the slot, which must not be skewed.
        notch
            Number of nodes around a full circle of a fillet.
        order
            Order of the elements. With 2 they are twice as long, and the nodes in the middle of
            their edges are among the nodes of the flanks, whose numbers are odd.
        growth
            Growth of the size of elements per distance from the flanks; by default that of the
            order.
        curved
            Whether the bodies are those of the elements themselves, with midside nodes on the
            fillets; the flanks then meet at the vertices only.

        Raises
        ------
        MeshError
            If the section cannot be drawn, or if a skewed slot is to be meshed in 2 dimensions.
        """
        self.check()
        nodes = checks.array("nodes of a flank", flank_nodes, (2,), error=MeshError)
        if nodes.min() < 2.0 or (nodes % 1.0).any():
            raise MeshError(f"flank_nodes {tuple(flank_nodes)}: give two whole numbers, 2 or more")
        checks.number("size", size, above=0.0, error=MeshError)
        if checks.whole("notch", notch, MeshError) < 1 or dimension not in (2, 3):
            raise MeshError(f"notch {notch}, dimension {dimension!r}: give 1 or more, and 2 or 3")
        if order not in (1, 2):
            raise MeshError(f"order {order!r}: give 1 or 2")
        if dimension == 2 and self.skew != 0.0:
            raise MeshError("a skewed slot is not the same all along: model it in 3 dimensions")
        if order == 2:
            if not (nodes % 2.0).all():
                raise MeshError(
                    f"flank_nodes {tuple(flank_nodes)}: elements of order 2 have three nodes along "
                    "an edge, so give odd numbers of nodes"
                )
            flank_nodes = (flank_nodes[0] + 1) // 2, (flank_nodes[1] + 1) // 2
            size, notch = 2.0 * size, max(notch // 2, 1)
        sections = {
            "disk": (self.disk_section(), self.slot_fillet),
            "blade": (self.blade_section(), self.neck_fillet),
        }
        disk, blade = (
            mesh_body(
                name,
                section,
                self.flank_width,
                self.slot_length * self.slot_direction if dimension == 3 else np.zeros(3),
                (self.end_width or 0.0) / self.slot_length,
                flank_nodes,
                (size, 2.0 * np.pi * fillet / notch),
                SIZE_GROWTH[order] if growth is None else growth,
                dimension,
            )
            for name, (section, fillet) in sections.items()
        )
        if curved or order == 2:
            disk, blade = (
                self._curved(body, sections[name][0])
                for name, body in (("disk", disk), ("blade", blade))
            )
        if order == 2:
            disk, blade = halved(disk), halved(blade)
        interfaces = []
        for name, side in (("intrados", 1), ("extrados", -1)):
            face = matched_interface(name, disk, blade, name, self.flank_frame(side))
            x, y = face.coordinates.T
            interfaces.append(replace(face, gap=self.flank_gap(x, y, side)))
        return StructureMesh((disk, blade), tuple(interfaces))

    def _curved(self, body: Body, section: list[SectionCurve]) -> Body:
        """Return the body with midside nodes, those on its fillets at their true radius."""
        edges, facets = mesh_edges(body.mesh), body.mesh.boundary_facets()
        on_surface = np.zeros(len(edges), bool)
        on_surface[facets if body.mesh.dim() == 2 else np.unique(body.mesh.f2e[:, facets])] = True
        middles = body.points[edges].mean(axis=1)
        # The section is the same in every plane Y = const, but shifted along X if it is skewed.
        slope = np.tan(self.skew)
        places = body.points[:, [0, 2]] - slope * body.points[:, 1:2] * [1.0, 0.0]
        for start, middle, _ in (corners for name, corners in section if name == "fillet"):
            for side in (1.0, -1.0):
                centre = np.array(middle) * [side, 1.0]
                radius = float(np.hypot(*np.subtract(start, middle)))
                off = np.abs(np.linalg.norm(places - centre, axis=1) - radius)
                round_edges = on_surface & (off < ON_ARC * radius)[edges].all(axis=1)
                arms = places[edges[round_edges]].mean(axis=1) - centre
                arms *= radius / np.linalg.norm(arms, axis=1, keepdims=True) - 1.0
                middles[np.ix_(round_edges, [0, 2])] += arms
        return replace(body, midsides=np.ascontiguousarray(middles[:, body.axes]))

    def blade_section(self) -> list[SectionCurve]:
        """Return named curves around the right half of the blade; arcs are (start, centre, end)."""
        top, bottom = self.flank_ends()
        neck = 0.5 * self.neck_width
        tangent = self.neck_fillet * np.tan(0.5 * self.flank_angle)
        arc_z = top[1] + tangent * (np.cos(self.flank_angle) + 1.0)
        low, high = bottom[1] - self.root_depth, top[1] + self.shank_height
        return _chain(
            [
                ("root_bottom", (0.0, low)),
                ("", (bottom[0], low)),
                ("flank", tuple(bottom)),
                ("fillet", tuple(top), (neck + self.neck_fillet, arc_z)),
                ("", (neck, arc_z)),
                ("shank_top", (neck, high)),
                ("middle", (0.0, high)),
            ]
        )

    def disk_section(self) -> list[SectionCurve]:
        """Return named curves around the right half of the disk; arcs are (start, centre, end)."""
        top, bottom = self.flank_ends()
        radius = self.slot_fillet
        sine, cosine = np.sin(self.flank_angle), np.cos(self.flank_angle)
        wall = bottom[0] + radius * (1.0 - cosine)
        slot = bottom[1] - self.root_depth - self.slot_clearance
        inner, outer = self.rim_radius - self.disk_height, self.rim_radius + self.lug_height
        tangent = np.tan(np.pi / self.blades)
        # The curves run up the flank, as in the blade's section: gmsh then splits both faces along
        # the same diagonals.
        return _chain(
            [
                ("", (0.0, slot)),
                ("fillet", (wall - radius, slot), (wall - radius, slot + radius)),
                ("", (wall, slot + radius)),
                (
                    "fillet",
                    (wall, bottom[1] - radius * sine),
                    (wall - radius, bottom[1] - radius * sine),
                ),
                ("flank", tuple(bottom)),
                ("", tuple(top)),
                ("", (top[0], outer)),
                ("sides", (outer * tangent, outer)),
                ("inner", (inner * tangent, inner)),
                ("middle", (0.0, inner)),
            ]
        )


def _chain(corners: list[Any]) -> list[SectionCurve]:
    """Return the curves between consecutive corners; a third entry is the centre of an arc.

    The arc follows the corner.
    """
    following = corners[1:] + corners[:1]
    return [
        (corner[0], [corner[1], *corner[2:], following_corner[1]])
        for corner, following_corner in zip(corners, following, strict=True)
    ]
