"""Parameters recovered from loops of known laws, synthesised with noise.

Noise, as a standard deviation over the range, is added to displacement and force.
"""

from functools import cache

import numpy as np
import pytest

from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.types import Material
from tests.marks import slow
from wear.joints.bouc_wen import BoucWen
from wear.joints.iwan import UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.measured.loop_record import MeasuredLoopError, reversals
from wear.joints.measured.measured_loops import mean_estimate, measure_loops

STIFFNESS, RESIDUAL, FRICTION, LOAD = 60e3, 900.0, 0.9, 60.0
LIMIT = FRICTION * LOAD
LAWS = {
    "jenkins": Jenkins(STIFFNESS, FRICTION, LOAD, RESIDUAL),
    "iwan": UniformIwan(STIFFNESS, FRICTION, LOAD, RESIDUAL),
    "bouc_wen": BoucWen(STIFFNESS, FRICTION, LOAD, RESIDUAL),
}
# What Bouc-Wen calls stiffness is the whole initial slope.
STICK = {"jenkins": 60900.0, "iwan": 60900.0, "bouc_wen": 60000.0}
# Strokes over the displacement µN/kt that a stuck contact can give one way: Fantetti's loops at
# 14 µm have 16, those of Li's test 4 have 10.
AMPLITUDE = 4.0 * LIMIT / STIFFNESS
NOISE = 0.005


def harmonic(amplitude, samples, cycles):
    """Return a harmonic motion from within a branch, with a partial cycle at either end."""
    return amplitude * np.sin(2.0 * np.pi * np.arange(int((cycles + 0.9) * samples)) / samples)


def triangular(amplitude, samples, cycles):
    return 2.0 / np.pi * amplitude * np.arcsin(harmonic(1.0, samples, cycles))


def forces(law, displacement):
    marched = march_joints(law, law.rest(1), np.zeros((1, 1)), displacement[:, None, None])
    return marched.force[:, 0, 0]


def noisy(values, noise, generator):
    return values + noise * np.ptp(values) * generator.standard_normal(len(values))


@cache
def clean(name, motion, amplitude, samples, cycles):
    displacement = motion(amplitude, samples, cycles)
    return displacement, forces(LAWS[name], displacement)


def loops(
    name, seed=None, noise=NOISE, motion=harmonic, amplitude=AMPLITUDE, samples=400, cycles=30
):
    displacement, force = clean(name, motion, amplitude, samples, cycles)
    if seed is None:
        return measure_loops(displacement, force, LOAD)
    generator = np.random.default_rng(seed)
    return measure_loops(
        noisy(displacement, noise, generator), noisy(force, noise, generator), LOAD
    )


# --- round trips --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("motion", [harmonic, triangular])
def test_clean_loops_give_the_parameters(name, motion):
    measured = loops(name, motion=motion, cycles=3)
    # The windows end at samples, not where sticking does: of Iwan a bit of a parabola is left.
    assert measured.stick_stiffness == pytest.approx(STICK[name], rel=2e-3)
    # ξ of Bouc-Wen only tends to 1.
    assert measured.friction == pytest.approx(FRICTION, rel=2e-3)
    assert measured.residual_stiffness == pytest.approx(RESIDUAL, rel=0.03)
    assert measured.stroke == pytest.approx(2.0 * AMPLITUDE, rel=1e-12)


# Cycles that bring the standard error of kt to a third of a percent: four times as many where the
# tangent is of a parabola, whose bend has to be found too.
CYCLES = {"jenkins": 30, "iwan": 120, "bouc_wen": 30}


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize(
    ("seed", "noise", "samples"),
    [
        *((0, 0.005, 400), (0, 0.01, 1000)),
        *(slow(seed, 0.005, 400) for seed in range(1, 6)),
        *(slow(seed, 0.01, 1000) for seed in range(1, 3)),
    ],
)
def test_noisy_loops_give_friction_and_stiffness_within_a_percent(name, seed, noise, samples):
    measured = loops(name, seed, noise, samples=samples, cycles=CYCLES[name])
    stick = measured.stick_estimate
    assert stick.value == pytest.approx(STICK[name], rel=0.01)
    assert stick.error < 0.005 * stick.value
    assert abs(stick.value - STICK[name]) < 4.0 * stick.error
    assert mean_estimate(measured.friction).value == pytest.approx(FRICTION, rel=0.01)
    # Of the height of a loop, 1 % is what kr may be wrong by over the stroke.
    allowed = 0.01 * 2.0 * LIMIT / (2.0 * AMPLITUDE)
    assert mean_estimate(measured.residual_stiffness).value == pytest.approx(RESIDUAL, abs=allowed)


