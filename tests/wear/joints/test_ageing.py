"""Long tests by jumps in energy, against counting: exact recurrences, marches, and the papers."""

from math import cosh, exp, log, sqrt, tanh

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import wear.joints.ageing
from tests.wear.joints.papers import BOLTED, KJ, RIG, RIG_AMPLITUDE, RIG_EVOLUTION, J
from wear.joints.ageing import (
    AgeingError,
    NeverReachedError,
    integrate_cycles,
    long_test,
    marched_stroke,
    steady_stroke,
)
from wear.joints.bouc_wen import BoucWen
from wear.joints.evolution import JointEvolution, LinearEvolution, TabulatedEvolution
from wear.joints.iwan import UniformIwan
from wear.joints.jenkins import Jenkins

TEST_4 = BOLTED["test4"]


@pytest.fixture(scope="module")
def rig():
    """Return Fantetti's test 1 to 2800 J and beyond."""
    return long_test(steady_stroke(RIG, RIG_EVOLUTION, RIG_AMPLITUDE), 2.3e6)


@pytest.fixture(scope="module")
def bolted():
    """Return Li's test 4."""
    return long_test(steady_stroke(*TEST_4), 1.08e6)


def bouc_wen_energy(law: BoucWen, amplitude: float) -> float:
    """Return the energy of the settled loop with n = 2, σ = 1/2, derived here.

    From -ξm the joint unloads along a line, ξ = -ξm + K (x + A)/F with F = µN and K = kt - kp, to
    ξ = 0; then it loads, ξ = tanh of the rest. So artanh ξm + ξm = 2 K A/F, and the loop encloses
    2 ∫ F ξ dx = (2 F²/K) (ln cosh u - ξm²/2), where u = artanh ξm.
    """
    limit, spring = law.friction * law.normal_load, law.stiffness - law.residual_stiffness
    way = 2.0 * spring * amplitude / limit
    u = brentq(lambda u: u + tanh(u) - way, 0.0, way, xtol=1e-14)
    return 2.0 * limit**2 / spring * (log(cosh(u)) - 0.5 * tanh(u) ** 2)


def iwan_energy(law: UniformIwan, amplitude: float) -> float:
    """Return 4 Fs (A - 2 φ/3) with φ = 2 Fs/kt < A, where all sliders slip."""
    limit = law.friction * law.normal_load
    reach = 2.0 * limit / law.stiffness
    assert reach < amplitude
    return 4.0 * limit * (amplitude - 2.0 * reach / 3.0)


# --- exact recurrences --------------------------------------------------------------------------


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(
    ("energy_per_cycle", "start", "cycles", "exact"),
    [
        # (sqrt(E) + 1)² after each cycle: steep, from 0, over twelve decades.
        (lambda e: 2.0 * sqrt(e) + 1.0, 0.0, 1e6, lambda n: n**2),
        (lambda e: 1e-3 * e, 1.0, 2e4, lambda n: np.exp(n * np.log1p(1e-3))),
        # The energy tends to 5, where nothing slides.
        (
            lambda e: 1e-4 * max(5.0 - e, 0.0),
            1.0,
            1e5,
            lambda n: 5.0 - 4.0 * np.exp(n * np.log1p(-1e-4)),
        ),
        (lambda _: 2.5, 3.0, 1.9e6, lambda n: 3.0 + 2.5 * n),
    ],
)
def test_error_is_below_what_is_stated(energy_per_cycle, start, cycles, exact, tolerance) -> None:
    """Errors in cycles are those of the energy over that of a cycle."""
    test = long_test(energy_per_cycle, cycles, start=start, tolerance=tolerance)
    number = np.unique(np.round(np.geomspace(1.0, cycles, 300)))
    energy = test.energy_at(number)
    per_cycle = np.array([energy_per_cycle(dissipated) for dissipated in energy.tolist()])
    # The energy that a cycle adds is rounded to the last digit of the sum.
    rounding = 2.2e-16 * number * energy / per_cycle
    assert np.all(np.abs(energy - exact(number)) / per_cycle <= test.error + rounding)
    assert test.error <= tolerance * cycles
    np.testing.assert_allclose(test.cycles_at(energy), number, rtol=1e-8)


