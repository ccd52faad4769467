"""Tests of the friction rig with its specimens, from the command line, on coarse pads."""

import h5py
import numpy as np
import pytest

from tests.workflow.vibration.time_scenes import refused, run

SPECIMENS = """\
title: Coarse specimens
analysis: wear
structure:
  kind: specimens
  diameter: 8 mm
  length: 33 mm
  strip_width: 1 mm
  chamfer_depth: 1 mm
  ring_distance: 2 mm
  ring_nodes: 4
  form: {along: 1e6 mm, across: 50 mm}
materials:
  body_1: {young: 200 GPa, poisson: 0.3, density: 7800 kg/m^3}
  body_2: {young: 200 GPa, poisson: 0.3, density: 7800 kg/m^3}
friction: {coefficient: 0.88}
load_path: {normal_forces: [60 N], stroke: 14 um}
mesh: {pad_elements: 4, size: 3 mm, order: 1}
reduction: {modes: 2}
wear:
  law: energy
  body_1: {coefficient: 1500 um^3/J}
  body_2: {coefficient: 1500 um^3/J}
  cycles: 1000
"""
RIG = """\
title: Coarse rig
analysis: vibration
structure:
  kind: friction_rig
  specimens: specimens.yaml
  masses: [21.152 kg, 1.189 kg]
  springs: [1.3469e3 N/mm, 273e3 N/mm]
  damping_ratio: 0.01
joint:
  law: friction_contact
  normal_load: 60 N
  friction: 0.88
  stiffness: 45 N/um
  normal_stiffness: 58.5 N/um
forces: [0.1 N, 90 N]
frequencies: [30 Hz, 300 Hz]
resolution: {harmonics: 3, samples: 64}
output: {figures: false, paraview: false}
"""
NODES = 25


@pytest.fixture
def files(tmp_path):
    (tmp_path / "specimens.yaml").write_text(SPECIMENS, encoding="utf-8")
    return tmp_path


@pytest.mark.slow
def test_the_rig_sticks_under_a_small_force_and_slides_under_a_large_one(files):
    summary = run(files, RIG, "loops={frequency: 100 Hz, harmonics: [3, 8]}")
    (warning,) = summary["warnings"]
    assert "90 N: at resonance the pads slide over each other by" in warning
    assert summary["joints"] == NODES
    assert 9 <= summary["touching"] <= NODES
    # The masses alone give 39.08 Hz; the specimen adds 1 % to the second.
    assert summary["free"][1] == pytest.approx(39.07, abs=0.02)
    small, large = summary["responses"]
    assert small["resonance"] == pytest.approx(summary["stuck"][0], rel=1e-2)
    assert large["resonance"] == pytest.approx(summary["sliding"][0], rel=2e-2)
    assert (small["slip"] < 0.1, large["slip"] > 0.9) == (True, True)
    assert small["harmonics"] == [0, 1, 3, 5]
    with h5py.File(files / "out" / "results.h5") as file:
        contact = {name: file[f"contact/{name}"][()] for name in file["contact"]}
        nodes = {name: file[f"responses/00001/nodes/{name}"][()] for name in ("slip", "energy")}
        energy = file["responses/00001/energy_per_cycle"][()]
        frequency = file["responses/00001/frequency"][()]
        loop = {name: file[f"responses/00001/loops/00001/{name}"][()] for name in ("force",)}
    # The load, and the gaps of two strips of radius 50 mm: (x² + y²)/2R and a little.
    assert contact["normal_force"].sum() == pytest.approx(60.0, rel=1e-8)
    assert contact["area"].sum() == pytest.approx(1.0, rel=1e-9)
    square = contact["x"] ** 2 + contact["y"] ** 2
    np.testing.assert_allclose(contact["gap"], square / 100.0, rtol=1e-4, atol=1e-12)
    # All forces end on the circle when everything slides.
    assert np.abs(loop["force"]).max() == pytest.approx(0.88 * 60.0, rel=1e-2)
    assert nodes["slip"].shape == (len(frequency), NODES)
    np.testing.assert_allclose(nodes["energy"].sum(axis=1), energy, rtol=1e-12)


@pytest.mark.slow
def test_pads_pressed_evenly_are_closed_evenly_if_contacts_share_by_area(files):
    """Contacts are so soft that bodies are rigid in comparison, so each carries its share."""
    law = "law: friction_contact, normal_load: 60, friction: 1"
    soft = f"joint={{{law}, stiffness: 10, normal_stiffness: 10}}"
    shares = {}
    for sharing in ("even", "area"):
        run(files, RIG, soft, f"structure.sharing={sharing}", "forces=[1e-3 N]")
        with h5py.File(files / "out" / "results.h5") as file:
            shares[sharing] = file["contact/normal_force"][()] / 60.0
            area = file["contact/area"][()]
    np.testing.assert_allclose(shares["even"], 1.0 / NODES, rtol=1e-2)
    np.testing.assert_allclose(shares["area"], area, rtol=1e-2)


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("joint.normal_load=0", "joint.normal_load"),
        ("structure.specimens=nothing.yaml", "nothing.yaml"),
        ("joint={law: jenkins, normal_load: 60, friction: 1, stiffness: 1}", "friction_contact"),
        ("mass=1", "mass"),
    ],
)
def test_wrong_entries_are_named(files, override, named):
    code, message = refused(files, RIG, override)
    assert code == 2
    assert named in message
