"""Stress inside the bodies against closed forms, point forces, equilibrium and symmetry."""

import itertools

import numpy as np
import pytest

from sa_solver.half_space.stress import principal_stresses, von_mises
from sa_solver.half_space.subsurface import SubsurfaceError, SubsurfaceStress, sections
from sa_solver.half_space.subsurface_influence import (
    INDICES,
    XX,
    XY,
    YY,
    YZ,
    ZX,
    ZZ,
    rectangle_stress,
    strip_stress,
)
from sa_solver.reference.hertz import HertzCylinder, HertzSphere
from sa_solver.reference.subsurface import (
    cylinder_stress,
    point_force_stress,
    sphere_axis_stress,
    sphere_surface_stress,
)
from sa_solver.types import Grid, Material

STEEL = Material(200e3, 0.3)
MODULUS = 1.1e5
SPHERE = HertzSphere(400.0, 10.0, MODULUS)
CYLINDER = HertzCylinder(500.0, 10.0, MODULUS)
FRICTION = 0.4
SIZE = (0.8, 0.5)
RATIOS = [0.0, 0.3, 0.5]
POINTS = [
    (0.1, -0.05, 0.4),
    (0.4, 0.25, 0.3),  # below a corner
    (0.4, 0.1, 0.25),  # below an edge
    (0.9, 0.25, 0.1),
    (-1.3, 0.7, 0.0),
    (3.0, -4.0, 2.0),
]


def rectangle(x, y, z, poisson, size=SIZE):
    """Return all coefficients (6, 3) at a point from the centre of a rectangle."""
    edges = [np.array([c - 0.5 * s, c + 0.5 * s]) for c, s in zip((x, y), size, strict=True)]
    return rectangle_stress(edges[0], edges[1], z, poisson)[..., 0, 0]


def as_tensor(stress):
    """Return stress (6, ...) as tensors (3, 3, ...)."""
    tensor = np.empty((3, 3, *stress.shape[1:]))
    for component, (i, j) in zip(stress, INDICES, strict=True):
        tensor[i, j] = tensor[j, i] = component
    return tensor


@pytest.mark.parametrize("poisson", RATIOS)
@pytest.mark.parametrize("point", POINTS)
def test_a_rectangle_is_the_integral_of_point_forces(point, poisson):
    """60 Gauss points in each direction converge to rounding at these depths and distances."""
    x, y, z = point
    nodes, weights = np.polynomial.legendre.leggauss(60)
    sources = [c - 0.5 * s * nodes for c, s in zip((x, y), SIZE, strict=True)]
    distance = np.meshgrid(*sources, indexing="ij")
    kernel = point_force_stress(*distance, np.full((60, 60), z), poisson)
    expected = 0.25 * np.prod(SIZE) * np.einsum("ijxy,x,y->ij", kernel, weights, weights)
    accuracy = 1e-8 * np.abs(expected).max()
    np.testing.assert_allclose(rectangle(x, y, z, poisson), expected, rtol=0, atol=accuracy)


@pytest.mark.parametrize("point", POINTS[:4])
def test_a_rectangle_is_in_equilibrium_and_compatible(point):
    """The divergence is 0, and Beltrami and Michell's ∇²σ_ij + σ_kk,ij / (1+ν) = 0.

    Central differences over a step h have errors O(h²), and twice the rounding over h²: 1e-4 of
    σ/size².
    """
    step, poisson = 2e-3, 0.3

    def tensor(*shift):
        moved = np.array(point) + step * np.array(shift)
        return as_tensor(rectangle(*moved, poisson))

    unit = np.eye(3)
    first = np.array([tensor(*u) - tensor(*-u) for u in unit]) / (2.0 * step)
    np.testing.assert_allclose(np.einsum("iijk->jk", first), 0.0, atol=1e-3)
    second = np.empty((3, 3, 3, 3, 3))
    for i, j in itertools.product(range(3), repeat=2):
        a, b = unit[i], unit[j]
        both = tensor(*(a + b)) - tensor(*(a - b)) - tensor(*(b - a)) + tensor(*(-a - b))
        second[i, j] = both / (4.0 * step**2)
    laplacian = np.einsum("iijkl->jkl", second)
    trace = np.einsum("ijkkl->ijl", second)
    size = np.abs(second).max()
    np.testing.assert_allclose(laplacian + trace / (1.0 + poisson), 0.0, atol=1e-3 * size)


