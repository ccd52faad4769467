"""Tests of excitations of vibration cases: forces, records, the ground, an engine; and errors."""

import csv

import h5py
import numpy as np
import pytest

from fe_models.joints.reduction import ReducedModel, save_reduced
from tests.workflow.vibration.test_vibration_case import RIG, SAMPLED, STIFFNESS
from tests.workflow.vibration.time_scenes import MASS, linear_rig, refused, run

STUCK, AT = "joint.friction=10", 83.0
FEW = ("forces=", f"at=[{AT} Hz]", "frequencies=[80 Hz, 84 Hz]")
RECORD = "time [ms],force [N]\n5,0\n7,3\n10,-1\n12,4\n15,0\n"


def responses_to(forces, order=1):
    """Return displacements ``(2,)`` of the stuck rig by amplitudes of forces of a harmonic."""
    stiffness, damping = linear_rig(STIFFNESS)
    angular = 2.0 * np.pi * AT * order
    return np.linalg.solve(stiffness - angular**2 * MASS + 1j * angular * damping, forces)


def answer(folder, *settings, joint=STUCK):
    """Return the summary, its one motion, and its harmonics by order ``(2,)``."""
    summary = run(folder, RIG, joint, *FEW, *settings)
    (motion,) = summary["responses"][0]["at"][0]["motions"]
    with h5py.File(folder / "out" / "results.h5") as file:
        group = file["responses/00000/harmonics/at_00000"]
        found = dict(zip(group["harmonic"][()].tolist(), group["displacement"][()], strict=True))
    return summary, motion, found


def test_forces_with_phases_and_harmonics_superpose(tmp_path):
    forces = (
        "[{points: m1, amplitude: 10 N}, {points: m2, amplitude: 5 N, phase: 90 deg}, "
        "{points: m1, direction: -x, amplitude: 3 N, harmonic: 2, phase: 30 deg}]"
    )
    summary, motion, found = answer(
        tmp_path, f"excitation={{levels: [2], forces: {forces}}}", "resolution.harmonics=2"
    )
    assert list(found) == [0, 1, 2, 3]
    first = responses_to([-20j, 10.0])
    np.testing.assert_allclose(found[1], first, rtol=1e-8)
    second = responses_to([6j * np.exp(1j * np.pi / 6.0), 0.0], 2)
    np.testing.assert_allclose(found[2], second, rtol=1e-8)
    np.testing.assert_allclose([found[0], found[3]], 0.0, atol=1e-9 * abs(first[0]))
    assert motion["phase"] == pytest.approx(np.angle(1j * first[1]))
    assert summary["responses"][0]["level"] == 2.0
    assert "force" not in summary["responses"][0]
    assert "level 2: resonance" in (tmp_path / "out" / "run.log").read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", ["displacement", "acceleration"])
def test_the_ground_shakes_the_rig(tmp_path, kind):
    """Relative and absolute motions follow from M (x'' + x_g'') + C x' + K x = 0.

    C and K contain the connections of both masses to the ground.
    """
    squared = (2.0 * np.pi * AT) ** 2
    amplitude = 0.02 if kind == "displacement" else 0.02 * squared
    base = f"[{{kind: {kind}, amplitude: {amplitude}, phase: 40 deg}}]"
    summary, motion, found = answer(tmp_path, f"excitation={{base: {base}, forces: []}}")
    ground = -0.02j * np.exp(1j * np.radians(40.0)) * (1.0 if kind == "displacement" else -1.0)
    relative = responses_to(squared * MASS.sum(axis=1) * ground)
    np.testing.assert_allclose(found[1], relative, rtol=1e-8)
    assert motion["amplitude"] == pytest.approx(abs(relative[1]), rel=SAMPLED)
    absolute = abs(relative[1] + ground)
    assert motion["absolute_amplitude"] == pytest.approx(absolute, rel=SAMPLED)
    assert "absolute_amplitude" in summary["responses"][0]
    log = (tmp_path / "out" / "run.log").read_text(encoding="utf-8")
    assert "relative to the ground" in log


