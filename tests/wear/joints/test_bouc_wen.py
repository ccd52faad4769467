"""Bouc-Wen joint against closed forms and an independent integration, and limits of its memory."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.wear.joints.friction_paths import lead_along_one
from wear.joints.bouc_wen import BoucWen
from wear.joints.bouc_wen_curve import TabulatedBoucWen, bouc_wen_curve
from wear.joints.iwan import UniformIwan
from wear.joints.parameters import JointError

LAW = BoucWen(stiffness=40e3, friction=0.5, normal_load=60.0, residual_stiffness=900.0)
LIMIT, SPRING = 30.0, 40e3 - 900.0
REACH = LIMIT / SPRING
SHAPES = [
    (0.5, 1.0),
    (0.5, 2.0),
    (0.5, 3.0),
    (0.8, 1.0),
    (1.0, 2.0),
    (0.7, 1.2),
    (0.7, 1.5),
    (0.6, 6.0),
]


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_loading_branch(exponent):
    law = replace(LAW, exponent=exponent)
    s = np.array([1e-3, 0.1, 1.0, 4.0, 30.0])
    history = lead_along_one(law, s * REACH)
    xi = np.tanh(s) if exponent == 2.0 else 1.0 - np.exp(-s)
    np.testing.assert_allclose(history.force[:, 0, 0], LIMIT * xi + 900.0 * s * REACH, rtol=1e-13)
    np.testing.assert_allclose(history.state[0], [30.0 * REACH, xi[-1]], rtol=1e-14)


@pytest.mark.parametrize("exponent", [1.0, 2.0, 3.3])
def test_unloading_branch_is_straight_until_no_force(exponent):
    law = replace(LAW, exponent=exponent)
    loaded = law.respond(law.rest(1), np.full((1, 1), 1.2 * REACH))
    xi = loaded.state[0, 1]
    for share in (0.1, 0.5, 0.999, 1.0):
        back = np.full((1, 1), -share * xi * REACH)
        response = law.respond(loaded.state, back)
        exact = loaded.force + 40e3 * back
        np.testing.assert_allclose(response.force, exact, atol=1e-12 * LIMIT)
        assert response.tangent[0, 0, 0] == pytest.approx(40e3, rel=1e-12)
        assert response.dissipated[0] == 0.0
    # Beyond that it loads in the other direction, for n = 2 as tanh.
    if exponent == 2.0:
        beyond = law.respond(loaded.state, np.full((1, 1), -(xi + 0.7) * REACH))
        assert beyond.state[0, 1] == pytest.approx(-np.tanh(0.7), rel=1e-12)


@pytest.mark.parametrize("kind", [BoucWen, TabulatedBoucWen])
@pytest.mark.parametrize(("sigma", "exponent"), SHAPES)
def test_any_shape_against_an_independent_integration(sigma, exponent, kind):
    law = kind(40e3, 0.5, 60.0, 900.0, sigma=sigma, exponent=exponent)
    path = np.array([0.6, -0.3, 1.7, 1.2, 1.6, -2.5, 0.4]) * REACH
    history = lead_along_one(law, path)
    xi, work, start = 0.0, 0.0, 0.0
    for end, force, lost in zip(path, history.force, history.dissipated, strict=True):
        sign = np.sign(end - start)

        def rate(_, y, sign=sign):
            eta = sign * y[0]
            power = abs(eta) ** exponent
            gone = power if eta > 0.0 else (1.0 - 2.0 * sigma) * power
            return [sign * (1.0 - gone), eta * gone]

        def zero(_, y):
            return y[0]

        # The integration is restarted at ξ = 0, where the rate has a corner.
        zero.terminal = True
        y, s, rest = [xi, 0.0], 0.0, abs(end - start) / REACH
        while s < rest:
            part = solve_ivp(
                rate, (s, rest), y, method="DOP853", rtol=1e-13, atol=1e-14, events=zero
            )
            s = part.t[-1]
            y = part.y[:, -1]
            if part.status == 1:
                y[0] = sign * 1e-16
        xi, work, start = y[0], y[1], end
        assert force[0, 0] == pytest.approx(LIMIT * xi + 900.0 * end, abs=1e-8 * LIMIT)
        assert lost[0] == pytest.approx(LIMIT * REACH * work, abs=1e-8 * LIMIT * REACH)


@pytest.mark.parametrize("share", [0.01, 0.3, 1.0, 3.0, 40.0])
def test_energy_of_the_settled_loop(share):
    """At its ends ξ + artanh ξ = 2 K A/µN, and the energy is -(µN)²/K (ξ² + ln(1 - ξ²))."""
    # With y = artanh ξ, 1 - ξ² = 1/cosh² y keeps its digits in full sliding.
    y = brentq(lambda y: y + np.tanh(y) - 2.0 * share, 0.0, 2.0 * share, xtol=1e-15, rtol=1e-14)
    log = -2.0 * (y + np.log1p(np.exp(-2.0 * y)) - np.log(2.0))
    exact = -LIMIT * REACH * (np.tanh(y) ** 2 + log)
    scale = LIMIT * REACH
    assert LAW.loop_energy(share * REACH) == pytest.approx(exact, rel=1e-10, abs=1e-14 * scale)
    # March until the loop has closed: a small loop takes many cycles.
    history = lead_along_one(LAW, np.tile([share, -share], 3000) * REACH)
    assert history.dissipated[-2:].sum() == pytest.approx(exact, rel=1e-4, abs=1e-14 * scale)


@pytest.mark.parametrize(("sigma", "exponent"), SHAPES)
def test_loop_energy_is_that_of_a_marched_loop(sigma, exponent):
    law = replace(LAW, sigma=sigma, exponent=exponent)
    history = lead_along_one(law, np.tile([1.5, -1.5], 40) * REACH)
    assert law.loop_energy(1.5 * REACH) == pytest.approx(
        history.dissipated[-2:].sum(), rel=1e-8, abs=1e-8 * LIMIT * REACH
    )


@pytest.mark.parametrize(("energy", "lost"), [(1000.0, 1.30), (2800.0, 1.34)])
def test_worn_loop_of_the_friction_rig(energy, lost):
    """Fantetti 2019, test 1 at ± 7 µm, gives the energy per cycle [mJ] after ``energy`` J.

    The paper prints two digits.
    """
    worn = BoucWen(
        stiffness=27.3e3 * (1.0 + 1.32 * np.exp(-150.0 / energy)),
        friction=0.11 * (1.0 + 0.26 * np.log(1.3e9 * energy + 1.0)),
        normal_load=60.0,
        residual_stiffness=0.88e3 * (1.0 + 0.24 * energy / 1000.0),
    )
    assert round(float(worn.loop_energy(7e-3)), 2) == lost


def test_small_loops_under_a_force_do_not_close():
    """Each ripple of s lowers ξ by s ξ², so that 1/ξ grows by s: this is a limit of the law.

    A small ripple back and forth is -s and then ∫(1 - ξ²) ds, so that ∫ ξ² ds is lost. An Iwan
    joint returns to where it was.
    """
    drifts = []
    for s in (0.02, 0.01):
        loaded = lead_along_one(LAW, [0.8 * REACH])
        ripple = 0.8 * REACH + np.tile([-s * REACH, 0.0], 50)
        rippled = lead_along_one(LAW, ripple, loaded.state, 0.8 * REACH)
        growth = 1.0 / rippled.state[0, 1] - 1.0 / loaded.state[0, 1]
        drifts.append(growth / (50 * s))
        assert rippled.force[-1, 0, 0] < loaded.force[-1, 0, 0] - 0.1 * LIMIT
    errors = np.abs(np.array(drifts) - 1.0)
    # The error is of first order in the size of the ripple.
    assert errors[0] < 0.05
    assert errors[1] == pytest.approx(errors[0] / 2.0, rel=0.2)
    iwan = UniformIwan(40e3, 0.5, 60.0, 900.0)
    loaded = lead_along_one(iwan, [0.8 * REACH])
    rippled = lead_along_one(
        iwan, 0.8 * REACH + np.tile([-0.02 * REACH, 0.0], 50), loaded.state, 0.8 * REACH
    )
    assert rippled.force[-1] == pytest.approx(loaded.force[-1], rel=1e-13)


def test_force_follows_new_parameters_at_the_same_xi():
    loaded = lead_along_one(LAW, [0.8 * REACH])
    worn = replace(LAW, friction=0.2)
    response = worn.respond(loaded.state, np.zeros((1, 1)))
    assert response.force[0, 0] == pytest.approx(0.2 * 60.0 * np.tanh(0.8) + 900.0 * 0.8 * REACH)


# What the fourth-order rule of both leaves in ξ and the loss, 2e-9 each.
RULE = 4e-9
MANY = 500


def joints(kind, sigma, exponent):
    """Many joints of one shape, with all that a kernel has to tell apart among them."""
    rng = np.random.default_rng(5)
    stiffness, load = 10.0 ** rng.uniform(3.0, 6.0, MANY), 10.0 ** rng.uniform(0.0, 3.0, MANY)
    load[:20] = 0.0
    law = kind(stiffness, 0.5, load, 0.1 * stiffness, sigma=sigma, exponent=exponent)
    state = np.stack([rng.uniform(-1e-3, 1e-3, MANY), rng.uniform(-1.0, 1.0, MANY)], axis=1)
    state[20:40, 1], state[40:60, 1], state[60:80, 1] = 0.0, 1.0, -1.0
    reach = law.limit / (0.9 * stiffness)
    moved = rng.choice([-1.0, 1.0], MANY) * 10.0 ** rng.uniform(-9.0, 2.0, MANY) * reach
    moved[:10] = 1e-3
    moved[15:100:5] = 0.0
    return law, state, moved[:, None]


@pytest.mark.parametrize(("sigma", "exponent"), [*SHAPES, (0.5, 1.01), (1.0, 40.0)])
def test_pieces_of_the_curve_are_joints_that_are_marched_alone(sigma, exponent):
    law, state, moved = joints(BoucWen, sigma, exponent)
    alone = law.respond(state, moved)
    at_once = joints(TabulatedBoucWen, sigma, exponent)[0].respond(state, moved)
    limit, spring = law.limit, 0.9 * law.stiffness
    np.testing.assert_allclose(at_once.state[:, 1], alone.state[:, 1], atol=RULE)
    assert np.all(
        np.abs(at_once.force - alone.force)[:, 0] <= RULE * (limit + np.abs(alone.force[:, 0]))
    )
    # The rate is 1 - |ξ|^n, with the slope n.
    off = np.abs(at_once.tangent - alone.tangent)[:, 0, 0]
    assert np.all(off <= exponent * RULE * spring)
    # The loss of a way far into sliding is as long as that.
    lost = (1.0 + spring * np.abs(moved[:, 0]) / np.maximum(limit, 1e-300)) * limit**2 / spring
    assert np.all(np.abs(at_once.dissipated - alone.dissipated) <= RULE * lost)
    assert np.all(at_once.dissipated >= 0.0)


@pytest.mark.parametrize(("sigma", "exponent"), SHAPES)
def test_a_piece_of_the_curve_is_its_parts(sigma, exponent):
    """To rounding, wherever it is divided; of joints marched alone, to the error of the rule."""
    law = TabulatedBoucWen(40e3, 0.5, 60.0, 900.0, sigma=sigma, exponent=exponent)
    state = np.stack([np.zeros(MANY), np.linspace(-1.0, 1.0, MANY)], axis=1)
    whole = law.respond(state, np.full((MANY, 1), 2.0 * REACH))
    divided = state
    for share in (0.013, 0.4, 0.587):
        divided = law.respond(divided, np.full((MANY, 1), share * 2.0 * REACH)).state
    np.testing.assert_allclose(divided[:, 1], whole.state[:, 1], rtol=0.0, atol=1e-13)


def test_a_curve_is_that_of_its_shape_alone():
    """Many joints of other limits and ways take no more steps than one."""
    bouc_wen_curve.cache_clear()
    for kind in range(3):
        law, state, moved = joints(TabulatedBoucWen, 0.7, 2.5)
        law.respond(state, (kind + 1) * moved)
        replace(law, friction=0.1 * (kind + 1)).respond(state, moved)
    assert bouc_wen_curve.cache_info().misses == 1


def test_a_curve_needs_one_shape():
    with pytest.raises(JointError, match="exponent"):
        TabulatedBoucWen(40e3, 0.5, 60.0, exponent=np.array([1.5, 2.5]))
