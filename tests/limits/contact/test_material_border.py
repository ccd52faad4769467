"""Tests of extreme materials: ν from 0 to 0.5, moduli 1 : 1000 and rigid."""

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.half_space.operator import HalfSpace
from sa_solver.reference.hertz import HertzSphere
from sa_solver.types import ElasticPair, Grid, Material
from tests.limits.conditions import frictional_error

P, RADIUS, FRICTION = 100.0, 10.0, 0.4
SOLVED = 1e-8
POISSON = [0.0, 0.3, 0.499, 0.5]


def sphere(pair, cells=48, friction=FRICTION):
    """Return a contact over two thirds of the grid, and its states under P and Qx = µP/2."""
    hertz = HertzSphere(P, RADIUS, pair.contact_modulus)
    size = 3.0 * hertz.contact_radius
    grid = Grid.covering((size, size), (cells, cells))
    contact = FrictionalContact(HalfSpace(grid, pair), friction, SOLVED)
    height = hertz.gap(grid.x, grid.y)
    loads = [ContactLoad(np.array([P, Q, 0.0, 0.0, 0.0, 0.0])) for Q in (0.0, 0.5 * friction * P)]
    states = [contact.unloaded_state(height)]
    for load in loads:
        states.append(contact.advance(states[-1], height, load))
        assert states[-1].converged, states[-1].message
        assert frictional_error(contact, states[-2], height, states[-1], load) < 3.0 * SOLVED
    return hertz, contact, states[1:]


@pytest.mark.parametrize("poisson", POISSON)
def test_poissons_ratio_scales_a_contact_of_equal_bodies(poisson):
    """Approach is Hertz's with E* to 1e-3, at 16 cells in the contact radius.

    With so much friction that hardly any cell slips, the shift is Q Σ(2-ν)/G / 8a (Mindlin 1949,
    exact for every ν), to 1 %: the singular edge causes an error of half a cell.
    """
    body = Material(70e3, poisson)
    friction, Q = 1e4, 1.0
    hertz, contact, (pressed, _) = sphere(ElasticPair(body, body), friction=friction)
    assert pressed.rigid[0] == pytest.approx(hertz.approach, rel=1e-3)
    height = hertz.gap(contact.grid.x, contact.grid.y)
    state = contact.advance(pressed, height, ContactLoad(np.array([P, Q, 0.0, 0.0, 0.0, 0.0])))
    compliance = 2.0 * (2.0 - poisson) / body.shear_modulus / (8.0 * hertz.contact_radius)
    assert state.rigid[1] == pytest.approx(compliance * Q, rel=0.01)


@pytest.mark.parametrize("poisson", POISSON)
def test_a_rigid_ball_couples_less_the_less_compressible_its_partner(poisson):
    """β = (1-2ν)/2(1-ν) against a rigid body is 0.5 at ν = 0, and 0 at 0.5 (uncoupled)."""
    body = Material(70e3, poisson)
    pair = ElasticPair(Material(np.inf, 0.3), body)
    assert pair.dundurs_beta == pytest.approx((1 - 2 * poisson) / (2 - 2 * poisson))
    assert pair.similar == (poisson == 0.5)
    hertz, _, (pressed, _) = sphere(pair, cells=24)
    if poisson == 0.5:
        assert not pressed.shear.any()
    # Coupled or not, friction is too little to move the approach by more than a few per cent.
    assert pressed.rigid[0] == pytest.approx(hertz.approach, rel=0.1)


def test_nearly_incompressible_is_close_to_incompressible():
    """β falls in proportion to 1 - 2ν, and so does shear under pressure alone."""
    largest = []
    for poisson in (0.49, 0.499, 0.4999):
        pair = ElasticPair(Material(np.inf, 0.3), Material(70e3, poisson))
        _, _, (pressed, _) = sphere(pair, cells=24)
        largest.append(np.abs(pressed.shear).max() / pressed.pressure.max())
    ratios = np.array(largest[:-1]) / np.array(largest[1:])
    np.testing.assert_allclose(ratios, 10.0, rtol=0.05)


@pytest.mark.parametrize("stiffer", [1, 2])
def test_a_thousand_times_stiffer_is_almost_rigid(stiffer):
    """The difference from a rigid body falls as the ratio of the moduli."""

    def motions(young):
        bodies = [Material(70e3, 0.2), Material(young, 0.3)]
        pair = ElasticPair(*(bodies if stiffer == 2 else bodies[::-1]))
        # The same grid for all: that of the rigid pair.
        hertz = HertzSphere(P, RADIUS, 70e3 / (1 - 0.2**2))
        size = 3.0 * hertz.contact_radius
        grid = Grid.covering((size, size), (24, 24))
        contact = FrictionalContact(HalfSpace(grid, pair), FRICTION, 1e-10)
        height = hertz.gap(grid.x, grid.y)
        state = contact.unloaded_state(height)
        for Q in (0.0, 0.5 * FRICTION * P):
            before, load = state, ContactLoad(np.array([P, Q, 0.0, 0.0, 0.0, 0.0]))
            state = contact.advance(before, height, load)
            assert state.converged
            assert frictional_error(contact, before, height, state, load) < SOLVED
        return state.rigid

    rigid = motions(np.inf)
    errors = [np.abs(motions(70e3 * ratio) / rigid - 1.0)[:2].max() for ratio in (1e3, 1e4, 1e5)]
    assert errors[0] < 2e-3
    np.testing.assert_allclose(np.array(errors[:-1]) / np.array(errors[1:]), 10.0, rtol=0.1)


def test_bodies_that_are_almost_alike_are_solved_as_if_they_were():
    """There is no jump between the two solvers, uncoupled and coupled."""
    alike = Material(70e3, 0.3)
    results = []
    for other in (alike, Material(70e3, 0.3 + 1e-9)):
        pair = ElasticPair(alike, other)
        assert pair.similar == (other is alike)
        grid = Grid.covering((1.2, 1.2), (24, 24))
        height = (grid.x**2 + grid.y**2) / (2.0 * RADIUS)
        contact = FrictionalContact(HalfSpace(grid, pair), FRICTION, 1e-10)
        state = contact.unloaded_state(height)
        for Q in (0.0, 20.0, -10.0):
            state = contact.advance(
                state, height, ContactLoad(np.array([P, Q, 0.0, 0.0, 0.0, 0.0]))
            )
            assert state.converged
        results.append(state)
    one, other = results
    np.testing.assert_allclose(other.traction, one.traction, atol=1e-6 * one.pressure.max())
    np.testing.assert_allclose(other.slip, one.slip, atol=1e-6 * np.abs(one.slip).max())
