"""Structures on moving ground, against absolute coordinates and closed forms."""

import numpy as np
import pytest

from fe_models.dynamics.curves.phase_resonance import along_phase_resonance
from fe_models.dynamics.friction_rig import ground_inertia
from fe_models.dynamics.ground_motion import translation_of
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, RigError, lumped_rig
from fe_models.joints.reduction import ReducedModel
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch

FREE = PeriodicMarch(Jenkins(stiffness=1e3, friction=0.0, normal_load=10.0))
SLIDER = PeriodicMarch(Jenkins(stiffness=2e3, friction=0.5, normal_load=10.0))
WAY = 0.01


def shaken(joints, harmonics=(1,)):
    """Return two different masses on a ground that moves as a sine."""
    springs = {Link("a"): 1e3, Link("b", "a"): 3e3}
    rig = lumped_rig({"a": 1e-3, "b": 2e-3}, springs, [[Link("b")]], 0.02)
    load = PeriodicLoad({}, inertial={1: -1j * WAY * rig.mass.sum(axis=1)})
    return HarmonicBalance(rig, joints, load, Resolution(harmonics, 256))


@pytest.mark.parametrize("ratio", [0.3, 1.0, np.sqrt(2.0), 5.0])
def test_transmissibility_of_one_mass(ratio):
    """Absolute motion over that of the ground: √((1 + (2ζr)²) / ((1 - r²)² + (2ζr)²)), 1 at √2."""
    damping = 0.05
    rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], damping)
    load = PeriodicLoad({}, inertial={1: -1j * WAY * rig.mass.sum(axis=1)})
    balance = HarmonicBalance(rig, FREE, load, Resolution((1,), 64))
    motion = balance.solve(ratio * 1e3 / (2.0 * np.pi), force=1.0)
    passed = abs(motion.amplitude(0) - 1j * WAY) / WAY
    turned = (2.0 * damping * ratio) ** 2
    assert passed == pytest.approx(np.sqrt((1.0 + turned) / ((1.0 - ratio**2) ** 2 + turned)))


def test_derivatives_include_the_change_of_the_load_with_frequency():
    balance = shaken(SLIDER, (1, 3))
    motion = balance.solve(140.0, 3.0)
    unknowns, step = motion.coefficients.ravel(), 1e-5
    at = balance.evaluate(unknowns, 140.0, 3.0, "frequency")
    ahead, behind = (
        balance.evaluate(unknowns, 140.0 + sign * step, 3.0, "frequency").residual
        for sign in (1.0, -1.0)
    )
    np.testing.assert_allclose(at.slope, (ahead - behind) / (2.0 * step), rtol=1e-5, atol=1e-10)
    at = balance.evaluate(unknowns, 140.0, 3.0, "force")
    ahead, behind = (
        balance.evaluate(unknowns, 140.0, 3.0 + sign * step, "force").residual
        for sign in (1.0, -1.0)
    )
    np.testing.assert_allclose(at.slope, (ahead - behind) / (2.0 * step), rtol=1e-6, atol=1e-12)


def test_phase_resonance_under_such_a_load_is_refused():
    balance = shaken(SLIDER)
    with pytest.raises(HarmonicBalanceError, match="with the frequency"):
        along_phase_resonance(balance, balance.solve(100.0, 1.0), (0.5, 2.0))


def free_body(axes="xyz", points=("pad 1", "ring 1", "ring 2"), seed=0):
    """Return springs and a full mass matrix between points; a translation strains nothing."""
    random = np.random.default_rng(seed)
    names = tuple(f"{point} {axis}" for point in points for axis in axes)
    size, each = len(names), len(axes)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for one in range(len(points)):
        for other in range(one):
            stretch = np.zeros((each, size))
            stretch[:, each * one : each * one + each] = random.normal(size=(each, each))
            stretch[:, each * other : each * other + each] = -stretch[
                :, each * one : each * one + each
            ]
            stiffness += 1e3 * stretch.T @ stretch
    factor = random.normal(size=(size, size))
    mass += 1e-4 * factor @ factor.T + 1e-4 * np.eye(size)
    none = np.zeros(0)
    return ReducedModel(
        np.arange(size), stiffness, mass, np.zeros((size, 0)), np.zeros((size, 0)), none, names
    )


def test_the_mass_of_what_holds_a_body_counts():
    """Points that move with the ground, in absolute coordinates, agree with -M r x_g''."""
    lower, upper = free_body(seed=1), free_body(seed=2)
    moved = translation_of(lower, "x")
    held = np.array([name.startswith("ring") for name in lower.names])
    angular = 700.0
    dynamic = lower.stiffness - angular**2 * lower.mass
    absolute = np.linalg.solve(
        dynamic[np.ix_(~held, ~held)], -dynamic[np.ix_(~held, held)] @ moved[held]
    )
    inertia = ground_inertia(lower, upper, (0.02, 0.001), "x")
    relative = np.linalg.solve(dynamic[np.ix_(~held, ~held)], angular**2 * inertia[:3])
    np.testing.assert_allclose(moved[~held] + relative, absolute, rtol=1e-9)
    # The upper specimen stands on m2 and moves along x as a whole; m1 is the last displacement.
    assert inertia[-1] == 0.02
    upper_moved = translation_of(upper, "x")
    whole = upper_moved @ upper.mass @ upper_moved
    assert inertia[3] + inertia[6] == pytest.approx(whole + 0.001)


def test_a_body_that_is_held_inside_does_not_move_with_the_ground():
    body = free_body()
    held = ReducedModel(**(vars(body) | {"stiffness": body.stiffness + 100.0 * np.eye(9)}))
    with pytest.raises(RigError, match="held inside"):
        translation_of(held, "x")
