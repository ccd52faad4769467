"""Contacts of all cells and of one: nearly conforming, barely touching, very rough.

A strip of half width a with the profile x²/2R is pressed into full contact from

    P* = π E* a² / 4R

on, the load at which a Hertz contact is as wide as the strip. Beyond, what is left over acts as on
a flat (superposition, for every point of the strip is in contact):

    p = (P - P*) / π sqrt(a² - x²) + 2P*/πa sqrt(1 - x²/a²)

A hollow one (R < 0) presses at its ends first and closes in the middle from the same P* on: there
p = (P + P*) / π sqrt(a² - x²) - 2P*/πa sqrt(1 - x²/a²) vanishes at P = P*.

A single cell carries all of a load while its neighbours, displaced by K01 p where it is by K00 p,
do not close their gap h1: up to p = h1 / (K00 - K01), with Love's coefficients.
"""

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.dissimilar.contact import CoupledContact
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.tangential.contact import FrictionLimitError
from sa_solver.types import ElasticPair, Grid, Material
from tests.limits.conditions import frictional_error, love_matrix, normal_error
from tests.marks import slow

TITANIUM = Material(115e3, 0.29)
PAIRS = {
    "alike": ElasticPair(TITANIUM, TITANIUM),
    "unlike": ElasticPair(Material(np.inf, 0.3), Material(115e3, 0.0)),
}
PAIR = PAIRS["alike"]
MODULUS = PAIR.contact_modulus
BOTH = pytest.mark.parametrize("kind", PAIRS)
SOLVED = 1e-8


def force(P, Qx=0.0, Mz=0.0):
    return ContactLoad(np.array([P, Qx, 0.0, 0.0, 0.0, Mz]))


# --- everything in contact -----------------------------------------------------------------------

HALF, RADIUS = 1.0, 1e4
FULL = 0.25 * np.pi * MODULUS * HALF**2 / RADIUS


def strip(cells=400):
    grid = Grid.line_contact(2.0 * HALF, cells)
    return grid, NormalContact(HalfSpace(grid, PAIR)), grid.x**2 / (2.0 * RADIUS)


def conforming(x, P, hollow):
    """Return the pressure of full contact."""
    sign = -1.0 if hollow else 1.0
    flat = (P - sign * FULL) / (np.pi * np.sqrt(HALF**2 - x**2))
    return flat + sign * 2.0 * FULL / (np.pi * HALF) * np.sqrt(1.0 - (x / HALF) ** 2)


@pytest.mark.parametrize("share", [0.97, 1.03, 3.0])
def test_a_round_strip_is_pressed_into_full_contact(share):
    """Contact agrees to a cell; pressure to 1 % ten cells from the ends."""
    grid, contact, height = strip()
    P = share * FULL
    state = contact.solve(height, P)
    assert state.converged
    pressed = np.count_nonzero(state.pressure) * grid.pitch[0]
    assert pressed == pytest.approx(2.0 * HALF * min(1.0, np.sqrt(share)), abs=2.0 * grid.pitch[0])
    assert (state.border_load > 0.0) == (share > 1.0)
    x = grid.x[:, 0]
    inner = np.abs(x) < HALF - 10.0 * grid.pitch[0]
    exact = 2.0 * np.sqrt(P * FULL) / (np.pi * HALF)
    exact *= np.sqrt(np.maximum(0.0, 1.0 - x**2 / (share * HALF**2)))
    if share > 1.0:
        exact = conforming(x, P, hollow=False)
    wanted = exact[inner]
    np.testing.assert_allclose(state.pressure[inner, 0], wanted, rtol=0.01, atol=0.01 * exact[200])


@pytest.mark.parametrize("share", [0.9, 0.99, 1.01, 2.0])
def test_a_hollow_strip_closes_in_the_middle(share):
    grid, contact, height = strip()
    P = share * FULL
    state = contact.solve(-height, P)
    assert state.converged
    assert (state.pressure[200] > 0.0) == (share > 1.0)
    assert np.all(state.pressure > 0.0) == (share > 1.0)
    if share > 1.0:
        x = grid.x[:, 0]
        inner = np.abs(x) < HALF - 10.0 * grid.pitch[0]
        wanted = conforming(x[inner], P, hollow=True)
        atol = 0.01 * P / HALF
        np.testing.assert_allclose(state.pressure[inner, 0], wanted, rtol=0.01, atol=atol)


