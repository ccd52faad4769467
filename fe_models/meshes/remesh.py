"""Meshes moved to another shape: worn faces, and the form of faces that are meshed flat.

Nodes of the faces move along the normal of the interface; the interior follows a harmonic field.
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
    mesh_edges,
    numbered_as,
)
from fe_models.solvers.linear_solver import prepare
from sa_solver.types import Array, Indices

# An element that keeps less than this share of its volume is too flat for its stress to be trusted.
SMALLEST_VOLUME_SHARE = 0.1
# Boundaries beside a face follow its form over this multiple of its depth: no steeper than 1 in 5.
FOLLOWING = 5.0


def worn_mesh(mesh: StructureMesh, depths: list[tuple[Array, Array]]) -> StructureMesh:
    """Return the mesh with the faces of every interface lowered by nodal depths.

    Interior nodes follow a harmonic field, all other boundaries stay. The gaps of the interfaces
    are unchanged, because they are kept separately from the mesh.

    Parameters
    ----------
    mesh
        The unworn mesh.
    depths
        Depths of body 1 and body 2 of each interface, ``(n,)`` [mm] each, at the nodes of that
        body's own face.

    Raises
    ------
    MeshError
        If an element is crushed because the depth is not small against the elements at the face.
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
    """Return the displacements ``(n, dim)`` [mm] of each body that give it the form of its faces.

    The form is the part of the interfaces' gaps, such as rounded edges, that the meshed faces do
    not have. Body 2 receives all of it and body 1 stays as it is meshed, as in
    :class:`wear.surfaces.Surfaces`. Where body 1 does not cover a face, its form is that of the
    nearest covered node. Boundaries beside it follow over a few times its depth, and stay unchanged
    farther away.
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
    all_held = np.unique(np.concatenate(held))
    others = np.setdiff1d(body.mesh.boundary_nodes(), all_held)
    distance, nearest = cKDTree(points[all_held]).query(points[others])
    form[others] = np.maximum(1.0 - distance / reach, 0.0)[:, None] * form[all_held[nearest]]
    return _followed(body.mesh, form[:, body.axes])


def formed_mesh(mesh: StructureMesh, form: Sequence[Array]) -> StructureMesh:
    """Return the mesh with its bodies in their ``form`` from :func:`form_of`, or 0 [mm].

    Raises :class:`MeshError` if an element is crushed.
    """
    bodies = []
    for body, moved in zip(mesh.bodies, form, strict=True):
        formed = _moved(body, moved) if moved.any() else body
        if _crushed(body, formed):
            raise MeshError(
                f"elements of the {body.name} are too small for the form of its faces: use larger "
                "elements at its faces"
            )
        bodies.append(formed)
    return replace(mesh, bodies=tuple(bodies))


def worn_volume(before: Body, after: Body, interface: Interface, number: int) -> float:
    """Return the volume between the faces of an interface before and after, of one body [mm³].

    ``number`` is 1 or 2. Each facet sweeps a prism: its area times the mean distance of its
    corners. In the plane the result is per length [mm²].
    """
    moved = (after.points - before.points)[interface.nodes(number)] @ interface.frame.axes[2]
    return float(interface.face(number).nodal_areas @ np.abs(moved))


def element_volumes(mesh: MeshTet | MeshTri) -> Array:
    """Return signed volumes of the elements ``(m,)`` [mm³]; areas in the plane [mm²]."""
    corners = mesh.p[:, mesh.t]
    edges = np.moveaxis(corners[:, 1:] - corners[:, :1], -1, 0)
    return np.linalg.det(edges) / factorial(mesh.dim())


def oriented_elements(mesh: MeshTet | MeshTri) -> Indices:
    """Return the corners of the elements ``(m, dim + 1)``, ordered to have positive volumes.

    Files for VTK need that order; scikit-fem takes corners in any order.
    """
    elements = mesh.t.T.copy()
    inverted = element_volumes(mesh) < 0.0
    elements[inverted, -2:] = elements[inverted][:, [-1, -2]]
    return elements


def _unmeshed_gap(mesh: StructureMesh, interface: Interface) -> Array:
    """Return the part of an interface's gap ``(n,)`` [mm] that the meshed faces do not have."""
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
    """Return displacements ``(n, dim)``, harmonic inside, from those prescribed on the boundary."""
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
        # The displacement is linear between vertices, so edges keep their bulges.
        midsides = midsides + displacement[mesh_edges(body.mesh)].mean(axis=1)
    mesh, elements = numbered_as(body.mesh, mesh), body.elements
    if elements is not None:
        corners, middles = np.split(mesh.p, [elements.mesh.nvertices], axis=1)
        moved = replace(elements.mesh, doflocs=np.ascontiguousarray(corners))
        moved = numbered_as(elements.mesh, moved)
        elements = replace(elements, mesh=moved, midsides=np.ascontiguousarray(middles.T))
    return replace(body, mesh=mesh, midsides=midsides, elements=elements)


def _crushed(before: Body, after: Body) -> bool:
    shares = element_volumes(after.mesh) / element_volumes(before.mesh)
    if np.min(shares) < SMALLEST_VOLUME_SHARE:
        return True
    return after.midsides is not None and bool(folded(after).any())
