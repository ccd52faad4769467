"""Douglas-Rachford splitting with Anderson acceleration, for any contact problem.

The tractions of a contact problem satisfy an elastic relation (linear, global) and a contact law
(nonlinear, cell by cell). The splitting needs only the resolvents of the two and repeats

    t1 = elastic_step(s)            the elastic relation near s, with the exact resultants
    t2 = local_law(2 t1 - s)        the contact law near the reflected point
    s  = s + 1.6 (t2 - t1)

until ``t1 = t2``, which satisfies both.

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
"""Factor of the step along ``t2 - t1``, between 0 and 2. With acceleration it hardly matters: 1.0
to 1.9 took 35 to 52 iterations on flats and spheres, without a trend."""

ANDERSON_DEPTH = 10
"""Number of stored differences. On flats and spheres 0, 3, 5, 10 and 20 differences took about 285,
70, 60, 43 and 39 iterations. Each difference costs memory and time."""

RESTART_GROWTH = 2.0
"""Growth of the residual in one iteration above which the stored differences are dropped: the
contact set has changed, so that they mislead."""

GRAM_CUTOFF = 1e-13
"""Eigenvalues of the scaled Gram matrix below this value are rounding, because the matrix squares
the differences. Their directions are left out of the least-squares problem."""

RETURN_GROWTH = 10.0
"""Growth of the residual over the smallest so far above which an extrapolation is undone. Such an
extrapolation may have lifted a body off its contacts, where it would move on for ever; plain steps
converge, if slowly. It must not be undone for a body that moves towards its contacts, because the
residual grows when the body lands."""

AT_REST = 1e-9
"""Relative change of the residual below which a body moves freely at constant speed. Differences
are then rounding, and an extrapolation from them would throw the body far off."""

ROUNDING = float(np.finfo(np.float64).eps)
"""A step smaller than the state by more than this factor is lost in the digits of the state."""

TINY = np.finfo(float).tiny
"""Keeps divisions by a vanishing size finite."""

REFRESHED = 1e4
"""Distance from the last refreshed state, in steps, beyond which an inexact elastic step is
refreshed. The error of a matrix in single precision is then 1/2000 of the step. The number of
iterations is the same as in double precision, also with a tenth or ten times this distance."""

HARDLY_CHANGED = 1e-3
"""Relative change of the residual below which an inexact elastic step is refreshed as well: only
exact steps show whether a body moves at constant speed (:data:`AT_REST`)."""

SplittingStep = Callable[[Array], Array]


@dataclass(frozen=True)
class SplittingResult:
    """Result of a splitting; arrays have the shape of the start.

    ``solution`` obeys the local law exactly, ``elastic`` the elastic relation. They differ by
    ``residual`` times the scale. ``state`` can start the next solve.
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

    Parameters
    ----------
    elastic_step, local_law
        Steps that map an array to a new array of the same shape, without modifying it.
    start
        Initial state, of any shape.
    scale
        Size to which the residual is relative; max(|t1|, |t2|) by default.
    tolerance
        Bound on the relative residual.
    max_iterations
        Most iterations. The result says whether the iteration has converged.
    returning
        Whether an extrapolation that made the residual much larger is undone.
    refresh
        Function for an ``elastic_step`` that is exact near one state only: first near the start,
        then near the state with which ``refresh`` was last called. It is called whenever the error
        of the step may matter, and before a state is accepted as converged.
    """
    state = np.array(start, dtype=np.float64)
    memory = AndersonMemory(state.size, returning)
    elastic = solution = state
    residual, last, refreshed, iterations = np.inf, np.inf, state, 0
    while iterations < max_iterations:
        iterations += 1
        elastic, solution, residual = _both_steps(elastic_step, local_law, state, scale, tolerance)
        if refresh is not None and state is not refreshed:
            distance = np.linalg.norm(state - refreshed)
            far = distance > REFRESHED * np.linalg.norm(solution - elastic)
            if far or residual <= tolerance or abs(residual - last) <= HARDLY_CHANGED * last:
                refresh(state)
                refreshed = state
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
    """Return ``t1``, ``t2`` and their relative difference."""
    elastic = elastic_step(state)
    solution = local_law(2.0 * elastic - state)
    size = scale or max(np.linalg.norm(solution), np.linalg.norm(elastic), TINY)
    residual = float(np.linalg.norm(solution - elastic) / size)
    if ROUNDING * np.linalg.norm(state) > tolerance * size:
        # The state is so large that such a step is lost in its digits. This is no solution, even
        # if the difference vanishes.
        residual = np.inf
    return elastic, solution, residual


class AndersonMemory:
    """Anderson acceleration (type II) of a fixed-point iteration ``s ← s + f(s)``.

    It stores the last :data:`ANDERSON_DEPTH` differences of images and of residuals, and the Gram
    matrix of the differences of residuals; each iteration renews one row and column of the matrix.
    The differences are stored in single precision, relative to the size of the first residual. They
    only correct an exact image, so that the number of iterations is the same as in double
    precision, and reading them is most of the work.
    """

    def __init__(self, size: int, returning: bool) -> None:
        """Allocate memory for vectors of ``size`` values.

        ``returning`` is that of :func:`douglas_rachford`.
        """
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
        """Return the state that follows ``state`` with its ``residual`` f(s), both ``(size,)``."""
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
        """Return the combination of the stored images that has the smallest residual."""
        slot = (self._seen - 1) % ANDERSON_DEPTH
        used = min(self._seen, ANDERSON_DEPTH)
        self._store_difference(self._residuals[slot], residual, self._last_residual)
        self._store_difference(self._images[slot], image, self._last_image)
        stored = self._residuals[:used]
        change = np.linalg.norm(self._residuals[slot]) * self._unit
        if change <= AT_REST * self._last_norm:
            self._seen = 0
            return image
        self._gram[slot, :used] = self._gram[:used, slot] = stored @ self._residuals[slot]
        scaled = (residual / self._unit).astype(np.float32)
        products = (stored @ scaled).astype(np.float64)
        weights = _solve_gram(self._gram[:used, :used], products)
        correction = weights.astype(np.float32) @ self._images[:used]
        return image - self._unit * correction

    def _store_difference(self, out: NDArray[np.float32], new: Array, last: Array) -> None:
        """Write the difference of ``new`` and ``last``, relative to the unit, to ``out``."""
        np.subtract(new, last, out=out, casting="same_kind")
        out /= self._unit


def _solve_gram(gram: Array, right: Array) -> Array:
    """Return the least-squares weights for a Gram matrix that may be singular to rounding."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), TINY))
    values, vectors = np.linalg.eigh(gram * np.outer(scale, scale))
    kept = values > GRAM_CUTOFF * values[-1]
    basis = vectors[:, kept]
    weights: Array = scale * (basis @ ((basis.T @ (scale * right)) / values[kept]))
    return weights
