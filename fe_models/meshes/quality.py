"""Sizes of the elements of a mesh, and their quality."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from skfem import MeshTet, MeshTri

from fe_models.meshes.structure_mesh import Face
from sa_solver.types import Array


def element_sizes(mesh: MeshTet | MeshTri) -> Array:
    """Return the longest edge of each element, ``(m,)`` [mm].

    Examples
    --------
    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from fe_models.meshes.quality import element_sizes
    >>> element_sizes(MeshTri.init_tensor(np.array([0.0, 3.0]), np.array([0.0, 4.0])))
    array([5., 5.])
    """
    longest: Array = _edges(mesh).max(axis=0)
    return longest


def radius_ratios(mesh: MeshTet | MeshTri) -> Array:
    """Return the inscribed over the circumscribed radius of each element, ``(m,)``.

    The ratio is normalised: 1 for a regular element, 0 for a flat one. It is gmsh's ``gamma``, d r
    / R in d dimensions (Liu and Joe, Relationship between tetrahedron shape measures, BIT 34, 1994,
    doi:10.1007/BF01955874).

    Examples
    --------
    A right-angled triangle of 3, 4 and 5 mm has radii of 1 and 2.5 mm:

    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from fe_models.meshes.quality import radius_ratios
    >>> radius_ratios(MeshTri.init_tensor(np.array([0.0, 3.0]), np.array([0.0, 4.0])))
    array([0.8, 0.8])
    """
    corners = np.moveaxis(mesh.p[:, mesh.t], 0, -1)  # (dim + 1, m, dim)
    sides = corners[1:] - corners[0]
    ratios: Array
    if mesh.dim() == 2:
        a, b, c = _edges(mesh)
        area = 0.5 * np.abs(np.linalg.det(np.moveaxis(sides, 0, 1)))
        ratios = 16.0 * area**2 / ((a + b + c) * a * b * c)
        return ratios
    u, v, w = sides
    normals = np.cross(v, w), np.cross(w, u), np.cross(u, v)
    six_volumes = np.abs(np.einsum("ma,ma->m", u, normals[0]))
    faces = 0.5 * sum(np.linalg.norm(n, axis=1) for n in (*normals, sum(normals)))
    squares = (np.einsum("ma,ma->m", side, side)[:, None] for side in sides)
    centre = np.linalg.norm(sum(s * n for s, n in zip(squares, normals, strict=True)), axis=1)
    # Radii r = 3 V / A and R = centre / 12 V; the ratio is 3 r / R.
    ratios = 3.0 * six_volumes**2 / (faces * centre)
    return ratios


def elements_across(face: Face, width: float) -> float:
    """Return the number of elements of a face over a ``width`` along its x, by the median extent.

    Examples
    --------
    >>> import numpy as np
    >>> from fe_models.meshes.structure_mesh import Face
    >>> from fe_models.meshes.quality import elements_across
    >>> from sa_solver import Frame
    >>> ends = np.arange(5)
    >>> places = np.stack([0.5 * ends, 0.0 * ends], axis=1)
    >>> frame, facets = Frame(np.zeros(3), np.eye(3)), np.stack([ends[:-1], ends[1:]], axis=1)
    >>> line = Face("flank", frame, places, facets)
    >>> elements_across(line, width=1.5)
    3.0
    """
    along = face.coordinates[face.facets, 0]
    return float(width / np.median(np.ptp(along, axis=1)))


def _edges(mesh: MeshTet | MeshTri) -> Array:
    """Return the lengths of the edges of each element, ``(edges, m)`` [mm]."""
    corners = np.moveaxis(mesh.p[:, mesh.t], 0, -1)
    pairs = combinations(range(len(corners)), 2)
    return np.array([np.linalg.norm(corners[i] - corners[j], axis=1) for i, j in pairs])
