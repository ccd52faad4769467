"""Newmark's average acceleration method, implicit in the forces of the joints.

Over a step h, the means of accelerations, velocities and forces at its two ends act throughout:

    M Δv = h (f̄ - Bᵀ F̄ - C v̄ - K x̄),    Δx = h v̄.

The method is of second order, stable for every step of a linear structure, and conserves its
energy: with the work f̄·Δx of the excitation and F̄·BΔx on the joints, the energy balance closes to
rounding. The response of the structure to joint forces within a step is linear with constant
matrices,

    u = u_free - A F(u),    A = h²/4 B (M + h/2 C + h²/4 K)⁻¹ Bᵀ,

so that the only unknowns of Newton's method are the joints' displacements u, however large the
model. If Newton's method fails, because a joint force is not smooth, the step is repeated as two
half steps.

One step causes a displacement error of h³/12 x''', which is estimated from the change of
acceleration as h²/12 Δa. Where a tolerance is given, this estimate controls the step size. The
accumulated error of all steps is estimated by a companion run, the same motion with steps of twice
the length from the start: global extrapolation (Shampine & Watts 1976, doi:10.1145/355666.355671).
The companion run costs half as much again. If both runs step over an event, the reported error is
the largest error of one step.

Source: Newmark 1959, Journal of the Engineering Mechanics Division (ASCE) 85(3), 67.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_models.dynamics.model import DynamicModel, IncrementResponse, Joints
from fe_models.dynamics.motion import Motion, Start
from fe_models.dynamics.transient.joint_equilibrium import (
    TOLERANCE,
    JointEquilibrium,
    largest_entry,
)
from fe_models.dynamics.transient.record import MotionRecord, RecordedSteps, StepState
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Largest number of halvings of a step: to 1/4096, at which any continuous law is nearly linear.
MAX_HALVINGS = 12
# A step is doubled if its error is below this share of the allowed one: doubling multiplies it by
# 8.
DOUBLE_BELOW = 1.0 / 16.0
# Allowed error of a companion step over that of a step: errors grow with the third power of the
# step.
TWICE_AS_LONG = 8.0
# Share of the rough first run in the work of an integration with step-size control.
ROUGH_RUN_SHARE = 0.15
# Number of steps held in memory before their energies are summed and unrecorded rows dropped.
BLOCK_STEPS = 1024


@dataclass(frozen=True)
class TimeStepControl:
    """Control of the time steps.

    Parameters
    ----------
    step
        Length of a step [s]. With a tolerance, steps are divided in halves, quarters, ... where
        needed.
    tolerance
        Displacement error that one step may add, relative to the largest displacement; both are
        norms weighted by mass. A rough first run without division finds the largest displacement.
        None for steps of fixed length.
    every
        Number of steps between two rows of the result.

    Raises
    ------
    InputError
        If the step or the tolerance is not above zero, or ``every`` is below 1.

    Examples
    --------
    The allowed error of one step controls the step size. A mass released at 1 mm moves as a cosine,
    within the estimated error:

    >>> import numpy as np
    >>> from fe_models.dynamics import Link, TimeStepControl, integrate, lumped_rig
    >>> from fe_models.dynamics.motion import Start
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]])
    >>> control = TimeStepControl(step=2e-3 * np.pi / 50, tolerance=1e-6)
    >>> motion = integrate(rig, None, None, 2e-3 * np.pi, control, Start(np.array([1.0])))
    >>> exact = np.cos(1e3 * motion.times)
    >>> print(np.abs(motion.displacement[:, 0] - exact).max() < motion.error < 1e-3)
    True
    """

    step: float
    tolerance: float | None = None
    every: int = 1

    def __post_init__(self) -> None:
        checks.numbers(self, "step", "tolerance")
        if not self.step > 0.0 or checks.whole("every", self.every) < 1:
            raise InputError(
                f"a step of {self.step:g} s with a row every {self.every} steps is not possible: "
                "give a step above 0 and a row every 1 or more steps"
            )
        if self.tolerance is not None and not self.tolerance > 0.0:
            raise InputError(
                f"tolerance {self.tolerance:g} is not above 0: give a tolerance above 0"
            )


def integrate(
    model: DynamicModel,
    joints: Joints | None,
    excitation: Callable[[Array], Array] | None,
    duration: float,
    control: TimeStepControl,
    start: Start | None = None,
    steps: Steps = COMPUTED,
    reached: Callable[[float], None] = lambda share: None,
) -> Motion:
    """Integrate the motion of a structure with joints in time.

    An integration that stops early says so in the ``message`` of the result.

    Parameters
    ----------
    model
        The structure.
    joints
        The joint law; None leaves all joints free.
    excitation
        Function that returns forces ``(t, n)`` [N] at times ``(t,)`` [s]; None for no forces.
    duration
        Duration [s]. The last time is the first multiple of the step at or after it.
    control
        Control of the time steps.
    start
        Initial state; at rest if None.
    steps
        Runner of blocks of many time steps; see :class:`sa_solver.steps.Steps`.
    reached
        Function that is called after each block with the share of the work that is done.

    Raises
    ------
    InputError
        If joints and connection have different directions, or if the model has structural damping,
        which is defined in steady vibration only.

    Examples
    --------
    A suddenly applied load moves an undamped mass to twice F / k, and the energy balance closes:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]])
    >>> load = ConstantForce(5.0 * unit_force(rig, "m"))
    >>> motion = integrate(rig, None, load, 0.01, TimeStepControl(2e-5))
    >>> print(f"{motion.displacement.max():.4f} mm of {2.0 * 5.0 / 1e3:.4f}")
    0.0100 mm of 0.0100
    >>> print(motion.energies.balance_error < 1e-12)
    True
    """
    if model.structural is not None:
        raise InputError("structural damping is not known in time: give modal damping instead")
    law = joints if joints is not None else _FreeJoints()
    if len(model.connection) % law.directions:
        raise InputError(
            f"a connection of {len(model.connection)} rows for joints of {law.directions} "
            "directions: give a row for each direction of each joint"
        )
    checks.number("duration", duration, least=0.0)
    count = int(np.ceil(duration / control.step * (1.0 - 1e-12)))
    excite = excitation if excitation is not None else _NoForce(len(model.mass))
    checks.array("forces of the excitation", excite(np.zeros(1)), (1, len(model.mass)))
    begin = start or Start()
    allowed, first_share = np.inf, 0.0
    if control.tolerance is not None:
        rough_march = _March(model, law, excite, control.step, begin, np.inf)
        first_share = ROUGH_RUN_SHARE
        rough_run = _march_blocks(
            rough_march, None, count, count, steps, lambda share: reached(first_share * share)
        )
        allowed = control.tolerance * rough_run.largest_displacement
    march = _March(model, law, excite, control.step, begin, allowed)
    coarse_run_allowed = TWICE_AS_LONG * allowed
    coarse_start = replace(begin.coarse_run or begin, time=begin.time)
    coarse_run = _March(model, law, excite, 2.0 * control.step, coarse_start, coarse_run_allowed)
    record = _march_blocks(
        march,
        coarse_run,
        count,
        control.every,
        steps,
        lambda share: reached(first_share + (1.0 - first_share) * share),
    )
    in_step = march.taken == 2 * coarse_run.taken and count % control.every == 0
    return record.motion(march.message or coarse_run.message, coarse_run.end if in_step else None)


@dataclass(frozen=True)
class _NoResponse:
    """Response of joints that transmit nothing."""

    force: Array
    tangent: Array
    state: Array
    dissipated: Array


class _FreeJoints:
    """Joints that transmit nothing."""

    directions = 1

    def rest(self, joints: int) -> Array:
        return np.zeros((joints, 0))

    def respond(self, state: Array, increment: Array) -> IncrementResponse:
        count = len(increment)
        return _NoResponse(np.zeros((count, 1)), np.zeros((count, 1, 1)), state, np.zeros(count))


@dataclass(frozen=True)
class _NoForce:
    """Excitation without forces on ``size`` degrees of freedom."""

    size: int

    def __call__(self, times: Array) -> Array:
        return np.zeros((len(times), self.size))


class _Operators:
    """Matrices of one step h."""

    def __init__(self, model: DynamicModel, step: float) -> None:
        half = 0.5 * step
        effective = model.mass + half * model.damping + half**2 * model.stiffness
        self.step = step
        # Maps the mean force to the change of velocity (n, n), ...
        self.gain = step * np.linalg.inv(effective)
        # ... displacements and velocities to its reduction (n, 2 n), ...
        self.drag = self.gain @ np.hstack([model.stiffness, model.damping + half * model.stiffness])
        # ... and the joints' forces at one end of the step to its reduction (n, j d).
        self.joint_gain = 0.5 * self.gain @ model.connection.T
        # A: maps the joints' forces at the end of the step to the reduction of their displacements.
        self.flexibility = half * model.connection @ self.joint_gain


@dataclass(frozen=True)
class _MarchState:
    """State of a march, from which it can be continued.

    ``at`` is the last point, and ``taken`` the number of whole steps so far. Steps are divided by 2
    to the power ``halvings``. ``largest_force`` is the largest joint force so far. ``message`` says
    why the march has stopped, or is empty.
    """

    at: StepState
    taken: int
    halvings: int
    largest_force: float
    message: str


class _March:
    """March of a structure with joints, step by step.

    Parameters
    ----------
    model, joints, excitation
        As in :func:`integrate`.
    step
        Length of a whole step [s].
    start
        Initial state.
    allowed
        Error that one step may add, as a norm weighted by mass.
    """

    def __init__(
        self,
        model: DynamicModel,
        joints: Joints,
        excitation: Callable[[Array], Array],
        step: float,
        start: Start,
        allowed: float,
    ) -> None:
        self.model, self.directions = model, joints.directions
        self._joints, self._excitation = joints, excitation
        self._step, self._allowed = step, allowed
        self._operators: dict[int, tuple[_Operators, JointEquilibrium]] = {}
        self._start_time, self.taken, self.message = start.time, 0, ""
        self.at = self._start(start)
        self._halvings, self._joint_residual = 0, 0.0
        self._largest_force = largest_entry(self.at.response.force)
        self._inverse_mass = np.linalg.inv(model.mass)

    @property
    def end(self) -> Start:
        """Current state, from which an integration can be continued."""
        displacement, velocity = np.split(self.at.motion, 2)
        return Start(displacement, velocity, self.at.response.state, self.at.time)

    @property
    def state(self) -> _MarchState:
        """State of the march; setting it continues the march from there."""
        return _MarchState(self.at, self.taken, self._halvings, self._largest_force, self.message)

    @state.setter
    def state(self, state: _MarchState) -> None:
        self.at, self.taken, self.message = state.at, state.taken, state.message
        self._halvings, self._largest_force = state.halvings, state.largest_force
        # Inverses reused from earlier steps are dropped: a resumed march must give the same result.
        self._operators.clear()

    def block(self, steps: int) -> list[list[StepState]]:
        """Return the points of up to ``steps`` whole steps; fewer if ``message`` says why."""
        times = self._time(np.arange(self.taken + 1.0, self.taken + steps + 1.0))
        whole_steps = []
        for time, force in zip(times.tolist(), self._excitation(times), strict=True):
            points = self._whole_step(time, force)
            if self.message:
                break
            whole_steps.append(points)
            self.taken += 1
        return whole_steps

    def _whole_step(self, end: float, end_force: Array) -> list[StepState]:
        """Return the points of one whole step up to a time, divided where needed."""
        whole = 1 << MAX_HALVINGS
        points: list[StepState] = []
        done = 0
        while done < whole:
            part = whole >> self._halvings
            time, force = end, end_force
            if done + part < whole:
                times = self._time(np.array([self.taken + (done + part) / whole]))
                time, force = float(times[0]), self._excitation(times)[0]
            point, error = self._sub_step(time, force)
            if point is None:
                if self._halvings == MAX_HALVINGS:
                    self.message = self._failure(error)
                    return points
                self._halvings += 1
                continue
            points.append(point)
            self.at, done = point, done + part
            if self._halvings > 0 and error <= DOUBLE_BELOW and done % (2 * part) == 0:
                self._halvings -= 1
        return points

    def _sub_step(self, time: float, force: Array) -> tuple[StepState | None, float]:
        """Take a step up to a time; return its end and its error over the allowed one.

        The end is None if the step must be smaller. A step without equilibrium has an infinite
        error.
        """
        operators, equilibrium = self._operators_of(self._halvings)
        at, step, size = self.at, operators.step, len(force)
        change = (
            operators.gain @ (0.5 * (at.force + force))
            - operators.drag @ at.motion
            - operators.joint_gain @ at.response.force.ravel()
        )
        velocity = at.motion[size:]
        free = step * (self.model.connection @ (velocity + 0.5 * change)) + at.lag
        trial = equilibrium.solve(at.response, free, self._largest_force)
        if not trial.solved:
            self._joint_residual = trial.relative
            return None, np.inf
        joint_force = trial.response.force.ravel()
        change -= operators.joint_gain @ joint_force
        motion = at.motion.copy()
        motion[:size] += step * (velocity + 0.5 * change)
        motion[size:] += change
        point = StepState(
            time, motion, force, trial.response, -trial.residual, step, trial.relative
        )
        error = self._error(point)
        if error > 1.0:
            return None, error
        self._largest_force = max(self._largest_force, largest_entry(joint_force))
        return point, error

    def _error(self, point: StepState) -> float:
        """Return the error that a step adds over the allowed one."""
        if not np.isfinite(self._allowed):
            return 0.0
        jump = self._acceleration(point) - self._acceleration(self.at)
        error = point.step**2 / 12.0 * float(np.sqrt(jump @ self.model.mass @ jump))
        return error / self._allowed if error > 0.0 else 0.0

    def _acceleration(self, point: StepState) -> Array:
        model, size = self.model, len(point.force)
        return np.asarray(
            self._inverse_mass
            @ (
                point.force
                - point.response.force.ravel() @ model.connection
                - model.damping @ point.motion[size:]
                - model.stiffness @ point.motion[:size]
            )
        )

    def _operators_of(self, halvings: int) -> tuple[_Operators, JointEquilibrium]:
        if halvings not in self._operators:
            operators = _Operators(self.model, self._step / (1 << halvings))
            equilibrium = JointEquilibrium(self._joints, operators.flexibility)
            self._operators[halvings] = operators, equilibrium
        return self._operators[halvings]

    def _start(self, start: Start) -> StepState:
        model, directions = self.model, self._joints.directions
        motion = start.motion(len(model.mass))
        stretch = model.connection @ motion[: len(model.mass)]
        if start.joint_state is None:
            rest = self._joints.rest(len(stretch) // directions)
            response = self._joints.respond(rest, stretch.reshape(-1, directions))
        else:
            unmoved = np.zeros((len(start.joint_state), directions))
            response = self._joints.respond(start.joint_state, unmoved)
        force = self._excitation(np.array([start.time]))[0]
        return StepState(start.time, motion, force, response, np.zeros(len(stretch)), 0.0, 0.0)

    def _time(self, steps: Array) -> Array:
        return np.asarray(self._start_time + self._step * steps, dtype=np.float64)

    def _failure(self, error: float) -> str:
        step = self._step / (1 << MAX_HALVINGS)
        where = f"at t = {self.at.time:.9g} s, with steps of {step:.3g} s"
        if np.isfinite(error):
            return (
                f"{where}, a step's error is {error:.3g} times what is allowed: give smaller steps "
                "or a larger tolerance"
            )
        return (
            f"{where}, the joints are not in equilibrium: their residual is "
            f"{self._joint_residual:.3g} of their largest force, above {TOLERANCE:g}; "
            "give smaller steps, or a joint law whose force is continuous"
        )


def _march_blocks(
    march: _March,
    coarse_run: _March | None,
    count: int,
    every: int,
    steps: Steps,
    reached: Callable[[float], None],
) -> MotionRecord:
    """March until ``count`` whole steps are taken or the march stops; return the record.

    Parameters
    ----------
    march
        The march.
    coarse_run
        March with steps of twice the length that follows, or None.
    count
        Number of whole steps.
    every
        Number of steps between two rows of the record.
    steps, reached
        As in :func:`integrate`.
    """
    record = MotionRecord(march.model, march.directions, every, march.at)
    marches = [march] if coarse_run is None else [march, coarse_run]

    def block() -> tuple[RecordedSteps | None, list[_MarchState]]:
        points = march.block(min(BLOCK_STEPS, count - march.taken))
        coarse_points = coarse_run.block(march.taken // 2 - coarse_run.taken) if coarse_run else []
        return record.recorded(points, coarse_points), [each.state for each in marches]

    while march.taken < count and not any(each.message for each in marches):
        recorded, states = steps("steps in time", block)
        for each, state in zip(marches, states, strict=True):
            each.state = state
        if recorded is not None:
            record.add(recorded)
        reached(march.taken / count)
    return record
