"""Normal contact: closed forms, imposed resultants, warm starts, wear compliance, errors."""

from dataclasses import replace

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal import bound_cg, few_cells
from sa_solver.normal import splitting as normal_splitting
from sa_solver.normal.contact import NormalContact, NormalContactError
from sa_solver.reference.flat_rounded import FlatRoundedPunch
from sa_solver.reference.hertz import HertzSphere
from sa_solver.rigid_modes import pseudoinverse
from sa_solver.types import ElasticPair, Grid, Material

TITANIUM = Material(115e3, 0.29)
PAIR = ElasticPair(TITANIUM, TITANIUM)
MODULUS = PAIR.contact_modulus
SPHERE = HertzSphere(400.0, 10.0, MODULUS)
SOLVED = 1e-8
"""What the solver imposes: resultants, penetration, complementarity."""


def assert_solves(grid, height, P, Mx, My, state, compliance=0.0):
    """Assert small residuals from the fields alone, with a new convolution."""
    p, S = state.pressure, grid.cell_area
    displacement = HalfSpace(grid, PAIR).normal(p) + compliance * p
    rigid = state.approach + state.tilt_x * grid.y - state.tilt_y * grid.x
    gap = height + displacement - rigid
    scale = displacement.max()
    assert state.converged
    assert ("border" in state.message) == (state.border_load > 0.0)
    assert p.min() >= 0.0
    assert np.sum(p) * S == pytest.approx(P, rel=SOLVED)
    assert np.sum(p * grid.y) * S == pytest.approx(Mx, rel=SOLVED, abs=SOLVED * P * grid.size[1])
    assert -np.sum(p * grid.x) * S == pytest.approx(My, rel=SOLVED, abs=SOLVED * P * grid.size[0])
    assert gap.min() >= -1.01 * SOLVED * scale
    assert np.abs(p * gap).max() <= 1.01 * SOLVED * p.max() * scale
    np.testing.assert_allclose(state.gap, gap, atol=1e-12 * scale)


def sphere_on(cells):
    grid = Grid.covering((1.0, 1.0), (cells, cells))
    return grid, SPHERE.gap(grid.x, grid.y)


def flat(shape=(64, 64)):
    """Return a flat of 8 mm x 54 mm with rounded edges, and its height."""
    grid = Grid.covering((10.0, 60.0), shape)
    dx = np.maximum(np.abs(grid.x) - 4.0, 0.0)
    dy = np.maximum(np.abs(grid.y) - 27.0, 0.0)
    return grid, dx**2 / 60.0 + dy**2 / 300.0


def rough(grid, amplitude):
    """Return self-affine roughness with the standard deviation ``amplitude``."""
    noise = np.fft.fft2(np.random.default_rng(0).standard_normal(grid.shape))
    wave = np.hypot(*np.meshgrid(*(np.fft.fftfreq(n) for n in grid.shape), indexing="ij"))
    field = np.fft.ifft2(noise / (wave**1.8 + 1e-2)).real
    return amplitude * field / field.std()


# -- Hertz --
def test_sphere_on_a_fine_grid():
    grid, height = sphere_on(128)
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, 400.0)
    assert_solves(grid, height, 400.0, 0.0, 0.0, state)
    assert state.pressure.max() == pytest.approx(1450.3, rel=1e-3)
    assert state.approach == pytest.approx(13.168e-3, rel=2e-4)
    radius = np.sqrt(np.count_nonzero(state.pressure) * grid.cell_area / np.pi)
    assert radius == pytest.approx(0.36288, rel=1e-2)
    assert not state.touches_border


def test_sphere_converges():
    """The approach converges with second order.

    The pressure (L2) converges with first order, because of the square root at its edge.
    """
    errors = []
    for cells in (32, 64, 128, 256):
        grid, height = sphere_on(cells)
        state = NormalContact(HalfSpace(grid, PAIR)).solve(height, 400.0)
        exact = SPHERE.pressure(grid.x, grid.y)
        l2 = np.linalg.norm(state.pressure - exact) / np.linalg.norm(exact)
        errors.append((abs(state.approach / SPHERE.approach - 1.0), l2))
    rates = np.log2(np.array(errors[0]) / np.array(errors[-1])) / 3.0
    assert 1.7 < rates[0] < 2.3
    assert 0.85 < rates[1] < 1.6


