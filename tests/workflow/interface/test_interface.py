"""Tests of ``import fretscale``: cases from dictionaries, runs, and results as arrays."""

import json
import re
import shutil
import warnings
from pathlib import Path

import fretscale
import numpy as np
import pytest
import xarray

from tests.conftest import CASES
from tests.workflow.shell.interruptions import ctrl_c_after_jumps

SPHERE = CASES / "sphere_normal.yaml"
SMALL = {"contact__grid": [32, 32], "output__paraview": False, "output__figures": False}
# A ball that is pressed, and pushed back and forth.
BALL = {
    "title": "Ball on a flat",
    "analysis": "contact",
    "structure": {"kind": "bodies", "shape": "sphere", "radius": "10 mm"},
    "materials": {
        "body_1": {"young": "115 GPa", "poisson": 0.29},
        "body_2": {"young": 115e3, "poisson": np.float64(0.29)},
    },
    "friction": {"coefficient": 0.7},
    "load_path": {"legs": [{"P": "400 N"}, {"Qx": 200}, {"Qx": -200.0}]},
    "contact": {"grid": np.array([32, 32]), "size": ("1 mm", "1 mm")},
    "output": {"paraview": False, "figures": False},
}


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    return fretscale.run(BALL, tmp_path_factory.mktemp("ball") / "out", quiet=True)


# --- cases ----------------------------------------------------------------------------------------


def test_a_dictionary_is_the_same_case_as_its_file():
    from workflow.case.source import Source

    text = SPHERE.read_text("utf-8")
    assert fretscale.load_case(Source(str(SPHERE), text).data) == fretscale.load_case(SPHERE)


def test_files_of_a_dictionary_are_looked_for_from_the_current_folder(tmp_path, monkeypatch):
    legs = "P [N]\n400\n"
    monkeypatch.chdir(tmp_path)
    case = BALL | {"load_path": {"file": Path("legs.csv")}}
    with pytest.raises(fretscale.CaseError, match=r"^the case: load_path\.file: 'legs.csv': no "):
        fretscale.load_case(case)
    Path("legs.csv").write_text(legs, encoding="utf-8")
    assert fretscale.load_case(case).load_path.file == str(tmp_path / "legs.csv")


@pytest.mark.parametrize(
    ("name", "value"),
    [("wear.cycles", "many"), ("wear.cycles", None), ("contact.grd", 3), ("contact", {"grid": 3})],
)
def test_a_wrong_override_is_refused_as_on_the_command_line(name, value, dovetail_path):
    from workflow.kinds import load_case

    text = value if isinstance(value, str) else json.dumps(value)
    with pytest.raises(fretscale.CaseError) as there:
        load_case(dovetail_path, [f"{name}={text}"])
    with pytest.raises(fretscale.CaseError) as here:
        fretscale.load_case(dovetail_path, **{name.replace(".", "__"): value})
    assert str(here.value) == str(there.value)


@pytest.mark.parametrize(
    ("case", "named"),
    [
        ({}, "analysis"),
        ([BALL], "list"),
        (BALL | {"title": object()}, "title"),
        (BALL | {"frction": {}}, "'friction'"),
        ("no.yaml", "no.yaml"),
    ],
)
def test_a_wrong_case_is_refused(case, named):
    with pytest.raises(fretscale.CaseError, match=named):
        fretscale.load_case(case)


def test_overrides_change_a_loaded_case():
    case = fretscale.load_case(SPHERE)
    assert fretscale.load_case(case) is case
    changed = fretscale.load_case(
        case, friction__coefficient="60 %", **{"load_path.legs.0.P": "1 kN"}
    )
    assert changed.friction.coefficient == 0.6
    assert changed.load_path.legs[0].P == 1000.0


def test_check_returns_what_the_command_prints(monkeypatch):
    checked = fretscale.check(SPHERE, contact__grid=[64, 64])
    assert "64 x 64 cells" in dict(checked.outline)["contact"]
    assert "64 x 64 cells" in str(checked)
    assert checked.memory > 1e9
    implausible = fretscale.check(SPHERE, materials__body_1__young="210 MPa")
    assert "210 MPa" in implausible.plausibility_warnings[0]
    assert f"warning: {implausible.plausibility_warnings[0]}" in str(implausible)
    monkeypatch.setattr("workflow.shell.memory._available_bytes", lambda: 1e9)
    with pytest.raises(fretscale.OutOfMemory, match=r"1\.0 GB are free"):
        fretscale.check(SPHERE)


# --- runs -----------------------------------------------------------------------------------------


