"""Tangential contact of two elastic half-spaces with friction, for a given pressure.

The problem of one increment is

    Δs = K q + offset - Δδ - Δφz (-y, x)
    stick: Δs = 0;  slip: |q| = µp, q opposite to Δs
    Σ q S = (Qx, Qy), Σ (qy x - qx y) S = Mz, or imposed motions Δδx, Δδy, Δφz instead

K couples both directions of shear (Cerruti). The ``offset`` carries the history: it is minus the
displacement of the previous state, plus any other displacement of the surfaces (bulk stress,
pressure on dissimilar bodies). The problem is solved by :mod:`sa_solver.tangential.disk_newton`,
with :mod:`sa_solver.tangential.disk_gradient` as fallback.

Source: Gallego, Nélias & Jacq 2006, J. Tribol. 128, 476, doi:10.1115/1.2194914 (the problem).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sa_solver import checks
from sa_solver.errors import ContactProblemError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.rigid_modes import PlanarModes, Window
from sa_solver.tangential.friction_limit import largest_share
from sa_solver.tangential.problem import TangentialProblem, squared
from sa_solver.traction_state import StickingState
from sa_solver.types import Array, Mask

if TYPE_CHECKING:
    from sa_solver.tangential.disk_newton import DiskSolution
    from sa_solver.tangential.levels import ShearLevel

TOLERANCE = 1e-8
"""Default bound on every residual of :class:`TangentialResiduals`."""

ITERATIONS = 300
"""Most conjugate directions; 10 to 60 are usual, 100 for rough surfaces close to sliding."""

FALLBACK_ITERATIONS = 3000
"""Most projected gradients where Newton's method stalls; 100 to 1000 are usual."""

BOX_STEP = 16
"""Sides of boxes around the pressed cells are multiples of this many cells, so that few transforms
are planned."""

SLIDES = 100.0
"""Ratio of the rigid motion under given forces to the elastic displacement above which the contact
slides. Where ν > 0 turns slip sideways the motion grows with 1/√(1 - Q/µP): it is 11 times
Mindlin's at 1e-6 from the limit, and millimetres due to rounding at the limit itself."""

UNCARRIED = (
    "nothing carries the shear load: no cell is in contact, or the friction coefficient is 0; give "
    "a normal load first, or impose motions instead of forces"
)
"""Message for a shear force or a moment Mz without pressure or without friction."""

NAMES = ("Qx", "Qy", "Mz")
UNITS = ("N", "N", "N mm")


class TangentialContactError(ContactProblemError):
    """Data of a tangential contact problem that admit no solution."""


class FrictionLimitError(TangentialContactError):
    """Shear force that friction cannot carry; ``share`` is the largest share that it can."""

    def __init__(self, share: float, message: str) -> None:
        super().__init__(message)
        self.share = share

    def __reduce__(self) -> tuple[type[FrictionLimitError], tuple[float, str]]:
        """Return how to rebuild the exception after pickling.

        By default it would be rebuilt from its message alone.
        """
        return type(self), (self.share, str(self))


@dataclass(frozen=True)
class TangentialResiduals:
    """Dimensionless residuals of a state, which do not depend on the method of solution.

    The shear itself never exceeds µp.

    Attributes
    ----------
    force
        Largest error of an imposed Qx or Qy over Σ µp S.
    moment
        Error of an imposed Mz over Σ µp S times half the larger side of the grid.
    coulomb
        See :meth:`~sa_solver.tangential.problem.TangentialProblem.residual`.
    """

    force: float
    moment: float
    coulomb: float

    @property
    def largest(self) -> float:
        """Largest of the three residuals."""
        return max(self.force, self.moment, self.coulomb)


@dataclass(frozen=True)
class TangentialState(StickingState):
    """Solution of a tangential contact problem.

    Attributes
    ----------
    shear
        Shear ``(2, nx, ny)`` [MPa].
    slip
        Slip Δs of the increment ``(2, nx, ny)`` [mm], 0 outside the contact.
    displacement
        Elastic displacement K q ``(2, nx, ny)`` [mm].
    sticking
        Cells in contact that stick ``(nx, ny)``.
    shift_x, shift_y, twist
        Rigid motions Δδx, Δδy [mm] and Δφz [rad] of the increment.
    Qx, Qy, Mz
        Resultants of the shear [N, N mm; per mm on a line grid].
    residuals
        Residuals of the state, which do not depend on the method.
    converged
        Whether all residuals are within the tolerance.
    cell_area
        Area of a cell of the grid [mm²].
    message
        What is wrong and what to try, if the state has not ``converged``; empty otherwise.
    convolutions
        Number of convolutions of two components, on a box around the pressed cells.
    """

    shear: Array
    slip: Array
    displacement: Array
    sticking: Mask
    shift_x: float
    shift_y: float
    twist: float
    Qx: float
    Qy: float
    Mz: float
    residuals: TangentialResiduals
    converged: bool
    cell_area: float
    message: str = ""
    convolutions: int = 0

    @property
    def motion(self) -> Array:
        """Rigid motion (Δδx, Δδy, Δφz) of the increment [mm, rad]."""
        return np.array([self.shift_x, self.shift_y, self.twist])

    @property
    def elastic_energy(self) -> float:
        """Elastic energy ½ Σ q·u S of the shear in both bodies [N mm], with u = K q."""
        return 0.5 * float(np.vdot(self.shear, self.displacement)) * self.cell_area


