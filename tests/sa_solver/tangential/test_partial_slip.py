"""Partial slip by normal problems alone, against Mindlin and the full tangential problem."""

from dataclasses import replace

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.cycles.partial_slip import PartialSlipError, partial_slip_curve
from sa_solver.cycles.tangential_loop import LoopPath, march_loop
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.types import ElasticPair, Grid, Material

LOAD, RADIUS, FRICTION = 60.0, 47.619, 0.5
PLAIN, STEEL, SOFT = Material(200e3, 0.0), Material(200e3, 0.3), Material(100e3, 0.3)
CELLS = 48
# Errors of stiffness and curve by the number of cells across the contact of a sphere.
GRID_ERROR = 2e-3
# Two solvers solve the same discrete problem, each to 1e-8.
SOLVED = 1e-6


def sphere(material):
    return ShearedSphere(LOAD, RADIUS, material, material, FRICTION)


def grid_of(case, cells=CELLS):
    size = 2.2 * case.contact.contact_radius
    return Grid.covering((size, size), (cells, cells))


def moved(case, cells=CELLS, height=None, **settings):
    """Return the contact of a sphere, or of a ``height`` over the same grid, and its half-space."""
    grid = grid_of(case, cells)
    half_space = HalfSpace(grid, ElasticPair(case.body_1, case.body_2))
    gap = case.contact.gap(grid.x, grid.y) if height is None else height(grid)
    curve = partial_slip_curve(NormalContact(half_space), gap, LOAD, tolerance=1e-9, **settings)
    return curve, half_space, gap


def dented(grid):
    """Return the gap of a sphere with a shallow scar and a slope, without symmetry."""
    scar = 3e-4 * np.exp(-((grid.x - 0.05) ** 2 + 2.0 * grid.y**2) / 0.03)
    return (grid.x**2 + grid.y**2) / (2.0 * RADIUS) + scar + 1e-4 * grid.x


def travel_of(curve, *amplitudes):
    """Return the paths of the sliders in loops of these amplitudes, for a friction of 1."""
    return sum(4.0 * np.maximum(amplitude - curve.reach, 0.0) for amplitude in amplitudes)


# --- against Mindlin ----------------------------------------------------------------------------


@pytest.mark.parametrize("material", [PLAIN, STEEL])
def test_a_sphere_follows_mindlins_curve(material):
    case = sphere(material)
    curve, _, _ = moved(case)
    assert curve.stiffness == pytest.approx(1.0 / case.tangential_compliance, rel=GRID_ERROR)
    share = curve.force / LOAD
    wanted = [case.displacement(FRICTION * LOAD * ratio) for ratio in share]
    np.testing.assert_allclose(
        FRICTION * curve.shift, wanted, atol=GRID_ERROR * wanted[-1], rtol=0.0
    )


def test_sliders_are_as_stiff_as_the_stuck_contact_and_carry_all_of_the_load():
    curve, _, _ = moved(sphere(STEEL))
    assert np.all(curve.slider_stiffness > 0.0)
    assert curve.slider_stiffness.sum() == pytest.approx(curve.stiffness, rel=1e-12)
    assert curve.slider_load.sum() == pytest.approx(LOAD, rel=1e-9)
    assert np.all(np.diff(curve.reach) > 0.0)


def test_loops_of_the_sliders_lose_what_mindlins_do():
    case = sphere(STEEL)
    curve, _, _ = moved(case, stages=48)
    for share in (0.3, 0.6, 0.9):
        force = share * FRICTION * LOAD
        travel = travel_of(curve, case.displacement(force) / FRICTION)
        lost = FRICTION**2 * float(curve.slider_load @ travel)
        assert lost == pytest.approx(case.loop_energy(force), rel=0.01)


# --- against the whole tangential problem -------------------------------------------------------


@pytest.mark.parametrize("height", [None, dented])
@pytest.mark.parametrize("share", [0.2, 0.7])
def test_without_poissons_ratio_it_is_the_discrete_solution(height, share):
    curve, half_space, gap = moved(sphere(PLAIN), 32, height)
    stage = int(share * len(curve.shift)) + 1
    path = LoopPath(LOAD, FRICTION * curve.shift[stage], increments=2)
    loop = march_loop(FrictionalContact(half_space, FRICTION), gap, path)
    force = loop.loading[1][-1]
    assert force == pytest.approx(FRICTION * curve.force[stage], rel=1e-5)
    # The energy on the grid itself, from the cells that have slipped.
    pressure = curve.normal.pressure
    cells = 4.0 * FRICTION**2 * np.vdot(pressure, curve.slip[stage]) * half_space.grid.cell_area
    assert cells == pytest.approx(loop.energy, rel=1e-3)


