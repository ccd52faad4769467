"""Hammer blows on structures of known response: H1, windows, quantities and resonances."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from fe_models.dynamics.transient.impact_hammer import SignalError, frequency_response
from tests.oracles.mode_fit import resonances

# The rig with its contact stuck, in t and N/mm: 2 masses, one of 21.2 kg held by 1.4 N/µm.
MASS = np.diag([21.2e-3, 1.2e-3])
STIFFNESS = np.array([[1.4e3 + 273e3, -273e3], [-273e3, 273e3 + 27.3e3]])
STEP, PEAK, DURATION = 2e-5, 100.0, 4e-4


def rig(ratio):
    """Return mass, damping, stiffness and natural frequencies, with one damping ratio."""
    root = np.sqrt(np.diag(MASS))
    squares, modes = np.linalg.eigh(STIFFNESS / np.outer(root, root))
    shapes = root[:, None] * modes
    viscous = shapes @ np.diag(2.0 * ratio * np.sqrt(squares)) @ shapes.T
    return viscous, np.sqrt(squares) / (2.0 * np.pi)


def transfer(frequency, ratio, order=2, decay=0.0):
    """Return x1 over a force on mass 1, times (σ + iω)^order."""
    viscous, _ = rig(ratio)
    s = decay + 2j * np.pi * frequency
    dynamic = STIFFNESS + s[:, None, None] * viscous + s[:, None, None] ** 2 * MASS
    return s**order * np.linalg.inv(dynamic)[:, 0, 0]


def blow(ratio, seconds, sampling=STEP):
    """Return half a sine on mass 1 and the acceleration of mass 1, exact at the samples.

    The half sine is the motion of an oscillator that drives the structure until it stops.
    """
    viscous, _ = rig(ratio)
    inverse, rate = np.linalg.inv(MASS), np.pi / DURATION
    system = np.zeros((6, 6))
    system[:2, 2:4] = np.eye(2)
    system[2:4, :2], system[2:4, 2:4] = -inverse @ STIFFNESS, -inverse @ viscous
    system[2:4, 4] = inverse[:, 0]
    system[4, 5], system[5, 4] = rate, -rate
    struck = round(DURATION / sampling)
    step = expm(sampling * system)
    state, rows = np.array([0.0, 0.0, 0.0, 0.0, 0.0, PEAK]), []
    for number in range(round(seconds / sampling)):
        if number == struck:
            state[4:] = 0.0
        rows.append((state[4], (system @ state)[2]))
        state = step @ state
    return np.array(rows).T


@pytest.fixture(scope="module")
def damped():
    """Return a blow whose ring-down ends within the record."""
    return blow(0.01, 1.5)


def near(response, lowest=20.0, highest=1500.0):
    return (response.frequency > lowest) & (response.frequency < highest)


def error(sampling):
    """Return the largest error below 1500 Hz over the largest response."""
    response = frequency_response(*blow(0.01, 1.0, sampling), sampling)
    band = near(response)
    assert response.coherence is None
    assert response.remaining < 1e-4
    exact = transfer(response.frequency[band], 0.01)
    return np.abs(response.value[band] - exact).max() / np.abs(exact).max()


def test_single_blow_is_the_transfer_function():
    """Sums replace integrals of the half sine, which has kinks: second order in the step.

    The relative error of the force's spectrum is (π step / duration)² / 12.
    """
    coarse, fine = error(4e-5), error(2e-5)
    assert fine == pytest.approx((np.pi * 2e-5 / DURATION) ** 2 / 12.0, rel=0.1)
    assert coarse / fine == pytest.approx(4.0, rel=0.05)


def test_conversions_are_factors_of_the_frequency(damped):
    response = frequency_response(*damped, STEP)
    receptance = response.converted("receptance")
    assert receptance.quantity == "receptance"
    rate = 2j * np.pi * response.frequency
    assert receptance.value * rate**2 == pytest.approx(response.value, rel=1e-12)
    assert receptance.converted("mobility").value == pytest.approx(
        response.converted("mobility").value, rel=1e-12
    )


def test_exponential_window_is_a_complex_frequency():
    """A tenth of a second is far too short for a damping ratio of 0.001 without a window."""
    record, decay = blow(0.001, 0.15), 60.0
    response = frequency_response(*record, STEP, decay=decay)
    exact = transfer(response.frequency, 0.001, decay=decay)
    band = near(response)
    assert response.remaining < 1e-3
    assert np.abs(response.value - exact)[band].max() < 3e-3 * np.abs(exact[band]).max()
    assert frequency_response(*record, STEP).remaining > 0.1
    _, natural = rig(0.001)
    (first,) = resonances(response, 50.0, 1000.0)
    assert first.natural_frequency == pytest.approx(natural[0], rel=1e-4)
    # The window makes up 98 % of the damping rate, and is subtracted again.
    assert first.damping_ratio == pytest.approx(0.001, abs=2e-4)


def test_h1_of_several_noisy_blows(damped):
    """Noise of the response averages out, and reduces the coherence."""
    generator = np.random.default_rng(4)
    force, response = damped
    scale = np.array([0.7, 1.0, 1.3, 0.9] * 10)[:, None]
    forces, clean = scale * force, scale * response
    noisy = clean + 0.05 * np.std(response) * generator.standard_normal(clean.shape)
    exact = frequency_response(force, response, STEP)
    alike = frequency_response(forces, clean, STEP)
    band = near(exact)
    assert alike.coherence[band] == pytest.approx(1.0, abs=1e-12)
    assert alike.value[band] == pytest.approx(exact.value[band], rel=1e-12)
    estimate = frequency_response(forces, noisy, STEP)
    peak = np.argmax(np.abs(exact.value) * band)
    assert estimate.coherence[peak] > 0.999
    assert estimate.coherence[band].min() < 0.9
    one = frequency_response(force, noisy[0] / scale[0], STEP)
    averaged, single = (np.std((h1.value - exact.value)[band]) for h1 in (estimate, one))
    assert averaged < 0.3 * single


def test_force_window_drops_what_comes_after_the_blow(damped):
    generator = np.random.default_rng(1)
    force, response = damped
    noisy = force + 0.02 * PEAK * generator.standard_normal(force.shape)
    exact = frequency_response(force, response, STEP).value
    plain = frequency_response(noisy, response, STEP)
    windowed = frequency_response(noisy, response, STEP, blow_end=DURATION).value
    band = near(plain)
    wrong = [np.abs(value - exact)[band].max() for value in (plain.value, windowed)]
    assert wrong[1] < 0.1 * wrong[0]


def test_resonances_are_those_of_the_modes(damped):
    response = frequency_response(*damped, STEP)
    _, natural = rig(0.01)
    # Frequencies stay below 3750 Hz, which a half sine of 0.4 ms does not excite.
    modes = resonances(response, 50.0, 3000.0, share=0.01)
    assert [mode.natural_frequency for mode in modes] == pytest.approx(natural, rel=1e-3)
    assert [mode.damping_ratio for mode in modes] == pytest.approx([0.01, 0.01], rel=0.02)
    fine = np.linspace(150.0, 200.0, 50001)
    exact = np.abs(transfer(fine, 0.01))
    assert modes[0].frequency == pytest.approx(fine[exact.argmax()], rel=1e-3)
    assert modes[0].magnitude == pytest.approx(exact.max(), rel=5e-3)
    assert resonances(response, 9000.0, 9001.0) == []


def test_resonance_of_a_single_mode_is_exact():
    """Three samples are enough, for any quantity and with any constant added."""
    frequency = np.arange(1.0, 200.0, 0.5)
    s = 2j * np.pi * frequency
    natural, ratio = 2.0 * np.pi * 41.3, 0.004
    receptance = 1.0 / (3.0 * (s**2 + 2.0 * ratio * natural * s + natural**2))
    blank = frequency_response(np.eye(1, 8)[0], np.ones(8), 1.0, "receptance")
    response = replace(blank, frequency=frequency, value=receptance)
    converted = [
        response.converted(quantity) for quantity in ("receptance", "mobility", "accelerance")
    ]
    for one in (*converted, replace(converted[2], value=converted[2].value + 0.3)):
        (mode,) = resonances(one, 10.0)
        assert mode.natural_frequency == pytest.approx(41.3, rel=1e-9)
        assert mode.damping_ratio == pytest.approx(ratio, rel=1e-6)
    peak = 41.3 * np.sqrt(1.0 - 2.0 * ratio**2)
    (mode,) = resonances(response, 10.0)
    assert mode.frequency == pytest.approx(peak, rel=1e-5)
    height = 1.0 / (3.0 * natural**2 * 2.0 * ratio * np.sqrt(1.0 - ratio**2))
    assert mode.magnitude == pytest.approx(height, rel=1e-5)


@pytest.mark.parametrize(
    "arguments",
    [
        (np.ones(8), np.ones(9), 1.0),
        (np.ones(2), np.ones(2), 1.0),
        (np.zeros(8), np.ones(8), 1.0),
        (np.ones(8), np.ones(8), 0.0),
        (np.ones(8), np.full(8, np.inf), 1.0),
        (np.ones(8), np.ones(8), 1.0),
    ],
)
def test_invalid_records_are_refused(arguments):
    with pytest.raises(SignalError):
        frequency_response(*arguments)
