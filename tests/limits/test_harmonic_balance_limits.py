"""Harmonic balance at its limits: a right answer, or a message that says what to do."""

from __future__ import annotations

import numpy as np
import pytest

from fe_models.dynamics.curves.forced_response import along_force, along_frequency
from fe_models.dynamics.curves.motion_recorder import Accuracy
from fe_models.dynamics.excitation import HarmonicForce
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.periodic.resolution_error import resolution_error
from fe_models.dynamics.rig import Link, lumped_rig, natural_frequencies, unit_force
from tests.limits.contact_rigs import KN, KT, MU, SOLVED, balance, body, contact, linear, rig
from tests.marks import slow
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import SEPARATED, SLIP, STICK, PeriodicMarch

# --- Resolution


def lifting(highest, samples):
    """Return the balance of a body shaken in all directions, apart for half of the cycle."""
    waves = {"x": 10.0, "y": 4.0j, "z": 30.0 * np.exp(0.7j)}
    return balance(body(ratio=0.03), contact(8.0), waves, 10.0, highest, samples)


FREQUENCY = 60.0


@pytest.fixture(scope="module")
def resolved():
    """Return the solution with so many harmonics that 1e-5 is left out."""
    solution = lifting(40, 2048).solve(FREQUENCY, 1.0)
    assert solution.converged
    assert {STICK, SLIP, SEPARATED} == set(np.unique(solution.cycle.states))
    assert solution.left_out < 1e-5
    return solution


def error_of(solution, resolved):
    """Return the relative error of the joints' vibration."""
    adopted = resolved.resolution.adopt(solution.coefficients, solution.resolution)
    wrong = (adopted - resolved.coefficients)[:, 1:]
    return np.linalg.norm(wrong) / np.linalg.norm(resolved.coefficients[:, 1:])


def distance(solution, resolved):
    """Return the largest difference of motions over the largest displacement."""
    motion, wanted = solution.displacement(256), resolved.displacement(256)
    return np.abs(motion - wanted).max() / np.abs(wanted).max()


@pytest.mark.parametrize(("highest", "least"), [(1, 0.05), (2, 5e-3), (5, 5e-4)])
def test_too_few_harmonics_for_lift_off_are_reported(highest, least, resolved):
    """The estimate of the error is within a factor of 3 of it."""
    problem = lifting(highest, 512)
    solution = problem.solve(FREQUENCY, 1.0)
    assert solution.converged
    reported = resolution_error(problem, solution).vibration
    assert reported > least
    assert reported / 3.0 < error_of(solution, resolved) < 3.0 * reported


def test_too_few_harmonics_for_lift_off_are_added_if_asked(resolved):
    branch = along_frequency(
        lifting(1, 16), 1.0, (55.0, FREQUENCY), accuracy=Accuracy(1e-3, 31), upward=False
    )
    assert branch.message == ""
    assert all(s.error.largest <= 1e-3 for s in branch.solutions)
    assert distance(branch.solutions[0], resolved) < 5e-3


@pytest.mark.parametrize("samples", [12, 16, 32])
def test_too_few_samples_are_reported(samples, resolved):
    """With one sample above the minimum it still ends, and reports its error."""
    problem = lifting(5, samples)
    rough = problem.solve(FREQUENCY, 1.0)
    assert rough.converged
    reported = resolution_error(problem, rough).vibration
    error = error_of(rough, resolved)
    assert error > 1e-3
    assert error / 3.0 < reported < 3.0 * error


def test_the_error_of_the_finest_resolution_is_reported():
    """Neither harmonics nor samples suffice for a tolerance of 1e-6: the branch still ends."""
    accuracy = Accuracy(1e-6, highest=7, most_samples=64)
    branch = along_frequency(lifting(1, 16), 1.0, (58.0, FREQUENCY), accuracy=accuracy)
    assert branch.message == ""
    resolution = branch.problem.resolution
    assert resolution.harmonics[-1] <= 7
    assert resolution.samples == 64
    assert all(s.error.largest > 1e-6 for s in branch.solutions)


# --- Linear limits


def test_a_contact_that_sticks_is_its_springs_through_a_resonance():
    """Pressed so hard that nothing slips, it is three springs, with only harmonic 1."""
    model, waves = body(), {"x": 1.0, "y": 0.5j, "z": 0.7}
    problem = balance(model, contact(), waves, 5e4)
    wave = problem.load.waves[1]
    branch = along_frequency(problem, 1.0, (50.0, 180.0))
    assert branch.message == ""
    assert branch.curve.folds == ()
    for solution in branch.solutions:
        wanted = linear(model, np.array([KT, KT, KN]), solution.frequency, wave)
        # The tolerance is one of the whole motion, whose mean is a thousand times the vibration.
        scale = np.abs(solution.motion).max()
        np.testing.assert_allclose(solution.motion[1], wanted, atol=SOLVED * scale)
        assert np.abs(solution.motion[2:]).max() < SOLVED * scale
        assert np.all(solution.cycle.states == STICK)
        assert solution.motion[0, 2].real == pytest.approx(5e4 / (900.0 + KN), rel=SOLVED)
    peak = branch.frequencies[np.argmax(branch.first_amplitudes(0))]
    stuck = natural_frequencies(model, np.array([KT, KT, KN]))[0]
    assert peak == pytest.approx(stuck, rel=0.02)


