"""Tests of the rig of two masses under forces from 1 to 90 N, over all frequencies.

Small forces leave the slider stuck, large ones never; in between, sticking ends near every
resonance and superharmonics meet that of the stuck rig. All motions of every successful branch are
checked against the equations of the structure, in its matrices, and some peaks against exact
integration.
"""

from itertools import pairwise

import numpy as np
import pytest

from fe_models.dynamics.curves.curve_steps import ContinuationControl
from fe_models.dynamics.curves.forced_response import along_frequency
from fe_models.dynamics.excitation import HarmonicForce
from fe_models.dynamics.motion import Start
from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from fe_models.dynamics.rig import natural_frequencies, unit_force
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from tests.oracles.two_mass_rig import two_mass_rig
from wear.joints.jenkins import Jenkins
from wear.joints.periodic.march import PeriodicMarch

pytestmark = pytest.mark.slow

# The rig of cases/rig_two_dof.yaml.
RIG = two_mass_rig((21.152e-3, 1.189e-3), (1.3469e3, 273e3), 0.001)
KT, LIMIT = 45e3, 0.88 * 60.0
SPAN = (20.0, 400.0)
FORCES = (*range(1, 14, 4), *range(16, 50, 6), 53, 55, 57, 58, 60, 63, 66, 67, 68, 70, 76, 83, 90)
STEPS = ContinuationControl(most=0.1)
# Tolerance of the balance: Newton's residual is relative to terms that may cancel.
BALANCED = 1e-7


def problem(odd=8, samples=256):
    return HarmonicBalance(
        RIG,
        PeriodicMarch(Jenkins(KT, 0.88, 60.0)),
        PeriodicLoad({1: -1j * unit_force(RIG, "m1")}),
        Resolution(tuple(range(1, 2 * odd, 2)), samples),
    )


@pytest.fixture(scope="module")
def branches():
    return {force: along_frequency(problem(), force, SPAN, control=STEPS) for force in FORCES}


def slider_forces(displacement):
    """Return the slider forces ``(t,)`` in the second of two equal periods, step by step."""
    forces, force = [], 0.0
    steps = np.diff(displacement, prepend=displacement[-1])
    for step in [*steps, *steps]:
        force = min(max(force + KT * step, -LIMIT), LIMIT)
        forces.append(force)
    return np.array(forces[len(steps) :])


def missing(motion):
    """Return the largest residual of the balance of forces at each harmonic [N]."""
    orders = np.array(motion.resolution.harmonics)
    samples = motion.resolution.samples
    times = np.exp(2j * np.pi * np.outer(np.arange(samples), orders) / samples)
    joint = slider_forces((times @ motion.motion[:, 1]).real)
    pulled = 2.0 / samples * times.conj().T @ joint
    balance = np.outer(pulled, [0.0, 1.0])
    for row, (order, amplitudes) in enumerate(zip(orders, motion.motion, strict=True)):
        angular = 2.0 * np.pi * motion.frequency * order
        dynamic = RIG.stiffness + 1j * angular * RIG.damping - angular**2 * RIG.mass
        balance[row] += dynamic @ amplitudes
    balance[0, 0] += 1j * motion.force
    return np.abs(balance).max()


def test_every_branch_reaches_its_end_and_balances(branches):
    for force, branch in branches.items():
        assert branch.message == "", force
        assert (branch.frequencies[0], branch.frequencies[-1]) == SPAN
        # No motion of this rig has another beside it with so few harmonics.
        assert branch.curve.folds == ()
        for motion in branch.solutions[::10]:
            assert missing(motion) < BALANCED * (force + LIMIT), (force, motion.frequency)


def test_peaks_move_from_the_stuck_rig_to_the_sliding_one(branches):
    """They fall with every force up to 57 N, and are lowest where most is dissipated.

    Beyond 4/π of the limit the slider, whose force does not grow, does not hold the first mode.
    """
    receptance, peaks = {}, {}
    for force, branch in branches.items():
        sizes = branch.first_amplitudes(1)
        receptance[force], peaks[force] = sizes.max() / force, branch.frequencies[sizes.argmax()]
    assert peaks[1] == pytest.approx(natural_frequencies(RIG, KT)[0], rel=3e-3)
    sticking = [force for force in FORCES if 13 <= force <= 57]
    # Points are some thousandths of the frequency apart, and peaks are flat.
    assert all(peaks[after] < 1.002 * peaks[force] for force, after in pairwise(sticking))
    least = min(receptance, key=receptance.__getitem__)
    assert 28 <= least <= 37
    sizes = [receptance[force] for force in FORCES]
    place = FORCES.index(least)
    assert (np.diff(sizes[: place + 1]) < 0.0).all()
    assert (np.diff(sizes[place:]) > 0.0).all()
    held = [peaks[force] == pytest.approx(39.08, rel=4e-3) for force in FORCES]
    assert held == [force > 4.0 / np.pi * LIMIT for force in FORCES]


def test_downward_the_same_peaks_are_met(branches):
    for force in (13, 34, 57, 63, 90):
        down = along_frequency(problem(), force, SPAN, upward=False, control=STEPS)
        assert down.message == ""
        sizes = [branch.first_amplitudes(1).max() for branch in (branches[force], down)]
        assert sizes[0] == pytest.approx(sizes[1], rel=3e-3)


@pytest.mark.parametrize(("force", "error"), [(13, 2e-4), (46, 1.5e-2), (90, 5e-3)])
def test_peaks_are_those_of_exact_integration(branches, force, error):
    """Integration starts from the motion with many harmonics and stays there."""
    branch = branches[force]
    near = branch.solutions[int(branch.first_amplitudes(1).argmax())]
    motion, period = problem(24, 2048).solve(near.frequency, force, near), 1.0 / near.frequency
    at, speed = motion.displacement(1)[0], motion.velocity(1)[0]
    slider = at[1] - motion.cycle.samples[0, 0, 0] / KT
    exact = integrate_exactly(
        RIG,
        SliderJoints(np.array([KT]), np.array([LIMIT]), np.zeros(1)),
        HarmonicForce(unit_force(RIG, "m1"), force, near.frequency),
        12.0 * period,
        period / 64.0,
        Start(at, speed, np.array([[slider]])),
    )
    turns = np.exp(-2j * np.pi * np.arange(64) / 64)
    last = 2.0 * (exact.displacement[-65:-1, 1] * turns).mean()
    assert motion.amplitude(1) == pytest.approx(last, rel=5e-4)
    assert near.amplitude(1) == pytest.approx(last, rel=error)
