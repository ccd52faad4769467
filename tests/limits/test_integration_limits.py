"""Limits of integration in time: stuck, apart, and steps far too large."""

from dataclasses import dataclass

import numpy as np
import pytest

from fe_models.dynamics.excitation import HammerBlow, HarmonicForce, RecordedForce
from fe_models.dynamics.motion import Start
from fe_models.dynamics.rig import Link, lumped_rig, natural_frequencies, unit_force
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from tests.oracles.two_mass_rig import two_mass_rig
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.law import JointResponse

SOLVED = 1e-9
RIG = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3), 1e-3)


@dataclass(frozen=True)
class Elastic:
    """Joint without memory, whose force and slope are functions of its displacement."""

    force: object
    slope: object
    directions = 1

    def rest(self, joints):
        return np.zeros((joints, 1))

    def respond(self, state, increment):
        moved = state + increment
        return JointResponse(
            self.force(moved), self.slope(moved)[:, :, None], moved, np.zeros(len(moved))
        )


def stop(stiffness, gap):
    """Return a spring that is touched at a gap."""
    return Elastic(
        lambda u: stiffness * np.maximum(u - gap, 0.0), lambda u: np.where(u > gap, stiffness, 0.0)
    )


def test_a_stuck_start_is_linear():
    """A slider that never reaches its limit is a spring: same motion, nothing dissipated."""
    start = Start(np.array([1e-3, 0.9e-3]))
    control = TimeStepControl(1e-4)
    stuck = integrate(RIG, Jenkins(27.3e3, 0.5, 1e6), None, 0.1, control, start)
    spring = Elastic(lambda u: 27.3e3 * u, lambda u: np.full_like(u, 27.3e3))
    linear = integrate(RIG, spring, None, 0.1, control, start)
    np.testing.assert_allclose(stuck.displacement, linear.displacement, atol=SOLVED * 1e-3)
    np.testing.assert_array_equal(stuck.energies.joints, 0.0)
    exact = integrate_exactly(
        RIG, SliderJoints(np.array([27.3e3]), np.array([5e5]), np.zeros(1)), None, 0.1, 1e-4, start
    )
    # The first mode swings at the stuck frequency: sign changes of a nearly pure mode.
    changes = np.flatnonzero(np.diff(np.sign(exact.displacement[:, 0])))
    period = 2.0 * np.diff(exact.times[changes]).mean()
    assert 1.0 / period == pytest.approx(natural_frequencies(RIG, 27.3e3)[0], rel=0.01)
    np.testing.assert_array_equal(exact.energies.joints, 0.0)


def test_a_start_at_the_limit_slips_or_sticks_as_it_is_pushed():
    """Moved to 10 times its reach, the spring is at its limit, and returns in stick."""
    start = Start(np.array([0.0, 0.01]), np.array([0.0, 5.0]))
    joints = SliderJoints(np.array([27.3e3]), np.array([27.3]), np.array([880.0]))
    exact = integrate_exactly(RIG, joints, None, 0.01, 1e-5, start)
    motion = integrate(RIG, Jenkins(27.3e3, 0.273, 100.0, 880.0), None, 0.01, TimeStepControl(1e-6,
                       every=10), start)  # fmt: skip
    assert motion.joint_force[0, 0, 0] == pytest.approx(27.3 + 8.8)
    assert motion.converged
    assert exact.energies.joints[1, 0] > 0.0
    largest = np.abs(exact.displacement).max()
    np.testing.assert_allclose(motion.displacement, exact.displacement, atol=1e-3 * largest)


def test_without_normal_load_nothing_is_held():
    """A slider without a limit, a contact that stays apart and no joint at all are equal."""
    blow = HammerBlow(unit_force(RIG, "m1"), 100.0, 1e-3)
    free = integrate(RIG, None, blow, 0.05, TimeStepControl(1e-4))
    loose = integrate(RIG, Jenkins(27.3e3, 0.5, 0.0), blow, 0.05, TimeStepControl(1e-4))
    apart = integrate(RIG, stop(1e5, 10.0), blow, 0.05, TimeStepControl(1e-4))
    largest = np.abs(free.displacement).max()
    for motion in (loose, apart):
        np.testing.assert_allclose(motion.displacement, free.displacement, atol=SOLVED * largest)
        np.testing.assert_array_equal(motion.joint_force, 0.0)
    unlimited = SliderJoints(np.array([27.3e3]), np.zeros(1), np.zeros(1))
    exact = integrate_exactly(RIG, unlimited, blow, 0.05, 1e-3)
    assert exact.converged
    np.testing.assert_array_equal(exact.joint_force, 0.0)