def test_a_coarser_tolerance_takes_fewer_energies() -> None:
    taken = [
        long_test(lambda e: 2.0 * sqrt(e) + 1.0, 1e6, tolerance=tolerance).evaluations
        for tolerance in (1e-9, 1e-6, 1e-3)
    ]
    assert taken == sorted(taken, reverse=True)
    assert taken[-1] < 1000


# --- limits -------------------------------------------------------------------------------------


def test_a_joint_that_sticks_does_not_age() -> None:
    test = long_test(lambda _: 0.0, 1e9)
    assert test.final_energy == 0.0
    np.testing.assert_array_equal(test.cycles, [0.0, 1e9])
    np.testing.assert_array_equal(test.energy, [0.0, 0.0])
    np.testing.assert_array_equal(test.cycles_at(np.array([0.0, 1.0])), [0.0, np.nan])
    assert test.error == 0.0
    assert integrate_cycles(test, lambda _: 0.0, 10.0, 5).difference == 0.0


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_a_joint_that_wears_until_nothing_slides(power) -> None:
    """With e = c (E* - E)^p, E reaches E* for p < 1, and otherwise only approaches it."""
    test = long_test(lambda e: 1e-3 * max(7.0 - e, 0.0) ** power, 1e6)
    assert test.final_energy == pytest.approx(7.0, rel={0.5: 1e-6, 1.0: 1e-12, 2.0: 2e-3}[power])
    assert np.all(np.diff(test.energy) >= 0.0)
    assert np.all(np.diff(test.cycles) > 0.0)
    assert np.isnan(test.cycles_at(7.1))


def test_preload_worn_to_nothing_ends_the_ageing() -> None:
    """A Jenkins joint stops where 4 µN (A - µN/kt) vanishes, with N falling to 0 at 1 kJ."""
    joint = Jenkins(stiffness=1e5, friction=0.5, normal_load=100.0)
    test = long_test(
        steady_stroke(joint, JointEvolution(normal_load=LinearEvolution(-1.0 / KJ)), 0.01), 3e7
    )
    assert test.final_energy == pytest.approx(KJ, rel=1e-6)
    assert test.error <= 30.0


def test_a_single_cycle_and_parts_of_one() -> None:
    test = long_test(lambda _: 2.0, 1.0, start=5.0)
    assert test.final_energy == 7.0
    assert long_test(lambda _: 2.0, 0.25).final_energy == 0.5
    np.testing.assert_array_equal(test.cycles, [0.0, 1.0])


@pytest.mark.parametrize("until", [0.5, 1.0, 30.0, 1e9, 1e12])
def test_a_test_may_end_at_an_energy(until) -> None:
    """With (sqrt(E) + 1)² after each cycle, E takes sqrt(E) cycles, if this is a whole number."""
    test = long_test(lambda e: 2.0 * sqrt(e) + 1.0, until=until)
    assert test.final_energy == pytest.approx(until, rel=1e-12)
    below, above = np.floor(sqrt(until)), np.ceil(sqrt(until))
    assert below - test.error <= test.total_cycles <= above + test.error
    assert float(test.cycles_at(until)) == test.total_cycles
    assert long_test(lambda e: 2.0 * sqrt(e) + 1.0, 0.25, until=until).total_cycles == 0.25


def test_an_energy_that_is_never_reached_is_reported() -> None:
    with pytest.raises(NeverReachedError, match="8 N mm are never reached"):
        long_test(lambda e: 1e-2 * max(7.0 - e, 0.0), until=8.0)
    with pytest.raises(NeverReachedError, match="0 cycles and 0 N mm"):
        long_test(lambda _: 0.0, until=8.0)


