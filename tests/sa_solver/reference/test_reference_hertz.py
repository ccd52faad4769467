"""Hertz: the displacement by the pressure closes the gap, by quadrature of Green's functions."""

import numpy as np
import pytest
from scipy.integrate import quad

from sa_solver.reference.hertz import HertzCylinder, HertzEllipse, HertzSphere

MODULUS = 62777.0
LOAD = 400.0


def displacement_inside(contact: HertzEllipse, x: float, y: float) -> float:
    """Return u_z inside: ∫∫ p dρ dθ / π E*, in polar coordinates about the point."""
    a, b = contact.semi_axes

    def along_ray(angle: float) -> float:
        # Along a chord of the ellipse p² is a parabola; its square root integrates to half an arc.
        c, s = np.cos(angle), np.sin(angle)
        square = (c / a) ** 2 + (s / b) ** 2
        half = (x * c / a**2 + y * s / b**2) / square
        inside = 1.0 - (x / a) ** 2 - (y / b) ** 2
        reach = half + np.sqrt(half**2 + inside / square)
        return quad(
            lambda u: (
                2.0 * u * float(contact.pressure(x - (reach - u * u) * c, y - (reach - u * u) * s))
            ),
            0.0,
            np.sqrt(reach),
        )[0]

    full = quad(along_ray, 0.0, 2.0 * np.pi, limit=200, epsrel=1e-9)[0]
    return full / (np.pi * contact.contact_modulus)


def test_equal_radii_make_a_sphere():
    ellipse, sphere = HertzEllipse(LOAD, 10.0, 10.0, MODULUS), HertzSphere(LOAD, 10.0, MODULUS)
    assert ellipse.semi_axes == pytest.approx([sphere.contact_radius] * 2, rel=1e-12)
    assert ellipse.peak_pressure == pytest.approx(sphere.peak_pressure, rel=1e-12)
    assert ellipse.approach == pytest.approx(sphere.approach, rel=1e-12)


def test_exchange_of_axes():
    one, other = HertzEllipse(LOAD, 5.0, 80.0, MODULUS), HertzEllipse(LOAD, 80.0, 5.0, MODULUS)
    assert one.semi_axes == pytest.approx(other.semi_axes[::-1], rel=1e-12)
    assert one.semi_axes[0] < one.semi_axes[1]
    assert one.approach == pytest.approx(other.approach, rel=1e-12)


@pytest.mark.parametrize("radius_y", [3.0, 10.0, 200.0])
def test_ellipse_closes_the_gap(radius_y):
    contact = HertzEllipse(LOAD, 10.0, radius_y, MODULUS)
    a, b = contact.semi_axes
    for x, y in ((0.0, 0.0), (0.6 * a, 0.0), (0.0, 0.7 * b), (-0.4 * a, 0.5 * b)):
        gap = contact.gap(x, y) + displacement_inside(contact, x, y) - contact.approach
        assert abs(gap) < 1e-7 * contact.approach


def test_a_long_ellipse_is_a_cylinder():
    """For b >> a every section is a line contact under its own load per length."""
    contact = HertzEllipse(LOAD, 10.0, 1e7, MODULUS)
    a, b = contact.semi_axes
    per_length = 1.5 * LOAD / (2.0 * b)  # at y = 0; it is a parabola along y
    line = HertzCylinder(per_length, 10.0, MODULUS)
    assert b / a > 200.0
    assert a == pytest.approx(line.half_width, rel=1e-3)
    assert contact.peak_pressure == pytest.approx(line.peak_pressure, rel=1e-3)


@pytest.mark.parametrize("position", [0.0, 0.3, -0.8])
def test_cylinder_closes_the_gap_at_its_datum(position):
    line, datum = HertzCylinder(100.0, 10.0, MODULUS), 7.0
    a, x = line.half_width, position * line.half_width
    displacement = quad(
        lambda s: float(line.pressure(s)) * np.log(abs(x - s) / datum), -a, a, points=[x], limit=200
    )[0]
    displacement *= -2.0 / (np.pi * MODULUS)
    assert line.gap(x) + displacement == pytest.approx(line.approach(datum), rel=1e-7)
