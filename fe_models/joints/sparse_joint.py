"""Joint of bodies whose full matrices do not fit into memory, solved as one sparse system.

The friction solver needs the resolvent (H + ρ)⁻¹ of a joint (:mod:`fe_models.joints.joint`). Its
product with v is the relative displacement w of bodies whose faces are connected by springs of
stiffness ρ with ends at v, since w is where the energy ½ wᵀHw + ½ ρ |w - v|² is smallest. With K
the stiffness of all bodies, side by side, and w = B u,

    (H + ρ)⁻¹ = B (K + ρ BᵀB)⁻¹ Bᵀ,

so the springs tie all bodies into one sparse positive definite system, and nothing is condensed.
Loads r displace the faces by B (K + ρ BᵀB)⁻¹ r = -(H + ρ)⁻¹ f0, from which f0 follows.

A product takes longer than with a full matrix: it reads all factors twice. In return memory grows
with the bodies, and hardly with the number of contact nodes.

Which ρ is best follows from the extreme elastic eigenvalues of H, whose geometric mean it is. A
nodal force spread over a wavelength l meets the stiffness E h²/l, with h the distance of the nodes;
it is largest, E h, at wavelengths h and smallest at the length L of a face. So ρ is half the median
stiffness of the contact nodes, times √(h/L). On dovetails of 135 to 735 nodes a flank this was
within 20 % of the geometric mean; twice or half of it takes 5 to 25 % more iterations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, cg

from fe_models.meshes.structure_mesh import Face
from fe_models.solvers.linear_solver import RefinedFactors, SolverError
from fe_models.solvers.pardiso import in_parallel
from fe_models.solvers.symmetry import Mirror, halves
from sa_solver.types import Array, Indices, Mask

# Relative residual of the loads on the joint, and that of each pass in single precision.
LOADS_RESIDUAL, PASS_RESIDUAL = 1e-10, 1e-4
# Iterations of a pass, and passes, beyond which the loads are not found: 20 to 40 in 3 passes.
MOST_ITERATIONS, MOST_PASSES = 500, 10


class SparseBody(NamedTuple):
    """Body that is not condensed: ``stiffness`` ``(n, n)`` and ``loads`` ``(n, cases)``.

    ``interface`` ``(k,)`` are the numbers of its free interface displacements, in their order.
    """

    stiffness: sp.csr_matrix
    loads: Array
    interface: Indices


def relative_displacements(
    projection: sp.csr_matrix | None, held: tuple[Mask, Mask], order: Indices
) -> sp.csr_matrix:
    """Return w ``(d n, k)`` of the free interface displacements of one body after the other.

    Parameters
    ----------
    projection
        Projection of the free displacements of faces 1 to faces 2, None if they match.
    held
        Flags of the displacements of faces 1 and of faces 2 that supports hold; w is zero there.
    order
        Position ``(k,)`` of each of the bodies' displacements among the free ones of faces 1, then
        of faces 2.
    """
    held_1, held_2 = held
    moved = sp.identity(np.sum(~held_1)) if projection is None else projection
    apart = sp.hstack([-moved, sp.identity(np.sum(~held_2))], format="csc")
    onto_all = sp.identity(len(held_2), format="csc")[:, ~held_2]
    return (onto_all @ apart[:, order]).tocsr()


def expected_rho(bodies: Sequence[SparseBody], faces: Sequence[Face]) -> float:
    """Return the ρ at which the friction solver needs few iterations [N/mm]."""
    stiffness = [body.stiffness.diagonal()[body.interface] for body in bodies]
    area = float(np.median(np.concatenate([face.nodal_areas for face in faces])))
    length = max(float(np.ptp(face.coordinates, axis=0).max()) for face in faces)
    spacing = area if faces[0].line else np.sqrt(area)
    return 0.5 * float(np.median(np.concatenate(stiffness)) * np.sqrt(spacing / length))


class _Part(NamedTuple):
    """Whole system, or its symmetric or antisymmetric half, with its relative displacements."""

    relative: sp.csr_matrix
    factors: RefinedFactors


class SparseResolvent:
    """Resolvent of a joint of sparse systems, in the place of a full :class:`JointResolvent`.

    Attributes
    ----------
    rho
        ρ [N/mm].
    loads
        Load cases f0 on the joint ``(d n, cases)`` [N], as those of :class:`JointStiffness`.
    rigid_modes
        Dimension of H's null space.
    """

    def __init__(
        self,
        bodies: Sequence[SparseBody],
        relative: sp.csr_matrix,
        rho: float,
        rigid_modes: int,
        mirror: Mirror | None = None,
    ) -> None:
        """Factorise the joined bodies.

        Parameters
        ----------
        bodies
            The bodies.
        relative
            Relative displacements ``(d n, k)`` of the interface displacements of all bodies, one
            body after the other.
        rho
            ρ [N/mm].
        rigid_modes
            Dimension of H's null space, the number of rigid motions that contact alone prevents.
        mirror
            Mirror of the displacements of one body after the other, which halves the system if it
            leaves all stiffness unchanged.

        Raises
        ------
        SolverError
            If the bodies can move when all faces stick; :class:`FactorMemoryError` if the factors
            do not fit into memory.
        """
        self.rho, self.rigid_modes = rho, rigid_modes
        starts = np.cumsum([0, *(body.stiffness.shape[0] for body in bodies)])
        pairs = zip(starts, bodies, strict=False)
        places = np.concatenate([start + body.interface for start, body in pairs])
        chosen = sp.csr_matrix(
            (np.ones(len(places)), (np.arange(len(places)), places)), (len(places), starts[-1])
        )
        motion = (relative @ chosen).tocsr()
        stiffness = sp.block_diag([body.stiffness for body in bodies], format="csr")
        whole = (stiffness + rho * (motion.T @ motion)).tocsr()
        split = None if mirror is None else halves(whole, mirror)
        systems: Sequence[sp.csr_matrix] = (whole,)
        bases: Sequence[sp.csr_matrix] = (sp.identity(whole.shape[0], format="csr"),)
        if mirror is not None and split is not None:
            systems, bases = split, mirror.bases
        self._parts = [
            _Part((motion @ basis).tocsr(), RefinedFactors(system))
            for system, basis in zip(systems, bases, strict=True)
        ]
        loads = np.concatenate([body.loads for body in bodies])
        moved = (
            part.relative @ part.factors(basis.T @ loads)
            for part, basis in zip(self._parts, bases, strict=True)
        )
        self.loads = -self._unsprung(np.asarray(sum(moved)))

    @property
    def widest(self) -> int:
        """Number of unknowns of the largest matrix in a product with the inverse."""
        return max(part.relative.shape[1] for part in self._parts)

    def product(self, vectors: Array) -> Array:
        """Return (H + ρ)⁻¹ times ``vectors`` ``(d n,)`` or ``(d n, m)``."""
        return self._sum(lambda part: part.factors(part.relative.T @ vectors))

    def rounded_product(self, vectors: Array) -> Array:
        """Return the product in single precision, in a third of the time."""
        return self._sum(lambda part: part.factors.rounded(part.relative.T @ vectors))

    def _sum(self, displacement: Callable[[_Part], Array]) -> Array:
        """Return the sum of the relative displacements of all parts, solved in parallel."""
        found = in_parallel([partial(displacement, part) for part in self._parts])
        pairs = zip(self._parts, found, strict=True)
        return np.asarray(sum(part.relative @ moved for part, moved in pairs))

    def _unsprung(self, displacement: Array) -> Array:
        """Return (H + ρ) times displacements ``(d n, cases)``, by conjugate gradients.

        All columns are solved as one system, in passes of single precision.
        """
        shape = displacement.shape
        size = displacement.size

        def rounded(vector: Array) -> Array:
            return self.rounded_product(vector.reshape(shape)).ravel()

        inverse = LinearOperator((size, size), matvec=rounded, dtype=np.float64)
        forces, left = np.zeros(shape), displacement
        for _ in range(MOST_PASSES):
            if np.linalg.norm(left) <= LOADS_RESIDUAL * np.linalg.norm(displacement):
                return forces
            found, _ = cg(inverse, left.ravel(), rtol=PASS_RESIDUAL, maxiter=MOST_ITERATIONS)
            forces = forces + found.reshape(shape)
            left = displacement - self.product(forces)
        raise SolverError(
            "the loads on the joint were not found: the bodies are not held when all faces stick, "
            "or the mesh has a degenerate element"
        )
