"""Displacements that loads impose on boundaries of bodies, and faces that are tied to a point.

A point tied to a face moves by q, displacement and rotation, of which some components are given and
the others free. A rigid face moves with the point, u = R q at each node. For a face that stays free
to deform, q is the mean motion by least squares over the area: q_k = c_k·u, where c_k are the nodal
forces of a unit force or moment at the point
(:class:`~fe_models.loads.applied_loads.BoundaryForce`). Forces and motions of the point then do the
same work as those of the face.

Given components are imposed by displacements u = R q of the face's nodes alone. They are added to
the displacements that the constraints leave, in which these components are zero.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fe_models.elasticity.body import ElasticBody
from fe_models.loads.applied_loads import (
    BoundaryForce,
    Displacement,
    RemoteDisplacement,
    boundary_of,
)
from fe_models.loads.constraints import Constraints
from fe_models.loads.rigid_motions import rigid_motions
from fe_models.meshes.structure_mesh import MeshError
from sa_solver.types import Array, Mask

# Relative difference up to which displacements count as the same; it covers rounding errors.
HELD_SHARE = 1e-9

Imposing = Displacement | RemoteDisplacement


def impose(constraints: Constraints, elastic: ElasticBody, load: Imposing) -> Array:
    """Constrain the displacements that a load imposes, and return their values ``(size,)``."""
    nodes = elastic.boundary_nodes(load.boundary)
    imposed = np.zeros((len(elastic.nodes), elastic.dimension))
    if isinstance(load, Displacement):
        displacement = load.displacement[list(elastic.body.axes)]
        direction = displacement / np.linalg.norm(displacement)
        constraints.slide(nodes, np.tile(direction, (len(nodes), 1)))
        imposed[nodes] = displacement
        return imposed.ravel()
    if load.rigid:
        tie_rigid(constraints, elastic, load.boundary, load.at, load.free)
    else:
        units = np.eye(6)[~load.free & _possible_motions(elastic)]
        means = [BoundaryForce(load.boundary, unit[:3], load.at, unit[3:]) for unit in units]
        if means:
            # Forces at nodes behind the face are rounding errors and are left out.
            forces = np.zeros((len(means), *imposed.shape))
            for row, mean in zip(forces, means, strict=True):
                row[nodes] = mean.forces(elastic).reshape(imposed.shape)[nodes]
            constraints.no_work(forces.reshape(len(means), -1), elastic.nodes)
    imposed[nodes] = _motions(elastic, load.boundary, load.at) @ load.motion
    return imposed.ravel()


def tie_rigid(
    constraints: Constraints,
    elastic: ElasticBody,
    boundary: str,
    at: Array,
    free: Mask | None = None,
) -> None:
    """Make a boundary rigid, so that it moves about a point in the ``free`` components ``(6,)``.

    By default all components are free.
    """
    nodes = elastic.boundary_nodes(boundary)
    arms = elastic.nodes[nodes] - at
    size = max(float(np.ptp(arms, axis=0).max()), float(np.abs(arms).max()))
    motions = rigid_motions(arms / size, elastic.body.axes)
    moving = _possible_motions(elastic) if free is None else _possible_motions(elastic) & free
    constraints.follow(nodes, motions[:, moving])


def check_against_supports(loads: Sequence[object], imposed: Array, allowed: Array) -> None:
    """Raise :class:`MeshError` unless supports allow the ``imposed`` displacements.

    ``imposed`` and ``allowed`` are ``(size, loads)``: the displacements, and those that supports
    leave of them.
    """
    for load, displacement, left in zip(loads, imposed.T, allowed.T, strict=True):
        if np.abs(left - displacement).max() > HELD_SHARE * np.abs(displacement).max():
            raise MeshError(
                f"a displacement is imposed on {boundary_of(load)} along a direction in which a "
                "support holds its nodes; hold them only across it, such as xy for a displacement "
                "along z"
            )


def check_against_each_other(elastic: ElasticBody, loads: Sequence[Imposing]) -> None:
    """Raise :class:`MeshError` if displacements of two loads would add up at shared nodes.

    Loads on the same boundary, or on the same point tied to it, are meant to add up.
    """
    for index, one in enumerate(loads):
        for other in loads[:index]:
            if one.boundary == other.boundary and _same_motion(one, other):
                continue
            nodes = elastic.boundary_nodes(one.boundary)
            if not np.isin(nodes, elastic.boundary_nodes(other.boundary)).any():
                continue
            if not (_allows(elastic, one, other) and _allows(elastic, other, one)):
                raise MeshError(
                    f"{other.boundary} and {one.boundary} share nodes, at which the displacements "
                    "imposed on both would add up; impose them on one boundary, in directions "
                    "across each other, or about one point"
                )


def _same_motion(one: Imposing, other: Imposing) -> bool:
    """Return whether two loads of a boundary impose displacements along it or about one point."""
    if isinstance(one, Displacement) or isinstance(other, Displacement):
        return isinstance(one, Displacement) and isinstance(other, Displacement)
    return bool(np.array_equal(one.at, other.at)) and one.rigid == other.rigid


def _allows(elastic: ElasticBody, one: Imposing, other: Imposing) -> bool:
    """Return whether the constraints of ``one`` allow the displacements that ``other`` imposes."""
    nothing, alone = (Constraints(len(elastic.nodes), elastic.dimension) for _ in range(2))
    imposed = impose(nothing, elastic, other)
    impose(alone, elastic, one)
    left = alone.transformation() @ alone.values(imposed)
    return bool(np.abs(left - imposed).max() <= HELD_SHARE * np.abs(imposed).max())


def _motions(elastic: ElasticBody, boundary: str, at: Array) -> Array:
    """Return displacements ``(n, d, 6)`` of a boundary's nodes in unit motions about a point."""
    nodes = elastic.boundary_nodes(boundary)
    motions = rigid_motions(elastic.nodes[nodes] - at, elastic.body.axes)
    return motions.reshape(len(nodes), elastic.dimension, 6)


def _possible_motions(elastic: ElasticBody) -> Mask:
    """Return flags of the six components of a motion that the body has; in the plane three."""
    if elastic.dimension == 3:
        return np.ones(6, bool)
    return np.array([True, False, True, False, True, False])
