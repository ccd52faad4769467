"""Tests of the error budget's part for the mesh along the slot of a dovetail."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.conftest import CASES
from workflow.analyses.wear.model import wear_model
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.kinds import load_case
from workflow.models.budget.probe_models import along_slot
from workflow.models.budget.probe_runs import probe_run
from workflow.models.wear import WearModel
from workflow.shell.folders.cache import DiskStore


def depth_of(model: WearModel) -> float:
    """Return the largest depth of the extrados after a probe run [mm]."""
    return probe_run(model, model.loads(DiskStore()), "every").worn["extrados"]["depth"]


@pytest.mark.parametrize(
    ("own", "other"), [((9, 13), 25), ((9, 21), 11), ((21, 27), 13), ((5, 3), 5)]
)
def test_meshes_along_the_slot_differ_in_nothing_else(own, other) -> None:
    asked = ["structure.skew=10 deg", f"mesh.flank_nodes={list(own)}"]
    joint = dovetail_joint(load_case(CASES / "dovetail.yaml", asked))
    meshes = joint.along_slot()
    assert meshes is not None
    assert meshes.own.mesh.flank_nodes == (min(own[0], 7), own[1])
    assert meshes.other.mesh.flank_nodes == (min(own[0], 7), other)
    assert replace(meshes.other, mesh=meshes.own.mesh) == meshes.own
    assert meshes.own.geometry == joint.geometry
    assert meshes.share == pytest.approx(1.0 / (1.0 - ((own[1] - 1) / (other - 1)) ** 2), rel=1e-12)
    assert joint.section().along_slot() is None


@pytest.mark.slow
@pytest.mark.parametrize("ends", [3.0, 0.2])
def test_error_along_the_slot_is_true_within_a_factor_of_three(ends) -> None:
    """Round and nearly sharp ends are compared with four times as many layers."""
    asked = [f"structure.end_width={ends}", "mesh.flank_nodes=[9, 13]", "contact.grid=[48, 96]"]
    model = wear_model(load_case(CASES / "dovetail.yaml", asked))
    meshes = along_slot(model)
    assert meshes is not None
    own, other = depth_of(meshes.own), depth_of(meshes.model)
    mesh = model.structure.mesh
    fine = replace(model.structure, mesh=replace(mesh, flank_nodes=(9, 49)))
    few, many = depth_of(model), depth_of(replace(model, structure=fine))
    assert few / many - 1.0 > 0.02
    assert 1.0 / 3.0 < meshes.share * (own - other) / own / (few / many - 1.0) < 3.0
