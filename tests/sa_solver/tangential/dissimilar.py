"""Contacts of dissimilar bodies, one rigid and one elastic: a sphere, a cylinder, a flat punch."""

import numpy as np

from sa_solver.dissimilar.contact import CoupledContact
from sa_solver.half_space.operator import HalfSpace
from sa_solver.types import ElasticPair, Grid, Material

TOLERANCE = 1e-8
STEEL = Material(200e3, 0.3)
P = 100.0
RADIUS = 10.0


def rigid_on_elastic(beta):
    """Return a pair with Dundurs' ``beta``: body 1 is rigid, body 2 has ν from 0.5 to 0."""
    return ElasticPair(Material(np.inf, 0.3), Material(70e3, (1 - 2 * beta) / (2 - 2 * beta)))


def sphere(cells, beta, friction, width=2.6):
    """Return a sphere contact on a grid of ``width`` Hertzian contact radii, and its height."""
    pair = rigid_on_elastic(beta)
    radius = (0.75 * P * RADIUS / pair.contact_modulus) ** (1 / 3)
    grid = Grid.covering((width * radius, width * radius), (cells, cells))
    height = (grid.x**2 + grid.y**2) / (2 * RADIUS)
    return CoupledContact(HalfSpace(grid, pair), friction), height


def cylinder(cells, beta, friction):
    """Return a line contact under P newtons per mm, and its height."""
    pair = rigid_on_elastic(beta)
    half_width = np.sqrt(4 * P * RADIUS / (np.pi * pair.contact_modulus))
    grid = Grid.line_contact(2.6 * half_width, cells)
    height = np.broadcast_to(grid.x**2 / (2 * RADIUS), grid.shape)
    return CoupledContact(HalfSpace(grid, pair), friction), height


def flat_strip(cells, beta, friction):
    """Return a rigid flat punch with sharp edges in plane strain, and its height."""
    grid = Grid.line_contact(1.2, cells)
    height = np.where(np.abs(grid.x) < 0.5, 0.0, 1.0)
    return CoupledContact(HalfSpace(grid, rigid_on_elastic(beta)), friction), height


def loads(load=P, Qx=0.0, Qy=0.0, Mx=0.0, My=0.0, Mz=0.0):
    return np.array([load, Qx, Qy, Mx, My, Mz])
