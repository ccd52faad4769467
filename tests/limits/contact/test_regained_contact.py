"""Contact that is lost and regained within a history: friction forgets only at P = 0.

An unloaded contact keeps the shear that its last reversal locked in; separated bodies keep nothing,
and touch again as if for the first time.
"""

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.cycles.history import ContactLoadPath, march_history
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.types import ElasticPair, Grid
from tests.limits.scenes import ALIKE, BOTH, FRICTION, RADIUS, SOLVED, P, sphere
from tests.marks import slow
from wear.steps.full_cycle import march_cycle


def follow(contact, height, *loads):
    """Return the last of the states under consecutive (P, Qx)."""
    state = contact.unloaded_state(height)
    for load in loads:
        values = np.array([load[0], load[1], 0.0, 0.0, 0.0, 0.0])
        state = contact.advance(state, height, ContactLoad(values))
        assert state.converged, state.message
    return state


def test_while_pressed_it_remembers_as_in_mindlins_solution():
    """Shear locked in when Q returns to 0, to 2 % of µp0 (rms; single cells at its kinks 6 %)."""
    contact, height = sphere("alike", 48)
    state = follow(contact, height, (P, 0.0), (P, 30.0), (P, 0.0))
    exact = ShearedSphere(P, RADIUS, ALIKE, ALIKE, FRICTION)
    grid, largest = contact.grid, FRICTION * exact.contact.peak_pressure
    wanted = exact.shear_after(grid.x, grid.y, [30.0, 0.0])
    inner = np.hypot(grid.x, grid.y) < exact.contact.contact_radius - 2.0 * grid.pitch[0]
    assert np.abs(wanted).max() > 0.2 * largest
    error = state.shear[0][inner] - wanted[inner]
    assert np.sqrt(np.mean(error**2)) < 0.02 * largest
    np.testing.assert_allclose(error, 0.0, atol=0.08 * largest)


@pytest.mark.parametrize(("left", "trace"), [(0.5, True), (0.3, True), (0.2, False), (1e-3, False)])
def test_a_load_that_falls_far_enough_forgets_too(left, trace):
    """Below P' = P - Q/µ the remaining contact lies within the zone that never slipped.

    With a contact radius a (P'/P)^(1/3) below c = a (1 - Q/µP)^(1/3), nothing has moved there and
    no shear is locked in.
    """
    contact, height = sphere("alike", 48)
    assert trace == (left > 1.0 - 30.0 / (FRICTION * P))
    fresh = follow(contact, height, (P, 0.0))
    again = follow(contact, height, (P, 0.0), (P, 30.0), (left * P, 0.0), (P, 0.0))
    change = np.abs(again.shear - fresh.shear).max() / (FRICTION * fresh.pressure.max())
    assert (change > 0.01) == trace
    assert trace or change < 1e-6


@BOTH
def test_bodies_that_part_touch_again_as_new(kind):
    contact, height = sphere(kind)
    apart = follow(contact, height, (P, 0.0), (P, 30.0), (0.0, 0.0))
    assert not apart.traction.any()
    assert not apart.slip.any()
    assert not apart.sticking.any()
    assert apart.gap.min() == pytest.approx(0.0, abs=1e-15)
    for loads in ([(P, 0.0)], [(P, 0.0), (P, -30.0)], [(0.5 * P, 5.0), (P, 10.0)]):
        fresh = follow(contact, height, *loads)
        again = follow(contact, height, (P, 0.0), (P, 30.0), (0.0, 0.0), *loads)
        atol = 1e-5 * fresh.pressure.max()
        np.testing.assert_allclose(again.traction, fresh.traction, atol=atol)
        np.testing.assert_allclose(
            again.slip, fresh.slip, atol=1e-5 * np.abs(fresh.slip).max() + 1e-15
        )
        np.testing.assert_allclose(again.energy, fresh.energy, atol=1e-7 * P * RADIUS * 1e-3)


@BOTH
def test_a_bulk_strain_while_apart_is_not_felt(kind):
    """Stretching the surfaces while they are apart causes no shear when they touch again."""
    contact, height = sphere(kind)
    fresh = follow(contact, height, (P, 0.0))
    state = contact.unloaded_state(height)
    for load, strain in ((P, 0.0), (0.0, 1e-3), (P, 1e-3)):
        values = np.array([load, 0.0, 0.0, 0.0, 0.0, 0.0])
        state = contact.advance(state, height, ContactLoad(values, strain=strain))
        assert state.converged
    np.testing.assert_allclose(state.traction, fresh.traction, atol=1e-5 * fresh.pressure.max())


