"""Harmonic balance against two time integrators that do not use harmonics.

A steady motion is a fixed point of the map of a state over one period. The fixed point is found
directly, however long a ring-down takes: at a damping ratio of 0.001 it takes thousands of periods.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from fe_models.dynamics.excitation import CombinedForces, HarmonicForce, RecordedForce
from fe_models.dynamics.motion import Start
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from tests.fe_models.dynamics.harmonic_rigs import rig
from tests.marks import slow
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import SEPARATED, SLIP, STICK, PeriodicMarch

KT, MU, LOAD = 45e3, 0.88, 60.0
JENKINS = Jenkins(KT, MU, LOAD)
SAMPLES = 256  # at which motions are compared
PERIODS = 6  # from rest, before a fixed point is looked for
SETTLED = 1e-10  # change in a period of a fixed point, over the largest of a state
WANTED = 1e-4  # agreement of the motions, over the largest displacement


def fixed_point(period, state):
    """Return the state ``(n,)`` that a period maps to itself, by Newton's method.

    A derivative is reused while a step with it leaves at most a twentieth of the change.
    """
    moving, slopes, before = np.flatnonzero(state), None, np.inf
    for _ in range(40):
        end = period(state)
        size = np.abs(end - state).max()
        if size <= SETTLED * np.abs(state).max():
            return state
        if slopes is None or size > 0.05 * before:
            slopes = np.array([slope(period, state, end, place)[moving] for place in moving]).T
        before, state = size, state.copy()
        state[moving] -= np.linalg.solve(slopes - np.eye(len(moving)), (end - state)[moving])
    raise AssertionError(f"no fixed point: a period still changes it by {size:g}")


def slope(period, state, end, place):
    """Return the derivative of the end of a period by one number of its initial state."""
    step = np.zeros(len(state))
    step[place] = 1e-6 * abs(state[place])
    return (period(state + step) - end) / step[place]


@dataclass(frozen=True)
class ExactPeriod:
    """One period of a rig with a Jenkins joint, integrated from event to event.

    A state consists of displacements, velocities over ω, and the position of the slider.
    """

    model: object
    force: HarmonicForce

    def motion(self, state, parts=1):
        size, length = len(self.model.mass), 1.0 / self.force.frequency
        sliders = SliderJoints(np.array([KT]), np.array([MU * LOAD]), np.zeros(1))
        speed = 2.0 * np.pi * self.force.frequency
        start = Start(state[:size], speed * state[size:-1], state[-1:, None])
        return integrate_exactly(self.model, sliders, self.force, length, length / parts, start)

    def __call__(self, state):
        return self.packed(self.motion(state))

    def packed(self, motion):
        speed = 2.0 * np.pi * self.force.frequency
        return np.concatenate(
            [motion.displacement[-1], motion.velocity[-1] / speed, motion.joint_state[:, 0]]
        )

    def steady(self):
        """Return the steady motion at :data:`SAMPLES` times, and the energy lost in a period."""
        state = np.zeros(2 * len(self.model.mass) + 1)
        for _ in range(PERIODS):
            state = self(state)
        motion = self.motion(fixed_point(self, state), SAMPLES)
        return motion.displacement[:-1], motion.energies.joints[-1].sum()


@dataclass(frozen=True)
class NewmarkPeriod:
    """One period in a number of steps of average acceleration, with one joint.

    A state consists of displacements, velocities over ω, and the stretch of the joint's tangential
    springs.
    """

    model: object
    law: object
    excitation: object
    frequency: float
    steps: int

    def motion(self, state, every):
        size, speed = len(self.model.mass), 2.0 * np.pi * self.frequency
        apart = self.model.connection @ state[:size]
        stretch = state[2 * size :]
        # The state of a slider is its position and stretch, that of a contact its stretch and
        # approach.
        joint = [*stretch, apart[2]] if len(stretch) == 2 else [apart[0], *stretch]
        start = Start(state[:size], speed * state[size : 2 * size], np.array([joint]))
        return integrate(
            self.model,
            self.law,
            self.excitation,
            1.0 / self.frequency,
            TimeStepControl(1.0 / self.frequency / self.steps, every=every),
            start,
        )

    def __call__(self, state):
        motion = self.motion(state, self.steps)
        assert motion.converged, motion.message
        joint = motion.joint_state[0]
        stretch = joint[:2] if self.law.directions == 3 else joint[1:]
        speed = 2.0 * np.pi * self.frequency
        return np.concatenate([motion.displacement[-1], motion.velocity[-1] / speed, stretch])


def newmark_steady(periods, state=None):
    """Return states, steady motions and energies lost per period of ever finer periods.

    The iteration starts from rest, or from a ``state``.
    """
    if state is None:
        size = 2 * len(periods[0].model.mass)
        state = np.zeros(size + max(periods[0].law.directions - 1, 1))
        for _ in range(PERIODS):
            state = periods[0](state)
    steady = []
    for period in periods:
        state = fixed_point(period, state)
        motion = period.motion(state, period.steps // SAMPLES)
        steady.append((state, motion.displacement[:-1], motion.energies.joints[-1].sum()))
    return steady


def extrapolated(coarse, fine):
    """Return the extrapolation that removes the error of second order in the step."""
    return (4.0 * fine - coarse) / 3.0


def furthest(one, other):
    """Return the largest difference of motions ``(t, n)``, relative to each displacement."""
    return (np.abs(one - other).max(axis=0) / np.abs(other).max(axis=0)).max()


def odd_balance(model, highest, samples):
    load = PeriodicLoad({1: -1j * unit_force(model, "m1")})
    harmonics = tuple(range(1, highest + 1, 2))
    return HarmonicBalance(model, PeriodicMarch(JENKINS), load, Resolution(harmonics, samples))


# --- One Jenkins joint


@pytest.mark.parametrize(
    ("ratio", "frequency", "force", "highest"),
    [
        slow(0.001, 150.0, 40.0, 63),
        (0.02, 150.0, 40.0, 63),
        (0.001, 240.0, 200.0, 31),
        # The second mode, at 2478 Hz with the joint free, is close to harmonic 63.
        slow(0.02, 39.0, 60.0, 91),
    ],
)
def test_jenkins_rig_is_the_fixed_point_of_event_driven_integration(
    ratio, frequency, force, highest
):
    model = rig(ratio)
    wanted, lost = ExactPeriod(
        model, HarmonicForce(unit_force(model, "m1"), force, frequency)
    ).steady()
    solution = odd_balance(model, highest, 4096).solve(frequency, force)
    assert solution.converged
    assert {STICK, SLIP} == set(np.unique(solution.cycle.states))
    assert furthest(solution.displacement(SAMPLES), wanted) <= WANTED
    assert solution.cycle.dissipated[0] == pytest.approx(lost, rel=WANTED)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.001, 0.02])
def test_error_falls_with_the_third_power_of_the_harmonics(ratio):
    """The slope of the joint's force jumps where slip begins: its harmonics fall as k⁻².

    Those of the displacement then fall as k⁻⁴ above the second mode, here at harmonic 17, and the
    sum of the neglected ones as k⁻³. These harmonics show an order of 3.4.
    """
    model = rig(ratio)
    wanted, _ = ExactPeriod(model, HarmonicForce(unit_force(model, "m1"), 40.0, 150.0)).steady()
    highest, errors, estimates, solution = np.array([31, 63, 127]), [], [], None
    for order in highest:
        problem = odd_balance(model, int(order), 16384)
        solution = problem.solve(150.0, 40.0, solution)
        errors.append(furthest(solution.displacement(SAMPLES), wanted))
        estimates.append(solution.left_out)
    assert -4.0 < np.polyfit(np.log(highest), np.log(errors), 1)[0] < -2.9
    # The error estimate of a solution is the norm over time, not the largest value, for the joint
    # alone.
    assert np.all(np.divide(errors, estimates) > 1.0)
    assert np.all(np.divide(errors, estimates) < 10.0)


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.001, 0.02])
def test_jenkins_rig_is_the_fixed_point_of_newmark(ratio):
    """Newmark is of second order; after extrapolation the error is below 1e-4."""
    model = rig(ratio)
    force = HarmonicForce(unit_force(model, "m1"), 40.0, 150.0)
    periods = [NewmarkPeriod(model, JENKINS, force, 150.0, steps) for steps in (1024, 2048)]
    (_, coarse, lost), (_, fine, lost_fine) = newmark_steady(periods)
    solution = odd_balance(model, 63, 4096).solve(150.0, 40.0)
    motion = solution.displacement(SAMPLES)
    assert 3.0 < furthest(coarse, motion) / furthest(fine, motion) < 5.0
    assert furthest(extrapolated(coarse, fine), motion) <= WANTED
    assert solution.cycle.dissipated[0] == pytest.approx(extrapolated(lost, lost_fine), rel=WANTED)


# --- One contact in three dimensions, under a normal load that varies until it lifts off


# Amplitude [N] and phase of the force on each point.
SHAKEN = {"m1": (75.0, 0.0), "y": (20.0, 1.9), "z": (110.0, 0.7)}


class PressedRig:
    """Rig whose contact also moves across (y), and is pressed and lifted (z)."""

    frequency = 100.0
    law = FrictionContact(KT, 1.3 * KT, MU, LOAD)

    def __init__(self, ratio):
        self.model = lumped_rig(
            {"m1": 21.152e-3, "m2": 1.189e-3, "y": 1.189e-3, "z": 1.189e-3},
            {Link("m1"): 1.3469e3, Link("m2", "m1"): 273e3, Link("y"): 5e3, Link("z"): 20e3},
            [[Link("m2"), Link("y"), Link("z")]],
            ratio,
        )
        # The load exceeds that of the contact: at rest it is pressed by 0.1 µm more.
        self.static = (LOAD + 8.0) * unit_force(self.model, "z")

    @property
    def excitation(self):
        waves = [
            HarmonicForce(unit_force(self.model, name), amplitude, self.frequency, phase)
            for name, (amplitude, phase) in SHAKEN.items()
        ]
        return CombinedForces((*waves, RecordedForce(self.static, np.zeros(1), np.ones(1))))

    def balance(self, highest, samples):
        wave = sum(
            -1j * amplitude * np.exp(1j * phase) * unit_force(self.model, name)
            for name, (amplitude, phase) in SHAKEN.items()
        )
        load = PeriodicLoad({1: wave}, self.static)
        resolution = Resolution(tuple(range(highest + 1)), samples)
        return HarmonicBalance(self.model, PeriodicMarch(self.law), load, resolution)

    def newmark(self, *steps):
        return [
            NewmarkPeriod(self.model, self.law, self.excitation, self.frequency, count)
            for count in steps
        ]


def check_pressed_rig(pressed, steady, resolutions, allowed):
    (_, coarse, lost), (_, fine, lost_fine) = steady[-2:]
    wanted = extrapolated(coarse, fine)
    errors = []
    for highest, samples in resolutions:
        solution = pressed.balance(highest, samples).solve(pressed.frequency, 1.0)
        assert solution.converged
        errors.append(furthest(solution.displacement(SAMPLES), wanted))
    assert {STICK, SLIP, SEPARATED} == set(np.unique(solution.cycle.states))
    assert errors[-1] <= allowed
    assert solution.cycle.dissipated[0] == pytest.approx(extrapolated(lost, lost_fine), rel=allowed)
    # In the mean, spring and contact carry the load, but not as at rest, since lift-off cuts part
    # of the force.
    mean, pressing = solution.amplitude(3, 0).real, solution.cycle.samples[:, 0, 2].mean()
    assert 20e3 * mean + pressing == pytest.approx(LOAD + 8.0, rel=1e-8)
    assert abs(pressing - LOAD) > 5.0
    return np.array(errors)


@pytest.mark.slow
def test_contact_that_lifts_off_is_the_fixed_point_of_newmark():
    """Errors of 31 harmonics and 1024 steps are below 1e-3, those of 15 ten times as large."""
    pressed = PressedRig(0.02)
    steady = newmark_steady(pressed.newmark(512, 1024))
    errors = check_pressed_rig(pressed, steady, [(15, 512), (31, 1024)], 1e-3)
    assert errors[0] > 8.0 * errors[1]


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.001, 0.02])
def test_contact_that_lifts_off_is_the_fixed_point_of_newmark_to_1e_4(ratio):
    """With little damping the search starts from the result with more damping."""
    state = newmark_steady(PressedRig(0.02).newmark(512))[0][0]
    pressed = PressedRig(ratio)
    steady = newmark_steady(pressed.newmark(512, 2048, 4096), state)
    check_pressed_rig(pressed, steady, [(63, 4096)], WANTED)
