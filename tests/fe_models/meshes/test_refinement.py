"""Influence of the mesh: resultants converge, edge peaks do not."""

import numpy as np
import pytest

from fe_models.dovetail import dovetail_structure
from fe_models.joints.friction import FrictionalJoint
from fe_models.notch_stress import face_tractions, notch_models
from tests.fe_models.conftest import stress_state

FRICTION, PEAK = 0.4, 7


def solve(dovetail, titanium, mission, flank_nodes, size, notch):
    """Return (P, Qx, Mx, My) per flank at the peak, the largest slip of a node, and stresses."""
    mesh = dovetail.mesh(flank_nodes, size, 3, notch, 2)
    structure = dovetail_structure(dovetail, mesh, titanium, titanium, mission, 2)
    frictional = FrictionalJoint(structure.condense().resolvent(), FRICTION)
    amplitudes = mission.amplitudes()
    cycle = structure.solve_cycle(frictional, amplitudes, structure.gap(), FRICTION)
    assert cycle.converged
    assert cycle.equilibrium.max() <= 1e-6
    loads = [
        [getattr(h.loads, name)[PEAK] for name in ("P", "Qx", "Mx", "My")] for h in cycle.histories
    ]
    slip = [np.linalg.norm(h.slip, axis=1).sum(axis=0).max() for h in cycle.histories]
    fields = stress_state(
        structure,
        np.concatenate([h.force[PEAK] for h in cycle.histories], axis=1),
        np.concatenate([h.displacement[PEAK] for h in cycle.histories], axis=1),
        amplitudes[PEAK],
    )
    return np.array(loads), np.array(slip), np.array([f.von_mises.max() for f in fields])


@pytest.mark.slow
def test_refined_mesh_moves_the_load_by_less_than_half_a_percent(dovetail, titanium, mission):
    """Compare 9 x 11 nodes per flank with 17 x 21 and the default of 21 x 27."""
    ladder = [((9, 11), 12.0, 16), ((17, 21), 10.0, 24), ((21, 27), 8.0, 24)]
    results = [solve(dovetail, titanium, mission, *mesh) for mesh in ladder]
    (_, coarse_slip, _), (middle, middle_slip, _), (fine, fine_slip, stress) = results
    for mesh, (loads, slip, peak) in zip(ladder, results, strict=True):
        print(mesh, "P, Qx, Mx, My", loads.round(1).tolist(), "slip [mm]", slip, "MPa", peak)  # noqa: T201
    np.testing.assert_allclose(middle[:, :2], fine[:, :2], rtol=5e-3)
    # Moments are small differences of large ones, so they are compared with P times the width.
    arm = fine[:, :1] * dovetail.flank_width
    assert np.all(np.abs(middle[:, 2:] - fine[:, 2:]) < 5e-3 * arm)
    np.testing.assert_allclose(middle_slip, fine_slip, rtol=5e-2)
    assert np.all(np.abs(fine_slip - middle_slip) < np.abs(fine_slip - coarse_slip))
    assert np.all(stress > 0.0)


def test_elements_of_second_order_are_better_on_the_same_nodes(dovetail, titanium, mission):
    """Check moments, slips and energies of the section against 121 nodes across the flank."""
    amplitudes = mission.amplitudes()

    def found(order, nodes, size):
        mesh = dovetail.mesh((nodes, 3), size, 2, 24, order)
        structure = dovetail_structure(dovetail, mesh, titanium, titanium, mission, order)
        joint = FrictionalJoint(structure.condense().resolvent(), FRICTION)
        cycle = structure.solve_cycle(joint, amplitudes, structure.gap(), FRICTION)
        slips = [np.hypot(*h.slip.transpose(1, 0, 2)).sum(axis=0).mean() for h in cycle.histories]
        moments = [h.loads.My[PEAK] for h in cycle.histories]
        return np.array([moments, slips, [h.loads.Edx.sum() for h in cycle.histories]])

    fine = found(2, 121, 4.0)
    off = np.abs(np.array([found(order, 21, 8.0) for order in (1, 2)]) - fine)
    errors = off.max(axis=-1) / np.abs(fine).max(axis=-1)
    # What is left is due to the contact, which ends between nodes.
    assert np.all(errors[1] < 0.6 * errors[0])
    assert np.all(errors[1] < 0.03)


@pytest.mark.slow
def test_stress_of_the_notches_is_near_that_of_a_fine_mesh(dovetail, titanium, symmetric):
    """Check in the plane that a significant estimated error is within a factor of three.

    That of local models is an upper bound, within a factor of two.
    """
    amplitudes = symmetric.amplitudes()

    mesh = dovetail.mesh((11, 2), dovetail.flank_width, 2, 24, growth=0.35, curved=True)
    section = dovetail_structure(dovetail, mesh, titanium, titanium, symmetric, 2)

    def local_models(structure, force):
        return notch_models(section, face_tractions(structure, force[None]), amplitudes[[PEAK]])

    def notches(flank_nodes, order, notch):
        mesh = dovetail.mesh((flank_nodes, 3), 5.0, 2, notch, order)
        structure = dovetail_structure(dovetail, mesh, titanium, titanium, symmetric, order)
        joint = FrictionalJoint(structure.condense().resolvent(), FRICTION)
        cycle = structure.solve_cycle(joint, amplitudes, structure.gap(), FRICTION)
        force, apart = (
            np.concatenate([getattr(h, name)[PEAK] for h in cycle.histories], axis=1)
            for name in ("force", "displacement")
        )
        stress = stress_state(structure, force, apart, amplitudes[PEAK])
        return [field.notch for field in stress], local_models(structure, force)

    fine = notches(241, 2, 400)[0]
    for settings, left in (((81, 2, 96), 0.01), ((41, 2, 96), 0.01), ((20, 1, 48), 0.08)):
        at_vertices, local = notches(*settings)
        for found, (model,), exact in zip(at_vertices, local, fine, strict=True):
            true = abs(model.largest[0] / exact.von_mises - 1.0)
            assert true < 0.006
            assert true < 2.0 * model.error < 0.03
            true = abs(found.von_mises / exact.von_mises - 1.0)
            assert true < left
            assert true / 3.0 < found.error < 3.0 * true or max(true, found.error) < 0.02
            assert np.linalg.norm(np.abs(found.place) - np.abs(exact.place)) < 0.5
