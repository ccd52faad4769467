"""Files that a case names are opened with it, and refused if their content is unsuitable."""

import h5py
import numpy as np
import pytest

from tests.conftest import CASES
from tests.workflow.command_line import command
from tests.workflow.scenes import BALL, ROLLER_LOADS, ROLLER_WEAR
from workflow.case.files.input_files import InputFileError, open_hdf5

TIME = """\
title: joint
analysis: time
structure: {kind: joint}
joint: {law: jenkins, normal_load: 60 N, friction: 0.5, stiffness: 10 N/um}
evolution: {file: %s}
drive: {stroke: 14 um, frequency: 100 Hz}
ageing: {cycles: 1000}
"""


def reported(path, *overrides):
    """Return the only line of a case that is refused."""
    ended = command("check", path, overrides=overrides)
    assert ended.exit_code == 2, ended.output
    (line,) = ended.stderr.splitlines()
    return line


# --- cases ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", ["itself", "a link", "another"])
def test_no_case_names_one_that_names_it(tmp_path, way):
    path, named = tmp_path / "a.yaml", {"itself": "a.yaml"}.get(way, "b.yaml")
    path.write_text(TIME % named, encoding="utf-8")
    if way == "a link":
        (tmp_path / "b.yaml").symlink_to(path)
    if way == "another":
        (tmp_path / "b.yaml").write_text(TIME % "a.yaml", encoding="utf-8")
    wrong = "no case of wear" if way == "another" else "the case itself, or one that names it"
    start = f"fretscale: {path}:5: evolution.file: '{named}': {wrong}"
    assert reported(path).startswith(start)


@pytest.mark.parametrize("text", [BALL, "", ROLLER_WEAR])
def test_a_case_without_a_table_of_loops_is_refused_where_it_is_named(tmp_path, text):
    (tmp_path / "loads.csv").write_text(ROLLER_LOADS, encoding="utf-8")
    (tmp_path / "w.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "a.yaml").write_text(TIME % "w.yaml", encoding="utf-8")
    assert "a.yaml:5: evolution.file: " in reported(tmp_path / "a.yaml")


# --- HDF5 -----------------------------------------------------------------------------------------


def soft(file):
    file["one"], file["two"] = h5py.SoftLink("/two"), h5py.SoftLink("/one")


def virtual(file):
    layout = h5py.VirtualLayout(shape=(3,), dtype="f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", shape=(3,))
    file.create_virtual_dataset("far", layout)


ASTRAY = [
    (soft, "/one"),
    (lambda file: file.update({"out": h5py.ExternalLink("b.h5", "/x")}), "/out"),
    (virtual, "/far"),
]


@pytest.mark.parametrize(("spoil", "place"), ASTRAY)
def test_links_that_leave_an_hdf5_file_are_refused(tmp_path, spoil, place):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["gap"] = np.zeros((8, 8))
        spoil(file)
    with pytest.raises(InputFileError, match=place), open_hdf5(str(tmp_path / "a.h5")):
        pass


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("stiffness", np.zeros(3), "stiffness: shape (3,)"),
        ("stiffness", np.full((6, 6), np.nan), "stiffness: not all finite numbers"),
        ("names", np.arange(6.0), "names: not texts"),
        ("kept", None, "no dataset kept"),
    ],
)
def test_a_reduced_body_is_read_by_check(tmp_path, name, value, words):
    names = [f"{point} {axis}".encode() for point in ("pad 1", "ring 1") for axis in "xyz"]
    whole = {
        "kept": np.arange(6),
        "stiffness": np.eye(6),
        "mass": np.eye(6),
        "loads": np.zeros((6, 1)),
        "mode_shapes": np.zeros((6, 0)),
        "frequencies": np.zeros(0),
        "names": np.array(names),
        "places": np.zeros((6, 3)),
    }
    path = tmp_path / "case.yaml"
    text = (CASES / "rig_reduced.yaml").read_text(encoding="utf-8")
    text = text.replace("file: specimens_coarse.yaml", "file: body.h5")
    path.write_text("".join(line for line in text.splitlines(True) if "  body: " not in line))
    for datasets, code in ((whole, 0), (whole | {name: value}, 2)):
        with h5py.File(tmp_path / "body.h5", "w") as file:
            file.update({key: array for key, array in datasets.items() if array is not None})
        ended = command("check", path)
        assert ended.exit_code == code, ended.output
    assert words in ended.stderr
