"""Stability of periodic motions against shooting, event-driven integration and Hill's method."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import mathieu_a, mathieu_b

from fe_models.dynamics.curves.bifurcations import find_bifurcations
from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.followed_curve import curve_by_force, curve_by_frequency
from fe_models.dynamics.curves.forced_response import along_force, along_frequency
from fe_models.dynamics.curves.further_branches import further_branches, vibrating_starts
from fe_models.dynamics.curves.motion_recorder import Accuracy
from fe_models.dynamics.excitation import CombinedForces, ConstantForce, HarmonicForce
from fe_models.dynamics.motion import Start
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from fe_models.dynamics.stability import floquet
from fe_models.dynamics.stability.floquet import Floquet
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from tests.fe_models.dynamics.harmonic_rigs import KT, LOAD, MU, balance, contact_rig, pressed, rig
from tests.limits.contact_rigs import body
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from tests.oracles.hill import hill_multipliers
from wear.joints.elastic import ElasticStop, PolynomialSpring
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch

TURN = 2.0 * np.pi
FINE = ContinuationControl(most=0.05)
# x'' + 0.1 x' + x + x³ = F cos ωt.
DAMPING = 0.1


def oscillator(law, harmonics, ratio=0.5 * DAMPING, samples=256, load=None):
    """Return a mass of 1 on a spring of 1 and a joint, driven by cosines."""
    model = lumped_rig({"m": 1.0}, {Link("m"): 1.0}, [[Link("m")]], damping_ratio=ratio)
    load = load or PeriodicLoad({1: unit_force(model, "m")})
    return HarmonicBalance(model, PeriodicMarch(law), load, Resolution(harmonics, samples))


def duffing(highest=11, samples=128):
    return oscillator(
        PolynomialSpring(0.0, cubic=1.0), tuple(range(1, highest + 1, 2)), samples=samples
    )


def shooting_multipliers(force, slope, motion, amplitude, damping=DAMPING):
    """Return multipliers of a mass of 1 by shooting, for a spring's ``force`` and ``slope``."""
    omega = TURN * motion.frequency

    def rates(time, y):
        drive = amplitude * np.cos(omega * time)
        held = slope(y[0])
        return [
            *(y[1], drive - damping * y[1] - force(y[0])),
            *(y[3], -damping * y[3] - held * y[2], y[5], -damping * y[5] - held * y[4]),
        ]

    state = np.array([motion.displacement(1)[0, 0], motion.velocity(1)[0, 0]])
    for _ in range(4):
        begin = [*state, 1.0, 0.0, 0.0, 1.0]
        end = solve_ivp(
            rates, (0.0, TURN / omega), begin, "DOP853", rtol=1e-11, atol=1e-12, max_step=0.02
        ).y[:, -1]
        matrix = end[2:].reshape(2, 2).T
        state = state - np.linalg.solve(matrix - np.eye(2), end[:2] - state)
    multipliers = np.linalg.eigvals(matrix)
    return multipliers[np.argsort(-np.abs(multipliers), kind="stable")]


def agree(found, wanted, tolerance):
    """Return whether multipliers agree, pairs in either order."""
    for value in wanted:
        assert np.abs(np.append(found, 0.0) - value).min() < tolerance, (found, wanted)


@pytest.fixture(scope="module")
def folded():
    branch = along_frequency(duffing(), 0.3, (0.5 / TURN, 2.5 / TURN), control=FINE)
    of = Floquet(branch.problem).stability
    return branch, cache(lambda place: of(branch.solutions[place]))


def test_a_joint_that_sticks_is_a_spring_whose_slider_is_neutral():
    """The multipliers are exactly those of the linear structure, without that of the slider."""
    problem = oscillator(Jenkins(3.0, 0.5, 1e3), (1, 3))
    stability = Floquet(problem).stability(problem.solve(0.3, 1.0))
    exponent = complex(-0.5 * DAMPING, np.sqrt(4.0 - 0.25 * DAMPING**2))
    assert (stability.verdict, stability.neutral) == ("stable", 1)
    agree(
        stability.multipliers, [np.exp(exponent / 0.3), np.exp(exponent.conjugate() / 0.3)], 1e-12
    )


