"""Pairs of materials, grids and counters: known values, symmetries, errors."""

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from sa_solver.types import ElasticPair, Grid, Material, Tally

RIGID = Material(np.inf, 0.3)
STEEL = Material(200e3, 0.3)
ALUMINIUM = Material(70e3, 0.34)


def test_contact_modulus_is_that_of_johnson():
    """Eq. 4.20: 1/E* = Σ (1-ν²)/E."""
    pair = ElasticPair(STEEL, ALUMINIUM)
    inverse = sum((1.0 - body.poisson**2) / body.young for body in (STEEL, ALUMINIUM))
    assert pair.contact_modulus == pytest.approx(1.0 / inverse, rel=1e-14)


def test_compliances_are_sums_over_the_bodies():
    pair, alone = ElasticPair(STEEL, ALUMINIUM), ElasticPair(RIGID, ALUMINIUM)
    other = ElasticPair(STEEL, RIGID)
    for name in ("normal", "shear", "poisson", "coupling"):
        parts = getattr(alone, name) + getattr(other, name)
        assert getattr(pair, name) == pytest.approx(parts, rel=1e-14)
    assert alone.shear == pytest.approx(2.0 * 1.34 / 70e3, rel=1e-14)
    assert alone.poisson == pytest.approx(0.34 * alone.shear, rel=1e-14)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_identical_materials_are_exactly_similar(poisson):
    pair = ElasticPair(Material(115e3, poisson), Material(115e3, poisson))
    assert pair.coupling == 0.0
    assert pair.dundurs_beta == 0.0
    assert pair.similar


def test_the_same_modulus_in_other_units_is_similar():
    """Conversions of units change the last digits."""
    off = 115e3 * (1.0 + 4.0 * np.finfo(float).eps)
    pair = ElasticPair(Material(115e3, 0.29), Material(off, 0.29))
    assert pair.coupling != 0.0
    assert pair.similar
    assert not ElasticPair(Material(115e3, 0.29), Material(115e3 + 1.0, 0.29)).similar


@pytest.mark.parametrize(("poisson", "beta"), [(0.0, 0.5), (0.3, 2.0 / 7.0), (0.5, 0.0)])
def test_dundurs_beta_of_a_body_on_a_rigid_one(poisson, beta):
    """The value is β = (1-2ν) / 2(1-ν), positive where body 2 is the compliant one."""
    body = Material(3e3, poisson)
    assert ElasticPair(RIGID, body).dundurs_beta == pytest.approx(beta, abs=1e-15)
    assert ElasticPair(body, RIGID).dundurs_beta == pytest.approx(-beta, abs=1e-15)
    assert ElasticPair(RIGID, body).similar == (poisson == 0.5)


def test_swapping_the_bodies_changes_the_sign_of_the_coupling_alone():
    pair, swapped = ElasticPair(STEEL, ALUMINIUM), ElasticPair(ALUMINIUM, STEEL)
    assert pair.coupling == -swapped.coupling != 0.0
    for name in ("normal", "shear", "poisson"):
        assert getattr(pair, name) == getattr(swapped, name)


def test_two_rigid_bodies_are_refused():
    with pytest.raises(ValueError, match="two rigid bodies"):
        ElasticPair(RIGID, RIGID)


@pytest.mark.parametrize(
    ("shape", "pitch"), [((0, 4), (1.0, 1.0)), ((4, -1), (1.0, 1.0)), ((4, 4), (1.0, 0.0))]
)
def test_a_grid_without_area_is_refused(shape, pitch):
    with pytest.raises(ValueError, match="no area"):
        Grid(shape, pitch)


@pytest.mark.parametrize(("shape", "pitch"), [((4, 2), (0.1, 1.0)), ((4, 1), (0.1, 0.5))])
def test_a_line_grid_has_one_row_one_millimetre_long(shape, pitch):
    with pytest.raises(ValueError, match=r"Grid\.line_contact"):
        Grid(shape, pitch, line=True)


def test_strips_cover_their_width_about_the_origin():
    grid = Grid.line_contact(3.0, 6)
    assert grid.line
    assert grid.shape == (6, 1)
    assert grid.size == pytest.approx((3.0, 1.0))
    assert grid.cell_area == pytest.approx(0.5)
    np.testing.assert_allclose(grid.x[:, 0], [-1.25, -0.75, -0.25, 0.25, 0.75, 1.25])
    assert np.array_equal(grid.y, [[0.0]])


def test_strips_of_negative_width_are_refused():
    with pytest.raises(ValueError, match="no area"):
        Grid.line_contact(-1.0, 4)


def test_a_covering_grid_has_the_size_it_covers():
    grid = Grid.covering((3.0, 0.7), (8, 5))
    assert grid.size == pytest.approx((3.0, 0.7))
    assert not grid.line
    assert grid.x[0, 0] == pytest.approx(-1.5 + 0.5 * 3.0 / 8)
    assert grid.x.sum() == pytest.approx(0.0, abs=1e-14)


@pytest.fixture
def restless():
    """Let threads switch after every few instructions."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-7)
    yield
    sys.setswitchinterval(interval)


@pytest.mark.usefixtures("restless")
def test_a_tally_counts_what_any_thread_has_done_in_order():
    reported, things, threads = [], 500, 4
    done = Tally(lambda count, total: reported.append((count, total)), things * threads)
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda _: [done() for _ in range(things)], range(threads)))
    assert reported == [(count, things * threads) for count in range(1, things * threads + 1)]
