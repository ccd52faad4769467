"""The wear between two scans: known caps with known noise, tilt, shift and missing points."""

import doctest

import numpy as np
import pytest

from sa_solver import Grid, InputError
from sa_solver.surfaces.scans import Scan
from wear import scar as module
from wear.scar import measure_scar

DEEPEST, RADIUS = 4e-3, 10.0


def rough(rng, cells, waves):
    """Return periodic heights of unit deviation, with waves down to ``waves`` points."""
    k = np.hypot(*np.meshgrid(np.fft.fftfreq(cells), np.fft.fftfreq(cells), indexing="ij"))
    spectrum = np.fft.fft2(rng.normal(size=(cells, cells))) * np.exp(-0.5 * (k * waves) ** 2)
    heights = np.fft.ifft2(spectrum).real
    return heights / heights.std()


def shifted(heights, shift):
    """Return periodic heights moved exactly, by fractions of a point."""
    x, y = (np.fft.fftfreq(n) * by for n, by in zip(heights.shape, shift, strict=True))
    turned = np.exp(-2j * np.pi * (x[:, None] + y[None, :]))
    return np.fft.ifft2(np.fft.fft2(heights) * turned).real


def scans(
    seed, cells=80, noise=2e-4, waves=0.0, missing=0.0, roughness=4e-4, most_shift=3.0, size=1.0
):
    """Return scans before and after a cap of 4 µm, its volume, its disk, and the shift."""
    rng, grid = np.random.default_rng(seed), Grid.covering((size, size), (cells, cells))
    cap = np.maximum(DEEPEST - (grid.x**2 + grid.y**2) / (2.0 * RADIUS), 0.0)
    surface = roughness * rough(rng, cells, 18.0)
    shift = rng.uniform(-most_shift, most_shift, 2)
    first, second = (noise * rough(rng, cells, waves) for _ in range(2))
    before = surface + first
    after = shifted(surface, shift) - cap + second + 0.02 * grid.x - 0.01 * grid.y + 1e-3
    for heights in (before, after):
        heights[rng.random(heights.shape) < missing] = np.nan
    disk = grid.x**2 + grid.y**2 < 0.33**2
    pair = Scan(before, grid.pitch), Scan(after, grid.pitch)
    return *pair, cap.sum() * grid.cell_area, disk, shift * grid.pitch


def test_example():
    assert doctest.testmod(module).failed == 0


@pytest.mark.parametrize("given", [True, False], ids=["given", "found"])
def test_a_tilted_scan_with_missing_points_gives_its_volume(given):
    """5 % of the points are missing, with a tilt of 1° and a shift of 2.4 points.

    The volume is within 1 % and within its bound.
    """
    before, after, volume, disk, shift = scans(7, cells=128, noise=5e-5, missing=0.05)
    got = measure_scar(before, after, disk if given else None)
    assert got.volume == pytest.approx(volume, rel=0.01)
    assert abs(got.volume - volume) < got.volume_error < 0.01 * volume
    assert got.deepest == pytest.approx(DEEPEST, abs=2.0 * got.depth_error)
    np.testing.assert_allclose(got.shift, shift, atol=0.1 * before.pitch[0])
    assert np.all(np.array(got.shift_error) < 0.1 * before.pitch[0])
    assert 0.05 < got.missing < 0.15
    assert got.sure
    # The residual contains the noise of two scans, the first slightly smoothed by interpolation.
    assert 0.9 < got.noise / (np.sqrt(2.0) * 5e-5) < 1.6


def test_a_scar_over_much_of_the_scan_is_found_where_it_hides_the_shift():
    """A shift of 20 points, visible in the rim alone, is found as with a given worn area."""
    before, after, volume, _, shift = scans(2, 320, 1e-4, size=0.8, most_shift=20.0)
    got = measure_scar(before, after)
    assert abs(got.volume - volume) < got.volume_error < 0.01 * volume
    np.testing.assert_allclose(got.shift, shift, atol=0.1 * before.pitch[0])


