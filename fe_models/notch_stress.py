"""Stress in the notches of a structure, from bodies of second order under known contact tractions.

Contact decides the tractions on the faces, which hardly depend on the elements of the bodies. So a
body alone, with curved elements of second order, finds its displacements under them without any
condensation or friction. They drive a local model round the largest stress on its free surface
(:mod:`fe_models.elasticity.local_model`). The displacements of first-order elements are not good
enough for that: those of the default dovetail's section leave 2 to 3 % of the stress.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.extruded import ExtrudedBody
from fe_models.elasticity.extruded_notch import ExtrudedNotch, extruded_models
from fe_models.elasticity.local_model import LocalModel, NotchedBody, local_models
from fe_models.joints.face_traction import FaceTraction
from fe_models.loads.constraints import Constraints
from fe_models.solvers.linear_solver import prepare
from fe_models.structure import Structure
from fe_models.supported_body import independent
from sa_solver.types import Array


def face_tractions(structure: Structure, force: Array) -> tuple[FaceTraction, ...]:
    """Return the tractions of contact forces on body 2 ``(k, 3, n)`` [N] at all interfaces."""
    return tuple(FaceTraction.of(face, force[..., nodes]) for face, nodes in structure.shares())


def notch_models(
    structure: Structure, tractions: Sequence[FaceTraction], amplitudes: Array
) -> list[list[LocalModel | None]]:
    """Return local models of the largest stress on the free surface, by body and by state.

    Parameters
    ----------
    structure
        The bodies with elements of second order, whose contact faces have the names of the
        ``tractions``.
    tractions
        :func:`face_tractions` of all contact faces in ``k`` states.
    amplitudes
        Amplitudes of the load cases ``(k, cases)``.

    Returns
    -------
    list
        For each body, :func:`fe_models.elasticity.local_model.local_models` of its states.
    """
    jobs = [
        partial(_of_body, structure, number, tractions, amplitudes)
        for number in range(len(structure.bodies))
    ]
    return structure.run_parallel(*jobs)


def extruded_notch_models(
    structure: Structure, tractions: Sequence[FaceTraction], amplitudes: Array, ends: Array
) -> list[list[LocalModel | None]]:
    """Return local models of bodies whose sections are those of a plane structure.

    Parameters
    ----------
    structure
        The sections with elements of second order, with loads per length along Y. Supports hold
        nodes in both directions, and then also along Y, or along one direction in the section.
    tractions, amplitudes
        As in :func:`notch_models`, with tractions over the areas of the contact faces.
    ends
        Ends of the elements along Y ``(m + 1,)`` [mm], from one end of the bodies to the other.
    """
    jobs = [
        partial(_of_extruded, structure, number, tractions, amplitudes, ends)
        for number in range(len(structure.bodies))
    ]
    return structure.run_parallel(*jobs)


def _of_extruded(
    structure: Structure,
    number: int,
    tractions: Sequence[FaceTraction],
    amplitudes: Array,
    ends: Array,
) -> list[LocalModel | None]:
    """Return the local models of one extruded body."""
    supported = structure.bodies[number]
    section = supported.elastic
    body = ExtrudedBody(section, ends)
    acting = {traction.interface.name: traction for traction in tractions}
    sides = {face.name: side for face, side in structure.mesh.faces_of(number)}

    def loaded(part: ExtrudedBody) -> Array:
        """Return the nodal forces of the tractions on a part of the body."""
        load = np.zeros((part.size, len(amplitudes)))
        for name in sides.keys() & part.section.body.mesh.boundaries.keys():
            load += part.traction_load(acting[name], sides[name], whole=False)
        return load

    smoothed = [acting[name].with_smoothed() for name in sides]
    loads = [body.traction_load(of, sides[of.interface.name], whole=True) for of in smoothed]
    load = np.sum(loads, axis=0)
    per_length = body.along(supported.loads @ amplitudes.T)
    cases = load.shape[1] // len(amplitudes)
    moved = _moved(body, supported.constraints, load + np.tile(per_length, cases))
    volume = supported.acting @ amplitudes.T
    displacement, *variants = np.split(moved, cases, axis=1)
    return extruded_models(
        ExtrudedNotch(
            body=body,
            displacement=displacement,
            free=supported.free_facets,
            contacts=tuple(sides),
            variants=np.array(variants),
            traction=loaded,
            density=np.array([section.nodal_density(load) for load in volume.T]),
        )
    )


def _moved(body: ExtrudedBody, constraints: Constraints, load: Array) -> Array:
    """Return the displacements ``(size, k)`` under a load, up to rigid motions that are free."""
    in_plane = constraints.transformation().tocsr()
    count, levels = len(body.section.nodes), len(body.levels)
    still = (np.diff(in_plane.indptr) == 0).reshape(count, 2).all(axis=1)
    along = sp.identity(count, format="csr")[:, np.flatnonzero(~still)]
    spread = sp.kron(sp.identity(count), [[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    across = sp.kron(sp.identity(count), [[0.0], [1.0], [0.0]])
    sections = sp.hstack([spread @ in_plane, across @ along])
    free = sp.kron(sections, sp.identity(levels), format="csr")
    stiffness, rhs = (free.T @ body.stiffness @ free).tocsr(), free.T @ load
    if still.any():
        return np.asarray(free @ prepare(stiffness)(rhs))
    rigid = sl.orth(free.T @ body.rigid_motions)
    rhs -= rigid @ (rigid.T @ rhs)
    kept = np.delete(np.arange(len(rhs)), independent(rigid))
    solved = np.zeros_like(rhs)
    solved[kept] = prepare(stiffness[kept][:, kept].tocsr())(rhs[kept])
    return np.asarray(free @ solved)


def _of_body(
    structure: Structure, number: int, tractions: Sequence[FaceTraction], amplitudes: Array
) -> list[LocalModel | None]:
    """Return the local models of one body."""
    body = structure.bodies[number]
    elastic = body.elastic
    acting = {traction.interface.name: traction for traction in tractions}
    sides = {face.name: side for face, side in structure.mesh.faces_of(number)}

    def loaded(part: ElasticBody) -> Array:
        """Return the nodal forces of the tractions on a part of the body."""
        load = np.zeros((part.size, len(amplitudes)))
        for name in sides.keys() & part.body.mesh.boundaries.keys():
            load += acting[name].load(part, sides[name], whole=False)
        return load

    smoothed = [acting[name].with_smoothed() for name in sides]
    load = np.sum(
        [of.load(elastic, sides[of.interface.name], whole=True) for of in smoothed], axis=0
    )
    cases = load.shape[1] // len(amplitudes)
    repeated = np.tile(amplitudes, (cases, 1)).T
    moved, _ = body.respond(np.zeros((len(body.held), load.shape[1])), repeated, load)
    displacement, *variants = np.split(body.straining(moved, repeated), cases, axis=1)
    volume = body.acting @ amplitudes.T
    return local_models(
        NotchedBody(
            elastic=elastic,
            displacement=displacement,
            free=body.free_facets,
            contacts=tuple(sides),
            variants=np.array(variants),
            traction=loaded,
            density=np.array([elastic.nodal_density(load) for load in volume.T]),
            thermal=body.thermal_strain(amplitudes.T),
            clamped=body.clamped,
        )
    )
