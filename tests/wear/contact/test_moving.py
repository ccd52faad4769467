"""Surfaces that pass over each other: conservation, adjointness, closed forms, rates."""

import numpy as np
import pytest

from sa_solver.types import Array, Grid
from wear.contact.moving import (
    Passage,
    TravelError,
    followed,
    moves,
    offsets,
    passages,
    stroke_of,
    ways_of_states,
)

GRID = Grid.covering((4.0, 3.0), (40, 30))
STRAIGHT = (-0.234, 0.0), (0.417, 0.0)
OBLIQUE = (-0.31, 0.22), (0.17, -0.29)
LONG = (-1.03, 0.4), (0.91, 0.4)
STILL = (0.137, -0.061), (0.137, -0.061)
WAYS = [STRAIGHT, OBLIQUE, LONG, STILL]
# Weights are exact except for the rounding of a few dozen additions.
ROUNDING = 1e-13


def scattered(margin: int) -> Array:
    """Return a random field, 0 within ``margin`` cells of the border."""
    field = np.random.default_rng(1).random(GRID.shape)
    field[:margin], field[-margin:], field[:, :margin], field[:, -margin:] = 0.0, 0.0, 0.0, 0.0
    return field


def straight(start: tuple[float, float], end: tuple[float, float], grid: Grid = GRID) -> Passage:
    """Return the path from one offset to another."""
    return Passage(grid, np.array([start, end]))


def reciprocating(stroke: float, each_way: int) -> Array:
    """Return the offsets of a cycle along x."""
    out = np.linspace(-0.5 * stroke, 0.5 * stroke, each_way + 1)
    x = np.concatenate([out, out[-2::-1]])
    return np.stack([x, np.zeros_like(x)], axis=1)


# --- conservation -------------------------------------------------------------------------------


@pytest.mark.parametrize("way", WAYS)
def test_deposit_is_the_adjoint_of_carry(way) -> None:
    passage = straight(*way)
    field, worn = np.random.default_rng(0).random(GRID.shape), scattered(11)
    assert np.vdot(passage.carry(field), worn) == pytest.approx(
        np.vdot(field, passage.deposit(worn)), rel=ROUNDING
    )


@pytest.mark.parametrize("way", WAYS)
def test_deposit_keeps_volume_and_sign(way) -> None:
    worn = scattered(11)
    spread = straight(*way).deposit(worn)
    assert spread.sum() == pytest.approx(worn.sum(), rel=ROUNDING)
    assert spread.min() >= 0.0


@pytest.mark.parametrize("way", WAYS)
def test_a_constant_stays_constant_away_from_the_border(way) -> None:
    seen = straight(*way).carry(np.ones(GRID.shape))
    np.testing.assert_allclose(seen[11:-11, 5:-5], 1.0, rtol=ROUNDING)


@pytest.mark.parametrize("way", WAYS)
def test_a_plane_is_carried_exactly(way) -> None:
    """The mean of a linear field over the path is its value in the middle of the path."""
    passage = straight(*way)
    x, y = (0.5 * (first + last) for first, last in zip(*way, strict=True))
    seen = passage.carry(2.0 * GRID.x - 3.0 * GRID.y + 7.0)
    expected = 2.0 * (GRID.x + x) - 3.0 * (GRID.y + y) + 7.0
    np.testing.assert_allclose(seen[11:-11, 5:-5], expected[11:-11, 5:-5], rtol=ROUNDING)


def test_no_motion_changes_nothing() -> None:
    field = scattered(0)
    still = straight((0.0, 0.0), (0.0, 0.0))
    np.testing.assert_allclose(still.carry(field), field, rtol=ROUNDING)
    np.testing.assert_allclose(still.deposit(field), field, rtol=ROUNDING)


def test_forward_and_backward_paths_are_equal() -> None:
    field = scattered(11)
    there, back = straight(*OBLIQUE), straight(*OBLIQUE[::-1])
    np.testing.assert_allclose(there.carry(field), back.carry(field), atol=ROUNDING)


