"""Douglas-Rachford splitting with Anderson acceleration, for contact problems of any kind.

A contact problem asks for tractions that satisfy an elastic relation (linear, global) and a contact
law (nonlinear, cell by cell). The splitting needs only the two resolvents: it repeats

    t1 = elastic_step(s)            the elastic relation near s, resultants met exactly
    t2 = local_law(2 t1 - s)        the contact law near the reflected point
    s  = s + 1.6 (t2 - t1)

until ``t1 = t2``, which then satisfies both.

Sources: Lions & Mercier 1979, SIAM J. Numer. Anal. 16, 964, doi:10.1137/0716071; Walker & Ni 2011,
SIAM J. Numer. Anal. 49, 1715, doi:10.1137/10078356X.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sa_solver.types import Array

OVER_RELAXATION = 1.6
"""Step along ``t2 - t1``, in (0, 2). Once accelerated it hardly matters: 1.0 to 1.9 took 35 to 52
iterations on flats and spheres, without an order."""

ANDERSON_DEPTH = 10
"""Differences remembered. On flats and spheres 0, 3, 5, 10 and 20 took about 285, 70, 60, 43 and 39
iterations, and each difference costs memory and time."""

RESTART_GROWTH = 2.0
"""The memory is dropped when the residual grows by this factor in one iteration: the contact set
has changed and the old differences mislead."""

GRAM_CUTOFF = 1e-13
"""Eigenvalues of the scaled Gram matrix below this are rounding, since it squares the differences:
their directions are left out of the least-squares problem."""

RETURN_GROWTH = 10.0
"""An extrapolation to a residual this many times the least so far is taken back: it may have thrown
a body off its contacts, where it would float on for ever. Plain steps get on, if slowly. A body
that floats towards its contacts must not be held back so: there the residual grows on landing."""

AT_REST = 1e-9
"""A residual that changes by less than this share of itself is that of a body in free motion, at
constant speed until it meets something: differences are rounding, and would throw it far off."""

ROUNDING = float(np.finfo(np.float64).eps)
"""A state larger than its steps by more than the inverse of this holds no digit of them."""

TINY = np.finfo(float).tiny
"""Keeps divisions by a vanishing size finite."""

REFRESHED = 1e4
"""An elastic step that is exact near one state only is told of the present one where that is
farther from it than so many steps: of a matrix in single precision the error is then 1/2000 of the
step. It takes as many iterations as in double precision, and so it did with a tenth and ten times
of this."""

HARDLY_CHANGED = 1e-3
"""So it is where the residual changes by less than this share of itself: whether a body is at
constant speed, see :data:`AT_REST`, only exact steps tell."""

SplittingStep = Callable[[Array], Array]


@dataclass(frozen=True)
class SplittingResult:
    """Outcome of a splitting; arrays have the shape of the start.

    ``solution`` obeys the local law exactly and ``elastic`` the elastic relation exactly; they
    differ by ``residual`` times the scale. ``state`` is the start of a next solve.
    """

    state: Array
    solution: Array
    elastic: Array
    residual: float
    iterations: int
    converged: bool


def douglas_rachford(
    elastic_step: SplittingStep,
    local_law: SplittingStep,
    start: Array,
    *,
    scale: float | None = None,
    tolerance: float = 1e-8,
    max_iterations: int = 1000,
    returning: bool = False,
    refresh: Callable[[Array], None] | None = None,
) -> SplittingResult:
    """Iterate the two steps from ``start`` until ``|t2 - t1| <= tolerance scale``.

    ``scale`` is the size to measure the residual against, max(|t1|, |t2|) unless it is given.
    ``elastic_step`` and ``local_law`` map an array of any shape to one of the same shape and must
    not modify it. ``returning`` takes back extrapolations that made things much worse. With
    ``refresh`` the ``elastic_step`` need be exact only at the start, and then at the last state
    that ``refresh`` was called with: whenever its error might count, and where the tolerance is
    met, which must be so afterwards. A result that has not converged after ``max_iterations`` says
    so.
    """
    state = np.array(start, dtype=np.float64)
    memory = AndersonMemory(state.size, returning)
    elastic = solution = state
    residual, last, known, iterations = np.inf, np.inf, state, 0
    while iterations < max_iterations:
        iterations += 1
        elastic, solution, residual = _both_steps(elastic_step, local_law, state, scale, tolerance)
        if refresh is not None and state is not known:
            far = np.linalg.norm(state - known) > REFRESHED * np.linalg.norm(solution - elastic)
            if far or residual <= tolerance or abs(residual - last) <= HARDLY_CHANGED * last:
                refresh(state)
                known = state
                elastic, solution, residual = _both_steps(
                    elastic_step, local_law, state, scale, tolerance
                )
        if residual <= tolerance or not np.isfinite(residual):
            break
        last = residual
        step = OVER_RELAXATION * (solution - elastic)
        state = memory.next_state(state.ravel(), step.ravel()).reshape(state.shape)
    return SplittingResult(state, solution, elastic, residual, iterations, residual <= tolerance)


def _both_steps(
    elastic_step: SplittingStep,
    local_law: SplittingStep,
    state: Array,
    scale: float | None,
    tolerance: float,
) -> tuple[Array, Array, float]:
    """``t1``, ``t2`` and the residual that they leave."""
    elastic = elastic_step(state)
    solution = local_law(2.0 * elastic - state)
    size = scale or max(np.linalg.norm(solution), np.linalg.norm(elastic), TINY)
    residual = float(np.linalg.norm(solution - elastic) / size)
    if ROUNDING * np.linalg.norm(state) > tolerance * size:
        # Thrown so far off that steps of this size are lost in its digits: no solution, though
        # nothing may seem to be left.
        residual = np.inf
    return elastic, solution, residual


class AndersonMemory:
    """Anderson acceleration (type II) of a fixed-point iteration ``s ← s + f(s)``.

    Holds the last :data:`ANDERSON_DEPTH` differences of images and of residuals, and the Gram
    matrix of the latter, of which each iteration renews one row and column. Differences are kept in
    single precision, over the first residual's size: they only correct an image that is exact, take
    the same number of iterations as in double precision, and reading them is most of the work.
    """

    def __init__(self, size: int, returning: bool) -> None:
        """Memory for vectors of ``size`` values."""
        self._returning = returning
        self._images = np.empty((ANDERSON_DEPTH, size), dtype=np.float32)
        self._residuals = np.empty((ANDERSON_DEPTH, size), dtype=np.float32)
        self._unit = 1.0
        self._gram = np.zeros((ANDERSON_DEPTH, ANDERSON_DEPTH))
        self._last_image = self._last_residual = np.empty(0)
        self._last_norm = 0.0
        self._least_norm, self._least_image = np.inf, np.empty(0)
        self._extrapolated = False
        self._seen = 0

    def next_state(self, state: Array, residual: Array) -> Array:
        """The next state from this ``state`` and its ``residual`` f(s), both ``(size,)``."""
        image = state + residual
        norm = float(np.linalg.norm(residual))
        if self._seen == 0:
            self._unit = max(norm, TINY)
        if norm < self._least_norm:
            self._least_norm, self._least_image = norm, image
        elif self._returning and self._extrapolated and norm > RETURN_GROWTH * self._least_norm:
            self._seen, self._least_norm, self._extrapolated = 0, np.inf, False
            return self._least_image
        if self._seen > 0 and norm > RESTART_GROWTH * self._last_norm:
            self._seen = 0
        accelerated = self._accelerate(image, residual) if self._seen > 0 else image
        self._extrapolated = accelerated is not image
        self._last_image, self._last_residual, self._last_norm = image, residual, norm
        self._seen += 1
        return accelerated

    def _accelerate(self, image: Array, residual: Array) -> Array:
        """Combine the remembered images so that the combined residual is least."""
        slot = (self._seen - 1) % ANDERSON_DEPTH
        used = min(self._seen, ANDERSON_DEPTH)
        self._keep(self._residuals[slot], residual, self._last_residual)
        self._keep(self._images[slot], image, self._last_image)
        remembered = self._residuals[:used]
        moved = np.linalg.norm(self._residuals[slot]) * self._unit
        if moved <= AT_REST * self._last_norm:
            self._seen = 0
            return image
        self._gram[slot, :used] = self._gram[:used, slot] = remembered @ self._residuals[slot]
        scaled = (residual / self._unit).astype(np.float32)
        products = (remembered @ scaled).astype(np.float64)
        weights = _solve_gram(self._gram[:used, :used], products)
        correction = weights.astype(np.float32) @ self._images[:used]
        return image - self._unit * correction

    def _keep(self, place: NDArray[np.float32], new: Array, last: Array) -> None:
        """The difference of ``new`` and ``last`` over the unit, into ``place``."""
        np.subtract(new, last, out=place, casting="same_kind")
        place /= self._unit


def _solve_gram(gram: Array, right: Array) -> Array:
    """Least-squares weights from a Gram matrix that may be singular to rounding."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), TINY))
    values, vectors = np.linalg.eigh(gram * np.outer(scale, scale))
    kept = values > GRAM_CUTOFF * values[-1]
    basis = vectors[:, kept]
    weights: Array = scale * (basis @ ((basis.T @ (scale * right)) / values[kept]))
    return weights