def test_duffing_against_shooting_and_liouville(folded):
    """Liouville's formula gives the product of all multipliers for motions of every kind."""
    branch, stability_at = folded
    for place in range(10, len(branch.solutions), 20):
        motion, stability = branch.solutions[place], stability_at(place)
        wanted = shooting_multipliers(lambda x: x + x**3, lambda x: 1.0 + 3.0 * x**2, motion, 0.3)
        agree(stability.multipliers, wanted, 3e-4)
        lost = np.exp(-DAMPING / motion.frequency)
        assert abs(np.prod(stability.multipliers)) == pytest.approx(lost, rel=1e-4)
        assert (stability.verdict == "stable") == (abs(wanted[0]) < 1.0)


@pytest.mark.parametrize(
    ("value", "share"), [(mathieu_b, 0.2), (mathieu_a, 0.2), (mathieu_b, 1.0), (mathieu_a, 1.0)]
)
def test_duffing_in_one_harmonic_against_mathieu(value, share):
    """Deviations from A cos ωt obey Mathieu's equation, whose characteristic values are known.

    With τ = ωt and without damping, δ'' + (v + 2p cos 2τ) δ = 0 with p = 3 A² / (4 ω²). At a
    characteristic value v both multipliers of a period are 1, and on one side of it one of them is
    above 1.
    """
    border = value(1 if share < 1.0 else 2, share)
    omega = np.sqrt((1.0 - 0.25 * DAMPING**2) / (border - 2.0 * share))
    problem, traces = oscillator(PolynomialSpring(0.0, cubic=1.0), (1,), samples=512), []
    for further in (0.99, 1.0, 1.01):
        size = np.array([omega * further * np.sqrt(share / 0.75), 0.0])
        frequency = omega * further / TURN
        at = problem.evaluate(size, frequency, 0.3, "frequency")
        motion = problem.describe(size, at, frequency, 0.3)
        multipliers = Floquet(problem).stability(motion).multipliers
        traces.append(np.sum(multipliers).real * np.exp(0.5 * DAMPING / frequency))
    assert traces[1] == pytest.approx(2.0, abs=2e-4)
    assert (traces[0] - 2.0) * (traces[2] - 2.0) < 0.0


@pytest.mark.slow
def test_folds_of_duffing_are_where_the_curve_turns_and_a_multiplier_is_1(folded):
    branch, stability_at = folded
    known = [stability_at(place) for place in range(len(branch.solutions))]
    found = find_bifurcations(curve_by_frequency(branch.problem, 0.3), branch.solutions, known)
    assert [each.kind for each in found] == ["fold", "fold"]
    assert [each.unstable for each in found] == [(0, 1), (1, 0)]
    for each in found:
        assert each.multiplier == pytest.approx(1.0, abs=1e-4)
    # Along the force, the folds are at the same motions.
    upper = found[0].motion
    across = along_force(branch.problem, upper.frequency * 0.95, (0.01, 2.0), control=FINE)
    of = Floquet(branch.problem).stability
    stability = [of(motion) for motion in across.solutions]
    curve = curve_by_force(branch.problem, upper.frequency * 0.95)
    turned = find_bifurcations(curve, across.solutions, stability)
    assert [each.kind for each in turned] == ["fold", "fold"]
    assert all(each.multiplier == pytest.approx(1.0, abs=1e-4) for each in turned)


def test_unknown_motions_near_a_fold_do_not_affect_it(folded):
    """Motions without a verdict neither hide a fold of the curve nor contradict it."""
    branch, stability_at = folded
    one = replace(stability_at(10), verdict="unknown", error=np.inf, multipliers=np.empty(0))
    unknown = [one] * len(branch.solutions)
    found = find_bifurcations(curve_by_frequency(branch.problem, 0.3), branch.solutions, unknown)
    assert [each.kind for each in found] == ["fold", "fold"]
    assert [each.unstable for each in found] == [(None, None)] * 2


