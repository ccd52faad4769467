"""The worn shape in the mesh: flank nodes lowered, the inside moved after them."""

from __future__ import annotations

from dataclasses import replace
from math import factorial

import numpy as np
from skfem import Basis, BilinearForm, MeshTet, MeshTri
from skfem.helpers import dot, grad

from fe_models.elasticity import ELEMENTS
from fe_models.linear_solver import prepare
from fe_models.mesh import Body, Interface, MeshError, StructureMesh
from sa_solver.types import Array

# An element that keeps less than this share of its volume is too flat to trust its stress.
SMALLEST_VOLUME_SHARE = 0.1


def worn_mesh(mesh: StructureMesh, depths: list[tuple[Array, Array]]) -> StructureMesh:
    """Lower the faces of every interface by the nodal depths of body 1 and body 2 [mm].

    Each is ``(n,)`` at the nodes of that body's own face.

    Nodes inside follow a harmonic field, all other boundaries stay. The gaps of the interfaces are
    left alone: they are carried apart from the mesh. Raises :class:`MeshError` if an element is
    crushed, when the depth is no longer small against the elements at the flank.
    """
    bodies = []
    for number, body in enumerate((mesh.body_1, mesh.body_2), start=1):
        prescribed = np.zeros_like(body.points)
        for interface, pair in zip(mesh.interfaces, depths, strict=True):
            inwards = {1: -1.0, 2: 1.0}[number] * interface.frame.axes[2]
            prescribed[interface.nodes(number)] += np.outer(pair[number - 1], inwards)
        bodies.append(_moved(body, prescribed[:, body.axes]))
    return StructureMesh(bodies[0], bodies[1], mesh.interfaces)


def worn_volume(before: Body, after: Body, interface: Interface, number: int) -> float:
    """Volume between the faces of an interface before and after, of body ``number`` 1 or 2 [mm³].

    Each facet sweeps a prism: its area times the mean distance of its corners; per length in the
    plane [mm²].
    """
    moved = (after.points - before.points)[interface.nodes(number)] @ interface.frame.axes[2]
    return float(interface.face(number).nodal_areas @ np.abs(moved))


def element_volumes(mesh: MeshTet | MeshTri) -> Array:
    """Signed volumes of the elements ``(m,)`` [mm³]; areas in the plane [mm²]."""
    corners = mesh.p[:, mesh.t]
    edges = np.moveaxis(corners[:, 1:] - corners[:, :1], -1, 0)
    return np.linalg.det(edges) / factorial(mesh.dim())


def _moved(body: Body, prescribed: Array) -> Body:
    mesh = body.mesh
    boundary = mesh.boundary_nodes()
    inner = np.setdiff1d(np.arange(mesh.nvertices), boundary)
    laplace = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(
        Basis(mesh, ELEMENTS[mesh.dim(), 1]())
    )
    displacement = prescribed.copy()
    if len(inner) > 0:
        load = -(laplace[inner][:, boundary] @ prescribed[boundary])
        displacement[inner] = prepare(laplace[inner][:, inner].tocsr())(load)
    moved = replace(mesh, doflocs=mesh.p + displacement.T)
    if np.min(element_volumes(moved) / element_volumes(mesh)) < SMALLEST_VOLUME_SHARE:
        raise MeshError(
            f"the worn depth crushes elements of the {body.name}: use larger elements at the flank "
            "(mesh.flank_nodes) or stop at a smaller depth"
        )
    return Body(body.name, moved)
