"""Tests of the link of structure and contact in runs: dovetails, fine meshes, both methods."""

import json

import numpy as np
import pytest

from fe_models.structure import InterfaceHistory
from sa_solver.types import Array
from wear.contact.interface import FirstContact
from wear.contact.link import StructureLink
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.output.link_report import report_link
from workflow.analyses.wear.translation import face_contact
from workflow.case.text.readable import percent
from workflow.kinds import load_case
from workflow.models.contact import FaceContact
from workflow.shell.terminal.reporter import Reporter

# Places on a flank of the section [mm]: its rounded edges begin at 4 mm.
PLACES = np.array([-3.0, 0.0, 3.0])


def test_a_run_reports_how_its_contacts_are_linked(whole) -> None:
    summary = json.loads((whole.folder / "summary.json").read_text())
    log = (whole.folder / "run.log").read_text()
    for name in ("intrados", "extrados"):
        link = summary[name]["link"]
        assert link["corrected"]
        assert len(link["degrees"]) == 2
        assert 0.1 < link["bodies"] < 1.0
        assert f"{name}: the bodies add {percent(link['bodies'])}" in log


@pytest.mark.parametrize(
    ("quality", "reported"),
    [((0.3, 0.01, 0.02), ""), ((0.3, 0.04, 0.01), "fewer nodes"), ((0.3, 0.02, 0.03), "coarse")],
)
def test_what_a_fit_leaves_is_warned_of(tmp_path, quality, reported) -> None:
    link = StructureLink(
        np.zeros((1, 3, 5, 1)), np.array([[-1.0, 0.0], [1.0, 0.0]]), np.array(quality)
    )
    reporter = Reporter(tmp_path / "log")
    report_link("flank", link, True, reporter)
    assert len(reporter.warnings) == bool(reported)
    assert all(reported in line and "refine the mesh" in line for line in reporter.warnings)


def flank(path, nodes: int, *settings: str) -> tuple[InterfaceHistory, FaceContact, FirstContact]:
    """Return the unworn intrados of the section with ``nodes`` first-order nodes across it."""
    case = load_case(path, [f"mesh.flank_nodes=[{nodes}, 34]", "mesh.order=1", *settings])
    source = loads_of(case)
    stage = face_contact(case, source.faces[0])
    history = source.unworn()[0]
    return history, stage, stage.contact.begin(history, 1.0)[1]


def at_places(x: Array, values: Array) -> Array:
    order = np.argsort(x)
    return np.interp(PLACES, x[order], values[order])


@pytest.mark.slow
def test_a_coarse_mesh_and_the_link_give_what_a_fine_mesh_does(dovetail_path) -> None:
    """The pressure for 20 nodes is within 1.5 % of that for 160; half-spaces are off by 18 %.

    With its own friction the half-space slips as the structure does, within 1.5 % of its path;
    without the link it does not bend, and is off by up to 8 %.
    """
    path, peak = dovetail_path.with_name("dovetail_2d.yaml"), 7
    fine = flank(path, 160)[0]
    x = fine.interface.coordinates[:, 0]
    pressures = at_places(x, fine.pressure[peak])
    ways = at_places(x, np.abs(fine.slip[:, 0]).sum(axis=0))
    errors = {}
    for link in ("corrected", "half_space"):
        _, stage, first = flank(path, 20, f"contact.link={link}", "contact.method=full")
        cells = stage.grid.x.ravel()
        slip = np.sum([np.abs(state.slip[0, :, 0]) for state in first.cycle], axis=0)
        pressure = at_places(cells, first.pressure[peak, :, 0])
        errors[link] = [
            np.abs(found / right - 1.0).max()
            for found, right in ((pressure, pressures), (at_places(cells, slip), ways))
        ]
    assert max(errors["corrected"]) < 0.015
    assert errors["half_space"][0] > 0.15
    assert errors["half_space"][1] > 0.05
