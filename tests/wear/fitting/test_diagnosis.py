"""Plausibility warnings: bad residuals raise them, good ones do not."""

import numpy as np
import pytest

from wear.fitting import VolumeData, VolumeLaw, diagnose, fit, volume_problem

ENERGY = np.linspace(1e6, 9e6, 24)


def plausibility_warnings_of(volume, deviations=None, files=None):
    problem = volume_problem(
        [VolumeData("both", ENERGY, volume, deviations=deviations)], VolumeLaw()
    ).problem
    return [(caveat.text, caveat.data) for caveat in diagnose(fit(problem), ENERGY, files)]


def noise(seed=0, size=1e-4):
    return size * np.random.default_rng(seed).standard_normal(len(ENERGY))


def test_good_data_are_not_spoken_against():
    files = np.arange(len(ENERGY)) % 3
    spoken = sum(
        len(plausibility_warnings_of(1e-9 * ENERGY + noise(seed), files=files))
        for seed in range(40)
    )
    # Five tests with a rate of one in a thousand each, in 40 fits.
    assert spoken <= 2


def test_two_materials_in_one_table_are_reported_with_their_lines():
    odd = np.arange(len(ENERGY)) % 3 == 0
    ((text, data), *_) = plausibility_warnings_of(np.where(odd, 2.2e-9, 1e-9) * ENERGY + noise())
    assert "two groups" in text
    assert set(data) == set(np.flatnonzero(odd))


def test_an_outlier_is_reported_with_its_line():
    volume = 1e-9 * ENERGY + noise()
    volume[7] += 1e-3
    assert [data for text, data in plausibility_warnings_of(volume) if "outlier" in text] == [(7,)]


def test_a_function_that_does_not_follow_the_data_leaves_waves():
    texts = [text for text, _ in plausibility_warnings_of(1e-9 * ENERGY + 2e-10 * ENERGY**2 / 9e6)]
    assert any("waves" in text for text in texts)


def test_files_that_disagree_are_reported():
    files = np.random.default_rng(5).permutation(np.arange(len(ENERGY)) // 12)
    texts = [
        text
        for text, _ in plausibility_warnings_of(1e-9 * ENERGY + noise() + 3e-4 * files, files=files)
    ]
    assert any("files" in text for text in texts)


def test_scatter_that_grows_is_reported():
    texts = [
        text
        for text, _ in plausibility_warnings_of(
            1e-9 * ENERGY * (1.0 + 0.0 * ENERGY) + noise() * (ENERGY / 3e6) ** 3
        )
    ]
    assert any("grows" in text for text in texts)


@pytest.mark.parametrize(("stated", "spoken"), [(1e-4, 0), (3e-5, 1)])
def test_deviations_that_are_too_small_are_reported(stated, spoken):
    deviations = np.full(len(ENERGY), stated)
    texts = [text for text, _ in plausibility_warnings_of(1e-9 * ENERGY + noise(), deviations)]
    assert sum("as much as their standard deviations" in text for text in texts) == spoken
