"""Joint laws fitted to records of their loops, with noise and without."""

import numpy as np
import pytest

from tests.marks import slow
from wear.fitting import fit, loop_data, loop_problem
from wear.fitting.loops import LAWS
from wear.joints import march_joints, measure_loops
from wear.joints.bouc_wen_curve import bouc_wen_curve

COMMON = {"stiffness": 60e3, "friction": 0.9, "residual_stiffness": 1.4e3}
SHAPES = {
    "jenkins": {},
    "uniform_iwan": {},
    "bouc_wen": {"sigma": 0.5, "exponent": 2.0},
    "four_parameter_iwan": {"chi": -0.4, "beta": 0.8},
}
OFFSET = 1.5
# Nothing is averaged and turning points are fitted, so that errors are rounding of the solver.
EXACT = 1e-6


def record(law, stroke, rng=None):
    """Return a measured record of 6 cycles.

    The noise is 1e-3 of the amplitude and 0.5 % of the force.
    """
    made = LAWS[law].law(normal_load=60.0, **COMMON, **SHAPES[law])
    motion = 0.5 * stroke * np.sin(2.0 * np.pi * np.arange(3601) / 600)
    history = march_joints(made, made.rest(1), np.zeros((1, 1)), motion[:, None, None])
    force = history.force.ravel() + OFFSET
    if rng is not None:
        motion = motion + 5e-4 * stroke * rng.standard_normal(len(motion))
        force = force + 0.3 * rng.standard_normal(len(force))
    return loop_data("force", measure_loops(motion, force, 60.0))


@pytest.mark.parametrize(
    "law", ["jenkins", "uniform_iwan", "bouc_wen", slow("four_parameter_iwan")]
)
def test_a_law_comes_back(law):
    # An exponent that the reversal of a loop hardly shows is fitted too; sigma is held.
    held = {"normal_load": np.nan} | ({"sigma": 0.5} if law == "bouc_wen" else {})
    found = fit(loop_problem([record(law, 14e-3)], law, held).problem)
    values = {one.name: one.value for one in found.estimates}
    assert values.pop("force.offset") == pytest.approx(OFFSET, abs=1e-2)
    truth = {name: v for name, v in (COMMON | SHAPES[law]).items() if name not in held}
    assert values == pytest.approx(truth, rel=EXACT)


def test_a_bouc_wen_curve_is_marched_once_for_all_but_its_shape():
    """Of all unknowns, turning points and limits among them, only two change the curve."""
    made = loop_problem([record("bouc_wen", 14e-3)], "bouc_wen", {"normal_load": 60.0})
    values = made.problem.starts[0]
    values[made.names["sigma"]] = 0.6
    bouc_wen_curve.cache_clear()
    for place in range(len(values)):
        moved = values.copy()
        moved[place] += 1e-6 * max(abs(values[place]), 1e-3)
        made.problem.predict(moved)
    assert bouc_wen_curve.cache_info().misses == 3


@pytest.mark.slow
def test_deviations_of_a_noisy_record_are_those_of_its_repetition():
    """Errors of neighbours are correlated by smoothing, which stated deviations do not include."""
    trials, found = 10, []
    for seed in range(trials):
        loop = record("jenkins", 14e-3, np.random.default_rng(seed))
        found.append(fit(loop_problem([loop], "jenkins", {"normal_load": 60.0}).problem).estimates)
    for place, truth in enumerate((60e3, 0.9, 1.4e3, OFFSET)):
        values = np.array([estimates[place].value for estimates in found])
        stated = np.mean([estimates[place].deviation for estimates in found])
        scatter = values.std(ddof=1)
        # The scatter of ten records is known to a quarter.
        assert 0.5 < scatter / stated < 1.75
        assert abs(values.mean() - truth) < 3.5 * scatter / np.sqrt(trials)


def test_several_strokes_are_fitted_together():
    loops = [record("uniform_iwan", stroke) for stroke in (3e-3, 14e-3)]
    loops = [
        type(one)(**{**vars(one), "name": f"force_{number}"}) for number, one in enumerate(loops)
    ]
    found = fit(loop_problem(loops, "uniform_iwan", {"normal_load": 60.0}).problem)
    values = {one.name: one for one in found.estimates}
    assert values["friction"].value == pytest.approx(0.9, rel=EXACT)
    # The sliding loop determines the friction; both determine the stiffness.
    assert values["friction"].shares.sum() == pytest.approx(1.0)
    assert values["friction"].shares[1] > 0.5


STIFFNESS, LIMIT, LOAD = 20e3, 30.0, 60.0


