"""The linear regime: found where wear is linear, not where it is curved, and extrapolated."""

from typing import cast

import numpy as np
import pytest

from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.types import Array, ElasticPair, Grid, Material
from wear.kinetics import LATEST_START, LinearRegime, linear_regime

CYCLES = np.arange(0.0, 11.0) * 1e4

# A two-dimensional crowned pad that wears to a flat one, with the same slip everywhere.
BODY = Material(120e3, 0.0)
WIDTH, CROWN, LOAD = 4.0, 1000.0, 100.0  # mm, mm, N/mm
WEAR = 8e-11  # depth per pressure and cycle [mm/MPa]
GRID = Grid.line_contact(WIDTH, 48)


def depths_of_pad(cycles: Array) -> Array:
    """Return the largest depth [mm] at ``cycles``, worn in implicit jumps from each to the next."""
    contact = NormalContact(HalfSpace(GRID, ElasticPair(BODY, BODY)))
    worn, depths, start = np.zeros(GRID.shape), [0.0], None
    for jump in np.diff(cycles):
        state = contact.solve(
            GRID.x**2 / (2.0 * CROWN) + worn,
            LOAD,
            None,
            0.0,
            tolerance=1e-9,
            start=start,
            compliance=np.full(GRID.shape, WEAR * jump),
        )
        assert state.converged
        worn, start = worn + WEAR * jump * state.pressure, state.start
        depths.append(float(worn.max()))
    return np.array(depths)


def jumps(kind: str, cycles: float) -> Array:
    """Return numbers of cycles from 0 to ``cycles``."""
    if kind == "equal":
        return np.linspace(0.0, cycles, 41)
    if kind == "growing":
        return np.append(0.0, cycles * 1.3 ** -np.arange(24.0, -1.0, -1.0))
    inside = np.random.default_rng(1).random(40) * cycles
    return np.sort(np.append(inside, [0.0, cycles]))


def regime_of(cycles: Array, values: Array) -> LinearRegime:
    regime = linear_regime(cycles, values)
    assert regime is not None
    return regime


# --- where it begins ----------------------------------------------------------------------------


def test_line_is_linear_from_the_start() -> None:
    regime = regime_of(CYCLES, 3e-9 * CYCLES)
    assert regime.start == 0.0
    assert regime.rate == pytest.approx(3e-9, rel=1e-12)
    assert regime.uncertainty(np.array([1e6])) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("bend", [2, 5])
def test_regime_begins_at_the_bend(bend: int) -> None:
    """After fast running-in up to a bend, growth is linear."""
    values = 3e-9 * CYCLES + 5e-9 * np.minimum(CYCLES, CYCLES[bend])
    regime = regime_of(CYCLES, values)
    assert regime.start == CYCLES[bend]
    assert regime.rate == pytest.approx(3e-9, rel=1e-9)


def test_regime_begins_where_running_in_has_died_away() -> None:
    """The rate of r N + a N0 (1 - exp(-N/N0)) is within 2 % of r once a/r exp(-N/N0) is."""
    cycles = np.linspace(0.0, 3e5, 61)
    rate, excess, decay = 1e-9, 2e-9, 1.5e4
    values = rate * cycles + excess * decay * (1.0 - np.exp(-cycles / decay))
    regime = regime_of(cycles, values)
    begin = decay * np.log(excess / (0.02 * rate))  # 6.9e4 cycles
    assert regime.start == pytest.approx(begin, abs=1.5e4)
    assert regime.rate == pytest.approx(rate, rel=0.02)


def test_a_line_in_the_last_third_is_not_enough() -> None:
    values = 3e-9 * CYCLES + 5e-9 * np.minimum(CYCLES, 7e4)
    assert linear_regime(CYCLES, values) is None


@pytest.mark.parametrize("power", [0.5, 0.9, 1.1, 2.0])
@pytest.mark.parametrize("kind", ["equal", "growing", "random"])
def test_curve_has_no_regime(power: float, kind: str) -> None:
    cycles = jumps(kind, 1e5)
    assert linear_regime(cycles, 1e-6 * cycles**power) is None


def test_a_curve_seen_closely_at_its_end_has_no_regime() -> None:
    """Many short jumps at the end do not make a regime: any smooth curve is straight over them."""
    cycles = np.append(jumps("equal", 1e5), np.linspace(1.0001e5, 1.01e5, 20))
    assert linear_regime(cycles, np.sqrt(cycles)) is None


def test_one_long_jump_is_no_evidence() -> None:
    """The course within a long jump is unknown, however many short jumps lie next to it."""
    cycles = np.append(np.linspace(0.0, 1e3, 11), [9e4, 1e5])
    assert linear_regime(cycles, 3e-9 * cycles) is None


