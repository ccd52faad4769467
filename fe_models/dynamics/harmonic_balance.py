"""Periodic motion of a structure with joints under periodic forces, by its harmonics.

    M x'' + C x' + K x = f(t) - Bᵀ F(B x),   f(t) = s + a Re Σ w_k exp(ikωt)

The unknowns are the real Fourier coefficients of the joints' displacements u = B x: the structure
answers exactly, harmonic by harmonic, by its receptances R_k between joints (alternating frequency
and time: Cameron and Griffin, J. Appl. Mech. 56, 1989, 149; condensed to the joints: Petrov and
Ewins, doi:10.1115/1.1539868). With the Fourier coefficients F_k of the joints' forces

    r_k = u_k - (what the forces without joints make of u)_k + R_k F_k = 0.

This form has no stiff terms: its Jacobian 1 + R J is near 1 where joints are soft, and of the size
of kt R where they are stiff.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numba import njit

from fe_models.dynamics.bordered import LinearMap, solve_alone
from fe_models.dynamics.continuation import ContinuationControl, first_point, follow
from fe_models.dynamics.harmonics import (
    ComplexArray,
    HarmonicBalanceError,
    Resolution,
    by_function,
    by_joint,
)
from fe_models.dynamics.joint_rest import Rest
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.newton import NewtonControl, NewtonSolution, relative_norm, solve
from fe_models.dynamics.receptance import Receptance, SteadyMotion
from sa_solver.types import Array

# Unknowns up to which a matrix is assembled and factorised; beyond, products with it are cheaper.
DENSE = 400
# Harmonics left out are looked for up to this multiple of the highest, and at least to this one.
LOOK_BEYOND, LOOK_AT_LEAST = 4, 9
# A vibration below this share of what balances in the mean is rounding: there is none.
STILL = 1e-12


class Cycle(Protocol):
    """What joints do in a period; see :class:`PeriodicJoints`."""

    @property
    def force(self) -> Array: ...
    @property
    def jacobian(self) -> Array: ...
    @property
    def samples(self) -> Array: ...
    @property
    def states(self) -> np.ndarray: ...
    @property
    def dissipated(self) -> Array: ...
    @property
    def change(self) -> Array: ...


class PeriodicJoints(Protocol):
    """Joints that are led round a period: :class:`wear.joints.periodic.PeriodicMarch` is one.

    The displacement of joint j at sample t is ``basis[t] @ coefficients[j]``, from ``basis``
    ``(t, m)`` and ``coefficients`` ``(j, m, d)`` [mm]; ``lead`` ``(p, m)`` gives the points through
    which they are led from rest to the first sample, the last. Answers ``force`` ``(j, m, d)``
    [N], the samples times ``weights`` ``(m, t)``, its derivative ``jacobian``
    ``(j, m, d, m, d)``, the ``samples`` ``(t, j, d)`` and ``states`` ``(t, j)`` (0 stick, 1 slip,
    2 separated), the energy ``dissipated`` ``(j,)`` [N mm] per period, and the relative ``change``
    ``(j,)`` of the force from one period to the next.
    """

    @property
    def directions(self) -> int: ...
    def settle(
        self, coefficients: Array, basis: Array, weights: Array, lead: Array | None
    ) -> Cycle: ...


@dataclass(frozen=True)
class PeriodicLoad:
    """Forces on the structure [N].

    ``waves`` gives the complex amplitudes ``(n,)`` of its harmonics, for a force of 1: with w the
    force is Re w exp(ikωt), so that -1j makes a sine. ``static`` ``(n,)`` does not grow with the
    force.
    """

    waves: Mapping[int, ComplexArray]
    static: Array | None = None


@dataclass(frozen=True)
class CycleRecord:
    """What is kept of a :class:`Cycle`: all but its derivative."""

    force: Array
    samples: Array
    states: np.ndarray
    dissipated: Array
    change: Array


@dataclass(frozen=True)
class Balance:
    """The equations at one motion: what is left of them ``(n,)``, and derivatives when asked for.

    ``over`` is what varies, frequency or force; ``steady`` the structure at this frequency,
    ``motion`` ``(k, n)`` that of its modes, ``cycle`` what the joints do, ``size`` the norm of the
    terms that balance.
    """

    problem: HarmonicBalance
    over: str
    steady: SteadyMotion
    motion: ComplexArray
    cycle: Cycle
    residual: Array
    size: float

    @cached_property
    def relative(self) -> float:
        return relative_norm(self.residual, self.size)

    @cached_property
    def jacobian(self) -> Array | LinearMap:
        """∂r/∂u ``(n, n)``, a matrix up to :data:`DENSE` unknowns."""
        products = _Jacobian(self.problem, self.steady, self.cycle.jacobian)
        return products.assembled() if self.problem.size <= DENSE else products

    @cached_property
    def slope(self) -> Array:
        """∂r/∂λ ``(n,)``."""
        problem, steady = self.problem, self.steady
        if self.over == "force":
            return -problem.at_joints(steady.respond(problem.wave))
        turned = steady.turned(self.motion) * (2.0 * np.pi * problem.orders[:, None])
        return problem.at_joints(steady.respond(turned))


@dataclass(frozen=True)
class HarmonicSolution:
    """A periodic motion.

    ``frequency`` [Hz], ``force`` (the factor a of the load), ``coefficients`` ``(j, m, d)`` [mm] of
    the joints' displacements, ``motion`` ``(k, n)`` the complex amplitudes of the structure's [mm],
    ``cycle`` what the joints do, ``iterations`` and ``residual`` of Newton's method. ``message`` is
    empty, or says why this is not a solution.

    ``left_out`` estimates the share of the joints' vibration that is in other harmonics than those
    of the ``resolution``: what the joints' forces there would cause. ``sampling`` is by how much
    the vibration would change with twice the samples, relative to it; None if not asked for.
    """

    frequency: float
    force: float
    resolution: Resolution
    coefficients: Array
    motion: ComplexArray
    cycle: CycleRecord
    iterations: int
    residual: float
    left_out: float
    sampling: float | None
    message: str

    @property
    def converged(self) -> bool:
        return not self.message

    def amplitude(self, place: int, harmonic: int = 1) -> complex:
        """Complex amplitude of a degree of freedom [mm]."""
        return complex(self.motion[self.resolution.harmonics.index(harmonic), place])

    def displacement(self, samples: int) -> Array:
        """Displacement of the structure ``(t, n)`` [mm] at equal times of a period."""
        return _in_time(self.motion, self.resolution, samples)

    def velocity(self, samples: int) -> Array:
        """Velocity of the structure ``(t, n)`` [mm/s]."""
        rates = 2j * np.pi * self.frequency * np.array(self.resolution.harmonics)
        return _in_time(rates[:, None] * self.motion, self.resolution, samples)


def _in_time(amplitudes: ComplexArray, resolution: Resolution, samples: int) -> Array:
    """Re Σ a_k exp(ikωt) ``(t, n)`` at equal times of a period."""
    turns = np.outer(np.arange(samples), resolution.harmonics) % samples / samples
    return np.asarray((np.exp(2j * np.pi * turns) @ amplitudes).real)


class HarmonicBalance:
    """The balance of one structure, its joints and a load, at one resolution."""

    def __init__(
        self,
        model: DynamicModel,
        joints: PeriodicJoints,
        load: PeriodicLoad,
        resolution: Resolution,
        receptance: Receptance | None = None,
        rest: Rest | None = None,
    ) -> None:
        unknown = sorted(set(load.waves) - set(resolution.harmonics))
        still = load.static is not None and np.any(load.static)
        if unknown or (still and resolution.harmonics[0] != 0):
            raise HarmonicBalanceError(
                f"the load has harmonics {unknown or [0]} that the motion has not: add them"
            )
        given = [*load.waves.values(), *([] if load.static is None else [load.static])]
        if not all(np.isfinite(part).all() for part in given):
            raise HarmonicBalanceError("a force of the load is not a number: give finite ones")
        self.model, self.joints, self.load, self.resolution = model, joints, load, resolution
        self.receptance = receptance or Receptance(model)
        self._directions = joints.directions
        self._joints = len(model.connection) // joints.directions
        self.orders = np.array(resolution.harmonics, dtype=float)
        self.held = self.receptance.held if resolution.harmonics[0] == 0 else 0.0
        # Forces on the modes (k, n): those that grow with the force, and the others.
        self.wave = np.zeros((len(self.orders), len(model.mass)), dtype=complex)
        for harmonic, wave in load.waves.items():
            self.wave[resolution.harmonics.index(harmonic)] = wave @ self.receptance.at_points
        self._constant = np.zeros_like(self.wave)
        if load.static is not None and still:
            self._constant[0] = load.static @ self.receptance.at_points
        self.rest = rest or Rest(model, self.receptance, joints, self._constant[0].real)
        self._beyond = _beyond(resolution)

    @property
    def size(self) -> int:
        """Unknowns."""
        return self._joints * self.resolution.size * self._directions

    def by_frequency(self, force: float) -> _ByFrequency:
        """The equations at a given force, with the frequency [Hz] as parameter."""
        return _ByFrequency(self, force)

    def by_force(self, frequency: float) -> _ByForce:
        """The equations at a given frequency [Hz], with the force as parameter."""
        return _ByForce(self, frequency)

    def solve(
        self, frequency: float, force: float, start: HarmonicSolution | None = None
    ) -> HarmonicSolution:
        """The motion at a frequency [Hz] and a force, found from another motion or from rest."""
        found = self.find(frequency, force, self.guess(start))
        solution = self.describe(found.unknowns, found.at, frequency, force)
        return replace(solution, iterations=found.iterations, message=found.message)

    def guess(self, start: HarmonicSolution | None) -> Array:
        """Unknowns taken from another motion, or those of the structure at rest under its load."""
        if start is None:
            unknowns = np.zeros((self._joints, self.resolution.size, self._directions))
            if self.resolution.harmonics[0] == 0:
                unknowns[:, 0] = self.rest.displacement
            return unknowns.ravel()
        return self.resolution.adopt(start.coefficients, start.resolution).ravel()

    def find(
        self,
        frequency: float,
        force: float,
        unknowns: Array,
        control: ContinuationControl | None = None,
    ) -> NewtonSolution[Balance]:
        """Newton's method from given unknowns; if it fails, from rest, by raising the force.

        A branch is followed for the latter, with the steps of ``control``. The equations of the
        solution are those with the frequency as parameter. Raises :class:`HarmonicBalanceError` for
        a frequency that is not above zero, and for numbers that are not finite.
        """
        if not (0.0 < frequency < np.inf and np.isfinite(force)):
            raise HarmonicBalanceError(
                f"frequency {frequency:g} Hz, force {force:g}: give a frequency above 0, and both "
                "finite"
            )
        control = control or ContinuationControl()
        newton = NewtonControl(control.tolerance)
        found = solve(self.by_frequency(force), unknowns, frequency, newton)
        if found.converged or force == 0.0:
            return found
        rising = self.by_force(frequency)
        still = solve(rising, self.guess(None), 0.0, newton)
        if not still.converged:
            return replace(
                still,
                message="there is no rest under the constant load, from which the force could be "
                f"raised: {still.message}, or give a load that does not pull all joints apart",
            )
        point = first_point(still, 0.0, force > 0.0, control.first)
        # A curve that comes back to no force has turned back, or is closed.
        span = min(force, 0.0), max(force, 0.0)
        curve = follow(
            rising, point, span, control, origin=self.guess(None), rounding=self.rounding
        )
        if curve.message:
            return replace(found, message=f"raising the force from 0, {curve.message}")
        last = curve.points[-1]
        if last.parameter != force:
            reached = np.max(np.sign(force) * curve.parameters)
            return replace(
                found,
                message=f"raising the force from 0, the curve turns back at {reached:.6g} and "
                f"does not reach {abs(force):g}: give more harmonics and samples, or start from a "
                "solution nearby",
            )
        return solve(self.by_frequency(force), last.unknowns, frequency, newton)

    def describe(
        self, unknowns: Array, at: Balance, frequency: float, force: float, *, check: bool = False
    ) -> HarmonicSolution:
        """The motion with these unknowns; ``check`` it with twice the samples."""
        coefficients, cycle = self._shaped(unknowns), at.cycle
        record = CycleRecord(
            cycle.force, cycle.samples, cycle.states, cycle.dissipated, cycle.change
        )
        shares = self.left_out(coefficients, record, frequency)
        return HarmonicSolution(
            frequency=frequency,
            force=force,
            resolution=self.resolution,
            coefficients=coefficients,
            motion=at.motion @ self.receptance.at_points.T,
            cycle=record,
            iterations=0,
            residual=at.relative,
            left_out=float(np.linalg.norm(shares)),
            sampling=self.sampling(unknowns, frequency, force) if check else None,
            message="",
        )

    def left_out(self, coefficients: Array, cycle: CycleRecord, frequency: float) -> Array:
        """Share of the joints' vibration that each harmonic 0, 1, 2, ... left out would have.

        The larger of what the joints' forces there cause with joints free, and as stiff as at rest:
        a harmonic may meet a mode of either.
        """
        beyond, vibration = self._beyond, self._vibration(coefficients)
        harmonics = np.array(beyond.harmonics)
        shares = np.zeros(harmonics[-1] + 1)
        if vibration == 0.0:
            return shares
        pull = beyond.weights @ cycle.samples.reshape(beyond.samples, -1)
        cosine, sine = beyond.places
        for structure in (self.receptance, self.rest.stiffened):
            steady = structure.at(2.0 * np.pi * frequency * harmonics)
            moved = steady.respond(beyond.combined(pull @ structure.at_joints))
            squares = np.square(beyond.separated(moved) @ structure.at_joints.T).sum(axis=1)
            found = np.sqrt(squares[cosine] + np.where(sine < 0, 0.0, squares[sine]))
            shares[harmonics] = np.maximum(shares[harmonics], found)
        shares[list(self.resolution.harmonics)] = 0.0
        return shares / vibration

    def sampling(self, unknowns: Array, frequency: float, force: float) -> float:
        """Change of the joints' vibration by twice the samples, to first order and relative."""
        vibration = self._vibration(self._shaped(unknowns))
        if vibration == 0.0:
            return 0.0
        at = self._twice.evaluate(unknowns, frequency, force, "frequency")
        change = solve_alone(at.jacobian, at.residual)
        return self._moved(self._shaped(change)) / vibration

    @cached_property
    def rounding(self) -> float:
        """Norm of unknowns that only rounding leaves of what balances in the mean [mm]."""
        rest, loaded = self.rest.displacement, self.rest.loaded
        return STILL * float(np.linalg.norm(rest) + np.linalg.norm(loaded))

    def _moved(self, coefficients: Array) -> float:
        """Norm of coefficients ``(j, m, d)`` without the mean."""
        return float(np.linalg.norm(coefficients[:, int(self.resolution.harmonics[0] == 0) :]))

    def _vibration(self, coefficients: Array) -> float:
        """The same, 0 where it is rounding."""
        moved = self._moved(coefficients)
        return moved if moved > self.rounding else 0.0

    @cached_property
    def _twice(self) -> HarmonicBalance:
        """The same problem with twice the samples."""
        return self.refined(Resolution(self.resolution.harmonics, 2 * self.resolution.samples))

    def refined(self, resolution: Resolution) -> HarmonicBalance:
        """The same problem at another resolution."""
        return HarmonicBalance(
            self.model, self.joints, self.load, resolution, self.receptance, self.rest
        )

    def _shaped(self, unknowns: Array) -> Array:
        return unknowns.reshape(self._joints, self.resolution.size, self._directions)

    def pulled(
        self, force: Array, unknowns: Array, structure: Receptance | None = None
    ) -> ComplexArray:
        """Forces on the modes ``(k, n)`` by joints that pull with ``force`` ``(j, m, d)``.

        Of the opposite sign. It is their ``unknowns`` by which they are held at harmonic 0.
        """
        structure, pull = structure or self.receptance, by_function(force)
        if self.held:
            # Of one joint it is the joint's own force, which stays.
            pull = pull.copy()
            pull[0] -= self.held * self._shaped(unknowns)[:, 0].ravel()
        return self.resolution.combined(pull @ structure.at_joints)

    def evaluate(self, unknowns: Array, frequency: float, force: float, over: str) -> Balance:
        """The equations; ``over`` is what varies in their derivatives, frequency or force."""
        resolution = self.resolution
        coefficients = self._shaped(unknowns)
        cycle = self.joints.settle(
            coefficients, resolution.basis, resolution.weights, resolution.lead
        )
        steady = self.receptance.at(2.0 * np.pi * frequency * self.orders)
        pulled = self.pulled(cycle.force, unknowns)
        motion = steady.respond(self._constant + force * self.wave - pulled)
        answer = self.at_joints(motion)
        size = self._size(coefficients, answer, cycle)
        return Balance(self, over, steady, motion, cycle, unknowns - answer, size)

    def _size(self, coefficients: Array, answer: Array, cycle: Cycle) -> float:
        """Norm of the terms that balance.

        Load and joints may cancel at rest: what each does to the mean displacement counts. Where
        only joints hold the structure, any mean displacement balances that of the springs that
        hold it here, and does not count.
        """
        moving = int(self.held > 0.0)
        size = np.linalg.norm(coefficients[:, moving:])
        size += np.linalg.norm(self._shaped(answer)[:, moving:])
        if self.resolution.harmonics[0] == 0:
            still = self.receptance.still_joints
            size += np.linalg.norm(still @ cycle.force[:, 0].ravel())
            size += np.linalg.norm(self.rest.loaded)
        return float(size)

    def at_joints(self, motion: ComplexArray, structure: Receptance | None = None) -> Array:
        """Coefficients ``(j m d,)`` of the joints' displacements, of a motion of the modes.

        The modes are those of this structure, or of another one.
        """
        structure = structure or self.receptance
        rows = self.resolution.separated(motion) @ structure.at_joints.T
        return by_joint(rows, self._directions).ravel()


