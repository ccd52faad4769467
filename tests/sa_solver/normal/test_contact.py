"""Increments of a frictional contact: normal, tangential and sliding states in sequence."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.half_space.operator import HalfSpace
from sa_solver.tangential.contact import FrictionLimitError
from sa_solver.types import ElasticPair, Grid, Material

TITANIUM, STEEL = Material(115e3, 0.29), Material(200e3, 0.3)
GRID = Grid.covering((1.0, 1.0), (32, 32))
HEIGHT = (GRID.x**2 + GRID.y**2) / 20.0
FRICTION = 0.6


def contact(friction=FRICTION):
    return FrictionalContact(HalfSpace(GRID, ElasticPair(TITANIUM, TITANIUM)), friction)


def load(P, Qx=0.0, Qy=0.0, Mz=0.0, **more):
    return ContactLoad(np.array([P, Qx, Qy, 0.0, 0.0, Mz]), **more)


def test_resultants_motions_and_energy_add_up():
    """-Σ q·Δs S = Σ Q·Δδ + Mz Δφz - Σ q·Δu S holds in increments with changing pressure.

    The dissipated energy uses the mean pressure of both ends of the increment instead.
    """
    solver = contact()
    state = solver.unloaded_state(HEIGHT)
    for P, Qx, Qy, Mz in [
        (100.0, 0.0, 0.0, 0.0),
        (300.0, 80.0, 20.0, 3.0),
        (400.0, 150.0, -60.0, -4.0),
        (200.0, -60.0, 30.0, 2.0),
    ]:
        before = state
        state = solver.advance(before, HEIGHT, load(P, Qx, Qy, Mz))
        wanted = np.array([P, Qx, Qy, 0.0, 0.0, Mz])
        assert state.converged
        np.testing.assert_allclose(state.resultants, wanted, rtol=1e-9, atol=1e-9 * P)
        moved = (state.rigid - before.rigid)[[1, 2, 5]]
        change = state.displacement[:2] - before.displacement[:2]
        elastic = np.sum(state.shear * change) * GRID.cell_area
        expected = float(wanted[[1, 2, 5]] @ moved) - elastic
        against = -np.sum(state.shear * state.slip) * GRID.cell_area
        assert against == pytest.approx(expected, rel=1e-7, abs=1e-9)
        mean = 0.5 * FRICTION * (before.pressure + state.pressure)
        lost = float(np.vdot(mean, np.hypot(*state.slip))) * GRID.cell_area
        assert state.energy.sum() == pytest.approx(lost, rel=1e-7, abs=1e-9)
        assert np.all(np.hypot(*state.shear) <= FRICTION * state.pressure * (1.0 + 1e-12))


def test_energy_is_of_second_order_in_the_increments():
    """Shear moves forward and back while the pressure rises and falls, and cells separate."""
    solver = contact()
    energies = []
    for count in (2, 4, 8, 16, 32):
        state, energy = (
            solver.advance(solver.unloaded_state(HEIGHT), HEIGHT, load(200.0, -30.0)),
            0.0,
        )
        for (P, Q), (P_to, Q_to) in pairwise([(200.0, -30.0), (400.0, 130.0), (200.0, -50.0)]):
            for share in np.linspace(0.0, 1.0, count + 1)[1:]:
                to = load(P + share * (P_to - P), Q + share * (Q_to - Q))
                state = solver.advance(state, HEIGHT, to)
                energy += state.energy.sum()
        energies.append(energy)
    changes = np.abs(np.diff(energies))
    assert np.log2(changes[:-1] / changes[1:]).mean() > 1.5
    assert changes[-1] < 1e-2 * energies[-1]


@pytest.mark.parametrize("second", [TITANIUM, STEEL], ids=["similar", "dissimilar"])
def test_a_near_state_to_begin_from_changes_the_work_only(second):
    """The surface has worn by a thousandth of the approach since the state of the initial guess."""
    solver = FrictionalContact(HalfSpace(GRID, ElasticPair(TITANIUM, second)), FRICTION)
    pressed = solver.advance(solver.unloaded_state(HEIGHT), HEIGHT, load(300.0, 20.0))
    near = solver.advance(pressed, HEIGHT, load(400.0, 150.0))
    worn = HEIGHT + 1e-6 * near.pressure / near.pressure.max()
    known = solver.advance(pressed, worn, load(400.0, 150.0), near.as_start)
    found = solver.advance(pressed, worn, load(400.0, 150.0))
    assert known.converged
    assert known.convolutions < 0.8 * found.convolutions
    atol = 1e-6 * found.pressure.max()
    np.testing.assert_allclose(known.traction, found.traction, rtol=0, atol=atol)
    np.testing.assert_allclose(known.rigid, found.rigid, rtol=1e-6, atol=1e-12)


def test_motions_bring_the_same_state_as_their_forces():
    solver = contact()
    pressed = solver.advance(solver.unloaded_state(HEIGHT), HEIGHT, load(300.0, 30.0))
    forced = solver.advance(pressed, HEIGHT, load(250.0, 100.0, -20.0, 2.0))
    motion = ContactLoad(forced.rigid, motion=(True,) * 6)
    moved = solver.advance(pressed, HEIGHT, motion)
    scale = forced.pressure.max()
    np.testing.assert_allclose(moved.traction, forced.traction, atol=1e-5 * scale)
    np.testing.assert_allclose(moved.resultants, forced.resultants, atol=1e-5 * 250.0)


def test_bodies_that_part_forget_and_carry_nothing():
    solver = contact()
    pressed = solver.advance(solver.unloaded_state(HEIGHT), HEIGHT, load(300.0, 90.0))
    apart = solver.advance(pressed, HEIGHT, load(0.0))
    assert apart.converged
    assert not apart.traction.any()
    with pytest.raises(FrictionLimitError, match="give a normal load first"):
        solver.advance(apart, HEIGHT, load(0.0, 1.0))


def test_sliding_is_decided_by_force_and_energy():
    solver = contact()
    pressed = solver.advance(solver.unloaded_state(HEIGHT), HEIGHT, load(300.0))
    limit = FRICTION * 300.0
    energy = np.array([2.0, 0.0])
    partial = solver.advance(pressed, HEIGHT, load(300.0, 0.9 * limit, energy=energy))
    assert not partial.sliding
    assert partial.resultants[1] == pytest.approx(0.9 * limit, rel=1e-9)
    for force in (0.9999 * limit, 1.05 * limit):
        sliding = solver.advance(pressed, HEIGHT, load(300.0, force, energy=energy))
        assert sliding.sliding
        assert sliding.energy.sum() == pytest.approx(2.0, rel=1e-5)
        assert sliding.resultants[1] == pytest.approx(limit, rel=5e-3)
        assert not sliding.sticking.any()
    with pytest.raises(FrictionLimitError, match="Qx = 180"):
        solver.advance(pressed, HEIGHT, load(300.0, 1.05 * limit))


def test_a_contact_that_creeps_keeps_its_force():
    """The force is close to its limit, but the energy is less than sliding would dissipate."""
    solver = contact()
    pressed = solver.advance(solver.unloaded_state(HEIGHT), HEIGHT, load(300.0))
    held = solver.advance(pressed, HEIGHT, load(300.0, 162.0))
    force = 162.0 / (0.995 * FRICTION)
    creeping = load(force, 162.0, energy=np.array([1e-6, 0.0]))
    state = solver.advance(held, HEIGHT, creeping)
    assert state.converged
    assert not state.sliding
    assert state.resultants[1] == pytest.approx(162.0, rel=1e-9)
    plain = solver.advance(held, HEIGHT, load(force, 162.0))
    np.testing.assert_allclose(state.shear, plain.shear, atol=1e-6 * plain.pressure.max())


def test_without_friction_there_is_no_shear():
    solver = contact(0.0)
    state = solver.advance(solver.unloaded_state(HEIGHT), HEIGHT, load(300.0))
    assert state.converged
    assert not state.shear.any()


def test_strain_is_that_of_body_2_over_body_1():
    """Tension in body 2 alone would stretch its surface; the shear by body 1 resists this."""
    solver = contact()
    pressed = solver.advance(solver.unloaded_state(HEIGHT), HEIGHT, load(300.0))
    stretched = solver.advance(pressed, HEIGHT, load(300.0, strain=1e-4))
    right = stretched.shear[0][GRID.x[:, 0] > 0.0].sum()
    assert right < 0.0
    assert stretched.shear[0].sum() == pytest.approx(0.0, abs=1e-8 * abs(right))
    again = solver.advance(stretched, HEIGHT, load(300.0, strain=1e-4))
    np.testing.assert_allclose(again.shear, stretched.shear, atol=1e-6 * abs(right))


@pytest.mark.parametrize("second", [TITANIUM, Material(200e3, 0.3)], ids=["similar", "dissimilar"])
def test_surfaces_that_move_evenly_along_x_are_strained(second):
    """Displacements ε x of the surfaces, before they touch and after, are a strain ε."""
    solver = FrictionalContact(HalfSpace(GRID, ElasticPair(TITANIUM, second)), FRICTION)
    stretch = np.stack([1e-4 * np.broadcast_to(GRID.x, GRID.shape), np.zeros(GRID.shape)])
    moved, strained = solver.unloaded_state(HEIGHT, along=-stretch), solver.unloaded_state(HEIGHT)
    for share, P in ((-0.5, 200.0), (1.0, 300.0), (0.2, 250.0)):
        given = load(P, strain=1e-4 * (1.0 + share))
        strained = solver.advance(strained, HEIGHT, given)
        given = replace(load(P), along=share * stretch)
        moved = solver.advance(moved, HEIGHT, given)
        tolerance = 1e-6 * moved.pressure.max()
        np.testing.assert_allclose(moved.traction, strained.traction, atol=tolerance)
        assert moved.shear.any()


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_any_rough_history(seed):
    """Equilibrium, friction and dissipation hold for rough surfaces and random histories."""
    rng = np.random.default_rng(seed)
    grid = Grid(tuple(rng.integers(6, 24, 2)), tuple(rng.uniform(0.02, 0.1, 2)))
    material = Material(10.0 ** rng.uniform(3, 5.5), rng.uniform(0.0, 0.49))
    friction = rng.uniform(0.05, 1.2)
    solver = FrictionalContact(HalfSpace(grid, ElasticPair(material, material)), friction)
    height = 2e-3 * rng.standard_normal(grid.shape) + (grid.x**2 + grid.y**2) / 30.0
    state = solver.unloaded_state(height)
    for _ in range(4):
        P = material.young * 10.0 ** rng.uniform(-4.5, -3.0)
        angle, share = rng.uniform(0.0, 2.0 * np.pi), 0.95 * friction * rng.random()
        values = np.array([P, P * share * np.cos(angle), P * share * np.sin(angle), 0, 0, 0])
        motion = (False, False, False, True, True, True)
        state = solver.advance(state, height, ContactLoad(values, motion))
        assert state.converged
        np.testing.assert_allclose(state.resultants[:3], values[:3], atol=1e-7 * P)
        assert np.all(np.hypot(*state.shear) <= friction * state.pressure * (1.0 + 1e-12))
        moved = np.abs(state.shear * state.displacement[:2]).sum() * grid.cell_area
        assert state.energy.sum() >= -1e-7 * moved
