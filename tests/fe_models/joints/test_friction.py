"""Structural friction: small joints against independent solvers, and Coulomb's law node by node."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.joints.joint import JointStiffness
from sa_solver.errors import InputError
from tests.marks import slow

NODES = 4
# Error due to the solver's TOLERANCE of the load, which carries over to the forces here.
FORCES = 1e-5

# Angles between the steepest and the flattest flanks are run by `make test-full`.
ANGLES = [35, *(slow(angle) for angle in (45, 55, 65))]


def small_joint(rng, nodes=NODES, plane=False):
    """Return a random positive definite joint, pressed at most nodes and pulled sideways."""
    factor = rng.standard_normal((3 * nodes, 3 * nodes))
    stiffness = factor @ factor.T / (3 * nodes) + np.eye(3 * nodes)
    loads = rng.standard_normal((nodes, 3))
    # With H w + f0 = f on body 2, a positive f0 is one that presses.
    loads[:, 2] += 1.0
    if plane:
        across = np.arange(3 * nodes) % 3 == 1
        stiffness[np.ix_(across, ~across)] = stiffness[np.ix_(~across, across)] = 0.0
        loads[:, 1] = 0.0
    values = np.linalg.eigvalsh(stiffness)
    return JointStiffness(stiffness, loads.reshape(-1, 1), 0, values[0], values[-1])


def one_increment(joint, mu, gap, previous=None):
    (state,) = FrictionalJoint(joint.resolvent(), mu).march(np.ones((1, 1)), gap, previous)
    assert state.converged
    return state


def enumerated(joint, mu, gap):
    """Return all solutions in the plane (x, z), found by trying every status of every node.

    Statuses are separated, stuck, sliding to +x, and sliding to -x.
    """
    nodes = len(gap)
    solutions = []
    for statuses in itertools.product("ospm", repeat=nodes):
        # Unknowns w and f (x and z of each node): elastic relation and two conditions per node.
        keep = np.arange(3 * nodes).reshape(-1, 3)[:, [0, 2]].ravel()
        size = 2 * nodes
        system = np.zeros((2 * size, 2 * size))
        right = np.zeros(2 * size)
        system[:size, :size] = joint.stiffness[np.ix_(keep, keep)]
        system[:size, size:] = -np.eye(size)
        right[:size] = -joint.loads[keep, 0]
        for node, status in enumerate(statuses):
            x, z = 2 * node, 2 * node + 1
            first, second = size + x, size + z
            if status == "o":
                system[first, size + x] = system[second, size + z] = 1.0
                continue
            system[second, z], right[second] = 1.0, -gap[node]
            if status == "s":
                system[first, x] = 1.0
            else:
                system[first, size + x] = 1.0
                system[first, size + z] = mu if status == "p" else -mu
        w, f = np.linalg.solve(system, right).reshape(2, nodes, 2)
        allowed = {
            "o": lambda w, f, g: g + w[1] > 0.0,
            "s": lambda w, f, g: f[1] >= 0.0 and abs(f[0]) <= mu * f[1],
            "p": lambda w, f, g: f[1] >= 0.0 and w[0] > 0.0,
            "m": lambda w, f, g: f[1] >= 0.0 and w[0] < 0.0,
        }
        if all(allowed[s](*args) for s, args in zip(statuses, zip(w, f, gap, strict=True),
                                                    strict=True)):  # fmt: skip
            solutions.append((statuses, f))
    return solutions


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("mu", [0.0, 0.3, 0.8])
def test_against_every_combination_of_statuses(seed, mu):
    rng = np.random.default_rng(seed)
    joint = small_joint(rng, plane=True)
    gap = 0.2 * rng.random(NODES)
    ((_, expected),) = enumerated(joint, mu, gap)
    state = one_increment(joint, mu, gap)
    np.testing.assert_allclose(state.force[[0, 2]].T, expected, atol=FORCES)
    np.testing.assert_allclose(state.force[1], 0.0, atol=FORCES)


def gauss_seidel(joint, mu, gap, previous, sweeps=4000):
    """Return forces by projected Gauss-Seidel on the compliance, node after node."""
    compliance = np.linalg.inv(joint.stiffness)
    load = joint.loads[:, 0]
    force = np.zeros_like(load)
    for _ in range(sweeps):
        before = force.copy()
        for node in range(len(gap)):
            dofs = slice(3 * node, 3 * node + 3)
            step = 0.7 / np.linalg.eigvalsh(compliance[dofs, dofs])[-1]
            w = compliance[dofs] @ (force - load)
            force[dofs.start + 2] = max(0.0, force[dofs.start + 2] - step * (w[2] + gap[node]))
            shear = force[dofs][:2] - step * (w[:2] - previous[:2, node])
            limit = mu * force[dofs.start + 2]
            size = np.linalg.norm(shear)
            force[dofs.start : dofs.start + 2] = shear * min(1.0, limit / max(size, 1e-300))
        if np.abs(force - before).max() < 1e-13:
            return force.reshape(-1, 3)
    raise AssertionError("Gauss-Seidel did not converge")


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("mu", [0.0, 0.2, 0.6])
def test_against_projected_gauss_seidel(seed, mu):
    """Compare in three dimensions, from a displaced state."""
    rng = np.random.default_rng(100 + seed)
    joint = small_joint(rng)
    gap, previous = 0.2 * rng.random(NODES), 0.1 * rng.standard_normal((3, NODES))
    state = one_increment(joint, mu, gap, previous)
    expected = gauss_seidel(joint, mu, gap, previous)
    np.testing.assert_allclose(state.force.T, expected, atol=FORCES)


def test_single_node_in_closed_form():
    """Check a spring k under N and T: stuck below µN, else sliding by (T - µN)/k."""
    k, normal, mu = 1000.0, 10.0, 0.5
    for pull in (3.0, -3.0, 8.0, -8.0):
        loads = np.array([[pull], [0.0], [normal]])
        joint = JointStiffness(k * np.eye(3), loads, 0, k, 2 * k)
        state = one_increment(joint, mu, np.zeros(1))
        shear = np.sign(pull) * min(abs(pull), mu * normal)
        np.testing.assert_allclose(state.force[:, 0], [shear, 0.0, normal], rtol=1e-5, atol=1e-5)
        # f = k w + pull, so the node has moved by (shear - pull) / k: against the shear.
        np.testing.assert_allclose(state.slip[0, 0], (shear - pull) / k, atol=1e-7)


def test_loaded_and_unloaded_node_keeps_its_shear():
    """Check hysteresis of one node: after release the spring holds min(T-µN, µN)."""
    k, normal, mu, pull = 1000.0, 10.0, 0.5, 8.0
    loads = np.array([[0.0, pull], [0.0, 0.0], [normal, 0.0]])
    joint = JointStiffness(k * np.eye(3), loads, 0, k, 2 * k)
    path = np.array([[1.0, 1.0], [1.0, 0.0]])
    _, released = FrictionalJoint(joint.resolvent(), mu).march(path, np.zeros(1))
    left = mu * normal - pull
    np.testing.assert_allclose(released.force[:, 0], [left, 0.0, normal], atol=1e-5)
    np.testing.assert_allclose(released.slip, 0.0, atol=1e-7)


def test_constant_and_absent_load():
    """Check that without load nothing happens, and that a constant load changes nothing."""
    joint = small_joint(np.random.default_rng(0))
    path = np.array([[0.0], [0.0], [1.0], [1.0], [1.0]])
    states = list(FrictionalJoint(joint.resolvent(), 0.3).march(path, np.zeros(NODES)))
    assert all(state.converged for state in states)
    for state in states[:2]:
        np.testing.assert_allclose(state.force, 0.0, atol=1e-8)
    for state in states[3:]:
        np.testing.assert_allclose(state.force, states[2].force, atol=FORCES)
        np.testing.assert_allclose(state.slip, 0.0, atol=FORCES)


def check_coulomb(state, mu, gap):
    """Check complementarity and Coulomb's law, which the splitting satisfies exactly."""
    shear, pressure = state.force[:2], state.force[2]
    opening = gap + state.displacement[2]
    length = np.abs(state.displacement).max()
    assert pressure.min() >= 0.0
    assert opening.min() >= -1e-12 * length
    assert np.all(pressure * opening <= 1e-12 * length * pressure.max())
    size, slip = np.linalg.norm(shear, axis=0), np.linalg.norm(state.slip, axis=0)
    assert np.all(size <= mu * pressure * (1.0 + 1e-12))
    dissipated = -np.sum(shear * state.slip, axis=0)
    scale = pressure.max() * length
    # A node slips against its shear or not at all; one below the limit not at all.
    np.testing.assert_allclose(dissipated, size * slip, atol=1e-12 * scale)
    assert dissipated.min() >= -1e-12 * scale
    stuck = size < mu * pressure * (1.0 - 1e-9)
    assert np.all(slip[stuck] <= 1e-12 * length)


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.4, 0.8])
@pytest.mark.parametrize("angle", ANGLES)
def test_dovetail_obeys_every_law(structure_of, solved, mission, angle, mu):
    """Check every node of every increment; at 35° and µ 0.8 the joint locks itself."""
    changes = {"flank_angle": np.deg2rad(angle)}
    structure, joint = structure_of(**changes)
    cycle = solved(mu, mission, **changes)
    assert cycle.converged
    assert cycle.residual <= friction.TOLERANCE
    assert cycle.equilibrium.max() <= 1e-6
    marched = FrictionalJoint(joint.resolvent(), mu).march(
        mission.amplitudes(), structure.gap(), None, cycle.states
    )
    for state, amplitudes in zip(marched, mission.amplitudes(), strict=True):
        assert state.converged
        check_coulomb(state, mu, structure.gap())
        load = joint.loads @ amplitudes
        elastic = joint.stiffness @ state.displacement.T.ravel() + load
        floor = friction.LOAD_FLOOR * np.linalg.norm(joint.loads @ mission.amplitudes()[7])
        # Forces and displacements belong to each other as far as the splitting has converged:
        # its residual is that of (H + ρ) w / ρ.
        allowed = 2.0 * joint.largest / joint.resolvent().rho * friction.TOLERANCE
        error = np.linalg.norm(elastic - state.force.T.ravel())
        assert error <= allowed * max(np.linalg.norm(load), floor)


