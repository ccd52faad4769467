"""Limits of convergence when pressure and shear are solved alternately.

Changes shrink by about µβ per round where the contact slides, so that the limit is µβ = 1.
Contacts that stick under pressure alone stay on the safe side of it. With β at most 0.5 and µ up
to 1 the iteration therefore converges, ever more slowly; solving both together has no such limit.
"""

import numpy as np
import pytest

from sa_solver.dissimilar.contact import CoupledContact
from sa_solver.half_space.operator import HalfSpace
from sa_solver.types import ElasticPair, Grid, Material
from tests.oracles.alternating import AlternatingContact

P = 100.0
RADIUS = 10.0
SHARE = 0.5
"""Q over µP."""


def pair(beta):
    return ElasticPair(Material(np.inf, 0.3), Material(70e3, (1 - 2 * beta) / (2 - 2 * beta)))


def sphere(beta):
    bodies = pair(beta)
    radius = (0.75 * P * RADIUS / bodies.contact_modulus) ** (1 / 3)
    grid = Grid.covering((3 * radius, 3 * radius), (24, 24))
    return HalfSpace(grid, bodies), (grid.x**2 + grid.y**2) / (2 * RADIUS)


def cylinder(beta):
    bodies = pair(beta)
    grid = Grid.line_contact(3 * np.sqrt(4 * P * RADIUS / (np.pi * bodies.contact_modulus)), 96)
    return HalfSpace(grid, bodies), grid.x**2 / (2 * RADIUS)


def rounded_punch(beta):
    grid = Grid.covering((1.6, 1.6), (24, 24))
    height = np.maximum(0.0, np.hypot(grid.x, grid.y) - 0.5) ** 2 / 4.0
    return HalfSpace(grid, pair(beta)), height / 20.0


BODIES = [sphere, cylinder, rounded_punch]


def in_turns(build, friction, beta, share=SHARE, rounds=50):
    half_space, height = build(beta)
    values = (P, share * friction * P, 0.0, 0.0, 0.0, 0.0)
    contact = AlternatingContact(half_space, friction)
    return contact.solve(height, None, values, tolerance=1e-6, max_rounds=rounds)


def together(build, friction, beta, share=SHARE):
    half_space, height = build(beta)
    values = (P, share * friction * P, 0.0, 0.0, 0.0, 0.0)
    return CoupledContact(half_space, friction).solve(height, None, values)


def factor(changes):
    """Return the mean factor of the last rounds."""
    count = min(4, len(changes) - 1)
    return (changes[-1] / changes[-1 - count]) ** (1 / count)


@pytest.mark.parametrize("build", BODIES)
def test_it_converges_for_all_real_materials_up_to_a_friction_of_one(build):
    assert in_turns(build, 1.0, 0.5).converged


@pytest.mark.parametrize(("friction", "beta"), [(0.5, 0.5), (1.0, 0.5), (2.0, 0.25), (1.0, 0.25)])
def test_its_factor_in_a_sliding_line_contact_is_the_product(friction, beta):
    measured = factor(in_turns(cylinder, friction, beta, share=0.95).changes)
    assert measured == pytest.approx(friction * beta, abs=0.07)


@pytest.mark.parametrize("build", BODIES)
@pytest.mark.parametrize(("friction", "beta"), [(1.0, 0.5), (2.8, 0.5), (5.6, 0.3)])
def test_solving_both_together_has_no_such_border(build, friction, beta):
    assert together(build, friction, beta).converged


@pytest.mark.slow
def test_pressing_alone_is_easier_than_shearing():
    """Where cells stick, shear cannot follow pressure."""
    assert in_turns(sphere, 4.0, 0.3, share=0.0).converged
    assert not in_turns(sphere, 4.0, 0.3, share=0.95, rounds=30).converged
