"""Joint laws from measured hysteresis loops: the law's own loop beside the mean one of a record.

The loops of a record are taken to be alike, as :func:`wear.joints.measure_loops` takes them: their
forces and displacements are averaged over the cycles at equal times between reversals. The law goes
through its settled loop of that motion; a constant force of the record is fitted beside it. Bounds
count what scatters about the law: a displacement that is wrong in every cycle alike is not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from sa_solver.types import Array
from wear.fitting.problem import FitError, FitProblem, Series, Unknown
from wear.joints.bouc_wen import BoucWen
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.measured_loops import MeasuredLoops
from wear.joints.parameters import UniaxialLaw

POINTS = 40
"""Of each branch of a loop."""

SETTLING = 2
"""Cycles before the loop that counts: a law that forgets is settled after one."""

STIFFER = 1.0 - 1e-9
"""Largest residual stiffness of a Bouc-Wen joint, in its stiffness."""

MOBILISED = 1.2
"""Friction to begin with where nothing slides, over what the record has mobilised."""

OFFSET = "offset"
"""Mean force of a record, beside the parameters of the law."""

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
    """The mean loop of a record, its ``name``.

    ``displacement`` ``(2 m,)`` [mm] about the middle of the stroke, there and back, ``force``
    ``(2 m,)`` [N], ``amplitude`` [mm] half the stroke, ``normal_load`` [N] NaN if it is not known.
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
    amplitude: float
    normal_load: float
    stiffness: float
    residual_stiffness: float
    limit: float


def mean_loop(name: str, measured: MeasuredLoops) -> LoopData:
    """The mean of all loops of a record, at :data:`POINTS` places of each branch.

    Examples
    --------
    See :class:`LoopData`.

    >>> from wear.fitting import mean_loop
    """
    record, branches = measured.record, []
    for begin, turn, end in measured.reversals.tolist():
        for first, last in ((begin, turn), (turn, end)):
            branches.append(_at_phases(record.displacement, record.force, first, last))
    # Shares of the way (m,) and forces (m,) of each branch, averaged over the cycles.
    out, back = (np.mean(branches[k::2], axis=0) for k in (0, 1))
    if out[0, 0] > out[0, -1]:
        out, back = back, out
    amplitude = 0.5 * float(measured.stroke.mean())
    slides = measured.slides
    stick = measured.stick_estimate.value
    return LoopData(
        name=name,
        displacement=amplitude * np.concatenate([_one_way(out[0]), -_one_way(-back[0])]),
        force=np.concatenate([out[1], back[1]]),
        amplitude=amplitude,
        normal_load=float(measured.normal_load.mean()),
        stiffness=stick,
        residual_stiffness=float(measured.residual_stiffness.mean()) if slides else 0.0,
        limit=float((measured.friction_force if slides else MOBILISED * measured.force).mean()),
    )


def _at_phases(motion: Array, force: Array, first: int, last: int) -> Array:
    """Share of the way, -1 to 1, and force ``(2, m)`` of a branch at equal times of it.

    Displacements are averaged as forces are: both have noise, time has none.
    """
    places = first + (last - first) * (np.arange(POINTS) + 0.5) / POINTS
    samples = np.arange(len(motion))
    middle, half = 0.5 * (motion[first] + motion[last]), 0.5 * abs(motion[last] - motion[first])
    moved = np.interp(places, samples, motion)
    return np.stack([(moved - middle) / half, np.interp(places, samples, force)])


def _one_way(shares: Array) -> Array:
    """Shares of a way that goes nowhere back, nor beyond its ends."""
    return np.clip(np.maximum.accumulate(shares), -1.0, 1.0)


