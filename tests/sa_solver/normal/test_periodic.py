"""Tests of contact on a periodic half-space: waves in closed form, and symmetries."""

from __future__ import annotations

import numpy as np
import pytest

from sa_solver import (
    ElasticPair,
    FrictionalContact,
    Grid,
    HalfSpace,
    InputError,
    Material,
    NormalContact,
)
from sa_solver.contact_state import ContactLoad
from sa_solver.reference.waviness import WavySurface

MODULUS, AMPLITUDE = 1e5, 1e-3
PAIR = ElasticPair.from_contact_modulus(MODULUS)


def periodic(grid: Grid) -> NormalContact:
    return NormalContact(HalfSpace(grid, PAIR, periodic=True))


def rough(cells: int) -> np.ndarray:
    """Return a periodic self-affine surface ``(cells, cells)`` [mm]."""
    along_x, along_y = np.fft.fftfreq(cells, 1 / cells), np.fft.rfftfreq(cells, 1 / cells)
    wave_number = np.hypot(along_x[:, None], along_y)
    size = np.where(wave_number >= 3.0, np.maximum(wave_number, 1.0) ** -1.8, 0.0)
    phase = np.random.default_rng(1).random(wave_number.shape)
    heights = np.fft.irfft2(size * np.exp(2j * np.pi * phase), s=(cells, cells))
    return AMPLITUDE * heights / heights.std()


def test_waves_in_full_contact_are_exact() -> None:
    """P = p̄ + Σ E* k Δ/2 cos kx (Johnson 1985, section 13.2)."""
    grid, mean = Grid.covering((1.0, 2.0), (48, 60)), 2000.0
    along_x, along_y = 2.0 * np.pi * grid.x, 3.0 * np.pi * grid.y
    height = -AMPLITUDE * (np.cos(along_x) + np.cos(along_y))
    state = periodic(grid).solve(height, P=mean * 2.0)
    waves = 2.0 * np.pi * np.cos(along_x) + 3.0 * np.pi * np.cos(along_y)
    exact = mean + 0.5 * MODULUS * AMPLITUDE * waves
    np.testing.assert_allclose(state.pressure, exact, atol=1e-9 * mean)
    assert state.approach == pytest.approx(0.0, abs=1e-9 * AMPLITUDE)
    assert not state.message


@pytest.mark.parametrize("share", [0.2, 0.7])
@pytest.mark.parametrize("cells", [32, 128, 512])
def test_partial_contact_of_a_wave_converges_to_westergaard(share, cells) -> None:
    """The pressure rises as a root at the edges, so that its mean error falls with power 1.5."""
    grid = Grid.line_contact(1.0, cells)
    wave = WavySurface(AMPLITUDE, 1.0, share * np.pi * MODULUS * AMPLITUDE, MODULUS)
    state, exact = (
        periodic(grid).solve(wave.gap(grid.x), P=wave.mean_pressure),
        wave.pressure(grid.x),
    )
    assert np.abs(state.pressure - exact).mean() < 4.0 * cells**-1.5 * exact.mean()
    assert abs(state.contact_area - 2.0 * wave.half_width) <= 2.0 / cells


def test_a_moved_surface_has_the_moved_pressure() -> None:
    grid, height = Grid.covering((1.0, 1.0), (64, 64)), rough(64)
    contact = periodic(grid)
    state = contact.solve(height, P=100.0)
    moved = contact.solve(np.roll(height, (20, 31), (0, 1)), P=100.0)
    error = np.abs(np.roll(state.pressure, (20, 31), (0, 1)) - moved.pressure).max()
    assert error < 1e-6 * state.pressure.max()
    assert not moved.message  # The pressure at the border of the grid is no warning.


def test_a_patch_repeats_itself() -> None:
    """Four patches carry four times the load, each as one alone."""
    height = rough(48)
    one = periodic(Grid.covering((1.0, 1.0), (48, 48))).solve(height, P=100.0)
    four = periodic(Grid.covering((2.0, 2.0), (96, 96))).solve(np.tile(height, (2, 2)), P=400.0)
    error = np.abs(np.tile(one.pressure, (2, 2)) - four.pressure).max()
    assert error < 1e-6 * one.pressure.max()
    assert four.approach == pytest.approx(one.approach, rel=1e-7)


def test_load_and_approach_are_inverse_to_each_other() -> None:
    contact, height = periodic(Grid.covering((1.0, 1.0), (64, 64))), rough(64)
    pressed = contact.solve(height, P=200.0)
    moved = contact.solve(height, approach=pressed.approach)
    assert pytest.approx(200.0, rel=1e-6) == moved.P


def test_a_large_local_compliance_evens_out_the_pressure() -> None:
    contact, height = periodic(Grid.covering((1.0, 1.0), (32, 32))), rough(32)
    state = contact.solve(height, P=100.0, compliance=np.full((32, 32), 1.0))
    np.testing.assert_allclose(state.pressure, 100.0, rtol=1e-4)


def test_what_a_periodic_contact_cannot_do_is_refused() -> None:
    grid = Grid.covering((1.0, 1.0), (16, 16))
    contact, height = periodic(grid), rough(16)
    for entry in ({"Mx": 0.0}, {"tilt_y": 1e-3}):
        with pytest.raises(InputError, match="turn"):
            contact.solve(height, P=1.0, **entry)
    with pytest.raises(InputError, match="is full at an approach"):
        contact.solve(height, approach=1.001 * float(height.mean()) + 1e-6)
    steel, rubber = Material(young=210e3, poisson=0.3), Material(young=10.0, poisson=0.5)
    sheared = FrictionalContact(HalfSpace(grid, ElasticPair(steel, steel), periodic=True), 0.5)
    unloaded = sheared.unloaded_state(height)
    for load, why in (
        (ContactLoad(P=1.0, Mz=0.1), "turn"),
        (ContactLoad(P=1.0, strain=1e-3), "strain"),
    ):
        with pytest.raises(InputError, match=why):
            sheared.advance(unloaded, height, load)
    with pytest.raises(InputError, match="similar"):
        HalfSpace(grid, ElasticPair(steel, rubber), periodic=True)
