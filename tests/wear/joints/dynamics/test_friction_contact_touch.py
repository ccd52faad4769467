"""A friction contact that lifts off and touches again, and its limits."""

from __future__ import annotations

import numpy as np
import pytest

from tests.wear.joints.friction_paths import (
    KN,
    KT,
    LAW,
    LIFT,
    LOAD,
    MU,
    REACH,
    derivative,
    lead,
    one,
    random_path,
)
from wear.joints.friction_contact import FrictionContact


def test_a_gap_closes_before_anything_is_felt():
    gap = 0.02
    law = FrictionContact(KT, KN, MU, gap=gap)
    force, state, lost, tangent = one(law, law.rest(1), [0.3, -0.2, 0.9 * gap])
    assert not force.any()
    assert not tangent.any()
    assert lost == 0.0
    # From a gap of 0.1 to a pressing of 0.2: two thirds of the path count.
    pressing = 0.2 * gap
    small = 0.9 * MU * KN * pressing / KT / (2.0 / 3.0)
    force, end, lost, _ = one(law, state, [small, 0.0, 0.1 * gap + pressing])
    np.testing.assert_allclose(force, [KT * small * 2.0 / 3.0, 0.0, KN * pressing], rtol=1e-12)
    assert lost == 0.0
    np.testing.assert_allclose(end, [small * 2.0 / 3.0, 0.0, gap + pressing], rtol=1e-12)
    # A longer way slips from the touch on, in the direction of the path.
    way = np.array([0.3, 0.4])
    force, _, lost, _ = one(law, state, [*way, 0.1 * gap + pressing])
    limit = MU * KN * pressing
    np.testing.assert_allclose(force[:2], limit * way / 0.5, rtol=1e-12)
    assert lost == pytest.approx(0.5 * limit * (0.5 * 2.0 / 3.0 - limit / KT), rel=1e-12)


def test_a_preload_is_a_gap_of_the_other_sign():
    path = random_path(11, 60)
    loaded = lead(LAW, path)
    gap = 2.0 * LIFT
    gapped = FrictionContact(KT, KN, MU, gap=gap)
    raised = np.array([0.0, 0.0, gap + LIFT])
    same = lead(gapped, path + raised, raised, raised)
    np.testing.assert_allclose(same.force, loaded.force, atol=1e-12)
    np.testing.assert_allclose(same.dissipated, loaded.dissipated, atol=1e-12)


def test_lift_off_forgets_the_slider_and_loses_what_the_spring_held():
    _, held, _, _ = one(LAW, LAW.rest(1), [0.5 * REACH, 0.0, 0.0])
    force, apart, lost, tangent = one(LAW, held, [0.0, 0.0, -2.0 * LIFT])
    assert not force.any()
    assert not tangent.any()
    assert not apart[:2].any()
    assert lost == pytest.approx(0.5 * KT * (0.5 * REACH) ** 2, rel=1e-12)
    force, _, _, _ = one(LAW, apart, [0.0, 0.0, 2.0 * LIFT])
    np.testing.assert_allclose(force, [0.0, 0.0, LOAD], atol=1e-14)


def test_the_force_is_continuous_where_contact_is_lost_and_found():
    state = np.array([0.3 * REACH, 0.4 * REACH, 0.0])
    for left in (1e-3, 1e-6, 1e-9, 0.0, -1e-9):
        force, _, lost, _ = one(LAW, state, [REACH, 0.2 * REACH, -LIFT * (1.0 - left)])
        assert np.hypot(*force[:2]) <= MU * LOAD * max(left, 0.0) * (1.0 + 1e-6) + 1e-15
        near = one(LAW, state, [REACH, 0.2 * REACH, -LIFT])[2]
        assert lost == pytest.approx(near, abs=3.0 * abs(left) * MU * LOAD * REACH + 1e-15)
    apart = np.array([0.0, 0.0, -2.0 * LIFT])
    for left in (1e-3, 1e-6, 1e-9, 0.0, -1e-9):
        force, _, _, _ = one(LAW, apart, [REACH, 0.2 * REACH, LIFT * (1.0 + left)])
        assert np.hypot(*force[:2]) <= MU * LOAD * max(left, 0.0) * (1.0 + 1e-6) + 1e-15


