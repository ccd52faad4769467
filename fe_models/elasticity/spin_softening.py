"""Spin softening: the centrifugal force grows with the displacement away from the rotor axis.

Material at X + u has the centrifugal force Ω² M (X + u), with M the mass matrix of the
displacements across the axis. The part Ω² M u acts as a negative stiffness; the part Ω² M X is an
ordinary load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.elasticity.body import ROTOR, ElasticBody
from sa_solver.types import Array


@dataclass(frozen=True)
class CarriedMass:
    """Rigid mass [t] that moves with a named boundary.

    Its centre is at ``centre`` ``(3,)`` [mm]. In the plane it is a mass per length [t/mm].
    """

    boundary: str
    mass: float
    centre: Array


def spin_softening(
    elastic: ElasticBody,
    speed: float,
    carried: Sequence[CarriedMass] = (),
    axis: Array = ROTOR,
) -> sp.csr_matrix:
    """Return Ω² M ``(size, size)`` [N/mm] of a body and the masses that it carries.

    Parameters
    ----------
    elastic
        The elastic body.
    speed
        Speed of rotation [rad/s].
    carried
        Masses that it carries.
    axis
        Unit vector ``(3,)`` of the axis of rotation.
    """
    axes = elastic.body.axes
    across = sp.csr_matrix((np.eye(3) - np.outer(axis, axis))[np.ix_(axes, axes)])
    mass = elastic.mass @ sp.kron(sp.identity(elastic.size // elastic.dimension), across)
    for body in carried:
        motion = carried_motion(elastic, body)
        mass = mass + body.mass * (motion.T @ across @ motion)
    return (speed**2 * mass).tocsr()


def carried_motion(elastic: ElasticBody, carried: CarriedMass) -> sp.csr_matrix:
    """Return the matrix ``(d, size)`` from a body's displacements to that of a carried mass.

    The mass follows the mean translation and, by least squares, the rotation of its boundary.
    Rotations are small.
    """
    nodes, weights = elastic.boundary_weights(carried.boundary)
    shares = weights / weights.sum()
    middle = shares @ elastic.nodes[nodes]
    arms = _cross(elastic.nodes[nodes] - middle)
    inertia = np.einsum("n,nba,nbc->ac", shares, arms, arms)
    # The points of a line in the plane do not determine rotations out of it.
    rotation = np.linalg.pinv(inertia, hermitian=True) @ (shares[:, None, None] * arms)
    motion = shares[:, None, None] * np.eye(3) - _cross(carried.centre - middle) @ rotation
    axes = list(elastic.body.axes)
    blocks = motion[:, axes][:, :, axes]
    columns = elastic.dimension * nodes[:, None, None] + np.arange(elastic.dimension)
    rows = np.arange(elastic.dimension)[:, None]
    places = tuple(np.broadcast_to(part, blocks.shape).ravel() for part in (rows, columns))
    return sp.csr_matrix((blocks.ravel(), places), shape=(elastic.dimension, elastic.size))


def _cross(arms: Array) -> Array:
    """Return matrices ``(..., 3, 3)`` of the vector product r ×."""
    return np.asarray(np.cross(arms[..., None, :], np.eye(3)).swapaxes(-1, -2))
