"""Tests of mesh files with midside nodes: messages, and Hertz contact with such elements."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models.geometry.imported import read_bodies
from tests.workflow.mesh_scenes import run
from tests.workflow.wear.mesh.test_curved_mesh import PEAK, pressed
from workflow.analyses.wear.structures.mesh.case import MeshCase
from workflow.analyses.wear.structures.mesh.elements import folded_elements
from workflow.analyses.wear.structures.mesh.model import mesh_assembly
from workflow.kinds import load_case
from workflow.messages.warning_kinds import WarningKind

pytestmark = [pytest.mark.usefixtures("reads_here")]


@pytest.mark.parametrize(
    ("dimension", "order", "rel"), [(2, 2, 0.015), pytest.param(3, 0, 0.03, marks=pytest.mark.slow)]
)
def test_hertz_of_curved_elements(tmp_path, dimension: int, order: int, rel: float):
    """A second-order mesh and a CAD file give Hertz; in space four nodes carry the load."""
    case = pressed(tmp_path, dimension, order)
    summary = run(case, tmp_path / "out", "mesh.order=2")
    assert summary["sole"]["peak_pressure"]["unworn"] == pytest.approx(PEAK[dimension], rel=rel)
    assert read_bodies(tmp_path / "out" / "worn.msh").midsides


def test_only_bodies_with_curved_edges_have_midsides(tmp_path):
    case = load_case(pressed(tmp_path, 2, 2))
    assert isinstance(case, MeshCase)
    assert all(body.midsides is None for body in mesh_assembly(case).meshed().bodies)
    curved = case.model_copy(update={"mesh": case.mesh.model_copy(update={"order": 2})})
    block, foot = mesh_assembly(curved).meshed().bodies
    assert block.midsides is None
    assert foot.midsides is not None
    arc = foot.mesh.boundaries["sole"]
    radii = np.hypot(foot.midsides[arc, 0], foot.midsides[arc, 1] - 30.0)
    np.testing.assert_allclose(radii, 30.0, rtol=1e-6)


def test_edges_that_are_taken_straight_give_a_warning(tmp_path):
    case = load_case(pressed(tmp_path, 2, 2))
    assert isinstance(case, MeshCase)
    imported, mesh = case.structure.read(None), case.structure.mesh(None, 2)
    assert list(folded_elements(mesh, imported)) == []
    block, foot = mesh.bodies
    midsides = foot.midsides.copy()
    arc = foot.mesh.boundaries["sole"][:3]
    midsides[arc] = foot.mesh.p[:, foot.mesh.facets[:, arc]].mean(axis=1).T
    reported = replace(mesh, bodies=(block, replace(foot, midsides=midsides)))
    ((kind, text),) = folded_elements(reported, imported)
    assert kind is WarningKind.FOLDED_ELEMENTS
    assert text.startswith("foot: ")
    assert "3 edges" in text
