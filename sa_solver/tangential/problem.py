"""Discrete tangential contact problem on a box of cells, and its residual.

Fields cover the box and have the shape ``(2, nx, ny)``. Cells without a limit (µp = 0) carry no
shear and their slip does not matter. With the displacement K q, an imposed ``offset`` and rigid
motions R c the problem is

    Δs = K q + offset - R c,    |q| <= µp,    Δs = -λ q with λ >= 0, λ (µp - |q|) = 0,

where the resultants Rᵀq conjugate to the motions are imposed. For a given limit the solution is the
unique minimum of ½ q·Kq + q·offset over the disks |q| <= µp.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sa_solver.half_space.operator import (
    SHEAR,
    HalfSpace,
    fast_lengths,
    inverse_symbols,
    spectral_filter,
)
from sa_solver.rigid_modes import PlanarModes
from sa_solver.transforms.padded import SpectralFilter
from sa_solver.types import Array, Mask

BALANCE_TOLERANCE = 1e-13
"""Error of the resultants after a balance, relative to the largest shear force: rounding."""

BALANCE_ITERATIONS = 200
"""Most iterations of a balance. Newton's method takes 2 to 10, more only within 1e-3 of the largest
force."""

LONGEST_STEP = 3.0
"""Longest Newton step relative to the present coefficients. Close to the largest force the
coefficients grow without bound, and so would a step along the tangent."""

RIDGE = 1e-14
"""Relative size of a multiple of the identity that keeps the Hessian of a balance regular where no
cell can change its shear."""

REACHED = 1e-12
"""Relative distance from the limit, due to rounding, of shear that has reached it."""

SMALLEST_INCREMENT = 1e-4
"""Least displacement to which residuals are relative, as a share of the present displacement.
Residuals are usually relative to the displacement of the increment, but rounding would dominate
that of a smaller one."""

LEVELS = 2
LEVEL_RATIO = 8.0
"""Number of levels of local compliance for which the preconditioner has an inverse, and the ratio
between levels, each plus the compliance of a cell. For spheres with 512² cells at Q/µP = 0.75 the
residual of a phase falls by 10⁶ in 18 conjugate directions with one level, in 12 with two to four.
"""

FEW = 0.05
"""Share of cells with a compliance nearer the second level below which the first level is used
alone, because another level costs a transform in each iteration."""

TINY = 1e-200
"""Keeps divisions by a vanishing size, and their results, finite."""


def squared(field: Array) -> Array:
    """Return |q|² ``(nx, ny)`` of a field ``(2, nx, ny)``."""
    square: Array = field[0] * field[0]
    square += field[1] * field[1]
    return square


def dot(one: Array, other: Array) -> Array:
    """Return the scalar product ``(nx, ny)`` of two fields ``(2, nx, ny)``, cell by cell."""
    product: Array = one[0] * other[0]
    product += one[1] * other[1]
    return product


@dataclass(frozen=True)
class TangentialProblem:
    """Data of a tangential contact problem.

    Attributes
    ----------
    limit
        Friction limit µp >= 0 ``(nx, ny)`` [MPa].
    offset
        Slip ``(2, nx, ny)`` [mm] without new tractions and free motions; it includes all imposed
        motions.
    modes
        Free modes R of rigid motion.
    target
        Imposed sums ``(k,)`` of the shear with these modes [MPa].
    operator
        Elastic operator K.
    """

    limit: Array
    offset: Array
    modes: PlanarModes
    target: Array
    operator: BoxOperator

    @cached_property
    def per_limit(self) -> Array:
        """Inverse 1/µp of the limit, 0 where µp is 0."""
        inverse = np.zeros_like(self.limit)
        return np.divide(1.0, self.limit, out=inverse, where=self.pressed)

    @cached_property
    def pressed(self) -> Mask:
        """Cells that can carry shear."""
        return self.limit > 0.0

    @cached_property
    def largest(self) -> float:
        """Sum Σ µp of the limits [MPa]."""
        return float(self.limit.sum())

    def energy(self, shear: Array, displacement: Array) -> float:
        """Return ½ q·Kq + q·offset [MPa mm], which is least at the solution."""
        return float(0.5 * np.vdot(shear, displacement) + np.vdot(shear, self.offset))

    def slip(self, displacement: Array, rigid: Array) -> Array:
        """Return the slip Δs ``(2, nx, ny)`` [mm] at free motions ``rigid`` ``(k,)``.

        It is given for all cells of the box, also those that are not pressed.
        """
        slip = displacement + self.offset
        self.modes.add_motion(slip, -rigid)
        return slip

    def residual(self, shear: Array, displacement: Array, rigid: Array) -> float:
        """Return the largest κ |q - Π(q - Δs/κ)|, relative to the displacement.

        Π is the projection on the disks. The residual vanishes only at the solution, for any scale
        κ [mm/MPa], which is here the compliance of a cell. It is relative to the largest
        displacement |K q + offset| of a pressed cell, but at least to ``SMALLEST_INCREMENT`` times
        the largest |K q|.
        """
        compliance = self.operator.self_compliance
        step = self.slip(displacement, rigid)
        step *= -1.0 / compliance
        step += shear
        step *= self.limit / np.maximum(np.sqrt(squared(step)), np.maximum(self.limit, TINY))
        step -= shear
        increment = float(squared(displacement + self.offset)[self.pressed].max())
        present = SMALLEST_INCREMENT**2 * float(squared(displacement)[self.pressed].max())
        scale = np.sqrt(max(increment, present))
        largest = compliance * float(np.sqrt(squared(step).max()))
        return float(largest / scale) if scale > 0.0 else largest

    def on_circle(self, shear: Array) -> Mask:
        """Return the pressed cells whose shear has reached its limit."""
        reached: Mask = squared(shear) >= (self.limit * (1.0 - REACHED)) ** 2
        return reached & self.pressed

    def balanced(self, shear: Array, on_circle: Mask | None = None) -> Array | None:
        """Return the shear that :meth:`balance` finds, or None."""
        balance = self.balance(shear, on_circle)
        return balance[0] if balance else None

    def balance(
        self, shear: Array, on_circle: Mask | None = None, weight: Array | None = None
    ) -> tuple[Array, Array] | None:
        """Return an admissible shear near ``shear`` with the resultants ``target``, and c.

        The result is Π(q + w R c), where Π projects on the disks, or on their circles in the cells
        ``on_circle`` ``(nx, ny)``. The weight w ``(nx, ny)`` is µp by default. ``shear``
        ``(2, nx, ny)`` must be 0 in cells that are not pressed. The resultants of the result are
        the gradient of a convex function of c, whose minimum is found by Newton's method. None is
        returned if no admissible shear has the resultants to within rounding.
        """
        weight = self.limit if weight is None else weight
        on_circle = np.zeros_like(self.pressed) if on_circle is None else on_circle
        floor = np.where(on_circle, TINY, np.maximum(self.limit, TINY))
        unit = float(self.limit.max() / weight.max())
        start = coefficients = step = np.zeros(len(self.target))
        potential, cautious = float(np.inf), step
        for _ in range(BALANCE_ITERATIONS):
            raw = shear.copy()
            self.modes.add_weighted(raw, weight, coefficients)
            magnitude = np.sqrt(squared(raw))
            factor = self.limit / np.maximum(magnitude, floor)
            admissible = factor * raw
            missing = self.target - self.modes.sums(admissible)
            if np.abs(missing).max(initial=0.0) <= BALANCE_TOLERANCE * self.largest:
                return admissible, coefficients
            value = self._envelope(magnitude, factor, weight) - float(self.target @ coefficients)
            if value > potential + BALANCE_TOLERANCE * self.largest:
                step = np.multiply(0.25, step)
                if np.linalg.norm(step) < np.linalg.norm(cautious):
                    step = cautious
                coefficients = start + step
                continue
            outside = on_circle | (magnitude > self.limit)
            newton, majorant = self._hessians(admissible, factor * weight, outside)
            ridge = RIDGE * float(np.trace(majorant)) * np.eye(len(missing))
            step = _solved(newton + ridge, missing)
            cautious = _solved(majorant + ridge, missing)
            longest = LONGEST_STEP * (unit + float(np.linalg.norm(coefficients)))
            step *= min(1.0, longest / (float(np.linalg.norm(step)) + TINY))
            start, potential = coefficients, value
            coefficients = start + step
        return None

    def _envelope(self, magnitude: Array, factor: Array, weight: Array) -> float:
        """Return the convex function of :meth:`balance` without its linear part [MPa]."""
        reached = magnitude * factor
        magnitude = magnitude - 0.5 * reached
        reached *= np.where(self.pressed, 1.0 / np.maximum(weight, TINY), 0.0)
        return float(np.vdot(reached, magnitude))

    def _hessians(self, admissible: Array, slope: Array, outside: Mask) -> tuple[Array, Array]:
        """Return the derivative ``(k, k)`` of the resultants in :meth:`balance`, and its bound.

        The bound majorises the convex function, so that a step by the bound always lowers it.
        """
        normal = admissible * self.per_limit
        along = np.where(outside, slope, 0.0) * normal
        lost = self.modes.products(along[0] * normal[0], along[0] * normal[1], along[1] * normal[1])
        majorant = self.modes.products(slope, np.zeros_like(slope), slope)
        return majorant - lost, majorant


def _solved(matrix: Array, right: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)


class BoxOperator:
    """Elastic operator K for shear on a box of cells, and its approximate inverse.

    The inverse uses the symbol of the box made periodic with almost no padding (Vollebregt 2014,
    doi:10.1016/j.jcp.2013.10.005).
    """

    def __init__(self, half_space: HalfSpace) -> None:
        """Prepare the operator on the box that ``half_space`` covers."""
        self._half_space = half_space
        self.self_compliance = half_space.self_compliance(SHEAR[0])
        self._inverses: dict[int, SpectralFilter] = {}

    @cached_property
    def largest_eigenvalue(self) -> float:
        """Upper bound of K's eigenvalues [mm/MPa]: the largest one of the circulant matrix."""
        xx, xy, yy = (self._half_space.symbol(*pair) for pair in ((0, 0), (0, 1), (1, 1)))
        return float(np.max(0.5 * (xx + yy) + np.hypot(0.5 * (xx - yy), xy)))

    def displacement(self, shear: Array) -> Array:
        """Return K q ``(2, nx, ny)`` [mm] for ``shear`` ``(2, nx, ny)`` [MPa]: one convolution."""
        return self._half_space.shear(shear)

    def precondition(self, displacement: Array, level: int) -> Array:
        """Return (K + D)⁻¹ u ``(2, nx, ny)`` [MPa], approximately, for a ``displacement`` u [mm].

        The local compliance D [mm/MPa] is that of ``level``.
        """
        if level not in self._inverses:
            self._inverses[level] = self._inverse(level)
        return self._inverses[level].apply(displacement)

    def windows(self, compliance: Array) -> tuple[list[tuple[int, Array]], Array]:
        """Return the levels for a local ``compliance`` D ``(nx, ny)``, with windows and a rest.

        (K + D)⁻¹ is approximately Σ χj (K + Dj)⁻¹ χj plus the rest ``(nx, ny)`` [MPa/mm], where χj
        is the window of level j and the levels are evenly spaced in log D. Up to the last level
        Σ χj² = 1. Beyond the last level the sum is smaller and the rest is (1 - Σ χj²) over the sum
        of D and the compliance of a cell, because such cells hardly interact.
        """
        place: Array = np.log1p(compliance / self.self_compliance) / np.log(LEVEL_RATIO)
        yielding = int(np.count_nonzero(place > 0.5))
        within = np.minimum(place, LEVELS - 1 if yielding > FEW * place.size else 0)
        beyond = LEVEL_RATIO ** (within - place)
        levels = range(int(np.ceil(within.max())) + 1)
        hats = [np.maximum(0.0, 1.0 - np.abs(within - level)) * beyond for level in levels]
        rest = (1.0 - beyond) / (compliance + self.self_compliance)
        taken = [(level, np.sqrt(hat)) for level, hat in zip(levels, hats, strict=True)]
        return [(level, window) for level, window in taken if window.any()], rest

    def _inverse(self, level: int) -> SpectralFilter:
        half_space, shape = self._half_space, self._half_space.grid.shape
        period = shape if half_space.periodic else fast_lengths(*shape)
        symbols = [[half_space.symbol(i, j, period) for j in SHEAR] for i in SHEAR]
        local = (LEVEL_RATIO**level - 1.0) * self.self_compliance
        for k, row in enumerate(symbols):
            row[k] = row[k] + local
            if half_space.periodic:
                row[k][0, 0] = row[k].max()  # The forces decide the mean shear.
        transform = half_space.transform(shape, period, 2)
        return spectral_filter(transform, inverse_symbols(symbols), SHEAR, SHEAR)