@pytest.mark.parametrize("name", LAWS)
def test_errors_are_as_large_as_stated(name):
    """Over seeds the estimates scatter by their standard errors, within a factor of two."""
    sticks = [loops(name, seed, samples=200, cycles=8).stick_estimate for seed in range(20)]
    away = [(stick.value - STICK[name]) / stick.error for stick in sticks]
    assert 0.5 < np.std(away) < 2.0
    assert abs(np.mean(away)) < 1.0


@pytest.mark.parametrize("name", LAWS)
def test_energy_is_that_dissipated(name):
    displacement = harmonic(AMPLITUDE, 4000, 3)
    law = LAWS[name]
    marched = march_joints(law, law.rest(1), np.zeros((1, 1)), displacement[:, None, None])
    measured = measure_loops(displacement, marched.force[:, 0, 0])
    # The first loop of Bouc-Wen's law is not settled: it closes in displacement, not in force.
    for energy, (begin, _, end) in zip(measured.energy[1:], measured.reversals[1:], strict=True):
        # Trapezoids of the step: second order, 4e-7 of a loop here, and more at Jenkins's corners.
        dissipated = marched.dissipated[begin + 1 : end + 1].sum()
        assert energy == pytest.approx(dissipated, rel=1e-5)


def test_noise_does_not_bias_the_energy():
    exact, noisy = loops("jenkins", cycles=3), loops("jenkins", 1, 0.01)
    measured = mean_estimate(noisy.energy)
    assert measured.value == pytest.approx(exact.energy[0], abs=4.0 * measured.error)
    assert measured.error < 2e-3 * measured.value


def test_contact_stiffness_of_parallel_laws_is_without_the_residual_one():
    assert loops("jenkins", cycles=3).contact_stiffness == pytest.approx(STIFFNESS, rel=1e-6)


def test_tangent_of_spheres():
    """Mindlin's loop is no parabola; the tangent has the stated error of 0.4 %."""
    body = Material(115e3, 0.3)
    sphere = ShearedSphere(400.0, 10.0, body, body, 0.7)
    fall = np.linspace(0.0, 0.95 * sphere.sliding_force, 4000)
    moved = np.array([sphere.displacement(force) for force in fall])
    tangent = fall[1] / moved[1]
    force = np.concatenate([fall[-1] - 2.0 * fall, -fall[-1] + 2.0 * fall[1:]])
    path = np.concatenate([moved[-1] - 2.0 * moved, -moved[-1] + 2.0 * moved[1:]])
    measured = measure_loops(path, force, 400.0)
    assert 1.003 < measured.stick_stiffness[0] / tangent < 1.005
    assert not measured.slides


# --- what slides --------------------------------------------------------------------------------


def test_stuck_and_partly_slipping_loops_bound_the_friction():
    """Up to 2 µN/kt, where the last slider of an Iwan joint slips, friction is only bounded."""
    for share in (0.3, 0.6, 0.9, 1.0):
        amplitude = share * 2.0 * LIMIT / STIFFNESS
        for seed in (None, 0):
            measured = loops("iwan", seed, amplitude=amplitude, cycles=3 if seed is None else 30)
            assert not measured.slides, share
            assert measured.stick_estimate.value == pytest.approx(STICK["iwan"], rel=0.01)
            assert np.isnan(measured.friction_force).all()
            with pytest.raises(MeasuredLoopError, match=r"lower bound of 0.* larger stroke"):
                _ = measured.friction
            bound = (LIMIT * share * (2.0 - share) + RESIDUAL * amplitude) / LOAD
            assert mean_estimate(measured.mobilised).value == pytest.approx(bound, rel=0.01)


