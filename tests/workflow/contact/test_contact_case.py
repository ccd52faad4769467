"""Tests of contact cases: refusals in one line each, and the path and files that are read."""

import h5py
import numpy as np
import pytest

from sa_solver.types import Material
from tests.workflow.scenes import BALL
from workflow.analyses.contact.case import ContactCase, LineContactCase
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import parse_case
from workflow.models.uncoupled.load_table import LoadTable

ROLLER = (
    BALL.replace("shape: sphere", "shape: cylinder")
    .replace("400 N", "400 N/mm")
    .replace("210 N", "210 N/mm, bulk_stress_2: 100 MPa")
    .replace("grid: [16, 16], size: [1 mm, 1 mm]", "grid: 64, size: 2 mm")
)
RIGID_2 = "  body_2: {young: 115 GPa, poisson: 0.29}", "  body_2: rigid"

SPHERE = "shape: sphere, radius: 10 mm"
NO_FRICTION = "friction: {coefficient: 0.7}\n", ""
PERIODIC = BALL.replace("size: [1 mm, 1 mm]", "size: [1 mm, 1 mm], boundary: periodic")
LAYER = "{thickness: 50 um, young: 20 GPa, poisson: 0.3}"
COATED = BALL.replace(RIGID_2[0], f"{RIGID_2[0][:-1]}, layers: [{LAYER}]}}")
# Base, text to replace, its replacement, key in the message.
WRONG = [
    (BALL, "shape: sphere, ", "", "structure.shape"),
    (BALL, "sphere", "ellipsoid", "structure.radius"),
    (BALL, RIGID_2[0], "  body_2: steel", "materials.body_2"),
    (
        BALL.replace(*RIGID_2),
        RIGID_2[0].replace("2", "1", 1),
        "  body_1: rigid",
        "materials.body_2",
    ),
    (ROLLER, *RIGID_2, "materials.body_2"),
    (BALL, "P: 400 N", "P: 400 N, approach: 1 um", "load_path.legs.0.approach"),
    (BALL, "- {P: 400 N}", "- {P: 400 N, shift_x: 1 um}", "load_path.legs.0.shift_x"),
    (BALL, "P: 400 N", "Qy: 1 N", "load_path.legs"),
    (BALL, "size: [1 mm, 1 mm]", "size: 1 mm", "contact.size"),
    (ROLLER, "size: 2 mm", "size: 2 mm, datum: 1 mm", "contact.datum"),
    (BALL, SPHERE, "shape: heights, file: none.npy", "structure.file"),
    (BALL, *NO_FRICTION, "friction"),
    (BALL.replace(*RIGID_2).replace("Qx: 210 N", "Mx: 1 N*mm"), *NO_FRICTION, "friction"),
    (PERIODIC, "boundary: periodic", "boundary: closed", "contact.boundary"),
    (PERIODIC, "Qx: 210 N", "Mz: 1 N*mm", "load_path"),
    (PERIODIC, "Qx: 210 N", "bulk_stress_1: 1 MPa", "load_path"),
    (PERIODIC, *RIGID_2, "materials"),
    (ROLLER, "size: 2 mm", "size: 2 mm, datum: 9 mm, boundary: periodic", "contact.datum"),
    (BALL, "size: [1 mm, 1 mm]", "size: [1 mm, 1 mm], hardness: 0 MPa", "contact.hardness"),
    (BALL, "size: [1 mm, 1 mm]", "size: [1 mm, 1 mm], hardness: 300 MPa", "contact.hardness"),
    (COATED, "size: [1 mm, 1 mm]", "size: [1 mm, 1 mm], hardness: 1 GPa", "contact.hardness"),
    (BALL, "coefficient: 0.7", "coefficient: 0.7, field: none.npy", "friction.field"),
    (
        *(BALL, "coefficient: 0.7"),
        "coefficient: 0.7, by_pressure: {pressure: [1 GPa, 0 MPa], factor: [1, 2]}",
        "friction.by_pressure.pressure",
    ),
    (
        *(BALL, "coefficient: 0.7"),
        "coefficient: 0.7, by_pressure: {pressure: [0 MPa], factor: [1, 2]}",
        "friction.by_pressure.factor",
    ),
    (
        *(COATED, "coefficient: 0.7"),
        "coefficient: 0.7, by_pressure: {pressure: [0 MPa], factor: [1]}",
        "friction",
    ),
    (COATED, "thickness: 50 um", "thickness: -1 um", "materials.body_2.layers.0.thickness"),
    (COATED, "thickness: 50 um, ", "", "materials.body_2.layers.0.thickness"),
    (COATED, LAYER, "paint", "materials.body_2.layers.0"),
    (COATED, "young: 20 GPa, ", "", "materials.body_2.layers.0.young"),
    (COATED, "Qx: 210 N", "bulk_stress_2: 1 MPa", "materials.body_2"),
    (COATED, "size: [1 mm, 1 mm]", "size: [1 mm, 1 mm], boundary: periodic", "materials"),
    (COATED.replace("Qx: 210 N", "Mx: 1 N*mm"), *NO_FRICTION, "friction"),
]