def test_a_contact_with_a_gap_larger_than_the_motion_is_nothing_through_a_resonance():
    model, waves = body(), {"x": 1.0, "y": 0.5j, "z": 0.7}
    problem = balance(model, contact(gap=1.0), waves)
    branch = along_frequency(problem, 1.0, (50.0, 180.0))
    assert branch.message == ""
    for solution in branch.solutions:
        wanted = linear(model, np.zeros(3), solution.frequency, problem.load.waves[1])
        np.testing.assert_allclose(solution.motion[1], wanted, rtol=1e-7)
        assert not solution.motion[[0, 2, 3, 4, 5]].any()
        assert np.all(solution.cycle.states == SEPARATED)
        assert solution.left_out == 0.0
        assert solution.cycle.dissipated[0] == 0.0


def test_an_open_contact_that_alone_holds_the_structure():
    """Without loads the structure floats in the gap where it was, and x moves freely."""
    model = body(normal=0.0)
    problem = balance(model, contact(gap=0.5), {"x": 1.0, "z": 0.01})
    solution = problem.solve(30.0, 1.0)
    assert solution.converged
    assert np.all(solution.cycle.states == SEPARATED)
    wanted = linear(model, np.zeros(3), 30.0, problem.load.waves[1])
    np.testing.assert_allclose(solution.motion[1], wanted, rtol=SOLVED)
    assert solution.motion[0, 2] == 0.0
    branch = along_frequency(problem, 1.0, (20.0, 100.0))
    assert branch.message == ""
    assert not any(s.motion[0].any() for s in branch.solutions)


@pytest.mark.parametrize("load", [-8.0, -1e-3])
def test_a_static_load_that_lifts_the_structure_off_has_no_equilibrium(load):
    """Only the contact holds it along z, so pulled away it has no periodic motion."""
    problem = balance(body(normal=0.0), contact(), {"x": 1.0}, load)
    solution = problem.solve(30.0, 1.0)
    assert not solution.converged
    assert "no static equilibrium" in solution.message
    assert "give a load that does not pull all joints apart" in solution.message
    branch = along_frequency(problem, 1.0, (30.0, 60.0))
    assert branch.message == solution.message
    assert branch.solutions == ()


def test_a_static_load_that_lifts_a_held_structure_off_is_linear():
    """Springs hold it, pulled off its contact by half more than its motion."""
    model = body()
    problem = balance(model, contact(8.0), {"x": 1.0, "z": 0.1}, -30.0)
    solution = problem.solve(30.0, 1.0)
    assert solution.converged
    assert np.all(solution.cycle.states == SEPARATED)
    wanted = linear(model, np.zeros(3), 30.0, problem.load.waves[1])
    np.testing.assert_allclose(solution.motion[1], wanted, rtol=SOLVED)
    assert solution.motion[0, 2].real == pytest.approx(-30.0 / 900.0, rel=SOLVED)


# --- Without force


@pytest.mark.parametrize(("load", "static"), [(0.0, 0.0), (0.0, 8.0), (8.0, 8.0), (8.0, 20.0)])
@pytest.mark.parametrize("normal", [0.0, 900.0, 900.3])
def test_without_force_it_rests(load, static, normal):
    """It rests even where the preload equals the pressing load, at 0."""
    problem = balance(body(normal), contact(load), {"x": 1.0, "z": 0.3}, static)
    solution = problem.solve(30.0, 0.0)
    assert solution.converged
    rest = (static - load) / (normal + KN)
    assert solution.motion[0, 2].real == pytest.approx(rest, abs=1e-12)
    assert np.abs(solution.motion[1:]).max() < 1e-14
    assert solution.left_out == 0.0
    assert solution.cycle.dissipated[0] == 0.0
    branch = along_frequency(problem, 0.0, (20.0, 200.0))
    assert branch.message == ""
    assert np.abs([s.motion[1:] for s in branch.solutions]).max() < 1e-14
    assert all(s.left_out == 0.0 for s in branch.solutions)


def test_without_force_nothing_is_refined():
    """Rounding errors of a vanishing vibration are no reason for more harmonics or samples."""
    problem = balance(body(), contact(8.0), {"x": 1.0}, 8.5, highest=1, samples=16)
    branch = along_frequency(problem, 0.0, (20.0, 60.0), accuracy=Accuracy(1e-3))
    assert branch.message == ""
    assert branch.problem.resolution == Resolution((0, 1), 16)
    rising = along_force(problem, 30.0, (0.0, 0.5), accuracy=Accuracy(1e-3))
    assert rising.message == ""
    assert rising.solutions[0].error.largest == 0.0


