"""Sheared and twisted spheres, by quadrature of Cerruti's Green's function."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe, ellipkm1

from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.reference.torsion import TwistedSphere
from sa_solver.types import Material

TITANIUM = Material(115e3, 0.29)
STEEL = Material(210e3, 0.3)
SHEARED = ShearedSphere(400.0, 10.0, TITANIUM, TITANIUM, 0.7)
TWISTED = TwistedSphere(400.0, 10.0, TITANIUM, TITANIUM, 0.7)
RADIUS = SHEARED.contact.contact_radius


def polar(field, x: float, y: float, weight) -> float:
    """Return ∫ weight(θ) ∫ field dρ dθ about (x, y), by midpoints in θ and Gauss points to a."""
    angle = (np.arange(256) + 0.5)[:, None] * (2.0 * np.pi / 256)
    node, gauss = np.polynomial.legendre.leggauss(400)
    toward = x * np.cos(angle) + y * np.sin(angle)
    reach = -toward + np.sqrt(toward**2 + RADIUS**2 - x**2 - y**2)
    distance = 0.5 * reach * (1.0 + node)
    values = field(x + distance * np.cos(angle), y + distance * np.sin(angle))
    rays = np.sum(values * gauss, axis=1, keepdims=True) * 0.5 * reach
    return float(np.sum(weight(angle) * rays) * (2.0 * np.pi / 256))


def ring_twist(contact: TwistedSphere, moment: float, r: float) -> float:
    """Return u_θ times G of one body, by rings of radius s: ∮ cos θ / ρ in K and E."""
    a, c = contact.contact.contact_radius, contact.stick_radius(moment)
    # The double-exponential rule handles the logarithm at s = r and the roots at c and a.
    u = np.linspace(-2.7, 2.7, 201)
    node = np.tanh(0.5 * np.pi * np.sinh(u))
    weight = 0.5 * np.pi * np.cosh(u) / np.cosh(0.5 * np.pi * np.sinh(u)) ** 2 * (u[1] - u[0])
    total = 0.0
    for low, high in pairwise(sorted({0.0, r, c, a})):
        s = 0.5 * (low + high) + 0.5 * (high - low) * node
        rest = ((r - s) / (r + s)) ** 2
        m = 1.0 - rest
        cosine = 2.0 / (r + s) * ((2.0 / m - 1.0) * ellipkm1(rest) - 2.0 / m * ellipe(m))
        integrand = contact.shear(s, moment) * s * cosine / np.pi
        total += float(np.sum(weight * integrand)) * 0.5 * (high - low)
    return total


# -- shear


def test_numbers_of_the_dovetail_paper():
    assert SHEARED.stick_radius(210.0) / RADIUS == pytest.approx(0.62996, abs=5e-6)
    assert SHEARED.displacement(210.0) == pytest.approx(6.695e-3, abs=5e-7)
    assert SHEARED.loop_energy(210.0) == pytest.approx(0.41409, abs=5e-6)


@pytest.mark.parametrize("tangential", [1.0, 210.0, -279.0, 280.0])
def test_shear_carries_the_load(tangential):
    carried = quad(
        lambda r: 2.0 * np.pi * r * float(SHEARED.shear(r, 0.0, tangential)),
        0.0,
        RADIUS,
        points=[SHEARED.stick_radius(tangential)],
    )[0]
    assert carried == pytest.approx(tangential, rel=1e-7)


@pytest.mark.parametrize("position", [(0.0, 0.0), (0.4, 0.0), (0.0, 0.5), (-0.3, 0.4)])
def test_stuck_points_move_with_the_body(position):
    """u_x follows from q alone, by Cerruti with ν; it is δx where the surface sticks."""
    contact = ShearedSphere(400.0, 10.0, TITANIUM, Material(115e3, 0.0), 0.7)
    a = contact.contact.contact_radius
    x, y = position[0] * RADIUS, position[1] * RADIUS
    scale = a / RADIUS  # The quadrature is over the disk of RADIUS.
    moved = sum(
        polar(
            lambda x, y: contact.shear(scale * x, scale * y, 210.0),
            x,
            y,
            lambda angle, v=body.poisson: (1.0 - v) + v * np.cos(angle) ** 2,
        )
        * scale
        / (2.0 * np.pi * body.shear_modulus)
        for body in (contact.body_1, contact.body_2)
    )
    assert moved == pytest.approx(contact.displacement(210.0), rel=2e-4)


def test_first_displacements_are_those_without_slip():
    small = SHEARED.displacement(1e-3) / 1e-3
    assert small == pytest.approx(SHEARED.tangential_compliance, rel=1e-5)


def test_exchange_of_bodies_and_of_sign():
    one = ShearedSphere(400.0, 10.0, TITANIUM, STEEL, 0.7)
    other = ShearedSphere(400.0, 10.0, STEEL, TITANIUM, 0.7)
    assert one.displacement(150.0) == pytest.approx(other.displacement(150.0), rel=1e-14)
    assert one.displacement(-150.0) == -one.displacement(150.0)


def test_loop_of_shear_is_closed_and_its_area_is_the_energy():
    loads = 210.0 * np.cos(np.linspace(0.0, np.pi, 4001))
    back = np.array([SHEARED.displacement_after([210.0, load]) for load in loads])
    area = 2.0 * np.trapezoid(back + back[::-1], -loads) / 2.0
    assert back[[0, -1]] == pytest.approx([6.6952e-3, -6.6952e-3], rel=1e-4)
    assert area == pytest.approx(SHEARED.loop_energy(210.0), rel=1e-5)


def test_energy_is_the_work_of_friction_in_the_annulus():
    """Masing, ν = 0: a half cycle slips twice as far as first loading to Q, under µ p."""
    contact = ShearedSphere(400.0, 10.0, Material(115e3, 0.0), Material(115e3, 0.0), 0.7)
    tangential, steps = 210.0, 40
    a, modulus = contact.contact.contact_radius, 57.5e3
    scale = a / RADIUS
    c = contact.stick_radius(tangential)
    node, gauss = np.polynomial.legendre.leggauss(steps)
    radius = 0.5 * (a + c) + 0.5 * (a - c) * node
    work = 0.0
    for r, weight in zip(radius, gauss * 0.5 * (a - c), strict=True):
        moved = polar(
            lambda x, y: contact.shear(scale * x, scale * y, tangential),
            r / scale,
            0.0,
            lambda angle: 1.0,
        )
        slip = 2.0 * moved * scale / (2.0 * np.pi * modulus) - contact.displacement(tangential)
        assert slip < 1e-9  # slip against the shear
        work -= weight * 2.0 * np.pi * r * float(contact.shear(r, 0.0, tangential)) * slip
    assert 4.0 * work == pytest.approx(contact.loop_energy(tangential), rel=2e-3)


def test_reversed_shear_carries_the_load_and_respects_friction():
    r = np.linspace(0.0, RADIUS, 4001)
    q = SHEARED.shear_after(r, 0.0 * r, [210.0, -60.0])
    limit = 0.7 * SHEARED.contact.pressure(r, 0.0 * r)
    assert np.all(np.abs(q) <= limit + 1e-9)
    assert np.trapezoid(2.0 * np.pi * r * q, r) == pytest.approx(-60.0, rel=1e-4)


def test_a_load_at_the_limit_but_for_rounding_is_at_the_limit():
    """Such a load comes from a solver that was given the limit and summed up its shear."""
    assert SHEARED.stick_radius(SHEARED.sliding_force * (1.0 + 1e-9)) == 0.0
    assert TWISTED.stick_radius(TWISTED.sliding_moment * (1.0 + 1e-9)) == 0.0


def test_beyond_friction_there_is_no_partial_slip():
    with pytest.raises(ValueError, match="slides"):
        SHEARED.displacement(281.0)
    with pytest.raises(ValueError, match="slides"):
        TWISTED.twist(59.9)


# -- twist


def test_sliding_moment_is_the_moment_of_friction():
    moment = quad(
        lambda r: 2.0 * np.pi * r**2 * 0.7 * float(TWISTED.contact.pressure(r, 0.0)), 0.0, RADIUS
    )[0]
    assert TWISTED.sliding_moment == pytest.approx(moment, rel=1e-8)
    assert TWISTED.sliding_moment == pytest.approx(59.85, abs=5e-3)


@pytest.mark.parametrize("moment", [0.1, 10.0, 50.0, -59.8])
def test_twist_shear_carries_the_moment(moment):
    node, gauss = np.polynomial.legendre.leggauss(60)
    c, total = TWISTED.stick_radius(moment), 0.0
    for low, high in ((0.0, c), (c, RADIUS)):
        # With r = end - u², at the stick radius, where the slope is infinite, and at the edge.
        u = 0.5 * np.sqrt(high - low) * (1.0 + node)
        r = high - u**2
        integrand = 2.0 * np.pi * r**2 * TWISTED.shear(r, moment) * 2.0 * u
        total += np.sum(gauss * integrand) * 0.5 * np.sqrt(high - low)
    assert total == pytest.approx(moment, rel=1e-6)


def test_shear_is_continuous_at_the_stick_radius():
    c = TWISTED.stick_radius(20.0)
    inside, outside = TWISTED.shear(c * np.array([1.0 - 1e-10, 1.0 + 1e-10]), 20.0)
    assert inside == pytest.approx(outside, rel=1e-4)
    assert inside < outside


@pytest.mark.parametrize("moment", [10.0, 50.0])
def test_stuck_circle_rotates_rigidly_and_the_annulus_lags(moment):
    c, shear_modulus = TWISTED.stick_radius(moment), TITANIUM.shear_modulus
    for r in (0.2 * c, 0.6 * c, 0.95 * c):
        rotation = 2.0 * ring_twist(TWISTED, moment, r) / (shear_modulus * r)
        assert rotation == pytest.approx(TWISTED.twist(moment), rel=1e-6)
    for r in (0.3 * c + 0.7 * RADIUS, 0.5 * (c + RADIUS)):
        rotation = 2.0 * ring_twist(TWISTED, moment, r) / (shear_modulus * r)
        assert rotation < TWISTED.twist(moment)


def test_a_small_twist_does_not_slip():
    moment = 1e-3
    assert moment / TWISTED.twist(moment) == pytest.approx(TWISTED.torsional_stiffness, rel=1e-4)
    equal_bodies = 8.0 / 3.0 * TITANIUM.shear_modulus * RADIUS**3
    assert TWISTED.torsional_stiffness == pytest.approx(equal_bodies, rel=1e-14)
    r = np.linspace(0.0, 0.9 * RADIUS, 10)
    no_slip = TWISTED.no_slip_shear(r, moment)
    np.testing.assert_allclose(TWISTED.shear(r, moment), no_slip, rtol=1e-4)


def test_no_twist_and_sliding():
    r = np.linspace(0.0, 1.2 * RADIUS, 7)
    assert np.all(TWISTED.shear(r, 0.0) == 0.0)
    assert TWISTED.twist(0.0) == 0.0
    sliding = 0.7 * TWISTED.contact.pressure(r, 0.0 * r)
    np.testing.assert_allclose(TWISTED.shear(r, TWISTED.sliding_moment), sliding)
    assert TWISTED.twist(TWISTED.sliding_moment) == np.inf


def test_loop_of_twist_is_its_energy():
    moments = 40.0 * np.cos(np.linspace(0.0, np.pi, 201))
    back = np.array([TWISTED.twist_after([40.0, moment]) for moment in moments])
    area = np.trapezoid(back + back[::-1], -moments)
    assert area == pytest.approx(TWISTED.loop_energy(40.0), rel=1e-3)
    assert back[-1] == pytest.approx(-back[0], rel=1e-12)


def test_small_loops_grow_with_the_cube():
    ratio = TWISTED.loop_energy(2.0) / TWISTED.loop_energy(1.0)
    assert ratio == pytest.approx(8.0, rel=0.05)


def test_twist_shear_after_reversal_carries_the_moment():
    r = np.linspace(0.0, RADIUS, 20001)
    q = TWISTED.shear_after(r, [40.0, -10.0])
    assert np.trapezoid(2.0 * np.pi * r**2 * q, r) == pytest.approx(-10.0, rel=1e-3)
    assert np.all(np.abs(q) <= 0.7 * TWISTED.contact.pressure(r, 0.0 * r) + 1e-9)