@pytest.mark.parametrize("left", [1e-9, 1e-12, 1e-15])
@pytest.mark.parametrize("pull", [0.0, 1e-15, 1e-9, 1e-3, 1.0, 1e4])
@pytest.mark.parametrize("held", [0.0, 1e-6, 1.0])
def test_a_limit_that_all_but_vanishes(left, pull, held):
    """The beginning of slip and the end of the path are then one rounding error apart."""
    state = [0.6 * held * REACH, 0.8 * held * REACH, 0.0]
    for way in ([1.0, 0.0], [-0.6, -0.8]):
        increment = np.array([*(pull * REACH * np.array(way)), -LIFT * (1.0 - left)])
        force, jacobian = derivative(LAW, state, increment)
        assert np.all(np.isfinite(jacobian))
        assert np.hypot(*force[:2]) <= MU * force[2] + 1e-15 * MU * LOAD
        lost = one(LAW, state, increment)[2]
        _, near, first, _ = one(LAW, state, 0.3 * increment)
        assert lost == pytest.approx(first + one(LAW, near, 0.7 * increment)[2], rel=1e-10)


def test_grazing():
    # The pressure vanishes at the very end of an increment, and comes back.
    _, state, _, _ = one(LAW, LAW.rest(1), [0.5 * REACH, 0.0, 0.0])
    force, state, _, tangent = one(LAW, state, [0.1 * REACH, 0.0, -LIFT])
    assert np.all(np.isfinite(tangent))
    np.testing.assert_allclose(force, 0.0, atol=1e-15)
    force, _, _, _ = one(LAW, state, [0.1 * REACH, 0.0, LIFT])
    np.testing.assert_allclose(force, [0.1 * KT * REACH, 0.0, LOAD], atol=1e-14)
    # Along the circle: the limit grows exactly as fast as the spring is pulled.
    start = np.array([REACH, 0.0, 0.0])
    pull = 0.7 * REACH
    force, _, lost, tangent = one(LAW, start, [pull, 0.0, KT * pull / (MU * KN)])
    assert force[0] == pytest.approx(MU * LOAD + KT * pull, rel=1e-14)
    assert lost == pytest.approx(0.0, abs=1e-14)
    assert np.all(np.isfinite(tangent))
    # Square to the force: neither held nor moving at the first moment, slipping after it.
    force, _, lost, tangent = one(LAW, start, [0.0, pull, 0.0])
    assert np.hypot(*force[:2]) == pytest.approx(MU * LOAD, rel=1e-14)
    assert force[1] == pytest.approx(MU * LOAD * np.tanh(0.7), rel=1e-13)
    assert lost == pytest.approx((MU * LOAD) ** 2 / KT * np.log(np.cosh(0.7)), rel=1e-12)


def test_without_friction_only_the_normal_spring_is_left():
    law = FrictionContact(KT, KN, 0.0, LOAD)
    state = law.rest(1)
    for increment in [[0.1, 0.2, 0.1], [0.0, 0.0, 0.0], [-0.3, 0.1, -1.0], [0.2, 0.2, 1.5]]:
        answer = law.respond(state, np.array([increment]))
        state = answer.state
        normal = max(LOAD + KN * state[0, 2], 0.0)
        np.testing.assert_array_equal(answer.force[0], [0.0, 0.0, normal])
        expected = np.diag([0.0, 0.0, KN if normal > 0.0 else 0.0])
        np.testing.assert_array_equal(answer.tangent[0], expected)
        assert answer.dissipated[0] == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_zero_increments_change_nothing(seed):
    path = random_path(300 + seed, 30)
    plain, patient = lead(LAW, path), lead(LAW, np.repeat(path, 3, axis=0))
    np.testing.assert_allclose(patient.force[2::3], plain.force, atol=1e-13)
    np.testing.assert_allclose(patient.dissipated[1::3], 0.0, atol=1e-15)
    _, _, lost, tangent = one(LAW, LAW.rest(1), np.zeros(3))
    assert lost == 0.0
    np.testing.assert_array_equal(tangent, np.diag([KT, KT, KN]))


def test_steps_far_too_large_end_in_sliding_along_the_path():
    state = np.array([0.6 * REACH, -0.8 * REACH, 0.0])
    way = np.array([3.0, 4.0])
    for size in 10.0 ** np.arange(2.0, 13.0, 2.0):
        for normal in (0.0, 0.3, size):
            force, _, lost, tangent = one(LAW, state, [*(size * way), normal])
            limit = MU * (LOAD + KN * normal)
            np.testing.assert_allclose(force[:2], limit * way / 5.0, rtol=1e-12)
            assert np.all(np.isfinite(tangent))
            mean = 0.5 * (limit + MU * LOAD)
            straight = mean * (5.0 * size - (limit - MU * LOAD) / KT)
            assert lost == pytest.approx(straight, rel=2.0 * REACH / size)  # it turns on REACH
