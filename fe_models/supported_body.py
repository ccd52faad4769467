"""A supported, loaded body, condensed onto its interface nodes: S u = r + f."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_models.constraints import Constraints
from fe_models.elasticity import ElasticBody
from fe_models.linear_solver import factorise, schur_complement
from fe_models.mesh import Body, Indices, Interface
from sa_solver.types import Array

# A rigid motion that supports change by less than this share of itself is free.
FREE_MOTION = 1e-9


class SupportedBody:
    """A supported body whose interface displacements are in the interface frames.

    ``nodes`` ``(n,)`` are its interface vertices and ``frames`` ``(n, d, d)`` the axes at each, d
    the dimension; ``loads`` ``(d all, cases)`` its load cases, and ``imposed`` ``(d all, cases)``
    displacements that each imposes on nodes that ``constraints`` hold. Raises ValueError if an
    interface node is constrained.
    """

    def __init__(
        self,
        elastic: ElasticBody,
        constraints: Constraints,
        nodes: Indices,
        frames: Array,
        loads: Array,
        imposed: Array | None = None,
    ) -> None:
        self.elastic = elastic
        self._loads = loads
        self._imposed = imposed
        self._constraints = constraints
        transformation = constraints.transformation()
        self._interface = _free_columns(transformation, nodes, elastic.dimension)
        rotation = _rotation(transformation.shape[1], self._interface, frames)
        self._transformation = (transformation @ rotation).tocsr()

    def condense(self) -> tuple[Array, Array]:
        """Stiffness ``(d n, d n)`` and loads ``(d n, cases)`` on the interface displacements."""
        stiffness, loads = self._reduced()
        inner = self._inner(stiffness)
        solve = factorise(stiffness[inner][:, inner].tocsr())
        condensed = schur_complement(stiffness, self._interface, inner, solve)
        coupling = stiffness[self._interface][:, inner]
        return condensed, loads[self._interface] - coupling @ solve(loads[inner])

    def recover(self, interface_displacement: Array, amplitudes: Array) -> Array:
        """All displacements ``(d all,)`` for given interface displacements ``(d n, )``."""
        stiffness, loads = self._reduced()
        inner = self._inner(stiffness)
        rhs = loads[inner] @ amplitudes
        rhs -= stiffness[inner][:, self._interface] @ interface_displacement
        displacement = np.empty(stiffness.shape[0])
        displacement[self._interface] = interface_displacement
        displacement[inner] = factorise(stiffness[inner][:, inner].tocsr())(rhs)
        return self._all(displacement, amplitudes)

    def respond(self, interface_forces: Array, amplitudes: Array) -> tuple[Array, Array]:
        """All displacements and the interface's, of a held body under interface forces."""
        stiffness, loads = self._reduced()
        rhs = loads @ amplitudes
        rhs[self._interface] += interface_forces
        displacement = factorise(stiffness)(rhs)
        return self._all(displacement, amplitudes), displacement[self._interface]

    def load_resultants(self, amplitudes: Array, about: Array) -> Array:
        """Force and moment ``(2, 3)`` of the applied loads about a point."""
        forces = np.zeros((len(self.elastic.nodes), 3))
        forces[:, self.elastic.body.axes] = self._nodal(self._loads @ amplitudes)
        arms = self.elastic.nodes - about
        return np.array([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])

    def free_motions(self, about: Array, size: float) -> Array:
        """Small rigid motions that the supports leave, ``(k, 6)``, orthonormal.

        Columns: displacement of the point ``about`` [mm] and rotation times ``size`` [mm], along
        the global axes.
        """
        motions = _rigid_motions((self.elastic.nodes - about) / size, self.elastic.body)
        held = motions - self._constraints.transformation() @ motions[self._constraints.free]
        gram = motions.T @ motions
        # Motions along the plane of a plane body are the only ones it knows.
        known = np.flatnonzero(np.diag(gram) > 0.0)
        shares, vectors = np.linalg.eigh((held.T @ held)[np.ix_(known, known)])
        free = np.zeros((int(np.sum(shares <= FREE_MOTION * gram.max())), 6))
        free[:, known] = vectors[:, : len(free)].T
        return free

    def _reduced(self) -> tuple[sp.csr_matrix, Array]:
        t, loads = self._transformation, self._loads
        if self._imposed is not None:
            loads = loads - self.elastic.stiffness @ self._imposed
        return (t.T @ self.elastic.stiffness @ t).tocsr(), t.T @ loads

    def _all(self, free: Array, amplitudes: Array) -> Array:
        displacement = self._transformation @ free
        return displacement if self._imposed is None else displacement + self._imposed @ amplitudes

    def _nodal(self, values: Array) -> Array:
        return values.reshape(-1, self.elastic.dimension)

    def _inner(self, stiffness: sp.csr_matrix) -> Indices:
        return np.setdiff1d(np.arange(stiffness.shape[0]), self._interface)


def interface_frames(interfaces: tuple[Interface, ...], number: int, body: Body) -> Array:
    """Axes at every interface node of body ``number``, ``(n, d, d)``, interface after interface."""
    axes = np.ix_(body.axes, body.axes)
    return np.concatenate(
        [np.tile(i.frame.axes[axes], (len(i.face(number)), 1, 1)) for i in interfaces]
    )


def _rigid_motions(arms: Array, body: Body) -> Array:
    """Displacements ``(d n, 6)`` of unit translations and of unit rotations about the origin."""
    turned = np.cross(np.eye(3)[:, None, :], arms)
    shifted = np.broadcast_to(np.eye(3)[:, None, :], turned.shape)
    motions = np.concatenate([shifted, turned])[..., body.axes]
    return motions.reshape(6, -1).T


def _rotation(size: int, interface: Indices, frames: Array) -> sp.csr_matrix:
    """Free displacements from ones that are in ``frames`` ``(n, d, d)`` at the interface nodes."""
    others = np.setdiff1d(np.arange(size), interface)
    nodal = interface.reshape(frames.shape[:2])
    rows = np.broadcast_to(nodal[:, :, None], frames.shape).ravel()
    columns = np.broadcast_to(nodal[:, None, :], frames.shape).ravel()
    values = np.append(frames.transpose(0, 2, 1).ravel(), np.ones(len(others)))
    places = np.append(rows, others), np.append(columns, others)
    return sp.csr_matrix((values, places), shape=(size, size))


def _free_columns(transformation: sp.csr_matrix, nodes: Indices, dimension: int) -> Indices:
    """Columns of T that are the displacements of the given nodes."""
    rows = transformation[(dimension * nodes[:, None] + np.arange(dimension)).ravel()]
    if not np.all(np.diff(rows.indptr) == 1):
        raise ValueError("a displacement of an interface node is constrained")
    return rows.indices.astype(np.int64)