@BOTH
def test_motions_that_part_the_bodies_and_join_them(kind):
    """The same holds for an approach that is reversed and imposed again."""
    contact, height = sphere(kind)
    depth = follow(contact, height, (P, 0.0)).rigid[0]
    state, states = contact.unloaded_state(height), []
    for dz in (depth, -depth, 0.5 * depth, depth):
        values = np.array([dz, 0.0, 0.0, 0.0, 0.0, 0.0])
        load = ContactLoad(values, (True, False, False, True, True, False))
        state = contact.advance(state, height, load)
        assert state.converged
        states.append(state)
    assert not states[1].traction.any()
    assert states[1].gap.min() > 0.0
    # Unlike bodies rub while they are pressed, and pressing them in two steps is another path.
    assert states[3].resultants[0] == pytest.approx(P, rel=1e-5 if kind == "alike" else 0.01)


@pytest.mark.parametrize("kind", ["alike", slow("unlike")])
def test_legs_are_not_taken_in_one_step_across_a_parting(kind):
    """The short way through a history does not apply there, and is not used."""
    contact, height = sphere(kind, 16)
    values = np.zeros((6, 6))
    values[:, 0] = [P, P, 0.0, P, P, P]
    values[:, 1] = [0.0, 30.0, 0.0, 0.0, 15.0, 30.0]
    given = ContactLoadPath(values)
    marched = march_history(contact.half_space, height, given, FRICTION)
    assert marched.method == "full"
    assert len(marched.states) == 6
    # As given: those of unlike bodies are split otherwise.
    marched = march_history(contact.half_space, height, given, FRICTION, history="full")
    fresh = follow(contact, height, (P, 0.0), (P, 15.0), (P, 30.0))
    atol = 1e-4 * fresh.pressure.max()
    np.testing.assert_allclose(marched.states[-1].traction, fresh.traction, atol=atol)


# --- a cycle of a wear run -----------------------------------------------------------------------


def cycle(load, shear, energy=0.0):
    load, shear = np.array(load), np.array(shear)
    zero = np.zeros(len(load))
    return LoadHistory(
        P=load,
        Qx=shear,
        Qy=zero,
        Mx=zero,
        My=zero,
        Mz=zero,
        Edx=zero + energy,
        Edy=zero,
        sliding=zero > 1.0,
    )


@BOTH
def test_what_a_cycle_did_before_it_parted_does_not_matter_after(kind):
    contact, height = sphere(kind, 16)
    one = march_cycle(contact, height, cycle([P, P, 0.0, 0.5 * P, P], [5.0, 30.0, 0.0, 3.0, -9.0]))
    other = march_cycle(
        contact, height, cycle([P, P, 0.0, 0.5 * P, P], [0.0, -20.0, 0.0, 3.0, -9.0])
    )
    assert not one[2].traction.any()
    for k in (3, 4):
        atol = 1e-5 * one[k].pressure.max()
        np.testing.assert_allclose(one[k].traction, other[k].traction, atol=atol)
    # The cycle is closed: what it does first depends on what it did last.
    assert np.abs(one[0].shear - other[0].shear).max() > 0.01 * FRICTION * one[0].pressure.max()


# --- no slip -------------------------------------------------------------------------------------


def test_a_flat_that_sticks_dissipates_nothing_and_one_that_slides_does():
    """Shear and pressure of a flat punch have the same shape: all of it sticks up to Q = µP.

    Complete contact of similar bodies, plane strain (Johnson 1985, section 7.2): below, no slip and
    no energy except for the solver's tolerance; above, exactly the given energy.
    """
    grid = Grid.line_contact(2.0, 64)
    height = np.where(np.abs(grid.x) < 0.75, 0.0, 1.0)
    contact = FrictionalContact(HalfSpace(grid, ElasticPair(ALIKE, ALIKE)), FRICTION, SOLVED)
    held = march_cycle(contact, height, cycle([P, P, P], [0.0, 0.95 * FRICTION * P, -10.0]))
    work = P * np.abs([state.rigid[1] for state in held]).max()
    for state in held:
        assert state.sticking.sum() == 48
        assert abs(state.energy.sum()) < 1e-7 * work
        assert np.abs(state.slip).max() < 1e-7 * abs(held[1].rigid[1])
    energy = [0.0, 0.3, 0.0]
    slid = march_cycle(contact, height, cycle([P, P, P], [0.0, FRICTION * P, -10.0], energy))
    assert [state.sliding for state in slid] == [False, True, False]
    assert slid[1].energy.sum() == pytest.approx(0.3, rel=1e-5)
    assert abs(slid[2].energy.sum()) < 1e-7 * work


@BOTH
def test_an_energy_of_zero_leaves_the_force_to_be_carried(kind):
    """Zero energy at a force near sliding is no gross slip: the contact creeps under its force."""
    contact, height = sphere(kind, 16)
    pressed = follow(contact, height, (P, 0.0))
    values = np.array([P, 0.995 * FRICTION * P, 0.0, 0.0, 0.0, 0.0])
    zero = contact.advance(pressed, height, ContactLoad(values, energy=np.zeros(2)))
    unknown = contact.advance(pressed, height, ContactLoad(values))
    assert zero.converged
    assert not zero.sliding
    np.testing.assert_array_equal(zero.traction, unknown.traction)
    assert zero.energy.sum() >= 0.0
