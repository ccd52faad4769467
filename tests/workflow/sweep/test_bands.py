"""Tests of the 95 % bands of a sweep: samples of a fit, and quantiles with their own error."""

import json

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats.qmc import Sobol

from tests.workflow.scenes import BALL
from wear.fitting import VolumeData, VolumeLaw, fit, volume_problem
from workflow.errors import CaseError
from workflow.sweep.bands import FEWEST, band_of, curve_band
from workflow.sweep.design import runs_of
from workflow.sweep.fitted import DrawnParameter, FittedSample, read_fit
from workflow.sweep.schema import load_sweep

FREE = (-np.inf, np.inf)


def parameter(name, value, bounds, *, allowed=FREE, logarithmic=False, entries=None):
    entries = (name,) if entries is None else entries
    return DrawnParameter(name, value, "1", bounds, allowed, logarithmic, entries)


def even(power, columns):
    """Return normal numbers ``(2**power, columns)``, evenly spread and uncorrelated."""
    return ndtri(Sobol(columns, rng=0).random_base2(power))


def test_a_sample_has_the_bounds_of_the_fit():
    """Medians and 95 % bounds equal those of the fit, also for a profile and a logarithm."""
    reported = [
        parameter("a", 3.0, (2.0, 3.5)),
        parameter("b", 1e9, (1e8, 1e10), logarithmic=True),
        parameter("c", 0.99, (0.95, 1.03), allowed=(0.0, 1.0)),
    ]
    values = FittedSample(tuple(reported), np.eye(3)).draw(even(12, 3))
    found = np.quantile(values, [0.025, 0.5, 0.975], axis=0)
    expected = [[2.0, 3.0, 3.5], [1e8, 1e9, 1e10], [0.95, 0.99, 1.0]]
    np.testing.assert_allclose(found.T, expected, rtol=5e-3)
    assert values[:, 2].max() == 1.0


def test_correlation_is_that_of_the_fit_and_bands_are_of_first_order():
    """A result that is linear in a and b has sd² = g C gᵀ, as the fit's own band does."""
    energy = np.linspace(1.0, 6.0, 40)
    rng = np.random.default_rng(3)
    volume = 5.0 * energy + 2.0 + 0.1 * rng.standard_normal(40)
    line = volume_problem([VolumeData("both", energy, volume)], VolumeLaw(offset="intercept"))
    found = fit(line.problem)
    reported = [parameter(one.name, one.value, one.bounds) for one in found.estimates]
    sample = FittedSample(tuple(reported), found.correlation)
    values = sample.draw(even(12, 2))
    assert np.corrcoef(values.T)[0, 1] == pytest.approx(found.correlation[0, 1], abs=5e-3)
    at = np.array([0.5, 3.5, 10.0])
    curve = line.curve(line.data[0], at, None)
    sides = np.quantile([curve(row) for row in values], [0.025, 0.975], axis=0)
    np.testing.assert_allclose((sides[1] - sides[0]) / 2.0, found.band(curve), rtol=0.03)


def test_bands_of_fits_hold_the_truth():
    """95 % of the bands contain the truth, for lines through scattered data sampled by a sweep."""
    energy, at, truth = np.linspace(1.0, 6.0, 6), 9.0, 5.0
    normal, rng, hits = even(9, 1), np.random.default_rng(8), 0
    for _ in range(300):
        volume = truth * energy + rng.standard_normal(6)
        slope = float(energy @ volume / (energy @ energy))
        scatter = np.sum((volume - slope * energy) ** 2) / 5.0
        reach = 2.570582 * np.sqrt(scatter / (energy @ energy))  # Student, 5 degrees of freedom
        reported = parameter("slope", slope, (slope - reach, slope + reach))
        band = band_of(at * FittedSample((reported,), np.eye(1)).draw(normal)[:, 0])
        hits += band["lower"] <= truth * at <= band["upper"]
    assert 0.92 * 300 <= hits <= 0.98 * 300


def test_the_error_of_a_side_is_that_of_order_statistics():
    """Its quantile lies between both in at least 95 of 100 samples; few runs give no error."""
    rng, inside = np.random.default_rng(1), 0
    for _ in range(400):
        low, high = band_of(rng.standard_normal(400))["upper_within"]
        inside += low <= ndtri(0.975) <= high
    assert inside >= 0.95 * 400
    assert band_of(np.arange(145.0))["lower_within"][0] is None
    assert band_of(np.arange(146.0))["lower_within"][0] == 0.0
    fewest = band_of(np.append(np.arange(float(FEWEST)), np.nan))
    assert (fewest["lower"], fewest["upper"]) == pytest.approx((0.0, FEWEST - 1.0))
    assert band_of(np.arange(FEWEST - 1.0)) is None


