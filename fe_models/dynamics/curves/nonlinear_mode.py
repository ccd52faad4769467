"""Nonlinear modes of a structure with joints: frequency and damping against amplitude.

A free vibration of a structure with dissipative joints decays. It is replaced by a periodic motion
that is fed as much energy as it loses, by a damping term -2Dω M proportional to the mass (extended
periodic motion concept: Krack 2015, Comput. Struct. 154, 59, doi:10.1016/j.compstruc.2015.03.008):

    M x'' + (C - 2Dω M) x' + K x + Bᵀ F(B x) = s.

The amplitude a is the norm of the first harmonic, weighted by mass. For each amplitude there is one
such motion with a frequency ω and a damping ratio D; a linear mode has its own ω and D. Because the
feed acts on all harmonics and all points in proportion to their mass, D is the energy lost in a
period over 2ω ∫ x'ᵀ M x' dt, whatever the shape of the mode. A response at phase resonance is close
to the mode if its force excites a single, lightly damped mode that no other mode is close to.

The unknowns are those of harmonic balance, ln ω and D. Two further equations set the amplitude, and
require that the first harmonic is in phase with the linear mode: q̂ᴴ x is real, in the coordinates
of the modes without joints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from fe_models.dynamics.curves.bordered import solve_alone
from fe_models.dynamics.curves.continuation import follow
from fe_models.dynamics.curves.curve_steps import ContinuationControl, CurvePoint, first_point
from fe_models.dynamics.curves.newton import NewtonControl, solve
from fe_models.dynamics.curves.sizes import limited_frequency
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray, HarmonicBalanceError
from fe_models.dynamics.periodic.resolution_error import extended_problem
from sa_solver import checks
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Relative offset of the initial frequency from that of the linear mode. With joints of no
# stiffness, that frequency is one of the structure alone, whose flexibility is not finite there.
INITIAL_OFFSET = 1e-4
# Largest damping ratio.
MAX_DAMPING_RATIO = 10.0


@dataclass(frozen=True)
class ModeBalance:
    """Equations of a nonlinear mode at one motion, and their derivatives on demand.

    Parameters
    ----------
    equations
        The equations.
    balance
        Harmonic balance of the motion without a force, with the feed of D.
    frequency
        Frequency [Hz].
    damping_ratio
        Damping ratio D.
    amplitude
        Prescribed amplitude [t^0.5 mm].
    """

    equations: NonlinearMode
    balance: Balance
    frequency: float
    damping_ratio: float
    amplitude: float

    @cached_property
    def first(self) -> ComplexArray:
        """Harmonic 1 ``(n,)`` of the modes without joints."""
        return self.balance.motion[self.equations.first]

    @cached_property
    def _size(self) -> float:
        return float(np.linalg.norm(self.first))

    @cached_property
    def _conditions(self) -> Array:
        """Residuals of amplitude and phase: the logarithm of its ratio, the sine of its angle."""
        if not 0.0 < self._size < np.inf:
            return np.array([np.inf, np.inf])
        phase = np.vdot(self.equations.reference, self.first).imag / self._size
        return np.array([np.log(self._size / self.amplitude), phase])

    @cached_property
    def residual(self) -> Array:
        return np.append(self.balance.residual, self.equations.scale * self._conditions)

    @property
    def size(self) -> float:
        """Norm of the terms of the harmonic balance."""
        return self.balance.size

    @cached_property
    def relative(self) -> float:
        """Relative residual of harmonic balance, amplitude and phase together."""
        residual = float(np.hypot(self.balance.relative, np.linalg.norm(self._conditions)))
        return residual if np.isfinite(residual) else np.inf

    @cached_property
    def jacobian(self) -> Array:
        """Jacobian ∂r/∂u ``(n + 2, n + 2)``."""
        inner = self.balance.jacobian
        inner = inner if isinstance(inner, np.ndarray) else inner.assembled()
        count, scale = len(inner), self.equations.scale
        matrix = np.empty((count + 2, count + 2), order="F")
        matrix[:count, :count] = inner
        transfer, steady = self.equations.problem.transfer, self.balance.steady
        to_first = self._conditions_by_unknowns
        forces = self._forces_by_frequency, self._forces_by_damping
        for column, force in enumerate(forces, start=count):
            response = steady.vibrate(force)
            matrix[:count, column] = transfer.at_joints(response) / scale
            matrix[count:, column] = -(self._condition_rows @ response[self.equations.first]).real
        # Rows are the equations times the scale; the columns of the joint unknowns are not scaled.
        matrix[count:, :count] = scale * to_first
        return matrix

    @cached_property
    def slope(self) -> Array:
        """Derivative ∂r/∂a ``(n + 2,)`` with respect to the amplitude."""
        slope = np.zeros(len(self.residual))
        slope[-2] = -self.equations.scale / self.amplitude
        return slope

    @cached_property
    def _condition_rows(self) -> ComplexArray:
        """Rows ``(2, n)`` whose products with a change of harmonic 1 change both conditions.

        The change is the real part of the product.
        """
        along = self.first.conj() / self._size**2
        # Re(-i z) is the imaginary part of z.
        across = -1j * self.equations.reference.conj() / self._size
        return np.stack([along, across - self._conditions[1] * along])

    @property
    def _conditions_by_unknowns(self) -> Array:
        """Derivatives ``(2, n)`` of both conditions by the unknowns, through the joints' forces."""
        problem, first = self.equations.problem, self.equations.first
        # The matrix between displacements and forces of modes is symmetric.
        fed_structure = problem.uniform_receptance.less_damped(self._feed_rate).at(
            np.array([self._angular])
        )
        per_force = np.concatenate(
            [fed_structure.vibrate(row[None]) for row in self._condition_rows]
        )
        by_joint = (per_force @ problem.uniform_receptance.at_joints.T).reshape(
            2, -1, problem.joints.directions
        )
        cosine, sine = (places[first] for places in problem.resolution.places)
        slopes = self.balance.cycle.jacobian
        by_motion = slopes[:, cosine] - 1j * slopes[:, sine]
        return np.asarray(-np.einsum("rjd,jdme->rjme", by_joint, by_motion).reshape(2, -1).real)

    @property
    def _angular(self) -> float:
        return 2.0 * np.pi * self.frequency

    @property
    def _feed_rate(self) -> float:
        """Feed 2Dω [1/s]."""
        return 2.0 * self.damping_ratio * self._angular

    @property
    def _forces_by_frequency(self) -> ComplexArray:
        """Change ``(k, n)`` of the modal forces that maintain a motion, per ln ω."""
        by_angular = self.balance.steady.stiffness_slope(self.balance.vibration)
        by_angular *= self._angular_by_harmonic[:, None]
        # The feed is proportional to ω itself.
        return np.asarray(by_angular + self.damping_ratio * self._forces_by_damping)

    @property
    def _forces_by_damping(self) -> ComplexArray:
        """Change ``(k, n)`` of the modal forces that maintain a motion, per D."""
        return np.asarray(
            -2j * self._angular * self._angular_by_harmonic[:, None] * self.balance.vibration
        )

    @property
    def _angular_by_harmonic(self) -> Array:
        """Angular frequency kω [rad/s] of each harmonic ``(k,)``."""
        return self._angular * self.equations.problem.harmonic_numbers


