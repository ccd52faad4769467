"""What an integrator keeps of a march in small steps: rows, and the energies summed until each.

The energies are those of the trapezoidal rule, with which the balance of average acceleration
closes: forces and velocities of a step are the means of its ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fe_models.dynamics.model import DynamicModel, IncrementResponse
from fe_models.dynamics.motion import Energies, Motion, Start, accelerations, quadratic
from sa_solver.types import Array

# Distance of a companion by steps of twice the length over the error: 2² - 1 of second order, and 1
# where friction lasts that depends on a mode which the steps do not resolve. In between, both are
# told within a factor of three.
COMPANION = 2.0


class StepState(NamedTuple):
    """The end of a step: displacements and velocities ``(2 n,)``, and the joints.

    ``missing`` ``(j d,)`` [mm] is how far the joints are behind the structure, what was left of
    the ``residual``; ``step`` [s] ended here.
    """

    time: float
    motion: Array
    force: Array
    response: IncrementResponse
    missing: Array
    step: float
    residual: float


@dataclass(frozen=True)
class RecordedSteps:
    """What is kept of some whole steps: ``rows`` by column, None where no step of them has one.

    ``last`` is the point that they end with, ``sums`` ``(3 + j,)`` the energies until there, and
    ``kept`` the point of the last row so far. They are so many whole steps, of ``points`` in all;
    ``missed`` is the largest distance from the companion, ``jump`` the largest error that one step
    adds and ``moved`` the largest displacement, all as half of the square of their norm weighted by
    mass, ``residual`` the largest one.
    """

    rows: tuple[Array, Array, Array, Array, Array] | None
    last: StepState
    sums: Array
    kept: StepState
    whole_steps: int
    points: int
    missed: float
    jump: float
    moved: float
    residual: float


class MotionRecord:
    """Rows of the result, and the energies summed until each."""

    def __init__(self, model: DynamicModel, directions: int, every: int, first: StepState) -> None:
        self._model, self._directions, self._every = model, directions, every
        self._before, self._kept = first, first
        sums = np.zeros((1, 3 + len(model.connection) // directions))
        self._sums, self._rows = sums[0], [(*_columns([first]), sums)]
        self._missed = self._largest_jump = self._largest_motion = self._residual = 0.0
        self._taken = self._steps = 0

    def recorded(
        self, block: list[list[StepState]], companion: list[list[StepState]]
    ) -> RecordedSteps | None:
        """What is to be added of whole steps, each of one or more points; None without any.

        Beside them, those of the ``companion``, each for two of them.
        """
        points = [point for whole in block for point in whole]
        if not points:
            return None
        ends = np.cumsum([len(whole) for whole in block]) - 1
        kept = ends[(self._taken + 1 + np.arange(len(block))) % self._every == 0]
        flows, jump = self._flows([self._before, *points])
        sums, rows = self._sums + np.cumsum(flows, axis=0), None
        if len(kept):
            rows = (*_columns([points[row] for row in kept]), sums[kept])
        return RecordedSteps(
            rows=rows,
            last=points[-1],
            sums=sums[-1].copy(),
            kept=points[kept[-1]] if len(kept) else self._kept,
            whole_steps=len(block),
            points=len(points),
            missed=self._distance(block[1::2], companion),
            jump=jump,
            moved=self._largest(np.array([point.motion for point in points])),
            residual=max(point.residual for point in points),
        )

    def add(self, recorded: RecordedSteps) -> None:
        """Add what has been recorded of the next whole steps."""
        if recorded.rows is not None:
            self._rows.append(recorded.rows)
        self._before, self._kept, self._sums = recorded.last, recorded.kept, recorded.sums
        self._taken += recorded.whole_steps
        self._steps += recorded.points
        self._missed = max(self._missed, recorded.missed)
        self._largest_jump = max(self._largest_jump, recorded.jump)
        self._largest_motion = max(self._largest_motion, recorded.moved)
        self._residual = max(self._residual, recorded.residual)

    def _distance(self, block: list[list[StepState]], companion: list[list[StepState]]) -> float:
        """Largest distance of whole steps that end at the same times, as half of its square."""
        pairs = zip(block, companion, strict=False)
        apart = [whole[-1].motion - other[-1].motion for whole, other in pairs]
        return self._largest(np.array(apart)) if apart else 0.0

    def _largest(self, motion: Array) -> float:
        """Largest displacement of motions ``(t, 2 n)``, as half of its square."""
        displacement = motion[:, : len(self._model.mass)]
        return float(quadratic(self._model.mass, displacement).max())

    def _flows(self, points: list[StepState]) -> tuple[Array, float]:
        """Energies of each step ``(s, 3 + j)``: brought in, damped, into joints, lost in each.

        Beside them ``jump`` of :class:`RecordedSteps`.
        """
        model = self._model
        _, motion, force, joint_force = _columns(points)
        steps = np.array([point.step for point in points[1:]])[:, None]
        velocity = np.split(0.5 * (motion[1:] + motion[:-1]), 2, axis=1)[1]
        travel = steps * velocity
        pairs = (
            (0.5 * (force[1:] + force[:-1]), travel),
            (velocity @ model.damping.T, travel),
            (0.5 * (joint_force[1:] + joint_force[:-1]), travel @ model.connection.T),
        )
        works = np.stack([np.einsum("ti,ti->t", *pair) for pair in pairs], axis=1)
        dissipated = np.array([point.response.dissipated for point in points[1:]])
        jumps = steps**2 / 12.0 * np.diff(accelerations(model, motion, force, joint_force), axis=0)
        jump = float(quadratic(model.mass, jumps).max())
        return np.hstack([works, dissipated]), jump

    @property
    def largest_displacement(self) -> float:
        """As a norm weighted by mass [t^0.5 mm]."""
        return float(np.sqrt(2.0 * self._largest_motion))

    def motion(self, message: str, companion: Start | None) -> Motion:
        """All rows kept so far; ``message`` says why they end early, if they do.

        ``companion`` is where that is at the last of them.
        """
        model, directions = self._model, self._directions
        times, motion, force, joint_force, sums = (
            np.concatenate(parts) for parts in zip(*self._rows, strict=True)
        )
        displacement, velocity = np.split(motion, 2, axis=1)
        shape = (len(motion), len(model.connection) // directions, directions)
        missed, moved = max(self._missed / COMPANION**2, self._largest_jump), self._largest_motion
        return Motion(
            times=times,
            displacement=displacement,
            velocity=velocity,
            acceleration=accelerations(model, motion, force, joint_force),
            joint_displacement=(displacement @ model.connection.T).reshape(shape),
            joint_force=joint_force.reshape(shape),
            joint_state=self._kept.response.state,
            companion=companion,
            energies=Energies(
                kinetic=quadratic(model.mass, velocity),
                elastic=quadratic(model.stiffness, displacement),
                excitation=sums[:, 0],
                damping=sums[:, 1],
                joint_work=sums[:, 2],
                joints=sums[:, 3:],
            ),
            error=float(np.sqrt(missed / moved)) if moved > 0.0 else 0.0,
            residual=self._residual,
            steps=self._steps,
            message=message,
        )


def _columns(points: list[StepState]) -> tuple[Array, Array, Array, Array]:
    """Times ``(t,)``, motion ``(t, 2 n)``, force ``(t, n)``, joint force ``(t, j d)`` of points."""
    times = np.array([point.time for point in points])
    motion = np.array([point.motion for point in points])
    force = np.array([point.force for point in points])
    return times, motion, force, np.array([point.response.force.ravel() for point in points])
