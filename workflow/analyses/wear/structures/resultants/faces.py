"""Facets over the nodes of a contact face, for files that give none."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array, Indices

# Triangles flatter than this are slivers along a straight edge of the face, due to coordinates with
# six digits; elements of a contact face are never as thin.
FLATTEST = 1e-4


class FaceError(ValueError):
    """Error of nodes that do not form a face."""


def facets_over(coordinates: Array, line: bool) -> Indices:
    """Return triangles ``(m, 3)`` over nodes ``(n, 2)`` [mm]; segments ``(n - 1, 2)`` in a line.

    Triangles are Delaunay's and fill the convex hull of the nodes: the facets of a face with holes
    or notches must be given. Raises FaceError if a node belongs to none.
    """
    facets = _segments(coordinates) if line else _triangles(coordinates)
    check_facets(facets, len(coordinates))
    return facets


def check_facets(facets: Indices, count: int) -> None:
    """Raise FaceError unless the ``facets`` join all of ``count`` nodes and no others."""
    if facets.size and not (facets.min() >= 0 and facets.max() < count):
        raise FaceError(
            f"facets name nodes beyond the {count} there are; allowed: 0 to {count - 1}"
        )
    left = np.setdiff1d(np.arange(count), facets)
    if len(left):
        raise FaceError(
            f"node {left[0] + 1} of {count} belongs to no facet; allowed: nodes of one face, each "
            "at a different place"
        )


def _segments(coordinates: Array) -> Indices:
    order = np.argsort(coordinates[:, 0], kind="stable")
    apart = np.diff(coordinates[order, 0]) > 0.0
    return np.stack([order[:-1], order[1:]], axis=1)[apart].astype(np.int64)


def _triangles(coordinates: Array) -> Indices:
    from scipy.spatial import Delaunay, QhullError

    try:
        facets = Delaunay(coordinates).simplices.astype(np.int64)
    except (QhullError, ValueError) as error:
        raise FaceError("the nodes lie on one line; allowed: nodes that span a face") from error
    corners = coordinates[facets]
    edges = np.roll(corners, -1, axis=1) - corners
    longest = np.hypot(edges[..., 0], edges[..., 1]).max(axis=1)
    altitude = np.abs(np.linalg.det(edges[:, :2])) / longest
    return facets[altitude > FLATTEST * longest]
