"""The specimen pair: geometry, matched pads and rings, and frequencies from the source."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fe_models.elasticity.body import ElasticBody
from fe_models.geometry.specimens import Specimen
from fe_models.joints.reduction import free_frequencies, reduce_body
from fe_models.meshes.structure_mesh import MeshError
from fe_models.specimens import reduced_specimens, specimen_matrices
from sa_solver.types import Material
from tests.marks import slow

STEEL = Material(200e3, 0.3, 7.8e-9)
# Free-free frequencies of the rig's specimen, full model [Hz] (thesis, table 1).
PRINTED = np.array([29852.0, 29885.0, 47439.0, 69989.0, 70145.0, 76965.0])
COARSE = Specimen(pad_elements=4)


@pytest.fixture(scope="module")
def pair():
    return COARSE.mesh(2.0)


def volume(mesh):
    corners = mesh.p[:, mesh.t].transpose(2, 1, 0)
    return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6.0


def exact_volume(specimen):
    """Return the cylinder less both chamfers, by quadrature over their width."""
    radius, half = 0.5 * specimen.diameter, 0.5 * specimen.strip_width
    nodes, weights = np.polynomial.legendre.leggauss(200)
    y = half + 0.5 * (radius - half) * (nodes + 1.0)
    drop = specimen.chamfer_depth * (y - half) / (radius - half)
    removed = (radius - half) * weights @ (drop * 2.0 * np.sqrt(radius**2 - y**2))
    return np.pi * radius**2 * specimen.length - removed


class TestGeometry:
    def test_volume_converges(self):
        errors = [
            1.0 - volume(COARSE.mesh(size).bodies[0].mesh) / exact_volume(COARSE)
            for size in (2.0, 1.0)
        ]
        # A circle drawn as a polygon: second order in the size.
        assert 0.0 < errors[1] < 0.35 * errors[0] < 0.02

    def test_pads_meet_node_to_node(self, pair):
        (face,) = pair.interfaces
        assert len(face) == 25
        np.testing.assert_allclose(
            pair.bodies[0].points[face.nodes_1], pair.bodies[1].points[face.nodes_2], atol=1e-12
        )
        np.testing.assert_allclose(face.nodal_areas.sum(), 1.0, rtol=1e-12)
        np.testing.assert_allclose(np.abs(face.coordinates).max(axis=0), 0.5)

    def test_default_pad_has_121_nodes(self):
        assert len(Specimen().mesh(2.0).interfaces[0]) == 121

    def test_both_pads_have_the_same_triangles(self, pair):
        (face,) = pair.interfaces
        of_body_2 = {tuple(sorted(face.nodes_1[triangle])) for triangle in face.facets}
        assert of_body_2 == {tuple(sorted(t)) for t in pair.bodies[0].facets("contact")}

    def test_bodies_are_on_their_sides_of_the_contact(self, pair):
        assert pair.bodies[0].points[:, 2].max() == pytest.approx(0.0, abs=1e-12)
        assert pair.bodies[1].points[:, 2].min() == pytest.approx(0.0, abs=1e-12)
        assert np.ptp(pair.bodies[0].points[:, 2]) == pytest.approx(33.0)

    @pytest.mark.parametrize("mirror", [(-1.0, 1.0, 1.0), (1.0, -1.0, 1.0)])
    def test_mesh_is_its_mirror_image(self, pair, mirror):
        points = pair.bodies[0].points
        distance, image = cKDTree(points).query(points * mirror)
        assert distance.max() < 1e-12
        tets = {tuple(sorted(tet)) for tet in pair.bodies[0].mesh.t.T}
        assert {tuple(sorted(image[list(tet)])) for tet in tets} == tets

    def test_strip_of_body_2_is_turned(self, pair):
        for body, axis in ((pair.bodies[0], 1), (pair.bodies[1], 0)):
            flat = body.points[np.abs(body.points[:, 2]) < 1e-12]
            assert np.abs(flat[:, axis]).max() == pytest.approx(0.5)
            assert np.abs(flat[:, 1 - axis]).max() == pytest.approx(4.0)

    def test_boundaries(self, pair):
        for body, side in ((pair.bodies[0], -1.0), (pair.bodies[1], 1.0)):
            gripped = body.points[body.vertices("gripped")]
            np.testing.assert_allclose(gripped[:, 2], 33.0 * side)
            holder = body.points[body.vertices("holder")]
            assert np.abs(holder[:, 2]).min() == pytest.approx(2.0)
            np.testing.assert_allclose(np.hypot(holder[:, 0], holder[:, 1]), 4.0)

    def test_rings(self, pair):
        for body, side in ((pair.bodies[0], -1.0), (pair.bodies[1], 1.0)):
            x, y, z = body.points[COARSE.ring(body)].T
            angle = 2.0 * np.pi * np.arange(16) / 16
            np.testing.assert_allclose(x, 4.0 * np.cos(angle), atol=1e-9)
            np.testing.assert_allclose(y, 4.0 * np.sin(angle), atol=1e-9)
            np.testing.assert_allclose(z, 2.0 * side)

    def test_ring_of_another_specimen(self, pair):
        with pytest.raises(MeshError, match="no nodes on the ring"):
            Specimen(ring_distance=5.0).ring(pair.bodies[0])

    def test_crossed_strips_touch_like_a_sphere(self):
        specimen = Specimen(radii=(1000.0, 50.0))
        x, y = np.meshgrid(np.linspace(-0.5, 0.5, 5), np.linspace(-0.5, 0.5, 5))
        relative = 1000.0 * 50.0 / (1000.0 + 50.0)
        sphere = (x**2 + y**2) / (2.0 * relative)
        # The next term of a circle's sagitta is r⁴/8R³: a share of (0.5/50)²/4.
        np.testing.assert_allclose(specimen.gap(x, y), sphere, rtol=3e-5)
        np.testing.assert_allclose(specimen.gap(x, y), specimen.gap(y, x), rtol=1e-14)
        assert not Specimen().gap(x, y).any()

    def test_gap_is_that_of_the_interface(self):
        specimen = Specimen(pad_elements=4, radii=(1000.0, 50.0))
        (face,) = specimen.mesh(2.0).interfaces
        np.testing.assert_array_equal(face.gap, specimen.gap(*face.coordinates.T))

    @pytest.mark.parametrize(
        ("changed", "message"),
        [
            ({"strip_width": 6.0}, "strip_width"),
            ({"chamfer_depth": 2.5}, "chamfer_depth"),
            ({"ring_distance": 40.0}, "ring_distance"),
            ({"pad_elements": 5}, "even number"),
            ({"ring_nodes": 10}, "multiple of 4"),
            ({"radii": (1000.0, 0.4)}, "radii"),
        ],
    )
    def test_impossible_specimens(self, changed, message):
        with pytest.raises(MeshError, match=message):
            Specimen(**changed).mesh()

    def test_no_chamfer(self):
        bare = Specimen(pad_elements=4, chamfer_depth=0.0)
        error = 1.0 - volume(bare.mesh(1.0).bodies[0].mesh) / exact_volume(bare)
        assert 0.0 < error < 0.02


class TestModels:
    def test_body_2_is_body_1_turned(self, pair):
        """Check equal stiffness after exchanging X and Y, and the nodes."""
        first, second = reduced_specimens(COARSE, pair, (STEEL, STEEL), order=1, modes=0)
        turn = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
        (face,) = pair.interfaces
        points = np.concatenate(
            [
                pair.bodies[1].points[face.nodes_2],
                pair.bodies[1].points[COARSE.ring(pair.bodies[1])],
            ]
        )
        kept = np.concatenate(
            [
                pair.bodies[0].points[face.nodes_1],
                pair.bodies[0].points[COARSE.ring(pair.bodies[0])],
            ]
        )
        image = cKDTree(kept).query(points @ turn)[1]
        blocks = first.stiffness.reshape(len(kept), 3, len(kept), 3)[image][:, :, image]
        turned = np.einsum("ab,nbmc,dc->namd", turn, blocks, turn).reshape(first.stiffness.shape)
        size = np.abs(turned).max()
        np.testing.assert_allclose(second.stiffness, turned, atol=1e-9 * size)

    @pytest.mark.parametrize("order", [1, slow(2)])
    def test_reduced_frequencies(self, pair, order):
        (face,) = pair.interfaces
        full = specimen_matrices(COARSE, pair.bodies[0], face.nodes_1, STEEL, order)
        model = reduce_body(full.stiffness, full.mass, full.kept, 20)
        exact = free_frequencies(full.stiffness, full.mass, 12)
        reduced = free_frequencies(model.stiffness, model.mass, 12)
        np.testing.assert_allclose(reduced[6:], exact[6:], rtol=6e-3)
        assert max(exact[:6].max(), reduced[:6].max()) < 1e-5 * exact[6]

    def test_tied_ring_moves_linearly(self, pair):
        """Check that a displacement linear in each element is unchanged, and the pad's trace."""
        (face,) = pair.interfaces
        full = specimen_matrices(COARSE, pair.bodies[0], face.nodes_1, STEEL)
        elastic = ElasticBody(pair.bodies[0], STEEL, 2)
        assert elastic.size - full.stiffness.shape[0] == 3 * (16 - len(face))
        rigid = np.tile(np.eye(3), (full.transformation.shape[1] // 3, 1))
        # The springs of the trace are stiff.
        rounding = 1e-13 * abs(full.stiffness).max()
        np.testing.assert_allclose(full.stiffness @ rigid, 0.0, atol=rounding)

    @pytest.mark.slow
    def test_printed_frequencies(self):
        """Check the thesis's frequencies: full model within 2 %, reduced one within 0.6 % of it.

        The chamfer is assumed to be 1 mm deep.
        """
        specimen = Specimen()
        mesh = specimen.mesh()
        nodes = mesh.interfaces[0].nodes_1
        full = specimen_matrices(specimen, mesh.bodies[0], nodes, STEEL)
        exact = free_frequencies(full.stiffness, full.mass, 12)
        np.testing.assert_allclose(exact[6:], PRINTED, rtol=0.02)
        assert exact[:6].max() < 1e-5 * exact[6]
        model = reduce_body(full.stiffness, full.mass, full.kept, 20)
        reduced = free_frequencies(model.stiffness, model.mass, 12)
        np.testing.assert_allclose(reduced[6:], exact[6:], rtol=6e-3)
        assert reduced[:6].max() < 1e-5 * reduced[6]
