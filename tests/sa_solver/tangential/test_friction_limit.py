"""Largest shear load that friction can carry: closed forms, search, properties."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from sa_solver.rigid_modes import PlanarModes
from sa_solver.tangential.friction_limit import largest_share
from sa_solver.types import Grid

GRID = Grid.covering((2.0, 2.0), (200, 200))
RADIUS = np.hypot(GRID.x, GRID.y)


def share(limit, loads, grid=GRID):
    """Return the largest factor of (Qx, Qy, Mz)."""
    modes = PlanarModes.on(grid)
    pressed = limit > 0.0
    target = np.array(loads) / (modes.lengths * grid.cell_area)
    return largest_share(limit[pressed], modes.fields()[:, :, pressed], target)


HERTZ = np.sqrt(np.maximum(0.0, 1.0 - RADIUS**2))
UNIFORM = np.where(RADIUS < 1.0, 1.0, 0.0)


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2, -2.0])
def test_pure_force_is_friction_times_load(angle):
    carried = HERTZ.sum() * GRID.cell_area
    assert share(HERTZ, (np.cos(angle), np.sin(angle), 0.0)) == pytest.approx(carried, rel=1e-10)


@pytest.mark.parametrize(
    ("limit", "ratio"), [(HERTZ, 3.0 * np.pi / 16.0), (UNIFORM, 2.0 / 3.0)], ids=["Hertz", "disk"]
)
def test_pure_torsion(limit, ratio):
    """Mz = (3π/16) µPa under a Hertz pressure, (2/3) µPa under a uniform one."""
    carried = limit.sum() * GRID.cell_area
    assert share(limit, (0.0, 0.0, 1.0)) == pytest.approx(ratio * carried, rel=2e-3)


@pytest.mark.slow
@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_combined_loads_against_a_search(seed):
    """The bound is the minimum over all sliding velocities that do unit work."""
    rng = np.random.default_rng(seed)
    grid = Grid((7, 6), (0.1, 0.2))
    limit = rng.exponential(size=grid.shape) * (rng.random(grid.shape) < 0.6)
    limit[:2, :2] = 1.0
    loads = rng.standard_normal(3)
    modes = PlanarModes.on(grid)
    target = loads / (modes.lengths * grid.cell_area)
    fields = modes.fields()

    def dissipation(velocity):
        velocity = velocity / (target @ velocity)
        return float(np.sum(limit * np.hypot(*np.tensordot(velocity, fields, 1))))

    starts = [target, *(target * rng.uniform(0.1, 3.0, 3) for _ in range(3))]
    options = {"xatol": 1e-10, "fatol": 1e-12, "maxiter": 4000}
    lowest = min(
        minimize(dissipation, start, method="Nelder-Mead", options=options).fun for start in starts
    )
    used = share(limit, loads, grid)
    assert used <= lowest * (1.0 + 1e-8)
    assert used == pytest.approx(lowest, rel=1e-5)
    assert share(limit, -loads, grid) == pytest.approx(used, rel=1e-8)
    assert share(3.0 * limit, loads, grid) == pytest.approx(3.0 * used, rel=1e-8)


def test_the_limit_surface_is_convex():
    carried = HERTZ.sum() * GRID.cell_area
    moment = share(HERTZ, (0.0, 0.0, 1.0))
    angles = np.linspace(0.0, np.pi / 2.0, 9)
    points = [
        share(HERTZ, (carried * np.cos(a), 0.0, moment * np.sin(a)))
        * np.array([np.cos(a), np.sin(a)])
        for a in angles
    ]
    steps = np.diff(points, axis=0)
    turns = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
    assert np.all(turns > 0.0)


def test_a_load_that_the_cells_cannot_feel():
    """A single cell carries no moment about itself."""
    limit = np.zeros(GRID.shape)
    limit[150, 100] = 1.0
    assert share(limit, (0.0, 0.0, 1.0)) == 0.0
