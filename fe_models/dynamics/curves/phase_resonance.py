"""Phase resonance of a structure with joints: the backbone curve of its forced responses.

At phase resonance the first harmonic of a displacement lags that of the force by a quarter of a
period. Let x be that displacement as a complex amplitude relative to the force (its real part in
phase with the force). Then one equation is added for one more unknown, the frequency:

    cot(phase of x) = Re x / Im x = 0.

The cotangent is used because it is linear in the frequency near the resonance of a mode, however
small its damping, whereas Re x itself turns back within the half-power bandwidth. By default the
output is the displacement wᴴ x of the force's own points, with the complex amplitudes w of the
force. At phase resonance all power of the force's first harmonic is then active power (Peter and
Leine, Mech. Syst. Signal Process. 96, 2017, 139, doi:10.1016/j.ymssp.2017.04.011).

The unknowns are those of harmonic balance and ln(f / f0). The latter is multiplied by the norm of
the joints' vibration at the start, so that both have comparable sizes. The structure's matrices are
symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from fe_models.dynamics.curves.bordered import Bordered, LinearMap
from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.followed_curve import FollowedCurve
from fe_models.dynamics.curves.forced_response import Motions, ResponseBranch
from fe_models.dynamics.curves.motion_recorder import Accuracy, MotionRecorder
from fe_models.dynamics.curves.sizes import limited_frequency
from fe_models.dynamics.periodic.harmonic_balance import Balance, HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import ComplexArray, HarmonicBalanceError
from fe_models.dynamics.periodic.receptance import SteadyMotion
from sa_solver import checks
from sa_solver.steps import COMPUTED, Steps
from sa_solver.types import Array

# Tolerance for the points of a force to act in phase or in antiphase.
SAME_PHASE = 1e-9


@dataclass(frozen=True)
class PhaseBalance:
    """Equations of phase resonance at one motion, and their derivatives on demand.

    Parameters
    ----------
    equations
        The equations.
    balance
        The harmonic balance of the motion, with the frequency as parameter.
    frequency
        Frequency [Hz] of the motion.
    output
        Complex output displacement x of the motion; see the module.
    """

    equations: PhaseResonance
    balance: Balance
    frequency: float
    output: complex

    @property
    def cotangent(self) -> float:
        """Cotangent of the phase; infinite if the force does no work."""
        return self.output.real / self.output.imag if self.output.imag else np.inf

    @cached_property
    def residual(self) -> Array:
        return np.append(self.balance.residual, self.equations.scale * self.cotangent)

    @property
    def size(self) -> float:
        """Norm of the terms of the harmonic balance."""
        return self.balance.size

    @cached_property
    def relative(self) -> float:
        """Relative residual of the harmonic balance and the cotangent together."""
        residual = float(np.hypot(self.balance.relative, self.cotangent))
        return residual if np.isfinite(residual) else np.inf

    @cached_property
    def jacobian(self) -> Array | LinearMap:
        """Jacobian ∂r/∂u ``(n + 1, n + 1)``, a matrix if that of the harmonic balance is one."""
        scale, inner = self.equations.scale, self.balance.jacobian
        hertz_per_unknown = self.frequency / scale
        by_frequency = complex(
            self._steady.stiffness_slope(self._first_harmonic)[0] @ self._output_by_forces
        )
        corner = -2.0 * np.pi * hertz_per_unknown * self._change_of_phase(by_frequency)
        row = np.append(self._change_of_phase(self._output_by_unknowns), corner)
        bordered = Bordered(inner, self.balance.slope * hertz_per_unknown, row)
        return bordered.assembled() if isinstance(inner, np.ndarray) else bordered

    @cached_property
    def slope(self) -> Array:
        """Derivative ∂r/∂a ``(n + 1,)`` with respect to the force."""
        by_force = replace(self.balance, varies="force").slope
        wave = self.equations.problem.wave[self.equations.first]
        return np.append(by_force, self._change_of_phase(complex(wave @ self._output_by_forces)))

    def _change_of_phase(self, change: ComplexArray | complex) -> Array:
        """Return the change of the last equation for a change of x."""
        cotangent = np.real(change) - self.cotangent * np.imag(change)
        return np.asarray(self.equations.scale * cotangent / self.output.imag)

    @property
    def _first_harmonic(self) -> ComplexArray:
        """Modal displacements at harmonic 1 ``(1, n)``."""
        return self.balance.motion[self.equations.first][None]

    @cached_property
    def _steady(self) -> SteadyMotion:
        """Structure at harmonic 1."""
        first = self.equations.problem.receptance.of(1)
        return first.at(np.array([2.0 * np.pi * self.frequency]))

    @cached_property
    def _output_by_forces(self) -> ComplexArray:
        """Derivative ``(n,)`` of x with respect to modal forces."""
        return np.asarray(self._steady.per_force(self.equations.output_by_modes[None])[0])

    @property
    def _output_by_unknowns(self) -> ComplexArray:
        """Derivative ``(n,)`` of x with respect to the unknowns, through the joints' forces."""
        problem, first = self.equations.problem, self.equations.first
        by_joint = problem.receptance.of(1).at_joints.conj() @ self._output_by_forces
        cosine, sine = (places[first] for places in problem.resolution.places)
        slopes = self.balance.cycle.jacobian
        by_motion = slopes[:, cosine] - 1j * slopes[:, sine]
        by_joint = by_joint.reshape(-1, problem.joints.directions)
        return np.asarray(-np.einsum("jd,jdme->jme", by_joint, by_motion).ravel())


