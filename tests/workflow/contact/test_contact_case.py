"""Tests of contact cases: refusals in one line each, and the path and files that are read."""

import re

import h5py
import numpy as np
import pytest

from sa_solver.types import Material
from tests.workflow.scenes import BALL
from workflow.analyses.contact.case import ContactCase, LineContactCase
from workflow.case.files.input_files import InputFileError, read_heights
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import parse_case
from workflow.models.uncoupled.load_table import FORCES, LoadTable

ROLLER = (
    BALL.replace("shape: sphere", "shape: cylinder")
    .replace("400 N", "400 N/mm")
    .replace("210 N", "210 N/mm, bulk_stress_2: 100 MPa")
    .replace("grid: [16, 16], size: [1 mm, 1 mm]", "grid: 64, size: 2 mm")
)
RIGID_2 = "  body_2: {young: 115 GPa, poisson: 0.29}", "  body_2: rigid"

# Name, base, text to replace, its replacement, key in the message, words in it.
WRONG = [
    ("no structure", BALL, "structure: {kind: bodies, shape: sphere, radius: 10 mm}\n", "",
     "structure.kind", "missing; allowed: bodies"),
    ("no shape", BALL, "shape: sphere, ", "", "structure.shape", "missing; allowed: sphere, "),
    ("entry of another shape", BALL, "sphere", "ellipsoid", "structure.radius",
     "did you mean 'radius_"),
    ("unknown body", BALL, *RIGID_2[:1], "  body_2: steel", "materials.body_2",
     "'steel': unknown material; allowed: a name that `fretscale materials` lists"),
    ("rigid, misspelt", BALL, *RIGID_2[:1], "  body_2: rigidly", "materials.body_2", "'rigid'"),
    ("both rigid", BALL.replace(*RIGID_2), "body_1: {young: 115 GPa, poisson: 0.29}",
     "body_1: rigid", "materials.body_2", "both bodies are rigid"),
    ("bulk stress in a rigid body", ROLLER, *RIGID_2, "materials.body_2", "bulk_stress_2"),
    ("P and approach in one leg", BALL, "P: 400 N", "P: 400 N, approach: 1 um",
     "load_path.legs.0.approach", "with P"),
    ("force and motion in two legs", BALL, "- {P: 400 N}", "- {P: 400 N, shift_x: 1 um}",
     "load_path.legs.0.shift_x", "with Qx"),
    ("neither P nor approach", BALL, "P: 400 N", "Qy: 1 N", "load_path.legs",
     "neither P nor approach"),
    ("no legs", BALL, BALL[BALL.index("\n  legs:"):BALL.index("\ncontact")], " {legs: []}",
     "load_path.legs", "neither given"),
    ("one size on an area", BALL, "size: [1 mm, 1 mm]", "size: 1 mm", "contact.size", "not a list"),
    ("two sizes on a line", ROLLER, "size: 2 mm", "size: [2 mm, 2 mm]", "contact.size",
     "not a number"),
    ("datum in the grid", ROLLER, "size: 2 mm", "size: 2 mm, datum: 1 mm", "contact.datum",
     "at least the size, 2 mm"),
    ("path that is not there", BALL, BALL[BALL.index("\n  legs:"):BALL.index("\ncontact")],
     " {file: none.csv}", "load_path.file", "no such file"),
    ("heights that are not there", BALL, "shape: sphere, radius: 10 mm",
     "shape: heights, file: none.npy", "structure.file", "no such file"),
    ("heights of another kind", BALL, "shape: sphere, radius: 10 mm",
     "shape: heights, file: none.tif", "structure.file", ".npy, .csv, .h5"),
    ("shear without friction", BALL, "friction: {coefficient: 0.7}\n", "", "friction",
     "missing, but load_path has Qx"),
    ("unlike bodies without friction", BALL.replace(*RIGID_2).replace("Qx: 210 N", "Mx: 1 N*mm"),
     "friction: {coefficient: 0.7}\n", "", "friction", "missing, but dissimilar bodies rub"),
]  # fmt: skip