def test_time_integration_on_both_sides_of_a_fold(folded):
    """A motion that starts 1 % away stays near stable motions and leaves unstable ones."""
    branch, stability_at = folded
    fold = branch.curve.folds[0]
    for place in (fold - 8, fold + 12):
        motion = branch.solutions[place]
        omega = TURN * motion.frequency
        begin = 1.01 * np.array([motion.displacement(1)[0, 0], motion.velocity(1)[0, 0]])
        end = solve_ivp(
            lambda t, y, w=omega: [y[1], 0.3 * np.cos(w * t) - DAMPING * y[1] - y[0] - y[0] ** 3],
            (0.0, 60.0 * TURN / omega),
            begin,
            rtol=1e-9,
        ).y[:, -1]
        away = np.linalg.norm(end - begin / 1.01) / np.linalg.norm(begin)
        assert (away < 1e-3) == (stability_at(place).verdict == "stable")


def test_hill_agrees_for_a_smooth_spring(folded):
    """With deviations in all harmonics up to 15, the sorted exponents agree."""
    branch, stability_at = folded
    for place in range(10, len(branch.solutions), 20):
        hill = hill_multipliers(branch.problem, branch.solutions[place], 15, 256)
        agree(stability_at(place).multipliers, hill, 2e-3)


def exact_period(model, joints, force, frequency, y):
    """Return the state (displacements, velocities, slider) after a period, from event to event."""
    size = len(model.mass)
    start = Start(displacement=y[:size], velocity=y[size:-1], joint_state=y[-1:, None])
    period = 1.0 / frequency
    motion = integrate_exactly(model, joints, force, period, period / 8, start)
    return np.concatenate([motion.displacement[8], motion.velocity[8], motion.joint_state[0]])


@pytest.mark.slow
@pytest.mark.parametrize(("frequency", "amplitude"), [(180.0, 40.0), (210.0, 100.0)])
def test_jenkins_against_event_driven_integration(frequency, amplitude):
    """All multipliers agree, that of the slider included; Hill's method gives other ones."""
    model = rig(0.01)
    problem = balance(model, harmonics=tuple(range(1, 60, 2)), samples=2048)
    motion = problem.solve(frequency, amplitude)
    displacement, velocity = motion.displacement(1)[0], motion.velocity(1)[0]
    slider = model.connection @ displacement - motion.cycle.samples[0, :, 0] / KT
    state, joints = (
        np.concatenate([displacement, velocity, slider]),
        SliderJoints(np.array([KT]), np.array([MU * LOAD]), np.zeros(1)),
    )
    force = HarmonicForce(unit_force(model, "m1"), amplitude, frequency)
    steps = np.array([1e-9, 1e-9, 1e-6, 1e-6, 1e-9])
    matrix = np.empty((5, 5))
    for column, step in enumerate(steps):
        away = step * np.eye(5)[column]
        ends = [exact_period(model, joints, force, frequency, state + s * away) for s in (1, -1)]
        matrix[:, column] = (ends[0] - ends[1]) / (2.0 * step)
    exact = np.linalg.eigvals(matrix)
    stability = Floquet(problem).stability(motion)
    assert (stability.verdict, stability.neutral) == ("stable", 0)
    agree(stability.multipliers, exact, 2e-3)
    hill = hill_multipliers(problem, motion, 31, 512)
    assert max(np.abs(hill - value).min() for value in exact) > 0.02


def test_without_damping_there_is_no_verdict():
    """The multipliers are on the unit circle, and rounding must not decide the verdict."""
    model = contact_rig()
    law = PeriodicMarch(FrictionContact(300.0, 400.0, 0.5, 10.0))
    resolution = Resolution((0, 1, 2, 3), 128)
    problem = HarmonicBalance(model, law, pressed(model, 10.0, 1.0, 1.0), resolution)
    stability = Floquet(problem).stability(problem.solve(40.0, 1.0))
    assert stability.verdict == "unknown"
    assert stability.largest == pytest.approx(1.0, abs=1e-9)
    assert "as close to 1 as its error" in stability.message


