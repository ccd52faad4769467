"""A supported, loaded body, condensed onto its interface nodes: S u = r + f."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.constraints import Constraints
from fe_models.elasticity import ElasticBody
from fe_models.linear_solver import factorise, schur_complement
from fe_models.mesh import Interface
from sa_solver.types import Array


class SupportedBody:
    """A supported body whose interface displacements are in the interface frames.

    ``nodes`` ``(n,)`` are its interface vertices and ``frames`` ``(n, 3, 3)`` the axes at each;
    ``loads`` ``(3 all, cases)`` its load cases.
    """

    def __init__(
        self,
        elastic: ElasticBody,
        constraints: Constraints,
        nodes: NDArray[np.int64],
        frames: Array,
        loads: Array,
    ) -> None:
        self.elastic = elastic
        self._loads = loads
        transformation = constraints.transformation()
        self._interface = _free_columns(transformation, nodes)
        rotation = _rotation(transformation.shape[1], self._interface, frames)
        self._transformation = (transformation @ rotation).tocsr()

    def condense(self) -> tuple[Array, Array]:
        """Stiffness ``(3 n, 3 n)`` and loads ``(3 n, cases)`` on the interface displacements."""
        stiffness, loads = self._reduced()
        inner = self._inner(stiffness)
        solve = factorise(stiffness[inner][:, inner].tocsr())
        condensed = schur_complement(stiffness, self._interface, inner, solve)
        coupling = stiffness[self._interface][:, inner]
        return condensed, loads[self._interface] - coupling @ solve(loads[inner])

    def recover(self, interface_displacement: Array, amplitudes: Array) -> Array:
        """All displacements ``(3 all,)`` for given interface displacements ``(3 n, )``."""
        stiffness, loads = self._reduced()
        inner = self._inner(stiffness)
        rhs = loads[inner] @ amplitudes
        rhs -= stiffness[inner][:, self._interface] @ interface_displacement
        displacement = np.empty(stiffness.shape[0])
        displacement[self._interface] = interface_displacement
        displacement[inner] = factorise(stiffness[inner][:, inner].tocsr())(rhs)
        return self._transformation @ displacement

    def respond(self, interface_forces: Array, amplitudes: Array) -> tuple[Array, Array]:
        """All displacements and the interface's, of a held body under interface forces."""
        stiffness, loads = self._reduced()
        rhs = loads @ amplitudes
        rhs[self._interface] += interface_forces
        displacement = factorise(stiffness)(rhs)
        return self._transformation @ displacement, displacement[self._interface]

    def load_resultants(self, amplitudes: Array, about: Array) -> Array:
        """Force and moment ``(2, 3)`` of the applied loads about a point."""
        forces = (self._loads @ amplitudes).reshape(-1, 3)
        arms = self.elastic.nodes - about
        return np.array([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])

    def _reduced(self) -> tuple[sp.csr_matrix, Array]:
        t = self._transformation
        return (t.T @ self.elastic.stiffness @ t).tocsr(), t.T @ self._loads

    def _inner(self, stiffness: sp.csr_matrix) -> NDArray[np.int64]:
        return np.setdiff1d(np.arange(stiffness.shape[0]), self._interface)


def interface_frames(interfaces: tuple[Interface, ...]) -> Array:
    """Axes at every interface node, ``(n, 3, 3)``, interface after interface."""
    return np.concatenate([np.tile(i.frame.axes, (len(i), 1, 1)) for i in interfaces])


def _rotation(size: int, interface: NDArray[np.int64], frames: Array) -> sp.csr_matrix:
    """Free displacements from ones that are in ``frames`` ``(n, 3, 3)`` at the interface nodes."""
    others = np.setdiff1d(np.arange(size), interface)
    nodal = interface.reshape(-1, 3)
    rows = np.broadcast_to(nodal[:, :, None], frames.shape).ravel()
    columns = np.broadcast_to(nodal[:, None, :], frames.shape).ravel()
    values = np.append(frames.transpose(0, 2, 1).ravel(), np.ones(len(others)))
    places = np.append(rows, others), np.append(columns, others)
    return sp.csr_matrix((values, places), shape=(size, size))


def _free_columns(transformation: sp.csr_matrix, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Columns of T that are the displacements of the given nodes."""
    rows = transformation[(3 * nodes[:, None] + np.arange(3)).ravel()]
    if not np.all(np.diff(rows.indptr) == 1):
        raise ValueError("a displacement of an interface node is constrained")
    return rows.indices.astype(np.int64)
