"""Files of contact loads that are refused, each with the place of its error."""

import re
from dataclasses import dataclass, replace

import h5py
import numpy as np
import pytest

from sa_solver.types import LoadHistory
from tests.workflow.contact_loads import COLUMNS, FRICTION, GOOD, SIZE, face_history, table, write
from workflow.analyses.wear.structures.resultants.faces import FaceError, facets_over
from workflow.analyses.wear.structures.resultants.reading import read_resultants
from workflow.analyses.wear.structures.resultants.writing import write_resultants_h5
from workflow.case.files.input_files import InputFileError


@dataclass(frozen=True)
class Wrong:
    """Row of three that differs from GOOD in some columns, and the error about it."""

    row: int
    changes: dict[str, object]
    error: str


WRONG = {
    "negative P": Wrong(2, {"P": -5}, "3: P: -5: negative; allowed: 0 or more"),
    "negative energy": Wrong(1, {"Edx": -1}, "2: Edx: -1: negative; allowed: 0 or more"),
    "nan": Wrong(1, {"Qy": "nan"}, "2: Qy: nan: not a finite number; allowed: finite numbers"),
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
    """Limits may be met to four digits, with remainders of an iterative solver at parting."""
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
    with pytest.raises(InputFileError, match=r"csv:2: no column Qy, .*; this file has 'P', 'Qx',"):
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
    """Replace a dataset."""
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
        ("axes", np.diag([1.0, 1.0, -1.0]), "z = x × y"),
        ("axes", 2.0 * np.eye(3), "/f: axes of a frame"),
        ("axes", np.eye(2), "/f: axes of a frame have shape (2, 2)"),
    ):
        with h5py.File(path, "a") as file:
            file["f"].attrs[attribute] = value
        with pytest.raises(InputFileError, match=re.escape(error)):
            read_resultants(path)
    with h5py.File(path, "a") as file:
        del file["f"].attrs["origin"]
    with pytest.raises(InputFileError, match="/f: only the attribute axes"):
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
    shorter = replace(
        longer,
        loads=LoadHistory(**{name: column[:5] for name, column in vars(longer.loads).items()}),
        force=longer.force[:5],
        displacement=longer.displacement[:5],
        slip=longer.slip[:5],
    )
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
    """An edge that is straight up to its sixth digit belongs only to the elements inside."""
    x, y = np.meshgrid(np.linspace(0.0, 1.0, 7), np.linspace(0.0, 1.0, 7), indexing="ij")
    wavy = np.stack([x.ravel(), y.ravel()], 1)
    wavy += 1e-6 * np.random.default_rng(0).standard_normal(wavy.shape)
    assert len(facets_over(wavy, line=False)) == 2 * 6 * 6
    with pytest.raises(FaceError, match="lie on one line"):
        facets_over(np.stack([x.ravel(), 0.0 * x.ravel()], 1), line=False)
    with pytest.raises(FaceError, match="belongs to no facet"):
        facets_over(np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]), line=False)