@pytest.mark.slow
@pytest.mark.parametrize(("frequency", "state"), [(70.0, 2), (95.0, 1)])
def test_a_contact_in_three_directions_against_fine_steps(frequency, state):
    """Newmark's method integrates one period from nearby states.

    The contact slips along a circle under a changing load, and separates.
    """
    model = body(normal=100.0, ratio=0.02)
    law = FrictionContact(300.0, 400.0, 0.5, 10.0)
    load = pressed(model, 10.0, 6.0, 3.0)
    problem = HarmonicBalance(model, PeriodicMarch(law), load, Resolution(tuple(range(20)), 512))
    motion = problem.solve(frequency, 1.0)
    assert (motion.cycle.states == state).any()
    stability = Floquet(problem).stability(motion)
    size, period = 3, 1.0 / frequency
    force = CombinedForces(
        (
            HarmonicForce(
                6.0 * unit_force(model, "x") + 3.0 * unit_force(model, "z"),
                1.0,
                frequency,
                0.5 * np.pi,
            ),
            ConstantForce(10.0 * unit_force(model, "z")),
        )
    )
    displacement, velocity = motion.displacement(1)[0], motion.velocity(1)[0]
    stretch = motion.cycle.samples[0, 0, :2] / 300.0
    state = np.concatenate([displacement, velocity, stretch])

    def after(y):
        joint = np.array([[y[6], y[7], y[2]]])
        start = Start(displacement=y[:size], velocity=y[size:6], joint_state=joint)
        end = integrate(model, law, force, period, TimeStepControl(period / 2000), start)
        last = np.array([end.displacement[-1], end.velocity[-1]]).ravel()
        return np.concatenate([last, end.joint_state[0, :2]])

    assert np.abs(after(state)[:3] - state[:3]).max() < 2e-2 * np.abs(displacement).max()
    matrix = np.empty((8, 8))
    for column in range(8):
        away = 1e-6 * np.abs(state[3:6] if 3 <= column < 6 else state[:3]).max() * np.eye(8)[column]
        matrix[:, column] = (after(state + away) - after(state - away)) / (2.0 * away[column])
    exact = np.linalg.eigvals(matrix)
    assert stability.verdict == "stable"
    agree(stability.multipliers, exact[np.abs(exact) > 0.05], 1e-2)


@pytest.mark.slow
def test_a_mass_on_a_stop_through_grazing():
    """Before contact the multipliers are those of the free mass; beyond, those of shooting."""
    law = ElasticStop(stiffness=3.0, gap=1.0)
    problem = oscillator(law, tuple(range(41)), ratio=0.05, samples=2048)
    branch = along_frequency(problem, 0.4, (0.8 / TURN, 1.8 / TURN), control=FINE)
    of = Floquet(problem).stability
    stability = [of(motion) for motion in branch.solutions]
    touches = np.array([(motion.cycle.states != 2).any() for motion in branch.solutions])
    assert 0 < touches.sum() < len(touches)
    first = int(np.argmax(touches))
    for place in (first - 1, first, first + 1, *np.flatnonzero(touches)[::15]):
        motion = branch.solutions[place]
        wanted = shooting_multipliers(
            lambda x: x + 3.0 * max(x - 1.0, 0.0), lambda x: 1.0 + 3.0 * (x > 1.0), motion, 0.4
        )
        # Where the stop is just touched, the contact time depends strongly on the motion.
        agree(stability[place].multipliers, wanted, 5e-3 + 2.0 * stability[place].error)


