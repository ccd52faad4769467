"""Normal contact of two elastic half-spaces on a grid, under imposed forces or motions.

    p >= 0,  g = h + K p + D p - δz - φx y + φy x >= 0,  p g = 0
    Σ p S = P,  Σ p y S = Mx,  -Σ p x S = My

K is the half-space (Love's coefficients), h the gap before loading and D >= 0 an optional local
compliance: implicit wear, where D p is the depth worn during the step. Of each pair δz and P, φx
and Mx, φy and My one is imposed. Conjugate gradients solve it in a few convolutions; where they do
not converge, a slower splitting takes over from their last pressure.

Source: Gallego, Nélias & Jacq 2006, J. Tribol. 128, 476, doi:10.1115/1.2194914 (the problem).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sa_solver import checks
from sa_solver.errors import ContactProblemError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.control import NormalContactError as NormalContactError
from sa_solver.normal.control import NormalControl
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
from sa_solver.rigid_modes import APPROACH, NormalModes, mode_lengths
from sa_solver.surfaces.absent_cells import without_absent
from sa_solver.types import Array, Grid

TOLERANCE = 1e-8
"""Default bound on every residual of :class:`NormalResiduals`."""

BALANCED = 1e-12
"""Pressures that balancing changes by less than this share of the largest were balanced already:
sums over a grid leave about 1e-15 of rounding."""


@dataclass(frozen=True)
class NormalStart:
    """What a solve can start from: pressure [MPa] and its displacement K p [mm], ``(nx, ny)``."""

    pressure: Array
    displacement: Array


@dataclass(frozen=True)
class NormalState:
    """Solution of a normal contact problem.

    ``pressure`` [MPa], ``gap`` [mm] and ``displacement`` (K p, elastic only) [mm] are ``(nx, ny)``;
    ``approach`` is δz [mm], ``tilt_x`` φx and ``tilt_y`` φy [rad], ``P`` [N], ``Mx`` and ``My``
    [N mm] the resultants of the pressure (per mm on a line grid). A tilt that the pressed cells
    cannot feel (they lie on one line or point) is the smallest that fits.

    ``convolutions`` are in units of one on the whole grid, by the size of their transforms, rounded
    up. (Each iteration also transforms an unpadded field, a quarter of a convolution.)
    ``border_load`` is the share of P carried by the
    outermost cells: above 0, the grid is too small. ``message`` says what is wrong and what to try,
    of a state that has not ``converged`` and of a contact that reaches the grid's border; else it
    is empty. ``cell_area`` [mm²] is that of the grid.
    """

    pressure: Array
    gap: Array
    displacement: Array
    approach: float
    tilt_x: float
    tilt_y: float
    P: float
    Mx: float
    My: float
    residuals: NormalResiduals
    converged: bool
    message: str
    convolutions: int
    border_load: float
    cell_area: float
    method: str = ""

    @property
    def contact_area(self) -> float:
        """Area of the cells in contact [mm²; in a line contact, per mm, its width in mm]."""
        return float(np.count_nonzero(self.pressure)) * self.cell_area

    @property
    def elastic_energy(self) -> float:
        """Energy ½ Σ p u S stored in both bodies [N mm], with their displacement u = K p.

        Between bodies that do not wear it is the work of P and moments since the bodies were apart.
        In a line contact, per mm, it counts up to the datum of the half-space.
        """
        return 0.5 * float(np.vdot(self.pressure, self.displacement)) * self.cell_area

    @property
    def start(self) -> NormalStart:
        """Start of a next solve on the same grid."""
        return NormalStart(self.pressure, self.displacement)

    @property
    def touches_border(self) -> bool:
        """Whether the contact reaches the outermost cells of the grid."""
        return self.border_load > 0.0


class NormalContact:
    """Normal contact solver on one grid; owns the planned transforms.

    Examples
    --------
    A cylinder on a flat, against Hertz:

    >>> from sa_solver import ElasticPair, Grid, HalfSpace, Material, NormalContact
    >>> from sa_solver.reference.hertz import HertzCylinder
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.strips(1.0, 256)
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
        """Plan for ``half_space``.

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
    ) -> NormalState:
        """Pressure, gap and the unknown motions and resultants of a contact.

        Imposed are the load ``P`` [N] or the ``approach`` δz [mm]; about x the moment ``Mx`` [N mm]
        or the tilt ``tilt_x`` φx [rad], about y ``My`` or ``tilt_y``. The bodies do not turn unless
        one of these is given: ``Mx=0.0, My=0.0`` lets them turn freely, until the load passes
        through the middle of the grid.

        ``height`` h is the gap before loading ``(nx, ny)`` [mm], large where the surfaces are far
        from each other, whatever else moves them apart included. It is +infinity, or masked, where
        there is no surface: such cells never touch, and stay at an infinite gap. (Where points were
        only not measured, :func:`sa_solver.surfaces.scans.filled` puts a surface in.)
        ``compliance`` D >= 0 ``(nx, ny)`` [mm/MPa]; ``start`` that of any state on the same grid.
        Converged means that every residual is within ``tolerance``; a state that is not says so in
        its ``message``.

        Raises NormalContactError for heights or compliances that are NaN, no numbers or of another
        shape, both of a force and its motion, neither ``P`` nor ``approach``, a negative load, or a
        moment that no pressure on the grid can carry.

        Examples
        --------
        A ball 0.1 mm off the middle of its grid, held and free to turn:

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
        control.check_moments(self.grid)

        def pressed(height: Array) -> NormalState:
            return self._pressed(height, control, tolerance, start, compliance)

        delta, tilt_x, tilt_y = map(float, control.motions)
        imposed = float(control.resultants[0]), delta, tilt_x, tilt_y
        return without_absent(height, self.half_space, imposed, pressed, NormalContactError)

    # -- steps of solve -----------------------------------------------------------------------
    def _pressed(
        self,
        height: Array,
        control: NormalControl,
        tolerance: float,
        start: NormalStart | None,
        compliance: Array | None,
    ) -> NormalState:
        """The state on finite heights."""
        # Counted from the lowest point, heights keep the digits of a small displacement.
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
            residuals = NormalResiduals(0.0, 0.0, 0.0, 0.0)
        state = self._state(problem, control, iterate, residuals, tolerance)
        return replace(state, approach=state.approach + lowest, method=method)

    def _problem(
        self, height: Array, control: NormalControl, compliance: Array | None
    ) -> NormalProblem:
        """The problem left when imposed motions are taken off the heights."""
        modes = NormalModes.on(self.grid, control.free)
        target = control.sums(self.grid, modes.free)
        delta, phi_x, phi_y = control.motions
        if delta or phi_x or phi_y:
            height = height - (delta + phi_x * self.grid.y - phi_y * self.grid.x)
        return NormalProblem(height, target, modes, self.half_space, compliance, Work())

    def _start(
        self, problem: NormalProblem, start: NormalStart | None
    ) -> tuple[Array, Array | None]:
        """Balanced pressure >= 0, from ``start`` if it can be used; its displacement if known."""
        if start is not None and start.pressure.any():
            pressure = problem.modes.balance(start.pressure, problem.target)
            if pressure is not None:
                change = np.abs(pressure - start.pressure).max()
                if change <= BALANCED * start.pressure.max():
                    kept = start.pressure
                    return kept, start.displacement + problem.yielded(kept)
                return pressure, None
        cold = self._solver.cold_start(problem)
        if cold is None:
            raise NormalContactError(
                "the load acts too close to the edge of the grid to be balanced: enlarge the grid"
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
        border_load = border_share(iterate.pressure)
        failure = "" if converged else _failure(problem, iterate, residuals, tolerance)
        transformed = sum(count * nx * ny for (nx, ny), count in problem.work.items())
        return NormalState(
            pressure=iterate.pressure,
            gap=iterate.gap(problem),
            displacement=iterate.displacement - problem.yielded(iterate.pressure),
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
                f"start has shape {given}, the grid {shape}: start from a state on the same grid"
            )


def _separated(problem: NormalProblem) -> Array | None:
    """Free motions ``(k,)`` at which no pressure is needed, or None where some is."""
    if problem.target.any():
        return None
    if APPROACH not in problem.modes.free:
        return separating_tilt(problem.height, problem.modes)
    touching = np.zeros(len(problem.modes.free))
    touching[0] = problem.height.min()
    return touching


def checked_heights(
    height: Array, grid: Grid, error: type[ContactProblemError] = NormalContactError
) -> Array:
    """Heights on ``grid``, infinite where there is no surface."""
    return checks.array("heights", height, grid.shape, error=error, masked=np.inf, infinite=True)


def checked_compliance(
    compliance: Array, grid: Grid, error: type[ContactProblemError] = NormalContactError
) -> Array:
    """Compliances on ``grid``."""
    compliance = checks.array("compliances", compliance, grid.shape, error=error)
    if compliance.min() < 0.0:
        raise error("compliances must be 0 or more: check the wear rate's sign")
    return compliance


def _failure(
    problem: NormalProblem, iterate: Iterate, measured: NormalResiduals, tolerance: float
) -> str:
    largest = float(np.abs(problem.height)[iterate.pressure > 0.0].max(initial=0.0))
    smallest = float(np.spacing(largest)) / tolerance
    depth = float(iterate.displacement.max(initial=0.0))
    if depth < smallest:
        remedy = (
            f"with heights of {largest:.1e} mm in contact, rounding hides what a displacement of "
            f"{depth:.1e} mm changes: take a slope off the heights, raise the load, or loosen the "
            "tolerance"
        )
    else:
        remedy = "loosen the tolerance, or smooth or refine the heights"
    return (
        f"the normal contact stopped at a residual of {measured.largest:.1e} (penetration "
        f"{measured.penetration:.1e}, complementarity {measured.complementarity:.1e}) above the "
        f"tolerance {tolerance:.0e}: {remedy}"
    )
