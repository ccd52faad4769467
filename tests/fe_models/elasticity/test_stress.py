"""Stress of both bodies at a state of the joint."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fe_models.elasticity.stress import PeakStress, StressField, cycle_stresses, steps
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import Body
from sa_solver import von_mises
from sa_solver.types import Frame
from tests.fe_models.conftest import stress_state

PEAK = 7


def state(cycle, increment):
    force = np.concatenate([h.force[increment] for h in cycle.histories], axis=1)
    relative = np.concatenate([h.displacement[increment] for h in cycle.histories], axis=1)
    return force, relative


@pytest.fixture(scope="module")
def peak(structure, solved, symmetric):
    """Return amplitudes, contact forces and stress fields at the peak of the symmetric mission."""
    amplitudes = symmetric.amplitudes()[PEAK]
    force, relative = state(solved(0.4, symmetric), PEAK)
    return amplitudes, force, relative, stress_state(structure, force, relative, amplitudes)


def test_unloaded_joint_has_no_stress(structure):
    nothing = np.zeros((3, len(structure.gap())))
    for field in stress_state(structure, nothing, nothing, np.zeros(2)):
        for values in (field.displacement, field.von_mises, field.maximum_principal):
            assert np.abs(values).max() == 0.0


def test_contact_forces_are_recovered(structure, peak):
    """Check that K u - loads is the contact force on the flanks of either body.

    It vanishes at every other node that is not supported.
    """
    _, force, _, fields = peak
    amplitudes = peak[0]
    bodies = structure.bodies
    supports = ({"inner", "sides"}, {"root_bottom"})
    for number, (body, field) in enumerate(zip(bodies, fields, strict=True)):
        elastic = body.elastic
        residual = elastic.stiffness @ field.displacement.ravel() - body.loads @ amplitudes
        residual = residual.reshape(-1, 3)
        start, faces = 0, []
        for face in structure.mesh.interfaces:
            nodes = (face.nodes_1, face.nodes_2)[number]
            expected = (-1.0, 1.0)[number] * force[:, start : start + len(face)].T
            recovered = face.frame.components(residual[nodes])
            np.testing.assert_allclose(recovered, expected, atol=2e-6 * np.abs(force).max())
            start += len(face)
            faces.append(nodes)
        touched = [elastic.boundary_nodes(name) for name in supports[number]]
        free = np.setdiff1d(np.arange(len(residual)), np.concatenate(faces + touched))
        assert np.abs(residual[free]).max() < 1e-8 * np.abs(force).max()


def test_relative_displacements_are_those_given(structure, peak):
    """Check that body 2 follows body 1 at the distance that the friction solver found."""
    _, _, relative, (disk, blade) = peak
    start = 0
    for face in structure.mesh.interfaces:
        apart = blade.displacement[face.nodes_2] - disk.displacement[face.nodes_1]
        recovered = face.frame.components(apart)
        expected = relative[:, start : start + len(face)].T
        np.testing.assert_allclose(recovered, expected, atol=1e-9)
        start += len(face)


def test_supports_hold(structure, peak):
    """Check the held bore, the sliding sides of the sector, and the mean of the root."""
    _, _, _, (disk, blade) = peak
    body = structure.bodies[0].elastic
    np.testing.assert_allclose(disk.displacement[body.boundary_nodes("inner")], 0.0, atol=1e-15)
    nodes, normals = body.boundary_normals("sides")
    across = np.sum(disk.displacement[nodes] * normals, axis=1)
    np.testing.assert_allclose(across, 0.0, atol=1e-12)
    nodes, weights = structure.bodies[1].elastic.boundary_weights("root_bottom")
    along = blade.displacement[nodes, 1]
    assert abs(weights @ along) < 1e-12 * weights.sum()


def test_symmetric_load_gives_symmetric_stress(structure, peak):
    _, _, _, fields = peak
    for body, field in zip(structure.mesh.bodies, fields, strict=True):
        points = body.mesh.p.T
        _, image = cKDTree(points).query(points * [-1.0, 1.0, 1.0])
        for values in (field.von_mises, field.maximum_principal):
            np.testing.assert_allclose(values[image], values, atol=1e-5 * values.max())
        mirrored = field.displacement[image] * [-1.0, 1.0, 1.0]
        size = np.abs(field.displacement).max()
        np.testing.assert_allclose(mirrored, field.displacement, atol=1e-6 * size)


def test_shank_carries_the_pull(structure, peak):
    """Check the virial of a body in equilibrium: ∫ σ = Σ r ⊗ f over the forces on it."""
    _, _, _, (_, blade) = peak
    elastic = structure.bodies[1].elastic
    stress = elastic.stress(blade.displacement.ravel())
    total = stress @ np.abs(element_volumes(elastic.body.mesh))
    forces = elastic.stiffness @ blade.displacement.ravel()
    moments = elastic.nodes.T @ forces.reshape(-1, 3)
    moments = 0.5 * (moments + moments.T)
    expected = moments[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    np.testing.assert_allclose(total, expected, atol=1e-9 * np.abs(expected).max())


def test_neck_stress_is_pull_over_area(structure, dovetail, peak):
    """Check the mean of σ_zz over a slice of the shank far from fillet and top."""
    amplitudes, _, _, (_, blade) = peak
    elastic = structure.bodies[1].elastic
    mesh = elastic.body.mesh
    centre = mesh.p[:, mesh.t].mean(axis=1)
    volume = np.abs(element_volumes(mesh))
    low, high = dovetail.rim_radius + 8.0, dovetail.rim_radius + dovetail.shank_height
    inside = (centre[2] > low) & (centre[2] < high)
    stress = elastic.stress(blade.displacement.ravel())[2]
    mean = np.sum((stress * volume)[inside]) / volume[inside].sum()
    area = dovetail.neck_width * dovetail.slot_length
    # Airfoil, and on average half of the slice's own mass above it.
    airfoil = amplitudes[0] * 0.8e-3 * 400.0
    mass = 4.43e-9 * volume[inside].sum()
    shank = 0.5 * amplitudes[0] * mass * 0.5 * (low + high)
    assert mean == pytest.approx((airfoil + shank) / area, rel=2e-2)


def test_faces_move_over_a_cycle_as_the_bodies_do(structure, solved, symmetric, peak):
    """Check relative motions in every increment, and all nodes of both bodies at peak load."""
    fields = solved(0.4, symmetric).fields()
    force, relative = fields["force"], fields["displacement"]
    amplitudes, done = symmetric.amplitudes(), []
    (cycle,) = cycle_stresses(
        structure, [(force, relative)], amplitudes, PEAK, [0, PEAK], lambda: done.append(1)
    )
    assert len(done) == steps(2)
    start = 0
    for interface, (of_1, of_2) in zip(structure.mesh.interfaces, cycle.faces, strict=True):
        nodes = slice(start, start + len(interface))
        np.testing.assert_allclose(of_2 - of_1, relative[:, :, nodes], atol=1e-12)
        for number, faces in ((1, of_1), (2, of_2)):
            moved = peak[3][number - 1].displacement[interface.nodes(number)]
            expected = interface.frame.components(moved).T
            np.testing.assert_allclose(faces[PEAK], expected, atol=1e-9)
        start += len(interface)
    for field, alone, seen in zip(cycle.fields, peak[3], cycle.surfaces, strict=True):
        scale = alone.von_mises.max()
        np.testing.assert_allclose(field.stress, alone.stress, atol=1e-6 * scale)
        # The surface at peak load is that of the field.
        on_surface = field.stress[:, seen.vertices]
        np.testing.assert_allclose(seen.stress[1], on_surface, atol=1e-9 * scale)
        moved = field.displacement[seen.vertices]
        np.testing.assert_allclose(seen.displacement[1], moved, atol=1e-12)
        assert np.abs(seen.stress[0]).max() < 0.5 * np.abs(on_surface).max()
        mesh = field.body.mesh
        facets = np.sort(seen.vertices[seen.triangles], axis=1).T
        np.testing.assert_array_equal(facets, mesh.facets[:, mesh.boundary_facets()])


@pytest.mark.parametrize("kind", ["MeshTet", "MeshTri"])
def test_stress_at_points_is_linear_and_turned(kind):
    """Check tension along global X that grows along it, in a frame turned by 45° about Y."""
    import skfem

    mesh = getattr(skfem, kind)().refined(2)
    body = Body("block", mesh)
    stress = np.zeros((6, mesh.nvertices))
    stress[0] = 10.0 + 4.0 * mesh.p[0]
    peak = PeakStress(14.0, 14.0, (1.0, 0.0, 0.0), False, 0.0)
    field = StressField(body, np.zeros((mesh.nvertices, 3)), stress, peak, None)
    half = np.sqrt(0.5)
    axes = np.array([[half, 0.0, half], [0.0, 1.0, 0.0], [-half, 0.0, half]])
    frame = Frame(np.array([0.5, 0.5 if mesh.dim() == 3 else 0.0, 0.5]), axes)
    along = np.array([0.0, 0.3, -0.4, 2.0])
    found = field.at(np.stack([along, 0.0 * along, 0.0 * along], axis=1), frame)
    size = 10.0 + 4.0 * (0.5 + along[:3] * half)
    expected = np.zeros((6, 3))
    expected[0], expected[2], expected[5] = 0.5 * size, 0.5 * size, -0.5 * size
    np.testing.assert_allclose(found[:, :3], expected, atol=1e-12 * 10.0)
    assert np.isnan(found[:, 3]).all()
    np.testing.assert_allclose(von_mises(found[:, :3]), size)


def test_depth_of_elements_is_their_height_over_the_face(structure):
    """Check a tetrahedron: three times its volume over the area of its face."""
    body, name = structure.mesh.bodies[0], structure.mesh.interfaces[0].name
    areas = np.linalg.norm(body.outward(name), axis=1)
    cells = body.mesh.f2t[0, body.mesh.boundaries[name]]
    heights = 3.0 * np.abs(element_volumes(body.mesh))[cells] / areas
    assert body.depth(name) == pytest.approx(np.median(heights))
