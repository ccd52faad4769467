"""Ring-downs of known damping: linear modes, and a uniform Iwan joint."""

import numpy as np
import pytest

from fe_models.dynamics.transient.free_decay import SMALLEST_AMPLITUDE, ring_down
from fe_models.dynamics.transient.impact_hammer import SignalError
from tests.marks import slow

FREQUENCY, STEP = 100.0, 1.0 / 10e3


def decay(ratio, seconds=2.0, phase=0.0, frequency=FREQUENCY):
    time, natural = STEP * np.arange(int(seconds / STEP)), 2.0 * np.pi * frequency
    damped = natural * np.sqrt(1.0 - ratio**2)
    return np.exp(-ratio * natural * time) * np.cos(damped * time + phase)


@pytest.mark.parametrize("band", [(50.0, 150.0), (70.0, 150.0), (80.0, 120.0)])
@pytest.mark.parametrize("ratio", [1e-3, 0.01, 0.03])
@pytest.mark.parametrize("phase", [0.0, slow(1.0)])
def test_linear_mode_gives_its_damping_and_frequency(ratio, phase, band):
    """The accuracy is that of the filter's transients: 1e-4 of the amplitude, less in its slope."""
    ringing = ring_down(decay(ratio, phase=phase), STEP, band)
    assert ringing.damping_ratio == pytest.approx(ratio, rel=5e-4)
    damped = FREQUENCY * np.sqrt(1.0 - ratio**2)
    assert ringing.frequency == pytest.approx(damped, rel=5e-6)
    amplitude = np.exp(-ratio * 2.0 * np.pi * FREQUENCY * ringing.time)
    # The spectrum of a decay is wider than one frequency, so that the gain of the filter varies
    # over it.
    assert ringing.amplitude == pytest.approx(amplitude, rel=1e-4 + 10.0 * ratio**2)
    assert ringing.amplitude[-1] >= 0.99 * SMALLEST_AMPLITUDE * ringing.amplitude[0]


def test_other_modes_are_filtered_out():
    ringing = ring_down(decay(0.005) + 0.3 * decay(0.005, frequency=650.0), STEP, (60.0, 140.0))
    assert ringing.damping_ratio == pytest.approx(0.005, rel=0.01)
    assert ringing.frequency == pytest.approx(FREQUENCY, rel=1e-3)


def test_noise_scatters_but_does_not_bias():
    generator = np.random.default_rng(2)
    signal = decay(0.005)
    ringing = ring_down(signal + 0.01 * generator.standard_normal(signal.size), STEP, (60.0, 140.0))
    loud = ringing.amplitude > 0.1
    assert np.mean(ringing.damping_ratio[loud]) == pytest.approx(0.005, rel=0.02)


# --- Iwan ---------------------------------------------------------------------------------------

# A spring in parallel to the joint is twice as stiff. Loops of up to a tenth of full slip are
# examined: the averaged law is of first order in the amplitude.
MASS, SPRING, JOINT, SLIP = 1e-3, 400.0, 200.0, 0.05
START = 0.12 * SLIP


def iwan_ring_down(periods=900, steps=200):
    """Return displacement from rest at START, by Verlet's method, and the step.

    Reversals follow Masing's rule. Each amplitude is smaller than the last, so that no loop closes
    and only the last reversal matters.
    """
    step = 2.0 * np.pi * np.sqrt(MASS / (SPRING + JOINT)) / steps
    moved, speed, displacement = START, 0.0, []
    turn, sense = START, -1.0
    held = JOINT * START - JOINT * START**2 / (2.0 * SLIP)
    force = held
    for _ in range(periods * steps):
        displacement.append(moved)
        speed -= 0.5 * step / MASS * (SPRING * moved + force)
        moved += step * speed
        gone = abs(moved - turn)
        force = held + sense * JOINT * gone * (1.0 - gone / (4.0 * SLIP))
        speed -= 0.5 * step / MASS * (SPRING * moved + force)
        if speed * sense < 0.0:
            turn, sense, held = moved, -sense, force
    return np.array(displacement), step


def iwan_law(amplitude):
    """Return frequency [Hz] and damping ratio of a slowly decaying vibration of ``amplitude``.

    Averaged over a period (first harmonic): k(A) = K + kt (1 - A / 2φ) and a' = -E / (2π m ω A), E
    = 2 kt A³ / (3 φ); so ζ = -a'/(a ω) = E / (4π · k A²/2), the energy lost over 4π times that
    stored.
    """
    stiffness = SPRING + JOINT * (1.0 - amplitude / (2.0 * SLIP))
    energy = 2.0 * JOINT * amplitude**3 / (3.0 * SLIP)
    frequency = np.sqrt(stiffness / MASS) / (2.0 * np.pi)
    return frequency, energy / (2.0 * np.pi * stiffness * amplitude**2)


@pytest.fixture(scope="module")
def iwan():
    displacement, step = iwan_ring_down()
    return displacement, step, ring_down(displacement, step, (70.0, 180.0))


def test_iwan_ring_down_gives_its_law(iwan):
    """Errors are within 2 % up to a tenth of full slip: the law is of first order."""
    *_, ringing = iwan
    frequency, ratio = iwan_law(ringing.amplitude)
    assert 0.05 * SLIP < ringing.amplitude[0] < 0.1 * SLIP
    assert ringing.amplitude[-1] < 0.02 * SLIP
    wrong = np.abs(ringing.damping_ratio / ratio - 1.0)
    assert wrong.max() < 0.02
    assert wrong[ringing.amplitude < 0.03 * SLIP].max() < 0.006
    assert np.abs(ringing.frequency / frequency - 1.0).max() < 1e-3


def test_iwan_ring_down_agrees_with_its_decrement(iwan):
    """Successive maxima, each the top of a parabola, decay by 2πζ, without a filter or a law."""
    displacement, step, ringing = iwan
    inner = displacement[1:-1]
    tops = 1 + np.flatnonzero((inner > displacement[:-2]) & (inner >= displacement[2:]))
    before, at, after = displacement[tops - 1], displacement[tops], displacement[tops + 1]
    height = at - (after - before) ** 2 / (8.0 * (before - 2.0 * at + after))
    ratio = np.log(height[:-1] / height[1:]) / (2.0 * np.pi)
    time = 0.5 * step * (tops[1:] + tops[:-1])
    seen = (time > ringing.time[0]) & (time < ringing.time[-1])
    measured = np.interp(time[seen], ringing.time, ringing.damping_ratio)
    assert measured == pytest.approx(ratio[seen], rel=5e-3)


# --- invalid records ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("signal", "band"),
    [
        (decay(0.01), (150.0, 50.0)),
        (decay(0.01), (90.0, 6000.0)),
        (decay(0.01), (1500.0, 2000.0)),
        (decay(0.01, seconds=0.05), (50.0, 150.0)),
        (decay(0.08), (95.0, 105.0)),
        (0.0 * decay(0.01), (50.0, 150.0)),
        (np.nan * decay(0.01), (50.0, 150.0)),
    ],
)
def test_invalid_records_are_refused(signal, band):
    with pytest.raises(SignalError):
        ring_down(signal, STEP, band)
