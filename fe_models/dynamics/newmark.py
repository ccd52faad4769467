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
as h²/12 Δa: it chooses the steps where a tolerance is given, and is reported where not.

Source: Newmark 1959, Journal of the Engineering Mechanics Division (ASCE) 85(3), 67.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg as sl

from fe_models.dynamics.model import DynamicModel, Joints, Response
from fe_models.dynamics.motion import Energies, Motion, Start, accelerations, quadratic
from sa_solver.types import Array

# Residual of the joints' equilibrium, relative to the largest force they have had so far. Newton
# ends far below on its last iteration; sums over 1e5 steps still hold to 1e-6 at worst.
TOLERANCE = 1e-10
# Where joints slip far in one step, their displacement is resolved to this share of it only: ten
# times the rounding of a number.
ROUNDING = 2e-15
# Newton needs one to five iterations; where it takes more, it walks between two kinks.
MAX_ITERATIONS = 20
# A correction that does not lower the residual at 1/64 of its size points in a useless direction.
MAX_SHORTENED = 6
# A step is halved at most this often: to 1/4096, where any continuous law is nearly linear.
MAX_HALVED = 12
# A step is doubled when its error is this share of what is allowed: doubling multiplies it by 8.
DOUBLE_BELOW = 1.0 / 16.0
# Steps held in full before their energies are summed and the rows not asked for dropped.
BLOCK = 4096


@dataclass(frozen=True)
class StepControl:
    """Steps of ``step`` [s], or where ``tolerance`` is given, parts of it: halves, quarters, ...

    ``tolerance`` is the error of displacement one step may add, relative to the largest
    displacement so far, both as norms weighted by mass. The result has a row every ``every`` steps.
    Raises ``ValueError`` for a step or tolerance that is not above zero.
    """

    step: float
    tolerance: float | None = None
    every: int = 1

    def __post_init__(self) -> None:
        if not self.step > 0.0 or self.every < 1:
            raise ValueError(
                f"a step of {self.step:g} s, every {self.every}: give a step above 0, every 1 "
                "or more"
            )
        if self.tolerance is not None and not self.tolerance > 0.0:
            raise ValueError(f"tolerance {self.tolerance:g}: give one above 0")


def integrate(
    model: DynamicModel,
    joints: Joints | None,
    excitation: Callable[[Array], Array] | None,
    duration: float,
    control: StepControl,
    start: Start | None = None,
) -> Motion:
    """Motion of a structure with joints from ``start`` on, at rest unless given.

    ``excitation`` takes times ``(t,)`` to forces ``(t, n)``; None is none, and None of ``joints``
    leaves all of them free. The last time is the first multiple of the step at or after
    ``duration`` [s]. A motion that has not been found to the end says so in its ``message``.
    Raises ``ValueError`` if joints and connection do not have the same directions.
    """
    laws = joints if joints is not None else _Free()
    if len(model.connection) % laws.directions:
        raise ValueError(
            f"a connection of {len(model.connection)} rows for joints of {laws.directions} "
            "directions: give a row for each direction of each joint"
        )
    steps = int(np.ceil(duration / control.step * (1.0 - 1e-12)))
    shake = excitation if excitation is not None else _Silence(len(model.mass))
    march = _March(model, laws, shake, control, start or Start())
    record = _Record(model, laws.directions, control.every, march)
    while march.taken < steps and not march.message:
        record.add(march.block(min(BLOCK, steps - march.taken)), march)
    return record.motion(march)


@dataclass(frozen=True)
class _FreeResponse:
    force: Array
    tangent: Array
    state: Array
    dissipated: Array


class _Free:
    """Joints that transmit nothing."""

    directions = 1

    def rest(self, joints: int) -> Array:
        return np.zeros((joints, 0))

    def respond(self, state: Array, increment: Array) -> Response:
        count = len(increment)
        return _FreeResponse(
            np.zeros((count, 1)), np.zeros((count, 1, 1)), state, np.zeros(count)
        )


@dataclass(frozen=True)
class _Silence:
    size: int

    def __call__(self, times: Array) -> Array:
        return np.zeros((len(times), self.size))


