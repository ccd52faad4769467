"""Normal contact under imposed motions, and on line grids."""

import itertools

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact, NormalContactError
from sa_solver.reference.hertz import HertzCylinder
from sa_solver.types import ElasticPair, Grid, Material

PAIR = ElasticPair(Material(115e3, 0.29), Material(115e3, 0.29))
RESULTANTS = ("P", "Mx", "My")
MOTIONS = ("approach", "tilt_x", "tilt_y")
DATUM = 50.0


def cap(grid):
    """Return the gap of a blunt cap that is flatter along y."""
    return grid.x**2 / 40.0 + (grid.y - 0.1) ** 2 / 300.0


@pytest.mark.parametrize("control", list(itertools.product(*zip(RESULTANTS, MOTIONS, strict=True))))
def test_motions_fed_back_give_the_same_pressure(control):
    """Any choice of each pair gives the same; 1e-8 of the gap is 1e-5 of the peak on a cell."""
    grid = Grid.covering((2.0, 5.0), (40, 66))
    contact = NormalContact(HalfSpace(grid, PAIR))
    forced = contact.solve(cap(grid), 400.0, 120.0, -60.0)
    state = contact.solve(cap(grid), **{name: getattr(forced, name) for name in control})
    assert forced.converged
    assert state.converged
    atol = 1e-5 * forced.pressure.max()
    np.testing.assert_allclose(state.pressure, forced.pressure, atol=atol)
    for name in RESULTANTS + MOTIONS:
        assert getattr(state, name) == pytest.approx(getattr(forced, name), rel=1e-5, abs=1e-9)


def test_resultants_are_those_of_the_pressure():
    grid = Grid.covering((2.0, 5.0), (40, 66))
    state = NormalContact(HalfSpace(grid, PAIR)).solve(cap(grid), approach=0.01, tilt_x=1e-3)
    p, S = state.pressure, grid.cell_area
    assert (state.approach, state.tilt_x) == (0.01, 1e-3)
    assert pytest.approx(p.sum() * S) == state.P
    assert state.Mx == pytest.approx((p * grid.y).sum() * S)
    assert state.My == pytest.approx(0.0, abs=1e-8 * state.P)


@pytest.mark.parametrize("motions", [{}, {"tilt_x": 2e-3}, {"tilt_x": 2e-3, "tilt_y": -1e-3}])
def test_bodies_apart_carry_nothing(motions):
    grid = Grid.covering((2.0, 5.0), (20, 22))
    height = cap(grid) + 0.5
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, approach=0.3, **motions)
    assert state.converged
    assert state.P == 0.0
    assert not state.pressure.any()
    assert state.gap.min() > 0.0
    assert state.approach == 0.3


def test_a_free_tilt_turns_a_body_out_of_contact():
    """A plane that penetrates at one edge does not press if its tilt is free."""
    grid = Grid.covering((2.0, 5.0), (20, 22))
    height = 0.1 + 0.1 * grid.y + np.zeros(grid.shape)
    contact = NormalContact(HalfSpace(grid, PAIR))
    apart = contact.solve(height, approach=0.05, Mx=0.0, My=0.0)
    pressed = contact.solve(height, approach=0.05)
    assert apart.P == 0.0
    assert apart.gap.min() >= -1e-12
    assert pressed.converged
    assert pressed.P > 0.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"P": 1.0, "approach": 0.1}, "both"),
        ({"P": 1.0, "Mx": 0.0, "tilt_x": 0.0}, "both"),
        ({}, "neither"),
        ({"Mx": 1.0, "tilt_y": 0.0}, "neither"),
        ({"approach": np.inf}, "finite"),
    ],
)
def test_one_of_each_pair_is_imposed(given, words):
    grid = Grid.covering((2.0, 5.0), (20, 22))
    with pytest.raises(NormalContactError, match=words):
        NormalContact(HalfSpace(grid, PAIR)).solve(cap(grid), **given)


# -- line contact --
LINE = HertzCylinder(120.0, 20.0, PAIR.contact_modulus)


def cylinder(count, load=LINE.load, **given):
    grid = Grid.line_contact(3.0 * LINE.half_width, count)
    contact = NormalContact(HalfSpace(grid, PAIR, datum=DATUM))
    return grid, contact.solve(LINE.gap(grid.x), load, **given)


def test_cylinder():
    grid, state = cylinder(512)
    assert state.converged
    assert state.pressure.max() == pytest.approx(LINE.peak_pressure, rel=1e-3)
    assert state.approach == pytest.approx(LINE.approach(DATUM), rel=1e-5)
    assert pytest.approx(LINE.load) == state.P
    assert state.tilt_x == 0.0
    half_width = 0.5 * np.count_nonzero(state.pressure) * grid.pitch[0]
    assert half_width == pytest.approx(LINE.half_width, abs=grid.pitch[0])


def test_cylinder_converges():
    """The approach converges with second order.

    The pressure (L2) converges with first order, because of the square root at its edge.
    """
    errors = []
    for count in (64, 128, 256, 512, 1024):
        grid, state = cylinder(count)
        exact = LINE.pressure(grid.x)
        l2 = np.linalg.norm(state.pressure - exact) / np.linalg.norm(exact)
        errors.append((abs(state.approach - LINE.approach(DATUM)), l2))
    rates = np.log2(np.array(errors[0]) / np.array(errors[-1])) / 4.0
    assert rates[0] > 1.7
    assert 0.8 < rates[1] < 1.6


def test_a_moment_rolls_the_cylinder():
    grid, centred = cylinder(240)
    offset = 12 * grid.pitch[0]
    _, moved = cylinder(240, My=-LINE.load * offset)
    expected = np.roll(centred.pressure, 12, axis=0)
    np.testing.assert_allclose(moved.pressure, expected, atol=1e-5 * LINE.peak_pressure)
    assert moved.tilt_y == pytest.approx(-offset / LINE.radius, rel=1e-6)


def test_cylinder_by_its_motions():
    _, forced = cylinder(128, My=3.0)
    _, state = cylinder(128, None, approach=forced.approach, tilt_y=forced.tilt_y)
    atol = 1e-5 * LINE.peak_pressure
    np.testing.assert_allclose(state.pressure, forced.pressure, atol=atol)
    assert state.My == pytest.approx(3.0, rel=1e-5)


def test_a_line_carries_no_moment_across():
    with pytest.raises(NormalContactError, match="Mx"):
        cylinder(64, Mx=1.0)
