"""Plane partial slip: strains and slips by quadrature of Flamant's solution."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from sa_solver.reference.flat_rounded import FlatRoundedPunch
from sa_solver.reference.hertz import HertzCylinder
from sa_solver.reference.line_partial_slip import (
    BulkStressedCylinder,
    ShearedCylinder,
    ciavarella_jaeger,
)
from sa_solver.types import ElasticPair, Material

STEEL = Material(210e3, 0.3)
MODULUS = ElasticPair(STEEL, STEEL).contact_modulus
LINE = HertzCylinder(200.0, 30.0, MODULUS)
FRICTION = 0.6
SLIDING = FRICTION * LINE.load
A = LINE.half_width
TRACTION = FRICTION * LINE.peak_pressure


def strain(shear, x: float, ends: list[float]) -> float:
    """Return du_x/dx by the shear alone: Cauchy's principal value, with roots at ``ends``."""
    total = 0.0
    for low, high in pairwise(sorted(ends)):
        if high - low < 1e-12:
            continue
        if low < x < high:
            total -= quad(shear, low, high, weight="cauchy", wvar=x, limit=400, epsabs=1e-7)[0]
        else:
            total += quad(lambda s: shear(s) / (x - s), low, high, limit=400, epsabs=1e-7)[0]
    return -2.0 / (np.pi * MODULUS) * total


def carried(shear, ends: list[float]) -> float:
    return sum(quad(shear, low, high, limit=200)[0] for low, high in pairwise(sorted(ends)))


def bulk(tangential: float, stress: float, body: int = 2) -> BulkStressedCylinder:
    return BulkStressedCylinder(LINE, FRICTION, tangential, stress, body)


def slip_at(contact: BulkStressedCylinder, x: float) -> float:
    """Return the slip at ``x``: the stretch of body 2 relative to body 1 from the sticking edge."""
    ends = [-A, A, contact.offset - contact.stick_half_width]
    ends.append(contact.offset + contact.stick_half_width)
    node, gauss = np.polynomial.legendre.leggauss(12)
    edge = ends[3] if x > contact.offset else ends[2]
    points = 0.5 * (edge + x) + 0.5 * (x - edge) * node
    rates = [strain(contact.shear, s, ends) + contact.mismatch_strain for s in points]
    return float(np.sum(gauss * rates)) * 0.5 * (x - edge)


# -- shear alone


@pytest.mark.parametrize("tangential", [5.0, 70.0, -110.0, SLIDING])
def test_shear_carries_the_load(tangential):
    contact = ShearedCylinder(LINE, FRICTION)
    c = contact.stick_half_width(tangential)
    total = carried(lambda x: float(contact.shear(x, tangential)), [-A, -c, c, A])
    assert total == pytest.approx(tangential, rel=1e-7)


@pytest.mark.parametrize("position", [0.0, 0.5, -0.95])
def test_stuck_points_have_the_displacement_of_the_body(position):
    contact, tangential, datum = ShearedCylinder(LINE, FRICTION), 70.0, 11.0
    c = contact.stick_half_width(tangential)
    x = position * c

    def kernel(s: float) -> float:
        return float(contact.shear(s, tangential)) * np.log(abs(x - s) / datum)

    displacement = -2.0 / (np.pi * MODULUS) * carried(kernel, [-A, -c, x, c, A])
    assert displacement == pytest.approx(contact.displacement(tangential, datum), rel=1e-7)


def test_at_sliding_the_displacement_is_that_of_the_pressure_times_friction():
    contact = ShearedCylinder(LINE, FRICTION)
    sliding = contact.displacement(SLIDING, 5.0)
    assert sliding == pytest.approx(FRICTION * LINE.approach(5.0), rel=1e-12)


def test_loop_area_needs_no_datum_and_is_the_energy():
    contact = ShearedCylinder(LINE, FRICTION)
    loads = 90.0 * np.cos(np.linspace(0.0, np.pi, 4001))
    for datum in (1.0, 100.0):
        back = np.array([contact.displacement_after([90.0, load], datum) for load in loads])
        area = np.trapezoid(back + back[::-1], -loads)
        assert area == pytest.approx(contact.loop_energy(90.0), rel=1e-4)


