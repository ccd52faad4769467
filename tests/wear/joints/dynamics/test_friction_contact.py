"""Friction contact in three dimensions: closed forms, brute force, symmetries, balances."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numba import njit
from scipy.integrate import quad, solve_ivp

from tests.wear.joints.friction_paths import (
    KN,
    KT,
    LAW,
    LIFT,
    LOAD,
    MU,
    REACH,
    brute_force,
    central,
    derivative,
    lead,
    one,
    random_path,
    split,
)
from wear.joints.friction_contact import FrictionContact, advance_contact
from wear.joints.parameters import JointError
from wear.joints.periodic.friction_path import ForcePath
from wear.joints.periodic.friction_path import energy_lost as lost_on_path

# --- what it reduces to -----------------------------------------------------------------------


def test_constant_load_along_a_line_is_a_jenkins_element():
    rng = np.random.default_rng(1)
    along = np.cumsum(rng.normal(scale=REACH, size=400))
    direction = np.array([np.cos(0.7), np.sin(0.7), 0.0])
    history = lead(LAW, along[:, None] * direction)
    slider, limit = 0.0, MU * LOAD
    for step, x in enumerate(along):
        before = slider
        slider = min(max(slider, x - limit / KT), x + limit / KT)
        expected = KT * (x - slider) * direction + [0.0, 0.0, LOAD]
        np.testing.assert_allclose(history.force[step, 0], expected, atol=1e-12)
        assert history.dissipated[step, 0] == pytest.approx(limit * abs(slider - before), abs=1e-12)


def test_a_growing_load_catches_the_slider_and_a_falling_one_lets_it_go():
    _, sliding, _, _ = one(LAW, LAW.rest(1), [2.0 * REACH, 0.0, 0.0])
    # Pulled on, but the limit grows faster than the spring: it sticks from the first moment.
    pull = 0.5 * REACH
    force, _, lost, tangent = one(LAW, sliding, [pull, 0.0, 1.1 * KT * pull / (MU * KN)])
    assert force[0] == pytest.approx(MU * LOAD + KT * pull, rel=1e-13)
    assert lost == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_allclose(tangent[:2], [[KT, 0, 0], [0, KT, 0]], atol=1e-12)
    # Pulled back, but the limit falls faster: it slips, against the pull.
    force, _, lost, _ = one(LAW, sliding, [-pull, 0.0, -1.1 * KT * pull / (MU * KN)])
    limit = MU * LOAD - 1.1 * KT * pull
    assert force[0] == pytest.approx(limit, rel=1e-13)
    slipped = (MU * LOAD - limit) / KT - pull
    assert lost == pytest.approx(0.5 * (MU * LOAD + limit) * slipped, rel=1e-12)


# --- sliding along a straight path ------------------------------------------------------------


def slide(angle, pull, limits):
    """Return the end of a slip that begins on the circle, by integration of its angle."""
    first, last = limits
    change = last - first

    def rate(s, force):
        limit = first + change * s
        direction = force / np.hypot(*force)
        slip = pull * direction[0] - change
        return np.array([pull, 0.0]) - slip * force / limit

    start = first * np.array([np.cos(angle), np.sin(angle)])
    return solve_ivp(rate, (0.0, 1.0), start, rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]


@pytest.mark.parametrize(
    ("angle", "pull", "last"),
    [(angle, 4.0, last) for angle in (0.3, -1.2) for last in (0.05, 0.97, 1.0, 1.03, 1.04, 1.9)]
    + [(1.56, 4.0, last) for last in (0.05, 0.97, 1.0, 1.03, 1.04)]
    # Against the force a pull slips only where the circle shrinks faster.
    + [(2.8, 0.5, 0.05), (2.8, 0.02, 0.97), (-3.1, 0.9, 0.05)],
)
def test_the_force_turns_into_the_path_at_the_closed_rate(angle, pull, last):
    limit = MU * LOAD
    pull, end = pull * limit, last * limit
    state = [REACH * np.cos(angle), REACH * np.sin(angle), 0.0]
    force, _, _, _ = one(LAW, state, [pull / KT, 0.0, (end - limit) / (MU * KN)])
    length = pull / limit if end == limit else pull * np.log(end / limit) / (end - limit)
    half = np.tan(angle / 2.0) * np.exp(-length)
    expected = end * np.array([1.0 - half**2, 2.0 * half]) / (1.0 + half**2)
    np.testing.assert_allclose(force[:2], expected, atol=1e-13)
    np.testing.assert_allclose(force[:2], slide(angle, pull, (limit, end)), atol=1e-10)


def test_the_direction_tends_to_the_path_even_where_the_pressure_vanishes():
    state = [0.0, REACH, 0.0]
    for left in 10.0 ** -np.arange(2.0, 13.0, 2.0):
        force, _, _, _ = one(LAW, state, [0.3 * REACH, 0.0, -LIFT * (1.0 - left)])
        assert np.hypot(*force[:2]) == pytest.approx(MU * force[2], rel=1e-12)
        assert force[2] == pytest.approx(LOAD * left, rel=1e-2)
        exponent = 0.3 / (1.0 - left)
        half = np.tan(0.5 * np.arctan2(force[1], force[0]))
        assert half == pytest.approx((force[2] / LOAD) ** exponent, rel=1e-10)


def test_energy_of_a_slip_under_constant_load_is_its_closed_form():
    for angle, length in [(1.2, 0.3), (0.7, 2.0), (-1.5, 7.0), (0.1, 900.0)]:
        state = [REACH * np.cos(angle), REACH * np.sin(angle), 0.0]
        _, _, lost, _ = one(LAW, state, [length * REACH, 0.0, 0.0])
        shape = np.logaddexp(
            length + np.log1p(np.cos(angle)), -length + np.log1p(-np.cos(angle))
        ) - np.log(2.0)
        assert lost == pytest.approx((MU * LOAD) ** 2 / KT * shape, rel=1e-12)


@pytest.mark.parametrize(
    ("angle", "pull", "last"),
    [
        (1.3, 0.5, 1.1),
        (1.0, 3.0, 0.2),
        (0.4, 30.0, 12.0),
        (1.5, 900.0, 3.0),
        (0.2, 2e4, 40.0),
        (3.0, 0.5, 0.01),
        (np.pi, 0.9, 0.05),
        (np.pi / 2, 1e-3, 0.5),
        (0.9, 0.0, 0.3),
    ],
)
def test_energy_of_a_slip_under_changing_load_is_its_integral(angle, pull, last):
    limit = MU * LOAD
    state = [REACH * np.cos(angle), REACH * np.sin(angle), 0.0]
    increment = np.array([pull * REACH, 0.0, (last - 1.0) * LIFT])
    _, _, lost, _ = one(LAW, state, increment)

    def power(s):
        now, change = limit * (1.0 + s * (last - 1.0)), limit * (last - 1.0)
        half = 2.0 * np.arctanh(-(last - 1.0) * s / (2.0 + s * (last - 1.0)))  # ln R0/R1
        decay = np.exp(pull / (last - 1.0) * half)
        p, m = (1.0 + np.cos(angle)), (1.0 - np.cos(angle)) * decay**2
        return now * (pull * limit * (p - m) / (p + m) - change) / KT

    corners = np.concatenate([[0.0], np.minimum(1.0, np.geomspace(1e-3, 64.0, 30) / (pull + 1.0))])
    corners = np.unique(np.append(corners, 1.0))
    expected = sum(quad(power, a, b, epsrel=1e-13, epsabs=0)[0] for a, b in pairwise(corners))
    assert lost == pytest.approx(expected, rel=1e-11)


# --- symmetry, splitting, brute force, order --------------------------------------------------


def test_the_cone_is_round():
    path = random_path(2, 200)
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(0.8), -np.sin(0.8)], [np.sin(0.8), np.cos(0.8)]]
    state, turned = LAW.rest(1), LAW.rest(1)
    for increment in np.diff(path, axis=0, prepend=np.zeros((1, 3))):
        here = LAW.respond(state, increment[None])
        there = LAW.respond(turned, (turn @ increment)[None])
        np.testing.assert_allclose(there.force[0], turn @ here.force[0], atol=1e-12)
        np.testing.assert_allclose(there.tangent[0], turn @ here.tangent[0] @ turn.T, atol=1e-9)
        np.testing.assert_allclose(there.dissipated, here.dissipated, atol=1e-12)
        state, turned = here.state, there.state


@pytest.mark.parametrize("seed", range(6))
def test_splitting_an_increment_changes_nothing(seed):
    path = random_path(seed, 40)
    whole = lead(LAW, path)
    for parts in (2, 3, 17):
        pieces = lead(LAW, split(path, parts))
        np.testing.assert_allclose(pieces.force[parts - 1 :: parts], whole.force, atol=1e-12)
        energies = pieces.dissipated.reshape(len(path), parts).sum(axis=1)
        np.testing.assert_allclose(energies, whole.dissipated[:, 0], atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_tiny_steps_of_radial_return_converge_to_it(seed):
    path = random_path(100 + seed, 10)
    history = lead(LAW, path)
    errors = []
    for steps in (100, 1000, 10_000):
        forces, lost = brute_force(path, steps)
        off = np.abs(forces - history.force[:, 0, :2]).max()
        errors.append((off, abs(lost - history.dissipated.sum())))
    force_errors, energy_errors = np.array(errors).T
    # The reference is of first order: ten times as many steps have a tenth of the error.
    assert np.all(force_errors[1:] < 0.2 * force_errors[:-1])
    assert np.all(energy_errors[1:] < 0.2 * energy_errors[:-1])
    assert force_errors[-1] < 2e-4 * MU * LOAD
    assert energy_errors[-1] < 1e-3 * history.dissipated.sum()


def orbit(steps):
    """Return a smooth closed path that sticks, slips, lifts off and touches, in equal times."""
    t = 2.0 * np.pi * np.arange(steps + 1) / steps
    x, y = 2.0 * REACH * np.sin(t), 1.5 * REACH * np.sin(2.0 * t + 0.4)
    z = 1.2 * LIFT * np.sin(t + 1.0)
    return np.column_stack([x, y, z])


def test_a_smooth_orbit_converges_with_the_square_of_the_step():
    steps = np.array([64, 128, 256, 512, 1024])
    fine = 32768

    def run(count):
        path = orbit(count)
        history = lead(LAW, path[1:], [0.0, 0.0, path[0, 2]], path[0])
        return history.force[count // 64 - 1 :: count // 64, 0], history.dissipated.sum()

    forces, lost = run(fine)
    runs = [run(count) for count in steps]
    errors = [np.abs(force - forces).max() for force, _ in runs]
    energies = [abs(energy - lost) for _, energy in runs]
    assert -np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.1)
    assert -np.polyfit(np.log(steps), np.log(energies), 1)[0] == pytest.approx(2.0, abs=0.1)


def kinks(state, increment):
    """Return where on a path the force may have a kink: touch, lift-off, beginning of slip."""
    pull, limit = KT * increment[:2], MU * np.array([KN * increment[2], LOAD + KN * state[2]])
    stuck = sum(np.polymul([k, t], [k, t]) for k, t in zip(pull, KT * state[:2], strict=True))
    roots = np.append(np.roots(limit), np.roots(np.polysub(stuck, np.polymul(limit, limit))))
    real = roots[np.isreal(roots)].real
    return real[(real > 0.0) & (real < 1.0)]


@pytest.mark.parametrize("seed", range(4))
def test_energy_lost_is_work_less_what_is_stored(seed):
    path = random_path(200 + seed, 12)
    state, here = LAW.rest(1)[0], np.zeros(3)

    def stored(state):
        return 0.5 * KT * (state[0] ** 2 + state[1] ** 2) + (
            0.5 * max(LOAD + KN * state[2], 0.0) ** 2 / KN
        )

    for there in path:
        increment = there - here

        def power(s, state=state, increment=increment):
            return one(LAW, state, s * increment)[0] @ increment

        work = quad(power, 0.0, 1.0, epsabs=0.0, epsrel=1e-13, points=kinks(state, increment))[0]
        _, end, lost, _ = one(LAW, state, increment)
        assert lost >= 0.0
        assert lost == pytest.approx(work - stored(end) + stored(state), abs=1e-10)
        state, here = end, there


# --- derivatives ------------------------------------------------------------------------------

SITUATIONS = {
    "sticks": ([0.1, 0.2, 0.0], [0.2, -0.3, 0.1]),
    "sticks, just": ([0.0, 0.0, 0.0], [0.5999, 0.7999, 0.0]),
    "slips, just": ([0.0, 0.0, 0.0], [0.6001, 0.8001, 0.0]),
    "sticks, then slips": ([0.1, 0.2, 0.1], [1.5, 0.4, -0.2]),
    "sticks, then slips as the load grows": ([0.1, 0.2, 0.1], [1.5, 0.4, 0.6]),
    "slips": ([0.6 - 1e-4, 0.8 - 1e-4, 0.0], [1.0, -0.1, 0.03]),
    "slips, load nearly constant": ([0.5999, 0.7999, 0.0], [1.0, 0.2, 1e-3]),
    "slips, load constant": ([0.5999, 0.7999, 0.0], [1.0, 0.2, 0.0]),
    "slips far": ([0.1, 0.7, 0.0], [30.0, 5.0, 0.5]),
    "slips without a pull": ([0.6, 0.7, 0.0], [0.0, 0.0, -0.5]),
    "slips against the pull": ([0.6, 0.7, 0.0], [-0.1, -0.12, -0.6]),
    "turned back": ([0.5999, 0.7999, 0.0], [-0.3, -0.3, 0.1]),
    "turned back, then slips": ([0.5999, 0.7999, 0.0], [-2.3, -0.9, 0.1]),
    "caught by the load": ([0.5999, 0.7999, 0.0], [0.2, 0.1, 0.9]),
    "outside, sticks": ([1.0, 0.8, 0.0], [-0.3, -0.2, 0.2]),
    "outside, slips": ([1.0, 0.8, 0.0], [0.7, -0.2, 0.2]),
    "lifts off": ([0.3, 0.4, 0.2], [0.5, 0.3, -1.6]),
    "lifts off, nearly": ([0.3, 0.4, 0.2], [0.5, 0.3, -1.1995]),
    "lifts off, just": ([0.3, 0.4, 0.2], [0.5, 0.3, -1.2005]),
    "apart": ([0.0, 0.0, -1.4], [0.5, 0.3, -0.2]),
    "apart, nearly touches": ([0.0, 0.0, -1.4], [0.5, 0.3, 0.3995]),
    "touches, just, slips": ([0.0, 0.0, -1.4], [0.5, 0.3, 0.4005]),
    "touches, slips": ([0.0, 0.0, -1.4], [1.5, 0.3, 0.9]),
    "touches, sticks": ([0.0, 0.0, -1.4], [0.5, 0.3, 0.9]),
    "touches, sticks, just": ([0.0, 0.0, -1.5], [0.8, 0.0, 0.8005]),
    "touches, slips, just": ([0.0, 0.0, -1.5], [0.8, 0.0, 0.7995]),
}


@pytest.mark.parametrize("name", SITUATIONS)
def test_derivatives_in_every_state_and_next_to_every_transition(name):
    state, increment = (np.array(part) * [REACH, REACH, LIFT] for part in SITUATIONS[name])
    force, jacobian = derivative(LAW, state, increment)
    np.testing.assert_array_equal(force, one(LAW, state, increment)[0])
    np.testing.assert_array_equal(jacobian[:, 3:], one(LAW, state, increment)[3])
    largest = max(1.0, np.abs(jacobian).max() / KT)
    np.testing.assert_allclose(
        jacobian, central(LAW, state, increment), atol=1e-6 * KT * largest**2
    )


def test_derivatives_of_random_increments():
    rng = np.random.default_rng(7)
    for _ in range(400):
        state = rng.uniform(-1.0, 1.0, 3) * [REACH, REACH, 1.5 * LIFT]
        increment = rng.uniform(-1.0, 1.0, 3) * [3.0 * REACH, 3.0 * REACH, 2.0 * LIFT]
        _, jacobian = derivative(LAW, state, increment)
        expected = central(LAW, state, increment)
        np.testing.assert_allclose(jacobian, expected, rtol=1e-6, atol=1e-6 * KT)


def test_derivative_of_a_whole_march():
    """Chaining the kernel's derivatives gives that of all forces by all displacements."""
    path, shift = orbit(24), 1e-7 * REACH
    start = np.array([0.0, 0.0, path[0, 2]])
    rng = np.random.default_rng(3)
    change = rng.normal(size=path.shape)

    def run(displacement):
        first = [0.0, 0.0, displacement[0, 2]]
        return lead(LAW, displacement[1:], first, displacement[0]).force[:, 0]

    state, moved = start.copy(), np.array([0.0, 0.0, change[0, 2]])
    directional, end = [], np.empty(3)
    for increment, further in zip(np.diff(path, axis=0), np.diff(change, axis=0), strict=True):
        force, jacobian = np.empty(3), np.empty((3, 6))
        advance_contact(LAW.parameters[0], state, increment, force, end, jacobian)
        slope = jacobian @ np.concatenate([moved, further])
        moved = np.array([slope[0] / KT, slope[1] / KT, moved[2] + further[2]])
        directional.append(slope)
        state[:] = end
    expected = (run(path + shift * change) - run(path - shift * change)) / (2.0 * shift)
    np.testing.assert_allclose(directional, expected, atol=1e-5 * KT)