@pytest.mark.parametrize("cells_off", [(3, 0), (-5, 7)])
def test_a_moment_moves_the_paraboloid(cells_off):
    """A load with the moment P d has the same pressure, shifted by d.

    A paraboloid with the apex off centre by d differs from a centred one by a tilt and a constant.
    For whole cells this is exact.
    """
    grid = Grid.covering((1.5, 1.2), (60, 48))
    contact, height = NormalContact(HalfSpace(grid, PAIR)), SPHERE.gap(grid.x, grid.y)
    offset = np.array(cells_off) * grid.pitch
    centred = contact.solve(height, 400.0)
    moved = contact.solve(height, 400.0, Mx=400.0 * offset[1], My=-400.0 * offset[0])
    expected = np.roll(centred.pressure, cells_off, axis=(0, 1))
    np.testing.assert_allclose(moved.pressure, expected, atol=2e-6 * centred.pressure.max())
    assert moved.tilt_x == pytest.approx(offset[1] / 10.0, rel=1e-6)
    assert moved.tilt_y == pytest.approx(-offset[0] / 10.0, rel=1e-6)
    assert_solves(grid, height, 400.0, 400.0 * offset[1], -400.0 * offset[0], moved)


def test_a_single_row_of_cells():
    grid = Grid((1, 21), (0.1, 0.1))
    height = SPHERE.gap(grid.x, grid.y)
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, 40.0, Mx=4.0, My=0.0)
    assert_solves(grid, height, 40.0, 4.0, 0.0, state)
    assert state.tilt_y == 0.0


def test_a_load_on_few_cells():
    grid = Grid.covering((4.0, 4.0), (64, 64))
    height = ((grid.x - 0.5) ** 2 + (grid.y - 0.3) ** 2) / 20.0
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, 0.04, Mx=0.012, My=-0.02)
    assert_solves(grid, height, 0.04, 0.012, -0.02, state)


# -- production flat --
@pytest.mark.parametrize("share", [0.015, 0.3, 1.0])
@pytest.mark.parametrize("eccentricity", [(0.0, 0.0), (0.5, 5.0), (-2.5, 22.0)])
def test_flat_meets_resultants_and_law(share, eccentricity):
    grid, height = flat()
    P = 9e4 * share
    Mx, My = P * eccentricity[1], -P * eccentricity[0]
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, P, Mx, My)
    assert_solves(grid, height, P, Mx, My, state)
    assert state.method == "conjugate gradients"


def test_middle_of_a_long_flat_is_the_plane_closed_form():
    """The profile is within 3 % of the peak and the peak within 1 %, with one cell at the edge."""
    grid, height = flat((256, 64))
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, 9e4)
    profile = state.pressure[:, 32]
    closed = FlatRoundedPunch(4.0, 30.0, profile.sum() * grid.pitch[0], MODULUS)
    assert profile.max() == pytest.approx(closed.peak[0], rel=0.01)
    inner = np.abs(grid.x[:, 0]) < 4.3
    expected = closed.cell_averages(grid.pitch[0], 256)
    np.testing.assert_allclose(profile[inner], expected[inner], atol=0.01 * closed.peak[0])


@pytest.mark.parametrize("radius", [3.0, 10.0, 30.0])
@pytest.mark.parametrize("cells", [64, 128])
def test_the_predicted_peak_error_bounds_the_true_one(radius, cells):
    grid = Grid.covering((10.0, 60.0), (cells, 64))
    dx = np.maximum(np.abs(grid.x) - 4.0, 0.0)
    dy = np.maximum(np.abs(grid.y) - 27.0, 0.0)
    height = dx**2 / (2.0 * radius) + dy**2 / 300.0
    profile = NormalContact(HalfSpace(grid, PAIR)).solve(height, 9e4).pressure[:, 32]
    closed = FlatRoundedPunch(4.0, radius, profile.sum() * grid.pitch[0], MODULUS)
    made = profile.max() / closed.peak[0] - 1.0
    assert abs(made) <= abs(closed.peak_error(grid.pitch[0])) + 2e-4


