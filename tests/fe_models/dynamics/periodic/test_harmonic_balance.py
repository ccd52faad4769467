"""Harmonic balance against closed forms, linear limits and exact integration in time."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fe_models.dynamics.curves.forced_response import along_force, along_frequency
from fe_models.dynamics.curves.motion_recorder import Accuracy
from fe_models.dynamics.excitation import HarmonicForce
from fe_models.dynamics.periodic import harmonic_balance, harmonic_jacobian, modal_inverse
from fe_models.dynamics.periodic.cycle_energy import energy_lost
from fe_models.dynamics.periodic.harmonic_jacobian import HarmonicJacobian
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.periodic.receptance import Receptance, ReceptanceError
from fe_models.dynamics.periodic.resolution_error import resolution_error
from fe_models.dynamics.periodic.static_residual import AT_REST, ResidualReceptance, modes_that_move
from fe_models.dynamics.rig import Link, lumped_rig, natural_frequencies, unit_force
from tests.fe_models.dynamics.harmonic_rigs import (
    EXACT,
    KT,
    LOAD,
    MU,
    ODD,
    REACH,
    balance,
    contact_rig,
    pressed,
    rig,
    sine,
)
from tests.oracles.cubic_springs import CubicSprings
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import STICK, PeriodicMarch


def mixed_rig():
    """Return a rig whose joint alone holds it along z, with damping that couples modes."""
    names = ("x", "y", "z")
    model = lumped_rig(
        dict(zip(names, (2e-3, 3e-3, 1e-3), strict=True)),
        {Link("x"): 500.0, Link("y", "x"): 800.0},
        [[Link(name) for name in names]],
        0.01,
    )
    return replace(model, damping=model.damping + np.diag([0.05, 0.0, 0.02]))


def mixed_problem():
    model = mixed_rig()
    load = PeriodicLoad(
        {1: unit_force(model, "x") * (1.0 - 2j), 2: unit_force(model, "z") * 3.0},
        4.0 * unit_force(model, "z"),
    )
    joints = PeriodicMarch(FrictionContact(300.0, 400.0, 0.5, gap=0.001))
    return balance(model, joints, (0, 1, 2, 3), 64, load)


# --- Receptances


@pytest.mark.parametrize("damping", ["modal", "mixed"])
def test_receptances_are_the_inverse_of_the_dynamic_stiffness(damping):
    model = rig(0.02)
    if damping == "mixed":
        model = replace(model, damping=model.damping + np.diag([0.3, 0.0]))
    receptance = Receptance(model)
    angular = np.array([0.0, 100.0, 1300.0, 16000.0])
    load = unit_force(model, "m1")
    modal = np.tile(load @ receptance.at_points, (4, 1)).astype(complex)
    steady = receptance.at(angular)
    motion = steady.respond(modal) @ receptance.at_points.T
    between = steady.between_joints()
    for place, omega in enumerate(angular):
        stiffness = model.stiffness + 1j * omega * model.damping - omega**2 * model.mass
        inverse = np.linalg.inv(stiffness)
        np.testing.assert_allclose(motion[place], inverse @ load, rtol=EXACT)
        wanted = model.connection @ inverse @ model.connection.T
        np.testing.assert_allclose(between[place], wanted, rtol=EXACT)


def test_modes_far_above_the_forces_respond_quasistatically():
    """A chain of 40 masses has a few slow modes; all others are in error by (ω/ω_n)²."""
    names = [f"m{place}" for place in range(40)]
    springs = {Link(name): 1e5 * 1.4**place for place, name in enumerate(names)}
    springs |= {Link(one, other): 1e6 for one, other in pairwise(names)}
    model = lumped_rig(
        dict.fromkeys(names, 1e-3), springs, [[Link("m0")], [Link("m7")], [Link("m39")]], 0.02
    )
    receptance, resolution = Receptance(model), Resolution((0, 1, 3), 16)
    angular = np.array([0.0, 100.0, 300.0])
    moving = modes_that_move(receptance, angular[-1])
    assert 0 < moving < len(names)
    force = np.random.default_rng(3).standard_normal((resolution.size, 2))
    some = np.array([0, 2])
    answer = ResidualReceptance(receptance, resolution, angular, some).respond(force)
    between = receptance.at(angular).between_joints()[:, :, some]
    wanted = resolution.real_from_complex(
        (between @ resolution.complex_from_real(force)[:, :, None])[:, :, 0]
    )
    np.testing.assert_allclose(answer, wanted, atol=AT_REST**-2 * np.abs(wanted).max())


def test_a_structure_that_nothing_holds_is_refused():
    free = lumped_rig({"a": 1e-3, "b": 1e-3}, {}, [[Link("a")]])
    with pytest.raises(ReceptanceError, match="hold it"):
        Receptance(free)
    with pytest.raises(ReceptanceError, match="give every point mass"):
        Receptance(replace(rig(), mass=np.diag([1.0, 0.0])))


# --- Harmonics


@pytest.mark.parametrize("harmonics", [(1,), (0, 1, 2), (1, 3, 7), (0, 5)])
def test_coefficients_and_complex_amplitudes_are_the_same_function_of_time(harmonics):
    resolution = Resolution(harmonics, 32)
    rows = np.random.default_rng(9).standard_normal((resolution.size, 6))
    amplitudes = resolution.complex_from_real(rows)
    turns = 2.0 * np.pi * np.outer(np.arange(32), harmonics) / 32
    in_time = (np.exp(1j * turns) @ amplitudes).real
    np.testing.assert_allclose(resolution.basis @ rows, in_time, atol=1e-13)
    np.testing.assert_allclose(resolution.weights @ in_time, rows, atol=1e-13)
    np.testing.assert_array_equal(resolution.real_from_complex(amplitudes), rows)
    by_joint = np.random.default_rng(10).standard_normal((3, resolution.size, 2))
    again = resolution.coefficients(resolution.amplitudes(by_joint), 2)
    np.testing.assert_array_equal(again, by_joint)


# --- The equations


@pytest.mark.parametrize("varies", ["frequency", "force"])
@pytest.mark.parametrize("case", ["rig", "mixed"])
def test_derivatives_of_the_equations(case, varies):
    if case == "rig":
        problem, size = balance(rig(), harmonics=(1, 3, 5), samples=64), 3.0 * REACH
    else:
        problem, size = mixed_problem(), 0.02
    unknowns = size * np.random.default_rng(3).standard_normal(problem.size)
    step = 1e-7 * size
    at = problem.evaluate(unknowns, 47.0, 2.0, varies)
    wanted = np.empty_like(at.jacobian)
    for place in range(problem.size):
        change = np.zeros(problem.size)
        change[place] = step
        upper = problem.evaluate(unknowns + change, 47.0, 2.0, varies).residual
        lower = problem.evaluate(unknowns - change, 47.0, 2.0, varies).residual
        wanted[:, place] = (upper - lower) / (2.0 * step)
    np.testing.assert_allclose(at.jacobian, wanted, atol=1e-6 * np.abs(wanted).max())
    ends = [(47.0, 2.0 + d) if varies == "force" else (47.0 + d, 2.0) for d in (1e-4, -1e-4)]
    upper, lower = (problem.evaluate(unknowns, *end, varies).residual for end in ends)
    slope = (upper - lower) / 2e-4
    np.testing.assert_allclose(at.slope, slope, atol=1e-7 * np.abs(slope).max())


@pytest.mark.parametrize("case", ["rig", "mixed"])
def test_products_with_the_jacobian_are_those_of_the_matrix(case, monkeypatch):
    """Large problems never assemble the Jacobian, and find the same motion."""
    problem = balance(rig(0.02)) if case == "rig" else mixed_problem()
    motion = 0.01 * np.random.default_rng(5).standard_normal(problem.size)
    force = 60.0 if case == "rig" else 1.0
    matrix = problem.evaluate(motion, 90.0, force, "frequency").jacobian
    wanted = problem.solve(90.0, force)
    assert wanted.converged
    monkeypatch.setattr(harmonic_balance, "DENSE", 0)
    products = problem.evaluate(motion, 90.0, force, "frequency").jacobian
    assert not isinstance(products, np.ndarray)
    vector = np.random.default_rng(6).standard_normal(problem.size)
    np.testing.assert_allclose(
        products @ vector, matrix @ vector, atol=1e-12 * np.abs(matrix @ vector).max()
    )
    solution = problem.solve(90.0, force)
    assert solution.converged
    np.testing.assert_allclose(
        solution.coefficients, wanted.coefficients, atol=1e-8 * np.abs(wanted.coefficients).max()
    )
    branch = along_frequency(problem, force, (85.0, 95.0))
    assert branch.message == ""


@pytest.mark.parametrize("free", [False, True])
def test_stuck_joints_are_preconditioned_by_their_stiffness(free):
    """Where joints act as at rest, the preconditioner is the inverse of the Jacobian."""
    model = contact_rig()
    if not free:
        model = replace(model, stiffness=np.diag([500.0, 700.0, 900.0]))
    load = pressed(model, 8.0, 1.0)
    problem = balance(model, PeriodicMarch(FrictionContact(300.0, 400.0, 0.5)), (0, 1, 2), 64, load)
    assert (problem.transfer.holding_stiffness > 0.0) == free
    motion = problem.solve(30.0, 0.1)
    assert np.all(motion.cycle.states == STICK)
    at = problem.evaluate(motion.coefficients.ravel(), 30.0, 0.1, "frequency")
    products = HarmonicJacobian(problem.transfer, problem.rest, at.steady, at.cycle.jacobian)
    vector = np.random.default_rng(8).standard_normal(problem.size)
    np.testing.assert_allclose(products.precondition(products @ vector), vector, atol=1e-9)
    # The product is exact also where joints act otherwise, and are closer to sliding.
    for factor in (100.0, 1e5):
        moved = motion.coefficients.copy()
        moved[:, 1:] *= factor
        at = problem.evaluate(moved.ravel(), 30.0, 0.1, "frequency")
        products = HarmonicJacobian(problem.transfer, problem.rest, at.steady, at.cycle.jacobian)
        wanted = products.precondition(products @ vector)
        np.testing.assert_allclose(products.preconditioned(vector), wanted, atol=1e-9)
        assert np.abs(wanted - vector).max() > 1e-3
    assert problem.rest.springs_like(at.cycle.jacobian) is problem.rest.sliding


@pytest.mark.parametrize("harmonics", [(1, 3), (0, 1, 2)])
def test_loops_over_few_modes_and_joints_are_the_products_of_many(monkeypatch, harmonics):
    model = contact_rig()
    held = harmonics[0] == 0
    load = pressed(model, 8.0, 1.0) if held else PeriodicLoad({1: unit_force(model, "x")})
    law = FrictionContact(300.0, 400.0, 0.5, normal_load=0.0 if held else 8.0)
    found = []
    for few in (harmonic_jacobian.FEW, -1):
        monkeypatch.setattr(harmonic_jacobian, "FEW", few)
        monkeypatch.setattr(modal_inverse, "FEW", few)
        problem = balance(model, PeriodicMarch(law), harmonics, 64, load)
        unknowns = np.random.default_rng(5).standard_normal(problem.size) * 0.02
        at = problem.evaluate(unknowns, 30.0, 2.0, "frequency")
        shares = problem.describe(unknowns, at, 30.0, 2.0).shares
        found.append((at.residual, at.slope, at.jacobian, shares))
    for loops, products in zip(*found, strict=True):
        np.testing.assert_allclose(loops, products, rtol=0.0, atol=1e-12 * np.abs(products).max())


@pytest.mark.parametrize(("load", "gap"), [(0.0, 0.001), (3.0, 0.0)])
def test_neglected_harmonics_are_the_response_to_their_forces(load, gap):
    """Each neglected harmonic is computed from the Fourier transform of the forces.

    The dynamic stiffness is that with the joint free, or as stiff as at rest: open, or pressed and
    stuck.
    """
    free = np.diag([1300.0, 800.0, 700.0])
    mixed = mixed_rig()
    # Damping does not couple the modes, as assumed for the stiffened structure.
    model = replace(mixed, stiffness=free, damping=1e-4 * free + 0.5 * mixed.mass)
    waves = {1: unit_force(model, "x") * (1.0 - 2j) + unit_force(model, "z") * 3.0}
    joints = PeriodicMarch(FrictionContact(300.0, 400.0, 0.5, normal_load=load, gap=gap))
    still = model.connection.T @ [0.0, 0.0, load]
    problem = balance(model, joints, (0, 1, 3), 64, PeriodicLoad(waves, still))
    motion = problem.solve(40.0, 2.0)
    assert motion.converged
    shares = problem.left_out(motion.coefficients, motion.cycle, 40.0)
    spectrum = np.fft.rfft(motion.cycle.samples[:, 0], axis=0) / 32.0
    spectrum[0] *= 0.5
    vibration = np.linalg.norm(motion.coefficients[:, 1:])
    stuck = model.connection.T @ np.diag([300.0, 300.0, 400.0]) @ model.connection
    assert len(shares) == 32
    for harmonic, share in enumerate(shares):
        omega = 2.0 * np.pi * 40.0 * harmonic
        force = model.connection.T @ spectrum[harmonic]
        sizes = [
            np.linalg.norm(model.connection @ np.linalg.solve(dynamic, force))
            for dynamic in (
                stiffness + 1j * omega * model.damping - omega**2 * model.mass
                for stiffness in (free, free + (stuck if load else 0.0))
            )
        ]
        wanted = 0.0 if harmonic in (0, 1, 3) else max(sizes) / vibration
        assert share == pytest.approx(wanted, rel=1e-9)
    assert motion.left_out == pytest.approx(np.linalg.norm(shares), rel=EXACT)


# --- Linear limits


@pytest.mark.parametrize(("friction", "held", "peak"), [(0.0, 0.0, 39.08), (1e9, KT, 214.38)])
def test_free_and_stuck_rig_are_linear(friction, held, peak):
    model = rig()
    problem = balance(model, PeriodicMarch(Jenkins(KT, friction, LOAD)))
    branch = along_frequency(problem, 10.0, (20.0, 400.0))
    assert branch.message == ""
    sizes = branch.first_amplitudes(1)
    stiffness = model.stiffness + held * model.connection.T @ model.connection
    for solution in branch.solutions:
        omega = 2.0 * np.pi * solution.frequency
        dynamic = stiffness + 1j * omega * model.damping - omega**2 * model.mass
        wanted = np.linalg.solve(dynamic, -10j * unit_force(model, "m1"))
        # Both sides have a residual of 1e-10, which a resonance multiplies by 1/2ζ = 500.
        np.testing.assert_allclose(solution.motion[0], wanted, rtol=2e-7)
        assert np.abs(solution.motion[1:]).max() <= 1e-9 * np.abs(wanted).max()
        assert solution.left_out <= 1e-12
    assert branch.frequencies[np.argmax(sizes)] == pytest.approx(peak, rel=1e-3)
    assert natural_frequencies(model, held)[0] == pytest.approx(peak, abs=5e-3)


def test_without_force_nothing_moves():
    solution = balance(rig()).solve(50.0, 0.0)
    assert solution.converged
    assert not solution.motion.any()
    assert solution.left_out == 0.0


# --- Closed forms of one harmonic


@pytest.mark.parametrize("reaches", [0.5, 1.5, 4.0, 50.0])
def test_jenkins_oscillator_of_one_harmonic(reaches):
    """The closed form gives the force for an amplitude; harmonic balance returns the amplitude."""
    model = lumped_rig({"m": 2e-3}, {Link("m"): 800.0}, [[Link("m")]], 0.02)
    law = Jenkins(1500.0, 0.5, 10.0, 30.0)
    amplitude, frequency = reaches * 5.0 / 1500.0, 120.0
    omega = 2.0 * np.pi * frequency
    cosine, sine_part = law.first_harmonic(amplitude)
    dynamic = 800.0 - 2e-3 * omega**2 + 1j * omega * model.damping[0, 0]
    force = abs(dynamic * amplitude + cosine - 1j * sine_part)
    problem = balance(model, PeriodicMarch(law), (1,), 65536, sine(model, "m"))
    solution = problem.solve(frequency, float(force))
    assert solution.converged
    assert abs(solution.amplitude(0)) == pytest.approx(amplitude, rel=1e-8)
    assert solution.cycle.dissipated[0] == pytest.approx(law.loop_energy(amplitude), rel=1e-7)


@pytest.mark.parametrize("upward", [True, False])
def test_duffing_oscillator_of_one_harmonic_folds_both_ways(upward):
    """At every point ((k + ¾ κ a² - m ω²)² + c² ω²) a² = F², folds included."""
    model = lumped_rig({"m": 1e-3}, {Link("m"): 40.0}, [[Link("m")]], 0.02)
    problem = balance(model, CubicSprings(100.0), (1,), 16, sine(model, "m"))
    force = 1.5
    branch = along_frequency(problem, force, (10.0, 100.0), upward=upward)
    assert branch.message == ""
    assert len(branch.curve.folds) == 2
    for solution in branch.solutions:
        omega, a = 2.0 * np.pi * solution.frequency, abs(solution.amplitude(0))
        elastic = 40.0 + 75.0 * a * a - 1e-3 * omega**2
        balancing = a * np.hypot(elastic, omega * model.damping[0, 0])
        assert balancing == pytest.approx(force, rel=1e-8)
    again = along_frequency(problem, force, (10.0, 100.0), upward=not upward)
    highest = (max(b.first_amplitudes(0)) for b in (branch, again))
    assert next(highest) == pytest.approx(next(highest), rel=2e-3)


def test_force_is_followed_through_folds_too():
    model = lumped_rig({"m": 1e-3}, {Link("m"): 40.0}, [[Link("m")]], 0.02)
    problem = balance(model, CubicSprings(100.0), (1,), 16, sine(model, "m"))
    branch = along_force(problem, 45.0, (0.0, 15.0))
    assert branch.message == ""
    assert len(branch.curve.folds) == 2
    assert branch.forces[-1] == 15.0
    half = along_frequency(problem, 1.5, (10.0, 100.0))
    resumed = along_frequency(
        problem,
        1.5,
        (10.0, 100.0),
        replace(half, curve=replace(half.curve, points=half.curve.points[:20])),
    )
    assert resumed.message == ""
    assert resumed.frequencies[-1] == half.frequencies[-1]


# --- Against time integration


@pytest.mark.slow
@pytest.mark.parametrize(("frequency", "force"), [(100.0, 75.0), (150.0, 40.0)])
def test_rig_against_its_exact_steady_state(frequency, force):
    """The event-driven reference has settled to 1e-12; more harmonics reduce the error to 1e-4."""
    model, samples = rig(0.02), 256
    motion = integrate_exactly(
        model,
        SliderJoints(np.array([KT]), np.array([MU * LOAD]), np.zeros(1)),
        HarmonicForce(unit_force(model, "m1"), force, frequency),
        50.0 / frequency,
        1.0 / (samples * frequency),
    )
    wanted = motion.displacement[-samples - 1 : -1]
    scale = np.abs(wanted).max()
    assert np.abs(motion.displacement[-2 * samples - 1 : -samples - 1] - wanted).max() < EXACT
    errors = []
    for highest, count in ((15, 512), (61, 2048)):
        solution = balance(model, harmonics=tuple(range(1, highest + 1, 2)), samples=count).solve(
            frequency, force
        )
        assert solution.converged
        errors.append(np.abs(solution.displacement(samples) - wanted).max() / scale)
        assert solution.left_out < errors[-1] < 20.0 * solution.left_out
    assert errors[1] <= 1e-4
    lost = np.diff(motion.energies.joints[[-samples - 1, -1], 0])[0]
    assert solution.cycle.dissipated[0] == pytest.approx(lost, rel=1e-4)


# --- Accuracy


def test_twice_as_many_samples_reveal_too_few():
    coarse, fine = balance(rig(), samples=64), balance(rig(), samples=4096)
    rough, exact = coarse.solve(100.0, 75.0), fine.solve(100.0, 75.0)

    error = np.linalg.norm(rough.coefficients - exact.coefficients)
    error /= np.linalg.norm(exact.coefficients)
    estimate = resolution_error(coarse, rough)
    assert estimate.vibration > 1e-3
    assert 0.4 * error < estimate.sampling < 2.5 * error
    assert resolution_error(fine, exact).sampling < 1e-5


def test_harmonics_and_samples_grow_to_a_tolerance():
    model = rig(0.02)
    start = balance(model, harmonics=(1,), samples=64)
    branch = along_frequency(start, 60.0, (80.0, 130.0), accuracy=Accuracy(2e-3))
    assert branch.message == ""
    assert all(s.error.largest <= 2e-3 for s in branch.solutions)
    assert len(branch.problem.resolution.harmonics) > 3
    assert all(k % 2 == 1 for k in branch.problem.resolution.harmonics)
    fine = balance(model, harmonics=tuple(range(1, 62, 2)), samples=2048)
    last = branch.solutions[-1]
    exact = fine.solve(last.frequency, 60.0, last)
    assert abs(last.amplitude(1)) == pytest.approx(abs(exact.amplitude(1)), rel=1e-2)


def reaches_the_end(force, tolerance):
    """Check that the branch of the rig, which has no folds, reaches the far end of its span."""
    span = (20.0, 400.0)
    branch = along_frequency(balance(rig()), force, span, accuracy=Accuracy(tolerance))
    assert branch.message == ""
    assert branch.frequencies[[0, -1]].tolist() == list(span)
    return branch


def test_resolution_that_grows_on_the_way_does_not_turn_a_branch_round():
    """Near 50 N harmonics are added on the way, and the peak moves."""
    branch = reaches_the_end(50.0, 0.1)
    assert branch.curve.folds == ()
    assert len(branch.problem.resolution.harmonics) > len(ODD)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [0.1, 0.03])
@pytest.mark.parametrize("force", [1, 10, 20, 30, 40, 45, 50, 52, 55, 60, 70, 80, 90])
def test_branches_of_all_forces_reach_the_far_end(force, tolerance):
    reaches_the_end(float(force), tolerance)


def test_the_error_of_motions_is_estimated_within_a_factor_of_three():
    """Many harmonics give the true errors of vibration and energy, at 19 of 20 motions."""
    branch = along_frequency(balance(rig()), 30.0, (60.0, 300.0), accuracy=Accuracy(0.05))
    fine = balance(rig(), harmonics=tuple(range(1, 128, 2)), samples=4096)
    ratios = []
    for motion in branch.solutions[::4]:
        exact = fine.solve(motion.frequency, 30.0, motion)
        coefficients = fine.resolution.adopt(motion.coefficients, motion.resolution)
        vibration = np.linalg.norm(coefficients - exact.coefficients)
        vibration /= np.linalg.norm(exact.coefficients)
        energy = abs(motion.cycle.dissipated.sum() - exact.cycle.dissipated.sum())
        true = max(vibration, energy / energy_lost(fine, exact))
        assert true <= 0.1
        if true > 1e-5:
            ratios.append(motion.error.largest / true)
    assert len(ratios) > 20
    assert np.mean((np.array(ratios) > 1.0 / 3.0) & (np.array(ratios) < 3.0)) >= 0.95


def test_resonance_falls_from_stuck_to_sliding_as_the_force_grows():
    peaks, heights = [], []
    for force in (1.0, 10.0, 30.0, 50.0, 90.0):
        branch = along_frequency(balance(rig()), force, (20.0, 400.0))
        assert branch.message == ""
        sizes = branch.first_amplitudes(1) / force
        peaks.append(branch.frequencies[np.argmax(sizes)])
        heights.append(sizes.max())
    assert np.all(np.diff(peaks) < 0.0)
    assert peaks[0] == pytest.approx(214.38, abs=0.5)
    assert peaks[-1] == pytest.approx(39.08, abs=0.1)
    assert 0 < np.argmin(heights) < len(heights) - 1


# --- Mistakes


def test_resolutions_that_cannot_show_the_motion_are_refused():
    with pytest.raises(HarmonicBalanceError, match="cannot show harmonic 7"):
        Resolution((1, 7), 14)
    with pytest.raises(HarmonicBalanceError, match=r"harmonics \[2\]"):
        balance(rig(), load=PeriodicLoad({2: unit_force(rig(), "m1")}))
    with pytest.raises(HarmonicBalanceError, match=r"harmonics \[0\]"):
        balance(rig(), load=PeriodicLoad({1: unit_force(rig(), "m1")}, np.ones(2)))
