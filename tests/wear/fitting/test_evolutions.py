"""Wear functions fitted to the tables of two papers, with valid bounds."""

import numpy as np
import pytest
from scipy.stats import binom

from wear.fitting import EvolutionData, FitError, diagnose, evolution_problem, fit

# Fantetti et al. 2019, table 4.2; energies in N mm, the slope of kp per kJ.
FANTETTI = {
    "friction.initial": 0.11,
    "friction.change": 0.26,
    "friction.rate": 1.3e6,
    "stiffness.initial": 27.3e3,
    "stiffness.change": 1.32,
    "stiffness.scale": 150e3,
    "residual_stiffness.initial": 0.88e3,
    "residual_stiffness.slope": 0.24e-6,
}
# Li et al. 2020, tables A1 and A2.
RATES = {"rate": 0.3e-6, "second_rate": 5e-6}
LI = {
    "test 2": {
        "normal_load.initial": 710.0,
        "normal_load.final": 0.72,
        "stiffness.initial": 105e3,
        "stiffness.final": 1.71,
        "stiffness.share": 0.4,
        "friction.initial": 0.30,
        "friction.final": 1.16,
        "friction.share": 0.2,
        **RATES,
    },
    "test 4": {
        "normal_load.initial": 745.0,
        "normal_load.final": 0.72,
        "stiffness.initial": 115e3,
        "stiffness.final": 1.31,
        "stiffness.share": 0.8,
        "friction.initial": 0.34,
        "friction.final": 1.12,
        "friction.share": 0.5,
        **RATES,
    },
}
SINGLE = {"share": 1.0, "second_rate": 0.0}


def fantetti_table(energy, scatter=0.0, rng=None):
    """Return the three functions at an energy, with a ``scatter`` relative to initial values."""
    with np.errstate(divide="ignore"):
        stiffness = 27.3e3 * (1.0 + 1.32 * np.exp(-150e3 / energy))
    tables = {
        "friction": (0.11 * (1.0 + 0.26 * np.log(1.0 + 1.3e6 * energy)), "logarithmic"),
        "stiffness": (stiffness, "arrhenius"),
        "residual_stiffness": (880.0 * (1.0 + 0.24e-6 * energy), "linear"),
    }
    return [
        EvolutionData(name, energy, noisy(values, scatter, rng), form)
        for name, (values, form) in tables.items()
    ]


def li_table(printed, energy, scatter=0.0, rng=None):
    """Return the three functions of the paper at an energy."""
    first, second = (np.exp(-rate * energy) for rate in RATES.values())
    data = []
    for name in ("normal_load", "stiffness", "friction"):
        share = printed.get(f"{name}.share", 1.0)
        decay = share * first + (1.0 - share) * second
        final = printed[f"{name}.final"]
        values = printed[f"{name}.initial"] * (final + (1.0 - final) * decay)
        held = SINGLE if name == "normal_load" else {}
        data.append(EvolutionData(name, energy, noisy(values, scatter, rng), "exponential", held))
    return data


def noisy(values, scatter, rng):
    if not scatter:
        return values
    return values + scatter * values[0] * rng.standard_normal(len(values))


def found_in(data, shared=()):
    return {one.name: one for one in fit(evolution_problem(data, shared).problem).estimates}


def test_fantetti_s_parameters_come_back():
    energy = np.concatenate([[0.0], np.geomspace(1e2, 2.8e6, 30)])
    found = found_in(fantetti_table(energy))
    assert found.keys() == FANTETTI.keys()
    for name, value in FANTETTI.items():
        assert found[name].value == pytest.approx(value, rel=1e-6), name
        assert found[name].determined


@pytest.mark.parametrize("test", LI)
def test_li_s_parameters_come_back(test):
    found = found_in(li_table(LI[test], np.linspace(0.0, 8.4e6, 40)), ["rate", "second_rate"])
    assert found.keys() == LI[test].keys()
    for name, value in LI[test].items():
        assert found[name].value == pytest.approx(value, rel=1e-6), name
        assert found[name].determined


def test_without_an_unworn_loop_the_logarithm_is_not_determined():
    """From 0.1 J on ln(1 + b E) is ln b + ln E: two numbers for three parameters."""
    energy = np.geomspace(1e2, 2.8e6, 40)
    (data, *_) = fantetti_table(energy, 0.05, np.random.default_rng(0))
    assert not any(one.determined for one in found_in([data]).values())
    # The printed initial value, that of an unworn loop, determines both other parameters.
    (data, *_) = fantetti_table(energy, 0.01, np.random.default_rng(0))
    held = EvolutionData("friction", energy, data.values, "logarithmic", {"initial": 0.11})
    found = found_in([held])
    assert all(one.determined for one in found.values())
    for name, one in found.items():
        assert one.bounds[0] < FANTETTI[name] < one.bounds[1]


def test_a_rate_of_no_change_is_not_determined():
    rng = np.random.default_rng(1)
    energy = np.linspace(0.0, 1e6, 30)
    flat = EvolutionData("stiffness", energy, 30e3 + 200.0 * rng.standard_normal(30), "arrhenius")
    found = found_in([flat])
    assert not found["stiffness.scale"].determined


def test_held_parameters_stay_and_nonsense_is_refused():
    energy = np.linspace(0.0, 8.4e6, 20)
    preload, *_ = li_table(LI["test 4"], energy)
    held = EvolutionData(
        "normal_load", energy, preload.values, "exponential", {**SINGLE, "final": 0.72}
    )
    assert found_in([held]).keys() == {"normal_load.initial", "normal_load.rate"}
    with pytest.raises(FitError, match="energy below 0"):
        evolution_problem([EvolutionData("kt", energy - 1.0, energy, "linear")])
    with pytest.raises(FitError, match="no energy above 0"):
        evolution_problem([EvolutionData("kt", 0.0 * energy, energy, "linear")])
    with pytest.raises(FitError, match="shared, but not free in any data"):
        evolution_problem([held], ["second_rate"])


@pytest.mark.slow
@pytest.mark.parametrize("paper", ["Fantetti", "test 4"])
def test_true_parameters_are_within_their_bounds_in_95_of_100_trials(paper):
    trials, hits, plausibility_warnings = 100, {}, 0
    truth = FANTETTI if paper == "Fantetti" else LI[paper]
    low, high = binom.interval(0.9999, trials, 0.95)
    for trial in range(trials):
        rng = np.random.default_rng(trial)
        if paper == "Fantetti":
            energy = np.concatenate([np.zeros(5), np.geomspace(1e2, 2.8e6, 30)])
            problem = evolution_problem(fantetti_table(energy, 0.01, rng)).problem
        else:
            energy = np.linspace(0.0, 8.4e6, 30)
            table = li_table(truth, energy, 0.003, rng)
            problem = evolution_problem(table, ["rate", "second_rate"]).problem
        found = fit(problem)
        plausibility_warnings += len(diagnose(found, np.tile(energy, 3)))
        for one in found.estimates:
            within = one.bounds[0] <= truth[one.name] <= one.bounds[1]
            hits[one.name] = hits.get(one.name, 0) + within
    assert hits.keys() == truth.keys()
    assert all(low <= count <= high for count in hits.values()), hits
    # Four tests of three series with a rate of one in a thousand each.
    assert plausibility_warnings <= 5
