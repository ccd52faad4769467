"""Joint laws from measured hysteresis loops: the law's own loop beside those of a record.

Loops are averaged with loops of their own step alone, those that are alike
(:class:`wear.joints.measured_loops.MeasuredLoops`), and only where there is noise: forces and
displacements at equal times between reversals. The law goes through its settled loop from one
turning point to the other. Where these are is fitted too, since the samples only pass them by, and
so is a constant force of each step: of a loop within others, Masing's laws leave just that. Every
point counts by the noise of its force and, where the loop is steep, that of its displacement.
Bounds count what scatters about the law: a displacement that is wrong in every cycle alike is not
seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from sa_solver.types import Array, Indices
from wear.fitting.problem import FitError, FitProblem, Series, Unknown
from wear.joints.bouc_wen import BoucWen
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.loop_record import (
    LoopBranch,
    LoopPair,
    LoopRecord,
    MeasuredLoopError,
    noise_of,
)
from wear.joints.measured_loops import MeasuredLoops
from wear.joints.parameters import UniaxialLaw

POINTS = 40
"""Most of each branch of a loop."""

SLOPE_STEP = 1e-3
"""Of the amplitude: slopes that tell the noise of a displacement in that of the force."""

SETTLING = 2
"""Cycles before the loop that counts: a law that forgets is settled after one."""

BEYOND, WITHIN = 3.0, 0.5
"""A turning point is no farther beyond the outermost sample, nor within it, than so many times the
distance of that to its neighbours, ..."""

TURN_NOISE = 5.0
"""... or than this many standard deviations of the noise."""

SAME_COURSE = 0.02
"""Loops go the same way in time if the spreads of their displacements differ by less than this."""

STIFFER = 1.0 - 1e-9
"""Largest residual stiffness of a Bouc-Wen joint, in its stiffness."""

MOBILISED = 1.2
"""Friction to begin with where nothing slides, over what the record has mobilised."""

OFFSET, TURNS = "offset", ("lower", "upper")
"""Mean force and turning points of a loop, beside the parameters of the law."""

COMMON = ("stiffness", "friction", "normal_load", "residual_stiffness")
"""Parameters that all laws have, none below 0."""


@dataclass(frozen=True)
class LoopLaw:
    """A law as it is fitted.

    ``law`` makes it of its parameters, ``shape`` are those that it has beside the common ones, with
    bounds, and ``tried`` values of these to begin with.
    """

    law: Callable[..., UniaxialLaw]
    shape: Mapping[str, tuple[float, float]]
    tried: Mapping[str, tuple[float, ...]]


LAWS: Mapping[str, LoopLaw] = {
    "jenkins": LoopLaw(Jenkins, {}, {}),
    "uniform_iwan": LoopLaw(UniformIwan, {}, {}),
    "bouc_wen": LoopLaw(
        BoucWen,
        {"sigma": (0.5, 1.0), "exponent": (1.0, 100.0)},
        {"sigma": (0.5,), "exponent": (1.5, 4.0)},
    ),
    "four_parameter_iwan": LoopLaw(
        FourParameterIwan,
        {"chi": (-0.99, 10.0), "beta": (0.0, 1e3)},
        {"chi": (-0.5, 0.5), "beta": (0.3, 3.0)},
    ),
}
"""By the names that a case has for them."""


@dataclass(frozen=True)
class LoopData:
    """Loops of one step of the record ``name``, or their mean.

    ``displacement`` ``(n,)`` [mm] about its mean and ``force`` ``(n,)`` [N], on branches of
    ``sense`` ``(n,)`` ±1; ``turns`` ``(2,)`` [mm] the outermost samples, and ``spacing`` [mm] the
    distance to their neighbours; ``noise`` the standard deviations of displacement [mm] and force
    [N]. ``amplitude`` [mm] is half the stroke, ``normal_load`` [N] NaN if it is not known.
    ``stiffness``, ``residual_stiffness`` [N/mm] and ``limit`` [N], the friction force, are what the
    record says of itself, to begin with.

    Examples
    --------
    The loop of a Jenkins joint, which is what its record says:

    >>> import numpy as np
    >>> from wear.fitting import mean_loop
    >>> from wear.joints import Jenkins, march_joints, measure_loops
    >>> law = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> motion = 0.03 * np.sin(2.0 * np.pi * np.arange(801) / 160)
    >>> record = march_joints(law, law.rest(1), np.zeros((1, 1)), motion[:, None, None])
    >>> loop = mean_loop("first", measure_loops(motion, record.force.ravel(), 100.0))
    >>> print(f"{loop.limit:.2f} N, {loop.amplitude:.4f} mm")
    50.00 N, 0.0300 mm
    """

    name: str
    displacement: Array
    force: Array
    sense: Array
    turns: Array
    spacing: float
    noise: tuple[float, float]
    amplitude: float
    normal_load: float
    stiffness: float
    residual_stiffness: float
    limit: float


def mean_loop(name: str, measured: MeasuredLoops) -> LoopData:
    """Return the mean of loops that are alike, at up to :data:`POINTS` places of each branch.

    Without noise, and of a single loop, there is nothing to average: samples are taken as they are.
    Raises MeasuredLoopError for loops of several steps.

    Examples
    --------
    See :class:`LoopData`.

    >>> from wear.fitting import mean_loop
    """
    measured.require_alike()
    record = measured.record
    noise = noise_of(record.displacement), noise_of(record.force)
    pairs = [tuple(sorted(pair, key=lambda branch: -branch.sense)) for pair in measured.branches]
    pairs = [pairs[len(pairs) // 2]] if not any(noise) else _of_one_course(record, pairs)
    counts = [min(POINTS, *(len(pair[side].samples) - 2 for pair in pairs)) for side in (0, 1)]
    if min(counts) < 1:
        raise MeasuredLoopError(
            f"a branch of {2 - max(0, -min(counts))} samples; allowed: some between its reversals"
        )
    # Displacements and forces (2, m) of all loops, each about its own middle.
    points = np.array(
        [
            np.concatenate(
                [
                    _points(record, branch, count, len(pairs) > 1, noise[0] == 0.0)
                    for branch, count in zip(pair, counts, strict=True)
                ],
                axis=1,
            )
            for pair in pairs
        ]
    )
    middles = points[:, 0].mean(axis=1)
    motion, force = points.mean(axis=0)
    ends = np.array([[record.displacement[pair[k].begin] for k in (0, 1)] for pair in pairs])
    beside = [
        record.displacement[branch.samples[[0, 1, -2, -1]]] for pair in pairs for branch in pair
    ]
    limit = float(
        (measured.friction_force if measured.slides else MOBILISED * measured.force).mean()
    )
    amplitude = 0.5 * float(measured.stroke.mean())
    return LoopData(
        name=name,
        displacement=motion - middles.mean(),
        force=force,
        sense=np.repeat([1.0, -1.0], counts),
        turns=(ends - middles[:, None]).mean(axis=0),
        spacing=float(np.abs(np.diff(beside, axis=1)[:, [0, 2]]).max()),
        noise=noise,
        amplitude=amplitude,
        normal_load=float(measured.normal_load.mean()),
        stiffness=_stiffness(measured, amplitude, limit),
        residual_stiffness=float(np.nan_to_num(measured.residual_stiffness).mean()),
        limit=limit,
    )


def _of_one_course(record: LoopRecord, pairs: Sequence[LoopPair]) -> list[LoopPair]:
    """The loops that go the same way in time, as most do: those of a transition are faster."""
    courses = [[record.displacement[branch.samples].std() for branch in pair] for pair in pairs]
    away = np.abs(courses / np.median(courses, axis=0) - 1.0).max(axis=1)
    return [
        pair for pair, one in zip(pairs, away, strict=True) if one <= max(SAME_COURSE, away.min())
    ]


def _points(
    record: LoopRecord, branch: LoopBranch, count: int, between: bool, exact: bool
) -> Array:
    """Displacement and force ``(2, count)`` of a branch, its ends left out.

    At equal times, and of an ``exact`` displacement, in which a rest is no time, as much by its
    way; at samples, or ``between`` them too.
    """
    motion, force = record.displacement[branch.samples], record.force[branch.samples]
    last = len(motion) - 1
    phase = np.arange(last + 1) / last
    if exact:
        way = np.maximum.accumulate(branch.sense * (motion - motion[0]))
        phase = 0.5 * (phase + way / way[-1])
    places = np.interp((np.arange(count) + 0.5) / count, phase, np.arange(last + 1.0))
    if between:
        return np.stack([np.interp(places, np.arange(last + 1), one) for one in (motion, force)])
    # Each sample once, and none of the ends, which are of both branches.
    taken = np.arange(1, last) if count == last - 1 else _spread(places, last)
    return np.stack([motion[taken], force[taken]])


def _spread(places: Array, last: int) -> Indices:
    """Different whole numbers from 1 to ``last`` - 1, each near one of the growing ``places``."""
    count = len(places)
    order = np.arange(count)
    taken = np.maximum.accumulate(np.clip(np.rint(places).astype(int), 1, last - 1) - order)
    return np.minimum(taken, last - count) + order


def _stiffness(measured: MeasuredLoops, amplitude: float, limit: float) -> float:
    """Stick stiffness: where no slope tells it, by the energy of a slider, 4 µN (A - µN/kt)."""
    if np.isfinite(measured.stick_stiffness).all():
        return measured.stick_estimate.value
    stuck = amplitude - float(measured.energy.mean()) / (4.0 * limit)
    return limit / max(stuck, 0.01 * amplitude)


@dataclass(frozen=True)
class LoopFit:
    """The problem of some :class:`LoopData` under a law of parameters that are ``held`` or free.

    ``names`` has the place among the unknowns by parameter; each of the data has an offset and two
    turning points of its own, by its number.
    """

    problem: FitProblem
    data: tuple[LoopData, ...]
    law: LoopLaw
    held: Mapping[str, float]
    names: Mapping[str, int] = field(default_factory=dict)

    def record(self, name: str, values: Array) -> Array:
        """Force ``(n,)`` of the law at the displacements of all data of a record [N]."""
        chosen = [number for number, one in enumerate(self.data) if one.name == name]
        return _forces(self, chosen, values)


def loop_problem(data: Sequence[LoopData], law: str, held: Mapping[str, float]) -> LoopFit:
    """A joint law from loops, as a problem of :func:`fit`.

    The data of a record, which have one name and follow each other, are one series. ``law`` is a
    key of ``LAWS``; ``held`` are parameters that are not free, by name. A normal load
    that is neither held nor free (``nan``) is that of each record. Raises FitError for a record
    without one.

    Examples
    --------
    The joint that a record was made with comes back:

    >>> import numpy as np
    >>> from wear.fitting import fit, loop_problem, mean_loop
    >>> from wear.joints import UniformIwan, march_joints, measure_loops
    >>> law = UniformIwan(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> motion = 0.03 * np.sin(2.0 * np.pi * np.arange(4001) / 800)
    >>> record = march_joints(law, law.rest(1), np.zeros((1, 1)), motion[:, None, None])
    >>> loop = mean_loop("first", measure_loops(motion, record.force.ravel(), 100.0))
    >>> problem = loop_problem([loop], "uniform_iwan", {"normal_load": 100.0})
    >>> stiffness, friction, *_ = fit(problem.problem).estimates
    >>> print(f"{friction.value:.3f}, {stiffness.value:.0f} N/mm")
    0.500, 10000 N/mm
    """
    known = LAWS[law]
    for one in data:
        if np.isnan(held.get("normal_load", 0.0)) and np.isnan(one.normal_load):
            raise FitError(
                f"{one.name}: no normal load; allowed: that of the record, or of the joint, or a "
                "free one, of which only the product with friction counts"
            )
    free = [name for name in (*COMMON, *known.shape) if name not in held]
    stiffest = max(one.stiffness for one in data)
    unknowns = [_unknown(name, known, stiffest) for name in free]
    unknowns += _of_data(data)
    names = {unknown.name: place for place, unknown in enumerate(unknowns)}
    made = LoopFit(
        FitProblem((), (), lambda values: values, ()), tuple(data), known, dict(held), names
    )
    starts = _starts(made)
    slopes = _slopes(made, starts[0])
    problem = FitProblem(
        tuple(unknowns),
        tuple(_series(name, made.data, slopes) for name in dict.fromkeys(one.name for one in data)),
        lambda values: _forces(made, range(len(data)), values),
        starts,
    )
    return LoopFit(problem, made.data, known, made.held, names)


def _of_data(data: Sequence[LoopData]) -> list[Unknown]:
    """The unknowns that each of the data has of its own: offsets first, then turning points."""
    size = max(float(np.abs(one.force).max()) for one in data)
    offsets = [Unknown(_own(data, number, OFFSET), size=size) for number in range(len(data))]
    turns = []
    for number, one in enumerate(data):
        noise = TURN_NOISE * one.noise[0]
        near = WITHIN * one.spacing + noise, BEYOND * one.spacing + noise
        for turn, name, (down, up) in zip(one.turns, TURNS, (near[::-1], near), strict=True):
            turns.append(
                Unknown(
                    _own(data, number, name),
                    turn - down,
                    turn + up,
                    size=one.amplitude,
                    nuisance=True,
                )
            )
    return offsets + turns


def _own(data: Sequence[LoopData], number: int, what: str) -> str:
    """Name of an unknown of one of the data: of a record with several by its number there."""
    name = data[number].name
    places = [place for place, one in enumerate(data) if one.name == name]
    return f"{name}.{what}" + (f"_{places.index(number) + 1}" if len(places) > 1 else "")


def _series(name: str, data: Sequence[LoopData], slopes: Sequence[Array]) -> Series:
    """The forces of a record, which scatter by their own noise and that of the displacement."""
    chosen = [(one, slope) for one, slope in zip(data, slopes, strict=True) if one.name == name]
    forces = np.concatenate([one.force for one, _ in chosen])
    shares = np.concatenate([np.hypot(one.noise[1], slope * one.noise[0]) for one, slope in chosen])
    return Series(name, forces, shares=shares / shares.max() if shares.all() else None)


def _unknown(name: str, law: LoopLaw, stiffness: float) -> Unknown:
    if name in law.shape:
        lower, upper = law.shape[name]
        return Unknown(name, lower, upper, size=1.0)
    if name == "residual_stiffness":
        # Nothing, within a small part of the stiffness, is a residual stiffness too.
        return Unknown(name, 0.0, size=stiffness)
    return Unknown(name, 0.0)


def _forces(made: LoopFit, chosen: Iterable[int], values: Array) -> Array:
    """Force of the law on its settled loops, ``(n,)``: each point from the reversal before it."""
    given = dict(made.held) | {name: float(values[place]) for name, place in made.names.items()}
    data = [made.data[number] for number in chosen]
    own = [[given[_own(made.data, number, what)] for what in (OFFSET, *TURNS)] for number in chosen]
    counts = [len(one.force) for one in data]
    offset, lower, upper = np.repeat(np.array(own), counts, axis=0).T
    sense = np.concatenate([one.sense for one in data])
    place = np.clip(np.concatenate([one.displacement for one in data]), lower, upper)
    there, back = np.where(sense > 0.0, (upper, lower), (lower, upper))
    parameters: dict[str, Any] = {name: given[name] for name in (*COMMON, *made.law.shape)}
    if np.isnan(parameters["normal_load"]):
        parameters["normal_load"] = np.repeat([one.normal_load for one in data], counts)
    tiny = np.finfo(float).tiny
    parameters["stiffness"] = max(parameters["stiffness"], tiny)
    if made.law.law is BoucWen:
        most = STIFFER * parameters["stiffness"]
        parameters["residual_stiffness"] = min(parameters["residual_stiffness"], most)
    law = made.law.law(**parameters)
    way = np.stack([*[there, back] * SETTLING, place])
    history = march_joints(law, law.rest(len(place)), np.zeros((len(place), 1)), way[..., None])
    return np.asarray(history.force[-1, :, 0] + offset)


def _slopes(made: LoopFit, values: Array) -> list[Array]:
    """Slopes ``(n,)`` [N/mm] of the law's loops at the displacements of each of the data."""
    found = []
    for number, one in enumerate(made.data):
        step = SLOPE_STEP * one.amplitude
        ends = [
            _forces(replace(made, data=_moved(made.data, number, way * step)), [number], values)
            for way in (1.0, -1.0)
        ]
        found.append((ends[0] - ends[1]) / (2.0 * step))
    return found


def _moved(data: Sequence[LoopData], number: int, step: float) -> tuple[LoopData, ...]:
    """The data with all displacements of one of them moved."""
    one = data[number]
    moved = replace(one, displacement=one.displacement + step)
    return (*data[:number], moved, *data[number + 1 :])


def _starts(made: LoopFit) -> list[Array]:
    """What the records say of themselves, with some shapes of the law."""
    # The loop that slides most says most.
    first = max(made.data, key=lambda one: one.amplitude)
    load = made.held.get("normal_load", 1.0)
    load = first.normal_load if np.isnan(load) else load
    parallel = 0.0 if made.law.law is BoucWen else first.residual_stiffness
    begin = {
        "stiffness": max(first.stiffness - parallel, 0.1 * first.stiffness),
        "residual_stiffness": max(first.residual_stiffness, 0.0),
        "friction": first.limit / load,
        "normal_load": first.limit / made.held.get("friction", first.limit),
    }
    for number, one in enumerate(made.data):
        own = (float(one.force.mean()), *one.turns.tolist())
        for what, value in zip((OFFSET, *TURNS), own, strict=True):
            begin[_own(made.data, number, what)] = value
    free = [name for name in made.law.tried if name in made.names]
    starts = []
    for shape in product(*(made.law.tried[name] for name in free)):
        values = {**begin, **dict(zip(free, shape, strict=True))}
        starts.append(np.array([values[name] for name in made.names]))
    return starts