@dataclass(frozen=True)
class LoopFit:
    """The problem of some :class:`LoopData` under a law of parameters that are ``held`` or free.

    ``names`` has the place among the unknowns by parameter; each loop has an offset of its own.
    """

    problem: FitProblem
    data: tuple[LoopData, ...]
    law: LoopLaw
    held: Mapping[str, float]
    names: Mapping[str, int] = field(default_factory=dict)

    def loop(self, data: LoopData, values: Array) -> Array:
        """Force ``(2 m,)`` of the law at the displacements of one of the data [N]."""
        return _loop(data, self.law, {**self.held, **_named(self.names, values)})


def loop_problem(data: Sequence[LoopData], law: str, held: Mapping[str, float]) -> LoopFit:
    """A joint law from mean loops, as a problem of :func:`fit`.

    ``law`` is a key of ``LAWS``; ``held`` are parameters that are not free, by name. A normal load
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
    size = max(float(np.abs(one.force).max()) for one in data)
    unknowns += [Unknown(f"{one.name}.{OFFSET}", size=size) for one in data]
    names = {unknown.name: place for place, unknown in enumerate(unknowns)}
    made = LoopFit(
        FitProblem((), (), lambda values: values, ()), tuple(data), known, dict(held), names
    )
    problem = FitProblem(
        tuple(unknowns),
        tuple(Series(one.name, one.force) for one in data),
        lambda values: np.concatenate([made.loop(one, values) for one in data]),
        _starts(made),
    )
    return LoopFit(problem, made.data, known, made.held, names)


def _unknown(name: str, law: LoopLaw, stiffness: float) -> Unknown:
    if name in law.shape:
        lower, upper = law.shape[name]
        return Unknown(name, lower, upper, size=1.0)
    if name == "residual_stiffness":
        # Nothing, within a small part of the stiffness, is a residual stiffness too.
        return Unknown(name, 0.0, size=stiffness)
    return Unknown(name, 0.0)


def _named(names: Mapping[str, int], values: Array) -> dict[str, float]:
    return {name: float(values[place]) for name, place in names.items()}


def _loop(data: LoopData, law: LoopLaw, values: Mapping[str, float]) -> Array:
    """Force of the settled loop at the displacements of the data."""
    given = {name: values[name] for name in (*COMMON, *law.shape)}
    if np.isnan(given["normal_load"]):
        given["normal_load"] = data.normal_load
    tiny = np.finfo(float).tiny
    given["stiffness"] = max(given["stiffness"], tiny)
    if law.law is BoucWen:
        given["residual_stiffness"] = min(given["residual_stiffness"], STIFFER * given["stiffness"])
    made = law.law(**given)
    half = len(data.displacement) // 2
    ends = data.amplitude * np.array([1.0, -1.0] * SETTLING)
    out, back = data.displacement[:half], data.displacement[half:]
    way = np.concatenate([ends, out, ends[:1], back])
    history = march_joints(made, made.rest(1), np.zeros((1, 1)), way[:, None, None])
    force = np.delete(history.force[len(ends) :, 0, 0], half)
    return np.asarray(force + values[f"{data.name}.{OFFSET}"])


def _starts(made: LoopFit) -> list[Array]:
    """What the records say of themselves, with some shapes of the law."""
    first = made.data[0]
    load = made.held.get("normal_load", 1.0)
    load = first.normal_load if np.isnan(load) else load
    parallel = 0.0 if made.law.law is BoucWen else first.residual_stiffness
    begin = {
        "stiffness": max(first.stiffness - parallel, 0.1 * first.stiffness),
        "residual_stiffness": max(first.residual_stiffness, 0.0),
        "friction": first.limit / load,
        "normal_load": first.limit / made.held.get("friction", first.limit),
    }
    for one in made.data:
        begin[f"{one.name}.{OFFSET}"] = float(one.force.mean())
    free = [name for name in made.law.tried if name in made.names]
    starts = []
    for shape in product(*(made.law.tried[name] for name in free)):
        values = {**begin, **dict(zip(free, shape, strict=True))}
        starts.append(np.array([values[name] for name in made.names]))
    return starts
