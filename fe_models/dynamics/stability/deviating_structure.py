"""Structure and joints for the propagation of small deviations over a period.

Of a large structure only the low modes are dynamic. All others respond quasi-statically, with the
joints as stiff as at rest; with a finely meshed contact these are nearly all modes. Joints that
behave like these springs are then not followed. The error of this reduction is seen by taking more
modes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import ComplexArray
from fe_models.dynamics.periodic.joints import Deviations
from fe_models.dynamics.periodic.period_times import PeriodTimes
from fe_models.dynamics.periodic.receptance import Receptance
from fe_models.dynamics.stability.monodromy import (
    GivenMotion,
    JointSteps,
    StructureSteps,
    monodromy,
)
from fe_models.dynamics.transient.linear_steps import linear_steps
from sa_solver.types import Array

# Largest number of spring sets that represent the joints in the steps of a period.
MAX_SPRING_SETS = 8
# Stiffness relative to the largest one of the joints below which it is rounding.
STIFFNESS_ROUNDING = 1e-10


@dataclass(frozen=True)
class ModalStructure:
    """Modes of a structure with springs in place of its joints.

    Parameters
    ----------
    squares
        Squared natural frequencies ``(n,)`` [rad²/s²].
    damping
        Modal damping matrix ``(n, n)``.
    at_joints
        Modal displacements of the joints ``(j d, n)``.
    at_points
        Modal displacements of the structure ``(p, n)``.
    reference
        Springs ``(j, d, d)`` in place of the joints.
    residual
        Quasi-static flexibility ``(j d, j d)`` of neglected modes at the joints, or None.
    to_load
        Quasi-static displacement ``(j d, p)`` of the joints due to the load on neglected modes, or
        None.
    """

    squares: Array
    damping: Array
    at_joints: Array
    at_points: Array
    reference: Array
    residual: Array | None
    to_load: Array | None = None

    @classmethod
    def whole(cls, problem: HarmonicBalance) -> ModalStructure:
        """Return all modes of the structure without joints."""
        return cls.without_joints(problem.uniform_receptance, problem.joints.directions)

    @classmethod
    def without_joints(cls, receptance: Receptance, directions: int) -> ModalStructure:
        """Return all modes of a structure, for joints of ``directions`` directions."""
        damping = receptance.damping
        damping = damping if damping.ndim == 2 else np.diag(damping)
        joints = len(receptance.at_joints) // directions
        nothing = np.zeros((joints, directions, directions))
        shapes = receptance.at_joints, receptance.at_points
        return cls(receptance.squares, damping, *shapes, nothing, None)

    @classmethod
    def reduced(cls, problem: HarmonicBalance, count: int) -> ModalStructure:
        """Return the ``count`` lowest modes, with the joints as stiff as at rest."""
        stuck = problem.rest.stuck
        stiffened, shapes = stuck.stiffened, stuck.stiffened.at_points[:, :count]
        others = stiffened.at_joints[:, count:] / stiffened.squares[count:]
        return cls(
            stiffened.squares[:count],
            # Full matrix: damping is defined for the structure without joints, whose modes differ.
            shapes.T @ problem.model.damping @ shapes,
            stiffened.at_joints[:, :count],
            shapes,
            stuck.tangents,
            stiffened.residual_flexibility(count),
            others @ stiffened.at_points[:, count:].T,
        )

    def rates(self, stiffness: Array, scale: Array) -> Array:
        """Return state matrices A ``(s, 2 n, 2 n)`` for ``s`` modal stiffnesses ``(s, n, n)``.

        Displacements are multiplied by a ``scale`` ``(n,)`` [rad/s], so that all rates have about
        one size.
        """
        count = len(scale)
        rates = np.zeros((len(stiffness), 2 * count, 2 * count))
        rates[:, :count, count:] = np.diag(scale)
        rates[:, count:, :count] = -stiffness / scale
        rates[:, count:, count:] = -self.damping
        return rates


def modes_below(problem: HarmonicBalance, angular: float) -> int:
    """Return the number of modes with stuck joints below a frequency [rad/s], at least 1."""
    return int(np.searchsorted(problem.rest.stuck.stiffened.squares, angular**2)) or 1


@dataclass(frozen=True)
class ActiveJoints:
    """Joints that are followed over a period, and constant springs for all others.

    Parameters
    ----------
    active
        Indices ``(a,)`` of the followed joints.
    constant
        Whether each joint ``(j,)`` is a constant spring all period long.
    springs
        These springs ``(j, d, d)``, less those that are part of the structure; 0 for other joints.
    changed
        Whether each state variable ``(a p,)`` of the followed joints changes in the period.
    neutral
        Number of neutral deviations: state variables that do not change, and positions of sliders
        that stick all period long.
    """

    active: np.ndarray
    constant: np.ndarray
    springs: Array
    changed: np.ndarray
    neutral: int

    @classmethod
    def of(
        cls, deviations: Deviations, structure: ModalStructure, every: bool = False
    ) -> ActiveJoints:
        """Classify the joints by their behaviour over one period.

        Parameters
        ----------
        deviations
            Maps of the joints over the period.
        structure
            The structure.
        every
            Whether all joints are followed, or only those that are not constant springs.
        """
        kept, starts, ends = deviations.kept, deviations.by_start, deviations.by_end
        same = _all(deviations.tangent == deviations.tangent[0]) & _all(ends == ends[0])
        holds = same & _all(kept == np.eye(kept.shape[2])) & _all(starts == -ends)
        nothing = _all(kept == 0.0) & _all(starts == 0.0) & _all(ends == 0.0)
        constant = holds | (same & nothing)
        springs = deviations.tangent[0] + deviations.pull @ ends[0] - structure.reference
        springs[~constant] = 0.0
        followed = ~constant | every
        if structure.residual is not None:
            # Quasi-static modes depend on these joints, which have no state variables.
            followed |= springs.any(axis=(1, 2))
        active = np.flatnonzero(followed)
        # State variables that never change in the period store events before it, as an open turning
        # point.
        never = (kept[:, active] == np.eye(kept.shape[2])).all(axis=(0, 3))
        for maps in (starts, ends):
            never &= (maps[:, active] == 0.0).all(axis=(0, 3))
        never[constant[active]] = False
        remembered = deviations.remembered
        numbered = np.arange(kept.shape[2]) < remembered[active, None]
        neutral = int(remembered[holds & ~nothing].sum()) + int((never & numbered).sum())
        return cls(active, constant, springs, ~never.ravel(), neutral)

    def steps(self, deviations: Deviations, structure: ModalStructure) -> JointSteps:
        """Return the maps of the followed joints, less the springs of the structure."""
        active = self.active
        # np.take makes the arrays contiguous whatever their source, so that nothing is compiled
        # again.
        kept, starts, ends, tangent = (
            np.take(maps, active, axis=1)
            for maps in (
                deviations.kept,
                deviations.by_start,
                deviations.by_end,
                deviations.tangent,
            )
        )
        tangent -= structure.reference[active]
        springs = self.constant[active]
        for maps in (kept, starts, ends):
            maps[:, springs] = 0.0
        tangent[:, springs] = self.springs[active][springs]
        kinds = np.zeros(len(kept), np.int64)
        return JointSteps(kinds, kept, starts, ends, deviations.pull[active], tangent)


class DrivenMotion(NamedTuple):
    """Motion under a load.

    Parameters
    ----------
    harmonics
        Numbers of the harmonics ``(k,)``.
    load
        Their complex amplitudes ``(k, p)`` [N] on the structure.
    displacement
        Displacements ``(t, j d)`` [mm] of the joints.
    """

    harmonics: Array
    load: ComplexArray
    displacement: Array


class PeriodMap(NamedTuple):
    """Map of deviations over one period, and the closure error of a driven motion.

    Parameters
    ----------
    matrix
        The map ``(n, n)``.
    closure_error
        State ``(n,)`` by which the motion fails to close.
    history
        Displacements of the joints ``(t, j d, n + 1)`` for each deviation, and for the closure
        error.
    shifts
        Deviations ``(n, s)`` that do not change.
    """

    matrix: Array
    closure_error: Array
    history: Array
    shifts: Array

    @property
    def multipliers(self) -> ComplexArray:
        """Eigenvalues in descending order of magnitude, without those of the shifts."""
        matrix = self.matrix
        if self.shifts.shape[1]:
            # Restrict the matrix to the complement of the shifts: it has all other eigenvalues.
            complement = np.linalg.qr(self.shifts, mode="complete")[0][:, self.shifts.shape[1] :]
            matrix = complement.T @ matrix @ complement
        multipliers = np.linalg.eigvals(matrix)
        return np.asarray(multipliers[np.argsort(-np.abs(multipliers), kind="stable")])

    def corrections(self) -> Array:
        """Return the change of the joints' displacements ``(t, j d)`` with which the motion closes.

        Raises
        ------
        numpy.linalg.LinAlgError
            If numbers are not finite.
        """
        start = np.linalg.lstsq(
            np.eye(len(self.matrix)) - self.matrix, self.closure_error, STIFFNESS_ROUNDING
        )[0]
        return np.asarray(self.history[:, :, :-1] @ start + self.history[:, :, -1])


def period_map(
    structure: ModalStructure,
    frequency: float,
    times: PeriodTimes,
    deviations: Deviations,
    joints: ActiveJoints,
    driven: DrivenMotion | None = None,
    delayed: bool = False,
) -> PeriodMap:
    """Return the map of deviations over one period, and the closure error of a driven motion.

    Parameters
    ----------
    structure
        The structure.
    frequency
        Frequency [Hz] of the motion.
    times
        Steps of the period.
    deviations
        Maps of the joints.
    joints
        Classification of the joints.
    driven
        The motion, or None if no closure error is needed.
    delayed
        Whether joints that become stiffer in the shortest steps do so one of these steps later.
        Events are located to one step only, so that joints are stiff for up to one step too long or
        too short; the comparison shows the effect.
    """
    maps = joints.steps(deviations, structure)
    if delayed:
        before = np.roll(maps.tangent, 1, axis=0)
        stiffer = (maps.tangent - before).sum(axis=(1, 2, 3)) > 0.0
        changed = stiffer & (times.levels == times.deepest)
        maps.tangent[changed] = before[changed]
    columns, history = _integrated_columns(
        structure, frequency, times, (deviations, joints, maps), driven
    )
    count = 2 * len(structure.squares)
    # State variables that a joint never changes have the multiplier 1: drop their rows and columns.
    changed = np.flatnonzero(np.concatenate([np.ones(count, bool), joints.changed]))
    rows = np.where(changed < count, changed, changed + len(columns) - columns.shape[1] + 1)
    matrix = columns[np.ix_(rows, changed)]
    known = history[:-1, :, np.append(changed, -1)] if len(history) else history
    shifts = _shifts(structure, deviations, joints, len(matrix))
    return PeriodMap(matrix, columns[rows, -1], known, shifts)


def _integrated_columns(
    structure: ModalStructure,
    frequency: float,
    times: PeriodTimes,
    of_joints: tuple[Deviations, ActiveJoints, JointSteps],
    driven: DrivenMotion | None,
) -> tuple[Array, Array]:
    """Return the result of :func:`monodromy`: the map of one period, and the history."""
    deviations, joints, maps = of_joints
    stiffness = np.diag(structure.squares)[None]
    scale = np.sqrt(np.maximum(structure.squares, (2.0 * np.pi * frequency) ** 2))
    if structure.residual is None and joints.springs[_not_followed(joints)].any():
        others = np.where(_not_followed(joints)[:, None, None], joints.springs, 0.0)
        stiffness = stiffness + _modal_stiffness(others[None], structure.at_joints)
    if len(joints.active) == 0:
        nothing = np.empty((2 * len(scale), 0))
        rates = structure.rates(stiffness, scale)
        forward = linear_steps(rates, nothing, 1.0 / frequency, 1).forward[0, 0]
        return np.pad(forward, ((0, 0), (0, 1))), np.empty((0, 0, 0))
    directions, levels = deviations.tangent.shape[2], int(times.levels.max()) + 1
    places = (joints.active[:, None] * directions + np.arange(directions)).ravel()
    at_joints = structure.at_joints[places]
    if structure.residual is None:
        residual = np.zeros((len(places), len(places)))
        kinds, spring_sets = _spring_sets(maps)
        stiffness = stiffness + _modal_stiffness(spring_sets, at_joints)
    else:
        residual = structure.residual[np.ix_(places, places)]
        kinds, spring_sets = maps.kinds, np.zeros((1, *maps.tangent.shape[1:]))
    rates, phases = _rates_with_load(
        structure, structure.rates(stiffness, scale), driven, frequency
    )
    padding = ((0, len(phases)), (0, 0))
    inputs = np.pad(np.vstack([np.zeros_like(at_joints.T), -at_joints.T]), padding)
    steps = linear_steps(rates, inputs, 1.0 / (frequency * times.samples), levels)
    in_steps = StructureSteps(
        steps.forward.reshape(-1, *rates.shape[1:]),
        steps.by_start.reshape(-1, *inputs.shape),
        steps.by_end.reshape(-1, *inputs.shape),
        np.repeat(spring_sets, levels, axis=0),
        np.pad(np.hstack([at_joints / scale, np.zeros_like(at_joints)]), padding[::-1]),
        residual,
    )
    count = 2 * len(scale)
    memory = maps.kept.shape[1] * maps.kept.shape[2]
    start = np.eye(len(rates[0]), count + memory + 1)
    start[count:] = 0.0
    start[count:, -1] = phases
    given = _given_motion(structure, times, deviations, driven, places)
    history = np.zeros((0 if driven is None else len(maps.kept) + 1, len(places), start.shape[1]))
    in_order = maps._replace(kinds=levels * kinds + times.levels)
    return np.asarray(monodromy(in_steps, in_order, given, start, history)), history


def _not_followed(joints: ActiveJoints) -> np.ndarray:
    """Return for each joint ``(j,)`` whether it is not followed."""
    others = np.ones(len(joints.springs), bool)
    others[joints.active] = False
    return others


def _rates_with_load(
    structure: ModalStructure, rates: Array, driven: DrivenMotion | None, frequency: float
) -> tuple[Array, Array]:
    """Return state matrices ``(s, k, k)`` with the load as state variables, and their start.

    Each harmonic of the load is the state of a free oscillator, so that a step is exact under the
    load too.
    """
    count = rates.shape[1]
    if driven is None:
        return rates, np.empty(0)
    on_modes = driven.load @ structure.at_points
    loading = on_modes.any(axis=1)
    angular = 2.0 * np.pi * frequency * driven.harmonics[loading]
    amplitudes = on_modes[loading]
    # Scale the load variables so that all rates have about one size.
    unit = np.abs(amplitudes).max(initial=0.0) / np.abs(rates).max()
    whole = np.zeros((len(rates), count + 2 * len(angular), count + 2 * len(angular)))
    whole[:, :count, :count] = rates
    cosines = count + 2 * np.arange(len(angular))
    whole[:, count // 2 : count, cosines] = amplitudes.real.T / unit
    whole[:, count // 2 : count, cosines + 1] = -amplitudes.imag.T / unit
    whole[:, cosines, cosines + 1], whole[:, cosines + 1, cosines] = -angular, angular
    phases = np.zeros(2 * len(angular))
    phases[::2] = unit
    return whole, phases


def _given_motion(
    structure: ModalStructure,
    times: PeriodTimes,
    deviations: Deviations,
    driven: DrivenMotion | None,
    places: np.ndarray,
) -> GivenMotion:
    """Return the joints' displacements and forces at all times of the period."""
    steps = len(deviations.kept)
    if driven is None:
        nothing = np.zeros((steps + 1, len(places)))
        return GivenMotion(nothing, nothing)
    moved, force = driven.displacement, deviations.force.reshape(steps, -1)
    if structure.to_load is not None:
        by_joint = moved.reshape(*deviations.force.shape, 1)
        force = force - (structure.reference @ by_joint).reshape(force.shape)
        # The quasi-static response of the neglected modes to the load is not part of the followed
        # motion.
        turns = np.exp(2j * np.pi * np.outer(times.starts / times.parts, driven.harmonics))
        moved = moved - (turns @ driven.load @ structure.to_load.T).real
    # Rows are contiguous, so that the loops over steps are compiled only once.
    after = np.ix_(np.arange(steps + 1) % steps, places)
    return GivenMotion(moved[after], force[after])