# --- many joints, compiled loops, parameters --------------------------------------------------


def test_many_joints_answer_as_each_alone():
    rng = np.random.default_rng(5)
    joints = 121
    values = rng.uniform(0.5, 2.0, (5, joints)) * np.array([KT, KN, MU, LOAD, LIFT])[:, None]
    open_gap = rng.random(joints) < 0.3
    values[3, open_gap], values[4, ~open_gap] = 0.0, 0.0
    law = FrictionContact(*values)
    state = rng.uniform(-1.0, 1.0, (joints, 3)) * [REACH, REACH, 2.0 * LIFT]
    increment = rng.uniform(-1.0, 1.0, (joints, 3)) * [2.0 * REACH, 2.0 * REACH, 3.0 * LIFT]
    kept = state.copy()
    together = law.respond(state, increment)
    np.testing.assert_array_equal(state, kept)
    for joint in range(joints):
        alone = FrictionContact(*(float(value[joint]) for value in values))
        force, end, lost, tangent = one(alone, state[joint], increment[joint])
        np.testing.assert_array_equal(together.force[joint], force)
        np.testing.assert_array_equal(together.state[joint], end)
        np.testing.assert_array_equal(together.tangent[joint], tangent)
        assert together.dissipated[joint] == lost


@njit
def compiled_march(parameters, state, increments, forces):
    """March in one compiled loop that advances the state in place."""
    lost, jacobian = 0.0, np.empty((3, 6))
    for step in range(len(increments)):
        lost += advance_contact(parameters, state, increments[step], forces[step], state, jacobian)
    return lost


