"""Tests of branches of a contact that closes: folds are passed, reported and restarted from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fe_models.dynamics.curves import continuation, newton
from fe_models.dynamics.curves.forced_response import along_frequency
from fe_models.dynamics.excitation import HarmonicForce
from fe_models.dynamics.motion import Start
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import unit_force
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from tests.limits.contact_rigs import KT, MU, SOLVED, body
from tests.marks import slow
from wear.joints.friction_contact import FrictionContact
from wear.joints.periodic.march import PeriodicMarch

SHORT = continuation.ContinuationControl(most=0.03)
STOP = FrictionContact(KT, 1600.0, MU, gap=0.02)


def stopped(highest=9, samples=1024):
    """Return a mass that hits a stop at its resonance: a hardening spring.

    Each sample that begins to touch is a corner of the branch: with 256 samples they appear as
    folds of 0.1 Hz near the highest point, with 1024 no more.
    """
    model = body(normal=800.0, ratio=0.02)
    load = PeriodicLoad({1: -1j * unit_force(model, "z")})
    resolution = Resolution(tuple(range(highest + 1)), samples)
    return HarmonicBalance(model, PeriodicMarch(STOP), load, resolution)


@pytest.fixture(scope="module")
def folded():
    branch = along_frequency(stopped(), 1.0, (60.0, 200.0), control=SHORT)
    assert branch.message == ""
    return branch


@pytest.mark.slow
def test_folds_are_passed_and_reported(folded):
    """Up and down find the same two folds, 103.0 and 108.2 Hz, three motions between them."""
    down = along_frequency(stopped(), 1.0, (60.0, 200.0), upward=False, control=SHORT)
    assert down.message == ""
    for branch in (folded, down):
        assert len(branch.curve.folds) == 2
        turned = [branch.frequencies[place - 1] for place in branch.curve.folds]
        # The last point before a fold is nearer to it than a step.
        assert sorted(turned) == pytest.approx([103.03, 108.16], abs=0.3)
        assert np.count_nonzero(np.diff(np.sign(branch.frequencies - 106.0))) == 3
    highest = [branch.first_amplitudes(2).max() for branch in (folded, down)]
    assert highest[0] == pytest.approx(highest[1], rel=1e-3)


@pytest.mark.slow
def test_motions_that_coexist_are_those_that_time_integration_ends_in(folded):
    """At 106 Hz it reaches the largest and the smallest of three; the middle one repels."""
    crossings = np.flatnonzero(np.diff(np.sign(folded.frequencies - 106.0)))
    motions = [stopped(15, 512).solve(106.0, 1.0, folded.solutions[at]) for at in crossings]
    assert all(solution.converged for solution in motions)
    sizes = sorted(abs(solution.amplitude(2)) for solution in motions)
    model, amplitudes = stopped().model, []
    for speed in (0.0, 20.0):
        motion = integrate(
            model,
            STOP,
            HarmonicForce(unit_force(model, "z"), 1.0, 106.0),
            80.0 / 106.0,
            TimeStepControl(1.0 / (128.0 * 106.0)),
            Start(velocity=speed * unit_force(model, "z")),
        )
        last = motion.displacement[-129:-1, 2]
        assert np.abs(last - motion.displacement[-257:-129, 2]).max() < 1e-5
        turns = np.exp(-2j * np.pi * np.arange(128) / 128)
        amplitudes.append(2.0 * abs((last * turns).mean()))
    # 128 steps per period leave 2e-3 of the frequency's distance from resonance.
    assert amplitudes == pytest.approx([sizes[0], sizes[2]], rel=5e-3)
    assert sizes[1] > 1.5 * sizes[0]


def highest_point(folded):
    """Return the motion on the fold at 108 Hz, to 1e-9 of its frequency."""
    problem, last = stopped(), folded.solutions[folded.curve.folds[0] - 1]
    unknowns, below, above = last.coefficients.ravel(), last.frequency, last.frequency + 0.1
    control = newton.NewtonControl(max_iterations=8, max_shortened=1)
    while above - below > 1e-9 * below:
        middle = 0.5 * (below + above)
        solution = newton.solve(problem.by_frequency(1.0), unknowns, middle, control)
        # Beyond the fold Newton's method ends nowhere, or far away in the small motion.
        far = np.linalg.norm(solution.unknowns - unknowns) > 0.2 * np.linalg.norm(unknowns)
        if solution.converged and not far:
            unknowns, below = solution.unknowns, middle
        else:
            above = middle
    return replace(last, frequency=below, coefficients=unknowns.reshape(last.coefficients.shape))


def test_a_branch_that_starts_on_a_fold(folded):
    """The frequency does not distinguish the two ways there; each is found, one on either side."""
    start, problem = highest_point(folded), stopped()
    at_fold = problem.find(start.frequency, 1.0, start.coefficients.ravel())
    ends = {}
    for upward in (True, False):
        point = continuation.first_point(at_fold, start.frequency, upward, 0.02)
        assert np.all(np.isfinite(point.tangent))
        begun = replace(folded, curve=continuation.SolutionCurve((point,), ""))
        branch = along_frequency(problem, 1.0, (60.0, 200.0), begun)
        assert branch.message == ""
        ends[branch.frequencies[-1]] = branch.solutions[-1].motion
    assert set(ends) == {60.0, 200.0}
    for solution in (folded.solutions[0], folded.solutions[-1]):
        scale = np.abs(solution.motion).max()
        wanted = ends[solution.frequency]
        np.testing.assert_allclose(solution.motion, wanted, atol=SOLVED * scale)
    # Nothing is above the fold: the branch leaves a span that begins there where it began.
    above = along_frequency(problem, 1.0, (start.frequency, 200.0), start)
    assert "does not reach 200" in above.message
    assert above.frequencies[-1] == start.frequency


def test_a_start_beyond_a_fold_fails_or_lands_on_the_other_side(folded):
    """The largest motion does not exist above the fold; the small one is found there."""
    largest = max(folded.solutions, key=lambda solution: abs(solution.amplitude(2)))
    beyond = stopped().solve(112.0, 1.0, largest)
    assert beyond.converged
    alone = along_frequency(stopped(), 1.0, (112.0, 200.0), upward=False).solutions[-1]
    np.testing.assert_allclose(beyond.motion, alone.motion, atol=1e-9 * np.abs(alone.motion).max())


@pytest.mark.parametrize("share", [slow(0.25), 0.5, slow(0.75)])
def test_a_branch_taken_up_in_its_middle_is_the_rest_of_it(folded, share):
    """Points agree, also at folds, since a point stores its tangent and its step."""
    kept = round(share * len(folded.curve.points))
    part = replace(folded, curve=replace(folded.curve, points=folded.curve.points[:kept]))
    rest = along_frequency(part.problem, 1.0, (60.0, 200.0), part, control=SHORT)
    assert rest.message == ""
    wanted = folded.solutions[kept + 1 :]
    np.testing.assert_allclose(rest.frequencies, [s.frequency for s in wanted], rtol=1e-6)
    for solution, before in zip(rest.solutions, wanted, strict=True):
        scale = np.abs(before.motion).max()
        np.testing.assert_allclose(solution.motion, before.motion, atol=1e-5 * scale)
