"""Tests of the damping of rigs in cases: linear systems by their matrices, and errors."""

import numpy as np
import pytest
import scipy.linalg as sl

from tests.workflow.vibration.test_vibration_case import RIG, SAMPLED, STIFFNESS
from tests.workflow.vibration.time_scenes import MASS, STIFF, refused, run
from tests.workflow.vibration.time_scenes import RIG as RIG_IN_TIME

AT = 82.0
FREE, STUCK = "joint.friction=0", "joint.friction=10"
RAYLEIGH = "{kind: ratios, frequencies: [30 Hz, 500 Hz], ratios: [2 %, 5 %]}"
DASHPOTS = "[{points: m2, against: m1, coefficient: 200 N*s/m}, {points: m1, coefficient: 0.1}]"


def of_modes(*ratios):
    """Return C for these damping ratios."""
    squares, shapes = sl.eigh(STIFF, MASS)
    return MASS @ shapes @ np.diag(2.0 * np.array(ratios) * np.sqrt(squares)) @ shapes.T @ MASS


def rayleigh():
    """Return α and β from 2 ζ = α / ω + β ω."""
    angular = 2.0 * np.pi * np.array([30.0, 500.0])
    alpha, beta = np.linalg.solve(np.stack([1.0 / angular, angular], 1), [0.04, 0.1])
    return alpha * MASS + beta * STIFF


@pytest.mark.parametrize(
    ("entries", "damping", "loss", "held"),
    [
        (["damping_ratio=[3 %, 8 %]"], of_modes(0.03, 0.08), 0.0, 0.0),
        (["damping_ratio=[3 %]"], of_modes(0.03, 0.03), 0.0, STIFFNESS),
        (["damping_ratio=0", f"damping.rayleigh={RAYLEIGH}"], rayleigh(), 0.0, STIFFNESS),
        (["damping.loss_factor=4 %"], of_modes(0.1, 0.1), 0.04, STIFFNESS),
        (
            [f"damping.dashpots={DASHPOTS}"],
            of_modes(0.1, 0.1) + np.array([[0.3, -0.2], [-0.2, 0.2]]),
            *(0.0, 0.0),
        ),
    ],
)
def test_linear_rigs_are_damped_as_their_matrices(tmp_path, entries, damping, loss, held):
    """Loss factor and β are those of the structure without its joint."""
    given = [f"structure.{entry}" for entry in entries]
    few = ("forces=[2 N]", f"at=[{AT} Hz]", "frequencies=[80 Hz, 84 Hz]", "resolution.harmonics=1")
    summary = run(tmp_path, RIG, STUCK if held else FREE, *given, *few)
    angular = 2.0 * np.pi * AT
    stiffness = (1.0 + 1j * loss) * STIFF + np.diag([0.0, held]) + 1j * angular * damping
    wanted = np.linalg.solve(stiffness - angular**2 * MASS, [2.0, 0.0])[1]
    (motion,) = summary["responses"][0]["at"][0]["motions"]
    assert motion["amplitude"] == pytest.approx(abs(wanted), rel=SAMPLED + 1e-7)
    assert motion["phase"] == pytest.approx(np.angle(wanted), abs=1e-7)
    # Half of what a mode of the stuck rig loses by C and by D.
    squares, shapes = sl.eigh(STIFF + np.diag([0.0, STIFFNESS if held else 0.0]), MASS)
    lost = np.diag(shapes.T @ damping @ shapes) * np.sqrt(squares)
    lost = lost + loss * np.diag(shapes.T @ STIFF @ shapes)
    np.testing.assert_allclose(summary["damping_stuck"], 0.5 * lost / squares, rtol=1e-6)


def test_dashpots_damp_in_time(tmp_path):
    """A stuck rig settles at the amplitude of its matrices."""
    given = f"structure.damping.dashpots={DASHPOTS}"
    summary = run(tmp_path, RIG_IN_TIME, STUCK, given, "integration.step=25 us")
    angular = 2.0 * np.pi * 80.0
    damping = of_modes(0.1, 0.1) + np.array([[0.3, -0.2], [-0.2, 0.2]])
    stiffness = STIFF + np.diag([0.0, STIFFNESS]) + 1j * angular * damping
    wanted = np.linalg.solve(stiffness - angular**2 * MASS, [50.0, 0.0])
    np.testing.assert_allclose(summary["states"][0]["amplitudes"], np.abs(wanted), rtol=1e-3)


@pytest.mark.parametrize(
    ("entry", "named"),
    [
        ("damping_ratio=[1 %, 1 %, 1 %]", "structure.damping_ratio"),
        (
            "damping.rayleigh={kind: ratios, frequencies: [90 Hz, 9 Hz], ratios: [1 %, 2 %]}",
            "structure.damping.rayleigh",
        ),
        ("damping.dashpots=[{points: m3, coefficient: 1}]", "damping.dashpots.0.points"),
        (
            "damping.dashpots=[{points: m1, against: m1, coefficient: 1}]",
            "damping.dashpots.0.against",
        ),
    ],
)
def test_wrong_damping_is_named(tmp_path, entry, named):
    code, reported = refused(tmp_path, RIG, f"structure.{entry}")
    assert code == 2
    assert named in reported
