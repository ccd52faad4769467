"""Periodic motion of a structure with joints under periodic forces, by harmonic balance.

    M x'' + C x' + K x = f(t) - Bᵀ F(B x),   f(t) = s + a Re Σ (w_k + (kω)² v_k) exp(ikωt)

The unknowns are the real Fourier coefficients of the joints' displacements u = B x. The structure
responds exactly, harmonic by harmonic, through its receptances R_k between joints (alternating
frequency-time method: Cameron and Griffin, J. Appl. Mech. 56, 1989, 149; condensation to the
joints: Petrov and Ewins, doi:10.1115/1.1539868). With the Fourier coefficients F_k of the joints'
forces, the equations are

    r_k = u_k - (displacement u_k due to the load without joint forces) + R_k F_k = 0.

This form has no stiff terms: its Jacobian 1 + R J is close to 1 where joints are soft, and of the
size of kt R where they are stiff.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_models.dynamics.curves.bordered import LinearMap
from fe_models.dynamics.curves.continuation import follow
from fe_models.dynamics.curves.curve_steps import ContinuationControl, first_point
from fe_models.dynamics.curves.newton import Equations, NewtonControl, NewtonSolution, solve
from fe_models.dynamics.curves.sizes import norm, relative_norm
from fe_models.dynamics.joint_rest import Rest
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.periodic.harmonic_jacobian import HarmonicJacobian
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray, HarmonicBalanceError, Resolution
from fe_models.dynamics.periodic.joints import Cycle, CycleRecord, PeriodicJoints
from fe_models.dynamics.periodic.load import PeriodicLoad as PeriodicLoad
from fe_models.dynamics.periodic.neglected import NeglectedHarmonics, examined
from fe_models.dynamics.periodic.receptance import Receptance, SteadyMotion
from fe_models.dynamics.rings.sector import CyclicSector
from fe_models.dynamics.rings.travelling_wave import WaveReceptance, transfer_of
from sa_solver import checks
from sa_solver.types import Array

# Largest number of unknowns for which the Jacobian is assembled and factorised. Beyond it, products
# with the Jacobian are cheaper. A sector in a travelling wave is always assembled, because these
# products are not implemented for it.
DENSE = 400
# Smallest number of samples per period of the highest harmonic, so that samples show corners of a
# joint force.
SAMPLES_PER_PERIOD = 8
# Relative rounding error of the difference of two numbers of one size.
EPSILON = float(np.finfo(float).eps)
# Share of the static displacements below which a vibration is rounding error, and counts as zero.
NO_VIBRATION = 1e-12


@dataclass(frozen=True)
class Balance:
    """Equations of harmonic balance at one motion: residual, and derivatives on demand.

    Parameters
    ----------
    problem, force
        The problem, and the force factor of its load.
    varies
        Name of the continuation parameter, ``frequency`` or ``force``.
    steady
        The structure at this frequency.
    on_modes, vibration
        Modal forces, and modal displacements without the mean, ``(k, n)``.
    cycle
        Response of the joints over one period.
    residual
        Residual r ``(n,)`` [mm].
    size, relative
        Norm of the terms that balance [mm], and norm of the residual over it.
    """

    problem: HarmonicBalance
    varies: str
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
        """Complex amplitudes ``(k, n)`` of the modal displacements."""
        return self.steady.respond(self.on_modes)

    @cached_property
    def jacobian(self) -> Array | LinearMap:
        """Jacobian ∂r/∂u ``(n, n)``: a matrix up to :data:`DENSE` unknowns, else products."""
        problem = self.problem
        products = HarmonicJacobian(
            problem.transfer, problem.rest, self.steady, self.cycle.jacobian
        )
        return (
            products.assembled()
            if problem.size <= DENSE or problem.is_travelling_wave
            else products
        )

    @cached_property
    def slope(self) -> Array:
        """Derivative ∂r/∂λ ``(n,)`` with respect to the continuation parameter."""
        problem, steady = self.problem, self.steady
        if self.varies == "force":
            wave = problem.wave_at(steady.angular)
            return -problem.transfer.at_joints(steady.respond(wave))
        forces = steady.stiffness_slope(self.vibration)
        if problem.load.inertial:
            forces -= self.force * (2.0 * steady.angular)[:, None] * problem.inertial
        forces *= problem.angular_per_hertz[:, None]
        return problem.transfer.at_joints(steady.vibrate(forces))


class HarmonicBalance:
    """Harmonic balance of a structure, its joints and a load, at one resolution.

    Parameters
    ----------
    model, joints, load
        The structure, its joint law and the periodic load.
    resolution
        Harmonics of the motion and samples of a period.
    receptance, rest
        Receptance of the structure and static equilibrium of the joints; computed if None.

    Raises
    ------
    HarmonicBalanceError
        If the load has harmonics that the resolution lacks, or numbers that are not finite.

    Examples
    --------
    Per period, the work of the force is the energy that the damping, π c ω X², and the joint
    dissipate:

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
        load.check(resolution, len(model.mass))
        self.model, self.joints, self.load, self.resolution = model, joints, load, resolution
        self.receptance = receptance or Receptance(model)
        self.transfer = transfer_of(resolution, self.receptance, joints.directions)
        self.harmonic_numbers = np.array(resolution.harmonics, dtype=float)
        # Angular frequencies [rad/s] per Hz: 2π k.
        self.angular_per_hertz = 2.0 * np.pi * self.harmonic_numbers
        # Modal forces (k, n): those proportional to the force, to force times squared frequency,
        # and the constant ones.
        self.wave, self.inertial = (self._on_modes(part) for part in (load.waves, load.inertial))
        self._constant = np.zeros_like(self.wave)
        if load.static is not None and np.any(load.static):
            self._constant[0] = load.static @ self.receptance.of(0).at_points
        self.rest = rest or Rest(model, self.receptance.of(0), joints, self._constant[0].real)
        self._extended: HarmonicBalance | None = None

    @classmethod
    def of_sector(
        cls,
        sector: CyclicSector,
        joints: PeriodicJoints,
        load: PeriodicLoad,
        resolution: Resolution,
    ) -> HarmonicBalance:
        """Return the problem of one sector in a wave that travels round its ring.

        The joints are those of one sector. The load is that of sector 0 on the sector's own
        unknowns, and travels round the ring with the wave.
        """
        return cls(sector.at(0), joints, load, resolution, WaveReceptance(sector))

    def _on_modes(self, waves: Mapping[int, ComplexArray]) -> ComplexArray:
        """Return modal amplitudes ``(k, n)`` for amplitudes on the structure, given by harmonic."""
        on_modes = np.zeros((len(self.harmonic_numbers), len(self.model.mass)), dtype=complex)
        for harmonic, wave in waves.items():
            row = self.resolution.harmonics.index(harmonic)
            on_modes[row] = self.transfer.load_on_modes(wave, row)
        return on_modes

    def wave_at(self, angular: Array) -> ComplexArray:
        """Return the modal load ``(k, n)`` per unit force.

        ``angular`` ``(k,)`` [rad/s] are the angular frequencies of the harmonics.
        """
        if not self.load.inertial:
            return self.wave
        return np.asarray(self.wave + np.square(angular)[:, None] * self.inertial)

    def first_wave(self, angular: Array) -> ComplexArray:
        """Return harmonic 1 of the modal load ``(f, n)`` per unit force.

        ``angular`` ``(f,)`` [rad/s] are angular frequencies of this harmonic.
        """
        first = self.resolution.harmonics.index(1)
        return np.asarray(self.wave[first] + np.square(angular)[:, None] * self.inertial[first])

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.transfer.size

    def by_frequency(self, force: float) -> Equations[Balance]:
        """Return the equations at a given force, with the frequency [Hz] as parameter."""
        return lambda unknowns, frequency: self.evaluate(unknowns, frequency, force, "frequency")

    def by_force(self, frequency: float) -> Equations[Balance]:
        """Return the equations at a given frequency [Hz], with the force as parameter."""
        return lambda unknowns, force: self.evaluate(unknowns, frequency, force, "force")

    def solve(
        self, frequency: float, force: float, start: HarmonicSolution | None = None
    ) -> HarmonicSolution:
        """Return the periodic motion at a frequency [Hz] and a force.

        Newton's method starts from a motion ``start``, or from the static equilibrium.
        """
        solution = self.find(frequency, force, self.guess(start))
        motion = self.describe(
            solution.unknowns, solution.at, frequency, force, solution.iterations
        )
        return replace(motion, message=solution.message)

    def guess(self, start: HarmonicSolution | None) -> Array:
        """Return unknowns adopted from another motion, or those of the static equilibrium."""
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
        """Solve for the unknowns by Newton's method, and by raising the force from 0 if that fails.

        The solution holds the equations with the frequency as parameter.

        Parameters
        ----------
        frequency, force
            Frequency [Hz] and force factor of the load.
        unknowns
            Initial guess ``(n,)`` for Newton's method.
        control
            Steps along which the force is raised, whose ``watch`` is not called.

        Raises
        ------
        HarmonicBalanceError
            If the frequency is not above zero, or if a number is not finite.
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
                message="no static equilibrium is found under the constant load, from which the "
                f"force could be raised: {unforced.message}, or give a load that does not pull all "
                "joints apart",
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
            return replace(direct, message=f"while the force was raised from 0, {curve.message}")
        return solve(self.by_frequency(force), curve.points[-1].unknowns, frequency, newton)

    def describe(
        self, unknowns: Array, at: Balance, frequency: float, force: float, iterations: int = 0
    ) -> HarmonicSolution:
        """Return the motion for given unknowns, at a frequency [Hz] and a force.

        ``at`` are the equations at the unknowns, to which ``iterations`` of Newton's method have
        led.
        """
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
        """Return the estimated share of each neglected harmonic in the joints' vibration.

        The shares are ordered by harmonic 0, 1, 2, ...; those of the kept harmonics are 0. They
        are estimates by :class:`NeglectedHarmonics`.
        """
        vibration = self.vibration(coefficients)
        if vibration == 0.0:
            return np.zeros(examined(self.resolution).harmonics[-1] + 1)
        return self._neglected.sizes(cycle.samples, frequency) / vibration

    @cached_property
    def _neglected(self) -> NeglectedHarmonics:
        structures = self.receptance, self.stuck
        return NeglectedHarmonics(self.resolution, structures, self.joints.directions)

    @property
    def is_travelling_wave(self) -> bool:
        """True if this is a sector in a wave that travels round its ring."""
        return isinstance(self.receptance, WaveReceptance)

    @property
    def uniform_receptance(self) -> Receptance:
        """Receptance of a structure that has the same modes in every harmonic.

        Raises :class:`HarmonicBalanceError` for a sector in a wave, whose modes differ between
        harmonics.
        """
        if isinstance(self.receptance, WaveReceptance):
            raise HarmonicBalanceError(
                "the modes of a sector differ between the harmonics of a wave: only its responses "
                "and phase resonances can be computed"
            )
        return self.receptance

    @property
    def stuck(self) -> Receptance | WaveReceptance:
        """Receptance of the structure with its joints as stiff as at rest."""
        if isinstance(self.receptance, WaveReceptance):
            return self.receptance.stuck(self.rest.stuck.tangents)
        return self.rest.stuck.stiffened

    @cached_property
    def rounding(self) -> float:
        """Norm [mm] of a vibration that is only rounding error of the mean displacements."""
        rest, loaded = self.rest.displacement, self.rest.loaded
        return NO_VIBRATION * float(np.linalg.norm(rest) + np.linalg.norm(loaded))

    def without_mean(self, unknowns: Array) -> Array:
        """Return the unknowns without those of the mean, in one row."""
        first = int(self.resolution.harmonics[0] == 0)
        return self.transfer.shaped(unknowns)[:, first:].ravel()

    def vibration(self, coefficients: Array) -> float:
        """Return the norm [mm] of coefficients ``(j, m, d)`` without the mean.

        It is 0 where it is only rounding error.
        """
        size = norm(self.without_mean(coefficients))
        return size if size > self.rounding else 0.0

    def with_resolution(self, resolution: Resolution) -> HarmonicBalance:
        """Return the same problem at another resolution."""
        return HarmonicBalance(
            self.model, self.joints, self.load, resolution, self.receptance, self.rest
        )

    def with_harmonics(self, harmonics: set[int]) -> HarmonicBalance:
        """Return the same problem with further harmonics, and at least twice the samples.

        The result is cached and contains the harmonics of all earlier calls.
        """
        known = () if self._extended is None else self._extended.resolution.harmonics
        if self._extended is None or not harmonics <= set(known):
            every = tuple(sorted({*self.resolution.harmonics, *known, *harmonics}))
            samples = 2 * self.resolution.samples
            while samples < SAMPLES_PER_PERIOD * every[-1]:
                samples *= 2
            self._extended = self.with_resolution(Resolution(every, samples))
        return self._extended

    def evaluate(
        self,
        unknowns: Array,
        frequency: float,
        force: float,
        varies: str,
        steady: SteadyMotion | None = None,
    ) -> Balance:
        """Evaluate the equations for given unknowns, at a frequency [Hz] and a force.

        ``varies`` names the continuation parameter, ``frequency`` or ``force``. ``steady`` is the
        structure at this frequency, if its damping differs from that of the model.
        """
        resolution = self.resolution
        coefficients = self.transfer.shaped(unknowns)
        cycle = self.joints.settle(
            coefficients, resolution.basis, resolution.weights, resolution.lead
        )
        steady = steady or self.transfer.steady(frequency * self.angular_per_hertz)
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
            # Bodies that only joints hold have no equilibrium once they have separated. If they are
            # far apart, rounding hides their residual.
            rounding = EPSILON * norm(coefficients[:, 0])
            relative = max(relative, rounding / size if size > 0.0 else 0.0)
        return Balance(
            self, varies, force, steady, on_modes, vibration, cycle, residual, size, relative
        )

    @cached_property
    def _mean_by_load(self) -> Array:
        """Mean displacements ``(2, j, d)`` due to the constant load, and per unit force."""
        at_rest = self.transfer.receptance
        loads = np.stack([self._constant[0].real, self.wave[0].real])
        means = np.stack([at_rest.respond_at_rest(load) for load in loads]) @ at_rest.at_joints.T
        return means.reshape(2, self.transfer.joints, -1)

    def _size(self, coefficients: Array, response: Array, cycle: Cycle) -> float:
        """Return the norm [mm] of the terms that balance, to which residuals are relative.

        Load and joint forces may cancel at rest: the mean displacements that each of them causes
        count separately. Where only joints hold the structure, its mean displacement does not
        count, because the auxiliary holding springs balance any value of it.
        """
        if not self.transfer.mean:
            return norm(coefficients) + norm(response)
        first = int(self.transfer.holding_stiffness > 0.0)
        size = norm(coefficients[:, first:]) + norm(self.transfer.shaped(response)[:, first:])
        by_joints = self.transfer.receptance.static_flexibility @ cycle.force[:, 0].ravel()
        return size + norm(by_joints) + norm(self.rest.loaded)
