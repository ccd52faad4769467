"""Phase resonance and damping against closed forms and exact time integration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.forced_response import along_frequency
from fe_models.dynamics.curves.motion_recorder import Accuracy
from fe_models.dynamics.curves.phase_resonance import PhaseResonance, along_phase_resonance
from fe_models.dynamics.excitation import HarmonicForce
from fe_models.dynamics.periodic import harmonic_balance
from fe_models.dynamics.periodic.cycle_energy import (
    damping_ratio,
    energy_lost,
    largest_kinetic_energy,
)
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import HarmonicBalanceError, Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import Link, lumped_rig, natural_frequencies, unit_force
from tests.fe_models.dynamics.harmonic_rigs import rig
from tests.marks import slow
from tests.oracles.cubic_springs import CubicSprings
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from wear.joints.friction_contact import FrictionContact
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import SLIP, STICK, PeriodicMarch

# Error of a motion whose equations are solved to 1e-10, with a joint that changes its state.
SOLVED = 1e-8
KT, LIMIT = 45e3, 0.88 * 60.0
ODD = tuple(range(1, 16, 2))
# Duration after which the rig, damped by 2 %, has settled to 1e-3.
PERIODS = 20
# Step sizes that resolve a peak.
CLOSE = ContinuationControl(most=0.05)


def oscillator(ratio):
    return lumped_rig({"m": 2e-3}, {Link("m"): 800.0}, [[Link("m")]], ratio)


def balance(model, law, harmonics, samples, load=None):
    load = load or PeriodicLoad({1: -1j * unit_force(model, model.names[0])})
    joints = law if hasattr(law, "settle") else PeriodicMarch(law)
    return HarmonicBalance(model, joints, load, Resolution(harmonics, samples))


def on_rig(harmonics=ODD, samples=256, ratio=0.001):
    return balance(rig(ratio), Jenkins(KT, 0.88, 60.0), harmonics, samples)


def peak(problem, force, span, place=0):
    """Return the motion of a response with the largest amplitude of a degree of freedom."""
    branch = along_frequency(problem, force, span, control=CLOSE)
    return max(branch.solutions, key=lambda solution: abs(solution.amplitude(place)))


def cotangent(problem, solution):
    """Return the cotangent of the phase at the force's own points."""
    seen = np.vdot(problem.load.waves[1], solution.motion[solution.resolution.harmonics.index(1)])
    return seen.real / seen.imag


def pressed_block(joints=3):
    """Return a block that only its contacts hold along z, pressed on them and shaken along x.

    Its contacts are on springs of their own; one more mode has its own damping.
    """
    masses = dict.fromkeys(("x", "y", "z"), 0.002)
    springs = {Link("x"): 500.0, Link("y", "x"): 800.0}
    links = []
    for joint in range(joints):
        points = [f"{name}{joint}" for name in ("x", "y", "z")]
        masses |= dict.fromkeys(points, 2e-05)
        springs |= {Link(point, point[0]): 900.0 + 100.0 * joint for point in points}
        links.append([Link(point) for point in points])
    model = lumped_rig(masses, springs, links, 0.01)
    damping = model.damping.copy()
    damping[0, 0] += 0.02
    return replace(model, damping=damping)


def block_problem(harmonics=(0, 1, 2, 3), samples=64, wave=1.0 - 2.0j):
    model = pressed_block()
    gaps = np.array([0.0, 0.001, 0.002])
    law = FrictionContact(300.0, 400.0, 0.5, gap=gaps)
    normal = unit_force(model, "z")
    load = PeriodicLoad({1: wave * (unit_force(model, "x") + 0.05 * normal)}, 12.0 * normal)
    return balance(model, law, harmonics, samples, load)


# --- Derivatives


