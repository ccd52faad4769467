"""Tests of the exact integration against closed forms: a sliding oscillator, and a blow."""

import numpy as np
import pytest

from fe_models.dynamics.excitation import CombinedForces, HammerBlow, HarmonicForce, RecordedForce
from fe_models.dynamics.motion import Start
from fe_models.dynamics.rig import Link, lumped_rig, natural_frequencies, unit_force
from tests.oracles.event_driven import SliderJoints, integrate_exactly
from tests.oracles.two_mass_rig import two_mass_rig

EXACT = 1e-10


def sliders(stiffness, limit, residual):
    return SliderJoints(*(np.array(v, dtype=float) for v in (stiffness, limit, residual)))


def mass_on_springs(mass, stiffness, ratio=0.0):
    return lumped_rig({"m": mass}, {Link("m"): stiffness}, [[Link("m")]], ratio)


def sliding_decay(m, k, kt, limit, start, times):
    """Return the free decay from ``start`` > limit/kt at rest with the spring at its limit.

    Derived by hand. A half swing is: stuck about xe = kt s/(k + kt), s the slider's place, until
    the spring has turned round, x = start - 2 limit/kt; then slip about limit/k until it stops. The
    next half swing is its mirror image. The last one never leaves stick.
    """
    place, begin, sign = np.empty_like(times), 0.0, 1.0
    stuck, slipping = np.sqrt((k + kt) / m), np.sqrt(k / m)
    while True:
        centre = kt * (start - limit / kt) / (k + kt)
        swing = start - centre
        since = times - begin
        place[since >= 0.0] = sign * (centre + swing * np.cos(stuck * since[since >= 0.0]))
        slips_at = start - 2.0 * limit / kt
        if slips_at <= centre - swing:
            return place
        first = np.arccos((slips_at - centre) / swing) / stuck
        speed = -swing * stuck * np.sin(stuck * first)
        radius = np.hypot(slips_at - limit / k, speed / slipping)
        angle = np.arctan2(-speed / slipping, slips_at - limit / k)
        later = since >= first
        place[later] = sign * (
            limit / k + radius * np.cos(slipping * (since[later] - first) + angle)
        )
        begin += first + (np.pi - angle) / slipping
        start, sign = radius - limit / k, -sign


def test_free_decay_with_a_slider_is_the_closed_form():
    m, k, kt, limit, start = 2e-3, 500.0, 1500.0, 3.0, 0.05
    motion = integrate_exactly(
        mass_on_springs(m, k),
        sliders([kt], [limit], [0.0]),
        None,
        0.1,
        1e-4,
        Start(np.array([start])),
    )
    wanted = sliding_decay(m, k, kt, limit, start, motion.times)
    np.testing.assert_allclose(motion.displacement[:, 0], wanted, atol=EXACT * start)
    lost = motion.energies.joints[:, 0]
    # It has slipped both ways, and ends swinging in stick.
    assert np.count_nonzero(np.diff(np.sign(motion.velocity[:, 0]))) > 6
    assert lost[-1] == lost[len(lost) // 2] > 0.0
    energy = motion.energies
    np.testing.assert_allclose(energy.missing, 0.0, atol=EXACT * energy.elastic[0])


def test_energy_balances_with_every_kind_of_force():
    """Work, damping and friction are integrated separately and balance to 1e-10."""
    rig = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3), 0.01)
    first, second = unit_force(rig, "m1"), unit_force(rig, "m2")
    force = CombinedForces(
        (
            HarmonicForce(first, 75.0, 100.0, ramp=0.01),
            HammerBlow(second, 100.0, 1.3e-3, start=2.1e-3),
            RecordedForce(first, np.array([0.004, 0.0073, 0.03]), np.array([0.0, 30.0, -40.0])),
        )
    )
    joints = sliders([27.3e3], [30.0], [880.0])
    motion = integrate_exactly(rig, joints, force, 0.04, 1e-4)
    energies = motion.energies
    largest = energies.excitation.max()
    assert motion.converged
    assert energies.joints[-1, 0] > 0.1 * largest
    assert energies.damping[-1] > 0.001 * largest
    np.testing.assert_allclose(energies.missing, 0.0, atol=EXACT * largest)
    for lost in (energies.damping, energies.joints[:, 0]):
        assert np.diff(lost).min() >= -1e-12 * largest
    hysteretic = motion.joint_force[:, 0, 0] - 880.0 * motion.joint_displacement[:, 0, 0]
    assert np.abs(hysteretic).max() == pytest.approx(30.0, rel=EXACT)