def test_previous_continues_a_path(structure, joint, mission):
    """Check that a path in one go equals the path in two parts."""
    frictional = FrictionalJoint(joint.resolvent(), 0.4)
    amplitudes, gap = mission.amplitudes(), structure.gap()
    whole = list(frictional.march(amplitudes, gap))
    part = list(frictional.march(amplitudes[:8], gap))
    rest = list(frictional.march(amplitudes[8:], gap, part[-1].displacement))
    largest = max(np.abs(state.force).max() for state in whole)
    for one, two in zip(whole, part + rest, strict=True):
        np.testing.assert_allclose(two.force, one.force, atol=1e-4 * largest)


def test_guess_changes_nothing(structure, joint, mission):
    """Check that even a bad guess does not change the solution."""
    frictional = FrictionalJoint(joint.resolvent(), 0.4)
    amplitudes, gap = mission.amplitudes(), structure.gap()
    plain = list(frictional.march(amplitudes, gap))
    size = max(np.abs(state.state).max() for state in plain)
    rng = np.random.default_rng(0)
    guess = [state.state + 0.3 * size * rng.standard_normal(len(state.state)) for state in plain]
    largest = max(np.abs(state.force).max() for state in plain)
    for one, two in zip(plain, frictional.march(amplitudes, gap, None, guess), strict=True):
        assert two.converged
        np.testing.assert_allclose(two.force, one.force, atol=1e-4 * largest)


