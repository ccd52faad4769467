"""Scans averaged onto grids, against closed forms, balances and rates."""

import doctest

import numpy as np
import pytest

from sa_solver import ElasticPair, Grid, HalfSpace, InputError, Material, NormalContact
from sa_solver.surfaces import scans
from sa_solver.surfaces.scans import Scan, cell_means, filled, fit, levelled, resampled, rms

RNG = np.random.default_rng


def over(size, shape, of):
    """Return a scan of points at the middles of its cells."""
    grid = Grid.covering(size, shape)
    return Scan(np.asarray(of(grid.x, grid.y) + 0.0 * (grid.x + grid.y)), grid.pitch)


def test_examples():
    assert doctest.testmod(scans).failed == 0


def test_a_grid_of_its_own_points_gets_the_scan_itself():
    scan = Scan(RNG(0).normal(size=(24, 17)), (0.01, 0.013))
    got = resampled(scan, Grid.covering(scan.size, scan.heights.shape))
    np.testing.assert_allclose(got.heights, scan.heights, rtol=0.0, atol=1e-13)
    assert got.lost < 1e-13


def test_parabolas_are_exact_and_no_volume_is_lost():
    """The grid has nothing in common with the points of the scan, and is shifted as well."""

    def mean(x, y, dx, dy):  # Means of 3 + x + 2 y + x² - x y + y² / 2 over cells.
        return 3 + x + 2 * y + x**2 + dx**2 / 12 - x * y + 0.5 * (y**2 + dy**2 / 12)

    scan = over((1.0, 0.9), (37, 41), lambda x, y: mean(x, y, 1 / 37, 0.9 / 41))
    for shape in ((9, 7), (80, 99)):
        grid = Grid.covering((0.7, 0.6), shape)
        got = resampled(scan, grid, shift=(0.1, -0.07)).heights
        exact = mean(grid.x - 0.1, grid.y + 0.07, *grid.pitch)
        np.testing.assert_allclose(got, exact, atol=1e-11)
    rough = Scan(RNG(1).normal(size=(64, 48)), (0.01, 0.01))
    coarse = resampled(rough, Grid.covering(rough.size, (9, 7)))
    assert coarse.heights.mean() == pytest.approx(rough.heights.mean(), abs=1e-14)


def test_waves_finer_than_the_grid_do_not_come_back_as_others():
    """A sine is averaged over cells of 0.9 wavelengths: sampled points would show all of it."""
    cells, wave = 20, 1.0 / 20 / 0.9
    scan = over((1.0, 1.0), (2000, 3), lambda x, y: np.sin(2 * np.pi * x / wave))
    got = resampled(scan, Grid.covering((1.0, 1.0), (cells, 1)))
    amplitude = np.sqrt(2.0) * rms(got.heights)
    assert amplitude == pytest.approx(abs(np.sinc(0.9 * 1.0)), rel=0.02)
    assert got.lost == pytest.approx(np.sqrt(0.5), rel=0.02)


def test_smooth_surfaces_converge_with_the_pitch_of_the_scan():
    """The order is four where points are means; the cells are finer than all points."""
    grid, k = Grid.covering((0.5, 0.5), (64, 4)), 2 * np.pi / 0.3
    # The mean of cos k x over a cell of width d is cos k x sin(k d/2) / (k d/2).
    exact = np.cos(k * grid.x) * np.sinc(k * grid.pitch[0] / 2 / np.pi)
    errors = []
    for count in (32, 64, 128):
        share = np.sinc(k / count / 2 / np.pi)
        scan = over((1.0, 1.0), (count, 4), lambda x, y, share=share: share * np.cos(k * x))
        errors.append(np.abs(resampled(scan, grid).heights - exact).max())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(rates > 2.9), (errors, rates)


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, np.pi, -np.pi / 2, 0.4, -2.0])
def test_scans_turn_from_x_to_y_about_their_middle(angle):
    def wave(x, y):
        return np.sin(7.0 * x + 2.0) * np.cos(5.0 * y - 1.0) + x

    scan = over((1.2, 1.0), (240, 220), wave)
    grid, shift = Grid.covering((0.4, 0.3), (40, 32)), (0.05, 0.02)
    x, y = grid.x - shift[0], grid.y - shift[1]
    cos, sin = np.cos(angle), np.sin(angle)
    exact = wave(cos * x + sin * y, cos * y - sin * x)
    # Points and means over cells of 10 um differ by less than 1e-3 of the waves.
    np.testing.assert_allclose(resampled(scan, grid, shift, angle).heights, exact, atol=8e-4)


def test_what_turns_and_goes_on_mirrored_is_the_mirrored_scan():
    scan = Scan(RNG(2).normal(size=(20, 30)), (0.1, 0.1))
    grid = Grid.covering((4.0, 3.0), (40, 30))
    with pytest.raises(InputError, match="2 mm x 3 mm, ends"):
        resampled(scan, grid)
    got = resampled(scan, grid, beyond="mirrored")
    np.testing.assert_allclose(got.heights, np.pad(scan.heights, ((10, 10), (0, 0)), "symmetric"))
    assert got.beyond == 0.5
    assert resampled(scan, grid, shift=(0.5, 0.0), beyond="mirrored").beyond == 0.5
    turned = resampled(scan, grid, angle=0.5 * np.pi, beyond="mirrored")
    assert turned.beyond == pytest.approx(0.5)  # 2 x 3 mm of 4 x 3 mm, in either orientation.
    # The corners of the grid turn out of a square scan.
    square = Scan(RNG(2).normal(size=(20, 20)), (0.1, 0.1))
    with pytest.raises(InputError, match="where it is put"):
        resampled(square, Grid.covering((1.9, 1.9), (20, 20)), angle=0.3)