def test_barely_sliding_loops_are_found():
    measured = loops("jenkins", 0, amplitude=1.5 * LIMIT / STIFFNESS)
    assert measured.slides
    assert mean_estimate(measured.friction).value == pytest.approx(FRICTION, rel=0.01)


def test_normal_load_is_the_mean_of_each_cycle():
    displacement = harmonic(AMPLITUDE, 400, 4)
    force = forces(LAWS["jenkins"], displacement)
    loads = LOAD * (1.0 + 0.1 * np.arange(len(force)) / 400.0)
    measured = measure_loops(displacement, force, loads)
    assert len(measured.steps) == len(measured.energy)
    assert np.diff(measured.normal_load) == pytest.approx(0.1 * LOAD, rel=1e-9)
    assert measured.friction * measured.normal_load == pytest.approx(LIMIT, rel=1e-6)
    assert np.isnan(measure_loops(displacement, force).normal_load).all()
    with pytest.raises(MeasuredLoopError, match="has no normal load"):
        _ = measure_loops(displacement, force).friction


# --- splitting ----------------------------------------------------------------------------------


@pytest.mark.parametrize("motion", [harmonic, triangular])
@pytest.mark.parametrize("noise", [0.0, 0.002, 0.01])
def test_reversals_are_found_in_noise(motion, noise):
    generator = np.random.default_rng(5)
    displacement = noisy(motion(1.0, 500, 20), noise, generator)
    turns = reversals(displacement)[1:-1]
    # 2.5 % of a cycle is 1 % of the stroke, at its turn.
    assert len(turns) == 42
    away = turns - 250 * np.arange(42) - 125
    assert np.abs(away).max() <= (12 if noise else 0)


@pytest.mark.parametrize("start", [0.0, 0.1, 0.25, 0.4, 0.5, 0.75, 0.9])
@pytest.mark.parametrize("repeated", [True, False])
def test_one_closed_period_may_begin_anywhere(start, repeated):
    long = harmonic(AMPLITUDE, 400, 4)
    begin = 800 + int(400 * start)
    period = slice(begin, begin + 400 + repeated)
    measured = measure_loops(long[period], forces(LAWS["jenkins"], long)[period], LOAD)
    assert measured.stick_stiffness == pytest.approx(STICK["jenkins"], rel=1e-6)
    assert measured.friction == pytest.approx(FRICTION, rel=1e-6)
    assert measured.energy == pytest.approx(4.0 * LIMIT * (AMPLITUDE - LIMIT / STIFFNESS), rel=1e-3)
    assert np.isnan(measured.stick_estimate.error)


def test_uneven_times_are_evened():
    time = np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 4000)) / 400.0
    displacement = AMPLITUDE * np.sin(2.0 * np.pi * time)
    measured = measure_loops(displacement, forces(LAWS["iwan"], displacement), LOAD, time)
    assert measured.stick_estimate.value == pytest.approx(STICK["iwan"], rel=0.01)
    assert mean_estimate(measured.friction).value == pytest.approx(FRICTION, rel=1e-3)


def test_displacement_may_drift():
    """The displacement of a vibrometer, an integral, drifts by half a stroke over the record."""
    displacement, force = clean("jenkins", harmonic, AMPLITUDE, 400, 30)
    drift = AMPLITUDE * np.linspace(0.0, 1.0, len(force))
    measured = measure_loops(displacement + drift, force, LOAD)
    assert len(measured.energy) >= 29
    assert mean_estimate(measured.friction).value == pytest.approx(FRICTION, rel=0.01)
    assert measured.stick_estimate.value == pytest.approx(STICK["jenkins"], rel=0.01)


# --- loops that are not alike -------------------------------------------------------------------

KT, SLIP = 20e3, 30.0
RISING = (2.0, 4.0, 6.0, 8.0, 10.0, 12.0)


def strokes(amplitudes, samples=200):
    """Return two cycles of each amplitude [µm] of a slider of 30 N on 20 N/µm, from rest."""
    wave = np.sin(2.0 * np.pi * np.arange(2 * samples) / samples)
    motion = 1e-3 * np.concatenate([*(a * wave for a in amplitudes), [0.0]])
    return motion, forces(Jenkins(KT, 0.5, 60.0), motion)


