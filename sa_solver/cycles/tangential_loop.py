"""Tangential loop of a contact: press, move back and forth along one axis, and find a joint law.

The normal load is constant while body 1 is moved relative to body 2, by an imposed motion or force
along x or y, without rotation and without transverse motion. After first loading, whole cycles are
marched until one closes.

The energy is computed from slip, with the mean pressure of both ends of an increment. Where the
pressure is constant and slip keeps its direction during a branch (line contacts, and areas with
ν = 0), a cell slips only while |q| = µp. The energy then depends on the grid but not on the number
of increments. The area of the loop by the trapezoidal rule is less by ½ Σ (q_n - q_n-1)·Δs S, which
is of second order in the size of the increments.

The stiffness is that of the contact with all pressed cells stuck, which is the slope immediately
after a reversal (Mindlin 1949). Measured from the first increments it would include their slip. For
dissimilar bodies the pressure changes with the motion while P, Mx and My are constant.

Source: Mindlin & Deresiewicz 1953, J. Appl. Mech. 20, 327, doi:10.1115/1.4010702 (the loop).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, TypeVar, get_args

import numpy as np
from scipy.ndimage import binary_erosion
from scipy.sparse.linalg import LinearOperator, cg

from sa_solver import checks
from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad, ContactState
from sa_solver.errors import ConvergenceError, InputError
from sa_solver.half_space.influence import Z
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.state import NormalState
from sa_solver.types import Array, Mask

State = TypeVar("State", ContactState, NormalState)

MOST_CYCLES = 4
"""Most cycles marched to find one that closes. For similar bodies the first one closes. Dissimilar
bodies forget how they were pressed once they have slid both ways; otherwise they creep by less in
each cycle."""

CLOSED = 1e-3
"""Difference between the force at the end and the start of a cycle, over the range of the force,
below which the cycle counts as closed; or the same of the motion. It is well below the error due to
the grid."""

STUCK_TOLERANCE = 1e-10
"""Relative residual of the stuck contact; its stiffness then has twice as many digits."""

STUCK_ITERATIONS = 2000
"""Most conjugate gradient iterations of the stuck contact. It takes 40 on 32² cells and 100 on
256²; the number grows with the square root of the cells across."""

LoopAxis = Literal["x", "y"]


class LoopError(InputError):
    """Invalid data of a loop."""


class LoopFailure(ConvergenceError):
    """Failure of an increment of a loop, or of its stuck contact, to converge."""


@dataclass(frozen=True)
class LoopPath:
    """Load path of a loop: a normal load, then an oscillating motion or force.

    Forces are per mm on line grids.

    Parameters
    ----------
    P
        Normal load [N].
    amplitude
        Amplitude of the motion [mm] or force [N].
    by
        Whether a ``motion`` or a ``force`` is imposed.
    increments
        Number of increments of each branch, all of equal size.
    axis
        Direction of the motion, ``x`` or ``y``.
    moments
        Moments (Mx, My) [N mm] imposed together with P; without them the bodies do not tilt. On
        line grids Mx does not matter.

    Raises
    ------
    LoopError
        For a P or amplitude that is not above 0, or less than 2 increments.

    Examples
    --------
    An oscillation by ±2 µm under 500 N, with 12 increments per branch:

    >>> from sa_solver import LoopPath
    >>> path = LoopPath(P=500.0, amplitude=0.002)
    >>> print(path.by, path.axis, path.increments)
    motion x 12
    >>> LoopPath(P=500.0, amplitude=0.0)
    Traceback (most recent call last):
        ...
    sa_solver.cycles.tangential_loop.LoopError: amplitude = 0: give a value above 0
    """

    P: float
    amplitude: float
    by: Literal["motion", "force"] = "motion"
    increments: int = 12
    axis: LoopAxis = "x"
    moments: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        checks.choice("by", self.by, ("motion", "force"), LoopError)
        checks.choice("axis", self.axis, get_args(LoopAxis), LoopError)
        for name in ("P", "amplitude"):
            value = checks.number(name, getattr(self, name), infinite=True, error=LoopError)
            checks.settle(self, **{name: value})
        checks.whole("increments of a branch", self.increments, LoopError)
        for name in ("P", "amplitude"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise LoopError(f"{name} = {getattr(self, name):g}: give a value above 0")
        if self.increments < 2:
            raise LoopError(f"{self.increments} increments: give a branch of a loop at least 2")

    @property
    def place(self) -> int:
        """Index of the axis among the resultants and motions."""
        return 1 if self.axis == "x" else 2


@dataclass(frozen=True)
class TangentialLoop:
    """Hysteresis loop of a contact and its properties; forces and areas are per mm on line grids.

    Attributes
    ----------
    P
        Normal load [N].
    increments
        Number of increments of a branch.
    displacement
        Displacement ``(k,)`` [mm] of body 1 relative to body 2 since the pressed state. First
        loading is followed by cycles of two branches each, of which the last one is evaluated.
    force
        Force ``(k,)`` [N] on body 2.
    energy
        Energy [N mm] dissipated by slip in the last cycle.
    stiffness
        Stiffness [N/mm] of the stuck contact.
    sliding
        Share of P on cells that slip at the ends of the branches.
    area, rim
        Area of contact, and its part on cells that have a neighbour out of contact [mm²].
    border_load
        Largest share of P on the outermost cells; above 0 the grid may be too small.
    closure
        Relative distance between the ends of the last cycle: see ``CLOSED``.
    residual, convolutions
        Largest residual of the solver, and cost of the loop in convolutions.
    """

    P: float
    increments: int
    displacement: Array
    force: Array
    energy: float
    stiffness: float
    sliding: float
    area: float
    rim: float
    border_load: float
    closure: float
    residual: float
    convolutions: int

    @property
    def loading(self) -> tuple[Array, Array]:
        """Displacement and force of first loading from 0, each ``(increments + 1,)``."""
        end = self.increments + 1
        return self.displacement[:end], self.force[:end]

    @property
    def cycle(self) -> tuple[Array, Array]:
        """Displacement and force of the last cycle, each ``(2 increments + 1,)``.

        The branch of falling displacement comes first.
        """
        begin = len(self.force) - 2 * self.increments - 1
        return self.displacement[begin:], self.force[begin:]

    @property
    def amplitude(self) -> float:
        """Half the range of the displacement [mm]."""
        return 0.5 * float(np.ptp(self.cycle[0]))

    @property
    def force_amplitude(self) -> float:
        """Half the range of the force [N]."""
        return 0.5 * float(np.ptp(self.cycle[1]))

    @property
    def work(self) -> float:
        """Area ∮ Q dδ of the loop by the trapezoidal rule [N mm].

        It tends to the energy as the increments shrink.
        """
        displacement, force = self.cycle
        return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(displacement)))

    @property
    def slides(self) -> bool:
        """True if the whole contact slides at the ends of the branches."""
        return self.sliding >= 1.0

    @property
    def friction(self) -> float:
        """Mobilised friction ``max |Q| / P``, which is µ where the contact slides."""
        return float(np.abs(self.cycle[1]).max()) / self.P

    @property
    def residual_stiffness(self) -> float:
        """Mean slope of the last increments of both branches [N/mm]; 0 in sliding."""
        slopes = [
            (force[-1] - force[-2]) / (displacement[-1] - displacement[-2])
            for displacement, force in self._branches
        ]
        return float(np.mean(slopes))

    @property
    def _branches(self) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Displacement and force of the falling and of the rising branch."""
        displacement, force = self.cycle
        n = self.increments
        return (displacement[: n + 1], force[: n + 1]), (displacement[n:], force[n:])


