"""Forces in time: their values, and agreement with the smooth sections of which they consist."""

import numpy as np
import pytest

from fe_models.dynamics.excitation import (
    CombinedForces,
    ConstantForce,
    ExcitationError,
    HammerBlow,
    HarmonicForce,
    RecordedForce,
)
from tests.given import assert_refused
from tests.oracles.signals import breaks, signal_at

SHAPE = np.array([0.0, 2.0])
FORCES = {
    "harmonic": HarmonicForce(SHAPE, 75.0, 100.0, phase=0.3),
    "ramped": HarmonicForce(SHAPE, 75.0, 100.0, phase=0.3, ramp=0.013),
    "blow": HammerBlow(SHAPE, 100.0, 4e-3, start=2e-3),
    "recorded": RecordedForce(SHAPE, np.array([1e-3, 2e-3, 9e-3]), np.array([1.0, -3.0, 8.0])),
    "sample": RecordedForce(SHAPE, np.array([0.0]), np.array([6.0])),
    "constant": ConstantForce(SHAPE),
}


@pytest.mark.parametrize("force", FORCES.values(), ids=FORCES)
def test_smooth_sections_are_the_force(force):
    times = np.linspace(-5e-3, 30e-3, 71) + 1e-5
    stretches = [signal_at(force, time) for time in times]
    lines = [s.value + s.slope * (t - s.origin) for s, t in zip(stretches, times, strict=True)]
    waves = [
        sum(w.amplitude * np.sin(w.angular * t + w.phase) for w in s.waves)
        for s, t in zip(stretches, times, strict=True)
    ]
    forces = force(times)
    assert forces.shape == (71, 2)
    np.testing.assert_array_equal(forces[:, 0], 0.0)
    np.testing.assert_allclose(forces[:, 1], 2.0 * np.add(lines, waves), atol=1e-11)


@pytest.mark.parametrize("force", FORCES.values(), ids=FORCES)
def test_a_section_continues_until_the_next_break(force):
    for early, late in [(-1.0, -1e-9), (1e-9, 0.99e-3), (1e-3, 2e-3), (2e-3, 6e-3), (9e-3, 1.3e-2)]:
        between = [time for time in breaks(force) if early < time < late]
        share = 1e-3 * (late - early)
        if not between:
            assert signal_at(force, early + share) == signal_at(force, late - share)


def test_a_blow_is_half_a_sine():
    blow = HammerBlow(np.ones(1), 100.0, 4e-3)
    times = np.linspace(-1e-3, 6e-3, 70001)
    force = blow(times)[:, 0]
    assert force.max() == pytest.approx(100.0, rel=1e-9)
    assert np.trapezoid(force, times) == pytest.approx(2.0 * 100.0 * 4e-3 / np.pi, rel=1e-6)
    assert np.all(force[(times < 0.0) | (times > 4e-3)] == 0.0)


def test_a_ramp_starts_with_zero_force_and_slope_and_ends_in_the_harmonic():
    ramped, full = FORCES["ramped"], FORCES["harmonic"]
    h = 1e-9
    start = ramped(np.array([0.0, h]))[:, 1]
    assert start[0] == 0.0
    assert abs(start[1]) / h < 1e-3 * 150.0 * 2.0 * np.pi * 100.0
    late = np.linspace(0.013, 0.05, 99)
    np.testing.assert_array_equal(ramped(late), full(late))


def test_forces_add_up():
    both = CombinedForces((FORCES["blow"], FORCES["constant"]))
    times = np.linspace(0.0, 0.01, 11)
    wanted = FORCES["blow"](times) + SHAPE
    np.testing.assert_allclose(both(times), wanted, rtol=1e-15)
    assert breaks(both) == (2e-3, 6e-3)
    assert breaks(CombinedForces((FORCES["blow"], FORCES["sample"]))) == (0.0, 2e-3, 6e-3)


def test_invalid_signals_are_refused():
    attempts = (
        lambda: HarmonicForce(SHAPE, 1.0, 0.0),
        lambda: HarmonicForce(SHAPE, 1.0, 1.0, ramp=-1.0),
        lambda: HammerBlow(SHAPE, 1.0, 0.0),
        lambda: RecordedForce(SHAPE, np.array([]), np.array([])),
        lambda: RecordedForce(SHAPE, np.zeros(2), np.zeros(3)),
        lambda: RecordedForce(SHAPE, np.array([1.0, 1.0]), np.zeros(2)),
        lambda: RecordedForce(SHAPE, np.array([1.0]), np.array([np.nan])),
    )
    assert_refused(ExcitationError, attempts)
