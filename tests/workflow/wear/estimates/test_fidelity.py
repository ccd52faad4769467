"""Tests of settings chosen by probe runs: the decision on each axis, and the total accuracy."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.marks import slow
from workflow.analyses.wear import ANALYSIS
from workflow.analyses.wear.case.base import MOST_INCREMENTS
from workflow.analyses.wear.case.sections import Step
from workflow.analyses.wear.fidelity import choosing, decisions
from workflow.analyses.wear.fidelity.decisions import estimate
from workflow.analyses.wear.fidelity.probe import (
    STEPS,
    coupled_wear,
    plane_section,
    section_wear,
    slot_wear,
)
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.analyses.wear.translation import structure_loads
from workflow.case.changing import changed
from workflow.case.text.writing import dump_case
from workflow.errors import MethodFailed
from workflow.kinds import load_case
from workflow.runs.run import run_case

FRICTION = 0.4
COARSE = "mesh={flank_nodes: [9, 9], size: 8 mm, order: 1}", "contact.grid=[64, 64]"
QUIET = (
    *("output.paraview=false", "output.figures=false"),
    *("stress.section=none", "stress.life.parameter=none"),
)


@pytest.fixture(scope="module")
def plane_path(dovetail_path: Path) -> Path:
    return dovetail_path.with_name("dovetail_2d.yaml")


@pytest.fixture
def case(plane_path):
    return load_case(plane_path, ["fidelity=auto", *COARSE])


def read_again(case, folder):
    """Return the case after it has been written and read."""
    path = folder / "case.yaml"
    path.write_text(dump_case(case), encoding="utf-8")
    return load_case(path)


def in_space(case):
    return changed(case, {"structure.dimension": 3})


def both(value):
    return {name: {"depth": value, "volume": 2.0 * value} for name in ("intrados", "extrados")}


# --- estimates ------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [0.7, 1.0, 2.0])
def test_estimate_finds_limit_and_order(order):
    """f(h) = 1 + 0.3 h^p gives the errors of all rungs."""
    steps = 0.4, 0.2, 0.1
    estimated = estimate([both(1.0 + 0.3 * h**order) for h in steps], steps, 2.0)
    scale = 1.0 + 0.3 * steps[-1] ** order
    for errors in estimated.values():
        assert errors == pytest.approx([0.3 * h**order / scale for h in steps], rel=1e-9)


def test_a_rung_near_the_last_by_chance_is_no_better_than_it():
    values = [both(v) for v in (1.001, 1.10, 1.0)]
    for errors in estimate(values, [4.0, 2.0, 1.0], 2.0).values():
        assert errors[0] >= errors[-1] > 0.05


def test_a_flank_that_hardly_wears_is_measured_by_a_share_of_the_other():
    values = [{"a": {"depth": 1.0}, "b": {"depth": v}} for v in (1e-3, 2e-3)]
    errors = estimate(values, [2.0, 1.0], 1.0)["depth on the b"]
    assert max(errors) == pytest.approx(2e-3 / 0.1, rel=1e-9)


# --- increments -----------------------------------------------------------------------------------


def test_increments_are_those_of_the_section(case):
    """They do not depend on the case; with automatic legs there are none to compare with."""
    fixed = decisions.choose_increments(in_space(case), 0.02)
    auto = decisions.choose_increments(changed(case, {"load_path.increments": "auto"}), 0.02)
    assert auto.chosen == fixed.chosen
    assert fixed.why.startswith(f"{auto.why}; the 22 of the case cause 0.")


@pytest.mark.slow
def test_probe_runs_of_increments_are_of_second_order(case):
    """Doubling the increments again changes a quarter as much or less."""
    section = changed(plane_section(case), {"mesh.flank_nodes": (10, 10)})
    legs = [(4 * k, 7 * k) for k in (1, 2, 4, 8)]
    values = [section_wear(changed(section, case.divided(counts))) for counts in legs]
    for flank, quantities in values[-1].items():
        for name, value in quantities.items():
            before, last = values[-3][flank][name], values[-2][flank][name]
            assert 0.1 < (value - last) / (last - before) < 0.3


# --- meshes and grids -----------------------------------------------------------------------------


def by_nodes(case, resultants="constant"):
    return both(1.0 + 1.0 / (case.mesh.flank_nodes[0] - 1))


@pytest.mark.parametrize(("allowed", "nodes"), [(0.2, 9), (0.04, 33), (0.01, 129)])
def test_mesh_is_the_coarsest_within_its_share(case, monkeypatch, allowed, nodes):
    monkeypatch.setattr(decisions, "section_wear", by_nodes)
    decision = decisions.choose_mesh(case, allowed)
    assert decision.met
    assert decision.value[0] == nodes
    factor = (nodes - 1) / 8
    assert decision.chosen["mesh.size"] == pytest.approx(8.0 / factor)
    assert decision.value[1] == 1 + 8 * factor


def test_mesh_in_space_is_never_finer_than_written(case, monkeypatch):
    """Its error is still known, from finer meshes in the plane, and reported."""
    monkeypatch.setattr(decisions, "section_wear", by_nodes)
    monkeypatch.setattr(decisions, "wear_along_slot", lambda case: (both(1.0), both(1.01), 1.0))
    decision = decisions.choose_mesh(in_space(case), 0.01)
    assert decision.value == (9, 9)
    assert not decision.met
    assert decision.error == pytest.approx(1.0 / 8 / (1.0 + 1.0 / 32) + 0.01, rel=1e-9)
    assert "the finest available" in decision.why


@pytest.mark.parametrize(("allowed", "along", "left"), [(0.2, 5, 0.04), (0.08, 7, 0.01 * 64 / 36)])
def test_layers_along_the_slot_are_chosen_apart_from_the_section(
    case, monkeypatch, allowed, along, left
):
    """Half as many nodes change results by 3 % and have four times the error of all of them."""
    monkeypatch.setattr(decisions, "section_wear", lambda case, resultants: both(1.0))
    compared = both(1.0), both(1.03), -1.0 / 3.0
    monkeypatch.setattr(decisions, "wear_along_slot", lambda case: compared)
    decision = decisions.choose_mesh(in_space(case), allowed)
    assert decision.value[1] == along
    assert decision.error == pytest.approx(left, rel=1e-9)
    assert decision.met


def by_strips(case):
    return both(1.0 + 5.0 / case.contact.grid[0] ** 2)


def test_grid_in_space_shares_between_its_directions(case, monkeypatch):
    monkeypatch.setattr(decisions, "section_wear", by_strips)
    monkeypatch.setattr(decisions, "slot_wear", lambda case, cells: both(1.0 + 50.0 / cells**2))
    decision = decisions.choose_grid(in_space(case), 0.03)
    assert decision.value == (32, 64)
    assert decision.met
    finest = decisions.choose_grid(in_space(case), 1e-6)
    assert finest.value == (128, 128)
    assert not finest.met


def test_the_profile_along_the_slot_wears_most_at_its_ends(case):
    """Cells resolve the peaks at its ends; the volume is α µ Σ P s with uniform slip s."""
    section = plane_section(case)
    coarse, fine = (slot_wear(section, cells)["intrados"] for cells in (64, 256))
    structure = structure_loads(section, dovetail_joint)
    history = structure.unworn()[0]
    slip = np.hypot(history.slip[:, 0], history.slip[:, 1]).mean(axis=1)
    slip[history.loads.P == 0.0] = 0.0
    mean_load = 0.5 * (history.loads.P + np.roll(history.loads.P, 1))
    energy = FRICTION * mean_load @ slip * section.structure.slot_length
    both_bodies = 2.0 * section.wear.blade.coefficient
    volume = both_bodies * energy * section.wear.cycles / section.structure.face_width
    for profile in (coarse, fine):
        assert profile["volume"] == pytest.approx(volume, rel=1e-6)
    assert fine["depth"] > coarse["depth"]
    assert fine["depth"] > 1.5 * volume / section.structure.slot_length


# --- without a ladder -----------------------------------------------------------------------------


def test_steps_are_automatic_with_their_share_as_tolerance(case, tmp_path):
    chosen = changed(case, decisions.choose_steps(case, 0.0015).chosen)
    assert chosen.wear.step.automatic
    assert chosen.wear.step.kind == "implicit"
    assert chosen.wear.tolerance == 0.0015
    assert read_again(chosen, tmp_path) == chosen


@pytest.mark.slow
@pytest.mark.long
def test_steps_leave_no_more_than_their_tolerance(plane_path, tmp_path):
    """Depth and volume keep the tolerance over a long run of flanks that carry differently."""
    uneven = "load_path.aerodynamic_moment=3e4", "friction.coefficient=0.25"
    long = "wear.cycles=1e6", "coupling.resultants=constant"
    case = load_case(plane_path, [*COARSE, *QUIET, *uneven, *long])
    fine = changed(case, {"wear.step": Step(kind="second_order", cycles=2e4)})
    limit = worn(summary_of(fine, tmp_path / "fine"))
    for tolerance in (0.1, 0.01, 0.001):
        steps = decisions.choose_steps(case, tolerance)
        reached = worn(summary_of(changed(case, steps.chosen), tmp_path / f"{tolerance}"))
        assert np.max(np.abs(reached / limit - 1.0)) <= steps.error == tolerance


@pytest.mark.parametrize("allowed", [1e-2, slow(2e-3)])
def test_the_tolerance_leaves_its_share_where_flanks_carry_differently(case, allowed):
    """Where faces slide as a whole the error is even below half of the tolerance."""
    case = changed(case, {"load_path.aerodynamic_moment": 3e4, "friction.coefficient": 0.25})
    section, chosen = plane_section(case), decisions.choose_tolerance(case, allowed)
    tolerance = chosen.value
    assert chosen.error == pytest.approx(allowed)
    loose, tight = (
        section_wear(changed(section, {"contact.tolerance": t})) for t in (tolerance, 1e-9)
    )
    for flank, quantities in tight.items():
        for name, value in quantities.items():
            assert loose[flank][name] == pytest.approx(value, rel=0.5 * tolerance)


@pytest.mark.slow
def test_drift_is_what_changes_depth_by_its_share(case):
    """With n steps, loads that follow after each feel 1 - 1/n of a steady drift."""
    section = plane_section(case)
    coupled, drift = coupled_wear(section)
    apart = section_wear(section)
    effect = max(abs(apart[f][q] / coupled[f][q] - 1.0) for f in apart for q in apart[f])
    effect /= 1.0 - 1.0 / STEPS
    decision = decisions.choose_drift(case, 0.5 * effect)
    assert decision.value == pytest.approx(0.5 * drift, rel=1e-6)
    assert decision.error == pytest.approx(0.5 * effect, rel=1e-6)


# --- all of them ----------------------------------------------------------------------------------


@pytest.fixture
def cheap_probes(monkeypatch):
    """Replace probe runs by ones whose errors are known."""

    def known(case, resultants="constant"):
        mesh, grid = case.mesh.flank_nodes[0], case.contact.grid[0]
        return both(1.0 + 0.5 / mesh**2 + 2.0 / grid**2)

    def mid_slot(case, dimension):
        """Two dimensions carry 4.3 % more."""
        values = {"P": 1.043 if dimension == 2 else 1.0, "Qx": 0.0, "energy": 1.0, "slip": 1.0}
        return {name: dict(values) for name in ("intrados", "extrados")}

    monkeypatch.setattr(decisions, "_mid_slot", mid_slot)
    monkeypatch.setattr(decisions, "section_wear", known)
    monkeypatch.setattr(decisions, "slot_wear", lambda case, cells: both(1.0 + 5.0 / cells**2))
    monkeypatch.setattr(decisions, "coupled_wear", lambda case: (both(1.05), 0.02))


@pytest.mark.usefixtures("cheap_probes")
def test_shares_add_up_to_the_accuracy(plane_path):
    assert sum(choosing.SHARES.values()) == pytest.approx(1.0, rel=1e-12)
    costs = []
    for accuracy in (0.2, 0.1):
        case = load_case(plane_path, ["fidelity=auto", f"accuracy={accuracy}", *COARSE])
        chosen, record = ANALYSIS.choose(case)
        two, *others = record["decisions"]
        used = two["error"] + sum(decision["allowed"] for decision in others)
        assert used == pytest.approx(accuracy, rel=1e-9)
        assert record["met"]
        assert record["estimated_error"] <= accuracy * (1.0 + 1e-9)
        assert set(record["budget"]) == {decision["entry"] for decision in record["decisions"]}
        increments = sum(chosen.load_path.increments)
        costs.append((increments, chosen.mesh.flank_nodes, chosen.contact.grid))
    assert costs[0] < costs[1]


@pytest.mark.usefixtures("cheap_probes")
def test_record_makes_the_case(plane_path, tmp_path):
    """The record gives the case of the folder, also when a resumed run reads it from JSON."""
    case = load_case(plane_path, ["fidelity=auto", *COARSE])
    chosen, record = ANALYSIS.choose(case)
    read = json.loads(json.dumps(record))
    assert dump_case(changed(case, read["chosen"])) == dump_case(chosen)
    assert read_again(chosen, tmp_path) == chosen
    # The physical settings stay as written.
    assert chosen.contact.method == case.contact.method
    assert chosen.friction == case.friction
    assert chosen.wear.blade == case.wear.blade


@pytest.mark.usefixtures("cheap_probes")
def test_a_failed_probe_leaves_the_setting_unchanged(plane_path, monkeypatch):
    def fail(case, resultants="constant"):
        raise MethodFailed("no convergence")

    monkeypatch.setattr(decisions, "section_wear", fail)
    case = load_case(plane_path, ["fidelity=auto", *COARSE])
    chosen, record = ANALYSIS.choose(case)
    assert chosen.mesh == case.mesh
    assert chosen.contact.grid == case.contact.grid
    assert chosen.coupling == case.coupling
    failed = [decision for decision in record["decisions"] if "no convergence" in decision["why"]]
    assert len(failed) == 3
    assert not record["met"]


# --- the proof ------------------------------------------------------------------------------------

# Cases that nothing was tuned on. The one in the plane hardly feels its ends and Poisson's ratio,
# so that two dimensions do for 1 %; the flanks of the other carry differently.
PROOFS = {
    "dovetail_2d.yaml": (
        *("friction.coefficient=0.6", "structure.end_radius=1e5", "structure.end_width=0.5"),
        *("materials.blade.poisson=0.01", "materials.disk.poisson=0.01"),
        *("mesh.flank_nodes=[21, 10]", "mesh.order=1", "contact.grid=[64, 32]"),
        "wear.cycles=1e4",
    ),
    "dovetail_small.yaml": (
        *("structure.flank_angle=55 deg", "friction.coefficient=0.25", "structure.edge_radius=60"),
        *("structure.end_width=4", "load_path.aerodynamic_moment=30 N*m", "mesh.size=10"),
        *("load_path.increments=[4, 7]", "mesh.flank_nodes=[8, 8]"),
        *("contact.grid=[16, 24]", "wear.cycles=1e4"),
    ),
}
# Tighter than any chosen one, of solver and of wear steps, whose cost goes up with it.
FINEST = {
    "fidelity": "fixed",
    "contact.tolerance": 1e-8,
    "wear.step": Step(),
    "wear.tolerance": 1e-3,
    "coupling.resultants": "every",
}
# Increments of the finest rungs: too many to run in a test. Two runs of fewer give their limit, by
# their second order.
FEW = 8, 14


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("name", PROOFS)
def test_accuracy_is_met_at_half_the_cost_or_less(name, dovetail_path, tmp_path):
    """The finest rung of every axis is the reference; for increments, Richardson's limit.

    Convolutions count the cost. Meshes in space are those of the case on all rungs.
    """
    path, settings = dovetail_path.with_name(name), (*PROOFS[name], *QUIET)
    plain = load_case(path, settings)
    finest = changed(plain, decisions.choose_mesh(plain, 1e-9).chosen)
    finest = changed(finest, decisions.choose_grid(finest, 1e-9).chosen | FINEST)
    coarse, fine = (
        summary_of(changed(finest, finest.divided(legs)), tmp_path / f"{sum(legs)}")
        for legs in (FEW, [2 * count for count in FEW])
    )
    limit = (4.0 * worn(fine) - worn(coarse)) / 3.0
    cost = fine["work"]["convolutions"] * MOST_INCREMENTS / (2 * sum(FEW))
    chosen = []
    for accuracy in (0.05, 0.01):
        case = load_case(path, (*settings, "fidelity=auto", f"accuracy={accuracy}"))
        summary = summary_of(case, tmp_path / f"{accuracy}")
        assert np.max(np.abs(worn(summary) / limit - 1.0)) <= accuracy
        assert summary["work"]["convolutions"] <= 0.5 * cost
        chosen.append(summary["choice"]["chosen"])
    looser, tighter = chosen
    assert looser["structure.dimension"] == tighter["structure.dimension"]
    assert looser["structure.dimension"] == plain.structure.dimension
    assert sum(looser["load_path.increments"]) < sum(tighter["load_path.increments"])
    for entry in ("contact.tolerance", "wear.tolerance", "coupling.drift"):
        assert looser[entry] > tighter[entry]


def summary_of(case, folder):
    run_case(case, folder, force=False)
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))


def worn(summary):
    flanks, names = ("intrados", "extrados"), ("depth_1", "depth_2", "volume_1", "volume_2")
    return np.array([summary[flank][name] for flank in flanks for name in names])