@pytest.mark.parametrize("amplitude", [1e-4, 1e-3, 1e-2])
def test_rough_flat(amplitude):
    grid, height = flat()
    height = height + rough(grid, amplitude)
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, 9e4, Mx=9e4, My=0.0)
    assert_solves(grid, height, 9e4, 9e4, 0.0, state)


# -- starts, methods --
def test_any_start_gives_the_same_answer():
    """1e-8 on the gap is 1e-5 of the peak on single cells, which are stiffer by their size."""
    grid, height = flat()
    contact = NormalContact(HalfSpace(grid, PAIR))
    cold = contact.solve(height, 9e4, Mx=0.0, My=9e3)
    one = np.zeros(grid.shape)
    one[10, 10] = 1.0
    noise = np.random.default_rng(0).random(grid.shape)
    others = [replace(cold, pressure=one), replace(cold, pressure=noise), cold]
    others.append(contact.solve(height + rough(grid, 2e-3), 3e3))
    for start in others:
        state = contact.solve(height, 9e4, Mx=0.0, My=9e3, start=start)
        assert state.converged
        atol = 1e-5 * cold.pressure.max()
        np.testing.assert_allclose(state.pressure, cold.pressure, atol=atol)


def test_a_solution_is_its_own_start():
    grid, height = flat()
    contact = NormalContact(HalfSpace(grid, PAIR))
    state = contact.solve(height, 9e4)
    for load in (9e4, 9e4 * (1.0 + 1e-15)):
        again = contact.solve(height, load, start=state)
        assert again.convolutions == 0
        assert np.array_equal(again.pressure, state.pressure)


def test_a_worn_flat_starts_warm():
    """With wear of 2 % of the approach between jumps a solve takes at most 25 convolutions."""
    grid, height = flat((128, 128))
    contact = NormalContact(HalfSpace(grid, PAIR))
    state = contact.solve(height, 9e4, Mx=9e4, My=0.0)
    depth = 0.02 * state.approach * state.pressure / state.pressure.max()
    worn = contact.solve(height + depth, 9e4, Mx=9e4, My=0.0, start=state)
    assert_solves(grid, height + depth, 9e4, 9e4, 0.0, worn)
    assert worn.convolutions <= 25


@pytest.mark.parametrize("wear", [0.0, 1e-4])
@pytest.mark.parametrize(("method", "largest"), [("splitting", 0), ("active set", 2000)])
def test_the_fallbacks_agree_with_conjugate_gradients(monkeypatch, wear, method, largest):
    grid, height = flat((24, 32))
    compliance = wear * (np.abs(grid.x) > 2.0) * np.ones(grid.shape)
    contact = NormalContact(HalfSpace(grid, PAIR))
    expected = contact.solve(height, 9e4, Mx=9e4, My=9e3, compliance=compliance)
    monkeypatch.setattr(bound_cg, "ITERATIONS", 0)
    monkeypatch.setattr(few_cells, "LARGEST", largest)
    state = contact.solve(height, 9e4, Mx=9e4, My=9e3, compliance=compliance)
    assert expected.method == "conjugate gradients"
    assert state.method == method
    assert_solves(grid, height, 9e4, 9e4, 9e3, state, compliance)
    atol = 1e-5 * expected.pressure.max()
    np.testing.assert_allclose(state.pressure, expected.pressure, atol=atol)


def test_failure_is_a_value_with_a_remedy(monkeypatch):
    monkeypatch.setattr(bound_cg, "ITERATIONS", 1)
    monkeypatch.setattr(few_cells, "STEPS", 1)
    monkeypatch.setattr(normal_splitting, "SPLITTING_ITERATIONS", 2)
    grid, height = flat((16, 16))
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, 9e4)
    assert not state.converged
    assert "loosen" in state.message
    assert np.sum(state.pressure) * grid.cell_area == pytest.approx(9e4, rel=SOLVED)


# -- wear compliance --
def compliances(grid):
    ones = np.ones(grid.shape)
    return {
        "uniform": ones,
        "edges": np.exp(-((np.abs(grid.x) - 4.0) ** 2) / 0.3) * ones,
        "stuck centre": np.clip(np.abs(grid.x) - 2.0, 0.0, 2.0) * ones,
        "random": np.random.default_rng(0).random(grid.shape),
    }


