"""Files that a case names are opened with it, and refused if their content is unsuitable."""

import h5py
import numpy as np
import pytest

from tests.conftest import CASES
from tests.workflow.command_line import command
from tests.workflow.scenes import BALL, ROLLER_LOADS, ROLLER_WEAR
from workflow.case.fields import File
from workflow.case.files.input_files import InputFileError, open_hdf5
from workflow.case.loading import YAML, CaseFile
from workflow.case.sections import entry_of, sections_of
from workflow.kinds import kinds

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


def entries(model):
    for name, field in model.model_fields.items():
        yield name, field
        for section in sections_of(field.annotation):
            yield from entries(section)


@pytest.mark.parametrize("kind", kinds())
def test_every_case_that_a_case_names_is_read_with_it(kind):
    """Any entry that names a case has it read, in any kind of case."""
    for name, field in entries(kinds()[kind]):
        file = entry_of(field)
        if isinstance(file, File) and YAML in file.endings:
            assert isinstance(file, CaseFile), name


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


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BALL, "no case of wear with loops"),
        ("", "w.yaml:1: empty"),
        (ROLLER_WEAR, "writes no table of loops"),
        (ROLLER_WEAR.replace("loads.csv", "none.csv"), "'none.csv': no such file"),
    ],
)
def test_a_case_that_is_named_is_one_of_the_kind(tmp_path, text, words):
    (tmp_path / "loads.csv").write_text(ROLLER_LOADS, encoding="utf-8")
    (tmp_path / "w.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "a.yaml").write_text(TIME % "w.yaml", encoding="utf-8")
    line = reported(tmp_path / "a.yaml")
    assert line.startswith(f"fretscale: {tmp_path / 'a.yaml'}:5: evolution.file: 'w.yaml': ")
    assert words in line


# --- HDF5 -----------------------------------------------------------------------------------------


def soft(file):
    file["one"], file["two"] = h5py.SoftLink("/two"), h5py.SoftLink("/one")


def virtual(file):
    layout = h5py.VirtualLayout(shape=(3,), dtype="f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", shape=(3,))
    file.create_virtual_dataset("far", layout)


ASTRAY = [
    (soft, "/one: a link that leads nowhere"),
    (lambda file: file.update({"lost": h5py.SoftLink("/none")}), "/lost: a link that leads"),
    (lambda file: file.update({"out": h5py.ExternalLink("b.h5", "/x")}), "/out: a link to another"),
    (virtual, "/far: a dataset with numbers of another file"),
    (
        lambda file: file.create_dataset("raw", (3,), "f8", external=[("/dev/zero", 0, 24)]),
        "/raw: a dataset with numbers of another file",
    ),
]


@pytest.mark.parametrize(("spoil", "words"), ASTRAY)
def test_all_that_an_hdf5_file_leads_to_is_in_it(tmp_path, spoil, words):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["gap"] = np.zeros((8, 8))
        spoil(file)
    text = (CASES / "sphere_normal.yaml").read_text(encoding="utf-8")
    path, structure = tmp_path / "case.yaml", "structure={kind: bodies, shape: heights, file: %s}"
    path.write_text(text, encoding="utf-8")
    line = reported(path, structure % '"a.h5:gap"')
    assert f"structure.file: {tmp_path / 'a.h5'}: {words}" in line
    with pytest.raises(InputFileError, match=words), open_hdf5(str(tmp_path / "a.h5")):
        pass


def test_links_within_an_hdf5_file_may_go_round(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("group")
        group["again"], group["top"] = group, file["/"]
        file["gap"] = np.arange(3.0)
        file["same"] = h5py.SoftLink("/group/top/gap")
    with open_hdf5(str(tmp_path / "a.h5")) as file:
        assert file["same"][2] == 2.0


@pytest.mark.parametrize("spoil", [b"", b"\x89HDF\r\n\x1a\n" + bytes(200), b"PK\x03\x04 no"])
@pytest.mark.parametrize("name", ["a.h5:gap", "a.npy"])
def test_what_is_no_field_of_heights_is_one_line(tmp_path, spoil, name):
    for ending in ("h5", "npy"):
        (tmp_path / f"a.{ending}").write_bytes(spoil)
    text = (CASES / "sphere_normal.yaml").read_text(encoding="utf-8")
    (tmp_path / "case.yaml").write_text(text, encoding="utf-8")
    structure = f'structure={{kind: bodies, shape: heights, file: "{name}"}}'
    assert "cannot be read (" in reported(tmp_path / "case.yaml", structure)


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