def test_a_compiled_loop_marches_in_place():
    path = random_path(9, 50)
    increments = np.diff(path, axis=0, prepend=np.zeros((1, 3)))
    forces, state = np.empty((50, 3)), np.zeros(3)
    lost = compiled_march(LAW.parameters[0], state, increments, forces)
    history = lead(LAW, path)
    np.testing.assert_array_equal(forces, history.force[:, 0])
    np.testing.assert_array_equal(state, history.state[0])
    assert lost == pytest.approx(history.dissipated.sum(), rel=1e-13)


def test_a_worn_limit_lets_the_slider_slip_and_counts_what_it_loses():
    _, state, _, _ = one(LAW, LAW.rest(1), [0.8 * REACH, 0.6 * REACH, 0.0])
    worn = replace(LAW, normal_load=0.25 * LOAD)
    force, _, lost, _ = one(worn, state, np.zeros(3))
    limit = 0.25 * MU * LOAD
    np.testing.assert_allclose(force, [0.8 * limit, 0.6 * limit, 0.25 * LOAD], rtol=1e-12)
    assert lost == pytest.approx(0.5 * ((MU * LOAD) ** 2 - limit**2) / KT, rel=1e-12)
    for gone in (replace(LAW, normal_load=0.0), replace(LAW, normal_load=0.0, gap=0.01)):
        force, end, lost, tangent = one(gone, state, np.zeros(3))
        assert not force.any()
        assert not end.any()
        assert not tangent.any()
        assert lost == pytest.approx(0.5 * (MU * LOAD) ** 2 / KT, rel=1e-12)


