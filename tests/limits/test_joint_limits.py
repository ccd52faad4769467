"""Tests of joints at rest, over very large steps, and without preload."""

from dataclasses import replace

import numpy as np
import pytest

from tests.wear.joints.friction_paths import lead_along_one
from wear.joints.bouc_wen import BoucWen
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins

LIMIT, RESIDUAL = 30.0, 900.0
COMMON = (40e3, 0.5, 60.0, RESIDUAL)
REACH = LIMIT / 40e3
LAWS = {
    "jenkins": Jenkins(*COMMON),
    "uniform iwan": UniformIwan(*COMMON),
    "four parameters": FourParameterIwan(*COMMON, chi=-0.4, beta=0.7),
    "bouc-wen": BoucWen(*COMMON),
    "bouc-wen, general": BoucWen(*COMMON, sigma=0.7, exponent=2.5),
}
EVERY = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
RNG_SEED = 11


@EVERY
def test_fully_stuck_start(law):
    """From rest every law is its spring in any direction, and dissipates nothing."""
    whole = law.stiffness + (0.0 if isinstance(law, BoucWen) else RESIDUAL)
    still = law.respond(law.rest(1), np.zeros((1, 1)))
    assert still.tangent[0, 0, 0] == whole
    assert still.force[0, 0] == still.dissipated[0] == 0.0
    for increment in (1e-9 * REACH, -1e-9 * REACH):
        response = law.respond(law.rest(1), np.full((1, 1), increment))
        # The power law of the spread, chi + 1 = 0.6, is felt even here.
        assert response.force[0, 0] == pytest.approx(whole * increment, rel=1e-5)
        assert response.tangent[0, 0, 0] == pytest.approx(whole, rel=1e-5)
        assert 0.0 <= response.dissipated[0] < 1e-5 * LIMIT * abs(increment)


@EVERY
def test_a_step_far_too_large_is_right(law):
    """One increment spans a thousand reaches, from a history of nested loops, and back."""
    path = REACH * np.random.default_rng(RNG_SEED).uniform(-1.0, 1.0, 50)
    state, start = lead_along_one(law, path).state, path[-1]
    far = 1000.0 * REACH
    for end in (far, -far):
        once = lead_along_one(law, [end], state, start)
        many = lead_along_one(law, np.linspace(start, end, 20001)[1:], state, start)
        assert once.force[-1, 0, 0] == pytest.approx(np.sign(end) * (LIMIT + RESIDUAL * far))
        np.testing.assert_allclose(once.force[-1], many.force[-1], rtol=1e-11)
        assert once.dissipated.sum() == pytest.approx(many.dissipated.sum(), rel=1e-9)
    there_and_back = lead_along_one(law, [far, -far, far])
    assert there_and_back.dissipated[1:].sum() == pytest.approx(
        float(law.loop_energy(far)), rel=1e-9
    )


@EVERY
def test_a_step_beyond_all_measure_stays_finite(law):
    for size in (1e30, 1e-300):
        response = law.respond(law.rest(1), np.full((1, 1), size))
        assert np.all(np.isfinite(response.force))
        assert np.all(np.isfinite(response.dissipated))


@EVERY
@pytest.mark.parametrize("load", [0.0, 1e-300])
def test_preload_worn_to_nothing(law, load):
    """Only the residual slope remains in any state; the spring's energy is lost at most once."""
    worn = replace(law, normal_load=load)
    path = REACH * np.random.default_rng(RNG_SEED).uniform(-3.0, 3.0, 30)
    for state, start in ((law.rest(1), 0.0), (lead_along_one(law, path).state, path[-1])):
        history = lead_along_one(worn, path, state, start)
        np.testing.assert_allclose(history.force[:, 0, 0], RESIDUAL * path, atol=1e-12)
        assert np.all(history.dissipated[1:] < 1e-12)
        assert 0.0 <= history.dissipated[0, 0] <= 0.5 * LIMIT * REACH * (1.0 + 1e-12)
        still = worn.respond(history.state, np.zeros((1, 1)))
        assert np.all(np.isfinite(still.force))
        # Displacement, and a finite memory: a load that returns finds a joint that works.
        back = lead_along_one(law, path, history.state, path[-1])
        assert np.all(np.abs(back.force[:, 0, 0] - RESIDUAL * path) <= LIMIT * (1.0 + 1e-12))
        assert np.all(back.dissipated >= 0.0)
    assert worn.loop_energy(REACH) < 1e-12


@EVERY
def test_no_preload_has_the_residual_tangent(law):
    worn = replace(law, normal_load=0.0)
    for increment in (0.0, REACH, -1e-12 * REACH):
        response = worn.respond(worn.rest(1), np.full((1, 1), increment))
        assert response.tangent[0, 0, 0] == RESIDUAL


@EVERY
def test_frictionless_from_the_start_and_without_residual_slope(law):
    free = replace(law, friction=0.0, residual_stiffness=0.0)
    history = lead_along_one(free, REACH * np.array([1.0, -2.0, 0.5]))
    np.testing.assert_array_equal(history.force, 0.0)
    np.testing.assert_array_equal(history.dissipated, 0.0)