def test_too_few_jumps_or_no_wear_are_no_regime() -> None:
    assert linear_regime(CYCLES[:4], 3e-9 * CYCLES[:4]) is None
    assert linear_regime(CYCLES[:1], np.zeros(1)) is None
    assert linear_regime(CYCLES, np.zeros_like(CYCLES)) is None


@pytest.mark.parametrize("kind", ["growing", "random"])
def test_uneven_jumps_count_by_their_slope(kind: str) -> None:
    cycles = jumps(kind, 1e5)
    regime = regime_of(cycles, 3e-9 * cycles)
    assert regime.start == 0.0
    assert regime.rate == pytest.approx(3e-9, rel=1e-12)


def test_noise_of_the_solver_does_not_count_in_a_jump_of_one_cycle() -> None:
    """The slope of a jump of one cycle is all noise: 1e-6 of the depth in 1e-5 of the cycles."""
    noise = 3e-4 * 1e-6 * np.random.default_rng(2).standard_normal(13)
    cycles = np.append(CYCLES, [1e5 + 1.0, 1e5 + 2.0])
    regime = regime_of(cycles, 3e-9 * cycles + noise)
    assert regime.start == 0.0
    assert regime.rate == pytest.approx(3e-9, rel=1e-5)


# --- how far it reaches -------------------------------------------------------------------------


def test_extrapolation_goes_on_from_the_last_value() -> None:
    values = 3e-9 * CYCLES + 5e-9 * np.minimum(CYCLES, 2e4)
    beyond = np.array([1e5, 2e5, 1e6])
    expected = 3e-9 * beyond + 1e-4
    np.testing.assert_allclose(regime_of(CYCLES, values).extrapolate(beyond), expected, rtol=1e-12)


def test_bound_of_a_rate_that_drifts_evenly_is_exact() -> None:
    """For the slope r + b N the bound is the whole difference, over any jumps."""
    beyond = np.linspace(1e5, 4e5, 7)
    for kind in ("equal", "growing", "random"):
        cycles = jumps(kind, 1e5)
        values, expected = (1e-9 * n * (1.0 - 1e-7 * n) for n in (cycles, beyond))
        regime = regime_of(cycles, values)
        missed = regime.extrapolate(beyond) - expected
        np.testing.assert_allclose(regime.uncertainty(beyond), missed, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("power", [0.96, 0.99, 1.01, 1.04])
def test_bound_covers_curves_that_pass_for_linear(power: float) -> None:
    cycles, beyond = jumps("equal", 1e5), np.linspace(1e5, 1e6, 10)[1:]
    regime = regime_of(cycles, 1e-9 * cycles**power)
    missed = np.abs(1e-9 * beyond**power - regime.extrapolate(beyond))
    assert np.all(missed <= regime.uncertainty(beyond))


def test_bound_grows_from_nothing() -> None:
    regime = LinearRegime(0.0, 1e-9, 1e5, 1e-4, trend=-1e-16, scatter=1e-11)
    bound = regime.uncertainty(np.array([1e5, 2e5, 3e5]))
    assert bound[0] == 0.0
    assert bound[1] == pytest.approx(1e-16 * 1e5 * 1e5 + 1e-11 * 1e5)
    assert bound[2] > 2.0 * bound[1]


# --- against computed wear ----------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["equal", "growing", "random"])
def test_extrapolation_agrees_with_the_computed_continuation(kind: str) -> None:
    """A pad is run in for 4e6 cycles, then computed to three times that.

    Its rate tends to w P/width. The bound covers the difference everywhere, and is itself within
    3 % of the depth.
    """
    cycles = jumps(kind, 4e6)
    further = np.linspace(4e6, 12e6, 41)[1:]
    depths = depths_of_pad(np.append(cycles, further))
    computed, continued = depths[: len(cycles)], depths[len(cycles) :]
    regime = regime_of(cycles, computed)
    assert 0.0 < regime.start <= LATEST_START * 4e6
    assert regime.rate == pytest.approx(WEAR * LOAD / WIDTH, rel=0.01)
    missed = np.abs(regime.extrapolate(further) - continued)
    assert np.all(missed <= regime.uncertainty(further))
    assert float(regime.uncertainty(further)[-1]) < 0.03 * continued[-1]


@pytest.mark.parametrize("kind", ["equal", "growing", "random"])
def test_pad_that_still_runs_in_has_no_regime(kind: str) -> None:
    """After 4e5 cycles the depth of a pad still grows by over 1.2 times its final rate."""
    cycles = jumps(kind, 4e5)
    depths = depths_of_pad(cycles)
    assert linear_regime(cycles, depths) is None
    last = cast(float, (depths[-1] - depths[-2]) / (cycles[-1] - cycles[-2]))
    assert last > 1.2 * WEAR * LOAD / WIDTH
