"""Rates of convergence to closed forms that are not smooth at the edge of the contact.

Pressure and shear end like a square root, so that their mean square errors are about of first order
in the pitch. Integrals of them (approach, twist, shift) converge with about the order 3/2 or
better.
"""

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad
from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.contact import NormalContact
from sa_solver.reference.flat_rounded import FlatRoundedPunch
from sa_solver.reference.hertz import HertzCylinder, HertzEllipse
from sa_solver.reference.line_partial_slip import BulkStressedCylinder
from sa_solver.reference.torsion import TwistedSphere
from sa_solver.reference.waviness import ChebyshevPunch
from sa_solver.types import ElasticPair, Grid, Material

STEEL = Material(200e3, 0.3)
PAIR = ElasticPair(STEEL, STEEL)
MODULUS = PAIR.contact_modulus
FRICTION = 0.5


def rate(errors):
    """Return the order of convergence over all halvings of the pitch together."""
    return np.log2(errors[0] / errors[-1]) / (len(errors) - 1)


def mean_square(computed, expected):
    return np.linalg.norm(computed - expected) / np.linalg.norm(expected)


def test_elliptical_contact():
    ellipse = HertzEllipse(400.0, 8.0, 30.0, MODULUS)
    a, b = ellipse.semi_axes
    pressures, approaches = [], []
    for cells in (24, 48, 96, 192):
        grid = Grid.covering((2.5 * a, 2.5 * b), (cells, cells))
        state = NormalContact(HalfSpace(grid, PAIR)).solve(ellipse.gap(grid.x, grid.y), 400.0)
        pressures.append(mean_square(state.pressure, ellipse.pressure(grid.x, grid.y)))
        approaches.append(abs(state.approach / ellipse.approach - 1.0))
    assert rate(pressures) > 0.8
    assert pressures[-1] < 0.02
    assert rate(approaches) > 1.3
    assert approaches[-1] < 3e-4


@pytest.mark.parametrize("share", [0.4, 0.9])
def test_twisted_sphere(share):
    sphere = TwistedSphere(400.0, 10.0, STEEL, STEEL, FRICTION)
    moment, a = share * sphere.sliding_moment, sphere.contact.contact_radius
    shears = []
    for cells in (24, 48, 96, 192):
        grid = Grid.covering((2.5 * a, 2.5 * a), (cells, cells))
        contact = FrictionalContact(HalfSpace(grid, PAIR), FRICTION)
        height = sphere.contact.gap(grid.x, grid.y)
        load = ContactLoad(np.array([400.0, 0.0, 0.0, 0.0, 0.0, moment]))
        state = contact.advance(contact.unloaded_state(height), height, load)
        expected = sphere.shear(np.hypot(grid.x, grid.y), moment)
        shears.append(mean_square(np.hypot(*state.shear), expected))
        # The edge moves in steps of cells, so that the sign of the error varies: test a bound.
        assert abs(state.rigid[5] / sphere.twist(moment) - 1.0) < 0.08 * (2.5 / cells) ** 1.5
    assert rate(shears) > 0.7
    assert shears[-1] < 0.03


@pytest.mark.parametrize("body", [1, 2])
def test_cylinder_with_bulk_stress(body):
    cylinder = HertzCylinder(400.0, 50.0, MODULUS)
    form = BulkStressedCylinder(cylinder, FRICTION, 100.0, 60.0, body)
    shears = []
    for strips in (64, 128, 256, 512):
        grid = Grid.line_contact(2.4 * cylinder.half_width, strips)
        contact = FrictionalContact(HalfSpace(grid, PAIR), FRICTION)
        height = cylinder.gap(grid.x)
        pressed = contact.advance(
            contact.unloaded_state(height), height, ContactLoad(np.array([400.0, 0, 0, 0, 0, 0]))
        )
        load = ContactLoad(np.array([400.0, 100.0, 0, 0, 0, 0]), strain=form.mismatch_strain)
        state = contact.advance(pressed, height, load)
        shears.append(mean_square(state.shear[0], form.shear(grid.x)))
    assert rate(shears) > 0.7
    assert shears[-1] < 0.02


@pytest.mark.parametrize(
    "form",
    [ChebyshevPunch(0.5, 400.0, 0.05, 8, MODULUS), FlatRoundedPunch(4.0, 30.0, 400.0, MODULUS)],
    ids=["waves", "rounded flat"],
)
def test_line_contacts_without_friction(form):
    half = getattr(form, "contact_half_width", None) or form.half_width
    pressures = []
    for strips in (128, 256, 512, 1024):
        grid = Grid.line_contact(2.3 * half, strips)
        state = NormalContact(HalfSpace(grid, PAIR)).solve(form.gap(grid.x), 400.0)
        pressures.append(mean_square(state.pressure, form.pressure(grid.x)))
    assert rate(pressures) > 0.7
    assert pressures[-1] < 0.03
