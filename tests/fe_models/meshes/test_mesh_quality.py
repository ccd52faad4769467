"""Sizes and shapes of elements, compared with gmsh and regular ones."""

import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.meshes.quality import element_sizes, radius_ratios

# gmsh's numbers of first-order elements.
CELLS = {2: 2, 3: 4}


@pytest.mark.parametrize("dim", CELLS)
def test_shapes_are_the_gamma_of_gmsh(dim):
    """Check a cone of elements of many shapes, and the triangles of its base."""
    with gmsh_model("cone") as gmsh:
        gmsh.model.occ.addCone(0, 0, 0, 0, 0, 2, 1, 0.3)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
        gmsh.model.mesh.generate(dim)
        tags, points, _ = gmsh.model.mesh.getNodes()
        elements, nodes = gmsh.model.mesh.getElementsByType(CELLS[dim])
        gamma = np.array(gmsh.model.mesh.getElementQualities(elements, "gamma"))
    order = np.argsort(tags)
    cells = order[np.searchsorted(tags[order], nodes)].reshape(-1, dim + 1)
    points = points.reshape(-1, 3)
    flat = np.ptp(points[cells][:, :, 2], axis=1) < 1e-12 if dim == 2 else np.full(len(cells), True)
    kind = MeshTri if dim == 2 else MeshTet
    mesh = kind(np.ascontiguousarray(points[:, :dim].T), np.ascontiguousarray(cells[flat].T))
    assert np.sort(radius_ratios(mesh)) == pytest.approx(np.sort(gamma[flat]), abs=1e-12)


def test_regular_elements_and_flat_ones():
    height = np.sqrt(3.0) / 2.0
    triangle = MeshTri(np.array([[0.0, 1.0, 0.5], [0.0, 0.0, height]]), np.array([[0], [1], [2]]))
    assert radius_ratios(triangle) == pytest.approx(1.0)
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]).T
    tetrahedron = MeshTet(corners, np.arange(4)[:, None])
    assert radius_ratios(tetrahedron) == pytest.approx(1.0)
    assert element_sizes(tetrahedron) == pytest.approx(np.sqrt(8.0))
    flat = MeshTet(corners * [[1.0], [1.0], [1e-6]], np.arange(4)[:, None])
    assert radius_ratios(flat) < 1e-5
