"""Tests of the layer's compliance against the equations of elasticity and thin layers."""

import numpy as np
import pytest
from scipy.linalg import expm

from tests.oracles.elastic_layer import layer_compliance, press, softness

POISSON = 0.3
# Lamé's constants and E* of E = 1 MPa.
LAME, SHEAR = POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON)), 0.5 / (1.0 + POISSON)
CONFINED, MODULUS = LAME + 2.0 * SHEAR, 1.0 / (1.0 - POISSON**2)


@pytest.mark.parametrize("alpha", [0.1, 0.5, 1.0, 2.0, 5.0])
def test_softness_solves_the_equations_of_the_layer(alpha: float) -> None:
    """With u = U sin x, w = W cos x, τ = T sin x, σ = S cos x an equation along z remains.

    It is solved from the base up.
    """
    rows = [
        [0.0, 1.0, 1.0 / SHEAR, 0.0],
        [-LAME / CONFINED, 0.0, 0.0, 1.0 / CONFINED],
        [CONFINED - LAME**2 / CONFINED, 0.0, 0.0, LAME / CONFINED],
        [0.0, 0.0, -1.0, 0.0],
    ]
    across = expm(alpha * np.array(rows))
    for free, stuck in (([0, 3], None), ([2, 3], POISSON)):
        base = np.zeros(4)
        base[free] = np.linalg.solve(across[2:, free], [0.0, 1.0])
        half_plane = 2.0 / MODULUS
        assert (across @ base)[1] == pytest.approx(half_plane * softness(alpha, stuck), rel=1e-12)


@pytest.mark.parametrize(
    ("stuck", "confined"),
    [(None, MODULUS), (POISSON, MODULUS * (1.0 - POISSON) ** 2 / (1.0 - 2.0 * POISSON))],
)
def test_thin_layers_press_as_the_books_say(stuck: float | None, confined: float) -> None:
    """For b << a, p = E' (a² - x²) / 2Rb and P = 2 E' a³ / 3Rb (Johnson 1985, section 5.8).

    The half-width is off by a share of b, the largest pressure by less.
    """
    lacking = []
    for half in (4.0, 8.0, 16.0):
        x, spacing = np.linspace(-1.15 * half, 1.15 * half, 231, retstep=True)
        compliance = layer_compliance(x, spacing, MODULUS, 1.0, hats=False, stuck=stuck)
        widths, load = np.full(len(x), spacing), 2.0 / 3.0 * confined * half**3
        pressure = press(compliance, 0.5 * x**2, widths, load)
        assert pressure.max() == pytest.approx(0.5 * confined * half**2, rel=0.02 / half)
        lacking.append(half - 0.5 * spacing * np.count_nonzero(pressure))
    assert np.ptp(lacking) < 0.15
    assert abs(lacking[-1]) < 0.3
