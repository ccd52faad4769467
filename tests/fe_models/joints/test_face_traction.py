"""Tractions of contact faces on other meshes: their forces and moments are those of the nodes."""

import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.joints.face_traction import FaceTraction
from fe_models.meshes.structure_mesh import Body, StructureMesh, matched_interface
from sa_solver.types import Frame, Material

STEEL = Material(210e3, 0.3)


def blocks(dimension, divided):
    """Return two blocks of 2 x 3 mm that meet in the middle of the global axes, and their face."""
    last = dimension - 1
    sides = [np.linspace(-1.0, 1.0, divided), np.linspace(-1.5, 1.5, divided)][:last]
    kind = MeshTri if dimension == 2 else MeshTet
    bodies = []
    for low in (-1.0, 0.0):
        mesh = kind.init_tensor(*sides, np.linspace(low, low + 1.0, divided))
        bodies.append(Body("block", mesh.with_boundaries({"face": lambda x: x[-1] == 0.0})))
    turned = np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
    frame = Frame(np.array([0.1, 0.0, 0.0]), turned)
    return bodies, matched_interface("face", *bodies, "face", frame)


@pytest.mark.parametrize("weighted", [False, True])
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("there", "here"), [(9, 4), (4, 7)])
def test_forces_and_moments_are_those_of_the_nodes(dimension, weighted, there, here):
    bodies, face = blocks(dimension, there)
    face = StructureMesh(tuple(bodies), (face,)).weighted(2 if weighted else 1).interfaces[0]
    forces = np.random.default_rng(0).standard_normal((2, 3, len(face)))
    if dimension == 2:
        forces[:, 1] = 0.0
    traction = FaceTraction.of(face, forces)
    others, _ = blocks(dimension, here)
    x, y = face.coordinates.T
    for number, (body, sign) in enumerate(zip(others, (-1.0, 1.0), strict=True), start=1):
        elastic = ElasticBody(body, STEEL, 2)
        load = traction.load(elastic, number, whole=True).reshape(len(elastic.nodes), -1, 2)
        for state in (0, 1):
            along = np.zeros((len(elastic.nodes), 3))
            along[:, body.axes] = load[:, :, state]
            found = along @ face.frame.axes.T
            at = face.frame.coordinates(elastic.nodes)
            for weight, nodal in ((np.ones(len(at)), 1.0), (at[:, 0], x), (at[:, 1], y)):
                exact = sign * (forces[state] * nodal).sum(axis=1)
                np.testing.assert_allclose(weight @ found, exact, atol=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
def test_smoothing_keeps_forces_and_moments(dimension):
    """It takes a sixth of the difference to the neighbours off, along its axis alone."""
    _, face = blocks(dimension, 9)
    x, y = face.coordinates.T
    nodal = np.zeros((1, 3, len(face)))
    nodal[0, 2] = (np.abs(x - x.mean()) < 1e-9) * 6.0
    traction = FaceTraction(face, nodal)
    ones = np.ones_like(x)
    for axis in (0, 1)[: dimension - 1]:
        smooth = traction.smoothed(axis)
        for weight in (ones, x, y):
            before, after = (
                of.nodal[0, 2] @ (face.facet_shares * weight) for of in (traction, smooth)
            )
            assert after == pytest.approx(before, abs=0.02 * face.facet_shares.sum())
        change = smooth.nodal[0, 2] - nodal[0, 2]
        inner = np.abs(y) < 1.2
        middle, beside = (
            change[inner & (np.abs(np.abs(x - x.mean()) - at) < 1e-9)] for at in (0.0, 0.25)
        )
        np.testing.assert_allclose(middle, -2.0 if axis == 0 else 0.0, atol=0.05)
        np.testing.assert_allclose(beside, 1.0 if axis == 0 else 0.0, atol=0.05)
