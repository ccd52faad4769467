"""Record of a time integration: the recorded rows, and the energies summed up to each.

Energies follow the trapezoidal rule, with which the energy balance of the average acceleration
method closes: forces and velocities of a step are the means of those at its ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fe_models.dynamics.model import DynamicModel, IncrementResponse
from fe_models.dynamics.motion import Energies, Motion, Start, accelerations, quadratic
from sa_solver.types import Array

# Distance of the companion run, with steps of twice the length, over the error. The ratio is 2² - 1
# = 3 for errors of second order, and 1 where permanent slip depends on a mode that the steps do not
# resolve. With a value in between, both are estimated within a factor of three.
COARSE_STEP_RATIO = 2.0


class StepState(NamedTuple):
    """End of a time step.

    Parameters
    ----------
    time
        Time [s].
    motion
        Displacements, then velocities, ``(2 n,)``.
    force
        Forces of the excitation ``(n,)`` [N].
    response
        Response of the joints.
    lag
        Displacement ``(j d,)`` [mm] by which the joints lag behind the structure, due to the
        residual of their equilibrium.
    step
        Length of the step [s].
    residual
        Relative residual of the joints' equilibrium.
    """

    time: float
    motion: Array
    force: Array
    response: IncrementResponse
    lag: Array
    step: float
    residual: float


@dataclass(frozen=True)
class RecordedSteps:
    """Contribution of some whole steps to a record.

    All quantities that are norms weighted by mass are stored as half their squares.

    Parameters
    ----------
    rows
        Columns of the recorded rows, or None if no row is recorded.
    last
        End of the last step.
    sums
        Energies ``(3 + j,)`` summed up to there.
    kept
        Point of the last recorded row so far.
    whole_steps
        Number of whole steps.
    points
        Number of steps, divided ones included.
    distance_to_coarse_run
        Largest distance from the companion run, as half a squared norm.
    step_error
        Largest error that one step adds, as half a squared norm.
    largest_displacement
        Largest displacement, as half a squared norm.
    residual
        Largest residual of the joints' equilibrium.
    """

    rows: tuple[Array, Array, Array, Array, Array] | None
    last: StepState
    sums: Array
    kept: StepState
    whole_steps: int
    points: int
    distance_to_coarse_run: float
    step_error: float
    largest_displacement: float
    residual: float


class MotionRecord:
    """Recorded rows of a time integration, and the energies summed up to each.

    Parameters
    ----------
    model
        The structure.
    directions
        Number of directions of a joint.
    every
        Number of whole steps between two rows.
    first
        The start, which is the first row.
    """

    def __init__(self, model: DynamicModel, directions: int, every: int, first: StepState) -> None:
        self._model, self._directions, self._every = model, directions, every
        self._last_point, self._kept = first, first
        sums = np.zeros((1, 3 + len(model.connection) // directions))
        self._sums, self._rows = sums[0], [(*_columns([first]), sums)]
        self._distance_to_coarse_run = self._largest_step_error = 0.0
        self._largest_motion = self._residual = 0.0
        self._taken = self._steps = 0

    def recorded(
        self, block: list[list[StepState]], coarse_run: list[list[StepState]]
    ) -> RecordedSteps | None:
        """Return the contribution of whole steps to the record; None if there are none.

        ``block`` has the points of each whole step, and ``coarse_run`` those of the companion run,
        one step of it for two of these.
        """
        points = [point for step_points in block for point in step_points]
        if not points:
            return None
        ends = np.cumsum([len(step_points) for step_points in block]) - 1
        kept = ends[(self._taken + 1 + np.arange(len(block))) % self._every == 0]
        increments, step_error = self._energy_increments([self._last_point, *points])
        sums, rows = self._sums + np.cumsum(increments, axis=0), None
        if len(kept):
            rows = (*_columns([points[row] for row in kept]), sums[kept])
        return RecordedSteps(
            rows=rows,
            last=points[-1],
            sums=sums[-1].copy(),
            kept=points[kept[-1]] if len(kept) else self._kept,
            whole_steps=len(block),
            points=len(points),
            distance_to_coarse_run=self._distance(block[1::2], coarse_run),
            step_error=step_error,
            largest_displacement=self._largest(np.array([point.motion for point in points])),
            residual=max(point.residual for point in points),
        )

    def add(self, recorded: RecordedSteps) -> None:
        """Add the contribution of the next whole steps."""
        if recorded.rows is not None:
            self._rows.append(recorded.rows)
        self._last_point, self._kept, self._sums = recorded.last, recorded.kept, recorded.sums
        self._taken += recorded.whole_steps
        self._steps += recorded.points
        self._distance_to_coarse_run = max(
            self._distance_to_coarse_run, recorded.distance_to_coarse_run
        )
        self._largest_step_error = max(self._largest_step_error, recorded.step_error)
        self._largest_motion = max(self._largest_motion, recorded.largest_displacement)
        self._residual = max(self._residual, recorded.residual)

    def _distance(self, block: list[list[StepState]], coarse_run: list[list[StepState]]) -> float:
        """Return the largest distance between two runs at equal times, as half a squared norm."""
        pairs = zip(block, coarse_run, strict=False)
        differences = [step_points[-1].motion - other[-1].motion for step_points, other in pairs]
        return self._largest(np.array(differences)) if differences else 0.0

    def _largest(self, motion: Array) -> float:
        """Return the largest displacement of motions ``(t, 2 n)``, as half a squared norm."""
        displacement = motion[:, : len(self._model.mass)]
        return float(quadratic(self._model.mass, displacement).max())

    def _energy_increments(self, points: list[StepState]) -> tuple[Array, float]:
        """Return the energies of each step ``(s, 3 + j)``, and the largest error of one step.

        The energies are the work of the excitation, the energy dissipated by damping, the work on
        the joints, and the energy dissipated in each joint. The error is half a squared norm.
        """
        model = self._model
        _, motion, force, joint_force = _columns(points)
        steps = np.array([point.step for point in points[1:]])[:, None]
        velocity = np.split(0.5 * (motion[1:] + motion[:-1]), 2, axis=1)[1]
        displacements = steps * velocity
        pairs = (
            (0.5 * (force[1:] + force[:-1]), displacements),
            (velocity @ model.damping.T, displacements),
            (0.5 * (joint_force[1:] + joint_force[:-1]), displacements @ model.connection.T),
        )
        works = np.stack([np.einsum("ti,ti->t", *pair) for pair in pairs], axis=1)
        dissipated = np.array([point.response.dissipated for point in points[1:]])
        step_errors = (
            steps**2 / 12.0 * np.diff(accelerations(model, motion, force, joint_force), axis=0)
        )
        step_error = float(quadratic(model.mass, step_errors).max())
        return np.hstack([works, dissipated]), step_error

    @property
    def largest_displacement(self) -> float:
        """Largest displacement, as a norm weighted by mass [t^0.5 mm]."""
        return float(np.sqrt(2.0 * self._largest_motion))

    def motion(self, message: str, coarse_run: Start | None) -> Motion:
        """Return the motion from all recorded rows.

        ``message`` says why the integration stopped early, or is empty. ``coarse_run`` is the state
        of the companion run at the last row.
        """
        model, directions = self._model, self._directions
        times, motion, force, joint_force, sums = (
            np.concatenate(parts) for parts in zip(*self._rows, strict=True)
        )
        displacement, velocity = np.split(motion, 2, axis=1)
        shape = (len(motion), len(model.connection) // directions, directions)
        error_square = max(
            self._distance_to_coarse_run / COARSE_STEP_RATIO**2, self._largest_step_error
        )
        largest_square = self._largest_motion
        return Motion(
            times=times,
            displacement=displacement,
            velocity=velocity,
            acceleration=accelerations(model, motion, force, joint_force),
            joint_displacement=(displacement @ model.connection.T).reshape(shape),
            joint_force=joint_force.reshape(shape),
            joint_state=self._kept.response.state,
            coarse_run=coarse_run,
            energies=Energies(
                kinetic=quadratic(model.mass, velocity),
                elastic=quadratic(model.stiffness, displacement),
                excitation=sums[:, 0],
                damping=sums[:, 1],
                joint_work=sums[:, 2],
                joints=sums[:, 3:],
            ),
            error=float(np.sqrt(error_square / largest_square)) if largest_square > 0.0 else 0.0,
            residual=self._residual,
            steps=self._steps,
            message=message,
        )


def _columns(points: list[StepState]) -> tuple[Array, Array, Array, Array]:
    """Return times ``(t,)``, motion ``(t, 2 n)``, force ``(t, n)`` and joint force ``(t, j d)``."""
    times = np.array([point.time for point in points])
    motion = np.array([point.motion for point in points])
    force = np.array([point.force for point in points])
    return times, motion, force, np.array([point.response.force.ravel() for point in points])