def slid(amplitude):
    """Return the energy of a loop [N mm] of an amplitude [µm]."""
    return 4.0 * SLIP * max(1e-3 * amplitude - SLIP / KT, 0.0)


def test_rising_strokes_are_steps_and_the_account_is_whole():
    measured = measure_loops(*strokes(RISING), 60.0)
    # The twelfth cycle ends within its backward branch: it is not closed.
    expected = [amplitude for amplitude in RISING for _ in (0, 1)][:-1]
    assert measured.stroke == pytest.approx(2e-3 * np.array(expected), rel=1e-9)
    assert measured.energy == pytest.approx([slid(a) for a in expected], rel=1e-3)
    assert [step.stroke.size for step in measured.steps] == [2, 2, 2, 2, 2, 1]
    for step in measured.steps:
        assert step.stick_estimate.value == pytest.approx(KT, rel=1e-6)
        assert step.friction == pytest.approx(0.5, rel=1e-9)
    with pytest.raises(MeasuredLoopError, match="no common mean"):
        _ = measured.stick_estimate
    # First loading: 30²/2kt and 0.5 µm of slip; 2 µm of slip from one stroke to the next; at the
    # end 21 and 9 µm of slip.
    before, between, after = measured.left_out
    assert before == pytest.approx(0.0225 + 0.015, rel=1e-3)
    assert between == pytest.approx(5 * 0.06, rel=1e-3)
    assert after == pytest.approx(0.9, rel=1e-3)
    whole = measured.energy.sum() + before + between + after
    assert whole == pytest.approx(measured.work[-1], rel=1e-12)


def test_one_cycle_of_each_rising_stroke_closes_on_the_way_to_the_next():
    """Slopes and strokes of triangles, whose corners smoothing would round, are exact."""
    turns = 1e-3 * np.array([0.0, 2.0, -2.0, 4.0, -4.0, 6.0, -6.0, 8.0, -8.0, 0.0])
    motion = np.interp(np.arange(361) / 40.0, np.arange(10), turns)
    measured = measure_loops(motion, forces(Jenkins(KT, 0.5, 60.0), motion), 60.0)
    assert measured.stroke == pytest.approx([4e-3, 8e-3, 12e-3], rel=1e-9)
    assert measured.stick_stiffness == pytest.approx(KT, rel=1e-6)
    assert measured.energy == pytest.approx([slid(2.0), slid(4.0), slid(6.0)], rel=2e-3)


def test_small_strokes_are_found_in_noise():
    motion, force = strokes(RISING)
    generator = np.random.default_rng(1)
    measured = measure_loops(noisy(motion, 0.002, generator), noisy(force, 0.005, generator), 60.0)
    assert [step.stroke.size for step in measured.steps] == [2, 2, 2, 2, 2, 1]
    assert measured.energy == pytest.approx(
        [slid(amplitude) for amplitude in RISING for _ in (0, 1)][:-1], abs=0.02
    )


def test_falling_strokes_close_a_loop_each_and_the_rest_is_reported():
    measured = measure_loops(*strokes(RISING[::-1]), 60.0)
    assert measured.energy == pytest.approx([slid(a) for a in RISING[::-1]], rel=1e-3)
    assert measured.energy.sum() + sum(measured.left_out) == pytest.approx(measured.work[-1])


def test_a_loop_within_another_is_taken_out():
    """The two loops of a slider do not affect each other: both have their own energies."""
    turns = 1e-3 * np.array([0.0, 10.0, 0.0, 4.0, -10.0, 10.0, -10.0, 0.0])
    motion = np.unique(np.arange(len(turns) - 1)[:, None] + np.linspace(0.0, 1.0, 201))
    motion = np.interp(motion, np.arange(len(turns)), turns)
    measured = measure_loops(motion, forces(Jenkins(KT, 0.5, 60.0), motion), 60.0)
    assert measured.stroke == pytest.approx([4e-3, 20e-3], rel=1e-9)
    assert measured.energy == pytest.approx([slid(2.0), slid(10.0)], rel=2e-3)
    assert measured.step.tolist() == [0, 1]