def refusal(text, name="case.yaml"):
    with pytest.raises(CaseError) as refused:
        parse_case(text, str(name))
    (line,) = str(refused.value).splitlines()
    return line


@pytest.mark.parametrize(
    ("base", "old", "new", "key", "words"),
    [row[1:] for row in WRONG],
    ids=[row[0] for row in WRONG],
)
def test_wrong_entry_is_told_in_one_line(base, old, new, key, words):
    assert old in base
    text = base.replace(old, new, 1)
    with pytest.raises(CaseError) as refused:
        parse_case(text, "case.yaml")
    lines = str(refused.value).splitlines()
    (line,) = [line for line in lines if f": {key}: " in line]
    place = re.match(rf"case\.yaml:(\d+): {re.escape(key)}: ", line)
    assert place, line
    assert words in line
    # Of what is there, the line in the file is the entry's own.
    if "missing" not in line:
        written = [part for part in key.split(".") if not part.isdigit()][-1]
        assert written in text.splitlines()[int(place[1]) - 1]


def test_bases_are_cases_that_read_back_equal():
    for text, kind in ((BALL, ContactCase), (ROLLER, LineContactCase)):
        case = parse_case(text, "case.yaml")
        assert isinstance(case, kind)
        assert parse_case(dump_case(case), "dump") == case


def test_like_bodies_that_are_only_pressed_need_no_friction():
    pressed = BALL.replace("friction: {coefficient: 0.7}\n", "").replace("Qx: 210 N", "Mx: 1 N*mm")
    assert parse_case(pressed, "case.yaml").friction.coefficient == 0.0


def test_rigid_body_is_written_as_a_word():
    case = parse_case(BALL.replace(*RIGID_2), "case.yaml")
    assert "body_2: rigid " in dump_case(case)
    assert parse_case(dump_case(case), "dump") == case


# --- path ---------------------------------------------------------------------------------------


def test_legs_are_passed_at_equal_steps_and_keep_what_they_do_not_name():
    text = BALL.replace(
        "    - {P: 400 N}\n", "    - {P: 400 N, increments: 2}\n    - {shift_y: 1 um}\n"
    )
    table = parse_case(text, "case.yaml").load_path.table()
    assert table.is_motion == (False, False, True, False, False, False)
    np.testing.assert_array_equal(table.imposed[:, 0], [200, 400, 400, 400, 400, 400, 400])
    np.testing.assert_array_equal(table.imposed[:, 1], [0, 0, 0, 52.5, 105, 157.5, 210])
    np.testing.assert_array_equal(table.imposed[:, 2], [0, 0, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3])
    assert not table.imposed[:, 3:].any()


def test_returning_legs_return_exactly():
    """The loop is found by equal loads, which 0.1 + 0.2 must not disturb."""
    legs = "".join(f"    - {{Qx: {q}, increments: 7}}\n" for q in (0.3, -0.1, 0.3))
    text = BALL.replace("    - {Qx: 210 N, increments: 4}\n", legs)
    force = parse_case(text, "case.yaml").load_path.table()["Qx"]
    assert force[7] == force[21] == 0.3


def test_bulk_stress_strains_each_body_by_its_own_stiffness():
    bodies = Material(1e5, 0.3), Material(np.inf, 0.0)
    stress = np.array([0.0, 100.0])
    table = LoadTable({"P": stress, "bulk_stress_1": stress})
    np.testing.assert_allclose(table.bulk_strain(bodies), [0.0, -100.0 * 0.91 / 1e5])
    table = LoadTable({"P": stress, "bulk_stress_2": stress})
    np.testing.assert_allclose(table.bulk_strain(bodies[::-1]), [0.0, 100.0 * 0.91 / 1e5])