@dataclass(frozen=True)
class NonlinearMode:
    """Equations of a mode; the unknowns are those of a balance, ln(f / ``frequency``) and D.

    The last two are multiplied by ``scale``. The amplitude is the parameter of the equations.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    reference
        q̂ ``(n,)`` of the module.
    frequency
        Reference frequency [Hz].
    scale
        Norm of the joints' vibration at the start [mm].
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
        """Return the frequency [Hz] that the unknowns stand for."""
        return limited_frequency(self.frequency, unknowns[-2] / self.scale)

    def damping_ratio_of(self, unknowns: Array) -> float:
        """Return the damping ratio D that the unknowns stand for."""
        return float(np.clip(unknowns[-1] / self.scale, -MAX_DAMPING_RATIO, MAX_DAMPING_RATIO))

    def __call__(self, unknowns: Array, parameter: float) -> ModeBalance:
        problem = self.problem
        frequency, ratio = self.frequency_of(unknowns), self.damping_ratio_of(unknowns)
        fed = problem.uniform_receptance.less_damped(4.0 * np.pi * ratio * frequency)
        balance = problem.evaluate(
            unknowns[:-2],
            frequency,
            0.0,
            "frequency",
            fed.at(frequency * problem.angular_per_hertz),
        )
        return ModeBalance(self, balance, frequency, ratio, parameter)


@dataclass(frozen=True)
class ModeMotion:
    """Periodic motion of a nonlinear mode.

    The errors are the changes that a richer resolution would make, to first order.

    Parameters
    ----------
    solution
        The motion, without a force.
    amplitude
        Norm of harmonic 1, weighted by mass [t^0.5 mm].
    damping_ratio
        Damping ratio D.
    vibration_error
        Relative error of the joints' vibration.
    frequency_error
        Relative error of the frequency.
    damping_error
        Error of D.
    """

    solution: HarmonicSolution
    amplitude: float
    damping_ratio: float
    vibration_error: float
    frequency_error: float
    damping_error: float


@dataclass(frozen=True)
class ModeBranch:
    """Motions of a nonlinear mode from the smallest amplitude on, and its linear mode.

    ``message`` is empty if the largest amplitude was reached, else the reason why not.
    """

    motions: tuple[ModeMotion, ...]
    message: str
    linear: LinearMode

    @property
    def amplitudes(self) -> Array:
        """Amplitudes [t^0.5 mm]."""
        return np.array([motion.amplitude for motion in self.motions])

    @property
    def frequencies(self) -> Array:
        """Frequencies [Hz]."""
        return np.array([motion.solution.frequency for motion in self.motions])

    @property
    def damping_ratios(self) -> Array:
        return np.array([motion.damping_ratio for motion in self.motions])


@dataclass(frozen=True)
class LinearMode:
    """Mode of the structure with its joints as stiff as they are at rest.

    Parameters
    ----------
    frequency
        Natural frequency [Hz].
    damping_ratio
        Damping ratio due to the damping of the structure.
    shape
        Mode shape ``(n,)`` of unit modal mass.

    Examples
    --------
    A mass of 1 kg stands on a spring and a joint of 1 N/µm each: ω = √(2 k/m).

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
        """Return the mode of a ``number``, counted from 1 without rigid motions.

        Raises
        ------
        HarmonicBalanceError
            If there is no such mode.
        """
        # Raises an error for a sector in a wave.
        _ = problem.uniform_receptance
        stuck = problem.rest.stuck.stiffened
        elastic = np.flatnonzero(stuck.squares)
        if not 1 <= checks.whole("mode", number, HarmonicBalanceError) <= len(elastic):
            raise HarmonicBalanceError(
                f"mode {number} does not exist: the structure with stuck joints has 1 to "
                f"{len(elastic)}"
            )
        index = elastic[number - 1]
        angular = float(np.sqrt(stuck.squares[index]))
        ratio = float(stuck.damping[index] + stuck.loss[index] / angular) / (2.0 * angular)
        return cls(angular / (2.0 * np.pi), ratio, stuck.at_points[:, index])