@pytest.mark.slow
def test_a_period_doubles_where_time_integration_doubles_it():
    """Beyond a multiplier of -1 only every second period is the same.

    The static load removes the symmetry of the oscillator.
    """
    model = duffing().model
    load = PeriodicLoad({1: unit_force(model, "m")}, static=1.5 * unit_force(model, "m"))
    problem = oscillator(PolynomialSpring(0.0, cubic=1.0), tuple(range(13)), load=load)
    branch = along_frequency(problem, 1.5, (0.8 / TURN, 1.3 / TURN), control=FINE)
    of = Floquet(branch.problem).stability
    known = [of(motion) for motion in branch.solutions]
    found = find_bifurcations(curve_by_frequency(problem, 1.5), branch.solutions, known)
    doubled = [each for each in found if each.kind == "period_doubling"]
    assert [each.unstable for each in doubled] == [(0, 1), (1, 0)]
    assert all(each.multiplier == pytest.approx(-1.0, abs=1e-5) for each in doubled)
    inside = branch.solutions[(doubled[0].after + doubled[1].after + 1) // 2]
    omega = TURN * inside.frequency
    begin = [1.001 * inside.displacement(1)[0, 0], inside.velocity(1)[0, 0]]
    periods = TURN / omega * np.array([200.0, 201.0, 202.0])
    ends = solve_ivp(
        lambda t, y: [y[1], 1.5 + 1.5 * np.cos(omega * t) - DAMPING * y[1] - y[0] - y[0] ** 3],
        (0.0, periods[-1]),
        begin,
        t_eval=periods,
        rtol=1e-10,
        atol=1e-12,
    ).y.T
    assert np.abs(ends[2] - ends[0]).max() < 1e-4
    assert np.abs(ends[1] - ends[0]).max() > 1e-2


@pytest.mark.slow
def test_motions_of_a_third_of_the_frequency_are_on_a_closed_branch():
    """Duffing's subharmonic motions form a closed branch that no end of the span leads to."""
    model = lumped_rig({"m": 1.0}, {Link("m"): 1.0}, [[Link("m")]], damping_ratio=0.04)
    load = PeriodicLoad({3: unit_force(model, "m")})
    resolution = Resolution(tuple(range(1, 16, 2)), 128)
    spring = PeriodicMarch(PolynomialSpring(0.0, cubic=1.0))
    problem = HarmonicBalance(model, spring, load, resolution)
    span = (0.7 / TURN, 6.0 / TURN)
    branch = along_frequency(problem, 5.0, span, control=FINE)
    assert branch.first_amplitudes(0).max() < 1e-9
    at = 1.4 / TURN
    starts = list(vibrating_starts(problem, at, 1.2, np.ones(1)))
    found = further_branches(problem, 5.0, span, starts, at, [branch.solutions], control=FINE)
    # The same motion, shifted by one, two or three periods of the force, is a different one.
    assert [each.closed for each in found] == [True] * 3
    for each in found:
        assert each.first_amplitudes(0).min() > 0.1
        of = Floquet(problem).stability
        verdicts = {of(motion).verdict for motion in each.solutions}
        assert {"stable", "unstable"} <= verdicts
    again = further_branches(
        problem, 5.0, span, starts, at, [branch.solutions, *(each.solutions for each in found)]
    )
    assert again == ()


def test_further_branches_are_as_accurate_as_requested():
    """Harmonics are added on the way, also to the motion from which the branch is followed."""
    problem, at = duffing(1), 1.4 / TURN
    start = problem.guess(problem.solve(at, 0.3))
    accuracy = Accuracy(1e-3)
    (branch,) = further_branches(
        problem, 0.3, (0.5 * at, 1.5 * at), [start], at, [], accuracy=accuracy
    )
    assert branch.message == ""
    assert max(motion.error.largest for motion in branch.solutions) <= accuracy.tolerance
    assert 3 in branch.problem.resolution.harmonics


def test_a_reduced_structure_has_the_multipliers_of_all_modes(monkeypatch):
    """Few of many modes are dynamic: with the others quasi-static, multipliers hardly change.

    Many times are taken, since steps are not divided where the slider slips.
    """
    monkeypatch.setattr(floquet, "LARGE_SAMPLES", 2048)
    names = [f"m{number}" for number in range(12)]
    links = [Link(name, before) for name, before in zip(names, [None, *names], strict=False)]
    model = lumped_rig(
        dict.fromkeys(names, 1e-3), dict.fromkeys(links, 1e5), [[Link(names[-1])]], 0.01
    )
    law = Jenkins(5e4, 0.5, 4.0)
    problem = HarmonicBalance(
        model,
        PeriodicMarch(law),
        PeriodicLoad({1: unit_force(model, names[0])}),
        Resolution((1, 3, 5, 7), 512),
    )
    motion = problem.solve(150.0, 40.0)
    whole = Floquet(problem).stability(motion)
    few = Floquet(problem, most_modes=0).stability(motion)
    assert whole.verdict == few.verdict == "stable"
    agree(few.multipliers[:4], whole.multipliers[:4], 2e-3)
    assert np.any(motion.cycle.states == 1)


def test_joints_without_linearisation_have_no_verdict():
    problem = duffing()
    motion = problem.solve(0.2, 0.3)

    class Silent:
        directions = 1

        def settle(self, *arguments):
            return problem.joints.settle(*arguments)

    silent = HarmonicBalance(problem.model, Silent(), problem.load, problem.resolution)
    stability = Floquet(silent).stability(replace(motion))
    assert stability.verdict == "unknown"
    assert "cannot be linearised" in stability.message
