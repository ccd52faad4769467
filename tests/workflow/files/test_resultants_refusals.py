"""Files of contact loads that are refused, each with the place of its error."""

from dataclasses import dataclass

import h5py
import numpy as np
import pytest

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


WRONG = [
    Wrong(2, {"P": -5}, "3: P: -5"),
    Wrong(1, {"Edx": -1}, "2: Edx: -1"),
    Wrong(1, {"Qy": "nan"}, "2: Qy: nan"),
    Wrong(2, {"Qx": -41}, "3: Qx: -41"),
    Wrong(2, {"Qx": 30, "Qy": -31}, "3: Qy: -31"),
    Wrong(3, {"Mx": 3010}, "4: Mx: 3010"),
    Wrong(3, {"My": -501}, "4: My: -501"),
    Wrong(1, {"Mz": 1300}, "2: Mz: 1300"),
    Wrong(2, GOOD | dict.fromkeys(COLUMNS, 0) | {"Edx": 1}, "3: Edx: 1"),
    Wrong(2, GOOD | dict.fromkeys(COLUMNS, 0) | {"Qx": 1}, "3: Qx: 1"),
    Wrong(2, {"sliding": 0.5}, "3: sliding: 0.5"),
    Wrong(3, {"increment": 2}, "4: increment: 2"),
    Wrong(1, {"interface": "a/b"}, "2: interface: a/b"),
]


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: wrong.error)
def test_a_wrong_value_is_refused_at_its_line(tmp_path, wrong):
    rows = [{"interface": "a", "increment": k, **GOOD, "sliding": 0} for k in (1, 2, 3)]
    rows[wrong.row - 1].update(wrong.changes)
    path = write(tmp_path, table(rows))
    with pytest.raises(InputFileError) as refused:
        read_resultants(path, friction=FRICTION, face_sizes={"a": SIZE})
    assert str(refused.value).startswith(f"{path}:{wrong.error}: ")


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
    "P, Qx, Qy, Mx, My, Edx": "Mz, Edy",
    "P, Qx, Qy, Mx, My, Mz, Edx, Ed": "'Edy'",
    "P, Qx, P": "P: ",
    "P [mm], Qx": "P: unit 'mm'",
    "P [degC], Qx": "P: unknown unit 'degC'",
}


@pytest.mark.parametrize(("header", "named"), HEADERS.items())
def test_a_wrong_header_is_refused(tmp_path, header, named):
    path = write(tmp_path, f"{header}\n{', '.join('1' for _ in header.split(','))}\n")
    with pytest.raises(InputFileError, match="csv:1: ") as refused:
        read_resultants(path)
    assert named in str(refused.value)


SPOILT = [
    ("load_history/Mz", None, "load_history: Mz"),
    ("load_history/Mq", np.ones(7), "load_history/Mq"),
    ("load_history/Qx", np.ones(3), "load_history/Qx"),
    ("slip", np.full((7, 2, 680), np.nan), "slip"),
    ("load_history/P", -np.ones(7), "load_history/P"),
    ("coordinates", None, "facets"),
    ("coordinates", np.ones(680), "coordinates"),
    ("facets", np.ones((9, 4)), "facets"),
    ("nodes_2", np.linspace(0, 1, 680), "nodes_2"),
    ("slips", np.ones(3), "slips"),
]


@pytest.mark.parametrize(("name", "values", "named"), SPOILT)
def test_a_wrong_dataset_is_refused_by_its_name(tmp_path, name, values, named):
    path = tmp_path / "loads.h5"
    write_resultants_h5(path, {"f": face_history()})
    with h5py.File(path, "a") as file:
        if name in file["f"]:
            del file["f"][name]
        if values is not None:
            file["f"][name] = values
    with pytest.raises(InputFileError) as refused:
        read_resultants(path)
    assert str(refused.value).startswith(f"{path}: /f/{named}")


@pytest.mark.parametrize("axes", [np.diag([1.0, 1.0, -1.0]), 2.0 * np.eye(3), np.eye(2)])
def test_frames_must_be_right_handed(tmp_path, axes):
    path = tmp_path / "loads.h5"
    write_resultants_h5(path, {"f": face_history()})
    with h5py.File(path, "a") as file:
        file["f"].attrs["axes"] = axes
    with pytest.raises(InputFileError, match="axes"):
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