def march_loop(contact: FrictionalContact, height: Array, path: LoopPath) -> TangentialLoop:
    """March the loop of a contact on surfaces of gap ``height`` ``(nx, ny)`` [mm], without wear.

    Raises
    ------
    LoopFailure
        If a solve does not converge.
    FrictionLimitError
        For a force that friction cannot carry. Other exceptions of the solvers for impossible data
        may be raised as well.

    Examples
    --------
    The energy dissipated by a cylinder under ±60 N/mm, compared with the closed form:

    >>> from sa_solver import ElasticPair, FrictionalContact, Grid, HalfSpace, LoopPath, Material
    >>> from sa_solver import march_loop
    >>> from sa_solver.reference.hertz import HertzCylinder
    >>> from sa_solver.reference.line_partial_slip import ShearedCylinder
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.line_contact(1.0, 128)
    >>> half_space = HalfSpace(grid, ElasticPair(steel, steel))
    >>> hertz = HertzCylinder(200.0, 50.0, half_space.pair.contact_modulus)
    >>> contact = FrictionalContact(half_space, friction=0.5)
    >>> path = LoopPath(P=200.0, amplitude=60.0, by="force", increments=6)
    >>> loop = march_loop(contact, hertz.gap(grid.x), path)
    >>> exact = ShearedCylinder(hertz, 0.5).loop_energy(60.0)
    >>> print(f"{1e3 * loop.energy:.3f} of {1e3 * exact:.3f} µJ/mm, closed: {loop.closure < 1e-9}")
    5.907 of 5.902 µJ/mm, closed: True
    """
    pressed = _press(contact, height, path)
    states = list(_states(contact, height, path, pressed))
    cycle = states[-2 * path.increments - 1 :]
    motions = np.array([state.rigid[path.place] for state in states])
    forces = np.array([state.resultants[path.place] for state in states])
    middle = cycle[path.increments]
    touching = middle.pressure > 0.0
    return TangentialLoop(
        P=path.P,
        increments=path.increments,
        displacement=motions - pressed.rigid[path.place],
        force=forces,
        energy=float(sum(state.energy.sum() for state in cycle[1:])),
        stiffness=stuck_stiffness(contact.half_space, touching, path),
        sliding=0.5 * (_slipping_share(middle) + _slipping_share(cycle[-1])),
        area=float(np.count_nonzero(touching)) * contact.grid.cell_area,
        rim=_rim_cells(touching, contact.grid.line) * contact.grid.cell_area,
        border_load=max(state.border_load for state in states),
        closure=_closure(cycle, path),
        residual=max(state.residual for state in states),
        convolutions=sum(state.convolutions for state in states),
    )