@BOTH
@pytest.mark.parametrize("radius", [1e2, 1e5, 1e9, 1e15])
def test_nearly_conforming_bodies_tend_to_flat_ones(kind, radius):
    """From some radius on all cells press, and the pressure tends to a flat's as 1/R."""
    pair = PAIRS[kind]
    grid = Grid.covering((1.0, 1.0), (20, 20))
    contact = FrictionalContact(HalfSpace(grid, pair), 0.3)
    height = (grid.x**2 + grid.y**2) / (2.0 * radius)
    flat, round_ = (
        contact.advance(contact.unloaded_state(gap), gap, force(100.0))
        for gap in (np.zeros(grid.shape), height)
    )
    assert flat.converged
    assert round_.converged
    assert (
        frictional_error(contact, contact.unloaded_state(height), height, round_, force(100.0))
        < 3e-8
    )
    assert (round_.pressure > 0.0).all() == (radius > 1e3)
    if radius > 1e3:
        assert round_.border_load > 0.0
        change = np.abs(round_.pressure - flat.pressure).max() / flat.pressure.max()
        assert change < 1e3 / radius + 1e-6


# --- one cell ------------------------------------------------------------------------------------


def ball(kind):
    """Return a ball on an odd grid, which has a cell at the apex."""
    pair = PAIRS[kind]
    grid = Grid.covering((1.0, 1.0), (21, 21))
    height = (grid.x**2 + grid.y**2) / 20.0
    matrix = love_matrix(grid, pair.contact_modulus)
    middle = 10 * 21 + 10
    itself, next_to, diagonal, across = (matrix[middle, middle + k] for k in (0, 1, 22, 2))
    limit = height[11, 10] / (itself - next_to)
    return grid, height, pair, limit * grid.cell_area, (itself, next_to, diagonal, across)


@BOTH
def test_a_load_on_one_cell_then_on_five(kind):
    """Just above, pressures p0 and four times p1 follow from a system of two equations."""
    grid, height, pair, limit, (itself, next_to, diagonal, across) = ball(kind)
    contact = FrictionalContact(HalfSpace(grid, pair), 0.3)
    start = contact.unloaded_state(height)
    one = contact.advance(start, height, force(0.99 * limit))
    assert one.converged, one.message
    assert np.count_nonzero(one.pressure) == 1
    assert one.pressure[10, 10] * grid.cell_area == pytest.approx(0.99 * limit, rel=SOLVED)
    assert one.rigid[0] == pytest.approx(itself * one.pressure[10, 10], rel=1e-6)
    if kind == "unlike":
        return
    five = contact.advance(start, height, force(1.02 * limit))
    assert np.count_nonzero(five.pressure) == 5
    # Unknown p0, p1, δ: δ = K00 p0 + 4 K01 p1, δ = h1 + K01 p0 + (K00 + 2 K11 + K02) p1, P.
    second = itself + 2.0 * diagonal + across
    matrix = [[itself, 4.0 * next_to, -1.0], [next_to, second, -1.0], [1.0, 4.0, 0.0]]
    exact = np.linalg.solve(matrix, [0.0, -height[11, 10], 1.02 * limit / grid.cell_area])
    assert five.pressure[10, 10] == pytest.approx(exact[0], rel=1e-6)
    assert five.pressure[11, 10] == pytest.approx(exact[1], rel=1e-4)
    assert five.rigid[0] == pytest.approx(exact[2], rel=1e-6)


@pytest.mark.parametrize("kind", ["alike", slow("unlike")])
def test_one_cell_carries_shear_up_to_friction_and_no_moment(kind):
    """Stuck, it moves by its own compliance; about its own middle it can carry no Mz."""
    grid, height, pair, limit, _ = ball(kind)
    P = 0.5 * limit
    contact = FrictionalContact(HalfSpace(grid, pair), 0.3)
    pressed = contact.advance(contact.unloaded_state(height), height, force(P))
    state = contact.advance(pressed, height, force(P, Qx=0.999 * 0.3 * P))
    assert state.converged, state.message
    assert np.count_nonzero(state.sticking) == 1
    compliance = contact.half_space.self_compliance(0)
    assert state.rigid[1] == pytest.approx(compliance * state.shear[0, 10, 10], rel=1e-6)
    with pytest.raises(FrictionLimitError, match="cannot carry"):
        contact.advance(pressed, height, force(P, Qx=1.001 * 0.3 * P))
    try:
        message = contact.advance(pressed, height, force(P, Mz=1e-3 * P)).message
    except FrictionLimitError as error:
        message = str(error)
    assert "cannot carry" in message or "only 1 cells carry the load" in message


