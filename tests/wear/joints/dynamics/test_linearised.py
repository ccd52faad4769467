"""Linearised increments of joints, which make up the derivative of the whole period."""

import numpy as np
import pytest

from fe_models.dynamics.periodic.harmonics import Resolution
from wear.joints.bouc_wen import BoucWen
from wear.joints.elastic import ElasticStop, PolynomialSpring
from wear.joints.friction_contact import FrictionContact
from wear.joints.iwan import FourParameterIwan, UniformIwan
from wear.joints.jenkins import Jenkins
from wear.joints.law import march_joints
from wear.joints.parameters import JointError
from wear.joints.periodic.march import PeriodicMarch

EXACT = 1e-11
RESOLUTION = Resolution((0, 1, 2, 3), 96)
LAWS = {
    "jenkins": Jenkins(1e4, 0.5, 100.0, 200.0),
    "bouc-wen": BoucWen(1e4, 0.5, 100.0, 200.0),
    "uniform iwan": UniformIwan(1e4, 0.5, 100.0),
    "four parameters": FourParameterIwan(1e4, 0.5, 100.0, 50.0, chi=-0.4, beta=0.7),
    "polynomial": PolynomialSpring(1e3, 2e4, 1e6, -3e7, 1e9),
    "stop": ElasticStop(1e4, 0.005),
    "stops": ElasticStop(1e4, 0.003, two_sided=True),
    "contact": FrictionContact(1e4, 2e4, 0.5, 20.0),
}


def motion(directions, seed):
    """Return coefficients of two joints that move forward and backward, with small loops."""
    sizes = np.array([1e-3, *(1e-2,) * 2, *(4e-3,) * 2, *(3e-3,) * 2])
    random = np.random.default_rng(seed)
    return sizes[None, :, None] * random.standard_normal((2, RESOLUTION.size, directions))


def derivative(march, basis, joint):
    """Return ∂F/∂c ``(t, d, m d)`` of a joint's forces, from deviations that repeat."""
    times, directions = len(basis), march.tangent.shape[2]
    moved = np.einsum("tm,de->tdme", basis, np.eye(directions)).reshape(times, directions, -1)
    whole, memory = np.eye(march.kept.shape[2]), np.zeros((march.kept.shape[2], moved.shape[2]))

    def step(at, memory):
        after = (at + 1) % times
        driven = march.by_start[at, joint] @ moved[at] + march.by_end[at, joint] @ moved[after]
        return march.kept[at, joint] @ memory + driven

    for at in range(times):
        memory, whole = step(at, memory), march.kept[at, joint] @ whole
    memory = np.linalg.lstsq(np.eye(len(whole)) - whole, memory, rcond=None)[0]
    forces = np.empty_like(moved)
    for at in range(times):
        memory, after = step(at, memory), (at + 1) % times
        forces[after] = march.pull[joint] @ memory + march.tangent[at, joint] @ moved[after]
    return forces


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_deviations_make_up_the_derivative_of_the_period(law):
    joints, basis = PeriodicMarch(law), RESOLUTION.basis
    for seed in range(3):
        coefficients = motion(joints.directions, seed)
        cycle = joints.settle(coefficients, basis, RESOLUTION.weights, RESOLUTION.lead)
        march = joints.linearise(coefficients, basis, RESOLUTION.lead)
        for joint in range(2):
            forces = derivative(march, basis, joint)
            found = np.einsum("mt,tdn->mdn", RESOLUTION.weights, forces)
            wanted = cycle.jacobian[joint].reshape(found.shape)
            np.testing.assert_allclose(found, wanted, atol=EXACT * np.abs(wanted).max())


def test_the_regime_of_a_joint_is_reported_where_it_changes():
    joints, basis = PeriodicMarch(LAWS["jenkins"]), RESOLUTION.basis
    coefficients = motion(1, 0)
    cycle = joints.settle(coefficients, basis, RESOLUTION.weights, RESOLUTION.lead)
    march = joints.linearise(coefficients, basis, RESOLUTION.lead)
    # An increment leads to the next sample, whose state is that at its end.
    slips = np.roll(march.regimes, 1, axis=0) > 0
    np.testing.assert_array_equal(slips, cycle.states == 1)


@pytest.mark.parametrize("name", ["polynomial", "stop", "stops"])
def test_elastic_joints_give_back_what_they_take(name):
    """The work along any closed path is 0; the tangent is the slope of the force."""
    law = LAWS[name]
    path = np.array([0.004, -0.02, 0.013, 0.0])[:, None, None]
    fine = np.linspace(0.0, 1.0, 4001)[1:]
    ways = [
        start + fine * (end - start)
        for start, end in zip([0.0, *path[:-1, 0, 0]], path[:, 0, 0], strict=True)
    ]
    way = np.concatenate(ways)[:, None, None]
    history = march_joints(law, law.rest(1), np.zeros((1, 1)), way)
    force = history.force[:, 0, 0]
    work = np.trapezoid(np.append(0.0, force), np.append(0.0, way[:, 0, 0]))
    largest = np.abs(force).max() * 0.02
    assert abs(work) < 1e-6 * largest
    assert not history.dissipated.any()
    state = np.array([[0.011]])
    step, here = 1e-7, law.respond(state, np.zeros((1, 1)))
    ends = [law.respond(state, np.full((1, 1), way)).force[0, 0] for way in (-step, step)]
    assert here.tangent[0, 0, 0] == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=1e-5)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: PolynomialSpring(np.nan), "coefficient"),
        (lambda: ElasticStop(0.0), "stiffness"),
        (lambda: ElasticStop(1.0, -0.1), "gap"),
        (lambda: ElasticStop(1.0, 0.1, 2), "two_sided"),
    ],
)
def test_elastic_joints_that_cannot_be_are_refused(make, named):
    with pytest.raises(JointError, match=named):
        make()
