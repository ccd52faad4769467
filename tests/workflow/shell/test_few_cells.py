"""Tests of contacts on few cells of their grid: the warnings and the proposed grids."""

import json
import re

import numpy as np
import pytest

from sa_solver.types import Grid
from tests.workflow.command_line import command
from workflow.analyses.contact.case import ContactGrid
from workflow.errors import UserError
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.few_cells import check_cells

BALL = """\
title: Ball
analysis: contact
structure: {kind: bodies, shape: sphere, radius: 10 mm}
materials: {body_1: {young: 115 GPa, poisson: 0.29}, body_2: {young: 115 GPa, poisson: 0.29}}
friction: {coefficient: 0.5}
load_path: {legs: [{P: 100 N}]}
contact: {grid: [32, 32], size: [2 mm, 2 mm]}
output: {paraview: false, figures: false}
"""
STRIP = BALL.replace("shape: sphere, radius: 10 mm", "shape: cylinder, radius: 10 mm").replace(
    "P: 100 N", "P: 100 N/mm"
)


class Warnings(list):
    def warn(self, kind, text):
        assert kind is WarningKind.FEW_CELLS
        self.append(text)


def run(tmp_path, text, *settings):
    (tmp_path / "case.yaml").write_text(text, encoding="utf-8")
    out = tmp_path / "out"
    done = command("run", tmp_path / "case.yaml", "--out", out, "--force", overrides=settings)
    if done.exit_code:
        return done, []
    return done, json.loads((out / "summary.json").read_text("utf-8"))["warnings"]


@pytest.mark.parametrize(
    ("text", "grid", "size", "across"),
    [(BALL, "[32, 32]", "[2 mm, 2 mm]", "8 x 8, 10"), (STRIP, "36", "1.2 mm", "8, 16")],
    ids=["sphere", "line"],
)
def test_a_run_proposes_grids_that_do(tmp_path, text, grid, size, across):
    coarse = f"contact={{grid: {grid}, size: {size}}}"
    done, (warning,) = run(tmp_path, text, coarse)
    assert done.exit_code == 0
    found, enough = across.split(", ")
    assert f"the contact is only {found} cells across, and {enough} are needed" in warning
    found = re.search(r"take (contact.grid: .*) or (contact.size: .*) ", warning)
    for proposed in found.groups():
        _, warnings = run(tmp_path, text, coarse, proposed.replace(": ", "=", 1))
        assert warnings == []


def test_a_point_is_refused(tmp_path):
    done, _ = run(tmp_path, BALL, "structure.radius=1 nm")
    assert done.exit_code == 2
    line = done.stderr.splitlines()[-1]
    assert "contact.grid: the contact is only 2 x 2 cells across" in line
    assert "finer cells are needed than those of contact.grid: [200, 200] or contact.size:" in line


def test_a_contact_that_fills_its_grid_needs_more_cells_there():
    settings = ContactGrid(grid=(64, 8), size=(2.0, 1.0))
    pressure = np.zeros((64, 8))
    pressure[20:40] = 1.0
    reported = Warnings()
    check_cells("flank", settings, Grid.covering((2.0, 1.0), (64, 8)), pressure, reported)
    (line,) = reported
    assert line.endswith("take contact.grid: [64, 14]")


def test_one_that_has_worn_to_a_point_is_warned_of():
    settings = ContactGrid(grid=(64, 64), size=(1.0, 1.0))
    grid, pressure, reported = Grid.covering((1.0, 1.0), (64, 64)), np.zeros((64, 64)), Warnings()
    check_cells("pad", settings, grid, pressure, reported)
    assert reported == []
    pressure[10, 10] = 1.0
    check_cells("pad", settings, grid, pressure, reported, worn=True)
    assert "pad is only 1 x 1 cells across after wear" in reported[0]
    with pytest.raises(UserError, match="meaningless"):
        check_cells("pad", settings, grid, pressure, reported)
