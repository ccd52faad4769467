"""Tests of rigs in time that are shaken, hit or driven, and of the effect of wear."""

import h5py
import numpy as np
import pytest

from tests.marks import slow
from tests.workflow.vibration.time_scenes import (
    HAMMER,
    LIMIT,
    MASS,
    RIG,
    STIFFNESS,
    linear_rig,
    receptance,
    refused,
    run,
)
from workflow.kinds import template


@pytest.mark.parametrize("step", [4e-4, 2e-4, 1e-4])
def test_a_stuck_rig_is_linear(tmp_path, step):
    """Amplitudes agree with the receptance to second order in the step.

    Extremes among samples miss up to (ωh)²/8 of a sine, and Newmark's stiffness is off by a third
    of (ωh)²/4; near the resonance the error is a few times as much.
    """
    exact = 50.0 * np.abs(receptance(80.0, 1e4))
    settings = "joint.friction=10", f"integration.step={step}", "excitation.steady=1e-9"
    state = run(tmp_path, RIG, *settings)["states"][0]
    assert state["energy_per_cycle"] == 0.0
    error = np.abs(np.array(state["amplitudes"]) / exact - 1.0).max()
    assert error < 0.25 * (2.0 * np.pi * 80.0 * step) ** 2
    squares = np.linalg.eigvals(np.linalg.solve(MASS, linear_rig(1e4)[0]))
    assert state["stuck"] == pytest.approx(np.sort(np.sqrt(squares)) / (2.0 * np.pi), rel=1e-9)


def test_a_sliding_rig_dissipates_what_its_loop_encloses(tmp_path):
    state = run(tmp_path, RIG, "excitation.force=200 N")["states"][0]
    amplitude = 0.5 * state["stroke"]
    assert amplitude > 2.0 * LIMIT / STIFFNESS
    assert state["energy_per_cycle"] == pytest.approx(
        4.0 * LIMIT * (amplitude - LIMIT / STIFFNESS), rel=1e-3
    )
    assert state["extracted"]["friction"] == pytest.approx(0.5, rel=1e-3)


def test_a_rig_without_steady_state_fails(tmp_path):
    code, message = refused(tmp_path, RIG, "excitation.periods=3")
    assert code == 3
    assert "no steady state at 0 J after 3 cycles" in message


def test_a_rig_ages_in_steady_states(tmp_path):
    """Without evolution all steady states are equal, so cycles are energy over that of one."""
    loud = "excitation.force=200 N"
    summary = run(tmp_path, RIG, loud, "ageing={energy: 1 J, tolerance: 1e-3}", "energies=[0 J]")
    each = summary["states"][0]["energy_per_cycle"]
    assert summary["cycles"] == pytest.approx(1e3 / each, rel=1e-3)
    assert [state["energy"] for state in summary["states"]] == [0.0, 1e3]


def test_a_blow_shows_the_frequency_response_of_a_stuck_rig(tmp_path):
    """It is the exact accelerance up to the step; the peak lies within one line."""
    summary = run(tmp_path, RIG, HAMMER, "joint.friction=10", "integration.step=50 us")
    state = summary["states"][0]
    assert abs(state["first_frequency"] - state["stuck"][0]) <= state["resolution"]
    assert "change" not in summary
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        group = file["states/00000/frequency_response"]
        frequency, magnitude = group["frequency"][()], group["magnitude"][()]
    for hertz in (40.0, 100.0, 200.0, 800.0):
        exact = (2.0 * np.pi * hertz) ** 2 * abs(receptance(hertz, 1e4)[1])
        place = int(np.argmin(np.abs(frequency - hertz)))
        assert frequency[place] == pytest.approx(hertz, rel=1e-3)
        assert magnitude[place] == pytest.approx(exact, rel=0.02)
    # Damping of the first mode, whose shape the joint changes: from its complex eigenvalue.
    stiffness, damping = linear_rig(1e4)
    bottom = [-np.linalg.solve(MASS, stiffness), -np.linalg.solve(MASS, damping)]
    roots = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], bottom]))
    first = roots[np.argmin(np.abs(roots))]
    largest = state["ring_down"]["largest"]
    assert largest["damping_ratio"] == pytest.approx(-first.real / abs(first), rel=0.02)
    assert largest["frequency"] == pytest.approx(abs(first.imag) / (2.0 * np.pi), rel=2e-3)


@pytest.mark.slow
def test_wear_changes_the_response_to_a_blow(tmp_path):
    """E is frozen in each record; the available figures are drawn."""
    evolution = "evolution.stiffness={kind: table, energy: [0 J, 1 J], factor: [1, 2]}"
    summary = run(
        tmp_path,
        RIG,
        HAMMER,
        evolution,
        "energies=[0 J, 1 J]",
        "integration.step=50 us",
        "output.figures=true",
    )
    assert summary["change"]["first_frequency"] == 1.0
    assert [state["stiffness"] for state in summary["states"]] == [1e4, 2e4]
    names = {path.stem for path in (tmp_path / "out" / "figures").iterdir()}
    assert {"frequency_response", "ring_down", "evolution"} <= names
    assert (tmp_path / "out" / "ring_down_00001.csv").exists()
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        assert file.attrs["seen"].tolist() == ["m1", "m2"]


@pytest.mark.slow
def test_a_recorded_blow_moves_the_rig_as_a_hammer_does(tmp_path):
    """With 50 samples the second-order error of a polygon is 1e-3."""
    times = np.linspace(0.0, 1e-3, 51)
    rows = [f"{time},{100.0 * np.sin(np.pi * time / 1e-3)}" for time in times]
    folder = tmp_path / "recorded"
    folder.mkdir()
    (folder / "force.csv").write_text("\n".join(["time,force", *rows, "0.05,0"]), encoding="utf-8")
    step = "integration.step=20 us"
    recorded = run(folder, RIG, "excitation={kind: recorded, file: force.csv}", step)
    hit = run(tmp_path / "hammer", RIG, HAMMER, step)
    motions = []
    for kind in ("recorded", "hammer"):
        with h5py.File(tmp_path / kind / "out" / "results.h5") as file:
            motions.append(file["states/00000/motion/displacement"][:2000])
    largest = np.abs(motions[1]).max()
    np.testing.assert_allclose(motions[0], motions[1], atol=1e-3 * largest)
    assert recorded["states"][0]["dissipated"] == pytest.approx(
        hit["states"][0]["dissipated"], rel=5e-3, abs=1e-12
    )


@pytest.mark.parametrize("kind", ["joint", slow("rig")])
def test_what_new_writes_wears_without_a_warning(tmp_path, kind):
    """All requested energies are reached, and friction rises between them."""
    summary = run(tmp_path, template(kind), "output.figures=false")
    assert summary["warnings"] == []
    assert [state["energy"] for state in summary["states"]][:2] == [0.0, 1e6]
    assert summary["states"][1]["friction"] > 2.0 * summary["states"][0]["friction"]
