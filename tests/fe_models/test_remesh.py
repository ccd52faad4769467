"""Worn meshes: the flank goes where the depth says, its volume is the depth's, nothing folds."""

import numpy as np
import pytest

from fe_models.mesh import MeshError
from fe_models.remesh import element_volumes, worn_mesh, worn_volume


def bowls(face, depth):
    """A depth that is zero on the rim of the face."""
    x, y = np.abs(face.coordinates.T) / np.abs(face.coordinates).max(axis=0)[:, None]
    return depth * (1.0 - x**2) * (1.0 - y**2)


@pytest.fixture(scope="module")
def worn(coarse_mesh):
    depths = [
        (bowls(face, 0.02 * (k + 1)), bowls(face, 0.05 * (k + 1)))
        for k, face in enumerate(coarse_mesh.interfaces)
    ]
    return depths, worn_mesh(coarse_mesh, depths)


def bodies(mesh):
    return mesh.body_1, mesh.body_2


def test_flank_nodes_move_into_their_body(coarse_mesh, worn):
    depths, after = worn
    for number, (old, new) in enumerate(zip(bodies(coarse_mesh), bodies(after), strict=True)):
        for face, pair in zip(coarse_mesh.interfaces, depths, strict=True):
            nodes = (face.nodes_1, face.nodes_2)[number]
            moved = face.frame.components((new.mesh.p - old.mesh.p)[:, nodes].T)
            inwards = (-1.0, 1.0)[number]
            np.testing.assert_allclose(moved[:, 2], inwards * pair[number], atol=1e-12)
            np.testing.assert_allclose(moved[:, :2], 0.0, atol=1e-12)


def test_other_boundaries_stay(coarse_mesh, worn):
    _, after = worn
    for old, new in zip(bodies(coarse_mesh), bodies(after), strict=True):
        flanks = np.union1d(old.vertices("intrados"), old.vertices("extrados"))
        others = np.setdiff1d(old.mesh.boundary_nodes(), flanks)
        np.testing.assert_array_equal(new.mesh.p[:, others], old.mesh.p[:, others])
        for name in old.mesh.boundaries:
            np.testing.assert_array_equal(new.facets(name), old.facets(name))


def test_worn_volume_is_that_of_the_depth(coarse_mesh, worn):
    """By the nodal areas, and independently as the volume that the elements have lost."""
    depths, after = worn
    for number, (old, new) in enumerate(zip(bodies(coarse_mesh), bodies(after), strict=True)):
        volumes = [worn_volume(old, new, face, number + 1) for face in coarse_mesh.interfaces]
        expected = [
            face.nodal_areas @ pair[number]
            for face, pair in zip(coarse_mesh.interfaces, depths, strict=True)
        ]
        np.testing.assert_allclose(volumes, expected, rtol=1e-10)
        lost = np.sum(np.abs(element_volumes(old.mesh)) - np.abs(element_volumes(new.mesh)))
        assert sum(volumes) == pytest.approx(lost, rel=1e-7)


def test_no_element_turns_over(coarse_mesh, worn):
    _, after = worn
    for old, new in zip(bodies(coarse_mesh), bodies(after), strict=True):
        ratio = element_volumes(new.mesh) / element_volumes(old.mesh)
        assert ratio.min() > 0.5
        np.testing.assert_array_equal(new.mesh.t, old.mesh.t)


def test_inner_nodes_move_less_than_the_surface(coarse_mesh, worn):
    """A harmonic field has its extremes on the boundary."""
    _, after = worn
    for old, new in zip(bodies(coarse_mesh), bodies(after), strict=True):
        moved = new.mesh.p - old.mesh.p
        surface = old.mesh.boundary_nodes()
        inner = np.setdiff1d(np.arange(old.mesh.nvertices), surface)
        assert np.abs(moved[:, inner]).max() > 0.0
        for component in moved:
            low, high = component[surface].min(), component[surface].max()
            assert component[inner].min() >= low - 1e-12
            assert component[inner].max() <= high + 1e-12


def test_no_wear_changes_nothing(coarse_mesh):
    none = [(np.zeros(len(face)), np.zeros(len(face))) for face in coarse_mesh.interfaces]
    after = worn_mesh(coarse_mesh, none)
    for old, new in zip(bodies(coarse_mesh), bodies(after), strict=True):
        np.testing.assert_array_equal(new.mesh.p, old.mesh.p)


def test_interfaces_keep_their_gaps(coarse_mesh, worn):
    assert worn[1].interfaces is coarse_mesh.interfaces


@pytest.mark.parametrize(("number", "name"), [(0, "disk"), (1, "blade")])
def test_depth_that_crushes_elements_is_refused(coarse_mesh, number, name):
    """A spike twice as deep as the elements are large."""
    depths = []
    for face in coarse_mesh.interfaces:
        pair = [np.zeros(len(face)), np.zeros(len(face))]
        pair[number][np.hypot(*face.coordinates.T).argmin()] = 3.0
        depths.append(tuple(pair))
    with pytest.raises(MeshError, match=f"crushes elements of the {name}"):
        worn_mesh(coarse_mesh, depths)
