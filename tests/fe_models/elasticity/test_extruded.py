"""Extruded bodies: bending exactly, and the same as tetrahedra of many nodes."""

import numpy as np
import pytest
from skfem import MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.extruded import ExtrudedBody
from fe_models.elasticity.recovery import StressRecovery
from fe_models.meshes.structure_mesh import Body
from sa_solver.types import Material

STEEL = Material(210e3, 0.3, 7.85e-9)
RADIUS = 2000.0


@pytest.fixture
def beam():
    """Return a beam of 1 x 2 mm and 6 mm length along Y, on unequal elements."""
    mesh = MeshTri.init_tensor(np.linspace(-0.5, 0.5, 4), np.linspace(-1.0, 1.0, 6))
    return ExtrudedBody(ElasticBody(Body("beam", mesh), STEEL, 2), np.array([0.0, 1.0, 3.5, 6.0]))


def bent(beam):
    """Return the displacements of pure bending in the plane XY."""
    x, y, z = beam.nodes
    nu = STEEL.poisson
    moved = np.array([-(y**2) - nu * (x**2 - z**2), 2.0 * x * y, -2.0 * nu * x * z])
    return (0.5 / RADIUS * moved).transpose(1, 0, 2).ravel()


def test_pure_bending_is_in_balance(beam):
    """Nothing acts on the sides, and on the ends a moment E I / R."""
    forces = (beam.stiffness @ bent(beam)).reshape(-1, 3, len(beam.levels))
    moment = STEEL.young * 2.0 / 12.0 / RADIUS
    assert np.abs(forces[:, :, 1:-1]).max() < 1e-8 * moment
    x = beam.section.nodes[:, 0]
    assert x @ forces[:, 1, -1] == pytest.approx(moment)
    assert x @ forces[:, 1, 0] == pytest.approx(-moment)


def test_stress_of_bending_is_exact(beam):
    section = beam.section
    recovery = StressRecovery(section, section.body.mesh.boundary_facets())
    vertices = np.arange(section.body.mesh.nvertices)
    stress = beam.stress(bent(beam), vertices, recovery)
    exact = np.zeros_like(stress)
    exact[1] = STEEL.young * section.body.points[:, :1] / RADIUS
    exact[1][:, [0, -1]] = 0.0  # The ends count as free.
    np.testing.assert_allclose(stress, exact, atol=1e-8 * exact.max())


def test_rigid_motions_have_no_forces(beam):
    forces = beam.stiffness @ beam.rigid_motions
    assert np.abs(forces).max() < 1e-8 * np.abs(beam.stiffness).max()


def test_loads_along_the_body_are_those_per_length(beam):
    section = beam.section
    load = section.body_load(lambda x: np.stack([x[0] + 2.0, 0.0 * x[0], 1.0 - x[2]]))
    spatial = beam.along(load[:, None]).reshape(-1, 3, len(beam.levels))
    assert spatial.sum(axis=(0, 2)) == pytest.approx([6.0 * 4.0, 0.0, 6.0 * 2.0])
    assert spatial[:, 0].sum(axis=0) @ beam.levels == pytest.approx(3.0 * 24.0)
