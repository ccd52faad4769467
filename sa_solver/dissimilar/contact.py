"""Contact of dissimilar bodies, whose pressure and shear are solved together.

Between dissimilar bodies, pressure displaces the surfaces tangentially and shear displaces them
normally (:mod:`sa_solver.dissimilar.problem` states the problem of one increment). Alternating
between the normal and the tangential problem slows down with µ times Dundurs' β and fails from
µβ = 1. Here both are one problem, solved by Newton's method (:mod:`sa_solver.dissimilar.newton`).
Where Newton's method fails, Douglas-Rachford splitting (:mod:`sa_solver.dissimilar.splitting`) is
used, which is slower but converges more often. The friction limit depends on the pressure, so that
there is no minimum principle and no proof of convergence. Results therefore carry residuals that do
not depend on the method.

Source: Gallego, Nélias & Jacq 2006, J. Tribol. 128, 476, doi:10.1115/1.2194914 (the problem).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sa_solver import checks
from sa_solver.contact_law import sticking
from sa_solver.dissimilar.levels import CoupledLevel, pressed_without_friction
from sa_solver.dissimilar.problem import CoupledProblem, CoupledResiduals, coupled_residuals
from sa_solver.dissimilar.splitting import CoupledSplitting
from sa_solver.errors import ContactProblemError
from sa_solver.half_space.influence import Z
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact, checked_compliance, checked_heights
from sa_solver.normal.problem import border_share, messages
from sa_solver.rigid_modes import NORMAL, PLANAR, RESULTANTS, RigidModes
from sa_solver.splitting import douglas_rachford
from sa_solver.surfaces.absent_cells import without_absent
from sa_solver.tangential.contact import UNCARRIED, FrictionLimitError, listed
from sa_solver.tangential.friction_limit import largest_share
from sa_solver.traction_state import TractionState
from sa_solver.types import Array, Mask

TOLERANCE = 1e-8
"""Default bound on every residual of :class:`CoupledResiduals`."""

NEWTON_ITERATIONS = 200
"""Most directions of Newton's method; 10 to 35 are usual, 150 on lines with µ far below β."""

ROUNDS = 4
"""Most searches in ever larger boxes."""

ITERATIONS = 2000
"""Most iterations of the splitting. It takes 40 to 110 on spheres and punches (µ 0.005 to 1, β up
to 0.5), 200 within 0.1 % of sliding, up to 1000 on lines of 1024 cells with µ below 0.02."""

CHUNK = 400
"""Iterations after which the load is compared with the largest that friction can carry."""

LOST = 1e-2
"""Residual above which the splitting is restarted then, once, from the frictionless pressure. Slow
searches are below this value. On rough heights far above the elastic displacement, resting on three
cells, others still had 0.4 to 0.9 after 2000 iterations and took 70 to 310 after the restart."""

TIGHTENING, TIGHTEST = 0.1, 1e-4
"""Factor by which the tolerance of the splitting is lowered until the residuals of the state are
met, and the lowest tolerance, as a share of the given one. The residual of the splitting does not
bound those of the state."""

OVERLOAD = 0.999
"""Share of a load that friction must be able to carry, else the load is refused. The pressure of a
search that has not converged is not more accurate than this."""

BARELY = 1.001
"""Ratio of the largest load to the given one below which the contact is close to sliding. The
motion is then hardly determined, and the splitting converges slowly."""

FEW_CELLS = 8
"""Cells in contact below which a contact can hardly carry moments, so that the splitting is slow.
Random rough contacts that failed had 0 to 3 cells."""

ALL_FORCES = (False,) * 6
"""Motion switches for which all resultants are imposed."""

TILTS = (3, 4)
"""Indices of Mx and My among the resultants."""


class CoupledContactError(ContactProblemError):
    """Data of a coupled contact problem that admit no solution."""


