"""What loads impose on boundaries of bodies, and what they tie: faces that follow a point.

A point tied to a face moves by q, displacement and rotation, of which some components are given and
the others free. A rigid face moves with it, u = R q at each node. A face that stays free to deform
has it as its mean motion, by least squares over the area: q_k = c_k·u, where c_k are the nodal
forces of a unit force or moment at the point
(:class:`~fe_models.loads.applied_loads.BoundaryForce`), so that force and motion of the point do
the work of the face's.

Given components are met by the displacements u = R q of the face's nodes alone, added to those that
the constraints leave, for which they are zero.
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

# Displacements that differ by this share of themselves are the same: the rest is rounding.
HELD_SHARE = 1e-9

Imposing = Displacement | RemoteDisplacement


def impose(constraints: Constraints, elastic: ElasticBody, load: Imposing) -> Array:
    """Hold what a load imposes, and return the displacements ``(size,)`` that it does so by."""
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
        units = np.eye(6)[~load.free & _known(elastic)]
        means = [BoundaryForce(load.boundary, unit[:3], load.at, unit[3:]) for unit in units]
        if means:
            # Behind the face there is nothing but rounding.
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
    """Make a boundary rigid: it moves about a point in the components that are ``free`` ``(6,)``.

    All are unless said.
    """
    nodes = elastic.boundary_nodes(boundary)
    arms = elastic.nodes[nodes] - at
    size = max(float(np.ptp(arms, axis=0).max()), float(np.abs(arms).max()))
    motions = rigid_motions(arms / size, elastic.body.axes)
    moving = _known(elastic) if free is None else _known(elastic) & free
    constraints.follow(nodes, motions[:, moving])


def check_against_supports(loads: Sequence[object], imposed: Array, allowed: Array) -> None:
    """Raise unless supports leave the ``imposed`` displacements ``(size, loads)`` as they are."""
    for load, displacement, left in zip(loads, imposed.T, allowed.T, strict=True):
        if np.abs(left - displacement).max() > HELD_SHARE * np.abs(displacement).max():
            raise MeshError(
                f"a displacement is imposed on {boundary_of(load)} along what a support holds of "
                "its nodes; hold them across it alone, such as xy for one along z"
            )


def check_against_each_other(elastic: ElasticBody, loads: Sequence[Imposing]) -> None:
    """Raise if displacements of two loads would add up where their boundaries meet.

    Those of one boundary, or of one point tied to it, are meant to.
    """
    for index, one in enumerate(loads):
        for other in loads[:index]:
            if one.boundary == other.boundary and _alike(one, other):
                continue
            nodes = elastic.boundary_nodes(one.boundary)
            if not np.isin(nodes, elastic.boundary_nodes(other.boundary)).any():
                continue
            if not (_leaves(elastic, one, other) and _leaves(elastic, other, one)):
                raise MeshError(
                    f"{other.boundary} and {one.boundary} share nodes, on which the displacements "
                    "imposed on both would add up; impose them on one boundary, or across each "
                    "other, or about one point"
                )


def _alike(one: Imposing, other: Imposing) -> bool:
    """Whether two loads of a boundary impose along it, or about one point in one way."""
    if isinstance(one, Displacement) or isinstance(other, Displacement):
        return isinstance(one, Displacement) and isinstance(other, Displacement)
    return bool(np.array_equal(one.at, other.at)) and one.rigid == other.rigid


def _leaves(elastic: ElasticBody, one: Imposing, other: Imposing) -> bool:
    """Whether what ``one`` holds leaves the displacements that the ``other`` imposes."""
    nothing, alone = (Constraints(len(elastic.nodes), elastic.dimension) for _ in range(2))
    imposed = impose(nothing, elastic, other)
    impose(alone, elastic, one)
    left = alone.transformation() @ alone.values(imposed)
    return bool(np.abs(left - imposed).max() <= HELD_SHARE * np.abs(imposed).max())


def _motions(elastic: ElasticBody, boundary: str, at: Array) -> Array:
    """Displacements ``(n, d, 6)`` of a boundary's nodes in unit motions about a point."""
    nodes = elastic.boundary_nodes(boundary)
    motions = rigid_motions(elastic.nodes[nodes] - at, elastic.body.axes)
    return motions.reshape(len(nodes), elastic.dimension, 6)


def _known(elastic: ElasticBody) -> Mask:
    """Which of the six components of a motion the body has: of the plane three."""
    if elastic.dimension == 3:
        return np.ones(6, bool)
    return np.array([True, False, True, False, True, False])