@dataclass(frozen=True)
class _Jacobian:
    """1 + R (J - κ): what it does to a vector, and its assembly."""

    problem: HarmonicBalance
    steady: SteadyMotion
    slopes: Array

    def __matmul__(self, vector: Array) -> Array:
        joints = len(self.slopes)
        size = self.slopes.shape[1] * self.slopes.shape[2]
        columns = vector.reshape(joints, size, 1)
        force = (self.slopes.reshape(joints, size, size) @ columns).reshape(self.slopes.shape[:3])
        return vector + self._answer(self.steady, force, vector)

    def precondition(self, vector: Array) -> Array:
        """The inverse with the joints' stiffness D at rest, for J, times a vector.

        (1 + R (D - κ))⁻¹ = 1 - R' (D - κ), with receptances R' of the structure stiffened by D.
        """
        shaped = vector.reshape(self.slopes.shape[:3])
        return vector - self._answer(self._stiffened, shaped @ self.problem.rest.tangents, vector)

    @cached_property
    def _stiffened(self) -> SteadyMotion:
        return self.problem.rest.stiffened.at(self.steady.angular)

    def _answer(self, steady: SteadyMotion, force: Array, vector: Array) -> Array:
        problem, structure = self.problem, steady.structure
        motion = steady.respond(problem.pulled(force, vector, structure))
        return problem.at_joints(motion, structure)

    def assembled(self) -> Array:
        problem = self.problem
        slopes = self.slopes.reshape(*self.slopes.shape[:3], -1)
        jacobian = np.zeros((problem.size, problem.size))
        places = problem.resolution.places
        _assemble(self.steady.between_joints(), slopes, problem.held, *places, jacobian)
        return jacobian