@pytest.mark.parametrize(("case", "seen"), [("rig", None), ("rig", "m2"), ("block", "z1")])
def test_derivatives_of_the_equations(case, seen):
    if case == "rig":
        problem, size, force = on_rig((1, 3, 5), 64, 0.02), 3.0 * LIMIT / KT, 60.0
    else:
        problem, size, force = block_problem(), 0.02, 9.0
    seen = seen and unit_force(problem.model, seen)
    start = problem.solve(70.0, force)
    assert start.converged
    equations = PhaseResonance.near(problem, start, seen)
    rng = np.random.default_rng(3)
    place = np.append(problem.guess(start), 0.1 * equations.scale)
    place[:-1] += 0.3 * size * rng.standard_normal(problem.size)
    at, step = equations(place, force), 1e-6 * size
    for direction in np.eye(len(place)):
        upper = equations(place + step * direction, force).residual
        lower = equations(place - step * direction, force).residual
        wanted, derivative = (upper - lower) / (2.0 * step), at.jacobian @ direction
        np.testing.assert_allclose(
            derivative[:-1], wanted[:-1], atol=1e-6 * np.abs(wanted[:-1]).max()
        )
        np.testing.assert_allclose(
            derivative[-1], wanted[-1], atol=1e-6 * np.abs(at.jacobian[-1]).max()
        )
    rise = 1e-5 * force
    ends = [equations(place, force + way).residual for way in (rise, -rise)]
    wanted = (ends[0] - ends[1]) / (2.0 * rise)
    np.testing.assert_allclose(at.slope[:-1], wanted[:-1], atol=1e-7 * np.abs(wanted[:-1]).max())
    assert at.slope[-1] == pytest.approx(wanted[-1], rel=1e-7)


