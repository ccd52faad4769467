"""Loads as files are read as they were written, whatever their units, columns and signs."""

import re
from dataclasses import replace

import h5py
import numpy as np
import pytest

from fe_models.meshes.structure_mesh import Face
from fe_models.meshes.transfer import FaceTransfer
from fe_models.structure import CycleSolution, InterfaceHistory
from sa_solver.types import Frame, Grid, resultants
from tests.workflow.contact_loads import (
    COLUMNS,
    FRICTION,
    GOOD,
    RECIPE,
    SIZE,
    assert_same,
    face_history,
    random_loads,
    table,
    write,
)
from workflow.analyses.wear.output.datasets import put_face
from workflow.analyses.wear.output.layout import LAYOUT
from workflow.analyses.wear.structures.resultants.reading import read_resultants
from workflow.analyses.wear.structures.resultants.writing import (
    write_resultants_csv,
    write_resultants_h5,
)
from workflow.case.files.input_files import InputFileError
from workflow.shell.output.results import writing

# --- round trips --------------------------------------------------------------------------------


@pytest.mark.parametrize("line", [False, True], ids=["area", "line"])
def test_csv_reads_back_bit_for_bit(tmp_path, line):
    histories = {"intrados": random_loads(1), "extrados upper": random_loads(2)}
    if line:
        zeros = np.zeros(7)
        histories = {n: replace(loads, Mx=zeros, Mz=zeros) for n, loads in histories.items()}
    path = tmp_path / "loads.csv"
    write_resultants_csv(path, histories, line=line)
    imported = read_resultants(path, line=line)
    assert list(imported) == list(histories)
    for name, loads in histories.items():
        assert_same(imported[name].loads, loads)
        assert imported[name].slip is None
        assert imported[name].face(name) is None
    header = path.read_text().splitlines()[1]
    assert ("P [N/mm]" if line else "P [N]") in header


@pytest.mark.parametrize("line", [False, True], ids=["area", "line"])
def test_hdf5_reads_back_bit_for_bit(tmp_path, line):
    histories = {"intrados": face_history(1, line), "extrados": face_history(2, line)}
    if line:
        zeros = np.zeros(7)
        for name, history in histories.items():
            histories[name] = replace(history, loads=replace(history.loads, Mx=zeros, Mz=zeros))
    heights = {name: np.random.default_rng(3).random((6, 1 if line else 5)) for name in histories}
    path = tmp_path / "loads.h5"
    write_resultants_h5(path, histories, heights)
    imported = read_resultants(path, line=line)
    assert set(imported) == set(histories)
    for name, history in histories.items():
        read, face = imported[name], history.interface
        assert_same(read.loads, history.loads)
        pairs = {
            "slip": history.slip,
            "force": history.force,
            "displacement": history.displacement,
            "coordinates": face.coordinates,
            "facets": face.facets,
            "nodes_1": face.nodes_1,
            "nodes_2": face.nodes_2,
            "nodal_height": face.gap,
            "height": heights[name],
        }
        for key, written in pairs.items():
            np.testing.assert_array_equal(getattr(read, key), written, err_msg=key, strict=True)
        np.testing.assert_array_equal(read.frame.origin, face.frame.origin)
        np.testing.assert_array_equal(read.frame.axes, face.frame.axes)


@pytest.mark.parametrize(("name", "factor"), [("force", None), ("force", 1.02), ("force", -1.0)])
def test_nodal_forces_that_do_not_add_up_to_the_loads_are_refused(tmp_path, name, factor):
    write_resultants_h5(tmp_path / "loads.h5", {"f": face_history()})
    with h5py.File(tmp_path / "loads.h5", "a") as file:
        if factor is None:
            del file["f"][name]
        else:
            file["f"][name][...] *= factor
    with pytest.raises(InputFileError, match="/f/"):
        read_resultants(tmp_path / "loads.h5")


