"""Frictional contact of two whole bodies in one matrix, to check the condensed joint.

It shares nothing with ``fe_models`` but the mesh and the closed form of Coulomb's law: stiffness
from scikit-fem's own vector forms, supports and linear traces as equations with multipliers, both
bodies whole, and a method of multipliers with Newton's method inside instead of a splitting:

    K u + Aᵀ ν - Bᵀ f = F,   A u = 0,   f = C(f - r (B u - w0); µ f_z),

with w = B u the relative displacement of body 2 in the interface frames, f the force on it, w0 =
(last wx, last wy, -gap), and C(·; g) the law where a given g bounds the shear: pressure max(0, ·),
shear within g. These are the augmented equations of Alart and Curnier 1991, Comput. Methods Appl.
Mech. Eng. 92, 353, doi:10.1016/0045-7825(91)90022-X. Newton's method on all of them together may
cycle, depending on rounding. As in Kunisch and Stadler 2005, M2AN 39, 827,
doi:10.1051/m2an:2005036, they are therefore solved in nested loops, none of which can cycle:

- u, with f and g held, has least energy: the elastic one, less the work of F, plus |C|² / 2r.
  That is convex and has a continuous slope, so Newton's steps, cut where a whole one does not help,
  lead to its minimum from anywhere.
- f becomes C: the method of multipliers, which converges for any r and from anywhere (Rockafellar
  1976, Math. Oper. Res. 1, 97, doi:10.1287/moor.1.2.97).
- g becomes µ f_z: Tresca's friction on the way to Coulomb's, a contraction where friction couples
  pressure and shear weakly. A step leaves a tenth of the change in the tests' block on a plate, and
  0.4 of it, µ times the slope of the flanks, in a dovetail that slides. At first g is infinite:
  bodies that stick carry any load that friction can.

The last two steps are made together, for r is so large that one of the second all but ends it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.optimize import brentq
from scipy.sparse.linalg import splu
from skfem import Basis, ElementTetP1, ElementTetP2, ElementVector, MeshTet
from skfem.models.elasticity import lame_parameters, linear_elasticity

from sa_solver.types import Array, Material

ELEMENTS = {1: ElementTetP1, 2: ElementTetP2}
# Tolerated out-of-balance forces relative to the load, little more than rounding.
TOLERANCE = 1e-12
# Share of the residual to which the balance is solved; less would not improve the next forces.
BALANCED = 0.1
MAX_RENEWALS = 200
MAX_NEWTON_STEPS = 200
# Share of the stiffness' diagonal added to derivatives: a body that touches nowhere yet is held by
# nothing else. The equations are solved without it; steps are wrong by some 1e-5 of themselves.
REGULARISATION = 1e-8


def whole_stiffness(mesh: MeshTet, material: Material, order: int) -> sp.csr_matrix:
    """Return the stiffness ``(3 n, 3 n)`` by scikit-fem, numbered 3 node + component."""
    basis = Basis(mesh, ElementVector(ELEMENTS[order]()))
    form = linear_elasticity(*lame_parameters(material.young, material.poisson))
    return form.assemble(basis).tocsr()


def rows(size: int, dofs: Array, coefficients: Array) -> sp.csr_matrix:
    """Return equations Σ c u = 0, one per row of ``dofs`` and ``coefficients``, both ``(m, k)``."""
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
    """Return the equations of midside nodes that stay halfway between their vertices."""
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
    """State at the end of an increment.

    It has the ``force`` on body 2 and the relative ``displacement`` ``(3, n)`` in the frames, and
    all ``u``.
    """

    force: Array
    displacement: Array
    slip: Array
    u: Array
    renewals: int


class Monolith:
    """Body 1 and body 2 with the contact between them; ``frames`` are ``(n, 3, 3)``."""

    def __init__(self, part_1: Part, part_2: Part, frames: Array, friction: float) -> None:
        parts = (part_1, part_2)
        self.stiffness = sp.block_diag([p.stiffness for p in parts], format="csr")
        self.loads = np.concatenate([p.loads for p in parts])
        first, second = (self._selection(p, frames) for p in parts)
        self.jump = sp.hstack([-first, second], format="csr")
        self.friction = friction
        typical_stiffness = float(np.median(abs(self.jump) @ self.stiffness.diagonal()))
        # Any positive number is valid; a few times the contact's stiffness converges quickly.
        self.augmentation = 10.0 * typical_stiffness
        # Equations in displacements are scaled to the weight of those in forces.
        self.equations = typical_stiffness * sp.block_diag(
            [p.equations for p in parts], format="csr"
        )

    @staticmethod
    def _selection(part: Part, frames: Array) -> sp.csr_matrix:
        blocks = sp.block_diag(list(frames), format="csr")
        dofs = (3 * part.contact[:, None] + np.arange(3)).reshape(-1, 1)
        return blocks @ rows(part.stiffness.shape[0], dofs, np.ones(dofs.shape))

    def march(self, amplitudes: Array, gap: Array) -> Iterator[WholeState]:
        """Return states along a load path ``(increments, cases)`` from the unslipped state."""
        u, multipliers = np.zeros(len(self.loads)), np.zeros(self.equations.shape[0])
        start = _Guess(u, multipliers, np.zeros((len(gap), 3)))
        previous = np.zeros((3, len(gap)))
        for amplitude in amplitudes:
            datum = np.vstack([previous[:2], -gap]).T
            increment = _Increment(self, self.loads @ amplitude, datum)
            start, renewals = increment.solve(start)
            displacement = (self.jump @ start.u).reshape(-1, 3).T
            slip = displacement[:2] - previous[:2]
            previous = displacement
            yield WholeState(start.force.T, displacement, slip, start.u, renewals)

    def tied(self, amplitude: Array, closed: Array) -> tuple[Array, Array]:
        """Return forces ``(3, n)`` on body 2, and u, with the ``closed`` nodes bonded."""
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


@dataclass(frozen=True)
class _Guess:
    """Displacements, multipliers of the supports, and forces ``(n, 3)``."""

    u: Array
    multipliers: Array
    force: Array


class _Increment:
    """One increment of the bodies under ``load``, with nodes relative to ``datum`` ``(n, 3)``."""

    def __init__(self, whole: Monolith, load: Array, datum: Array) -> None:
        self.whole, self.load, self.datum = whole, load, datum
        floor = 1e-3 * float(np.linalg.norm(whole.loads))
        self.tolerance = TOLERANCE * max(float(np.linalg.norm(load)), floor)
        diagonal = sp.diags(whole.stiffness.diagonal())
        self.regularised = whole.stiffness + REGULARISATION * diagonal

    def solve(self, start: _Guess) -> tuple[_Guess, int]:
        """Return the state at the end of the increment, and the number of updates of its forces."""
        guess, residual = start, float(np.linalg.norm(self.load))
        bound = np.full(len(self.datum), np.inf)
        self._factorise(guess, bound)
        for renewal in range(1, MAX_RENEWALS + 1):
            enough = max(BALANCED * residual, 0.5 * self.tolerance)
            balanced = self._minimise(guess, bound, enough)
            guess = replace(balanced, force=law(self._trial(balanced), bound))
            bound = self._bound(guess)
            residual = self._residual(guess)
            if residual <= self.tolerance:
                return guess, renewal
        raise AssertionError("the forces of the whole bodies did not converge")

    def _residual(self, guess: _Guess) -> float:
        """Return the residual of the increment's equations, in forces."""
        whole, (u, multipliers, force) = self.whole, (guess.u, guess.multipliers, guess.force)
        elastic = whole.stiffness @ u + whole.equations.T @ multipliers
        balance = elastic - whole.jump.T @ force.ravel() - self.load
        coulomb = force - law(self._trial(guess), self._bound(guess))
        return float(
            np.linalg.norm(np.concatenate([balance, whole.equations @ u, coulomb.ravel()]))
        )

    def _minimise(self, guess: _Guess, bound: Array, enough: float) -> _Guess:
        """Minimise the augmented energy by Newton steps, which are shortened if needed.

        A derivative is kept until a step with it no longer halves the imbalance.
        """
        smallest = np.inf
        for _ in range(MAX_NEWTON_STEPS):
            imbalance = self._imbalance(guess, bound)
            if imbalance <= enough:
                return guess
            smallest = min(smallest, imbalance)
            ahead = self._ahead(guess, bound)
            if self._imbalance(ahead, bound) > 0.5 * smallest:
                self._factorise(guess, bound)
                ahead = self._ahead(guess, bound)
                if self._imbalance(ahead, bound) > 0.5 * smallest:
                    ahead = self._lowest(guess, ahead, bound)
            guess = ahead
        raise AssertionError("the energy of the whole bodies was not minimised")

    def _lowest(self, guess: _Guess, ahead: _Guess, bound: Array) -> _Guess:
        """Return the point of least energy between two guesses, where the slope is 0."""
        step = ahead.u - guess.u

        def between(length: float) -> _Guess:
            multipliers = guess.multipliers + length * (ahead.multipliers - guess.multipliers)
            return _Guess(guess.u + length * step, multipliers, guess.force)

        def slope(length: float) -> float:
            return float(step @ self._slope(between(length), bound))

        return ahead if slope(1.0) <= 0.0 else between(brentq(slope, 0.0, 1.0, xtol=1e-15))

    def _factorise(self, guess: _Guess, bound: Array) -> None:
        whole = self.whole
        slopes = law_slopes(self._trial(guess), bound)
        nodes = np.arange(len(slopes) + 1)
        contact = whole.jump.T @ sp.bsr_matrix((slopes, nodes[:-1], nodes)) @ whole.jump
        derivative = self.regularised + whole.augmentation * contact
        matrix = [[derivative, whole.equations.T], [whole.equations, None]]
        self._factors = splu(sp.bmat(matrix, format="csc"), permc_spec="MMD_AT_PLUS_A")

    def _ahead(self, guess: _Guess, bound: Array) -> _Guess:
        """Return the guess after a full Newton step."""
        imbalance = np.concatenate([self._slope(guess, bound), self.whole.equations @ guess.u])
        step, multipliers = np.split(self._factors.solve(-imbalance), [len(guess.u)])
        return _Guess(guess.u + step, multipliers, guess.force)

    def _bound(self, guess: _Guess) -> Array:
        return self.whole.friction * guess.force[:, 2]

    def _trial(self, guess: _Guess) -> Array:
        relative = (self.whole.jump @ guess.u).reshape(-1, 3)
        return guess.force - self.whole.augmentation * (relative - self.datum)

    def _slope(self, guess: _Guess, bound: Array) -> Array:
        """Return the derivative ``(3 n,)`` of the augmented energy by the displacements."""
        force = law(self._trial(guess), bound)
        return self.whole.stiffness @ guess.u - self.whole.jump.T @ force.ravel() - self.load

    def _imbalance(self, guess: _Guess, bound: Array) -> float:
        held = self.whole.equations.T @ guess.multipliers
        return float(np.linalg.norm(self._slope(guess, bound) + held))


def law(trial: Array, bound: Array) -> Array:
    """Return admissible forces ``(n, 3)`` nearest to ``trial``.

    They do not pull, and their shear is within ``bound``.
    """
    size = np.linalg.norm(trial[:, :2], axis=1)
    share = np.minimum(1.0, bound / np.where(size > 0.0, size, 1.0))
    return np.column_stack([share[:, None] * trial[:, :2], np.maximum(trial[:, 2], 0.0)])


def law_slopes(trial: Array, bound: Array) -> Array:
    """Return derivatives ``(n, 3, 3)`` of :func:`law` for open, stuck or sliding nodes."""
    size = np.linalg.norm(trial[:, :2], axis=1)
    slides = size > bound
    direction = trial[:, :2] / np.where(size > 0.0, size, 1.0)[:, None]
    share = np.where(slides, bound / np.where(slides, size, 1.0), 1.0)
    along = slides[:, None, None] * direction[:, :, None] * direction[:, None, :]
    slopes = np.zeros((len(trial), 3, 3))
    slopes[:, :2, :2] = share[:, None, None] * (np.eye(2) - along)
    slopes[:, 2, 2] = trial[:, 2] > 0.0
    return slopes
