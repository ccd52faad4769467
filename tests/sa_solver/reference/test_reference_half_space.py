"""Uniform tractions and wavy contacts, by quadrature of point and line forces."""

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from sa_solver.reference.hertz import HertzCylinder
from sa_solver.reference.waviness import ChebyshevPunch, WavySurface
from sa_solver.types import ElasticPair, Material
from tests.oracles.uniform_traction import UniformRectangle, UniformStrip, love_displacement

STEEL, RUBBERY = Material(210e3, 0.3), Material(5e3, 0.45)
MODULUS = ElasticPair(STEEL, RUBBERY).contact_modulus
HALF_SIDES = (0.3, 0.2)
PAIR = UniformRectangle(HALF_SIDES, STEEL, RUBBERY)
PLACES = [(0.0, 0.0), (0.1, -0.15), (0.3, 0.05), (0.3, 0.2), (0.7, 0.2), (1e-9, 0.5), (-2.0, 3.0)]


def cerruti(body: Material, x: float, y: float) -> np.ndarray:
    """Return the displacement of the surface of z > 0 under a unit force along x.

    Johnson section 3.6, with z into the body.
    """
    r, lame = np.hypot(x, y), 4.0 * np.pi * body.shear_modulus
    return np.array(
        [
            (1.0 / r + x**2 / r**3 + (1.0 - 2.0 * body.poisson) * (1.0 / r - x**2 / r**3)) / lame,
            (x * y / r**3 - (1.0 - 2.0 * body.poisson) * x * y / r**3) / lame,
            (1.0 - 2.0 * body.poisson) * x / r**2 / lame,
        ]
    )


def boussinesq(body: Material, x: float, y: float) -> np.ndarray:
    """Return the displacement of the surface under a unit force into the body.

    Johnson section 3.2.
    """
    r, lame = np.hypot(x, y), 4.0 * np.pi * body.shear_modulus
    inward = (1.0 - 2.0 * body.poisson) / (lame * r**2)
    return np.array([-inward * x, -inward * y, 2.0 * (1.0 - body.poisson) / (lame * r)])


def pair(solution, x: float, y: float, flip: np.ndarray) -> np.ndarray:
    """Return body 2 minus body 1.

    The normal of body 1 points down, and its force is ``flip`` times that of body 2.
    """
    below = solution(STEEL, x, y) * flip
    return solution(RUBBERY, x, y) - below * np.array([1.0, 1.0, -1.0])


@pytest.mark.parametrize(
    ("loading", "solution", "flip"), [("sheared", cerruti, -1.0), ("pressed", boussinesq, 1.0)]
)
def test_rectangle_is_the_integral_of_point_forces(loading, solution, flip):
    """The force is q on body 2 and -q on body 1; pressure acts into both."""
    for place in ((0.7, 0.2), (-0.4, 0.5)):
        expected = [
            dblquad(
                lambda y, x, i=i, at=place: pair(solution, at[0] - x, at[1] - y, flip)[i],
                *(-0.3, 0.3),
                *(-0.2, 0.2),
                epsrel=1e-7,
                epsabs=1e-13,
            )[0]
            for i in range(3)
        ]
        np.testing.assert_allclose(getattr(PAIR, loading)(*place), expected, rtol=1e-6)


@pytest.mark.parametrize("place", PLACES)
def test_four_quarters_make_the_rectangle(place):
    """Points lie inside, on edges and at corners: outside of the quarters or at their corners."""
    quarter = UniformRectangle((0.15, 0.1), STEEL, RUBBERY)
    x, y = place
    for loading in ("pressed", "sheared"):
        parts = sum(
            getattr(quarter, loading)(x - sx * 0.15, y - sy * 0.1)
            for sx in (-1, 1)
            for sy in (-1, 1)
        )
        whole = getattr(PAIR, loading)(x, y)
        np.testing.assert_allclose(parts, whole, rtol=1e-9, atol=1e-18)