def half_sine_response(angular, ratio, peak, duration, times):
    """Return the response of unit modal mass to a half sine from t = 0, in closed form."""
    drive, damped = np.pi / duration, angular * np.sqrt(1.0 - ratio**2)
    real, imaginary = angular**2 - drive**2, 2.0 * ratio * angular * drive
    share = peak / (real**2 + imaginary**2)

    def free(x0, v0, t):
        b = (v0 + ratio * angular * x0) / damped
        return np.exp(-ratio * angular * t) * (x0 * np.cos(damped * t) + b * np.sin(damped * t))

    def under(t):
        forced = share * (real * np.sin(drive * t) - imaginary * np.cos(drive * t))
        return forced + free(share * imaginary, -share * real * drive, t)

    # The blow that ends is minus another one that begins, half a period of its sine later.
    late = np.maximum(times - duration, 0.0)
    return under(times) + under(late)


def blow_response(rig, shape, peak, duration, times):
    """Return the linear rig's response to a blow, mode by mode ``(t, n)``."""
    angular = 2.0 * np.pi * natural_frequencies(rig)
    # Modes of unit modal mass, from the closed form of the eigenvectors of two masses.
    modes = np.array([np.ones(2), (rig.stiffness[0, 0] - angular**2 * rig.mass[0, 0])])
    modes[1] /= -rig.stiffness[0, 1]
    modes /= np.sqrt(np.einsum("im,ij,jm->m", modes, rig.mass, modes))
    ratios = np.diag(modes.T @ rig.damping @ modes) / (2.0 * angular)
    parts = [
        half_sine_response(w, zeta, peak * (mode @ shape), duration, times)[:, None] * mode
        for w, zeta, mode in zip(angular, ratios, modes.T, strict=True)
    ]
    return np.sum(parts, axis=0)


def test_a_blow_on_a_free_rig_is_the_closed_form():
    rig = two_mass_rig((21.2e-3, 1.2e-3), (1.4e3, 273e3), 0.003)
    shape = unit_force(rig, "m2")
    blow = HammerBlow(shape, 100.0, 0.73e-3)
    motion = integrate_exactly(rig, sliders([1.0], [0.0], [0.0]), blow, 0.05, 1e-3)
    wanted = blow_response(rig, shape, 100.0, 0.73e-3, motion.times)
    np.testing.assert_allclose(motion.displacement, wanted, atol=EXACT * np.abs(wanted).max())


def test_the_step_of_the_output_does_not_matter():
    """Two joints, between masses and to ground, slip at different times."""
    masses = {"a": 2e-3, "b": 1e-3}
    springs = {Link("a"): 400.0, Link("b", "a"): 900.0}
    rig = lumped_rig(masses, springs, [[Link("b")], [Link("b", "a")]], 0.01)
    joints = sliders([1200.0, 700.0], [2.0, 1.1], [30.0, 0.0])
    force = HarmonicForce(unit_force(rig, "b"), 6.0, 90.0)
    coarse, fine = (integrate_exactly(rig, joints, force, 0.1, step) for step in (5e-3, 1.25e-3))
    largest = np.abs(fine.displacement).max()
    np.testing.assert_allclose(coarse.displacement, fine.displacement[::4], atol=EXACT * largest)
    assert np.all(fine.energies.joints[-1] > 0.0)
    # It can be left at any time and taken up again.
    first = integrate_exactly(rig, joints, force, 0.05, 5e-3)
    second = integrate_exactly(rig, joints, force, 0.05, 5e-3, first.end)
    np.testing.assert_allclose(second.displacement, coarse.displacement[10:], atol=EXACT * largest)


def test_equal_joints_side_by_side_slip_together():
    """Twins whose events coincide are one joint of twice the stiffness and limit."""
    rig = lumped_rig({"m": 1e-3}, {Link("m"): 100.0}, [[Link("m")], [Link("m")]], 0.01)
    force = HarmonicForce(unit_force(rig, "m"), 5.0, 60.0)
    twins = integrate_exactly(rig, sliders([300.0] * 2, [1.0] * 2, [0.0] * 2), force, 0.1, 1e-3)
    one = mass_on_springs(1e-3, 100.0, 0.01)
    single = integrate_exactly(one, sliders([600.0], [2.0], [0.0]), force, 0.1, 1e-3)
    assert twins.converged
    largest = np.abs(single.displacement).max()
    np.testing.assert_allclose(twins.displacement, single.displacement, atol=1e-9 * largest)
    np.testing.assert_allclose(twins.energies.joints[:, 0], twins.energies.joints[:, 1], rtol=1e-9)


def test_nothing_moves_without_force():
    motion = integrate_exactly(
        mass_on_springs(1e-3, 10.0), sliders([5.0], [1.0], [0.0]), None, 0.1, 1e-2
    )
    for values in (motion.displacement, motion.joint_force, motion.energies.joints):
        np.testing.assert_array_equal(values, 0.0)


def test_what_is_no_slider_is_refused():
    with pytest.raises(ValueError, match="stiffness 0 N/mm"):
        sliders([0.0], [1.0], [0.0])
    with pytest.raises(ValueError, match="2 joints"):
        integrate_exactly(
            mass_on_springs(1.0, 1.0), sliders([1.0] * 2, [1.0] * 2, [0.0] * 2), None, 1.0, 0.1
        )