def stuck_stiffness(half_space: HalfSpace, pressed: Mask, path: LoopPath) -> float:
    """Return the stiffness [N/mm] along the axis with all cells ``pressed`` ``(nx, ny)`` stuck.

    Projected conjugate gradients minimise ½ t·K t - Σ t_axis over tractions of these cells whose
    pressure does not change P or imposed moments. LoopFailure is raised if they stall.
    """
    grid, similar = half_space.grid, half_space.pair.similar
    components = 2 if similar else 3
    apply = half_space.shear if similar else half_space.displacement
    fixed = _fixed_modes(half_space, pressed, path.moments is not None)

    def project(values: Array) -> Array:
        """Return the nearest traction on the pressed cells that changes no imposed resultant."""
        tractions = values.reshape(components, -1).copy()
        if not similar:
            tractions[Z] -= fixed @ (fixed.T @ tractions[Z])
        return tractions.ravel()

    motion = np.zeros((components, np.count_nonzero(pressed)))
    motion[path.place - 1] = 1.0
    traction = tractions_of_motion(apply, pressed, motion, project)
    return float(motion.ravel() @ traction) * grid.cell_area


def tractions_of_motion(
    displace: Callable[[Array], Array],
    pressed: Mask,
    motion: Array,
    project: Callable[[Array], Array] = np.ravel,
) -> Array:
    """Return the tractions ``(c m,)`` of m cells that displace them by a given motion.

    Parameters
    ----------
    displace
        Function from tractions ``(c, nx, ny)`` to displacements.
    pressed
        The m cells with tractions ``(nx, ny)``.
    motion
        Displacement of these cells ``(c, m)`` [mm].
    project
        Projection of tractions of the cells on admissible ones.

    Raises
    ------
    LoopFailure
        If conjugate gradients stall.
    """

    def compliance(values: Array) -> Array:
        field = np.zeros((len(motion), *pressed.shape))
        field[:, pressed] = project(values).reshape(motion.shape)
        return project(displace(field)[:, pressed].ravel())

    operator = LinearOperator((motion.size,) * 2, matvec=compliance, dtype=np.float64)
    traction, status = cg(operator, motion.ravel(), rtol=STUCK_TOLERANCE, maxiter=STUCK_ITERATIONS)
    if status != 0:
        raise LoopFailure(
            f"the stuck contact of {motion.shape[1]} cells did not converge in {STUCK_ITERATIONS} "
            "iterations: take a coarser grid"
        )
    return np.asarray(traction)


