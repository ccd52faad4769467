"""Displacement of two half-spaces by FFT: direct summation, closed forms, symmetry, energy."""

import numpy as np
import pytest

from sa_solver.half_space.influence import X, Y, Z, rectangle_influence, strip_influence
from sa_solver.half_space.operator import ALL, NORMAL, SHEAR, HalfSpace, HalfSpaceResolvent
from sa_solver.types import ElasticPair, Grid, Material

RIGID = Material(np.inf, 0.3)
STEEL = Material(200e3, 0.3)
ALUMINIUM = Material(70e3, 0.1)
DISSIMILAR = ElasticPair(STEEL, ALUMINIUM)
SIMILAR = ElasticPair(STEEL, STEEL)
STRONGEST = ElasticPair(RIGID, Material(70e3, 0.0))
"""β = 0.5, the largest of materials with ν >= 0."""

GRIDS = {
    "even": Grid((6, 4), (0.3, 0.5)),
    "odd": Grid((7, 5), (0.3, 0.5)),
    "mixed": Grid((4, 9), (0.5, 0.2)),
    "row": Grid((1, 8), (0.3, 0.5)),
    "column": Grid((7, 1), (0.3, 0.5)),
    "cell": Grid((1, 1), (0.3, 0.5)),
    "line, even": Grid.line_contact(2.0, 8),
    "line, odd": Grid.line_contact(2.0, 9),
}
LARGER_GRIDS = {
    "square": Grid((64, 64), (1.0, 1.0)),
    "long along y": Grid((16, 128), (1.0, 0.05)),
    "long along x": Grid((128, 16), (1.0, 0.05)),
    "flat cells": Grid((16, 16), (1.0, 0.02)),
    "line": Grid.line_contact(4.0, 101),
    "fine line": Grid.line_contact(4.0, 1000),
}
EVERY_GRID = GRIDS | LARGER_GRIDS
COMPONENT_SETS = [NORMAL, SHEAR, ALL]
ROUNDING = 1e-12

every_small_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS.keys())
every_grid = pytest.mark.parametrize("grid", EVERY_GRID.values(), ids=EVERY_GRID.keys())


def tractions(grid, count=1, seed=0):
    return np.random.default_rng(seed).standard_normal((count, 3, *grid.shape))


def assert_same(computed, expected, accuracy=ROUNDING):
    """Assert that two fields agree to ``accuracy`` of the largest value."""
    np.testing.assert_allclose(computed, expected, rtol=0, atol=accuracy * np.abs(expected).max())


def kernel(grid, pair, distances, datum):
    """Return all influence coefficients ``(3, 3, ...)`` at ``distances`` in cells along x and y."""
    edges = [
        np.append(steps - 0.5, steps[-1] + 0.5) * pitch
        for steps, pitch in zip(distances, grid.pitch, strict=True)
    ]

    def coefficients(i, j):
        if grid.line:
            return strip_influence(edges[0], pair, i, j, datum)[:, None]
        return rectangle_influence(*edges, pair, i, j)

    return np.array([[coefficients(i, j) for j in range(3)] for i in range(3)])


def dense_operator(grid, pair, datum=None):
    """Return K as a matrix ``(3 n, 3 n)``, from the influence coefficients alone."""
    datum = 2.0 * grid.size[0] if datum is None else datum
    distances = [np.arange(1 - n, n) for n in grid.shape]
    coefficients = kernel(grid, pair, distances, datum)
    ix, iy = (np.arange(n)[:, None] - np.arange(n) + n - 1 for n in grid.shape)
    blocks = coefficients[:, :, ix[:, None, :, None], iy[None, :, None, :]]
    size = 3 * grid.shape[0] * grid.shape[1]
    return blocks.transpose(0, 2, 3, 1, 4, 5).reshape(size, size)