@pytest.mark.parametrize("shape", [(40, 30), (200, 1)])
def test_forms_are_taken_off_where_points_are_missing(shape):
    """Least squares over the measured points remove the form to rounding."""
    one = float(shape[1] > 1)

    def form(x, y):
        return 2e-3 + 0.1 * x - one * 0.2 * y + 0.3 * x**2 + one * (0.1 * x * y - 0.4 * y**2)

    scan = over((1.0, 1.0), shape, form)
    scan.heights[RNG(3).random(shape) < 0.05] = np.nan
    assert rms(levelled(scan, "form").heights) < 1e-15
    whole = over((1.0, 1.0), shape, form)
    np.testing.assert_allclose(filled(scan, 0.1).heights, whole.heights, atol=1e-13)
    for level in ("mean", "plane"):
        left = levelled(scan, level)
        assert abs(np.nanmean(left.heights)) < 1e-15
        assert np.abs(fit(left, level)).max() < 1e-15  # There is nothing left to subtract.
        assert rms(left.heights) > 0.02  # The parabola along x alone: 0.3 rms(x²) = 0.022.
    assert rms(levelled(scan, "plane").heights) < rms(levelled(scan, "mean").heights)


def test_filled_points_lie_among_their_neighbours():
    """There are no new extremes, for a cluster at the border and one in the middle."""
    scan = Scan(RNG(4).normal(size=(30, 30)), (1.0, 1.0))
    scan.heights[:3, 5:9] = scan.heights[12:16, 20:22] = np.nan
    whole = filled(scan).heights
    new = whole[~scan.measured]
    assert np.abs(new).max() < np.nanmax(np.abs(scan.heights))
    np.testing.assert_array_equal(whole[scan.measured], scan.heights[scan.measured])


def test_what_is_no_scan_is_refused():
    with pytest.raises(InputError, match="without a point"):
        Scan(np.full((3, 3), np.nan), (1.0, 1.0))
    with pytest.raises(InputError, match="pitch above 0"):
        Scan(np.zeros((3, 3)), (1.0, 0.0))
    holes = Scan(np.where(np.eye(4) > 0, np.nan, 1.0), (1.0, 1.0))
    with pytest.raises(InputError, match=r"25.0% .* 5.0%"):
        filled(holes, 0.05)
    with pytest.raises(InputError, match="fill them first"):
        resampled(holes, Grid.covering((2.0, 2.0), (2, 2)))
    with pytest.raises(InputError, match=r"3 points .* at least 6"):
        levelled(Scan(np.array([[0.0, 1.0], [2.0, np.nan]]), (1.0, 1.0)), "plane")
    with pytest.raises(InputError, match="4 columns"):
        resampled(filled(holes), Grid.line_contact(2.0, 8))


def test_profiles_go_onto_strips():
    edges = np.linspace(-0.5, 0.5, 101)
    profile = Scan(np.diff(edges**3 / 3)[:, None] / 0.01, (0.01, 1.0))
    grid = Grid.line_contact(0.8, 30)
    got = resampled(profile, grid).heights
    np.testing.assert_allclose(got, grid.x**2 + grid.pitch[0] ** 2 / 12, atol=1e-13)
    assert cell_means(np.ones((2, 3)), np.arange(3.0), np.array([0.5, 1.5])).shape == (1, 3)


def test_pressures_converge_with_the_pitch_of_the_scan():
    """The pressure of a ball with waves converges with second order on a fixed grid."""
    steel = Material(young=210e3, poisson=0.3)
    grid = Grid.covering((0.6, 0.6), (48, 48))
    contact = NormalContact(HalfSpace(grid, ElasticPair(steel, steel)))

    def ball(x, y):
        return (x**2 + y**2) / 20.0 + 1e-4 * np.cos(2 * np.pi * x / 0.2) * np.cos(20.0 * y)

    def pressure(count):
        scan = over((0.75, 0.75), (count, count), ball)
        return contact.solve(resampled(scan, grid).heights, P=50.0).pressure

    finest = pressure(768)
    errors = [np.linalg.norm(pressure(n) - finest) / np.linalg.norm(finest) for n in (24, 48, 96)]
    assert errors[0] > 5e-3
    assert np.all(np.log2(np.array(errors[:-1]) / errors[1:]) > 1.9), errors
    # Points of 0.5 um and the middles of cells of 12.5 um are means over different lengths.
    points = contact.solve(ball(grid.x, grid.y), P=50.0).pressure
    assert np.linalg.norm(points - finest) < 2e-3 * np.linalg.norm(finest)


def test_a_masked_point_of_a_scan_is_a_missing_one():
    """The point is filled by the plane around it; its value in the array does not matter."""
    plane = over((1.0, 1.0), (12, 12), lambda x, y: 0.1 * x - 0.2 * y)
    spoiled = np.ma.array(plane.heights.copy(), mask=False)
    spoiled.data[3:5, 6] = 1e3
    spoiled[3:5, 6] = np.ma.masked
    scan = Scan(spoiled, plane.pitch)
    assert scan.missing == pytest.approx(2 / 144)
    np.testing.assert_allclose(filled(scan).heights, plane.heights, atol=1e-12)
    with pytest.raises(InputError):
        Scan(plane.heights.astype(str), plane.pitch)