def test_kinks_that_are_named_cost_nothing() -> None:
    """At the kinks of a table, the number of cycles of every straight stretch is a logarithm."""
    joint = Jenkins(stiffness=1e9, friction=1.0, normal_load=1.0)
    table = TabulatedEvolution((0.0, 1e4, 3e4), (1.0, 3.0, 2.0))
    evolution = JointEvolution(normal_load=table)
    rate = steady_stroke(joint, evolution, 0.5)
    named = long_test(rate, 4e4, tolerance=1e-9, breaks=evolution.breaks)
    counted = 0
    energy = 0.0
    while energy < 3.5e4:
        energy += rate(energy)
        counted += 1
    assert float(named.cycles_at(energy)) == pytest.approx(counted, abs=named.error + 1e-9)
    unnamed = long_test(rate, 4e4, tolerance=1e-9)
    assert named.evaluations < unnamed.evaluations
    assert float(unnamed.cycles_at(energy)) == pytest.approx(counted, abs=unnamed.error)


@pytest.mark.parametrize(
    "changes",
    [{"cycles": 0.0}, {"cycles": np.inf}, {"start": -1.0}, {"start": 3.0, "until": 3.0}],
)
def test_tests_without_meaning_are_refused(changes) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - whatever is said of it
        long_test(lambda _: 1.0, **{"cycles": 10.0, **changes})


def test_questions_beyond_the_test_are_refused() -> None:
    test = long_test(lambda _: 1.0, 10.0, start=3.0)
    with pytest.raises(ValueError, match="test has 10 cycles"):
        test.energy_at(11.0)
    with pytest.raises(ValueError, match="below the 3 N mm"):
        test.cycles_at(2.0)
    with pytest.raises(ValueError, match="0 cycles"):
        integrate_cycles(test, lambda _: 1.0, 1.0, 0)
    assert np.isnan(test.cycles_at(14.0))


def test_invalid_energies_are_reported(monkeypatch) -> None:
    for bad in (-1.0, np.nan, np.inf):
        with pytest.raises(AgeingError, match="allowed: 0 or more"):
            long_test(lambda _, bad=bad: bad, 10.0)
    monkeypatch.setattr(wear.joints.ageing, "MOST_EVALUATIONS", 1000)
    noise = np.random.default_rng(1)
    with pytest.raises(AgeingError, match="not smooth within"):
        long_test(lambda _: 1.0 + 0.1 * noise.random(), 1e6)


# --- a joint at a prescribed stroke -------------------------------------------------------------


@pytest.mark.parametrize("energy", [0.0, 1.5, 2800.0 * J])
@pytest.mark.parametrize("amplitude", [3e-4, 7e-3])
def test_settled_bouc_wen_loop(energy, amplitude) -> None:
    """The derived energy, the law's, and that of its integrated differential equation agree."""
    law = RIG_EVOLUTION.at(RIG, energy)
    expected = bouc_wen_energy(law, amplitude)
    lost = steady_stroke(RIG, RIG_EVOLUTION, amplitude)(energy)
    assert lost == pytest.approx(expected, rel=1e-9)
    limit, spring = law.friction * law.normal_load, law.stiffness - law.residual_stiffness

    def slopes(sense):
        """Return dξ/dx and the slope of the work of µNξ, in the ``sense`` of motion."""

        def slope(_, y):
            opposed = 0.5 * np.sign(sense * y[0]) + 0.5
            return [sense * spring / limit * (1.0 - opposed * y[0] ** 2), sense * limit * y[0]]

        return slope

    xi = tanh(brentq(lambda u: u + tanh(u) - 2.0 * spring * amplitude / limit, 0.0, 1e3))
    y = np.array([-xi, 0.0])
    for sense in (1.0, -1.0):
        y = solve_ivp(slopes(sense), (0.0, 2.0 * amplitude), y, rtol=1e-10, atol=1e-13).y[:, -1]
        assert y[0] == pytest.approx(sense * xi, rel=1e-8)
    assert y[1] == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("energy", [1.0, 3.0 * KJ])
