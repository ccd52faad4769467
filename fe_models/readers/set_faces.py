"""Node sets that are faces, since CAE programs often name surfaces by their nodes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fe_models.meshes.structure_mesh import Body
from sa_solver.types import Indices


def facets_within(body: Body, vertices: Indices) -> Indices:
    """Return the facets of the surface of a body whose corners are all among the vertices."""
    surface = body.mesh.boundary_facets()
    return np.asarray(surface[np.isin(body.mesh.facets[:, surface], vertices).all(axis=0)])


def faces_of_sets(body: Body, node_sets: Mapping[str, Indices]) -> dict[str, Indices]:
    """Return the facets of those node sets that are faces: each node is a corner of a facet."""
    known = body.mesh.boundaries or {}
    faces = {}
    for name, vertices in node_sets.items():
        facets = facets_within(body, vertices)
        corners = np.unique(body.mesh.facets[:, facets])
        if name not in known and len(corners) == len(np.unique(vertices)):
            faces[name] = facets
    return faces
