"""Load control up to gross slip: a shear force of µP, and the moment that friction can carry.

Below, the contact sticks somewhere and its displacement is finite. Above, no equilibrium exists:
the load is refused with the largest that can be carried or, where the energy of the increment is
known, the contact slides by it.
"""

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.reference.torsion import TwistedSphere
from sa_solver.tangential.contact import FrictionLimitError
from sa_solver.types import ElasticPair, Grid, Material
from tests.limits.conditions import frictional_error
from tests.limits.scenes import ALIKE, BOTH, FRICTION, PAIRS, RADIUS, SOLVED, P, sphere


def cylinder(kind, cells=128):
    """Return a line contact that takes two thirds of its grid under P, and its gap."""
    pair = PAIRS[kind]
    half = np.sqrt(4.0 * P * RADIUS / (np.pi * pair.contact_modulus))
    grid = Grid.line_contact(3.0 * half, cells)
    return FrictionalContact(HalfSpace(grid, pair), FRICTION, SOLVED), grid.x**2 / (2.0 * RADIUS)


def pressed_on(scene, kind, *cells):
    """Return the contact of a scene, its gap, and the state under P."""
    contact, height = scene(kind, *cells)
    return contact, height, contact.advance(contact.unloaded_state(height), height, load())


def load(Qx=0.0, Mz=0.0, energy=None):
    return ContactLoad(np.array([P, Qx, 0.0, 0.0, 0.0, Mz]), energy=energy)


# --- Q = µP --------------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("build", [sphere, cylinder])
def test_below_the_friction_of_the_load_the_contact_holds(build, kind):
    contact, height, pressed = pressed_on(build, kind)
    given = load(Qx=0.999 * FRICTION * P)
    state = contact.advance(pressed, height, given)
    assert state.converged
    assert not state.sliding
    assert frictional_error(contact, pressed, height, state, given) < 3.0 * SOLVED
    assert state.resultants[1] == pytest.approx(given.values[1], abs=3.0 * SOLVED * P)


@BOTH
@pytest.mark.parametrize("build", [sphere, cylinder])
def test_above_it_the_load_is_refused_with_the_largest(build, kind):
    contact, height, pressed = pressed_on(build, kind)
    with pytest.raises(FrictionLimitError, match=r"cannot carry .*lower the force") as info:
        contact.advance(pressed, height, load(Qx=1.001 * FRICTION * P))
    assert info.value.share == pytest.approx(1.0 / 1.001, rel=1e-7)


def test_the_stick_zone_closes_as_in_mindlins_solution():
    """c/a = (1 - Q/µP)^(1/3), 0.1 at 0.999, to a cell; displacement to 1e-3 (21 cells in a).

    At Q = µP itself every cell is at its limit and the displacement is the last finite one.
    """
    contact, height, pressed = pressed_on(sphere, "alike", 64)
    exact = ShearedSphere(P, RADIUS, ALIKE, ALIKE, FRICTION)
    shifts = []
    for share in (0.9, 0.999, 1.0):
        state = contact.advance(pressed, height, load(Qx=share * FRICTION * P))
        assert state.converged
        shifts.append(state.rigid[1])
        assert state.rigid[1] == pytest.approx(exact.displacement(share * FRICTION * P), rel=1e-3)
        if share < 1.0:
            stuck = np.sqrt(np.count_nonzero(state.sticking) * contact.grid.cell_area / np.pi)
            wanted = exact.stick_radius(share * FRICTION * P)
            assert stuck == pytest.approx(wanted, abs=contact.grid.pitch[0])
    assert np.all(np.diff(shifts) > 0.0)
    np.testing.assert_allclose(state.shear[0], FRICTION * state.pressure, atol=1e-5)


