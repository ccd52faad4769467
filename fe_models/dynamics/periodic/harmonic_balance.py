"""Periodic motion of a structure with joints under periodic forces, by its harmonics.

    M x'' + C x' + K x = f(t) - Bᵀ F(B x),   f(t) = s + a Re Σ (w_k + (kω)² v_k) exp(ikωt)

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

import numpy as np

from fe_models.dynamics.curves.bordered import LinearMap
from fe_models.dynamics.curves.continuation import first_point, follow
from fe_models.dynamics.curves.control import ContinuationControl
from fe_models.dynamics.curves.newton import NewtonControl, NewtonSolution, solve
from fe_models.dynamics.curves.sizes import norm, relative_norm
from fe_models.dynamics.joint_rest import Rest
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.periodic.harmonic_jacobian import HarmonicJacobian, HarmonicTransfer
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import (
    ComplexArray,
    HarmonicBalanceError,
    Resolution,
)
from fe_models.dynamics.periodic.joints import Cycle, CycleRecord, PeriodicJoints
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.periodic.receptance import Receptance, SteadyMotion
from fe_models.dynamics.rings.sector import CyclicSector
from fe_models.dynamics.rings.travelling_wave import WaveReceptance
from sa_solver import checks
from sa_solver.types import Array

# Unknowns up to which a matrix is assembled and factorised; beyond, products with it are cheaper,
# but for a sector in a wave, for which these are not written.
DENSE = 400
# Harmonics left out are looked for up to this multiple of the highest, and at least to this one.
LOOK_BEYOND, LOOK_AT_LEAST = 2, 63
# Samples per period of the highest harmonic, at least: a corner of a joint's force is then seen.
SAMPLES_PER_PERIOD = 8
# Between numbers of one size, what rounding hides of their difference.
EPSILON = float(np.finfo(float).eps)
# A vibration below this share of what balances in the mean is rounding: there is none.
NO_VIBRATION = 1e-12


@dataclass(frozen=True)
class Balance:
    """The equations at one motion: what is left of them ``(n,)``, and derivatives when asked for.

    ``over`` is what varies, frequency or ``force``; ``steady`` the structure at this frequency,
    ``on_modes`` ``(k, n)`` the forces on its modes, ``vibration`` ``(k, n)`` their motion without
    the mean, ``cycle`` what the joints do, ``size`` the norm of the terms that balance, and
    ``relative`` what is left over it.
    """

    problem: HarmonicBalance
    over: str
    force: float
    steady: SteadyMotion
    on_modes: ComplexArray
    vibration: ComplexArray
    cycle: Cycle
    residual: Array
    size: float
    relative: float

    @cached_property
    def motion(self) -> ComplexArray:
        """That of the modes ``(k, n)``."""
        return self.steady.respond(self.on_modes)

    @cached_property
    def jacobian(self) -> Array | LinearMap:
        """∂r/∂u ``(n, n)``, a matrix up to :data:`DENSE` unknowns."""
        problem = self.problem
        products = HarmonicJacobian(
            problem.transfer, problem.rest, self.steady, self.cycle.jacobian
        )
        return products.assembled() if problem.size <= DENSE or problem.travels else products

    @cached_property
    def slope(self) -> Array:
        """∂r/∂λ ``(n,)``."""
        problem, steady = self.problem, self.steady
        if self.over == "force":
            wave = problem.wave_at(steady.angular)
            return -problem.transfer.at_joints(steady.respond(wave))
        forces = steady.stiffness_slope(self.vibration)
        if problem.load.inertial:
            forces -= self.force * (2.0 * steady.angular)[:, None] * problem.inertial
        forces *= problem.turning[:, None]
        return problem.transfer.at_joints(steady.vibrate(forces))


class HarmonicBalance:
    """The balance of one structure, its joints and a load, at one resolution.

    Examples
    --------
    In a period the force does the work that damping and joint take, π c ω X² and its loop:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping_ratio=0.02)
    >>> load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    >>> law = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)
    >>> problem = HarmonicBalance(rig, PeriodicMarch(law), load, Resolution((1,), 1024))
    >>> motion = problem.solve(frequency=200.0, force=10.0)
    >>> x, omega = motion.amplitude(0), 400.0 * np.pi
    >>> work, damped = -10.0 * np.pi * x.real, np.pi * 0.04 * omega * abs(x) ** 2
    >>> print(f"{work:.3f} N mm of {damped:.3f} + {motion.cycle.dissipated[0]:.3f}")
    0.380 N mm of 0.067 + 0.313
    """

    def __init__(
        self,
        model: DynamicModel,
        joints: PeriodicJoints,
        load: PeriodicLoad,
        resolution: Resolution,
        receptance: Receptance | WaveReceptance | None = None,
        rest: Rest | None = None,
    ) -> None:
        missing = sorted(load.harmonics - set(resolution.harmonics))
        static = load.static is not None and np.any(load.static)
        if missing or (static and resolution.harmonics[0] != 0):
            raise HarmonicBalanceError(
                f"the load has harmonics {missing or [0]} that the motion has not: add them"
            )
        load.require(len(model.mass))
        self.model, self.joints, self.load, self.resolution = model, joints, load, resolution
        self.receptance = receptance or Receptance(model)
        self.transfer = _transfer(resolution, self.receptance, joints.directions)
        self.orders = np.array(resolution.harmonics, dtype=float)
        # 2π k: angular frequencies per Hz.
        self.turning = 2.0 * np.pi * self.orders
        # Forces on the modes (k, n): those that grow with the force, and the others.
        self.wave, self.inertial = (self._on_modes(part) for part in (load.waves, load.inertial))
        self._constant = np.zeros_like(self.wave)
        if load.static is not None and static:
            self._constant[0] = load.static @ self.receptance.of(0).at_points
        self.rest = rest or Rest(model, self.receptance.of(0), joints, self._constant[0].real)
        self._neglected = _neglected(resolution)
        self._richer: HarmonicBalance | None = None

    @classmethod
    def of_sector(
        cls,
        sector: CyclicSector,
        joints: PeriodicJoints,
        load: PeriodicLoad,
        resolution: Resolution,
    ) -> HarmonicBalance:
        """That of a sector in a wave that travels round its ring, under a load that does.

        ``load`` is that of sector 0 on its own unknowns, ``joints`` are of one sector.
        """
        return cls(sector.at(0), joints, load, resolution, WaveReceptance(sector))

    def _on_modes(self, waves: Mapping[int, ComplexArray]) -> ComplexArray:
        """Amplitudes on the modes ``(k, n)`` of those on the structure, by harmonic."""
        on_modes = np.zeros((len(self.orders), len(self.model.mass)), dtype=complex)
        for harmonic, wave in waves.items():
            row = self.resolution.harmonics.index(harmonic)
            on_modes[row] = self.transfer.load_on_modes(wave, row)
        return on_modes

    def wave_at(self, angular: Array) -> ComplexArray:
        """The force on the modes ``(k, n)`` at angular frequencies ``(k,)`` of its harmonics."""
        if not self.load.inertial:
            return self.wave
        return np.asarray(self.wave + np.square(angular)[:, None] * self.inertial)

    def first_wave(self, angular: Array) -> ComplexArray:
        """Harmonic 1 of the force on the modes ``(f, n)`` at angular frequencies ``(f,)``."""
        first = self.resolution.harmonics.index(1)
        return np.asarray(self.wave[first] + np.square(angular)[:, None] * self.inertial[first])

    @property
    def size(self) -> int:
        """Unknowns."""
        return self.transfer.size

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
        solution = self.find(frequency, force, self.guess(start))
        motion = self.describe(
            solution.unknowns, solution.at, frequency, force, solution.iterations
        )
        return replace(motion, message=solution.message)

    def guess(self, start: HarmonicSolution | None) -> Array:
        """Unknowns taken from another motion, or those of the structure at rest under its load."""
        if start is None:
            unknowns = self.transfer.shaped(np.zeros(self.size))
            if self.transfer.mean:
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

        A branch is followed for the latter, with the steps of ``control``; its ``watch``, who looks
        at another curve, is told nothing of it. The equations of the
        solution are those with the frequency as parameter. Raises :class:`HarmonicBalanceError` for
        a frequency that is not above zero, and for numbers that are not finite.
        """
        checks.number("frequency", frequency, above=0.0, error=HarmonicBalanceError)
        checks.number("force", force, error=HarmonicBalanceError)
        control = replace(control or ContinuationControl(), watch=lambda parameter: None)
        newton = NewtonControl(control.tolerance)
        direct = solve(self.by_frequency(force), unknowns, frequency, newton)
        if direct.converged or force == 0.0:
            return direct
        rising = self.by_force(frequency)
        unforced = solve(rising, self.guess(None), 0.0, newton)
        if not unforced.converged:
            return replace(
                unforced,
                message="there is no rest under the constant load, from which the force could be "
                f"raised: {unforced.message}, or give a load that does not pull all joints apart",
            )
        point = first_point(unforced, 0.0, force > 0.0, control.first)
        curve = follow(
            rising,
            point,
            (min(force, 0.0), max(force, 0.0)),
            control,
            origin=self.guess(None),
            rounding=self.rounding,
            end=force,
        )
        if curve.message:
            return replace(direct, message=f"raising the force from 0, {curve.message}")
        return solve(self.by_frequency(force), curve.points[-1].unknowns, frequency, newton)

    def describe(
        self, unknowns: Array, at: Balance, frequency: float, force: float, iterations: int = 0
    ) -> HarmonicSolution:
        """The motion with these unknowns, found in so many iterations."""
        coefficients, record = self.transfer.shaped(unknowns), CycleRecord.of(at.cycle)
        return HarmonicSolution(
            frequency=frequency,
            force=force,
            resolution=self.resolution,
            coefficients=coefficients,
            motion=self.transfer.displacement(at.motion),
            cycle=record,
            iterations=iterations,
            residual=at.relative,
            shares=self.left_out(coefficients, record, frequency),
            error=None,
            message="",
        )

    def left_out(self, coefficients: Array, cycle: CycleRecord, frequency: float) -> Array:
        """Share of the joints' vibration that each harmonic 0, 1, 2, ... left out would have.

        The larger of what the joints' forces there cause with joints free, and as stiff as at rest:
        a harmonic may meet a mode of either.
        """
        neglected, vibration = self._neglected, self.vibration(coefficients)
        shares = np.zeros(neglected.harmonics[-1] + 1)
        if vibration == 0.0:
            return shares
        force = (neglected.weights @ cycle.samples.reshape(neglected.samples, -1)).reshape(
            neglected.size, -1, self.joints.directions
        )
        orders, sizes = self._orders_left_out, []
        for transfer in self._left_out_by:
            steady = transfer.steady(2.0 * np.pi * frequency * orders)
            motion = steady.respond(transfer.modal(force.transpose(1, 0, 2)))
            sizes.append(neglected.sizes(transfer.shaped(transfer.at_joints(motion))))
        shares[orders] = np.maximum(*sizes)
        shares[list(self.resolution.harmonics)] = 0.0
        shares /= vibration
        return shares

    @cached_property
    def _orders_left_out(self) -> np.ndarray:
        return np.array(self._neglected.harmonics)

    @cached_property
    def _left_out_by(self) -> tuple[HarmonicTransfer, ...]:
        """What harmonics left out do with joints free, and as stiff as at rest."""
        structures = self.receptance, self.stuck
        directions = self.joints.directions
        return tuple(_transfer(self._neglected, of, directions) for of in structures)

    @property
    def travels(self) -> bool:
        """Whether this is a sector in a wave that travels round its ring."""
        return isinstance(self.receptance, WaveReceptance)

    @property
    def alone(self) -> Receptance:
        """The structure, with the same modes in every harmonic.

        Raises :class:`HarmonicBalanceError` for a sector in a wave, which has not.
        """
        if isinstance(self.receptance, WaveReceptance):
            raise HarmonicBalanceError(
                "a sector has other modes in every harmonic of a wave: only its responses and "
                "phase resonance are found"
            )
        return self.receptance

    @property
    def stuck(self) -> Receptance | WaveReceptance:
        """The structure with joints as stiff as at rest."""
        if isinstance(self.receptance, WaveReceptance):
            return self.receptance.stuck(self.rest.stuck.tangents)
        return self.rest.stuck.stiffened

    @cached_property
    def rounding(self) -> float:
        """Norm of unknowns that only rounding leaves of what balances in the mean [mm]."""
        rest, loaded = self.rest.displacement, self.rest.loaded
        return NO_VIBRATION * float(np.linalg.norm(rest) + np.linalg.norm(loaded))

    def vibrating(self, unknowns: Array) -> Array:
        """Unknowns without those of the mean, in one row."""
        first = int(self.resolution.harmonics[0] == 0)
        return self.transfer.shaped(unknowns)[:, first:].ravel()

    def vibration(self, coefficients: Array) -> float:
        """Norm of coefficients ``(j, m, d)`` without the mean [mm], 0 where it is rounding."""
        size = norm(self.vibrating(coefficients))
        return size if size > self.rounding else 0.0

    def refined(self, resolution: Resolution) -> HarmonicBalance:
        """The same problem at another resolution."""
        return HarmonicBalance(
            self.model, self.joints, self.load, resolution, self.receptance, self.rest
        )

    def richer(self, harmonics: set[int]) -> HarmonicBalance:
        """The same problem with these harmonics too, and at least twice the samples.

        It is kept, and grows with what is asked for.
        """
        known = () if self._richer is None else self._richer.resolution.harmonics
        if self._richer is None or not harmonics <= set(known):
            every = tuple(sorted({*self.resolution.harmonics, *known, *harmonics}))
            samples = 2 * self.resolution.samples
            while samples < SAMPLES_PER_PERIOD * every[-1]:
                samples *= 2
            self._richer = self.refined(Resolution(every, samples))
        return self._richer

    def evaluate(
        self,
        unknowns: Array,
        frequency: float,
        force: float,
        over: str,
        steady: SteadyMotion | None = None,
    ) -> Balance:
        """The equations; ``over`` is what varies in their derivatives, frequency or force.

        ``steady`` is the structure at this frequency, if it is damped otherwise than it is.
        """
        resolution = self.resolution
        coefficients = self.transfer.shaped(unknowns)
        cycle = self.joints.settle(
            coefficients, resolution.basis, resolution.weights, resolution.lead
        )
        steady = steady or self.transfer.steady(frequency * self.turning)
        on_modes = self._constant + force * self.wave_at(steady.angular)
        on_modes -= self.transfer.on_modes(cycle.force, unknowns)
        vibration = steady.vibrate(on_modes)
        response = self.transfer.at_joints(vibration)
        if self.transfer.mean:
            response -= self.transfer.mean_response(cycle.force, unknowns)
            constant, growing = self._mean_by_load
            self.transfer.shaped(response)[:, 0] += constant + force * growing
        size = self._size(coefficients, response, cycle)
        residual = unknowns - response
        relative = relative_norm(residual, size)
        if self.transfer.mean:
            # Bodies that only joints hold and that have left each other have no balance: far apart,
            # rounding hides what is left of it.
            hidden = EPSILON * norm(coefficients[:, 0])
            relative = max(relative, hidden / size if size > 0.0 else 0.0)
        return Balance(
            self, over, force, steady, on_modes, vibration, cycle, residual, size, relative
        )

    @cached_property
    def _mean_by_load(self) -> Array:
        """Mean displacement ``(2, j, d)`` of the joints by the load alone, constant and growing."""
        at_rest = self.transfer.receptance
        loads = np.stack([self._constant[0].real, self.wave[0].real])
        means = np.stack([at_rest.respond_at_rest(load) for load in loads]) @ at_rest.at_joints.T
        return means.reshape(2, self.transfer.joints, -1)

    def _size(self, coefficients: Array, response: Array, cycle: Cycle) -> float:
        """Norm of the terms that balance.

        Load and joints may cancel at rest: what each does to the mean displacement counts. Where
        only joints hold the structure, any mean displacement balances that of the springs that
        hold it here, and does not count.
        """
        if not self.transfer.mean:
            return norm(coefficients) + norm(response)
        first = int(self.transfer.held > 0.0)
        size = norm(coefficients[:, first:]) + norm(self.transfer.shaped(response)[:, first:])
        by_joints = self.transfer.receptance.static_flexibility @ cycle.force[:, 0].ravel()
        return size + norm(by_joints) + norm(self.rest.loaded)


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


def _transfer(
    resolution: Resolution, receptance: Receptance | WaveReceptance, directions: int
) -> HarmonicTransfer:
    """Between joints and modes: of a sector, those of every harmonic."""
    if isinstance(receptance, WaveReceptance):
        return receptance.transfer(resolution, directions)
    return HarmonicTransfer(resolution, receptance, directions)


def _neglected(resolution: Resolution) -> Resolution:
    """Harmonics that are left out, as far as they are looked for, and the highest that is not."""
    kept = resolution.harmonics
    highest = min((resolution.samples - 1) // 2, max(LOOK_BEYOND * kept[-1], LOOK_AT_LEAST))
    others = set(range(highest + 1)).difference(kept[:-1])
    return Resolution(tuple(sorted(others)), resolution.samples)