def test_settled_loops_are_those_of_a_march(energy) -> None:
    """Parameters are constant; a law with one straight increment per branch is exact."""
    for law, evolution, amplitude in (TEST_4, (RIG, RIG_EVOLUTION, RIG_AMPLITUDE)):
        marched = marched_stroke(law, evolution, amplitude, start=energy)
        for _ in range(3):
            lost = marched(energy)
        expected = steady_stroke(law, evolution, amplitude)(energy)
        assert lost == pytest.approx(expected, rel=1e-9)


# --- Fantetti's test 1 --------------------------------------------------------------------------


def test_rig_dissipates_what_systems_say(rig) -> None:
    """A cycle dissipates 1.30 to 1.34 mJ from 1 kJ on, and less before, while kt still grows."""
    rate = steady_stroke(RIG, RIG_EVOLUTION, RIG_AMPLITUDE)
    worn = np.array([rate(energy) for energy in np.linspace(1050.0, 2600.0, 40) * J])
    assert np.all((worn > 1.30) & (worn < 1.345))
    before = np.array([rate(energy) for energy in np.geomspace(1.0, 1000.0, 40) * J])
    assert np.all(np.diff(before) > 0.0)
    assert before[0] == pytest.approx(0.892, abs=1e-3)


def test_rig_needs_2_1_million_cycles(rig) -> None:
    """2800 J take about 2.1 million cycles (measured: 1.9), at 1.28 mJ on average."""
    cycles = float(rig.cycles_at(2800.0 * J))
    assert cycles == pytest.approx(2.1e6, rel=0.05)
    again = long_test(steady_stroke(RIG, RIG_EVOLUTION, RIG_AMPLITUDE), until=2800.0 * J)
    assert again.total_cycles == pytest.approx(cycles, abs=rig.error)
    assert rig.error < 1e-6 * 2.3e6


def test_rig_takes_few_strokes() -> None:
    """Only a few of 1.9 million strokes are evaluated."""
    test = long_test(steady_stroke(RIG, RIG_EVOLUTION, RIG_AMPLITUDE), 1.9e6)
    assert test.evaluations < 2000


@pytest.mark.parametrize("first", [0.0, 50.0, 1e5, 1.9e6])
def test_rig_on_a_stretch(rig, first) -> None:
    """Cycles with the closed form agree, from the first and steepest on."""
    rate = steady_stroke(RIG, RIG_EVOLUTION, RIG_AMPLITUDE)
    stretch = integrate_cycles(rig, rate, first, 1000)
    assert abs(stretch.difference) <= stretch.stated + 1e-8
    np.testing.assert_allclose(stretch.energy, stretch.jumped, rtol=1e-6)


@pytest.mark.parametrize("first", [0.0, 1e5, 1.9e6])
def test_rig_on_a_marched_stretch(rig, first) -> None:
    """The law's memory from cycle to cycle makes no difference: the joint slides fully."""
    start = float(rig.energy_at(first))
    marched = marched_stroke(RIG, RIG_EVOLUTION, RIG_AMPLITUDE, start=start)
    stretch = integrate_cycles(rig, marched, first, 1000)
    assert abs(stretch.difference) < 1e-4


def test_first_cycles_are_counted(rig) -> None:
    """Friction rises from 0.11 to 0.34 in the first cycle, which no jump could follow."""
    assert np.all(rig.cycles[:9] == np.arange(9.0))
    rate = steady_stroke(RIG, RIG_EVOLUTION, RIG_AMPLITUDE)
    assert rig.energy[1] == rate(0.0)
    values = RIG_EVOLUTION.values(RIG, rig.energy)
    assert values["friction"].shape == rig.cycles.shape
    assert values["friction"][0] == pytest.approx(0.11)
    assert values["friction"][1] == pytest.approx(0.11 * (1.0 + 0.26 * log(1.3e6 * rate(0.0))))


