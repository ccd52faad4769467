"""Tests of vibration cases from the command line: linear limits, closed forms, errors, files."""

import csv

import h5py
import numpy as np
import pytest
import scipy.linalg as sl

from tests.workflow.vibration.time_scenes import MASS, STIFF, linear_rig, receptance, refused, run
from wear.joints.jenkins import Jenkins
from workflow.models.vibration.structure import BESIDE

RIG = """\
title: Rig
analysis: vibration
structure: {kind: rig, masses: [20 kg, 1 kg], springs: [1 N/um, 200 N/um], damping_ratio: 0.1}
joint: {law: jenkins, normal_load: 100 N, friction: 0.5, stiffness: 10 N/um}
forces: [2 N, 60 N]
frequencies: [20 Hz, 300 Hz]
stability: none
output: {figures: false}
"""
ONE_MASS = """\
title: One mass
analysis: vibration
structure: {kind: rig, masses: [2 kg], springs: [800 N/mm], damping_ratio: 0.02}
joint: {law: jenkins, normal_load: 10 N, friction: 0.5, stiffness: 1500, residual_stiffness: 30}
forces: [10 N]
frequencies: [80 Hz, 200 Hz]
resolution: {harmonics: 1, samples: 4096}
stability: none
output: {figures: false}
"""
STIFFNESS = 1e4
# Tolerance of the solver over a resonance of moderate damping.
SOLVED = 1e-7
# Half the peak-to-peak motion is taken at 1024 times of a period: at most (π/1024)²/2 too small.
SAMPLED = 5e-6


def curves(folder, number=0):
    """Return the datasets of a force of a finished run."""
    with h5py.File(folder / "out" / "results.h5") as file:
        group = file[f"responses/{number:05d}"]
        return {name: item[()] for name, item in group.items() if isinstance(item, h5py.Dataset)}


# --- against closed forms -----------------------------------------------------------------------


@pytest.mark.parametrize(("friction", "held"), [(0.0, 0.0), (10.0, STIFFNESS)])
def test_free_and_stuck_joints_leave_the_rig_linear(tmp_path, friction, held):
    summary = run(tmp_path, RIG, f"joint.friction={friction}", "forces=[2 N]")
    curve = curves(tmp_path)
    for frequency, amplitude, phase in zip(
        curve["frequency"], curve["amplitude"], curve["phase"], strict=True
    ):
        wanted = 2.0 * receptance(frequency, held)
        np.testing.assert_allclose(amplitude, np.abs(wanted), rtol=SAMPLED + SOLVED)
        assert np.cos(phase - np.angle(wanted[-1])) == pytest.approx(1.0, abs=1e-12)
    (response,) = summary["responses"]
    assert response["message"] == ""
    assert response["error"] < 1e-12
    assert curve["frequency"][[0, -1]].tolist() == [20.0, 300.0]
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(MASS, linear_rig(held)[0])).real)
    reported = (2.0 * np.pi * np.array(summary["stuck" if held else "free"])) ** 2
    # Rounding is that of the largest, 4000 times the least.
    np.testing.assert_allclose(reported, squares, rtol=0.0, atol=1e-12 * squares[-1])
    assert curve["slip"].max() == (0.0 if held else 1.0)
    # It lies between the points of the curve, higher than both.
    grid = np.linspace(0.99, 1.01, 2001) * response["resonance"]
    sizes = [abs(receptance(frequency, held)[-1]) for frequency in grid]
    assert response["receptance"] == pytest.approx(max(sizes), rel=2.0 * SAMPLED)
    assert response["resonance"] == pytest.approx(grid[np.argmax(sizes)], rel=2e-3)


def test_linear_limits_without_damping_have_their_peaks_next_to_the_modes(tmp_path):
    """At the modes there is no bound: an amplitude is f0 / 2 |f - f0| times that at rest."""
    where = ("structure.damping_ratio=0", "joint.friction=0.001", "forces=[2 N]")
    summary = run(tmp_path, RIG, *where, "frequencies=[30 Hz, 40 Hz]")
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        linear = {name: values[()] for name, values in file["linear"].items()}
    place = int(np.argmax(linear["free"]))
    assert linear["frequency"][place] == pytest.approx(summary["free"][0], rel=1.1 * BESIDE)
    squares, shapes = sl.eigh(STIFF, MASS)
    alone = abs(shapes[0, 0] * shapes[-1, 0]) / squares[0] / (2.0 * BESIDE)
    assert linear["free"][place] == pytest.approx(alone, rel=1e-3)
    assert np.isfinite(linear["stuck"]).all()
    assert "are unbounded" in summary["warnings"][0]


