"""What public functions of fits are given: columns of any kind, and what is none."""

import numpy as np
import pytest

from sa_solver import InputError
from tests.given import NO_NUMBERS, assert_refused, held_otherwise, spoilt
from wear.fitting import (
    ComputedScars,
    EvolutionData,
    FitProblem,
    FreeParameter,
    ScarData,
    Series,
    VolumeData,
    VolumeLaw,
    common_over,
    diagnose,
    evolution_problem,
    fit,
    loop_data,
    loop_problem,
    scar_problem,
    volume_problem,
)
from wear.joints import Jenkins, march_joints, measure_loops

ENERGY = 1e6 * np.array([1.0, 2.0, 3.0, 4.0, 6.0, 8.0])
VOLUME = 1e-3 * np.array([1.125, 1.9375, 3.0, 4.125, 5.875, 8.125])
AMPLITUDE = 0.0078125 * np.array([1.0, 2.0, 3.0, 1.0, 2.0, 3.0])
WIDE = np.linspace(-1.0, 1.0, 65)
SCARS = np.stack([np.maximum(b**2 - WIDE**2, 0.0) for b in (0.4, 0.8)])
RUNS = ComputedScars(np.array([1e-9, 8e-9]), WIDE, SCARS)
PLACES = np.linspace(-0.5, 0.5, 9)
DEPTH = 0.3125 - PLACES**2
DATA = 1.0 + np.array([0.125, 0.25, 0.0, 0.5])
FOUND = fit(volume_problem([VolumeData("both", ENERGY, VOLUME)], VolumeLaw()).problem)
MOTION = 0.03 * np.sin(2.0 * np.pi * np.arange(801) / 160)
SLIDER = Jenkins(stiffness=1e4, friction=0.5, normal_load=100.0)
FORCE = march_joints(SLIDER, SLIDER.rest(1), np.zeros((1, 1)), MOTION[:, None, None]).force.ravel()
MEASURED = measure_loops(MOTION, FORCE, 100.0)


def fitted(problem):
    return fit(problem).values


def volumes(energy=ENERGY, volume=VOLUME, law=None, **more):
    law = law or VolumeLaw()
    return fitted(volume_problem([VolumeData("both", energy, volume, **more)], law).problem)


def friction(energy=ENERGY, values=VOLUME, form="linear", **more):
    return fitted(evolution_problem([EvolutionData("µ", energy, values, form, **more)]).problem)


def scars(x=PLACES, depth=DEPTH, runs=RUNS, **more):
    return fitted(scar_problem([ScarData("scan", x, depth, runs, **more)]).problem)


def mean(values=DATA, start=(0.5,), unknown=None, **more):
    series = Series("y", values, **more)
    predict = lambda free: np.full(len(DATA), free[0])  # noqa: E731
    return fitted(FitProblem((unknown or FreeParameter("mean"),), (series,), predict, [start]))


# Of each entry a good field, and the numbers that it makes of it.
ENTRIES = {
    "energy of volumes": (ENERGY, volumes),
    "volumes": (VOLUME, lambda v: volumes(volume=v)),
    "scatter of volumes": (0.1 * VOLUME, lambda d: volumes(deviations=d)),
    "amplitude": (AMPLITUDE, lambda a: volumes(amplitude=a, law=VolumeLaw(exponent=1.0))),
    "law": (ENERGY, lambda e: VolumeLaw().volume(e, None, {"coefficient": 1e-9})),
    "energy of a joint": (ENERGY, friction),
    "values of a joint": (VOLUME, lambda v: friction(values=v)),
    "scatter of a joint": (0.1 * VOLUME, lambda d: friction(deviations=d)),
    "places": (PLACES, scars),
    "depths": (DEPTH, lambda d: scars(depth=d)),
    "scatter of depths": (0.01 + 0.0 * DEPTH, lambda d: scars(deviations=d)),
    "coefficients of runs": (
        np.array([1.0, 8.0]),
        lambda c: ComputedScars(c, WIDE, SCARS).depth_at(PLACES, 2.0),
    ),
    "places of runs": (WIDE, lambda x: ComputedScars([1, 8], x, SCARS).depth_at(PLACES, 2.0)),
    "depths of runs": (SCARS, lambda d: ComputedScars([1, 8], WIDE, d).depth_at(PLACES, 2.0)),
    "depth at": (PLACES, lambda x: RUNS.depth_at(x, 2e-9)),
    "series": (DATA, mean),
    "deviations": (0.25 * DATA, lambda d: mean(deviations=d)),
    "shares": (0.5 * DATA, lambda s: mean(shares=s)),
    "start": (np.array([0.5]), lambda start: mean(start=start)),
    "order": (ENERGY, lambda order: np.array([len(diagnose(FOUND, order))])),
}
EVERY = pytest.mark.parametrize("entry", ENTRIES)


