"""Loads as files: what is read is what was written, and what contradicts itself is refused."""

import re
from dataclasses import dataclass, fields, replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import workflow.analyses.wear.structures.resultants
from fe_models.mesh import Face, Interface
from fe_models.structure import CycleSolution, InterfaceHistory
from fe_models.transfer import FaceTransfer
from sa_solver.types import Frame, Grid, LoadHistory, resultants
from workflow.analyses.wear.datasets import put_face
from workflow.analyses.wear.structures.resultants.faces import FaceError, facets_over
from workflow.analyses.wear.structures.resultants.reading import read_resultants
from workflow.analyses.wear.structures.resultants.writing import (
    write_resultants_csv,
    write_resultants_h5,
)
from workflow.case.input_files import InputFileError
from workflow.shell.results import writing

FRICTION, SIZE = 0.4, (10.0, 60.0)
RECIPE = Path(workflow.analyses.wear.structures.resultants.__file__).with_name("RECIPE.md")
COLUMNS = ("P", "Qx", "Qy", "Mx", "My", "Mz", "Edx", "Edy")
GOOD = {"P": 100, "Qx": -40, "Qy": 0, "Mx": 30, "My": -20, "Mz": 5, "Edx": 2, "Edy": 0}


def random_loads(seed: int, count: int = 7) -> LoadHistory:
    """Loads without a short decimal form, that no check objects to; the last row is unloaded."""
    rng = np.random.default_rng(seed)
    P = 1e3 * rng.random(count)
    P[-1] = 0.0
    arms = rng.uniform(-0.3, 0.3, (5, count)) * P
    energy = rng.random((2, count)) / 3.0 * (P > 0.0)
    return LoadHistory(P, *arms, *energy, sliding=rng.random(count) > 0.5)


def assert_same(one: LoadHistory, two: LoadHistory) -> None:
    """Bit for bit, signs of zeros included."""
    for field in fields(LoadHistory):
        a, b = getattr(one, field.name), getattr(two, field.name)
        assert a.dtype == b.dtype
        assert a.tobytes() == b.tobytes(), field.name


def flank() -> Frame:
    """A frame at 45 degrees."""
    x, z = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0), np.array([-1.0, 0.0, -1.0]) / np.sqrt(2.0)
    return Frame(np.array([15.0, 0.0, 245.0]), np.array([x, np.cross(z, x), z]))


def face_history(seed: int = 0, line: bool = False) -> InterfaceHistory:
    """A face of 20 x 34 nodes (or 20 along a line) that slips at random."""
    rng, loads = np.random.default_rng(seed), random_loads(seed)
    x, y = 5.0 * np.sin(np.linspace(-1.3, 1.3, 20)) / np.sin(1.3), np.linspace(-30.0, 30.0, 34)
    grid = np.meshgrid(x, [0.0] if line else y, indexing="ij")
    coordinates = np.stack([axis.ravel() for axis in grid], axis=1)
    facets = facets_over(coordinates, line)
    n = len(coordinates)
    numbers = rng.permutation(10 * n)[: 2 * n].reshape(2, n)
    interface = Interface("f", flank(), coordinates, facets, *numbers, rng.random(n))
    slip = rng.standard_normal((len(loads), 2, n)) / 300.0
    force = np.zeros((len(loads), 3, n))
    return InterfaceHistory(interface, loads, force, force, slip)


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


def marched_cycle(history: InterfaceHistory) -> CycleSolution:
    """The last of 13 cycles, which has not closed."""
    return CycleSolution(
        (history,), (), history.displacement[-1], 1, 1e-9, True, 3.5e-3, np.zeros(7), 13
    )


def test_how_well_a_cycle_is_closed_is_told_and_read_back(tmp_path):
    """By either file, each interface for itself; files of other codes need not say."""
    history = face_history()
    cycle, table, fields = marched_cycle(history), tmp_path / "loads.csv", tmp_path / "loads.h5"
    write_resultants_csv(table, {"f": history.loads}, cycle=cycle)
    write_resultants_h5(fields, {"f": history}, cycle=cycle)
    for path in (table, fields):
        assert read_resultants(path)["f"].closure == 3.5e-3
    told = table.read_text().splitlines()[0]
    assert told.endswith(
        "the last of 13 cycles marched from rest, which changes the contact forces of the one "
        "before it by 3.5e-03 of the largest"
    )
    with h5py.File(fields) as file:
        assert file["f"].attrs["cycles"] == 13
    write_resultants_csv(table, {"f": history.loads})
    assert read_resultants(table)["f"].closure is None


