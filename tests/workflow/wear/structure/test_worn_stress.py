"""Tests of the stress of worn bodies, which is solved without a mesh of the worn faces."""

import numpy as np
import pytest

from fe_models.elasticity.stress import cycle_stresses
from tests.conftest import CASES
from workflow.analyses.wear.model import loads_of
from workflow.kinds import load_case

COARSE = (
    *("mesh={flank_nodes: [12, 10], size: 8 mm, order: 1}", "contact.grid=[64, 64]"),
    "load_path.increments=[3, 5]",
)
# Depth of both bodies together [mm].
DEPTH = 0.005


def test_a_mesh_of_the_worn_faces_has_the_same_stress():
    """Cycles on faces worn by 5 µm stress bodies that are meshed and factorised anew as much."""
    source = loads_of(load_case(CASES / "dovetail_2d.yaml", COARSE))
    each = []
    for interface in source.mesh.interfaces:
        x = interface.coordinates[:, 0]
        each.append(0.5 * DEPTH * (1.0 - (x / np.abs(x).max()) ** 2))
    cycle = source.worn_cycle([2.0 * depth for depth in each])
    worn = source.worn_mesh([(depth, depth) for depth in each])
    fields = cycle.fields()
    given = [(fields["force"], fields["displacement"])]
    anew = source.model.structure(worn)
    (remeshed,) = cycle_stresses(anew, given, source.model.load_cycles[0].amplitudes, source.peak)
    ours = source.stresses({"worn": cycle})["worn"]
    unworn = source.stresses({"unworn": source.unworn_cycle})["unworn"]
    for field, same, before in zip(ours.fields, remeshed.fields, unworn.fields, strict=True):
        largest = np.abs(same.stress).max()
        assert np.abs(same.body.points - field.body.points).max() > 0.2 * DEPTH
        assert np.abs(field.stress - same.stress).max() < 3e-3 * largest
        assert field.notch.von_mises == pytest.approx(same.notch.von_mises, rel=1e-3)
        # What wear does to the stress is much larger than that difference.
        assert np.abs(field.stress - before.stress).max() > 2e-2 * largest
    for ones, others in zip(ours.faces, remeshed.faces, strict=True):
        for one, other in zip(ones, others, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-3 * np.abs(other).max())
