"""The linear regime: found where wear is linear, not where it is curved, and extrapolated."""

import numpy as np
import pytest

from wear.kinetics import linear_regime

CYCLES = np.arange(0.0, 11.0) * 1e4


def test_line_is_linear_from_the_start() -> None:
    regime = linear_regime(CYCLES, 3e-9 * CYCLES)
    assert regime is not None
    assert regime.start == 0.0
    assert regime.rate == pytest.approx(3e-9, rel=1e-12)


@pytest.mark.parametrize("bend", [2, 5])
def test_regime_begins_at_the_bend(bend: int) -> None:
    """Fast running-in up to the bend, then a line."""
    values = 3e-9 * CYCLES + 5e-9 * np.minimum(CYCLES, CYCLES[bend])
    regime = linear_regime(CYCLES, values)
    assert regime is not None
    assert regime.start == CYCLES[bend]
    assert regime.rate == pytest.approx(3e-9, rel=1e-9)


def test_regime_begins_where_running_in_has_died_away() -> None:
    """Depth r N + a (1 - exp(-N/N0)): its slope is within 2 % of r once a/N0 exp(-N/N0) is."""
    rate, excess, decay = 1e-9, 2e-9, 1.5e4
    values = rate * CYCLES + excess * decay * (1.0 - np.exp(-CYCLES / decay))
    regime = linear_regime(CYCLES, values)
    assert regime is not None
    begin = decay * np.log(excess / (0.02 * rate))  # 6.9e4 cycles
    assert regime.start == pytest.approx(begin, abs=1.5e4)
    assert regime.rate == pytest.approx(rate, rel=0.02)


@pytest.mark.parametrize("power", [0.5, 2.0])
def test_curve_has_no_regime(power: float) -> None:
    assert linear_regime(CYCLES, 1e-6 * CYCLES**power) is None


def test_too_few_jumps_or_no_wear_are_no_regime() -> None:
    assert linear_regime(CYCLES[:4], 3e-9 * CYCLES[:4]) is None
    assert linear_regime(CYCLES[:1], np.zeros(1)) is None
    assert linear_regime(CYCLES, np.zeros_like(CYCLES)) is None


def test_uneven_jumps_count_by_their_slope() -> None:
    cycles = np.array([0.0, 1e3, 1e4, 1.1e4, 9e4, 1e5])
    regime = linear_regime(cycles, 3e-9 * cycles)
    assert regime is not None
    assert regime.start == 0.0


def test_extrapolation_goes_on_from_the_last_value() -> None:
    values = 3e-9 * CYCLES + 5e-9 * np.minimum(CYCLES, 2e4)
    regime = linear_regime(CYCLES, values)
    assert regime is not None
    beyond = np.array([1e5, 2e5, 1e6])
    np.testing.assert_allclose(regime.extrapolate(beyond), 3e-9 * beyond + 1e-4, rtol=1e-12)