@pytest.mark.parametrize("written", [-1e-3, "open", [1e-3, 1e-3], np.nan])
def test_a_closure_that_is_none_is_refused(tmp_path, written):
    write_resultants_h5(tmp_path / "loads.h5", {"f": face_history()})
    with h5py.File(tmp_path / "loads.h5", "a") as file:
        file["f"].attrs["closure"] = written
    with pytest.raises(InputFileError, match=r"/f: attribute closure: .*; allowed: a number, 0"):
        read_resultants(tmp_path / "loads.h5")


def test_slip_on_the_grid_is_the_same_bit_for_bit(tmp_path):
    """What wear is computed from: slip on the cells, before writing and after reading."""
    history, grid = face_history(), Grid.covering(SIZE, (32, 64))
    write_resultants_h5(tmp_path / "loads.h5", {"f": history})
    imported = read_resultants(tmp_path / "loads.h5")["f"]
    before = FaceTransfer.between(history.interface, grid).to_cells(history.slip)
    after = FaceTransfer.between(imported.face("f"), grid).to_cells(imported.slip)
    assert before.tobytes() == after.tobytes()


def test_results_of_a_run_are_read_from_their_group(tmp_path):
    """``results.h5:structure`` holds what a run wrote of its structure."""
    history, path = face_history(), tmp_path / "results.h5"
    with writing(path) as writer:
        put_face(writer, "structure/intrados", history.interface, history)
    imported = read_resultants(f"{path}:structure")["intrados"]
    assert_same(imported.loads, history.loads)
    assert imported.frame is None
    assert isinstance(imported.face("intrados"), Face)


def test_loads_of_a_run_pass_all_checks(whole, tmp_path):
    """Our own structure contradicts itself nowhere, and its loads survive the way through a CSV."""
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


def table(rows: list[dict], header: dict[str, str] | None = None) -> str:
    """CSV text of rows by column; ``header`` renames columns."""
    names = list(rows[0])
    lines = [", ".join((header or {}).get(name, name) for name in names)]
    return "\n".join(lines + [", ".join(str(row[name]) for name in names) for row in rows]) + "\n"


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "loads.csv"
    path.write_text(text, encoding="utf-8")
    return path


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
    """Both of them, or in a line contact that about its length; in either kind of file."""
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
        file["f/slip"].attrs["unit"] = np.bytes_("um")
        del file["f/nodal_height"].attrs["unit"]
    imported = read_resultants(path)["f"]
    np.testing.assert_allclose(imported.loads.P, 1e3 * history.loads.P, rtol=1e-15)
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
    """At 99 % of µP and with energy lost; in a file that says so, as it says."""
    shears, energies = (-40, -39.7, -39.5, 40, 0), (2, 2, 2, 0, 0)
    rows = [GOOD | {"Qx": q, "Edx": e} for q, e in zip(shears, energies, strict=True)]
    path = write(tmp_path, table(rows))
    deduced = read_resultants(path, friction=FRICTION)["interface"].loads.sliding
    assert deduced.tolist() == [True, True, False, False, False]
    assert not read_resultants(path)["interface"].loads.sliding.any()
    path = write(tmp_path, table([row | {"sliding": int(k == 2)} for k, row in enumerate(rows)]))
    marked = read_resultants(path, friction=FRICTION)["interface"].loads.sliding
    assert marked.tolist() == [False, False, True, False, False]


# --- refusals -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Wrong:
    """A row of three that differs from GOOD in some columns, and the error about it."""

    row: int
    changes: dict[str, object]
    error: str


