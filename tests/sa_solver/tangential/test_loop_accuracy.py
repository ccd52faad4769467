"""Estimated errors of a loop, against closed forms."""

import numpy as np
import pytest

from sa_solver.contact import FrictionalContact
from sa_solver.cycles.loop_accuracy import LoopErrors, loop_errors
from sa_solver.cycles.tangential_loop import LoopPath, march_loop
from sa_solver.half_space.operator import HalfSpace
from sa_solver.reference.mindlin import ShearedSphere
from sa_solver.types import ElasticPair, Grid, Material

BODY = Material(115e3, 0.3)
SPHERE = ShearedSphere(400.0, 10.0, BODY, BODY, 0.7)
FORCE = 0.5 * SPHERE.sliding_force


def marched(height, path, size, cells, pair=None):
    """Return a loop on a square of ``size`` and its errors; ``height`` takes the radius."""
    grid = Grid.covering((size, size), (cells, cells))
    pair = pair or ElasticPair(BODY, BODY)
    contact = FrictionalContact(HalfSpace(grid, pair), SPHERE.friction)
    gap = height(np.hypot(grid.x, grid.y))
    loop = march_loop(contact, gap, path)
    return loop, loop_errors(contact, gap, path, loop)


@pytest.mark.parametrize(("cells", "size"), [(16, 1.0), (24, 1.4), (32, 1.4)])
def test_the_estimated_error_of_a_sphere_is_that_from_mindlin(cells, size):
    """The estimate is a bound of at most 8 % for any number of cells across.

    With 24 cells the grid of half as many agrees to 1 % by chance, while the error is 2.5 %.
    """
    path = LoopPath(400.0, SPHERE.displacement(FORCE), increments=6)
    loop, errors = marched(lambda r: r**2 / 20.0, path, size, cells)
    stiffness = 1.0 / SPHERE.tangential_compliance
    assert abs(loop.stiffness - stiffness) < errors.stiffness < 0.08 * stiffness
    assert abs(loop.friction - 0.35) < max(errors.friction, 1e-3)
    assert abs(loop.energy - SPHERE.loop_energy(FORCE)) < errors.energy


def test_a_worn_sphere_has_the_stiffness_of_its_contact():
    """Jaeger 1995: kt = 8 G* a for any profile of revolution (doi:10.1007/BF00787897).

    For a paraboloid worn flat within b the load follows from the reduction to one dimension (Heß
    2011): P = 2E*/R (a² d - d³/3), d² = a² - b².
    """
    a, b, radius = 0.4, 0.3, 10.0
    d = np.sqrt(a**2 - b**2)
    pair = ElasticPair(BODY, BODY)
    load = 2.0 * pair.contact_modulus / radius * (a**2 * d - d**3 / 3.0)
    shear_modulus = BODY.young / (2.0 * (1.0 + BODY.poisson))
    stiffness = 8.0 * a * shear_modulus / (2.0 * (2.0 - BODY.poisson))

    def height(r):
        return np.maximum(r**2 - b**2, 0.0) / (2.0 * radius)

    loop, errors = marched(height, LoopPath(load, 0.01, increments=2), 1.0, 48)
    assert abs(loop.stiffness - stiffness) < max(errors.stiffness, 2e-3 * stiffness)
    assert errors.stiffness < 0.03 * stiffness
    # The whole contact slides: the friction is µ on any grid.
    assert loop.slides
    assert loop.friction == pytest.approx(0.7, rel=1e-3)
    assert errors.friction < 1e-3


def test_a_coarse_loop_that_fails_leaves_nothing_known(monkeypatch):
    grid = Grid.line_contact(1.0, 16)
    contact = FrictionalContact(HalfSpace(grid, ElasticPair(BODY, BODY)), 0.5)
    path = LoopPath(100.0, 30.0, "force", 4)
    height = grid.x**2 / 40.0
    loop = march_loop(contact, height, path)
    monkeypatch.setattr("sa_solver.cycles.tangential_loop.STUCK_ITERATIONS", 1)
    known = loop_errors(contact, height, path, loop)
    # Two of the cells are at the rim.
    stiffness = loop.stiffness / 8.0 * 2.0 * grid.pitch[0] / loop.area
    assert known == LoopErrors(pytest.approx(stiffness), loop.friction, loop.energy)
