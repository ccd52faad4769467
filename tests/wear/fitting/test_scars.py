"""Wear coefficients from worn profiles: closed forms by Archard, alignment, coverage."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from wear.fitting import ComputedScars, FitError, ScarData, common_over, fit, scar_problem

PLACES = np.linspace(-1.0, 1.0, 201)
RADIUS = 10.0
# A cylinder that has worn to b = 0.5 mm: b³ is proportional to the coefficient.
UNIT, WIDTH = 5e-9, 0.5


def cylinder(alpha, x=PLACES):
    """Return a conforming cylinder [mm].

    Its volume is (2/3) b³/R = 2 α µ P s N, its depth (b² - x²)/2R.
    """
    half = WIDTH * (alpha / UNIT) ** (1 / 3)
    return np.maximum(half**2 - x**2, 0.0) / (2.0 * RADIUS)


def runs(*factors):
    known = UNIT * np.array(factors)
    return ComputedScars(known, PLACES, np.stack([cylinder(alpha) for alpha in known]))


def scan(alpha, of, seed=None, scatter=0.0, name="scan", share=1.0, **more):
    """Return a scan that is 0.13 mm off, raised and tilted, at its own points."""
    x = np.linspace(-0.97, 1.03, 160)
    noise = 0.0 if seed is None else scatter * np.random.default_rng(seed).standard_normal(len(x))
    if more.get("aligned"):
        return ScarData(name, x, share * cylinder(alpha, x) + noise, of, **more)
    worn = share * cylinder(alpha, x - 0.13)
    return ScarData(name, x, worn + 2e-3 + 1.5e-3 * x + noise, of, **more)


def test_depths_of_a_flat_punch_are_archards():
    """The depth is h = α µ p 2 s N: the coefficient is the mean depth over that of one run."""
    known, worn = 2e-9, 4e-3
    flat = ComputedScars(np.array([known]), np.array([-2.0, 2.0]), np.full((1, 2), worn))
    depth = worn * np.array([1.1, 1.2, 1.0, 1.15])
    found = fit(scar_problem([ScarData("punch", np.arange(4.0) / 4, depth, flat, True)]).problem)
    alpha = found.estimates[0]
    assert alpha.value == pytest.approx(known * depth.mean() / worn, rel=1e-9)
    error = known / worn * depth.std(ddof=1) / 2.0
    assert alpha.deviation == pytest.approx(error, rel=1e-6)


def test_a_cylinder_between_two_runs_is_met_with_shift_height_and_tilt():
    """Similar scars are powers of the coefficient: two distant runs determine all between them."""
    scars = scar_problem([scan(UNIT, runs(0.5, 1.4))])
    found = fit(scars.problem)
    assert found.values[0] == pytest.approx(UNIT, rel=1e-3)
    middle = 0.5 * (-0.97 + 1.03)
    assert found.values[1:] == pytest.approx([0.13, 2e-3 + 1.5e-3 * middle, 1.5e-3], rel=2e-3)


def test_the_error_of_few_runs_is_reported():
    """One run with twice the coefficient has a large error, a nearer third one a small error."""
    estimated, errors = [], []
    for of in (runs(2.0), runs(1.6, 2.0), runs(1.05, 1.6, 2.0)):
        scars = scar_problem([scan(UNIT, of)])
        found = fit(scars.problem)
        estimated.append(scars.error_of_runs(found)[0])
        errors.append(found.values[0] / UNIT - 1.0)
    assert np.isnan(estimated[0])
    assert abs(errors[0]) > 0.02
    assert abs(errors[1]) < abs(estimated[1])
    assert abs(errors[2]) < 1e-3
    assert abs(estimated[2]) < 0.02


def test_a_change_of_the_depths_moves_the_coefficient_to_first_order():
    scars = scar_problem([scan(UNIT, runs(0.8, 1.2))])
    found = fit(scars.problem)
    deeper = 1.02 * runs(0.8, 1.2).depth
    other = ComputedScars(UNIT * np.array([0.8, 1.2]), PLACES, deeper)
    moved = fit(scar_problem([scan(UNIT, other)]).problem).values[0] / found.values[0] - 1.0
    change = replace(scars, data=(scan(UNIT, other),)).predict(found.values) - found.fitted
    assert scars.moved_by(found, change)[0] == pytest.approx(moved, rel=0.05)
    assert moved < -1e-3


def test_each_body_has_its_share_and_one_may_be_held():
    """Both bodies wear one scar, by the sum of their coefficients."""
    of = runs(0.7, 1.2)
    first = scan(
        *(UNIT, of), name="first", share=0.25, body="body_1", held=0.75 * UNIT, aligned=True
    )
    second = scan(UNIT, of, name="second", share=0.75, body="body_2", aligned=True)
    found = fit(scar_problem([first, second]).problem)
    assert found.values[:2] == pytest.approx(UNIT * np.array([0.25, 0.75]), rel=2e-3)
    alone = fit(scar_problem([first]).problem)
    assert alone.values[0] == pytest.approx(0.25 * UNIT, rel=2e-3)


def test_a_threshold_needs_tests_that_dissipate_more_and_less():
    of, begun = runs(0.5, 1.2), 400.0
    tests = [
        scan(
            (1.0 - begun / energy) * UNIT, of, name=f"scan_{energy:g}", energy=energy, aligned=True
        )
        for energy in (1e3, 4e3)
    ]
    found = fit(scar_problem(tests, threshold=True).problem)
    assert found.values[:2] == pytest.approx([UNIT, begun], rel=5e-3)
    with pytest.raises(FitError, match="all tests have one energy"):
        scar_problem(tests[:1], threshold=True)


@pytest.mark.slow
def test_bounds_hold_the_coefficient_in_95_of_100_trials():
    of, true, scatter = runs(0.8, 1.2), 1.01 * UNIT, 3e-4
    scans = [scan(true, of, seed, scatter) for seed in range(100)]
    bounds = [fit(scar_problem([one]).problem).estimates[0].bounds for one in scans]
    inside = sum(lower <= true <= upper for lower, upper in bounds)
    assert binom.ppf(5e-4, 100, 0.95) <= inside <= 100


def test_profiles_of_two_materials_contradict_each_other():
    of = runs(0.9, 1.1)
    one, like, other = (
        scan(factor * UNIT, of, seed, 1e-4, f"scan_{seed}", aligned=True)
        for seed, factor in enumerate((1.0, 1.0, 1.1))
    )
    chances = []
    for pair in ((one, like), (one, other)):
        problem = scar_problem(pair).problem
        chances.append(common_over(fit(problem), problem.places)[0].chance)
    assert chances[0] > 1e-3
    assert chances[1] < 1e-6


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"x": PLACES[::-1]}, "scan: places do not rise"),
        ({"depth": np.full(201, np.nan)}, "scan: a place or depth is not finite"),
        ({"x": PLACES[:9]}, "scan: 9 places and 201 depths"),
        ({"x": PLACES[:4], "depth": np.ones(4)}, "scan: 4 points, which coefficient, shift"),
    ],
)
def test_scans_without_information_are_refused(change, words):
    entries = {"name": "scan", "x": PLACES, "depth": cylinder(UNIT), "runs": runs(1.0)}
    with pytest.raises(FitError, match=words):
        scar_problem([ScarData(**{**entries, **change})])
    with pytest.raises(FitError, match="twice"):
        runs(1.0, 1.0)
    with pytest.raises(FitError, match="both bodies together"):
        scar_problem([ScarData(**entries), ScarData(**entries, body="body_1")])
