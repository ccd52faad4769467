"""Tests of the half-space of rig specimens alone, on a pad of nodes in rows and columns."""

import numpy as np
import pytest

from fe_models.meshes.structure_mesh import Face
from sa_solver.types import ElasticPair, Frame, Material
from workflow.analyses.specimens.half_space import NodeGrid, PadHalfSpace

STEEL = Material(200e3, 0.3)


@pytest.fixture(scope="module")
def face():
    line = np.linspace(-0.5, 0.5, 11)
    x, y = (part.ravel() for part in np.meshgrid(line, line, indexing="ij"))
    place = np.arange(121).reshape(11, 11)
    a, b, c, d = (p.ravel() for p in (place[:-1, :-1], place[1:, :-1], place[:-1, 1:],
                                      place[1:, 1:]))  # fmt: skip
    facets = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    # Any order of the nodes will do.
    order = np.random.default_rng(0).permutation(121)
    points = np.stack([x, y], axis=1)[order]
    return Face("pad", Frame(np.zeros(3), np.eye(3)), points, np.argsort(order)[facets])


def test_smooth_shape_keeps_a_form(face):
    form = (face.coordinates**2).sum(axis=1)
    at = np.array([-0.43, 0.0, 0.27])
    smooth = NodeGrid.of(face).smooth(form)(at, at)
    np.testing.assert_allclose(smooth, at[:, None] ** 2 + at**2, atol=1e-14)


def test_form_given_as_depth_is_the_same_as_height(face):
    beside = PadHalfSpace(face, (20, 20), ElasticPair(STEEL, STEEL), 0.5, 1e-10)
    grid = beside.grid
    assert grid.size == pytest.approx((1.0, 1.0))
    height = (grid.x**2 + grid.y**2) / 100.0
    depth = (face.coordinates**2).sum(axis=1) / 100.0
    path = np.array([1e-5, 1e-2])
    one = beside.fretting_cycle(height, 0.0 * depth, 50.0, path)
    other = beside.fretting_cycle(0.0 * height, depth, 50.0, path)
    np.testing.assert_allclose(one.pressure, other.pressure, atol=1e-6)
    # Stuck at first, sliding at last, against the motion.
    assert one.force[0] == pytest.approx(1e-5 * one.stick_stiffness, rel=0.1)
    # All but what the shear across the motion takes.
    assert one.force[-1] == pytest.approx(0.5 * 50.0, rel=1e-5)
    assert np.all(one.shear <= 0.0)
    nodal = one.nodal_pressure @ face.nodal_areas
    assert nodal == pytest.approx(50.0, rel=1e-8)


def test_tied_square(face):
    """The stiffness of a rigid square punch follows from a plate's capacitance: k = π C E*.

    C = 0.36679 sides: Read 1997, J. Comput. Phys. 133, 1.
    """
    pair = ElasticPair(STEEL, STEEL)
    stiffness = []
    for cells in (20, 40):
        beside = PadHalfSpace(face, (cells, cells), pair, 0.5, 1e-10)
        stiffness.append(beside.tied()[0])
    coarse, fine = stiffness
    # First order in the cells, whose edge peaks are too low.
    extrapolated = 2.0 * fine - coarse
    assert extrapolated == pytest.approx(np.pi * 0.36679 * pair.contact_modulus, rel=1e-3)