@pytest.mark.slow
def test_products_with_the_jacobian_are_those_of_the_matrix(monkeypatch):
    """With several contacts, the backbone is the same if no matrix is assembled."""
    problem = block_problem()
    start = along_frequency(problem, 9.0, (40.0, 140.0))
    wanted = along_phase_resonance(problem, start, (4.0, 12.0))
    assert wanted.message == ""
    states = [set(np.unique(solution.cycle.states)) for solution in wanted.solutions]
    assert set.union(*states) == {STICK, SLIP}
    first = wanted.solutions[len(wanted.solutions) // 2]
    equations = PhaseResonance.near(problem, first)
    place = np.append(problem.guess(first), 0.02 * equations.scale)
    matrix = equations(place, 9.0).jacobian
    monkeypatch.setattr(harmonic_balance, "DENSE", 0)
    products = equations(place, 9.0).jacobian
    assert not isinstance(products, np.ndarray)
    np.testing.assert_allclose(products.assembled(), matrix, atol=1e-12 * np.abs(matrix).max())
    vector = np.random.default_rng(6).standard_normal(len(place))
    product = matrix @ vector
    np.testing.assert_allclose(products @ vector, product, atol=1e-12 * np.abs(product).max())
    # The border is eliminated exactly, whatever the preconditioner of the inner matrix.
    undone, inner = products.precondition(vector), products.inner.precondition
    assert matrix[-1] @ undone == pytest.approx(vector[-1], rel=1e-9)
    wanted_inner = inner(vector[:-1]) - undone[-1] * inner(matrix[:-1, -1])
    np.testing.assert_allclose(undone[:-1], wanted_inner, atol=1e-12 * np.abs(undone).max())
    branch = along_phase_resonance(problem, start, (4.0, 12.0))
    assert branch.message == ""
    for end, other in zip((0, -1), (0, -1), strict=True):
        one, two = wanted.solutions[end], branch.solutions[other]
        assert two.frequency == pytest.approx(one.frequency, rel=SOLVED)
        np.testing.assert_allclose(two.motion, one.motion, atol=1e-7 * np.abs(one.motion).max())


# --- Closed forms


@pytest.mark.parametrize(
    ("ratio", "off"), [(1e-6, 1.02), (1e-6, 0.9999), (1e-3, 0.95), (1e-3, 1.05), (0.2, 1.3)]
)
def test_linear_oscillator(ratio, off):
    """The backbone is the natural frequency, also from many half-power widths away."""
    model, force = oscillator(ratio), 2.0
    natural = natural_frequencies(model)[0]
    problem = balance(model, Jenkins(1500.0, 0.0, 10.0), (1, 3), 64)
    start = problem.solve(off * natural, force)
    backbone = along_phase_resonance(problem, start, (0.01, 300.0))
    assert backbone.message == ""
    assert backbone.forces[[0, -1]].tolist() == [0.01, 300.0]
    assert np.all(np.diff(backbone.forces) > 0.0)
    np.testing.assert_allclose(backbone.frequencies, natural, rtol=1e-11)
    wanted = backbone.forces / (2.0 * ratio * 800.0)
    np.testing.assert_allclose(backbone.first_amplitudes(0), wanted, rtol=1e-9)
    for solution in backbone.solutions:
        assert damping_ratio(problem, solution) == pytest.approx(ratio, rel=1e-9)
        omega, amplitude = 2.0 * np.pi * natural, abs(solution.amplitude(0))
        kinetic = 0.5 * 2e-3 * (omega * amplitude) ** 2
        assert largest_kinetic_energy(problem, solution) == pytest.approx(kinetic, rel=1e-9)


def test_duffing_oscillator():
    """On the backbone m ω² = k + ¾ κ a² and c ω a = F: it has no folds, unlike its responses."""
    model = lumped_rig({"m": 1e-3}, {Link("m"): 40.0}, [[Link("m")]], 0.02)
    problem = balance(model, CubicSprings(100.0), (1,), 16)
    start = peak(problem, 1.5, (10.0, 60.0))
    backbone = along_phase_resonance(problem, start, (0.05, 6.0))
    assert backbone.message == ""
    omega, sizes = 2.0 * np.pi * backbone.frequencies, backbone.first_amplitudes(0)
    np.testing.assert_allclose(1e-3 * omega**2, 40.0 + 75.0 * sizes**2, rtol=SOLVED)
    np.testing.assert_allclose(model.damping[0, 0] * omega * sizes, backbone.forces, rtol=SOLVED)
    assert np.all(np.diff(backbone.frequencies) > 0.0)


def test_jenkins_oscillator_of_one_harmonic():
    """The law's first harmonic A cos - B sin gives m ω² a = k a + A(a) and F = c ω a + B(a).

    The samples cause errors of 1e-9.
    """
    model, law = oscillator(0.02), Jenkins(1500.0, 0.5, 10.0, 30.0)
    problem = balance(model, law, (1,), 65536)
    start = peak(replaced(problem, 256), 6.0, (80.0, 200.0))
    backbone = along_phase_resonance(
        problem, start, (0.1, 12.0), control=ContinuationControl(most=0.1)
    )
    assert backbone.message == ""
    omega, sizes = 2.0 * np.pi * backbone.frequencies, backbone.first_amplitudes(0)
    cosine, sine = law.first_harmonic(sizes)
    np.testing.assert_allclose(2e-3 * omega**2 * sizes, 800.0 * sizes + cosine, rtol=SOLVED)
    lost = model.damping[0, 0] * omega * sizes - sine
    np.testing.assert_allclose(lost, backbone.forces, rtol=1e-7)
    stuck, sliding = (800.0 + 1530.0) / 2e-3, (800.0 + 30.0) / 2e-3
    assert omega[0] == pytest.approx(np.sqrt(stuck), rel=SOLVED)
    assert np.sqrt(sliding) < omega[-1] < 1.05 * np.sqrt(sliding)
    for solution, way, speed in zip(backbone.solutions, sizes, omega, strict=True):
        energy = np.pi * model.damping[0, 0] * speed * way**2 + law.loop_energy(way)
        wanted = energy / (2.0 * np.pi * 2e-3 * (speed * way) ** 2)
        assert damping_ratio(problem, solution) == pytest.approx(wanted, rel=1e-7)


def replaced(problem, samples):
    return problem.with_resolution(Resolution(problem.resolution.harmonics, samples))


def test_only_friction_damps():
    """With F = 4 µN (1 - µN/(kt a))/π, amplitudes grow without bound as F approaches 4 µN/π."""
    model, law = oscillator(0.0), Jenkins(1500.0, 0.5, 10.0)
    problem, bound = balance(model, law, (1,), 4096), 4.0 * 5.0 / np.pi
    start = peak(problem, 0.5 * bound, (80.0, 200.0))
    backbone = along_phase_resonance(problem, start, (0.01 * bound, 0.95 * bound))
    assert backbone.message == ""
    wanted = (5.0 / 1500.0) / (1.0 - backbone.forces / bound)
    # The force has a corner twice per period: the error of 4096 samples is of second order.
    np.testing.assert_allclose(backbone.first_amplitudes(0), wanted, rtol=1e-5)
    control = ContinuationControl(max_points=60)
    beyond = along_phase_resonance(problem, start, (0.5 * bound, 2.0 * bound), control=control)
    assert "at increasing force" in beyond.message
    assert np.all(beyond.forces < 1.00001 * bound)


# --- The rig


def test_rig_of_one_harmonic_falls_from_stuck_to_sliding():
    """A spring and a dashpot replace the joint by its first harmonic at its amplitude."""
    problem, model, law = on_rig((1,), 4096), rig(), Jenkins(KT, 0.88, 60.0)
    start = peak(problem, 50.0, (20.0, 400.0))
    backbone = along_phase_resonance(problem, start, (1.0, 90.0))
    assert backbone.message == ""
    assert backbone.forces[[0, -1]].tolist() == [1.0, 90.0]
    assert np.all(np.diff(backbone.forces) > 0.0)
    assert np.all(np.diff(backbone.frequencies) < 0.0)
    stuck, free = natural_frequencies(model, KT)[0], natural_frequencies(model)[0]
    assert stuck > backbone.frequencies[0] > 0.998 * stuck
    assert free < backbone.frequencies[-1] < 1.0001 * free

    def motion(frequency, joint):
        omega = 2.0 * np.pi * frequency
        dynamic = model.stiffness + 1j * omega * model.damping - omega**2 * model.mass
        return np.linalg.solve(dynamic + np.diag([0.0, joint]), [1.0, 0.0])

    for solution in backbone.solutions:
        amplitude = abs(solution.amplitude(1))
        cosine, sine = law.first_harmonic(amplitude)
        joint = (cosine - 1j * sine) / amplitude
        ends = 0.99 * solution.frequency, 1.01 * solution.frequency
        frequency = brentq(lambda f, k=joint: motion(f, k)[0].real, *ends, xtol=1e-12)
        # The samples cause an error of 1e-7 of the joint's force, over 2ζ = 0.002 at least.
        assert solution.frequency == pytest.approx(frequency, rel=1e-6)
        force = amplitude / abs(motion(frequency, joint)[1])
        assert solution.force == pytest.approx(force, rel=1e-4)


@pytest.mark.parametrize("given", ["peak", "response"])
@pytest.mark.parametrize("force", [10.0, slow(50.0), 90.0])
def test_any_response_leads_to_the_backbone(force, given):
    problem = on_rig((1, 3, 5))
    response = along_frequency(problem, force, (20.0, 400.0))
    highest = peak(problem, force, (20.0, 400.0))
    start = response if given == "response" else highest
    backbone = along_phase_resonance(problem, start, (1.0, 90.0))
    assert backbone.message == ""
    same = np.flatnonzero(backbone.forces == force)
    assert len(same) == 1
    assert backbone.frequencies[same[0]] == pytest.approx(highest.frequency, rel=0.03)
    assert np.all(np.diff(backbone.frequencies) < 0.0)
    for solution in backbone.solutions:
        assert abs(cotangent(problem, solution)) <= 1e-8
        assert solution.residual <= 1e-10


def work_of_forces(problem, solution):
    """Return -π a Σ k Im(w_kᴴ x_k), the work of the periodic forces in a period."""
    work = 0.0
    for harmonic, wave in problem.load.waves.items():
        moved = solution.motion[solution.resolution.harmonics.index(harmonic)]
        work -= np.pi * harmonic * float(np.vdot(wave, moved).imag)
    return solution.force * work


@pytest.mark.slow
def test_power_balances_with_the_samples():
    """The joint's dissipation is summed sample by sample, with an error of second order."""
    left = []
    for samples in (128, 256, 512, 1024):
        problem = on_rig((1, 3, 5), samples)
        backbone = along_phase_resonance(problem, peak(problem, 30.0, (20.0, 400.0)), (1.0, 90.0))
        works = np.array([work_of_forces(problem, s) for s in backbone.solutions])
        lost = np.array([energy_lost(problem, s) for s in backbone.solutions])
        sizes = backbone.first_amplitudes(0)
        np.testing.assert_allclose(works, np.pi * backbone.forces * sizes, rtol=1e-12)
        left.append(np.abs(lost / works - 1.0).max())
    assert left[-1] < 2e-5
    rate = np.log2(left[0] / left[-1]) / 3.0
    assert rate > 1.5


@pytest.mark.slow
@pytest.mark.parametrize("place", ["before", "folded back"])
def test_motion_in_time_has_the_phase(place):
    """Event-driven integration of the rig under a force and a frequency of the backbone.

    Where 5 f is the resonance of the stuck rig, the backbone folds back to forces that it has
    passed: the motion there is as real as elsewhere. Differences are due to harmonics above 31, and
    are largest in the velocities of the kinetic energy.
    """
    model, samples = rig(0.02), 256
    problem = on_rig(tuple(range(1, 32, 2)), 1024, 0.02)
    start = along_frequency(problem, 54.0, (20.0, 400.0))
    backbone = along_phase_resonance(problem, start, (54.0, 70.0))
    assert backbone.message == ""
    solution = backbone.solutions[0]
    if place == "folded back":
        falling = np.flatnonzero(np.diff(backbone.forces) < 0.0)
        most_damped = np.argmax([damping_ratio(problem, s) for s in backbone.solutions])
        solution = backbone.solutions[most_damped]
        assert backbone.forces[falling[0]] > solution.force + 3.0
        assert falling[0] < most_damped
    assert solution.left_out < 2e-3
    motion = integrate_exactly(
        model,
        SliderJoints(np.array([KT]), np.array([LIMIT]), np.zeros(1)),
        HarmonicForce(unit_force(model, "m1"), solution.force, solution.frequency),
        PERIODS / solution.frequency,
        1.0 / (samples * solution.frequency),
    )
    last = slice(-samples - 1, -1)
    turns = np.exp(-2j * np.pi * np.arange(samples) / samples)
    amplitude = 2.0 / samples * turns @ motion.displacement[last, 0]
    # The force is a sine: a displacement that lags it by a quarter is a negative cosine.
    assert amplitude.real < 0.0
    assert abs(amplitude.imag / amplitude.real) < 2e-3
    assert abs(amplitude) == pytest.approx(abs(solution.amplitude(0)), rel=3e-3)
    lost = np.diff(motion.energies.joints[[-samples - 1, -1], 0])[0]
    assert solution.cycle.dissipated[0] == pytest.approx(lost, rel=3e-3)
    velocity = motion.velocity[last]
    kinetic = 0.5 * np.einsum("ti,ij,tj->t", velocity, model.mass, velocity).max()
    assert largest_kinetic_energy(problem, solution) == pytest.approx(kinetic, rel=1e-2)


def test_the_output_decides_on_the_phase():
    """The default is the force's own point; another displacement lags by a quarter elsewhere."""
    problem, model = on_rig((1, 3), ratio=0.05), rig(0.05)
    start = peak(problem, 40.0, (20.0, 400.0))
    wanted = along_phase_resonance(problem, start, (20.0, 60.0))
    same = along_phase_resonance(problem, start, (20.0, 60.0), 3.0 * unit_force(model, "m1"))
    np.testing.assert_allclose(same.frequencies, wanted.frequencies, rtol=1e-9)
    other = along_phase_resonance(problem, start, (20.0, 60.0), unit_force(model, "m2"))
    assert other.message == ""
    for solution in other.solutions:
        lag = solution.amplitude(1) / -1j
        assert abs(lag.real / lag.imag) <= 1e-8
        assert abs(cotangent(problem, solution)) > 1e-3


def test_harmonics_and_samples_grow_to_a_tolerance():
    problem = on_rig((1,), 64, 0.02)
    start = peak(problem, 40.0, (20.0, 400.0))
    backbone = along_phase_resonance(problem, start, (10.0, 50.0), accuracy=Accuracy(3e-3))
    assert backbone.message == ""
    assert all(s.error.largest <= 3e-3 for s in backbone.solutions)
    fine = on_rig(tuple(range(1, 42, 2)), 2048, 0.02)
    for solution in (backbone.solutions[0], backbone.solutions[-1]):
        exact = along_phase_resonance(fine, solution, (solution.force, 50.0)).solutions[0]
        assert solution.frequency == pytest.approx(exact.frequency, rel=1e-2)


def test_a_response_starts_at_its_largest_passage():
    """Between two resonances the phase is passed once more, with hardly any motion."""
    model = rig()
    problem = balance(model, Jenkins(KT, 0.0, 60.0), (1,), 64)
    natural = natural_frequencies(model)
    response = along_frequency(problem, 1.0, (20.0, 3000.0), control=CLOSE)
    seen = np.array([cotangent(problem, solution) for solution in response.solutions])
    passed = response.frequencies[:-1][seen[:-1] * seen[1:] < 0.0]
    still = np.sqrt(273e3 / 1.189e-3) / (2.0 * np.pi)
    np.testing.assert_allclose(passed, [natural[0], still, natural[1]], rtol=CLOSE.most)
    backbone = along_phase_resonance(problem, response, (0.5, 2.0))
    np.testing.assert_allclose(backbone.frequencies, natural[0], rtol=1e-5)
    above = along_frequency(problem, 1.0, (60.0, 3000.0), control=CLOSE)
    second = along_phase_resonance(problem, above, (0.5, 2.0))
    np.testing.assert_allclose(second.frequencies, natural[1], rtol=1e-4)
    below = along_frequency(problem, 1.0, (10.0, 30.0))
    nowhere = along_phase_resonance(problem, below, (0.5, 2.0))
    assert nowhere.solutions == ()
    assert "does not pass through phase resonance" in nowhere.message


# --- No phase resonance


def test_starts_without_phase_resonance_are_reported():
    undamped = balance(oscillator(0.0), Jenkins(1500.0, 0.0, 10.0), (1,), 64)
    nothing = along_phase_resonance(undamped, undamped.solve(90.0, 1.0), (0.5, 2.0))
    assert nothing.solutions == ()
    assert "no phase resonance is found under 1 N from 90 Hz" in nothing.message
    problem = balance(oscillator(1e-4), Jenkins(1500.0, 0.0, 10.0), (1,), 64)
    far = along_phase_resonance(problem, problem.solve(5.0, 1.0), (0.5, 2.0))
    assert far.solutions == ()
    assert "nearer to the peak" in far.message
    failed = replace(problem.solve(100.0, 1.0), message="it is not")
    assert "the start is not a" in along_phase_resonance(problem, failed, (0.5, 2.0)).message


def test_invalid_arguments_are_refused():
    problem, model = on_rig((1, 3)), rig()
    start = problem.solve(100.0, 10.0)
    for forces in ((0.0, 20.0), (20.0, 30.0), (1.0, 5.0)):
        with pytest.raises(HarmonicBalanceError, match="include the start's"):
            along_phase_resonance(problem, start, forces)
    for seen in (np.zeros(2), np.ones(3)):
        with pytest.raises(HarmonicBalanceError, match="not zero"):
            along_phase_resonance(problem, start, (1.0, 20.0), seen)
    third = balance(model, Jenkins(KT, 0.88, 60.0), (1, 3), 64, PeriodicLoad({3: np.ones(2)}))
    with pytest.raises(HarmonicBalanceError, match="no harmonic 1"):
        along_phase_resonance(third, start, (1.0, 20.0))
    turning = PeriodicLoad({1: np.array([1.0, 1j])})
    spread = balance(model, Jenkins(KT, 0.88, 60.0), (1, 3), 64, turning)
    with pytest.raises(HarmonicBalanceError, match="several phases"):
        along_phase_resonance(spread, start, (1.0, 20.0), unit_force(model, "m1"))
    branch = along_phase_resonance(spread, peak(spread, 10.0, (150.0, 300.0)), (1.0, 20.0))
    assert branch.message == ""


# --- Energies


def test_largest_kinetic_energy_of_many_harmonics():
    """Values at many times of a period approach it from below."""
    problem = on_rig(ODD, 256)
    solution = problem.solve(47.0, 60.0)
    velocity = solution.velocity(20000)
    energies = 0.5 * np.einsum("ti,ij,tj->t", velocity, problem.model.mass, velocity)
    largest = largest_kinetic_energy(problem, solution)
    assert largest >= energies.max() * (1.0 - 1e-12)
    assert largest == pytest.approx(energies.max(), rel=1e-5)


def test_a_structure_at_rest_has_no_damping():
    problem = on_rig((1, 3))
    still = problem.solve(50.0, 0.0)
    assert damping_ratio(problem, still) == 0.0
    assert energy_lost(problem, still) == 0.0
