"""Friction that depends on the place or the pressure, for similar bodies."""

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
    LoopPath,
    Material,
    march_history,
    march_loop,
    steady_rolling,
)
from sa_solver.cycles.loop_accuracy import loop_errors
from sa_solver.reference.hertz import HertzSphere

STEEL = Material(210e3, 0.3)
HERTZ = HertzSphere(100.0, 10.0, ElasticPair(STEEL, STEEL).contact_modulus)
WIDTH = 3.0 * HERTZ.contact_radius
GRID = Grid.covering((WIDTH, WIDTH), (48, 48))
HEIGHT = HERTZ.gap(GRID.x, GRID.y)
LINE = Grid.line_contact(1.0, 96)


def contact(friction, factor, body_2=STEEL):
    return FrictionalContact(HalfSpace(GRID, ElasticPair(STEEL, body_2)), friction, factor=factor)


def sheared(found, *loads):
    """Return the states under P and then each of the loads, given by keywords."""
    states = [found.advance(found.unloaded_state(HEIGHT), HEIGHT, ContactLoad(P=100.0))]
    for load in loads:
        states.append(found.advance(states[-1], HEIGHT, ContactLoad(P=100.0, **load)))
    assert all(state.converged for state in states)
    return states


@pytest.mark.parametrize("grid", [GRID, LINE], ids=["area", "line"])
def test_a_factor_that_is_the_same_everywhere_scales_the_coefficient(grid):
    height = grid.x**2 / 20.0 + 0.0 * grid.y if grid.line else HEIGHT
    path = np.zeros((3, 6))
    path[:, 0], path[:, 1] = 100.0, (0.0, 15.0, -10.0)
    given = (HalfSpace(grid, ElasticPair(STEEL, STEEL)), height, ContactLoadPath(path))
    half = march_history(*given, 0.8, history="full", factor=lambda p: np.full(p.shape, 0.5))
    whole = march_history(*given, 0.4, history="full")
    for one, other in zip(half.states, whole.states, strict=True):
        assert one.shear == pytest.approx(other.shear, abs=1e-4 * other.pressure.max())
        assert one.energy.sum() == pytest.approx(other.energy.sum(), rel=1e-4, abs=1e-9)


def test_a_smooth_half_carries_no_shear():
    """The rest obeys Coulomb's law with its own bound, and carries the force."""
    factors = np.where(GRID.x < 0.0, 0.0, 1.0) * np.ones(GRID.shape)
    *_, state = sheared(contact(0.5, lambda p: factors), {"Qx": 15.0})
    limit = 0.5 * factors * state.pressure
    shear = np.hypot(*state.shear)
    assert state.resultants[1] == pytest.approx(15.0, rel=1e-6)
    assert not shear[factors == 0.0].any()
    assert (shear <= limit * (1.0 + 1e-7) + 1e-9).all()
    np.testing.assert_array_equal(state.limit, limit)
    # Cells that slip do so at their bound, against it.
    slips = state.slipping & (limit > 0.0)
    assert shear[slips] == pytest.approx(limit[slips], rel=1e-6)
    assert (state.shear * state.slip).sum(axis=0)[slips].max() <= 1e-12


def test_sliding_force_where_friction_falls_with_pressure():
    """µ = µ0 (1 - c p/p0) under Hertz's pressure slides at µ0 (P - c p0 π a²/2)."""
    fall = 0.4
    falling = contact(0.5, lambda p: 1.0 - fall * p / HERTZ.peak_pressure)
    *_, state = sheared(falling, {"shift_x": 0.05})
    lost = fall * HERTZ.peak_pressure * np.pi * HERTZ.contact_radius**2 / 2.0
    assert state.resultants[1] == pytest.approx(0.5 * (HERTZ.load - lost), rel=2e-3)
    assert not state.sticking.any()


def test_work_of_a_cycle_is_its_dissipation():
    """With steps half as long the difference falls with the second order."""
    factors = 1.0 + 0.5 * np.sin(8.0 * GRID.x / WIDTH) * np.cos(5.0 * GRID.y / WIDTH)
    differences = []
    for steps in (4, 8):
        found = contact(0.5, lambda p: factors * np.interp(p, [0.0, 800.0], [1.0, 0.5]))
        way = np.linspace(-1.0, 1.0, steps + 1)[1:]
        forces = [12.0, *(-12.0 * way), *(12.0 * way)]
        states = sheared(found, *({"Qx": force} for force in forces))[1:]
        work = np.trapezoid(
            [state.resultants[1] for state in states], [state.rigid[1] for state in states]
        )
        energy = sum(state.energy.sum() for state in states[1:])
        differences.append(abs(work - energy) / energy)
    assert differences[1] < 0.4 * differences[0]
    assert differences[1] < 0.05


def test_nonsense_is_refused():
    falling = contact(0.5, lambda p: 1.0 - p)
    with pytest.raises(InputError, match="factor"):
        sheared(falling)
    with pytest.raises(InputError, match="factors"):
        sheared(contact(0.5, lambda p: np.ones(3)))
    with pytest.raises(InputError, match="dissimilar"):
        contact(0.5, np.ones_like, Material(70e3, 0.3))
    with pytest.raises(InputError, match="roll"):
        steady_rolling(contact(0.5, np.ones_like), HEIGHT, 100.0)
    found, values = contact(0.5, np.ones_like), np.array([100.0, 50.0, 0.0, 0.0, 0.0, 0.0])
    apart, load = found.unloaded_state(HEIGHT), ContactLoad(values, energy=np.ones(2))
    with pytest.raises(InputError, match="energy"):
        found.advance(apart, HEIGHT, load)
    loop_path = LoopPath(100.0, 10.0, "force", 2)
    loop = march_loop(found, HEIGHT, loop_path)
    with pytest.raises(InputError, match="coarser"):
        loop_errors(found, HEIGHT, loop_path, loop)
