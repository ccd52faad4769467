"""Contacts that yield: bounds, the plastic limit, energy, and what a second loading leaves."""

import numpy as np
import pytest

from sa_solver import (
    ContactLoad,
    ContactLoadPath,
    ElasticPair,
    FrictionalContact,
    Grid,
    HalfSpace,
    InputError,
    Layer,
    Material,
    NormalContact,
    march_history,
    steady_rolling,
)
from sa_solver.normal.control import NormalContactError

STEEL = Material(210e3, 0.3)
GRID = Grid.covering((1.0, 1.0), (64, 64))
BALL = (GRID.x**2 + GRID.y**2) / 20.0
LOAD = 150.0


def contact_on(grid=GRID, periodic=False):
    return NormalContact(HalfSpace(grid, ElasticPair(STEEL, STEEL), periodic=periodic))


def rough(seed=1):
    """Return a periodic rough surface on the grid, with waves of 2 to 21 cells [mm]."""
    nx, ny = GRID.shape
    kx, ky = np.fft.fftfreq(nx, 1.0 / nx)[:, None], np.fft.rfftfreq(ny, 1.0 / ny)[None, :]
    q = np.hypot(kx, ky)
    size = np.where((q >= 3.0) & (q <= 24.0), np.maximum(q, 1.0) ** -1.8, 0.0)
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, q.shape)
    heights = np.fft.irfft2(size * np.exp(1j * phase), GRID.shape)
    return 1e-3 * heights / heights.std()


@pytest.mark.parametrize("surface", [BALL, rough()], ids=["ball", "rough"])
@pytest.mark.parametrize("hardness", [800.0, 1200.0])
def test_pressure_gap_and_flattening_exclude_each_other(surface, hardness):
    state = contact_on(periodic=surface is not BALL).solve(surface, P=LOAD, hardness=hardness)
    assert state.converged
    assert pytest.approx(LOAD, rel=1e-9) == state.P
    depth = state.displacement.max()
    p, g, f = state.pressure, state.gap, state.flattening
    assert p.min() >= 0.0
    assert p.max() <= hardness * (1.0 + 1e-6)
    assert f.max() > 0.0
    assert f.min() >= 0.0
    assert np.abs(f * (hardness - p)).max() == 0.0
    assert np.abs(p * g).max() < 1e-6 * hardness * depth
    assert g.min() > -1e-6 * depth
    # The same state is an elastic contact of the flattened surfaces.
    found = surface + f + state.displacement - state.approach - g
    assert np.abs(found).max() < 1e-9 * depth


def test_a_plastic_ball_is_pressed_over_its_load_by_the_hardness():
    for hardness in (400.0, 250.0):
        state = contact_on().solve(BALL, P=LOAD, hardness=hardness)
        assert state.contact_area == pytest.approx(LOAD / hardness, rel=0.01)


def test_cells_that_yield_at_the_border_are_told_of():
    small = Grid.covering((0.2, 0.2), (16, 16))
    height = (small.x**2 + small.y**2) / 20.0
    state = contact_on(small).solve(height, P=39.0, hardness=1000.0)
    yields = state.flattening > 0.0
    border = np.ones(small.shape, dtype=bool)
    border[1:-1, 1:-1] = False
    share = state.pressure[border].sum() / state.pressure.sum()
    assert (yields & border).any()
    assert state.border_load == pytest.approx(share)
    assert "border" in state.message


def test_a_high_hardness_changes_nothing():
    contact = contact_on()
    elastic, hard = contact.solve(BALL, P=LOAD), contact.solve(BALL, P=LOAD, hardness=1e5)
    np.testing.assert_array_equal(hard.pressure, elastic.pressure)
    assert not hard.flattening.any()