# --- Li's bolted joint --------------------------------------------------------------------------


def test_bolted_joint_reaches_its_cycle_counts(bolted) -> None:
    """Test 4 reaches 2, 4 and 6 kJ after 245, 485 and 725 thousand cycles, within 15 %."""
    counts = bolted.cycles_at(np.array([2.0, 4.0, 6.0]) * KJ)
    np.testing.assert_allclose(counts, [245e3, 485e3, 725e3], rtol=0.15)
    assert float(bolted.energy_at(100.0)) == pytest.approx(J, rel=0.25)  # about 1 J


def test_bolted_joint_counted_to_its_end(bolted) -> None:
    """All 1.08 million cycles are counted one by one, with the formulas written out."""
    law, _, amplitude = TEST_4
    energy, marks = 0.0, {100: 0.0, 10**5: 0.0, 485_000: 0.0, 1_080_000: 0.0}
    for cycle in range(1_080_001):
        if cycle in marks:
            marks[cycle] = energy
        slow, fast = exp(-3e-7 * energy), exp(-5e-6 * energy)
        preload = 745.0 * (0.72 + 0.28 * slow)
        stiffness = 115e3 * (1.31 - 0.31 * (0.8 * slow + 0.2 * fast))
        limit = 0.34 * (1.12 - 0.12 * (0.5 * slow + 0.5 * fast)) * preload
        energy += 4.0 * limit * (amplitude - 4.0 * limit / (3.0 * stiffness))
    reached = bolted.cycles_at(np.array(list(marks.values())) - 1e-9)
    # The sum of a million energies has as many rounding errors.
    assert np.all(np.abs(reached - np.array(list(marks))) <= bolted.error + 1e-5)
    assert bolted.error < 1e-6 * 1.08e6
    assert iwan_energy(law, amplitude) == pytest.approx(steady_stroke(*TEST_4)(0.0), rel=1e-12)


@pytest.mark.parametrize("first", [0.0, 245e3, 1e6])
def test_bolted_joint_on_a_marched_stretch(bolted, first) -> None:
    law, evolution, amplitude = TEST_4
    marched = marched_stroke(law, evolution, amplitude, start=float(bolted.energy_at(first)))
    stretch = integrate_cycles(bolted, marched, first, 500)
    assert abs(stretch.difference) <= stretch.stated + 1e-7


@pytest.mark.parametrize("test", ["test2", "test4"])
def test_bolted_joint_loses_preload_over_the_cycles(test) -> None:
    """It loses less than 30 %, as smooth surfaces do, while friction and stiffness rise."""
    law, evolution, amplitude = BOLTED[test]
    aged = long_test(steady_stroke(law, evolution, amplitude), 1.08e6)
    values = evolution.values(law, aged.energy)
    lost = 1.0 - values["normal_load"] / law.normal_load
    assert lost[0] == 0.0
    assert np.all(np.diff(lost) > 0.0)
    assert 0.25 < lost[-1] < 0.30
    assert np.all(np.diff(values["friction"]) > 0.0)
    assert np.all(np.diff(values["stiffness"]) > 0.0)


@pytest.mark.parametrize("cycles", np.geomspace(100.0, 2e6, 12).round())
def test_the_end_of_a_test_is_found_again(cycles) -> None:
    """The energy at the last cycle and the cycles at that energy are consistent."""
    test = long_test(lambda e: 1.0 + 0.3 * np.log1p(e), float(cycles))
    assert float(test.cycles_at(test.final_energy)) == pytest.approx(cycles, rel=1e-9)
    assert np.isnan(test.cycles_at(1.001 * test.final_energy))
