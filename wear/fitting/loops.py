"""Joint laws from measured hysteresis loops.

The loop of the law is compared with samples of measured loops (:mod:`wear.fitting.loop_samples`).
The law follows its steady loop from one turning point to the other. The turning points are fitted
too, because samples do not lie exactly on them. A constant force of each step of similar loops is
fitted as well; it is what remains of outer loops in Masing's laws. Samples are weighted by the
noise of their force and, where the loop is steep, by that of their displacement. The bounds include
scatter about the law, but not an error of the displacement that is the same in every cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from sa_solver import checks
from sa_solver.types import Array, Indices
from wear.fitting.loop_samples import LoopData
from wear.fitting.problem import FitError, FitProblem, FreeParameter, Series
from wear.joints.bouc_wen_curve import TabulatedBoucWen
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.parameters import UniaxialLaw

SLOPE_STEP = 1e-3
"""Step for slopes of the loop, relative to the amplitude. The slopes convert the noise of the
displacement to that of the force."""

SETTLING = 2
"""Number of cycles before the loop that is compared: a law reaches its steady loop after one."""

BEYOND, WITHIN = 3.0, 0.5
"""Largest distance of a turning point beyond the outermost sample, and inside it, relative to the
distance of this sample from its neighbours."""

TURN_NOISE = 5.0
"""Standard deviations of the noise that are added to these distances."""

ROUNDED = 1e-6
"""Noise of displacements and forces without visible noise, relative to their largest values."""

LEAST_SHARE = 0.01
"""Least ratio of the scatter of a sample to that of the noisiest one."""

STIFFER = 1.0 - 1e-9
"""Largest residual stiffness of a Bouc-Wen joint, relative to its stiffness."""

OFFSET = "offset"
"""Name of the mean force of loops, which is fitted in addition to the parameters of the law."""

COMMON = ("stiffness", "friction", "normal_load", "residual_stiffness")
"""Parameters of all laws, 0 or above."""


@dataclass(frozen=True)
class LoopLaw:
    """Joint law for the fit.

    ``law`` is its class, ``shape`` the bounds of its parameters other than the common ones, by
    name, and ``tried`` the initial values of these parameters.
    """

    law: Callable[..., UniaxialLaw]
    shape: Mapping[str, tuple[float, float]]
    tried: Mapping[str, tuple[float, ...]]


LAWS: Mapping[str, LoopLaw] = {
    "jenkins": LoopLaw(Jenkins, {}, {}),
    "uniform_iwan": LoopLaw(UniformIwan, {}, {}),
    "bouc_wen": LoopLaw(
        TabulatedBoucWen,
        {"sigma": (0.5, 1.0), "exponent": (1.0, 100.0)},
        {"sigma": (0.5,), "exponent": (1.5, 4.0)},
    ),
    "four_parameter_iwan": LoopLaw(
        FourParameterIwan,
        {"chi": (-0.99, 10.0), "beta": (0.0, 1e3)},
        {"chi": (-0.5, 0.5), "beta": (0.3, 3.0)},
    ),
}
"""Laws by the names that a case uses."""


@dataclass(frozen=True)
class LoopFit:
    """Problem of a fit of :class:`LoopData` to a law.

    Attributes
    ----------
    problem
        Problem of the fit.
    data
        Measured loops.
    law
        Law that is fitted.
    held
        Parameters of the law that are not free, by name.
    names
        Index among the unknowns of each free parameter of the law.
    offsets
        Index of the mean force of each of the data ``(k,)``.
    turns
        For each of the data the indices of the turning points of its loops ``(l, 2)``.
    """

    problem: FitProblem
    data: tuple[LoopData, ...]
    law: LoopLaw
    held: Mapping[str, float]
    names: Mapping[str, int]
    offsets: Indices
    turns: tuple[Indices, ...]

    def record(self, name: str, values: Array) -> Array:
        """Return the force ``(n,)`` [N] of the law at the displacements of all data of a record."""
        chosen = [number for number, one in enumerate(self.data) if one.name == name]
        return _forces(self, chosen, values)


def loop_problem(data: Sequence[LoopData], law: str, held: Mapping[str, float]) -> LoopFit:
    """Return a problem of :func:`fit` for a joint law from loops.

    Parameters
    ----------
    data
        Measured loops. Those of the same record have the same name and follow each other; they form
        one series.
    law
        Law, a key of ``LAWS``.
    held
        Parameters that are not free, by name. For a normal load of NaN that of each record is used.

    Raises
    ------
    FitError
        For a record without a normal load if this is required.

    Examples
    --------
    The joint that was used for a record:

    >>> import numpy as np
    >>> from wear.fitting import fit, loop_data, loop_problem
    >>> from wear.joints import UniformIwan, march_joints, measure_loops
    >>> law = UniformIwan(stiffness=1e4, friction=0.5, normal_load=100.0)
    >>> motion = 0.03 * np.sin(2.0 * np.pi * np.arange(4001) / 800)
    >>> record = march_joints(law, law.rest(1), np.zeros((1, 1)), motion[:, None, None])
    >>> loop = loop_data("first", measure_loops(motion, record.force.ravel(), 100.0))
    >>> problem = loop_problem([loop], "uniform_iwan", {"normal_load": 100.0})
    >>> stiffness, friction, *_ = fit(problem.problem).estimates
    >>> print(f"{friction.value:.3f}, {stiffness.value:.0f} N/mm")
    0.500, 10000 N/mm
    """
    checks.choice("law", law, list(LAWS), FitError)
    known = LAWS[law]
    for name, value in held.items():
        checks.choice("held", name, (*COMMON, *known.shape), FitError)
        checks.array(f"values of {name}", value, (), error=FitError, finite=False)
    if not data:
        raise FitError("no loops; allowed: those of one record or more")
    for one in data:
        if np.isnan(held.get("normal_load", 0.0)) and np.isnan(one.normal_load):
            raise FitError(
                f"{one.name}: no normal load; allowed: that of the record, or of the joint, or a "
                "free one, of which only the product with friction counts"
            )
    free = [name for name in (*COMMON, *known.shape) if name not in held]
    stiffest = max(one.stiffness for one in data)
    unknowns = [_unknown(name, known, stiffest) for name in free]
    names = {name: place for place, name in enumerate(free)}
    unknowns += _offsets(data)
    offsets = np.arange(len(free), len(unknowns))
    turns = []
    for number, one in enumerate(data):
        begin = len(unknowns)
        unknowns += _turns(one, number)
        turns.append(np.arange(begin, len(unknowns)).reshape(-1, 2))
    nothing = FitProblem(tuple(unknowns), (), lambda values: values, ())
    made = LoopFit(nothing, tuple(data), known, dict(held), names, offsets, tuple(turns))
    starts = _starts(made)
    slopes = _slopes(made, starts[0])
    problem = FitProblem(
        tuple(unknowns),
        tuple(_series(name, made.data, slopes) for name in dict.fromkeys(one.name for one in data)),
        lambda values: _forces(made, range(len(data)), values),
        starts,
    )
    return replace(made, problem=problem)


def _offsets(data: Sequence[LoopData]) -> list[FreeParameter]:
    """Return the mean forces of the data, as nuisances if a record has several steps."""
    size = max(float(np.abs(one.force).max()) for one in data)
    names = [one.name for one in data]
    several = len(set(names)) < len(names)
    return [
        FreeParameter(
            f"{name}.{OFFSET}" + (f"_{number}" if several else ""), size=size, nuisance=several
        )
        for number, name in enumerate(names, 1)
    ]


def _turns(data: LoopData, number: int) -> list[FreeParameter]:
    """Return the turning points of all loops of the data with a ``number``.

    The lower and the upper point of each loop alternate.
    """
    unknowns = []
    noise = TURN_NOISE * data.noise[0]
    for loop, (pair, spacing) in enumerate(zip(data.turns, data.spacing, strict=True)):
        within, beyond = WITHIN * spacing + noise, BEYOND * spacing + noise
        for at, sense in zip(pair, (-1.0, 1.0), strict=True):
            low, high = sorted((at - sense * within, at + sense * beyond))
            name = f"{data.name}.turn_{number}_{loop}_{'lower' if sense < 0.0 else 'upper'}"
            unknowns.append(FreeParameter(name, low, high, data.amplitude, nuisance=True))
    return unknowns


def _series(name: str, data: Sequence[LoopData], slopes: Sequence[Array]) -> Series:
    """Return the forces of a record, which scatter by their own noise and that of displacements.

    Where no noise is visible, both are assumed to be rounded to :data:`ROUNDED` of their size.
    """
    chosen = [(one, slope) for one, slope in zip(data, slopes, strict=True) if one.name == name]
    forces = np.concatenate([one.force for one, _ in chosen])
    steepness = np.concatenate([slope for _, slope in chosen])
    motion = max(chosen[0][0].noise[0], ROUNDED * max(one.amplitude for one, _ in chosen))
    force = max(chosen[0][0].noise[1], ROUNDED * float(np.abs(forces).max()))
    shares = np.hypot(force, steepness * motion)
    return Series(name, forces, shares=np.maximum(shares / shares.max(), LEAST_SHARE))


def _unknown(name: str, law: LoopLaw, stiffness: float) -> FreeParameter:
    if name in law.shape:
        lower, upper = law.shape[name]
        return FreeParameter(name, lower, upper, size=1.0)
    if name == "residual_stiffness":
        # A residual stiffness of 0, to within a small part of the stiffness, is also determined.
        return FreeParameter(name, 0.0, size=stiffness)
    return FreeParameter(name, 0.0)


def _forces(made: LoopFit, chosen: Iterable[int], values: Array) -> Array:
    """Return the force ``(n,)`` of the law on its steady loops, each from the last reversal on.

    A displacement that lies before this reversal because of noise is on the branch extended
    backwards. If it were cut off at the reversal, the noise would have only one sign.
    """
    given = dict(made.held) | {name: float(values[place]) for name, place in made.names.items()}
    chosen = list(chosen)
    data = [made.data[number] for number in chosen]
    counts = [len(one.force) for one in data]
    offset = np.repeat(values[made.offsets[chosen]], counts)
    turns = [made.turns[number][one.loop] for number, one in zip(chosen, data, strict=True)]
    lower, upper = values[np.concatenate(turns)].T
    sense = np.concatenate([one.sense for one in data])
    place = np.concatenate([one.displacement for one in data])
    there, back = np.where(sense > 0.0, (upper, lower), (lower, upper))
    before = sense * (place - back) < 0.0
    loads = np.repeat([one.normal_load for one in data], counts)
    # Branches alternate: the steady loop of each is found once, and all samples start from it.
    first = np.flatnonzero(np.append(True, np.diff(sense) != 0.0))
    branch = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(sense))))
    path = np.stack([there, back] * SETTLING)[:, first, None]
    law = _law(made, given, loads[first])
    settled = march_joints(law, law.rest(len(first)), np.zeros((len(first), 1)), path)
    moved = np.where(before, back - place, place - back)[:, None]
    response = _law(made, given, loads).respond(settled.state[branch], moved)
    start, force = settled.force[-1, branch, 0], response.force[:, 0]
    return np.asarray(np.where(before, 2.0 * start - force, force) + offset)


def _law(made: LoopFit, given: Mapping[str, float], loads: Array) -> UniaxialLaw:
    """Return the law for as many joints as ``loads``, which are used if no load is given."""
    parameters: dict[str, Any] = {name: given[name] for name in (*COMMON, *made.law.shape)}
    if np.isnan(parameters["normal_load"]):
        parameters["normal_load"] = loads
    parameters["stiffness"] = max(parameters["stiffness"], np.finfo(float).tiny)
    if made.law.law is TabulatedBoucWen:
        most = STIFFER * parameters["stiffness"]
        parameters["residual_stiffness"] = min(parameters["residual_stiffness"], most)
    return made.law.law(**parameters)


def _slopes(made: LoopFit, values: Array) -> list[Array]:
    """Return the slopes ``(n,)`` [N/mm] of the law at the displacements of each of the data."""
    found = []
    for number, one in enumerate(made.data):
        step = SLOPE_STEP * one.amplitude
        ends = [
            _forces(replace(made, data=_moved(made.data, number, sign * step)), [number], values)
            for sign in (1.0, -1.0)
        ]
        found.append((ends[0] - ends[1]) / (2.0 * step))
    return found


def _moved(data: Sequence[LoopData], number: int, step: float) -> tuple[LoopData, ...]:
    """Return the data with all displacements of one of them moved by ``step``."""
    one = data[number]
    moved = replace(one, displacement=one.displacement + step)
    return (*data[:number], moved, *data[number + 1 :])


def _starts(made: LoopFit) -> list[Array]:
    """Return initial values from the records, with several shapes of the law."""
    # The loop with the largest amplitude slides most and is the most informative.
    first = max(made.data, key=lambda one: one.amplitude)
    load = made.held.get("normal_load", 1.0)
    load = first.normal_load if np.isnan(load) else load
    parallel = 0.0 if made.law.law is TabulatedBoucWen else first.residual_stiffness
    begin = {
        "stiffness": max(first.stiffness - parallel, 0.1 * first.stiffness),
        "residual_stiffness": max(first.residual_stiffness, 0.0),
        "friction": first.limit / load,
        "normal_load": first.limit / made.held.get("friction", first.limit),
    }
    free = [name for name in made.law.tried if name in made.names]
    starts = []
    for shape in product(*(made.law.tried[name] for name in free)):
        values = {**begin, **dict(zip(free, shape, strict=True))}
        start = np.empty(len(made.problem.unknowns))
        start[list(made.names.values())] = [values[name] for name in made.names]
        start[made.offsets] = [one.force.mean() for one in made.data]
        for places, one in zip(made.turns, made.data, strict=True):
            start[places] = one.turns
        starts.append(start)
    return starts
