"""Tests of extreme grids and heights: long cells, odd counts, offsets, NaN."""

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.reference.hertz import HertzSphere
from sa_solver.types import ElasticPair, Grid, Material
from tests.limits.conditions import frictional_error

TITANIUM = Material(115e3, 0.29)
PAIRS = {
    "alike": ElasticPair(TITANIUM, TITANIUM),
    "unlike": ElasticPair(Material(np.inf, 0.3), Material(115e3, 0.0)),
}
BOTH = pytest.mark.parametrize("kind", PAIRS)
P, RADIUS = 400.0, 10.0
SOLVED = 1e-8


def force(P, Qx=0.0, Qy=0.0):
    return ContactLoad(np.array([P, Qx, Qy, 0.0, 0.0, 0.0]))


def ball(grid):
    return (grid.x**2 + grid.y**2) / (2.0 * RADIUS)


@BOTH
@pytest.mark.parametrize(
    "grid",
    [
        Grid((40, 20), (0.02, 0.4)),
        Grid((9, 90), (0.2, 0.01)),
        Grid((31, 17), (0.04, 0.07)),
        Grid((1, 21), (0.1, 0.1)),
        Grid((2, 2), (0.5, 0.5)),
        Grid((5, 3), (0.3, 0.5)),
        Grid.line_contact(2.0, 61),
        Grid.line_contact(2.0, 3),
    ],
    ids=lambda grid: f"{grid.shape[0]}x{grid.shape[1]}{'line' * grid.line}",
)
def test_any_grid_is_solved(kind, grid):
    """Cells of 1:20, odd counts, single rows and few cells meet every condition."""
    contact, height = FrictionalContact(HalfSpace(grid, PAIRS[kind]), 0.5), ball(grid)
    state = contact.unloaded_state(height)
    for load in (force(P), force(P, 60.0), force(P, -60.0, 60.0), force(0.5 * P, 20.0)):
        before, state = state, contact.advance(state, height, load)
        assert state.converged, state.message
        assert frictional_error(contact, before, height, state, load) < 3.0 * SOLVED
        np.testing.assert_allclose(state.resultants[:3], load.values[:3], atol=3.0 * SOLVED * P)


def test_long_cells_find_the_same_contact():
    """Cells of 1:20 match square ones of equal width: to 1 % in approach, 6 % in pressure.

    Their length is a seventh of the contact's, whose ends are then coarse.
    """
    exact = HertzSphere(P, RADIUS, PAIRS["alike"].contact_modulus)
    pitch = exact.contact_radius / 140.0
    grid = Grid((350, 19), (pitch, 20.0 * pitch))
    state = NormalContact(HalfSpace(grid, PAIRS["alike"])).solve(ball(grid), P)
    assert state.converged
    assert state.approach == pytest.approx(exact.approach, rel=0.01)
    assert state.pressure.max() == pytest.approx(exact.peak_pressure, rel=0.06)


@BOTH
@pytest.mark.parametrize("offset", [1e3, -1e3, 2.0**20])
@pytest.mark.parametrize("load", [1e-2, P])
def test_heights_far_from_zero_are_those_near_it(kind, offset, load):
    """A distance between the bodies adds to the approach, without loss of digits.

    Heights are rounded to numbers at the offset, and compared with the same ones without it.
    """
    grid = Grid.covering((1.0, 1.0), (24, 24))
    far = ball(grid) + offset
    near = far - offset
    contact = FrictionalContact(HalfSpace(grid, PAIRS[kind]), 0.5)
    states = []
    for height in (near, far):
        pressed = contact.advance(contact.unloaded_state(height), height, force(load))
        sheared = contact.advance(pressed, height, force(load, 0.2 * load))
        assert sheared.converged, sheared.message
        states.append(sheared)
    one, other = states
    np.testing.assert_allclose(other.traction, one.traction, atol=1e-5 * one.pressure.max())
    assert other.rigid[0] == pytest.approx(one.rigid[0] + offset, rel=1e-15)
    assert other.gap.min() >= -3.0 * SOLVED * one.displacement[2].max()


@pytest.mark.parametrize("slope", [1.0, 1e4])
def test_a_slope_of_the_heights_is_a_tilt(slope):
    """However steep the slope, without moments a body aligns with its partner."""
    grid = Grid.covering((1.0, 1.0), (24, 24))
    contact = NormalContact(HalfSpace(grid, PAIRS["alike"]))
    free = {"Mx": 0.0, "My": 0.0}
    level, tilted = (contact.solve(ball(grid) + rise * grid.x, P, **free) for rise in (0.0, slope))
    assert tilted.converged
    # Rounding of heights of slope/2 over the displacement of 13 µm.
    atol = max(1e-5, 10.0 * np.spacing(0.5 * slope) / 13e-3) * level.pressure.max()
    np.testing.assert_allclose(tilted.pressure, level.pressure, atol=atol)
    assert tilted.tilt_y == pytest.approx(-slope, rel=1e-6)


def test_a_gap_that_vanishes_to_rounding_is_no_crash():
    """A peak of 1 m on one of two strips once ended the search in a division by zero."""
    grid = Grid.line_contact(1.0, 2)
    contact = NormalContact(HalfSpace(grid, PAIRS["alike"]))
    state = contact.solve(np.array([[1e3], [0.0]]), 1e-3, My=0.0)
    if state.converged:
        np.testing.assert_allclose(state.pressure, 1e-3, rtol=SOLVED)
    else:
        assert "rounding hides" in state.message