@pytest.mark.parametrize("off", [-1e-10, -1e-13, 0.0, 1e-13])
def test_at_the_limit_rounding_does_not_choose_a_motion(off):
    """With Poisson's ratio no motion suffices at Q = µP; it once was 10 mm for a radius of 0.1."""
    grid = Grid.covering((0.6, 0.6), (32, 32))
    steel = Material(200e3, 0.3)
    contact = FrictionalContact(HalfSpace(grid, ElasticPair(steel, steel)), 0.3)
    height = (grid.x**2 + grid.y**2) / 40.0
    pressed = contact.advance(
        contact.unloaded_state(height), height, ContactLoad(10.0 * np.eye(6)[0])
    )
    values = np.array([10.0, 3.0 * (1.0 + off), 0.0, 0.0, 0.0, 0.0])
    with pytest.raises(FrictionLimitError, match="without sliding") as info:
        contact.advance(pressed, height, ContactLoad(values))
    assert info.value.share == pytest.approx(1.0, rel=1e-7)


@pytest.mark.slow
def test_dissimilar_bodies_at_the_friction_limit_converge_or_report_why_not():
    contact, height, pressed = pressed_on(sphere, "unlike", 16)
    given = load(Qx=(1.0 - 1e-9) * FRICTION * P)
    state = contact.advance(pressed, height, given)
    if state.converged:
        assert frictional_error(contact, pressed, height, state, given) < 3.0 * SOLVED
    else:
        assert "all that friction can carry" in state.message
        assert "impose the sliding motion" in state.message


@BOTH
@pytest.mark.parametrize("share", [0.98, 1.001])
def test_with_its_energy_known_it_slides_past_the_border(kind, share):
    """Inside, the force counts and not the energy; from 0.99 on it slides by the energy."""
    contact, height, pressed = pressed_on(sphere, kind)
    energy = np.array([0.5, 0.0])
    given = load(Qx=share * FRICTION * P, energy=energy)
    state = contact.advance(pressed, height, given)
    assert state.converged
    assert state.sliding == (share > 0.99)
    if state.sliding:
        assert state.energy.sum() == pytest.approx(energy.sum(), rel=1e-5)
        assert not state.sticking.any()
        # Poisson's ratio turns some shear sideways: of the order of a per cent of µP.
        assert state.resultants[1] == pytest.approx(FRICTION * P, rel=0.01)
        assert state.resultants[1] <= FRICTION * P * (1.0 + SOLVED)
    else:
        assert state.resultants[1] == pytest.approx(given.values[1], abs=3.0 * SOLVED * P)


@BOTH
def test_without_friction_no_shear_force_at_all(kind):
    pair = PAIRS[kind]
    grid = Grid.covering((0.6, 0.6), (12, 12))
    height = (grid.x**2 + grid.y**2) / (2.0 * RADIUS)
    contact = FrictionalContact(HalfSpace(grid, pair), 0.0)
    pressed = contact.advance(contact.unloaded_state(height), height, load())
    assert contact.advance(pressed, height, load()).converged
    with pytest.raises(FrictionLimitError, match=r"friction coefficient is 0|µP = 0 N"):
        contact.advance(pressed, height, load(Qx=1e-3))


# --- Mz ------------------------------------------------------------------------------------------


def grid_limit(contact, height):
    """Return Σ µp r S: the moment of friction on the cells, all turning about the middle.

    The pressure is that without friction, also for dissimilar bodies: shear along circles lifts
    nothing.
    """
    grid = contact.grid
    pressure = NormalContact(contact.half_space).solve(height, P).pressure
    return FRICTION * grid.cell_area * np.sum(pressure * np.hypot(grid.x, grid.y))


def test_the_limit_of_the_moment_is_that_of_hertz():
    """It is 3πµPa/16, to 1e-3 at 21 cells across the radius (midpoint rule of √ at the edge)."""
    contact, height, _ = pressed_on(sphere, "alike", 64)
    exact = TwistedSphere(P, RADIUS, ALIKE, ALIKE, FRICTION)
    assert grid_limit(contact, height) == pytest.approx(exact.sliding_moment, rel=1e-3)