def test_single_harmonic_of_one_mass_is_the_closed_form(tmp_path):
    """Amplitude a under force F satisfies |(k - m ω² + i c ω) a + cosine - i sine| = F."""
    summary = run(tmp_path, ONE_MASS)
    law = Jenkins(1500.0, 0.5, 10.0, 30.0)
    damping = 2.0 * 0.02 * np.sqrt(800.0 * 2e-3)
    curve = curves(tmp_path)
    amplitude = curve["amplitude"][:, 0]
    assert amplitude.max() > 3.0 * 5.0 / 1500.0
    omega = 2.0 * np.pi * curve["frequency"]
    cosine, sine = law.first_harmonic(amplitude)
    force = np.abs(
        (800.0 - 2e-3 * omega**2 + 1j * damping * omega) * amplitude + cosine - 1j * sine
    )
    # Amplitudes are SAMPLED; the joint's force, of second order in 1/4096, adds less.
    np.testing.assert_allclose(force, 10.0, rtol=2e-5)
    np.testing.assert_allclose(
        curve["energy_per_cycle"], law.loop_energy(amplitude), rtol=2e-5, atol=1e-6
    )
    assert summary["responses"][0]["error"] < 0.01


@pytest.mark.slow
def test_resonance_falls_from_stuck_to_free(tmp_path):
    overrides = ("structure.damping_ratio=0.01", "forces=[0.2 N, 20 N, 300 N]")
    summary = run(tmp_path, RIG, *overrides, "resolution.tolerance=1 %")
    assert summary["trend"]["resonance"] == -1.0
    assert summary["least_receptance_force"] == 20.0
    first, middle, last = summary["responses"]
    assert first["resonance"] == pytest.approx(summary["stuck"][0], rel=1e-3)
    assert last["resonance"] == pytest.approx(summary["free"][0], rel=1e-2)
    assert (first["slip"], last["slip"] > 0.9) == (0.0, True)
    assert len(middle["harmonics"]) > len(first["harmonics"]) - 1
    for response in summary["responses"]:
        assert response["error"] <= 0.01
        assert response["amplitude"] == pytest.approx(response["receptance"] * response["force"])
    assert summary["warnings"] == []


def test_a_curve_that_ends_early_or_has_no_peak_gives_a_warning(tmp_path):
    summary = run(tmp_path, RIG, "forces=[2 N]", "frequencies=[20 Hz, 25 Hz]")
    assert "no resonance" in summary["warnings"][0]
    summary = run(tmp_path, RIG, "forces=[2 N]", "continuation.most_points=5")
    assert "5 points" in summary["responses"][0]["message"]


# --- what is left -------------------------------------------------------------------------------


@pytest.mark.slow
def test_files_of_a_run(tmp_path):
    run(tmp_path, RIG, "output.figures=true")
    out = tmp_path / "out"
    assert (out / "figures" / "frequency_response.png").exists()
    curve = curves(tmp_path, 1)
    with (out / "frf_00001.csv").open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    assert header[:4] == ["frequency [Hz]", "amplitude_1 [mm]", "amplitude_2 [mm]", "phase [rad]"]
    table = np.array(rows, dtype=float)
    np.testing.assert_allclose(table[:, 0], curve["frequency"], rtol=1e-8)
    np.testing.assert_allclose(table[:, 1:3], curve["amplitude"], rtol=1e-8)
    with h5py.File(out / "results.h5") as file:
        free = file["linear/free"][()], file["linear/frequency"][()]
    wanted = [abs(receptance(frequency, 0.0)[-1]) for frequency in free[1][::200]]
    np.testing.assert_allclose(free[0][::200], wanted, rtol=1e-9)
    run(tmp_path, RIG, "forces=[2 N]")
    assert not (out / "frf_00001.csv").exists()


