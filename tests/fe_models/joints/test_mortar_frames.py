"""Frames of faces whose meshes do not match: they follow the bodies, detect bends, refuse."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models.joints.mortar import frame_of_faces, mortar_interface
from fe_models.meshes.structure_mesh import AXES, Body, MeshError
from sa_solver.types import Frame
from tests.fe_models.joints.pressed_blocks import DIMENSIONS, STEEL, SURFACE, block


def turned(dimension, seed):
    """Return a rotation of space, or in the plane about Y."""
    if dimension == SURFACE:
        axes, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
        return axes * np.sign(np.linalg.det(axes))
    angle = 0.4 + seed
    return np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )


def moved(body, rotation, shift, bend=0.0):
    """Return the body bent upwards on either side of x = 1, then rotated and shifted."""
    points = body.points.copy()
    points[:, 2] += np.tan(bend) * np.abs(points[:, 0] - 1.0)
    points = points @ rotation.T + shift
    return Body(body.name, replace(body.mesh, doflocs=points[:, body.axes].T.copy()))


def stacked(dimension, rotation=None, shift=0.0, bend=0.0):
    """Return a wide lower block and an upper one that overhangs it at x = 2, both irregular."""
    cells = [(4, 3, 2), (3, 4, 2)]
    ends = [((0.0, 0.0, 0.0), (2.0, 3.0, 1.0)), ((0.8, 0.0, 1.0), (2.6, 3.0, 2.0))]
    return [
        moved(
            block([n[axis] for axis in AXES[dimension]], *end, STEEL, 1, 0.0, k).body,
            np.eye(3) if rotation is None else rotation,
            shift,
            bend,
        )
        for k, (n, end) in enumerate(zip(cells, ends, strict=True))
    ]


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("seed", range(3))
def test_frame_follows_the_bodies(dimension, seed):
    """Check the origin in the middle of the shared part, and x turned into the plane."""
    rotation, shift = turned(dimension, seed), np.array([5.0, 0.0, -3.0])
    lower, upper = stacked(dimension, rotation, shift)
    given = rotation @ np.array([2.0, 0.0, 0.7])
    frame, angle = frame_of_faces(lower, "z1", upper, "z0", given)
    np.testing.assert_allclose(frame.axes, rotation.T, atol=1e-12)
    centre = np.array([1.4, 1.5 if dimension == SURFACE else 0.0, 1.0])
    np.testing.assert_allclose(frame.origin, rotation @ centre + shift, atol=1e-12)
    assert angle < 1e-12

    face = mortar_interface("joint", lower, "z1", upper, "z0", frame)
    assert len(face.nodes_2) < len(upper.vertices("z0"))
    assert face.nodal_areas.min() > 0.0
    assert face.facets.max() == len(face) - 1
    np.testing.assert_allclose(face.gap, 0.0, atol=1e-12)
    place = frame.coordinates(upper.points[face.nodes_2])[:, :2]
    np.testing.assert_array_equal(place, face.coordinates)
    np.testing.assert_allclose(
        face.projection @ face.face_1.coordinates, face.coordinates, atol=1e-12
    )


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_bent_faces_report_their_angle(dimension):
    lower, upper = stacked(dimension, bend=0.1)
    frame, angle = frame_of_faces(lower, "z1", upper, "z0", np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(frame.axes, np.eye(3), atol=1e-12)
    assert angle == pytest.approx(0.1, rel=1e-9)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_faces_that_share_less_than_a_facet_are_refused(dimension):
    lower, upper = stacked(dimension, shift=0.0)
    aside = moved(upper, np.eye(3), np.array([1.15, 0.0, 0.0]))
    with pytest.raises(MeshError, match="less than a facet of z0"):
        mortar_interface("joint", lower, "z1", aside, "z0", Frame(np.zeros(3), np.eye(3)))


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_faces_without_a_frame_are_refused(dimension):
    lower, upper = stacked(dimension)
    x, _, z = np.eye(3)
    with pytest.raises(MeshError, match=r"x_direction .* z1"):
        frame_of_faces(lower, "z1", upper, "z0", z)
    with pytest.raises(MeshError, match="do not face each other"):
        frame_of_faces(lower, "z1", upper, "z1", x)
    with pytest.raises(MeshError, match="do not face each other"):
        frame_of_faces(lower, "z1", upper, "x0", x)
