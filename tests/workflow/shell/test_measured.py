"""Tests of measured points and computed curves: known deviations, and refused comparisons."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.conftest import CASES
from workflow.case.sections import Case, Measured
from workflow.errors import UserError
from workflow.kinds import load_case
from workflow.layout.declared import Layout
from workflow.messages.warning_kinds import WarningKind
from workflow.pictures.measured import MEASURED, with_measured
from workflow.shell.analysis import Pictures
from workflow.shell.output.curves import Curve
from workflow.shell.output.measured import (
    MeasuredPoints,
    check_measured,
    compared,
    comparison_warnings,
    lines_of_measured,
    read_points,
    reported,
    tell_measured,
)
from workflow.shell.output.quantities import CurvesOf
from workflow.shell.output.results import writing

DEPTH = CurvesOf("depth", "kinetics/*/depth")
VOLUME = CurvesOf("volume", "kinetics/*/volume")
LAYOUT = Layout.read("""
kinetics
    cycles | 1 | cycles | cycles
kinetics/<face>
    depth | mm | cycles | worn depth
    volume | mm^3 | cycles | worn volume
""")
INLINE = {"curve": "depth", "at": [100.0], "values": ["3 um"], "source": "made up"}


def entry(**given: Any) -> Measured:
    return Measured.model_validate({**INLINE, **given})


def curve(x: np.ndarray, y: np.ndarray, unit: str = "1") -> Curve:
    return Curve("depth", x, y, "cycles", "depth", "1", unit, False)


def from_file(file: Path, **given: Any) -> Measured:
    return Measured.model_validate(
        {"curve": "depth", "source": "made up", "file": str(file), **given}
    )


def test_noise_of_known_size_has_its_chi_square_and_points_on_the_curve_have_none() -> None:
    x = np.linspace(0.0, 1.0, 101)
    line = curve(x, 2.0 * x + 1.0)
    places, sigma = np.linspace(0.01, 0.99, 400), 0.05
    exact = reported(compared(entry(), line, MeasuredPoints(places, 2.0 * places + 1.0, None)))
    assert exact["rms_deviation"] < 1e-14
    assert exact["interpolation_error"] < 1e-14
    assert "reduced_chi_square" not in exact
    noise = np.random.default_rng(7).normal(0.0, sigma, places.size)
    points = MeasuredPoints(places, 2.0 * places + 1.0 + noise, np.full(places.size, sigma))
    found = reported(compared(entry(), line, points))
    # For n independent points chi² per point is 1 with a standard deviation of sqrt(2/n).
    assert abs(found["reduced_chi_square"] - 1.0) < 4.0 * np.sqrt(2.0 / places.size)
    assert found["mean_deviation"] == pytest.approx(-noise.mean(), abs=1e-14)
    assert found["rms_deviation"] == pytest.approx(np.sqrt(np.mean(noise**2)))
    assert found["largest"]["at"] == places[np.argmax(np.abs(noise))]


def test_error_of_interpolation_is_that_of_a_parabola() -> None:
    x = np.linspace(0.0, 1.0, 11)
    inner = np.linspace(0.11, 0.89, 57)
    beside = compared(entry(), curve(x, x**2), MeasuredPoints(inner, inner**2, None))
    assert beside.error == pytest.approx(np.abs(beside.computed - inner**2).max(), rel=1e-9)
    ends = np.array([0.03, 0.97])
    beside = compared(entry(), curve(x, x**2), MeasuredPoints(ends, ends**2, None))
    assert beside.error is not None
    assert beside.error >= np.abs(beside.computed - ends**2).max() > 0.0
    two = compared(entry(), curve(x[[0, -1]], x[[0, -1]]), MeasuredPoints(ends, ends, None))
    assert two.error is None


def test_loop_is_compared_with_its_nearest_branch_and_nothing_is_extrapolated() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 4001)
    circle = curve(np.cos(angle), np.sin(angle))
    points = MeasuredPoints(np.array([0.6, 0.6, 1.5]), np.array([0.8, -0.7, 0.0]), None)
    found = reported(compared(entry(), circle, points))
    assert found["nearest_of_several_branches"]
    assert found["outside"] == [1.5]
    assert found["points"] == 2
    assert found["largest"]["computed"] == pytest.approx(-0.8, abs=1e-5)
    assert found["mean_deviation"] == pytest.approx(-0.05, abs=1e-5)
    none = reported(
        compared(entry(), circle, MeasuredPoints(np.array([2.0]), np.array([0.0]), None))
    )
    assert none["points"] == 0
    assert not list(lines_of_measured([none]))
    assert next(comparison_warnings([none])).kind is WarningKind.NOT_COMPARED


def test_table_is_read_in_its_units_with_deviations(tmp_path: Path) -> None:
    file = tmp_path / "depths.csv"
    file.write_text("at,d [um],d_deviation [nm]\n10,3,200\n20,4,300\n")
    points = read_points(from_file(file, columns={"values": "d"}), "1", "mm")
    np.testing.assert_allclose(points.y, [3e-3, 4e-3], rtol=1e-14)
    np.testing.assert_allclose(points.deviations, [2e-4, 3e-4], rtol=1e-14)
    share = read_points(entry(relative_deviation="5 %"), "1", "mm")
    np.testing.assert_allclose(share.deviations, [1.5e-4], rtol=1e-14)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return depth and volume of a contact, whose numbers differ by a factor of a thousand."""
    path = tmp_path / "results.h5"
    cycles = np.linspace(0.0, 1e4, 51)
    with writing(path, LAYOUT) as writer:
        writer.put("kinetics", {"cycles": cycles})
        worn = {"depth": 3e-5 * cycles / 100.0, "volume": 3e-2 * cycles / 100.0}
        writer.put("kinetics/pad", worn)
    return path