def refusal(text, name="case.yaml"):
    with pytest.raises(CaseError) as refused:
        parse_case(text, str(name))
    (line,) = str(refused.value).splitlines()
    return line


@pytest.mark.parametrize(("base", "old", "new", "key"), WRONG)
def test_wrong_entries_are_named(base, old, new, key):
    assert old in base
    with pytest.raises(CaseError) as refused:
        parse_case(base.replace(old, new, 1), "case.yaml")
    assert f": {key}: " in str(refused.value)


def test_bases_are_cases_that_read_back_equal():
    for text, kind in ((BALL, ContactCase), (ROLLER, LineContactCase)):
        case = parse_case(text, "case.yaml")
        assert isinstance(case, kind)
        assert parse_case(dump_case(case), "dump") == case


def test_layers_are_those_of_the_library():
    case = parse_case(COATED.replace(LAYER, f"{LAYER}, {{thickness: 1 um, material: 304L}}"), "c")
    first, second = case.materials.body_2.elastic().layers
    assert (first.thickness, first.young, first.poisson) == pytest.approx((0.05, 20e3, 0.3))
    assert second.young == case.materials.body_2.layers[1].young
    assert parse_case(dump_case(case), "dump") == case
    (row,) = (text for title, text in case.outline() if title == "layers")
    assert row.startswith("body_2: (thickness 50 µm")
    assert "304L" in row


def test_like_bodies_that_are_only_pressed_need_no_friction():
    pressed = BALL.replace("friction: {coefficient: 0.7}\n", "").replace("Qx: 210 N", "Mx: 1 N*mm")
    assert parse_case(pressed, "case.yaml").friction.coefficient == 0.0


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
    ("content", "line"), [("P,bulk_stress1\n1,2\n", 1), ("P,Qx\n1,2\n1\n", 3), ("P,Qx\n1,nan\n", 2)]
)
def test_a_wrong_path_file_is_refused_with_both_lines(tmp_path, content, line):
    file = tmp_path / "history.csv"
    file.write_text(content, encoding="utf-8")
    reported = refusal(with_file(BALL), tmp_path / "case.yaml")
    assert reported.startswith(f"{tmp_path / 'case.yaml'}:8: load_path.file: {file}:{line}: ")


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


def test_heights_on_another_grid_are_refused(tmp_path, heights):
    text = BALL.replace(SPHERE, "shape: heights, file: gap.npy")
    reported = refusal(text.replace("[16, 16]", "[16, 32]"), tmp_path / "case.yaml")
    assert "contact.grid" in reported
    assert "[16, 16]" in reported


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("gap.csv", b"1,2\n3\n"),
        ("gap.csv", b"1,2\n3,x\n"),
        ("gap.npy", b"no array"),
        ("gap.h5:a", b""),
    ],
)
def test_wrong_heights_are_refused(tmp_path, name, content):
    (tmp_path / name.split(":")[0]).write_bytes(content)
    text = BALL.replace(SPHERE, f"shape: heights, file: '{name}'")
    assert ":3: structure.file: " in refusal(text, tmp_path / "case.yaml")
