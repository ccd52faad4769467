"""Tests of bolts in a complete run: tightening, holding, and the tension lost by wear."""

import json

import h5py
import numpy as np
import pytest
from skfem import MeshTri

from fe_models.meshes.structure_mesh import Body, StructureMesh, write_msh
from tests.mirrored_blocks import along
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import refused, run, write_case

pytestmark = pytest.mark.usefixtures("reads_here")

HEIGHT, BEAM, FORCE = 4.0, 2.0, 600.0
LEGS = {"increments": [3, 2, 4, 4], "cycle_from": 3, "peak_leg": 3}
TIGHT = {
    "kind": "pretension",
    "name": "rods",
    "body": "frame",
    "through": [3.0, 0.0, 1.1],
    "axis": [0, 0, 1],
    "force": f"{FORCE} N",
    "path": [1, 1, 1, 1],
}


def written(folder, bodies):
    write_msh(folder / "clamp.msh", StructureMesh(tuple(bodies), ()))


@pytest.fixture
def clamp(tmp_path):
    """Return a block between the beams of a frame with two rods, shaken along them."""
    x = along((0, 0.5, 1), (0.5, 2, 3), (2, 4, 8), (4, 5.5, 3), (5.5, 6, 1))
    whole = MeshTri.init_tensor(x, along((-BEAM, 0, 2), (0, HEIGHT, 8), (HEIGHT, HEIGHT + BEAM, 2)))
    middle = whole.p[:, whole.t].mean(axis=1)
    window = (middle[1] > 0) & (middle[1] < HEIGHT) & (abs(middle[0] - 3.0) < 2.5)
    frame = whole.restrict(np.flatnonzero(~window))
    block = MeshTri.init_tensor(along((2, 4, 10)), along((0, HEIGHT, 8)))
    clamped = {
        "under": lambda p: np.isclose(p[1], 0.0) & (abs(p[0] - 3.0) < 1.0),
        "over": lambda p: np.isclose(p[1], HEIGHT) & (abs(p[0] - 3.0) < 1.0),
        "foot": lambda p: np.isclose(p[1], -BEAM),
    }
    ends = {"low": lambda p: np.isclose(p[1], 0), "high": lambda p: np.isclose(p[1], HEIGHT)}
    side = {"side": lambda p: np.isclose(p[0], 4.0)}
    written(
        tmp_path,
        [
            Body("frame", frame.with_boundaries(clamped)),
            Body("block", block.with_boundaries(ends | side)),
        ],
    )
    structure = {
        "file": "clamp.msh",
        "body_1": "frame",
        "body_2": "block",
        "contacts": [
            {"name": "under", "face_1": "frame_under", "face_2": "block_low", "x": [1, 0, 0]},
            {
                "name": "over",
                "bodies": ["block", "frame"],
                "face_1": "block_high",
                "face_2": "frame_over",
                "x": [1, 0, 0],
            },
        ],
        "supports": [{"group": "frame_foot", "hold": "all"}],
        "loads": [
            TIGHT,
            {
                "kind": "force",
                "group": "block_side",
                "force": ["300 N", 0, 0],
                "path": [0, 1, -1, 1],
            },
        ],
    }
    return write_case(
        tmp_path / "clamp.yaml", structure, LEGS, mu=0.3, grid=(64, 1), error_budget="known"
    )


def test_wear_of_what_is_clamped_costs_tension(clamp, tmp_path):
    """P of both faces is the tension, and its loss follows the depth by the joint diagram."""
    settings = "wear.cycles=2e4", "wear.step.cycles=1e4", "coupling.resultants=every"
    numbers = run(clamp, tmp_path / "out", *settings)
    bolt = numbers["structure"]["bolts"]["rods"]
    for moment in ("unworn", "worn"):
        for name in ("under", "over"):
            P = numbers[name]["peak_load"][moment]["P"]
            assert pytest.approx(bolt["tension"][moment]["peak"], rel=1e-6) == P
    before, after = (bolt["tension"][moment]["peak"] for moment in ("unworn", "worn"))
    # Shaking leaves it nearly what it was tightened to.
    assert before == pytest.approx(FORCE, rel=0.03)
    assert bolt["lost"] == pytest.approx(1.0 - after / before, rel=1e-12)
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        group = file["bolts/rods"]
        assert group["tension"].shape == file["kinetics/cycles"].shape
        assert group["tension"][0] == pytest.approx(before, rel=1e-9)
        assert (np.diff(group["tension"]) < 0.0).all()
        assert group["tension_worn"].shape == (8,)
    worn = sum(numbers[face][f"volume_{k}"] for face in ("under", "over") for k in (1, 2)) / 2.0
    # Loss per depth is tension over shortening. This is exact for uniform wear of a face, whereas
    # this one wears more at its ends, which are softer.
    stiffness = FORCE / bolt["shortening"]
    assert before - after == pytest.approx(stiffness * worn, rel=0.05)


@pytest.mark.slow
def test_a_bolt_is_in_check_summary_and_report(clamp, tmp_path):
    checked = invoke("check", clamp)
    assert checked.exit_code == 0, checked.stderr
    assert "pretension, force 600 N of frame" in checked.stdout
    ending = invoke("run", clamp, "--out", tmp_path / "out", "--set", "output.figures=true")
    assert ending.exit_code == 0, ending.stderr
    assert "rods: tension " in ending.output
    assert (tmp_path / "out" / "figures" / "bolts.png").stat().st_size > 10_000
    report = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "tension at peak load, worn" in report


@pytest.mark.slow
def test_a_shortening_is_as_long_as_it_is(clamp, tmp_path):
    """Twice the shortening gives twice the tension."""
    gently = "structure.loads.1.force=[10 N, 0, 0]"
    short = {"kind": "shortening", "shortening": "4 um"}
    loads = json.dumps({k: v for k, v in TIGHT.items() if k != "force"} | short)
    tensions = []
    for shortening in ("4 um", "8 um"):
        set_load = f"structure.loads.0={loads.replace('4 um', shortening)}"
        numbers = run(clamp, tmp_path / shortening, set_load, gently, "wear.cycles=500")
        bolt = numbers["structure"]["bolts"]["rods"]
        assert "shortening" not in bolt
        tensions.append(bolt["tension"]["unworn"]["peak"])
    assert tensions[1] == pytest.approx(2.0 * tensions[0], rel=0.02)


@pytest.mark.parametrize(
    ("overrides", "wrong"),
    [
        (["structure.loads.0.body=rod"], "no body rod; allowed: frame, block"),
        (["structure.loads.0.through=[0, 0, 99]"], "does not cut body frame"),
        (["structure.loads.0.path=[0, 1, 1, 1]"], "in which the bolt is tightened"),
        (["structure.loads.0.axis=[0, 0, 0]"], "no direction"),
        (["load_path.cycle_from=1"], "would be tightened in every cycle"),
        (
            ["structure.loads.0.axis=[1, 0, 0]", "structure.loads.0.through=[3.05, 0, 1]"],
            "goes through its contact face",
        ),
    ],
)
def test_bolts_that_cannot_be_are_refused(clamp, overrides, wrong):
    assert wrong in refused(clamp, *overrides)
