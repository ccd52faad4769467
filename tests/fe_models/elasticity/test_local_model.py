"""Local models of notches: a hole in a wide plate (Kirsch) and its limits."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spla

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.local_model import NotchedBody, local_models
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import mesh_edges
from tests.fe_models.elasticity.test_recovery import TITANIUM, outside_load, pulled_plate


def pulled(round_hole, *, curved=True):
    """Return half of a plate with a hole under tension, solved with order 2, and its exact peak."""
    field, exact = pulled_plate(2, 2, round_hole, uniaxial=True)
    body, mesh = field.body, field.body.mesh
    ends = mesh.p.T[mesh_edges(mesh)]
    middles = ends.mean(axis=1)
    on_hole = np.all(np.abs(np.linalg.norm(ends, axis=2) - 1.0) < 1e-9, axis=1)
    middles[on_hole] /= np.linalg.norm(middles[on_hole], axis=1, keepdims=True)
    elastic = ElasticBody(replace(body, midsides=middles if curved else None), TITANIUM, 2)
    held = Constraints(len(elastic.nodes), 2)
    held.slide(*elastic.boundary_normals("base"))
    held.slide(np.array([np.argmax(elastic.nodes[:, 2])]), np.eye(2)[:1])
    t = held.transformation()
    rhs = t.T @ outside_load(elastic, uniaxial=True)
    moved = t @ spla.spsolve((t.T @ elastic.stiffness @ t).tocsc(), rhs)
    notched = NotchedBody(
        elastic=elastic,
        displacement=np.stack([moved, 2.0 * moved], axis=1),
        free=mesh.boundaries["hole"],
        contacts=(),
        variants=np.zeros((0, elastic.size, 2)),
        traction=lambda local: np.zeros((local.size, 2)),
        density=np.zeros((2, mesh.nvertices, 3)),
        thermal=np.zeros((mesh.nvertices, 2)),
        clamped=np.empty(0, np.int64),
    )
    return notched, exact


@pytest.mark.parametrize(("round_hole", "left"), [(24, 2e-3), (48, 6e-4)])
def test_stress_at_a_hole(round_hole, left):
    """The stress is near Kirsch's, its estimated error within a factor of three, and it scales."""
    notched, exact = pulled(round_hole)
    one, two = local_models(notched)
    true = abs(one.largest[0] / exact - 1.0)
    assert true < left
    assert true / 3.0 < one.error < 3.0 * true
    np.testing.assert_allclose(two.largest, 2.0 * one.largest, rtol=1e-9)
    assert two.error == pytest.approx(one.error)
    assert one.place[::2] == pytest.approx((0.0, 1.0), abs=1e-9)


def test_straight_sides_have_no_local_model():
    """Corners of a polygon would be sharp notches."""
    notched, _ = pulled(24, curved=False)
    assert local_models(notched) == [None, None]


def test_loads_near_the_notch_prevent_it():
    """With few elements the cut would go through the outside, which carries the tension."""
    notched, _ = pulled(12)
    assert local_models(notched) == [None, None]