@pytest.mark.parametrize("surface", [BALL, rough()], ids=["ball", "rough"])
def test_a_second_loading_is_elastic(surface):
    """Shakedown: what has yielded carries the same load again without yielding."""
    half_space = HalfSpace(GRID, ElasticPair(STEEL, STEEL), periodic=surface is not BALL)
    contact = FrictionalContact(half_space, 0.3, hardness=900.0)
    first = contact.advance(contact.unloaded_state(surface), surface, ContactLoad(P=LOAD))
    apart = contact.advance(first, surface, ContactLoad(P=0.0))
    again = contact.advance(apart, surface, ContactLoad(P=LOAD))
    assert first.flattening.max() > 0.0
    np.testing.assert_array_equal(apart.flattening, first.flattening)
    np.testing.assert_array_equal(again.flattening, first.flattening)
    assert again.pressure == pytest.approx(first.pressure, abs=1e-5 * first.pressure.max())
    assert again.rigid[0] == pytest.approx(first.rigid[0], rel=1e-6)


def test_work_is_stored_or_flattens():
    """The work of P is the elastic energy and H times the displaced volume, as steps get small."""
    hardness, lost = 700.0, []
    for count in (10, 20):
        path = np.zeros((count, 6))
        path[:, 0] = LOAD * np.linspace(0.0, 1.0, count + 1)[1:]
        history = march_history(
            *(HalfSpace(GRID, ElasticPair(STEEL, STEEL)), BALL, ContactLoadPath(path), 0.0),
            hardness=hardness,
            history="full",
        )
        forces = np.append(0.0, path[:, 0])
        approaches = np.append(0.0, [state.rigid[0] for state in history.states])
        work, last = np.trapezoid(forces, approaches), history.states[-1]
        stored = 0.5 * np.vdot(last.pressure, last.displacement[2]) * GRID.cell_area
        flattened = hardness * last.flattening.sum() * GRID.cell_area
        lost.append(abs(work - stored - flattened) / work)
        assert flattened > 0.2 * work
    assert lost[1] < 0.4 * lost[0]
    assert lost[1] < 2e-3


def test_shear_of_a_line_contact_that_has_yielded():
    """Two normal problems give the shear of the flattened surfaces, as the general solver does."""
    grid = Grid.line_contact(1.0, 128)
    height, friction, load = grid.x**2 / 20.0, 0.4, 150.0
    contact = FrictionalContact(
        HalfSpace(grid, ElasticPair(STEEL, STEEL)), friction, hardness=500.0
    )
    pressed = contact.advance(contact.unloaded_state(height), height, ContactLoad(P=load))
    sheared = contact.advance(pressed, height, ContactLoad(P=load, Qx=30.0))
    general = contact.tangential.solve(friction * pressed.pressure, Qx=30.0)
    assert pressed.flattening.max() > 0.0
    assert sheared.shear == pytest.approx(general.shear, abs=1e-4 * general.shear.max())


def test_nonsense_is_refused():
    with pytest.raises(NormalContactError, match="whole grid"):
        contact_on().solve(BALL, P=LOAD, hardness=100.0)
    with pytest.raises(NormalContactError, match="hardness"):
        contact_on().solve(BALL, P=LOAD, hardness=-1.0)
    with pytest.raises(NormalContactError, match="all cells yield"):
        contact_on().solve(BALL, approach=1.0, hardness=100.0)
    with pytest.raises(NormalContactError, match="compliance"):
        contact_on().solve(BALL, P=LOAD, hardness=1e3, compliance=np.zeros(GRID.shape))
    coated = Material(210e3, 0.3, layers=[Layer(0.1, 20e3, 0.3)])
    with pytest.raises(InputError, match="dissimilar"):
        FrictionalContact(HalfSpace(GRID, ElasticPair(STEEL, coated)), 0.3, hardness=1e3)
    contact = FrictionalContact(HalfSpace(GRID, ElasticPair(STEEL, STEEL)), 0.3, hardness=1e3)
    with pytest.raises(InputError, match="roll"):
        steady_rolling(contact, BALL, P=LOAD)