def test_cycle_that_follows_another_repeats_it(structure, joint, solved, mission):
    """Check that the second cycle is closed: a third one is the same."""
    cycle = solved(0.4, mission)
    frictional = FrictionalJoint(joint.resolvent(), 0.4)
    third = structure.solve_cycle(
        frictional, mission.amplitudes(), structure.gap(), 0.4, after=cycle
    )
    assert cycle.closure < 1e-4
    assert third.closure == 0.0
    for one, two in zip(cycle.histories, third.histories, strict=True):
        largest = np.abs(one.force).max()
        np.testing.assert_allclose(two.force, one.force, atol=1e-4 * largest)


def test_too_few_iterations_are_reported(structure, joint, mission, monkeypatch):
    monkeypatch.setattr(friction, "MAX_ITERATIONS", 2)
    frictional = FrictionalJoint(joint.resolvent(), 0.4)
    cycle = structure.solve_cycle(frictional, mission.amplitudes(), structure.gap(), 0.4)
    assert not cycle.converged
    assert cycle.residual > friction.TOLERANCE


def test_free_shape_of_the_joint_does_not_matter(joint):
    """Check that doubling stiffness and loads doubles the forces and keeps the motion."""
    doubled = replace(
        joint,
        stiffness=2.0 * np.asarray(joint.stiffness),
        loads=2.0 * joint.loads,
        smallest=2.0 * joint.smallest,
        largest=2.0 * joint.largest,
    )
    gap, amplitudes = np.zeros(len(joint.stiffness) // 3), np.array([[4e5, 3e4]])
    (one,) = FrictionalJoint(joint.resolvent(), 0.4).march(amplitudes, gap)
    (two,) = FrictionalJoint(doubled.resolvent(), 0.4).march(amplitudes, gap)
    np.testing.assert_allclose(two.force, 2.0 * one.force, atol=1e-5 * np.abs(two.force).max())


@pytest.mark.parametrize("distance", [1e-4, 1e-3, 1e-2, 1.0])
def test_floating_body_that_starts_apart_arrives(distance):
    """Check a body held along z by the contact only: its start does not matter."""
    joint = small_joint(np.random.default_rng(4))
    up = np.tile([0.0, 0.0, 1.0], NODES)
    pushed = joint.stiffness @ up
    floating = joint.stiffness - np.outer(pushed, pushed) / (up @ pushed)
    values = np.linalg.eigvalsh(floating)
    loads = (pushed / (up @ pushed))[:, None]
    free = JointStiffness(floating, loads, 1, float(values[1]), float(values[-1]))
    gap = distance + 1e-4 * np.random.default_rng(5).random(NODES)
    (state,) = FrictionalJoint(free.resolvent(), 0.5).march(np.array([[17.0]]), gap)
    assert state.converged
    assert state.force[2].sum() == pytest.approx(17.0, rel=1e-6)
    assert np.all(gap + state.displacement[2] > -1e-9 * distance)


def test_sticking_nodes_have_no_slip_and_none_gains_energy(structure, joint, mission):
    """Check signs to the last bit, component by component."""
    amplitudes = mission.amplitudes()
    for state in FrictionalJoint(joint.resolvent(), 0.4).march(amplitudes, structure.gap()):
        assert np.all(state.force[:2] * state.slip <= 0.0)
        pressed = state.force[2] > 0.0
        inside = np.hypot(*state.force[:2]) < 0.4 * state.force[2] * (1.0 - 1e-12)
        assert not state.slip[:, pressed & inside].any()


@pytest.mark.slow
def test_worn_faces_meet_under_a_light_load(structure, joint, mission):
    """Check a first load of 1/5000 of the largest on deeply worn faces."""
    amplitudes, gap = mission.amplitudes(), structure.gap()
    frictional = FrictionalJoint(joint.resolvent(), 0.4)
    light = np.concatenate([2e-4 * amplitudes[7:8], amplitudes])
    before = list(frictional.march(light, gap))
    worn = gap + 6e-3 * (1.0 - 0.5 * gap / gap.max())
    end = before[-1].displacement
    first = next(frictional.march(light, worn, end, [s.state for s in before]))
    assert first.converged
    assert first.iterations < 100
    # The reference starts from a high pressure and takes small steps.
    (state,) = frictional.march(light[8:9], worn, end)
    for load in np.geomspace(0.6, 2e-4, 16)[:, None] * light[8:9]:
        (state,) = frictional.march(load[None], worn, end, [state.state])
        assert state.converged
        assert state.iterations < 100
    np.testing.assert_allclose(first.force, state.force, atol=1e-4 * np.abs(first.force).max())


SPRINGS = JointStiffness(100.0 * np.eye(3), np.eye(3)[:, [2, 0]], 0, 100.0, 100.0)
PATH = np.array([[10.0, 3.0], [10.0, 6.0]])


def marched(path=PATH, gap=(0.0,), mu=0.4):
    return [
        state.force[0, 0] for state in FrictionalJoint(SPRINGS.resolvent(), mu).march(path, gap)
    ]


@pytest.mark.parametrize("path", [PATH.tolist(), PATH.astype(int), np.asfortranarray(PATH)])
def test_a_path_is_any_array(path):
    assert marched(path) == pytest.approx([3.0, 4.0])


@pytest.mark.parametrize(
    "given",
    [
        {"path": np.ma.array(PATH, mask=PATH > 5.0)},
        {"path": np.where(PATH > 5.0, np.nan, PATH)},
        {"path": PATH[0]},
        {"path": PATH[:, :1]},
        {"gap": np.ma.array([0.0], mask=[True])},
        {"gap": [np.inf]},
        {"gap": np.zeros(3)},
        {"gap": 0.0},
        {"mu": -0.4},
        {"mu": np.nan},
        {"mu": [-0.4]},
        {"mu": "0.4"},
    ],
)
def test_what_has_no_meaning_is_refused(given):
    with pytest.raises(InputError):
        marched(**given)