@dataclass(frozen=True)
class CoupledContactState(TractionState):
    """Solution of one increment.

    ``traction`` (qx, qy, p) [MPa] and ``displacement`` K t [mm] are ``(3, nx, ny)``; the ``slip``
    Δs of the increment [mm], 0 outside the contact, is ``(2, nx, ny)``; ``gap`` [mm] and
    ``sticking``, the cells in contact that do not slip, are ``(nx, ny)``. ``resultants`` are (P,
    Qx, Qy, Mx, My, Mz) [N, N mm]. ``rigid`` are the motions (δz, δx, δy, φx, φy, φz) [mm, rad], of
    which δx, δy and φz are those of the increment. ``border_load`` is the share of P on the
    outermost cells; above 0 the grid is too small. ``cell_area`` [mm²] is the area of a cell.
    ``message`` says what is wrong and what to try, if the state has not ``converged`` or the
    contact reaches the border of the grid; otherwise it is empty. ``convolutions`` is the cost in
    convolutions of three components on the whole grid, by the size of the transforms, rounded up.
    Transforms of unpadded fields, a quarter of a convolution per iteration, are not counted.
    """

    traction: Array
    displacement: Array
    slip: Array
    gap: Array
    rigid: Array
    resultants: Array
    residuals: CoupledResiduals
    border_load: float
    sticking: Mask
    cell_area: float
    converged: bool = False
    message: str = ""
    iterations: int = 0
    convolutions: int = 0

    @property
    def start(self) -> Array:
        """Initial guess for the next solve on the same grid."""
        return self.traction

    @property
    def touches_border(self) -> bool:
        """True if the outermost cells of the grid carry load."""
        return self.border_load > 0.0


