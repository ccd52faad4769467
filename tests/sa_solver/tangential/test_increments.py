"""Sums over increments: both orders of summation, the rate of convergence, estimated errors."""

import numpy as np
import pytest

from sa_solver.cycles.increments import (
    before,
    dissipated,
    errors_of_increments,
    mean_of_ends,
    of_nearest,
    slip_of_states,
)
from sa_solver.types import Array

PLACES = np.linspace(0.0, 1.0, 101)
MISSIONS = [slice(0, 3), slice(3, 7)]


def test_a_cycle_begins_where_it_ends() -> None:
    values = np.arange(7.0)
    np.testing.assert_array_equal(before(values, MISSIONS), [2, 0, 1, 6, 3, 4, 5])
    np.testing.assert_array_equal(before(values), [6, 0, 1, 2, 3, 4, 5])


def test_increments_and_states_add_up_to_the_same() -> None:
    """Both sums are the same also where bodies separate, which does not count in either."""
    rng = np.random.default_rng(3)
    pressure, slip = rng.random((2, 7, 5))
    loaded = np.array([1, 1, 0, 1, 1, 1, 1], dtype=bool)
    pressure[~loaded] = 0.0
    by_increment = mean_of_ends(pressure, MISSIONS)[loaded] * slip[loaded]
    by_state = pressure * slip_of_states(slip, loaded, MISSIONS)
    np.testing.assert_allclose(by_state.sum(axis=0), by_increment.sum(axis=0), rtol=1e-14)


def test_work_is_against_the_slip() -> None:
    work = dissipated(np.array([10.0, 5.0]), np.array([[0.3, 0.0], [-0.4, 0.0]]))
    np.testing.assert_allclose(work, [[1.8, 0.0], [3.2, 0.0]], rtol=1e-14)


def cycle(count: int, begins: float = 0.0) -> tuple[Array, Array, Array]:
    """Return pressure, slip and exact Σ p |ds| of places that slide out and back in a cycle.

    The cycle has ``count`` increments. On the way out, t runs from 0 to 1 and a place slides from t
    = ``begins`` times its number on; on the way back it always slides. The pressure is 1 + t² on
    the way out and falls in the same way on the way back.
    """
    half = count // 2
    t = np.linspace(0.0, 1.0, half + 1)[:, None]
    start = begins * PLACES[None]
    out = np.maximum(t - start, 0.0)
    path = np.concatenate([out[1:], out[-1] * (1.0 - t[1:])])
    rising = np.concatenate([1.0 + t[1:] ** 2, 1.0 + (1.0 - t[1:]) ** 2])
    pressure = np.broadcast_to(rising, path.shape)
    slip = np.stack([np.diff(path, axis=0, prepend=path[-1:]), np.zeros_like(path)], axis=1)
    exact = (1.0 - start[0]) + (1.0 - start[0] ** 3) / 3.0 + (1.0 - start[0]) * 4.0 / 3.0
    return pressure, slip, exact


def summed(pressure: Array, slip: Array) -> Array:
    return np.asarray(np.sum(mean_of_ends(pressure) * np.abs(slip[:, 0]), axis=0))


@pytest.mark.parametrize("begins", [0.3, 0.9])
def test_second_order(begins: float) -> None:
    errors = []
    for count in (8, 16, 32, 64):
        pressure, slip, exact = cycle(count, begins)
        errors.append(float(np.mean(summed(pressure, slip) - exact)))
    rates = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
    assert rates.min() > 1.6
    assert rates.mean() > 1.9
    # The pressure at the end alone is of first order, with several times the error.
    at_end = np.sum(pressure * np.abs(slip[:, 0]), axis=0)
    assert abs(np.mean(at_end - exact)) > 5.0 * abs(errors[-1])


@pytest.mark.parametrize("begins", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("count", [8, 16, 64])
def test_the_estimate_is_near_the_error(begins: float, count: int) -> None:
    pressure, slip, exact = cycle(count, begins)
    error = errors_of_increments(pressure, slip, np.ones(count, dtype=bool))
    assert error is not None
    estimate = float(error.sum(axis=0).mean())
    true = float(np.mean(summed(pressure, slip) - exact))
    assert 1.0 / 3.0 < estimate / true < 3.0


@pytest.mark.parametrize("apart", [0.0, 2.0])
def test_slip_that_is_left_when_bodies_part_is_missed(apart: float) -> None:
    """The load is 1 on the way out and falls to 0 in the last increment, in which all slides back.

    Worn bodies have moved ``apart`` where they meet again, without friction.
    """
    count = 5
    pressure = np.ones((count, 3))
    pressure[-1] = 0.0
    slip = np.zeros((count, 2, 3))
    slip[:-1, 0], slip[-1, 0] = 0.25, -1.0 - apart
    slip[0, 0] += apart
    loaded = pressure[:, 0] > 0.0
    error = errors_of_increments(pressure, slip, loaded)
    assert error is not None
    # Pressure that falls linearly over the way back of 1 does work of a half, which is missing. In
    # the first increment the pressure grows from 0, and where the bodies meet is unknown.
    np.testing.assert_allclose(error[-1], -0.5 * (1.0 - 0.25), rtol=1e-12)


def test_increments_that_all_turn_have_no_error_estimate() -> None:
    pressure, slip, _ = cycle(2)
    assert errors_of_increments(pressure, slip, np.ones(2, dtype=bool)) is None


def test_a_few_cells_that_go_one_way_give_no_estimate_for_the_others() -> None:
    """Two increments reverse the slip where most is worn; one cell creeps in one direction."""
    pressure = np.array([[2.0, 3.0, 1.0], [1.0, 2.0, 1.0]])
    slip = np.zeros((2, 2, 3))
    slip[:, 0] = [[1.0, 1.0, 1e-3], [-1.0, -1.0, 1e-3]]
    loaded = np.ones(2, dtype=bool)
    assert errors_of_increments(pressure, slip, loaded) is None
    assert errors_of_increments(pressure[:, 2:], slip[:, :, 2:], loaded) is not None


def test_values_of_the_nearest_cells_keep_symmetry():
    """Around a square of cells many are at the same distance, and no side is preferred."""
    values = np.zeros((8, 8))
    values[2:6, 2:6] = np.array([4.0, 1.0, 1.0, 4.0])[:, None] + [3.0, 2.0, 2.0, 3.0]
    found = of_nearest(values, values > 0.0, (0.1, 0.1))
    np.testing.assert_array_equal(found[2:6, 2:6], values[2:6, 2:6])
    assert found[0, 3] == values[2, 3]
    for mirrored in (found[::-1], found[:, ::-1]):
        np.testing.assert_allclose(mirrored, found, rtol=1e-15)
    plus = np.zeros((5, 5), dtype=bool)
    plus[2, :] = plus[:, 2] = True
    along = np.where(plus, np.arange(5.0)[:, None] - 2.0, 0.0) ** 2
    found = of_nearest(along, plus, (1.0, 1.0))
    np.testing.assert_allclose(found, found[::-1, ::-1], rtol=1e-15)
