"""The worn shape in the mesh: flank nodes lowered, the inside moved after them."""

from __future__ import annotations

import numpy as np
from skfem import Basis, BilinearForm, ElementTetP1, MeshTet
from skfem.helpers import dot, grad

from fe_models.linear_solver import factorise
from fe_models.mesh import Body, Interface, MeshError, StructureMesh
from sa_solver.types import Array

# An element that keeps less than this share of its volume is too flat to trust its stress.
SMALLEST_VOLUME_SHARE = 0.1


def worn_mesh(mesh: StructureMesh, depths: list[tuple[Array, Array]]) -> StructureMesh:
    """Lower the faces of every interface by the nodal depths of body 1 and body 2 ``(n,)`` [mm].

    Nodes inside follow a harmonic field, all other boundaries stay. The gaps of the interfaces are
    left alone: they are carried apart from the mesh. Raises :class:`MeshError` if an element is
    crushed, when the depth is no longer small against the elements at the flank.
    """
    bodies = []
    for number, body in enumerate((mesh.body_1, mesh.body_2)):
        prescribed = np.zeros((body.mesh.nvertices, 3))
        for interface, pair in zip(mesh.interfaces, depths, strict=True):
            nodes = (interface.nodes_1, interface.nodes_2)[number]
            inwards = (-1.0, 1.0)[number] * interface.frame.axes[2]
            prescribed[nodes] += np.outer(pair[number], inwards)
        bodies.append(_moved(body, prescribed))
    return StructureMesh(bodies[0], bodies[1], mesh.interfaces)


def worn_volume(before: Body, after: Body, interface: Interface, number: int) -> float:
    """Volume between the faces of an interface before and after, of body ``number`` 1 or 2 [mm³].

    Each triangle sweeps a prism: its area times the mean distance of its corners.
    """
    nodes = (interface.nodes_1, interface.nodes_2)[number - 1]
    moved = (after.mesh.p - before.mesh.p)[:, nodes].T @ interface.frame.axes[2]
    return float(interface.nodal_areas @ np.abs(moved))


def element_volumes(mesh: MeshTet) -> Array:
    """Signed volumes of the tetrahedra ``(m,)`` [mm³]."""
    corners = mesh.p[:, mesh.t]
    a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
    return np.einsum("ae,ae->e", a, np.cross(b, c, axis=0)) / 6.0


def _moved(body: Body, prescribed: Array) -> Body:
    mesh = body.mesh
    boundary = mesh.boundary_nodes()
    inner = np.setdiff1d(np.arange(mesh.nvertices), boundary)
    laplace = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(
        Basis(mesh, ElementTetP1())
    )
    displacement = prescribed.copy()
    load = -(laplace[inner][:, boundary] @ prescribed[boundary])
    displacement[inner] = factorise(laplace[inner][:, inner].tocsr())(load)
    moved = MeshTet(mesh.p + displacement.T, mesh.t, sort_t=False).with_boundaries(mesh.boundaries)
    if np.min(element_volumes(moved) / element_volumes(mesh)) < SMALLEST_VOLUME_SHARE:
        raise MeshError(
            f"the worn depth crushes elements of the {body.name}: use larger elements at the flank "
            "(mesh.flank_nodes) or stop at a smaller depth"
        )
    return Body(body.name, moved)
