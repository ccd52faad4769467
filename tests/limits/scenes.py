"""Sphere that several test modules press and shear."""

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.half_space.operator import HalfSpace
from sa_solver.types import ElasticPair, Grid, Material

FRICTION, P, RADIUS = 0.4, 100.0, 10.0
SOLVED = 1e-8
ALIKE = Material(70e3, 0.0)
"""With ν = 0 slip keeps its direction, and Mindlin's solution is exact."""
PAIRS = {
    "alike": ElasticPair(ALIKE, ALIKE),
    "unlike": ElasticPair(Material(np.inf, 0.3), Material(70e3, 0.3)),
}
BOTH = pytest.mark.parametrize("kind", PAIRS)


def sphere(kind, cells=32):
    """Return a contact that takes two thirds of its grid under P, and its gap."""
    pair = PAIRS[kind]
    size = 3.0 * (0.75 * P * RADIUS / pair.contact_modulus) ** (1 / 3)
    grid = Grid.covering((size, size), (cells, cells))
    height = (grid.x**2 + grid.y**2) / (2.0 * RADIUS)
    return FrictionalContact(HalfSpace(grid, pair), FRICTION, SOLVED), height
