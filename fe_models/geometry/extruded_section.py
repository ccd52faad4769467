"""Meshes of bodies with two flanks: a mirrored section, extruded along a slot with gmsh."""

from __future__ import annotations

from math import ceil
from typing import Any

import numpy as np

from fe_models.meshes.gmsh_session import gmsh_model, grow_from
from fe_models.meshes.structure_mesh import AXES, Body, named_mesh
from fe_models.readers.gmsh_file import EntityGroup, generated_body
from sa_solver.types import Array

# Growth of the mesh size per distance from the flanks, by order, and from fillets. With order 1 the
# contact pressure is sensitive to the former. With order 2 the stress 0.1 mm below the face is: on
# 41 nodes 0.4, 0.5 and 0.8 leave 0.9, 1.2 and 2.6 % in the contact, 4, 5 and 8 % beside it; less
# growth takes more nodes in space. The growth from fillets affects only the stress there.
SIZE_GROWTH, FILLET_GROWTH = {1: 0.25, 2: 0.5}, 0.7
# Share of the layers along the slot that divide the rounding at each end, where pressure and wear
# are largest. A rounding shorter than the least share of the slot counts as a sharp end, and of a
# longer one than the first share only this part is divided. The layers between grow from the ends:
# at most the last share of them as a cosine does, the rest is even.
END_LAYERS, LEAST_END, MOST_GRADED = 0.15, 0.02, 0.45
# Number of points along a curve from which distances are measured: many more than it usually has
# nodes.
SAMPLES = 200

# Curves of a section that are not boundaries.
UNNAMED = ("", "middle", "fillet")

SectionCurve = tuple[str, list[tuple[float, float]]]


def mesh_body(
    name: str,
    section: list[SectionCurve],
    width: float,
    slot: Array,
    end: float,
    flank_nodes: tuple[int, int],
    sizes: tuple[float, float],
    growth: float,
    dimension: int,
) -> Body:
    """Mesh one body in a separate gmsh model.

    The flanks are ``width`` wide. The section is extruded by the vector ``slot`` ``(3,)``, whose
    share ``end`` is rounded at each end. ``sizes`` are the element sizes far away and on the
    fillets, ``growth`` that from the flanks. Two bodies in one model would share the nodes of their
    flanks, because gmsh identifies the nodes of an extruded mesh by their position.
    """
    with gmsh_model(name) as gmsh:
        model = gmsh.model
        surfaces, named = _draw_halves(model.occ, section, -0.5 * slot)
        model.occ.synchronize()
        for curve in named["flank"]:
            model.mesh.setTransfiniteCurve(curve, flank_nodes[0])
        fine = width / (flank_nodes[0] - 1)
        sources = (named["flank"], fine, growth), (named["fillet"], sizes[1], FILLET_GROWTH)
        for distance in grow_from(gmsh, "CurvesList", sources, sizes[0]):
            model.mesh.field.setNumber(distance, "Sampling", SAMPLES)
        _mirror_mesh(model, surfaces, -0.5 * slot[0])
        halves, cells = [(2, surface) for surface in surfaces], surfaces
        swept = {label: curves for label, curves in named.items() if label not in UNNAMED}
        if dimension == 3:
            layers = _layers(flank_nodes[1] - 1, end)
            extruded = model.occ.extrude(halves, *slot, np.ones_like(layers, dtype=int), layers)
            model.occ.synchronize()
            cells = [tag for dim, tag in extruded if dim == 3]
            swept = {label: _swept(model, curves, surfaces) for label, curves in swept.items()}
        model.mesh.generate(dimension)
        boundaries = [
            EntityGroup(label, dimension - 1, tags) for label, tags in _sided(swept).items()
        ]
        points, elements, facets = generated_body(
            gmsh, EntityGroup(name, dimension, cells), boundaries
        )
    return Body(name, named_mesh(points[:, AXES[dimension]], elements, facets))


def _layers(count: int, end: float) -> Array:
    """Return the ends ``(count,)`` of the layers of elements along the slot, up to 1.

    ``end`` is the width of the rounding at each end, relative to the slot.
    """
    at_end = min(ceil(END_LAYERS * count), (count - 1) // 3) if end >= LEAST_END else 0
    between = count - 2 * at_end
    end = min(end, END_LAYERS) if at_end else 0.0
    low = np.linspace(0.0, end, at_end + 1)
    even = np.linspace(0.0, 1.0, between + 1)
    cosine = 0.5 * (1.0 - np.cos(np.pi * even))
    # The first layer between is no shorter than those at the ends.
    finer = 1.0 - low[1] / (1.0 - 2.0 * end) * between if at_end else 1.0
    steepest = 1.0 - between * cosine[1] if between > 2 else 1.0
    graded = min(max(finer / steepest, 0.0), MOST_GRADED)
    middle = end + (1.0 - 2.0 * end) * (even + graded * (cosine - even))
    return np.concatenate([low, middle[1:], 1.0 - low[-2::-1]])[1:]


def _draw_halves(
    occ: Any, section: list[SectionCurve], start: Array
) -> tuple[list[int], dict[str, list[int]]]:
    """Draw the right and the left half of a section; return their surfaces and named curves."""
    points: dict[tuple[float, float], int] = {}
    named: dict[str, list[int]] = {}
    surfaces = []

    def point(x: float, z: float) -> int:
        if (x, z) not in points:
            points[x, z] = occ.addPoint(start[0] + x, start[1], z)
        return points[x, z]

    for side in (1.0, -1.0):
        loop = []
        for name, corners in section:
            if name == "middle" and "middle" in named:
                loop += named["middle"]
                continue
            tags = [point(side * x, z) for x, z in corners]
            curve = occ.addLine(*tags) if len(tags) == 2 else occ.addCircleArc(*tags)
            named.setdefault(name, []).append(curve)
            loop.append(curve)
        surfaces.append(occ.addPlaneSurface([occ.addCurveLoop(loop)]))
    return surfaces, named


def _mirror_mesh(model: Any, surfaces: list[int], middle: float) -> None:
    """Make the mesh of the left half the mirror image of the right half's, about X = middle."""
    mirror = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirror[0, 3] = 2.0 * middle
    model.mesh.setPeriodic(2, [surfaces[1]], [surfaces[0]], mirror.ravel().tolist())


def _swept(model: Any, curves: list[int], sections: list[int]) -> list[int]:
    """Return the faces that section curves have swept, curve after curve."""
    return [
        int(surface)
        for curve in curves
        for surface in np.setdiff1d(model.getAdjacencies(1, curve)[0], sections)
    ]


def _sided(named: dict[str, list[int]]) -> dict[str, list[int]]:
    """Return the named entities with the right flank as intrados and the left as extrados."""
    right, left = named["flank"]
    others = {label: tags for label, tags in named.items() if label != "flank"}
    return {"intrados": [right], "extrados": [left]} | others
