"""A tangential loop: press, move to and fro along one axis, and read off what a joint law needs.

The normal load stays while body 1 is moved relative to body 2, by an imposed motion or force along
x or y; it does not turn and does not move across. After first loading whole cycles are marched,
until one closes.

Energy is taken from slip, at the mean pressure of both ends of an increment. Where pressure stays
and slip keeps its direction during a branch (line contacts; areas with ν = 0) a cell slips only
while |q| = µp, so this is that of the grid whatever the number of increments; the loop's area by
trapezoids is less by ½ Σ (q_n - q_n-1)·Δs S, which is of second order in their size.

Stiffness is that of the contact with all pressed cells stuck: the slope right after a reversal, at
which nothing slips (Mindlin 1949). Measuring it from the first increments would add what already
slips in them. For dissimilar bodies pressure follows the motion, P, Mx and My staying.

Source: Mindlin & Deresiewicz 1953, J. Appl. Mech. 20, 327, doi:10.1115/1.4010702 (the loop).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from scipy.ndimage import binary_erosion
from scipy.sparse.linalg import LinearOperator, cg

from sa_solver import checks
from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad, ContactState
from sa_solver.errors import ConvergenceError, InputError
from sa_solver.half_space.influence import Z
from sa_solver.half_space.operator import HalfSpace
from sa_solver.types import Array, Mask

MOST_CYCLES = 4
"""Cycles marched for one that closes. Similar bodies close the first; dissimilar ones forget how
they were pressed once they have slid both ways, and otherwise creep by less from cycle to cycle."""

CLOSED = 1e-3
"""A cycle is closed when the force that ends it is this close to that which began it, in ranges of
the force, or the motion in ranges of the motion: well below what a grid leaves."""

STUCK_TOLERANCE = 1e-10
"""Relative residual of the stuck contact: its stiffness then has twice as many digits."""

STUCK_ITERATIONS = 2000
"""Conjugate gradients of the stuck contact: 40 on 32² cells, 100 on 256², growing with the root."""

LoopAxis = Literal["x", "y"]


class LoopError(InputError):
    """The loop asked for makes no sense."""


class LoopFailure(ConvergenceError):
    """An increment of the loop, or its stuck contact, did not converge."""


@dataclass(frozen=True)
class LoopPath:
    """What is imposed: normal load ``P`` [N], then a motion or a force to and fro.

    ``amplitude`` is a motion [mm] or, with ``by`` ``force``, a force [N], along ``axis``. Each
    branch has ``increments`` of equal size. The bodies do not tilt unless ``moments`` (Mx, My)
    [N mm] are imposed with P. Per mm on line grids, whose Mx is not asked for. Raises
    LoopError for a P or amplitude not above 0 or less than 2 increments.

    Examples
    --------
    To and fro by ±2 µm under 500 N, with 12 increments a branch:

    >>> from sa_solver import LoopPath
    >>> path = LoopPath(P=500.0, amplitude=0.002)
    >>> print(path.by, path.axis, path.increments)
    motion x 12
    >>> LoopPath(P=500.0, amplitude=0.0)
    Traceback (most recent call last):
        ...
    sa_solver.cycles.tangential_loop.LoopError: amplitude = 0: a loop needs one above 0
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
                raise LoopError(f"{name} = {getattr(self, name):g}: a loop needs one above 0")
        if self.increments < 2:
            raise LoopError(f"{self.increments} increments: give a branch of a loop at least 2")

    @property
    def place(self) -> int:
        """Place of the axis among the resultants and motions."""
        return 1 if self.axis == "x" else 2


