"""Joints as one sparse system, compared with the full matrices of condensed bodies."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models.imported_structure import Support
from fe_models.joints.friction import FrictionalJoint
from fe_models.joints.joint import JointResolvent
from fe_models.joints.sparse_joint import SparseResolvent
from fe_models.loads.applied_loads import BoundaryForce, Pressure
from fe_models.meshes.structure_mesh import StructureMesh
from fe_models.solvers import linear_solver
from fe_models.solvers.linear_solver import FactorMemoryError
from fe_models.structure import Structure
from tests.fe_models.joints.pressed_blocks import STEEL, SURFACE, TITANIUM, Pressed
from tests.fe_models.joints.test_many_bodies import PUSHED, box, built, imported, pair
from tests.mirrored_blocks import along

# Memory for full matrices: none at all, so that the sparse system is taken.
NONE = 0.0
SOLVER = 1e-6
PATH = np.array([[1.0, 0.4], [1.0, 1.0], [1.0, 0.0], [1.0, -1.0]])


def stacked(sides=()):
    """Return three blocks on each other, pressed and pushed; the ``sides`` y0 of blocks slide."""
    x, y = along((0, 2, 4)), along((0, 1, 3))
    levels = {"base": (-1.0, 0.0, 2), "ring": (0.0, 0.5, 2), "pad": (0.5, 1.5, 3)}
    mesh = imported(**{name: box(x, y, along(z)) for name, z in levels.items()})
    # The pad is body 1 of its contact, so the ring is body 2 of both.
    pairs = [pair("low", "base_z1", "ring_z0"), pair("high", "pad_z0", "ring_z1")]
    loads = [Pressure("pad_z1", 400.0), BoundaryForce("pad_z1", 1.5 * PUSHED)]
    supports = [Support("base_z0", "xyz"), *(Support(f"{name}_y0", "y") for name in sides)]
    return built(mesh, pairs, supports, loads)


def on_a_plane_of_symmetry():
    """Return the blocks with a plane of symmetry through both contacts."""
    return stacked(["base", "ring", "pad"])


def of_other_meshes():
    """Return two blocks whose meshes have nothing in common."""
    tensor = np.diag([0.0, 0.0, -50.0]) + 10.0 * np.eye(3)[[2, 1, 0]]
    pressed = Pressed(SURFACE, 1, (STEEL, TITANIUM), lambda _: tensor)
    meshes = tuple(elastic.body for elastic in pressed.elastic)
    return Structure(StructureMesh(meshes, (pressed.interface,)), tuple(pressed.bodies))


STRUCTURES = [stacked, on_a_plane_of_symmetry, of_other_meshes]


@pytest.mark.parametrize("make", STRUCTURES)
def test_products_and_loads_are_those_of_full_matrices(make):
    structure = make()
    sparse, joint = structure.resolvent(memory=NONE), structure.condense()
    assert isinstance(sparse, SparseResolvent)
    full = replace(joint, smallest=sparse.rho, largest=sparse.rho).resolvent()
    vectors = np.random.default_rng(0).standard_normal((len(full.loads), 3))
    exact = full.product(vectors)
    largest = np.abs(exact).max()
    np.testing.assert_allclose(sparse.product(vectors), exact, atol=1e-9 * largest)
    np.testing.assert_allclose(sparse.product(vectors[:, 0]), exact[:, 0], atol=1e-9 * largest)
    np.testing.assert_allclose(
        sparse.rounded_product(vectors[:, 0]), exact[:, 0], atol=1e-4 * largest
    )
    np.testing.assert_allclose(sparse.loads, full.loads, atol=1e-8 * np.abs(full.loads).max())
    assert sparse.rigid_modes == full.rigid_modes


@pytest.mark.parametrize("make", [stacked, on_a_plane_of_symmetry])
def test_cycles_with_friction_are_those_of_full_matrices(make):
    structure, mu = make(), 0.3
    cycles = [
        structure.solve_cycle(FrictionalJoint(resolvent, mu), PATH, structure.gap(), mu)
        for resolvent in (structure.resolvent(memory=NONE), structure.resolvent())
    ]
    sparse, full = (cycle.fields()["force"] for cycle in cycles)
    assert cycles[0].converged
    assert max(np.abs(cycle.fields()["slip"]).max() for cycle in cycles) > 0.0
    np.testing.assert_allclose(sparse, full, atol=1e2 * SOLVER * np.abs(full).max())
    assert cycles[0].equilibrium.max() < SOLVER


@pytest.mark.parametrize("make", STRUCTURES)
def test_its_stiffness_of_springs_is_near_the_best(make):
    """Compare ρ with the geometric mean of the extreme eigenvalues of the full matrix."""
    structure = make()
    joint = structure.condense()
    best = np.sqrt(joint.smallest * joint.largest)
    assert 1.0 / 3.0 < structure.resolvent(memory=NONE).rho / best < 3.0


def test_full_matrices_are_taken_where_they_fit():
    assert isinstance(stacked().resolvent(), JointResolvent)


def test_second_order_bodies_have_full_matrices_always():
    tensor = np.diag([0.0, 0.0, -50.0])
    pressed = Pressed(SURFACE, 2, (STEEL, TITANIUM), lambda _: tensor)
    meshes = tuple(elastic.body for elastic in pressed.elastic)
    structure = Structure(StructureMesh(meshes, (pressed.interface,)), tuple(pressed.bodies))
    assert isinstance(structure.resolvent(memory=NONE), JointResolvent)


def test_factors_that_do_not_fit_are_refused(monkeypatch):
    monkeypatch.setattr(linear_solver, "available_bytes", lambda: 1e4)
    with pytest.raises(FactorMemoryError):
        stacked().resolvent(memory=NONE)