def with_file(base):
    """Return the case with its path in ``history.csv``."""
    start, end = base.index("\n  legs:"), base.index("\ncontact")
    return base[:start] + " {file: history.csv}" + base[end:]


@pytest.mark.parametrize(("heading", "load"), [("P", "400"), ("P [kN]", "0.4")])
def test_file_and_legs_are_the_same_path(tmp_path, heading, load):
    rows = "".join(f"{load},{q}\n" for q in (0, 52.5, 105, 157.5, 210))
    (tmp_path / "history.csv").write_text(f"{heading}, Qx\n{rows}", encoding="utf-8")
    by_file = parse_case(with_file(BALL), str(tmp_path / "case.yaml"))
    by_legs = parse_case(BALL, "case.yaml")
    np.testing.assert_array_equal(
        by_file.load_path.table().imposed, by_legs.load_path.table().imposed
    )
    # Wherever its copy goes, the case finds its file.
    again = parse_case(dump_case(by_file), "elsewhere/case.yaml")
    np.testing.assert_array_equal(
        again.load_path.table().imposed, by_file.load_path.table().imposed
    )


@pytest.mark.parametrize(
    ("content", "line", "words"),
    [
        ("", 1, "no rows"),
        ("P,bulk_stress1\n1,2\n", 1, "column; did you mean 'bulk_stress_1'?"),
        ("P,P\n1,2\n", 1, "P: column given twice"),
        ("P,Qx\n1,2\n1\n", 3, "1 values; allowed: 2"),
        ("P,Qx\n1,2\n\n1,2,3\n", 4, "3 values; allowed: 2"),
        ("P,Qx\n1,nan\n", 2, "Qx: nan: not a finite number"),
        ("P,Qx\n-1,0\n", 2, "P: -1: out of range; allowed: 0 to 1e6 kN"),
    ],
)
def test_wrong_path_file_is_told_with_both_lines(tmp_path, content, line, words):
    file = tmp_path / "history.csv"
    file.write_text(content, encoding="utf-8")
    reported = refusal(with_file(BALL), tmp_path / "case.yaml")
    assert reported.startswith(f"{tmp_path / 'case.yaml'}:8: load_path.file: {file}:{line}: "), (
        reported
    )
    assert words in reported


@pytest.mark.parametrize(
    ("content", "words"),
    [("Qx\n1\n", "neither P nor approach"), ("P,approach\n1,0\n", "together with P")],
)
def test_columns_of_a_path_file_must_agree(tmp_path, content, words):
    (tmp_path / "history.csv").write_text(content, encoding="utf-8")
    reported = refusal(with_file(BALL), tmp_path / "case.yaml")
    assert f"{tmp_path / 'case.yaml'}:8: load_path.file: " in reported
    assert words in reported


def test_path_file_of_a_line_has_no_moment_about_x(tmp_path):
    (tmp_path / "history.csv").write_text("P,Mx\n1,0\n", encoding="utf-8")
    assert "'Mx': unknown column" in refusal(with_file(ROLLER), tmp_path / "case.yaml")


# --- shapes -------------------------------------------------------------------------------------


def gap(text, **changes):
    case = parse_case(text, "case.yaml")
    grid = case.contact.centred()
    return case.structure.gap_on(grid), np.broadcast_arrays(grid.x, grid.y)


def test_gaps_of_the_shapes():
    height, (x, y) = gap(BALL)
    np.testing.assert_allclose(height, (x**2 + y**2) / 20.0)
    sphere = "shape: sphere, radius: 10 mm"
    height, (x, y) = gap(BALL.replace(sphere, "shape: ellipsoid, radius_x: 5 mm, radius_y: 20 mm"))
    np.testing.assert_allclose(height, x**2 / 10.0 + y**2 / 40.0)
    height, (x, y) = gap(ROLLER)
    np.testing.assert_allclose(height, x**2 / 20.0)
    flat = "shape: flat_rounded, half_width: 0.5 mm, edge_radius: 3 mm"
    height, (x, y) = gap(ROLLER.replace("shape: cylinder, radius: 10 mm", flat))
    np.testing.assert_allclose(height, np.maximum(abs(x) - 0.5, 0.0) ** 2 / 6.0)
    assert (height == 0.0).sum() == 32


