"""Worn meshes: the flank moves by the depth, the volume is the depth's, nothing folds."""

from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.joints.mortar import mortar_interface
from fe_models.meshes.remesh import (
    element_volumes,
    form_of,
    formed_mesh,
    oriented_elements,
    worn_mesh,
    worn_volume,
)
from fe_models.meshes.structure_mesh import Body, MeshError, StructureMesh
from sa_solver.types import Frame


def bowls(face, depth):
    """Return a depth that is zero on the rim of the face."""
    half = np.abs(face.coordinates).max(axis=0)
    x, y = np.abs(face.coordinates.T) / np.where(half > 0.0, half, 1.0)[:, None]
    return depth * (1.0 - x**2) * (1.0 - y**2)


@pytest.fixture(scope="module")
def worn(coarse_mesh):
    depths = [
        (bowls(face, 0.02 * (k + 1)), bowls(face, 0.05 * (k + 1)))
        for k, face in enumerate(coarse_mesh.interfaces)
    ]
    return depths, worn_mesh(coarse_mesh, depths)


def bodies(mesh):
    return mesh.bodies[0], mesh.bodies[1]


def test_flank_nodes_move_into_their_body(coarse_mesh, worn):
    depths, after = worn
    for number, (old, new) in enumerate(zip(bodies(coarse_mesh), bodies(after), strict=True)):
        for face, pair in zip(coarse_mesh.interfaces, depths, strict=True):
            nodes = (face.nodes_1, face.nodes_2)[number]
            moved = face.frame.components((new.mesh.p - old.mesh.p)[:, nodes].T)
            inwards = (-1.0, 1.0)[number]
            np.testing.assert_allclose(moved[:, 2], inwards * pair[number], atol=1e-12)
            np.testing.assert_allclose(moved[:, :2], 0.0, atol=1e-12)


def test_elements_stay_connected_as_they_were(coarse_mesh, worn):
    _, after = worn
    for old, new in zip(bodies(coarse_mesh), bodies(after), strict=True):
        assert new.mesh.facets is old.mesh.facets
        anew = type(new.mesh)(new.mesh.p, new.mesh.t)
        for part in ("facets", "t2f", "f2t", "edges", "f2e"):
            np.testing.assert_array_equal(getattr(new.mesh, part), getattr(anew, part))


def test_other_boundaries_stay(coarse_mesh, worn):
    _, after = worn
    for old, new in zip(bodies(coarse_mesh), bodies(after), strict=True):
        flanks = np.union1d(old.vertices("intrados"), old.vertices("extrados"))
        others = np.setdiff1d(old.mesh.boundary_nodes(), flanks)
        np.testing.assert_array_equal(new.mesh.p[:, others], old.mesh.p[:, others])
        for name in old.mesh.boundaries:
            np.testing.assert_array_equal(new.facets(name), old.facets(name))


def test_worn_volume_is_that_of_the_depth(coarse_mesh, worn):
    """Compare by the nodal areas, and with the volume that the elements have lost."""
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
    """Check that the harmonic field has its extremes on the boundary."""
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
    """Check a spike twice as deep as the elements are large."""
    depths = []
    for face in coarse_mesh.interfaces:
        pair = [np.zeros(len(face)), np.zeros(len(face))]
        pair[number][np.hypot(*face.coordinates.T).argmin()] = 3.0
        depths.append(tuple(pair))
    with pytest.raises(MeshError, match=f"crushes elements of the {name}"):
        worn_mesh(coarse_mesh, depths)


# --- the form of the faces ------------------------------------------------------------------------


def opening(mesh, face):
    """Return the distance of the faces of an interface, along its normal ``(n,)`` [mm]."""
    low, high = (
        face.frame.coordinates(body.points[face.nodes(number)])[:, 2]
        for number, body in enumerate(bodies(mesh), start=1)
    )
    return high - (low if face.projection is None else face.projection @ low)


def test_flanks_are_as_far_apart_as_gap_and_wear(coarse_mesh, worn):
    """Check rounded edges and ends on the blade; disk and wear are as without them."""
    depths, after = worn
    form = form_of(coarse_mesh)
    unworn, shown = (formed_mesh(mesh, form) for mesh in (coarse_mesh, after))
    assert unworn.bodies[0] is coarse_mesh.bodies[0]
    assert shown.bodies[0] is after.bodies[0]
    for face, pair in zip(coarse_mesh.interfaces, depths, strict=True):
        assert face.gap.max() > 0.03
        np.testing.assert_allclose(opening(unworn, face), face.gap, atol=1e-12)
        np.testing.assert_allclose(opening(shown, face), face.gap + sum(pair), atol=1e-12)
        for number in (1, 2):
            body, before = bodies(shown)[number - 1], bodies(unworn)[number - 1]
            volume = worn_volume(before, body, face, number)
            assert volume == pytest.approx(face.nodal_areas @ pair[number - 1], rel=1e-10)
    blade = coarse_mesh.bodies[1]
    ratio = element_volumes(shown.bodies[1].mesh) / element_volumes(blade.mesh)
    assert ratio.min() > 0.5
    for name in ("root_bottom", "shank_top"):
        np.testing.assert_array_equal(form[1][blade.vertices(name)], 0.0)


