"""A structure with joints whose small deviations are followed: its modes, and what joints do to it.

Of a large structure the low modes move, and all others answer as at rest, with the joints as stiff
as they are there: with a finely meshed contact that is nearly all of them. Joints that do as these
springs do then have no part in it. What is left out this way is seen by taking more modes.
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

# Sets of springs, at most, that joints are taken as in the steps of a period.
MOST_SETS = 8
# Share of the largest stiffness of joints that is rounding.
RESISTING = 1e-10


@dataclass(frozen=True)
class ModalStructure:
    """Modes ``(n,)`` of the natural frequencies' ``squares`` with their ``damping`` ``(n, n)``.

    ``at_joints`` ``(j d, n)`` are their displacements there, and ``at_points`` ``(p, n)`` those of
    the structure, with springs ``reference`` ``(j, d, d)`` for joints. Modes left out answer forces
    of joints at once, by ``residual`` ``(j d, j d)``, and the load by ``to_load`` ``(j d, p)``;
    without any these are None.
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
        """All modes, without joints."""
        return cls.without_joints(problem.alone, problem.joints.directions)

    @classmethod
    def without_joints(cls, receptance: Receptance, directions: int) -> ModalStructure:
        """All modes of a structure on joints of so many directions."""
        damping = receptance.damping
        damping = damping if damping.ndim == 2 else np.diag(damping)
        joints = len(receptance.at_joints) // directions
        nothing = np.zeros((joints, directions, directions))
        shapes = receptance.at_joints, receptance.at_points
        return cls(receptance.squares, damping, *shapes, nothing, None)

    @classmethod
    def reduced(cls, problem: HarmonicBalance, count: int) -> ModalStructure:
        """So many low modes, with joints as stiff as at rest."""
        stuck = problem.rest.stuck
        stiffened, shapes = stuck.stiffened, stuck.stiffened.at_points[:, :count]
        others = stiffened.at_joints[:, count:] / stiffened.squares[count:]
        return cls(
            stiffened.squares[:count],
            # Not only that of each mode: damping is that of the structure without joints.
            shapes.T @ problem.model.damping @ shapes,
            stiffened.at_joints[:, :count],
            shapes,
            stuck.tangents,
            stiffened.residual_flexibility(count),
            others @ stiffened.at_points[:, count:].T,
        )

    def rates(self, stiffness: Array, scale: Array) -> Array:
        """A ``(s, 2 n, 2 n)`` for sets of ``stiffness`` ``(s, n, n)``.

        Displacements are in units of velocities, by a ``scale`` ``(n,)`` [rad/s]: then rates are of
        about one size.
        """
        count = len(scale)
        rates = np.zeros((len(stiffness), 2 * count, 2 * count))
        rates[:, :count, count:] = np.diag(scale)
        rates[:, count:, :count] = -stiffness / scale
        rates[:, count:, count:] = -self.damping
        return rates


def modes_below(problem: HarmonicBalance, angular: float) -> int:
    """How many modes, with joints as stiff as at rest, are slower than that [rad/s]."""
    return int(np.searchsorted(problem.rest.stuck.stiffened.squares, angular**2)) or 1


