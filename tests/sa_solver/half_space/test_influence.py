"""Influence coefficients against quadrature of the point and line kernels, body by body."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad, quad_vec

from sa_solver.half_space.influence import X, Y, Z, rectangle_influence, strip_influence
from sa_solver.types import ElasticPair, Material

RIGID = Material(np.inf, 0.3)
STEEL = Material(200e3, 0.3)
ALUMINIUM = Material(70e3, 0.1)
DISSIMILAR = ElasticPair(STEEL, ALUMINIUM)
ON_RIGID = ElasticPair(RIGID, ALUMINIUM)
PAIRS = [DISSIMILAR, ElasticPair(ALUMINIUM, STEEL), ON_RIGID]
SIMILAR = ElasticPair(STEEL, STEEL)
COMPONENTS = list(itertools.product((X, Y, Z), repeat=2))
CROSS = [(X, Z), (Y, Z), (Z, X), (Z, Y)]
SIZE = (0.8, 0.5)
DATUM = 7.0
POINTS = {
    "centre": (0.0, 0.0),
    "inside": (0.13, -0.21),
    "edge along y": (0.4, 0.1),
    "edge along x": (-0.3, -0.25),
    "corner": (0.4, 0.25),
    "opposite corner": (-0.4, -0.25),
    "on the line of an edge": (0.9, 0.25),
    "next to it": (0.0, 0.6),
    "outside": (-0.7, 1.1),
    "far": (6.0, -9.0),
}


def point_kernel(x, y, body):
    """Return the displacement of the half-space z > 0 under unit forces at the origin.

    The columns are the forces along x, y and z. Johnson 1985, eqs 3.75 (Cerruti) and 3.18
    (Boussinesq), at the surface.
    """
    r, z = np.hypot(x, y), 0.0
    k = 1.0 - 2.0 * body.poisson

    def cerruti(a, b):
        """Return the displacement along the force, across it and along z.

        ``a`` is the coordinate along the force.
        """
        return (
            1.0 / r + a**2 / r**3 + k * (1.0 / (r + z) - a**2 / (r * (r + z) ** 2)),
            a * b / r**3 - k * a * b / (r * (r + z) ** 2),
            a * z / r**3 + k * a / (r * (r + z)),
        )

    along_x, across_x, down_x = cerruti(x, y)
    along_y, across_y, down_y = cerruti(y, x)
    boussinesq = (
        x * z / r**3 - k * x / (r * (r + z)),
        y * z / r**3 - k * y / (r * (r + z)),
        z**2 / r**3 + 2.0 * (1.0 - body.poisson) / r,
    )
    columns = [(along_x, across_x, down_x), (across_y, along_y, down_y), boussinesq]
    return np.array(columns).swapaxes(0, 1) / (4.0 * np.pi * body.shear_modulus)


def line_kernel(x, body):
    """Return the displacement of the half-plane z > 0 under unit line forces at the origin.

    The columns are the forces along x, y and z. Johnson 1985, eqs 2.22 and 2.19; along y antiplane
    shear, where τ = q/(π r) on half circles.
    """
    E, nu = body.young, body.poisson
    logarithm = -2.0 * (1.0 - nu**2) / (np.pi * E) * np.log(abs(x) / DATUM)
    jump = (1.0 - 2.0 * nu) * (1.0 + nu) / (2.0 * E) * np.sign(x)
    antiplane = -np.log(abs(x) / DATUM) / (np.pi * body.shear_modulus)
    return np.array([[logarithm, 0.0, -jump], [0.0, antiplane, 0.0], [jump, 0.0, logarithm]])


def relative(kernel, pair, *point):
    """Return ``u_2 - u_1`` under the tractions on body 2.

    Body 2 is the half-space of the kernel. Body 1 carries the opposite tractions and lies in z < 0:
    the mirror z → -z maps it to the kernel's half-space, and its displacement back.
    """
    mirror = np.array([1.0, 1.0, -1.0])
    signs = (mirror[:, None] * mirror).reshape(3, 3, *[1] * (np.ndim(point[0])))
    return kernel(*point, pair.body_2) + signs * kernel(*point, pair.body_1)


def rectangle(point, pair, size=SIZE):
    """Return all coefficients (3, 3) at ``point`` from the centre of a rectangle."""
    edges = [np.array([c - 0.5 * s, c + 0.5 * s]) for c, s in zip(point, size, strict=True)]
    return np.array(
        [[rectangle_influence(*edges, pair, i, j)[0, 0] for j in range(3)] for i in range(3)]
    )


def strip(x, pair, width, datum=DATUM):
    edges = np.array([x - 0.5 * width, x + 0.5 * width])
    return np.array(
        [[strip_influence(edges, pair, i, j, datum)[0] for j in range(3)] for i in range(3)]
    )


def rectangle_by_quadrature(point, pair):
    """Return the kernel integrated over the rectangle, by its boundary.

    The kernel falls as 1/r. Its integral over the triangle between the point and a piece of the
    boundary is therefore its value on the boundary times twice the area of the triangle.
    """
    corners = np.array(point) + 0.5 * np.array(SIZE) * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    total = np.zeros((3, 3))
    for begin, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        twice_area = begin[0] * end[1] - begin[1] * end[0]
        if abs(twice_area) < 1e-14:
            continue  # The point is on the line of this edge.

        def on_edge(t, begin=begin, end=end):
            return relative(point_kernel, pair, *(begin + t * (end - begin)))

        integral, _ = quad_vec(on_edge, 0.0, 1.0, epsabs=1e-13 * pair.normal, epsrel=1e-12)
        total += twice_area * integral
    return total


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("place", POINTS)
def test_a_rectangle_is_the_integral_of_point_forces(pair, place):
    point = POINTS[place]
    expected = rectangle_by_quadrature(point, pair)
    accuracy = 1e-10 * np.abs(expected).max()
    np.testing.assert_allclose(rectangle(point, pair), expected, rtol=0, atol=accuracy)


@pytest.mark.parametrize("place", ["on the line of an edge", "next to it", "outside", "far"])
def test_outside_the_rectangle_gauss_points_find_the_same(place):
    x, w = np.polynomial.legendre.leggauss(40)
    sources = [c - 0.5 * s * x for c, s in zip(POINTS[place], SIZE, strict=True)]
    kernel = relative(point_kernel, DISSIMILAR, *np.meshgrid(*sources, indexing="ij"))
    expected = 0.25 * np.prod(SIZE) * np.einsum("ijxy,x,y->ij", kernel, w, w)
    accuracy = 1e-9 * np.abs(expected).max()
    coefficients = rectangle(POINTS[place], DISSIMILAR)
    np.testing.assert_allclose(coefficients, expected, rtol=0, atol=accuracy)


def test_centre_of_a_square():
    """∬ 1/r = 4 ln(1+√2) s (Johnson eq. 3.26); x²/r³ and y²/r³ are one half of it each."""
    pair = DISSIMILAR
    integral = 4.0 * np.log(1.0 + np.sqrt(2.0)) * 0.6
    tangential = (pair.shear - 0.5 * pair.poisson) * integral / (2.0 * np.pi)
    expected = np.diag([tangential, tangential, integral / (np.pi * pair.contact_modulus)])
    coefficients = rectangle((0.0, 0.0), pair, (0.6, 0.6))
    np.testing.assert_allclose(coefficients, expected, rtol=1e-14, atol=1e-15 * pair.normal)


def test_far_away_it_is_a_point_force():
    """The rectangle differs by O((size / r)²) of the largest coefficient."""
    coefficients = rectangle((30.0, -40.0), DISSIMILAR, (0.1, 0.2))
    expected = 0.02 * relative(point_kernel, DISSIMILAR, 30.0, -40.0)
    np.testing.assert_allclose(coefficients, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("place", POINTS)
def test_a_rectangle_is_the_sum_of_its_halves(place):
    x, y = POINTS[place]
    width, length = SIZE
    expected = rectangle((x, y), DISSIMILAR)
    across = sum(
        rectangle((x + s * width, y), DISSIMILAR, (0.5 * width, length)) for s in (-0.25, 0.25)
    )
    along = sum(
        rectangle((x, y + s * length), DISSIMILAR, (width, 0.5 * length)) for s in (-0.25, 0.25)
    )
    for halves in (across, along):
        np.testing.assert_allclose(halves, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(("row", "column"), COMPONENTS)
def test_finite_on_corners_and_edges(row, column):
    edges = np.array([-1.0, 0.0, 1.0])
    coefficients = rectangle_influence(edges, edges, DISSIMILAR, row, column)
    shifted = rectangle_influence(edges + 1e-9, edges - 1e-9, DISSIMILAR, row, column)
    assert np.all(np.isfinite(coefficients))
    np.testing.assert_allclose(coefficients, shifted, rtol=0, atol=1e-7 * DISSIMILAR.normal)


def test_a_quarter_turn_exchanges_the_directions():
    """A quarter turn maps x to y and y to -x."""
    x, y = POINTS["outside"]
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = rectangle((-y, x), DISSIMILAR, SIZE[::-1])
    expected = turn @ rectangle((x, y), DISSIMILAR) @ turn.T
    np.testing.assert_allclose(turned, expected, rtol=1e-12, atol=1e-18)


def test_rectangles_between_edges_are_those_taken_one_by_one():
    edges_x, edges_y = np.array([-0.7, -0.1, 0.3, 1.5]), np.array([0.2, 0.4, 1.1])
    for row, column in COMPONENTS:
        together = rectangle_influence(edges_x, edges_y, DISSIMILAR, row, column)
        assert together.shape == (3, 2)
        one = rectangle_influence(edges_x[1:3], edges_y[1:], DISSIMILAR, row, column)
        assert together[1, 1] == pytest.approx(one[0, 0], rel=1e-14)


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("x", [0.0, 0.2, 0.4, -0.4, 0.9, -5.0])
def test_a_strip_is_the_integral_of_line_forces(pair, x):
    """Both bodies are tested; the displacement by a line force is zero at the datum."""
    width = 0.8
    breaks = sorted({x - 0.5 * width, x + 0.5 * width, 0.0 if abs(x) < 0.4 else x + 0.5 * width})
    expected = np.zeros((3, 3))
    for begin, end in itertools.pairwise(breaks):
        for i, j in COMPONENTS:
            expected[i, j] += quad(
                lambda s, i=i, j=j: relative(line_kernel, pair, s)[i, j],
                begin,
                end,
                epsabs=1e-12 * pair.normal,
                epsrel=1e-11,
            )[0]
    accuracy = 1e-10 * np.abs(expected).max()
    np.testing.assert_allclose(strip(x, pair, width), expected, rtol=0, atol=accuracy)


@pytest.mark.parametrize("pair", PAIRS)
def test_a_strip_is_a_very_long_rectangle_up_to_a_rigid_displacement(pair):
    """Differences between two points at mid-length agree; the ends have an effect of x / length."""
    width, length = 0.8, 2e7
    strips = strip(1.7, pair, width) - strip(-0.2, pair, width)
    rectangles = [rectangle((x, 0.0), pair, (width, length)) for x in (1.7, -0.2)]
    accuracy = 1e-7 * np.abs(strips).max()
    np.testing.assert_allclose(strips, rectangles[0] - rectangles[1], rtol=0, atol=accuracy)


def test_a_farther_datum_moves_a_strip_rigidly():
    """The shift is F/π ln(L'/L) times the compliance, at any point."""
    pair, width = DISSIMILAR, 0.8
    compliances = np.diag([pair.normal, pair.shear, pair.normal])
    expected = width * compliances * np.log(3.0) / np.pi
    for x in (0.0, 0.4, 2.5):
        moved = strip(x, pair, width, 3.0 * DATUM) - strip(x, pair, width, DATUM)
        np.testing.assert_allclose(moved, expected, rtol=1e-12, atol=1e-18)


def test_a_strip_is_the_sum_of_its_halves():
    for x in (0.0, 0.4, -1.3):
        halves = strip(x - 0.2, DISSIMILAR, 0.4) + strip(x + 0.2, DISSIMILAR, 0.4)
        np.testing.assert_allclose(halves, strip(x, DISSIMILAR, 0.8), rtol=1e-12, atol=1e-19)


@pytest.mark.parametrize(("row", "column"), CROSS)
def test_pressure_and_shear_of_identical_bodies_ignore_each_other_exactly(row, column):
    edges = np.array([-0.7, -0.1, 0.3, 1.5])
    assert np.array_equal(rectangle_influence(edges, edges, SIMILAR, row, column), np.zeros((3, 3)))
    assert np.array_equal(strip_influence(edges, SIMILAR, row, column, DATUM), np.zeros(3))


@pytest.mark.parametrize(("row", "column"), COMPONENTS)
def test_swapping_the_bodies_changes_the_sign_of_the_cross_terms_alone(row, column):
    swapped = ElasticPair(DISSIMILAR.body_2, DISSIMILAR.body_1)
    edges = np.array([-0.7, -0.1, 0.3, 1.5])
    sign = -1.0 if (row, column) in CROSS else 1.0
    for pair_values in (
        [rectangle_influence(edges, edges, pair, row, column) for pair in (DISSIMILAR, swapped)],
        [strip_influence(edges, pair, row, column, DATUM) for pair in (DISSIMILAR, swapped)],
    ):
        assert np.array_equal(pair_values[0], sign * pair_values[1])


@pytest.mark.parametrize("place", POINTS)
def test_a_rigid_body_adds_nothing(place):
    """Two equal bodies have twice the direct terms of one on a rigid body, which couples too."""
    alone = rectangle(POINTS[place], ON_RIGID)
    both = rectangle(POINTS[place], ElasticPair(ALUMINIUM, ALUMINIUM))
    direct = np.array([[1, 1, 0], [1, 1, 0], [0, 0, 1]])
    np.testing.assert_allclose(both, 2.0 * direct * alone, rtol=1e-14, atol=0)