@pytest.fixture
def heights(tmp_path):
    """Return the same heights in every kind of file."""
    values = np.arange(16.0 * 16.0).reshape(16, 16) / 7.0
    np.save(tmp_path / "gap.npy", values)
    np.savetxt(tmp_path / "gap.csv", values, delimiter=",", fmt="%.17g")
    with h5py.File(tmp_path / "gap.h5", "w") as file:
        file["scan/gap"] = values
    return values


@pytest.mark.parametrize("name", ["gap.npy", "gap.csv", "gap.h5:scan/gap"])
def test_heights_are_read_as_written(tmp_path, heights, name):
    text = BALL.replace("shape: sphere, radius: 10 mm", f"shape: heights, file: '{name}'")
    case = parse_case(text, str(tmp_path / "case.yaml"))
    np.testing.assert_array_equal(case.structure.gap_on(case.contact.centred()), heights)
    assert parse_case(dump_case(case), "elsewhere/case.yaml") == case


def test_heights_of_one_column_are_a_line_contact(tmp_path):
    np.save(tmp_path / "gap.npy", np.arange(64.0))
    text = ROLLER.replace("shape: cylinder, radius: 10 mm", "shape: heights, file: gap.npy")
    case = parse_case(text, str(tmp_path / "case.yaml"))
    assert isinstance(case, LineContactCase)
    assert case.structure.gap_on(case.contact.centred()).shape == (64, 1)


def test_heights_on_another_grid_are_refused(tmp_path, heights):
    text = BALL.replace("shape: sphere, radius: 10 mm", "shape: heights, file: gap.npy")
    reported = refusal(text.replace("[16, 16]", "[16, 32]"), tmp_path / "case.yaml")
    assert (
        "contact.grid: 16 x 32 cells: the file of heights has 16 x 16; allowed: [16, 16]"
        in reported
    )


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("gap.csv", b"1,2\n3\n", ":2: 1 values; allowed: 2"),
        ("gap.csv", b"1,2\n3,x\n", ":2: 'x': not a number"),
        ("gap.csv", b"", ":1: empty"),
        ("gap.csv", b"\xff\xfe1", "cannot be read"),
        ("gap.npy", b"no array", "cannot be read"),
        ("gap.h5", b"no file", "which dataset?"),
        ("gap.h5:a", b"no file", "cannot be read"),
    ],
)
def test_wrong_heights_are_told(tmp_path, name, content, words):
    (tmp_path / name.split(":")[0]).write_bytes(content)
    text = BALL.replace("shape: sphere, radius: 10 mm", f"shape: heights, file: '{name}'")
    reported = refusal(text, tmp_path / "case.yaml")
    assert words in reported
    assert ":3: structure.file: " in reported


def test_heights_that_are_no_numbers_are_told(tmp_path):
    for values, words in (
        (np.zeros((2, 2, 2)), "3 dimensions"),
        (np.array([["a"]]), "of type"),
        (np.zeros((0, 3)), "allowed: numbers"),
        (np.array([[1.0, 2.0], [3.0, np.nan]]), "row 2, column 2: not a finite number"),
    ):
        np.save(tmp_path / "gap.npy", values)
        with pytest.raises(InputFileError, match=re.escape(words)):
            read_heights(str(tmp_path / "gap.npy"))
    with h5py.File(tmp_path / "gap.h5", "w") as file:
        file["scan/gap"] = np.zeros((2, 2))
    with pytest.raises(InputFileError, match="no such dataset; at the top: scan"):
        read_heights(f"{tmp_path / 'gap.h5'}:scan")
    assert len(FORCES) == 6
