"""Stability of motions on a stiff stop, against exact shooting from contact to contact."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.forced_response import along_frequency
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.periodic.period_times import PeriodTimes
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from fe_models.dynamics.stability.floquet import Floquet
from tests.oracles.stop_shooting import shoot
from wear.joints.elastic import ElasticStop
from wear.joints.periodic.march import PeriodicMarch

# Masses of 1 are on springs of 1; the last one meets a stop a hundred times as stiff.
DAMPING, GAP, STIFFNESS, FORCE = 0.03, 1.0, 100.0, 0.1


def two_masses(highest: int = 21) -> HarmonicBalance:
    """Return two masses in a row, with damping in proportion to their stiffness."""
    model = lumped_rig(
        {"a": 1.0, "b": 1.0}, {Link("a"): 1.0, Link("b", "a"): 1.0}, [[Link("b")]], 0.0
    )
    model = replace(model, damping=DAMPING * model.stiffness)
    law = PeriodicMarch(ElasticStop(stiffness=STIFFNESS, gap=GAP))
    load = PeriodicLoad({1: -1j * unit_force(model, "b")})
    return HarmonicBalance(model, law, load, Resolution(tuple(range(highest + 1)), 1024))


@pytest.fixture(scope="module")
def touching():
    """Return a curve that folds where the stop is touched, and the stability of its motions."""
    control = ContinuationControl(max_points=75)
    branch = along_frequency(two_masses(), FORCE, (0.0796, 0.1273), control=control)
    of = Floquet(branch.problem).stability
    return branch, [of(motion) for motion in branch.solutions]


@pytest.mark.slow
def test_multipliers_are_those_of_shooting_within_their_error(touching):
    """With 21 harmonics alone, errors reach 1, and more than ten verdicts are wrong."""
    branch, known = touching
    problem, compared, away = branch.problem, 0, 0.0
    for motion, stability in list(zip(branch.solutions, known, strict=True))[18::6]:
        exact = shoot(problem, motion)
        if stability.verdict == "unknown" or exact is None:
            continue
        largest = abs(exact.multipliers[0])
        assert stability.verdict == ("stable" if largest < 1.0 else "unstable")
        assert abs(stability.largest - largest) <= 2.0 * stability.error
        assert stability.error < 5e-3 * max(largest, 1.0)
        compared, away = compared + 1, max(away, exact.distance)
    assert compared >= 8
    # The error of the motions themselves is larger than that.
    assert away > 1e-3


def test_a_motion_of_seven_harmonics_has_the_stability_of_the_refined_motion():
    """The multiplier is that of shooting, although the harmonics are in error by a hundredth."""
    problem = two_masses(highest=7)
    motion = problem.solve(0.105, FORCE)
    stability, exact = Floquet(problem).stability(motion), shoot(problem, motion)
    assert exact.distance > 1e-2
    assert stability.verdict == ("stable" if abs(exact.multipliers[0]) < 1.0 else "unstable")
    assert stability.largest == pytest.approx(abs(exact.multipliers[0]), abs=2.0 * stability.error)
    assert stability.error < 1e-3


def barely_touching(stiffness, deep, frequency=0.2):
    """Return a motion that penetrates the stop by ``deep``, midway between two of 1024 times.

    The smallest penetration lasts for less than a 2048th of the period. Without the stop the motion
    would be stable.
    """
    free, highest = two_masses().model, 601 / 2048
    point, angular = unit_force(free, "b"), 2.0 * np.pi * frequency
    dynamic = free.stiffness - angular**2 * free.mass + 1j * angular * free.damping
    wave = np.exp(-2j * np.pi * highest) / (point @ np.linalg.solve(dynamic, point))
    law = PeriodicMarch(ElasticStop(stiffness=stiffness, gap=GAP - deep))
    load, resolution = PeriodicLoad({1: wave * point}), Resolution(tuple(range(22)), 4096)
    problem = HarmonicBalance(free, law, load, resolution)
    return problem, problem.solve(frequency, GAP)


@pytest.mark.parametrize(
    ("stiffness", "deep"), [(100.0, 1e-6), (300.0, 1e-6), (300.0, 1e-5), (1000.0, 1e-5)]
)
def test_a_brief_contact_with_a_stop_is_not_missed(stiffness, deep):
    problem, motion = barely_touching(stiffness, deep)
    stability, exact = Floquet(problem).stability(motion), shoot(problem, motion, steps=2048)
    assert exact.distance < 1e-6
    largest = abs(exact.multipliers[0])
    assert largest > 1.05
    assert stability.verdict == "unstable"
    assert stability.largest == pytest.approx(largest, abs=2.0 * stability.error)
    assert stability.error < 0.01


@pytest.mark.slow
def test_liouville_holds_through_contact(touching):
    """The product of all multipliers in a period is exp(-T tr M⁻¹C)."""
    branch, known = touching
    for motion, stability in list(zip(branch.solutions, known, strict=True))[20::15]:
        if stability.resolved:
            lost = np.exp(-DAMPING * np.trace(branch.problem.model.stiffness) / motion.frequency)
            assert abs(np.prod(stability.multipliers)) == pytest.approx(lost, rel=1e-4)


@pytest.mark.slow
def test_few_verdicts_are_unknown(touching):
    _, known = touching
    assert sum(stability.verdict == "unknown" for stability in known) <= 0.05 * len(known)


@pytest.mark.slow
def test_no_verdict_on_what_is_no_motion(touching):
    """A motion that does not balance is not near a solution, and its error is unknown."""
    branch, _ = touching
    motion = branch.solutions[40]
    stability = Floquet(branch.problem).stability(replace(motion, residual=1e-2))
    assert stability.verdict == "unknown"
    assert not stability.resolved


def test_merged_steps_start_at_the_same_times():
    """Half as many steps start at every second time, wherever steps were divided."""
    times = PeriodTimes.uniform(8, 2)
    for place in (3, 6):
        marked = np.zeros(len(times.starts), bool)
        marked[place] = True
        times = times.with_divided(marked)
    half = times.halved()
    ends = np.append(half.starts, half.parts)
    np.testing.assert_array_equal(np.diff(ends), 4 ** (half.deepest - half.levels))


def test_joint_states_shorter_than_a_step_are_resolved():
    def regimes(times):
        share = times.starts / times.parts
        return ((share > 0.4301) & (share < 0.4341))[:, None]

    times = PeriodTimes.adapted(regimes, 32, 5)
    assert regimes(times).sum() > 10