WRONG = {
    "negative P": Wrong(2, {"P": -5}, "3: P: -5: negative; allowed: 0 or more"),
    "negative energy": Wrong(1, {"Edx": -1}, "2: Edx: -1: negative; allowed: 0 or more"),
    "text": Wrong(3, {"Mz": "four"}, "4: Mz: 'four': not a number; allowed: numbers"),
    "empty": Wrong(3, {"Mz": ""}, "4: Mz: '': not a number"),
    "underscore": Wrong(3, {"Mz": "1_0"}, "4: Mz: '1_0': not a number"),
    "nan": Wrong(1, {"Qy": "nan"}, "2: Qy: nan: not a finite number; allowed: finite numbers"),
    "inf": Wrong(1, {"Qy": "-inf"}, "2: Qy: -inf: not a finite number"),
    "too much shear": Wrong(
        2, {"Qx": -41}, "3: Qx: -41: shear force 41 above µP = 40; allowed: up to µP with µ = 0.4"
    ),
    "both shears": Wrong(2, {"Qx": 30, "Qy": -31}, "3: Qy: -31: shear force 43.1393 above µP"),
    "moment about x": Wrong(
        3, {"Mx": 3010}, "4: Mx: 3010: puts the resultant pressure outside the face"
    ),
    "moment about y": Wrong(
        3, {"My": -501}, "4: My: -501: puts the resultant pressure outside the face"
    ),
    "twist": Wrong(1, {"Mz": 1300}, "2: Mz: 1300: puts the shear outside the face"),
    "energy apart": Wrong(
        2, GOOD | dict.fromkeys(COLUMNS, 0) | {"Edx": 1}, "3: Edx: 1: not zero though P is"
    ),
    "shear apart": Wrong(
        2, GOOD | dict.fromkeys(COLUMNS, 0) | {"Qx": 1}, "3: Qx: 1: not zero though P is"
    ),
    "half sliding": Wrong(2, {"sliding": 0.5}, "3: sliding: 0.5: neither yes nor no; allowed: 0 o"),
    "twice": Wrong(3, {"increment": 2}, "4: increment: 2: increment given twice; allowed: 3"),
    "left out": Wrong(2, {"increment": 3}, "3: increment: 3: increments are left out; allowed: 2"),
    "no whole": Wrong(2, {"increment": 1.5}, "3: increment: 1.5: not a whole number; allowed"),
    "no name": Wrong(1, {"interface": "a/b"}, "2: interface: a/b: no name; allowed: letters"),
    "other interface": Wrong(3, {"interface": "b"}, "4: increment: 3: increments are left out"),
}


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
def test_a_wrong_value_is_refused_at_its_line(tmp_path, wrong):
    rows = [{"interface": "a", "increment": k, **GOOD, "sliding": 0} for k in (1, 2, 3)]
    rows[wrong.row - 1].update(wrong.changes)
    path = write(tmp_path, table(rows))
    with pytest.raises(InputFileError) as refused:
        read_resultants(path, friction=FRICTION, face_sizes={"a": SIZE})
    message = str(refused.value)
    assert message.startswith(f"{path}:{wrong.error}"), message
    assert "\n" not in message
    assert "; allowed: " in message


def test_what_is_within_rounding_is_taken(tmp_path):
    """Limits met to four digits, and the remainders of an iterative solver where bodies part."""
    at_limit = GOOD | {"Qx": 40.03, "My": 500.3, "Edy": -1e-9, "Edx": 2}
    apart = {name: 1e-6 * GOOD[name] for name in COLUMNS} | {"P": 0}
    path = write(tmp_path, table([at_limit, apart | {"Edy": 0}]))
    with pytest.raises(InputFileError, match="Edy: -1e-09: negative"):
        read_resultants(path)  # nothing but a remainder: no scale to measure it by
    path = write(tmp_path, table([at_limit | {"Edy": 1}, apart | {"Edy": -1e-7}]))
    read_resultants(path, friction=FRICTION, face_sizes={"interface": SIZE})


HEADERS = {
    "missing": ("P, Qx, Qy, Mx, My, Edx", "1: no column Mz, Edy; this file has 'P', 'Qx', "),
    "unknown": ("P, Qx, Qy, Mx, My, Mz, Edx, Ed", "1: 'Ed': unknown column; did you mean 'Edy'?"),
    "stranger": ("P, weight", "1: 'weight': unknown column; allowed: interface, increment, P"),
    "twice": ("P, Qx, P", "1: P: column given twice; allowed: once"),
    "wrong unit": ("P [mm], Qx", "1: P: unit 'mm' cannot be converted to N; allowed: N, or a unit"),
    "no unit": ("P [Newtonish], Qx", "1: P: unknown unit 'Newtonish'"),
    "temperature": ("P [degC], Qx", "1: P: unknown unit 'degC'"),
    "brackets": ("P [N, Qx", "1: 'P [N': unknown column"),
}


