"""Static condensation of two bodies onto the interfaces between them.

Each body is condensed onto its interface nodes, S u = r + f, with f the contact forces on it. Two
bodies that meet node to node then form one joint: with w = u_2 - u_1 the relative displacement and
f the contact forces on body 2,

    f = H w + f0,   H = S_2 - S_2 (S_1 + S_2)⁻¹ S_2,   f0 = S_2 (S_1 + S_2)⁻¹ (r_1 + r_2) - r_2.

H is symmetric; the rigid motions of a body that is held by contact alone are its null space.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

from fe_models.constraints import Constraints
from fe_models.elasticity import ElasticBody
from fe_models.linear_solver import factorise, schur_complement
from fe_models.mesh import Interface
from sa_solver.types import Array

# Eigenvalues below this share of the largest are rigid motions; elastic ones start near 1e-3.
RIGID_LIMIT = 1e-7
# Share of the largest eigenvalue that makes the singular joint invertible for the Lanczos search.
SPECTRUM_SHIFT = 1e-5


@dataclass(frozen=True)
class JointStiffness:
    """The joint ``f = H w + Σ_c amplitude_c loads_c`` in the interface frames.

    ``stiffness`` ``(3 n, 3 n)`` [N/mm] and ``loads`` ``(3 n, cases)`` [N], numbered ``3 node +
    component`` over all interfaces; ``rigid_modes`` counts H's null space; ``smallest`` and
    ``largest`` are its extreme elastic eigenvalues.
    """

    stiffness: Array
    loads: Array
    rigid_modes: int
    smallest: float
    largest: float

    def resolvent(self) -> JointResolvent:
        """(H + ρ)⁻¹ with ρ the geometric mean of the extreme elastic eigenvalues."""
        rho = float(np.sqrt(self.smallest * self.largest))
        shifted = self.stiffness.copy()
        shifted[np.diag_indices_from(shifted)] += rho
        factor = sl.cholesky(shifted, lower=True, overwrite_a=True, check_finite=False)
        inverse, _ = sl.lapack.dpotri(factor, lower=1, overwrite_c=1)
        inverse = np.tril(inverse) + np.tril(inverse, -1).T
        return JointResolvent(inverse, rho, self.loads, self.rigid_modes)


@dataclass(frozen=True)
class JointResolvent:
    """What structural friction needs of a joint.

    ``inverse`` ``(3 n, 3 n)`` is (H + ρ)⁻¹ [mm/N] with ``rho`` ρ [N/mm]; ``loads`` and
    ``rigid_modes`` are the joint's.
    """

    inverse: Array
    rho: float
    loads: Array
    rigid_modes: int


class ConstrainedBody:
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


def join(condensed_1: tuple[Array, Array], condensed_2: tuple[Array, Array]) -> JointStiffness:
    """Join two condensed bodies; body 1 must be held, body 2 may float."""
    (stiffness_1, loads_1), (stiffness_2, loads_2) = condensed_1, condensed_2
    factor = sl.cholesky(stiffness_1 + stiffness_2, lower=True, overwrite_a=True)
    # S_2 (S_1 + S_2)⁻¹ S_2 = XᵀX with X = L⁻¹ S_2: half the work of solving with both factors.
    half = sl.solve_triangular(factor, stiffness_2, lower=True)
    stiffness = stiffness_2 - half.T @ half
    loads = half.T @ sl.solve_triangular(factor, loads_1 + loads_2, lower=True) - loads_2
    rigid_modes, smallest, largest = _spectrum(stiffness)
    return JointStiffness(stiffness, loads, rigid_modes, smallest, largest)


def _spectrum(stiffness: Array) -> tuple[int, float, float]:
    """Number of zero eigenvalues, smallest other one and largest one, by Lanczos iterations."""
    start = np.random.default_rng(0).standard_normal(len(stiffness))
    (largest,) = eigsh(stiffness, 1, v0=start, return_eigenvectors=False)
    shift = SPECTRUM_SHIFT * largest
    shifted = stiffness.copy()
    shifted[np.diag_indices_from(shifted)] += shift
    factors = sl.cho_factor(shifted, lower=True, overwrite_a=True)
    inverse = LinearOperator(
        stiffness.shape, matvec=lambda v: sl.cho_solve(factors, v), dtype=np.float64
    )
    # A free body has six rigid motions: the seventh eigenvalue is elastic.
    lowest = 1.0 / eigsh(inverse, 7, v0=start, return_eigenvectors=False) - shift
    elastic = lowest[lowest > RIGID_LIMIT * largest]
    return len(lowest) - len(elastic), float(elastic.min()), float(largest)


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
