"""A dovetail's disk between its true neighbours: what they change, and what they cannot."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models import structure
from fe_models.dovetail import dovetail_cuts, dovetail_structure
from fe_models.elasticity.body import ElasticBody
from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import MeshError, StructureMesh, matched_interface
from fe_models.meshes.trace import LinearTrace
from fe_models.structure import Structure
from fe_models.supported_body import SupportedBody, interface_nodes
from sa_solver.types import Frame
from tests.fe_models.conftest import FLANK_NODES, NOTCH, SIZE
from tests.wheels import about, turned, wheel

MU = 0.4


BLADES = 9
SIDES = about(sectors=BLADES, low=("sides",), high=("sides",))


def ring_of(dovetail, mesh, material, sector, order):
    """Return the whole disk with all its blades, each loaded as that of a ``sector``."""
    part, blade = mesh.bodies
    disk = wheel(part, SIDES, ("intrados", "extrados"))
    blades = [turned(blade, SIDES, k) for k in range(BLADES)]
    bodies = (disk, *blades)
    interfaces = []
    for k, body in enumerate(blades):
        for name, side in (("intrados", 1), ("extrados", -1)):
            own = dovetail.flank_frame(side)
            turn = SIDES.turn(k)
            frame = Frame(turn @ own.origin, own.axes @ turn.T)
            face = matched_interface(f"{name}_{k}", disk, body, f"{name}_{k}", frame)
            gap = dovetail.flank_gap(*face.coordinates.T, side)
            interfaces.append(replace(face, gap=gap, bodies=(0, k + 1)))
    joined = StructureMesh(bodies, tuple(interfaces)).weighted(order)
    supported = []
    for number, body in enumerate(bodies):
        elastic = ElasticBody(body, material, order)
        constraints = Constraints(len(elastic.nodes), 2)
        loads = np.zeros((elastic.size, 1 + BLADES))
        loads[:, 0] = elastic.centrifugal_load()
        if number == 0:
            constraints.hold(elastic.boundary_nodes("inner"))
        else:
            turn = SIDES.turn(number - 1)[np.ix_((0, 2), (0, 2))]
            loads[:, [0, number]] = turned_loads(sector.bodies[1].loads, turn)
        faces = joined.faces_of(number)
        trace = LinearTrace.of(elastic, {i.name: i.nodes(side) for i, side in faces})
        placed = interface_nodes(faces, body)
        supported.append(SupportedBody(elastic, constraints, *placed, loads, trace=trace))
    return Structure(joined, tuple(supported))


def turned_loads(loads, turn):
    """Return forces ``(size, cases)`` rotated in the plane, node by node."""
    by_node = loads.reshape(-1, 2, loads.shape[1])
    return np.einsum("ab,nbc->nac", turn, by_node).reshape(loads.shape)


def test_contacts_are_those_of_the_whole_disk(dovetail, titanium, mission, monkeypatch):
    """Compare with all blades of a disk that is meshed whole, each under the moment."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-13)
    monkeypatch.setattr(structure, "CLOSED", -1.0)
    monkeypatch.setattr(structure, "MOST_CYCLES", 2)
    joint = replace(dovetail, blades=BLADES)
    mesh = joint.mesh((6, 6), 20.0, dimension=2, notch=8)
    amplitudes = mission.amplitudes()[3:16:3]
    part = dovetail_structure(joint, mesh, titanium, titanium, mission, 2, cyclic=True)
    ring = ring_of(joint, mesh, titanium, part, 2)
    every = amplitudes[:, [0, *[1] * BLADES]]
    histories = []
    for whole, path in ((part, amplitudes), (ring, every)):
        frictional = FrictionalJoint(whole.condense().resolvent(), MU)
        histories.append(whole.solve_cycle(frictional, path, whole.gap(), MU).histories)
    mine, theirs = histories
    size = max(np.abs(history.force).max() for history in mine)
    slid = max(np.abs(history.slip).max() for history in mine)
    assert slid > 0.0
    for k, history in enumerate(theirs):
        np.testing.assert_allclose(history.force, mine[k % 2].force, atol=1e-8 * size)
        np.testing.assert_allclose(history.slip, mine[k % 2].slip, atol=1e-7 * slid)


@pytest.fixture(scope="module")
def cycles(dovetail, titanium, mission):
    """Return the section's cycle with guided and with cyclic sides, under a moment."""

    def solve(moment, cyclic, order=2):
        load = replace(mission, aerodynamic_moment=moment)
        mesh = dovetail.mesh(FLANK_NODES, SIZE, dimension=2, notch=NOTCH)
        given = dovetail, mesh, titanium, titanium, load, order
        structure = dovetail_structure(*given, cyclic)
        joint = FrictionalJoint(structure.condense().resolvent(), MU)
        return structure.solve_cycle(joint, load.amplitudes(), structure.gap(), MU)

    return solve


@pytest.mark.parametrize("dimension", [2, 3])
def test_sides_are_images(dovetail, dimension):
    """Check that all nodes of the sides are images of each other."""
    mesh = dovetail.mesh(FLANK_NODES, SIZE, dimension=dimension, notch=NOTCH)
    disk = mesh.bodies[0]
    cuts = dovetail_cuts(dovetail, disk)
    assert cuts.matched
    assert cuts.max_distance < 1e-9
    assert len(cuts.low) + len(cuts.high) == len(disk.mesh.boundaries["sides"])


def test_neighbours_of_a_symmetric_joint_are_its_images(cycles, monkeypatch):
    """Check that without a moment guided and cyclic sides give the same result."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-12)
    guided, cyclic = (cycles(0.0, way) for way in (False, True))
    for one, two in zip(guided.histories, cyclic.histories, strict=True):
        np.testing.assert_allclose(one.force, two.force, atol=1e-9 * np.abs(one.force).max())


def test_neighbours_move_with_a_moment(cycles):
    """Check the small difference due to the force that a moment passes around the wheel."""
    guided, cyclic = (cycles(30e3, way) for way in (False, True))
    changes = [
        np.abs(one.loads.P - two.loads.P).max() / one.loads.P.max()
        for one, two in zip(guided.histories, cyclic.histories, strict=True)
    ]
    assert cyclic.equilibrium.max() < 1e-6
    assert 1e-5 < max(changes) < 0.02


def test_sides_of_a_skewed_slot(dovetail, titanium, mission):
    skewed = replace(dovetail, skew=0.1)
    mesh = skewed.mesh(FLANK_NODES, SIZE, notch=NOTCH)
    with pytest.raises(MeshError, match="not images of each other"):
        dovetail_structure(skewed, mesh, titanium, titanium, mission, 1, cyclic=True)
