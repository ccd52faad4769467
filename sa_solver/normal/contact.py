"""Normal contact of two elastic half-spaces on a grid, under imposed forces or motions.

The problem is

    p >= 0,  g = h + K p + D p - δz - φx y + φy x >= 0,  p g = 0
    Σ p S = P,  Σ p y S = Mx,  -Σ p x S = My

where K is the half-space (Love's coefficients), h the gap before loading and D >= 0 an optional
local compliance, as in implicit wear, where D p is the depth worn during the step. One of each pair
δz and P, φx and Mx, φy and My is imposed. Conjugate gradients solve the problem in a few
convolutions. Where they do not converge, slower methods continue from their last pressure.

Source: Gallego, Nélias & Jacq 2006, J. Tribol. 128, 476, doi:10.1115/1.2194914 (the problem).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from sa_solver import checks
from sa_solver.errors import ContactProblemError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.control import NormalContactError as NormalContactError
from sa_solver.normal.control import NormalControl
from sa_solver.normal.hardness import yielding_state
from sa_solver.normal.nested_solver import NestedSolver
from sa_solver.normal.problem import (
    Iterate,
    NormalProblem,
    NormalResiduals,
    Work,
    border_share,
    messages,
    normal_residuals,
)
from sa_solver.normal.separation import separating_tilt
from sa_solver.normal.state import NormalStart, NormalState
from sa_solver.rigid_modes import APPROACH, TILT_X, TILT_Y, NormalModes, mode_lengths
from sa_solver.surfaces.absent_cells import without_absent
from sa_solver.types import Array, Grid

TOLERANCE = 1e-8
"""Default bound on every residual of :class:`NormalResiduals`."""

BALANCED = 1e-12
"""Relative change in a balance below which the pressure was balanced before. Rounding of sums over
a grid is about 1e-15."""


class NormalContact:
    """Solver of normal contact problems on one grid.

    Examples
    --------
    A cylinder on a flat, compared with Hertz:

    >>> from sa_solver import ElasticPair, Grid, HalfSpace, Material, NormalContact
    >>> from sa_solver.reference.hertz import HertzCylinder
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.line_contact(1.0, 256)
    >>> half_space = HalfSpace(grid, ElasticPair(steel, steel))
    >>> hertz = HertzCylinder(200.0, 50.0, half_space.pair.contact_modulus)
    >>> state = NormalContact(half_space).solve(hertz.gap(grid.x), P=200.0)
    >>> print(f"{state.pressure.max():.1f} MPa, Hertz {hertz.peak_pressure:.1f} MPa")
    383.3 MPa, Hertz 383.3 MPa
    >>> half_width = 0.5 * (state.pressure > 0.0).sum() * grid.pitch[0]
    >>> print(f"{half_width:.3f} mm, Hertz {hertz.half_width:.3f} mm")
    0.332 mm, Hertz 0.332 mm
    """

    def __init__(self, half_space: HalfSpace) -> None:
        """Prepare the solver for ``half_space``.

        Raises NormalContactError for a grid of fewer than 2 cells.
        """
        grid = half_space.grid
        if grid.shape[0] * grid.shape[1] < 2:
            raise NormalContactError(f"a grid of {grid.shape} cells is too small: use 2 or more")
        self.grid = grid
        self.half_space = half_space
        self._solver = NestedSolver(half_space)

    def solve(
        self,
        height: Array,
        P: float | None = None,
        Mx: float | None = None,
        My: float | None = None,
        *,
        approach: float | None = None,
        tilt_x: float | None = None,
        tilt_y: float | None = None,
        tolerance: float = TOLERANCE,
        start: NormalStart | None = None,
        compliance: Array | None = None,
        hardness: float | None = None,
    ) -> NormalState:
        """Solve for the pressure, the gap and the unknown motions and resultants.

        Parameters
        ----------
        height
            Gap h before loading ``(nx, ny)`` [mm], large where the surfaces are far apart. It is
            +infinity, or masked, where a body has no surface: such cells never touch, and their gap
            stays infinite. To fill in points that were not measured, use
            :func:`sa_solver.surfaces.scans.filled`.
        P, approach
            Load [N] or approach δz [mm]; one of them is required.
        Mx, tilt_x, My, tilt_y
            Moments [N mm] or tilts φx, φy [rad] about x and y. The tilt is held at 0 where neither
            of a pair is given. ``Mx=0.0, My=0.0`` lets the bodies turn freely, until the load
            passes through the middle of the grid.
        tolerance
            Bound on every residual. The ``message`` of the state says if it is not met.
        start
            Initial guess, from any state on the same grid.
        compliance
            Local compliance D >= 0 ``(nx, ny)`` [mm/MPa].
        hardness
            Largest pressure [MPa] that the softer surface bears before it flattens:
            :mod:`sa_solver.normal.hardness`. Not together with ``compliance``.

        Raises
        ------
        NormalContactError
            For heights or compliances that are NaN, not numbers or of another shape, both of a
            force and its motion, neither ``P`` nor ``approach``, a negative load, or a load or
            moment that no pressure on the grid can carry.

        Examples
        --------
        A ball 0.1 mm off the middle of its grid, with its tilt held and free:

        >>> from sa_solver import ElasticPair, Grid, HalfSpace, NormalContact
        >>> grid = Grid.covering((1.0, 1.0), (32, 32))
        >>> contact = NormalContact(HalfSpace(grid, ElasticPair.from_contact_modulus(115e3)))
        >>> height = ((grid.x - 0.1) ** 2 + grid.y**2) / 20.0
        >>> held, free = contact.solve(height, P=10.0), contact.solve(height, P=10.0, Mx=0, My=0)
        >>> print(f"My {held.My:.2f} N mm, tilt {held.tilt_y:.3f}; tilt {free.tilt_y:.3f} rad")
        My -1.00 N mm, tilt 0.000; tilt 0.010 rad
        """
        height = checked_heights(height, self.grid)
        compliance = None if compliance is None else checked_compliance(compliance, self.grid)
        self._check_start(start)
        tolerance = checks.number("tolerance", tolerance, above=0.0, error=NormalContactError)
        control = NormalControl(P, Mx, My, approach, tilt_x, tilt_y)
        if self.half_space.periodic:
            _check_periodic(height, control)
        control.check_moments(self.grid)

        def elastic(
            height: Array, control: NormalControl, start: NormalStart | None
        ) -> NormalState:
            def pressed(height: Array) -> NormalState:
                return self._pressed(height, control, tolerance, start, compliance)

            delta, tilt_x, tilt_y = map(float, control.motions)
            imposed = float(control.resultants[0]), delta, tilt_x, tilt_y
            return without_absent(height, self.half_space, imposed, pressed, NormalContactError)

        if hardness is None:
            return elastic(height, control, start)
        hardness = checks.number("hardness", hardness, above=0.0, error=NormalContactError)
        if compliance is not None:
            raise NormalContactError("hardness and compliance are both given: give one of them")
        return yielding_state(elastic, self.half_space, height, control, hardness, start)

    # -- steps of solve -----------------------------------------------------------------------
    def _pressed(
        self,
        height: Array,
        control: NormalControl,
        tolerance: float,
        start: NormalStart | None,
        compliance: Array | None,
    ) -> NormalState:
        """Return the state for finite heights."""
        # Heights relative to the lowest point keep the digits of a small displacement.
        lowest = float(height.min()) if APPROACH in control.free else 0.0
        problem = self._problem(height - lowest, control, compliance)
        apart = _separated(problem)
        if apart is None:
            pressure, displacement = self._start(problem, start)
            iterate, method = self._solver.solve(problem, pressure, displacement, tolerance)
            residuals = normal_residuals(problem, iterate)
        else:
            zero = np.zeros(self.grid.shape)
            iterate, method = Iterate(zero, zero.copy(), apart), "no load"
            residuals = NormalResiduals(0.0, 0.0, 0.0, 0.0, 0.0)
        state = self._state(problem, control, iterate, residuals, tolerance)
        return replace(state, approach=state.approach + lowest, method=method)

    def _problem(
        self, height: Array, control: NormalControl, compliance: Array | None
    ) -> NormalProblem:
        """Return the problem for the free motions, with imposed motions subtracted from heights."""
        modes = NormalModes.on(self.grid, control.free)
        target = control.sums(self.grid, modes.free)
        delta, phi_x, phi_y = control.motions
        if delta or phi_x or phi_y:
            height = height - (delta + phi_x * self.grid.y - phi_y * self.grid.x)
        return NormalProblem(height, target, modes, self.half_space, compliance, Work())

    def _start(
        self, problem: NormalProblem, start: NormalStart | None
    ) -> tuple[Array, Array | None]:
        """Return a balanced pressure >= 0, from ``start`` if possible, and its displacement.

        The displacement is None where it is not known.
        """
        if start is not None and start.pressure.any():
            pressure = problem.modes.balance(start.pressure, problem.target)
            if pressure is not None:
                change = np.abs(pressure - start.pressure).max()
                if change <= BALANCED * start.pressure.max():
                    local = problem.local_displacement(start.pressure)
                    return start.pressure, start.displacement + local
                return pressure, None
        cold = self._solver.cold_start(problem)
        if cold is None:
            raise NormalContactError(
                "no pressure can balance the load, which acts too close to the edge of the grid: "
                "enlarge the grid"
            )
        return cold, None

    def _state(
        self,
        problem: NormalProblem,
        control: NormalControl,
        iterate: Iterate,
        residuals: NormalResiduals,
        tolerance: float,
    ) -> NormalState:
        converged = residuals.largest <= tolerance
        motions, free = control.motions, list(problem.modes.free)
        motions[free] = iterate.rigid / mode_lengths(self.grid)[free]
        force = iterate.pressure * self.grid.cell_area
        along_x, along_y = force.sum(axis=1), force.sum(axis=0)
        border_load = 0.0 if self.half_space.periodic else border_share(iterate.pressure)
        failure = "" if converged else _failure(problem, iterate, residuals, tolerance)
        transformed = sum(count * nx * ny for (nx, ny), count in problem.work.items())
        return NormalState(
            pressure=iterate.pressure,
            gap=iterate.gap(problem),
            displacement=iterate.displacement - problem.local_displacement(iterate.pressure),
            approach=float(motions[0]),
            tilt_x=float(motions[1]),
            tilt_y=float(motions[2]),
            P=float(along_x.sum()),
            Mx=float(along_y @ self.grid.y[0]),
            My=float(along_x @ -self.grid.x[:, 0]),
            residuals=residuals,
            converged=converged,
            message=messages(failure, border_load),
            convolutions=int(np.ceil(transformed / np.prod(self.half_space.padded))),
            border_load=border_load,
            cell_area=self.grid.cell_area,
        )

    def _check_start(self, start: NormalStart | None) -> None:
        pressure: Any = getattr(start, "pressure", None)
        given, shape = np.shape(pressure), self.grid.shape
        if start is not None and given != shape:
            raise NormalContactError(
                f"start has the shape {given} and the grid {shape}: start from a state on the same "
                "grid"
            )


def _separated(problem: NormalProblem) -> Array | None:
    """Return free motions ``(k,)`` for which the bodies do not press, or None if they press."""
    if problem.target.any():
        return None
    if APPROACH not in problem.modes.free:
        return separating_tilt(problem.height, problem.modes)
    touching = np.zeros(len(problem.modes.free))
    touching[0] = problem.height.min()
    return touching


def _check_periodic(height: Array, control: NormalControl) -> None:
    """Raise NormalContactError for what a periodic contact cannot do."""
    free, (delta, *tilts) = control.free, control.motions
    if any(tilts) or TILT_X in free or TILT_Y in free:
        raise NormalContactError("a periodic contact does not turn: leave out moments and tilts")
    if APPROACH not in free and delta >= (mean := float(height.mean())):
        raise NormalContactError(
            f"a periodic contact is full at an approach of {mean:g} mm, the mean of its heights, "
            "under any larger load: impose P instead"
        )


def checked_heights(
    height: Array, grid: Grid, error: type[ContactProblemError] = NormalContactError
) -> Array:
    """Return heights on ``grid``, infinite where masked, or raise ``error`` for invalid ones."""
    return checks.array("heights", height, grid.shape, error=error, masked=np.inf, infinite=True)


def checked_compliance(
    compliance: Array, grid: Grid, error: type[ContactProblemError] = NormalContactError
) -> Array:
    """Return compliances on ``grid``, or raise ``error`` for invalid ones."""
    compliance = checks.array("compliances", compliance, grid.shape, error=error)
    if compliance.min() < 0.0:
        raise error("compliances must be 0 or more: check the sign of the wear rate")
    return compliance


def _failure(
    problem: NormalProblem, iterate: Iterate, measured: NormalResiduals, tolerance: float
) -> str:
    largest = float(np.abs(problem.height)[iterate.pressure > 0.0].max(initial=0.0))
    smallest = float(np.spacing(largest)) / tolerance
    depth = float(iterate.displacement.max(initial=0.0))
    if depth < smallest:
        remedy = (
            f"with heights of {largest:.1e} mm in contact, rounding hides the effect of a "
            f"displacement of {depth:.1e} mm: subtract a slope from the heights, raise the load, "
            "or loosen the tolerance"
        )
    else:
        remedy = "loosen the tolerance, or smooth or refine the heights"
    return (
        f"the normal contact stopped at a residual of {measured.largest:.1e} (penetration "
        f"{measured.penetration:.1e}, complementarity {measured.complementarity:.1e}, wear "
        f"{measured.wear:.1e}) above the tolerance {tolerance:.0e}: {remedy}"
    )