@dataclass(frozen=True)
class Backbone(Motions):
    """Phase resonances from the lowest force on; the curve may turn back in force.

    Parameters
    ----------
    solutions
        The motions.
    message
        Empty if the curve reaches both ends of the forces, else the reason why not.
    problem
        The problem at the resolution of the last motion found at increasing force.
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
    """Follow the phase resonances of a structure over a range of forces, past folds.

    If ``start`` is a response, the curve starts where the response passes through phase resonance
    with the largest displacement. Newton's method finds the phase resonance under that force, from
    which the curve is followed in both directions.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    start
        A response that passes through phase resonance, or a motion near it, such as a peak.
    forces
        Lowest and highest force factor, including that of the start.
    output
        Combination ``(n,)`` of the structure's displacements whose phase counts; that of the
        force's own points if None.
    control
        Control of the steps.
    accuracy
        Accuracy of the motions; if None, the resolution is that of the problem.
    steps
        Runner of the steps, each of which finds one motion; see :class:`sa_solver.steps.Steps`.

    Raises
    ------
    HarmonicBalanceError
        If the load has no first harmonic, if the output is zero or refers to a force of several
        phases, or if the forces are not above zero or do not include that of the start.

    Examples
    --------
    At phase resonance damping and joint dissipate the work of the force, F = c ω X + E / π X:

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
            (),
            "the response does not pass through phase resonance: give one with its peak",
            problem,
        )
    if not 0.0 < low <= nearest.force <= high:
        raise HarmonicBalanceError(
            f"forces from {low:g} to {high:g} do not suit a start at {nearest.force:g}: give two "
            "above 0 that include the start's"
        )
    if nearest.message:
        return Backbone((), f"the start is not a solution: {nearest.message}", problem)
    control = control or ContinuationControl()
    curve = curve_by_phase(problem, nearest, output)
    recorder = MotionRecorder(curve, accuracy)
    first = recorder.find_first(curve.unknowns_of(nearest), nearest.force, True, control, steps)
    if isinstance(first, str):
        message = (
            f"no phase resonance is found under {nearest.force:g} N from {nearest.frequency:.6g} "
            f"Hz: {first}, such as one nearer to the peak of the response"
        )
        return Backbone((), message, problem)
    halves, messages = [], []
    for end, point, name in ((low, first.turned(), "decreasing"), (high, first, "increasing")):
        half = MotionRecorder(recorder.curve, accuracy)
        if nearest.force != end:
            followed = half.follow(point, forces, control, steps, end)
            if followed.message:
                messages.append(f"at {name} force, {followed.message}")
        halves.append(half)
    below, above = halves
    return Backbone(
        (*reversed(below.solutions), *recorder.solutions, *above.solutions),
        "; ".join(messages),
        above.curve.problem,
    )


def nearest_to_phase(branch: ResponseBranch, weights: ComplexArray) -> HarmonicSolution | None:
    """Return the motion of a branch nearest to where it passes through phase resonance, or None.

    If the branch passes several times, the passage with the largest displacement wᴴ x counts, with
    ``weights`` w ``(n,)``. Between two resonances there is one too, with a small displacement.
    """
    outputs = [
        complex(np.vdot(weights, solution.motion[solution.resolution.harmonics.index(1)]))
        for solution in branch.solutions
    ]
    passing = [
        (abs(before) + abs(after), index)
        for index, (before, after) in enumerate(pairwise(outputs))
        if before.real * after.real <= 0.0 < before.imag * after.imag
    ]
    if not passing:
        return None
    _, index = max(passing)
    cotangents = [abs(x.real / x.imag) for x in outputs[index : index + 2]]
    return branch.solutions[index + int(np.argmin(cotangents))]