@pytest.mark.parametrize(("header", "error"), HEADERS.values(), ids=HEADERS)
def test_a_wrong_header_is_refused(tmp_path, header, error):
    row = ", ".join("1" for _ in header.split(","))
    path = write(tmp_path, f"{header}\n{row}\n")
    with pytest.raises(InputFileError) as refused:
        read_resultants(path)
    assert str(refused.value).startswith(f"{path}:{error}"), refused.value


def test_missing_columns_name_those_present(tmp_path):
    path = write(tmp_path, "# loads\nP, Qx, Edx [J]\n1, 2, 3\n")
    with pytest.raises(
        InputFileError,
        match=r"csv:2: no column Qy, .*; this file has 'P', 'Qx', 'Edx \[J\]'; allowed: P, Qx",
    ):
        read_resultants(path)


def test_rows_of_another_length_are_refused(tmp_path):
    text = table([GOOD, GOOD]) + "1, 2, 3\n"
    with pytest.raises(InputFileError, match=r"loads.csv:4: 3 values; allowed: 8, as the header"):
        read_resultants(write(tmp_path, text))


def test_files_without_rows_are_refused(tmp_path):
    for text in ("", "# nothing\n", "P, Qx\n"):
        with pytest.raises(InputFileError, match=r"loads.csv:1: no rows; allowed"):
            read_resultants(write(tmp_path, text))
    with pytest.raises(InputFileError, match=r"missing.csv: no such file"):
        read_resultants(tmp_path / "missing.csv")


def test_interfaces_must_have_as_many_increments(tmp_path):
    rows = [{"interface": name, **GOOD} for name in ("a", "a", "b", "a")]
    with pytest.raises(InputFileError, match=r"csv:4: 'b' ends after 1 increments; .* a has 3"):
        read_resultants(write(tmp_path, table(rows)))


def test_a_line_contact_has_no_moment_about_x(tmp_path):
    path = write(tmp_path, table([GOOD]))
    with pytest.raises(InputFileError, match=r"csv:2: Mx: 30: moment of a line contact; allowed"):
        read_resultants(path, line=True)


def spoil(file: h5py.File, name: str, values: object) -> None:
    """Put a dataset in the place of another one."""
    if name in file:
        del file[name]
    file[name] = values


SPOILT = {
    "missing column": ("f/load_history/Mz", None, "/f/load_history: Mz missing; allowed: all"),
    "unknown column": ("f/load_history/Mq", np.ones(7), "/f/load_history/Mq: unknown column; all"),
    "length": ("f/load_history/Qx", np.ones(3), "/f/load_history/Qx: shape (3,); allowed: (7,)"),
    "text": ("f/load_history/Qx", "no", "/f/load_history/Qx: no numbers; allowed: a dataset of"),
    "nan": ("f/slip", np.full((7, 2, 680), np.nan), "/f/slip: entry 1, 1, 1 is not finite; allow"),
    "negative": (
        "f/load_history/P",
        -np.ones(7),
        "/f/load_history/P: increment 1: -1: negative; allowed: 0 or more",
    ),
    "slip": ("f/slip", np.ones((7, 2, 3)), "/f/slip: shape (7, 2, 3); allowed: (7, 2, 680)"),
    "no coordinates": ("f/coordinates", None, "/f/facets: given without coordinates; allowed: bo"),
    "coordinates": ("f/coordinates", np.ones(680), "/f/coordinates: shape (680,); allowed: x and"),
    "one line": ("f/coordinates", np.ones((680, 1)), "/f/coordinates: shape (680, 1); allowed"),
    "facets": ("f/facets", np.ones((9, 4)), "/f/facets: shape (9, 4); allowed: 3 nodes for each"),
    "beyond": ("f/facets", np.full((9, 3), 680), "/f: facets name nodes beyond the 680 there are"),
    "lonely": ("f/facets", np.array([[0, 1, 34]]), "/f: node 3 of 680 belongs to no facet; allow"),
    "fractions": ("f/nodes_2", np.linspace(0, 1, 680), "/f/nodes_2: not whole numbers; allowed: w"),
    "same node": ("f/nodes_2", np.ones(680), "/f/nodes_2: not one number per node; allowed: 680"),
    "typo": ("f/slips", np.ones(3), "/f/slips: unknown; allowed: load_history, coordinates"),
    "sliding": ("f/load_history/sliding", 2 * np.ones(7), "/f/load_history/sliding: neither yes"),
}


