"""The changes that "How to extend" shows apply to the current packages, and work."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = "sa_solver", "wear", "fe_models", "workflow"
RIG = """\
title: A rig on the new joint
analysis: time
structure: {kind: joint}
joint: {law: mixed_iwan, normal_load: 60 N, friction: 0.5, stiffness: 30 N/um, share: 0.4}
drive: {stroke: 14 um, frequency: 100 Hz}
ageing: {cycles: 10}
output: {figures: false}
"""
QUIET = ("output.figures=false", "output.paraview=false")
WORN = (
    *("contact.grid=[64, 1]", "wear.cycles=1e4", "wear.step.cycles=1e4", "error_budget=known"),
    *("stress.section=none", "stress.life.parameter=none", *QUIET),
    "wear.body_1={law: power, coefficient: 1e4 um^3/J, reference_slip: 100 um, exponent: 1}",
)


@pytest.fixture
def changed(tmp_path):
    """Return a function that patches a copy of the packages and runs the copy's command."""
    if shutil.which("git") is None:
        pytest.skip("git applies the patches")
    for package in PACKAGES:
        ignore = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignore)

    def command(*arguments, code="import workflow.cli; workflow.cli.main()"):
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(tmp_path)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def apply(name):
        patch = ROOT / "docs" / "extend" / name
        subprocess.run(["git", "apply", str(patch)], cwd=tmp_path, check=True)
        return command

    return apply


@pytest.mark.skipif(shutil.which("git") is None, reason="git applies the patches")
@pytest.mark.parametrize("patch", sorted((ROOT / "docs" / "extend").glob("*.patch")))
def test_patches_apply(patch, tmp_path):
    """They apply to the current files: context lines match."""
    for line in patch.read_text("utf-8").splitlines():
        if line.startswith("+++ b/"):
            name = line.removeprefix("+++ b/")
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            if (ROOT / name).exists():
                shutil.copy(ROOT / name, tmp_path / name)
    subprocess.run(["git", "apply", "--check", str(patch)], cwd=tmp_path, check=True)


def settings(overrides):
    return [part for override in overrides for part in ("--set", override)]


@pytest.mark.slow
def test_wear_law(changed, tmp_path):
    """Half the reference slip per cycle halves the coefficient, twice doubles it."""
    command = changed("wear_law.patch")
    command("new", "line_wear", "case.yaml")
    command("run", "case.yaml", "--out", "out", *settings(WORN))
    worn = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))["interface"]
    slip = 2.0 * 20e-3  # there and back
    assert worn["volume_1"] / worn["volume_2"] == pytest.approx(slip / 100e-3, rel=1e-6)


@pytest.mark.slow
def test_joint_law(changed, tmp_path):
    """Its loop loses as much as sliders with its share of spread ones; cases accept it."""
    command = changed("joint_law.patch")
    (tmp_path / "case.yaml").write_text(RIG, encoding="utf-8")
    assert "mixed_iwan, normal load 60 N" in command("check", "case.yaml")
    law = "MixedIwan(30e3, 0.5, 60.0, share=0.4)"
    code = f"from wear.joints.iwan import MixedIwan; print({law}.loop_energy(7e-3))"
    places = (np.arange(20000) + 0.5) / 20000 * 30.0 / (30e3 * 0.8)  # where spread sliders slip
    spread = 4.0 * (30e3 * 0.4 * places * (7e-3 - places)).mean()
    last = 4.0 * 30e3 * 0.6 * 1.25e-3 * (7e-3 - 1.25e-3)
    assert float(command(code=code)) == pytest.approx(spread + last, rel=1e-6)


@pytest.mark.slow
def test_output_field(changed, tmp_path):
    command = changed("output.patch")
    command("new", "bodies", "case.yaml")
    command("run", "case.yaml", "--out", "out", *settings(("contact.grid=[16, 16]", *QUIET)))
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        field = file["contact/bodies/00001/dissipated"]
        assert field.shape == (16, 16)
        assert field.attrs["unit"] == "N/mm"
