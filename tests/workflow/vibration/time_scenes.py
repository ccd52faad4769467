"""Joints and rigs in time that several test modules run."""

import json
from pathlib import Path

import numpy as np

from tests.workflow.command_line import command
from tests.workflow.conftest import invoke

# Tolerance for the rounding of closed forms and marched cycles.
ROUNDING = 1e-12

JOINT = """\
title: Spring and slider
analysis: time
structure: {kind: joint}
joint: {law: jenkins, normal_load: 100 N, friction: 0.5, stiffness: 10 N/um}
drive: {stroke: 40 um, frequency: 10 Hz}
ageing: {cycles: 1000}
output: {figures: false}
"""
# Loop of the joint: 4 µN (A - µN/kt).
LIMIT, STIFFNESS, AMPLITUDE = 50.0, 1e4, 0.02
LOOP_ENERGY = 4.0 * LIMIT * (AMPLITUDE - LIMIT / STIFFNESS)

RIG = """\
title: Rig
analysis: time
structure: {kind: rig, masses: [20 kg, 1 kg], springs: [1 N/um, 200 N/um], damping_ratio: 0.1}
joint: {law: jenkins, normal_load: 100 N, friction: 0.5, stiffness: 10 N/um}
excitation: {kind: harmonic, force: 50 N, frequency: 80 Hz}
integration: {step: 100 us}
output: {figures: false}
"""
MASS, STIFF = np.diag([0.02, 0.001]), np.array([[201e3, -200e3], [-200e3, 200e3]])
HAMMER = (
    "excitation={kind: hammer, force: 100 N, duration: 1 ms, record: 0.5 s, band: [50 Hz, 300 Hz], "
    "highest: 1 kHz}"
)


def run(folder: Path, text: str, *overrides: str):
    """Return the summary of a run of a case."""
    folder.mkdir(exist_ok=True)
    (folder / "case.yaml").write_text(text, encoding="utf-8")
    settings = [part for override in overrides for part in ("--set", override)]
    ended = invoke("run", folder / "case.yaml", "--out", folder / "out", *settings, "--force")
    assert ended.exit_code == 0, ended.stderr
    return json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8"))


def refused(folder: Path, text: str, *overrides: str) -> tuple[int, str]:
    """Return exit code and message of a run that fails."""
    (folder / "case.yaml").write_text(text, encoding="utf-8")
    ended = command("run", folder / "case.yaml", "--out", folder / "out", overrides=overrides)
    return ended.exit_code, ended.stderr.splitlines()[-1]


def linear_rig(joint_stiffness: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the stiffness with the joint as a spring, and the damping of the modes without it."""
    squares, shapes = np.linalg.eig(np.linalg.solve(MASS, STIFF))
    shapes = shapes / np.sqrt(np.einsum("im,ij,jm->m", shapes, MASS, shapes))
    moved = MASS @ shapes
    damping = moved @ np.diag(2.0 * 0.1 * np.sqrt(squares)) @ moved.T
    return STIFF + np.diag([0.0, joint_stiffness]), damping


def receptance(frequency: float, joint_stiffness: float) -> np.ndarray:
    """Return the displacements of both masses under 1 N on the first."""
    stiffness, damping = linear_rig(joint_stiffness)
    angular = 2.0 * np.pi * frequency
    matrix = stiffness - angular**2 * MASS + 1j * angular * damping
    return np.linalg.solve(matrix, np.array([1.0, 0.0]))
