"""Frictional contact of two whole bodies in one matrix: the check on the condensed joint.

It shares nothing with ``fe_models`` but the mesh and the closed form of Coulomb's law: stiffness
from scikit-fem's own vector forms, supports and linear traces as equations with multipliers, both
bodies whole, and a semi-smooth Newton method on the augmented equations of Alart and Curnier
1991, Comput. Methods Appl. Mech. Eng. 92, 353, doi:10.1016/0045-7825(91)90022-X, instead of a
splitting:

    K u + Aᵀ ν - Bᵀ f = F,   A u = 0,   f = C(f - r (B u - w0)),

with w = B u the relative displacement of body 2 in the interface frames, f the force on it, w0 =
(last wx, last wy, -gap), and C Coulomb's law: pressure max(0, ·), shear within µ times that.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu
from skfem import Basis, ElementTetP1, ElementTetP2, ElementVector, MeshTet
from skfem.models.elasticity import lame_parameters, linear_elasticity

from sa_solver.types import Array, Material

ELEMENTS = {1: ElementTetP1, 2: ElementTetP2}
# Newton's method ends at rounding: it converges quadratically once the statuses are right.
TOLERANCE = 1e-12
MAX_ITERATIONS = 100
SHORTEST_STEP = 1.0 / 64.0


def whole_stiffness(mesh: MeshTet, material: Material, order: int) -> sp.csr_matrix:
    """Stiffness ``(3 n, 3 n)`` by scikit-fem's linear elasticity, numbered 3 node + component."""
    basis = Basis(mesh, ElementVector(ELEMENTS[order]()))
    form = linear_elasticity(*lame_parameters(material.young, material.poisson))
    return form.assemble(basis).tocsr()


def rows(size: int, dofs: Array, coefficients: Array) -> sp.csr_matrix:
    """Equations Σ c u = 0, one per row of ``dofs`` and ``coefficients``, both ``(m, k)``."""
    count = np.repeat(np.arange(len(dofs)), dofs.shape[1])
    shape = (len(dofs), size)
    return sp.csr_matrix((coefficients.ravel(), (count, dofs.ravel())), shape=shape)


def held(size: int, nodes: Array) -> sp.csr_matrix:
    dofs = (3 * nodes[:, None] + np.arange(3)).reshape(-1, 1)
    return rows(size, dofs, np.ones_like(dofs, dtype=float))


def sliding(size: int, nodes: Array, normals: Array) -> sp.csr_matrix:
    return rows(size, 3 * nodes[:, None] + np.arange(3), normals)


def mean_held(size: int, nodes: Array, weights: Array, direction: Array) -> sp.csr_matrix:
    dofs = (3 * nodes[:, None] + np.arange(3)).reshape(1, -1)
    return rows(size, dofs, (weights[:, None] * direction).reshape(1, -1))


def linear_trace(size: int, middle: Array, parents: Array) -> sp.csr_matrix:
    """Midsides that stay halfway between the vertices beside them."""
    nodes = np.column_stack([middle, parents])
    dofs = (3 * nodes[:, None, :] + np.arange(3)[:, None]).reshape(-1, 3)
    return rows(size, dofs, np.tile([1.0, -0.5, -0.5], (len(dofs), 1)))


@dataclass(frozen=True)
class Part:
    """One body: ``stiffness``, ``equations`` of its supports, ``loads`` ``(3 n, cases)``.

    ``contact`` ``(m,)`` are its contact nodes, in the same order on both bodies.
    """

    stiffness: sp.csr_matrix
    equations: sp.csr_matrix
    loads: Array
    contact: Array


@dataclass(frozen=True)
class WholeState:
    """``force`` on body 2 and relative ``displacement`` ``(3, n)`` in the frames; all ``u``."""

    force: Array
    displacement: Array
    slip: Array
    u: Array
    iterations: int