def test_a_loop_has_a_band_on_each_of_its_ways():
    """Jenkins loops of many µ slide at ± µ P, so both ways have the band of µ."""
    friction = 0.4 + 1e-3 * np.arange(1, 200)  # quantiles are exact
    there = np.linspace(1.0, -1.0, 81)
    loops = []
    for mu in friction:
        back = np.maximum(mu - 4.0 * (1.0 - there), -mu)
        x = np.concatenate([there, -there[1:]])
        loops.append((x, np.concatenate([back, -back[1:]])))
    pieces = curve_band(loops)
    assert len(pieces) == 2
    for piece, sign, at in zip(pieces, (-1.0, 1.0), (0, -1), strict=True):
        sides = sorted((sign * 0.405, sign * 0.595))
        assert (piece.lower[at], piece.upper[at]) == pytest.approx(sides, abs=1e-12)
        assert piece.median[at] == pytest.approx(sign * 0.5)
    short = [(x[:41], y[:41]) for x, y in loops[:-1]] + [(there[:11], 2.0 + 0.0 * there[:11])]
    assert curve_band(short)[0].places[[0, -1]].tolist() == [there[10], 1.0]
    folded = [loops[0], *[(x[:40], y[:40]) for x, y in loops[1:]]]
    assert curve_band(folded) == []


# --- from the file of a fit -----------------------------------------------------------------------


def told_by_fit(**changes):
    friction = {"value": 0.5, "unit": "1", "bounds": [0.4, 0.6], "determined": True, "doubt": ""}
    friction |= {"fitted_as_logarithm": False, "entries": ["friction.coefficient"]}
    radius = {**friction, "value": 20.0, "unit": "mm", "bounds": [19.0, 21.0]}
    radius |= {"entries": ["structure.radius"], "allowed": [0.0, None]}
    names = ["friction", "radius"]
    return {
        "parameters": {"friction": friction | {"allowed": [0.0, None]} | changes, "radius": radius},
        "correlation": {"parameters": names, "matrix": [[1.0, -0.9], [-0.9, 1.0]]},
    }


@pytest.fixture
def load(tmp_path):
    def make(text, reported):
        (tmp_path / "contact.yaml").write_text(BALL, encoding="utf-8")
        (tmp_path / "fit.json").write_text(json.dumps(reported), encoding="utf-8")
        path = tmp_path / "sweep.yaml"
        path.write_text(f"case: contact.yaml\nfit: fit.json\n{text}", encoding="utf-8")
        return load_sweep(path)

    return make


def test_a_sweep_takes_the_parameters_of_a_fit(load):
    vary = "vary: {materials.body_1.young: {values: [100 GPa, 110 GPa]}}\n"
    drawn = runs_of(load(f"{vary}design: sample\nsamples: 400\n", told_by_fit()))
    friction, radius = (
        np.array([float(str(run.values[path]).split()[0]) for run in drawn])
        for path in ("friction.coefficient", "structure.radius")
    )
    assert np.corrcoef(friction, radius)[0, 1] == pytest.approx(-0.9, abs=0.02)
    assert np.quantile(radius, [0.025, 0.975]) == pytest.approx([19.0, 21.0], abs=0.15)
    assert all(str(run.values["structure.radius"]).endswith(" mm") for run in drawn)
    assert {run.values["materials.body_1.young"] for run in drawn} == {"100 GPa", "110 GPa"}


@pytest.mark.parametrize(
    ("text", "changes", "named"),
    [
        ("", {}, "fit: "),
        ("set: {structure.radius: 1 mm}\n", {}, "structure.radius"),
        ("", {"bounds": None}, "fit.json"),
    ],
)
def test_fits_that_do_not_go_with_a_sweep_are_refused(load, text, changes, named):
    with pytest.raises(CaseError, match=named):
        load(text, told_by_fit(**changes))


def test_shared_rates_go_to_all_entries_that_have_them(tmp_path):
    """One rate of two functions (Li's table) is one column of a sample but two entries."""
    from workflow.fit.report import summary
    from workflow.fit.running import run_fit
    from workflow.fit.schema import load_fit

    energy = np.linspace(0.0, 8.0, 20)
    wear = np.exp(-0.3 * energy)
    rng = np.random.default_rng(2)
    mu = 0.34 * (1.12 - 0.12 * wear) + 1e-4 * rng.standard_normal(20)
    load = 745.0 * (0.72 + 0.28 * wear) + 0.2 * rng.standard_normal(20)
    table = np.column_stack([energy, mu, load])
    heading = "energy [kJ], mu, P [N]"
    np.savetxt(tmp_path / "t.csv", table, delimiter=",", header=heading, comments="")
    (tmp_path / "fit.yaml").write_text(
        "title: Two of one rate\nfit: joint_evolution\nmeasurements: [{file: t.csv}]\n"
        "law: uniform_iwan\nshared: [rate]\nevolution:\n"
        "  friction: {kind: exponential, share: 1}\n"
        "  normal_load: {kind: exponential, share: 1}\n",
        encoding="utf-8",
    )
    fitted = run_fit(load_fit(tmp_path / "fit.yaml"))
    (tmp_path / "summary.json").write_text(json.dumps(summary(fitted, "")), encoding="utf-8")
    sample = read_fit(tmp_path / "summary.json")
    assert len(sample.parameters) == 5
    shared = [f"evolution.{name}.rate" for name in ("friction", "normal_load")]
    columns = sample.columns(np.full((1, 5), 0.5))
    assert columns[shared[0]] == columns[shared[1]]
    assert set(shared) < set(sample.entries)
    assert len(sample.entries) == 6
