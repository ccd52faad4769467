"""Modes of a structure with joints: frequency and damping against amplitude.

A free vibration of a structure whose joints dissipate dies away. A periodic motion takes its place
when as much energy is fed in as is lost, by a damping -2Dω M proportional to the mass (extended
periodic motion concept: Krack 2015, Comput. Struct. 154, 59, doi:10.1016/j.compstruc.2015.03.008):

    M x'' + (C - 2Dω M) x' + K x + Bᵀ F(B x) = s.

Of each amplitude a, the norm of the first harmonic by the mass, there is one such motion with its
frequency ω and its damping ratio D: of a linear mode its own. Because the feed acts on all
harmonics and all places alike, D is the energy lost in a period over 2ω ∫ x'ᵀ M x' dt, whatever the
mode's form. A response at phase resonance is near it where its force feeds one mode that no other
meets, lightly damped.

The unknowns are those of harmonic balance, ln ω and D. Two equations more say the amplitude, and
that the first harmonic is in phase with the linear mode, q̂ᴴ x = real in the coordinates of the
modes without joints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from fe_models.dynamics.curves.bordered import solve_alone
from fe_models.dynamics.curves.continuation import CurvePoint, first_point, follow
from fe_models.dynamics.curves.control import ContinuationControl
from fe_models.dynamics.curves.newton import NewtonControl, solve
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray, HarmonicBalanceError
from fe_models.dynamics.periodic.resolution_error import richer_problem
from sa_solver import checks
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Share of its frequency by which a linear mode is left to begin with: with joints of no stiffness
# it is that of the structure alone, whose flexibility is not finite there.
BESIDE = 1e-4
# Frequencies are looked for up to this factor from the linear mode's, and damping ratios up to it.
FARTHEST, MOST_DAMPED = 1e3, 10.0


@dataclass(frozen=True)
class ModeBalance:
    """The equations of a mode at one motion, and their derivatives when asked for.

    ``balance`` is that of the motion without a force, fed as the ``damping_ratio`` D says, at a
    ``frequency`` [Hz]; ``amplitude`` is the one that is asked for.
    """

    equations: NonlinearMode
    balance: Balance
    frequency: float
    damping_ratio: float
    amplitude: float

    @cached_property
    def first(self) -> ComplexArray:
        """Harmonic 1 of the modes without joints ``(n,)``."""
        return self.balance.motion[self.equations.first]

    @cached_property
    def _size(self) -> float:
        return float(np.linalg.norm(self.first))

    @cached_property
    def _left(self) -> Array:
        """What is left of the amplitude, as a share of it, and the sine of the phase."""
        if not 0.0 < self._size < np.inf:
            return np.array([np.inf, np.inf])
        phase = np.vdot(self.equations.reference, self.first).imag / self._size
        return np.array([np.log(self._size / self.amplitude), phase])

    @cached_property
    def residual(self) -> Array:
        return np.append(self.balance.residual, self.equations.scale * self._left)

    @property
    def size(self) -> float:
        """That of the balance."""
        return self.balance.size

    @cached_property
    def relative(self) -> float:
        """What is left of the balance, relative to its terms, of amplitude and phase, together."""
        left = float(np.hypot(self.balance.relative, np.linalg.norm(self._left)))
        return left if np.isfinite(left) else np.inf

    @cached_property
    def jacobian(self) -> Array:
        """∂r/∂u ``(n + 2, n + 2)``."""
        inner = self.balance.jacobian
        inner = inner if isinstance(inner, np.ndarray) else inner.assembled()
        count, scale = len(inner), self.equations.scale
        matrix = np.empty((count + 2, count + 2), order="F")
        matrix[:count, :count] = inner
        transfer, steady = self.equations.problem.transfer, self.balance.steady
        to_first = self._by_motion
        forces = self._by_frequency, self._by_damping
        for column, needed in enumerate(forces, start=count):
            moved = steady.vibrate(needed)
            matrix[:count, column] = transfer.at_joints(moved) / scale
            matrix[count:, column] = -(self._rows @ moved[self.equations.first]).real
        # Rows are scale times the equations, and of the columns before unknowns are as they are.
        matrix[count:, :count] = scale * to_first
        return matrix

    @cached_property
    def slope(self) -> Array:
        """∂r/∂a ``(n + 2,)`` by the amplitude."""
        slope = np.zeros(len(self.residual))
        slope[-2] = -self.equations.scale / self.amplitude
        return slope

    @cached_property
    def _rows(self) -> ComplexArray:
        """What both equations make of a change of harmonic 1 ``(2, n)``: the real part of these."""
        along = self.first.conj() / self._size**2
        # Re(-i z) is the imaginary part of z.
        across = -1j * self.equations.reference.conj() / self._size
        return np.stack([along, across - self._left[1] * along])

    @property
    def _by_motion(self) -> Array:
        """Both equations by the unknowns of the joints ``(2, n)``, through their forces."""
        problem, first = self.equations.problem, self.equations.first
        # What joins displacements and forces of modes is symmetric.
        alone = problem.alone.less_damped(self._rate).at(np.array([self._angular]))
        per_force = np.concatenate([alone.vibrate(row[None]) for row in self._rows])
        by_joint = (per_force @ problem.alone.at_joints.T).reshape(2, -1, problem.joints.directions)
        cosine, sine = (places[first] for places in problem.resolution.places)
        slopes = self.balance.cycle.jacobian
        by_motion = slopes[:, cosine] - 1j * slopes[:, sine]
        return np.asarray(-np.einsum("rjd,jdme->rjme", by_joint, by_motion).reshape(2, -1).real)

    @property
    def _angular(self) -> float:
        return 2.0 * np.pi * self.frequency

    @property
    def _rate(self) -> float:
        """2Dω [1/s]."""
        return 2.0 * self.damping_ratio * self._angular

    @property
    def _by_frequency(self) -> ComplexArray:
        """Forces on the modes ``(k, n)`` that a motion needs more per ln ω."""
        by_angular = self.balance.steady.stiffness_slope(self.balance.vibration)
        by_angular *= self._angulars[:, None]
        # The feed grows with ω itself.
        return np.asarray(by_angular + self.damping_ratio * self._by_damping)

    @property
    def _by_damping(self) -> ComplexArray:
        """Forces on the modes ``(k, n)`` that a motion needs more per D."""
        return np.asarray(-2j * self._angular * self._angulars[:, None] * self.balance.vibration)

    @property
    def _angulars(self) -> Array:
        """kω [rad/s] of all harmonics ``(k,)``."""
        return self._angular * self.equations.problem.orders


@dataclass(frozen=True)
class NonlinearMode:
    """Equations for the unknowns of a balance, ``scale`` · ln(f / ``frequency``) and ``scale`` · D.

    The amplitude is their parameter. ``reference`` ``(n,)`` is q̂ of the module, ``scale`` [mm] the
    size of the joints' vibration at the start.
    """

    problem: HarmonicBalance
    reference: ComplexArray
    frequency: float
    scale: float

    @cached_property
    def first(self) -> int:
        """Row of harmonic 1."""
        return self.problem.resolution.harmonics.index(1)

    def frequency_of(self, unknowns: Array) -> float:
        """[Hz]"""
        share = np.clip(unknowns[-2] / self.scale, -np.log(FARTHEST), np.log(FARTHEST))
        return float(self.frequency * np.exp(share))

    def damping_ratio_of(self, unknowns: Array) -> float:
        """D"""
        return float(np.clip(unknowns[-1] / self.scale, -MOST_DAMPED, MOST_DAMPED))

    def __call__(self, unknowns: Array, parameter: float) -> ModeBalance:
        problem = self.problem
        frequency, ratio = self.frequency_of(unknowns), self.damping_ratio_of(unknowns)
        fed = problem.alone.less_damped(4.0 * np.pi * ratio * frequency)
        balance = problem.evaluate(
            unknowns[:-2], frequency, 0.0, "frequency", fed.at(frequency * problem.turning)
        )
        return ModeBalance(self, balance, frequency, ratio, parameter)


@dataclass(frozen=True)
class ModeMotion:
    """A periodic motion of a mode: ``solution``, without a force, and its ``damping_ratio`` D.

    ``amplitude`` [t^0.5 mm] is the norm of harmonic 1 by the mass. A richer resolution would change
    the joints' vibration by ``vibration_error`` and the frequency by ``frequency_error``, as shares
    of themselves, and D by ``damping_error``, to first order.
    """

    solution: HarmonicSolution
    amplitude: float
    damping_ratio: float
    vibration_error: float
    frequency_error: float
    damping_error: float


@dataclass(frozen=True)
class ModeBranch:
    """Motions of a mode from the least amplitude on, and the ``linear`` one.

    ``message`` is empty if the largest amplitude was reached.
    """

    motions: tuple[ModeMotion, ...]
    message: str
    linear: LinearMode

    @property
    def amplitudes(self) -> Array:
        """[t^0.5 mm]"""
        return np.array([motion.amplitude for motion in self.motions])

    @property
    def frequencies(self) -> Array:
        """[Hz]"""
        return np.array([motion.solution.frequency for motion in self.motions])

    @property
    def damping_ratios(self) -> Array:
        return np.array([motion.damping_ratio for motion in self.motions])


@dataclass(frozen=True)
class LinearMode:
    """A mode of the structure with its joints as stiff as they are at rest.

    ``frequency`` [Hz], ``shape`` ``(n,)`` of unit modal mass, ``damping_ratio`` what C takes of it.

    Examples
    --------
    A mass of 1 kg on a spring and a joint of 1 N/µm each: √(2 k/m)

    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]])
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> problem = HarmonicBalance(rig, PeriodicMarch(law), PeriodicLoad({}), Resolution((1,), 64))
    >>> print(f"{LinearMode.of(problem, 1).frequency:.3f} Hz")
    225.079 Hz
    """

    frequency: float
    damping_ratio: float
    shape: Array

    @classmethod
    def of(cls, problem: HarmonicBalance, number: int) -> LinearMode:
        """The mode of a ``number``, counted from 1, rigid motions left out.

        Raises :class:`HarmonicBalanceError` for one that there is not.
        """
        # A sector in a wave is refused.
        _ = problem.alone
        stuck = problem.rest.stuck.stiffened
        elastic = np.flatnonzero(stuck.squares)
        if not 1 <= checks.whole("mode", number, HarmonicBalanceError) <= len(elastic):
            raise HarmonicBalanceError(
                f"mode {number}: the structure with stuck joints has 1 to {len(elastic)}"
            )
        place = elastic[number - 1]
        angular = float(np.sqrt(stuck.squares[place]))
        ratio = float(stuck.damping[place] + stuck.loss[place] / angular) / (2.0 * angular)
        return cls(angular / (2.0 * np.pi), ratio, stuck.at_points[:, place])


def along_nonlinear_mode(
    problem: HarmonicBalance,
    linear: LinearMode,
    amplitudes: tuple[float, float],
    control: ContinuationControl | None = None,
    steps: Steps = COMPUTED,
) -> ModeBranch:
    """A mode from a least to a largest amplitude [t^0.5 mm].

    It begins with the ``linear`` one, which must be near that of the least amplitude. The load of
    the problem counts as far as it is constant. Each of the ``steps`` finds a motion. Raises
    :class:`HarmonicBalanceError` for amplitudes that do not ascend from above zero.

    Examples
    --------
    A mass on a slider: D is the energy of its loop over 2π m ω² X², X = a / √m.

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]])
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> problem = HarmonicBalance(rig, PeriodicMarch(law), PeriodicLoad({}), Resolution((1,), 512))
    >>> X = np.array([1e-3, 2e-2])
    >>> ends = tuple(np.sqrt(1e-3) * X)
    >>> mode = along_nonlinear_mode(problem, LinearMode.of(problem, 1), ends)
    >>> work = 1e-3 * (2.0 * np.pi * mode.frequencies[-1] * X[1]) ** 2
    >>> D = law.loop_energy(X[1]) / (2.0 * np.pi * work)
    >>> print(f"{mode.damping_ratios[-1]:.4f} of {D:.4f}")
    0.0998 of 0.0998
    """
    ends = checks.array("amplitudes", amplitudes, (2,), error=HarmonicBalanceError, finite=False)
    least, largest = ends.tolist()
    if not 0.0 < least < largest < np.inf:
        raise HarmonicBalanceError(
            f"amplitudes from {least:g} to {largest:g}: give two above 0 that ascend"
        )
    control = control or ContinuationControl()
    unknowns, equations = _beginning(problem, linear, least)
    record = _Recorder(equations)
    first = steps("first motion of a mode", partial(_first, record, unknowns, least, control))
    if isinstance(first, str):
        return ModeBranch((), first, linear)
    point, motion = first
    record.take(motion)
    rest = np.append(problem.guess(None), np.zeros(2))
    curve = follow(
        equations, point, amplitudes, control, record, rest, problem.rounding, largest, steps
    )
    return ModeBranch(tuple(record.motions), curve.message, linear)


def _beginning(
    problem: HarmonicBalance, linear: LinearMode, amplitude: float
) -> tuple[Array, NonlinearMode]:
    """Unknowns of the linear mode with an amplitude, and the equations that count from it."""
    unknowns = problem.transfer.shaped(problem.guess(None).copy())
    cosine, _ = problem.resolution.places
    place = cosine[problem.resolution.harmonics.index(1)]
    moved = amplitude * problem.model.connection @ linear.shape
    unknowns[:, place] = moved.reshape(len(unknowns), -1)
    reference = problem.alone.at_points.T @ problem.model.mass @ linear.shape
    scale = float(np.linalg.norm(moved)) or 1.0
    equations = NonlinearMode(problem, reference + 0j, linear.frequency, scale)
    return np.append(unknowns, [scale * BESIDE, scale * linear.damping_ratio]), equations


def _first(
    record: _Recorder, unknowns: Array, amplitude: float, control: ContinuationControl
) -> tuple[CurvePoint, ModeMotion] | str:
    """The motion of the least amplitude; or why there is none."""
    found = solve(record.equations, unknowns, amplitude, NewtonControl(control.tolerance))
    if not found.converged:
        return (
            f"at the least amplitude Newton's method leaves {found.at.relative:.2g} after "
            f"{found.iterations} iterations from the linear mode; begin with a smaller one"
        )
    point = first_point(found, amplitude, True, control.first)
    return point, record.describe(point, found.at)


class _Recorder:
    """Keeps every new motion of a mode, with its error."""

    def __init__(self, equations: NonlinearMode) -> None:
        self.equations = equations
        self.motions: list[ModeMotion] = []

    def describe(self, point: CurvePoint, at: ModeBalance) -> ModeMotion:
        """The motion at a point."""
        problem = self.equations.problem
        motion = problem.describe(
            point.unknowns[:-2], at.balance, at.frequency, 0.0, point.iterations
        )
        motion = replace(motion, residual=at.relative)
        errors = self._errors(motion, point)
        return ModeMotion(motion, point.parameter, at.damping_ratio, *errors)

    def take(self, description: ModeMotion) -> None:
        """Keep a motion."""
        self.motions.append(description)

    def _errors(self, motion: HarmonicSolution, point: CurvePoint) -> tuple[float, float, float]:
        """Of vibration, frequency and D: one step of Newton's method with a richer resolution."""
        problem, scale = self.equations.problem, self.equations.scale
        vibration = problem.vibration(motion.coefficients)
        if vibration == 0.0:
            return 0.0, 0.0, 0.0
        richer = replace(self.equations, problem=richer_problem(problem, motion))
        joints = richer.problem.resolution.adopt(motion.coefficients, problem.resolution)
        at = richer(np.append(joints, point.unknowns[-2:]), point.parameter)
        change = solve_alone(at.jacobian, -at.residual)
        moved = float(np.linalg.norm(richer.problem.vibrating(change[:-2])))
        return moved / vibration, abs(float(change[-2])) / scale, abs(float(change[-1])) / scale
