"""Joint of condensed bodies.

Each body is condensed onto its interface nodes, S u = r + f, with f the contact forces on it. For
all bodies together S is block-diagonal; u_1 are the displacements of bodies 1 of the interfaces at
their faces, u_2 those of bodies 2. With N the projection of u_1 onto the nodes of faces 2,
w = u_2 - N u_1 is the relative displacement, and forces f on bodies 2 are -Nᵀf on bodies 1. The
bodies form one joint

    f = H w + f0,   H = S_22 - K C⁻¹ Kᵀ,   f0 = K C⁻¹ (r_1 + Nᵀr_2) - r_2,
    K = S_21 + S_22 N,   C = S_11 + S_12 N + NᵀS_21 + NᵀS_22 N,

where C is the stiffness of all bodies with closed faces that stick, and S_21 that of bodies which
are body 1 of one interface and body 2 of another. N is the identity where faces meet node to node.
H is symmetric; the rigid motions of bodies that are held by contact alone are its null space.

A plane of symmetry through a contact holds displacements u_1 and u_2 of its nodes at zero. They are
left out of S and N, and so is their w: the supports carry the forces along them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, eigsh

from fe_models.joints.condensation import Condensed
from fe_models.solvers.blas_threads import one_thread
from fe_models.solvers.symmetry import Matrix, Mirror, SplitMatrix, symmetric_product
from sa_solver import checks
from sa_solver.transforms.threads import run_parallel
from sa_solver.types import Array, Indices

T = TypeVar("T")

# Eigenvalues below this share of the largest are rigid motions; elastic ones start near 1e-3 of it.
RIGID_LIMIT = 1e-7
# Tolerated residual of eigenvectors over their eigenvalue: eigenvalues are exact to its square.
RITZ_RESIDUAL = 1e-9
# Share of the largest eigenvalue that makes the singular joint invertible for the Lanczos search.
SPECTRUM_SHIFT = 1e-5


@dataclass(frozen=True)
class JointStiffness:
    """Stiffness and loads of a joint ``f = H w + Σ_c amplitude_c loads_c`` in the interface frames.

    A joint with a mirror symmetry, and without held displacements, is split into its symmetric and
    antisymmetric parts.

    Attributes
    ----------
    stiffness
        H ``(d n, d n)`` [N/mm], numbered ``d node + component`` over all interfaces in d
        dimensions, per length in the plane.
    loads
        Load cases ``(d n, cases)`` [N].
    rigid_modes
        Dimension of H's null space.
    smallest, largest
        Extreme elastic eigenvalues of H [N/mm].
    held
        Flags ``(d n,)`` of displacements that stay zero; the stiffness and the loads have no rows
        and columns for these.

    Examples
    --------
    A node is on springs of 100 N/mm. With the splitting's ρ, the geometric mean of the extreme
    eigenvalues, its resolvent is 1 / (100 + 100).

    >>> import numpy as np
    >>> from fe_models import JointStiffness
    >>> springs = JointStiffness(100.0 * np.eye(3), np.eye(3)[:, 2:], 0, 100.0, 100.0)
    >>> print(springs.resolvent().rho, np.diag(springs.resolvent().inverse))
    100.0 [0.005 0.005 0.005]
    """

    stiffness: Array | SplitMatrix
    loads: Array
    rigid_modes: int
    smallest: float
    largest: float
    held: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        loads = checks.array("loads", self.loads, (None, None), finite=False, order="K")
        checks.settle(self, loads=loads)
        if not isinstance(self.stiffness, SplitMatrix):
            shape = len(loads), len(loads)
            stiffness = checks.array("stiffnesses", self.stiffness, shape, finite=False, order="K")
            checks.settle(self, stiffness=stiffness)

    def resolvent(self) -> JointResolvent:
        """Return (H + ρ)⁻¹ with ρ the geometric mean of the extreme elastic eigenvalues.

        It is zero for displacements that are held, as if H were infinite there.
        """
        rho = float(np.sqrt(self.smallest * self.largest))
        if isinstance(self.stiffness, SplitMatrix):
            jobs = [partial(_shifted_inverse, block, rho) for block in self.stiffness.blocks]
            symmetric, antisymmetric = _in_single_threads(jobs)
            split = SplitMatrix(self.stiffness.mirror, (symmetric, antisymmetric))
            return JointResolvent(split, rho, self.loads, self.rigid_modes)
        inverse = _shifted_inverse(self.stiffness, rho)
        loads = self.loads
        if self.held is not None and self.held.any():
            free = np.flatnonzero(~self.held)
            whole = np.zeros((len(self.held),) * 2)
            whole[np.ix_(free, free)] = inverse
            inverse, loads = whole, np.zeros((len(whole), loads.shape[1]))
            loads[free] = self.loads
        return JointResolvent(inverse, rho, loads, self.rigid_modes)


class Resolvent(Protocol):
    """Protocol of (H + ρ)⁻¹ of a joint, with all that the friction solver needs of the joint.

    ``rho`` is ρ [N/mm], ``loads`` ``(d n, cases)`` and ``rigid_modes`` are those of
    :class:`JointStiffness`, and ``widest`` is the number of unknowns of the largest matrix in a
    product.
    """

    @property
    def rho(self) -> float: ...

    @property
    def loads(self) -> Array: ...

    @property
    def rigid_modes(self) -> int: ...

    @property
    def widest(self) -> int: ...

    def product(self, vectors: Array) -> Array:
        """Return (H + ρ)⁻¹ times ``vectors`` ``(d n,)`` or ``(d n, m)``."""
        ...

    def rounded_product(self, vector: Array) -> Array:
        """Return the product with one vector ``(d n,)`` in single precision, which is faster."""
        ...


@dataclass(frozen=True)
class JointResolvent:
    """Resolvent of a joint as a full matrix.

    ``inverse`` ``(d n, d n)`` is (H + ρ)⁻¹ [mm/N] with ``rho`` ρ [N/mm]; ``loads`` and
    ``rigid_modes`` are those of the joint.
    """

    inverse: Array | SplitMatrix
    rho: float
    loads: Array
    rigid_modes: int

    def product(self, vectors: Array) -> Array:
        """Return (H + ρ)⁻¹ times ``vectors`` ``(d n,)`` or ``(d n, m)``."""
        return _product(self.inverse, vectors)

    def rounded_product(self, vector: Array) -> Array:
        """Return the product with one vector ``(d n,)`` in single precision, in half the time."""
        return _product(self._rounded, vector)

    @cached_property
    def _rounded(self) -> Matrix | SplitMatrix:
        if isinstance(self.inverse, SplitMatrix):
            return self.inverse.in_single_precision()
        return self.inverse.astype(np.float32)

    @property
    def widest(self) -> int:
        """Number of unknowns of the largest matrix in a product with the inverse."""
        if isinstance(self.inverse, SplitMatrix):
            return max(map(len, self.inverse.blocks))
        return len(self.inverse)

    def normal_stiffness(self, nodes: int) -> Array:
        """Return H between the normal displacements of the ``nodes`` ``(nodes, nodes)`` [N/mm].

        ``nodes`` is their number.
        """
        inverse = np.asarray(self.inverse)
        free = np.flatnonzero(np.diag(inverse))
        stiffness = np.zeros_like(inverse)
        stiffness[np.ix_(free, free)] = np.linalg.inv(inverse[np.ix_(free, free)])
        stiffness[free, free] -= self.rho
        normal = slice(len(self.loads) // nodes - 1, None, len(self.loads) // nodes)
        return np.asarray(stiffness[normal, normal])


def join(
    bodies: Sequence[Condensed],
    projection: sp.csr_matrix | None = None,
    places: Sequence[Indices] | None = None,
    held: NDArray[np.bool_] | None = None,
    like: Resolvent | None = None,
) -> JointStiffness:
    """Join condensed ``bodies``, which need to be held only when all faces stick.

    Parameters
    ----------
    bodies
        Stiffness and loads of each condensed body.
    projection
        N on displacements ``(d n, d n_1)``; None where all faces meet node to node. It has no rows
        and columns for held displacements.
    places
        Positions ``(k,)`` of each body's displacements in u_1 followed by u_2. By default there are
        two bodies, the first below and the second above all faces.
    held
        Flags ``(d n,)`` of displacements u_2 that are held.
    like
        A joint that differs little from this one and whose ρ is used as both extreme eigenvalues.
        The search for the joint's own fails where contact alone holds a body in a centrifugal
        field, which makes H slightly indefinite.
    """
    stiffness, loads = _joined(_faces(bodies, projection, places), projection)
    if like is None:
        rigid_modes, smallest, largest = _spectrum(stiffness, len(bodies) - 1)
    else:
        rigid_modes, smallest, largest = like.rigid_modes, like.rho, like.rho
    return JointStiffness(stiffness, loads, rigid_modes, smallest, largest, held)


def join_halves(
    halves_1: Sequence[Condensed], halves_2: Sequence[Condensed], mirror: Mirror
) -> JointStiffness:
    """Join two bodies that meet node to node, condensed in halves of the same ``mirror``."""
    jobs = [partial(_joined_half, *pair) for pair in zip(halves_1, halves_2, strict=True)]
    joined = _in_single_threads(jobs)
    (symmetric, symmetric_loads), (antisymmetric, antisymmetric_loads) = (
        half for half, _ in joined
    )
    counts, smallest, largest = zip(*(spectrum for _, spectrum in joined), strict=True)
    loads = mirror.bases[0] @ symmetric_loads + mirror.bases[1] @ antisymmetric_loads
    stiffness = SplitMatrix(mirror, (symmetric, antisymmetric))
    return JointStiffness(stiffness, loads, sum(counts), min(smallest), max(largest))


def _joined_half(
    half_1: Condensed, half_2: Condensed
) -> tuple[Condensed, tuple[int, float, float]]:
    """Return H and f0 of a half, and the spectrum of H."""
    stiffness, loads = _joined(_Faces(half_1, half_2, None), None)
    return (stiffness, loads), _spectrum(stiffness, 1)


def _in_single_threads(jobs: Sequence[Callable[[], T]]) -> list[T]:
    """Run jobs of dense algebra in parallel, with one BLAS thread each.

    This is as fast as running them one by one with all threads.
    """
    with one_thread():
        return run_parallel(jobs)


def _product(matrix: Matrix | SplitMatrix, vectors: Array) -> Array:
    """Return a symmetric matrix times ``vectors`` ``(n,)`` or ``(n, m)``."""
    if isinstance(matrix, SplitMatrix):
        return matrix @ vectors
    return symmetric_product(matrix, vectors)


class _Faces(NamedTuple):
    """Stiffness and loads of all bodies at faces 1 and at faces 2, and S_21 if there is any."""

    first: Condensed
    second: Condensed
    coupling: Array | None


def _faces(
    bodies: Sequence[Condensed],
    projection: sp.csr_matrix | None,
    places: Sequence[Indices] | None,
) -> _Faces:
    """Assemble ``bodies``, whose displacements have ``places`` among all, into faces 1 and 2."""
    total = sum(len(stiffness) for stiffness, _ in bodies)
    if places is None or (
        len(bodies) == 2 and np.array_equal(np.concatenate(places), np.arange(total))
    ):
        return _Faces(bodies[0], bodies[1], None)
    count = total // 2 if projection is None else projection.shape[1]
    cases = bodies[0][1].shape[1]
    first = np.zeros((count, count)), np.zeros((count, cases))
    second = np.zeros((total - count,) * 2), np.zeros((total - count, cases))
    coupling = None
    for (stiffness, loads), place in zip(bodies, places, strict=True):
        one, two = np.flatnonzero(place < count), np.flatnonzero(place >= count)
        for (matrix, forces), mine, start in ((first, one, 0), (second, two, count)):
            matrix[np.ix_(place[mine] - start, place[mine] - start)] = stiffness[np.ix_(mine, mine)]
            forces[place[mine] - start] = loads[mine]
        if len(one) and len(two):
            coupling = np.zeros((total - count, count)) if coupling is None else coupling
            coupling[np.ix_(place[two] - count, place[one])] = stiffness[np.ix_(two, one)]
    return _Faces(first, second, coupling)


def _joined(faces: _Faces, projection: sp.csr_matrix | None) -> tuple[Array, Array]:
    """Return H and f0 of the load cases."""
    (stiffness_1, loads_1), (stiffness_2, loads_2), between = faces
    if projection is None:
        coupling, carried, transferred = stiffness_2, stiffness_2, loads_2
        if between is not None:
            coupling, carried = coupling + between.T, carried + between.T + between
    else:
        coupling, transferred = projection.T @ stiffness_2, projection.T @ loads_2
        if between is not None:
            coupling = coupling + between.T
        carried = coupling @ projection
        if between is not None:
            carried = carried + projection.T @ between
    factor = sl.cholesky(_by_columns(stiffness_1 + carried), lower=True, overwrite_a=True)
    # K C⁻¹ Kᵀ = XᵀX with X = L⁻¹ Kᵀ: half the work of solving with both factors.
    half = sl.solve_triangular(factor, coupling, lower=True, check_finite=False)
    stiffness = half.T @ half
    np.subtract(stiffness_2, stiffness, out=stiffness)
    loads = half.T @ sl.solve_triangular(factor, loads_1 + transferred, lower=True) - loads_2
    return stiffness, loads


def _by_columns(symmetric: Matrix) -> Matrix:
    """Return the same symmetric matrix in column order, which LAPACK takes without a copy."""
    return symmetric if symmetric.flags.f_contiguous else symmetric.T


def _shifted(stiffness: Matrix, shift: float) -> Array:
    """Return H + shift in column order."""
    shifted = np.array(_by_columns(stiffness), np.float64, order="K")
    shifted[np.diag_indices_from(shifted)] += shift
    return shifted


def _shifted_inverse(stiffness: Matrix, rho: float) -> Array:
    """Return (H + ρ)⁻¹, symmetric to the last bit."""
    factor = sl.cholesky(_shifted(stiffness, rho), lower=True, overwrite_a=True, check_finite=False)
    # Both matrices are zero above the diagonal.
    lower, _ = sl.lapack.dpotri(factor, lower=1, overwrite_c=1)
    inverse = lower + lower.T
    inverse[np.diag_indices_from(inverse)] = np.diag(lower)
    return np.asarray(inverse)


def _spectrum(stiffness: Array, free: int) -> tuple[int, float, float]:
    """Return the number of zero eigenvalues, the smallest other one and the largest one.

    ``free`` is the number of bodies that may be free. Rounding decides how many copies of a
    multiple eigenvalue Lanczos iterations find. Eigenvectors that were found are therefore
    projected out, and the search is repeated until no zero eigenvalue is left.
    """
    start = np.random.default_rng(0).standard_normal(len(stiffness))
    extreme = partial(eigsh, v0=start, tol=RITZ_RESIDUAL)
    product = LinearOperator(
        stiffness.shape, matvec=lambda v: symmetric_product(stiffness, v), dtype=np.float64
    )
    with one_thread(len(stiffness)):
        (largest,) = extreme(product, 1, return_eigenvectors=False)
    shift = SPECTRUM_SHIFT * largest
    factors = sl.cho_factor(_shifted(stiffness, shift), lower=True, overwrite_a=True)
    inverse = LinearOperator(
        stiffness.shape,
        matvec=lambda v: sl.cho_solve(factors, v, check_finite=False),
        dtype=np.float64,
    )
    # A free body has at most six rigid motions: the next eigenvalue is elastic.
    count = min(6 * free + 1, len(stiffness) - 1)
    rigid, elastic = np.empty((len(stiffness), 0)), np.empty(0)
    with one_thread(len(stiffness)):
        while not rigid.shape[1] or count < len(stiffness) - rigid.shape[1]:
            inverted, modes = extreme(_without(inverse, rigid), count)
            values = 1.0 / inverted - shift
            zero = values <= RIGID_LIMIT * largest
            elastic, count = np.append(elastic, values[~zero]), 1
            if not zero.any():
                break
            rigid = np.linalg.qr(np.hstack([rigid, modes[:, zero]]))[0]
    return rigid.shape[1], float(elastic.min()), float(largest)


def _without(operator: LinearOperator, vectors: Array) -> LinearOperator:
    """Return a symmetric operator that maps orthonormal ``vectors`` ``(n, k)`` to zero."""

    def outside(vector: Array) -> Array:
        return vector - vectors @ (vectors.T @ vector)

    return LinearOperator(
        operator.shape, matvec=lambda v: outside(operator.matvec(outside(v))), dtype=np.float64
    )
