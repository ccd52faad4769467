"""Iwan joints against closed forms, Jenkins sliders and Masing's memory."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.wear.joints.friction_paths import lead_along_one
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.masing import MasingLaw

STIFFNESS, FRICTION, LOAD, RESIDUAL = 100e3, 0.3, 700.0, 2e3
LIMIT = FRICTION * LOAD
COMMON = (STIFFNESS, FRICTION, LOAD, RESIDUAL)
UNIFORM = UniformIwan(*COMMON)
REACH = 2.0 * LIMIT / STIFFNESS
FOUR = FourParameterIwan(*COMMON, chi=-0.5, beta=0.4)
FOUR_REACH = LIMIT * 1.4 / (STIFFNESS * (0.4 + 0.5 / 1.5))
LAWS = {"uniform": UNIFORM, "four parameters": FOUR}
RNG_SEED = 7


@dataclass(frozen=True)
class MasingJenkins(MasingLaw):
    """Jenkins element as a joint without distributed sliders."""

    @property
    def spread(self):
        return 0.0, 2.0


def force_at(law, displacement):
    return lead_along_one(law, displacement).force[-1, 0, 0]


@pytest.mark.parametrize("share", [0.2, 1.0, 1.7, 3.0])
def test_curve_of_first_loading(share):
    d = share * REACH
    if share < 1.0:
        exact = (STIFFNESS + RESIDUAL) * d - (STIFFNESS * d) ** 2 / (4.0 * LIMIT)
    else:
        exact = LIMIT + RESIDUAL * d
    assert force_at(UNIFORM, [d]) == pytest.approx(exact, rel=1e-13)
    assert force_at(UNIFORM, [-d]) == pytest.approx(-exact, rel=1e-13)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_loop_follows_masing(law):
    amplitude = 0.8 * REACH
    for d in np.linspace(-1.0, 1.0, 9) * amplitude:
        down = force_at(law, [amplitude, d])
        rising = force_at(law, [amplitude, -amplitude, d])
        top = force_at(law, [amplitude])
        assert down == pytest.approx(top - 2.0 * force_at(law, [(amplitude - d) / 2]), abs=1e-10)
        assert rising == pytest.approx(-top + 2.0 * force_at(law, [(amplitude + d) / 2]), abs=1e-10)


@pytest.mark.parametrize("share", [0.1, 0.7, 1.0, 1.6, 20.0])
def test_energy_of_the_uniform_loop(share):
    amplitude = share * REACH
    if share <= 1.0:
        exact = 2.0 * STIFFNESS * amplitude**3 / (3.0 * REACH)
    else:
        exact = 4.0 * LIMIT * (amplitude - 2.0 * REACH / 3.0)
    lost = lead_along_one(UNIFORM, [amplitude, -amplitude, amplitude]).dissipated
    assert lost[1:].sum() == pytest.approx(exact, rel=1e-12)
    # First loading dissipates a quarter of a loop.
    assert lost[0, 0] == pytest.approx(exact / 4.0, rel=1e-12)
    assert UNIFORM.loop_energy(amplitude) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize(("chi", "beta"), [(-0.8, 0.0), (-0.5, 0.4), (-0.2, 5.0), (0.0, 0.0)])
def test_four_parameters_are_segalmans(chi, beta):
    law = replace(FOUR, chi=chi, beta=beta, residual_stiffness=0.0)
    reach = LIMIT * (1.0 + beta) / (STIFFNESS * (beta + (chi + 1.0) / (chi + 2.0)))
    # Slope when all stick; small loops lose by the power chi + 3; full slip at the limit, before
    # which the slope is that of the sliders that slip together.
    tiny, just = 1e-12 * reach, 1e-9
    assert law.respond(law.rest(1), np.zeros((1, 1))).tangent == pytest.approx(STIFFNESS)
    small = law.loop_energy(np.array([1e-4, 2e-4]) * reach)
    assert np.log2(small[1] / small[0]) == pytest.approx(chi + 3.0, rel=1e-10)
    before = law.respond(law.rest(1), np.full((1, 1), reach * (1.0 - just)))
    after = law.respond(law.rest(1), np.full((1, 1), reach * (1.0 + just) + tiny))
    assert after.force[0, 0] == pytest.approx(LIMIT, rel=1e-14)
    assert after.tangent[0, 0, 0] == 0.0
    assert before.force[0, 0] == pytest.approx(LIMIT, rel=2 * just)
    assert before.tangent[0, 0, 0] == pytest.approx(
        STIFFNESS * beta / (1.0 + beta), rel=1e-6, abs=1e-3
    )


def test_four_parameters_hold_the_uniform_joint():
    path = np.random.default_rng(RNG_SEED).uniform(-2.0, 2.0, 60) * REACH
    uniform = lead_along_one(UNIFORM, path)
    same = lead_along_one(FourParameterIwan(*COMMON, chi=0.0, beta=0.0), path)
    np.testing.assert_allclose(same.force, uniform.force, atol=1e-12 * LIMIT)
    np.testing.assert_allclose(same.dissipated, uniform.dissipated, atol=1e-12 * LIMIT * REACH)


def test_jenkins_as_a_masing_law():
    path = np.random.default_rng(RNG_SEED).uniform(-1.5, 1.5, 400) * LIMIT / STIFFNESS
    masing, direct = (
        lead_along_one(MasingJenkins(*COMMON), path),
        lead_along_one(Jenkins(*COMMON), path),
    )
    scale = LIMIT**2 / STIFFNESS
    np.testing.assert_allclose(masing.force, direct.force, atol=1e-11 * LIMIT)
    np.testing.assert_allclose(masing.dissipated, direct.dissipated, atol=1e-11 * scale)


def sliders(law, number):
    """Return Jenkins elements of equal stiffness whose limits are distributed as the law's."""
    middles = (np.arange(number) + 0.5) / number
    if isinstance(law, UniformIwan):
        return np.full(number, STIFFNESS / number), middles * REACH
    spread = np.full(number, STIFFNESS / (1.0 + law.beta) / number)
    together = law.beta * STIFFNESS / (1.0 + law.beta)
    reaches = middles ** (1.0 / (law.chi + 1.0)) * FOUR_REACH
    return np.append(spread, together), np.append(reaches, FOUR_REACH)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_many_sliders_approach_the_law_at_second_order(law):
    path = np.random.default_rng(RNG_SEED).uniform(-1.2, 1.2, 60) * REACH
    by_law = lead_along_one(law, path)
    errors = []
    for number in (250, 2000):
        stiffness, reach = sliders(law, number)
        bank = Jenkins(stiffness, 1.0, stiffness * reach)
        n = len(stiffness)
        history = march_joints(
            bank, bank.rest(n), np.zeros((n, 1)), np.tile(path[:, None, None], (1, n, 1))
        )
        force = history.force.sum(axis=1)[:, 0] + RESIDUAL * path
        lost = history.dissipated.sum(axis=1)
        errors.append(
            (
                np.abs(force - by_law.force[:, 0, 0]).max() / LIMIT,
                np.abs(lost - by_law.dissipated[:, 0]).max() / (LIMIT * REACH),
            )
        )
    assert max(errors[1]) < 1e-5
    # Eightfold refinement: 64 at second order; where sliders happen to lie leaves a factor of 2.
    ratios = np.divide(errors[0], errors[1])
    assert np.all(ratios > 32.0)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_closed_loops_are_forgotten(law):
    a = REACH * np.array([0.9, -0.6, 0.5, -0.2, 0.3, 0.0])
    # Go through the nested loops and out of all of them again, past the first turning point.
    inner = lead_along_one(law, [*a, a[4], a[2], a[0], 1.1 * REACH])
    outer = lead_along_one(law, [1.1 * REACH])
    np.testing.assert_allclose(inner.force[-1], outer.force[-1], rtol=1e-13)
    np.testing.assert_allclose(inner.force[6:9, 0, 0], inner.force[[4, 2, 0], 0, 0], rtol=1e-13)
    after = lead_along_one(law, [0.2 * REACH], inner.state, 1.1 * REACH)
    plain = lead_along_one(law, [0.2 * REACH], outer.state, 1.1 * REACH)
    np.testing.assert_allclose(after.force, plain.force, rtol=1e-13)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_ring_down_is_remembered_to_the_last_turning_point(law):
    turns = 0.7 * REACH * (-1.0) ** np.arange(3001) * np.linspace(1.0, 0.001, 3001)
    down = lead_along_one(law, turns)
    assert down.state.shape[1] < 2 * (2 * 3001 + 10)
    # Out again through every turning point but the innermost, where it is.
    out = lead_along_one(law, turns[-2::-1], down.state, turns[-1])
    np.testing.assert_allclose(out.force, down.force[-2::-1], rtol=1e-12, atol=1e-12 * LIMIT)
    closed = lead_along_one(law, [0.71 * REACH], out.state, turns[0])
    assert closed.force[-1, 0, 0] == pytest.approx(force_at(law, [0.71 * REACH]), rel=1e-13)
    settled = lead_along_one(law, np.tile([-REACH, REACH], 10), closed.state, 0.71 * REACH)
    assert settled.state.shape[1] < 100


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_new_parameters_find_the_turning_points_where_they_were(law):
    path = np.random.default_rng(RNG_SEED).uniform(-0.9, 0.9, 30) * REACH
    worn = replace(law, stiffness=1.3 * STIFFNESS, normal_load=0.6 * LOAD)
    changed = worn.respond(lead_along_one(law, path).state, np.zeros((1, 1)))
    always = lead_along_one(worn, path)
    np.testing.assert_allclose(changed.force, always.force[-1], rtol=1e-12)
    next_path = np.random.default_rng(RNG_SEED + 1).uniform(-2.0, 2.0, 30) * REACH
    ahead = lead_along_one(worn, next_path, changed.state, path[-1])
    expected = lead_along_one(worn, next_path, always.state, path[-1])
    np.testing.assert_allclose(ahead.force, expected.force, rtol=1e-12)
    np.testing.assert_allclose(ahead.dissipated, expected.dissipated, atol=1e-12 * LIMIT * REACH)