@pytest.mark.parametrize(("name", "values", "error"), SPOILT.values(), ids=SPOILT)
def test_a_wrong_dataset_is_refused_by_its_name(tmp_path, name, values, error):
    path = tmp_path / "loads.h5"
    write_resultants_h5(path, {"f": face_history()})
    with h5py.File(path, "a") as file:
        if values is None:
            del file[name]
        else:
            spoil(file, name, values)
    with pytest.raises(InputFileError) as refused:
        read_resultants(path)
    assert str(refused.value).startswith(f"{path}: {error}"), refused.value


def test_frames_must_be_right_handed(tmp_path):
    path = tmp_path / "loads.h5"
    write_resultants_h5(path, {"f": face_history()})
    for attribute, value, error in (
        ("axes", np.diag([1.0, 1.0, -1.0]), "/f: axes of no frame; allowed: rows x, y, z"),
        ("axes", 2.0 * np.eye(3), "/f: axes of no frame"),
        ("axes", np.eye(2), "/f: frame of another shape; allowed: origin"),
    ):
        with h5py.File(path, "a") as file:
            file["f"].attrs[attribute] = value
        with pytest.raises(InputFileError, match=re.escape(error)):
            read_resultants(path)
    with h5py.File(path, "a") as file:
        del file["f"].attrs["origin"]
    with pytest.raises(InputFileError, match="/f: attribute axes alone"):
        read_resultants(path)


def test_hdf5_without_interfaces_is_refused(tmp_path):
    path = tmp_path / "loads.h5"
    write_resultants_h5(path, {"f": face_history()})
    with pytest.raises(InputFileError, match=r"/elsewhere: no interfaces; .* at the top: f"):
        read_resultants(f"{path}:elsewhere")
    path.write_text("no HDF5")
    with pytest.raises(InputFileError, match="cannot be read"):
        read_resultants(path)


def test_hdf5_interfaces_must_have_as_many_increments(tmp_path):
    path, longer = tmp_path / "loads.h5", face_history()
    shorter = replace(longer, loads=random_loads(0, count=5), slip=longer.slip[:5])
    write_resultants_h5(path, {"a": longer, "b": shorter})
    with pytest.raises(InputFileError, match="increments differ: a 7, b 5; allowed: as many"):
        read_resultants(path)


def test_facets_are_made_where_none_are_given(tmp_path):
    history, path = face_history(), tmp_path / "loads.h5"
    write_resultants_h5(path, {"f": history})
    with h5py.File(path, "a") as file:
        del file["f/facets"]
    face = read_resultants(path)["f"].face("f")
    assert face.nodal_areas.sum() == pytest.approx(SIZE[0] * SIZE[1], rel=1e-12)


def test_slivers_of_printed_coordinates_are_no_elements():
    """An edge that is straight but for its sixth digit belongs to the elements inside alone."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, 7), np.linspace(0.0, 1.0, 7), indexing="ij")
    wavy = np.stack([x.ravel(), y.ravel()], 1)
    wavy += 1e-6 * np.random.default_rng(0).standard_normal(wavy.shape)
    assert len(facets_over(wavy, line=False)) == 2 * 6 * 6
    with pytest.raises(FaceError, match="lie on one line"):
        facets_over(np.stack([x.ravel(), 0.0 * x.ravel()], 1), line=False)
    with pytest.raises(FaceError, match="belongs to no facet"):
        facets_over(np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]), line=False)


# --- signs --------------------------------------------------------------------------------------


def snippet() -> dict:
    """The Python of the recipe, run."""
    (code,) = re.findall(r"```python\n(.*?)```", RECIPE.read_text(encoding="utf-8"), re.DOTALL)
    names: dict = {}
    exec(code, names)
    return names


def test_snippet_of_the_recipe_gives_our_resultants():
    """Point forces in global axes, their moment about the global origin: as our own structure."""
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


def test_signs_as_the_recipe_tells_them():
    """Pressure at x > 0 and y > 0, body 2 sliding along +x."""
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