@dataclass(frozen=True)
class PhaseResonance:
    """Equations for the unknowns of a harmonic balance and ``scale`` · ln(f / ``frequency``).

    The force is their parameter.

    Parameters
    ----------
    problem
        The problem of harmonic balance.
    weights
        Weights w ``(n,)`` of the output wᴴ x of the structure's amplitudes x.
    frequency
        Reference frequency [Hz].
    scale
        Norm of the joints' vibration at the start [mm].
    """

    problem: HarmonicBalance
    weights: ComplexArray
    frequency: float
    scale: float

    @classmethod
    def near(
        cls, problem: HarmonicBalance, start: HarmonicSolution, output: Array | None = None
    ) -> PhaseResonance:
        """Return the equations near a motion; see :func:`along_phase_resonance`."""
        vibration = problem.guess(start) - problem.guess(None)
        # If no joint moves, there is no scale for the frequency.
        scale = float(np.linalg.norm(vibration)) or 1.0
        return cls(problem, _weights(problem, output), start.frequency, scale)

    @cached_property
    def first(self) -> int:
        """Row of harmonic 1."""
        return self.problem.resolution.harmonics.index(1)

    @cached_property
    def output_by_modes(self) -> ComplexArray:
        """Derivative ``(n,)`` of x with respect to the modal amplitudes at harmonic 1."""
        return np.asarray(self.weights.conj() @ self.problem.receptance.of(1).at_points)

    def frequency_of(self, unknowns: Array) -> float:
        """Return the frequency [Hz] that the unknowns stand for."""
        return limited_frequency(self.frequency, unknowns[-1] / self.scale)

    def unknown_of(self, frequency: float) -> float:
        """Return the unknown that stands for a frequency [Hz]."""
        return float(self.scale * np.log(frequency / self.frequency))

    def __call__(self, unknowns: Array, parameter: float) -> PhaseBalance:
        frequency = self.frequency_of(unknowns)
        balance = self.problem.evaluate(unknowns[:-1], frequency, parameter, "frequency")
        output = complex(self.output_by_modes @ balance.motion[self.first])
        return PhaseBalance(self, balance, frequency, output)


def curve_by_phase(
    problem: HarmonicBalance, near: HarmonicSolution, output: Array | None = None
) -> FollowedCurve[PhaseBalance]:
    """Return the curve of phase resonances, with the force as parameter.

    The motion ``near`` the curve sets the reference of the unknown frequency. For ``output`` see
    :func:`along_phase_resonance`.
    """
    return _phase_curve(PhaseResonance.near(problem, near, output))


def _phase_curve(equations: PhaseResonance) -> FollowedCurve[PhaseBalance]:
    problem = equations.problem

    def unknowns_of(motion: HarmonicSolution) -> Array:
        return np.append(problem.guess(motion), equations.unknown_of(motion.frequency))

    def motion_of(unknowns: Array, force: float, at: PhaseBalance) -> HarmonicSolution:
        return problem.describe(unknowns[:-1], at.balance, at.frequency, force)

    return FollowedCurve(
        problem,
        equations,
        np.append(problem.guess(None), 0.0),
        unknowns_of,
        lambda motion: motion.force,
        motion_of,
        lambda finer: _phase_curve(replace(equations, problem=finer)),
    )


def _weights(problem: HarmonicBalance, output: Array | None) -> ComplexArray:
    """Return the weights ``(n,)`` whose product wᴴ x is the output displacement."""
    if problem.load.inertial:
        raise HarmonicBalanceError(
            "a load that changes with the frequency has no phase resonance under a force: give a "
            "force or an acceleration that does not"
        )
    wave = problem.load.waves.get(1)
    if wave is None or not np.any(wave):
        raise HarmonicBalanceError(
            "the load has no harmonic 1 to which a phase could be relative: give one"
        )
    if output is None:
        return np.asarray(wave, dtype=complex)
    output = checks.complex_array("outputs", output, None, error=HarmonicBalanceError)
    if output.shape != wave.shape or not np.any(output):
        raise HarmonicBalanceError(
            f"the output displacement has shape {output.shape}: give a combination, not zero, "
            f"of the {len(wave)} displacements of the structure"
        )
    largest = wave[np.argmax(np.abs(wave))]
    turn = largest / abs(largest)
    if np.abs((wave * np.conj(turn)).imag).max() > SAME_PHASE * abs(largest):
        raise HarmonicBalanceError(
            "the force has several phases, so that no displacement lags all of it by a quarter of "
            "a period: leave out the output"
        )
    return np.asarray(turn * output)
