"""Tests of stability in vibration cases: columns, bifurcations, dashed curves, branches."""

import json
import tracemalloc
from typing import Any

import h5py
import numpy as np
import pytest

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.stability.floquet import Floquet
from tests.workflow.conftest import invoke
from tests.workflow.vibration.vibration_pad import block
from wear.joints.friction_contact import FrictionContact
from wear.joints.periodic.march import PeriodicMarch
from workflow.analyses.vibration.figures.response import frequency_response
from workflow.analyses.vibration.output.outcome import VibrationContents

CASE = """
title: A mass on a spring that hardens
analysis: vibration
structure: {kind: rig, masses: [1 kg], springs: [1000 N/mm], damping_ratio: 0.02}
joint: {law: polynomial_spring, stiffness: 0 N/mm, cubic: 1e6 N/mm^3}
forces: [0.5 N, 2 N]
frequencies: [190 Hz, 300 Hz]
resolution: {harmonics: 3, samples: 64}
continuation: {start: upper}
output: {figures: false, paraview: false}
further_branches:
  - {force: 2 N, frequency: 200 Hz, amplitude: 20 um}
"""


def run(tmp_path: Any, text: str) -> dict[str, Any]:
    path = tmp_path / "case.yaml"
    path.write_text(text, encoding="utf-8")
    result = invoke("run", path, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    summary: dict[str, Any] = json.loads((tmp_path / "out" / "summary.json").read_text())
    return summary


@pytest.mark.slow
def test_a_further_branch_is_found_with_its_fold_and_drawn_dashed(tmp_path: Any) -> None:
    """Descending from 300 Hz finds small motions; large and unstable ones are connected."""
    summary = run(tmp_path, CASE)
    assert [response["unstable_points"] for response in summary["responses"]] == [0, 0]
    (branch,) = summary["further_branches"]
    assert branch["unstable_points"] > 0
    (fold,) = branch["bifurcations"]
    assert fold["kind"] == "fold"
    assert fold["multiplier"] == pytest.approx(1.0, abs=1e-3)
    assert fold["frequency"] == pytest.approx(branch["highest_frequency"], rel=1e-3)
    table = (tmp_path / "out" / "bifurcations.csv").read_text(encoding="utf-8").splitlines()
    assert table[0].startswith("curve,kind,frequency [Hz],force [N],amplitude [mm]")
    assert table[1].startswith("further branch 0,fold,")
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        group = file["further_branches/00000"]
        codes = group["stability"][()]
        assert set(codes) == {1, -1}
        assert ((group["multiplier"][()] > 1.0) == (codes == -1)).all()
        assert list(group["bifurcations"].attrs["kind"]) == ["fold"]
        contents = VibrationContents(("00000", "00001"), (), places=False, backbone=False)
        axis, _ = frequency_response(file, contents).axes
        dashed = [line for line in axis.lines if line.get_linestyle() == "--"]
        drawn = np.concatenate([line.get_xdata() for line in dashed])
        unstable = group["frequency"][()][codes == -1]
        assert np.isin(unstable, drawn).all()
        assert {"unstable", "fold"} <= {line.get_label() for line in axis.lines}


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("force: 2 N, freq", "force: 3 N, freq", "further_branches.0.force"),
        ("frequency: 200 Hz", "frequency: 400 Hz", "further_branches.0.frequency"),
        ("law: polynomial_spring", "law: elastic_stop", "cubic"),
    ],
)
def test_wrong_branches_are_named(tmp_path: Any, old: str, new: str, named: str) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(CASE.replace(old, new), encoding="utf-8")
    result = invoke("check", path)
    assert result.exit_code == 2
    assert named in result.output


def test_a_stop_without_even_harmonics_gives_a_warning(tmp_path: Any) -> None:
    text = CASE.partition("further_branches")[0].replace(
        "{law: polynomial_spring, stiffness: 0 N/mm, cubic: 1e6 N/mm^3}",
        "{law: elastic_stop, stiffness: 1 N/um, gap: 5 um}",
    )
    path = tmp_path / "case.yaml"
    path.write_text(text, encoding="utf-8")
    assert "no even ones" in invoke("check", path).output
    path.write_text(text.replace("harmonics: 3", "harmonics: [0, 1, 2, 3]"), encoding="utf-8")
    assert "no even ones" not in invoke("check", path).output


def test_a_body_that_contacts_alone_hold_takes_little_memory() -> None:
    """As many rows as increments times contacts determine the holding forces."""
    rig = block()
    law = FrictionContact(1.8e3, 2.3e3, 0.5, gap=rig.gap)
    load = PeriodicLoad({1: -1j * rig.driven}, 60.0 * rig.pressing)
    problem = HarmonicBalance(rig.model, PeriodicMarch(law), load, Resolution((0, 1, 3), 32))
    motion = problem.solve(600.0, 25.0)
    tracemalloc.start()
    reported = Floquet(problem).stability(motion)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert reported.verdict == "stable"
    assert most < 1e8