def _fixed_modes(half_space: HalfSpace, pressed: Mask, tilting: bool) -> Array:
    """Return orthonormal pressures ``(cells, modes)`` that imposed resultants fix.

    These are P and, if ``tilting``, Mx and My.
    """
    grid = half_space.grid
    modes = [np.ones(grid.shape)]
    if tilting:
        modes.append(np.broadcast_to(grid.x, grid.shape))
        if not grid.line:
            modes.append(np.broadcast_to(grid.y, grid.shape))
    columns = np.stack([mode[pressed] for mode in modes], axis=1)
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    # A single row of cells has no moment about its own line.
    return basis[:, sizes > np.finfo(float).eps * len(columns) * sizes[0]]


def _press(contact: FrictionalContact, height: Array, path: LoopPath) -> ContactState:
    """Return the pressed state.

    Dissimilar bodies are pressed in several steps, because they slip while the load grows.
    """
    steps = 1 if contact.half_space.pair.similar else path.increments
    tilts = path.moments is None
    motion = (False, False, False, tilts and not contact.grid.line, tilts, False)
    Mx, My = path.moments or (0.0, 0.0)
    state = contact.unloaded_state(height)
    for step in range(1, steps + 1):
        values = np.array([path.P, 0.0, 0.0, Mx, My, 0.0]) * (step / steps)
        state = converged(contact.advance(state, height, ContactLoad(values, motion)))
    return state


def _states(
    contact: FrictionalContact, height: Array, path: LoopPath, pressed: ContactState
) -> Iterator[ContactState]:
    """Yield the pressed state, the states of first loading, and of cycles until one closes."""
    n = path.increments
    back = np.linspace(1.0, -1.0, n + 1)
    load = _Imposed.after(pressed, path, contact.grid.line)
    state = pressed
    yield state
    for share in np.linspace(0.0, 1.0, n + 1)[1:]:
        state = converged(contact.advance(state, height, load.at(share)))
        yield state
    for _ in range(MOST_CYCLES):
        cycle = [state]
        for share in (*back[1:], *-back[1:]):
            state = converged(contact.advance(state, height, load.at(share)))
            cycle.append(state)
            yield state
        if _closure(cycle, path) <= CLOSED:
            return


@dataclass(frozen=True)
class _Imposed:
    """Loads of the loop: ``rest`` in the middle and ``step`` more at the amplitude."""

    rest: ContactLoad
    step: Array

    @classmethod
    def after(cls, pressed: ContactState, path: LoopPath, line: bool) -> _Imposed:
        """Return the loads that follow the state ``pressed``.

        The bodies are guided, without transverse motion and twist.
        """
        tilts = path.moments is None
        motion = [False, True, True, tilts and not line, tilts, not line]
        motion[path.place] = path.by == "motion"
        values = np.where(motion, pressed.rigid, pressed.resultants)
        # The values of the path, not the solved ones, so that errors do not accumulate.
        values[0] = path.P
        if path.moments is not None:
            values[3:5] = path.moments
        if line:
            values[[3, 5]] = 0.0
        step = np.zeros(6)
        step[path.place] = path.amplitude
        return cls(ContactLoad(values, tuple(motion), pressed.strain), step)

    def at(self, share: float) -> ContactLoad:
        """Return the load at ``share`` of the amplitude."""
        return replace(self.rest, values=self.rest.values + share * self.step)


def _closure(cycle: list[ContactState], path: LoopPath) -> float:
    """Return the relative distance between the ends of a cycle.

    It is that of the force under an imposed motion, and that of the motion under an imposed force.
    """
    name = "resultants" if path.by == "motion" else "rigid"
    values = np.array([getattr(state, name)[path.place] for state in cycle])
    extent = float(np.ptp(values))
    return abs(float(values[-1] - values[0])) / extent if extent > 0.0 else 0.0


def _rim_cells(pressed: Mask, line: bool) -> int:
    """Return the number of pressed cells with a neighbour that is not pressed or off the grid."""
    structure = np.ones((3, 1)) if line else None
    return int(np.count_nonzero(pressed & ~binary_erosion(pressed, structure)))


def _slipping_share(state: ContactState) -> float:
    """Return the share of the normal force on cells that slip."""
    pressure = state.pressure
    return float(pressure[~state.sticking].sum() / pressure.sum())


def converged(state: State) -> State:
    """Return a state, or raise LoopFailure if it has not converged."""
    if not state.converged:
        raise LoopFailure(state.message)
    return state
