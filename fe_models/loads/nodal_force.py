"""Forces on node sets of a user's mesh that are not faces: the nodes share them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fe_models.elasticity.body import ElasticBody
from fe_models.loads.applied_loads import FLAT, Acceleration, BoundaryForce, Pressure, Rotation
from fe_models.meshes.structure_mesh import MeshError
from sa_solver.types import Array, Indices

Forcing = Pressure | BoundaryForce | Rotation | Acceleration
# Relative error of the moment of nodal forces up to which the nodes carry it; it covers rounding.
CARRIED = 1e-6


def forces_of(load: Forcing, elastic: ElasticBody, points: Mapping[str, Indices]) -> Array:
    """Return the nodal forces ``(size,)`` of a load on a boundary or on a node set.

    ``points`` are the vertices of the node sets that are not faces.
    """
    boundaries = elastic.body.mesh.boundaries or {}
    if not isinstance(load, BoundaryForce) or load.boundary in boundaries:
        return load.forces(elastic)
    nodes = points[load.boundary]
    forces = np.zeros((len(elastic.nodes), elastic.dimension))
    forces[nodes] = shared(load, elastic.nodes[nodes])[:, list(elastic.body.axes)]
    return forces.ravel()


def shared(load: BoundaryForce, places: Array) -> Array:
    """Return the forces ``(n, 3)`` [N] by which nodes at ``places`` ``(n, 3)`` share a load.

    The forces are f = F/n + ω x r about the nodes' mean position. The mean motions of the nodes are
    those of a point tied to them by least squares with equal weights (a distributing coupling,
    RBE3). Raises :class:`MeshError` for a moment that they cannot carry, such as one about the line
    they are on.
    """
    middle = places.mean(axis=0)
    arms = places - middle
    arm = np.zeros(3) if load.at is None else load.at - middle
    turning = load.moment + np.cross(arm, load.force)
    second = arms.T @ arms
    turn = np.linalg.pinv(np.trace(second) * np.eye(3) - second, rcond=FLAT) @ turning
    moments = np.cross(turn, arms)
    carried = np.cross(arms, moments).sum(axis=0)
    if np.linalg.norm(carried - turning) > CARRIED * np.linalg.norm(turning):
        raise MeshError(
            f"the {len(places)} nodes of {load.boundary} cannot carry its moment; allowed: "
            "nodes that are not on a line, or a boundary"
        )
    return load.force / len(places) + moments