def marched_cycle(history: InterfaceHistory) -> CycleSolution:
    """Return the last of 13 cycles, which has not closed."""
    return CycleSolution(
        (history,), (), history.displacement[-1], 1, 1e-9, True, 3.5e-3, np.zeros(7), 13
    )


def test_the_closure_of_a_cycle_is_written_and_read_back(tmp_path):
    """Both kinds of file have it for each interface; files of other codes may omit it."""
    history = face_history()
    cycle, table, fields = marched_cycle(history), tmp_path / "loads.csv", tmp_path / "loads.h5"
    write_resultants_csv(table, {"f": history.loads}, cycle=cycle)
    write_resultants_h5(fields, {"f": history}, cycle=cycle)
    for path in (table, fields):
        assert read_resultants(path)["f"].closure == 3.5e-3
    reported = table.read_text().splitlines()[0]
    assert reported.endswith(
        "the last of 13 cycles marched from rest; the contact forces differ from the cycle "
        "before by 3.5e-03 of the largest"
    )
    with h5py.File(fields) as file:
        assert file["f"].attrs["cycles"] == 13
    write_resultants_csv(table, {"f": history.loads})
    assert read_resultants(table)["f"].closure is None


def test_slip_on_the_grid_is_the_same_bit_for_bit(tmp_path):
    """The slip on the cells, from which wear is computed, is the same after reading."""
    history, grid = face_history(), Grid.covering(SIZE, (32, 64))
    write_resultants_h5(tmp_path / "loads.h5", {"f": history})
    imported = read_resultants(tmp_path / "loads.h5")["f"]
    before = FaceTransfer.between(history.interface, grid).to_cells(history.slip)
    after = FaceTransfer.between(imported.face("f"), grid).to_cells(imported.slip)
    assert before.tobytes() == after.tobytes()


def test_results_of_a_run_are_read_from_their_group(tmp_path):
    """``results.h5:structure`` holds the structure's results of a run."""
    history, path = face_history(), tmp_path / "results.h5"
    with writing(path, LAYOUT) as writer:
        put_face(writer, "structure/intrados", history.interface, history)
    imported = read_resultants(f"{path}:structure")["intrados"]
    assert_same(imported.loads, history.loads)
    assert imported.frame is None
    assert isinstance(imported.face("intrados"), Face)


def test_loads_of_a_run_pass_all_checks(whole, tmp_path):
    """Our structure's loads pass all checks, also after export to a CSV."""
    with h5py.File(whole.folder / "results.h5") as file:
        friction, grids = file.attrs["friction"], file["grid"]
        sizes = {n: tuple(g.attrs["shape"] * g.attrs["pitch"]) for n, g in grids.items()}
        written = {name: group["slip"][()] for name, group in file["structure"].items()}
    bounds = {"friction": friction, "face_sizes": sizes}
    imported = read_resultants(f"{whole.folder / 'results.h5'}:structure", **bounds)
    for name, slip in written.items():
        assert imported[name].slip.tobytes() == slip.tobytes()
    write_resultants_csv(tmp_path / "loads.csv", {n: face.loads for n, face in imported.items()})
    for name, from_csv in read_resultants(tmp_path / "loads.csv", **bounds).items():
        assert_same(from_csv.loads, imported[name].loads)


# --- units and columns --------------------------------------------------------------------------


def test_units_of_the_header_are_converted_exactly(tmp_path):
    header = {"P": "P [kN]", "Qx": "Qx[kN]", "Mx": "Mx [N*m]", "My": "My [kN*mm]", "Edx": "Edx [J]"}
    row = GOOD | {"P": 1.1, "Qx": -0.3, "Mx": 0.7, "My": -0.1, "Edx": 0.0033}
    loads = read_resultants(write(tmp_path, table([row], header)))["interface"].loads
    values = [getattr(loads, name)[0] for name in COLUMNS]
    assert values == [1100.0, -300.0, 0.0, 700.0, -100.0, 5.0, 3.3, 0.0]