def test_a_run_is_found_again(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    first = fretscale.run(SPHERE, **SMALL)
    assert "run: Sphere" in capfd.readouterr().err
    assert first.folder.parent == tmp_path / "out"
    assert first.folder.name.startswith("sphere_normal-")
    written = first.folder.joinpath("results.h5").stat().st_mtime_ns
    again = fretscale.run(SPHERE, quiet=True, **SMALL)
    assert again.folder == first.folder
    assert again.folder.joinpath("results.h5").stat().st_mtime_ns == written
    other = fretscale.run(SPHERE, quiet=True, **SMALL | {"friction__coefficient": 0.1})
    assert other.folder != first.folder
    assert not capfd.readouterr().err


def test_another_case_is_in_the_way(ball, tmp_path):
    folder = shutil.copytree(ball.folder, tmp_path / "out")
    with pytest.raises(fretscale.UserError, match="holds the results of another case"):
        fretscale.run(BALL, folder, friction__coefficient=0.1)
    forced = fretscale.run(BALL, folder, force=True, quiet=True, friction__coefficient=0.8)
    assert forced.case.friction.coefficient == 0.8


@pytest.mark.slow
def test_an_interrupted_run_goes_on(tmp_path):
    case = fretscale.load_case(CASES / "sphere_wear.yaml", **SMALL, error_budget="known")
    with ctrl_c_after_jumps(1), pytest.raises(KeyboardInterrupt):
        fretscale.run(case, tmp_path / "out", quiet=True)
    with pytest.raises(fretscale.UserError, match="not finished; continue with"):
        fretscale.open(tmp_path / "out")
    results = fretscale.run(case, tmp_path / "out", quiet=True)
    assert "resume" in results.folder.joinpath("run.log").read_text("utf-8")


# --- results --------------------------------------------------------------------------------------


def coordinates_of(group):
    """Return the names of all coordinates of the datasets of a group."""
    below = [coordinates_of(item) for item in group.values() if isinstance(item, fretscale.Group)]
    arrays = [item for item in group.values() if not isinstance(item, fretscale.Group)]
    return set().union(*below, *(array.coords for array in arrays))


def opened_by_xarray(folder):
    """Return the results of a run as xarray opens them by itself."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return xarray.open_datatree(folder / "results.h5", engine="h5netcdf")


def test_results_have_units_and_descriptions(ball):
    assert ball.title == "Ball on a flat"
    assert ball.case == fretscale.load_case(BALL)
    assert ball.summary["title"] == ball.title
    assert ball.warnings == ball.summary["warnings"]
    assert "digests" not in ball.summary
    pressure = ball["contact/bodies/00003/pressure"]
    assert (pressure.units, pressure.long_name) == ("MPa", "contact pressure")
    assert pressure.dims == ("x", "y")
    assert "pressure (x 32, y 32) [MPa]: contact pressure" in ball.tree()
    assert "contact" in repr(ball)
    assert "Ball on a flat" in ball._repr_html_()
    assert ball["contact"]["bodies"].attributes == {}
    assert ball["contact/bodies/00003"].attributes == {"increment": 3}
    with pytest.raises(KeyError, match=r"contcat: not there; the results: case, contact"):
        ball["contcat"]


def test_main_results_have_units_and_errors(ball, tmp_path):
    pressure = next(result for result in ball.main if "pressure" in result.name)
    assert pressure.unit == "MPa"
    states = ball.summary["states"]
    assert pressure.value == pytest.approx(states[-1]["peak_pressure"], rel=1e-12)
    page = ball.report(tmp_path / "for_others.html")
    assert ball.title in page.read_text(encoding="utf-8")


def test_datasets_are_labelled_arrays(ball):
    pressure = ball["contact/bodies/00001/pressure"]
    x, y = pressure.coords["x"], pressure.coords["y"]
    assert x.units == "mm"
    cell = float((x[1] - x[0]) * (y[1] - y[0]))
    assert float(pressure.sum()) * cell == pytest.approx(400.0, rel=1e-6)


def test_xarray_opens_the_results_as_they_are(ball):
    tree = opened_by_xarray(ball.folder)
    for path in ("contact/bodies/00003", "history", "grid/bodies", "surfaces/bodies"):
        xarray.testing.assert_identical(
            tree[path].to_dataset(inherit=False).drop_attrs(), ball[path].xarray().drop_attrs()
        )
    shear = tree["contact/bodies/00003/shear"]
    assert shear.dims == ("component", "x", "y")
    assert (shear.units, shear.x.units) == ("MPa", "mm")
    assert tree["path"].dims == {"row": 3}


@pytest.mark.slow
def test_axes_of_a_wear_run_have_their_coordinates(whole):
    results = fretscale.open(whole.folder)
    assert coordinates_of(results) == {"x", "y", "cycles"}
    tree = opened_by_xarray(whole.folder)
    depth = tree["kinetics/intrados/depth_1"]
    np.testing.assert_array_equal(depth.cycles, results["kinetics/cycles"])
    jumps = results["surfaces/intrados"].xarray()
    assert jumps["body_1"].dims == ("cycles", "x", "y")
    assert list(jumps["cycles"].values) == list(results["kinetics/cycles"])
    new = results["surfaces/intrados/00000/body_1"]
    assert (jumps.body_1.sel(cycles=0.0).values == new.values).all()


def test_xarray_has_units_and_coordinates(ball):
    shear = ball["contact/bodies/00003/shear"]
    assert shear.dims == ("component", "x", "y")
    assert shear.attrs["units"] == "MPa"
    assert shear.coords["x"].attrs["units"] == "mm"
    states = ball["contact/bodies"].xarray()
    assert states.pressure.dims == ("increment", "x", "y")
    assert list(states.increment) == [1, 2, 3]
    turned = states.shear.sel(increment=3)
    assert (turned.values == ball["contact/bodies/00003/shear"].values).all()


def test_pandas_has_units_and_an_index(ball):
    table = ball["history"].pandas()
    assert table.index.name == "increment"
    assert list(table["P [N]"]) == pytest.approx([400.0] * 3)
    assert table["Qx [N]"].loc[2] == pytest.approx(200.0)
    with pytest.raises(fretscale.UserError, match="contact/bodies/00003"):
        ball["contact/bodies/00003"].pandas()
    assert list(ball["contact/bodies"].pandas().index) == [1, 2, 3]


def test_folders_without_whole_results_are_refused(ball, tmp_path):
    with pytest.raises(fretscale.UserError, match=re.escape(str(tmp_path))):
        fretscale.open(tmp_path)
    folder = shutil.copytree(ball.folder, tmp_path / "out")
    with Path(folder, "results.h5").open("r+b") as file:
        file.seek(2000)
        file.write(b"x")
    with pytest.raises(fretscale.UserError, match=r"results\.h5"):
        fretscale.open(folder)
    Path(folder, "summary.json").unlink()
    with pytest.raises(fretscale.UserError, match="not finished"):
        fretscale.open(folder)
