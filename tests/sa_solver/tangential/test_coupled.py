"""Contact of dissimilar bodies: closed forms, similarity, symmetry, energy, other methods."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import sa_solver.dissimilar.contact as coupled
import sa_solver.half_space.active_box as active_box
from sa_solver.dissimilar.contact import CoupledContact
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.rigid_modes import RigidModes
from sa_solver.tangential.contact import TangentialContact
from sa_solver.types import ElasticPair, Grid, resultants
from tests.marks import slow
from tests.oracles.alternating import AlternatingContact
from tests.sa_solver.tangential.dissimilar import (
    RADIUS,
    STEEL,
    TOLERANCE,
    P,
    cylinder,
    flat_strip,
    loads,
    rigid_on_elastic,
    sphere,
)


def march(contact, height, path, motion=coupled.ALL_FORCES):
    """Return the states along ``path``, an iterable of six values each; all must converge."""
    states, offset, start = [], None, None
    for values in path:
        state = contact.solve(height, offset, values, motion, start=start)
        assert state.converged, state.message
        states.append(state)
        offset, start = -state.displacement[:2], state.start
    return states


def sticking(state, friction):
    shear = np.hypot(*state.shear)
    return (state.pressure > 0) & (shear < friction * state.pressure * (1 - 1e-7))


def stick_share(state, friction):
    """Return the share of the pressed cells that stick, which is c/a in plane strain."""
    return sticking(state, friction).sum() / (state.pressure > 0).sum()


def assert_same(computed, expected, accuracy):
    np.testing.assert_allclose(computed, expected, rtol=0, atol=accuracy * np.abs(expected).max())


def assert_solves(contact, height, offset, state):
    """Assert every condition of the problem, from the tractions alone."""
    friction, scale = contact.friction, np.abs(state.displacement).max()
    displacement = contact.half_space.displacement(state.traction)
    rigid = RigidModes(contact.grid)
    relative = displacement - rigid.motion(state.rigid * rigid.lengths)
    relative[2] += height
    relative[:2] += 0.0 if offset is None else offset
    pressed, stuck = state.pressure > 0, sticking(state, friction)
    slipping = pressed & ~stuck
    shear, slip = state.shear, relative[:2]
    assert state.pressure.min() >= 0
    assert relative[2].min() >= -1e-7 * scale
    assert np.abs(relative[2][pressed]).max() <= 1e-6 * scale
    assert np.all(np.hypot(*shear) <= friction * state.pressure * (1 + 1e-12))
    assert np.abs(slip[:, stuck]).max(initial=0) <= 1e-6 * scale
    power = np.sum(shear * slip, axis=0)[slipping]
    bound = friction * state.pressure[slipping] * np.hypot(*slip)[slipping]
    np.testing.assert_allclose(power, -bound, atol=1e-6 * scale * state.pressure.max())


# -- it converges, and to a solution ---------------------------------------------------------
@pytest.mark.parametrize("beta", [0.05, 0.3, 0.5])
@pytest.mark.parametrize("friction", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("build", [sphere, cylinder])
def test_every_condition_is_met(build, beta, friction):
    contact, height = build(24 if build is sphere else 100, beta, friction)
    moment = 0.0 if build is cylinder else 0.05 * friction * P * height.max()
    for share in (0.0, 0.5, 0.95):
        values = loads(Qx=0.8 * share * friction * P, Qy=0.6 * share * friction * P, Mz=moment)
        state = contact.solve(height, None, values, tolerance=TOLERANCE)
        assert state.converged
        assert state.message == ""
        assert state.residuals.largest <= TOLERANCE
        assert state.convolutions < 400
        assert not state.touches_border
        np.testing.assert_allclose(state.resultants, values, atol=1e-7 * P)
        x, y = contact.grid.x, contact.grid.y
        carried = resultants(state.traction * contact.grid.cell_area, x, y)
        if build is sphere:
            np.testing.assert_allclose(state.resultants, carried, atol=1e-12 * P)
        assert_solves(contact, height, None, state)


@pytest.mark.parametrize("seed", range(8))
def test_rough_contacts_under_random_loads(seed):
    """The bodies are tilted and twisted so that the shear acts at the centre of pressure."""
    rng = np.random.default_rng(seed)
    friction = 10 ** rng.uniform(-1.5, 0.0)
    contact, height = sphere(24, rng.uniform(0.0, 0.5), friction)
    x, y = contact.grid.x, contact.grid.y
    rough = height + 0.02 * height.max() * rng.standard_normal(height.shape)
    offset, start = None, None
    for _ in range(3):
        at_x, at_y = 0.1 * rng.uniform(-1.0, 1.0, 2) * (x.max(), y.max())
        Qx, Qy = rng.uniform(-0.6, 0.6, 2) * friction * P
        values = loads(P, Qx, Qy, P * at_y, -P * at_x, Qy * at_x - Qx * at_y)
        state = contact.solve(rough, offset, values, start=start)
        assert state.converged, state.message
        assert -np.vdot(state.shear, state.slip) >= -1e-9 * P
        offset, start = -state.displacement[:2], state.start


def test_history_under_all_six_resultants():
    contact, height = sphere(24, 0.4, 0.5)
    reach = contact.grid.x.max()
    path = [
        P * np.array([0.5, 0.0, 0.0, 0.0, 0.0, 0.0]),
        P * np.array([1.0, 0.2, -0.1, 0.1 * reach, -0.05 * reach, 0.02 * reach]),
        P * np.array([0.8, -0.2, 0.1, -0.1 * reach, 0.1 * reach, -0.02 * reach]),
    ]
    states = march(contact, height, path)
    for k, (state, values) in enumerate(zip(states, path, strict=True)):
        offset = None if k == 0 else -states[k - 1].displacement[:2]
        np.testing.assert_allclose(state.resultants, values, atol=1e-7 * P)
        assert_solves(contact, height, offset, state)


# -- limits that other solvers and closed forms know ----------------------------------------
def test_without_friction_it_is_the_normal_contact():
    contact, height = sphere(32, 0.5, 0.0)
    worn = 1e-6 * (1.0 + contact.grid.x / contact.grid.size[0]) * np.ones(contact.grid.shape)
    moment = 0.1 * P * contact.grid.x.max()
    for compliance in (None, worn):
        state = contact.solve(height, None, loads(My=moment), compliance=compliance)
        normal = NormalContact(contact.half_space).solve(
            height, P, My=moment, tolerance=1e-10, compliance=compliance
        )
        assert state.converged
        assert np.array_equal(state.shear, np.zeros((2, 32, 32)))
        assert_same(state.pressure, normal.pressure, 1e-6)
        assert_same(state.gap, normal.gap, 1e-7)
        assert state.rigid[0] == pytest.approx(normal.approach, rel=1e-7)
        assert state.rigid[4] == pytest.approx(normal.tilt_y, rel=1e-6)


def test_similar_bodies_are_pressed_first_and_then_sheared():
    grid = Grid.covering((1.1, 1.1), (32, 32))
    half_space = HalfSpace(grid, ElasticPair(STEEL, STEEL))
    height = (grid.x**2 + grid.y**2) / (2 * RADIUS)
    friction, Qx, Mz = 0.4, 0.2 * P, 0.02 * P
    state = CoupledContact(half_space, friction).solve(height, None, loads(Qx=Qx, Mz=Mz))
    normal = NormalContact(half_space).solve(height, P, tolerance=1e-10)
    tangential = TangentialContact(half_space).solve(
        friction * normal.pressure, None, Qx, 0.0, Mz, tolerance=1e-10
    )
    assert_same(state.pressure, normal.pressure, 1e-6)
    assert_same(state.shear, tangential.shear, 1e-6)
    motions = tangential.shift_x, tangential.shift_y, tangential.twist
    np.testing.assert_allclose(state.rigid[[1, 2, 5]], motions, rtol=0, atol=1e-6 * motions[0])


def test_similar_bodies_without_shear_force_have_no_shear():
    grid = Grid.covering((1.1, 1.1), (24, 24))
    contact = CoupledContact(HalfSpace(grid, ElasticPair(STEEL, STEEL)), 0.4)
    state = contact.solve((grid.x**2 + grid.y**2) / (2 * RADIUS), None, loads())
    assert state.converged
    assert np.abs(state.shear).max() < 1e-9 * state.pressure.max()


def test_stuck_flat_punch():
    """Mossakovskii: P = 4 G a δ ln(3-4ν)/(1-2ν); without friction 4 G a δ/(1-ν).

    Here ν = 0. The ratio of the two loads hardly depends on the radius of the punch on the grid.
    """
    grid = Grid.covering((2.2, 2.2), (48, 48))
    height = np.where(np.hypot(grid.x, grid.y) < 1.0, 0.0, 1.0)
    half_space = HalfSpace(grid, rigid_on_elastic(0.5))
    smooth, stuck = (
        CoupledContact(half_space, friction).solve(height, None, loads()) for friction in (0.0, 3.0)
    )
    assert np.all(sticking(stuck, 3.0) == (stuck.pressure > 0))
    assert smooth.rigid[0] / stuck.rigid[0] == pytest.approx(np.log(3.0), rel=3e-3)


def test_stick_zone_of_a_flat_strip_for_weak_coupling():
    """K'(c/a)/K(c/a) = β/µ for small β (Goodman's approximation; Spence 1973)."""
    beta = 0.05
    for friction in (0.05, 0.1):
        contact, height = flat_strip(600, beta, friction)
        state = contact.solve(height, None, loads())
        expected = brentq(
            lambda k, ratio=beta / friction: ellipk(1 - k**2) - ratio * ellipk(k**2), 0.01, 0.9999
        )
        assert stick_share(state, friction) == pytest.approx(expected, abs=0.008)


@pytest.mark.parametrize("beta", [0.3, slow(0.5)])
def test_punch_and_growing_contacts_share_one_stick_zone(beta):
    """Spence 1968: c/a is the same for every power-law profile under a growing load.

    A flat punch is solved in one step and has no increments to refine. For a cylinder c/a
    approaches that of the punch as the increments are refined, and is constant while the load
    grows.
    """
    friction = beta
    contact, height = flat_strip(400, beta, friction)
    punch = stick_share(contact.solve(height, None, loads()), friction)
    contact, height = cylinder(200, beta, friction)
    errors = []
    for count in (4, 16):
        path = [loads((k / count) ** 2 * P) for k in range(1, count + 1)]
        half, *_, full = march(contact, height, path)[count // 2 - 1 :]
        errors.append(punch - stick_share(full, friction))
    assert 0 < errors[1] < 0.4 * errors[0]
    assert errors[1] < 0.03
    assert stick_share(half, friction) == pytest.approx(stick_share(full, friction), abs=0.03)


def test_one_step_and_many_differ():
    """Loading of dissimilar bodies depends on the path: less sticks after a single step."""
    contact, height = sphere(32, 0.5, 0.5)
    one = contact.solve(height, None, loads())
    many = march(contact, height, [loads(k / 6 * P) for k in range(1, 7)])[-1]
    assert stick_share(many, 0.5) > stick_share(one, 0.5) + 0.1


@pytest.mark.parametrize("friction", [0.2, slow(1.0)])
def test_adjusting_in_turns_gives_the_same(friction):
    """The alternating iteration, where it converges, is an independent method."""
    contact, height = sphere(24, 0.5, friction)
    values = loads(Qx=0.5 * friction * P)
    together = contact.solve(height, None, values, tolerance=1e-9)
    in_turns = AlternatingContact(contact.half_space, friction).solve(height, None, values)
    assert in_turns.converged
    assert_same(together.traction, in_turns.traction, 1e-5)
    assert_same(together.displacement, in_turns.displacement, 1e-6)


def test_newton_and_the_splitting_find_the_same(monkeypatch):
    """The two methods share only the half-space and the residuals."""
    contact, height = sphere(24, 0.4, 0.3)
    path = [loads(), loads(Qx=0.7 * 0.3 * P, Mz=0.5)]
    by_newton = march(contact, height, path)
    monkeypatch.setattr(coupled, "NEWTON_ITERATIONS", 0)
    by_splitting = march(contact, height, path)
    for one, other in zip(by_newton, by_splitting, strict=True):
        assert one.iterations < other.iterations
        assert_same(one.traction, other.traction, 1e-6)
        assert_same(one.displacement, other.displacement, 1e-7)


def test_a_contact_that_outgrows_its_box_is_that_of_the_whole_grid(monkeypatch):
    """The initial guess covers a tenth of the cells; a second contact has formed since."""
    contact, height = sphere(48, 0.4, 0.5, width=6.0)
    small = contact.solve(height, None, loads(0.05 * P))
    x, y = contact.grid.x / contact.grid.size[0], contact.grid.y / contact.grid.size[1]
    bump = 0.9 * height.max() * np.exp(-((x - 0.4) ** 2 + (y - 0.4) ** 2) / 0.005)
    values = loads(0.5 * P)
    in_boxes = contact.solve(height - bump, None, values, start=small.start)
    monkeypatch.setattr(active_box, "LARGEST_SHARE", 0.0)
    on_all = contact.solve(height - bump, None, values)
    assert in_boxes.converged
    assert on_all.converged
    assert (in_boxes.pressure[36:, 36:] > 0.0).any()
    assert_same(in_boxes.traction, on_all.traction, 1e-6)


# -- symmetry ---------------------------------------------------------------------------------
def test_swapping_the_bodies_reverses_shear_and_nothing_else():
    contact, height = sphere(24, 0.3, 0.4)
    pair = contact.half_space.pair
    half_space = HalfSpace(contact.grid, ElasticPair(pair.body_2, pair.body_1))
    swapped = CoupledContact(half_space, 0.4)
    values = loads(Qx=10.0, Qy=5.0, My=2.0, Mz=1.0)
    turn = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0])
    state = contact.solve(height, None, values)
    other = swapped.solve(height, None, turn * values)
    assert_same(other.pressure, state.pressure, 1e-6)
    assert_same(other.shear, -state.shear, 1e-6)
    np.testing.assert_allclose(other.rigid, turn * state.rigid, atol=1e-6 * state.rigid[0])


def test_shear_turns_with_the_load():
    contact, height = sphere(24, 0.4, 0.4)
    along_x = contact.solve(height, None, loads(Qx=20.0))
    along_y = contact.solve(height, None, loads(Qy=20.0))
    assert_same(along_y.traction[[1, 0, 2]].swapaxes(1, 2), along_x.traction, 1e-6)
    diagonal = contact.solve(height, None, loads(Qx=14.0, Qy=14.0))
    assert_same(diagonal.traction[[1, 0, 2]].swapaxes(1, 2), diagonal.traction, 1e-6)


def test_pressing_alone_shears_towards_or_from_the_centre():
    """Pressure draws in body 2, the more compliant one, and friction resists this."""
    for build, cells in ((sphere, 24), (cylinder, 100)):
        contact, height = build(cells, 0.4, 0.4)
        state = contact.solve(height, None, loads())
        outwards = state.shear[0] * contact.grid.x + state.shear[1] * contact.grid.y
        pressed = state.pressure > 0
        assert outwards[pressed].min() > -1e-6 * state.pressure.max() * contact.grid.x.max()
        for axis in (0, 1):
            sign = np.array([-1.0 if k == axis else 1.0 for k in range(3)])[:, None, None]
            assert_same(sign * np.flip(state.traction, 1 + axis), state.traction, 1e-6)


# -- energy -----------------------------------------------------------------------------------
@pytest.mark.parametrize("build", [sphere, cylinder])
def test_dissipation_is_the_work_of_the_shear_forces_less_what_is_stored(build):
    """In each increment -Σ q·Δs S = Q·Δδ + Mz Δφz - Σ q·Δu S >= 0."""
    contact, height = build(24 if build is sphere else 100, 0.4, 0.4)
    path = [loads(k / 3 * P) for k in (1, 2, 3)]
    path += [loads(Qx=0.3 * P * np.sin(angle)) for angle in np.linspace(0.5, 6.0, 8)]
    area, before = contact.grid.cell_area, np.zeros((3, *contact.grid.shape))
    total, scale = 0.0, P * RADIUS * 1e-3
    for state in march(contact, height, path):
        dissipated = -np.vdot(state.shear, state.slip) * area
        change = state.displacement[:2] - before[:2]
        shear_work = state.resultants[[1, 2, 5]] @ state.rigid[[1, 2, 5]]
        assert dissipated >= -1e-9 * scale
        balance = shear_work - np.vdot(state.shear, change) * area
        assert dissipated == pytest.approx(balance, abs=1e-9 * scale)
        total, before = total + dissipated, state.displacement
    assert total > 1e-4 * scale


# -- control, starts, time --------------------------------------------------------------------
@pytest.mark.parametrize("build", [sphere, cylinder])
def test_imposing_the_motions_found_gives_the_forces_back(build):
    contact, height = build(24 if build is sphere else 100, 0.4, 0.5)
    values = loads(Qx=20.0, Qy=10.0, My=1.0) if build is cylinder else loads(P, 20, 10, 2, 1, 1)
    by_force = contact.solve(height, None, values, tolerance=1e-9)
    moved = [(True,) * 6, (True, False, True, False, True, False)]
    for motion in moved:
        mixed = np.where(motion, by_force.rigid, values)
        by_motion = contact.solve(height, None, mixed, motion, tolerance=1e-9)
        assert by_motion.converged
        np.testing.assert_allclose(by_motion.resultants, values, atol=1e-5 * P)
        np.testing.assert_allclose(by_motion.rigid, by_force.rigid, atol=1e-7 * by_force.rigid[0])
        assert_same(by_motion.traction, by_force.traction, 1e-5)


def test_a_large_imposed_shift_slides_everywhere():
    contact, height = sphere(24, 0.4, 0.5)
    values = loads()
    values[1] = 1.0
    motion = (False, True, False, False, False, False)
    state = contact.solve(height, None, values, motion)
    assert state.converged
    assert not sticking(state, 0.5).any()
    assert state.resultants[1] == pytest.approx(0.5 * P, rel=1e-3)


def test_an_imposed_mismatch_shears_the_contact():
    """Antisymmetric shear resists a stretch of the surfaces by bulk stress."""
    contact, height = cylinder(100, 0.2, 0.5)
    first = contact.solve(height, None, loads())
    offset = -first.displacement[:2]
    same = contact.solve(height, offset, loads())
    offset[0] += 2e-3 * contact.grid.x
    stretched = contact.solve(height, offset, loads())
    assert stretched.converged
    assert_same(same.traction, first.traction, 1e-5)
    assert np.sum(stretched.shear[0] * contact.grid.x) < np.sum(first.shear[0] * contact.grid.x)


def test_a_start_saves_iterations_and_changes_nothing():
    contact, height = sphere(32, 0.4, 0.5)
    first = contact.solve(height, None, loads())
    again = contact.solve(height, None, loads(), start=first.start)
    assert again.iterations < 5
    offset = -first.displacement[:2]
    cold = contact.solve(height, offset, loads(Qx=20.0))
    warm = contact.solve(height, offset, loads(Qx=20.0), start=first.start)
    assert warm.convolutions < cold.convolutions
    assert_same(warm.traction, cold.traction, 1e-6)


@pytest.mark.slow
def test_iterations_hardly_grow_with_the_grid():
    counts = []
    for cells in (24, 96):
        contact, height = sphere(cells, 0.5, 0.5)
        counts.append(contact.solve(height, None, loads(Qx=0.25 * P)).iterations)
    assert counts[1] < 2.0 * counts[0]
    assert counts[1] < 40
