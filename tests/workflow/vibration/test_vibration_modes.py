"""Tests of amplitude-dependent modes with joints in a vibration case: reports and files."""

import csv

import h5py
import numpy as np
import pytest

from tests.workflow.output.figure_checks import problems
from tests.workflow.vibration.test_vibration_case import RIG
from tests.workflow.vibration.time_scenes import run
from workflow.analyses.vibration.figures.modes import modes as figure
from workflow.analyses.vibration.output.outcome import VibrationContents

LIGHT = "structure.damping_ratio=0.001"
ASKED = "modes={numbers: [1, 2], amplitudes: [0.2 um, 20 um]}"


@pytest.fixture(scope="module")
def sliding(tmp_path_factory):
    """Return folder and summary of a rig whose joint slides, under two forces."""
    folder = tmp_path_factory.mktemp("sliding")
    return folder, run(folder, RIG, "forces=[2 N, 60 N]", "backbone=true", LIGHT, ASKED)


def test_modes_begin_as_the_stuck_structure_and_lose_energy(sliding):
    folder, summary = sliding
    for mode, stuck in zip(summary["modes"], summary["stuck"], strict=True):
        assert mode["linear_frequency"] == pytest.approx(stuck, rel=1e-9)
        assert mode["frequency"][0] == pytest.approx(stuck, rel=1e-6)
        assert mode["frequency"][1] < mode["frequency"][0]
        assert mode["most_damped"] > 5.0 * mode["linear_damping"]
        assert mode["message"] == ""
    with h5py.File(folder / "out" / "results.h5") as file:
        first = {name: values[()] for name, values in file["modes/00000"].items()}
        assert file["modes/00000"].attrs["mode"] == 1
    assert first["amplitude"][0] == pytest.approx(0.2e-3, rel=1e-3)
    np.testing.assert_array_less(0.0, np.diff(first["modal_amplitude"]))
    with (folder / "out" / "mode_00001.csv").open(encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    np.testing.assert_allclose(
        [float(row["frequency [Hz]"]) for row in rows], first["frequency"], rtol=1e-8
    )


def test_phase_resonance_lies_on_the_lightly_damped_mode(sliding):
    folder, _ = sliding
    with h5py.File(folder / "out" / "results.h5") as file:
        mode, backbone = file["modes/00000"], file["backbone"]
        light = backbone["damping"][()] < 0.05
        assert light.sum() > 1
        beside = np.interp(backbone["amplitude"][light], mode["amplitude"], mode["frequency"])
        np.testing.assert_allclose(backbone["frequency"][light], beside, rtol=2e-3)


def test_figure_has_two_panels_for_each_mode(sliding):
    folder, _ = sliding
    contents = VibrationContents(("00000", "00001"), (), False, True, modes=("00000", "00001"))
    with h5py.File(folder / "out" / "results.h5") as file:
        drawn = figure(file, contents)
        drawn.canvas.draw()
        assert problems(drawn) == []
        assert len(drawn.axes) == 4
