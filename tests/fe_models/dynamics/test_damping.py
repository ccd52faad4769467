"""Damping other than modal damping, against linear algebra and energy balances."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl

from fe_models.dynamics.curves.phase_resonance import along_phase_resonance
from fe_models.dynamics.damping import damped, rayleigh_factors
from fe_models.dynamics.periodic.cycle_energy import damping_ratio, energy_lost
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.periodic.modal_inverse import MixedModes, ModesWithDashpots
from fe_models.dynamics.periodic.receptance import Receptance
from fe_models.dynamics.rig import Link, RigError, lumped_rig, natural_frequencies, unit_force
from fe_models.dynamics.transient.newmark import TimeStepControl, integrate
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch

MASSES = {"a": 1e-3, "b": 2e-3}
SPRINGS = {Link("a"): 1e3, Link("b", "a"): 3e3}
FREE = PeriodicMarch(Jenkins(stiffness=1e3, friction=0.0, normal_load=10.0))
SLIDER = PeriodicMarch(Jenkins(stiffness=2e3, friction=0.5, normal_load=10.0))


def two_masses(**damping):
    return damped(lumped_rig(MASSES, SPRINGS, [[Link("b")]], 0.01), **damping)


def problem(model, joints=FREE, harmonics=(1,), samples=256):
    load = PeriodicLoad({1: -1j * unit_force(model, "a")})
    return HarmonicBalance(model, joints, load, Resolution(harmonics, samples))


@pytest.mark.parametrize(
    "damping",
    [
        {"dashpots": {Link("a"): 0.1, Link("b", "a"): 0.3}},
        {"mass_factor": 20.0, "stiffness_factor": 2e-5},
        {"loss_factor": 0.03},
        {"dashpots": {Link("b"): 0.2}, "loss_factor": 0.03},
    ],
)
def test_linear_responses_are_those_of_the_matrices(damping):
    """Damping that couples the modes is included; at rest structural damping has no effect."""
    model = two_masses(**damping)
    balance = problem(model, harmonics=(0, 1, 3))
    structural = np.zeros((2, 2)) if model.structural is None else model.structural
    for frequency in (30.0, 110.0, 320.0):
        angular = 2.0 * np.pi * frequency
        stiffness = model.stiffness + 1j * structural + 1j * angular * model.damping
        wanted = np.linalg.solve(stiffness - angular**2 * model.mass, [-5j, 0.0])
        motion = balance.solve(frequency, 5.0)
        np.testing.assert_allclose(motion.motion[1], wanted, rtol=1e-10)
        np.testing.assert_allclose(motion.motion[[0, 2]], 0.0, atol=1e-15)
        work = np.pi * 5.0 * -motion.amplitude(0).real
        assert energy_lost(balance, motion) == pytest.approx(work, rel=1e-9)


def test_work_balances_losses_with_friction_and_a_loss_factor():
    """The motion has several harmonics.

    Structural damping dissipates the same in each cycle, at any frequency.
    """
    model = two_masses(loss_factor=0.05, dashpots={Link("b", "a"): 0.05})
    balance = problem(model, SLIDER, harmonics=(1, 3, 5, 7), samples=4096)
    motion = balance.solve(140.0, 20.0)
    assert motion.converged
    assert motion.cycle.dissipated[0] > 0.1
    work = np.pi * 20.0 * -motion.amplitude(0).real
    assert energy_lost(balance, motion) == pytest.approx(work, rel=1e-5)


def test_derivatives_include_structural_damping():
    model = two_masses(loss_factor=0.1, dashpots={Link("b"): 0.1})
    balance = problem(model, SLIDER, harmonics=(0, 1, 3))
    motion = balance.solve(140.0, 20.0)
    unknowns, step = motion.coefficients.ravel(), 1e-5
    at = balance.evaluate(unknowns, 140.0, 20.0, "frequency")
    ahead, behind = (
        balance.evaluate(unknowns, 140.0 + sign * step, 20.0, "frequency").residual
        for sign in (1.0, -1.0)
    )
    np.testing.assert_allclose(at.slope, (ahead - behind) / (2.0 * step), rtol=1e-5, atol=1e-10)


def test_equivalent_damping_is_half_the_loss_factor():
    """At phase resonance of one mass without friction, the amplitude is F / (η k) and ζ = η / 2."""
    rig = lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]])
    load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    balance = HarmonicBalance(damped(rig, loss_factor=0.04), FREE, load, Resolution((1,), 64))
    start = balance.solve(158.0, 2.0)
    backbone = along_phase_resonance(balance, start, (1.0, 4.0))
    np.testing.assert_allclose(backbone.frequencies, natural_frequencies(rig)[0], rtol=1e-9)
    np.testing.assert_allclose(
        backbone.first_amplitudes(0), backbone.forces / (0.04 * 1e3), rtol=1e-9
    )
    assert damping_ratio(balance, backbone.solutions[0]) == pytest.approx(0.02, rel=1e-9)


def test_modal_ratios_and_rayleigh_factors():
    model = lumped_rig(MASSES, SPRINGS, [[Link("b")]], np.array([0.01, 0.04]))
    squares, shapes = sl.eigh(model.stiffness, model.mass)
    of_modes = np.diag(shapes.T @ model.damping @ shapes) / (2.0 * np.sqrt(squares))
    np.testing.assert_allclose(of_modes, [0.01, 0.04], rtol=1e-9)
    one = lumped_rig(MASSES, SPRINGS, [[Link("b")]], np.array([0.02]))
    np.testing.assert_allclose(
        one.damping, lumped_rig(MASSES, SPRINGS, [[Link("b")]], 0.02).damping
    )
    frequencies = np.sqrt(squares) / (2.0 * np.pi)
    alpha, beta = rayleigh_factors(frequencies, np.array([0.01, 0.02]))
    none = lumped_rig(MASSES, SPRINGS, [[Link("b")]])
    again = damped(none, mass_factor=alpha, stiffness_factor=beta).damping
    ratios = np.diag(shapes.T @ again @ shapes) / (2.0 * np.sqrt(squares))
    np.testing.assert_allclose(ratios, [0.01, 0.02], rtol=1e-9)


def test_invalid_damping_is_refused():
    model = two_masses()
    for wrong in ({"mass_factor": -1.0}, {"loss_factor": -0.1}, {"dashpots": {Link("a"): -1.0}}):
        with pytest.raises(RigError, match="damping below zero"):
            damped(model, **wrong)
    with pytest.raises(RigError, match="no point 'c'"):
        damped(model, dashpots={Link("c"): 1.0})
    with pytest.raises(RigError, match="3 damping ratios for 2 modes"):
        lumped_rig(MASSES, SPRINGS, [[Link("b")]], np.array([0.1, 0.1, 0.1]))
    with pytest.raises(ValueError, match="structural damping"):
        integrate(two_masses(loss_factor=0.1), None, None, 0.1, TimeStepControl(1e-3))


def test_dashpots_are_separated_from_modal_damping():
    """A row of 20 masses with three dashpots responds as with the full matrix, at resonance too."""
    names = [f"m{number}" for number in range(20)]
    springs = {Link(name, before): 1e3 for name, before in zip(names, [None, *names], strict=False)}
    dashpots = {Link("m3"): 0.5, Link("m9", "m4"): 2.0, Link("m19"): 1e3}
    for ratio in (0.002, 0.0):
        row = lumped_rig(dict.fromkeys(names, 1e-3), springs, [[Link("m19")]], ratio)
        natural = natural_frequencies(row)
        model = damped(row, loss_factor=0.01 * (ratio > 0.0), dashpots=dashpots)
        apart, whole = Receptance(model), Receptance(replace(model, dashpots=None))
        force = np.arange(60.0).reshape(3, 20) + 1j
        # At the natural frequency of a mode with no other damping, the dashpots cannot be
        # separated.
        at_resonance = MixedModes if ratio == 0.0 else ModesWithDashpots
        for frequency, way in ((17.0, ModesWithDashpots), (natural[2], at_resonance)):
            angular = 2.0 * np.pi * frequency * np.array([1.0, 3.0, 5.0])
            assert isinstance(apart.inverse_at(angular), way)
            assert isinstance(whole.inverse_at(angular), MixedModes)
            steady, wanted = apart.at(angular), whole.at(angular)
            response = wanted.vibrate(force)
            stiffness = np.diag(whole.squares - angular[0] ** 2) + 1j * (
                angular[0] * whole.damping + whole.loss
            )
            np.testing.assert_allclose(stiffness @ response[0], force[0], rtol=1e-9)
            scale = np.abs(response).max()
            np.testing.assert_allclose(steady.vibrate(force), response, atol=1e-10 * scale)
            # Constant forces are not affected by damping: the mean has an inverse of its own.
            still, with_mean = np.insert(force, 0, 1.0, axis=0), np.insert(angular, 0, 0.0)
            np.testing.assert_allclose(whole.at(with_mean).respond(still)[1:], response)
            alone = whole.at(np.zeros(1)).respond(still[:1])
            np.testing.assert_allclose(alone[0], 1.0 / whole.squares, rtol=1e-9)
            between = wanted.between_joints()
            np.testing.assert_allclose(steady.between_joints(), between, rtol=1e-8)
            slope = wanted.stiffness_slope(response)
            np.testing.assert_allclose(
                steady.stiffness_slope(response), slope, atol=1e-10 * np.abs(slope).max()
            )