class Monolith:
    """Body 1 and body 2 with the contact between them; ``frames`` ``(n, 3, 3)``."""

    def __init__(self, part_1: Part, part_2: Part, frames: Array, friction: float) -> None:
        parts = (part_1, part_2)
        self.stiffness = sp.block_diag([p.stiffness for p in parts], format="csr")
        self.equations = sp.block_diag([p.equations for p in parts], format="csr")
        self.loads = np.concatenate([p.loads for p in parts])
        first, second = (self._selection(p, frames) for p in parts)
        self.jump = sp.hstack([-first, second], format="csr")
        self.friction = friction
        # Any positive number will do; one like the contact's own stiffness does best.
        own = abs(self.jump) @ self.stiffness.diagonal()
        self.augmentation = float(np.median(own))

    @staticmethod
    def _selection(part: Part, frames: Array) -> sp.csr_matrix:
        blocks = sp.block_diag(list(frames), format="csr")
        dofs = (3 * part.contact[:, None] + np.arange(3)).reshape(-1, 1)
        return blocks @ rows(part.stiffness.shape[0], dofs, np.ones(dofs.shape))

    def march(self, amplitudes: Array, gap: Array) -> Iterator[WholeState]:
        """States along a load path ``(increments, cases)`` from the unslipped state."""
        count = 3 * len(gap)
        u, multipliers = np.zeros(len(self.loads)), np.zeros(self.equations.shape[0])
        force = np.zeros(count)
        previous = np.zeros((3, len(gap)))
        # All nodes start in contact: nothing else holds body 2.
        force[2::3] = 1.0
        for amplitude in amplitudes:
            datum = np.vstack([previous[:2], -gap]).T.ravel()
            start = np.concatenate([u, multipliers, force])
            solution, iterations = self._newton(self.loads @ amplitude, datum, start)
            u, multipliers, force = self._split(solution)
            displacement = (self.jump @ u).reshape(-1, 3).T
            slip = displacement[:2] - previous[:2]
            previous = displacement
            yield WholeState(force.reshape(-1, 3).T, displacement, slip, u, iterations)

    def tied(self, amplitude: Array, closed: Array) -> tuple[Array, Array]:
        """Forces ``(3, n)`` on body 2 and u with the ``closed`` nodes bonded, the others free."""
        bond = self.jump[np.repeat(closed, 3)]
        system = sp.bmat(
            [
                [self.stiffness, self.equations.T, -bond.T],
                [self.equations, None, None],
                [-bond, None, None],
            ],
            format="csc",
        )
        right = np.zeros(system.shape[0])
        right[: len(self.loads)] = self.loads @ amplitude
        solution = splu(system).solve(right)
        force = np.zeros((3, len(closed)))
        force[:, closed] = solution[-bond.shape[0] :].reshape(-1, 3).T
        return force, solution[: len(self.loads)]

    def _split(self, unknowns: Array) -> list[Array]:
        size = len(self.loads)
        return np.split(unknowns, [size, size + self.equations.shape[0]])

    def _newton(self, load: Array, datum: Array, start: Array) -> tuple[Array, int]:
        scale = max(float(np.linalg.norm(load)), 1e-3 * float(np.linalg.norm(self.loads)))
        unknowns, residual = start, self._residual(start, load, datum)
        for iteration in range(MAX_ITERATIONS):
            if np.linalg.norm(residual) <= TOLERANCE * scale:
                return unknowns, iteration
            step = splu(self._derivative(unknowns, datum)).solve(-residual)
            unknowns, residual = self._search(unknowns, step, residual, load, datum)
        raise AssertionError("the monolithic Newton method did not converge")

    def _search(
        self, unknowns: Array, step: Array, residual: Array, load: Array, datum: Array
    ) -> tuple[Array, Array]:
        """Halve the step until the residual falls; the shortest one is taken as it is."""
        length, before = 1.0, np.linalg.norm(residual)
        while True:
            trial = unknowns + length * step
            found = self._residual(trial, load, datum)
            if np.linalg.norm(found) < before or length <= SHORTEST_STEP:
                return trial, found
            length *= 0.5

    def _trial(self, unknowns: Array, datum: Array) -> Array:
        u, _, force = self._split(unknowns)
        return (force - self.augmentation * (self.jump @ u - datum)).reshape(-1, 3)

    def _residual(self, unknowns: Array, load: Array, datum: Array) -> Array:
        u, multipliers, force = self._split(unknowns)
        trial = self._trial(unknowns, datum)
        pressure = np.maximum(trial[:, 2], 0.0)
        size = np.linalg.norm(trial[:, :2], axis=1)
        share = np.minimum(1.0, self.friction * pressure / np.where(size > 0.0, size, 1.0))
        law = np.column_stack([share[:, None] * trial[:, :2], pressure])
        balance = self.stiffness @ u + self.equations.T @ multipliers - self.jump.T @ force - load
        # Equations in displacements are multiplied to weigh as much as those in forces.
        supports = self.augmentation * (self.equations @ u)
        return np.concatenate([balance, supports, force - law.ravel()])

    def _derivative(self, unknowns: Array, datum: Array) -> sp.csc_matrix:
        slopes = sp.block_diag([self._slope(t) for t in self._trial(unknowns, datum)])
        law_u = self.augmentation * slopes @ self.jump
        law_force = sp.identity(slopes.shape[0]) - slopes
        weighed = self.augmentation * self.equations
        return sp.bmat(
            [
                [self.stiffness, self.equations.T, -self.jump.T],
                [weighed, None, None],
                [law_u, None, law_force],
            ],
            format="csc",
        )

    def _slope(self, trial: Array) -> Array:
        """Derivative ``(3, 3)`` of Coulomb's law at one node: open, stuck or sliding."""
        slope = np.zeros((3, 3))
        if trial[2] <= 0.0:
            return slope
        slope[2, 2] = 1.0
        size, limit = np.linalg.norm(trial[:2]), self.friction * trial[2]
        if size <= limit:
            return np.eye(3)
        direction = trial[:2] / size
        slope[:2, 2] = self.friction * direction
        slope[:2, :2] = limit / size * (np.eye(2) - np.outer(direction, direction))
        return slope