def test_love_agrees_with_the_contour():
    for x, y in PLACES:
        contour = PAIR.pressed(x, y)[2]
        if abs(x) != 0.3 and abs(y) != 0.2:
            love = love_displacement(np.array(x), np.array(y), HALF_SIDES, MODULUS)
            assert float(love) == pytest.approx(contour, rel=1e-9)


def test_like_bodies_do_not_couple():
    like = UniformRectangle(HALF_SIDES, STEEL, STEEL)
    assert np.all(like.pressed(0.5, 0.1)[:2] == 0.0)
    assert like.sheared(0.5, 0.1)[2] == 0.0


def test_coupling_is_reciprocal():
    """The normal displacement by shear equals the tangential displacement by pressure (Betti)."""
    assert PAIR.sheared(0.5, 0.1)[2] == pytest.approx(PAIR.pressed(-0.5, -0.1)[0], rel=1e-12)


@pytest.mark.parametrize("loading", ["pressed", "sheared"])
def test_a_long_rectangle_is_a_strip(loading):
    """Differences of u_x and u_z between two points are compared, because a strip has a datum."""
    strip = UniformStrip(0.3, STEEL, RUBBERY, 10.0)
    long = UniformRectangle((0.3, 3e6), STEEL, RUBBERY)
    for near, far in ((0.0, 0.25), (-0.1, 0.9)):
        u = np.array(getattr(strip, loading)(np.array([near, far])))
        v = getattr(long, loading)(far, 0.0) - getattr(long, loading)(near, 0.0)
        np.testing.assert_allclose(u[:, 1] - u[:, 0], v[[0, 2]], rtol=1e-6)


def test_strip_datum_and_edges():
    strip = UniformStrip(0.3, STEEL, RUBBERY, 10.0)
    for x in (0.0, 0.3, -1.2):
        kernel = quad(
            lambda s, x=x: np.log(abs(x - s) / 10.0),
            -0.3,
            0.3,
            points=[x] if abs(x) < 0.3 else None,
        )[0]
        u_x, u_z = strip.pressed(np.array(x))
        assert float(u_z) == pytest.approx(-2.0 / (np.pi * MODULUS) * kernel, rel=1e-8)
        assert float(u_x) == pytest.approx(-float(strip.sheared(np.array(x))[1]))


# -- waves

WAVES = WavySurface(1e-3, 2.0, 4.0, MODULUS)


def test_waves_carry_the_mean_pressure():
    a = WAVES.half_width
    total = quad(lambda x: float(WAVES.pressure(x)), -a, a)[0]
    assert total / WAVES.wavelength == pytest.approx(WAVES.mean_pressure, rel=1e-8)


@pytest.mark.parametrize("x", [0.0, 0.3, 0.55, -0.7])
def test_waves_close_the_gap(x):
    """A row of line loads causes slopes cot(π (x-ξ)/λ) π/λ: -h' in contact, more outside."""
    a, wavelength = 0.6, WAVES.wavelength
    mean = WAVES.full_contact_pressure * np.sin(np.pi * a / wavelength) ** 2
    waves = WavySurface(1e-3, wavelength, mean, MODULUS)
    assert waves.half_width == pytest.approx(a)

    def integrand(s: float) -> float:
        angle = np.pi * (x - s) / wavelength
        smooth = angle / np.tan(angle) if angle != 0.0 else 1.0
        return float(waves.pressure(s)) * smooth

    if abs(x) < a:
        hilbert = -quad(integrand, -a, a, weight="cauchy", wvar=x, limit=200)[0]
    else:
        hilbert = quad(lambda s: integrand(s) / (x - s), -a, a, limit=200)[0]
    step = 1e-5
    slope = float(waves.gap(x + step) - waves.gap(x - step)) / (2.0 * step)
    slope -= 2.0 / (np.pi * MODULUS) * hilbert
    if abs(x) < a:
        assert abs(slope) < 1e-8
    else:
        assert slope * x > 1e-5  # The gap opens away from the contact.