def test_below_the_largest_moment_the_twist_is_lubkins():
    """At 0.99 of it, with a stick radius of 5 cells: twist to 1 %, shear to 1 % of µp0 (rms).

    Single cells at the kink of the stick radius are off by 4 %; twice the cells halve all errors.
    """
    contact, height, pressed = pressed_on(sphere, "alike", 64)
    exact = TwistedSphere(P, RADIUS, ALIKE, ALIKE, FRICTION)
    moment = 0.99 * exact.sliding_moment
    given = load(Mz=moment)
    state = contact.advance(pressed, height, given)
    assert frictional_error(contact, pressed, height, state, given) < 3.0 * SOLVED
    x, y = np.broadcast_arrays(contact.grid.x, contact.grid.y)
    r = np.hypot(x, y)
    along = (state.shear[1] * x - state.shear[0] * y) / r
    radial = (state.shear[0] * x + state.shear[1] * y) / r
    largest = FRICTION * exact.contact.peak_pressure
    inner = r < exact.contact.contact_radius - 2.0 * contact.grid.pitch[0]
    error = along[inner] - exact.shear(r[inner], moment)
    assert np.sqrt(np.mean(error**2)) < 0.01 * largest
    np.testing.assert_allclose(error, 0.0, atol=0.06 * largest)
    np.testing.assert_allclose(radial[inner], 0.0, atol=0.01 * largest)
    assert state.rigid[5] == pytest.approx(exact.twist(moment), rel=0.01)


@pytest.mark.parametrize("distance", [1e-2, 1e-4])
def test_the_border_of_the_moment_is_sharp(distance):
    """For a centred contact the cells' own limit is exact: the slip velocity is a rotation."""
    contact, height, pressed = pressed_on(sphere, "alike")
    limit = grid_limit(contact, height)
    inside = contact.advance(pressed, height, load(Mz=(1.0 - distance) * limit))
    assert inside.converged
    assert inside.resultants[5] == pytest.approx((1.0 - distance) * limit, rel=SOLVED)
    with pytest.raises(FrictionLimitError, match="Mz") as info:
        contact.advance(pressed, height, load(Mz=(1.0 + distance) * limit))
    assert info.value.share == pytest.approx(1.0 / (1.0 + distance), rel=1e-6)


def test_dissimilar_bodies_share_that_border():
    """A pressure that depends on shear is known only once it has been found.

    The moment is then refused, but not within 0.1 % of the border.
    """
    contact, height, pressed = pressed_on(sphere, "unlike")
    limit = grid_limit(contact, height)
    given = load(Mz=0.999 * limit)
    inside = contact.advance(pressed, height, given)
    assert inside.converged
    assert frictional_error(contact, pressed, height, inside, given) < 3.0 * SOLVED
    outside = contact.advance(pressed, height, load(Mz=1.002 * limit))
    assert not outside.converged
    assert "friction cannot carry" in outside.message
    assert "Mz" in outside.message


@BOTH
def test_a_moment_uses_up_what_the_force_may_be(kind):
    """Half the moment and all of the force are too much, half of both is not."""
    contact, height, pressed = pressed_on(sphere, kind)
    limit = grid_limit(contact, height)
    given = load(Qx=0.5 * FRICTION * P, Mz=0.5 * limit)
    state = contact.advance(pressed, height, given)
    assert frictional_error(contact, pressed, height, state, given) < 3.0 * SOLVED
    too_much = load(Qx=0.999 * FRICTION * P, Mz=0.5 * limit)
    try:
        message = contact.advance(pressed, height, too_much).message
    except FrictionLimitError as error:
        message = str(error)
    assert "friction cannot carry" in message


@BOTH
@pytest.mark.parametrize("shear", [{"Qx": 1.0}, {"Mz": 1.0}])
def test_bodies_apart_carry_neither(kind, shear):
    contact, height, pressed = pressed_on(sphere, kind, 12)
    values = load(**shear).values
    values[0] = 0.0
    with pytest.raises(FrictionLimitError, match=r"no cell is in contact|µP = 0 N"):
        contact.advance(pressed, height, ContactLoad(values))