@pytest.mark.slow
def test_with_poissons_ratio_loops_differ_little_from_the_whole_problem():
    curve, half_space, gap = moved(sphere(STEEL), 32)
    for share, allowed in ((0.5, 0.02), (2.0, 1e-3)):
        amplitude = share * curve.shift[-1]
        path = LoopPath(LOAD, FRICTION * amplitude)
        loop = march_loop(FrictionalContact(half_space, FRICTION), gap, path)
        lost = FRICTION**2 * float(curve.slider_load @ travel_of(curve, amplitude))
        assert lost == pytest.approx(loop.energy, rel=allowed)


# --- what cells slip ----------------------------------------------------------------------------


def test_energies_of_cells_converge_to_that_of_the_sliders():
    errors = []
    for stages in (8, 16, 32):
        curve, half_space, _ = moved(sphere(STEEL), stages=stages)
        travel = travel_of(curve, 0.5 * curve.shift[-1], 0.2 * curve.shift[-1])
        cells = float(np.vdot(curve.normal.pressure, curve.travelled(travel)))
        cells *= half_space.grid.cell_area
        errors.append(abs(cells / float(curve.slider_load @ travel) - 1.0))
    # Stages are spaced with the power 1.5 of their number, and curves are linear between them.
    assert errors[2] < 0.3 * errors[1] < 0.1 * errors[0]


def test_a_sliding_contact_slips_uniformly():
    curve, _, _ = moved(sphere(STEEL))
    less, more = (curve.travelled(travel_of(curve, k * curve.shift[-1])) for k in (1.5, 3.0))
    pressed = curve.normal.pressure > 0.0
    np.testing.assert_allclose((more - less)[pressed], 6.0 * curve.shift[-1], rtol=1e-9)
    assert not more[~pressed].any()


def test_what_has_not_reached_its_onset_has_not_slipped():
    curve, _, _ = moved(sphere(STEEL))
    amplitude = curve.shift[len(curve.shift) // 2]
    path = curve.travelled(travel_of(curve, amplitude))
    pressed = curve.normal.pressure > 0.0
    assert np.all(path[pressed & (curve.onset >= amplitude)] < 1e-12 * path.max())
    assert np.all(path[pressed & (curve.onset < amplitude * (1.0 - 1e-12))] > 0.0)
    assert not curve.travelled(np.zeros(len(curve.reach))).any()


def test_the_last_cells_to_slip_do_so_together():
    """Rounding makes four cells in the middle slip one after the other."""
    curve, _, _ = moved(sphere(STEEL))
    slip = curve.slip.copy()
    middle = [k // 2 for k in slip.shape[1:]]
    first, second = (slice(k - 1, k + 1) for k in middle)
    slip[-1, first, second] = 1e-16 * slip.max() * np.array([[0.0, 1.0], [2.0, 3.0]])
    onset = replace(curve, slip=slip).onset
    assert np.all(onset[first, second] == curve.shift[-1])


def test_a_flat_punch_slips_all_at_once():
    curve, half_space, _ = moved(sphere(STEEL), height=lambda grid: np.zeros(grid.shape))
    assert len(curve.reach) == 1
    assert curve.reach[0] == pytest.approx(LOAD / curve.stiffness, rel=1e-6)
    travel = travel_of(curve, 2.0 * curve.reach[0])
    cells = np.vdot(curve.normal.pressure, curve.travelled(travel)) * half_space.grid.cell_area
    assert cells == pytest.approx(4.0 * LOAD * curve.reach[0], rel=1e-6)


# --- what it cannot be --------------------------------------------------------------------------


def test_dissimilar_bodies_and_no_load_are_refused():
    grid = grid_of(sphere(STEEL), 16)
    gap = (grid.x**2 + grid.y**2) / (2.0 * RADIUS)
    dissimilar = NormalContact(HalfSpace(grid, ElasticPair(STEEL, SOFT)))
    with pytest.raises(PartialSlipError, match="dissimilar"):
        partial_slip_curve(dissimilar, gap, LOAD, tolerance=1e-8)
    similar = NormalContact(HalfSpace(grid, ElasticPair(STEEL, STEEL)))
    with pytest.raises(PartialSlipError, match=r"load P .* = 0"):
        partial_slip_curve(similar, gap, 0.0, tolerance=1e-8)