def _shifts(
    structure: ModalStructure, deviations: Deviations, joints: ActiveJoints, size: int
) -> Array:
    """Return deviations ``(size, s)`` that do not change.

    If only sliders hold the structure, it can be displaced as a whole.
    """
    rigid = np.flatnonzero(structure.squares == 0.0)
    if len(rigid) == 0:
        return np.empty((size, 0))
    shapes = structure.at_joints[:, rigid].reshape(len(joints.springs), -1, len(rigid))
    resisted = [joints.springs @ shapes]
    for maps in (deviations.tangent, deviations.by_start + deviations.by_end):
        resisted.extend(maps[:, joints.active] @ shapes[joints.active])
    rows = np.concatenate([part.reshape(-1, len(rigid)) for part in resisted])
    # There is a row for each step and joint; their triangular factor has the same null space.
    triangle = np.linalg.qr(rows, mode="r")
    _, sizes, directions = np.linalg.svd(triangle, full_matrices=True)
    free = np.ones(len(rigid), bool)
    free[: len(sizes)] = sizes <= STIFFNESS_ROUNDING * np.abs(rows).max(initial=1.0)
    shifts = np.zeros((size, int(free.sum())))
    shifts[rigid] = directions[free].T
    return shifts


def _modal_stiffness(tangents: Array, at_joints: Array) -> Array:
    """Return the modal stiffness ``(s, n, n)`` of sets of springs ``(s, j, d, d)``."""
    by_joint = at_joints.reshape(*tangents.shape[1:3], -1)
    pulled = (tangents @ by_joint).reshape(len(tangents), *at_joints.shape)
    return np.asarray(at_joints.T @ pulled)


def _spring_sets(joints: JointSteps) -> tuple[np.ndarray, Array]:
    """Return the index of a spring set for each step, and the sets ``(s, a, d, d)``.

    Each set is close to the tangents of the joints in its steps. Joints that stick, slip and
    separate need few sets; other joints are grouped by their stiffness.
    """
    slopes = joints.tangent + joints.pull @ joints.by_end
    sums = slopes.reshape(len(slopes), -1).sum(axis=1)
    _, kinds = np.unique(sums, return_inverse=True)
    if kinds.max() >= MAX_SPRING_SETS:
        share = (sums - sums.min()) / np.ptp(sums)
        _, kinds = np.unique(np.rint(share * (MAX_SPRING_SETS - 1)), return_inverse=True)
    counts = np.bincount(kinds)
    sets = np.zeros((len(counts), *slopes.shape[1:]))
    np.add.at(sets, kinds, slopes)
    return kinds, sets / counts[:, None, None, None]


def _all(condition: np.ndarray) -> np.ndarray:
    """Return for each joint ``(j,)`` whether a condition ``(t, j, ...)`` always holds."""
    return np.asarray(condition.all(axis=(0, *range(2, condition.ndim))))
