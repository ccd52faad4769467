"""Equilibrium and complementarity of normal contact on random geometries, loads and materials."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.types import ElasticPair, Grid, Material

SOLVED = 1e-8
RUNS = settings(max_examples=25, deadline=None, derandomize=True)

sides = st.floats(1.0, 20.0)
counts = st.integers(5, 70)
grids = st.one_of(
    st.builds(lambda a, b, m, n: Grid.covering((a, b), (m, n)), sides, sides, counts, counts),
    st.builds(Grid.line_contact, sides, st.integers(5, 300)),
)
materials = st.builds(Material, st.floats(1e3, 4e5), st.floats(0.0, 0.49))
pairs = st.builds(ElasticPair, materials, materials)
logs = st.floats(-3.0, 1.0)
shares = st.floats(-0.6, 0.6)


def surface(grid, kind, radius, seed, roughness):
    """Return a gap before loading: a cap, a flat with rounded ends, or waves, with white noise."""
    x, y = grid.x / grid.size[0], grid.y / grid.size[1]
    smooth = {
        "cap": x**2 + y**2,
        "flat": np.maximum(np.abs(x) - 0.3, 0.0) ** 2 + np.maximum(np.abs(y) - 0.35, 0.0) ** 2,
        "waves": 0.01 * np.cos(20.0 * x) * np.cos(15.0 * y),
    }[kind]
    noise = np.random.default_rng(seed).standard_normal(grid.shape)
    return min(grid.size) * (smooth / radius + roughness * noise)


surfaces = {
    "kind": st.sampled_from(["cap", "flat", "waves"]),
    "radius": st.floats(1.0, 100.0),
    "seed": st.integers(0, 1000),
    "roughness": st.sampled_from([0.0, 1e-5, 1e-4]),
}


def assert_contact(grid, pair, height, state, worn=0.0):
    """Assert p >= 0, no penetration, p g = 0 and the resultants, from the pressure alone.

    ``worn`` is a depth in ``height`` that the solver counts as displacement.
    """
    p, S = state.pressure, grid.cell_area
    moved = HalfSpace(grid, pair).normal(p)
    gap = height + moved - state.approach - state.tilt_x * grid.y + state.tilt_y * grid.x
    scale = (moved + worn).max()
    assert state.converged, state.message
    assert p.min() >= 0.0
    assert gap.min() >= -1.01 * SOLVED * scale
    assert np.abs(p * gap).max() <= 1.01 * SOLVED * p.max() * scale
    reach = state.P * max(grid.size)
    assert pytest.approx(p.sum() * S, rel=SOLVED) == state.P
    assert state.Mx == pytest.approx((p * grid.y).sum() * S, abs=SOLVED * reach)
    assert state.My == pytest.approx(-(p * grid.x).sum() * S, abs=SOLVED * reach)


def load(grid, pair, log):
    """Return a load for a random number of pressed cells, from a few to nearly all.

    The mean pressure over E* is 1e-6 to 1e-2.
    """
    area = grid.size[0] * grid.size[1]
    return 1e-3 * 10.0**log * pair.contact_modulus * area


@RUNS
@given(grids, pairs, st.fixed_dictionaries(surfaces), logs, shares, shares)
def test_loads_are_carried(grid, pair, form, log, share_x, share_y):
    height, P = surface(grid, **form), load(grid, pair, log)
    Mx, My = P * share_y * float(grid.y.max()), P * share_x * float(grid.x.max())
    state = NormalContact(HalfSpace(grid, pair)).solve(height, P, Mx, My)
    assert_contact(grid, pair, height, state)
    assert pytest.approx(P, rel=SOLVED) == state.P
    assert state.Mx == pytest.approx(Mx, abs=SOLVED * P * grid.size[1])
    assert state.My == pytest.approx(My, abs=SOLVED * P * grid.size[0])


@RUNS
@given(grids, pairs, st.fixed_dictionaries(surfaces), st.floats(-4.0, -2.0), shares)
def test_motions_are_resisted(grid, pair, form, log, share):
    height = surface(grid, **form)
    depth = 10.0**log * min(grid.size)
    tilt = share * depth / max(grid.size)
    state = NormalContact(HalfSpace(grid, pair)).solve(
        height, approach=float(height.min()) + depth, tilt_x=tilt, tilt_y=tilt
    )
    if state.pressure.any():
        assert_contact(grid, pair, height, state)
    else:
        assert state.gap.min() >= 0.0


@RUNS
@given(grids, pairs, st.fixed_dictionaries(surfaces), logs, st.floats(-2.0, 3.0))
def test_wear_softens(grid, pair, form, log, softness):
    """Heights worn by D p, pressed without compliance, give the same pressure."""
    height, half_space = surface(grid, **form), HalfSpace(grid, pair)
    compliance = np.full(grid.shape, 10.0**softness * half_space.self_compliance(2))
    contact, P = NormalContact(half_space), load(grid, pair, log)
    state = contact.solve(height, P, compliance=compliance)
    assert state.converged, state.message
    worn = compliance * state.pressure
    assert_contact(grid, pair, height + worn, state, worn)
