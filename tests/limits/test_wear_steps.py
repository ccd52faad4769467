"""Wear steps on either side of the explicit stability limit, and far beyond it.

A flat punch that slides as a whole, all of its cells in contact: then wear is linear in the heights
and a roughness of the shortest wave is multiplied by 1 - w ΔN/λ_min at every step, λ_min being the
smallest eigenvalue of the half-space on the grid.
"""

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.normal.contact import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, Material
from tests.marks import slow
from wear.laws import EnergyLaw
from wear.steps.stepping import SlidingCycle, WearingContact, WearState

BODY = Material(115e3, 0.29)
PAIR = ElasticPair(BODY, BODY)
GRIDS = {
    "line 16": Grid.line_contact(4.0, 16),
    "line 33": Grid.line_contact(4.0, 33),
    "line 64": Grid.line_contact(4.0, 64),
    "square 12": Grid.covering((4.0, 4.0), (12, 12)),
    "square 21": Grid.covering((4.0, 4.0), (21, 21)),
    "long cells": Grid.covering((4.0, 12.0), (24, 16)),
}
FRICTION, SLIP, MEAN_PRESSURE = 0.4, 0.02, 200.0
RNG_SEED = 5


def punch(grid: Grid) -> WearingContact:
    load = np.array([MEAN_PRESSURE * grid.cell_area * np.prod(grid.shape)])
    zero = np.zeros(1)
    history = LoadHistory(load, *[zero] * 7, sliding=np.array([True]))
    slip = np.full((1, *grid.shape), SLIP)
    contact = NormalContact(HalfSpace(grid, PAIR))
    cycle = SlidingCycle(history, slip)
    return WearingContact(contact, (EnergyLaw(1e-8), EnergyLaw(2e-8)), FRICTION, cycle, 1e-12)


def unevenness(contact: WearingContact, kind: str, limits: float, steps: int) -> Array:
    """Return how far a rough punch's pressure is from uniform after each step ``(steps,)`` [MPa].

    The shape under uniform pressure has worn in already, and would wear evenly for ever. It carries
    a roughness of 0.01 nm.
    """
    grid = contact.contact.grid
    rough = 1e-8 * np.random.default_rng(RNG_SEED).standard_normal(grid.shape)
    dished = -contact.contact.half_space.normal(np.full(grid.shape, MEAN_PRESSURE))
    state, sizes = WearState.unworn(dished + rough), []
    cycles = limits * contact.stable_cycles(state)
    for _ in range(steps):
        state = getattr(contact, f"{kind}_step")(state, cycles).state
        pressure = contact.solve(state.surfaces, 0, None).pressure
        assert pressure.min() > 0.0
        sizes.append(np.abs(pressure - MEAN_PRESSURE).max())
    return np.array(sizes)


@pytest.mark.parametrize("name", GRIDS)
def test_explicit_steps_are_stable_just_below_their_limit_and_unstable_just_above(name) -> None:
    """Per step |1 - 2 · 0.9| = 0.8 and |1 - 2 · 1.1| = 1.2 on an endless grid, less at its ends."""
    contact = punch(GRIDS[name])
    for limits, least, most in ((0.9, 0.0, 0.98), (1.1, 1.08, 1.2)):
        sizes = unevenness(contact, "explicit", limits, 24)
        growth = (sizes[-1] / sizes[-9]) ** (1.0 / 8.0)
        assert least < growth < most, (limits, growth)


@pytest.mark.parametrize("kind", ["implicit", "second_order"])
@pytest.mark.parametrize("name", GRIDS)
def test_other_steps_do_not_grow_at_a_hundred_times_that_limit(name, kind) -> None:
    """Short waves shrink by 1 / (1 + 2 · 100) in the first step, longer ones more slowly."""
    sizes = unevenness(punch(GRIDS[name]), kind, 100.0, 3)
    assert np.all(sizes[1:] <= 0.5 * sizes[:-1]), sizes


@pytest.mark.parametrize("kind", ["implicit", "second_order"])
def test_no_checkerboard_and_no_growth_back(kind) -> None:
    """A ball worn by 100 times the limit per step shows no difference of alternate cells."""
    grid = Grid.covering((4.0, 4.0), (32, 32))
    contact = punch(grid)
    ball = (grid.x**2 + grid.y**2) / 80.0
    state = WearState.unworn(ball)
    cycles = 100.0 * contact.stable_cycles(state)
    signs = (-1.0) ** np.add.outer(np.arange(32), np.arange(32))
    for _ in range(3):
        before, state = state, getattr(contact, f"{kind}_step")(state, cycles).state
        for name in ("depth_1", "depth_2"):
            assert np.all(getattr(state.surfaces, name) >= getattr(before.surfaces, name))
    depth = state.surfaces.depth
    inside = depth[10:22, 10:22]
    second = np.diff(np.diff(inside, 2, axis=0), 2, axis=1) / 16.0
    assert abs(np.mean(second * signs[11:21, 11:21])) < 1e-4 * depth.max()


@pytest.mark.parametrize("limits", [slow(0.5), slow(5.0), 100.0])
@pytest.mark.parametrize("kind", ["implicit", "second_order"])
def test_a_symmetric_problem_stays_symmetric_over_100_jumps(kind, limits) -> None:
    """The sphere's four reflections agree to 1e-8 of the depth."""
    grid = Grid.covering((4.0, 4.0), (16, 16))
    contact, state = punch(grid), WearState.unworn((grid.x**2 + grid.y**2) / 80.0)
    cycles = limits * contact.stable_cycles(state) / 10.0
    for _ in range(100):
        state = getattr(contact, f"{kind}_step")(state, cycles).state
    depth = state.surfaces.depth
    for mirrored in (depth[::-1], depth[:, ::-1], depth.T):
        np.testing.assert_allclose(mirrored, depth, atol=1e-8 * depth.max())