class TangentialContact:
    """Solver of tangential contact problems on one grid.

    Examples
    --------
    A pressed sphere under half of the sliding force, compared with Cattaneo and Mindlin:

    >>> import numpy as np
    >>> from sa_solver import ElasticPair, Grid, HalfSpace, Material, TangentialContact
    >>> from sa_solver.reference.mindlin import ShearedSphere
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.covering((0.5, 0.5), (48, 48))
    >>> sphere = ShearedSphere(load=50.0, radius=10.0, friction=0.5, body_1=steel, body_2=steel)
    >>> limit = 0.5 * sphere.contact.pressure(grid.x, grid.y)
    >>> contact = TangentialContact(HalfSpace(grid, ElasticPair(steel, steel)))
    >>> state = contact.solve(limit, Qx=12.5)
    >>> stick = np.sqrt(state.sticking[limit > 0.0].sum() * grid.cell_area / np.pi)
    >>> print(f"stick radius {stick:.2f} mm, Cattaneo {sphere.stick_radius(12.5):.2f} mm")
    stick radius 0.12 mm, Cattaneo 0.12 mm
    >>> mindlin = sphere.displacement(12.5)
    >>> print(f"moved {1e3 * state.shift_x:.3f} um, Mindlin {1e3 * mindlin:.3f} um")
    moved 0.493 um, Mindlin 0.493 um
    """

    def __init__(self, half_space: HalfSpace) -> None:
        """Prepare the solver for ``half_space``."""
        self.half_space = half_space
        self.grid = half_space.grid
        self._modes = planar_modes(half_space)
        self._levels: dict[tuple[int, int], ShearLevel] = {}

    def solve(
        self,
        limit: Array,
        offset: Array | None = None,
        Qx: float = 0.0,
        Qy: float = 0.0,
        Mz: float = 0.0,
        *,
        shift_x: float | None = None,
        shift_y: float | None = None,
        twist: float | None = None,
        tolerance: float = TOLERANCE,
        start: Array | None = None,
        slipping: Mask | None = None,
    ) -> TangentialState:
        """Solve for the shear and slip of one increment.

        Parameters
        ----------
        limit
            Friction limit µp ``(nx, ny)`` [MPa].
        offset
            Tangential displacement ``(2, nx, ny)`` [mm] without the new tractions and motions; 0 by
            default.
        Qx, Qy, Mz
            Imposed forces [N] and moment [N mm].
        shift_x, shift_y, twist
            Motions [mm, rad] that are imposed instead of Qx, Qy and Mz, where given. A line grid
            and a periodic half-space have no twist.
        tolerance
            Bound on every residual.
        start
            Shear field to begin from ``(2, nx, ny)`` [MPa].
        slipping
            Cells ``(nx, ny)`` that are known to slip; their shear in ``start`` is scaled to its
            limit.

        Raises
        ------
        TangentialContactError
            For fields that are not finite or of another shape, or a negative limit.
        FrictionLimitError
            For a force beyond the largest that friction can carry, or so close to it that the
            contact slides.
        """
        limit, offset = self._checked(limit, offset)
        tolerance = checks.number("tolerance", tolerance, above=0.0, error=TangentialContactError)
        self._check_loads((Qx, Qy, Mz), (shift_x, shift_y, twist))
        motions = [shift_x, shift_y, twist]
        modes = self._modes
        free = tuple(k for k in modes.free if motions[k] is None)
        imposed = np.array([motions[k] or 0.0 for k in modes.free])
        forces = np.array([(Qx, Qy, Mz)[k] for k in modes.free])
        if not limit.any():
            return self._without_contact(forces, free, imposed)
        if not (offset.any() or imposed.any() or forces[list(free)].any()):
            return self._at_rest(limit > 0.0, imposed)
        # Imported here because they load the compiler, which takes a fifth of a second.
        from sa_solver.tangential.disk_gradient import gradients_on_disks
        from sa_solver.tangential.disk_newton import newton_on_disks

        window, level = self._box(limit)
        problem = self._problem(window, level, limit, offset, forces, imposed, free)
        before = level.half_space.count
        if start is not None:
            start = checks.array(
                "shears to start from", start, offset.shape, error=TangentialContactError
            )
        begin, on_circle = _initial_shear(problem, window, start, slipping)
        shear = problem.balanced(begin, on_circle) if on_circle.any() else None
        if shear is None:
            shear = problem.balanced(begin) if begin.any() else level.begin(problem, begin)
        if shear is None:
            raise self._beyond_friction(problem, forces)
        solution = newton_on_disks(problem, shear, tolerance, ITERATIONS)
        if not solution.converged:
            solution = gradients_on_disks(problem, solution.shear, tolerance, FALLBACK_ITERATIONS)
        if _slides(problem, solution):
            raise self._beyond_friction(problem, forces)
        rigid = imposed.copy()
        rigid[list(free)] = solution.rigid / problem.modes.lengths
        convolutions = level.half_space.count - before
        return self._state(problem, solution, window, rigid, tolerance, convolutions)

    # -- steps of solve -----------------------------------------------------------------------
    def _box(self, limit: Array) -> tuple[Window, ShearLevel]:
        """Return a box of cells around the pressed ones, and its operators."""
        from sa_solver.tangential.levels import ShearLevel

        window = []
        for axis, size in enumerate(self.grid.shape):
            if self.half_space.periodic:
                window.append(slice(0, size))
                continue
            pressed = np.flatnonzero(limit.any(axis=1 - axis))
            extent = int(pressed[-1] - pressed[0]) + 1
            length = min(size, -(-extent // BOX_STEP) * BOX_STEP)
            first = min(int(pressed[0]), size - length)
            window.append(slice(first, first + length))
        box = window[0].stop - window[0].start, window[1].stop - window[1].start
        if box not in self._levels:
            half_space = self.half_space
            if box != self.grid.shape:
                half_space = half_space.on(replace(self.grid, shape=box))
            self._levels[box] = ShearLevel(half_space)
        return (window[0], window[1]), self._levels[box]

    def _problem(
        self,
        window: Window,
        level: ShearLevel,
        limit: Array,
        offset: Array,
        forces: Array,
        imposed: Array,
        free: tuple[int, ...],
    ) -> TangentialProblem:
        modes = self._modes.cropped(window)
        moved = offset[:, *window].copy()
        modes.add_motion(moved, -imposed * modes.lengths)
        sums = forces / (modes.lengths * self.grid.cell_area)
        return TangentialProblem(
            limit=np.ascontiguousarray(limit[window]),
            offset=moved,
            modes=modes.only(free),
            target=sums[list(free)],
            operator=level.operator,
        )

    def _state(
        self,
        problem: TangentialProblem,
        solution: DiskSolution,
        window: Window,
        rigid: Array,
        tolerance: float,
        convolutions: int,
    ) -> TangentialState:
        slip = problem.slip(solution.displacement, solution.rigid)
        shear = self._field(solution.shear, window)
        free = problem.modes.free
        errors = np.zeros(3)
        sums = problem.modes.sums(solution.shear)
        errors[list(free)] = np.abs(sums - problem.target) / problem.largest
        residuals = TangentialResiduals(
            float(errors[:2].max()), float(errors[2]), solution.residual
        )
        converged = residuals.largest <= tolerance
        sticking = np.zeros(self.grid.shape, dtype=bool)
        sticking[window] = problem.pressed & ~solution.slipping
        motions = np.append(rigid, 0.0)
        sums = self._modes.sums(shear) * self._modes.lengths
        loads = np.append(sums * self.grid.cell_area, 0.0)
        whole = solution.shear.shape == shear.shape
        return TangentialState(
            shear=shear,
            slip=self._field(slip * problem.pressed, window),
            displacement=solution.displacement if whole else self.half_space.shear(shear),
            sticking=sticking,
            shift_x=float(motions[0]),
            shift_y=float(motions[1]),
            twist=float(motions[2]),
            Qx=float(loads[0]),
            Qy=float(loads[1]),
            Mz=float(loads[2]),
            residuals=residuals,
            converged=converged,
            cell_area=self.grid.cell_area,
            message="" if converged else _failure(residuals, tolerance),
            convolutions=convolutions,
        )

    def _field(self, part: Array, window: Window) -> Array:
        """Return ``part`` on the whole grid ``(2, nx, ny)``, with 0 outside the ``window``."""
        field = np.zeros((2, *self.grid.shape))
        field[:, *window] = part
        return field

    def _without_contact(
        self, forces: Array, free: tuple[int, ...], imposed: Array
    ) -> TangentialState:
        """Return the state of bodies that are apart, without shear and slip."""
        if forces[list(free)].any():
            raise FrictionLimitError(0.0, UNCARRIED)
        return self._at_rest(np.zeros(self.grid.shape, dtype=bool), imposed)

    def _at_rest(self, sticking: Mask, imposed: Array) -> TangentialState:
        """Return the state without shear and slip, where no load or motion shears the bodies."""
        zero = np.zeros((2, *self.grid.shape))
        motions = np.append(imposed, 0.0)
        return TangentialState(
            shear=zero,
            slip=zero.copy(),
            displacement=zero.copy(),
            sticking=sticking,
            shift_x=float(motions[0]),
            shift_y=float(motions[1]),
            twist=float(motions[2]),
            Qx=0.0,
            Qy=0.0,
            Mz=0.0,
            residuals=TangentialResiduals(0.0, 0.0, 0.0),
            converged=True,
            cell_area=self.grid.cell_area,
        )

    def _beyond_friction(self, problem: TangentialProblem, forces: Array) -> FrictionLimitError:
        pressed, free = problem.pressed, problem.modes.free
        shapes = problem.modes.fields()[:, :, pressed]
        share = largest_share(problem.limit[pressed], shapes, problem.target)
        given, largest = (listed(free, scale * forces[list(free)]) for scale in (1.0, share))
        return FrictionLimitError(
            share,
            f"friction cannot carry {given} without sliding; the largest in this direction is "
            f"{largest}: lower the force, raise the pressure, or impose the sliding motion or its "
            "energy instead",
        )

    def _checked(self, limit: Array, offset: Array | None) -> tuple[Array, Array]:
        """Return limits and offsets, checked."""
        shape, error = self.grid.shape, TangentialContactError
        limit = checks.array("limits", limit, shape, error=error)
        if limit.min() < 0.0:
            raise TangentialContactError(
                "limits µp must be 0 or more: check the sign of friction and pressure"
            )
        if offset is None:
            return limit, np.zeros((2, *shape))
        return limit, checks.array("offsets", offset, (2, *shape), error=error)

    def _check_loads(
        self,
        forces: tuple[float, float, float],
        motions: tuple[float | None, float | None, float | None],
    ) -> None:
        given = dict(zip(NAMES, forces, strict=True))
        named = zip(("shift_x", "shift_y", "twist"), motions, strict=True)
        given |= {name: motion for name, motion in named if motion is not None}
        for name, value in given.items():
            checks.number(name, value, error=TangentialContactError)
        if (self.grid.line or self.half_space.periodic) and (forces[2] != 0.0 or motions[2]):
            raise TangentialContactError(
                "line and periodic contacts carry no Mz and have no twist: give Qx and Qy only, or "
                "shifts"
            )


def planar_modes(half_space: HalfSpace) -> PlanarModes:
    """Return the rigid motions in the plane of a contact; a periodic one does not turn."""
    modes = PlanarModes.on(half_space.grid)
    return modes.only(modes.free[:2]) if half_space.periodic else modes


def listed(places: Sequence[int], forces: Array) -> str:
    """Return shear forces and moment with their indices ``places``, 0 to 2, as text."""
    pairs = zip(places, forces, strict=True)
    return ", ".join(f"{NAMES[k]} = {force:.6g} {UNITS[k]}" for k, force in pairs)


def _initial_shear(
    problem: TangentialProblem, window: Window, start: Array | None, slipping: Mask | None
) -> tuple[Array, Mask]:
    """Return the shear to begin from on the ``window``, and the cells on their circle."""
    shear = np.zeros_like(problem.offset)
    if start is None:
        return shear, np.zeros_like(problem.pressed)
    shear += start[:, *window] * problem.pressed
    if slipping is None:
        return shear, np.zeros_like(problem.pressed)
    magnitude = np.sqrt(squared(shear))
    on_circle = np.asarray(slipping, dtype=bool)[window] & (magnitude > 0.0)
    shear *= np.divide(problem.limit, magnitude, out=np.ones_like(magnitude), where=on_circle)
    return shear, on_circle


def _slides(problem: TangentialProblem, solution: DiskSolution) -> bool:
    """Return whether all cells slip and the forces do not determine the motion."""
    if not solution.slipping[problem.pressed].all():
        return False
    rigid = np.zeros_like(problem.offset)
    problem.modes.add_motion(rigid, solution.rigid)
    elastic = solution.displacement + problem.offset
    moved, strained = (float(squared(u)[problem.pressed].max()) for u in (rigid, elastic))
    return moved > SLIDES**2 * strained


def _failure(residuals: TangentialResiduals, tolerance: float) -> str:
    return (
        f"the tangential contact stopped at a residual of {residuals.largest:.1e} (stick and slip "
        f"{residuals.coulomb:.1e}, force {residuals.force:.1e}) above the tolerance "
        f"{tolerance:.0e}: loosen the tolerance, take smaller increments, or refine the grid"
    )