class _Operators:
    """What one step h does: its matrices, found once."""

    def __init__(self, model: DynamicModel, step: float) -> None:
        half = 0.5 * step
        effective = model.mass + half * model.damping + half**2 * model.stiffness
        self.step = step
        self.gain = step * np.linalg.inv(effective)
        """Takes a mean force to the change of velocity ``(n, n)``."""
        self.drag = self.gain @ np.hstack([model.stiffness, model.damping + half * model.stiffness])
        """Takes displacements and velocities to the change of velocity lost ``(n, 2 n)``."""
        self.joint_gain = 0.5 * self.gain @ model.connection.T
        """Takes joint forces at one end to the change of velocity lost ``(n, j d)``."""
        self.flexibility = half * model.connection @ self.joint_gain
        """A ``(j d, j d)``, takes joint forces at the end to joint displacements lost."""
        self.weight = float(np.diag(self.flexibility).max(initial=0.0))


class _Trial(NamedTuple):
    """Joint displacements of a step tried, and how far they are from equilibrium [mm]."""

    increment: Array
    response: Response
    residual: Array
    size: float


class _Point(NamedTuple):
    """A time on the way: displacements and velocities ``(2 n,)``, and the joints.

    ``missing`` ``(j d,)`` [mm] is how far the joints are behind the structure, the residual left.
    """

    motion: Array
    force: Array
    response: Response
    missing: Array
    step: float
    residual: float


class _JointEquilibrium:
    """Newton's method for u = u_free - A F(u) over one step."""

    def __init__(self, joints: Joints, flexibility: Array) -> None:
        self._joints, self._flexibility = joints, flexibility
        self._size, self._directions = len(flexibility), joints.directions
        self._by_joint = flexibility.reshape(self._size, -1, self._directions)
        self._factor: tuple[Array, Array] | None = None
        self._factored = np.empty(0)

    def solve(self, before: Response, free: Array, scale: float) -> _Trial:
        """The best found from the state ``before``; solved where its size is within tolerance.

        ``free`` ``(j d,)`` is where the joints would go without forces at the end of the step, and
        ``scale`` [mm] what residuals are measured against.
        """
        state, tangent = before.state, before.tangent
        start = self._correction(free - self._flexibility @ before.force.ravel(), tangent)
        at = self._trial(state, free, start)
        for _ in range(MAX_ITERATIONS):
            if at.size <= TOLERANCE * scale:
                break
            closer = self._search(state, free, at)
            if closer is None:
                break
            at = closer
        return at

    def _search(self, state: Array, free: Array, at: _Trial) -> _Trial | None:
        """A trial with a lower residual, along Newton's correction or what is left of it."""
        correction = self._correction(at.residual, at.response.tangent)
        for shortened in range(MAX_SHORTENED + 1):
            trial = self._trial(state, free, at.increment - 0.5**shortened * correction)
            if trial.size < at.size:
                return trial
        return None

    def _trial(self, state: Array, free: Array, increment: Array) -> _Trial:
        response = self._joints.respond(state, increment.reshape(-1, self._directions))
        residual = increment - free + self._flexibility @ response.force.ravel()
        return _Trial(increment, response, residual, float(np.abs(residual).max(initial=0.0)))

    def _correction(self, residual: Array, tangent: Array) -> Array:
        """(1 + A T)⁻¹ r; factors are kept as long as the tangents T are the same."""
        if self._size == 1:
            return np.asarray(residual / (1.0 + self._flexibility[0, 0] * tangent[0, 0, 0]))
        if self._factor is None or not np.array_equal(tangent, self._factored):
            coupled = np.einsum("ajc,jcd->ajd", self._by_joint, tangent)
            matrix = np.eye(self._size) + coupled.reshape(self._size, self._size)
            self._factor, self._factored = sl.lu_factor(matrix, check_finite=False), tangent
        return np.asarray(sl.lu_solve(self._factor, residual, check_finite=False))


