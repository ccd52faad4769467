"""Shapes put into the mesh: worn faces, and the form that bodies have beside their flat faces.

Nodes of the faces move along the normal of the interface, the inside follows a harmonic field.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import factorial

import numpy as np
from scipy.spatial import cKDTree
from skfem import Basis, BilinearForm, MeshTet, MeshTri
from skfem.helpers import dot, grad

from fe_models.elasticity.body import ELEMENTS
from fe_models.meshes.isoparametric import folded
from fe_models.meshes.structure_mesh import (
    MATCHING_TOLERANCE,
    Body,
    Interface,
    MeshError,
    StructureMesh,
    numbered_as,
)
from fe_models.solvers.linear_solver import prepare
from sa_solver.types import Array

# An element that keeps less than this share of its volume is too flat to trust its stress.
SMALLEST_VOLUME_SHARE = 0.1
# Boundaries beside a face follow its form over so many times its depth: no steeper than 1 in 5.
FOLLOWING = 5.0


def worn_mesh(mesh: StructureMesh, depths: list[tuple[Array, Array]]) -> StructureMesh:
    """Lower the faces of every interface by the nodal depths of its body 1 and body 2 [mm].

    Each is ``(n,)`` at the nodes of that body's own face.

    Nodes inside follow a harmonic field, all other boundaries stay. The gaps of the interfaces are
    left alone: they are carried apart from the mesh. Raises :class:`MeshError` if an element is
    crushed, when the depth is no longer small against the elements at the flank.
    """
    bodies = []
    by_name = dict(zip((i.name for i in mesh.interfaces), depths, strict=True))
    for number, body in enumerate(mesh.bodies):
        prescribed = np.zeros_like(body.points)
        for interface, side in mesh.faces_of(number):
            inwards = {1: -1.0, 2: 1.0}[side] * interface.frame.axes[2]
            prescribed[interface.nodes(side)] += np.outer(
                by_name[interface.name][side - 1], inwards
            )
        worn = _moved(body, _followed(body.mesh, prescribed[:, body.axes]))
        if _crushed(body, worn):
            raise MeshError(
                f"the worn depth crushes elements of the {body.name}: use larger elements at the "
                "flank (mesh.flank_nodes) or stop at a smaller depth"
            )
        bodies.append(worn)
    return replace(mesh, bodies=tuple(bodies))


def form_of(mesh: StructureMesh) -> tuple[Array, ...]:
    """Displacements ``(n, dim)`` of each body's vertices that give it the form of its faces [mm].

    What the gaps of the interfaces are wider than the meshed faces are apart, such as rounded
    edges: body 2 has it and body 1 is as it is meshed, as in :class:`wear.surfaces.Surfaces`. Where
    body 1 covers nothing of a face its form goes on as at the nearest node; boundaries beside it
    follow over a few times its depth, and stay farther away.
    """
    return tuple(_form_of_body(mesh, number) for number in range(len(mesh.bodies)))


def _form_of_body(mesh: StructureMesh, number: int) -> Array:
    body, faces = mesh.bodies[number], mesh.faces_of(number)
    points, form, held = body.points, np.zeros_like(body.points), []
    for interface, side in faces:
        face, nodes, z = (
            body.vertices(interface.name),
            interface.nodes(side),
            interface.frame.axes[2],
        )
        if side == 2:
            nearest = cKDTree(points[nodes]).query(points[face])[1]
            form[face] += np.outer(_unmeshed_gap(mesh, interface)[nearest], z)
        held.append(face)
    reach = FOLLOWING * float(np.linalg.norm(form, axis=1).max())
    if reach == 0.0:
        return form[:, body.axes]
    every = np.unique(np.concatenate(held))
    beside = np.setdiff1d(body.mesh.boundary_nodes(), every)
    distance, nearest = cKDTree(points[every]).query(points[beside])
    form[beside] = np.maximum(1.0 - distance / reach, 0.0)[:, None] * form[every[nearest]]
    return _followed(body.mesh, form[:, body.axes])


def formed_mesh(mesh: StructureMesh, form: Sequence[Array]) -> StructureMesh:
    """The mesh with its bodies in their ``form``, of :func:`form_of` or 0 [mm].

    Raises :class:`MeshError` if that crushes an element.
    """
    bodies = []
    for body, moved in zip(mesh.bodies, form, strict=True):
        formed = _moved(body, moved) if moved.any() else body
        if _crushed(body, formed):
            raise MeshError(f"elements of the {body.name} are too small for the form of its faces")
        bodies.append(formed)
    return replace(mesh, bodies=tuple(bodies))


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


def _unmeshed_gap(mesh: StructureMesh, interface: Interface) -> Array:
    """What of its gap ``(n,)`` [mm] the meshed faces of an interface do not have."""
    height_1, height_2 = (
        interface.frame.coordinates(body.points[interface.nodes(number)])[:, 2]
        for number, body in enumerate((mesh.bodies[k] for k in interface.bodies), start=1)
    )
    form = interface.gap - (height_2 - interface.carried(height_1))
    if interface.bulged is not None:
        form -= interface.bulged
    form[np.abs(form) < MATCHING_TOLERANCE * np.ptp(interface.coordinates)] = 0.0
    return np.asarray(form)


def _followed(mesh: MeshTet | MeshTri, prescribed: Array) -> Array:
    """Displacements ``(n, dim)``, inside a harmonic field of those prescribed on the boundary."""
    boundary = mesh.boundary_nodes()
    inner = np.setdiff1d(np.arange(mesh.nvertices), boundary)
    displacement = prescribed.copy()
    if len(inner) > 0:
        laplace = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(
            Basis(mesh, ELEMENTS[mesh.dim(), 1]())
        )
        load = -(laplace[inner][:, boundary] @ prescribed[boundary])
        displacement[inner] = prepare(laplace[inner][:, inner].tocsr())(load)
    return displacement


def _moved(body: Body, displacement: Array) -> Body:
    mesh = replace(body.mesh, doflocs=body.mesh.p + displacement.T)
    midsides = body.midsides
    if midsides is not None:
        # What moves is linear between vertices: edges keep their bulges.
        ends = body.mesh.edges if mesh.dim() == 3 else body.mesh.facets
        midsides = midsides + displacement[ends].mean(axis=0)
    return replace(body, mesh=numbered_as(body.mesh, mesh), midsides=midsides)


def _crushed(before: Body, after: Body) -> bool:
    shares = element_volumes(after.mesh) / element_volumes(before.mesh)
    if np.min(shares) < SMALLEST_VOLUME_SHARE:
        return True
    return after.midsides is not None and bool(folded(after).any())