class CoupledContact:
    """Solver of contact problems of dissimilar bodies with friction, on one grid.

    Examples
    --------
    A cylinder pressed on a rigid flat. With friction its surface sticks in the middle, and the
    pressure is higher than Hertz's:

    >>> from sa_solver import CoupledContact, ElasticPair, Grid, HalfSpace, Material
    >>> from sa_solver.reference.hertz import HertzCylinder
    >>> rigid, titanium = Material(float("inf"), 0.3), Material(young=115e3, poisson=0.29)
    >>> grid = Grid.line_contact(1.2, 128)
    >>> half_space = HalfSpace(grid, ElasticPair(rigid, titanium))
    >>> hertz = HertzCylinder(400.0, 50.0, half_space.pair.contact_modulus)
    >>> for friction in (0.0, 0.5):
    ...     contact = CoupledContact(half_space, friction)
    ...     state = contact.solve(hertz.gap(grid.x), None, [400.0, 0, 0, 0, 0, 0])
    ...     print(f"µ = {friction}: {state.pressure.max() / hertz.peak_pressure:.3f} of Hertz")
    µ = 0.0: 1.000 of Hertz
    µ = 0.5: 1.081 of Hertz
    """

    def __init__(self, half_space: HalfSpace, friction: float) -> None:
        """Prepare the solver for ``half_space`` and the coefficient of ``friction`` µ.

        Raises CoupledContactError for a µ below 0 or not finite.
        """
        friction = checks.number("friction", friction, least=0.0, error=CoupledContactError)
        self.half_space, self.friction = half_space, friction
        self.grid = half_space.grid
        self._modes = RigidModes(half_space.grid)
        self._level = CoupledLevel(half_space)

    def solve(
        self,
        height: Array,
        offset: Array | None,
        values: Array | Sequence[float],
        motion: tuple[bool, ...] = ALL_FORCES,
        *,
        tolerance: float = TOLERANCE,
        start: Array | None = None,
        compliance: Array | None = None,
    ) -> CoupledContactState:
        """Solve for the tractions and motions at the end of one increment.

        Parameters
        ----------
        height
            Gap before loading ``(nx, ny)`` [mm], infinite or masked where a body has no surface.
        offset
            Imposed mismatch minus the displacement of the previous state ``(2, nx, ny)`` [mm].
        values, motion
            Resultants P, Qx, Qy [N], Mx, My, Mz [N mm] or, where ``motion`` is true, the conjugate
            motions δz, δx, δy [mm], φx, φy, φz [rad]. Moments of 0 let the bodies turn; to hold
            them, impose tilts φx and φy of 0.
        tolerance
            Bound on every residual.
        start
            Initial guess: tractions ``(3, nx, ny)`` of any state on the same grid.
        compliance
            Compliance D ``(nx, ny)`` [mm/MPa], which adds D p to the gap.

        Raises
        ------
        CoupledContactError
            For invalid fields, a negative load, or moments that the cells cannot carry.
        FrictionLimitError
            For a shear force above µP.
        """
        error, shape = CoupledContactError, self.grid.shape
        height = checked_heights(height, self.grid, error)
        if compliance is not None:
            compliance = checked_compliance(compliance, self.grid, error)
        if offset is not None:
            offset = checks.array("offsets", offset, (2, *shape), error=error)
        tolerance = checks.number("tolerance", tolerance, above=0.0, error=error)
        if np.shape(values) != (6,) or np.shape(motion) != (6,):
            raise error("give six values, for P, Qx, Qy, Mx, My and Mz, and six truth values")
        values = checks.array("values", values, (6,), error=error)
        self._check(values, motion)

        def pressed(height: Array) -> CoupledContactState:
            problem = self._problem(height, offset, values, motion, compliance)
            apart = self._apart(problem)
            state = self._unloaded(problem) if apart else self._search(problem, tolerance, start)
            return replace(state, message=messages(state.message, state.border_load))

        delta, *tilts = (float(values[k]) if motion[k] else 0.0 for k in NORMAL)
        imposed = 0.0 if motion[0] else float(values[0]), delta, tilts[0], tilts[1]
        return without_absent(height, self.half_space, imposed, pressed, error)

    # -- steps of solve -----------------------------------------------------------------------
    def _search(
        self, problem: CoupledProblem, tolerance: float, start: Array | None
    ) -> CoupledContactState:
        """Solve by Newton's method and, where it fails, by the splitting from its last state."""
        if start is not None and start.shape != problem.offset.shape:
            raise CoupledContactError("start is from another grid: give a state on the same grid")
        before = self._level.transformed
        solution, iterations, verified = None, 0, 0
        guess, missed = self._guess(problem, start), None
        while guess is not None and verified < ROUNDS:
            remaining = NEWTON_ITERATIONS - iterations
            found = self._level.search(problem, guess, tolerance, remaining, missed)
            solution = self._state(problem, found.traction, found.rigid)
            iterations, verified = iterations + found.iterations, verified + 1
            guess = found.traction, found.slipping
            # The search does not see the gap outside its box.
            missed = solution.gap < -tolerance * solution.displacement[Z].max()
            if not (found.converged and (missed & (solution.pressure == 0.0)).any()):
                break
        transformed = self._level.transformed - before
        convolutions = verified + int(np.ceil(transformed / np.prod(self.half_space.padded)))
        if solution is None or solution.residuals.largest > tolerance:
            solution = self._split(problem, tolerance, solution)
        else:
            solution = replace(solution, converged=True)
        return replace(
            solution,
            iterations=iterations + solution.iterations,
            convolutions=convolutions + solution.convolutions,
        )

    def _guess(self, problem: CoupledProblem, start: Array | None) -> tuple[Array, Mask] | None:
        """Return tractions and slipping cells as initial guess, or None if there are none."""
        if start is not None and start[Z].any():
            guess = self._level.near(problem, start)
            if guess is not None:
                return guess
        return self._level.begin(problem)

    def _split(
        self, problem: CoupledProblem, tolerance: float, last: CoupledContactState | None
    ) -> CoupledContactState:
        """Iterate the splitting until the residuals of its solution are met, or it fails."""
        before = self.half_space.count
        whole, free = self._splitting, list(problem.free)
        splitting = whole.of(problem)
        if last is not None and np.isfinite(last.residuals.largest):
            state = self._splitting_state(problem, last)
        else:
            state = whole.touching(problem)
        inner, iterations, message, restarted = tolerance, 0, "", False
        while True:
            result = douglas_rachford(
                splitting.elastic_step,
                splitting.local_law,
                state,
                tolerance=inner,
                max_iterations=min(CHUNK, ITERATIONS - iterations),
            )
            state, iterations = result.state, iterations + result.iterations
            rigid = np.zeros(6)
            rigid[free] = splitting.rigid
            solution = self._state(problem, whole.resolvent.on_grid(result.solution), rigid)
            converged = solution.residuals.largest <= tolerance
            if converged:
                break
            if not result.converged:
                message = self._overload(problem, solution)
                if not (message or restarted or solution.residuals.largest <= LOST):
                    state, restarted = self._pressed(problem), True
            elif inner > TIGHTEST * tolerance:
                inner *= TIGHTENING
            else:
                message = self._failure(problem, solution, tolerance)
            if iterations >= ITERATIONS or not np.all(np.isfinite(state)):
                message = message or self._failure(problem, solution, tolerance)
            if message:
                break
        return replace(
            solution,
            converged=converged,
            message=message,
            iterations=iterations,
            convolutions=self.half_space.count - before,
        )

    def _splitting_state(self, problem: CoupledProblem, last: CoupledContactState) -> Array:
        """Return the state of the splitting that corresponds to the ``last`` solution."""
        slip = problem.relative(last.traction, last.displacement, self._free(problem, last.rigid))
        slip[Z] -= problem.compliance * last.pressure
        return self._splitting.state(last.traction, slip)

    def _free(self, problem: CoupledProblem, rigid: Array) -> Array:
        """Return the part of the motions ``rigid`` ``(6,)`` [mm, rad] that is free [mm]."""
        return np.asarray(rigid * self._modes.lengths - problem.imposed)

    @cached_property
    def _splitting(self) -> CoupledSplitting:
        return CoupledSplitting(self.half_space, self.friction, self._modes)

    def _problem(
        self,
        height: Array,
        offset: Array | None,
        values: Array,
        motion: tuple[bool, ...],
        compliance: Array | None,
    ) -> CoupledProblem:
        modes = self._modes
        imposed = np.where(motion, values * modes.lengths, 0.0)
        if not motion[0]:
            # Relative to the state in which the bodies touch, a small motion keeps its digits.
            imposed[0] = height.min()
        free = tuple(k for k in modes.present if not motion[k])
        moved = np.zeros((3, *self.grid.shape))
        moved[:Z] = 0.0 if offset is None else offset
        moved[Z] = height
        return CoupledProblem(
            half_space=self.half_space,
            modes=modes,
            friction=self.friction,
            offset=moved - modes.motion(imposed),
            imposed=imposed,
            free=free,
            target=(values / (modes.lengths * self.grid.cell_area))[list(free)],
            compliance=0.0 if compliance is None else compliance,
        )

    def _state(self, problem: CoupledProblem, traction: Array, rigid: Array) -> CoupledContactState:
        """Return the state with these tractions and free motions, not marked as converged."""
        displacement = self.half_space.displacement(traction)
        relative = problem.relative(traction, displacement, rigid)
        return CoupledContactState(
            traction=traction,
            displacement=displacement,
            slip=np.where(traction[Z] > 0.0, relative[:Z], 0.0),
            gap=relative[Z],
            rigid=(rigid + problem.imposed) / self._modes.lengths,
            resultants=self._modes.resultants(traction),
            residuals=coupled_residuals(problem, traction, displacement, relative),
            border_load=border_share(traction[Z]),
            sticking=sticking(traction, self.friction),
            cell_area=self.grid.cell_area,
        )

    def _pressed(self, problem: CoupledProblem) -> Array:
        """Return the state of the splitting for the bodies pressed without friction."""
        pressed = pressed_without_friction(problem, self._normal)
        traction, elastic = np.zeros((2, *problem.offset.shape))
        traction[Z] = pressed.pressure
        elastic[Z] = pressed.gap - problem.compliance * pressed.pressure
        return self._splitting.state(traction, elastic)

    @cached_property
    def _normal(self) -> NormalContact:
        return NormalContact(self.half_space)

    @staticmethod
    def _apart(problem: CoupledProblem) -> bool:
        """Return whether the bodies are unloaded: P is 0, or the imposed motions leave a gap."""
        if problem.load is not None:
            return problem.load == 0.0
        tilting = TILTS[0] in problem.free or TILTS[1] in problem.free
        return not tilting and float(problem.offset[Z].min()) >= 0.0

    def _unloaded(self, problem: CoupledProblem) -> CoupledContactState:
        """Return the unloaded state: the bodies just touch, or are apart by imposed motions."""
        if any(value for k, value in zip(problem.free, problem.target, strict=True) if k in PLANAR):
            raise FrictionLimitError(0.0, UNCARRIED)
        traction = np.zeros((3, *self.grid.shape))
        rigid = np.zeros(6)
        if problem.load is not None:
            rigid[0] = problem.offset[Z].min()
        return replace(
            self._state(problem, traction, rigid),
            residuals=CoupledResiduals(*[0.0] * 5),
            converged=True,
            border_load=0.0,
        )

    def _failure(
        self, problem: CoupledProblem, state: CoupledContactState, tolerance: float
    ) -> str:
        measured, cells = state.residuals, np.count_nonzero(state.pressure)
        remedy = "take smaller increments, loosen the tolerance, or smooth or refine the heights"
        if cells < FEW_CELLS:
            remedy = f"only {cells} cells carry the load, refine the grid or smooth the heights"
        elif self._overload(problem, state, BARELY):
            remedy = (
                "the shear load is all that friction can carry, within 0.1 %, lower it or impose "
                "the sliding motion instead"
            )
        return (
            f"the contact of dissimilar bodies stopped at a residual of {measured.largest:.1e} "
            f"(stick and slip {measured.coulomb:.1e}, penetration {measured.penetration:.1e}, "
            f"force {measured.force:.1e}) above the tolerance {tolerance:.0e}: {remedy}"
        )

    def _overload(
        self, problem: CoupledProblem, state: CoupledContactState, least: float = OVERLOAD
    ) -> str:
        """Return a message if friction under the pressure of ``state`` carries too little load."""
        limit = self.friction * state.pressure
        planar = [k for k in problem.free if k in PLANAR]
        target = np.array([problem.target[problem.free.index(k)] for k in planar])
        resolved = np.all(np.isfinite(limit)) and np.count_nonzero(limit) >= FEW_CELLS
        if not (resolved and target.any()):
            return ""
        shapes = np.array([self._modes.motion(np.eye(6)[k])[:Z] for k in planar])
        share = largest_share(limit.ravel(), shapes.reshape(len(planar), 2, -1), target)
        if share >= least:
            return ""
        forces = target * (self._modes.lengths * self.grid.cell_area)[planar]
        places = [PLANAR.index(k) for k in planar]
        given, largest = (listed(places, scale * forces) for scale in (1.0, share))
        return (
            f"friction cannot carry {given}; under the pressure found the largest in this "
            f"direction is {largest}: lower the force, or impose the sliding motion instead"
        )

    # -- checks -------------------------------------------------------------------------------
    def _check(self, values: Array, motion: tuple[bool, ...]) -> None:
        for k, name in enumerate(RESULTANTS):
            if k not in self._modes.present and values[k] != 0.0:
                raise CoupledContactError(
                    f"{name} or its motion has no meaning on this grid (a line contact or a "
                    "single row of cells): give 0"
                )
        if not motion[0]:
            self._check_load(values, motion)

    def _check_load(self, values: Array, motion: tuple[bool, ...]) -> None:
        """Raise an error for loads that no pressure with the resultant P can carry."""
        load = values[0]
        if load < 0.0:
            raise CoupledContactError(f"load P = {load:g} N pulls: give P >= 0")
        for k, centres in zip(TILTS, (self.grid.y, self.grid.x), strict=True):
            reach = float(centres.max())
            if not motion[k] and values[k] != 0.0 and not abs(values[k]) < load * reach:
                raise CoupledContactError(
                    f"{RESULTANTS[k]} = {values[k]:g} N mm under P = {load:g} N puts the load "
                    f"outside the cells, more than {reach:g} mm off centre: enlarge the grid or "
                    "lower the moment"
                )
        planar = [k for k in (1, 2) if not motion[k]]
        shear = float(np.hypot.reduce(values[planar])) if planar else 0.0
        largest = self.friction * load
        if shear > largest:
            raise FrictionLimitError(
                largest / shear,
                f"friction cannot carry a shear force of {shear:.6g} N; the largest is µP = "
                f"{largest:.6g} N: lower the force, or impose the sliding motion instead",
            )
