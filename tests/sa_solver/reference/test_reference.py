"""Closed forms: equilibrium and limits."""

import numpy as np
import pytest
from scipy.integrate import quad

from sa_solver.reference.flat_rounded import FlatRoundedPunch
from sa_solver.reference.hertz import HertzCylinder, HertzSphere
from sa_solver.types import ElasticPair, Material

TITANIUM = Material(115e3, 0.29)
MODULUS = ElasticPair(TITANIUM, TITANIUM).contact_modulus
PRODUCTION = FlatRoundedPunch(4.0, 30.0, 1440.0, MODULUS)


def test_sphere_of_the_dovetail_paper():
    sphere = HertzSphere(400.0, 10.0, MODULUS)
    assert sphere.contact_radius == pytest.approx(0.36288, abs=5e-6)
    assert sphere.peak_pressure == pytest.approx(1450.3, abs=0.05)
    assert sphere.approach == pytest.approx(13.168e-3, abs=5e-7)


def test_hertz_pressure_carries_the_load():
    sphere, cylinder = HertzSphere(400.0, 10.0, MODULUS), HertzCylinder(100.0, 10.0, MODULUS)
    a = sphere.contact_radius
    carried = quad(lambda r: 2.0 * np.pi * r * float(sphere.pressure(r, 0.0)), 0.0, a)[0]
    assert carried == pytest.approx(400.0, rel=1e-8)
    b = cylinder.half_width
    assert quad(lambda x: float(cylinder.pressure(x)), -b, b)[0] == pytest.approx(100.0, rel=1e-8)


@pytest.mark.parametrize("load", [20.0, 1440.0, 20000.0])
def test_flat_rounded_carries_the_load(load):
    contact = FlatRoundedPunch(4.0, 30.0, load, MODULUS)
    b = contact.contact_half_width
    halves = [(0.0, 4.0), (4.0, b)]
    carried = 2.0 * sum(quad(contact.pressure, *half, limit=200)[0] for half in halves)
    assert carried == pytest.approx(load, rel=1e-7)


def test_without_flat_it_is_a_cylinder():
    contact, cylinder = (
        FlatRoundedPunch(1e-5, 30.0, 1440.0, MODULUS),
        HertzCylinder(1440.0, 30.0, MODULUS),
    )
    assert contact.contact_half_width == pytest.approx(cylinder.half_width, rel=1e-4)
    x = np.linspace(-1.25, 1.25, 26) * cylinder.half_width
    tolerance = 1e-4 * cylinder.peak_pressure
    np.testing.assert_allclose(contact.pressure(x), cylinder.pressure(x), atol=tolerance)


def test_with_sharp_edges_it_is_a_flat_punch():
    contact = FlatRoundedPunch(4.0, 1e-4, 1440.0, MODULUS)
    x = np.linspace(0.0, 3.0, 7)
    punch = 1440.0 / (np.pi * np.sqrt(16.0 - x**2))
    np.testing.assert_allclose(contact.pressure(x), punch, rtol=1e-4)


def test_pressure_closes_the_gap():
    """The curvature of the profile follows from the pressure: H[p] = (π E*/2) h', 0 on the flat.

    Plane relation (Johnson eq. 2.25 with 2(1-ν²)/E → 2/E*): PV ∫ p(s)/(x-s) ds = (π E*/2) h'(x).
    """
    b = PRODUCTION.contact_half_width
    s = (np.arange(400000) + 0.5) / 200000.0 * b - b
    p, ds = PRODUCTION.pressure(s), b / 200000.0
    for x, slope in ((0.5, 0.0), (2.0, 0.0), (4.3, 0.3 / 30.0)):
        middle = s[np.argmin(np.abs(s - x))] + 0.5 * ds
        hilbert = np.sum(p / (middle - s)) * ds
        assert hilbert == pytest.approx(0.5 * np.pi * MODULUS * slope, rel=2e-3, abs=1.0)


def test_peak_is_the_largest_pressure():
    peak, position = PRODUCTION.peak
    x = np.linspace(0.0, PRODUCTION.contact_half_width, 20001)
    assert peak == pytest.approx(PRODUCTION.pressure(x).max(), rel=1e-5)
    assert 4.0 < position < PRODUCTION.contact_half_width


@pytest.mark.parametrize("radius", [3.0, 30.0, 150.0])
@pytest.mark.parametrize("load", [20.0, 1440.0])
def test_five_percent_needs_a_third_of_the_rounded_band(radius, load):
    contact = FlatRoundedPunch(4.0, radius, load, MODULUS)
    band = contact.contact_half_width - contact.half_width
    assert -0.05 <= contact.peak_error(0.33 * band) < -0.035
    assert contact.peak_error(0.4 * band) < -0.05
