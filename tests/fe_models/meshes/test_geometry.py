"""Geometry of the dovetail: matching faces, boundaries in place, and gaps in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import MeshError

SKEWS = [0.0, np.deg2rad(15.0)]
DISK = {"intrados", "extrados", "inner", "sides"}
BLADE = {"intrados", "extrados", "root_bottom", "shank_top"}


@pytest.fixture(scope="module", params=SKEWS, ids=["straight", "skewed"])
def joint_and_mesh(request, dovetail):
    changed = replace(dovetail, skew=request.param)
    return changed, changed.mesh((8, 10), 8.0, notch=24)


def triangle_areas(mesh, boundary):
    a, b, c = mesh.p[:, mesh.facets[:, mesh.boundaries[boundary]]].transpose(1, 2, 0)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def test_faces_match_node_to_node(joint_and_mesh):
    _, mesh = joint_and_mesh
    for face in mesh.interfaces:
        apart = mesh.bodies[0].mesh.p[:, face.nodes_1] - mesh.bodies[1].mesh.p[:, face.nodes_2]
        assert np.abs(apart).max() < 1e-9
        assert len(face) == len(np.unique(face.nodes_1)) == len(np.unique(face.nodes_2)) == 80


def test_faces_are_split_along_the_same_diagonals(joint_and_mesh):
    """Check the diagonals: only then a uniform pressure gives equal nodal forces on both bodies."""
    _, mesh = joint_and_mesh
    for face in mesh.interfaces:
        number = {int(node): k for k, node in enumerate(face.nodes_1)}
        of_body_1 = [
            sorted(number[int(v)] for v in row) for row in mesh.bodies[0].facets(face.name)
        ]
        assert sorted(of_body_1) == sorted(np.sort(face.facets, axis=1).tolist())


def test_flanks_have_their_area(joint_and_mesh):
    """Check that the face is a parallelogram of flank width and slot length."""
    dovetail, mesh = joint_and_mesh
    for side, face in zip((1, -1), mesh.interfaces, strict=True):
        up = np.array([-side * np.sin(dovetail.flank_angle), 0.0, np.cos(dovetail.flank_angle)])
        edges = dovetail.flank_width * up, dovetail.slot_length * dovetail.slot_direction
        area = np.linalg.norm(np.cross(*edges))
        assert face.nodal_areas.sum() == pytest.approx(area, rel=1e-12)
        for body in mesh.bodies:
            assert triangle_areas(body.mesh, face.name).sum() == pytest.approx(area, rel=1e-12)


def test_frames(joint_and_mesh):
    """Check that frames are right-handed, with x up the flank, z out of the disk, y opposite."""
    dovetail, mesh = joint_and_mesh
    for side, face in zip((1, -1), mesh.interfaces, strict=True):
        x, y, z = face.frame.axes
        np.testing.assert_allclose(face.frame.axes @ face.frame.axes.T, np.eye(3), atol=1e-14)
        np.testing.assert_allclose(np.cross(x, y), z, atol=1e-14)
        assert abs(y @ dovetail.slot_direction) == pytest.approx(1.0)
        # Among all directions in the face, x has the largest component along the pull.
        assert x @ dovetail.load_axis == pytest.approx(np.hypot(z[0], z[1]))
        # The normal points out of the disk and into the blade: down, towards the slot's middle.
        assert z[2] < 0.0
        assert side * z[0] < 0.0
    ys = [face.frame.axes[1] for face in mesh.interfaces]
    np.testing.assert_allclose(ys[0], -ys[1], atol=1e-14)


def test_normals_point_out_of_the_disk(joint_and_mesh):
    """Check that the disk's material lies behind the face, the blade's in front of it."""
    _, mesh = joint_and_mesh
    for face in mesh.interfaces:
        for body, sense in ((mesh.bodies[0], -1.0), (mesh.bodies[1], 1.0)):
            facets = body.mesh.boundaries[face.name]
            inside = body.mesh.p[:, body.mesh.t[:, body.mesh.f2t[0, facets]]].mean(axis=1).T
            assert np.all(sense * face.frame.coordinates(inside)[:, 2] > 0.0)


def test_origin_is_the_centre_of_the_face(joint_and_mesh):
    _, mesh = joint_and_mesh
    for face in mesh.interfaces:
        centre = face.nodal_areas @ face.coordinates / face.nodal_areas.sum()
        np.testing.assert_allclose(centre, 0.0, atol=1e-10)
        size = np.ptp(face.coordinates, axis=0)
        np.testing.assert_allclose(size, joint_and_mesh[0].flank_size(), rtol=1e-12)


def test_boundaries_are_named_and_planar(joint_and_mesh):
    dovetail, mesh = joint_and_mesh
    assert set(mesh.bodies[0].mesh.boundaries) == DISK
    assert set(mesh.bodies[1].mesh.boundaries) == BLADE
    _, bottom = dovetail.flank_ends()
    heights = {
        "inner": dovetail.rim_radius - dovetail.disk_height,
        "root_bottom": bottom[1] - dovetail.root_depth,
        "shank_top": dovetail.rim_radius + dovetail.shank_height,
    }
    for body in mesh.bodies:
        for name in body.mesh.boundaries:
            assert len(body.facets(name)) > 0
            if name in heights:
                at = body.mesh.p[2, body.vertices(name)]
                np.testing.assert_allclose(at, heights[name], rtol=1e-12)
    for face in mesh.interfaces:
        local = face.frame.coordinates(mesh.bodies[0].mesh.p[:, face.nodes_1].T)
        np.testing.assert_allclose(local[:, 2], 0.0, atol=1e-9)


def test_boundaries_have_their_area(dovetail, coarse_mesh):
    tangent = np.tan(np.pi / dovetail.blades)
    inner = dovetail.rim_radius - dovetail.disk_height
    outer = dovetail.rim_radius + dovetail.lug_height
    side = (outer - inner) * np.hypot(1.0, tangent)
    _, bottom = dovetail.flank_ends()
    widths = [
        (coarse_mesh.bodies[0], "inner", 2.0 * inner * tangent),
        (coarse_mesh.bodies[0], "sides", 2.0 * side),
        (coarse_mesh.bodies[1], "root_bottom", 2.0 * bottom[0]),
        (coarse_mesh.bodies[1], "shank_top", dovetail.neck_width),
    ]
    for body, name, width in widths:
        area = triangle_areas(body.mesh, name).sum()
        assert area == pytest.approx(width * dovetail.slot_length, rel=1e-10)


def test_sides_lie_on_the_sector_planes(dovetail, coarse_mesh):
    x, _, z = coarse_mesh.bodies[0].mesh.p[:, coarse_mesh.bodies[0].vertices("sides")]
    np.testing.assert_allclose(np.abs(x), z * np.tan(np.pi / dovetail.blades), rtol=1e-12)


def test_mesh_is_its_own_mirror_image(joint_and_mesh):
    """Check nodes and elements for symmetry about the middle of every section."""
    dovetail, mesh = joint_and_mesh
    for body in mesh.bodies:
        points = body.mesh.p.T
        mirrored = points.copy()
        mirrored[:, 0] = 2.0 * points[:, 1] * np.tan(dovetail.skew) - points[:, 0]
        distance, image = cKDTree(points).query(mirrored)
        assert distance.max() < 1e-10
        elements = np.sort(body.mesh.t.T, axis=1).tolist()
        images = np.sort(image[body.mesh.t].T, axis=1).tolist()
        assert sorted(images) == sorted(elements)


def test_no_element_is_flat(joint_and_mesh):
    """Heights are 0.4 of the shortest edge or more; elements are long along the slot only."""
    _, mesh = joint_and_mesh
    for body in mesh.bodies:
        volumes = np.abs(element_volumes(body.mesh))
        edges = body.mesh.p[:, body.mesh.edges]
        lengths = np.linalg.norm(edges[:, 0] - edges[:, 1], axis=0)[body.mesh.t2e]
        sides = body.mesh.p[:, body.mesh.facets].transpose(1, 2, 0)
        areas = 0.5 * np.linalg.norm(np.cross(sides[1] - sides[0], sides[2] - sides[0]), axis=1)
        heights = 3.0 * volumes / areas[body.mesh.t2f].max(axis=0)
        assert np.all(heights > 0.4 * lengths.min(axis=0))
        assert np.all(lengths.max(axis=0) < 25.0 * lengths.min(axis=0))


def test_elements_of_many_layers_are_not_long_either(dovetail):
    for body in dovetail.mesh((8, 19), 8.0, notch=24).bodies:
        edges = body.mesh.p[:, body.mesh.edges]
        longest = np.linalg.norm(edges[:, 0] - edges[:, 1], axis=0)[body.mesh.t2e].max(axis=0)
        assert np.all(np.abs(element_volumes(body.mesh)) > 1e-3 * longest**3)


@pytest.mark.parametrize("order", [1, 2])
def test_layers_divide_the_rounding_of_the_ends(dovetail, order):
    """A seventh of them at each end are equal, and end where the flat begins."""
    along = 1 + 14 * order
    (face, _) = dovetail.mesh((3, along), 8.0, order=order).interfaces
    rows = np.unique(face.coordinates[:, 1].round(9))
    layers = np.diff(rows)[::order] * order
    assert layers == pytest.approx(layers[::-1], rel=1e-9)
    assert layers[:3] == pytest.approx(dovetail.end_width / 3.0, rel=1e-9)
    assert np.all(np.diff(layers[2:7]) > 0.0)


@pytest.mark.parametrize("ends", [{"end_width": 0.1}, {"end_width": None, "end_radius": None}])
def test_layers_of_sharp_ends_grow_towards_the_middle(dovetail, ends):
    (face, _) = replace(dovetail, **ends).mesh((3, 9), 8.0).interfaces
    layers = np.diff(np.unique(face.coordinates[:, 1].round(9)))
    assert layers == pytest.approx(layers[::-1], rel=1e-9)
    assert np.all(np.diff(layers[:4]) > 0.0)
    assert layers.max() < 3.0 * layers.min()


def test_gap_is_flat_with_circular_edges_and_ends(joint_and_mesh):
    """Check R - sqrt(R² - t²) at distances t into the arcs along the edges of the face."""
    dovetail, _ = joint_and_mesh

    def arc(t, radius):
        return radius - np.sqrt(radius**2 - np.maximum(t, 0.0) ** 2)

    for side in (1, -1):
        frame = dovetail.flank_frame(side)
        up = frame.components(
            np.array([-side * np.sin(dovetail.flank_angle), 0.0, np.cos(dovetail.flank_angle)])
        )[:2]
        along = frame.components(dovetail.slot_direction)[:2]
        share = np.linspace(-0.5, 0.5, 101)
        u, v = (a.ravel() for a in np.meshgrid(share, share))
        points = u * dovetail.flank_width * up[:, None] + v * dovetail.slot_length * along[:, None]
        across_slot = abs(up[0] * along[1] - up[1] * along[0])  # sine of the corner's angle
        to_edge = (0.5 - np.abs(u)) * dovetail.flank_width * across_slot
        to_end = (0.5 - np.abs(v)) * dovetail.slot_length * across_slot
        expected = arc(dovetail.edge_width - to_edge, dovetail.edge_radius)
        expected += arc(dovetail.end_width - to_end, dovetail.end_radius)
        gap = dovetail.flank_gap(*points, side)
        np.testing.assert_allclose(gap, expected, atol=1e-12)
        flat = (to_edge >= dovetail.edge_width) & (to_end >= dovetail.end_width)
        assert flat.any()
        assert np.abs(gap[flat]).max() < 1e-15


def test_nodes_carry_that_gap(joint_and_mesh):
    dovetail, mesh = joint_and_mesh
    for side, face in zip((1, -1), mesh.interfaces, strict=True):
        np.testing.assert_array_equal(face.gap, dovetail.flank_gap(*face.coordinates.T, side))
        assert face.gap.min() == 0.0
        assert face.gap.max() > 0.03


def test_gap_opens_beyond_the_face(dovetail):
    """Check that the gap opens fast beyond the face, where fillets and corners begin."""
    half = 0.5 * dovetail.flank_width
    x = half + np.array([0.0, 0.1, 1.0, 10.0])
    gap = dovetail.flank_gap(x, np.zeros(4), 1)
    assert np.all(np.diff(gap) >= 0.99 * np.diff(x))


@pytest.mark.parametrize(
    "changes", [{"slot_fillet": 6.0}, {"disk_height": 12.0}, {"blades": 48}, {"shank_height": 2.0}]
)
def test_impossible_sections_are_refused(dovetail, changes):
    with pytest.raises(MeshError, match=next(iter(changes))):
        replace(dovetail, **changes).mesh((8, 10), 8.0)