def test_a_passage_in_two_halves_is_their_mean() -> None:
    field, (start, end) = scattered(11), map(np.array, OBLIQUE)
    middle = tuple(0.3 * start + 0.7 * end)
    parts = straight(OBLIQUE[0], middle), straight(middle, OBLIQUE[1])
    mean = 0.7 * parts[0].deposit(field) + 0.3 * parts[1].deposit(field)
    np.testing.assert_allclose(straight(*OBLIQUE).deposit(field), mean, atol=ROUNDING)


def test_what_leaves_the_grid_is_refused_with_the_remedy() -> None:
    """The wear passes the end by 9 cells of 0.1 mm, or by 10 with a partial cell."""
    field = scattered(1)
    with pytest.raises(TravelError, match=r"10 cells .* along x: .* 2 mm"):
        straight(*LONG).deposit(field)
    with pytest.raises(TravelError, match="along y"):
        straight((0.0, 0.0), (0.0, 0.3)).deposit(field)
    # The motion is longer than the grid.
    with pytest.raises(TravelError, match="along x"):
        straight((0.0, 0.0), (9.0, 0.0)).deposit(field)
    assert not straight((5.0, 0.0), (9.0, 0.0)).carry(field).any()


def test_motion_along_a_line_contact_counts_for_nothing() -> None:
    grid = Grid.line_contact(4.0, 40)
    field = scattered(11)[:, 15:16]
    along, without = straight((0.1, -3.0), (0.3, 2.0), grid), straight((0.1, 0.0), (0.3, 0.0), grid)
    np.testing.assert_array_equal(along.deposit(field), without.deposit(field))


# --- closed forms and rates ---------------------------------------------------------------------


def trapezoid_up_to(x: Array, half_width: float, stroke: float) -> Array:
    """Return the integral up to ``x`` of a box of ``half_width`` a spread over a ``stroke`` s.

    The box, 1 high, convolved with the residence 1/s over [-s/2, s/2] is a trapezoid, half as high
    at ±a, with flanks s wide; its integral consists of second differences of u|u|/2.
    """
    total = np.zeros_like(x)
    for sign_a in (1.0, -1.0):
        for sign_s in (1.0, -1.0):
            u = x + sign_a * half_width + 0.5 * sign_s * stroke
            total += sign_a * sign_s * 0.5 * u * np.abs(u)
    return total / (2.0 * stroke)


@pytest.mark.parametrize("stroke", [0.4, 0.37, 1.9])
@pytest.mark.parametrize("each_way", [1, 3, 8])
def test_a_flat_punch_wears_a_trapezoid_into_the_flat(stroke: float, each_way: int) -> None:
    """Cells of body 1 have exactly the mean of the trapezoid over them.

    The cells of the punch, which ends between cells, wear uniformly.
    """
    grid = Grid.line_contact(4.0, 80)
    half_width = 10 * grid.pitch[0]
    punch = np.where(np.abs(grid.x) < half_width, 1.0, 0.0)
    cycle = passages(grid, ways_of_states(reciprocating(stroke, each_way)))
    assert cycle is not None
    worn = sum(passage.deposit(punch / len(cycle)) for passage in cycle)
    borders = np.append(grid.x - 0.5 * grid.pitch[0], grid.x[-1] + 0.5 * grid.pitch[0])
    expected = np.diff(trapezoid_up_to(borders, half_width, stroke)) / grid.pitch[0]
    np.testing.assert_allclose(worn.ravel(), expected, atol=1e-13)
    # The flat is worn as far as the punch moves, and not beyond.
    reach = half_width + 0.5 * stroke
    assert not worn.ravel()[np.abs(grid.x.ravel()) > reach + 0.5 * grid.pitch[0]].any()


def bump(x: Array, y: Array) -> Array:
    return np.exp(-2.0 * x**2 - 3.0 * y**2 + x * y)