def test_a_force_that_falls_to_nothing_leaves_the_linear_answer():
    """Over fifteen orders the rig is its stuck springs, without loss of terms or division."""
    problem = rig()
    for force in (1.0, 1e-6, 1e-15):
        solution = problem.solve(100.0, force)
        wanted = linear(problem.model, np.array([45e3]), 100.0, problem.load.waves[1])
        assert solution.converged
        np.testing.assert_allclose(solution.motion[0] / force, wanted, rtol=SOLVED)


# --- Grazing


@pytest.mark.parametrize("closer", [0.0, 1e-9, -1e-9, 1e-4, -1e-4, 1e-2])
def test_a_contact_that_is_only_just_touched(closer):
    """The response is continuous for a gap equal to the free amplitude or slightly less.

    At 20 Hz, a fifth of the first natural frequency, the mass moves as it is pushed.
    """
    model, waves = body(), {"x": 1.0, "z": 0.7}
    free = linear(model, np.zeros(3), 20.0, 0.7 * unit_force(model, "z"))[2]
    gap = abs(free) * (1.0 - closer)
    solution = balance(model, contact(gap=gap), waves, highest=9, samples=2048).solve(20.0, 1.0)
    assert solution.converged
    pressing = solution.cycle.samples[:, 0, 2].max()
    # The contact is in the way of no more than what it cuts off.
    depth = max(closer, 0.0) * abs(free)
    assert pressing <= KN * depth * (1.0 + SOLVED)
    assert abs(solution.amplitude(2) - free) <= max(closer, 0.0) * abs(free) + SOLVED * abs(free)
    if closer >= 1e-4:
        assert 0.3 * KN * depth < pressing
        assert solution.cycle.dissipated[0] > 0.0


# --- A harmonic meets the second mode

FIRST, LIMIT = 500.0, 2.0
# Springs for which, between equal masses, ω2 = 3 ω1: 9 (1 + 2 r)² = 100 r.
RATIO = (64.0 + np.sqrt(2800.0)) / 72.0


def pair(harmonics, samples):
    model = lumped_rig(
        {"a": 2e-3, "b": 2e-3},
        {Link("a"): FIRST, Link("b", "a"): FIRST * RATIO},
        [[Link("b")]],
        0.02,
    )
    joints = PeriodicMarch(Jenkins(KT, MU, LIMIT / MU))
    load = PeriodicLoad({1: -1j * unit_force(model, "a")})
    return HarmonicBalance(model, joints, load, Resolution(harmonics, samples))


@pytest.mark.parametrize("held", [slow(0.0), KT])
def test_the_third_harmonic_in_resonance_with_the_second_mode(held):
    """Enough harmonics are exact; one reports what it leaves out, and more are found if asked.

    With the joint free ω2 = 3 ω1: both modes are excited at once where the joint slips far.
    """
    model = pair((1,), 64).model
    modes = natural_frequencies(model)
    assert modes[1] == pytest.approx(3.0 * modes[0], rel=1e-12)
    frequency, force = natural_frequencies(model, held)[1] / 3.0, 3.0
    motion = integrate_exactly(
        model,
        SliderJoints(np.array([KT]), np.array([LIMIT]), np.zeros(1)),
        HarmonicForce(unit_force(model, "a"), force, frequency),
        60.0 / frequency,
        1.0 / (128.0 * frequency),
    )
    wanted = motion.displacement[-129:-1]
    scale = np.abs(wanted).max()
    assert np.abs(motion.displacement[-257:-129] - wanted).max() < 1e-7 * scale

    def error(solution):
        assert solution.converged
        return np.abs(solution.displacement(128) - wanted).max() / scale

    alone = pair((1,), 512).solve(frequency, force)
    assert error(alone) > 0.1
    assert alone.left_out > 0.05
    enough = pair(tuple(range(1, 32, 2)), 2048).solve(frequency, force)
    assert error(enough) < 1e-5
    third = abs(enough.amplitude(1, 3)) / abs(enough.amplitude(1))
    assert third > 0.05
    grown = along_frequency(
        pair((1,), 64), force, (frequency, 1.1 * frequency), accuracy=Accuracy(1e-3)
    )
    assert grown.message == ""
    assert error(grown.solutions[0]) < 2e-3


# --- What cannot be


def test_a_force_that_is_never_reached_is_no_solution():
    """Shaken by 2.5 times its weight the body would be thrown about: raising the force fails.

    Along the undamped free vibration, it would otherwise continue for ever.
    """
    model = body(normal=0.0)
    problem = balance(model, contact(), {"x": 1.0, "z": 20.0}, 8.0, highest=11, samples=512)
    solution = problem.solve(30.0, 1.0)
    assert not solution.converged
    assert "turns back" in solution.message
    assert "start from a solution nearby" in solution.message
