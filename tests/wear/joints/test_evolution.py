"""Wear functions of energy: their forms, the papers' values, and their effect on a law."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from sa_solver.types import Array
from tests.wear.joints.papers import BOLTED, KJ, RIG, RIG_EVOLUTION, J
from wear.joints.evolution import (
    ArrheniusEvolution,
    ExponentialEvolution,
    JointEvolution,
    LinearEvolution,
    LogarithmicEvolution,
    TabulatedEvolution,
)

FORMS = [
    LogarithmicEvolution(0.26, 1.3e6),
    ArrheniusEvolution(1.32, 150e3),
    LinearEvolution(2.4e-7),
    ExponentialEvolution(0.72, -3e-7),
    ExponentialEvolution(1.31, -3e-7, 0.8, -5e-6),
]
TABLE = TabulatedEvolution((1e3, 3e3, 4e3), (10.0, 30.0, 5.0))


@dataclass(frozen=True)
class Law:
    """A law with some parameters."""

    stiffness: float | Array = 100.0
    friction: float | Array = 0.5
    normal_load: float | Array = 60.0


# --- forms --------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", FORMS)
def test_forms_are_factors_that_start_at_one(form) -> None:
    assert form(0.0) == pytest.approx(1.0, abs=1e-15)
    energies = np.array([[0.0, 1.5], [1e3, 2.8e6]])
    assert form(energies).shape == (2, 2)
    np.testing.assert_array_equal(form(energies), [[form(e) for e in row] for row in energies])
    # The functions are finite for the smallest and the largest energies.
    assert np.all(np.isfinite(form(np.array([5e-324, 1e-300, 1e12]))))


def test_forms_are_those_of_the_papers() -> None:
    energy = np.array([0.3, 40.0, 9e5])
    log = 1.0 + 0.26 * np.log(1.3e6 * energy + 1.0)
    np.testing.assert_allclose(FORMS[0](energy), log, rtol=1e-14)
    np.testing.assert_allclose(FORMS[1](energy), 1.0 + 1.32 * np.exp(-150e3 / energy), rtol=1e-14)
    np.testing.assert_allclose(FORMS[2](energy), 1.0 + 2.4e-7 * energy, rtol=1e-14)
    one, two = np.exp(-3e-7 * energy), np.exp(-5e-6 * energy)
    np.testing.assert_allclose(FORMS[3](energy), 0.72 + 0.28 * one, rtol=1e-14)
    both = 0.8 * one + 0.2 * two
    np.testing.assert_allclose(FORMS[4](energy), 1.31 - 0.31 * both, rtol=1e-14)


def test_forms_end_where_they_must() -> None:
    assert ArrheniusEvolution(1.32, 150e3)(1e12) == pytest.approx(2.32, rel=1e-6)
    assert ExponentialEvolution(1.31, -3e-7, 0.8, -5e-6)(1e12) == pytest.approx(1.31, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: LogarithmicEvolution(0.2, -1.0), "rate = -1"),
        (lambda: ArrheniusEvolution(0.2, 0.0), "scale = 0"),
        (lambda: ExponentialEvolution(0.7, 0.3), "rate = 0.3"),
        (lambda: ExponentialEvolution(0.7, -0.3, 0.5, 5.0), "second_rate = 5"),
        (lambda: TabulatedEvolution((), ()), "0 energies and 0 factors"),
        (lambda: TabulatedEvolution((1.0, 1.0), (1.0, 2.0)), "must ascend"),
    ],
)
def test_what_makes_no_sense_is_refused(make, complaint) -> None:
    with pytest.raises(ValueError, match=complaint):
        make()


def test_a_table_is_linear_and_constant_beyond_its_ends() -> None:
    energy = np.array([0.0, 1e3, 2e3, 3e3, 3.5e3, 4e3, 1e9])
    np.testing.assert_allclose(TABLE(energy), [10.0, 10.0, 20.0, 30.0, 17.5, 5.0, 5.0])
    inside = TABLE(np.linspace(1e3, 3e3, 101))
    assert np.all(np.diff(inside) > 0.0)  # as monotone as its values
    assert TabulatedEvolution((0.0,), (7.0,))(123.0) == 7.0


# --- a law that follows -------------------------------------------------------------------------


def test_factors_multiply_and_tables_replace() -> None:
    evolution = JointEvolution(friction=LinearEvolution(1e-3), normal_load=TABLE)
    law = evolution.at(Law(), 2e3)
    assert law == Law(friction=1.5, normal_load=20.0)
    assert type(law.friction) is float
    assert evolution.at(Law(), 0.0) == Law(normal_load=10.0)
    assert JointEvolution().at(Law(), 2e3) == Law()


def test_every_joint_has_an_energy_of_its_own() -> None:
    evolution = JointEvolution(friction=LinearEvolution(1e-3), normal_load=TABLE)
    energy = np.array([0.0, 1e3, 2e3])
    law = evolution.at(Law(), energy)
    np.testing.assert_allclose(law.friction, [0.5, 1.0, 1.5])
    np.testing.assert_allclose(law.normal_load, [10.0, 10.0, 20.0])
    unlike = Law(friction=np.array([0.1, 0.2, 0.3]), normal_load=np.array([1.0, 2.0, 3.0]))
    law = evolution.at(unlike, energy)
    np.testing.assert_allclose(law.friction, [0.1, 0.4, 0.9])
    np.testing.assert_allclose(law.normal_load, [10.0, 10.0, 20.0])
    np.testing.assert_allclose(evolution.at(unlike, 1e3).normal_load, 10.0 * np.ones(3))


def test_what_is_worn_to_nothing_stays_so() -> None:
    law = JointEvolution(normal_load=LinearEvolution(-1e-3)).at(Law(), 5e3)
    assert law.normal_load == 0.0


def test_kinks_are_those_of_the_tables() -> None:
    tables = JointEvolution(friction=TabulatedEvolution((0.0, 3e3), (0.1, 0.2)), normal_load=TABLE)
    assert tables.breaks == (0.0, 1e3, 3e3, 4e3)
    assert JointEvolution(friction=LinearEvolution(1.0)).breaks == ()


# --- the papers ---------------------------------------------------------------------------------


def test_rig_as_printed() -> None:
    """Fantetti has µ(2800 J) = 0.937, kt(2800 J) = 61.5 N/µm, and µ = 0.52 after 1.5 mJ."""
    new, worn = (RIG_EVOLUTION.at(RIG, energy) for energy in (0.0, 2800.0 * J))
    assert new == RIG
    assert worn.friction == pytest.approx(0.937, abs=5e-4)
    assert worn.stiffness == pytest.approx(61.5e3, abs=50.0)
    assert worn.normal_load == 60.0
    assert RIG_EVOLUTION.at(RIG, 1.5).friction == pytest.approx(0.52, abs=5e-3)


def test_macroslip_slope_per_joule_would_pass_the_stiffness() -> None:
    """As printed, 2800 J are impossible (a misprint); per kJ the slope grows to 1.47 N/µm."""
    assert RIG_EVOLUTION.at(RIG, 2800.0 * J).residual_stiffness == pytest.approx(1471.0, abs=1.0)
    printed = replace(RIG_EVOLUTION, residual_stiffness=LinearEvolution(0.24 / J))
    values = printed.values(RIG, np.array([200.0, 220.0, 2800.0]) * J)
    passed = values["residual_stiffness"] > values["stiffness"]
    np.testing.assert_array_equal(passed, [False, True, True])


@pytest.mark.parametrize(
    ("test", "final"), [("test2", (0.72, 1.71, 1.16)), ("test4", (0.72, 1.31, 1.12))]
)
def test_bolted_joint_between_its_first_and_last_values(test, final) -> None:
    """In Li's joint preload falls, stiffness and friction rise, monotonically to final values."""
    law, evolution, _ = BOLTED[test]
    energies = np.concatenate([[0.0], np.geomspace(J, 100.0 * KJ, 200)])
    values = evolution.values(law, energies)
    names = "normal_load", "stiffness", "friction"
    for name, ratio, sense in zip(names, final, (-1.0, 1.0, 1.0), strict=True):
        initial = getattr(law, name)
        assert values[name][0] == pytest.approx(initial, rel=1e-12)
        assert values[name][-1] == pytest.approx(ratio * initial, rel=1e-10)
        assert np.all(sense * np.diff(values[name]) >= 0.0)


def test_bolted_joint_of_test_4_after_2_kj() -> None:
    """By hand e^-0.6 = 0.548812 and e^-10 = 4.54e-5."""
    law, evolution, _ = BOLTED["test4"]
    worn = evolution.at(law, 2.0 * KJ)
    assert worn.normal_load == pytest.approx(745.0 * (0.72 + 0.28 * 0.548812), rel=1e-6)
    stiffness = 115e3 * (1.31 - 0.31 * (0.8 * 0.548812 + 0.2 * 4.54e-5))
    assert worn.stiffness == pytest.approx(stiffness, rel=1e-6)
    friction = 0.34 * (1.12 - 0.12 * (0.5 * 0.548812 + 0.5 * 4.54e-5))
    assert worn.friction == pytest.approx(friction, rel=1e-6)
