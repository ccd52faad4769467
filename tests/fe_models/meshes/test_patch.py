"""Patches of meshes keep quadratic fields, boundaries and curved surfaces, cut out and halved."""

import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.meshes.patch import CUT, MeshPatch
from fe_models.meshes.structure_mesh import Body, mesh_edges
from sa_solver.types import Material

STEEL = Material(210e3, 0.3)


@pytest.mark.parametrize(("kind", "refined"), [(MeshTri, 3), (MeshTet, 2)])
def test_quadratic_fields_are_exact_on_halved_elements(kind, refined):
    mesh = kind().refined(refined).with_boundaries({"low": lambda x: x[1] == 0.0})
    body = Body("block", mesh)
    patch = MeshPatch.around(body, np.array([0]), rings=2)
    fine = patch.refined().refined()

    def field(elastic):
        x, y = elastic.nodes[:, elastic.body.axes[0]], elastic.nodes[:, elastic.body.axes[1]]
        return x**2 + 3.0 * x * y - y + 0.5 * y**2

    whole, part = ElasticBody(body, STEEL, 2), ElasticBody(fine.body, STEEL, 2)
    np.testing.assert_allclose(fine.of_nodes @ field(whole), field(part), atol=1e-14)
    np.testing.assert_allclose(fine.of_vertices @ mesh.p.T, fine.body.mesh.p.T, atol=1e-14)
    parts = 2 ** (2 * mesh.dim())
    assert fine.body.mesh.nelements == parts * patch.body.mesh.nelements


@pytest.mark.parametrize(("kind", "refined"), [(MeshTri, 3), (MeshTet, 2)])
def test_boundaries_keep_their_area_and_side(kind, refined):
    mesh = kind().refined(refined).with_boundaries({"low": lambda x: x[1] == 0.0})
    patch = MeshPatch.around(Body("block", mesh), np.array([0]), rings=2)
    fine = patch.refined()
    for name in ("low", CUT):
        before, after = (of.body.outward(name).sum(axis=0) for of in (patch, fine))
        np.testing.assert_allclose(after, before, atol=1e-14)
    surface = fine.body.outward_of(fine.body.mesh.boundary_facets())
    np.testing.assert_allclose(surface.sum(axis=0), 0.0, atol=1e-14)


def test_halved_elements_stay_on_a_round_surface():
    """Halved sides stay as close to a circle as the quadratic ones that they are parts of."""
    angles = np.linspace(0.0, 0.5 * np.pi, 7)
    mesh = MeshTri.init_tensor(np.linspace(1.0, 2.0, 4), angles)
    points = mesh.p[0] * np.array([np.cos(mesh.p[1]), np.sin(mesh.p[1])])
    mesh = MeshTri(points, mesh.t)
    ends = points.T[mesh_edges(mesh)]
    middles = ends.mean(axis=1)
    on = np.all(np.abs(np.linalg.norm(ends, axis=2) - 1.0) < 1e-9, axis=1)
    middles[on] /= np.linalg.norm(middles[on], axis=1, keepdims=True)
    body = Body("ring", mesh, midsides=middles)
    vertex = int(
        np.argmin(np.linalg.norm(points.T - [np.cos(angles[3]), np.sin(angles[3])], axis=1))
    )
    fine = MeshPatch.around(body, np.array([vertex]), rings=2).refined().body
    inmost = np.linalg.norm(fine.nodes, axis=1)
    near = inmost[np.abs(inmost - 1.0) < 0.02]
    # Straight sides would be off by the sagitta of 0.0086.
    assert len(near) >= 9
    assert np.abs(near - 1.0).max() < 1e-4
