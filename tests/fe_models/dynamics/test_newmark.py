"""Average acceleration with implicit friction: energy, order, closed forms, and failure."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fe_models.dynamics.excitation import HammerBlow, HarmonicForce
from fe_models.dynamics.motion import Start
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from tests.oracles.two_mass_rig import two_mass_rig
from wear.joints.jenkins import Jenkins
from wear.joints.law import JointResponse

SOLVED = 1e-9


@dataclass(frozen=True)
class LinearSpring:
    """Joint that is a linear spring."""

    stiffness: float
    directions = 1

    def rest(self, joints):
        return np.zeros((joints, 1))

    def respond(self, state, increment):
        moved = state + increment
        tangent = np.full((*moved.shape, 1), self.stiffness)
        return JointResponse(self.stiffness * moved, tangent, moved, np.zeros(len(moved)))


@pytest.fixture(scope="module")
def rig():
    """Return two masses and two joints, to the ground and between them."""
    masses = {"a": 2e-3, "b": 1e-3}
    springs = {Link("a"): 400.0, Link("b", "a"): 900.0}
    return lumped_rig(masses, springs, [[Link("b")], [Link("b", "a")]], 0.01)


@pytest.fixture(scope="module")
def law():
    return Jenkins(np.array([1200.0, 700.0]), np.array([0.4, 0.11]), np.array([5.0, 10.0]),
                   np.array([30.0, 0.0]))  # fmt: skip


@pytest.fixture(scope="module")
def drive(rig):
    return HarmonicForce(unit_force(rig, "b"), 6.0, 90.0)


@pytest.fixture(scope="module")
def exact(rig, law, drive):
    """Return the motion with the same joints, integrated from event to event."""
    sliders = SliderJoints(law.stiffness, law.friction * law.normal_load, law.residual_stiffness)
    return integrate_exactly(rig, sliders, drive, 0.05, 1e-3)


def error(motion, exact):
    """Return the largest error of displacement, relative to the largest displacement."""
    difference = np.abs(motion.displacement - exact.displacement).max()
    return difference / np.abs(exact.displacement).max()


def order(steps, errors):
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


@pytest.mark.parametrize("held", [False, True])
def test_energy_is_kept_without_friction(held):
    """It is kept to 1e-10 over 1e4 steps, coarse for the second mode, with and without a joint."""
    rig = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3))
    joint = LinearSpring(27.3e3) if held else None
    start = Start(np.array([0.01, 0.02]), np.array([3.0, -2.0]))
    motion = integrate(rig, joint, None, 1.0, TimeStepControl(1e-4), start)
    energies = motion.energies
    held_energy = 0.5 * motion.joint_force * motion.joint_displacement
    total = energies.kinetic + energies.elastic + held_energy[:, 0, 0]
    np.testing.assert_allclose(total, total[0], rtol=1e-10)
    assert len(motion.times) == 10001
    np.testing.assert_array_equal(energies.joints, 0.0)


@pytest.mark.parametrize("tolerance", [None, 1e-4])
def test_progress_is_reported(tolerance):
    """Progress is also correct where a first run in whole steps finds how large the motion is."""
    rig, start, shares = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3)), Start(np.ones(2)), []
    control = TimeStepControl(1e-4, tolerance)
    integrate(rig, None, None, 0.3, control, start, reached=shares.append)
    assert np.all(np.diff(shares) > 0.0)
    assert shares[0] < 0.5
    assert shares[-1] == 1.0


def test_implicit_friction_is_second_order(rig, law, drive, exact):
    """The event-driven reference has joints that slip in both directions."""
    assert np.all(exact.energies.joints[-1] > 0.0)
    parts = np.array([10, 20, 40, 80])
    errors = []
    for every in parts:
        motion = integrate(rig, law, drive, 0.05, TimeStepControl(1e-3 / every, every=int(every)))
        assert motion.residual < 1e-10
        errors.append(error(motion, exact))
    assert order(1.0 / parts, errors) == pytest.approx(2.0, abs=0.15)
    assert errors[-1] < 5e-4


def lagged(model, law, excitation, duration, step):
    """Integrate with joint forces of the start of a step throughout it, a variant not offered."""
    x, v = np.zeros((2, len(model.mass)))
    state = law.rest(len(model.connection))
    joint_force = np.zeros(len(model.connection))
    effective = model.mass + 0.5 * step * model.damping + 0.25 * step**2 * model.stiffness
    displacements = [x]
    for t in step * np.arange(round(duration / step)):
        mean = 0.5 * excitation(np.array([t, t + step])).sum(axis=0)
        unbalanced = mean - model.connection.T @ joint_force - model.damping @ v
        unbalanced -= model.stiffness @ (x + 0.5 * step * v)
        change = np.linalg.solve(effective, step * unbalanced)
        moved = step * (v + 0.5 * change)
        x, v = x + moved, v + change
        response = law.respond(state, (model.connection @ moved)[:, None])
        state, joint_force = response.state, response.force[:, 0]
        displacements.append(x)
    return np.array(displacements)


@pytest.mark.slow
def test_lagged_friction_is_first_order_only(rig, law, drive, exact):
    parts = np.array([40, 80, 160])
    errors = []
    for every in parts:
        displacement = lagged(rig, law, drive, 0.05, 1e-3 / every)[::every]
        errors.append(error(replace(exact, displacement=displacement), exact))
    assert order(1.0 / parts, errors) == pytest.approx(1.0, abs=0.2)
    implicit = integrate(rig, law, drive, 0.05, TimeStepControl(1e-3 / 160, every=160))
    assert errors[-1] > 10.0 * error(implicit, exact)


def test_a_tolerance_chooses_the_steps(rig, law, drive, exact):
    """Errors of h³ per step add up to h²: the error falls as the tolerance to the power 2/3."""
    tolerances, errors = 10.0 ** -np.arange(4, 8), []
    for tolerance in tolerances:
        motion = integrate(rig, law, drive, 0.05, TimeStepControl(1e-3, tolerance))
        assert motion.converged
        np.testing.assert_allclose(motion.times, exact.times, rtol=1e-12)
        errors.append(error(motion, exact))
        assert errors[-1] / 3.0 < motion.error < 3.0 * errors[-1]
    assert order(tolerances, errors) == pytest.approx(2.0 / 3.0, abs=0.15)
    assert errors[-1] < 1e-3


@pytest.mark.slow
def test_a_tolerance_spends_its_steps_where_they_are_needed():
    """After a short blow the rig swings slowly, for which few steps suffice."""
    rig = two_mass_rig((20e-3, 1e-3), (1.4e3, 27.3e3), 0.05)
    blow = HammerBlow(unit_force(rig, "m1"), 100.0, 1e-3)
    motion = integrate(rig, None, blow, 0.2, TimeStepControl(1e-3, 1e-6))
    fixed = integrate(rig, None, blow, 0.2, TimeStepControl(1e-3 / 64, every=64))
    assert motion.converged
    assert motion.steps < 0.3 * fixed.steps
    # Expected error: that of a fixed step 64 times as short.
    assert motion.error < 2.0 * fixed.error


def test_a_harmonic_steady_state_is_the_closed_form():
    """The rule replaces ω by 2/h tan(ωh/2), which is of second order."""
    rig = lumped_rig({"a": 2e-3, "b": 1e-3}, {Link("a"): 400.0, Link("b", "a"): 900.0},
                     [[Link("b")]], 0.1)  # fmt: skip
    joint, shape = LinearSpring(1200.0), unit_force(rig, "a")
    force, angular = HarmonicForce(shape, 6.0, 100.0), 2.0 * np.pi * 100.0
    stiffness = rig.stiffness + 1200.0 * rig.connection.T @ rig.connection

    def steady(w, times):
        dynamic = stiffness + 1j * w * rig.damping - w**2 * rig.mass
        return np.imag(
            np.exp(1j * angular * times)[:, None] * np.linalg.solve(dynamic, 6.0 * shape)
        )

    errors = []
    for parts in (25, 50, 100):
        step = 1e-2 / parts
        motion = integrate(rig, joint, force, 0.6, TimeStepControl(step))
        late = motion.times > 0.58
        displacement, times = motion.displacement[late], motion.times[late]
        turned = 2.0 / step * np.tan(0.5 * step * angular)
        largest = np.abs(displacement).max()
        np.testing.assert_allclose(displacement, steady(turned, times), atol=SOLVED * largest)
        errors.append(np.abs(displacement - steady(angular, times)).max() / largest)
    assert order([4.0, 2.0, 1.0], errors) == pytest.approx(2.0, abs=0.05)


def test_a_blow_converges_to_the_closed_form():
    """The velocity after a short blow follows from its impulse, to the order of the step."""
    rig = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3), 0.003)
    blow = HammerBlow(unit_force(rig, "m2"), 100.0, 0.73e-3)
    free = SliderJoints(np.array([1.0]), np.array([0.0]), np.array([0.0]))
    # This closed form is verified against Duhamel's integral in a test of its own.
    exact = integrate_exactly(rig, free, blow, 0.02, 1e-3)
    parts = np.array([100, 200, 400])
    errors = [
        error(integrate(rig, None, blow, 0.02, TimeStepControl(1e-3 / n, every=int(n))), exact)
        for n in parts
    ]
    assert order(1.0 / parts, errors) == pytest.approx(2.0, abs=0.05)
    assert errors[-1] < 1e-3


def test_the_balance_of_energy_closes(rig, law, drive):
    motion = integrate(rig, law, drive, 0.05, TimeStepControl(5e-5))
    energies = motion.energies
    largest = energies.excitation.max()
    np.testing.assert_allclose(energies.missing, 0.0, atol=SOLVED * largest)
    stored = energies.joint_work - energies.joints.sum(axis=1)
    springs = law.stiffness * motion.joint_displacement[:, :, 0] ** 2
    assert stored.max() < springs.max()
    # Bound: the springs store at most limit²/2kt each, and the trapezoidal rule has errors at
    # kinks.
    limit = law.friction * law.normal_load
    residual = 0.5 * law.residual_stiffness * motion.joint_displacement[:, :, 0] ** 2
    most = (0.5 * limit**2 / law.stiffness + residual).sum(axis=1)
    assert np.all(stored < most + 1e-3 * largest)
    assert np.all(stored > -1e-3 * largest)


def test_accelerations_balance_the_forces(rig, law, drive):
    motion = integrate(rig, law, drive, 0.01, TimeStepControl(1e-4))
    left = (
        motion.acceleration @ rig.mass
        + motion.velocity @ rig.damping
        + motion.displacement @ rig.stiffness
        + motion.joint_force[:, :, 0] @ rig.connection
    )
    np.testing.assert_allclose(left, drive(motion.times), atol=6.0 * SOLVED)


def test_a_motion_can_be_stopped_and_resumed(rig, law, drive):
    whole = integrate(rig, law, drive, 0.04, TimeStepControl(1e-4))
    first = integrate(rig, law, drive, 0.02, TimeStepControl(1e-4))
    second = integrate(rig, law, drive, 0.02, TimeStepControl(1e-4), first.end)
    largest = np.abs(whole.displacement).max()
    np.testing.assert_allclose(second.displacement, whole.displacement[200:], atol=SOLVED * largest)
    np.testing.assert_allclose(second.times, whole.times[200:], rtol=1e-12)


def test_rows_left_out_change_nothing(rig, law, drive):
    """The run has several blocks, and the state at the end is that of the last row."""
    every, full = (integrate(rig, law, drive, 0.25, TimeStepControl(1e-4, every=n)) for n in (7, 1))
    np.testing.assert_array_equal(every.displacement, full.displacement[::7])
    np.testing.assert_array_equal(every.energies.joints, full.energies.joints[::7])
    np.testing.assert_array_equal(every.times, full.times[::7])
    assert every.steps == full.steps == 2500
    state = integrate(rig, law, drive, float(every.times[-1]), TimeStepControl(1e-4)).joint_state
    np.testing.assert_array_equal(every.joint_state, state)


def test_nothing_moves_without_force(rig, law):
    motion = integrate(rig, law, None, 0.01, TimeStepControl(1e-3))
    for values in (motion.displacement, motion.joint_force, motion.energies.joint_work):
        np.testing.assert_array_equal(values, 0.0)
    assert motion.error == motion.residual == 0.0


def test_many_joints_are_as_good_as_their_sum():
    """Sixty small joints on one point equal one joint; Newton's method has sixty unknowns."""
    count = 60
    shared = lumped_rig({"m": 1e-3}, {Link("m"): 100.0}, [[Link("m")]] * count, 0.01)
    single = lumped_rig({"m": 1e-3}, {Link("m"): 100.0}, [[Link("m")]], 0.01)
    force = HarmonicForce(unit_force(single, "m"), 5.0, 60.0)
    control = TimeStepControl(2e-4)
    many = integrate(shared, Jenkins(600.0 / count, 0.5, 4.0 / count), force, 0.05, control)
    one = integrate(single, Jenkins(600.0, 0.5, 4.0), force, 0.05, control)
    largest = np.abs(one.displacement).max()
    assert many.converged
    np.testing.assert_allclose(many.displacement, one.displacement, atol=SOLVED * largest)