def test_a_dwell_and_a_stuck_contact_change_nothing():
    motion, force = strokes((1.0, 6.0))
    repeats = np.where(np.arange(len(motion)) % 50 == 0, 40, 1)
    still = measure_loops(np.repeat(motion, repeats), np.repeat(force, repeats), 60.0)
    assert still.energy[:2] == pytest.approx([0.0, 0.0], abs=1e-15)
    assert still.energy[2] == pytest.approx(slid(6.0), rel=1e-3)
    assert (still.sliding > 0.0).tolist() == [False, False, True]


def test_friction_that_grows_makes_steps():
    """Loops of one stroke are not similar if the joint wears."""
    motion = harmonic(AMPLITUDE, 400, 20)
    force = forces(LAWS["jenkins"], motion) * np.linspace(1.0, 1.5, len(motion))
    steps = measure_loops(motion, force, LOAD).steps
    assert len(steps) > 5
    for step in steps:
        assert np.ptp(step.energy) < 0.06 * step.energy.mean()


# --- nonsense -----------------------------------------------------------------------------------


def test_records_without_loops_are_refused():
    displacement = harmonic(AMPLITUDE, 400, 3)
    force = forces(LAWS["jenkins"], displacement)
    for wrong in (
        (np.zeros(100), np.zeros(100)),
        ([], []),
        ([0.0, 1.0], [0.0, 1.0]),
        (displacement[:250], force[:250]),
        (displacement, force[:-1]),
        (displacement, force, LOAD * np.ones(3)),
        (displacement, force * np.nan),
        (displacement, force, 0.0),
        (displacement, force, LOAD, displacement),
        (displacement, -force),
        (displacement[::40], force[::40]),
    ):
        with pytest.raises(MeasuredLoopError):
            measure_loops(*wrong)


@pytest.mark.parametrize(
    ("lead", "reason"),
    [
        (85.0, "follows the velocity"),
        (90.0, "follows the velocity"),
        (95.0, "follows the velocity"),
        (135.0, "falls where the displacement grows"),
        (180.0, "falls where the displacement grows"),
        (-90.0, "give energy"),
        (-45.0, "give energy"),
    ],
)
def test_loops_of_no_joint_are_refused_with_the_true_reason(lead, reason):
    """A harmonic force that leads a harmonic motion by an angle from 0 to 180° dissipates."""
    phase = 2.0 * np.pi * np.arange(600) / 200
    with pytest.raises(MeasuredLoopError, match=reason):
        measure_loops(0.01 * np.sin(phase), 10.0 * np.sin(phase + np.radians(lead)), LOAD)


def test_a_spring_and_a_dashpot_lose_the_energy_of_an_ellipse():
    """Up to a lead of 75° the loop is measured: π F x sin φ in a cycle."""
    phase = 2.0 * np.pi * np.arange(3000) / 1000
    for lead in np.radians([10.0, 45.0, 70.0]):
        measured = measure_loops(0.01 * np.sin(phase), 10.0 * np.sin(phase + lead), LOAD)
        assert measured.energy == pytest.approx(0.1 * np.pi * np.sin(lead), rel=1e-4)
        assert measured.force == pytest.approx(10.0, rel=1e-3)


def test_a_motion_that_is_not_harmonic_is_not_smoothed_away() -> None:
    """A joint sticks for 4 % of the cycle, in a rig whose 25th harmonic responds too."""
    law = Jenkins(stiffness=3e4, friction=0.1, normal_load=60.0)
    angle = np.linspace(0.0, 6.0 * np.pi, 3001)
    moved = 0.012 * (np.cos(angle) + 0.003 * np.cos(25.0 * angle))
    settled = march_joints(law, law.rest(1), np.zeros((1, 1)), moved[:1000, None, None])
    cycles = march_joints(law, settled.state, moved[999:1000, None], moved[1000:, None, None])
    measured = measure_loops(moved[1000:], cycles.force[:, 0, 0], 60.0)
    assert measured.stick_estimate.value == pytest.approx(3e4, rel=1e-3)
    assert np.mean(measured.friction) == pytest.approx(0.1, rel=1e-3)