@pytest.mark.parametrize("kind", ["uniform", "edges", "stuck centre", "random"])
@pytest.mark.parametrize("size", [1e-6, 1e-4, 1e-3])
def test_implicit_wear_is_consistent(kind, size):
    """Heights worn by D p, solved without compliance, give the same pressure."""
    grid, height = flat()
    compliance = size * compliances(grid)[kind]
    contact = NormalContact(HalfSpace(grid, PAIR))
    state = contact.solve(height, 9e4, Mx=9e4, My=0.0, compliance=compliance)
    assert_solves(grid, height, 9e4, 9e4, 0.0, state, compliance)
    assert state.method == "conjugate gradients"
    worn = contact.solve(height + compliance * state.pressure, 9e4, Mx=9e4, My=0.0)
    atol = 1e-4 * state.pressure.max()
    np.testing.assert_allclose(worn.pressure, state.pressure, atol=atol)


def test_wear_without_end_spreads_the_load_evenly():
    """For D far above K the pressure is uniform under a centred load, and linear under a moment."""
    grid, height = flat((32, 32))
    compliance = np.full(grid.shape, 1e3)
    state = NormalContact(HalfSpace(grid, PAIR)).solve(
        height, 9e4, Mx=9e4, My=0.0, compliance=compliance
    )
    linear = 9e4 / 600.0 + 9e4 * grid.y / (grid.cell_area * 32 * np.sum(grid.y**2))
    np.testing.assert_allclose(state.pressure, linear * np.ones(grid.shape), rtol=1e-4)


# -- edges of validity --
def test_no_load_no_pressure():
    grid, height = flat((16, 16))
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height + 0.25, 0.0)
    assert state.converged
    assert np.count_nonzero(state.pressure) == 0
    assert state.approach == pytest.approx(0.25)
    assert state.gap.min() == 0.0


def test_contact_at_the_border_is_measured():
    grid = Grid.covering((0.6, 1.0), (48, 80))
    state = NormalContact(HalfSpace(grid, PAIR)).solve(SPHERE.gap(grid.x, grid.y), 400.0)
    assert state.touches_border
    assert 0.0 < state.border_load < 0.1


@pytest.mark.parametrize(
    ("P", "Mx", "My"), [(-1.0, 0.0, 0.0), (1e3, 1e3 * 29.6, 0.0), (1e3, 0.0, -1e3 * 4.93)]
)
def test_loads_that_no_pressure_carries_are_refused(P, Mx, My):
    grid, height = flat()
    with pytest.raises(NormalContactError):
        NormalContact(HalfSpace(grid, PAIR)).solve(height, P, Mx, My)


def test_a_load_just_inside_the_cells_is_carried():
    grid, height = flat((32, 32))
    P, reach = 1e3, 0.999 * float(grid.x.max())
    state = NormalContact(HalfSpace(grid, PAIR)).solve(height, P, Mx=0.0, My=-P * reach)
    assert_solves(grid, height, P, 0.0, -P * reach, state)


def test_bad_fields_and_grids():
    grid, height = flat((16, 16))
    contact = NormalContact(HalfSpace(grid, PAIR))
    hole = height.copy()
    hole[3, 3] = np.nan
    with pytest.raises(NormalContactError, match="NaN"):
        contact.solve(hole, 1.0)
    with pytest.raises(NormalContactError, match="shape"):
        contact.solve(height[1:], 1.0)
    with pytest.raises(NormalContactError, match="compliances"):
        contact.solve(height, 1.0, compliance=-np.ones(grid.shape))
    with pytest.raises(NormalContactError, match="cells"):
        NormalContact(HalfSpace(Grid((1, 1), (1.0, 1.0)), PAIR))
    other, other_height = flat((8, 8))
    start = NormalContact(HalfSpace(other, PAIR)).solve(other_height, 1.0)
    with pytest.raises(NormalContactError, match="same grid"):
        contact.solve(height, 1.0, start=start)


@pytest.mark.parametrize("rank", [0, 1, 2, 3])
def test_pseudoinverse_is_that_of_the_modes_that_cells_feel(rank):
    root = np.random.default_rng(rank).standard_normal((3, rank))
    matrix = root @ root.T
    expected = np.linalg.pinv(matrix, rcond=1e-12, hermitian=True)
    np.testing.assert_allclose(pseudoinverse(matrix), expected, atol=1e-9 * np.abs(expected).max())
