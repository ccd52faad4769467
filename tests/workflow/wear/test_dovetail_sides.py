"""Tests of the sides of a dovetail's sector as a case gives them."""

import json

import pytest

from tests.conftest import CASES
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import settings

COARSE = [
    "mesh.flank_nodes=[8, 8]",
    "mesh.size=8 mm",
    "mesh.order=1",
    "contact.grid=[32, 1]",
    "load_path.increments=[3, 4]",
    "output.figures=false",
    "output.paraview=false",
    "stress.section=none",
    "stress.life.parameter=none",
    "error_budget=known",
]


def energies(folder, sides, moment):
    """Return the energy dissipated in a cycle on both flanks."""
    changes = [f"structure.sides={sides}", f"load_path.aerodynamic_moment={moment} N*m"]
    out = folder / f"{sides}_{moment}"
    ending = invoke("run", CASES / "dovetail_2d.yaml", "--out", out, *settings(COARSE + changes))
    assert ending.exit_code in (0, 1), ending.stderr
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    return [summary[name]["energy_per_cycle"]["structure"] for name in ("intrados", "extrados")]


@pytest.mark.slow
def test_neighbours_change_what_a_moment_does(tmp_path):
    """A moment increases slip on the flank that it presses and decreases it on the other."""
    for moment in (0, 30):
        guided, cyclic = (energies(tmp_path, sides, moment) for sides in ("guided", "cyclic"))
        more = [two / one for one, two in zip(guided, cyclic, strict=True)]
        if moment:
            assert more[0] > 1.05
            assert more[1] < 0.8
        else:
            assert more == pytest.approx([1.0, 1.0], rel=1e-5)


def test_skewed_slots_have_no_cyclic_sides():
    case = CASES / "dovetail.yaml"
    ending = invoke("check", case, *settings(["structure.sides=cyclic", "structure.skew=5 deg"]))
    assert ending.exit_code == 2
    assert "are not images of each other; allowed: guided, or skew 0" in ending.stderr


def test_elements_of_order_2_have_odd_numbers_of_nodes():
    case = CASES / "dovetail.yaml"
    ending = invoke("check", case, *settings(["mesh.flank_nodes=[20, 34]"]))
    assert ending.exit_code == 2
    assert "mesh.flank_nodes" in ending.stderr
    assert (
        invoke("check", case, *settings(["mesh.flank_nodes=[20, 34]", "mesh.order=1"])).exit_code
        == 0
    )