@pytest.mark.parametrize("way", [STRAIGHT, OBLIQUE, LONG])
def test_carrying_is_second_order_in_the_pitch(way) -> None:
    """The reference is the mean of a smooth field over the path by 200 Gauss points."""
    times, weights = np.polynomial.legendre.leggauss(200)
    start, end = map(np.array, way)
    places = start + 0.5 * (times[:, None] + 1.0) * (end - start)
    errors = []
    for count in (40, 80, 160):
        grid = Grid.covering((8.0, 8.0), (count, count))
        exact = sum(
            0.5 * weight * bump(grid.x + x, grid.y + y)
            for weight, (x, y) in zip(weights, places, strict=True)
        )
        seen = straight(*way, grid).carry(bump(grid.x, grid.y))
        errors.append(np.abs(seen - exact).max())
    rates = -np.diff(np.log2(errors))
    assert np.all(rates > 1.8), (errors, rates)


@pytest.mark.parametrize(("pitches", "blur"), [(20.0, 1 / 6), (1.5, 3 / 8 - 9 / 48), (0.5, None)])
def test_cells_blur_by_what_is_stated(pitches: float, blur: float | None) -> None:
    """The second moment of the weights exceeds that of the motion by dx²/6, or by L dx/4 - L²/12.

    A long path that ends between cells in the middle of either has dx²/6 only on average; the paths
    here begin and end on cells. At 1.5 dx blur and motion are equal.
    """
    grid = Grid.line_contact(61.0, 61)
    point = np.zeros(grid.shape)
    point[30] = 1.0
    spread = straight((-0.5 * pitches, 0.0), (0.5 * pitches, 0.0), grid).deposit(point)
    excess = float(np.sum(spread * grid.x**2)) - pitches**2 / 12.0
    expected = pitches / 4.0 - pitches**2 / 12.0 if blur is None else blur
    assert excess == pytest.approx(expected, rel=1e-12)
    if pitches == 1.5:
        assert excess == pytest.approx(pitches**2 / 12.0, rel=1e-12)


# --- the path of a cycle ------------------------------------------------------------------------


def test_offsets_are_those_of_the_weighted_slip_about_the_middle() -> None:
    """The pressed cells slide by 1, 2, -3; the slip of the others does not count."""
    weight = np.zeros(GRID.shape)
    weight[10:20, 5:9] = 7.0
    slip = np.random.default_rng(2).random((3, 2, *GRID.shape))
    slip[:, :, 10:20, 5:9] = np.array([[1.0, 0.0], [2.0, 0.5], [-3.0, -0.5]])[..., None, None]
    path = offsets(slip, weight)
    np.testing.assert_allclose(path[:, 0], [-1.5, -0.5, 1.5, -1.5], atol=1e-14)
    np.testing.assert_allclose(path[:, 1], [-0.25, -0.25, 0.25, -0.25], atol=1e-14)


def test_offsets_of_a_cycle_always_close() -> None:
    slip = np.random.default_rng(3).random((5, 2, *GRID.shape))
    path = offsets(slip, np.ones(GRID.shape))
    np.testing.assert_allclose(path[-1], path[0], atol=1e-14)
    assert not offsets(slip, np.zeros(GRID.shape)).any()


def test_stroke_is_the_longest_distance() -> None:
    stroke, direction = stroke_of(np.array([[0.0, 0.0], [3.0, 4.0], [1.0, 1.0]]))
    assert stroke == 5.0
    np.testing.assert_allclose(np.abs(direction), [0.6, 0.8])
    assert stroke_of(np.zeros((3, 2)))[0] == 0.0


@pytest.mark.parametrize(
    ("stroke", "half_width", "expected"),
    [
        (0.25, 1.0, True),  # 12 % of a contact 2 mm wide
        (0.19, 1.0, False),  # 9.5 %
        (0.14, 0.3, False),  # 23 %, but less than 1.5 cells of 0.1 mm
        (0.16, 0.3, True),
    ],
)
def test_motion_counts_where_it_is_large_and_can_be_resolved(stroke, half_width, expected):
    pressed = np.broadcast_to(np.abs(GRID.x) < half_width, GRID.shape)
    assert moves(reciprocating(stroke, 2), pressed, GRID) is expected


