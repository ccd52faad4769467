"""Meshes with named boundaries, matched faces, and the file they are written to."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models.meshes.structure_mesh import (
    Body,
    MeshError,
    matched_interface,
    named_mesh,
    write_msh,
)

TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def test_named_boundary_is_the_triangle_given():
    mesh = named_mesh(TETRAHEDRON, np.array([[0, 1, 2, 3]]), {"base": np.array([[2, 0, 1]])})
    body = Body("one", mesh)
    assert body.vertices("base").tolist() == [0, 1, 2]
    assert len(body.facets("base")) == 1


def test_triangle_that_is_no_face_is_refused():
    points = np.vstack([TETRAHEDRON, [1.0, 1.0, 1.0]])
    tets = np.array([[0, 1, 2, 3], [1, 2, 3, 4]])
    with pytest.raises(MeshError, match="not faces of the mesh"):
        named_mesh(points, tets, {"wrong": np.array([[0, 1, 4]])})


def test_shifted_face_is_refused(dovetail, coarse_mesh):
    shifted = replace(dovetail, neck_width=dovetail.neck_width + 1e-3).mesh((8, 10), 8.0)
    with pytest.raises(MeshError, match=r"0\.0005 mm apart"):
        matched_interface(
            "intrados",
            coarse_mesh.bodies[0],
            shifted.bodies[1],
            "intrados",
            dovetail.flank_frame(1),
        )


def test_nodal_areas_integrate_linear_fields(coarse_mesh):
    """Check first moments about the centre, which vanish, and a second one by trapezia."""
    face = coarse_mesh.interfaces[0]
    x, y = face.coordinates.T
    assert face.nodal_areas.min() > 0.0
    assert abs(face.nodal_areas @ x) < 1e-9
    assert abs(face.nodal_areas @ y) < 1e-9


def test_written_file_is_read_back(coarse_mesh, tmp_path):
    path = tmp_path / "structure.msh"
    write_msh(path, coarse_mesh)
    read = meshio.read(path)
    bodies = coarse_mesh.bodies
    points = np.concatenate([body.mesh.p.T for body in bodies])
    np.testing.assert_allclose(read.points, points, rtol=1e-15, atol=1e-15)
    sizes = {name: len(read.get_cells_type("tetra")) for name in ("all",)}
    assert sizes["all"] == sum(body.mesh.nelements for body in bodies)
    for body in bodies:
        assert body.name in read.field_data
        for boundary in body.mesh.boundaries:
            tag, dimension = read.field_data[f"{body.name}_{boundary}"]
            assert dimension == 2
            tags = read.cell_data_dict["gmsh:physical"]["triangle"]
            assert np.sum(tags == tag) == len(body.facets(boundary))


@pytest.mark.parametrize("size", [0, 5_000])
def test_a_file_that_cannot_be_written_to_its_end_is_an_error(coarse_mesh, size, tmp_path):
    """Check the error that gmsh does not raise if the disk is full."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        with pytest.raises(OSError, match="No space left"):
            write_msh(tmp_path / "structure.msh", coarse_mesh)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("mesh", [MeshTet().refined(2), MeshTri().refined(3)])
def test_facets_are_numbered_as_scikit_fem_numbers_them(mesh: MeshTet | MeshTri) -> None:
    # The order is random, because a refined mesh has its vertices in a regular order.
    order = np.random.default_rng(0).permutation(mesh.nvertices)
    points, cells = mesh.p.T[np.argsort(order)], order[mesh.t].T
    ours = named_mesh(points, cells, {})
    theirs = type(mesh)(ours.p, ours.t)
    for name in ("facets", "t2f", "f2t"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), err_msg=name)
        assert getattr(ours, name).dtype == getattr(theirs, name).dtype
