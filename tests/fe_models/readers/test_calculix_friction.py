"""Friction of two bodies by CalculiX's penalty, which converges to ours as it stiffens."""

import numpy as np
import pytest

from fe_models.joints.friction import FrictionalJoint
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import StructureMesh, matched_interface
from fe_models.motion import deformation
from fe_models.structure import Structure
from fe_models.supported_body import SupportedBody, interface_nodes
from tests.fe_models.readers.calculix import Job, Step, needs_ccx
from tests.fe_models.readers.test_calculix import FRAME, PRESSURE, blocks

pytestmark = [pytest.mark.slow, needs_ccx]

FRICTION = 0.4
# Shear over pressure on the upper end, there and back, with increments: CalculiX cuts longer ones.
TURNS = ((0.18, 16), (-0.18, 32))
PENALTIES = (1e6, 1e7, 1e8)  # [MPa/mm]; CalculiX does not converge with stiffer ones.


def pressed():
    """Return the structure of both bodies, and the load cases: pressed, and pulled along x."""
    lower, upper = blocks(1)
    face = matched_interface("joint", lower.body, upper.body, "joint", FRAME)
    pull = upper.traction_load("end", lambda x: np.ones(x.shape[1:]), np.eye(3)[0])
    cases = PRESSURE * np.stack([upper.pressure_load("end"), pull], axis=1)
    held, free = (Constraints(len(body.nodes), 3) for body in (lower, upper))
    held.hold(lower.boundary_nodes("end"))
    supported = []
    for side, (body, constraints, loads) in enumerate(
        ((lower, held, np.zeros((lower.size, 2))), (upper, free, cases)), start=1
    ):
        placed = interface_nodes([(face, side)], body.body)
        supported.append(SupportedBody(body, constraints, *placed, loads))
    return Structure(StructureMesh((lower.body, upper.body), (face,)), tuple(supported)), cases


def path():
    """Return amplitudes of the load cases after pressing and at the end of every increment."""
    amplitudes, last = [(1.0, 0.0)], 0.0
    for end, count in TURNS:
        amplitudes += [(1.0, last + (end - last) * k / count) for k in range(1, count + 1)]
        last = end
    return np.array(amplitudes)


def by_calculix(folder, structure, cases, stiffness):
    """Return displacements ``(n, 3)`` of both bodies at the end of the path."""
    lower, upper = (body.elastic for body in structure.bodies)
    job = Job([lower, upper])
    job.hold(0, lower.boundary_nodes("end"))
    job.touch("joint", stiffness, FRICTION)
    job.load(1, cases @ [1.0, 0.0])
    for end, increments in TURNS:
        job.steps.append(Step(increments))
        job.load(1, cases @ [1.0, end])
    return job.run(folder).displacements


def test_forces_go_to_those_of_a_stiff_penalty(tmp_path):
    """Check that the difference at each node falls tenfold for ten times the stiffness.

    At the end of the path some nodes stick, some slide and some are open.
    """
    structure, cases = pressed()
    (face,), lower = structure.mesh.interfaces, structure.bodies[0].elastic
    joint = FrictionalJoint(structure.condense().resolvent(), FRICTION)
    state = list(joint.march(path(), structure.gap()))[-1]
    limit, shear = FRICTION * state.force[2], np.linalg.norm(state.force[:2], axis=0)
    open_ = limit < 1e-9 * limit.max()
    slides = ~open_ & (shear > (1.0 - 1e-6) * limit)
    assert (open_.sum(), slides.sum(), len(face)) == (4, 6, 25)
    ours = deformation(structure, state.force, state.displacement, path()[-1])
    forces, moved = [], []
    for stiffness in PENALTIES:
        found = by_calculix(tmp_path, structure, cases, stiffness)
        force = -(lower.stiffness @ found[0].ravel()).reshape(-1, 3)[face.nodes_1].T
        forces.append(np.abs(force - state.force).max() / state.force[2].max())
        pairs = zip(ours, found, strict=True)
        moved.append(max(np.abs(u - v.ravel()).max() / np.abs(u).max() for u, v in pairs))
    for differences, most in ((forces, 8e-4), (moved, 3e-4)):
        assert np.divide(differences[:-1], differences[1:]).min() > 7.0, differences
        assert differences[-1] < most, differences