class _March:
    """The structure on its way, step by step."""

    def __init__(
        self,
        model: DynamicModel,
        joints: Joints,
        excitation: Callable[[Array], Array],
        control: StepControl,
        start: Start,
    ) -> None:
        self._model, self._joints, self._excitation = model, joints, excitation
        self._control = control
        self._operators: dict[int, tuple[_Operators, _JointEquilibrium]] = {}
        self.start_time, self.taken, self.message = start.time, 0, ""
        self.at = self._start(start)
        self._halved = 0
        self._largest_force = float(np.abs(self.at.response.force).max(initial=0.0))
        self._largest_motion = self._norm(self.at.motion[: len(model.mass)])
        self._inverse_mass = np.linalg.inv(model.mass)

    def block(self, steps: int) -> list[list[_Point]]:
        """The points of up to ``steps`` whole steps; fewer if ``message`` says so."""
        times = self._time(np.arange(self.taken + 1, self.taken + steps + 1))
        found = []
        for force in self._excitation(times):
            points = self._whole_step(force)
            if self.message:
                break
            found.append(points)
            self.taken += 1
        return found

    def _whole_step(self, end_force: Array) -> list[_Point]:
        """One step, in parts where that is needed."""
        whole = 1 << MAX_HALVED
        points: list[_Point] = []
        done = 0
        while done < whole:
            part = whole >> self._halved
            last = done + part == whole
            force = end_force if last else self._force_at(self.taken + (done + part) / whole)
            point, error = self._part(force)
            if point is None:
                if self._halved == MAX_HALVED:
                    self.message = self._failure(done / whole, error)
                    return points
                self._halved += 1
                continue
            points.append(point)
            self.at, done = point, done + part
            if self._halved > 0 and error <= DOUBLE_BELOW and done % (2 * part) == 0:
                self._halved -= 1
        return points

    def _part(self, force: Array) -> tuple[_Point | None, float]:
        """A step of the present size, None if it must be smaller; its error over the tolerance.

        A step without equilibrium has an infinite error.
        """
        operators, equilibrium = self._operators_of(self._halved)
        at, step, size = self.at, operators.step, len(force)
        before = at.response.force.ravel()
        change = (
            operators.gain @ (0.5 * (at.force + force))
            - operators.drag @ at.motion
            - operators.joint_gain @ before
        )
        velocity = at.motion[size:]
        free = step * (self._model.connection @ (velocity + 0.5 * change)) + at.missing
        reach = float(np.abs(free).max(initial=0.0))
        scale = operators.weight * self._largest_force + ROUNDING / TOLERANCE * reach
        found = equilibrium.solve(at.response, free, scale)
        joint_force = found.response.force.ravel()
        largest = max(self._largest_force, float(np.abs(joint_force).max(initial=0.0)))
        scale += operators.weight * (largest - self._largest_force)
        if not found.size <= TOLERANCE * scale:
            self._missed = found.size / scale
            return None, np.inf
        change -= operators.joint_gain @ joint_force
        motion = at.motion.copy()
        motion[:size] += step * (velocity + 0.5 * change)
        motion[size:] += change
        residual = found.size / scale if scale > 0.0 else 0.0
        point = _Point(motion, force, found.response, -found.residual, step, residual)
        error = self._error(point)
        if error > 1.0:
            return None, error
        self._largest_force = largest
        return point, error

    def _error(self, point: _Point) -> float:
        """The error a step adds, over what is allowed; 0 where steps are fixed."""
        if self._control.tolerance is None:
            return 0.0
        size = len(point.force)
        jump = self._acceleration(point) - self._acceleration(self.at)
        error = point.step**2 / 12.0 * self._norm(jump)
        self._largest_motion = max(self._largest_motion, self._norm(point.motion[:size]))
        allowed = self._control.tolerance * self._largest_motion
        return error / allowed if error > 0.0 else 0.0

    def _acceleration(self, point: _Point) -> Array:
        model, size = self._model, len(point.force)
        return np.asarray(
            self._inverse_mass
            @ (
                point.force
                - point.response.force.ravel() @ model.connection
                - model.damping @ point.motion[size:]
                - model.stiffness @ point.motion[:size]
            )
        )

    def _norm(self, values: Array) -> float:
        return float(np.sqrt(values @ self._model.mass @ values))

    def _operators_of(self, halved: int) -> tuple[_Operators, _JointEquilibrium]:
        if halved not in self._operators:
            operators = _Operators(self._model, self._control.step / (1 << halved))
            equilibrium = _JointEquilibrium(self._joints, operators.flexibility)
            self._operators[halved] = operators, equilibrium
        return self._operators[halved]

    def _start(self, start: Start) -> _Point:
        model, directions = self._model, self._joints.directions
        motion = start.motion(len(model.mass))
        stretch = model.connection @ motion[: len(model.mass)]
        if start.joint_state is None:
            rest = self._joints.rest(len(stretch) // directions)
            response = self._joints.respond(rest, stretch.reshape(-1, directions))
        else:
            still = np.zeros((len(start.joint_state), directions))
            response = self._joints.respond(start.joint_state, still)
        force = self._excitation(np.array([start.time]))[0]
        return _Point(motion, force, response, np.zeros(len(stretch)), 0.0, 0.0)

    def _time(self, steps: Array | float) -> Array:
        return np.asarray(self.start_time + self._control.step * np.asarray(steps))

    def _force_at(self, steps: float) -> Array:
        return np.asarray(self._excitation(self._time([steps]))[0])

    def _failure(self, done: float, error: float) -> str:
        step = self._control.step / (1 << MAX_HALVED)
        where = f"at t = {float(self._time(self.taken + done)):.9g} s, with steps of {step:.3g} s"
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


class _Record:
    """Rows of the result, and the energies summed until each."""

    def __init__(self, model: DynamicModel, directions: int, every: int, march: _March) -> None:
        self._model, self._directions, self._every = model, directions, every
        joints = len(model.connection) // directions
        self._before = march.at
        self._sums = np.zeros(3 + joints)
        self._rows: list[tuple[Array, Array, Array, Array]] = []
        self._largest_jump = self._largest_motion = self._residual = 0.0
        self._steps = 0
        self._keep([march.at], np.array([True]), self._sums[None])

    def add(self, block: list[list[_Point]], march: _March) -> None:
        """Sum the energies of whole steps just taken, and keep the rows asked for."""
        points = [point for whole in block for point in whole]
        if not points:
            return
        first = march.taken - len(block)
        kept = np.array(
            [
                last and (first + step + 1) % self._every == 0
                for step, whole in enumerate(block)
                for last in [False] * (len(whole) - 1) + [True]
            ]
        )
        flows = self._flows(points)
        sums = self._sums + np.cumsum(flows, axis=0)
        self._sums = sums[-1]
        self._keep(points, kept, sums)
        self._before = points[-1]
        self._steps += len(points)
        self._residual = max(self._residual, *(point.residual for point in points))

    def motion(self, march: _March) -> Motion:
        model = self._model
        motion, force, joint_force, sums = (
            np.concatenate(parts) for parts in zip(*self._rows, strict=True)
        )
        displacement, velocity = np.split(motion, 2, axis=1)
        shape = (len(motion), -1, self._directions)
        worst = self._largest_jump / self._largest_motion if self._largest_jump > 0.0 else 0.0
        rows = np.arange(len(motion)) * self._every
        return Motion(
            times=march.start_time + march.step * rows,
            displacement=displacement,
            velocity=velocity,
            acceleration=accelerations(model, motion, force, joint_force),
            joint_displacement=(displacement @ model.connection.T).reshape(shape),
            joint_force=joint_force.reshape(shape),
            joint_state=march.at.response.state,
            energies=Energies(
                kinetic=quadratic(model.mass, velocity),
                elastic=quadratic(model.stiffness, displacement),
                excitation=sums[:, 0],
                damping=sums[:, 1],
                joint_work=sums[:, 2],
                joints=sums[:, 3:],
            ),
            error=worst,
            residual=self._residual,
            steps=self._steps,
            message=march.message,
        )