def test_no_noise_no_error():
    """A cap and a plane without noise are exact to rounding, and the shift is unknown."""
    before, after, volume, disk, _ = scans(1, noise=0.0, roughness=0.0)
    got = measure_scar(before, after, disk)
    assert got.volume == pytest.approx(volume, rel=1e-10)
    assert got.volume_error < 1e-9 * volume
    assert got.shift is None


@pytest.mark.parametrize("given", [True, False], ids=["given", "found"])
def test_without_noise_no_error_is_known(given):
    """A box of 20 x 10 points and 1 µm in a plane has its exact volume, and no bounds."""
    box = np.zeros((60, 50))
    box[20:40, 25:35] = 1e-3
    before = Scan(np.zeros(box.shape), (0.01, 0.02))
    scar = measure_scar(before, Scan(-box, before.pitch), box > 0.0 if given else None)
    assert scar.volume == pytest.approx(200 * 1e-3 * 0.01 * 0.02, rel=1e-12)
    assert (scar.volume_error, scar.depth_error, scar.shift_error) == (None, None, None)
    assert (scar.length, scar.patches, scar.sure) == (None, None, False)


def test_scans_of_other_points():
    """A second scan of half the pitch and smaller extent is averaged onto the first's points."""
    before, _, _, _, _ = scans(3, cells=80, noise=0.0, most_shift=0.0)
    grid = Grid.covering((0.9, 0.8), (180, 160))
    cap = np.maximum(0.5 * DEEPEST - (grid.x**2 + grid.y**2) / (2.0 * RADIUS), 0.0)
    rng = np.random.default_rng(0)
    smooth = Scan(np.zeros((80, 80)), before.pitch)
    got = measure_scar(smooth, Scan(1e-5 * rng.normal(size=grid.shape) - cap, grid.pitch))
    volume = np.pi * RADIUS * (0.5 * DEEPEST) ** 2
    assert got.volume == pytest.approx(volume, rel=3e-3)
    assert got.depth.shape == (72, 64)


def test_what_cannot_be_measured_is_refused():
    before, after, _, disk, _ = scans(5)
    with pytest.raises(InputError, match=r"no area is clearly deeper|more than two thirds"):
        measure_scar(after, before)  # in this order the body has grown
    with pytest.raises(InputError, match="around the worn area"):
        measure_scar(before, after, np.ones_like(disk))
    with pytest.raises(InputError, match=r"worn area has \(3, 3\) points"):
        measure_scar(before, after, np.ones((3, 3), dtype=bool))
    for pitch in (before.pitch[0] * 1e3, before.pitch[0] * 1e-3):
        with pytest.raises(InputError, match="mm in common"):
            measure_scar(before, Scan(after.heights, (pitch, pitch)))
    profile = Scan(np.zeros((9, 1)), (1.0, 1.0))
    with pytest.raises(InputError, match="a profile has no volume"):
        measure_scar(profile, profile)


@pytest.mark.slow
@pytest.mark.parametrize("waves", [0.0, 9.0], ids=["white", "correlated"])
def test_bounds_cover_the_truth(waves):
    """The bounds hold in 95 % of 100 trials, within what chance allows, and are no wider."""
    tried = [scans(seed, cells=100, waves=waves, missing=0.02) for seed in range(100)]
    found = [(measure_scar(*trial[:2], trial[3]), trial[2]) for trial in tried]
    errors = np.array([scar.volume - volume for scar, volume in found])
    bounds = np.array([scar.volume_error for scar, _ in found])
    assert np.count_nonzero(np.abs(errors) < bounds) >= 90
    shifts = np.array([(scar.shift, scar.shift_error) for scar, _ in found])
    within = np.abs(shifts[:, 0] - [trial[4] for trial in tried]) < shifts[:, 1]
    assert np.all(np.count_nonzero(within, axis=0) >= 90)
    # At the middle of the cap the depth is flat, and its true value is known.
    depths = np.array([np.nanmean(scar.depth[49:52, 49:52]) for scar, _ in found])
    assert np.count_nonzero(np.abs(depths - DEEPEST) < [s.depth_error for s, _ in found]) >= 90
    assert np.mean(bounds) < 1.5 * 1.96 * errors.std()
    assert abs(errors.mean()) < 3.0 * errors.std() / 10.0
