"""Forces on node sets that are not faces: statics for any number of nodes."""

import numpy as np
import pytest

from fe_models.loads.applied_loads import BoundaryForce
from fe_models.loads.nodal_force import shared
from fe_models.meshes.structure_mesh import MeshError

FORCE, MOMENT, AT = (
    np.array([3.0, -1.0, 2.0]),
    np.array([5.0, 0.5, -4.0]),
    np.array([1.0, 7.0, 2.0]),
)


@pytest.mark.parametrize("count", [3, 4, 50])
def test_forces_of_nodes_are_the_force_and_its_moment(count):
    places = np.random.default_rng(count).normal(size=(count, 3)) * (4.0, 2.0, 1.0)
    forces = shared(BoundaryForce("tips", FORCE, AT, MOMENT), places)
    np.testing.assert_allclose(forces.sum(axis=0), FORCE, rtol=1e-12)
    moment = np.cross(places - AT, forces).sum(axis=0)
    np.testing.assert_allclose(moment, MOMENT, rtol=1e-10)


def test_a_force_alone_is_shared_alike():
    places = np.array([[0.0, 0, 0], [1, 0, 0], [5, 1, 0]])
    np.testing.assert_allclose(shared(BoundaryForce("tips", FORCE), places), [FORCE / 3] * 3)


def test_nodes_on_a_line_carry_no_moment_about_it():
    """Check that they carry moments across it."""
    places = np.array([[0.0, 0, 0], [1, 0, 0], [5, 0, 0]])
    none = np.zeros(3)
    forces = shared(BoundaryForce("edge", none, moment=np.array([0.0, 3.0, 0.0])), places)
    np.testing.assert_allclose(np.cross(places, forces).sum(axis=0), [0, 3, 0], atol=1e-12)
    with pytest.raises(MeshError, match=r"nodes of edge .* moment"):
        shared(BoundaryForce("edge", none, moment=np.array([3.0, 0.0, 0.0])), places)