def circulant(half_space, traction):
    """Return K on the padded periodic grid, by complex transforms of the whole kernel.

    At the same distance from two images, the displacement is the mean of both.
    """
    grid, period = half_space.grid, half_space.padded
    distances = [np.arange(-(m // 2), m // 2 + 1) for m in period]
    coefficients = kernel(grid, half_space.pair, distances, half_space.datum)
    for axis, m in ((2, period[0]), (3, period[1])):
        coefficients = np.moveaxis(coefficients, axis, 0)
        if m % 2 == 0:
            coefficients[0] = 0.5 * (coefficients[0] + coefficients[-1])
            coefficients = coefficients[:-1]
        coefficients = np.moveaxis(np.roll(coefficients, -(m // 2), axis=0), 0, axis)
    product = np.einsum("ijxy,jxy->ixy", np.fft.fft2(coefficients), np.fft.fft2(traction))
    return np.fft.ifft2(product).real


def symbols(half_space):
    """Return the matrix of symbols ``(mx, my//2 + 1, 3, 3)``."""
    rows = [[half_space.symbol(i, j) for j in ALL] for i in ALL]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


@every_small_grid
@pytest.mark.parametrize("pair", [DISSIMILAR, SIMILAR, STRONGEST])
def test_displacement_is_direct_summation(grid, pair):
    (traction,) = tractions(grid)
    direct = dense_operator(grid, pair) @ traction.ravel()
    assert_same(HalfSpace(grid, pair).displacement(traction).ravel(), direct)


@every_small_grid
@pytest.mark.parametrize("pair", [DISSIMILAR, SIMILAR])
def test_parts_are_those_of_the_full_vector(grid, pair):
    (traction,) = tractions(grid)
    pressure, shear = traction[Z], traction[:Z]
    half_space = HalfSpace(grid, pair)
    under_pressure = half_space.displacement(np.array([0 * pressure, 0 * pressure, pressure]))
    under_shear = half_space.displacement(np.array([*shear, 0 * pressure]))
    scale = np.abs(under_pressure).max()
    expected = [
        (half_space.normal(pressure), under_pressure[Z]),
        (half_space.shear(shear), under_shear[:Z]),
        (half_space.normal_under_shear(shear), under_shear[Z]),
    ]
    for part, whole in expected:
        assert part.shape == whole.shape
        np.testing.assert_allclose(part, whole, rtol=0, atol=ROUNDING * scale)


@pytest.mark.parametrize("grid", [Grid((16, 13), (0.3, 0.5)), Grid.line_contact(2.0, 16)])
@pytest.mark.parametrize(("cells", "larger"), [((9, 7), 1.0), ((8, 6), 2.0), ((5, 4), 3.1)])
def test_coefficients_from_a_finer_grid_are_those_of_the_grid(grid, cells, larger):
    """Boxes of the grid share coefficients, and larger cells of the same proportions.

    Lines do not.
    """
    if grid.line:
        other = Grid.line_contact(larger * grid.pitch[0] * cells[0], cells[0])
    else:
        other = Grid(cells, (larger * grid.pitch[0], larger * grid.pitch[1]))
    taken = HalfSpace(grid, DISSIMILAR).on(other)
    own = HalfSpace(other, DISSIMILAR, taken.datum)
    for row, column in np.ndindex(3, 3):
        expected = own.symbol(row, column)
        error = np.abs(taken.symbol(row, column) - expected).max()
        assert error <= ROUNDING * np.abs(own.symbol(Z, Z)).max()


def test_identical_bodies_have_no_cross_terms_at_all():
    grid = GRIDS["odd"]
    half_space = HalfSpace(grid, SIMILAR)
    (traction,) = tractions(grid)
    assert np.array_equal(half_space.normal_under_shear(traction[:Z]), np.zeros((7, 5)))
    assert half_space.count == 0
    traction[Z] = 0.0
    assert np.array_equal(half_space.displacement(traction)[Z], np.zeros((7, 5)))


@every_small_grid
def test_swapping_the_bodies_changes_the_sign_of_the_cross_terms_alone(grid):
    (traction,) = tractions(grid)
    swapped = HalfSpace(grid, ElasticPair(DISSIMILAR.body_2, DISSIMILAR.body_1))
    mirror = np.array([1.0, 1.0, -1.0])[:, None, None]
    expected = mirror * swapped.displacement(mirror * traction)
    assert_same(HalfSpace(grid, DISSIMILAR).displacement(traction), expected, 1e-14)


@every_grid
@pytest.mark.parametrize("pair", [DISSIMILAR, STRONGEST])
def test_reciprocity(grid, pair):
    """Betti: the work of either traction on the displacement of the other is the same."""
    first, second = tractions(grid, 2)
    half_space = HalfSpace(grid, pair)
    displacement = half_space.displacement(second)
    work = np.vdot(half_space.displacement(first), second)
    scale = np.linalg.norm(first) * np.linalg.norm(displacement)
    assert np.vdot(first, displacement) == pytest.approx(work, abs=1e-13 * scale)


@every_small_grid
@pytest.mark.parametrize("axis", [X, Y])
def test_mirrored_tractions_give_mirrored_displacements(grid, axis):
    """The component along the mirrored direction changes its sign; the others do not."""
    (traction,) = tractions(grid)
    half_space = HalfSpace(grid, DISSIMILAR)
    signs = np.ones((3, 1, 1))
    signs[axis] = -1.0
    mirrored = half_space.displacement(signs * np.flip(traction, 1 + axis))
    assert_same(signs * np.flip(mirrored, 1 + axis), half_space.displacement(traction))


def test_exchanging_x_and_y_exchanges_the_components():
    grid, transposed = Grid((6, 5), (0.3, 0.5)), Grid((5, 6), (0.5, 0.3))
    (traction,) = tractions(grid)
    exchange = [Y, X, Z]
    other = HalfSpace(transposed, DISSIMILAR).displacement(traction[exchange].transpose(0, 2, 1))
    expected = HalfSpace(grid, DISSIMILAR).displacement(traction)
    assert_same(other[exchange].transpose(0, 2, 1), expected)


def test_every_convolution_counts_once_whatever_its_components():
    grid = GRIDS["even"]
    half_space = HalfSpace(grid, DISSIMILAR)
    (traction,) = tractions(grid)
    assert half_space.count == 0
    for count, (apply, field) in enumerate(
        [
            (half_space.normal, traction[Z]),
            (half_space.shear, traction[:Z]),
            (half_space.displacement, traction),
            (half_space.normal_under_shear, traction[:Z]),
            (half_space.normal, traction[Z]),
        ],
        start=1,
    ):
        apply(field)
        assert half_space.count == count


@pytest.mark.parametrize("grid", [GRIDS["odd"], GRIDS["line, odd"]])
def test_self_compliance_is_the_displacement_of_a_loaded_cell(grid):
    half_space = HalfSpace(grid, DISSIMILAR)
    middle = tuple(n // 2 for n in grid.shape)
    for component in ALL:
        traction = np.zeros((3, *grid.shape))
        traction[component][middle] = 1.0
        displacement = half_space.displacement(traction)[component][middle]
        assert half_space.self_compliance(component) == pytest.approx(displacement, rel=ROUNDING)


def hertz_disc(cells):
    """Return a grid just larger than the unit disc, and √(1-r²) on it."""
    grid = Grid.covering((2.2, 2.2), (cells, cells))
    return grid, np.sqrt(np.maximum(0.0, 1.0 - grid.x**2 - grid.y**2))


@pytest.mark.parametrize(("cells", "accuracy"), [(32, 4e-3), (128, 5e-4)])
def test_shear_of_hertzian_shape(cells, accuracy):
    """Johnson eqs 3.91a, b hold for both bodies together; the error at the edge is O(pitch^1.5)."""
    grid, profile = hertz_disc(cells)
    pair = DISSIMILAR
    s, v = pair.shear, pair.poisson
    inside = grid.x**2 + grid.y**2 < 1.0
    u_x = np.pi / 32.0 * (4 * (2 * s - v) - (4 * s - 3 * v) * grid.x**2 - (4 * s - v) * grid.y**2)
    u_y = np.pi / 32.0 * 2.0 * v * grid.x * grid.y
    displacement = HalfSpace(grid, pair).shear(np.array([profile, 0.0 * profile]))
    assert np.abs(displacement[X] - u_x)[inside].max() < accuracy * u_x.max()
    assert np.abs(displacement[Y] - u_y)[inside].max() < accuracy * u_x.max()


@pytest.mark.parametrize(("cells", "accuracy"), [(32, 4e-3), (128, 5e-4)])
def test_pressure_of_hertzian_shape_pulls_the_softer_surface_inwards(cells, accuracy):
    """Johnson eqs 3.41a, b: u_r = -(1-2ν)/(6 G) p0 [1 - (1-r²)^1.5] / r, body 2 minus body 1."""
    grid, profile = hertz_disc(cells)
    pair = DISSIMILAR
    squares = grid.x**2 + grid.y**2
    inside = squares < 1.0
    u_z = np.pi / 4.0 / pair.contact_modulus * (2.0 - squares)
    radial = -pair.coupling / 3.0 * (1.0 - profile**3) / squares
    half_space = HalfSpace(grid, pair)
    scale = accuracy * u_z.max()
    assert np.abs(half_space.normal(profile) - u_z)[inside].max() < scale
    displacement = half_space.displacement(np.stack([0.0 * profile, 0.0 * profile, profile]))
    assert pair.body_2.shear_modulus < pair.body_1.shear_modulus
    assert displacement[X][-cells // 4, cells // 2] < 0.0  # where x > 0
    for component, coordinate in ((X, grid.x), (Y, grid.y)):
        assert np.abs(displacement[component] - radial * coordinate)[inside].max() < scale


@pytest.mark.parametrize(("cells", "accuracy"), [(50, 4e-3), (400, 1.8e-4)])
def test_line_load_of_hertzian_shape(cells, accuracy):
    """The displacement is a parabola under the load (Johnson eq. 4.45).

    At the centre it is -∫ ln|s/L| p ds, and the tangential displacement has a jump in slope.
    """
    grid, datum = Grid.line_contact(2.2, cells), 5.0
    x, pair = grid.x, DISSIMILAR
    profile = np.sqrt(np.maximum(0.0, 1.0 - x**2))
    inside = np.abs(x) < 1.0
    shape = 0.5 * (np.log(2.0 * datum) + 0.5 - x**2)
    one_sided = np.arcsin(np.clip(x, -1.0, 1.0)) + x * profile  # ∫ sgn(x-s) √(1-s²) ds
    zero = 0.0 * profile
    half_space = HalfSpace(grid, pair, datum=datum)
    cases = [
        ([profile, zero, zero], [pair.normal * shape, zero, 0.5 * pair.coupling * one_sided]),
        ([zero, profile, zero], [zero, pair.shear * shape, zero]),
        ([zero, zero, profile], [-0.5 * pair.coupling * one_sided, zero, pair.normal * shape]),
    ]
    for traction, expected in cases:
        error = half_space.displacement(np.array(traction)) - np.array(expected)
        assert np.abs(error[:, inside]).max() < accuracy * pair.normal * shape.max()


def test_the_default_datum_is_two_widths_away():
    grid = GRIDS["line, even"]
    (traction,) = tractions(grid)
    half_spaces = [HalfSpace(grid, DISSIMILAR, datum=datum) for datum in (None, 4.0)]
    assert half_spaces[0].datum == 4.0
    assert np.array_equal(*(h.displacement(traction) for h in half_spaces))


@pytest.mark.parametrize("datum", [1.99, 0.0, -4.0, np.nan])
def test_a_datum_shorter_than_the_grid_is_refused(datum):
    with pytest.raises(ValueError, match=r"width of the grid, 2 mm|datum = nan"):
        HalfSpace(Grid.line_contact(2.0, 8), DISSIMILAR, datum=datum)


@every_grid
@pytest.mark.parametrize("poisson", [0.0, 0.1, 0.3, 0.5])
@pytest.mark.parametrize("rigid_below", [True, False])
def test_symbol_is_positive_definite(grid, poisson, rigid_below):
    """The symbol is positive at every frequency, for β up to 0.5 and the smallest datum.

    Otherwise neither the resolvent nor the preconditioner would be positive definite.
    """
    body = Material(70e3, poisson)
    pair = ElasticPair(RIGID, body) if rigid_below else ElasticPair(body, RIGID)
    half_space = HalfSpace(grid, pair, datum=grid.size[0])
    assert np.linalg.eigvalsh(symbols(half_space)).min() > 0.0


@every_small_grid
@pytest.mark.parametrize("pair", [DISSIMILAR, STRONGEST])
def test_strain_energy_is_positive(grid, pair):
    """The energy of every traction is positive: the smallest eigenvalue of a direct K is."""
    assert np.linalg.eigvalsh(dense_operator(grid, pair, grid.size[0])).min() > 0.0


@every_grid
def test_strain_energy_of_random_tractions_is_positive(grid):
    half_space = HalfSpace(grid, STRONGEST, datum=grid.size[0])
    for traction in tractions(grid, 5):
        assert np.vdot(traction, half_space.displacement(traction)) > 0.0


@every_small_grid
@pytest.mark.parametrize("components", COMPONENT_SETS)
def test_resolvent_inverts_the_circulant(grid, components):
    half_space = HalfSpace(grid, DISSIMILAR)
    resolvent = HalfSpaceResolvent(half_space, components)
    assert resolvent.shift.min() > 0.0
    chosen, padded = list(components), resolvent.padded_shape
    traction = np.zeros((3, *padded))
    traction[chosen] = np.random.default_rng(6).standard_normal((len(chosen), *padded))
    displacement = circulant(half_space, traction)[chosen] + resolvent.shift * traction[chosen]
    assert_same(resolvent.solve(displacement), traction[chosen], 1e-11)
    assert half_space.count == 1


@every_small_grid
def test_circulant_is_the_half_space_on_the_grid(grid):
    """The resolvent inverts the operator where the padding carries no traction."""
    half_space = HalfSpace(grid, DISSIMILAR)
    traction = np.zeros((3, *half_space.padded))
    nx, ny = grid.shape
    traction[:, :nx, :ny] = tractions(grid)[0]
    displacement = circulant(half_space, traction)[:, :nx, :ny]
    assert_same(displacement, half_space.displacement(traction[:, :nx, :ny]))


@every_grid
@pytest.mark.parametrize("components", COMPONENT_SETS)
def test_resolvent_is_symmetric_and_positive(grid, components):
    resolvent = HalfSpaceResolvent(HalfSpace(grid, STRONGEST), components)
    shape = (2, len(components), *resolvent.padded_shape)
    first, second = np.random.default_rng(7).standard_normal(shape)
    solved = resolvent.solve(second)
    scale = np.linalg.norm(first) * np.linalg.norm(solved)
    mutual = np.vdot(resolvent.solve(first), second)
    assert np.vdot(first, solved) == pytest.approx(mutual, abs=1e-13 * scale)
    assert np.vdot(second, solved) > 0.0
    # The resolvent is never stiffer than 1/ρ, which bounds the step of the splitting.
    assert np.linalg.norm(solved) <= np.linalg.norm(second) / resolvent.shift.min() * (
        1.0 + ROUNDING
    )


def test_repeated_half_spaces_give_the_same_bits():
    grid = GRIDS["mixed"]
    (traction,) = tractions(grid)
    fields = [HalfSpace(grid, DISSIMILAR).displacement(traction) for _ in range(2)]
    assert np.array_equal(*fields)


def test_parts_share_transforms_without_disturbing_each_other():
    """The result does not depend on the order of calls, which leave their spectra behind."""
    grid = GRIDS["even"]
    (traction,) = tractions(grid)
    half_space, fresh = HalfSpace(grid, DISSIMILAR), HalfSpace(grid, DISSIMILAR)
    expected = fresh.displacement(traction)
    half_space.shear(traction[:Z])
    half_space.normal_under_shear(traction[:Z])
    half_space.displacement(2.0 * traction)
    half_space.normal(traction[Z])
    HalfSpaceResolvent(half_space, ALL).solve(np.ones((3, *half_space.padded)))
    assert np.array_equal(half_space.displacement(traction), expected)
