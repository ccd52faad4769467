"""Tests of first-order bands of a sweep: exact if linear, otherwise with a reported error."""

import json

import numpy as np
import pytest
from ruamel.yaml import YAML
from scipy.special import ndtri
from scipy.stats.qmc import Sobol

from tests.conftest import CASES
from tests.workflow.command_line import invoke, jobs_here
from tests.workflow.scenes import BALL
from tests.workflow.sweep.test_bands import parameter, told_by_fit
from workflow.sweep.design import runs_of
from workflow.sweep.first_order import LINEAR, first_order, positions
from workflow.sweep.fitted import FittedSample
from workflow.sweep.schema import load_sweep

NORMAL = 1.959963984540054


def sample_of(deviations, correlation=None):
    """Return parameters of means 1, 2, 3, ... and relative ``deviations``."""
    reported = [
        parameter(f"p{mean}", mean, (mean * (1 - NORMAL * d), mean * (1 + NORMAL * d)))
        for mean, d in enumerate(deviations, 1)
    ]
    return FittedSample(
        tuple(reported), np.eye(len(reported)) if correlation is None else correlation
    )


def test_what_is_linear_has_g_c_gt():
    """Linear results of three tied parameters, and Archard's volume k P s/H, have g C gᵀ."""
    tied = np.array([[1.0, 0.5, -0.7], [0.5, 1.0, 0.0], [-0.7, 0.0, 1.0]])
    sample = sample_of((0.1, 0.3, 0.2), tied)
    slope, deviations = np.array([2.0, -1.0, 4.0]), np.array([0.1, 0.6, 0.6])
    found = first_order(sample.draw(positions(3)) @ slope + 7.0)
    g = slope * deviations
    assert found.middle == pytest.approx(2.0 - 2.0 + 12.0 + 7.0)
    assert found.half == pytest.approx(NORMAL * np.sqrt(g @ tied @ g))
    assert found.error < 1e-12 * found.half
    volume = first_order(sample_of((0.1,)).draw(positions(1))[:, 0] * 50.0 * 0.2 / 3500.0)
    reported = volume.reported()
    half = NORMAL * 0.1 * 50.0 * 0.2 / 3500.0
    assert reported["upper"] - reported["lower"] == pytest.approx(2.0 * half, rel=1e-9)


@pytest.mark.parametrize("deviation", [0.03, 0.1, 0.3])
@pytest.mark.parametrize(
    ("law", "correlation"),
    [
        (lambda p: np.exp(p[:, 0] + 0.0 * p[:, 1]), 0.0),
        (lambda p: p[:, 0] * p[:, 1], 0.0),
        (lambda p: p[:, 0] / p[:, 1], 0.0),
        (lambda p: p[:, 0] / p[:, 1], -0.9),
        (lambda p: (p[:, 0] - 1.0) ** 2 + p[:, 1], 0.0),
    ],
)
def test_a_nonlinear_result_has_no_band_or_a_known_error(law, correlation, deviation):
    """Reported errors match 65 536 draws within a third, or there is no band."""
    sample = sample_of((deviation,) * 2, np.array([[1.0, correlation], [correlation, 1.0]]))
    found = first_order(law(sample.draw(positions(2))))
    draws = law(sample.draw(ndtri(Sobol(2, rng=0).random_base2(16))))
    sides = np.quantile(draws, [0.025, 0.975])
    off = np.abs(sides - (found.middle + found.half * np.array([-1.0, 1.0]))).max()
    assert found.linear == (found.error <= LINEAR * found.half)
    if found.linear:
        assert off < 1.35 * found.error + 2e-3 * found.half
    else:
        assert off > 0.04 * found.half
        assert found.reported() is None


def load(folder, text):
    (folder / "contact.yaml").write_text(BALL, encoding="utf-8")
    (folder / "fit.json").write_text(json.dumps(told_by_fit()), encoding="utf-8")
    path = folder / "sweep.yaml"
    path.write_text(f"case: contact.yaml\ndesign: linear\n{text}", encoding="utf-8")
    return load_sweep(path)


def test_the_runs_are_the_best_values_and_pairs_around_them(tmp_path):
    """The parameters are correlated ones of a fit and an independent one."""
    young = "materials.body_1.young"
    vary = f"vary: {{{young}: {{distribution: {{kind: lognormal, median: 100 GPa, factor: 2}}}}}}"
    runs = runs_of(load(tmp_path, f"fit: fit.json\n{vary}\n"))
    assert len(runs) == 9
    first = runs[0].values
    assert first["friction.coefficient"] == 0.5
    assert (first["structure.radius"], first[young]) == ("20 mm", "100 GPa")
    ends = [float(runs[k].values[young].split()[0]) for k in (5, 6)]
    assert ends == pytest.approx([100.0 * 2.0**NORMAL, 100.0 / 2.0**NORMAL])
    friction, radius = (
        np.array([float(str(run.values[name]).split()[0]) for run in runs[:5]])
        for name in ("friction.coefficient", "structure.radius")
    )
    moved = np.stack([(friction - 0.5) / 0.1, radius - 20.0])[:, 1::2]
    np.testing.assert_allclose(moved @ moved.T, [[1.0, -0.9], [-0.9, 1.0]], atol=1e-6)


@pytest.mark.slow
def test_a_worn_volume_has_the_band_of_its_coefficient(tmp_path):
    """Three runs of a sliding cylinder give V = k P s/H; its depth is nearly linear."""
    case = YAML(typ="safe").load((CASES / "cylinder_wear.yaml").read_text("utf-8"))
    bodies = {f"body_{n}": {"coefficient": 10.0 ** (-3 - n), "hardness": 3500} for n in (1, 2)}
    case |= {"wear": {"law": "archard", "cycles": 4000, **bodies}, "expect": []}
    with (tmp_path / "cylinder.yaml").open("w", encoding="utf-8") as stream:
        YAML().dump(case, stream)
    (tmp_path / "sweep.yaml").write_text(
        "case: cylinder.yaml\ndesign: linear\nset:\n"
        "  contact.grid: 64\n  error_budget: known\n  output.report: false\n"
        "vary:\n"
        "  wear.body_1.coefficient: {distribution: {kind: normal, mean: 1e-4, deviation: 1e-5}}\n",
        encoding="utf-8",
    )
    with jobs_here():
        ended = invoke("sweep", tmp_path / "sweep.yaml", "--out", tmp_path / "out")
    assert ended.exit_code == 0, ended.stderr
    found = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))["found"]
    volume, other = (found[f"interface.volume_{number}"] for number in (1, 2))
    exact = 1e-4 * 50.0 * 2.0 * 0.01 * 4000.0 / 3500.0
    assert volume["best"] == pytest.approx(exact, rel=1e-6)
    assert volume["band"]["lower"] == pytest.approx(exact * (1.0 - 0.1 * NORMAL), rel=1e-6)
    assert volume["band"]["upper"] == pytest.approx(exact * (1.0 + 0.1 * NORMAL), rel=1e-6)
    assert volume["bent"] < 1e-6
    # That of the other body does not depend on it, pressures bend.
    assert other["band"]["upper"] == pytest.approx(0.1 * exact, rel=1e-6)
    assert 0.0 < found["interface.depth_1"]["bent"] < 0.1
    assert found["interface.peak_pressure.worn"]["band"] is None
    assert "not linear within 10 %" in (tmp_path / "out" / "sweep.log").read_text("utf-8")
