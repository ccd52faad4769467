"""A dovetail's disk between its true neighbours: what they change, and what they cannot."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models import friction
from fe_models.dovetail import dovetail_cuts, dovetail_structure
from fe_models.friction import FrictionalJoint
from fe_models.mesh import MeshError
from tests.fe_models.conftest import FLANK_NODES, NOTCH, SIZE

MU = 0.4


@pytest.fixture(scope="module")
def cycles(dovetail, titanium, mission):
    """The section's cycle with guided and with cyclic sides, under a moment."""

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
    """Node by node, and all of them."""
    mesh = dovetail.mesh(FLANK_NODES, SIZE, dimension=dimension, notch=NOTCH)
    disk = mesh.bodies[0]
    cuts = dovetail_cuts(dovetail, disk)
    assert cuts.matched
    assert cuts.apart < 1e-9
    assert len(cuts.low) + len(cuts.high) == len(disk.mesh.boundaries["sides"])


def test_neighbours_of_a_symmetric_joint_are_its_images(cycles, monkeypatch):
    """Without a moment the sides of the sector slide on their planes: both ways are the same."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-12)
    guided, cyclic = (cycles(0.0, way) for way in (False, True))
    for one, two in zip(guided.histories, cyclic.histories, strict=True):
        np.testing.assert_allclose(one.force, two.force, atol=1e-9 * np.abs(one.force).max())


def test_neighbours_move_with_a_moment(cycles):
    """The force that a moment puts into the disk goes on round the wheel: a small difference."""
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
    with pytest.raises(MeshError, match="no images of each other"):
        dovetail_structure(skewed, mesh, titanium, titanium, mission, 1, cyclic=True)
