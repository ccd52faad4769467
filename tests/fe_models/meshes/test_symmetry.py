"""Joints split by a mirror equal the joint; joints without a mirror are not split."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from fe_models.dovetail import dovetail_structure
from fe_models.joints.joint import join
from fe_models.solvers.symmetry import (
    Mirror,
    SplitMatrix,
    halves,
    mirror_of_nodes,
    symmetric_product,
)


@pytest.fixture(scope="module", params=[1, 2], ids=["first order", "second order"])
def both(request, structure, dovetail, titanium, mission):
    """Return the joint by halves, and that of the whole bodies."""
    if request.param == 2:
        mesh = dovetail.mesh((10, 34), 10.0, dimension=2)
        structure = dovetail_structure(dovetail, mesh, titanium, titanium, mission, 2)
    return structure.condense(), join([body.condense() for body in structure.bodies])


def test_split_joint_is_the_whole_one(both):
    split, whole = both
    assert isinstance(split.stiffness, SplitMatrix)
    scale = np.abs(whole.stiffness).max()
    np.testing.assert_allclose(np.asarray(split.stiffness), whole.stiffness, atol=1e-11 * scale)
    np.testing.assert_allclose(split.loads, whole.loads, atol=1e-10 * np.abs(whole.loads).max())
    assert split.rigid_modes == whole.rigid_modes
    assert split.smallest == pytest.approx(whole.smallest, rel=1e-6)
    assert split.largest == pytest.approx(whole.largest, rel=1e-9)


def test_a_condensation_reports_its_steps(structure):
    """Check that the steps are as many, by halves or whole."""
    one_sided = copy(structure.bodies[0])
    one_sided.mirror = lambda axis: None
    for joined in (structure, replace(structure, bodies=(one_sided, structure.bodies[1]))):
        reported = []
        joined.condense(progress=lambda *counts, reported=reported: reported.append(counts))
        assert reported == [(step, 5) for step in range(1, 5 + 1)]


def test_split_resolvent_is_the_whole_one(both):
    split, whole = (joint.resolvent() for joint in both)
    vectors = np.random.default_rng(0).standard_normal((len(split.inverse), 3))
    expected = whole.inverse @ vectors
    one = split.inverse @ vectors[:, 0]
    for found, reported in ((split.inverse @ vectors, expected), (one, expected[:, 0])):
        np.testing.assert_allclose(found, reported, atol=1e-7 * np.abs(expected).max())
    np.testing.assert_allclose(one, (split.inverse @ vectors)[:, 0], rtol=1e-9, atol=1e-20)


@pytest.mark.parametrize("order", ["C", "F"])
def test_symmetric_products_are_products(order):
    matrix, vector = np.random.default_rng(2).standard_normal((2, 9, 9))
    matrix = np.asarray(matrix + matrix.T, order=order)
    np.testing.assert_allclose(symmetric_product(matrix, vector[0]), matrix @ vector[0], atol=1e-13)


def test_a_body_that_is_stiffer_on_one_side_is_not_split(structure):
    """Check a stiffness without the mirror of nodes, supports and frames."""
    body = structure.bodies[0]
    mirror = body.mirror(0)
    stiffness, _ = body._reduced()
    assert halves(stiffness, mirror) is not None
    uneven = sp.diags(1.0 + 1e-9 * (np.arange(stiffness.shape[0]) < 5))
    assert halves((uneven @ stiffness @ uneven).tocsr(), mirror) is None


def test_halves_hold_every_quadratic_form():
    """Check that xᵀK y is the sum over both halves, with unknowns that are their own image."""
    rng = np.random.default_rng(1)
    mirror = Mirror(np.array([1, 0, 2, 3, 5, 4]), np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0]))
    root = rng.standard_normal((6, 6))
    image = mirror.matrix().toarray()
    even = root @ root.T + image.T @ root @ root.T @ image
    parts = halves(sp.csr_matrix(even), mirror)
    x, y = rng.standard_normal((2, 6))
    bases = mirror.bases
    split = sum((b.T @ x) @ (part @ (b.T @ y)) for b, part in zip(bases, parts, strict=True))
    assert split == pytest.approx(x @ even @ y, rel=1e-12)
    assert sum(b.shape[1] for b in bases) == 6
    np.testing.assert_allclose(image @ bases[0].toarray(), bases[0].toarray())
    np.testing.assert_allclose(image @ bases[1].toarray(), -bases[1].toarray())


def test_mirror_of_nodes_needs_an_image_of_each():
    nodes = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 1.0]])
    mirror = mirror_of_nodes(nodes, (0, 1, 2), 0)
    assert mirror is not None
    u = np.arange(9.0)
    np.testing.assert_allclose(mirror.matrix() @ u, [-3, 4, 5, -0.0, 1, 2, -6, 7, 8])
    nodes[2, 0] = 0.1
    assert mirror_of_nodes(nodes, (0, 1, 2), 0) is None


def test_rotated_frames_keep_the_mirror_and_skewed_ones_lose_it():
    mirror = Mirror(np.array([1, 0]), np.ones(2))
    assert Mirror.of(mirror.matrix()) == mirror
    skew = np.array([[1.0, 0.2], [0.0, 1.0]])
    assert Mirror.of(sp.csr_matrix(np.linalg.inv(skew) @ mirror.matrix() @ skew)) is None


def test_restriction_to_what_is_not_closed_is_none():
    mirror = Mirror(np.array([1, 0, 2]), np.ones(3))
    assert mirror.restricted(np.array([0, 2])) is None
    assert mirror.restricted(np.array([1, 0])) == Mirror(np.array([1, 0]), np.ones(2))