def test_a_record_is_the_sum_of_its_harmonics(tmp_path):
    """Straight lines between rows are integrated by turns; omitted parts are reported."""
    (tmp_path / "period.csv").write_text(RECORD, encoding="utf-8")
    records = "[{points: m2, file: period.csv, highest: 4}]"
    settings = f"excitation={{records: {records}, forces: []}}", "resolution.harmonics=1"
    summary, _, found = answer(tmp_path, *settings)
    turns = (np.arange(20000) + 0.5) / 20000
    force = np.interp(turns, [0.0, 0.2, 0.5, 0.7, 1.0], [0.0, 3.0, -1.0, 4.0, 0.0])
    assert sorted(found) == [0, 1, 2, 3, 4]
    left = force - force.mean()
    for order in range(5):
        wave = np.mean(force * np.exp(-2j * np.pi * order * turns)) * (2.0 if order else 1.0)
        np.testing.assert_allclose(found[order], responses_to([0.0, wave], order), rtol=1e-6)
        if order:
            left = left - (wave * np.exp(2j * np.pi * order * turns)).real
    share = np.sqrt(np.mean(left**2) / np.var(force))
    assert summary["left_out_of_records"] == [pytest.approx(share, rel=1e-5)]
    assert any("above the highest harmonic used" in line for line in summary["warnings"])


def test_one_force_at_levels_is_what_forces_are(tmp_path):
    """The numbers agree with friction, folds and harmonics."""
    few = ("frequencies=[60 Hz, 140 Hz]", "resolution.harmonics=3")
    wanted = run(tmp_path / "forces", RIG, *few, "forces=[60 N]")
    excitation = "excitation={levels: [60], forces: [{points: m1, amplitude: 1 N}]}"
    found = run(tmp_path / "levels", RIG, *few, "forces=", excitation)
    for name in ("resonance", "amplitude", "receptance", "energy_per_cycle", "damping", "slip"):
        same = pytest.approx(wanted["responses"][0][name], rel=1e-9)
        assert found["responses"][0][name] == same, name


def test_engine_orders_give_speeds(tmp_path):
    orders = ("engine_order=4", "forces=[2 N]", "frequencies=[60 Hz, 140 Hz]", STUCK)
    summary = run(tmp_path, RIG, *orders, "output.figures=true", "resolution.harmonics=1")
    (response,) = summary["responses"]
    assert response["speed"] == pytest.approx(2.0 * np.pi * response["resonance"] / 4.0)
    with (tmp_path / "out" / "frf_00000.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["speed [rad/s]"]) == pytest.approx(2.0 * np.pi * 60.0 / 4.0, rel=1e-8)
    assert (tmp_path / "out" / "figures" / "engine_orders.png").exists()
    assert "rpm" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


ONE = "forces: [{points: m1, amplitude: 1 N}]"


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        (["forces="], "forces"),
        ([f"excitation={{{ONE}}}"], "excitation.levels"),
        (["forces=", "excitation={levels: [1]}"], "excitation"),
        (["forces=", f"excitation={{levels: [2, 1], {ONE}}}"], "excitation.levels"),
        (["forces=", "excitation={forces: [{points: m3, amplitude: 1}]}"], "forces.0.points"),
        (
            ["forces=", "excitation={base: [{kind: displacement, direction: z, amplitude: 1}]}"],
            "base.0.direction",
        ),
    ],
)
def test_wrong_excitations_are_named(tmp_path, settings, named):
    code, reported = refused(tmp_path, RIG, *settings)
    assert code == 2
    assert named in reported


BODY = """\
title: Two masses as a body
analysis: vibration
structure:
  kind: reduced
  file: body.h5
  joints: [{points: b, direction: x}]
  springs: [{points: a, direction: x, stiffness: 1 N/um}]
  damping_ratio: 0.1
  seen: {points: b, direction: x}
joint: {law: jenkins, normal_load: 100 N, friction: 10, stiffness: 10 N/um}
excitation:
  forces: [{points: b, amplitude: 5 N, phase: 60 deg}]
  base: [{kind: displacement, amplitude: 20 um}]
frequencies: [80 Hz, 84 Hz]
resolution: {harmonics: 1}
at: [83 Hz]
output: {figures: false, paraview: false}
"""


def two_masses():
    """Return the rig of the other tests without its first spring."""
    stiffness = 200e3 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    flat = np.zeros((2, 0))
    return ReducedModel(np.arange(2), stiffness, MASS, flat, flat, np.zeros(0), ("a x", "b x"))


def test_a_reduced_body_is_driven_at_its_points_and_by_its_ground(tmp_path):
    save_reduced(tmp_path / "body.h5", two_masses())
    summary = run(tmp_path, BODY)
    ground = -0.02j
    inertia = (2.0 * np.pi * AT) ** 2 * MASS.sum(axis=1) * ground
    pulled = np.array([0.0, -5j * np.exp(1j * np.pi / 3.0)])
    wanted = responses_to(inertia + pulled)[1]
    (motion,) = summary["responses"][0]["at"][0]["motions"]
    assert motion["amplitude"] == pytest.approx(abs(wanted), rel=SAMPLED + 1e-8)
    assert motion["absolute_amplitude"] == pytest.approx(abs(wanted + ground), rel=SAMPLED + 1e-8)
