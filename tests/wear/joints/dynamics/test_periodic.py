"""Joints over a period: exact derivatives, settled cycles, closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from wear.joints.bouc_wen import BoucWen
from wear.joints.friction_contact import FrictionContact
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.parameters import JointError
from wear.joints.periodic.march import SEPARATED, SLIP, STICK, PeriodicMarch

KT, MU, LOAD, KR = 10.0, 0.5, 4.0, 1.0
REACH = MU * LOAD / KT
ONE_DIRECTION = {
    "jenkins": Jenkins(KT, MU, LOAD, KR),
    "uniform iwan": UniformIwan(KT, MU, LOAD, KR),
    "four-parameter iwan": FourParameterIwan(KT, MU, LOAD, KR, chi=-0.3, beta=0.4),
    "bouc-wen": BoucWen(KT, MU, LOAD, KR),
    "bouc-wen n 1": BoucWen(KT, MU, LOAD, KR, sigma=0.8, exponent=1.0),
    "bouc-wen n 1.5": BoucWen(KT, MU, LOAD, KR, sigma=0.7, exponent=1.5),
}
CONTACTS = {
    "preloaded": FrictionContact(KT, 13.0, MU, LOAD),
    "touching": FrictionContact(KT, 13.0, MU),
    "with a gap": FrictionContact(KT, 13.0, MU, gap=0.05),
    "constant load": FrictionContact(KT, 0.0, MU, LOAD),
    "heavily loaded": FrictionContact(KT, 13.0, MU, 100.0),
}
STEP = 1e-7  # of central differences, whose rounding then is of the order of their error, 1e-9
DIFFERENCES = 2e-7  # agreement with them, over the largest entry
FINE_STEPS = 2e-5  # where the law itself is integrated, with errors of 2e-9 over STEP


def fourier(harmonics, samples):
    """Return basis, weights and lead of a Fourier series."""
    turns = 2.0 * np.pi * np.arange(samples) / samples
    columns, weights = [], []
    for k in harmonics:
        if k == 0:
            columns.append(np.ones(samples))
            weights.append(np.full(samples, 1.0 / samples))
            continue
        for wave in (np.cos(k * turns), np.sin(k * turns)):
            columns.append(wave)
            weights.append(2.0 / samples * wave)
    basis = np.array(columns).T.copy()
    mean = np.eye(1, len(columns)) if harmonics[0] == 0 else basis[:0]
    return basis, np.array(weights), np.vstack([mean, basis[:1]])


def central(law, coefficients, *functions):
    """Return the derivative by central differences."""
    settle = PeriodicMarch(law).settle
    answer = np.empty(coefficients.shape + coefficients.shape[1:])
    for m, d in np.ndindex(*coefficients.shape[1:]):
        change = np.zeros_like(coefficients)
        change[:, m, d] = STEP
        upper = settle(coefficients + change, *functions).force
        lower = settle(coefficients - change, *functions).force
        answer[..., m, d] = (upper - lower) / (2.0 * STEP)
    return answer


def check_derivative(law, coefficients, *functions):
    cycle = PeriodicMarch(law).settle(coefficients, *functions)
    wanted = central(law, coefficients, *functions)
    integrated = getattr(law, "exponent", 1.0) not in (1.0, 2.0)
    allowed = FINE_STEPS if integrated else DIFFERENCES
    for joint in range(len(coefficients)):
        largest = np.abs(wanted[joint]).max()
        error = np.abs(cycle.jacobian[joint] - wanted[joint]).max()
        assert error <= allowed * max(largest, KT), (joint, error / largest)
    return cycle


def random_motion(seed, joints, harmonics, directions, size):
    """Return coefficients that fall with the harmonic."""
    rng = np.random.default_rng(seed)
    functions = fourier(harmonics, 64)
    motion = rng.standard_normal((joints, functions[0].shape[1], directions))
    motion /= 1.0 + np.arange(motion.shape[1])[None, :, None]
    return size * motion, functions


@pytest.mark.parametrize("size", [0.02, 0.3, 3.0])
@pytest.mark.parametrize("name", ONE_DIRECTION)
def test_derivative_along_one_direction(name, size):
    motion, functions = random_motion(1, 6, (0, 1, 2, 3, 5), 1, size * REACH * 2.0)
    cycle = check_derivative(ONE_DIRECTION[name], motion, *functions)
    if size == 3.0:
        assert {STICK, SLIP} == set(np.unique(cycle.states))


@pytest.mark.parametrize("size", [0.02, 0.3, 3.0])
@pytest.mark.parametrize("name", CONTACTS)
def test_derivative_in_three_dimensions(name, size):
    """All states occur: sticking, slipping, apart and closed again, with and without preload."""
    motion, functions = random_motion(2, 8, (0, 1, 2, 3, 5), 3, size * REACH * 2.0)
    if name == "with a gap":
        motion[:4, 0, 2] += 0.1
    cycle = check_derivative(CONTACTS[name], motion, *functions)
    if size == 3.0 and name == "preloaded":
        assert {STICK, SLIP, SEPARATED} == set(np.unique(cycle.states))


def bisected(seen, inside, outside):
    """Return where ``seen`` ceases to be true, to rounding, from both sides."""
    for _ in range(60):
        middle = 0.5 * (inside + outside)
        if middle in (inside, outside):
            break
        if seen(middle):
            inside = middle
        else:
            outside = middle
    return inside, outside


@pytest.mark.parametrize("switch", ["slip", "lift off", "touch"])
def test_derivative_on_each_side_of_a_switch(switch):
    """Just before and after a state appears, one-sided differences agree."""
    law = CONTACTS["with a gap" if switch == "touch" else "preloaded"]
    functions = fourier((0, 1, 3), 48)
    shape = np.zeros((1, 5, 3))
    shape[0, 1], shape[0, 4] = (1.0, 0.4, 0.0), (0.1, -0.2, 0.0)
    if switch != "slip":
        shape[0, 1] = (0.3 * REACH, 0.1 * REACH, 1.0)
    state = {"slip": SLIP, "lift off": SEPARATED, "touch": SEPARATED}[switch]

    def count(size):
        cycle = PeriodicMarch(law).settle(_grown(shape, size, switch), *functions)
        return np.count_nonzero(cycle.states == state)

    first = count(1e-3)
    sides = bisected(lambda size: count(size) == first, 1e-3, 1.0)
    for size, away in zip(sides, (-1e-4, 1e-4), strict=True):
        check_derivative(law, _grown(shape, size + away, switch), *functions)


def _grown(shape, size, switch):
    grown = shape * size
    if switch != "slip":
        grown[..., :2] = shape[..., :2]
    return grown


@pytest.mark.parametrize("name", [*ONE_DIRECTION, *CONTACTS])
def test_settled_cycle_is_the_one_that_many_periods_lead_to(name):
    """An independent march through the same points for many periods ends in the same forces."""
    law = (ONE_DIRECTION | CONTACTS)[name]
    motion, functions = random_motion(3, 5, (0, 1, 2, 3), law.directions, 1.5 * REACH)
    basis, weights, lead = functions
    cycle = PeriodicMarch(law).settle(motion, basis, weights, lead)
    way = (basis @ motion).transpose(1, 0, 2)
    before = (lead @ motion).transpose(1, 0, 2)
    periods = 40
    rest = np.zeros_like(way[0])
    history = march_joints(
        law, law.rest(len(motion)), rest, np.vstack([before[:-1], *[way] * periods])
    )
    # A Bouc-Wen joint forgets gradually, not at once.
    scale = np.abs(history.force).max()
    np.testing.assert_allclose(cycle.samples, history.force[-64:], atol=1e-9 * scale)
    lost = history.dissipated[-64:].sum(axis=0)
    np.testing.assert_allclose(cycle.dissipated, lost, atol=1e-8 * max(lost.max(), 1e-6))
    np.testing.assert_allclose(
        cycle.force, np.einsum("mt,tjd->jmd", weights, cycle.samples), atol=1e-13 * scale
    )
    assert cycle.change.max() <= 1e-12


def test_first_harmonic_of_jenkins_and_its_rate():
    """The closed form is met to 1e-8 with many samples; the error falls with their square."""
    law, amplitude = ONE_DIRECTION["jenkins"], 3.3 * REACH
    wanted = np.ravel(law.first_harmonic(amplitude))
    errors = []
    for samples in (4096, 65536):
        cycle = PeriodicMarch(law).settle(np.array([[[amplitude], [0.0]]]), *fourier((1,), samples))
        errors.append(np.abs(cycle.force[0, :, 0] - wanted).max() / np.abs(wanted).max())
        np.testing.assert_allclose(cycle.dissipated[0], law.loop_energy(amplitude), rtol=1e-12)
    assert errors[1] <= 1e-8
    assert errors[0] <= 16.0**2 * 2e-9


def test_sliding_round_a_circle():
    """On a circle of radius A the force leads by acos(r/A), where r is the spring's reach.

    The slider follows on a circle of radius sqrt(A² - r²), on which it dissipates 2π µN times that.
    """
    law, amplitude = CONTACTS["constant load"], 2.5 * REACH
    errors = []
    for samples in (512, 2048):
        motion = np.zeros((1, 2, 3))
        motion[0, 0, 0] = motion[0, 1, 1] = amplitude
        cycle = PeriodicMarch(law).settle(motion, *fourier((1,), samples))
        force = cycle.force[0, 0, 0] - 1j * cycle.force[0, 1, 0]
        wanted = MU * LOAD * np.exp(1j * np.arccos(REACH / amplitude))
        errors.append(abs(force - wanted) / (MU * LOAD))
        way = 2.0 * np.pi * np.sqrt(amplitude**2 - REACH**2)
        np.testing.assert_allclose(cycle.dissipated[0], MU * LOAD * way, rtol=20.0 / samples**2)
    assert errors[1] <= 1e-5
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.1)


def test_a_stuck_contact_is_its_springs():
    """The phase has no effect; without lead the slider is where the joint was at rest."""
    law = CONTACTS["heavily loaded"]
    motion, (basis, weights, lead) = random_motion(4, 3, (0, 1, 2), 3, 0.1 * REACH)
    cycle = PeriodicMarch(law).settle(motion, basis, weights, lead)
    np.testing.assert_allclose(cycle.force[..., :2], KT * motion[..., :2], atol=1e-12)
    np.testing.assert_allclose(cycle.force[:, 1:, 2], 13.0 * motion[:, 1:, 2], atol=1e-12)
    np.testing.assert_allclose(cycle.force[:, 0, 2], 100.0 + 13.0 * motion[:, 0, 2], rtol=1e-13)
    stiffness = np.einsum("mn,de->mdne", np.eye(5), np.diag([KT, KT, 13.0]))
    np.testing.assert_allclose(
        cycle.jacobian, np.broadcast_to(stiffness, (3, 5, 3, 5, 3)), atol=1e-11
    )
    assert np.all(cycle.states == STICK)
    assert np.all(cycle.dissipated == 0.0)


def test_an_open_contact_is_nothing():
    law = CONTACTS["with a gap"]
    motion, functions = random_motion(5, 3, (0, 1), 3, 1e-3)
    cycle = PeriodicMarch(law).settle(motion, *functions)
    assert np.all(cycle.states == SEPARATED)
    for nothing in (cycle.force, cycle.jacobian, cycle.samples, cycle.dissipated):
        assert not nothing.any()


def test_slow_forgetting_is_not_waited_for():
    """A contact that hardly slips in a period settles as after a hundred thousand periods."""
    law = CONTACTS["constant load"]
    basis, weights, lead = fourier((0, 1), 32)
    motion = np.zeros((1, 3, 3))
    motion[0, 0] = (0.3 * REACH, 0.2 * REACH, 0.0)
    motion[0, 1, 0] = 1.02 * REACH
    cycle = check_derivative(law, motion, basis, weights, lead)
    way = (basis @ motion).transpose(1, 0, 2)
    state, here = law.rest(1), np.zeros((1, 3))
    state = law.respond(state, motion[:, 0]).state
    here = motion[:, 0]
    for _ in range(3000):
        history = march_joints(law, state, here, way)
        state, here = history.state, way[-1]
    # Across the motion the stretch decays like exp(-0.04 n).
    np.testing.assert_allclose(cycle.samples[:, 0], history.force[:, 0], atol=1e-9 * MU * LOAD)
    assert cycle.change.max() <= 1e-12


def test_joints_are_independent_and_may_share_threads():
    law = CONTACTS["preloaded"]
    motion, functions = random_motion(6, 7, (0, 1, 3), 3, REACH)
    unlike = replace(law, friction=np.linspace(0.2, 0.8, 7))
    together = PeriodicMarch(unlike).settle(motion, *functions)
    shared = PeriodicMarch(unlike, threads=3).settle(motion, *functions)
    for joint in range(7):
        alone = PeriodicMarch(replace(law, friction=float(unlike.friction[joint]))).settle(
            motion[joint : joint + 1], *functions
        )
        np.testing.assert_array_equal(alone.force[0], together.force[joint])
        np.testing.assert_array_equal(alone.jacobian[0], together.jacobian[joint])
    np.testing.assert_array_equal(shared.jacobian, together.jacobian)
    np.testing.assert_array_equal(shared.samples, together.samples)


def test_shapes_that_do_not_fit_are_refused():
    motion, (basis, weights, lead) = random_motion(7, 2, (0, 1), 1, 1.0)
    joints = PeriodicMarch(ONE_DIRECTION["jenkins"])
    with pytest.raises(JointError, match="directions"):
        PeriodicMarch(CONTACTS["touching"]).settle(motion, basis, weights, lead)
    with pytest.raises(JointError, match="they must be"):
        joints.settle(motion, basis[:, :2], weights, lead)
    with pytest.raises(JointError, match="parameters of 3 joints"):
        PeriodicMarch(Jenkins(np.ones(3), MU, LOAD)).settle(motion, basis, weights, lead)