def test_units_of_a_line_contact_are_per_length(tmp_path):
    header = {"P": "P [kN/m]", "My": "My [N]", "Edx": "Edx [J/m]"}
    row = {"P": 0.5, "Qx": -0.1, "My": 0.2, "Edx": 0.3}
    path = write(tmp_path, table([row], header))
    loads = read_resultants(path, line=True)["interface"].loads
    assert [loads.P[0], loads.Qx[0], loads.My[0], loads.Edx[0]] == [0.5, -0.1, 0.2, 0.3]
    assert not np.any([loads.Qy, loads.Mx, loads.Mz, loads.Edy])
    with pytest.raises(InputFileError, match=r"loads.csv:1: P: .*cannot be converted to N; allow"):
        read_resultants(path)


def test_without_moments_the_tilt_is_held(tmp_path):
    """Both are missing, or in a line contact the one about its length; in either kind of file."""
    two = {name: value for name, value in GOOD.items() if name not in ("Mx", "My")}
    one = {"P": 100, "Qx": -40, "Edx": 2}
    for row, line in ((two, False), (one, True), (one | {"Mx": 0}, True)):
        own = read_resultants(write(tmp_path, table([row])), line)["interface"]
        assert own.tilt == "held"
        assert not np.any([own.loads.Mx, own.loads.My])
    for row, line in ((GOOD, False), (one | {"My": 0}, True)):
        assert read_resultants(write(tmp_path, table([row])), line)["interface"].tilt == "free"
    with pytest.raises(InputFileError, match=r"csv:1: no column My; .* or neither: held tilt"):
        read_resultants(write(tmp_path, table([two | {"Mx": 0}])))
    path = tmp_path / "loads.h5"
    write_resultants_h5(path, {"f": face_history()})
    with h5py.File(path, "a") as file:
        del file["f/load_history/My"]
    with pytest.raises(InputFileError, match=r"/f/load_history: My missing; .* neither: held tilt"):
        read_resultants(path)
    with h5py.File(path, "a") as file:
        del file["f/load_history/Mx"]
    assert read_resultants(path)["f"].tilt == "held"


def test_units_of_datasets_are_converted(tmp_path):
    path, history = tmp_path / "loads.h5", face_history()
    write_resultants_h5(path, {"f": history})
    with h5py.File(path, "a") as file:
        file["f/load_history/P"].attrs["unit"] = "kN"
        for name in ("load_history/Qx", "load_history/Qy", "force"):
            file[f"f/{name}"].attrs["unit"] = "kN"
        file["f/slip"].attrs["unit"] = np.bytes_("um")
        del file["f/nodal_height"].attrs["unit"]
    imported = read_resultants(path)["f"]
    np.testing.assert_allclose(imported.loads.P, 1e3 * history.loads.P, rtol=1e-15)
    np.testing.assert_allclose(imported.force, 1e3 * history.force, rtol=1e-15)
    np.testing.assert_allclose(imported.slip, 1e-3 * history.slip, rtol=1e-15)
    np.testing.assert_array_equal(imported.nodal_height, history.interface.gap)
    with h5py.File(path, "a") as file:
        file["f/slip"].attrs["unit"] = "MPa"
    with pytest.raises(InputFileError, match=r"/f/slip: unit: .*'MPa' cannot be converted to mm"):
        read_resultants(path)


def test_interfaces_may_alternate_and_comments_stand_anywhere(tmp_path):
    rows = [
        {"interface": name, "increment": k, **GOOD, "P": 100 + k}
        for k in (1, 2, 3)
        for name in ("b", "a")
    ]
    lines = table(rows).splitlines()
    lines[3:3] = ["# half way", "", "   # indented, with, commas"]
    imported = read_resultants(write(tmp_path, "\ufeff# first\n" + "\n".join(lines)))
    assert list(imported) == ["b", "a"]
    assert imported["a"].loads.P.tolist() == imported["b"].loads.P.tolist() == [101.0, 102.0, 103.0]


