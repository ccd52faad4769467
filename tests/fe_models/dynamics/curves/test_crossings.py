"""All motions of a branch at one frequency, against the roots of Duffing's cubic equation."""

import numpy as np
import pytest

from fe_models.dynamics.curves.crossings import motions_at
from fe_models.dynamics.curves.followed_curve import Chord
from fe_models.dynamics.curves.forced_response import along_frequency
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from tests.oracles.cubic_springs import CubicSprings

MASS, STIFFNESS, RATIO, CUBIC, FORCE = 1e-3, 1e3, 0.02, 2e4, 10.0
DAMPING = 2.0 * RATIO * np.sqrt(MASS * STIFFNESS)


def amplitudes(frequency):
    """Return the roots A of A² ((k - m ω² + 3/4 k3 A²)² + (c ω)²) = F², for one harmonic."""
    angular = 2.0 * np.pi * frequency
    linear, cubic = STIFFNESS - MASS * angular**2, 0.75 * CUBIC
    resisting = linear**2 + (DAMPING * angular) ** 2
    roots = np.roots([cubic**2, 2.0 * linear * cubic, resisting, -(FORCE**2)])
    real = roots[(np.abs(roots.imag) < 1e-7 * np.abs(roots)) & (roots.real > 0.0)]
    return np.sort(np.sqrt(real.real))


def fold(inside, outside):
    """Return the frequency [Hz] at which two of three motions vanish, by bisection."""
    while abs(outside - inside) > 1e-9:
        middle = 0.5 * (inside + outside)
        if len(amplitudes(middle)) == 3:
            inside = middle
        else:
            outside = middle
    return inside


@pytest.fixture(scope="module")
def branch():
    rig = lumped_rig({"m": MASS}, {Link("m"): STIFFNESS}, [[Link("m")]], damping_ratio=RATIO)
    load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    problem = HarmonicBalance(rig, CubicSprings(CUBIC), load, Resolution((1,), 64))
    found = along_frequency(problem, FORCE, (100.0, 400.0))
    assert len(found.curve.folds) == 2
    return found


def sizes(branch, frequency):
    motions = motions_at(branch, frequency)
    assert all(motion.converged and motion.frequency == frequency for motion in motions)
    assert all(motion.residual < 1e-10 for motion in motions)
    return np.array([abs(motion.amplitude(0)) for motion in motions])


@pytest.mark.parametrize("frequency", [100.0, 130.0, 187.87, 199.0, 230.0, 400.0])
def test_every_coexisting_motion_is_found(branch, frequency):
    wanted = amplitudes(frequency)
    np.testing.assert_allclose(np.sort(sizes(branch, frequency)), wanted, rtol=1e-9)
    assert len(wanted) == (3 if 176.0 < frequency < 200.0 else 1)


def test_motions_are_in_the_order_of_the_curve(branch):
    upper, middle, lower = sizes(branch, 190.0)
    assert upper > middle > lower


def test_folds_between_points_are_not_missed(branch):
    """The frequency lies between the farthest point of the curve and its fold."""
    place = branch.curve.folds[0]
    farthest = branch.frequencies[place : place + 2].max()
    highest = fold(farthest, farthest + 1.0)
    assert highest > farthest + 0.1
    for frequency in (farthest, 0.5 * (farthest + highest), highest - 1e-5):
        wanted = amplitudes(frequency)
        assert len(wanted) == 3
        np.testing.assert_allclose(np.sort(sizes(branch, frequency)), wanted, rtol=1e-6)
    assert len(sizes(branch, highest + 1e-5)) == 1


def test_planes_across_the_chord_find_what_newton_misses(branch, monkeypatch):
    """All direct results of Newton's method are rejected: planes across the chord are used."""
    monkeypatch.setattr(Chord, "contains", lambda self, coordinates: False)
    np.testing.assert_allclose(np.sort(sizes(branch, 190.0)), amplitudes(190.0), rtol=1e-9)


def test_no_motion_where_the_curve_does_not_reach(branch):
    assert motions_at(branch, 401.0) == ()
    assert motions_at(branch, 99.0) == ()