# --- the case -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("forces=[40 N, 10 N]", "forces"),
        ("frequencies=[400 Hz, 20 Hz]", "frequencies"),
        ("mass=3", "mass"),
        ("loops={frequency: 10 Hz}", "loops.frequency"),
        ("resolution.harmonics=[1, 1]", "resolution.harmonics"),
        ("resolution.harmonics=[3, 5]", "resolution.harmonics"),
        ("resolution.samples=30", "resolution.samples"),
        ("loops={frequency: 100 Hz, harmonics: [0]}", "loops.harmonics"),
        ("at=[10 Hz]", "at"),
        ("modes={amplitudes: [5 um, 1 um]}", "modes.amplitudes"),
        ("modes={numbers: [9], amplitudes: [1 um, 5 um]}", "modes.numbers"),
    ],
)
def test_wrong_entries_are_named(tmp_path, override, named):
    code, message = refused(tmp_path, RIG, override)
    assert code == 2
    assert named in message


@pytest.mark.slow
def test_phase_resonance_follows_the_peaks(tmp_path):
    """Amplitude is half peak to peak; force and response are 90° apart at the driven mass."""
    summary = run(tmp_path, RIG, "forces=[2 N, 20 N, 60 N]", "backbone=true", "mass=2")
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        curve = {name: file[f"backbone/{name}"][()] for name in file["backbone"]}
    assert curve["force"][[0, -1]].tolist() == [2.0, 60.0]
    for response in summary["responses"][::2]:
        place = int(np.abs(curve["force"] - response["force"]).argmin())
        # Damping ratio 0.1: the peak of the amplitude lies a little below.
        assert curve["frequency"][place] == pytest.approx(response["resonance"], rel=0.06)
        assert curve["amplitude"][place] == pytest.approx(response["amplitude"], rel=0.02)


def test_motions_along_the_force_leave_the_linear_limit_where_the_joint_slips(tmp_path):
    """They lead from the stuck rig to the response of the largest force at that frequency."""
    summary = run(tmp_path, RIG, "forces=[2 N, 60 N]", "force_sweeps=[90 Hz]")
    (sweep,) = summary["force_sweeps"]
    assert (sweep["frequency"], sweep["folds"], sweep["message"]) == (90.0, [], "")
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        swept = {name: file[f"force_sweeps/00000/{name}"][()] for name in ("force", "amplitude")}
        slip = file["force_sweeps/00000/slip"][()]
        curve = {name: file[f"responses/00001/{name}"][()] for name in ("frequency", "amplitude")}
    assert swept["force"][[0, -1]].tolist() == [2.0, 60.0]
    stuck = slip == 0.0
    wanted = np.abs(receptance(90.0, STIFFNESS)[-1]) * swept["force"]
    assert 1 < stuck.sum() < len(stuck)
    np.testing.assert_allclose(swept["amplitude"][stuck], wanted[stuck], rtol=SAMPLED + SOLVED)
    assert np.all(np.abs(swept["amplitude"] / wanted - 1.0)[~stuck][1:] > 1e-4)
    along = np.interp(90.0, curve["frequency"], curve["amplitude"][:, -1])
    assert swept["amplitude"][-1] == pytest.approx(along, rel=2e-2)
    assert (tmp_path / "out" / "force_sweep_00000.csv").exists()


def test_loops_of_the_joint_at_one_frequency(tmp_path):
    """A slider's loop has its spring's slope, µN, and an energy of 4 µN (a - µN/kt)."""
    run(tmp_path, RIG, "forces=[2 N, 60 N]", "loops={frequency: 60 Hz, harmonics: [1, 40]}")
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        small, large = (dict(file[f"responses/0000{n}/loops/00001"].attrs) for n in (0, 1))
    assert small["stiffness"] == pytest.approx(STIFFNESS, rel=1e-9)
    assert "friction" not in small
    assert large["stiffness"] == pytest.approx(STIFFNESS, rel=2e-2)
    assert large["friction"] == pytest.approx(0.5, rel=1e-2)
    energy = 4.0 * 50.0 * (0.5 * large["stroke"] - 50.0 / STIFFNESS)
    assert large["energy"] == pytest.approx(energy, rel=2e-2)
