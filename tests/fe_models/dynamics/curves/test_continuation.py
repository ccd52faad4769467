"""Curves with known folds, corners and ends."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from fe_models.dynamics.curves.bordered import Bordered, Preconditioned, solve_alone, solve_bordered
from fe_models.dynamics.curves.continuation import Refinement, follow
from fe_models.dynamics.curves.curve_steps import ContinuationControl, first_point
from fe_models.dynamics.curves.newton import NewtonControl, solve
from fe_models.dynamics.curves.sizes import relative_norm

EXACT = 1e-9


@dataclass(frozen=True)
class Linearised:
    """Equations at one point, with all derivatives computed at once."""

    residual: np.ndarray
    jacobian: object
    slope: np.ndarray
    size: float

    @property
    def relative(self):
        return relative_norm(self.residual, self.size)


@dataclass(frozen=True)
class Marked(Linearised):
    """Linearised equations that also know the position of their peak."""

    peak: float


def scalar(value, by_unknown, by_parameter):
    """Return one equation in one unknown."""

    def equations(unknowns, parameter):
        u = float(unknowns[0])
        return Linearised(
            np.array([value(u, parameter)]),
            np.array([[by_unknown(u, parameter)]]),
            np.array([by_parameter(u, parameter)]),
            1.0 + abs(u),
        )

    return equations


class Products:
    """Matrix known only by its products."""

    def __init__(self, matrix):
        self._matrix, self.was_assembled, self.products = matrix, False, 0

    def __matmul__(self, vector):
        self.products += 1
        return self._matrix @ vector

    def assembled(self):
        self.was_assembled = True
        return self._matrix


class LikeAnother(Products):
    """Matrix known by its products, with the inverse of a similar matrix."""

    def __init__(self, matrix, other):
        super().__init__(matrix)
        self._inverse = np.linalg.inv(other)

    def precondition(self, vector):
        return self._inverse @ vector

    def preconditioned(self, vector):
        return self._inverse @ (self @ vector)


# λ = u³ - 3 u + 5, with folds at u = ∓1, λ = 7 and 3.
S_CURVE = scalar(
    lambda u, p: u**3 - 3.0 * u + 5.0 - p, lambda u, p: 3.0 * u**2 - 3.0, lambda u, p: -1.0
)


def start(equations, guess, parameter, upward=True, step=0.02):
    solution = solve(equations, np.array([guess]), parameter)
    assert solution.converged
    return first_point(solution, parameter, upward, step)


def test_newton_ends_at_the_solution_or_reports_failure():
    solution = solve(S_CURVE, np.array([-3.0]), 1.0)
    assert solution.converged
    assert solution.unknowns[0] ** 3 - 3.0 * solution.unknowns[0] == pytest.approx(-4.0, abs=EXACT)
    lost = solve(
        scalar(lambda u, p: u * u + p, lambda u, p: 2.0 * u, lambda u, p: 1.0),
        np.array([1.0]),
        1.0,
        NewtonControl(max_iterations=8),
    )
    assert not lost.converged
    assert "start from a solution nearby" in lost.message


@pytest.mark.parametrize("upward", [True, False])
def test_both_folds_are_passed_both_ways(upward):
    first = start(S_CURVE, -3.0 if upward else 3.0, 1.0 if upward else 9.0, upward)
    curve = follow(S_CURVE, first, (0.5, 9.5))
    assert curve.message == ""
    assert curve.parameters[-1] == (9.5 if upward else 0.5)
    places = np.array([point.unknowns[0] for point in curve.points])
    np.testing.assert_allclose(places**3 - 3.0 * places + 5.0, curve.parameters, atol=EXACT)
    assert np.all(np.diff(places) * (1 if upward else -1) > 0.0)
    at_folds = [places[i - 1 : i + 1] for i in curve.folds]
    assert len(at_folds) == 2
    for pair, fold in zip(at_folds, (-1.0, 1.0) if upward else (1.0, -1.0), strict=True):
        assert pair.min() < fold + 0.3
        assert pair.max() > fold - 0.3


def test_every_point_is_reported():
    reported = []
    control = ContinuationControl(watch=reported.append)
    curve = follow(S_CURVE, start(S_CURVE, -3.0, 1.0), (0.5, 9.5), control)
    assert reported == curve.parameters.tolist()


def test_a_curve_can_be_resumed_from_any_point():
    whole = follow(S_CURVE, start(S_CURVE, -3.0, 1.0), (0.5, 9.5))
    middle = whole.points[len(whole.points) // 2]
    rest = follow(S_CURVE, middle, (0.5, 9.5))
    assert rest.parameters[-1] == 9.5
    assert len(rest.folds) == sum(i > len(whole.points) // 2 for i in whole.folds)
    again = np.array([point.unknowns[0] for point in rest.points])
    np.testing.assert_allclose(again**3 - 3.0 * again + 5.0, rest.parameters, atol=EXACT)
    assert np.all(np.diff(again, prepend=middle.unknowns) > 0.0)


def test_a_closed_curve_ends_by_the_number_of_points():
    circle = scalar(
        lambda u, p: u * u + (p - 2.0) ** 2 - 1.0,
        lambda u, p: 2.0 * u,
        lambda u, p: 2.0 * (p - 2.0),
    )
    curve = follow(circle, start(circle, 1.0, 2.0), (0.0, 4.0), ContinuationControl(max_points=200))
    assert "200 points" in curve.message
    assert len(curve.folds) >= 4
    places = np.array([point.unknowns[0] for point in curve.points])
    np.testing.assert_allclose(np.hypot(places, curve.parameters - 2.0), 1.0, atol=1e-8)


@pytest.mark.parametrize("beyond", [0.2, 30.0, -1.5])
def test_corners_are_passed(beyond):
    """At λ = 2 the slope changes, even in sign: there the curve turns back."""

    def value(u, p):
        return p - (1.0 + u if u < 1.0 else 2.0 + beyond * (u - 1.0))

    corner = scalar(value, lambda u, p: -1.0 if u < 1.0 else -beyond, lambda u, p: 1.0)
    curve = follow(corner, start(corner, 0.5, 1.5), (0.5, 3.0))
    assert curve.message == ""
    assert curve.parameters[-1] == (3.0 if beyond > 0.0 else 0.5)
    assert curve.points[-1].unknowns[0] == pytest.approx(
        1.0 + (curve.parameters[-1] - 2.0) / beyond, abs=EXACT
    )


def test_a_narrow_peak_is_not_jumped_over():
    """Near a resonance of damping ratio 1e-4, amplitude and phase change within 1e-4 of λ."""

    def equations(unknowns, parameter):
        z = 1.0 - parameter**2
        c = 2e-4 * parameter
        matrix = np.array([[z, c], [-c, z]])
        slope = np.array([[-2.0 * parameter, 2e-4], [-2e-4, -2.0 * parameter]]) @ unknowns
        residual = matrix @ unknowns - np.array([1.0, 0.0])
        return Linearised(residual, matrix, slope, 1.0 + np.linalg.norm(unknowns))

    solution = solve(equations, np.zeros(2), 0.5)
    curve = follow(equations, first_point(solution, 0.5, True, 0.02), (0.5, 2.0))
    assert curve.message == ""
    assert curve.folds == ()
    largest = max(float(np.linalg.norm(point.unknowns)) for point in curve.points)
    assert largest > 0.99 * 5000.0
    assert len(curve.points) < 150


def test_a_curve_reports_where_it_ends():
    """The equation has no solution beyond λ = 1."""

    def root(u, p):
        return u - 1.0 - (np.sqrt(1.0 - p) if p <= 1.0 else np.nan) - 0.5 * p

    def slope(u, p):
        return 0.5 / np.sqrt(1.0 - p) - 0.5 if p < 1.0 else np.inf

    ending = scalar(root, lambda u, p: 1.0, slope)
    curve = follow(ending, start(ending, 2.0, 0.5), (0.0, 2.0))
    assert "the curve ends at " in curve.message
    assert "continue from another point" in curve.message
    assert curve.parameters.max() == pytest.approx(1.0, abs=1e-2)


def peak(place):
    """Return a resonance: a peak of 100 at λ = ``place``, without a fold."""
    return scalar(
        lambda u, p: u - 1.0 / ((p - place) ** 2 + 0.01),
        lambda u, p: 1.0,
        lambda u, p: 2.0 * (p - place) / ((p - place) ** 2 + 0.01) ** 2,
    )


@pytest.mark.parametrize("place", [5.1, 5.3, 5.6])
@pytest.mark.parametrize("refined", [5.02, 5.1, 5.2])
def test_finer_equations_with_their_peak_elsewhere_do_not_turn_the_curve_round(place, refined):
    """Beyond the coarse peak the unknown falls, while it still rises with the refined equations."""

    class Finer:
        def describe(self, point, at):
            return at.peak == 5.0 and point.parameter > refined

        def take(self, beyond):
            return Refinement(marked(place), lambda unknowns: unknowns) if beyond else None

    def marked(place):
        def equations(unknowns, parameter):
            at = peak(place)(unknowns, parameter)
            return Marked(at.residual, at.jacobian, at.slope, at.size, place)

        return equations

    curve = follow(marked(5.0), start(marked(5.0), 0.1, 1.0), (1.0, 9.0), None, Finer(), end=9.0)
    assert curve.message == ""
    assert curve.points[-1].parameter == 9.0
    assert curve.folds == ()
    assert max(point.unknowns[0] for point in curve.points) > 80.0


@pytest.mark.parametrize("end", [0.5, 9.5])
def test_a_curve_that_leaves_by_the_wrong_end_is_reported(end):
    """The curve λ = 3 + u² falls to its fold at 3 and rises again."""
    parabola = scalar(lambda u, p: u * u + 3.0 - p, lambda u, p: 2.0 * u, lambda u, p: -1.0)
    first = start(parabola, 2.0, 7.0, upward=False)
    curve = follow(parabola, first, (0.5, 9.5), end=end)
    assert curve.points[-1].parameter == 9.5
    reported = "turns back at 3" in curve.message and "does not reach 0.5" in curve.message
    assert reported == (end == 0.5)
    assert (curve.message == "") == (end == 9.5)


def test_finer_equations_take_over_on_the_way():
    """From λ = 3 on the equations have a second unknown, the square of the first."""
    coarse = scalar(lambda u, p: u - p, lambda u, p: 1.0, lambda u, p: -1.0)

    def fine(unknowns, parameter):
        u, v = unknowns
        return Linearised(
            np.array([u - parameter, v - u * u]),
            np.array([[1.0, 0.0], [-2.0 * u, 1.0]]),
            np.array([-1.0, 0.0]),
            1.0 + abs(u) + abs(v),
        )

    class Finer:
        def describe(self, point, at):
            return len(point.unknowns) == 1 and point.parameter > 3.0

        def take(self, beyond):
            return Refinement(fine, lambda unknowns: np.append(unknowns, 0.0)) if beyond else None

    curve = follow(coarse, start(coarse, 1.0, 1.0), (0.0, 9.0), None, Finer())
    assert curve.message == ""
    assert {len(point.unknowns) for point in curve.points} == {1, 2}
    for point in curve.points:
        assert len(point.unknowns) == 2 or point.parameter <= 3.0
    np.testing.assert_allclose(curve.points[-1].unknowns, [9.0, 81.0], rtol=EXACT)


def test_a_step_is_never_shorter_than_asked():
    first = replace(start(S_CURVE, -3.0, 1.0), step=10.0)
    curve = follow(S_CURVE, first, (0.5, 9.5), ContinuationControl(most=0.05))
    assert curve.message == ""
    assert all(1e-6 <= point.step <= 0.05 for point in curve.points)


@pytest.mark.parametrize("compact", [True, False])
def test_bordered_systems_by_products_are_those_of_the_matrix(compact):
    """GMRES solves 1 plus a compact matrix; a noise matrix of 200 unknowns has to be assembled."""
    rng = np.random.default_rng(1)
    noise = rng.standard_normal((200, 200))
    matrix = np.eye(200) + noise[:, :5] @ noise[:5] if compact else noise
    column, row, wanted = noise[0], noise[1], rng.standard_normal((201, 2))
    bordered = np.block([[matrix, column[:, None]], [np.append(row, 0.5)]])
    products = Products(matrix)
    solution, _ = solve_bordered(products, column, np.append(row, 0.5), wanted)
    assert products.was_assembled != compact
    assert np.linalg.norm(bordered @ solution - wanted) <= 1e-5 * np.linalg.norm(wanted)
    exact, sign = solve_bordered(matrix, column, np.append(row, 0.5), wanted)
    np.testing.assert_allclose(exact, np.linalg.solve(bordered, wanted), atol=1e-9)
    assert sign == np.linalg.slogdet(bordered)[0]
    alone = solve_alone(Products(matrix), wanted[:-1, 0])
    assert np.linalg.norm(matrix @ alone - wanted[:-1, 0]) <= 1e-5 * np.linalg.norm(wanted[:, 0])


def test_the_inverse_of_a_similar_matrix_saves_products():
    """The matrices differ in rank 2; the border makes it rank 4 at most."""
    rng = np.random.default_rng(2)
    noise = rng.standard_normal((200, 200))
    other = noise + 40.0 * np.eye(200)
    matrix = other + noise[:, :2] @ noise[:2]
    column, row, wanted = noise[0], rng.standard_normal(201), rng.standard_normal(201)
    exact, sign = solve_bordered(matrix, column, row, wanted[:, None])
    alike, alone = LikeAnother(matrix, other), Products(matrix)
    assert isinstance(alike, Preconditioned)
    for products in (alike, alone):
        solution = Bordered(products, column, row).solve(wanted, 1e-9)
        np.testing.assert_allclose(solution, exact[:, 0], atol=1e-7 * np.abs(exact).max())
        assert not products.was_assembled
    assert alike.products <= 8 < 20 < alone.products
    solution = solve_alone(alike, wanted[:-1], 1e-9)
    np.testing.assert_allclose(solution, np.linalg.solve(matrix, wanted[:-1]), atol=1e-7)
    assert Bordered(matrix, column, row).sign == sign


def test_a_useless_preconditioner_is_not_used():
    """A preconditioner that loses a direction never leads to a solution along it."""
    rng = np.random.default_rng(4)
    noise, wanted = rng.standard_normal((200, 2)), rng.standard_normal(200)
    products = LikeAnother(np.eye(200) + noise @ noise.T, np.eye(200))
    products._inverse[3, 3] = 0.0
    solution = solve_alone(products, wanted, 1e-9)
    assert not products.was_assembled
    np.testing.assert_allclose(products @ solution, wanted, atol=1e-7)


def test_a_singular_matrix_gives_the_smallest_solution():
    """No equation contains the second unknown."""
    singular = np.array([[2.0, 0.0], [0.0, 0.0]])
    np.testing.assert_allclose(solve_alone(singular, np.array([4.0, 0.0])), [2.0, 0.0], atol=EXACT)
    system = Bordered(singular, np.array([1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(system.solve(np.array([4.0, 0.0, 1.0])), [1.5, 0.0, 1.0], atol=EXACT)
    assert system.sign == 0


def test_a_looser_tolerance_needs_fewer_products():
    rng = np.random.default_rng(3)
    products = Products(np.eye(200) + 0.03 * rng.standard_normal((200, 200)))
    wanted, counts = rng.standard_normal(200), []
    for left in (1e-2, 1e-6):
        products.products = 0
        solution = solve_alone(products, wanted, left)
        assert np.linalg.norm(products @ solution - wanted) <= 1.01 * left * np.linalg.norm(wanted)
        counts.append(products.products)
    assert 2 * counts[0] < counts[1]


def test_newton_stops_where_it_makes_no_progress():
    """The iteration alternates between two slopes."""
    counted = [0]

    def value(u, p):
        counted[0] += 1
        return np.sign(u) * np.sqrt(abs(u)) + 0.0 * p

    # The slope of the root leads from u to -u.
    to_and_fro = scalar(value, lambda u, p: 0.5 / np.sqrt(abs(u)), lambda u, p: 0.0)
    for patience, most in ((None, 30), (3, 5)):
        counted[0] = 0
        lost = solve(
            to_and_fro,
            np.array([1.0]),
            1.0,
            NewtonControl(max_iterations=30, max_shortened=0, patience=patience),
        )
        assert not lost.converged
        assert counted[0] <= most + 1
