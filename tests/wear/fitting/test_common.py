"""Parameters common to several tests: fits of each test, and the rate of false alarms."""

import numpy as np
import pytest
from scipy.stats import f, f_oneway

from wear.fitting import VolumeData, VolumeLaw, common_over, fit, volume_problem

ENERGY = np.tile(np.linspace(1e6, 5e6, 6), 3)
TESTS = np.repeat([0, 1, 2], 6)


def volumes(alpha, seed=0, scatter=1e-4):
    """Return volumes of three tests with their own coefficients ``(3,)``."""
    rng = np.random.default_rng(seed)
    return np.asarray(alpha)[TESTS] * ENERGY + scatter * rng.standard_normal(len(ENERGY))


def found(values, offset="none", deviations=None):
    data = VolumeData("both", ENERGY, values, None, deviations)
    return fit(volume_problem([data], VolumeLaw(offset)).problem)


def test_own_values_are_those_of_fits_of_each_test():
    values = volumes([1.0e-9, 1.1e-9, 1.3e-9])
    (common,) = common_over(found(values), TESTS)
    alone = [values[k == TESTS] @ ENERGY[:6] / (ENERGY[:6] @ ENERGY[:6]) for k in range(3)]
    assert common.own == pytest.approx(alone, rel=1e-7)
    assert common.shares == pytest.approx(np.full(3, 1 / 3), rel=1e-7)
    # The full F test: one line through all data against a line for each test.
    one = np.sum((values - found(values).values[0] * ENERGY) ** 2)
    each = np.sum((values - np.array(alone)[TESTS] * ENERGY) ** 2)
    assert common.chance == pytest.approx(f.sf((one - each) / 2 / (each / 15), 2, 15), rel=1e-5)
    assert common.deviations[0] == pytest.approx(
        np.sqrt(each / 15 / np.sum(ENERGY[:6] ** 2)), rel=1e-6
    )


def test_means_of_groups_are_an_analysis_of_variance():
    values = volumes([1e-9, 1e-9, 1e-9]) + 2e-4 * TESTS
    common = {one.name: one for one in common_over(found(values, "intercept"), TESTS)}
    flat = values - found(values, "intercept").values[0] * ENERGY
    # With the same energies in every test, separate intercepts do not change the slope.
    groups = [flat[k == TESTS] for k in range(3)]
    statistic = f_oneway(*groups).statistic
    # The analysis of variance has one more degree of freedom within the tests: that of the slope.
    assert common["both.intercept"].chance == pytest.approx(
        f.sf(statistic * 14 / 15, 2, 14), rel=1e-4
    )


@pytest.mark.parametrize("known", [True, False])
def test_tests_that_agree_are_called_apart_as_often_as_the_level_says(known):
    deviations = np.full(len(ENERGY), 1e-4) if known else None
    chances = np.array(
        [
            common_over(found(volumes([1e-9] * 3, seed), deviations=deviations), TESTS)[0].chance
            for seed in range(80)
        ]
    )
    # Of 80 tests at a level of 20 % it is 16, with a standard deviation of 3.6.
    assert 4 <= np.count_nonzero(chances < 0.2) <= 28
    assert chances.mean() == pytest.approx(0.5, abs=4 * np.sqrt(1 / 12 / 80))


def test_a_test_without_information_has_no_value_of_its_own():
    """A volume at zero energy does not determine the slope."""
    energy = np.array([1e6, 2e6, 4e6, 5e6, 0.0, 0.0])
    data = VolumeData("both", energy, 1e-9 * energy + 1e-5 * np.array([1, -2, 1, 0, 1, -1]))
    result = fit(volume_problem([data], VolumeLaw()).problem)
    (common,) = common_over(result, np.array([0, 0, 1, 1, 2, 2]))
    assert np.isnan(common.own).tolist() == [False, False, True]
    assert common.shares[2] == 0.0