def test_an_endless_rectangle_carries_its_traction_everywhere():
    """In equilibrium the sum of zz, yz and zx over any plane is minus the load (Betti)."""
    stress = rectangle(0.0, 0.0, 3.0, 0.3, (1e9, 1e9))
    np.testing.assert_allclose(stress[[ZX, YZ, ZZ]], -np.eye(3), atol=1e-7)


@pytest.mark.parametrize("place", [(0.01, 0.01), (0.4 - 1e-9, 0.25 - 1e-9), (0.4 + 1e-9, 0.1)])
@pytest.mark.parametrize("depth", [1e-15, 1e-12])
def test_the_surface_is_the_limit_of_the_depth(place, depth):
    """The limit holds even 1e-9 from an edge or a corner, at 1e-3 of that distance below."""
    deep, surface = rectangle(*place, depth, 0.3), rectangle(*place, 0.0, 0.3)
    np.testing.assert_allclose(deep, surface, atol=2e-3 * depth / 1e-12 + 1e-12)


def test_below_a_corner_nothing_is_infinite():
    for depth in (1e-100, 1e-12, 1e-3):
        assert np.all(np.isfinite(rectangle(0.4, 0.25, depth, 0.3)))


def test_far_below_rounding_stays_small():
    """Differences between corners of a cell 1000 cells away are compared with a point force."""
    depth = 10.0
    stress = rectangle(3.0, -2.0, depth, 0.3, (0.01, 0.01))
    expected = 1e-4 * point_force_stress(3.0, -2.0, depth, 0.3)
    np.testing.assert_allclose(stress, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("depth", [0.0, 0.2])
@pytest.mark.parametrize("poisson", RATIOS)
def test_a_strip_is_a_long_rectangle_in_plane_strain(depth, poisson):
    edges = np.array([-0.7, -0.2, 0.3, 0.8])
    strip = strip_stress(edges, depth, poisson)
    long = rectangle_stress(edges, np.array([-1e9, 1e9]), depth, poisson)[..., 0]
    np.testing.assert_allclose(strip, long, atol=1e-9)
    plane = poisson * (strip[XX] + strip[ZZ])
    np.testing.assert_allclose(strip[YY], plane, atol=1e-14)


def sheared(pressure, friction=FRICTION):
    return np.stack([friction * pressure, np.zeros_like(pressure), pressure])


def cylinder_error(count, depths):
    """Return the largest error of a section over p0, at each depth."""
    grid = Grid.line_contact(4.0 * CYLINDER.half_width, count)
    traction = sheared(cell_means(grid))
    stress = SubsurfaceStress(grid, STEEL, 2).section(traction, "x", 0.0, depths)
    expected = cylinder_stress(CYLINDER, FRICTION, grid.x, depths, STEEL.poisson)
    return np.abs(stress - expected).max(axis=(0, 1)) / CYLINDER.peak_pressure


def cell_means(grid):
    """Return Hertz's line pressure, averaged over each cell."""
    a = CYLINDER.half_width
    edges = (np.arange(grid.shape[0] + 1) - 0.5 * grid.shape[0]) * grid.pitch[0]
    t = np.clip(edges / a, -1.0, 1.0)
    integral = 0.5 * CYLINDER.peak_pressure * a * (t * np.sqrt(1.0 - t**2) + np.arcsin(t))
    return np.diff(integral)[:, None] / grid.pitch[0]


def test_sliding_cylinder_converges_all_over_a_section():
    """McEwen and Johnson 7.8: second order inside, order 1/2 at the edges of the surface."""
    depths = np.array([0.0, 0.1, 0.5, 1.0, 2.0]) * CYLINDER.half_width
    coarse, fine = cylinder_error(256, depths), cylinder_error(1024, depths)
    assert np.all(fine[2:] < 5e-6)
    assert np.all(coarse[1:] / fine[1:] > 4.0**1.9)
    assert fine[0] < 0.02
    assert coarse[0] / fine[0] == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize(("body", "side"), [(1, 1.0), (2, -1.0)])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_trailing_edge_is_in_tension(body, side, sense):
    """The tension is 2 µ p0 at x = -a of body 2 under shear towards +x, at x = a of body 1.

    It falls as a square root outside the contact, so that the grid has an error O(sqrt(h)): 6 % at
    h = a / 256.
    """
    a, p0 = CYLINDER.half_width, CYLINDER.peak_pressure
    values = []
    for count in (256, 1024):
        grid = Grid.line_contact(4.0 * a, count)
        stress = SubsurfaceStress(grid, STEEL, body).at_depth(
            sheared(cell_means(grid), sense * 0.4), 0.0
        )
        edge = int(np.argmax(stress[XX]))
        assert grid.x[edge, 0] == pytest.approx(side * sense * a, abs=grid.pitch[0])
        values.append(1.0 - stress[XX, edge, 0] / (2.0 * FRICTION * p0))
    assert 0.0 < values[1] < 0.06
    assert values[0] / values[1] == pytest.approx(2.0, rel=0.05)


def sphere_grid(count, size=3.0):
    width = size * SPHERE.contact_radius
    grid = Grid.covering((width, width), (count, count))
    return grid, SPHERE.pressure(grid.x, grid.y)


@pytest.mark.parametrize("poisson", RATIOS)
def test_sphere_on_its_axis(poisson):
    """Johnson 3.45, at depths from 0.2 a."""
    grid, pressure = sphere_grid(95)
    depths = np.linspace(0.2, 2.0, 10) * SPHERE.contact_radius
    solver = SubsurfaceStress(grid, Material(1.0, poisson), 2)
    stress = solver.section(sheared(pressure, 0.0), "x", 0.0, depths)[:, 47]
    expected = sphere_axis_stress(SPHERE, depths, poisson)
    np.testing.assert_allclose(stress, expected, rtol=0, atol=1e-3 * SPHERE.peak_pressure)


def test_yield_starts_below_the_sphere():
    """The largest shear is 0.310 p0 at a depth of 0.481 a for ν = 0.3 (Johnson 3.46)."""
    a = SPHERE.contact_radius
    grid, pressure = sphere_grid(95)
    depths = np.linspace(0.4, 0.56, 17) * a
    section = SubsurfaceStress(grid, STEEL, 1).section(sheared(pressure, 0.0), "y", 0.0, depths)
    shear = 0.5 * (section[XX, 47] - section[ZZ, 47])
    assert shear.max() / SPHERE.peak_pressure == pytest.approx(0.310, abs=5e-4)
    assert depths[np.argmax(shear)] / a == pytest.approx(0.481, abs=0.01)


def surface_error(count):
    """Return the mean error at the surface over p0, inside the contact."""
    grid, pressure = sphere_grid(count)
    stress = SubsurfaceStress(grid, STEEL, 2).at_depth(sheared(pressure), 0.0)
    expected = sphere_surface_stress(SPHERE, FRICTION, grid.x, grid.y, STEEL.poisson)
    inside = np.hypot(grid.x, grid.y) < SPHERE.contact_radius
    return np.abs(stress - expected)[:, inside].mean(axis=1) / SPHERE.peak_pressure


def test_surface_of_a_sliding_sphere():
    """Johnson 3.42 and 3.91: first order in the mean, because the edge runs through cells."""
    coarse, fine = surface_error(64), surface_error(256)
    convolved = [XX, YY, XY]
    assert np.all(fine[convolved] < 2.5e-3)
    np.testing.assert_allclose(coarse[convolved] / fine[convolved], 4.0, rtol=0.1)
    np.testing.assert_allclose(fine[[ZZ, YZ, ZX]], 0.0, atol=1e-15)


def test_pressure_pulls_radially_at_the_edge():
    """The tension is (1-2ν) p0 / 3 at r = a (Johnson 3.44), and falls as a²/r² outside.

    The error jumps with the course of the edge through the cells, so that it is of first order over
    a wide range only.
    """
    coarse, fine = edge_error(32), edge_error(256)
    assert fine < 0.004
    assert coarse / fine > 8.0


def edge_error(count):
    """Return the largest relative error of the radial stress outside the contact, in one row."""
    grid, pressure = sphere_grid(count + 1)
    stress = SubsurfaceStress(grid, STEEL, 2).at_depth(sheared(pressure, 0.0), 0.0)
    r = np.abs(grid.x[:, 0]) / SPHERE.contact_radius
    expected = 0.4 / 3.0 * SPHERE.peak_pressure
    return np.abs(stress[XX, :, count // 2] * r**2 / expected - 1.0)[r > 1.0].max()


def random_traction(grid, seed=3):
    """Return random tractions on the middle of the grid."""
    rng = np.random.default_rng(seed)
    traction = np.zeros((3, *grid.shape))
    middle = tuple(slice(n // 4, n - n // 4) for n in grid.shape)
    traction[(slice(None), *middle)] = rng.standard_normal(traction[(slice(None), *middle)].shape)
    return traction


@pytest.mark.parametrize("body", [1, 2])
@pytest.mark.parametrize("depth", [0.0, 0.13])
@pytest.mark.parametrize("shape", [(5, 7), (4, 3), (1, 6)])
def test_convolution_is_the_sum_over_cells(body, depth, shape):
    grid = Grid(shape, (0.2, 0.15))
    traction = np.random.default_rng(1).standard_normal((3, *shape))
    sign = -1.0 if body == 1 else 1.0
    felt = traction * np.array([sign, sign, 1.0])[:, None, None]
    expected = np.zeros((6, *shape))
    for i, j in np.ndindex(shape):
        for k, m in np.ndindex(shape):
            offset = grid.x[i, 0] - grid.x[k, 0], grid.y[0, j] - grid.y[0, m]
            one = rectangle(*offset, depth, 0.3, grid.pitch)
            expected[:, i, j] += one @ felt[:, k, m]
    expected[[YZ, ZX]] *= sign
    stress = SubsurfaceStress(grid, STEEL, body).at_depth(traction, depth)
    np.testing.assert_allclose(stress, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("body", [1, 2])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_section_is_cut_from_planes(body, axis):
    grid = Grid((12, 17), (0.2, 0.15))
    traction, depths = random_traction(grid), np.array([0.0, 0.05, 0.4])
    solver = SubsurfaceStress(grid, STEEL, body)
    section = solver.section(traction, axis, 0.33, depths)
    for column, depth in enumerate(depths):
        plane = solver.at_depth(traction, depth)
        row = np.argmin(np.abs((grid.y[0] if axis == "x" else grid.x[:, 0]) - 0.33))
        expected = plane[:, :, row] if axis == "x" else plane[:, row]
        np.testing.assert_allclose(section[:, :, column], expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("body", [1, 2])
def test_both_bodies_are_in_equilibrium(body):
    """The divergence by differences over the grid, O(h²), is 4 times less on half the pitch."""
    worst = [divergence(body, count) for count in (24, 48)]
    assert worst[1] < 0.015
    assert worst[0] / worst[1] > 3.5


def divergence(body, count):
    """Return the largest divergence at a depth over the largest derivative of stress there."""
    grid = Grid.covering((4.0, 4.0), (count, count))
    bump = np.maximum(0.0, 1.0 - grid.x**2 - (grid.y - 0.2) ** 2) ** 2
    traction = np.stack([0.5 * bump * (1.0 + grid.x), -0.3 * bump, bump])
    solver, h = SubsurfaceStress(grid, STEEL, body), grid.pitch[0]
    above, here, below = (as_tensor(solver.at_depth(traction, 0.8 + s * h)) for s in (-1, 0, 1))
    down = 1.0 if body == 2 else -1.0
    inner = slice(1, -1)
    gradient = [
        (here[0, :, 2:, inner] - here[0, :, :-2, inner]) / (2.0 * h),
        (here[1, :, inner, 2:] - here[1, :, inner, :-2]) / (2.0 * h),
        down * (below[2] - above[2])[:, inner, inner] / (2.0 * h),
    ]
    return np.abs(sum(gradient)).max() / max(np.abs(part).max() for part in gradient)


def test_a_plane_below_carries_the_load():
    """The force of a line load between ±R at a depth z follows from Flamant's stress."""
    grid, depth = Grid.line_contact(20.0, 2001), 0.5
    traction = np.zeros((3, 2001, 1))
    traction[:, 1000] = np.array([20.0, 0.0, 50.0])[:, None]
    stress = SubsurfaceStress(grid, STEEL, 2).at_depth(traction, depth)
    forces = stress.sum(axis=(1, 2)) * grid.pitch[0]
    angle, dip = np.arctan(10.0 / depth), 10.0 * depth / (100.0 + depth**2)
    passed = 2.0 / np.pi * np.array([angle + dip, angle - dip])
    load = traction[:, 1000, 0] * grid.pitch[0]
    np.testing.assert_allclose(forces[[ZZ, ZX]], -load[[2, 0]] * passed, rtol=1e-3)


def test_body_1_is_body_2_turned_over():
    """Half a turn about x maps one to the other; xy and zx change their signs."""
    grid = Grid((12, 17), (0.2, 0.15))
    traction = random_traction(grid)
    turned = traction[:, :, ::-1] * np.array([-1.0, 1.0, 1.0])[:, None, None]
    for depth in (0.0, 0.3):
        first = SubsurfaceStress(grid, STEEL, 1).at_depth(traction, depth)
        second = SubsurfaceStress(grid, STEEL, 2).at_depth(turned, depth)[:, :, ::-1]
        second[[XY, ZX]] *= -1.0
        np.testing.assert_allclose(first, second, rtol=0, atol=1e-12)


def test_exchange_of_the_axes():
    grid, other = Grid((12, 17), (0.2, 0.15)), Grid((17, 12), (0.15, 0.2))
    traction = random_traction(grid)
    exchanged = traction[[1, 0, 2]].swapaxes(1, 2)
    stress = SubsurfaceStress(grid, STEEL, 2).at_depth(traction, 0.2)
    expected = SubsurfaceStress(other, STEEL, 2).at_depth(exchanged, 0.2).swapaxes(1, 2)
    np.testing.assert_allclose(stress, expected[[YY, XX, ZZ, XY, ZX, YZ]], rtol=0, atol=1e-12)


@pytest.mark.parametrize("body", [1, 2])
@pytest.mark.parametrize("grid", [Grid((12, 17), (0.2, 0.15)), Grid.line_contact(2.0, 12)], ids=str)
def test_points_are_where_planes_and_sections_are(grid, body):
    """The points are below the centres of cells, in the middle of the loaded part of the grid."""
    traction = random_traction(grid)
    traction[:, :3] = 0.0
    solver, depths = SubsurfaceStress(grid, STEEL, body), np.array([0.0, 1e-3, 0.3])
    place = grid.shape[1] // 2
    section = solver.section(traction, "x", grid.y[0, place], depths)
    for column, depth in enumerate(depths):
        points = [(x, y, depth) for x in grid.x[:, 0] for y in grid.y[0]]
        stress = solver.at_points(traction, points).reshape(6, *grid.shape)
        atol = 1e-11 * np.abs(stress).max()
        np.testing.assert_allclose(stress, solver.at_depth(traction, depth), rtol=0, atol=atol)
        np.testing.assert_allclose(stress[:, :, place], section[:, :, column], rtol=0, atol=atol)


def test_points_far_away_see_a_point_force_and_none_without_load():
    """A cell of 0.1 mm differs from a point force at 10 mm by the square of the ratio."""
    grid = Grid.covering((1.0, 1.0), (10, 10))
    solver, traction = SubsurfaceStress(grid, STEEL, 2), np.zeros((3, 10, 10))
    assert not solver.at_points(traction, [[0.3, 0.2, 0.1]]).any()
    traction[:, 7, 2] = 100.0, -50.0, 200.0
    point = np.array([6.0, 5.0, 7.0])
    away = point - (grid.x[7, 0], grid.y[0, 2], 0.0)
    expected = point_force_stress(*away[:, None], STEEL.poisson)[..., 0] @ traction[:, 7, 2]
    found = solver.at_points(traction, point[None])[:, 0]
    np.testing.assert_allclose(found, grid.cell_area * expected, rtol=3e-4)


def test_a_ball_yields_below_its_middle():
    """Johnson: the largest shear stress is 0.310 p0 at 0.48 a for ν = 0.3.

    On the axis √J is twice that, and two of the principal stresses are equal.
    """
    a, p0 = SPHERE.contact_radius, SPHERE.peak_pressure
    grid = Grid.covering((2.2 * a,) * 2, (64, 64))
    traction = np.zeros((3, 64, 64))
    traction[2] = SPHERE.pressure(grid.x, grid.y)
    depth = np.linspace(0.3, 0.7, 41) * a
    points = np.stack([0.0 * depth, 0.0 * depth, depth], axis=1)
    stress = SubsurfaceStress(grid, Material(200e3, 0.3), 1).at_points(traction, points)
    np.testing.assert_allclose(stress, sphere_axis_stress(SPHERE, depth, 0.3), atol=1e-3 * p0)
    equivalent, principal = von_mises(stress), principal_stresses(stress)
    assert equivalent.max() == pytest.approx(0.620 * p0, abs=2e-3 * p0)
    assert depth[equivalent.argmax()] == pytest.approx(0.48 * a, abs=0.011 * a)
    np.testing.assert_allclose(principal[0] - principal[2], equivalent, rtol=1e-9)
    assert np.all(np.diff(principal, axis=0) <= 1e-9 * p0)
    np.testing.assert_allclose(principal.sum(axis=0), stress[:3].sum(axis=0))


def test_points_on_borders_of_cells_and_above_the_surface_are_refused():
    grid = Grid((4, 4), (0.1, 0.1))
    solver, traction = SubsurfaceStress(grid, STEEL, 2), np.ones((3, 4, 4))
    for point in ([0.0, 0.0, 0.0], [0.03, 0.1, 0.0], [0.0, 0.0, -0.1], [0.0, 0.0, np.nan]):
        with pytest.raises(SubsurfaceError):
            solver.at_points(traction, [point])
    assert np.isfinite(solver.at_points(traction, [[0.0, 0.0, 0.01], [0.03, 0.02, 0.0]])).all()


@pytest.mark.parametrize("body", [1, 2])
def test_the_surface_carries_the_tractions(body):
    grid = Grid((12, 17), (0.2, 0.15))
    traction = random_traction(grid)
    surface = SubsurfaceStress(grid, STEEL, body).at_depth(traction, 0.0)
    np.testing.assert_array_equal(surface[[ZX, YZ, ZZ]], -traction)
    below = SubsurfaceStress(grid, STEEL, body).at_depth(traction, 1e-12)
    np.testing.assert_allclose(below, surface, rtol=0, atol=1e-9)


def test_no_load_no_stress():
    grid = Grid((4, 5), (0.1, 0.1))
    solver = SubsurfaceStress(grid, STEEL, 2)
    assert not solver.section(np.zeros((3, 4, 5)), "x", 0.0, np.array([0.1])).any()


def test_what_does_not_fit_is_refused():
    line, plane = Grid.line_contact(1.0, 8), Grid((4, 5), (0.1, 0.1))
    with pytest.raises(SubsurfaceError, match="body is 3"):
        SubsurfaceStress(line, STEEL, 3)
    with pytest.raises(SubsurfaceError, match="section along y"):
        SubsurfaceStress(line, STEEL, 1).section(np.ones((3, 8, 1)), "y", 0.0, np.ones(1))
    with pytest.raises(SubsurfaceError, match="grid ends"):
        SubsurfaceStress(plane, STEEL, 1).section(np.ones((3, 4, 5)), "x", 0.3, np.ones(1))
    with pytest.raises(SubsurfaceError, match="shape"):
        SubsurfaceStress(plane, STEEL, 1).at_depth(np.ones((3, 5, 4)), 0.0)
    with pytest.raises(SubsurfaceError, match="depth"):
        SubsurfaceStress(plane, STEEL, 1).at_depth(np.ones((3, 4, 5)), -0.1)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_sections_together_are_those_of_each(axis):
    """Shared coefficients are the same for each body, for any loaded rows and depths."""
    grid = Grid.covering((2.0, 3.0), (10, 12))
    one, other = random_traction(grid), np.roll(random_traction(grid, 4), 3, axis=1)
    bodies = [SubsurfaceStress(grid, Material(1.0, poisson), 1) for poisson in (0.3, 0.3, 0.1)]
    bodies.append(SubsurfaceStress(grid, Material(2.0, 0.3), 2))
    depths = [np.array(some) for some in ([0.0, 0.1, 0.5], [0.5, 0.2], [0.1, 0.5], [0.1])]
    wanted = list(zip(bodies, (one, other, one, 0.0 * one), depths, strict=True))
    for together, (body, traction, deep) in zip(sections(wanted, axis, 0.3), wanted, strict=True):
        np.testing.assert_array_equal(together, body.section(traction, axis, 0.3, deep))


@pytest.mark.parametrize("depth", [0.0, 0.2])
@pytest.mark.parametrize("body", [1, 2])
def test_stress_along_the_surface_alone_is_that_of_all(body, depth):
    grid = Grid.covering((2.0, 3.0), (10, 12))
    traction, solver = random_traction(grid), SubsurfaceStress(grid, STEEL, body)
    every, alone = solver.at_depth(traction, depth), solver.along_surface(traction, depth)
    np.testing.assert_array_equal(alone, every[[XX, YY, XY]])
