"""Tests of shear on a periodic half-space: waves in closed form, Ciavarella and Jäger, balances."""

from __future__ import annotations

import numpy as np
import pytest

from sa_solver import (
    ElasticPair,
    FrictionalContact,
    Grid,
    HalfSpace,
    Material,
    NormalContact,
    TangentialContact,
)
from sa_solver.contact_state import ContactLoad
from sa_solver.reference.waviness import WavySurface

STEEL = Material(young=210e3, poisson=0.3)
PAIR = ElasticPair(STEEL, STEEL)
FRICTION = 0.5


@pytest.mark.parametrize("waves", [(1, 0), (0, 2), (3, 4), (-2, 5)])
def test_waves_of_shear_have_the_compliance_of_plane_or_antiplane_strain(waves) -> None:
    """Shear along the wave moves the surfaces by n/k of it, across the wave by s/k."""
    grid = Grid.covering((1.0, 2.0), (24, 30))
    along = 2.0 * np.pi * np.array(waves) / grid.size
    wave_number = np.hypot(*along)
    wave = np.cos(along[0] * grid.x + along[1] * grid.y + 0.3)
    half_space, unit = HalfSpace(grid, PAIR, periodic=True), along / wave_number
    for direction, compliance in ((unit, PAIR.normal), (unit[::-1] * (-1, 1), PAIR.shear)):
        shear = direction[:, None, None] * wave
        moved = half_space.shear(shear)
        np.testing.assert_allclose(moved, compliance / wave_number * shear, atol=1e-18)


def test_shear_of_a_wave_is_the_difference_of_two_pressures() -> None:
    """Ciavarella and Jäger: q = µ (p(P) - p(P*)), with P* = P - Q/µ, on any plane surface."""
    grid = Grid.line_contact(1.0, 256)
    modulus, load, force = PAIR.contact_modulus, 120.0, 0.6 * FRICTION * 120.0
    wave = WavySurface(1e-3, 1.0, load, modulus)
    half_space = HalfSpace(grid, PAIR, periodic=True)
    normal, height = NormalContact(half_space), wave.gap(grid.x)
    pressed, less = (normal.solve(height, P=P) for P in (load, load - force / FRICTION))
    state = TangentialContact(half_space).solve(FRICTION * pressed.pressure, Qx=force)
    exact = FRICTION * (pressed.pressure - less.pressure)
    assert np.abs(state.shear[0] - exact).max() < 1e-5 * exact.max()
    assert 0.0 < state.sticking.sum() == np.count_nonzero(less.pressure) < len(exact)


def _rough(cells: int) -> np.ndarray:
    along = np.fft.fftfreq(cells, 1 / cells), np.fft.rfftfreq(cells, 1 / cells)
    wave_number = np.hypot(along[0][:, None], along[1])
    size = np.where(wave_number >= 2.0, np.maximum(wave_number, 1.0) ** -2.0, 0.0)
    phase = np.random.default_rng(2).random(wave_number.shape)
    heights = np.fft.irfft2(size * np.exp(2j * np.pi * phase), s=(cells, cells))
    return 5e-4 * heights / heights.std()


def test_a_moved_surface_slips_in_the_moved_cells() -> None:
    """The contact at the border of the grid continues on the other side."""
    grid, height = Grid.covering((1.0, 1.0), (48, 48)), _rough(48)
    contact = FrictionalContact(HalfSpace(grid, PAIR, periodic=True), FRICTION)
    shift = (17, 30)
    states = []
    for surface in (height, np.roll(height, shift, (0, 1))):
        state = contact.unloaded_state(surface)
        for load in (ContactLoad(P=100.0), ContactLoad(P=100.0, Qx=20.0, Qy=15.0)):
            state = contact.advance(state, surface, load)
        states.append(state)
    moved = np.roll(states[0].shear, shift, (1, 2))
    assert np.abs(moved - states[1].shear).max() < 1e-5 * moved.max()
    assert np.any(states[0].sticking)
    assert np.hypot(*states[0].slip).max() > 0.0


@pytest.mark.parametrize("increments", [20, 40])
def test_a_cycle_dissipates_the_work_of_its_forces(increments) -> None:
    """Both are sums over increments, whose difference falls with the square of their length."""
    grid, height = Grid.covering((1.0, 1.0), (32, 32)), _rough(32)
    contact = FrictionalContact(HalfSpace(grid, PAIR, periodic=True), FRICTION)
    state = contact.advance(contact.unloaded_state(height), height, ContactLoad(P=80.0))
    works, losses = [], []
    for force in 32.0 * np.sin(np.linspace(0.0, 4.0 * np.pi, 2 * increments + 1)[1:]):
        after = contact.advance(state, height, ContactLoad(P=80.0, Qx=float(force)))
        mean, moved = 0.5 * (state.resultants + after.resultants), after.rigid - state.rigid
        works.append(mean[1] * moved[1])
        losses.append(after.energy.sum())
        state = after
    work, lost = sum(works[increments:]), sum(losses[increments:])
    assert work == pytest.approx(lost, rel=7.0 / increments**2)