def test_sliding_is_deduced_by_the_share_of_the_contact_solver(tmp_path):
    """Sliding means 99 % of µP and lost energy, unless the file states it."""
    shears, energies = (-40, -39.7, -39.5, 40, 0), (2, 2, 2, 0, 0)
    rows = [GOOD | {"Qx": q, "Edx": e} for q, e in zip(shears, energies, strict=True)]
    path = write(tmp_path, table(rows))
    deduced = read_resultants(path, friction=FRICTION)["interface"].loads.sliding
    assert deduced.tolist() == [True, True, False, False, False]
    assert not read_resultants(path)["interface"].loads.sliding.any()
    path = write(tmp_path, table([row | {"sliding": int(k == 2)} for k, row in enumerate(rows)]))
    marked = read_resultants(path, friction=FRICTION)["interface"].loads.sliding
    assert marked.tolist() == [False, False, True, False, False]


# --- signs --------------------------------------------------------------------------------------


def snippet() -> dict:
    """Run the Python code of the recipe and return its names."""
    (code,) = re.findall(r"```python\n(.*?)```", RECIPE.read_text(encoding="utf-8"), re.DOTALL)
    names: dict = {}
    exec(code, names)
    return names


def test_snippet_of_the_recipe_gives_our_resultants():
    """Point forces in global axes with the moment about the origin match our structure."""
    names, rng = snippet(), np.random.default_rng(0)
    frame = Frame(names["origin"], names["axes"])
    np.testing.assert_allclose(frame.axes @ frame.axes.T, np.eye(3), atol=1e-15)
    places = rng.uniform(-1.0, 1.0, (5, 2)) * [5.0, 30.0]
    forces = rng.standard_normal((3, 5))
    points = frame.origin + frame.to_global(np.column_stack([places, np.zeros(5)]))
    vectors = frame.to_global(forces.T)
    moment = np.cross(points, vectors).sum(axis=0)
    columns = names["columns"](vectors.sum(axis=0)[None], moment[None], np.zeros(3))
    ours = resultants(forces, *places.T)
    named = [columns[name][0] for name in ("P", "Qx", "Qy", "Mx", "My", "Mz")]
    np.testing.assert_allclose(named, ours, rtol=1e-12, atol=1e-11)


def test_signs_are_those_of_the_recipe():
    """The pressure is at x > 0 and y > 0, and body 2 slides along +x."""
    names = snippet()
    frame = Frame(names["origin"], names["axes"])
    point = frame.origin + frame.to_global(np.array([2.0, 3.0, 0.0]))
    force = frame.to_global(np.array([-40.0, 0.0, 100.0]))  # friction and pressure on body 2
    columns = names["columns"](force[None], np.zeros((1, 3)), point)
    expected = {"P": 100.0, "Qx": -40.0, "Qy": 0.0, "Mx": 300.0, "My": -200.0, "Mz": 120.0}
    for name, value in expected.items():
        assert columns[name][0] == pytest.approx(value, abs=1e-10), name
    shear, slip = np.array([[[-40.0], [0.0]]]), np.array([[[0.01], [0.0]]])
    np.testing.assert_allclose(names["energies"](shear, slip), [[0.4], [0.0]])


def test_table_of_the_recipe_is_read(tmp_path):
    lines = RECIPE.read_text(encoding="utf-8").splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("    # dovetail"))
    text = "\n".join(line.strip() for line in lines[start : start + 6])
    sizes = dict.fromkeys(("intrados", "extrados"), SIZE)
    imported = read_resultants(write(tmp_path, text), friction=FRICTION, face_sizes=sizes)
    assert imported["intrados"].loads.My.tolist() == [-300.0, -1100.0]
    assert imported["extrados"].loads.sliding.all()