@pytest.mark.slow
def test_energy_is_the_work_of_friction():
    """Masing: a half cycle slips twice as far as first loading, under µ p at both edges."""
    contact = bulk(90.0, 0.0)
    c = contact.stick_half_width
    node, gauss = np.polynomial.legendre.leggauss(16)
    work = 0.0
    for x, weight in zip(0.5 * (A + c) + 0.5 * (A - c) * node, gauss, strict=True):
        work -= weight * 0.5 * (A - c) * float(contact.shear(x)) * slip_at(contact, x)
    energy = ShearedCylinder(LINE, FRICTION).loop_energy(90.0)
    assert 4.0 * 2.0 * work == pytest.approx(energy, rel=1e-3)


def test_shear_after_reversals():
    contact, x = ShearedCylinder(LINE, FRICTION), np.linspace(-1.1 * A, 1.1 * A, 20001)
    for last in (20.0, -50.0, -90.0):
        q = contact.shear_after(x, [90.0, last])
        assert np.trapezoid(q, x) == pytest.approx(last, rel=1e-4)
        assert np.all(np.abs(q) <= FRICTION * LINE.pressure(x) + 1e-9)
    np.testing.assert_allclose(q, -contact.shear(x, 90.0), atol=1e-10)


# -- bulk stress


@pytest.mark.parametrize("body", [1, 2])
@pytest.mark.parametrize("tangential", [80.0, -80.0])
@pytest.mark.parametrize("stress", [0.5 * TRACTION, -0.5 * TRACTION])
def test_bulk_stress_is_undone_where_the_contact_sticks(body, tangential, stress):
    """The surface strains are equal: K q, and ± σ (1 - ν²)/E in the body with the stress."""
    contact = bulk(tangential, stress, body)
    e, c = contact.offset, contact.stick_half_width
    ends = [-A, e - c, e + c, A]
    mismatch = stress * (1.0 - STEEL.poisson**2) / STEEL.young * (1.0 if body == 2 else -1.0)
    for x in (e - 0.7 * c, e, e + 0.4 * c):
        assert strain(contact.shear, x, ends) == pytest.approx(-mismatch, rel=1e-5)
    assert carried(contact.shear, ends) == pytest.approx(tangential, rel=1e-7)
    assert abs(e) == pytest.approx(A * 0.5 / 4.0)
    assert np.sign(e) == np.sign(tangential * mismatch)
    for x in (0.5 * (e + c + A), 0.5 * (e - c - A)):
        assert slip_at(contact, x) * tangential < 0.0


def test_moderate_bulk_stress_ends_where_the_stuck_zone_meets_the_edge():
    limit = 4.0 * (1.0 - np.sqrt(1.0 - 80.0 / SLIDING)) * TRACTION
    assert bulk(80.0, limit).offset + bulk(80.0, limit).stick_half_width == pytest.approx(A)
    with pytest.raises(ValueError, match="reverses slip"):
        bulk(80.0, 1.001 * limit)
    with pytest.raises(ValueError, match="reverses slip"):
        bulk(0.0, 0.01 * TRACTION)


def test_without_bulk_stress_it_is_the_plain_contact():
    contact, x = ShearedCylinder(LINE, FRICTION), np.linspace(-A, A, 101)
    np.testing.assert_allclose(bulk(80.0, 0.0).shear(x), contact.shear(x, 80.0))
    back = bulk(80.0, 0.0).reversed_shear(x, -30.0, 0.0)
    np.testing.assert_allclose(back, contact.shear_after(x, [80.0, -30.0]), atol=1e-10)


