"""Properties of every law of one direction: tangent, energy, any division of a straight path."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.wear.joints.friction_paths import lead_along_one
from wear.joints.bouc_wen import BoucWen
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.parameters import JointError

# One friction limit of 30 N, reached after about 1 µm.
COMMON = (40e3, 0.5, 60.0, 900.0)
LIMIT, REACH = 30.0, 1e-3
SCALE = LIMIT * REACH
LAWS = {
    "jenkins": Jenkins(*COMMON),
    "uniform iwan": UniformIwan(*COMMON),
    "four parameters": FourParameterIwan(*COMMON, chi=-0.4, beta=0.7),
    "bouc-wen": BoucWen(*COMMON),
    "bouc-wen, curved": BoucWen(*COMMON, sigma=0.8, exponent=1.0),
    "bouc-wen, general": BoucWen(*COMMON, sigma=0.7, exponent=2.5),
}
EVERY = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
# The general Bouc-Wen law is integrated in steps, so that dividing a path changes it by 2e-9.
ROUNDING, STEPPING = 1e-11, 4e-9
# Amplitudes from deep sticking to far sliding, in reaches.
PATHS = st.lists(st.floats(-4.0, 4.0), min_size=1, max_size=20)
RNG_SEED = 3


def tolerance(law):
    return STEPPING if law is LAWS["bouc-wen, general"] else ROUNDING


def force_after(law, state, increment):
    return law.respond(state, np.full((1, 1), increment)).force[0, 0]


@EVERY
@pytest.mark.parametrize(
    "history",
    [[0.0], [0.5], [3.0], [0.9, -0.4, 0.3], [3.0, -1.0, 0.2, -0.1], [-0.7, 0.69, -0.1]],
    ids=str,
)
def test_tangent_is_the_slope_of_the_force(law, history):
    """The path leads from a state both ways, and next to every transition."""
    state = lead_along_one(law, np.array(history) * REACH).state
    start = history[-1] * REACH
    # Loops close where they turned or opposite the first turn; sliders slip, and ξ passes 0,
    # somewhere on a fine grid that meets none of these points itself.
    switches = np.array([x * REACH * sign - start for x in history for sign in (1, -1)])
    near = (switches[:, None] + np.array([-1e-3, 1e-3]) * REACH).ravel()
    step, corners = 1e-5 * REACH, 0
    for increment in np.concatenate([np.linspace(-5.03, 5.11, 301) * REACH, near]):
        response = law.respond(state, np.full((1, 1), increment))
        ahead = force_after(law, state, increment + step)
        behind = force_after(law, state, increment - step)
        here = response.force[0, 0]
        forward, backward = (ahead - here) / step, (here - behind) / step
        if abs(increment) < 2.0 * step or abs(forward - backward) > 0.05 * COMMON[0]:
            corners += 1
            continue
        central = (ahead - behind) / (2.0 * step)
        assert response.tangent[0, 0, 0] == pytest.approx(central, abs=2e-6 * COMMON[0])
    assert corners <= 2  # a grid that meets a corner is bad luck; more would hide something


@EVERY
def test_tangent_after_a_step_too_small_to_see(law):
    """Right after a reversal everything sticks again; continued, the slope is the one before."""
    state = lead_along_one(law, [0.5 * REACH]).state
    on = law.respond(state, np.full((1, 1), 1e-12 * REACH)).tangent[0, 0, 0]
    back = law.respond(state, np.full((1, 1), -1e-12 * REACH)).tangent[0, 0, 0]
    here = (force_after(law, state, 1e-6 * REACH) - force_after(law, state, 0.0)) / (1e-6 * REACH)
    there = (force_after(law, state, 0.0) - force_after(law, state, -1e-6 * REACH)) / (1e-6 * REACH)
    # One-sided differences over a slope that bends as the power chi + 1 = 0.6 of the step.
    assert on == pytest.approx(here, rel=1e-3)
    assert back == pytest.approx(there, rel=1e-3)


@EVERY
@settings(max_examples=150, deadline=None, derandomize=True)
@given(path=PATHS)
def test_energy_is_never_gained(law, path):
    history = lead_along_one(law, np.array(path) * REACH)
    assert np.all(history.dissipated >= 0.0)
    assert np.all(np.isfinite(history.force))
    assert np.all(np.abs(history.force[:, 0, 0] - 900.0 * np.array(path) * REACH) <= LIMIT * 1.0001)


@EVERY
@settings(max_examples=100, deadline=None, derandomize=True)
@given(path=PATHS, shares=st.lists(st.floats(0.01, 0.99), min_size=1, max_size=4))
def test_a_straight_path_may_be_divided(law, path, shares):
    whole = lead_along_one(law, np.array(path) * REACH)
    starts, ends = np.array([0.0, *path[:-1]]), np.array(path)
    stops = np.append(np.sort(shares), 1.0)
    # Close to its end (1 - share) start + share end would round differently from the path itself.
    points = [np.append(a + stops[:-1] * (b - a), b) for a, b in zip(starts, ends, strict=True)]
    parts = lead_along_one(law, np.concatenate(points) * REACH)
    lost = parts.dissipated[:, 0].reshape(len(path), -1).sum(axis=1)
    allowed = tolerance(law) * len(path)
    np.testing.assert_allclose(parts.force[:: -len(stops)], whole.force[::-1], atol=allowed * LIMIT)
    np.testing.assert_allclose(lost, whole.dissipated[:, 0], atol=allowed * SCALE)


@EVERY
@pytest.mark.parametrize("amplitude", [0.4, 0.9, 3.0])
def test_energy_lost_in_a_loop_is_its_area(law, amplitude):
    """The area is integrated between the corners of the loop, independently of increments."""
    amplitude = amplitude * REACH
    settled = lead_along_one(law, np.tile([-amplitude, amplitude], 60))
    points, weights = np.polynomial.legendre.leggauss(40)
    state, area, lost = settled.state, 0.0, 0.0
    for start, end in ((amplitude, -amplitude), (-amplitude, amplitude)):
        corners = np.sort(np.clip(corners_from(law, state), 0.0, 2.0 * amplitude))
        # Squared, so that the power of the distance from the turning point is smooth.
        for near, far in zip(np.sqrt(corners[:-1]), np.sqrt(corners[1:]), strict=True):
            root = near + 0.5 * (far - near) * (1.0 + points)
            forces = [force_after(law, state, np.sign(end - start) * r * r) for r in root]
            measure = (far - near) * weights * root
            area += np.sign(end - start) * np.sum(measure * np.array(forces))
        response = law.respond(state, np.full((1, 1), end - start))
        state, lost = response.state, lost + response.dissipated[0]
    assert response.force[0, 0] == pytest.approx(settled.force[-1, 0, 0], abs=1e-9 * LIMIT)
    assert area == pytest.approx(lost, abs=1e-8 * SCALE)
    assert law.loop_energy(amplitude) == pytest.approx(lost, abs=1e-8 * SCALE)


def corners_from(law, state):
    """Return distances from a reversal at which the force may have a corner, and its ends."""
    if isinstance(law, Jenkins):
        corner = 2.0 * LIMIT / law.stiffness
    elif isinstance(law, BoucWen):
        corner = 0.0
        if law.sigma == 0.5:
            corner = abs(state[0, 1]) * LIMIT / (law.stiffness - law.residual_stiffness)
        else:
            corner = zero_of_xi(law, state)
    else:
        share, exponent = law.spread
        corner = 2.0 * LIMIT / (law.stiffness * (1.0 - share / exponent))
    return np.array([0.0, corner, np.inf])


def zero_of_xi(law, state):
    least, most = 0.0, 2.0 * LIMIT / (law.stiffness - law.residual_stiffness)
    sign = np.sign(state[0, 1])
    for _ in range(60):
        middle = 0.5 * (least + most)
        xi = law.respond(state, np.full((1, 1), -sign * middle)).state[0, 1]
        least, most = (middle, most) if sign * xi > 0.0 else (least, middle)
    return most


@EVERY
def test_joints_side_by_side_are_joints_alone(law):
    """Joints have their own parameters, states of different depth, and a non-contiguous layout."""
    loads, frictions = np.array([20.0, 60.0, 0.0, 500.0]), np.array([0.2, 0.5, 0.5, 1.0])
    several = replace(law, normal_load=loads, friction=frictions)
    scales = np.array([0.1, 1.0, 3.0, 0.0])
    path = np.random.default_rng(RNG_SEED).uniform(-1.0, 1.0, (40, 1, 4)) * scales * REACH
    path[20:, :, 1] = path[19, :, 1]
    together = march_joints(several, several.rest(4), np.zeros((4, 1)), path.transpose(0, 2, 1))
    for j in range(4):
        alone = replace(law, normal_load=loads[j], friction=frictions[j])
        single = lead_along_one(alone, path[:, 0, j])
        np.testing.assert_array_equal(together.force[:, j], single.force[:, 0])
        np.testing.assert_array_equal(together.dissipated[:, j], single.dissipated[:, 0])
    amplitudes = np.array([1.0, 2.0, 3.0, 4.0]) * REACH
    energies = [
        float(replace(law, normal_load=n, friction=m).loop_energy(a))
        for n, m, a in zip(loads, frictions, amplitudes, strict=True)
    ]
    np.testing.assert_allclose(several.loop_energy(amplitudes), energies, rtol=1e-13)


@EVERY
def test_no_joints_at_all(law):
    response = law.respond(law.rest(0), np.empty((0, 1)))
    assert response.force.shape == (0, 1)
    assert response.tangent.shape == (0, 1, 1)


@EVERY
def test_a_state_is_left_as_it_was(law):
    state = lead_along_one(law, np.array([0.8, -0.5, 0.1]) * REACH).state
    before = state.copy()
    first = law.respond(state, np.full((1, 1), -2.0 * REACH))
    np.testing.assert_array_equal(state, before)
    np.testing.assert_array_equal(
        law.respond(state, np.full((1, 1), -2.0 * REACH)).force, first.force
    )


@EVERY
def test_an_increment_of_nothing_changes_nothing(law):
    path = lead_along_one(law, np.array([0.8, -0.5, 0.1]) * REACH)
    still = law.respond(path.state, np.zeros((1, 1)))
    np.testing.assert_array_equal(still.force, path.force[-1])
    np.testing.assert_array_equal(still.state, path.state)
    assert still.dissipated[0] == 0.0


@EVERY
@pytest.mark.parametrize(
    "changes",
    [
        {"stiffness": 0.0},
        {"stiffness": np.nan},
        {"friction": -0.1},
        {"normal_load": np.array([1.0, -1.0])},
        {"residual_stiffness": np.inf},
    ],
)
def test_impossible_parameters_are_named(law, changes):
    with pytest.raises(JointError, match=next(iter(changes))):
        replace(law, **changes)


@pytest.mark.parametrize(
    ("law", "changes"),
    [
        ("bouc-wen", {"residual_stiffness": 40e3}),
        ("bouc-wen", {"sigma": 0.4}),
        ("bouc-wen", {"exponent": 0.5}),
        ("four parameters", {"chi": -1.0}),
        ("four parameters", {"beta": -1.0}),
    ],
)
def test_impossible_shapes_are_refused(law, changes):
    with pytest.raises(JointError):
        replace(LAWS[law], **changes)


@EVERY
def test_arrays_that_do_not_fit(law):
    with pytest.raises(JointError, match=r"must be \(2, 1\)"):
        law.respond(law.rest(2), np.zeros(2))
    of_three = replace(law, normal_load=np.ones(3))
    with pytest.raises(JointError, match=r"3 joints, .* 2"):
        of_three.respond(of_three.rest(2), np.zeros((2, 1)))
    with pytest.raises(JointError, match="a number or one per joint"):
        replace(law, normal_load=np.ones(3), friction=np.ones(2))
