"""Jenkins element against its closed forms."""

from dataclasses import replace

import numpy as np
import pytest

from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints

LAW = Jenkins(stiffness=40e3, friction=0.5, normal_load=60.0, residual_stiffness=900.0)
REACH = 0.5 * 60.0 / 40e3
AMPLITUDES = np.array([0.3, 1.0, 1.5, 10.0]) * REACH


def cycle(amplitude):
    return np.array([amplitude, -amplitude, amplitude])[:, None, None]


@pytest.mark.parametrize("amplitude", AMPLITUDES)
def test_energy_of_a_loop(amplitude):
    exact = max(4.0 * 30.0 * (amplitude - REACH), 0.0)
    history = march_joints(LAW, LAW.rest(1), np.zeros((1, 1)), cycle(amplitude))
    assert history.dissipated[1:].sum() == pytest.approx(exact, rel=1e-12)
    assert LAW.loop_energy(amplitude) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("amplitude", AMPLITUDES)
def test_first_harmonic_is_that_of_the_loop(amplitude):
    # From A to -A the force is A kr cos θ + µN - kt A (1 - cos θ), not below -µN; kinks between
    # the stretches over which Gauss's rule is spectrally exact.
    points, weights = np.polynomial.legendre.leggauss(30)
    switch = np.arccos(max(1.0 - 2.0 * REACH / amplitude, -1.0))
    state = march_joints(LAW, LAW.rest(1), np.zeros((1, 1)), cycle(amplitude)).state
    cosine = sine = 0.0
    for begin, end in ((0.0, switch), (switch, np.pi)):
        angles = begin + 0.5 * (end - begin) * (1.0 + points)
        for angle, weight in zip(angles, 0.5 * (end - begin) * weights, strict=True):
            increment = np.full((1, 1), amplitude * (np.cos(angle) - 1.0))
            force = LAW.respond(state, increment).force[0, 0]
            cosine += 2.0 / np.pi * weight * force * np.cos(angle)
            sine += 2.0 / np.pi * weight * force * np.sin(angle)
    expected = LAW.first_harmonic(amplitude)
    assert cosine == pytest.approx(expected[0], rel=1e-8)
    assert sine == pytest.approx(expected[1], rel=1e-8, abs=1e-10)


def test_first_harmonic_of_no_motion_and_of_many_amplitudes():
    cosine, sine = LAW.first_harmonic(np.array([0.0, 0.5 * REACH, 1e4 * REACH]))
    np.testing.assert_allclose(cosine[:2], [0.0, 0.5 * REACH * 40.9e3], rtol=1e-14)
    np.testing.assert_allclose(sine, [0.0, 0.0, -4.0 * 30.0 / np.pi * (1 - 1e-4)], rtol=1e-12)


def test_a_smaller_limit_lets_the_slider_slip_and_frees_its_energy():
    stuck = LAW.respond(LAW.rest(1), np.full((1, 1), 0.8 * REACH))
    worn = replace(LAW, normal_load=30.0)
    response = worn.respond(stuck.state, np.zeros((1, 1)))
    assert response.force[0, 0] == pytest.approx(15.0 + 900.0 * 0.8 * REACH)
    freed = 0.5 * 40e3 * REACH**2 * (0.8**2 - 0.5**2)
    assert response.dissipated[0] == pytest.approx(freed, rel=1e-12)
    # The slider stays where it slipped to when the limit returns.
    again = LAW.respond(response.state, np.zeros((1, 1)))
    assert again.force[0, 0] == pytest.approx(response.force[0, 0])
    assert again.dissipated[0] == 0.0


def test_stiffer_spring_pulls_more_at_the_same_stretch():
    stuck = LAW.respond(LAW.rest(1), np.full((1, 1), 0.4 * REACH))
    response = replace(LAW, stiffness=80e3).respond(stuck.state, np.zeros((1, 1)))
    assert response.force[0, 0] == pytest.approx((80e3 + 900.0) * 0.4 * REACH)
