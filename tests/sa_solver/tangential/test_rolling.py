"""Tests of steady rolling against Carter's cylinders, Kalker's linear theory, and balances."""

from __future__ import annotations

import numpy as np
import pytest

from sa_solver import ElasticPair, FrictionalContact, Grid, HalfSpace, Material, steady_rolling
from sa_solver.errors import InputError
from sa_solver.reference.hertz import HertzCylinder, HertzSphere
from tests.marks import slow

STEEL = Material(young=210e3, poisson=0.3)
FRICTION, LOAD, RADIUS = 0.3, 200.0, 50.0


def cylinder(cells: int, pair: ElasticPair | None = None):
    """Return a contact of cylinders, its heights and Hertz's solution."""
    grid = Grid.line_contact(1.0, cells)
    contact = FrictionalContact(HalfSpace(grid, pair or ElasticPair(STEEL, STEEL)), FRICTION)
    hertz = HertzCylinder(LOAD, RADIUS, contact.half_space.pair.contact_modulus)
    return contact, hertz.gap(grid.x), hertz


@pytest.mark.parametrize("share", [0.2, -0.5, 0.9])
def test_cylinders_creep_as_carter_says(share) -> None:
    """Carter 1926: ξ = µ(a - c)/R, and |x - (a - c)| < c sticks, with c = a √(1 - Q/µP)."""
    contact, height, hertz = cylinder(96)
    a, sign = hertz.half_width, np.sign(share)
    c = a * np.sqrt(1.0 - abs(share))
    rolling = steady_rolling(contact, height, LOAD, Qx=share * FRICTION * LOAD)
    assert rolling.creepage[0] == pytest.approx(sign * FRICTION * (a - c) / RADIUS, rel=0.03)
    x, cell = contact.grid.x.ravel(), contact.grid.pitch[0]
    sticking = x[rolling.contact.sticking.ravel()]
    assert np.abs(sticking[[0, -1]] - [a - 2.0 * c, a]).max() <= 1.5 * cell
    outer, inner = (
        np.sqrt(np.maximum(half**2 - (x - middle) ** 2, 0.0)) / a
        for middle, half in ((0.0, a), (a - c, c))
    )
    error = rolling.contact.shear[0].ravel() / (FRICTION * hertz.peak_pressure)
    error -= sign * (outer - inner)
    assert np.abs(error).mean() < 0.01


def test_creepage_and_force_are_inverse_to_each_other() -> None:
    contact, height, _ = cylinder(64)
    forced = steady_rolling(contact, height, LOAD, Qx=30.0, tolerance=1e-5)
    creepage = float(forced.creepage[0])
    moved = steady_rolling(contact, height, LOAD, creepage_x=creepage, tolerance=1e-5)
    assert moved.contact.resultants[1] == pytest.approx(30.0, rel=1e-4)


def test_work_of_the_forces_is_dissipated() -> None:
    contact, height, _ = cylinder(96)
    rolling = steady_rolling(contact, height, LOAD, Qx=30.0, tolerance=1e-5)
    found = rolling.contact.energy.sum() / contact.grid.pitch[0]
    assert rolling.dissipation == pytest.approx(found, rel=2e-3)


def test_large_creepage_slides() -> None:
    contact, height, _ = cylinder(48)
    rolling = steady_rolling(contact, height, LOAD, creepage_x=0.05)
    assert rolling.contact.resultants[1] == pytest.approx(FRICTION * LOAD, rel=1e-4)
    assert not rolling.contact.sticking.any()


def test_dissimilar_cylinders_creep_without_traction() -> None:
    """One surface stretches more than the other: exchanging the bodies changes the sign."""
    soft, creepages = Material(young=70e3, poisson=0.2), []
    for pair in (ElasticPair(soft, STEEL), ElasticPair(STEEL, soft)):
        contact, height, _ = cylinder(48, pair)
        creepages.append(steady_rolling(contact, height, LOAD, Qx=0.0).creepage[0])
    assert abs(creepages[0]) > 1e-5
    assert creepages[0] == pytest.approx(-creepages[1], rel=1e-4)


# Component of the force, and Kalker's coefficient for a circular contact and ν = 1/4 (1990).
KALKER = {"creepage_x": (1, 4.12), "creepage_y": (2, 3.67), "spin": (2, 1.47)}


@pytest.mark.parametrize("name", ["creepage_x", slow("creepage_y"), slow("spin")])
def test_small_creepages_give_kalkers_forces(name) -> None:
    """Fx = G a² C11 ξx and Fy = G a² C22 ξy + G a³ C23 φ, with a circle of as many cells.

    The error due to cells is of first order, and extrapolated from two grids.
    """
    component, coefficient = KALKER[name]
    material = Material(young=210e3, poisson=0.25)
    pair, shear_modulus = ElasticPair(material, material), 210e3 / 2.5
    hertz = HertzSphere(500.0, 20.0, pair.contact_modulus)
    a, small, found = hertz.contact_radius, 2e-5, []
    for cells in (20, 40):
        grid = Grid.covering((2.6 * a, 2.6 * a), (cells, cells))
        contact = FrictionalContact(HalfSpace(grid, pair), FRICTION)
        imposed = {name: small / a if name == "spin" else small}
        rolling = steady_rolling(contact, hertz.gap(grid.x, grid.y), 500.0, **imposed)
        radius = np.sqrt(rolling.contact.contact_area / np.pi)
        unit = shear_modulus * radius**2 * small * (radius / a if name == "spin" else 1.0)
        found.append(rolling.contact.resultants[component] / unit)
    assert 2.0 * found[1] - found[0] == pytest.approx(coefficient, rel=0.02)


def test_nonsense_is_refused() -> None:
    contact, height, _ = cylinder(48)
    with pytest.raises(InputError, match="creepage_x and Qx"):
        steady_rolling(contact, height, LOAD, creepage_x=1e-3, Qx=10.0)
    with pytest.raises(InputError, match="spin"):
        steady_rolling(contact, height, LOAD, spin=1e-3)
    with pytest.raises(InputError, match="P"):
        steady_rolling(contact, height, 0.0)
    with pytest.raises(InputError, match="border"):
        steady_rolling(contact, height, 20.0 * LOAD)