def along_nonlinear_mode(
    problem: HarmonicBalance,
    linear: LinearMode,
    amplitudes: tuple[float, float],
    control: ContinuationControl | None = None,
    steps: Steps = COMPUTED,
) -> ModeBranch:
    """Follow a nonlinear mode from a smallest to a largest amplitude.

    Only the constant part of the problem's load counts.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    linear
        The linear mode, which must be close to the mode of the smallest amplitude.
    amplitudes
        Smallest and largest amplitude [t^0.5 mm].
    control
        Control of the steps.
    steps
        Runner of the steps, each of which finds one motion; see :class:`sa_solver.steps.Steps`.

    Raises
    ------
    HarmonicBalanceError
        If the amplitudes do not ascend from above zero.

    Examples
    --------
    For a mass on a slider, D is the energy of its loop over 2π m ω² X², with X = a / √m.

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
            f"amplitudes from {least:g} to {largest:g} are not possible: give two above 0 that "
            "ascend"
        )
    control = control or ContinuationControl()
    unknowns, equations = _linear_start(problem, linear, least)
    record = _ModeRecorder(equations)
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


def _linear_start(
    problem: HarmonicBalance, linear: LinearMode, amplitude: float
) -> tuple[Array, NonlinearMode]:
    """Return the unknowns of the linear mode with an amplitude, and the equations around it."""
    unknowns = problem.transfer.shaped(problem.guess(None).copy())
    cosine, _ = problem.resolution.places
    index = cosine[problem.resolution.harmonics.index(1)]
    moved = amplitude * problem.model.connection @ linear.shape
    unknowns[:, index] = moved.reshape(len(unknowns), -1)
    reference = problem.uniform_receptance.at_points.T @ problem.model.mass @ linear.shape
    scale = float(np.linalg.norm(moved)) or 1.0
    equations = NonlinearMode(problem, reference + 0j, linear.frequency, scale)
    return np.append(unknowns, [scale * INITIAL_OFFSET, scale * linear.damping_ratio]), equations


def _first(
    record: _ModeRecorder, unknowns: Array, amplitude: float, control: ContinuationControl
) -> tuple[CurvePoint, ModeMotion] | str:
    """Return the motion of the smallest amplitude, or the reason why there is none."""
    found = solve(record.equations, unknowns, amplitude, NewtonControl(control.tolerance))
    if not found.converged:
        return (
            f"at the smallest amplitude Newton's method, started from the linear mode, leaves a "
            f"residual of {found.at.relative:.2g} after {found.iterations} iterations: begin with "
            "a smaller amplitude"
        )
    point = first_point(found, amplitude, True, control.first)
    return point, record.describe(point, found.at)


class _ModeRecorder:
    """Recorder of the motions of a mode, with their errors."""

    def __init__(self, equations: NonlinearMode) -> None:
        self.equations = equations
        self.motions: list[ModeMotion] = []

    def describe(self, point: CurvePoint, at: ModeBalance) -> ModeMotion:
        """Return the motion at a point."""
        problem = self.equations.problem
        motion = problem.describe(
            point.unknowns[:-2], at.balance, at.frequency, 0.0, point.iterations
        )
        motion = replace(motion, residual=at.relative)
        errors = self._errors(motion, point)
        return ModeMotion(motion, point.parameter, at.damping_ratio, *errors)

    def take(self, description: ModeMotion) -> None:
        """Store a motion."""
        self.motions.append(description)

    def _errors(self, motion: HarmonicSolution, point: CurvePoint) -> tuple[float, float, float]:
        """Return errors of vibration, frequency and D, by a Newton step at richer resolution."""
        problem, scale = self.equations.problem, self.equations.scale
        vibration = problem.vibration(motion.coefficients)
        if vibration == 0.0:
            return 0.0, 0.0, 0.0
        richer = replace(self.equations, problem=extended_problem(problem, motion))
        joints = richer.problem.resolution.adopt(motion.coefficients, problem.resolution)
        at = richer(np.append(joints, point.unknowns[-2:]), point.parameter)
        change = solve_alone(at.jacobian, -at.residual)
        moved = float(np.linalg.norm(richer.problem.without_mean(change[:-2])))
        return moved / vibration, abs(float(change[-2])) / scale, abs(float(change[-1])) / scale
