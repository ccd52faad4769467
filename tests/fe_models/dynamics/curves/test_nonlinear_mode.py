"""Nonlinear modes against closed forms, energy balances, time integration and phase resonance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipk

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.forced_response import along_frequency
from fe_models.dynamics.curves.nonlinear_mode import LinearMode, NonlinearMode, along_nonlinear_mode
from fe_models.dynamics.curves.phase_resonance import along_phase_resonance
from fe_models.dynamics.motion import Start
from fe_models.dynamics.periodic.cycle_energy import energy_lost
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, lumped_rig, unit_force
from tests.fe_models.dynamics.curves.test_phase_resonance import block_problem
from tests.fe_models.dynamics.harmonic_rigs import KT, LOAD, MU, REACH, balance, rig
from tests.marks import slow
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from wear.joints.elastic import PolynomialSpring
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch

# The points are so close that linear interpolation suffices.
FINE = ContinuationControl(most=0.03)
LAW = Jenkins(stiffness=1e3, friction=0.5, normal_load=10.0)


def oscillator(ratio=0.0, harmonics=(1,), samples=1024):
    model = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]], ratio)
    return HarmonicBalance(
        model, PeriodicMarch(LAW), PeriodicLoad({}), Resolution(harmonics, samples)
    )


def mode_of(problem, number, amplitudes, control=None):
    """Return a mode; amplitudes are relative to that at which a joint moves 1 mm at most."""
    linear = LinearMode.of(problem, number)
    one = 1.0 / np.abs(problem.model.connection @ linear.shape).max()
    mode = along_nonlinear_mode(problem, linear, tuple(one * np.array(amplitudes)), control)
    assert not mode.message
    return mode


def test_one_mass_on_a_slider():
    """With one harmonic ω² = (k + F₁/X) / m, and D is that of dashpot and loop."""
    mode = mode_of(oscillator(ratio=0.02), 1, (1e-3, 5e-2))
    X = mode.amplitudes / np.sqrt(1e-3)
    cosine, _ = LAW.first_harmonic(X)
    angular = np.sqrt((1e3 + cosine / X) / 1e-3)
    np.testing.assert_allclose(2.0 * np.pi * mode.frequencies, angular, rtol=1e-5)
    dashpot = 0.02 * np.sqrt(1e3 / 1e-3) / angular
    loop = LAW.loop_energy(X) / (2.0 * np.pi * 1e-3 * (angular * X) ** 2)
    np.testing.assert_allclose(mode.damping_ratios, dashpot + loop, rtol=2e-4)
    assert mode.frequencies[-1] < 0.8 * mode.frequencies[0]


def fed_back(problem, motion, ratio):
    """Return the energy lost in a period over 2ω ∫ x'ᵀ M x' dt."""
    orders = np.array(motion.resolution.harmonics)
    angular = 2.0 * np.pi * motion.frequency
    rates = orders[:, None] * motion.motion
    square = float(np.einsum("kn,nm,km->", rates.conj(), problem.model.mass, rates).real)
    return energy_lost(problem, motion) / (2.0 * np.pi * angular**2 * square)


@pytest.mark.parametrize("case", ["rig", slow("block")])
def test_damping_is_the_energy_lost(case):
    """Several harmonics, one and three directions, and a constant load are included."""
    if case == "rig":
        mode = mode_of(problem := balance(rig(), samples=512), 1, (0.3 * REACH, 4.0 * REACH))
    else:
        mode = mode_of(problem := block_problem(samples=256), 2, (2e-3, 1.5e-2))
    motion = mode.motions[-1]
    assert motion.damping_ratio > 3.0 * mode.linear.damping_ratio
    lost = fed_back(problem, motion.solution, motion.damping_ratio)
    assert motion.damping_ratio == pytest.approx(lost, rel=1e-3)


def test_fed_structure_repeats_itself_in_time():
    """One period is integrated from event to event, with C - 2Dω M in place of C.

    The feed makes other modes grow: for a mode with large losses they would not stay small.
    """
    problem = balance(rig(), samples=1024)
    motion = mode_of(problem, 1, (0.5 * REACH, 1.1 * REACH)).motions[-1]
    assert motion.damping_ratio > 0.05
    solution, model = motion.solution, problem.model
    rate = 4.0 * np.pi * motion.damping_ratio * solution.frequency
    fed = replace(model, damping=model.damping - rate * model.mass)
    path = solution.displacement(64)
    # The slider lags behind the joint by the stretch of its spring.
    slider = model.connection @ path[0] - solution.cycle.samples[0, :, 0] / KT
    start = Start(path[0], solution.velocity(64)[0], slider[:, None])
    period = 1.0 / solution.frequency
    joints = SliderJoints(*(np.array([value]) for value in (KT, MU * LOAD, 0.0)))
    after = integrate_exactly(fed, joints, None, period, period / 64, start)
    np.testing.assert_allclose(
        after.displacement[:64], path, atol=3e-3 * np.abs(path).max(), rtol=0.0
    )


def test_errors_are_the_changes_by_more_harmonics():
    coarse, fine = (
        mode_of(oscillator(0.01, tuple(range(1, top, 2)), 2048), 1, (4e-3, 1.5e-2))
        for top in (4, 30)
    )
    reported, true = coarse.motions[-1], fine.motions[-1]
    frequency = abs(reported.solution.frequency / true.solution.frequency - 1.0)
    assert 0.5 * frequency < reported.frequency_error < 2.0 * frequency
    damping = abs(reported.damping_ratio - true.damping_ratio)
    assert 0.5 * damping < reported.damping_error < 2.0 * damping
    assert true.vibration_error < 0.02 * reported.vibration_error


@pytest.mark.parametrize("number", [1, 2])
def test_phase_resonance_of_a_light_mode_is_near(number):
    """For two distant modes, the force at phase resonance is 2 D ω² a over the mode's share."""
    model = lumped_rig(
        {"a": 1e-3, "b": 1e-3}, {Link("a"): 1e3, Link("b", "a"): 1e3}, [[Link("b")]], 2e-3
    )
    law = Jenkins(stiffness=20.0, friction=0.5, normal_load=0.1)
    load = PeriodicLoad({1: -1j * unit_force(model, "a")})
    problem = HarmonicBalance(model, PeriodicMarch(law), load, Resolution((1, 3, 5), 512))
    middle = LinearMode.of(problem, number).frequency
    span = (0.9 * middle, 1.1 * middle)
    branch = along_frequency(problem, 0.05, span)
    backbone = along_phase_resonance(problem, branch, (0.03, 0.2))
    mode = mode_of(problem, number, (1e-3, 5e-2), FINE)
    forced = backbone.first_amplitudes(1)
    free = np.array([abs(m.solution.amplitude(1)) for m in mode.motions])
    inside = (forced > free[0]) & (forced < free[-1])
    assert inside.sum() > 3
    nearest = np.interp(forced[inside], free, mode.frequencies)
    np.testing.assert_allclose(backbone.frequencies[inside], nearest, rtol=2e-4)
    shape = np.array([m.solution.motion[0] for m in mode.motions])
    # The work of the force equals the loss per period: π F |x_a| = 2π D ω² a².
    angular = 2.0 * np.pi * mode.frequencies
    wanted = 2.0 * mode.damping_ratios * (angular * mode.amplitudes) ** 2 / np.abs(shape[:, 0])
    np.testing.assert_allclose(
        backbone.forces[inside], np.interp(forced[inside], free, wanted), rtol=0.02
    )