@pytest.mark.parametrize("parts", [20, 57, 160])
def test_a_body_hits_a_stop_and_comes_back(parts):
    """It flies freely, spends half a period on the stop, and returns with the same speed.

    The error is O(h²) with a factor that depends on the position of the hit in a step: 0.3 to 0.6
    gaps at steps of 1/20 to 1/320 of the time on the stop.
    """
    mass, stiffness, gap, speed = 1e-3, 4e3, 0.3, 100.0
    body = lumped_rig({"m": mass}, {}, [[Link("m")]])
    on_it = np.pi / np.sqrt(stiffness / mass)
    back = 2.0 * gap / speed + on_it
    start, control = Start(velocity=np.array([speed])), TimeStepControl(on_it / parts)
    motion = integrate(body, stop(stiffness, gap), None, 2.0 * back, control, start)
    assert motion.converged
    touching = motion.joint_force[:, 0, 0] > 0.0
    assert np.count_nonzero(np.diff(touching.astype(int))) == 2
    hardest = speed * np.sqrt(stiffness * mass)
    assert motion.joint_force.max() == pytest.approx(hardest, rel=0.01)
    late = motion.times > back
    wanted = -speed * (motion.times[late] - back)
    assert np.abs(motion.displacement[late, 0] - wanted).max() < 0.7 * gap / parts**2


def test_a_contact_that_lifts_off_and_slides_is_followed():
    """It is apart most of the time in three directions; energy balances; finer steps agree."""
    rig = lumped_rig(
        dict.fromkeys("xyz", 1e-3),
        {Link("x"): 300.0, Link("y"): 200.0, Link("z"): 100.0},
        [[Link(axis) for axis in "xyz"]],
        0.02,
    )
    contact = FrictionContact(2000.0, 2600.0, 0.5, gap=1e-3)
    start = Start(np.array([0.03, 0.0, -0.02]), np.array([0.0, 8.0, 0.0]))
    motions = [
        integrate(rig, contact, None, 0.02, TimeStepControl(1e-4 / n, every=n), start)
        for n in (1, 5, 10, 40)
    ]
    for motion in motions:
        assert motion.converged
        pressing = motion.joint_force[:, 0, 2]
        assert 0.2 < np.mean(pressing == 0.0) < 0.9
        energies = motion.energies
        first = energies.kinetic[0] + energies.elastic[0]
        np.testing.assert_allclose(energies.missing, 0.0, atol=SOLVED * first)
        assert 0.0 < energies.joints[-1, 0] < first
    errors = [
        np.abs(motion.displacement - motions[-1].displacement).max() for motion in motions[:3]
    ]
    assert errors[2] < 0.35 * errors[1] < 0.03 * errors[0]


def softening(peak, stiffness, fall):
    """Return a spring that softens: force up to its peak, then down to zero."""
    reach = peak / stiffness

    def force(u):
        past = np.maximum(np.abs(u) - reach, 0.0)
        return np.sign(u) * np.maximum(np.minimum(stiffness * np.abs(u), peak - fall * past), 0.0)

    def slope(u):
        past = np.abs(u) - reach
        falling = np.where(past < peak / fall, -fall, 0.0)
        return np.where(past < 0.0, stiffness, falling)

    return Elastic(force, slope)


def test_a_joint_that_lets_go_is_followed_in_parts_of_a_step():
    """Pulled slowly over its peak it falls so fast that Newton needs halved steps."""
    body = lumped_rig({"m": 1e-3}, {Link("m"): 50.0}, [[Link("m")]], 0.05)
    law = softening(20.0, 1000.0, 2e4)
    pull = RecordedForce(np.ones(1), np.array([0.0, 0.1]), np.array([0.0, 25.0]))
    coarse, fine = (
        integrate(body, law, pull, 0.1, TimeStepControl(5e-4 / n, every=n)) for n in (1, 20)
    )
    assert coarse.converged, coarse.message
    assert coarse.steps > len(coarse.times) - 1
    assert coarse.residual < 1e-10
    largest = np.abs(fine.displacement).max()
    np.testing.assert_allclose(coarse.displacement, fine.displacement, atol=0.05 * largest)


@pytest.mark.parametrize("stiffness", [1e7, 1e10])
def test_a_joint_far_stiffer_than_a_step_resolves(stiffness):
    """Every reversal falls within a step: plain Newton would jump between both directions."""
    force = HarmonicForce(unit_force(RIG, "m1"), 75.0, 30.0)
    stiff = Jenkins(stiffness, 0.5, 60.0)
    coarse = integrate(RIG, stiff, force, 0.2, TimeStepControl(1e-3))
    assert coarse.converged, coarse.message
    assert coarse.residual < 1e-10
    energies = coarse.energies
    largest = energies.excitation.max()
    np.testing.assert_allclose(energies.missing, 0.0, atol=SOLVED * largest)
    assert energies.joints[-1, 0] > 0.1 * largest


@pytest.mark.parametrize("step", [0.02, 1.0])
def test_the_error_of_a_step_far_too_large_is_estimated(step):
    """With 10 or 500 periods in a step the result is bounded (stable rule), but useless."""
    force = HarmonicForce(unit_force(RIG, "m1"), 75.0, 33.0)
    law = Jenkins(27.3e3, 0.5, 60.0)
    fixed = integrate(RIG, law, force, 20.0 * step, TimeStepControl(step))
    assert fixed.converged
    assert fixed.error > 0.3
    # Not above the quasi-static displacement of the load by orders.
    assert np.abs(fixed.displacement).max() < 20.0 * 75.0 / 1.4e3
    asked = integrate(RIG, law, force, 20.0 * step, TimeStepControl(step, 1e-12))
    assert not asked.converged
    assert "times what is allowed: give smaller steps or a larger tolerance" in asked.message
    assert len(asked.times) < 21
