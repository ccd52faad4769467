"""Wear laws against values worked out by hand, in the units users think in."""

import numpy as np
import pytest

from wear.laws import Archard, Energy, EnergyAmplitude

UM3_PER_J = 1e-12  # [1/MPa]: 1e-9 mm³ per 1e3 N mm
FRICTION = 0.4


def test_energy_law_by_hand() -> None:
    """200 MPa at µ 0.4 over 50 um are 4 mJ/mm²; 1e4 um³/J make 0.04 nm of it."""
    slip = np.full((1, 1, 1), 0.05)
    depth = Energy(1e4 * UM3_PER_J).depth_per_pressure(slip, FRICTION) * 200.0
    assert depth.item() == pytest.approx(4e-8, rel=1e-12)


def test_archard_law_by_hand() -> None:
    """V = K s P / H: 1e-4 x 0.05 mm x 200 MPa / 3500 MPa, whatever the friction."""
    slip = np.full((1, 1, 1), 0.05)
    law = Archard(coefficient=1e-4, hardness=3500.0)
    for friction in (0.0, FRICTION):
        depth = law.depth_per_pressure(slip, friction) * 200.0
        assert depth.item() == pytest.approx(1e-4 * 0.05 * 200.0 / 3500.0, rel=1e-12)


def test_archard_is_the_energy_law_with_its_coefficient_over_hardness_and_friction() -> None:
    slip = np.random.default_rng(1).random((5, 3, 4))
    archard = Archard(1e-4, 3500.0).depth_per_pressure(slip, FRICTION)
    energy = Energy(1e-4 / 3500.0 / FRICTION).depth_per_pressure(slip, FRICTION)
    np.testing.assert_allclose(archard, energy, rtol=1e-13)


def test_case_units_reach_the_law(dovetail_path) -> None:
    from workflow.case import load_case

    for text, value in (("1 um^3/J", 1e-12), ("1e4 um^3/J", 1e-8), ("1e-8", 1e-8)):
        case = load_case(dovetail_path, [f"wear.blade.coefficient={text}"])
        assert case.wear.blade.coefficient == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("increments", [1, 7])
def test_amplitude_law_is_the_energy_law_at_its_reference(increments: int) -> None:
    """One cycle slides four amplitudes, however many increments it takes."""
    reference = 0.075
    slip = np.random.default_rng(2).random((increments, 3, 4))
    slip *= 4.0 * reference / slip.sum(axis=0)
    amplitude = EnergyAmplitude(1e-8, reference).depth_per_pressure(slip, FRICTION)
    energy = Energy(1e-8).depth_per_pressure(slip, FRICTION)
    np.testing.assert_allclose(amplitude, energy, rtol=1e-13)


def test_amplitude_law_is_quadratic_in_slip() -> None:
    slip = np.random.default_rng(3).random((5, 3, 4))
    law = EnergyAmplitude(1e-8, 0.075)
    once, thrice = (law.depth_per_pressure(scale * slip, FRICTION) for scale in (1.0, 3.0))
    np.testing.assert_allclose(thrice, 9.0 * once, rtol=1e-13)


def test_amplitude_law_by_hand() -> None:
    """α / (4 δ_ref) (Σ|Δs|) (Σ|q·Δs|), with pressures of its own in every increment."""
    slip, pressure = np.array([0.01, 0.0, 0.03]), np.array([100.0, 300.0, 200.0])
    law = EnergyAmplitude(1e-8, 0.075)
    depth = law.depth_per_pressure(slip[:, None, None], FRICTION).ravel() @ pressure
    dissipated = FRICTION * (100.0 * 0.01 + 200.0 * 0.03)
    assert depth == pytest.approx(1e-8 / (4.0 * 0.075) * 0.04 * dissipated, rel=1e-12)


@pytest.mark.parametrize("law", [Archard(1e-4, 3500.0), Energy(1e-8), EnergyAmplitude(1e-8, 0.075)])
def test_no_slip_no_wear(law) -> None:
    slip = np.zeros((4, 2, 2))
    slip[1, 0, 0] = 0.01
    depth = law.depth_per_pressure(slip, FRICTION)
    assert np.all((depth > 0.0) == (slip > 0.0))