def test_parameters_that_cannot_be_are_refused():
    with pytest.raises(JointError, match="stiffness"):
        FrictionContact(0.0, KN, MU, LOAD)
    with pytest.raises(JointError, match="friction"):
        FrictionContact(KT, KN, np.array([0.1, -0.1]), LOAD)
    with pytest.raises(JointError, match="gap"):
        FrictionContact(KT, KN, MU, LOAD, 0.01)
    law = FrictionContact(np.full(2, KT), KN, MU, LOAD)
    assert law.directions == 3
    with pytest.raises(JointError, match="increment"):
        law.respond(law.rest(2), np.zeros((2, 1)))
    with pytest.raises(JointError, match="2 joints"):
        law.respond(law.rest(3), np.zeros((3, 3)))


@pytest.mark.parametrize("angle", [1e-6, 0.01, 0.5, 0.7, 1.5, 3.0, 3.14159])
@pytest.mark.parametrize("pull", [1e-3, 0.3, 1.0, 5.0, 80.0])
def test_energy_of_a_force_that_turns_under_a_constant_limit(angle, pull):
    """The energy is R² ln(sin ψ0 / sin ψ1), where tan(ψ/2) falls by exp(-L)."""
    path = ForcePath(2.0 * np.cos(angle), 2.0 * np.sin(angle), 2.0 * pull, 0.0, 2.0, 2.0)
    before = np.tan(0.5 * angle)
    # Pulled inward the slider holds until the chord leaves the circle: ψ becomes π - ψ.
    held = min(max(-2.0 * np.cos(angle) / pull, 0.0), 1.0)
    if held > 0.0:
        before = 1.0 / before
    length = pull * (1.0 - held)
    after = before * np.exp(-length)
    expected = 4.0 * (length + np.log1p(after**2) - np.log1p(before**2))
    assert lost_on_path(path) == pytest.approx(expected, rel=1e-11, abs=1e-12)
