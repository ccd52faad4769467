"""Phase resonance of a structure with joints: the backbone of its forced responses.

At phase resonance the first harmonic of a displacement lags that of the force by a quarter of a
period. With x that displacement as a complex amplitude relative to the force (its real part in
phase with it), this is one more equation for one more unknown, the frequency:

    cot(phase of x) = Re x / Im x = 0.

The cotangent is taken because it is linear in the frequency near the resonance of a mode, however
little damped, where Re x itself turns back within the half-power width. By default x is that of the
force's own points, wᴴ x with the complex amplitudes w of the force: all of its power is then spent
(Peter and Leine, Mech. Syst. Signal Process. 96, 2017, 139, doi:10.1016/j.ymssp.2017.04.011).

The unknowns are those of harmonic balance and ln(f / f0), in units of the size of the joints'
vibration at the start, so that the two may be measured together. The structure's matrices are
symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise

import numpy as np

from fe_models.dynamics.curves.bordered import Bordered, LinearMap
from fe_models.dynamics.curves.continuation import CurvePoint, Refinement, first_point, follow
from fe_models.dynamics.curves.control import ContinuationControl
from fe_models.dynamics.curves.forced_response import Accuracy, Motions, ResponseBranch, finer_for
from fe_models.dynamics.curves.newton import NewtonControl, solve
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray, HarmonicBalanceError, Resolution
from fe_models.dynamics.periodic.receptance import SteadyMotion
from fe_models.dynamics.periodic.resolution_error import resolution_error
from sa_solver import checks
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Frequencies are looked for up to this factor from the start's: Newton's method that goes farther
# is lost, and must not overflow.
FARTHEST = 1e3
# Of the phases of a force's points: below it they push together, in one sense or the other.
SAME_PHASE = 1e-9


@dataclass(frozen=True)
class PhaseBalance:
    """The equations of phase resonance at one motion, and their derivatives when asked for.

    ``balance`` is the motion's own, with the frequency as parameter, and ``output`` the complex x
    of the module, that ``frequency`` [Hz] and the motion have.
    """

    equations: PhaseResonance
    balance: Balance
    frequency: float
    output: complex

    @property
    def cotangent(self) -> float:
        """Of the phase; infinite where no power is spent: no frequency has the phase then."""
        return self.output.real / self.output.imag if self.output.imag else np.inf

    @cached_property
    def residual(self) -> Array:
        return np.append(self.balance.residual, self.equations.scale * self.cotangent)

    @property
    def size(self) -> float:
        """That of the balance."""
        return self.balance.size

    @cached_property
    def relative(self) -> float:
        """What is left of the balance, relative to its terms, and of the phase, together."""
        left = float(np.hypot(self.balance.relative, self.cotangent))
        return left if np.isfinite(left) else np.inf

    @cached_property
    def jacobian(self) -> Array | LinearMap:
        """∂r/∂u ``(n + 1, n + 1)``, a matrix where that of the balance is one."""
        scale, inner = self.equations.scale, self.balance.jacobian
        # Hz per unknown.
        stretch = self.frequency / scale
        by_frequency = complex(
            self._steady.stiffness_slope(self._first_harmonic)[0] @ self._per_force
        )
        corner = -2.0 * np.pi * stretch * self._of_phase(by_frequency)
        row = np.append(self._of_phase(self._by_motion), corner)
        bordered = Bordered(inner, self.balance.slope * stretch, row)
        return bordered.assembled() if isinstance(inner, np.ndarray) else bordered

    @cached_property
    def slope(self) -> Array:
        """∂r/∂a ``(n + 1,)`` by the force."""
        by_force = replace(self.balance, over="force").slope
        wave = self.equations.problem.wave[self.equations.first]
        return np.append(by_force, self._of_phase(complex(wave @ self._per_force)))

    def _of_phase(self, change: ComplexArray | complex) -> Array:
        """By how much a change of x changes the last of the equations."""
        cotangent = np.real(change) - self.cotangent * np.imag(change)
        return np.asarray(self.equations.scale * cotangent / self.output.imag)

    @property
    def _first_harmonic(self) -> ComplexArray:
        """The modes at harmonic 1 ``(1, n)``."""
        return self.balance.motion[self.equations.first][None]

    @cached_property
    def _steady(self) -> SteadyMotion:
        """The structure at harmonic 1."""
        first = self.equations.problem.receptance.of(1)
        return first.at(np.array([2.0 * np.pi * self.frequency]))

    @cached_property
    def _per_force(self) -> ComplexArray:
        """x by forces on the modes ``(n,)``."""
        return np.asarray(self._steady.per_force(self.equations.of_modes[None])[0])

    @property
    def _by_motion(self) -> ComplexArray:
        """x by the unknowns ``(n,)``, through the forces of the joints."""
        problem, first = self.equations.problem, self.equations.first
        by_joint = problem.receptance.of(1).at_joints.conj() @ self._per_force
        cosine, sine = (places[first] for places in problem.resolution.places)
        slopes = self.balance.cycle.jacobian
        by_motion = slopes[:, cosine] - 1j * slopes[:, sine]
        by_joint = by_joint.reshape(-1, problem.joints.directions)
        return np.asarray(-np.einsum("jd,jdme->jme", by_joint, by_motion).ravel())


@dataclass(frozen=True)
class Backbone(Motions):
    """Motions at phase resonance, from the least force on; the curve may turn back in force.

    ``message`` is empty if the curve reaches both ends of the forces. ``problem`` is at the
    resolution of the last motion found upward.
    """

    message: str
    problem: HarmonicBalance


def along_phase_resonance(
    problem: HarmonicBalance,
    start: HarmonicSolution | ResponseBranch,
    forces: tuple[float, float],
    output: Array | None = None,
    *,
    control: ContinuationControl | None = None,
    accuracy: Accuracy | None = None,
    steps: Steps = COMPUTED,
) -> Backbone:
    """Phase resonances for ``forces`` from a least to a largest, folds included.

    They begin where a response ``start`` passes through the phase with the largest displacement, or
    near one motion, best its peak. Newton's method finds the phase resonance under its force, from
    which the curve is followed both ways. ``output`` ``(n,)`` is the displacement whose phase
    counts, as a combination of those of the structure; the force's own if it is not given. Without
    ``accuracy`` the resolution is that of the problem. Each of the ``steps`` finds a motion.

    Raises :class:`HarmonicBalanceError` for a load without a first harmonic, an ``output`` that
    is nothing or lags a force of several phases, and forces that are not above zero or do not
    include the start's.

    Examples
    --------
    At phase resonance the force does the work of damping and joint, F = c ω X + E / π X:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> problem = HarmonicBalance(rig, PeriodicMarch(law), load, Resolution((1,), 512))
    >>> backbone = along_phase_resonance(problem, problem.solve(170.0, 10.0), (8.0, 12.0))
    >>> X = backbone.first_amplitudes(0)
    >>> taken = 0.04 * 2.0 * np.pi * backbone.frequencies * X + law.loop_energy(X) / (np.pi * X)
    >>> print(np.abs(taken / backbone.forces - 1.0).max() < 1e-3)
    True
    """
    low, high = checks.array("forces", forces, (2,), error=HarmonicBalanceError).tolist()
    weights = _weights(problem, output)
    nearest = nearest_to_phase(start, weights) if isinstance(start, ResponseBranch) else start
    if nearest is None:
        return Backbone(
            (), "the response does not pass through the phase: give one with its peak", problem
        )
    if not 0.0 < low <= nearest.force <= high:
        raise HarmonicBalanceError(
            f"forces from {low:g} to {high:g} with a start at {nearest.force:g}: give two above 0 "
            "that include the start's"
        )
    if nearest.message:
        return Backbone((), f"the start is no solution: {nearest.message}", problem)
    control = control or ContinuationControl()
    equations = PhaseResonance.near(problem, nearest, output)
    first = _first(_Recorder(equations, accuracy), nearest, control, steps)
    if isinstance(first, str):
        return Backbone((), first, problem)
    below = _half(first, False, forces, accuracy, control, steps)
    above = _half(first, True, forces, accuracy, control, steps)
    return Backbone(
        (*reversed(below.solutions), first.solution, *above.solutions),
        "; ".join(filter(None, (below.message, above.message))),
        above.problem,
    )


def nearest_to_phase(branch: ResponseBranch, weights: ComplexArray) -> HarmonicSolution | None:
    """The motion of a branch before or after which it passes through the phase, None if it never.

    The larger displacement wᴴ x with the ``weights`` w ``(n,)`` decides if it passes more often:
    between two resonances it also does.
    """
    outputs = [
        complex(np.vdot(weights, solution.motion[solution.resolution.harmonics.index(1)]))
        for solution in branch.solutions
    ]
    passing = [
        (abs(before) + abs(after), place)
        for place, (before, after) in enumerate(pairwise(outputs))
        if before.real * after.real <= 0.0 < before.imag * after.imag
    ]
    if not passing:
        return None
    _, place = max(passing)
    cotangents = [abs(x.real / x.imag) for x in outputs[place : place + 2]]
    return branch.solutions[place + int(np.argmin(cotangents))]


@dataclass(frozen=True)
class PhaseResonance:
    """Equations for the unknowns of a balance and ``scale`` · ln(f / ``frequency``).

    The force is their parameter. ``weights`` ``(n,)`` w make wᴴ x of the structure's amplitudes x;
    ``scale`` [mm] is the size of the joints' vibration at the start.
    """

    problem: HarmonicBalance
    weights: ComplexArray
    frequency: float
    scale: float

    @classmethod
    def near(
        cls, problem: HarmonicBalance, start: HarmonicSolution, output: Array | None = None
    ) -> PhaseResonance:
        """The equations near a motion; see :func:`along_phase_resonance`."""
        vibration = problem.guess(start) - problem.guess(None)
        # Where no joint moves there is nothing to be measured with the frequency.
        scale = float(np.linalg.norm(vibration)) or 1.0
        return cls(problem, _weights(problem, output), start.frequency, scale)

    @cached_property
    def first(self) -> int:
        """Row of harmonic 1."""
        return self.problem.resolution.harmonics.index(1)

    @cached_property
    def of_modes(self) -> ComplexArray:
        """x by the amplitudes of the modes at harmonic 1 ``(n,)``."""
        return np.asarray(self.weights.conj() @ self.problem.receptance.of(1).at_points)

    def frequency_of(self, unknowns: Array) -> float:
        """[Hz]"""
        share = np.clip(unknowns[-1] / self.scale, -np.log(FARTHEST), np.log(FARTHEST))
        return float(self.frequency * np.exp(share))

    def place_of(self, frequency: float) -> float:
        """The unknown that stands for a frequency [Hz]."""
        return float(self.scale * np.log(frequency / self.frequency))

    def __call__(self, unknowns: Array, parameter: float) -> PhaseBalance:
        frequency = self.frequency_of(unknowns)
        balance = self.problem.evaluate(unknowns[:-1], frequency, parameter, "frequency")
        output = complex(self.of_modes @ balance.motion[self.first])
        return PhaseBalance(self, balance, frequency, output)


class _Recorder:
    """Describes every new point of the curve, and asks for finer equations where needed."""

    def __init__(self, equations: PhaseResonance, accuracy: Accuracy | None) -> None:
        self.equations, self._accuracy = equations, accuracy
        self.solutions: list[HarmonicSolution] = []

    def describe(self, point: CurvePoint, at: PhaseBalance) -> HarmonicSolution:
        """The motion at a point, with its error if it is to be accurate."""
        problem = self.equations.problem
        solution = problem.describe(point.unknowns[:-1], at.balance, at.frequency, point.parameter)
        if self._accuracy is not None:
            solution = replace(solution, error=resolution_error(problem, solution))
        return replace(solution, iterations=point.iterations, residual=at.relative)

    def take(self, description: HarmonicSolution) -> Refinement[PhaseBalance] | None:
        """Keep a motion, or ask for finer equations where it is not accurate."""
        problem = self.equations.problem
        finer = finer_for(problem, description, self._accuracy)
        if finer is not None:
            return self._refine(finer)
        self.solutions.append(replace(description, resolution=problem.resolution))
        return None

    def _refine(self, finer: Resolution) -> Refinement[PhaseBalance]:
        problem = self.equations.problem
        coarse, directions = problem.resolution, problem.joints.directions
        self.equations = replace(self.equations, problem=problem.refined(finer))

        def lift(unknowns: Array) -> Array:
            joints = unknowns[:-1].reshape(-1, coarse.size, directions)
            return np.append(finer.adopt(joints, coarse), unknowns[-1])

        return Refinement(self.equations, lift)


@dataclass(frozen=True)
class _First:
    """The phase resonance from which the curve is followed ``down`` and ``up`` in force."""

    equations: PhaseResonance
    down: CurvePoint
    up: CurvePoint
    solution: HarmonicSolution


def _first(
    record: _Recorder, start: HarmonicSolution, control: ContinuationControl, steps: Steps
) -> _First | str:
    """The phase resonance under the start's force; or why there is none."""

    def found(unknowns: Array) -> tuple[CurvePoint, CurvePoint, HarmonicSolution] | str:
        resonance = solve(record.equations, unknowns, start.force, NewtonControl(control.tolerance))
        if not resonance.converged:
            return (
                f"no phase resonance is found under {start.force:g} N from {start.frequency:.6g} "
                f"Hz: Newton's method leaves {resonance.at.relative:.2g} after "
                f"{resonance.iterations} iterations; start from a motion nearer to the peak of the "
                "response"
            )
        down, up = (
            first_point(resonance, start.force, upward, control.first) for upward in (False, True)
        )
        return down, up, record.describe(up, resonance.at)

    unknowns = np.append(record.equations.problem.guess(start), 0.0)
    while True:
        first = steps("first phase resonance", partial(found, unknowns))
        if isinstance(first, str):
            return first
        down, up, motion = first
        finer = record.take(motion)
        if finer is None:
            return _First(record.equations, down, up, record.solutions[-1])
        unknowns = finer.lift(up.unknowns)