@pytest.mark.parametrize("off", [-1e-12, 0.0, 1e-12])
def test_rounding_does_not_decide_whether_motion_counts(off: float) -> None:
    """A stroke of exactly 1.5 cells is followed, one of exactly a tenth of the width is not."""
    cells, width = (np.abs(GRID.x) < half for half in (0.3, 1.0))
    assert moves(reciprocating(0.15 * (1.0 + off), 2), np.broadcast_to(cells, GRID.shape), GRID)
    tenth = 0.1 * np.count_nonzero(width) * GRID.pitch[0] * (1.0 + off)
    assert not moves(reciprocating(tenth, 2), np.broadcast_to(width, GRID.shape), GRID)


def test_motion_without_contact_does_not_count() -> None:
    assert not moves(reciprocating(1.0, 2), np.zeros(GRID.shape, dtype=bool), GRID)


def test_motion_of_a_line_contact_along_itself_does_not_count() -> None:
    grid = Grid.line_contact(4.0, 40)
    path = reciprocating(1.0, 2)[:, ::-1]
    assert not moves(path, np.ones(grid.shape, dtype=bool), grid)


# --- the passages of a cycle --------------------------------------------------------------------


def sliding(*steps: float) -> Array:
    """Return slip of increments along x that all cells share."""
    slip = np.zeros((len(steps), 2, *GRID.shape))
    slip[:, 0] = np.array(steps)[:, None, None]
    return slip


PRESSURE = np.broadcast_to(np.where(np.abs(GRID.x) < 0.5, 100.0, 0.0), GRID.shape)


def test_passages_follow_the_offsets() -> None:
    passes = passages(GRID, followed(GRID, sliding(0.3, 0.5, -0.8), PRESSURE))
    assert passes is not None
    along = [passage.path[:, 0] for passage in passes]
    expected = [(-0.25, -0.1, 0.15), (0.15, 0.4, 0.0), (0.0, -0.4, -0.25)]
    np.testing.assert_allclose(along, expected, atol=1e-14)


def test_a_path_is_its_legs_by_their_lengths() -> None:
    """On a path forward and half-way back the middle is passed twice."""
    field = np.exp(-((GRID.x - 0.1) ** 2 + GRID.y**2) / 0.3)
    bent = Passage(GRID, np.array([(0.0, 0.0), (0.8, 0.2), (0.4, 0.1)]))
    there, back = straight((0.0, 0.0), (0.8, 0.2)), straight((0.8, 0.2), (0.4, 0.1))
    mean = (2.0 * there.carry(field) + back.carry(field)) / 3.0
    np.testing.assert_allclose(bent.carry(field), mean, atol=ROUNDING)


def test_small_strokes_are_not_followed_unless_forced() -> None:
    small, large = sliding(0.08, -0.08), sliding(0.3, -0.3)
    assert passages(GRID, followed(GRID, small, PRESSURE)) is None
    assert passages(GRID, followed(GRID, large, PRESSURE, forced=False)) is None
    assert len(followed(GRID, small, PRESSURE, forced=True)) == 2


def test_each_block_of_a_mix_closes_by_itself() -> None:
    """If the motion of one cycle matters all are followed, each about its own middle."""
    slip = sliding(0.02, -0.02, 0.4, -0.4)
    places = followed(GRID, slip, PRESSURE, [slice(0, 2), slice(2, 4)])
    np.testing.assert_allclose(places[:, 1, 0], [0.01, -0.01, 0.2, -0.2], atol=1e-14)
    np.testing.assert_allclose(places[:, [0, 2], 0], 0.0, atol=1e-14)
    assert not places[..., 1].any()
