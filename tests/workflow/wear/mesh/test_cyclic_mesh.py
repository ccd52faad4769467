"""Tests of a mesh case of one sector of a wheel: runs, reports and refusals."""

import pytest

from fe_models.meshes.structure_mesh import StructureMesh, write_msh
from tests.marks import slow
from tests.wheels import about, sector, shoe, turned
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import refused, run, write_case

SECTORS, COUNTS = 4, (4, 7, 1)
CYCLIC = about(sectors=SECTORS)
CUTS = {"low": "wheel_low", "high": "wheel_high", "sectors": SECTORS}
STRUCTURE = {
    "body_1": "wheel",
    "body_2": "shoe_0",
    "contacts": [
        {"name": "pad", "face_1": "wheel_pad", "face_2": "shoe_0_pad_0", "x": [1, 0, 0]}
    ],
    "supports": [{"group": "wheel_bore", "hold": "all"}],
    "loads": [
        {"kind": "pressure", "group": "shoe_0_top_0", "pressure": "30 MPa", "path": [1, 1, 1]},
        {"kind": "force", "group": "shoe_0_top_0", "force": [150, 0, -80], "path": [0, 1, -1]},
        {"kind": "rotation", "speed": "500 rad/s", "axis": [0, 1, 0], "through": [0, 0, 0],
         "path": [0, 1, 1]},
    ],
    "cyclic": [CUTS],
}  # fmt: skip
LEGS = {"increments": [1, 2, 2]}


def case_of(folder, moved=0.0, **changes):
    """Write a case of a sector with its shoe, in the plane."""
    body = turned(shoe(SECTORS, COUNTS), CYCLIC, 0)
    file = folder / "sector.msh"
    write_msh(file, StructureMesh((sector(SECTORS, COUNTS, moved=moved), body), ()))
    structure = {"file": str(file), **STRUCTURE, **changes}
    return write_case(folder / "sector.yaml", structure, LEGS, grid=(24, 1))


@pytest.mark.parametrize("order", [1, slow(2)])
def test_sector_runs(tmp_path, order):
    """The run ties the cuts and announces what is tied."""
    case, elements = case_of(tmp_path), f"mesh.order={order}"
    reported = invoke("check", case).output
    assert "one of 4: wheel_low and wheel_high match node to node" in reported
    summary = run(case, tmp_path / "out", elements)["structure"]
    assert summary["equilibrium_error"] < 1e-6
    stress = summary["peak_stress"]["worn"]["wheel"]["von_mises"]
    free = run(case_of(tmp_path, cyclic=[]), tmp_path / "without", elements)["structure"]
    assert free["peak_stress"]["worn"]["wheel"]["von_mises"] > 1.1 * stress


def test_cuts_that_do_not_match_run(tmp_path):
    case = case_of(tmp_path, moved=0.3)
    assert (
        "wheel_low and wheel_high do not match and are tied by a mortar"
        in invoke("check", case).output
    )
    assert run(case, tmp_path / "out")["structure"]["equilibrium_error"] < 1e-6


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("structure.cyclic.0.sectors=5", "wheel_high"),
        ("structure.cyclic.0.axis=[0, 0, 0]", "structure.cyclic.0.axis"),
        ("structure.cyclic.0.axis=[0, 0, 1]", "structure.cyclic.0: "),
        ("structure.cyclic.0.high=wheel_low", "wheel_low"),
        ("structure.cyclic.0.high=wheel_rim", "wheel_rim"),
        ("structure.contacts.0.face_1=wheel_rim", "structure.cyclic.0: "),
        ("structure.loads.2.through=[1, 0, 0]", "rotation"),
        ("structure.supports.0.group=wheel_low", "supports.0.group"),
    ],
)
def test_wrong_cuts_are_refused(tmp_path, override, named):
    """The refusal is one line that names the entry."""
    assert named in refused(case_of(tmp_path), override)
