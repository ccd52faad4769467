"""A mesh in metres or inches gives the results of one in mm; a missing unit is warned of."""

import re

import numpy as np
import pytest

from fe_models.geometry.imported import read_bodies
from tests.fe_models.readers import cae_files
from tests.fe_models.readers.test_cae_files import group
from tests.workflow.case.test_offered_case import deck, offered
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import run, write_case

pytestmark = pytest.mark.usefixtures("reads_here")
METRES = "structure.length_unit=m"
# Without runs that estimate its errors.
ALONE = "error_budget=known"


def divided(path, size):
    """Write an Abaqus file with the positions of nodes and instances divided by a size."""
    lines, nodes = path.read_text("utf-8").splitlines(), False
    for k, line in enumerate(lines):
        if line.startswith("*"):
            nodes = line == "*Node"
            placed = line.startswith("*Instance")
        elif nodes:
            number, *place = line.split(",")
            lines[k] = ", ".join([number, *(repr(float(x) / size) for x in place)])
        elif placed:
            lines[k] = ", ".join(repr(float(x) / size) for x in line.split(","))
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


def test_a_mesh_in_metres_wears_as_in_millimetres(blocks, tmp_path):
    """All results agree, and so does the worn mesh, which is in mm."""
    expected = run(blocks, tmp_path / "mm", ALONE)["foot"]
    divided(tmp_path / "blocks.inp", 1000.0)
    found = run(blocks, tmp_path / "m", METRES, ALONE)["foot"]
    for name in ("depth_1", "depth_2", "volume_2", "energy"):
        assert found[name] == pytest.approx(expected[name], rel=1e-8)
    forces = (part["peak_load"]["unworn"]["P"] for part in (found, expected))
    assert next(forces) == pytest.approx(next(forces), rel=1e-9)
    for one, other in zip(
        *(read_bodies(tmp_path / unit / "worn.msh").bodies.values() for unit in ("m", "mm")),
        strict=True,
    ):
        np.testing.assert_allclose(one.points, other.points, atol=1e-9)
    assert "worn.msh, worn_nodes and ParaView files are in mm" in " ".join(
        (tmp_path / "m" / "run.log").read_text("utf-8").split()
    )


def _printed(case, *options):
    return " ".join(invoke("check", case, *options).output.split())


def test_a_forgotten_unit_gives_a_warning(blocks, tmp_path):
    """Metres read as mm make bodies of µm, with 4 N on a millionth of their face."""
    assert "warning: " not in _printed(blocks)
    divided(tmp_path / "blocks.inp", 1000.0)
    printed = _printed(blocks)
    assert re.search(
        r"warning: structure\.length_unit: bodies of 3 µm.*; 3 mm if they are in m", printed
    )
    assert "structure.loads.1: gives a pressure of about" in printed
    assert "warning: " not in _printed(blocks, "--set", METRES)
    moved = "{kind: displacement, group: foot_high, path: [0, 1, 0, 0], "
    moved += "displacement: [0.8 mm, 0, 0]}"
    printed = _printed(blocks, "--set", METRES, "--set", f"structure.loads.1={moved}")
    assert "structure.loads.1.displacement: moves Foot-1, which is 1 mm long, by 0.8 mm" in printed


def test_a_file_in_inches_becomes_a_case_in_base_units(tmp_path):
    """Pounds, inches and seconds: 3e7 psi, 7.346e-4 lbf s²/in⁴, 5801.5 psi, a traction of 4."""
    path = deck(tmp_path)
    divided(path, 25.4)
    text = path.read_text("utf-8")
    for ours, inches in (
        ("7.85e-09,", "7.3456e-4,"), ("206843.5, 0.29", "3.e7, 0.29"), ("P, 40.", "P, 5801.51"),
    ):  # fmt: skip
        assert ours in text
        text = text.replace(ours, inches)
    path.write_text(text, encoding="utf-8")
    case, _ = offered(path, "--unit", "in")
    assert case["structure"]["length_unit"] == "in"
    steel = case["materials"]["body_1"]
    assert steel["young"] == pytest.approx(206843.0, rel=1e-4)
    assert steel["density"] == pytest.approx(7.85e-9, rel=1e-4)
    assert steel["expansion"] == pytest.approx(1.2e-5)
    pressure, push, *_ = case["structure"]["loads"]
    assert pressure["pressure"] == pytest.approx(40.0, rel=1e-4)
    # 4 psi on the foot's square millimetre.
    assert push["force"] == pytest.approx([4.0 * 6.894757e-3, 0.0, 0.0], rel=1e-5)


def cubes_of_salome():
    """Return a column of two unit cubes below another, in a file that claims metres."""
    points = [(x, y, z) for z in (0, 1, 2, 2, 3) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    cells = np.array([range(8), range(4, 12), range(12, 20)])
    text = cae_files.universal(np.array(points, dtype=float), {"hexahedron": cells})
    text = text.rstrip("\n").removesuffix("    -1")
    named = [group(1, "lower", 8, [1, 2]), group(2, "upper", 8, [3])]
    for number, (name, layer) in enumerate({"base": 0, "low": 2, "foot": 3, "high": 4}.items(), 11):
        text += "".join(f"{v:10d}" for v in (number, 94, 1, 1, 7, 4)) + "\n"
        text += "".join(f"{4 * layer + corner:10d}" for corner in (1, 2, 3, 4)) + "\n"
        named.append(group(number, name, 8, [number]))
    units = "    -1\n   164\n         1  SI: Meter (newton)         2\n   1.   1.   1.\n    -1\n"
    return f"{units}{text}    -1\n    -1\n  2467\n{''.join(named)}    -1\n"


def test_metres_of_a_universal_file_are_asked_about(tmp_path):
    """Salome writes this unit for every mesh, so the case must state one."""
    (tmp_path / "cubes.unv").write_text(cubes_of_salome(), encoding="utf-8")
    contact = {"name": "pad", "face_1": "low", "face_2": "foot", "x": [1, 0, 0]}
    pressure = {"kind": "pressure", "group": "high", "pressure": "1 MPa", "path": [1, 0]}
    structure = {
        "file": "cubes.unv", "body_1": "lower", "body_2": "upper", "contacts": [contact],
        "supports": [{"group": "base", "hold": "all"}], "loads": [pressure],
    }  # fmt: skip
    case = write_case(tmp_path / "cubes.yaml", structure, {"increments": [1, 1]}, grid=(8, 8))
    printed = _printed(case)
    assert "in m, as cubes.unv:2 says, converted to mm; bodies within 1000 x 1000 x 3000" in printed
    assert "warning: structure.length_unit: lengths are in m, as cubes.unv:2 says" in printed
    for unit, sides in (("mm", "1 x 1 x 3 mm"), ("m", "1000 x 1000 x 3000 mm")):
        printed = _printed(case, "--set", f"structure.length_unit={unit}")
        assert "warning: structure.length_unit" not in printed
        assert f"bodies within {sides}" in printed
