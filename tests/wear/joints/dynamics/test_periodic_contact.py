"""Periodic contact in three dimensions: its cone, its separation, its order, its derivatives.

Motions consist of the functions 1, cos θ, sin θ, cos 2θ, sin 2θ; θ = 0 .. 2π is the period.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from wear.joints.friction_contact import FrictionContact
from wear.joints.periodic.march import SEPARATED, SLIP, STICK, PeriodicMarch

KT, KN, MU, LOAD = 10.0, 13.0, 0.5, 4.0
REACH = MU * LOAD / KT  # stretch at which the slider slips under the preload
LIFT = LOAD / KN  # lift at which the preload is gone
ROUNDING = 1e-12
STEP = 1e-7  # of central differences: their error and their rounding are both 1e-9 then
DIFFERENCES = 2e-7  # agreement with them, over the largest entry
PRESSED = FrictionContact(KT, KN, MU, LOAD)
APART = FrictionContact(KT, KN, MU, gap=0.05)
SIZE = 5


def functions(samples):
    """Return basis, weights and lead."""
    angle = 2.0 * np.pi * np.arange(samples) / samples
    waves = [wave for k in (1, 2) for wave in (np.cos(k * angle), np.sin(k * angle))]
    basis = np.column_stack([np.ones(samples), *waves])
    weights = 2.0 / samples * basis.T
    weights[0] *= 0.5
    return basis, weights, np.vstack([np.eye(1, SIZE), basis[:1]])


def settle(law, motion, samples=256):
    return PeriodicMarch(law).settle(motion, *functions(samples))


def way(motion, samples=256):
    """Return the displacement ``(t, 3)`` of the first joint."""
    return functions(samples)[0] @ motion[0]


def motion_of(x=(), y=(), z=()):
    """Return coefficients ``(1, 5, 3)`` from those of each direction; missing ones are 0."""
    motion = np.zeros((1, SIZE, 3))
    for direction, given in enumerate((x, y, z)):
        motion[0, : len(given), direction] = given
    return motion


def limits(law, cycle):
    """Return µ f ``(t,)`` and the tangential force ``(t,)``."""
    return law.friction * cycle.samples[:, 0, 2], np.hypot(*cycle.samples[:, 0, :2].T)


ORBITS = {
    "a circle": motion_of((0.0, 2.5 * REACH), (0.0, 0.0, 2.5 * REACH)),
    "an ellipse": motion_of((0.0, 3.0 * REACH), (0.0, 0.4 * REACH, 1.2 * REACH)),
    "a circle, load varies": motion_of(
        (0.0, 2.5 * REACH), (0.0, 0.0, 2.5 * REACH), (0.0, 0.3 * LIFT, 0.5 * LIFT)
    ),
    "an ellipse, load varies twice": motion_of(
        (0.1, 3.0 * REACH), (0.0, 0.4 * REACH, 1.2 * REACH), (0.0, 0.0, 0.0, 0.8 * LIFT)
    ),
    "a thin ellipse, load varies": motion_of(
        (0.0, 2.0 * REACH, 0.3 * REACH), (0.0, 0.4 * REACH, 0.15 * REACH), (0.0, 0.1, 0.4 * LIFT)
    ),
    "a figure of eight that lifts off": motion_of(
        (0.0, 0.0, 2.0 * REACH),
        (0.0, 0.6 * REACH, 0.0, 0.5 * REACH, 1.4 * REACH),
        (0.0, 1.02 * LIFT, 0.7 * LIFT),
    ),
}
EVERY_ORBIT = pytest.mark.parametrize("name", ORBITS)


# --- The cone


@EVERY_ORBIT
def test_the_resultant_stays_within_the_cone(name):
    """The resultant, not each component, is limited: a square would allow 1.41 times as much.

    It is on the circle where the contact slips, and inside where it sticks.
    """
    cycle = settle(PRESSED, ORBITS[name])
    limit, force = limits(PRESSED, cycle)
    assert np.all(force <= limit * (1.0 + ROUNDING))
    slips = cycle.states[:, 0] == SLIP
    assert np.count_nonzero(slips) > 64
    np.testing.assert_allclose(force[slips], limit[slips], rtol=1e-11)
    assert np.all(force[cycle.states[:, 0] == STICK] < limit[cycle.states[:, 0] == STICK])
    np.testing.assert_array_equal(force[cycle.states[:, 0] == SEPARATED], 0.0)


@EVERY_ORBIT
def test_the_cone_has_no_preferred_direction(name):
    """Rotating the motion about z rotates the forces and their derivative."""
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]]
    here = settle(PRESSED, ORBITS[name])
    there = settle(PRESSED, ORBITS[name] @ turn.T)
    np.testing.assert_allclose(there.samples, here.samples @ turn.T, atol=1e-11 * LOAD)
    np.testing.assert_allclose(there.dissipated, here.dissipated, rtol=1e-11)
    turned = np.einsum("de,jmenf,gf->jmdng", turn, here.jacobian, turn)
    np.testing.assert_allclose(there.jacobian, turned, atol=1e-9 * KT)


@EVERY_ORBIT
def test_friction_opposes_slip(name):
    """The force with which a joint resists is along the motion of its slider.

    Over a sample the slider moves along the force at its middle, up to the square of the sample.
    """
    largest = []
    for samples in (1024, 4096):
        cycle = settle(PRESSED, ORBITS[name], samples)
        force = cycle.samples[:, 0, :2]
        slider = way(ORBITS[name], samples)[:, :2] - force / KT
        moved, middle = np.diff(slider, axis=0), 0.5 * (force[1:] + force[:-1])
        slips = (cycle.states[1:, 0] == SLIP) & (cycle.states[:-1, 0] == SLIP)
        moved, middle = moved[slips], middle[slips]
        assert np.all(np.einsum("td,td->t", moved, middle) > 0.0)
        across = moved[:, 0] * middle[:, 1] - moved[:, 1] * middle[:, 0]
        angle = np.abs(across) / np.hypot(*moved.T) / np.hypot(*middle.T)
        # Next to a lift-off, where the circle is a point, the force turns within a sample.
        largest.append(np.quantile(angle, 0.95))
    assert largest[1] < 2e-5
    assert largest[1] < 0.07 * largest[0]


@EVERY_ORBIT
def test_energy_lost_is_that_of_the_slider(name):
    """The energy is ∮ t · du, by the trapezium rule of second order: no spring keeps any of it."""
    errors = []
    for samples in (1024, 4096):
        cycle = settle(PRESSED, ORBITS[name], samples)
        force, place = cycle.samples[:, 0], way(ORBITS[name], samples)
        work = (0.5 * (force + np.roll(force, -1, 0)) * (np.roll(place, -1, 0) - place)).sum()
        errors.append(abs(work / cycle.dissipated[0] - 1.0))
    assert errors[1] < 1e-5
    assert errors[1] < 0.15 * errors[0]


# --- Separation


def test_there_is_no_friction_without_contact():
    """Friction is exactly 0 while apart, and on touching limited by the travel since then."""
    motion = ORBITS["a figure of eight that lifts off"]
    cycle = settle(PRESSED, motion, 2048)
    force, place = cycle.samples[:, 0], way(motion, 2048)
    apart = LOAD + KN * place[:, 2] <= 0.0
    np.testing.assert_array_equal(cycle.states[:, 0] == SEPARATED, apart)
    assert 0.1 < apart.mean() < 0.9
    np.testing.assert_array_equal(force[apart], 0.0)
    touched = np.flatnonzero(apart & ~np.roll(apart, -1))
    assert len(touched) == 1
    after = np.arange(touched[0], touched[0] + 200) % 2048
    travelled = np.cumsum(np.hypot(*np.diff(place[after, :2], axis=0).T))
    assert np.all(np.hypot(*force[after[1:], :2].T) <= KT * travelled)


@pytest.mark.parametrize("law", [PRESSED, APART], ids=["preloaded", "with a gap"])
@EVERY_ORBIT
def test_forces_are_continuous(name, law):
    """From sample to sample a force changes by no more than springs and circle allow."""
    motion, samples = ORBITS[name] + motion_of(z=(0.02,)), 4096
    cycle, place = settle(law, motion, samples), way(motion, samples)
    force = cycle.samples[:, 0]
    normal = np.maximum(law.normal_load + KN * (place[:, 2] - law.gap), 0.0)
    np.testing.assert_allclose(force[:, 2], normal, atol=ROUNDING * LOAD)
    moved = np.abs(np.roll(place, -1, 0) - place)
    changed = np.abs(np.roll(force, -1, 0) - force)
    assert np.all(changed[:, 2] <= KN * moved[:, 2] + ROUNDING)
    allowed = KT * np.hypot(*moved[:, :2].T) + MU * KN * moved[:, 2]
    assert np.all(np.hypot(*changed[:, :2].T) <= allowed + ROUNDING)


def test_a_gap_without_preload_is_a_preload_below_zero():
    """The force kn (A cos θ - g), where positive, has closed forms of its first harmonics."""
    amplitude, gap = 0.2, 0.05
    law = replace(APART, gap=gap)
    half = np.arccos(gap / amplitude)
    mean = KN * (amplitude * np.sin(half) - gap * half) / np.pi
    first = KN * amplitude * (half - np.sin(half) * np.cos(half)) / np.pi
    second = KN * amplitude * (
        np.sin(half) + np.sin(3.0 * half) / 3.0 - gap / amplitude * np.sin(2.0 * half)
    ) / np.pi  # fmt: skip
    samples, errors = np.array([128, 512, 2048]), []
    for count in samples:
        force = settle(law, motion_of((0.0, 0.3), z=(0.0, amplitude)), int(count)).force[0, :, 2]
        errors.append(np.abs(force - [mean, first, 0.0, second, 0.0]).max() / first)
    assert errors[-1] < 1e-6
    assert np.polyfit(np.log(samples), np.log(errors), 1)[0] < -1.7


# --- Harmonic 0


def test_a_load_that_varies_gives_friction_a_mean():
    """Full slip along x = A cos θ under N0 + n sin θ has a mean friction of -2 µn/π.

    The friction is µ (N0 + n sin θ) against -sin θ; a constant load gives no mean. The effect of
    the slider's spring is of the order reach/A.
    """
    swing = 0.6 * LOAD
    missing = []
    for amplitude in (100.0 * REACH, 400.0 * REACH):
        steady = settle(PRESSED, motion_of((0.0, amplitude)), 8192)
        assert abs(steady.force[0, 0, 0]) < 1e-9 * LOAD
        varied = settle(PRESSED, motion_of((0.0, amplitude), z=(0.0, 0.0, swing / KN)), 8192)
        missing.append(varied.force[0, 0, 0] / (-2.0 * MU * swing / np.pi) - 1.0)
        assert varied.force[0, 0, 2] == pytest.approx(LOAD, rel=ROUNDING)
    assert abs(missing[1]) < 0.02
    assert missing[0] / missing[1] == pytest.approx(4.0, rel=0.3)


# --- Second order


@EVERY_ORBIT
def test_slip_is_of_second_order_in_the_samples(name):
    """Force coefficients, energy and derivative are compared with 16 times as many samples."""
    counts = np.array([128, 256, 512, 1024, 2048])
    fine = settle(PRESSED, ORBITS[name], 32768)
    errors = []
    for count in counts:
        cycle = settle(PRESSED, ORBITS[name], int(count))
        errors.append(
            [np.abs(cycle.force - fine.force).max(), np.abs(cycle.dissipated - fine.dissipated)[0]]
        )
    for order in np.polyfit(np.log(counts), np.log(errors), 1)[0]:
        assert -2.5 < order < -1.7


# --- Derivatives


def check_jacobian(law, motion, samples=48, step=STEP):
    cycle = settle(law, motion, samples)
    wanted = np.empty_like(cycle.jacobian)
    for m, d in np.ndindex(SIZE, 3):
        change = np.zeros_like(motion)
        change[:, m, d] = step
        upper, lower = (settle(law, motion + way * change, samples).force for way in (1.0, -1.0))
        wanted[:, :, :, m, d] = (upper - lower) / (2.0 * step)
    largest = max(np.abs(wanted).max(), KT)
    np.testing.assert_allclose(cycle.jacobian, wanted, atol=DIFFERENCES * largest)
    return set(np.unique(cycle.states))


CASES = {
    "sticks": (PRESSED, motion_of((0.0, 0.3 * REACH), (0.0, 0.1 * REACH, 0.2 * REACH)), {STICK}),
    "sticks under a load that varies": (
        PRESSED,
        motion_of((0.0, 0.2 * REACH), (0.0, 0.0, 0.1 * REACH), (0.0, 0.0, 0.0, 0.2 * LIFT)),
        {STICK},
    ),
    "slips along a line": (PRESSED, motion_of((0.0, 2.1 * REACH)), {STICK, SLIP}),
    "slips along a slanted line": (
        PRESSED,
        motion_of((0.0, 2.0 * REACH), (0.0, -1.3 * REACH)),
        {STICK, SLIP},
    ),
    "slips and turns on the circle": (PRESSED, ORBITS["a circle"], {SLIP}),
    "slips and turns under a load that varies": (PRESSED, ORBITS["a circle, load varies"], {SLIP}),
    "sticks, slips and turns": (PRESSED, ORBITS["a thin ellipse, load varies"], {STICK, SLIP}),
    "in every state": (
        PRESSED,
        ORBITS["a figure of eight that lifts off"],
        {STICK, SLIP, SEPARATED},
    ),
    "with a gap": (
        APART,
        motion_of((0.0, REACH), (0.1, 0.0, REACH), (-0.05, 0.31, 0.0, 0.1)),
        {STICK, SLIP, SEPARATED},
    ),
    "grazes, just touching": (APART, motion_of((0.0, REACH), z=(0.0, 0.05 * 1.001)), {SLIP, 2}),
    "grazes, just apart": (APART, motion_of((0.0, REACH), z=(0.0, 0.05 * 0.999)), {SEPARATED}),
    "lifts off, just": (PRESSED, motion_of((0.0, 1.4 * REACH), z=(0.0, 1.001 * LIFT)), {0, 1, 2}),
    "all but lifts off": (PRESSED, motion_of((0.0, 1.4 * REACH), z=(0.0, 0.999 * LIFT)), {0, 1}),
}


@pytest.mark.parametrize("name", CASES)
def test_derivative_in_every_state(name):
    law, motion, states = CASES[name]
    assert check_jacobian(law, motion) == states


def test_grazing_contact_is_apart_and_its_slopes_are_finite():
    """The contact touches at one sample without any pressure."""
    cycle = settle(APART, motion_of((0.0, REACH), z=(0.0, 0.05)), 64)
    assert np.all(cycle.states == SEPARATED)
    np.testing.assert_array_equal(cycle.samples, 0.0)
    assert np.all(np.isfinite(cycle.jacobian))
    assert cycle.change[0] == 0.0


# Transitions of a sample: the states before and after it, and an orbit on which they occur.
SWITCHES = {
    "slip begins": (STICK, SLIP, "a thin ellipse, load varies"),
    "slip begins, then lifts off": (STICK, SLIP, "a figure of eight that lifts off"),
    "slip ends": (SLIP, STICK, "a thin ellipse, load varies"),
    "lifts off": (SLIP, SEPARATED, "a figure of eight that lifts off"),
    "touches and slips": (SEPARATED, SLIP, "a figure of eight that lifts off"),
    "touches and sticks": (SEPARATED, STICK, "a short path that lifts off"),
}
SHORT = motion_of((0.0, 0.0, 0.5 * REACH), (0.0, 0.2 * REACH), (0.0, 1.5 * LIFT))
# The derivative is checked at this distance from a switch on both of its sides.
BESIDE = 2e-5


def family(orbit, share):
    """Return orbits that grow, shift in time, move aside and are pressed with a parameter."""
    path = ORBITS.get(orbit, SHORT)
    turned = path[:, [0, 2, 1, 4, 3]] * [[0.0], [-1.0], [1.0], [-2.0], [2.0]]
    aside = motion_of((0.3 * REACH,), z=(0.2 * LIFT,))
    return (0.7 + 0.5 * share) * (path + 0.2 * share * turned) + share * aside


def switching(before, after, orbit):
    """Return up to four parameters on both sides of a change of state at a sample."""

    def states(share):
        return settle(PRESSED, family(orbit, share), 48).states[:, 0]

    pairs, shares = [], np.linspace(0.0, 1.0, 400)
    known = [states(share) for share in shares]
    for (low, one), (high, other) in pairwise(zip(shares, known, strict=True)):
        changed = np.flatnonzero(one != other)
        if len(changed) != 1 or len(pairs) == 4:
            continue
        sample = changed[0]
        if (
            {one[sample], other[sample]} == {before, after}
            and one[sample - 1] == before
            and one[(sample + 1) % 48] == after
        ):
            pairs.append(bisected(lambda share, at=sample: states(share)[at], low, high))
    return pairs


def bisected(state_at, low, high):
    first = state_at(low)
    for _ in range(50):
        middle = 0.5 * (low + high)
        if state_at(middle) == first:
            low = middle
        else:
            high = middle
    return low, high


@pytest.mark.parametrize("name", SWITCHES)
def test_derivative_on_each_side_of_every_switch(name):
    """Each side has its own derivative, and the force is continuous at the transition."""
    orbit = SWITCHES[name][2]
    switches = switching(*SWITCHES[name])
    assert switches
    for low, high in switches:
        check_jacobian(PRESSED, family(orbit, low - BESIDE))
        check_jacobian(PRESSED, family(orbit, high + BESIDE))
        ends = [settle(PRESSED, family(orbit, share), 48) for share in (low, high)]
        np.testing.assert_allclose(ends[0].force, ends[1].force, atol=1e-11 * LOAD)
        np.testing.assert_allclose(ends[0].dissipated, ends[1].dissipated, rtol=1e-11)