def test_light_waves_are_hertz_and_heavy_ones_are_full():
    light = WavySurface(1e-3, 2.0, 1e-4 * WAVES.full_contact_pressure, MODULUS)
    crest = (2.0 / (2.0 * np.pi)) ** 2 / 1e-3
    line = HertzCylinder(light.mean_pressure * 2.0, crest, MODULUS)
    assert light.half_width == pytest.approx(line.half_width, rel=1e-3)
    assert float(light.pressure(0.0)) == pytest.approx(line.peak_pressure, rel=1e-3)
    star = WAVES.full_contact_pressure
    heavy = WavySurface(1e-3, 2.0, (1.0 - 1e-9) * star, MODULUS)
    x = np.linspace(-0.9, 0.9, 11)
    np.testing.assert_allclose(heavy.pressure(x), star * (1.0 + np.cos(np.pi * x)), rtol=1e-3)
    for mean in (0.0, star):
        with pytest.raises(ValueError, match="mean pressure"):
            WavySurface(1e-3, 2.0, mean, MODULUS)


PUNCH = ChebyshevPunch(1.5, 300.0, 0.3, 8, MODULUS)


def punch_surface(punch: ChebyshevPunch, x: float, datum: float) -> float:
    """Return the gap under load by quadrature, without the approach."""
    a = punch.half_width
    displacement = quad(
        lambda s: float(punch.pressure(s)) * np.log(abs(x - s) / datum),
        -a,
        a,
        points=[x] if abs(x) < a else None,
        limit=400,
    )[0]
    displacement *= -2.0 / (np.pi * MODULUS)
    return float(punch.gap(x)) + displacement - punch.approach(datum)


def test_punch_closes_its_gap_inside_and_opens_outside():
    for x in (0.0, 0.4, -1.1, 1.49):
        assert abs(punch_surface(PUNCH, x, 9.0)) < 1e-7 * PUNCH.approach(9.0)
    gaps = [punch_surface(PUNCH, x, 9.0) for x in (1.501, 1.52, 1.6, 2.0)]
    assert gaps[0] > 0.0
    assert np.all(np.diff(gaps) > 0.0)


def test_punch_carries_the_load_with_several_peaks():
    x = np.linspace(-1.5, 1.5, 30001)
    p = PUNCH.pressure(x)
    assert np.trapezoid(p, x) == pytest.approx(300.0, rel=1e-5)
    assert np.all(p >= 0.0)
    assert np.sum((p[1:-1] > p[:-2]) & (p[1:-1] > p[2:])) == 5


def test_largest_waviness_touches_zero():
    limit = PUNCH.largest_waviness
    x = np.linspace(-1.5, 1.5, 30001)[1:-1]
    lowest = ChebyshevPunch(1.5, 300.0, limit, 8, MODULUS).pressure(x)
    interior = lowest[np.abs(x) < 1.45]
    assert 0.0 <= interior.min() + 1e-9 < 1e-2
    for waviness, order in ((1.01 * limit, 8), (-0.1, 8), (0.1, 3), (0.1, 0)):
        with pytest.raises(ValueError, match=r"waviness|order"):
            ChebyshevPunch(1.5, 300.0, waviness, order, MODULUS)


def test_without_waves_it_is_a_cylinder():
    plain = ChebyshevPunch(1.5, 300.0, 0.0, 2, MODULUS)
    radius = np.pi * MODULUS * 1.5**2 / (4.0 * 300.0)
    line, x = HertzCylinder(300.0, radius, MODULUS), np.linspace(-1.6, 1.6, 17)
    np.testing.assert_allclose(plain.pressure(x), line.pressure(x), atol=1e-10)
    np.testing.assert_allclose(plain.gap(x), line.gap(x), rtol=1e-12, atol=1e-15)
    assert plain.approach(7.0) == pytest.approx(line.approach(7.0), rel=1e-12)
