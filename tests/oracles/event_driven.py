"""Exact integration of structures with joints of one spring and one slider each, as a reference.

While no joint changes between stick and slip, the structure is linear: a stuck joint is its
spring and the constant force -kt s of its slider at s, a slipping one the constant ± limit. It is
moved by matrix exponentials from one event to the next. Stick ends where the spring reaches the
limit, slip where the joint stops; both are located to rounding. Only rounding errors remain; the
cost is some matrix exponentials per event.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from fe_models.dynamics.excitation import CombinedForces, ExcitationForce
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.motion import Energies, Motion, Start, accelerations, quadratic
from fe_models.dynamics.rig import natural_frequencies
from sa_solver.types import Array
from tests.oracles.linear_flow import Layout, LinearFlow, unknowns
from tests.oracles.signals import breaks, signal_at, single_forces

# Events are searched in parts of a step, this many in the shortest period, so that each watched
# quantity has at most one extremum in a part.
PARTS = 20
# A passage through zero by less than this share of the quantity's terms is rounding.
ROUNDING = 1e-13
# A break this close to the end of a step, as a share of the step, is at its end: rounding.
SAME = 1e-9
# Largest number of changes of state in a part of a step; with more, joints switch without moving.
MAX_EVENTS = 100


@dataclass(frozen=True)
class SliderJoints:
    """Joints of one direction: a spring in series with a slider, and a parallel spring.

    ``stiffness`` kt and ``residual_stiffness`` kr [N/mm] of the springs, ``limit`` [N] of the
    slider, all ``(j,)``. Raises ``ValueError`` unless kt > 0 and the others are 0 or more.
    """

    stiffness: Array
    limit: Array
    residual_stiffness: Array

    def __post_init__(self) -> None:
        lowest = [np.min(v) for v in (self.stiffness, self.limit, self.residual_stiffness)]
        if not (lowest[0] > 0.0 and min(lowest[1:]) >= 0.0):
            raise ValueError(
                f"stiffness {lowest[0]:g} N/mm, limit {lowest[1]:g} N, residual stiffness "
                f"{lowest[2]:g} N/mm: give a stiffness above 0, and 0 or more of the others"
            )


def integrate_exactly(
    model: DynamicModel,
    joints: SliderJoints,
    excitation: ExcitationForce | CombinedForces | None,
    duration: float,
    step: float,
    start: Start | None = None,
) -> Motion:
    """Return the motion at multiples of ``step`` [s] until the first at or after ``duration``.

    A ``joint_state`` ``(j, 1)`` holds the slider positions [mm]; sliders that a start would leave
    beyond their limit have slipped to it. An incomplete motion is marked as such. Raises
    ``ValueError`` if the number of joints differs from the rows of the connection.
    """
    if len(joints.stiffness) != len(model.connection):
        raise ValueError(
            f"{len(joints.stiffness)} joints for a connection of {len(model.connection)} rows: "
            "give as many of both"
        )
    begin = start or Start()
    count = int(np.ceil(duration / step * (1.0 - 1e-12)))
    times = begin.time + step * np.arange(count + 1.0)
    run = _Run(model, joints, single_forces(excitation), begin, step)
    rows = [run.row()]
    for time in times[:-1]:
        run.advance(float(time))
        if run.message:
            break
        rows.append(run.row())
    return _motion(model, run, excitation, times[: len(rows)], rows)


class _Row(NamedTuple):
    """Stored values of a time, with the energies supplied, damped and lost in each joint."""

    motion: Array
    joint_force: Array
    energies: Array


class _Run:
    """Current state of the integration, and the energies so far."""

    def __init__(
        self,
        model: DynamicModel,
        joints: SliderJoints,
        forces: Sequence[ExcitationForce],
        start: Start,
        step: float,
    ) -> None:
        self._model, self._joints, self._forces, self._step = model, joints, forces, step
        self._flows: dict[tuple[Layout, bytes], LinearFlow] = {}
        self._breaks = np.unique([time for force in forces for time in breaks(force)])
        self._motion = start.motion(len(model.mass))
        stretch, reach = self._stretch(), joints.limit / joints.stiffness
        given = 0.0 if start.joint_state is None else start.joint_state[:, 0]
        slider = np.clip(given, stretch - reach, stretch + reach)
        # Direction in which each joint slips; 0 where it is stuck.
        self._slip = np.zeros(len(stretch))
        # Its force without that of springs that hold it.
        self._constant = -joints.stiffness * slider
        self._energies = np.zeros(2 + len(stretch))
        held = joints.stiffness + joints.residual_stiffness
        self._highest = float(natural_frequencies(model, held).max())
        self.steps, self.message = 0, ""

    @property
    def sliders(self) -> Array:
        """Positions of the sliders ``(j, 1)`` [mm]."""
        return (self._stretch() - self._spring_force() / self._joints.stiffness)[:, None]

    def row(self) -> _Row:
        residual = self._joints.residual_stiffness * self._stretch()
        return _Row(self._motion, self._spring_force() + residual, self._energies.copy())

    def advance(self, time: float) -> None:
        """Advance one step from a time, in parts between breaks of the excitation."""
        margin, end = SAME * self._step, time + self._step
        inside = self._breaks[(self._breaks > time + margin) & (self._breaks < end - margin)]
        for first, last in pairwise([time, *inside.tolist(), end]):
            # The same number for every step without breaks, of which exponentials are kept.
            length = self._step if len(inside) == 0 else last - first
            signals = [signal_at(force, 0.5 * (first + last)) for force in self._forces]
            waves = tuple(tuple(wave.angular for wave in signal.waves) for signal in signals)
            layout = Layout(len(self._motion) // 2, len(self._slip), waves)
            fastest = max(
                [self._highest, *(abs(w) / (2.0 * np.pi) for angular in waves for w in angular)]
            )
            parts = int(np.ceil(length * fastest * PARTS))
            for part in range(parts):
                start = first + part * length / parts
                y = unknowns(layout, self._motion, signals, start)
                self._part(layout, y, length / parts, known=len(inside) == 0)
                if self.message:
                    self.message = f"at t = {start:.9g} s, {self.message}"
                    return

    def _part(self, layout: Layout, y: Array, length: float, *, known: bool) -> None:
        """Follow y for a time, from event to event."""
        left = length
        for _ in range(MAX_EVENTS):
            y[layout.constant] = self._constant
            flow = self._flow(layout)
            forward, powers = flow.over(left, known=known and left == length)
            after = forward @ y
            time, joint = self._first_event(flow, layout, y, after, left)
            if joint is None:
                self._account(layout, y, after, powers)
                return
            if time > 0.0:
                forward, powers = flow.over(time)
                after = forward @ y
                self._account(layout, y, after, powers)
                y, left = after, left - time
            self._switch(joint)
        self.message = (
            f"joints changed between stick and slip {MAX_EVENTS} times within {length:.3g} s: "
            "their structure is singular, or their limits are too close to 0; give smaller steps"
        )

    def _first_event(
        self, flow: LinearFlow, layout: Layout, y: Array, after: Array, left: float
    ) -> tuple[float, tuple[int, float] | None]:
        """Return when the first joint changes its state, with joint and direction; None if none."""
        first: tuple[float, tuple[int, float] | None] = (left, None)
        for joint, slip in enumerate(self._slip):
            for direction in (1.0, -1.0) if slip == 0.0 else (slip,):
                watched = _Watched(flow, *self._watch(joint, direction, layout))
                time = watched.first_passage(y, after, left)
                if time is not None and time <= first[0]:
                    first = time, (joint, direction)
        return first

    def _watch(self, joint: int, direction: float, layout: Layout) -> tuple[Array, float]:
        """Return a row and an offset that are positive with y where a joint must change its state.

        A stuck joint is then beyond its limit, or a slipping one moves back.
        """
        row = np.zeros(layout.total)
        stretch = direction * self._model.connection[joint]
        if self._slip[joint] == 0.0:
            row[layout.displacement] = self._joints.stiffness[joint] * stretch
            row[layout.constant.start + joint] = direction
            return row, -float(self._joints.limit[joint])
        row[layout.velocity] = -stretch
        return row, 0.0

    def _switch(self, event: tuple[int, float]) -> None:
        joint, direction = event
        limit = direction * self._joints.limit[joint]
        if self._slip[joint] == 0.0:
            self._slip[joint], self._constant[joint] = direction, limit
        else:
            stiffness = self._joints.stiffness[joint]
            self._slip[joint] = 0.0
            self._constant[joint] = limit - stiffness * self._stretch()[joint]

    def _account(self, layout: Layout, before: Array, after: Array, powers: Array) -> None:
        """Advance to the end of a part of the step, and add its energies."""
        stretch = self._stretch()
        self._motion = after[: 2 * layout.size]
        lost = self._slip * self._joints.limit * (self._stretch() - stretch)
        self._energies += np.concatenate([before @ powers @ before, lost])
        self.steps += 1

    def stored(self, stretch: Array, force: Array) -> Array:
        """Return the joint springs' energy above that at the first of the times ``(t,)`` [N mm].

        ``stretch`` and ``force`` ``(t, j)``.
        """
        residual = self._joints.residual_stiffness * stretch
        springs = (force - residual) ** 2 / self._joints.stiffness + residual * stretch
        held = 0.5 * springs.sum(axis=1)
        return np.asarray(held - held[0])

    def _flow(self, layout: Layout) -> LinearFlow:
        stuck = self._slip == 0.0
        key = layout, stuck.tobytes()
        if key not in self._flows:
            held = self._joints.residual_stiffness + stuck * self._joints.stiffness
            shapes = [force.shape for force in self._forces]
            self._flows[key] = LinearFlow(self._model, held, shapes, layout)
        return self._flows[key]

    def _stretch(self) -> Array:
        return np.asarray(self._model.connection @ self._motion[: len(self._model.mass)])

    def _spring_force(self) -> Array:
        stuck = self._slip == 0.0
        return np.asarray(self._constant + stuck * self._joints.stiffness * self._stretch())


@dataclass(frozen=True)
class _Watched:
    """Quantity ``row`` y + ``offset``, which passes zero upwards where a joint changes state."""

    flow: LinearFlow
    row: Array
    offset: float

    def first_passage(self, y: Array, after: Array, length: float) -> float | None:
        """Return when it passes zero on the way from ``y`` to ``after``, None if it does not."""
        rounding = ROUNDING * max(self._terms(y), self._terms(after))
        end = length
        if self._value(after) <= rounding:
            if not self._slope(y) > 0.0 > self._slope(after):
                return None
            end = self._root(y, self._slope, 0.0, length)
            if self._value(self.flow.after(end, y)) <= rounding:
                return None
        begin = 0.0
        if self._value(y) >= 0.0:
            # It starts at zero, as after the last event: it passes now, or after a dip.
            if not self._slope(y) < 0.0 < self._slope(self.flow.after(end, y)):
                return 0.0
            begin = self._root(y, self._slope, 0.0, end)
            if self._value(self.flow.after(begin, y)) >= 0.0:
                return 0.0
        return self._root(y, self._value, begin, end)

    def _value(self, y: Array) -> float:
        return float(self.row @ y) + self.offset

    def _slope(self, y: Array) -> float:
        return float(self.row @ self.flow.rate(y))

    def _terms(self, y: Array) -> float:
        return float(np.abs(self.row) @ np.abs(y)) + abs(self.offset)

    def _root(self, y: Array, form: Callable[[Array], float], low: float, high: float) -> float:
        """Return the zero of a form between two times at which its signs differ, to rounding."""

        def at(time: float) -> float:
            return form(self.flow.after(time, y))

        return float(brentq(at, low, high, xtol=ROUNDING * high, rtol=4.0 * np.finfo(float).eps))


def _motion(
    model: DynamicModel,
    run: _Run,
    excitation: ExcitationForce | CombinedForces | None,
    times: Array,
    rows: list[_Row],
) -> Motion:
    motion, joint_force, energies = (np.array(column) for column in zip(*rows, strict=True))
    displacement, velocity = np.split(motion, 2, axis=1)
    force = np.zeros_like(displacement) if excitation is None else excitation(times)
    stretch = displacement @ model.connection.T
    return Motion(
        times=times,
        displacement=displacement,
        velocity=velocity,
        acceleration=accelerations(model, motion, force, joint_force),
        joint_displacement=stretch[:, :, None],
        joint_force=joint_force[:, :, None],
        coarse_run=None,
        joint_state=run.sliders,
        energies=Energies(
            kinetic=quadratic(model.mass, velocity),
            elastic=quadratic(model.stiffness, displacement),
            excitation=energies[:, 0],
            damping=energies[:, 1],
            joint_work=run.stored(stretch, joint_force) + energies[:, 2:].sum(axis=1),
            joints=energies[:, 2:],
        ),
        error=0.0,
        residual=0.0,
        steps=run.steps,
        message=run.message,
    )