def test_derivatives_of_the_equations():
    problem = block_problem()
    linear = LinearMode.of(problem, 1)
    reference = problem.receptance.at_points.T @ problem.model.mass @ linear.shape
    equations = NonlinearMode(problem, reference + 0j, linear.frequency, 0.02)
    rng = np.random.default_rng(3)
    place = np.append(problem.guess(None), [0.1 * 0.02, 0.05 * 0.02])
    place[:-2] += 0.006 * rng.standard_normal(problem.size)
    at, step = equations(place, 2e-3), 2e-8
    for direction in np.eye(len(place)):
        upper = equations(place + step * direction, 2e-3).residual
        lower = equations(place - step * direction, 2e-3).residual
        wanted = (upper - lower) / (2.0 * step)
        np.testing.assert_allclose(
            at.jacobian @ direction, wanted, atol=1e-5 * np.abs(wanted).max()
        )
    ends = [equations(place, 2e-3 * (1.0 + way)).residual for way in (1e-5, -1e-5)]
    np.testing.assert_allclose(at.slope, (ends[0] - ends[1]) / 4e-8, atol=1e-4)


def test_unknown_modes_are_refused():
    with pytest.raises(HarmonicBalanceError, match="has 1 to 1"):
        LinearMode.of(oscillator(), 2)


def test_mode_of_duffing_is_the_free_vibration_of_elliptic_functions():
    """At amplitude A, the period of x'' + x + x³ = 0 is 4 K(m) / √(1 + A²), m = A² / (2 + 2 A²).

    The joint has no stiffness at rest, so that the mode starts where the structure alone has no
    finite flexibility.
    """
    model = lumped_rig({"m": 1.0}, {Link("m"): 1.0}, [[Link("m")]], 0.01)
    load = PeriodicLoad({1: unit_force(model, "m")})
    spring = PeriodicMarch(PolynomialSpring(0.0, cubic=1.0))
    problem = HarmonicBalance(model, spring, load, Resolution(tuple(range(1, 22, 2)), 256))
    branch = along_nonlinear_mode(problem, LinearMode.of(problem, 1), (0.05, 4.0))
    assert branch.message == ""
    for mode in branch.motions:
        squared = np.abs(mode.solution.displacement(1024)).max() ** 2
        period = 4.0 * ellipk(squared / (2.0 + 2.0 * squared)) / np.sqrt(1.0 + squared)
        assert mode.solution.frequency * period == pytest.approx(1.0, abs=1e-9)