@dataclass(frozen=True)
class _ByFrequency:
    problem: HarmonicBalance
    force: float

    def __call__(self, unknowns: Array, parameter: float) -> Balance:
        return self.problem.evaluate(unknowns, parameter, self.force, "frequency")


@dataclass(frozen=True)
class _ByForce:
    problem: HarmonicBalance
    frequency: float

    def __call__(self, unknowns: Array, parameter: float) -> Balance:
        return self.problem.evaluate(unknowns, self.frequency, parameter, "force")


def _beyond(resolution: Resolution) -> Resolution:
    """The harmonics that are left out, as far as they are looked for, and the highest own one."""
    own = resolution.harmonics
    highest = min((resolution.samples - 1) // 2, max(LOOK_BEYOND * own[-1], LOOK_AT_LEAST))
    others = set(range(highest + 1)).difference(own[:-1])
    return Resolution(tuple(sorted(others)), resolution.samples)


@njit(cache=True, nogil=True)
def _assemble(
    between: ComplexArray,
    slopes: Array,
    held: float,
    cosines: np.ndarray,
    sines: np.ndarray,
    jacobian: Array,
) -> None:
    """1 + R (J - κ), added to ``jacobian`` of zeros.

    ``between`` ``(k, j d, j d)`` R; ``slopes`` ``(j, m, d, m d)`` J of the joints' forces, from
    which ``held`` κ is taken off at harmonic 0.
    """
    joints, size, directions, columns = slopes.shape
    for k in range(len(cosines)):
        cosine, sine = cosines[k], sines[k]
        for to in range(joints * directions):
            to_joint, to_direction = to // directions, to % directions
            row = (to_joint * size + cosine) * directions + to_direction
            other = (to_joint * size + sine) * directions + to_direction
            for joint in range(joints):
                first = joint * columns
                for direction in range(directions):
                    by = between[k, to, joint * directions + direction]
                    in_phase = slopes[joint, cosine, direction]
                    for c in range(columns):
                        jacobian[row, first + c] += by.real * in_phase[c]
                    if sine < 0:
                        jacobian[row, first + direction] -= by.real * held
                        continue
                    quadrature = slopes[joint, sine, direction]
                    for c in range(columns):
                        jacobian[row, first + c] += by.imag * quadrature[c]
                        jacobian[other, first + c] += (
                            by.real * quadrature[c] - by.imag * in_phase[c]
                        )
    for row in range(len(jacobian)):
        jacobian[row, row] += 1.0