@pytest.mark.parametrize(
    ("kind", "P"),
    [
        *(("alike", P) for P in (1e-12, 1e-6, 1e-3, 1e9)),
        *(("unlike", P) for P in (1e-4, 1e-3, 1e9)),
    ],
)
def test_loads_of_any_size(kind, P):
    """Tiny loads rest on a cell, huge ones press the whole grid, which is reported."""
    grid, height, pair, limit, _ = ball(kind)
    contact = FrictionalContact(HalfSpace(grid, pair), 0.3)
    start = contact.unloaded_state(height)
    state = contact.advance(start, height, force(P))
    assert state.converged, state.message
    assert frictional_error(contact, start, height, state, force(P)) < 3.0 * SOLVED
    assert np.count_nonzero(state.pressure) == (1 if limit > P else 441)
    assert (state.border_load > 0.0) == (limit < P)


@pytest.mark.parametrize("P", [slow(1e-7), 1e-5])
def test_rounding_hides_tiny_loads_on_dissimilar_bodies_with_a_message(P):
    """The splitting's state holds gaps over a cell's compliance: 2e4 MPa here, known to 4e-12.

    A pressure of 4e-4 MPa (1e-6 N) is then accurate to about 1e-8. Smaller loads are found only
    with proportionally looser tolerances.
    """
    grid, height, pair, _, _ = ball("unlike")
    contact, values = CoupledContact(HalfSpace(grid, pair), 0.3), [P, 0, 0, 0, 0, 0]
    tight = contact.solve(height, None, values)
    if not tight.converged:
        assert "stopped at a residual" in tight.message
        assert P < 2e-6
    loose = contact.solve(height, None, values, tolerance=1e-12 / P)
    for state in [loose] + [tight] * tight.converged:
        assert state.converged
        assert state.resultants[0] == pytest.approx(P, rel=2e-12 / P)
        assert np.count_nonzero(state.pressure) == 1


# --- very rough ----------------------------------------------------------------------------------


def rough(cells, rms, seed=0):
    grid = Grid.covering((1.0, 1.0), (cells, cells))
    return grid, rms * np.random.default_rng(seed).standard_normal(grid.shape)


@pytest.mark.parametrize("rms", [1e-6, 1e-3, 1e-1, 10.0])
@pytest.mark.parametrize("seed", range(3))
def test_any_roughness_is_solved(rms, seed):
    """From full contact to rigid bodies on three points, a dense matrix confirms the result.

    The displacement is 2 µm where all cells press and up to 70 µm where three do.
    """
    grid, height = rough(24, rms, seed)
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, 100.0, 0.0, 0.0)
    assert state.converged, state.message
    # Rounding of heights of 10 mm is 1e-15 mm, 1e-10 of that displacement.
    assert normal_error(grid, MODULUS, height, state) < 3.0 * SOLVED
    cells = np.count_nonzero(state.pressure)
    assert (cells == 576) == (rms < 1e-5)
    if rms > 1.0:
        assert cells == 3


@pytest.mark.parametrize("rms", [1e-3, 1e-1, 1.0])
@pytest.mark.parametrize("seed", [0, slow(1)])
def test_any_roughness_of_dissimilar_bodies_is_solved(rms, seed):
    """Three cells carry a load within the triangle of their centres; then sheared, and back."""
    grid, height = rough(24, rms, seed)
    contact = FrictionalContact(HalfSpace(grid, PAIRS["unlike"]), 0.5)
    state = contact.unloaded_state(height)
    for Qx in (0.0, 10.0, -10.0):
        before, state = state, contact.advance(state, height, force(100.0, Qx))
        assert state.converged, state.message
        error = frictional_error(contact, before, height, state, force(100.0, Qx))
        assert error < 3.0 * SOLVED


@pytest.mark.slow
def test_heights_whose_digits_hide_the_displacement_are_refused():
    """Rounding of 1e3 mm is 1e-13 mm, 1e-8 of a displacement of 1e-5 mm: about 1e-2 N here."""
    grid, height = rough(24, 1e3)
    contact = NormalContact(HalfSpace(grid, PAIR))
    turning = {"Mx": 0.0, "My": 0.0}
    assert contact.solve(height, 10.0, **turning).converged
    lost = contact.solve(height, 1e-5, **turning)
    assert not lost.converged
    assert "rounding hides" in lost.message
    assert "raise the load" in lost.message