def test_edges_finer_than_their_form_blend_into_the_sides(dovetail):
    """Check edges rounded by more than the element size, which are not crushed."""
    section = replace(dovetail, edge_radius=10.0).mesh((160, 2), 8.0, dimension=2)
    shown = formed_mesh(section, form_of(section))
    ratio = element_volumes(shown.bodies[1].mesh) / element_volumes(section.bodies[1].mesh)
    assert section.interfaces[0].gap.max() > 1.5 * dovetail.flank_width / 159.0
    assert ratio.min() > 0.5


def test_faces_meshed_apart_move_by_what_is_not_meshed():
    """Check an overhanging crowned pad with its own nodes, next to the gap of a groove."""
    z = np.array([0.0, 1.0])
    low = MeshTri.init_tensor(np.linspace(0.0, 5.0, 11), z)
    high = MeshTri.init_tensor(np.linspace(-1.0, 5.0, 14), 1.0 + z)
    crowned = high.p + (high.p[1] == 1.0) * [np.zeros(len(high.p[0])), 0.01 * high.p[0] ** 2]
    pair = [
        Body(name, mesh.with_boundaries({"pad": lambda x: np.isclose(x[1], 1.0, atol=0.3)}))
        for name, mesh in (("base", low), ("pad", replace(high, doflocs=crowned)))
    ]
    frame = Frame(np.array([2.0, 0.0, 1.0]), np.eye(3))
    face = mortar_interface("pad", pair[0], "pad", pair[1], "pad", frame)
    none = StructureMesh(pair, (face,))
    assert not any(form.any() for form in form_of(none))
    groove = replace(face, gap=face.gap + 0.1 * np.cos(face.coordinates[:, 0]) ** 2)
    mesh = StructureMesh(pair, (groove,))
    shown = formed_mesh(mesh, form_of(mesh))
    np.testing.assert_allclose(opening(shown, groove), groove.gap, atol=1e-12)
    # Beyond the base's end the pad has the form that it has above the end.
    (end,) = np.flatnonzero((high.p[0] == -1.0) & (high.p[1] == 1.0))
    nearest = np.argmin(groove.coordinates[:, 0])
    form = groove.gap[nearest] - face.gap[nearest]
    assert form_of(mesh)[1][end, 1] == pytest.approx(form, rel=1e-12)


def test_form_that_crushes_elements_is_refused(coarse_mesh):
    """Check a groove deeper than the elements are large, from one node to the next."""
    faces = []
    for face in coarse_mesh.interfaces:
        spike = np.where(np.arange(len(face)) == np.hypot(*face.coordinates.T).argmin(), 3.0, 0.0)
        faces.append(replace(face, gap=spike))
    mesh = replace(coarse_mesh, interfaces=tuple(faces))
    with pytest.raises(MeshError, match="elements of the blade"):
        formed_mesh(mesh, form_of(mesh))


@pytest.mark.parametrize("kind", [MeshTet, MeshTri])
def test_elements_in_files_have_positive_volumes(kind):
    mesh = kind().refined(2)
    volumes, elements = element_volumes(mesh), oriented_elements(mesh)
    assert (volumes < 0.0).any()
    oriented = element_volumes(kind(mesh.p, elements.T, sort_t=False))
    np.testing.assert_allclose(oriented, np.abs(volumes))
    np.testing.assert_array_equal(np.sort(elements, axis=1).T, np.sort(mesh.t, axis=0))


def test_elements_of_second_order_move_with_their_nodes(dovetail, titanium, caplog):
    """Their vertices and midside nodes are the vertices of the worn body."""
    mesh = dovetail.mesh((9, 3), 12.0, 2, notch=16, order=2)
    depths = [(bowls(face, 0.01), bowls(face, 0.02)) for face in mesh.interfaces]
    for before, after in zip(mesh.bodies, worn_mesh(mesh, depths).bodies, strict=True):
        assert np.abs(after.points - before.points).max() > 0.005
        np.testing.assert_array_equal(ElasticBody(after, titanium, 2).nodes, after.points)
        with pytest.raises(ValueError, match="second order"):
            ElasticBody(after, titanium, 1)
    # scikit-fem copies arrays in another order, and says so.
    assert not caplog.records
