"""Craig-Bampton models of the two specimens of a friction rig, on their pads and rings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fe_models.elasticity.body import ElasticBody
from fe_models.geometry.specimens import CONTACT, Specimen
from fe_models.joints import reduction
from fe_models.joints.reduction import ReducedModel, reduce_body
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import Body, StructureMesh
from fe_models.meshes.trace import LinearTrace
from sa_solver.types import Array, Indices, Material

# Fixed-interface modes of each specimen ("Dynamics simulations of fretting wear for aero-engine
# applications", thesis, section 4.2).
MODES = 20
# Number of steps in the reduction of both specimens: the matrices and the reduction of each.
STEPS = 2 * (1 + reduction.STEPS)
# Kinds of kept points, as named in the models.
PAD, RING, TARGET = "pad", "ring", "target"

NONE: Indices = np.empty(0, dtype=np.int64)


@dataclass(frozen=True)
class SpecimenMatrices:
    """Matrices of a free specimen with the linear trace of its pad and a ring that moves linearly.

    With elements of second order, the displacements of the pad are those of its trace
    (:mod:`fe_models.meshes.trace`); they come last and have no mass.

    Attributes
    ----------
    stiffness, mass
        Matrices ``(n, n)`` on the independent displacements.
    transformation
        Matrix ``(all, n)`` from the independent displacements to those of all nodes.
    kept
        The three displacements of each pad node, in the interface's order, then of each ring node,
        and of further points.
    """

    stiffness: sp.csr_matrix
    mass: sp.csr_matrix
    transformation: sp.csr_matrix
    kept: Indices


def specimen_matrices(
    specimen: Specimen,
    body: Body,
    pad: Indices,
    material: Material,
    order: int = 2,
    further: Indices = NONE,
) -> SpecimenMatrices:
    """Return the matrices of one free specimen.

    The circumference moves linearly from each ring node to the next, so that held ring nodes hold a
    line. The stiffness of the pair is then 96.8, 96.0 and 95.6 N/µm with elements of 1.5, 1 and 0.6
    mm. Held points would yield more the finer the mesh is, and make it 8, 11 and 13 N/µm less.

    Parameters
    ----------
    specimen
        Geometry of the specimen.
    body
        Its mesh.
    pad
        Vertices of the pad in the interface's order.
    material
        Its material.
    order
        Order of the elements, 1 or 2.
    further
        Vertices that are kept in addition to pad and ring.
    """
    elastic = ElasticBody(body, material, order)
    ring = specimen.ring(body)
    constraints = Constraints(len(elastic.nodes))
    if order == 2:
        edges = np.stack([ring, np.roll(ring, -1)], axis=1)
        middle = elastic.nodes[edges].mean(axis=1)
        constraints.average(cKDTree(elastic.nodes).query(middle)[1].astype(np.int64), edges)
    t = constraints.transformation()
    stiffness, mass = ((t.T @ matrix @ t).tocsr() for matrix in (elastic.stiffness, elastic.mass))
    trace = LinearTrace.of(elastic, {CONTACT: pad})
    if trace is None:
        kept = constraints.places(np.concatenate([pad, ring, further]))
    else:
        axes, every = np.tile(np.eye(3), (len(pad), 1, 1)), np.arange(3 * len(pad))
        free, massless = t.shape[1], sp.csr_matrix((len(every),) * 2)
        stiffness = trace.springs(elastic, axes, every).tied(stiffness, t)
        mass = sp.block_diag([mass, massless], format="csr")
        t = sp.hstack([t, sp.csr_matrix((elastic.size, len(every)))], format="csr")
        kept = np.concatenate([free + every, constraints.places(np.concatenate([ring, further]))])
    return SpecimenMatrices(stiffness, mass, t, kept)


def reduced_specimens(
    specimen: Specimen,
    mesh: StructureMesh,
    materials: tuple[Material, Material],
    order: int = 2,
    modes: int = MODES,
    target_distance: float | None = None,
    done: Callable[[], None] = lambda: None,
) -> tuple[ReducedModel, ReducedModel]:
    """Return the reduced models of both specimens on pad and ring, body 1 first.

    The kept points are named ``pad 1``, ``pad 2``, ... in the interface's order, and ``ring 1``,
    ... by angle from the X axis.

    Parameters
    ----------
    specimen
        Geometry of the specimens.
    mesh
        Their mesh.
    materials
        Materials of body 1 and body 2.
    order
        Order of the elements, 1 or 2.
    modes
        Number of fixed-interface modes of each.
    target_distance
        Distance from the contact plane [mm] of ``target 1``, at which a laser looks along X: the
        vertex closest to the point at X = R on the cylinder's side. By default it is not kept.
    done
        Called after each of ``STEPS`` steps if there are modes.
    """
    (face,) = mesh.interfaces
    models = []
    for body, pad, material in zip(
        mesh.bodies, (face.nodes_1, face.nodes_2), materials, strict=True
    ):
        target = NONE if target_distance is None else specimen.target(body, target_distance)
        full = specimen_matrices(specimen, body, pad, material, order, target)
        done()
        mass = full.mass if modes > 0 else None
        model = reduce_body(full.stiffness, mass, full.kept, modes, done=done)
        ring = specimen.ring(body)
        places = body.mesh.p.T[np.concatenate([pad, ring, target])]
        names = tuple(
            f"{kind} {number} {axis}"
            for kind, points in ((PAD, pad), (RING, ring), (TARGET, target))
            for number in range(1, len(points) + 1)
            for axis in "xyz"
        )
        models.append(replace(model, names=names, places=np.repeat(places, 3, axis=0)))
    return models[0], models[1]


def pad_stiffness(model: ReducedModel, specimen: Specimen) -> Array:
    """Return the stiffness ``(3 n, 3 n)`` [N/mm] of the pad's nodes with the ring held.

    No other displacements are kept.
    """
    count = len(model.kept) - 3 * specimen.ring_nodes
    return model.static_stiffness[:count, :count]