@dataclass(frozen=True)
class TangentialLoop:
    """A loop and what it says; per mm on line grids.

    ``displacement`` [mm] of body 1 relative to body 2, counted from the pressed state, and
    ``force`` [N] on body 2 are ``(k,)``, both from 0 on: first loading, then cycles of two branches
    of ``increments`` each, of which the last counts. ``energy`` [N mm] is dissipated by slip in it;
    ``stiffness`` [N/mm] is that of the stuck contact; ``sliding`` is the share of P on cells that
    slip as the branches end; ``area`` [mm²] is in contact, ``rim`` [mm²] of it on cells that have a
    neighbour apart. ``border_load`` is the largest share of
    P on the outermost cells: above 0, the grid may be too small. ``closure`` is how far the cycle
    is from closed (``CLOSED``), ``residual`` the largest of the solver.
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
        """First loading from 0: displacement and force, ``(increments + 1,)``."""
        end = self.increments + 1
        return self.displacement[:end], self.force[:end]

    @property
    def cycle(self) -> tuple[Array, Array]:
        """The last cycle: displacement and force, ``(2 increments + 1,)``, back first."""
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
        """∮ Q dδ by trapezoids [N mm]: the energy but for the size of the increments."""
        displacement, force = self.cycle
        return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(displacement)))

    @property
    def slides(self) -> bool:
        """Whether the whole contact slides as the branches end."""
        return self.sliding >= 1.0

    @property
    def friction(self) -> float:
        """``max |Q| / P``: µ where the contact slides, else what is mobilised of it."""
        return float(np.abs(self.cycle[1]).max()) / self.P

    @property
    def friction_by_opening(self) -> float:
        """ΔT / 2P with ΔT between the branches in the middle of the stroke.

        A residual stiffness beside the contact would cancel: this is how µ is measured. It is µ
        where the contact slides by then, less otherwise.
        """
        (down, down_force), (up, up_force) = self._branches
        middle = 0.5 * float(down[0] + down[-1])
        above = np.interp(middle, up, up_force)
        below = np.interp(middle, down[::-1], down_force[::-1])
        return float(abs(above - below)) / (2.0 * self.P)

    @property
    def residual_stiffness(self) -> float:
        """Mean slope of the last increments of both branches [N/mm]; 0 where it slides."""
        return self._mean_slope(-2)

    @property
    def reversal_stiffness(self) -> float:
        """Mean secant of the first increments after both reversals [N/mm].

        What one would measure; it tends to ``stiffness`` as the increments shrink.
        """
        return self._mean_slope(0)

    def _mean_slope(self, increment: int) -> float:
        """Of both branches, from point ``increment`` on."""
        slopes = [
            (force[increment + 1] - force[increment])
            / (displacement[increment + 1] - displacement[increment])
            for displacement, force in self._branches
        ]
        return float(np.mean(slopes))

    @property
    def _branches(self) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Displacement and force on the way back and on the way forth."""
        displacement, force = self.cycle
        n = self.increments
        return (displacement[: n + 1], force[: n + 1]), (displacement[n:], force[n:])


def march_loop(contact: FrictionalContact, height: Array, path: LoopPath) -> TangentialLoop:
    """Press and move to and fro on surfaces that do not wear.

    ``height`` ``(nx, ny)`` [mm] is the gap of the unloaded bodies. Raises LoopFailure where a solve
    does not converge, and what the solvers raise for impossible data: FrictionLimitError for a
    force that friction cannot carry.

    Examples
    --------
    A cylinder under ±60 N/mm, against the closed form of the energy lost:

    >>> from sa_solver import ElasticPair, FrictionalContact, Grid, HalfSpace, LoopPath, Material
    >>> from sa_solver import march_loop
    >>> from sa_solver.reference.hertz import HertzCylinder
    >>> from sa_solver.reference.line_partial_slip import ShearedCylinder
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.strips(1.0, 128)
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
    """Force per motion along the axis with the cells ``pressed`` ``(nx, ny)`` stuck [N/mm].

    Minimises ½ t·K t - Σ t_axis over tractions of these cells whose pressure keeps P and, where
    imposed, the moments: conjugate gradients, projected. Raises LoopFailure if they stall.
    """
    grid, similar = half_space.grid, half_space.pair.similar
    components = 2 if similar else 3
    apply = half_space.shear if similar else half_space.displacement
    kept = _balanced_modes(half_space, pressed, path.moments is not None)

    def project(values: Array) -> Array:
        """The nearest traction on the pressed cells that changes no imposed resultant."""
        tractions = values.reshape(components, -1).copy()
        if not similar:
            tractions[Z] -= kept @ (kept.T @ tractions[Z])
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
    """Tractions ``(c m,)`` of the m cells ``pressed`` that move them by ``motion`` ``(c, m)``.

    ``displace`` takes tractions ``(c, nx, ny)`` to displacements, ``project`` tractions of the
    cells to such as are allowed. Raises LoopFailure where conjugate gradients stall.
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
            "iterations"
        )
    return np.asarray(traction)