@EVERY
def test_numbers_count_and_not_how_they_are_held(entry):
    """Lists, single precision, every second of an array twice as long, arrays with no mask."""
    field, made = ENTRIES[entry]
    field = field.astype(np.float32).astype(np.float64)
    expected = made(field)
    for given in held_otherwise(field):
        found = made(given)
        assert type(found) is np.ndarray
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-15)


def test_whole_numbers_are_numbers():
    energy, volume = np.arange(1, 7), np.array([2, 3, 7, 9, 10, 13])
    found, expected = (volumes(energy.astype(kind), volume.astype(kind)) for kind in (int, float))
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(mean(np.array([1, 2, 4, 5])), mean([1.0, 2.0, 4.0, 5.0]))


@EVERY
@pytest.mark.parametrize(
    "kind", ["complex", "text", "flags", "none", "masked", "missing", "deep", "short", "one"]
)
def test_what_is_no_column_of_numbers_is_refused(entry, kind):
    field, made = ENTRIES[entry]
    if kind == "none" and entry in (
        *("scatter of volumes", "scatter of a joint", "scatter of depths", "deviations", "shares"),
    ):
        return  # they may be left out
    if entry in ("law", "depth at") and kind in ("deep", "short", "one"):
        return  # of any length
    given = spoilt(field, kind)
    with pytest.raises(InputError):
        made(given)


@pytest.mark.parametrize("value", NO_NUMBERS)
def test_what_is_no_number_is_refused(value):
    attempts = (
        lambda: FreeParameter("k", lower=value),
        lambda: FreeParameter("k", upper=value),
        lambda: FreeParameter("k", size=value),
        lambda: VolumeLaw(exponent=value),
        lambda: VolumeLaw(reference=value),
        lambda: friction(held={"initial": value}),
        lambda: scars(held=value),
        lambda: scars(energy=value),
        lambda: RUNS.depth_at(PLACES, value),
        lambda: loop_data("record", MEASURED, most=value),
        lambda: loop_problem([loop_data("r", MEASURED)], "jenkins", {"stiffness": value}),
    )
    assert_refused(InputError, attempts)


@pytest.mark.parametrize(
    "attempt",
    [
        lambda: FreeParameter("k", lower=2.0, upper=1.0),
        lambda: FreeParameter("rate", lower=-1.0, logarithmic=True),
        lambda: VolumeLaw(offset="treshold"),
        lambda: VolumeLaw(reference=0.0),
        lambda: volume_problem([], VolumeLaw()),
        lambda: volume_problem([VolumeData("both", ENERGY, VOLUME)] * 2, VolumeLaw()),
        lambda: VolumeData("both", ENERGY, VOLUME, amplitude=AMPLITUDE[1:]),
        lambda: evolution_problem([]),
        lambda: evolution_problem([EvolutionData("µ", ENERGY, VOLUME, "linear")] * 2),
        lambda: EvolutionData("µ", ENERGY, VOLUME, "line"),
        lambda: EvolutionData("µ", ENERGY, VOLUME, "linear", {"change": 0.1}),
        lambda: ScarData("scan", PLACES, DEPTH, RUNS, body="body 1"),
        lambda: ComputedScars([1, 8], WIDE, SCARS.T),
        lambda: loop_problem([loop_data("r", MEASURED)], "jenkin", {}),
        lambda: loop_problem([loop_data("r", MEASURED)], "jenkins", {"sigma": 0.5}),
        lambda: loop_problem([], "jenkins", {}),
        lambda: loop_data("r", MEASURED, most=0),
        lambda: mean(start=(0.5, 0.5)),
        lambda: fit(
            FitProblem(
                (FreeParameter("mean"),), (Series("y", DATA),), lambda free: free, [np.zeros(1)]
            )
        ),
        lambda: common_over(FOUND, np.zeros(5, dtype=int)),
        lambda: common_over(FOUND, 0.5 + np.zeros(6)),
        lambda: common_over(FOUND, np.ma.array(np.zeros(6, dtype=int), mask=[True] + 5 * [False])),
        lambda: diagnose(FOUND, ENERGY, np.zeros(5, dtype=int)),
        lambda: diagnose(FOUND, ENERGY, np.full(6, np.nan)),
    ],
)
def test_what_has_no_meaning_is_refused(attempt):
    with pytest.raises(InputError):
        attempt()