def case_of(*measured: Measured) -> Case:
    return load_case(CASES / "rig_bouc_wen.yaml").model_copy(update={"measured": measured})


def test_what_cannot_be_compared_is_a_warning_not_the_end_of_a_run(results: Path) -> None:
    case = case_of(entry(), entry(curve="depth, flank"))
    check_measured(case, [DEPTH], LAYOUT)
    good, nowhere = tell_measured(case, [DEPTH, VOLUME], results)
    assert good["curve"] == "depth, pad"
    assert good["mean_deviation"] == pytest.approx(-3e-3 + 3e-5)
    assert "allowed: depth, pad; volume, pad" in nowhere["refused"]
    assert len(list(comparison_warnings([good, nowhere]))) == 1


@pytest.mark.parametrize(
    ("given", "named"),
    [({"curve": "colour"}, "curve"), ({"values": ["3 N"]}, "values"), ({"at": ["3 J"]}, "at")],
)
def test_points_of_no_curve_are_refused_before_a_run(given: dict[str, Any], named: str) -> None:
    with pytest.raises(UserError, match=rf"measured\.0\W+{named}"):
        check_measured(case_of(entry(**given)), [DEPTH], LAYOUT)


def test_points_are_drawn_where_the_curve_is_and_nowhere_else(results: Path) -> None:
    def draw(file: h5py.File) -> Figure:
        figure = Figure()
        left, right, other = figure.subplots(1, 3)
        cycles, depth = file["kinetics/cycles"][()], file["kinetics/pad/depth"][()]
        left.plot(cycles, 1e3 * depth)
        left.set_ylabel("depth [µm]")
        right.plot(cycles, file["kinetics/pad/volume"][()])
        right.set_ylabel("volume [mm³]")
        other.plot(cycles, 2e3 * depth)
        other.set_ylabel("depth [µm]")
        return figure

    plain = Pictures(lambda _: {"kinetics": draw})
    pictures = with_measured(plain, [entry(deviation="1 um")], [DEPTH, VOLUME])
    with h5py.File(results) as file:
        drawn = {name: figure(file) for name, figure in pictures.figures_of(None).items()}
    assert [len(axis.containers) for axis in drawn["kinetics"].axes] == [1, 0, 0]
    points = drawn["kinetics"].axes[0].containers[0].lines[0]
    np.testing.assert_allclose(points.get_xydata(), [[100.0, 3.0]])
    assert len(drawn[MEASURED].axes) == 2
