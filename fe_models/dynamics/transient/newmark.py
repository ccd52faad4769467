"""Newmark's average acceleration, implicit in the forces of the joints.

Over a step h the mean of accelerations, velocities and forces at its ends acts throughout:

    M Δv = h (f̄ - Bᵀ F̄ - C v̄ - K x̄),    Δx = h v̄,

which is of second order, stable for every step of a linear structure, and keeps its energy: the
balance of energy closes to rounding with the work f̄·Δx of the excitation and F̄·BΔx on the joints.
What the joints do to the structure within a step is constant and found once,

    u = u_free - A F(u),    A = h²/4 B (M + h/2 C + h²/4 K)⁻¹ Bᵀ,

so that Newton's method has only the joints' displacements u as unknowns, however large the model.
A step in which it fails, where a joint's force is not smooth, is taken again as two halves.

An error of displacement of h³/12 x''' arises in one step, which the change of acceleration shows
as h²/12 Δa: it chooses the steps where a tolerance is given. What all steps together leave is told
by a companion, the same motion by steps of twice the length, from the start on: global
extrapolation (Shampine & Watts 1976, doi:10.1145/355666.355671). It takes half as much work again.
Where both step over what happens, the largest error of one step is told.

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

# A step is halved at most this often: to 1/4096, where any continuous law is nearly linear.
MAX_HALVED = 12
# A step is doubled when its error is this share of what is allowed: doubling multiplies it by 8.
DOUBLE_BELOW = 1.0 / 16.0
# So much more may a step of twice the length add: its error goes with the third power.
TWICE_AS_LONG = 8.0
# Of the work of a motion whose steps are chosen, about what its first run in whole steps is.
WHOLE_STEPS = 0.15
# Steps held in full before their energies are summed and the rows not asked for dropped.
BLOCK = 1024


@dataclass(frozen=True)
class TimeStepControl:
    """Steps of ``step`` [s], or where ``tolerance`` is given, parts of it: halves, quarters, ...

    ``tolerance`` is the error of displacement one step may add, relative to the largest
    displacement, both as norms weighted by mass. A first run in whole steps finds how large that
    is. The result has a row every ``every`` steps. Raises ``ValueError`` for a step or tolerance
    that is not above zero, or an ``every`` below 1.

    Examples
    --------
    Steps that follow from the error that one of them may add. A mass let go at 1 mm moves as its
    cosine, within the error that the motion says it has:

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
                f"a step of {self.step:g} s, every {self.every}: give a step above 0, every 1 "
                "or more"
            )
        if self.tolerance is not None and not self.tolerance > 0.0:
            raise InputError(f"tolerance {self.tolerance:g}: give one above 0")


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
    """Motion of a structure with joints from ``start`` on, at rest unless given.

    ``excitation`` takes times ``(t,)`` to forces ``(t, n)``; None is none, and None of ``joints``
    leaves all of them free. The last time is the first multiple of the step at or after
    ``duration`` [s]. A motion that has not been found to the end says so in its ``message``. Each
    of the ``steps`` marches many steps in time; ``reached`` is told after each what share of the
    work is done.
    Raises InputError if joints and connection do not have the same directions, or the model has
    structural damping, which there is in steady vibration only.

    Examples
    --------
    A load that is put on at once moves an undamped mass to twice F / k, and no energy is missing:

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
        raise InputError("structural damping is not known in time: give damping of the modes")
    laws = joints if joints is not None else _FreeJoints()
    if len(model.connection) % laws.directions:
        raise InputError(
            f"a connection of {len(model.connection)} rows for joints of {laws.directions} "
            "directions: give a row for each direction of each joint"
        )
    checks.number("duration", duration, least=0.0)
    count = int(np.ceil(duration / control.step * (1.0 - 1e-12)))
    forcing = excitation if excitation is not None else _NoForce(len(model.mass))
    checks.array("forces of the excitation", forcing(np.zeros(1)), (1, len(model.mass)))
    begin = start or Start()
    allowed, before = np.inf, 0.0
    if control.tolerance is not None:
        whole, before = _March(model, laws, forcing, control.step, begin, np.inf), WHOLE_STEPS
        rough = _followed(whole, None, count, count, steps, lambda share: reached(before * share))
        allowed = control.tolerance * rough.largest_displacement
    march = _March(model, laws, forcing, control.step, begin, allowed)
    twice = TWICE_AS_LONG * allowed
    start_of_companion = replace(begin.companion or begin, time=begin.time)
    companion = _March(model, laws, forcing, 2.0 * control.step, start_of_companion, twice)
    record = _followed(
        march,
        companion,
        count,
        control.every,
        steps,
        lambda share: reached(before + (1.0 - before) * share),
    )
    together = march.taken == 2 * companion.taken and count % control.every == 0
    return record.motion(march.message or companion.message, companion.end if together else None)


@dataclass(frozen=True)
class _NoResponse:
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
    size: int

    def __call__(self, times: Array) -> Array:
        return np.zeros((len(times), self.size))


class _Operators:
    """What one step h does: its matrices, found once."""

    def __init__(self, model: DynamicModel, step: float) -> None:
        half = 0.5 * step
        effective = model.mass + half * model.damping + half**2 * model.stiffness
        self.step = step
        # From a mean force to the change of velocity (n, n) ...
        self.gain = step * np.linalg.inv(effective)
        # ... from displacements and velocities to what is lost of it (n, 2 n) ...
        self.drag = self.gain @ np.hstack([model.stiffness, model.damping + half * model.stiffness])
        # ... and from the joints' forces at one end to what is lost of it (n, j d).
        self.joint_gain = 0.5 * self.gain @ model.connection.T
        # A: from the joints' forces at the end to what is lost of their displacements.
        self.flexibility = half * model.connection @ self.joint_gain


@dataclass(frozen=True)
class _Reached:
    """Where a march is: ``at`` a point, with so many whole steps ``taken``.

    Steps are ``halved`` so often, and ``largest_force`` is that of a joint so far. ``message`` says
    why it goes no further, if it does not.
    """

    at: StepState
    taken: int
    halved: int
    largest_force: float
    message: str


class _March:
    """The structure marched step by step; ``allowed`` is the error one may add (mass norm)."""

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
        self._halved, self._missed = 0, 0.0
        self._largest_force = largest_entry(self.at.response.force)
        self._inverse_mass = np.linalg.inv(model.mass)

    @property
    def end(self) -> Start:
        """Where it is, to go on from."""
        displacement, velocity = np.split(self.at.motion, 2)
        return Start(displacement, velocity, self.at.response.state, self.at.time)

    @property
    def reached(self) -> _Reached:
        """Where it is; a march that is put there goes on from it."""
        return _Reached(self.at, self.taken, self._halved, self._largest_force, self.message)

    @reached.setter
    def reached(self, reached: _Reached) -> None:
        self.at, self.taken, self.message = reached.at, reached.taken, reached.message
        self._halved, self._largest_force = reached.halved, reached.largest_force
        # Newton's method keeps an inverse of steps before, of which nothing may depend.
        self._operators.clear()

    def block(self, steps: int) -> list[list[StepState]]:
        """The points of up to ``steps`` whole steps; fewer if ``message`` says so."""
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
        """One step up to a time, in parts where that is needed."""
        whole = 1 << MAX_HALVED
        points: list[StepState] = []
        done = 0
        while done < whole:
            part = whole >> self._halved
            time, force = end, end_force
            if done + part < whole:
                times = self._time(np.array([self.taken + (done + part) / whole]))
                time, force = float(times[0]), self._excitation(times)[0]
            point, error = self._part(time, force)
            if point is None:
                if self._halved == MAX_HALVED:
                    self.message = self._failure(error)
                    return points
                self._halved += 1
                continue
            points.append(point)
            self.at, done = point, done + part
            if self._halved > 0 and error <= DOUBLE_BELOW and done % (2 * part) == 0:
                self._halved -= 1
        return points

    def _part(self, time: float, force: Array) -> tuple[StepState | None, float]:
        """A step up to a time, None if it must be smaller, and its error over what is allowed.

        A step without equilibrium has an infinite error.
        """
        operators, equilibrium = self._operators_of(self._halved)
        at, step, size = self.at, operators.step, len(force)
        change = (
            operators.gain @ (0.5 * (at.force + force))
            - operators.drag @ at.motion
            - operators.joint_gain @ at.response.force.ravel()
        )
        velocity = at.motion[size:]
        free = step * (self.model.connection @ (velocity + 0.5 * change)) + at.missing
        trial = equilibrium.solve(at.response, free, self._largest_force)
        if not trial.solved:
            self._missed = trial.relative
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
        """The error a step adds, over what is allowed."""
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

    def _operators_of(self, halved: int) -> tuple[_Operators, JointEquilibrium]:
        if halved not in self._operators:
            operators = _Operators(self.model, self._step / (1 << halved))
            equilibrium = JointEquilibrium(self._joints, operators.flexibility)
            self._operators[halved] = operators, equilibrium
        return self._operators[halved]

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
        step = self._step / (1 << MAX_HALVED)
        where = f"at t = {self.at.time:.9g} s, with steps of {step:.3g} s"
        if np.isfinite(error):
            return (
                f"{where}, a step's error is {error:.3g} times what is allowed: give smaller steps "
                "or a larger tolerance"
            )
        return (
            f"{where}, the joints are not in equilibrium: residual {self._missed:.3g} of their "
            f"largest force, above {TOLERANCE:g}; give smaller steps, or a law of joints whose "
            "force is continuous"
        )


def _followed(
    march: _March,
    companion: _March | None,
    count: int,
    every: int,
    steps: Steps,
    reached: Callable[[float], None],
) -> MotionRecord:
    """The record of a march until it has taken so many steps, or says why it has not.

    Its ``companion``, by steps of twice the length, is to follow it.
    """
    record = MotionRecord(march.model, march.directions, every, march.at)
    marches = [march] if companion is None else [march, companion]

    def block() -> tuple[RecordedSteps | None, list[_Reached]]:
        points = march.block(min(BLOCK, count - march.taken))
        beside = companion.block(march.taken // 2 - companion.taken) if companion else []
        return record.recorded(points, beside), [each.reached for each in marches]

    while march.taken < count and not any(each.message for each in marches):
        recorded, reached_by = steps("steps in time", block)
        for each, at in zip(marches, reached_by, strict=True):
            each.reached = at
        if recorded is not None:
            record.add(recorded)
        reached(march.taken / count)
    return record