@pytest.mark.parametrize(("tangential", "share"), [(20.0, 1.0), (-20.0, -0.25), (-80.0, -1.0)])
def test_on_the_way_back_what_sticks_keeps_its_slip(tangential, share):
    """The change of shear strains the reversed sticking zone by minus the change of mismatch."""
    stress = 0.5 * TRACTION
    contact = bulk(80.0, stress)
    half_width, centre = contact.reversed_zone(tangential, share * stress)
    e, c = contact.offset, contact.stick_half_width
    ends = [-A, e - c, e + c, centre - half_width, centre + half_width, A]

    def change(x: float) -> float:
        shear = contact.reversed_shear(np.array(x), tangential, share * stress)
        return float(shear - contact.shear(x))

    mismatch = (share - 1.0) * stress * (1.0 - STEEL.poisson**2) / STEEL.young
    for x in (centre - 0.6 * half_width, centre + 0.3 * half_width):
        assert strain(change, x, ends) == pytest.approx(-mismatch, rel=1e-5, abs=1e-9)
    assert carried(change, ends) == pytest.approx(tangential - 80.0, rel=1e-7)
    x = np.linspace(-A, A, 1001)
    q = contact.reversed_shear(x, tangential, share * stress)
    slipping = np.abs(x - centre) > half_width
    np.testing.assert_allclose(q[slipping], -FRICTION * LINE.pressure(x[slipping]), atol=1e-9)
    assert np.all(np.abs(q) <= FRICTION * LINE.pressure(x) + 1e-9)


def test_where_the_reversed_zone_stands():
    stress = 0.5 * TRACTION
    contact, x = bulk(80.0, stress), np.linspace(-A, A, 101)
    assert contact.reversed_zone(20.0, stress)[1] == 0.0
    cycled = contact.reversed_zone(-80.0, -stress)
    assert cycled == pytest.approx((contact.stick_half_width, contact.offset))
    other_end = contact.reversed_shear(x, -80.0, -stress)
    np.testing.assert_allclose(other_end, -contact.shear(x), atol=1e-9)


def test_a_held_stress_limits_the_way_back():
    contact = bulk(80.0, 0.5 * TRACTION)
    with pytest.raises(ValueError, match="stuck on first loading"):
        contact.reversed_shear(np.zeros(1), -80.0, 0.5 * TRACTION)
    with pytest.raises(ValueError, match="turn back"):
        contact.reversed_zone(90.0, 0.5 * TRACTION)


# -- any profile


def test_ciavarella_jaeger_of_a_cylinder_is_cattaneo_mindlin():
    x = np.linspace(-1.1 * A, 1.1 * A, 101)
    shear = ciavarella_jaeger(
        lambda load: HertzCylinder(load, 30.0, MODULUS).pressure(x), 200.0, -70.0, FRICTION
    )
    expected = ShearedCylinder(LINE, FRICTION).shear(x, -70.0)
    np.testing.assert_allclose(shear, expected, atol=1e-10)


def test_ciavarella_jaeger_sticks_a_rounded_flat():
    """There is no strain where p(P*) > 0 and slip against the shear outside; the load is Q."""
    load, tangential = 400.0, 160.0
    whole = FlatRoundedPunch(1.0, 60.0, load, MODULUS)
    inner = FlatRoundedPunch(1.0, 60.0, load - tangential / FRICTION, MODULUS)
    b, c = whole.contact_half_width, inner.contact_half_width

    def shear(x: float) -> float:
        return float(
            ciavarella_jaeger(
                lambda load: (whole if load == 400.0 else inner).pressure(np.array(x)),
                load,
                tangential,
                FRICTION,
            )
        )

    ends = [-b, -c, -1.0, 1.0, c, b]
    assert carried(shear, ends) == pytest.approx(tangential, rel=1e-6)
    slipping = strain(shear, 0.5 * (b + c), ends)
    for x in (0.0, 0.6, 0.5 * (1.0 + c)):
        assert abs(strain(shear, x, ends)) < 1e-4 * abs(slipping)
    assert slipping < 0.0  # The surface lags behind the body more towards the edge.


def test_ciavarella_jaeger_at_and_beyond_sliding():
    x = np.linspace(-A, A, 11)
    sliding = ciavarella_jaeger(
        lambda load: HertzCylinder(load, 30.0, MODULUS).pressure(x), 200.0, 0.5 * 200.0, 0.5
    )
    np.testing.assert_allclose(sliding, 0.5 * LINE.pressure(x))
    with pytest.raises(ValueError, match="slides"):
        ciavarella_jaeger(lambda load: x, 200.0, 101.0, 0.5)