def _balanced_modes(half_space: HalfSpace, pressed: Mask, tilting: bool) -> Array:
    """Orthonormal pressures ``(cells, modes)`` whose amounts P, and Mx, My if ``tilting``, fix."""
    grid = half_space.grid
    modes = [np.ones(grid.shape)]
    if tilting:
        modes.append(np.broadcast_to(grid.x, grid.shape))
        if not grid.line:
            modes.append(np.broadcast_to(grid.y, grid.shape))
    columns = np.stack([mode[pressed] for mode in modes], axis=1)
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    # A single row of cells knows no moment about its own line.
    return basis[:, sizes > np.finfo(float).eps * len(columns) * sizes[0]]


def _press(contact: FrictionalContact, height: Array, path: LoopPath) -> ContactState:
    """The pressed state; dissimilar bodies slip meanwhile, so they are pressed in steps."""
    steps = 1 if contact.half_space.pair.similar else path.increments
    tilts = path.moments is None
    motion = (False, False, False, tilts and not contact.grid.line, tilts, False)
    Mx, My = path.moments or (0.0, 0.0)
    state = contact.apart(height)
    for step in range(1, steps + 1):
        values = np.array([path.P, 0.0, 0.0, Mx, My, 0.0]) * (step / steps)
        state = _converged(contact.advance(state, height, ContactLoad(values, motion)))
    return state


def _states(
    contact: FrictionalContact, height: Array, path: LoopPath, pressed: ContactState
) -> Iterator[ContactState]:
    """The pressed state, first loading, and cycles up to one that closes."""
    n = path.increments
    back = np.linspace(1.0, -1.0, n + 1)
    load = _Imposed.after(pressed, path, contact.grid.line)
    state = pressed
    yield state
    for share in np.linspace(0.0, 1.0, n + 1)[1:]:
        state = _converged(contact.advance(state, height, load.at(share)))
        yield state
    for _ in range(MOST_CYCLES):
        cycle = [state]
        for share in (*back[1:], *-back[1:]):
            state = _converged(contact.advance(state, height, load.at(share)))
            cycle.append(state)
            yield state
        if _closure(cycle, path) <= CLOSED:
            return


@dataclass(frozen=True)
class _Imposed:
    """Loads of the loop: ``rest`` is imposed at rest, ``step`` more of it at the amplitude."""

    rest: ContactLoad
    step: Array

    @classmethod
    def after(cls, pressed: ContactState, path: LoopPath, line: bool) -> _Imposed:
        """Guided from the pressed state on: no motion across and no twist."""
        tilts = path.moments is None
        motion = [False, True, True, tilts and not line, tilts, not line]
        motion[path.place] = path.by == "motion"
        values = np.where(motion, pressed.rigid, pressed.resultants)
        # As asked for, not as solved: nothing adds up.
        values[0] = path.P
        if path.moments is not None:
            values[3:5] = path.moments
        if line:
            values[[3, 5]] = 0.0
        step = np.zeros(6)
        step[path.place] = path.amplitude
        return cls(ContactLoad(values, tuple(motion), pressed.strain), step)

    def at(self, share: float) -> ContactLoad:
        """The load at ``share`` of the amplitude."""
        return replace(self.rest, values=self.rest.values + share * self.step)


def _closure(cycle: list[ContactState], path: LoopPath) -> float:
    """What separates the ends of a cycle: of force and motion the one that is not imposed."""
    name = "resultants" if path.by == "motion" else "rigid"
    values = np.array([getattr(state, name)[path.place] for state in cycle])
    extent = float(np.ptp(values))
    return abs(float(values[-1] - values[0])) / extent if extent > 0.0 else 0.0


def _rim_cells(pressed: Mask, line: bool) -> int:
    """Pressed cells with a neighbour that is not, or is off the grid."""
    structure = np.ones((3, 1)) if line else None
    return int(np.count_nonzero(pressed & ~binary_erosion(pressed, structure)))


def _slipping_share(state: ContactState) -> float:
    """Share of the normal force on cells that slip."""
    pressure = state.pressure
    return float(pressure[~state.sticking].sum() / pressure.sum())


def _converged(state: ContactState) -> ContactState:
    if not state.converged:
        raise LoopFailure(state.message)
    return state