@dataclass(frozen=True)
class SignOfSlip:
    """Coulomb's law without a spring, whose force jumps: no integrator here can follow it."""

    limit: float
    directions = 1

    def rest(self, joints):
        return np.zeros((joints, 0))

    def respond(self, state, increment):
        force = self.limit * np.sign(increment)
        lost = np.abs(force * increment)[:, 0]
        return JointResponse(force, np.zeros((*increment.shape, 1)), state, lost)


def test_a_structure_needs_no_joints(drive):
    bare = lumped_rig({"a": 2e-3, "b": 1e-3}, {Link("a"): 400.0, Link("b", "a"): 900.0}, [])
    motion = integrate(bare, None, drive, 0.05, TimeStepControl(1e-4))
    assert motion.converged
    assert motion.joint_force.shape == (501, 0, 1)
    np.testing.assert_allclose(
        motion.energies.missing, 0.0, atol=SOLVED * motion.energies.excitation.max()
    )


def test_a_force_that_jumps_is_refused_with_what_to_do():
    rig = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3))
    force = HarmonicForce(unit_force(rig, "m1"), 5.0, 30.0)
    motion = integrate(rig, SignOfSlip(50.0), force, 0.1, TimeStepControl(1e-4))
    assert not motion.converged
    assert len(motion.times) == len(motion.displacement) == 1
    assert "not in equilibrium" in motion.message
    assert "whose force is continuous" in motion.message


def test_invalid_integrations_are_refused(rig, law, drive):
    with pytest.raises(ValueError, match="a step of 0 s"):
        TimeStepControl(0.0)
    with pytest.raises(ValueError, match="tolerance -1"):
        TimeStepControl(1.0, -1.0)

    class Planar(LinearSpring):
        directions = 3

    with pytest.raises(ValueError, match="2 rows for joints of 3"):
        integrate(rig, Planar(1.0), drive, 0.1, TimeStepControl(1e-3))
