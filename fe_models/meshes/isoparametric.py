"""Elements of second order whose midside nodes are off the middle of their edges.

Positions are quadratic in the element as the displacements are, x = Σ N_k(ξ) x_k: the elements are
isoparametric (Zienkiewicz, Taylor & Zhu 2013, ch. 6). Linear displacement fields stay exact, since
they are Σ N_k u(x_k), for any midside nodes that do not fold an element. Integrals of polynomials
in ξ up to a degree of ``INTEGRATED`` are exact: those of constant stress, of pressure over a face
and its moments, of volume, and of the resultants of weight and centrifugal forces.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from skfem import ElementTetP2, ElementTriP2, MeshTet2, MeshTri2
from skfem.mapping import MappingIsoparametric

from fe_models.meshes.structure_mesh import Body, numbered_as
from sa_solver.types import Array, Indices

# Degree in the coordinates of an element: constant stress needs 3, a centrifugal force 5.
INTEGRATED = 6
# Newton's method for a point's coordinates in its element ends after a step this small: since it
# converges quadratically, only rounding errors are left.
FOUND = 1e-8
MOST_STEPS = 20
# Corners of a triangle and middles of its edges, in the order of both gmsh and scikit-fem.
TRIANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]]).T
SEGMENT = np.array([[0.0, 1.0, 0.5]])


class QuadraticMapping(MappingIsoparametric):  # type: ignore[misc]
    """Mapping from the reference element to those of a body with ``midsides``.

    Its inverse is found by Newton's method.
    """

    def __init__(self, body: Body) -> None:
        assert body.midsides is not None
        kind, element = (
            (MeshTet2, ElementTetP2) if body.mesh.dim() == 3 else (MeshTri2, ElementTriP2)
        )
        nodes = np.hstack([body.mesh.p, body.midsides.T])
        mesh = numbered_as(body.mesh, kind(np.ascontiguousarray(nodes), body.mesh.t))
        super().__init__(mesh, element(), mesh.bndelem)

    def invF(self, x: Array, tind: Indices | None = None, *settings: Any) -> Array:
        """Return coordinates in the elements ``tind`` of points ``x`` ``(d, elements, points)``.

        scikit-fem's method demands more accuracy than rounding allows for points far from the
        origin.
        """
        local = np.full(x.shape, 1.0 / (1 + len(x)))
        for _ in range(MOST_STEPS):
            inverse = np.moveaxis(self.invDF(local, tind), (0, 1), (-2, -1))
            off = np.moveaxis(x - self.F(local, tind), 0, -1)
            step = np.moveaxis((inverse @ off[..., None])[..., 0], -1, 0)
            local = local + step
            if np.abs(step).max(initial=0.0) < FOUND:
                return np.asarray(local)
        raise ArithmeticError("midside nodes fold an element: a point on its face is not in it")


def mapping_of(body: Body) -> QuadraticMapping | None:
    """Return the mapping of a body with midside nodes, or None if its edges are straight."""
    return None if body.midsides is None else QuadraticMapping(body)


def facet_normals(body: Body, facets: Indices) -> Array:
    """Return outward normals ``(m, nodes, 3)`` at the nodes of facets, as long as their area.

    The nodes are those of :meth:`Body.facet_nodes`. In the plane a facet extends by 1 mm along Y.
    """
    corners = body.nodes[body.facet_nodes(facets)]
    slopes = _slopes(body.mesh.dim() - 1)
    along = np.einsum("mka,kdq->mdqa", corners, slopes)
    across = along[:, 1] if along.shape[1] == 2 else np.array([0.0, 1.0, 0.0])
    share = 0.5 if along.shape[1] == 2 else 1.0
    normals = share * np.cross(along[:, 0], across)
    out = np.sign(np.einsum("mqa,ma->m", normals, body.outward_of(facets)))
    return np.asarray(normals * out[:, None, None])


def folded(body: Body) -> NDArray[np.bool_]:
    """Return flags ``(m,)`` of the elements that their midside nodes turn inside out.

    This is checked at the nodes and at the integration points; elsewhere an element may still be
    folded.
    """
    from skfem.quadrature import get_quadrature

    mapping = mapping_of(body)
    assert mapping is not None
    inside, _ = get_quadrature(mapping.mesh.refdom, INTEGRATED)
    points = np.hstack([mapping.elem.doflocs.T, inside])
    determinants = np.linalg.det(np.moveaxis(mapping.DF(points), (0, 1), (-2, -1)))
    corners = body.mesh.p[:, body.mesh.t]
    straight = np.linalg.det(np.moveaxis(corners[:, 1:] - corners[:, :1], -1, 0))
    return np.asarray((determinants * np.sign(straight)[:, None]).min(axis=1) <= 0.0)


def _slopes(dimension: int) -> Array:
    """Return the derivatives of a facet's functions at its nodes.

    The shape is ``(nodes, d, nodes)``, with the functions along the first axis.
    """
    from skfem import ElementLineP2

    element, points = (ElementTriP2(), TRIANGLE) if dimension == 2 else (ElementLineP2(), SEGMENT)
    return np.stack([element.lbasis(points, k)[1] for k in range(points.shape[1])])
