"""The default joint on a coarse mesh and small boxes, for all tests of the structural stage."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from skfem import MeshTet

from fe_models.dovetail import Mission, dovetail_structure
from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.stress import StressField, cycle_stresses
from fe_models.geometry.dovetail import Dovetail
from fe_models.joints.friction import FrictionalJoint
from fe_models.joints.joint import JointStiffness
from fe_models.meshes.structure_mesh import Body, StructureMesh
from fe_models.structure import CycleSolution, Structure
from sa_solver.types import Array, Material

# The mesh is coarse, because the laws tested here hold on any mesh.
FLANK_NODES, SIZE, NOTCH = (8, 10), 8.0, 16


def stress_state(
    structure: Structure, force: Array, relative: Array, amplitudes: Array
) -> tuple[StressField, StressField]:
    """Return the stress fields of both bodies in one state, a cycle of a single increment."""
    (found,) = cycle_stresses(structure, [(force[None], relative[None])], amplitudes[None], 0)
    return found.fields


@pytest.fixture(scope="session")
def titanium() -> Material:
    return Material(115e3, 0.29, 4.43e-9, 900.0)


@pytest.fixture(scope="session")
def dovetail() -> Dovetail:
    """Return the joint of the default case."""
    return Dovetail(
        flank_angle=np.deg2rad(45.0),
        flank_length=8.0,
        edge_radius=30.0,
        edge_width=1.5,
        end_radius=150.0,
        end_width=3.0,
        neck_width=20.0,
        neck_fillet=3.0,
        root_depth=6.0,
        shank_height=30.0,
        slot_length=60.0,
        slot_fillet=3.0,
        slot_clearance=1.0,
        lug_height=6.0,
        disk_height=60.0,
        rim_radius=250.0,
        blades=24,
    )


@pytest.fixture(scope="session")
def mission() -> Mission:
    """Return the mission of the default case."""
    return Mission(22, 8, 6000 * 2 * np.pi / 60, 0.8e-3, 400.0, 30e3)


@pytest.fixture(scope="session")
def symmetric(mission: Mission) -> Mission:
    """Return the mission without the aerodynamic moment, for which both flanks behave the same."""
    return replace(mission, aerodynamic_moment=0.0)


@pytest.fixture(scope="session")
def coarse_mesh(dovetail: Dovetail) -> StructureMesh:
    return dovetail.mesh(FLANK_NODES, SIZE, notch=NOTCH)


@pytest.fixture(scope="session")
def structure_of(dovetail, titanium, mission):
    """Return the coarse structure and condensed joint of the default dovetail with changed fields.

    Of the mission only the airfoil is part of the structure; speeds and moment are amplitudes.
    """

    @cache
    def build(airfoil_mass: float = 0.8e-3, **changes) -> tuple[Structure, JointStiffness]:
        changed = replace(dovetail, **changes)
        mesh = changed.mesh(FLANK_NODES, SIZE, notch=NOTCH)
        lifted = replace(mission, airfoil_mass=airfoil_mass)
        structure = dovetail_structure(changed, mesh, titanium, titanium, lifted, 1)
        return structure, structure.condense()

    return build


@pytest.fixture(scope="session")
def solved(structure_of) -> Callable[..., CycleSolution]:
    """Return the closed cycle of ``structure_of`` with a friction coefficient on a mission."""

    @cache
    def solve(friction: float, mission: Mission, **changes) -> CycleSolution:
        structure, joint = structure_of(**changes)
        frictional = FrictionalJoint(joint.resolvent(), friction)
        return structure.solve_cycle(frictional, mission.amplitudes(), structure.gap(), friction)

    return solve


@pytest.fixture(scope="session")
def structure(structure_of) -> Structure:
    return structure_of()[0]


@pytest.fixture(scope="session")
def joint(structure_of) -> JointStiffness:
    return structure_of()[1]


def make_box(
    counts: tuple[int, int, int],
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    material: Material,
    order: int,
) -> ElasticBody:
    """Return a box of tetrahedra with boundaries x0, x1, y0, y1, z0, z1."""
    steps = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
    mesh = MeshTet.init_tensor(*steps)
    faces = {
        f"{name}{end}": (lambda x, axis=axis, value=value: np.isclose(x[axis], value))
        for axis, name in enumerate("xyz")
        for end, value in enumerate((low[axis], high[axis]))
    }
    return ElasticBody(Body("box", mesh.with_boundaries(faces)), material, order)


@pytest.fixture(scope="session")
def box() -> Callable[..., ElasticBody]:
    return make_box
