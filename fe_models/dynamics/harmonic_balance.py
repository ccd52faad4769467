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
from fe_models.dynamics.continuation import (
    Linearised,
    NewtonControl,
    Solution,
    StepControl,
    first_point,
    follow,
    solve,
)
from fe_models.dynamics.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.receptance import ComplexArray, Receptance, SteadyMotion
from sa_solver.types import Array

# Of rest under a constant load, as shares of what loads and joints do to the joints: a guess that
# Newton's method on all harmonics improves. More iterations mean that nothing closes.
REST_TOLERANCE, REST_ITERATIONS = 1e-10, 60
# First stiffness added to joints that hold nothing, over that of the structure they are held by.
SOFT = 1e-3
# Unknowns up to which a matrix is assembled and factorised; beyond, products with it are cheaper.
DENSE = 400
# Harmonics left out are looked for up to this multiple of the highest.
LOOK_BEYOND = 4


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
class Balance(Linearised):
    """The equations at one motion: the derivative ``by_force`` ``(n,)`` with respect to the force.

    ``cycle`` is what the joints do.
    """

    cycle: Cycle


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
    cycle: Cycle
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
    ) -> None:
        unknown = sorted(set(load.waves) - set(resolution.harmonics))
        still = load.static is not None and np.any(load.static)
        if unknown or (still and resolution.harmonics[0] != 0):
            raise HarmonicBalanceError(
                f"the load has harmonics {unknown or [0]} that the motion has not: add them"
            )
        self.model, self.joints, self.load, self.resolution = model, joints, load, resolution
        self.receptance = receptance or Receptance(model)
        self._directions = joints.directions
        self._joints = len(model.connection) // joints.directions
        self._orders = np.array(resolution.harmonics, dtype=float)
        self.held = self.receptance.held if resolution.harmonics[0] == 0 else 0.0
        self._wave = np.zeros((len(self._orders), len(model.mass)), dtype=complex)
        for harmonic, wave in load.waves.items():
            self._wave[resolution.harmonics.index(harmonic)] = wave @ self.receptance.at_points
        self._constant = np.zeros_like(self._wave)
        if still:
            self._constant[0] = load.static @ self.receptance.at_points

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
            if self._constant.any():
                unknowns[:, 0] = self._rest
            return unknowns.ravel()
        return self.resolution.adopt(start.coefficients, start.resolution).ravel()

    def find(
        self,
        frequency: float,
        force: float,
        unknowns: Array,
        control: StepControl | None = None,
    ) -> Solution[Balance]:
        """Newton's method from given unknowns; if it fails, from rest, by raising the force.

        A branch is followed for the latter, with the steps of ``control``. The equations of the
        solution are those with the frequency as parameter.
        """
        control = control or StepControl()
        newton = NewtonControl(control.tolerance)
        found = solve(self.by_frequency(force), unknowns, frequency, newton)
        if found.converged or force == 0.0:
            return found
        rising = self.by_force(frequency)
        still = solve(rising, self.guess(None), 0.0, newton)
        if not still.converged:
            return still
        point = first_point(still, 0.0, force > 0.0, control.first)
        span = -abs(force), abs(force)
        curve = follow(rising, point, span, control, origin=self.guess(None))
        if curve.message:
            return replace(found, message=f"raising the force from 0, {curve.message}")
        return solve(self.by_frequency(force), curve.points[-1].unknowns, frequency, newton)

    def describe(
        self, unknowns: Array, at: Balance, frequency: float, force: float, *, check: bool = False
    ) -> HarmonicSolution:
        """The motion with these unknowns; ``check`` it with twice the samples."""
        coefficients = self._shaped(unknowns)
        steady = self.receptance.at(2.0 * np.pi * frequency * self._orders)
        motion = self._modal_motion(steady, force, at.cycle, unknowns)
        shares = self.left_out(coefficients, at.cycle, frequency)
        return HarmonicSolution(
            frequency=frequency,
            force=force,
            resolution=self.resolution,
            coefficients=coefficients,
            motion=motion @ self.receptance.at_points.T,
            cycle=at.cycle,
            iterations=0,
            residual=at.relative,
            left_out=float(np.linalg.norm(shares)),
            sampling=self.sampling(unknowns, frequency, force) if check else None,
            message="",
        )

    def left_out(self, coefficients: Array, cycle: Cycle, frequency: float) -> Array:
        """Share of the joints' vibration that each harmonic 0, 1, 2, ... left out would have."""
        samples = len(cycle.samples)
        highest = min((samples - 1) // 2, max(LOOK_BEYOND * self.resolution.harmonics[-1], 9))
        spectrum = np.fft.rfft(cycle.samples.reshape(samples, -1), axis=0)[: highest + 1]
        spectrum *= 2.0 / samples
        spectrum[0] *= 0.5
        spectrum[list(self.resolution.harmonics)] = 0.0
        steady = self.receptance.at(2.0 * np.pi * frequency * np.arange(highest + 1.0))
        moved = steady.respond(spectrum @ self.receptance.at_joints)
        shares = np.linalg.norm(moved @ self.receptance.at_joints.T, axis=1)
        vibration = _vibration(coefficients, self.resolution)
        return shares / vibration if vibration > 0.0 else 0.0 * shares

    def sampling(self, unknowns: Array, frequency: float, force: float) -> float:
        """Change of the joints' vibration by twice the samples, to first order and relative."""
        vibration = _vibration(self._shaped(unknowns), self.resolution)
        if vibration == 0.0:
            return 0.0
        twice = self.refined(Resolution(self.resolution.harmonics, 2 * self.resolution.samples))
        at = twice.evaluate(unknowns, frequency, force, "frequency")
        change = solve_alone(at.jacobian, at.residual)
        return _vibration(self._shaped(change), self.resolution) / vibration

    def refined(self, resolution: Resolution) -> HarmonicBalance:
        """The same problem at another resolution."""
        return HarmonicBalance(self.model, self.joints, self.load, resolution, self.receptance)

    def _shaped(self, unknowns: Array) -> Array:
        return unknowns.reshape(self._joints, self.resolution.size, self._directions)

    def moved(self, steady: SteadyMotion, force: Array, unknowns: Array) -> ComplexArray:
        """Displacements of the modes ``(k, n)`` by joints that pull with ``force`` ``(j, m, d)``.

        It is their ``unknowns`` by which they are held at harmonic 0.
        """
        return steady.respond(self._pulled(force, unknowns))

    def _pulled(self, force: Array, unknowns: Array) -> ComplexArray:
        """Forces on the modes ``(k, n)``, with the opposite sign, of joints held at harmonic 0."""
        pull = self.resolution.amplitudes(force)
        if self.held:
            pull[0] -= self.held * self._shaped(unknowns)[:, 0].ravel()
        return np.asarray(pull @ self.receptance.at_joints)

    def _modal_motion(
        self, steady: SteadyMotion, force: float, cycle: Cycle, unknowns: Array
    ) -> ComplexArray:
        """Displacements of the modes ``(k, n)`` under the load and the joints' forces."""
        pulled = self._pulled(cycle.force, unknowns)
        return steady.respond(self._constant + force * self._wave - pulled)

    def evaluate(self, unknowns: Array, frequency: float, force: float, over: str) -> Balance:
        """The equations and their derivatives; ``over`` is what varies, frequency or force."""
        resolution = self.resolution
        coefficients = self._shaped(unknowns)
        cycle = self.joints.settle(
            coefficients, resolution.basis, resolution.weights, resolution.lead
        )
        steady = self.receptance.at(2.0 * np.pi * frequency * self._orders)
        motion = self._modal_motion(steady, force, cycle, unknowns)
        answer = self.at_joints(motion)
        products = _Jacobian(self, steady, cycle.jacobian)
        jacobian: Array | LinearMap = products.assembled() if self.size <= DENSE else products
        if over == "force":
            slope = -self.at_joints(steady.respond(self._wave))
        else:
            turned = steady.turned(motion) * (2.0 * np.pi * self._orders[:, None])
            slope = self.at_joints(steady.respond(turned))
        size = self._size(coefficients, answer, cycle)
        return Balance(unknowns - answer, jacobian, slope, size, cycle)

    def _size(self, coefficients: Array, answer: Array, cycle: Cycle) -> float:
        """Norm of the terms that balance.

        Where only joints hold the structure, any mean displacement balances that of the springs
        that hold it here: there the terms are what the forces themselves do.
        """
        if not self.held:
            return float(np.linalg.norm(coefficients) + np.linalg.norm(answer))
        moving = np.linalg.norm(coefficients[:, 1:])
        moving += np.linalg.norm(self._shaped(answer)[:, 1:])
        by_joints = np.linalg.norm(self.receptance.still_joints @ cycle.force[:, 0].ravel())
        return float(moving + by_joints + np.linalg.norm(self._loaded))

    @cached_property
    def _loaded(self) -> Array:
        """Mean displacement ``(j d,)`` of the joints under the load without them; held."""
        still = self.receptance.at(np.zeros(1)).respond(self._constant[:1])
        return np.asarray((still @ self.receptance.at_joints.T)[0].real)

    @cached_property
    def _rest(self) -> Array:
        """Displacement ``(j, d)`` of the joints at rest under the constant load, or a guess of it.

        Newton's method on that alone. Where joints are open, nothing may hold the structure: a
        spring added to each joint, ever softer, then lets it go as far as it must to close them.
        """
        compliance, held = self.receptance.still_joints, self.held
        one = np.ones((1, 1))
        displacement = np.zeros(len(compliance))
        softest = 1.0 / float(np.diagonal(compliance).mean())
        previous, added = np.inf, 10.0 * SOFT * softest
        for _ in range(REST_ITERATIONS):
            shaped = displacement.reshape(self._joints, 1, self._directions)
            cycle = self.joints.settle(shaped, one, one, one)
            force = cycle.force.ravel() - held * displacement
            residual = displacement - self._loaded + compliance @ force
            norm = float(np.linalg.norm(residual))
            by_joints = float(np.linalg.norm(compliance @ cycle.force.ravel()))
            if norm <= REST_TOLERANCE * (np.linalg.norm(self._loaded) + by_joints):
                break
            added = 0.1 * added if norm < previous else SOFT * softest
            previous = norm
            tangents = cycle.jacobian.reshape(self._joints, self._directions, self._directions)
            tangents = tangents + (added - held) * np.eye(self._directions)
            by_joint = compliance.reshape(len(compliance), self._joints, self._directions)
            product = np.einsum("pjd,jde->pje", by_joint, tangents)
            matrix = np.eye(len(compliance)) + product.reshape(compliance.shape)
            displacement = displacement - np.linalg.solve(matrix, residual)
        return displacement.reshape(self._joints, self._directions)

    def at_joints(self, motion: ComplexArray) -> Array:
        """Coefficients ``(j m d,)`` of the joints' displacements, of a motion of the modes."""
        moved = motion @ self.receptance.at_joints.T
        return self.resolution.coefficients(moved, self._directions).ravel()


@dataclass(frozen=True)
class _Jacobian:
    """1 + R (J - κ): what it does to a vector, and its assembly."""

    problem: HarmonicBalance
    steady: SteadyMotion
    slopes: Array

    def __matmul__(self, vector: Array) -> Array:
        problem, joints = self.problem, len(self.slopes)
        size = self.slopes.shape[1] * self.slopes.shape[2]
        by_joint = vector.reshape(joints, size, 1)
        force = (self.slopes.reshape(joints, size, size) @ by_joint).reshape(self.slopes.shape[:3])
        motion = problem.moved(self.steady, force, vector)
        return vector + problem.at_joints(motion)

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


def _vibration(coefficients: Array, resolution: Resolution) -> float:
    """Norm of coefficients ``(j, m, d)`` without the mean."""
    return float(np.linalg.norm(coefficients[:, int(resolution.harmonics[0] == 0) :]))


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
