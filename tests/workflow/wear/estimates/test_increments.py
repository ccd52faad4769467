"""Tests of ``load_path.increments: auto``: the choice suffices, is recorded and is kept."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import workflow.analyses.wear.increments as module
from tests.conftest import CASES
from tests.marks import slow
from tests.workflow.command_line import command
from tests.workflow.mesh_scenes import ASSEMBLY, BLOCKS, cube, refused, write_case
from tests.workflow.shell.interruptions import ctrl_c_after_jumps
from workflow.analyses.wear import ANALYSIS
from workflow.analyses.wear.increments import decide_increments, differences
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.analyses.wear.structures.mesh.model import mesh_assembly
from workflow.analyses.wear.translation import structure_loads
from workflow.case.changing import changed
from workflow.errors import MethodFailed
from workflow.kinds import load_case
from workflow.models.structure import StructureLoads

pytestmark = pytest.mark.usefixtures("reads_here")

PLANE = CASES / "dovetail_2d.yaml"
AUTO = "load_path.increments=auto"
COARSE = (
    *("mesh.flank_nodes=[9, 9]", "mesh.size=8", "contact.grid=[64, 64]"),
    *("wear.step={kind: implicit, cycles: 1e5}", "coupling.resultants=constant"),
    *("stress={section: none, life: {parameter: none}}",),
    *("output.paraview=false", "output.figures=false"),
)
# Flanks that carry differently, and some that hardly come back.
UNEVEN = "load_path.aerodynamic_moment=3e4", "friction.coefficient=0.25"
STEEP = "friction.coefficient=0.7", "structure.flank_length=6 mm"
MANY = 64, 112


@pytest.fixture
def blocks(tmp_path: Path) -> Path:
    """Return a cube on a larger one, pressed harder while it is pushed: much of it slides."""
    (tmp_path / "blocks.inp").write_text(cube("base", 2.0) + cube("foot", 1.0) + ASSEMBLY, "utf-8")
    pressed, pushed = BLOCKS["loads"]
    loads = [pressed | {"path": [1, 1, 1.5, 1]}, pushed | {"force": ["18 N", 0, 0]}]
    structure = {"file": "blocks.inp", **BLOCKS, "loads": loads}
    legs = {"increments": "auto", "cycle_from": 3, "peak_leg": 4}
    return write_case(tmp_path / "blocks.yaml", structure, legs)


def unworn(case, model, legs):
    return structure_loads(changed(case, case.divided(legs)), model).unworn()


@pytest.mark.parametrize(
    ("settings", "tolerance"),
    [(UNEVEN, 0.03), slow(STEEP, 0.03), slow(UNEVEN, 0.003), slow(STEEP, 0.003)],
)
def test_dovetails_wear_as_in_very_many(settings, tolerance):
    case = load_case(PLANE, [AUTO, *settings, *COARSE, f"wear.tolerance={tolerance}"])
    chosen, record = ANALYSIS.choose(case)
    fine = unworn(case, dovetail_joint, MANY)
    assert record["met"]
    assert np.max(differences(unworn(case, dovetail_joint, chosen.legs), fine)) <= tolerance
    assert sum(chosen.legs) < sum(MANY)
    few = [max(2, round(0.5 * count)) for count in chosen.legs]
    assert np.max(differences(unworn(case, dovetail_joint, few), fine)) > tolerance


@pytest.mark.slow
def test_increments_are_of_second_order():
    """The rms depth is of second order from 6 to 176; energy passes its limit before 11."""
    case = load_case(PLANE)
    cycles = {6: (2, 4)} | {11 * 2**k: (4 * 2**k, 7 * 2**k) for k in range(5)}
    fine = unworn(case, dovetail_joint, (256, 448))
    errors = np.array([differences(unworn(case, dovetail_joint, n), fine) for n in cycles.values()])
    counts, (depth, energy) = np.log(list(cycles)), np.log(errors.T)
    assert -2.4 < np.polyfit(counts, depth, 1)[0] < -1.8
    assert -2.4 < np.polyfit(counts[1:], energy[1:], 1)[0] < -1.8
    assert errors[2, 1] < 0.005
    assert errors[2, 0] < 0.01


@pytest.mark.slow
def test_legs_of_a_mesh_get_what_each_asks_for(blocks):
    case = load_case(blocks, ["wear.tolerance=0.03"])
    chosen, record = ANALYSIS.choose(case)
    once, before, out, back = chosen.load_path.increments
    assert once == before == max(out, back)
    assert record["met"]
    many = unworn(case, mesh_assembly, (88, 88))
    assert np.max(differences(unworn(case, mesh_assembly, (out, back)), many)) <= 0.03


@pytest.mark.slow
def test_a_run_uses_and_logs_what_was_chosen_once(tmp_path, monkeypatch):
    """A killed and resumed run has the same choice, since nothing is chosen again."""
    overrides = [AUTO, *COARSE]
    with ctrl_c_after_jumps(2):
        ending = command("run", PLANE, "--out", tmp_path / "out", overrides=overrides)
    assert ending.exit_code == 130
    kept = load_case(tmp_path / "out" / "case.yaml")
    chosen, _ = ANALYSIS.choose(load_case(PLANE, overrides))
    assert kept == chosen
    monkeypatch.setattr(module, "choose_increments", None)
    assert command("resume", tmp_path / "out").exit_code == 0
    log = (tmp_path / "out" / "run.log").read_text("utf-8")
    (logged,) = re.findall(r"chosen: load_path.increments: .(\d+), (\d+).: (\d+ \+ \d+) in", log)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    settings = summary["choice"]["chosen"]
    assert settings == {"load_path.increments": [int(count) for count in logged[:2]]}
    assert logged[2] == " + ".join(logged[:2])
    assert load_case(tmp_path / "out" / "case.yaml") == kept


@pytest.mark.slow
def test_what_is_chosen_does_not_depend_on_what_is_kept(tmp_path, monkeypatch):
    case = load_case(PLANE, [AUTO, *COARSE])
    records = []
    for cache in ("one", "one", "other"):
        monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / cache))
        record = ANALYSIS.choose(case)[1]
        records.append({**record["chosen"], "error": record["estimated_error"]})
    assert records[0] == records[1] == records[2]


def test_more_than_the_most_are_not_chosen(monkeypatch):
    case = load_case(PLANE, [AUTO, *COARSE])
    monkeypatch.setattr(module, "MOST_INCREMENTS", 12)
    decision = decide_increments(case, dovetail_joint, 1e-4)
    assert sum(decision.value) == 12
    assert not decision.met
    assert "the most available" in decision.why


def test_cycles_of_few_increments_that_fail_ask_for_more(monkeypatch):
    solve = StructureLoads.cycle_under

    def failing(stage, missions):
        if len(missions[0].amplitudes) < 12:
            raise MethodFailed("no convergence")
        return solve(stage, missions)

    monkeypatch.setattr(StructureLoads, "cycle_under", failing)
    decision = decide_increments(load_case(PLANE, [AUTO, *COARSE]), dovetail_joint, 0.5)
    assert sum(decision.value) >= 12


def test_nothing_slides_in_the_fewest(blocks):
    case = load_case(blocks, ["friction.coefficient=2", "structure.loads.1.force=[1 N, 0, 0]"])
    assert sum(ANALYSIS.choose(case)[0].legs) == 8


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("load_path.increments=[2, 2, 2, auto]", "load_path.increments"),
        ("load_path.peak_leg=5", "load_path.peak_leg"),
        ("structure.loads.1.path=[1, 1, 1]", "structure.loads.1.path"),
    ],
)
def test_legs_that_do_not_fit_are_refused(blocks, override, named):
    assert named in refused(blocks, override)
