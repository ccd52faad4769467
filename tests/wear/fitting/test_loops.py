"""Joint laws come back from records of their loops, with noise and without."""

import numpy as np
import pytest

from tests.marks import slow
from wear.fitting import fit, loop_data, loop_problem
from wear.fitting.loops import LAWS
from wear.joints import march_joints, measure_loops

COMMON = {"stiffness": 60e3, "friction": 0.9, "residual_stiffness": 1.4e3}
SHAPES = {
    "jenkins": {},
    "uniform_iwan": {},
    "bouc_wen": {"sigma": 0.5, "exponent": 2.0},
    "four_parameter_iwan": {"chi": -0.4, "beta": 0.8},
}
OFFSET = 1.5
# The mean loop joins samples by straight lines, and sliders of any limit round its corners.
DISCRETE = 2e-3


def record(law, stroke, rng=None):
    """A measured record of 6 cycles; noise is 1e-3 of the amplitude, 0.5 % of the force."""
    made = LAWS[law].law(normal_load=60.0, **COMMON, **SHAPES[law])
    motion = 0.5 * stroke * np.sin(2.0 * np.pi * np.arange(3601) / 600)
    history = march_joints(made, made.rest(1), np.zeros((1, 1)), motion[:, None, None])
    force = history.force.ravel() + OFFSET
    if rng is not None:
        motion = motion + 5e-4 * stroke * rng.standard_normal(len(motion))
        force = force + 0.3 * rng.standard_normal(len(force))
    return loop_data("force", measure_loops(motion, force, 60.0))


@pytest.mark.parametrize(
    "law", ["jenkins", "uniform_iwan", slow("bouc_wen"), slow("four_parameter_iwan")]
)
def test_a_law_comes_back(law):
    # Of an exponent, too, that the reversal of a loop hardly shows: sigma is held.
    held = {"normal_load": np.nan} | ({"sigma": 0.5} if law == "bouc_wen" else {})
    found = fit(loop_problem([record(law, 14e-3)], law, held).problem)
    values = {one.name: one.value for one in found.estimates}
    assert values.pop("force.offset") == pytest.approx(OFFSET, abs=1e-2)
    truth = {name: v for name, v in (COMMON | SHAPES[law]).items() if name not in held}
    assert values == pytest.approx(truth, rel=DISCRETE)


@pytest.mark.slow
def test_deviations_of_a_noisy_record_are_those_of_its_repetition():
    """Neighbours err alike where the displacement is smoothed, which stated ones do not know of."""
    trials, found = 10, []
    for seed in range(trials):
        loop = record("jenkins", 14e-3, np.random.default_rng(seed))
        found.append(fit(loop_problem([loop], "jenkins", {"normal_load": 60.0}).problem).estimates)
    for place, truth in enumerate((60e3, 0.9, 1.4e3, OFFSET)):
        values = np.array([estimates[place].value for estimates in found])
        stated = np.mean([estimates[place].deviation for estimates in found])
        scatter = values.std(ddof=1)
        # The scatter of ten is known to a quarter.
        assert 0.5 < scatter / stated < 1.75
        assert abs(values.mean() - truth) < 3.5 * scatter / np.sqrt(trials)


def test_several_strokes_are_fitted_together():
    loops = [record("uniform_iwan", stroke) for stroke in (3e-3, 14e-3)]
    loops = [
        type(one)(**{**vars(one), "name": f"force_{number}"}) for number, one in enumerate(loops)
    ]
    found = fit(loop_problem(loops, "uniform_iwan", {"normal_load": 60.0}).problem)
    values = {one.name: one for one in found.estimates}
    assert values["friction"].value == pytest.approx(0.9, rel=DISCRETE)
    # The loop that slides tells the friction; both tell the stiffness.
    assert values["friction"].shares.sum() == pytest.approx(1.0)
    assert values["friction"].shares[1] > 0.5
