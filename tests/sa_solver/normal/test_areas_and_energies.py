"""Contact areas and elastic energies of states, against closed forms and the work of loads."""

import numpy as np
import pytest

from sa_solver import (
    ContactLoad,
    CoupledContact,
    ElasticPair,
    FrictionalContact,
    Grid,
    HalfSpace,
    Material,
    NormalContact,
    TangentialContact,
)
from sa_solver.reference.hertz import HertzCylinder
from sa_solver.reference.line_partial_slip import ShearedCylinder
from sa_solver.reference.mindlin import ShearedSphere

STEEL, RIGID = Material(210e3, 0.3), Material(np.inf, 0.3)
P, Q, FRICTION = 50.0, 12.5, 0.5
SPHERE = ShearedSphere(load=P, radius=10.0, friction=FRICTION, body_1=STEEL, body_2=STEEL)


def on_grid(cells, pair=None):
    pair = pair or SPHERE.pair
    radius = np.cbrt(0.75 * P * 10.0 / pair.contact_modulus)
    grid = Grid.covering((2.5 * radius,) * 2, (cells, cells))
    return HalfSpace(grid, pair), (grid.x**2 + grid.y**2) / 20.0


def test_those_of_hertz_and_of_cattaneo():
    """The area is accurate to the cells at its edge, 2 % on 32 across; the energy is 2/5 P δ."""
    half_space, height = on_grid(48)
    area = np.pi * SPHERE.contact.contact_radius**2
    pressed = NormalContact(half_space).solve(height, P)
    assert pressed.contact_area == pytest.approx(area, rel=0.02)
    assert pressed.elastic_energy == pytest.approx(0.4 * P * SPHERE.contact.approach, rel=1e-3)
    sheared = TangentialContact(half_space).solve(FRICTION * pressed.pressure, Qx=Q)
    stick = area * (1.0 - Q / (FRICTION * P)) ** (2.0 / 3.0)
    assert sheared.stick_area == pytest.approx(stick, rel=0.03)
    contact = FrictionalContact(half_space, FRICTION)
    both = contact.advance(contact.unloaded_state(height), height, ContactLoad(P=P, Qx=Q))
    coupled = CoupledContact(half_space, FRICTION).solve(height, None, [P, Q, 0, 0, 0, 0])
    for state in (both, coupled):
        assert state.contact_area == pressed.contact_area
        assert state.stick_area == pytest.approx(sheared.stick_area, rel=0.02)
        total = pressed.elastic_energy + sheared.elastic_energy
        assert state.elastic_energy == pytest.approx(total, rel=1e-5)


def test_those_of_a_cylinder_are_per_length():
    grid = Grid.line_contact(1.0, 256)
    half_space = HalfSpace(grid, ElasticPair(STEEL, STEEL))
    hertz = HertzCylinder(200.0, 50.0, half_space.pair.contact_modulus)
    contact = FrictionalContact(half_space, FRICTION)
    height = hertz.gap(grid.x)
    state = contact.advance(contact.unloaded_state(height), height, ContactLoad(P=200.0, Qx=60.0))
    assert state.contact_area == pytest.approx(2.0 * hertz.half_width, abs=2.0 * grid.pitch[0])
    stick = ShearedCylinder(hertz, FRICTION).stick_half_width(60.0)
    assert state.stick_area == pytest.approx(2.0 * stick, abs=2.0 * grid.pitch[0])
    # The integral ∫ P dδ of δ(P) = (2 P / π E*) [ln(2 L / a) + 1/2], where a grows with √P.
    pressed = NormalContact(half_space).solve(height, 200.0)
    less = 200.0 / (2.0 * np.pi * hertz.contact_modulus)
    work = 0.5 * 200.0 * (hertz.approach(half_space.datum) - less)
    assert pressed.elastic_energy == pytest.approx(work, rel=1e-3)


@pytest.mark.parametrize("body", [STEEL, RIGID], ids=["similar", "dissimilar"])
def test_work_is_stored_or_dissipated(body):
    """The work by trapezoids in n and 2 n increments is compared with the energies.

    The contact is pressed, then pressed and sheared along a curved path.
    """
    half_space, height = on_grid(16, ElasticPair(body, STEEL))
    contact, missing = FrictionalContact(half_space, FRICTION), []
    for increments in (4, 8):
        state = contact.advance(contact.unloaded_state(height), height, ContactLoad(P=0.5 * P))
        work, lost, begun = 0.0, 0.0, state.elastic_energy
        for share in np.arange(1, increments + 1) / increments:
            load = ContactLoad(P=0.5 * P * (1.0 + share), Qx=0.8 * FRICTION * P * share**2)
            after = contact.advance(state, height, load)
            moved = after.rigid - state.rigid
            work += 0.5 * float((state.resultants + after.resultants) @ moved)
            lost += float(after.energy.sum())
            state = after
        assert lost > 0.0
        missing.append((work - (state.elastic_energy - begun) - lost) / lost)
    assert abs(missing[1]) < 0.1
    assert abs(missing[1]) < 0.4 * abs(missing[0])