def swept(law, amplitudes, samples=100.0, residual=400.0, cycles=2):
    """Return a record of several cycles of each amplitude [µm], which begins at rest."""
    phase = 2.0 * np.pi * np.arange(int(cycles * samples)) / samples
    motion = np.concatenate([*(1e-3 * a * np.sin(phase) for a in amplitudes), [0.0]])
    return motion, forces(law, motion, residual)


def forces(law, motion, residual=400.0):
    made = LAWS[law].law(STIFFNESS, LIMIT / LOAD, LOAD, residual)
    return march_joints(made, made.rest(1), np.zeros((1, 1)), motion[:, None, None]).force.ravel()


def fitted(law, motion, force):
    """Return the estimates of stiffness, friction and residual stiffness."""
    steps = measure_loops(motion, force, LOAD).steps
    data = [loop_data("force", step, 6 // len(steps) or 1) for step in steps]
    return fit(loop_problem(data, law, {"normal_load": LOAD}).problem).estimates[:3]


def holds(estimates, truth):
    return [
        one.determined and one.bounds[0] <= true <= one.bounds[1]
        for one, true in zip(estimates, truth, strict=True)
    ]


@pytest.mark.parametrize("law", ["jenkins", "uniform_iwan"])
@pytest.mark.parametrize("samples", [100.0, 61.3])
@pytest.mark.parametrize("amplitudes", [(3.0, 6.0, 12.0), (12.0, 6.0, 3.0), (4.0, 9.0, 4.0)])
def test_rising_falling_and_block_strokes_give_the_law_exactly(law, samples, amplitudes):
    """Without noise the bounds shrink to the truth, with or without samples at the reversals."""
    found = fitted(law, *swept(law, amplitudes, samples))
    for one, truth in zip(found, (STIFFNESS, LIMIT / LOAD, 400.0), strict=True):
        assert one.value == pytest.approx(truth, rel=EXACT)
        assert one.bounds[0] - EXACT * truth <= truth <= one.bounds[1] + EXACT * truth
        assert one.bounds[1] - one.bounds[0] < EXACT * truth


def test_digits_of_a_file_are_in_the_bounds():
    """Displacements rounded to 1e-6 µm have errors only where a loop is steep."""
    motion, force = swept("jenkins", (2.0, 4.0, 6.0, 8.0), residual=0.0)
    stiffness, friction, residual = fitted("jenkins", motion.round(9), force.round(6))
    assert holds([stiffness, friction], (STIFFNESS, LIMIT / LOAD)) == [True, True]
    assert stiffness.bounds[1] - stiffness.bounds[0] < 1e-6 * STIFFNESS
    assert residual.value < 1e-6 * STIFFNESS


@pytest.mark.parametrize("law", ["jenkins", "uniform_iwan"])
def test_points_of_a_curve_without_its_reversals_give_the_law(law):
    """Branches have random points, none near a reversal, which may be far outside."""
    rng = np.random.default_rng(2)
    turns = 1e-3 * np.array([0.0, *[8.0, -8.0] * 2, *[14.0, -14.0] * 2, 0.0])
    shares = [np.append(np.sort(rng.uniform(0.03, 0.97, 16)), 1.0) for _ in turns[1:]]
    pairs = zip(shares, turns[:-1], turns[1:], strict=True)
    motion = np.concatenate([begin + share * (end - begin) for share, begin, end in pairs])
    force = forces(law, motion)
    inside = np.arange(len(motion)) % 17 != 16
    found = fitted(law, motion[inside], force[inside])
    assert holds(found, (STIFFNESS, LIMIT / LOAD, 400.0)) == [True] * 3
    assert found[0].deviation < 0.1 * STIFFNESS


@pytest.mark.slow
@pytest.mark.parametrize("law", ["jenkins", "uniform_iwan"])
@pytest.mark.parametrize("amplitudes", [(4.0, 8.0, 12.0), (6.0, 6.0, 6.0)])
def test_bounds_of_noisy_records_hold_the_truth_in_95_of_100(law, amplitudes):
    motion, force = swept(law, amplitudes)
    held = []
    for seed in range(30):
        noise = np.random.default_rng(seed).standard_normal((2, len(motion)))
        found = fitted(law, motion + 2e-5 * noise[0], force + 0.3 * noise[1])
        held += holds(found, (STIFFNESS, LIMIT / LOAD, 400.0))
    # There are 90 bounds in correlated groups of three. If they were independent, 76 or fewer would
    # hold in 3 of 10,000 cases.
    assert np.count_nonzero(held) > 76