@dataclass(frozen=True)
class ActiveJoints:
    """Joints that are followed, by number ``(a,)``, and what is known of all.

    Those that are ``constant`` ``(j,)`` all period long are the ``springs`` ``(j, d, d)``, less
    those that the structure has. Of what active joints remember some is ``changed`` ``(a p,)`` in
    the period; what is not, and where other sliders are, is ``neutral``: so many numbers.
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
        """Classify what joints do over one period: ``every`` one, or those that need it."""
        kept, starts, ends = deviations.kept, deviations.by_start, deviations.by_end
        same = _all(deviations.tangent == deviations.tangent[0]) & _all(ends == ends[0])
        holds = same & _all(kept == np.eye(kept.shape[2])) & _all(starts == -ends)
        nothing = _all(kept == 0.0) & _all(starts == 0.0) & _all(ends == 0.0)
        constant = holds | (same & nothing)
        springs = deviations.tangent[0] + deviations.pull @ ends[0] - structure.reference
        springs[~constant] = 0.0
        followed = ~constant | every
        if structure.residual is not None:
            # Modes left out depend on them: they are joints that remember nothing.
            followed |= springs.any(axis=(1, 2))
        active = np.flatnonzero(followed)
        # What is not changed remembers what was before all periods, as an open turning point.
        never = (kept[:, active] == np.eye(kept.shape[2])).all(axis=(0, 3))
        for maps in (starts, ends):
            never &= (maps[:, active] == 0.0).all(axis=(0, 3))
        never[constant[active]] = False
        remembered = deviations.remembered
        numbered = np.arange(kept.shape[2]) < remembered[active, None]
        neutral = int(remembered[holds & ~nothing].sum()) + int((never & numbered).sum())
        return cls(active, constant, springs, ~never.ravel(), neutral)

    def steps(self, deviations: Deviations, structure: ModalStructure) -> JointSteps:
        """Their maps, with forces less those of springs that the structure has."""
        active = self.active
        # Taken, they are in rows whatever they come from: for others all is compiled again.
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


class Driven(NamedTuple):
    """A motion under its ``load`` ``(k, p)`` of the ``harmonics`` ``(k,)`` on the structure [N],
    with displacements ``moved`` ``(t, j d)`` of joints [mm]."""

    harmonics: Array
    load: ComplexArray
    moved: Array


class Deviating(NamedTuple):
    """What a period makes of deviations: the ``matrix`` ``(n, n)``, and of a motion that is driven
    what it ``lacks`` ``(n,)`` to come round, with the ``course`` ``(t, j d, n + 1)`` of joints.

    ``shifts`` ``(n, s)`` are deviations that stay as they are.
    """

    matrix: Array
    lacks: Array
    course: Array
    shifts: Array

    @property
    def multipliers(self) -> ComplexArray:
        """Eigenvalues by size, without the neutral ones."""
        matrix = self.matrix
        if self.shifts.shape[1]:
            # On what is left of the space beside them: it has all other eigenvalues.
            rest = np.linalg.qr(self.shifts, mode="complete")[0][:, self.shifts.shape[1] :]
            matrix = rest.T @ matrix @ rest
        multipliers = np.linalg.eigvals(matrix)
        return np.asarray(multipliers[np.argsort(-np.abs(multipliers), kind="stable")])

    def corrections(self) -> Array:
        """How the displacements of joints ``(t, j d)`` would change for the motion to come round.

        Raises ``numpy.linalg.LinAlgError`` for what is not finite.
        """
        begin = np.linalg.lstsq(np.eye(len(self.matrix)) - self.matrix, self.lacks, RESISTING)[0]
        return np.asarray(self.course[:, :, :-1] @ begin + self.course[:, :, -1])


def deviating(
    structure: ModalStructure,
    frequency: float,
    times: PeriodTimes,
    deviations: Deviations,
    joints: ActiveJoints,
    driven: Driven | None = None,
    late: bool = False,
) -> Deviating:
    """Return how one period of a frequency [Hz] maps deviations, and a motion that is ``driven``.

    Joints that become stiffer in the shortest steps do so one of these steps ``late``, if so: as
    they are found to a step, they are as stiff as that for a step too long or too short.
    """
    maps = joints.steps(deviations, structure)
    if late:
        before = np.roll(maps.tangent, 1, axis=0)
        stiffer = (maps.tangent - before).sum(axis=(1, 2, 3)) > 0.0
        changed = stiffer & (times.levels == times.deepest)
        maps.tangent[changed] = before[changed]
    columns, course = _columns(structure, frequency, times, (deviations, joints, maps), driven)
    count = 2 * len(structure.squares)
    # What a joint never changes is 1 by itself: a row and a column of it.
    changed = np.flatnonzero(np.concatenate([np.ones(count, bool), joints.changed]))
    rows = np.where(changed < count, changed, changed + len(columns) - columns.shape[1] + 1)
    matrix = columns[np.ix_(rows, changed)]
    known = course[:-1, :, np.append(changed, -1)] if len(course) else course
    shifts = _shifts(structure, deviations, joints, len(matrix))
    return Deviating(matrix, columns[rows, -1], known, shifts)


def _columns(
    structure: ModalStructure,
    frequency: float,
    times: PeriodTimes,
    of_joints: tuple[Deviations, ActiveJoints, JointSteps],
    driven: Driven | None,
) -> tuple[Array, Array]:
    """The result of :func:`monodromy`: the map of one period, and its course."""
    deviations, joints, maps = of_joints
    stiffness = np.diag(structure.squares)[None]
    scale = np.sqrt(np.maximum(structure.squares, (2.0 * np.pi * frequency) ** 2))
    if structure.residual is None and joints.springs[_others(joints)].any():
        others = np.where(_others(joints)[:, None, None], joints.springs, 0.0)
        stiffness = stiffness + _projected(others[None], structure.at_joints)
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
        kinds, alike = _alike(maps)
        stiffness = stiffness + _projected(alike, at_joints)
    else:
        residual = structure.residual[np.ix_(places, places)]
        kinds, alike = maps.kinds, np.zeros((1, *maps.tangent.shape[1:]))
    rates, phases = _loaded(structure, structure.rates(stiffness, scale), driven, frequency)
    beside = ((0, len(phases)), (0, 0))
    inputs = np.pad(np.vstack([np.zeros_like(at_joints.T), -at_joints.T]), beside)
    steps = linear_steps(rates, inputs, 1.0 / (frequency * times.samples), levels)
    in_steps = StructureSteps(
        steps.forward.reshape(-1, *rates.shape[1:]),
        steps.by_start.reshape(-1, *inputs.shape),
        steps.by_end.reshape(-1, *inputs.shape),
        np.repeat(alike, levels, axis=0),
        np.pad(np.hstack([at_joints / scale, np.zeros_like(at_joints)]), beside[::-1]),
        residual,
    )
    count = 2 * len(scale)
    memory = maps.kept.shape[1] * maps.kept.shape[2]
    begin = np.eye(len(rates[0]), count + memory + 1)
    begin[count:] = 0.0
    begin[count:, -1] = phases
    given = _given(structure, times, deviations, driven, places)
    course = np.zeros((0 if driven is None else len(maps.kept) + 1, len(places), begin.shape[1]))
    in_order = maps._replace(kinds=levels * kinds + times.levels)
    return np.asarray(monodromy(in_steps, in_order, given, begin, course)), course


def _others(joints: ActiveJoints) -> np.ndarray:
    """Joints ``(j,)`` that are not followed."""
    others = np.ones(len(joints.springs), bool)
    others[joints.active] = False
    return others


def _loaded(
    structure: ModalStructure, rates: Array, driven: Driven | None, frequency: float
) -> tuple[Array, Array]:
    """Rates ``(s, k, k)`` with the harmonics of a load as further numbers, and these at first.

    Each is the state of a free oscillator, so that a step is exact under the load too.
    """
    count = rates.shape[1]
    if driven is None:
        return rates, np.empty(0)
    on_modes = driven.load @ structure.at_points
    loading = on_modes.any(axis=1)
    angular = 2.0 * np.pi * frequency * driven.harmonics[loading]
    amplitudes = on_modes[loading]
    # A number for each in units that leave all rates of about one size.
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


def _given(
    structure: ModalStructure,
    times: PeriodTimes,
    deviations: Deviations,
    driven: Driven | None,
    places: np.ndarray,
) -> GivenMotion:
    """Return what the joints do in the motion at these places, from its beginning to its end."""
    steps = len(deviations.kept)
    if driven is None:
        nothing = np.zeros((steps + 1, len(places)))
        return GivenMotion(nothing, nothing)
    moved, force = driven.moved, deviations.force.reshape(steps, -1)
    if structure.to_load is not None:
        by_joint = moved.reshape(*deviations.force.shape, 1)
        force = force - (structure.reference @ by_joint).reshape(force.shape)
        # What modes left out do under the load is no motion of those that are followed.
        turns = np.exp(2j * np.pi * np.outer(times.starts / times.parts, driven.harmonics))
        moved = moved - (turns @ driven.load @ structure.to_load.T).real
    after = np.arange(steps + 1) % steps
    return GivenMotion(moved[after][:, places], force[after][:, places])


def _shifts(
    structure: ModalStructure, deviations: Deviations, joints: ActiveJoints, size: int
) -> Array:
    """Deviations ``(size, s)`` that stay as they are: where only sliders hold the structure, it
    may be displaced as a whole."""
    rigid = np.flatnonzero(structure.squares == 0.0)
    if len(rigid) == 0:
        return np.empty((size, 0))
    shapes = structure.at_joints[:, rigid].reshape(len(joints.springs), -1, len(rigid))
    resisted = [joints.springs @ shapes]
    for maps in (deviations.tangent, deviations.by_start + deviations.by_end):
        resisted.extend(maps[:, joints.active] @ shapes[joints.active])
    rows = np.concatenate([part.reshape(-1, len(rigid)) for part in resisted])
    # There are as many rows as increments times joints: their triangle has the same directions.
    triangle = np.linalg.qr(rows, mode="r")
    _, sizes, directions = np.linalg.svd(triangle, full_matrices=True)
    free = np.ones(len(rigid), bool)
    free[: len(sizes)] = sizes <= RESISTING * np.abs(rows).max(initial=1.0)
    shifts = np.zeros((size, int(free.sum())))
    shifts[rigid] = directions[free].T
    return shifts


def _projected(tangents: Array, at_joints: Array) -> Array:
    """Stiffness ``(s, n, n)`` of sets of springs ``(s, j, d, d)`` in terms of modes."""
    by_joint = at_joints.reshape(*tangents.shape[1:3], -1)
    pulled = (tangents @ by_joint).reshape(len(tangents), *at_joints.shape)
    return np.asarray(at_joints.T @ pulled)


def _alike(joints: JointSteps) -> tuple[np.ndarray, Array]:
    """For each increment the number of a set of springs, and these sets ``(s, a, d, d)``, each near
    to what the joints are in its increments.

    Joints that stick, slip and part have few; others are told apart by their stiffness.
    """
    slopes = joints.tangent + joints.pull @ joints.by_end
    sums = slopes.reshape(len(slopes), -1).sum(axis=1)
    _, kinds = np.unique(sums, return_inverse=True)
    if kinds.max() >= MOST_SETS:
        share = (sums - sums.min()) / np.ptp(sums)
        _, kinds = np.unique(np.rint(share * (MOST_SETS - 1)), return_inverse=True)
    counts = np.bincount(kinds)
    sets = np.zeros((len(counts), *slopes.shape[1:]))
    np.add.at(sets, kinds, slopes)
    return kinds, sets / counts[:, None, None, None]


def _all(condition: np.ndarray) -> np.ndarray:
    """Joints ``(j,)`` for which a condition ``(t, j, ...)`` holds throughout."""
    return np.asarray(condition.all(axis=(0, *range(2, condition.ndim))))