@dataclass(frozen=True)
class _Half:
    """Motions on one side of the first, in their order, and why there are not more."""

    solutions: tuple[HarmonicSolution, ...]
    message: str
    problem: HarmonicBalance


def _half(
    first: _First,
    upward: bool,
    forces: tuple[float, float],
    accuracy: Accuracy | None,
    control: ContinuationControl,
    steps: Steps,
) -> _Half:
    force, problem = first.solution.force, first.equations.problem
    if force == forces[upward]:
        return _Half((), "", problem)
    record = _Recorder(first.equations, accuracy)
    point = first.up if upward else first.down
    # Steps are shares of the vibration, as those of forced responses.
    rest = np.append(problem.guess(None), 0.0)
    end = forces[upward]
    curve = follow(first.equations, point, forces, control, record, rest, end=end, steps=steps)
    message = curve.message
    if message:
        message = f"{'upward' if upward else 'downward'} in force, {message}"
    return _Half(tuple(record.solutions), message, record.equations.problem)


def _weights(problem: HarmonicBalance, output: Array | None) -> ComplexArray:
    """Weights ``(n,)`` whose product wᴴ x is the output displacement, relative to the force."""
    if problem.load.inertial:
        raise HarmonicBalanceError(
            "a load that changes with the frequency: give a force or an acceleration that does not"
        )
    wave = problem.load.waves.get(1)
    if wave is None or not np.any(wave):
        raise HarmonicBalanceError("the load has no harmonic 1: no phase is relative to it")
    if output is None:
        return np.asarray(wave, dtype=complex)
    output = checks.complex_array("outputs", output, None, error=HarmonicBalanceError)
    if output.shape != wave.shape or not np.any(output):
        raise HarmonicBalanceError(
            f"the output displacement has shape {output.shape}: give a combination, not zero, "
            f"of the {len(wave)} of the structure"
        )
    largest = wave[np.argmax(np.abs(wave))]
    turn = largest / abs(largest)
    if np.abs((wave * np.conj(turn)).imag).max() > SAME_PHASE * abs(largest):
        raise HarmonicBalanceError(
            "the force has several phases, so that no displacement lags it by a quarter: leave out "
            "the output"
        )
    return np.asarray(turn * output)
