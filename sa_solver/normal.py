"""Normal contact of two elastic half-spaces on a grid, under imposed P, Mx and My.

    p >= 0,  g = h + K p + D p - δz - φx y + φy x >= 0,  p g = 0
    Σ p S = P,  Σ p y S = Mx,  -Σ p x S = My

K is the half-space (Love's coefficients), h the gap before loading and D >= 0 an optional local
compliance: implicit wear, where D p is the depth worn during the step. Conjugate gradients solve it
in a few convolutions; where they do not converge, the slower splitting of
:mod:`sa_solver.splitting` takes over from their last pressure.

Source: Gallego, Nélias & Jacq 2006, J. Tribol. 128, 476, doi:10.1115/1.2194914 (the problem).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sa_solver.bound_cg import bound_conjugate_gradients
from sa_solver.contact_law import unilateral
from sa_solver.convolution import (
    HalfSpaceConvolution,
    HalfSpacePreconditioner,
    HalfSpaceResolvent,
)
from sa_solver.influence import normal_influence
from sa_solver.normal_problem import Iterate, NormalProblem, NormalResiduals, residuals
from sa_solver.rigid_modes import RigidModes
from sa_solver.splitting import douglas_rachford
from sa_solver.types import Array, Grid

TOLERANCE = 1e-8
"""Default bound on every residual of :class:`NormalResiduals`."""

GRADIENT_ITERATIONS = 100
"""Conjugate gradients took at most 45 on every case tried; beyond this they are taken to circle
between contact sets."""

SPLITTING_ITERATIONS = 3000
"""The splitting takes 40 to 220, but 2300 where under 1 % of the cells carry the load."""

SPLITTING_STAGES = 4
"""The splitting's own residual is no bound on the gap's: it is tightened tenfold at most this many
times, until the independent residuals are met."""

SPLITTING_SHIFT = 0.5
"""ρ over the geometric mean of the extreme eigenvalues of K: the fewest iterations on spheres and
flats; 0.2 and 2 take up to twice as many."""

SMALLEST_EIGENVALUE = 0.5
"""Smallest eigenvalue of K over the self-coefficient of a cell, about, at any grid."""


class NormalContactError(ValueError):
    """The data of a normal contact problem admit no solution."""


@dataclass(frozen=True)
class NormalStart:
    """What a solve can start from: pressure [MPa] and its displacement K p [mm], ``(nx, ny)``."""

    pressure: Array
    displacement: Array


@dataclass(frozen=True)
class NormalState:
    """Solution of a normal contact problem.

    ``pressure`` [MPa], ``gap`` [mm] and ``displacement`` (K p, elastic only) [mm] are ``(nx, ny)``;
    ``approach`` is δz [mm], ``tilt_x`` φx and ``tilt_y`` φy [rad]. A tilt that the pressed cells
    cannot feel (they lie on one line or point) is the smallest that fits.
    ``border_load`` is the share of P carried by the outermost cells: above 0, the grid is
    too small. ``message`` is empty when ``converged``, else says what is wrong and what to try.
    """

    pressure: Array
    gap: Array
    displacement: Array
    approach: float
    tilt_x: float
    tilt_y: float
    residuals: NormalResiduals
    converged: bool
    message: str
    method: str
    iterations: int
    convolutions: int
    border_load: float

    @property
    def start(self) -> NormalStart:
        """Start of a next solve on the same grid."""
        return NormalStart(self.pressure, self.displacement)

    @property
    def touches_border(self) -> bool:
        """Whether the contact reaches the outermost cells of the grid."""
        return self.border_load > 0.0


class NormalContact:
    """Normal contact solver on one grid; owns the planned transforms."""

    def __init__(self, grid: Grid, contact_modulus: float, threads: int = 1) -> None:
        """Plan for ``grid`` and E* ``contact_modulus`` [MPa].

        Raises NormalContactError for a grid of fewer than 2 cells or a modulus not above 0.
        """
        if grid.shape[0] * grid.shape[1] < 2:
            raise NormalContactError(f"a grid of {grid.shape} cells is too small: use 2 or more")
        if not contact_modulus > 0.0:
            raise NormalContactError(f"contact modulus {contact_modulus:g} MPa must be positive")
        self.grid = grid
        self.convolution = HalfSpaceConvolution(grid, contact_modulus, threads)
        self._preconditioner = HalfSpacePreconditioner(grid, contact_modulus, threads)
        self._modes = RigidModes(grid)

    def solve(
        self,
        height: Array,
        P: float,
        Mx: float = 0.0,
        My: float = 0.0,
        *,
        tolerance: float = TOLERANCE,
        start: NormalStart | None = None,
        compliance: Array | None = None,
    ) -> NormalState:
        """Pressure, gap and rigid motion under the resultants ``P`` [N], ``Mx``, ``My`` [N mm].

        ``height`` h is the gap before loading ``(nx, ny)`` [mm], ``compliance`` D >= 0
        ``(nx, ny)`` [mm/MPa], ``start`` that of any state on the same grid. Converged means that
        every residual is within ``tolerance``. A state that is not says so in its ``message``.

        Raises NormalContactError for heights or compliances that are not finite or have another
        shape, a negative load, or a moment that no pressure on the grid can carry.
        """
        self._check(height, P, Mx, My, compliance)
        if P == 0.0:
            return self._unloaded(height)
        before = self.convolution.count
        problem = NormalProblem(
            height, self._modes.scaled(P, Mx, My), self._modes, self.convolution, compliance
        )
        iterate, iterations, method = self._solve(problem, start, tolerance)
        return self._state(
            problem, iterate, tolerance, method, iterations, self.convolution.count - before
        )

    # -- steps of solve -----------------------------------------------------------------------
    def _solve(
        self, problem: NormalProblem, start: NormalStart | None, tolerance: float
    ) -> tuple[Iterate, int, str]:
        """Conjugate gradients, then the splitting where they have failed."""
        pressure, displacement = self._start(problem, start)
        self._preconditioner.include(problem.compliance)
        search = bound_conjugate_gradients(
            problem, self._preconditioner, pressure, displacement, tolerance, GRADIENT_ITERATIONS
        )
        if search.converged:
            return search.iterate, search.iterations, "conjugate gradients"
        iterate, iterations = self._split(problem, search.iterate, tolerance)
        return iterate, search.iterations + iterations, "splitting"

    def _start(self, problem: NormalProblem, start: NormalStart | None) -> tuple[Array, Array]:
        """Balanced pressure >= 0 and its displacement, from ``start`` where it can be used."""
        if start is not None and start.pressure.shape != self.grid.shape:
            raise NormalContactError(
                f"start has shape {start.pressure.shape}, the grid {self.grid.shape}: "
                "start from a state on the same grid"
            )
        if start is not None:
            pressure = self._modes.balance(start.pressure, problem.target)
            if pressure is not None and np.array_equal(pressure, start.pressure):
                return pressure, self._with_wear(problem, pressure, start.displacement)
            if pressure is not None:
                return pressure, problem.displacement(pressure)
        pressure = self._uniform(problem)
        return pressure, problem.displacement(pressure)

    @staticmethod
    def _with_wear(problem: NormalProblem, pressure: Array, elastic: Array) -> Array:
        if problem.compliance is None:
            return elastic
        worn: Array = elastic + problem.compliance * pressure
        return worn

    def _uniform(self, problem: NormalProblem) -> Array:
        """Uniform pressure on the largest rectangle of cells centred on the load."""
        P, Mx, My = self._modes.resultants(problem.target)
        near = [
            np.abs(centres - at) <= max(0.5 * size - abs(at), pitch)
            for centres, at, size, pitch in zip(
                (self.grid.x, self.grid.y),
                (-My / P, Mx / P),
                self.grid.size,
                self.grid.pitch,
                strict=True,
            )
        ]
        pressure = self._modes.balance(np.where(near[0] & near[1], 1.0, 0.0), problem.target)
        if pressure is None:
            raise NormalContactError(
                "the load acts too close to the edge of the grid to be balanced: enlarge the grid"
            )
        return pressure

    def _split(
        self, problem: NormalProblem, start: Iterate, tolerance: float
    ) -> tuple[Iterate, int]:
        """Douglas-Rachford splitting from the pressure of ``start``."""
        splitting = _Splitting(problem, self._resolvent)
        state = splitting.padded(start.pressure)
        iterate, iterations, inner = start, 0, tolerance
        for _ in range(SPLITTING_STAGES):
            result = douglas_rachford(
                splitting.elastic_step,
                splitting.local_law,
                state,
                tolerance=inner,
                max_iterations=SPLITTING_ITERATIONS,
            )
            state, inner = result.state, 0.1 * inner
            iterations += result.iterations
            iterate = splitting.iterate(result.solution) or iterate
            if residuals(problem, iterate).largest <= tolerance or not result.converged:
                break
        return iterate, iterations

    @cached_property
    def _resolvent(self) -> HalfSpaceResolvent:
        cell = float(
            normal_influence(
                np.zeros(1), np.zeros(1), self.grid.pitch, self.convolution.contact_modulus
            )[0]
        )
        largest = float(self.convolution.symbol.max())
        shift = SPLITTING_SHIFT * float(np.sqrt(largest * SMALLEST_EIGENVALUE * cell))
        return HalfSpaceResolvent(self.convolution, shift)

    def _state(
        self,
        problem: NormalProblem,
        iterate: Iterate,
        tolerance: float,
        method: str,
        iterations: int,
        convolutions: int,
    ) -> NormalState:
        measured = residuals(problem, iterate)
        converged = measured.largest <= tolerance
        elastic = iterate.displacement
        if problem.compliance is not None:
            elastic = elastic - problem.compliance * iterate.pressure
        approach, tilt_x, tilt_y = (float(c) for c in iterate.rigid / self._modes.lengths)
        return NormalState(
            pressure=iterate.pressure,
            gap=iterate.gap(problem),
            displacement=elastic,
            approach=approach,
            tilt_x=tilt_x,
            tilt_y=tilt_y,
            residuals=measured,
            converged=converged,
            message="" if converged else _failure(measured, tolerance),
            method=method,
            iterations=iterations,
            convolutions=convolutions,
            border_load=_border_share(iterate.pressure),
        )

    def _unloaded(self, height: Array) -> NormalState:
        """No load: the bodies just touch, without tilt."""
        zero = np.zeros(self.grid.shape)
        approach = float(height.min())
        return NormalState(
            pressure=zero,
            gap=height - approach,
            displacement=zero.copy(),
            approach=approach,
            tilt_x=0.0,
            tilt_y=0.0,
            residuals=NormalResiduals(0.0, 0.0, 0.0, 0.0),
            converged=True,
            message="",
            method="no load",
            iterations=0,
            convolutions=0,
            border_load=0.0,
        )

    def _check(
        self, height: Array, P: float, Mx: float, My: float, compliance: Array | None
    ) -> None:
        _check_field("heights", height, self.grid.shape)
        if compliance is not None:
            _check_field("compliances", compliance, self.grid.shape)
            if compliance.min() < 0.0:
                raise NormalContactError(
                    "compliances must be 0 or more: check the wear rate's sign"
                )
        if not all(np.isfinite([P, Mx, My])):
            raise NormalContactError(
                f"resultants {P, Mx, My} must be finite: check the load history"
            )
        if P < 0.0:
            raise NormalContactError(f"load {P:g} N pulls: give P >= 0")
        self._check_moment(P, Mx, My)

    def _check_moment(self, P: float, Mx: float, My: float) -> None:
        """The load must act strictly inside the convex hull of the cell centres."""
        for name, moment, centres in (("Mx", Mx, self.grid.y), ("My", -My, self.grid.x)):
            reach = float(centres.max())
            inside = abs(moment) < P * reach or (moment == 0.0)
            if not inside:
                raise NormalContactError(
                    f"{name} = {abs(moment):g} N mm under P = {P:g} N puts the load outside the "
                    f"cells, over {reach:g} mm off centre: enlarge the grid or lower the moment"
                )


class _Splitting:
    """The two steps of the splitting, on pressures of the zero-padded grid.

    Off the grid the law is p = 0, which is what makes the circulant exact there.
    """

    def __init__(self, problem: NormalProblem, resolvent: HalfSpaceResolvent) -> None:
        self._problem, self._resolvent = problem, resolvent
        self._shift = resolvent.shift
        self._height = self.padded(problem.height)
        modes = problem.modes.shapes.reshape(3, *problem.height.shape)
        self._columns = np.stack([resolvent.solve(self.padded(mode)) for mode in modes])
        self._inverse = np.linalg.pinv(self._sums(self._columns).T)
        compliance = 0.0 if problem.compliance is None else problem.compliance
        self._yield = self._shift / (self._shift + compliance)

    def padded(self, field: Array) -> Array:
        """``field`` ``(nx, ny)`` continued by zero to the padded grid."""
        out = np.zeros(self._resolvent.padded)
        out[: field.shape[0], : field.shape[1]] = field
        return out

    def _on_grid(self, field: Array) -> Array:
        nx, ny = self._problem.height.shape
        return field[..., :nx, :ny]

    def _sums(self, field: Array) -> Array:
        """Products with the three modes, ``(..., 3)``."""
        on_grid = self._on_grid(field)
        sums: Array = on_grid.reshape(*on_grid.shape[:-2], -1) @ self._problem.modes.shapes.T
        return sums

    def elastic_step(self, state: Array) -> Array:
        """``(K + ρ)⁻¹ (ρ s - h + rigid)`` with the rigid motion that meets the resultants."""
        pressure = self._resolvent.solve(self._shift * state - self._height)
        rigid = self._inverse @ (self._problem.target - self._sums(pressure))
        met: Array = pressure + np.tensordot(rigid, self._columns, 1)
        return met

    def local_law(self, trial: Array) -> Array:
        """``max(0, ρ y / (ρ + D))`` on the grid and 0 off it."""
        return self.padded(unilateral(self._on_grid(trial)) * self._yield)

    def iterate(self, solution: Array) -> Iterate | None:
        """Balanced pressure with the rigid motion that makes Σ p g vanish for every mode."""
        problem = self._problem
        pressure = problem.modes.balance(self._on_grid(solution).copy(), problem.target)
        if pressure is None:
            return None
        displacement = problem.displacement(pressure)
        weighted = problem.modes.shapes * pressure.ravel()
        lifted = weighted @ (problem.height + displacement).ravel()
        rigid = np.linalg.pinv(weighted @ problem.modes.shapes.T, hermitian=True) @ lifted
        return Iterate(pressure, displacement, rigid)


def _check_field(name: str, field: Array, shape: tuple[int, int]) -> None:
    if field.shape != shape:
        raise NormalContactError(f"{name} have shape {field.shape}: give {shape}, the grid's")
    if not np.all(np.isfinite(field)):
        raise NormalContactError(f"{name} hold NaN or infinity: fill or crop the missing points")


def _border_share(pressure: Array) -> float:
    """Share of the load on the outermost cells, along each direction that has more than two."""
    border = np.zeros(pressure.shape, dtype=bool)
    if pressure.shape[0] > 2:
        border[[0, -1], :] = True
    if pressure.shape[1] > 2:
        border[:, [0, -1]] = True
    return float(pressure[border].sum() / pressure.sum())


def _failure(measured: NormalResiduals, tolerance: float) -> str:
    return (
        f"the normal contact stopped at a residual of {measured.largest:.1e} (penetration "
        f"{measured.penetration:.1e}, complementarity {measured.complementarity:.1e}) above the "
        f"tolerance {tolerance:.0e}: loosen the tolerance, or smooth or refine the heights"
    )
