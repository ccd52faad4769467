"""The dovetail under its mission: loads, equilibrium, and the laws of two-flank joints."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.meshes.remesh import element_volumes
from fe_models.structure import load_history
from sa_solver.load_history import LoadHistory
from tests.marks import slow

DEGREES = np.pi / 180.0
# The disk of the default case is too stout: at 60° the slot opens so little under speed that
# parts of the flanks never slide. A deep disk with few blades opens it more, a light airfoil
# closes the flanks less: every flank angle then slides as a whole.
COMPLIANT = {"disk_height": 200.0, "blades": 16, "airfoil_mass": 0.4e-3}
PEAK = 7

# Angles between the steepest and the flattest flanks are run by `make test-full`.
ANGLES = [35, *(slow(angle) for angle in (45, 55, 65))]


def pull(structure, amplitudes):
    """Return the total force on the blade along the load axis at every increment [N]."""
    axis = np.array([0.0, 0.0, 1.0])
    return np.array(
        [structure.bodies[1].load_resultants(a, 0.0 * axis)[0] @ axis for a in amplitudes]
    )


def test_speed_rises_and_falls(mission):
    speeds = mission.speeds() / mission.rotation_speed
    np.testing.assert_allclose(speeds[:8], np.arange(1, 9) / 8)
    np.testing.assert_allclose(speeds[7:], np.arange(14, -1, -1) / 14, atol=1e-15)
    amplitudes = mission.amplitudes()
    np.testing.assert_allclose(amplitudes[:, 0], mission.speeds() ** 2)
    np.testing.assert_allclose(amplitudes[:, 1], 30e3 * speeds**2)


def test_blade_carries_its_mass_the_airfoil_and_the_moment(structure, mission):
    """Check F = Ω² (ρ V r + m R), and the moment about and along the slot."""
    amplitudes = mission.amplitudes()[PEAK]
    mesh = structure.mesh.bodies[1].mesh
    moments = mesh.p[:, mesh.t].mean(axis=1) @ np.abs(element_volumes(mesh))
    force, moment = structure.bodies[1].load_resultants(amplitudes, np.zeros(3))
    expected = amplitudes[0] * (4.43e-9 * moments[2] + 0.8e-3 * 400.0)
    assert force[2] == pytest.approx(expected, rel=1e-10)
    np.testing.assert_allclose(force[:2], 0.0, atol=1e-9 * expected)
    # Pulling at X > 0 turns about -Y.
    np.testing.assert_allclose(moment, [0.0, -30e3, 0.0], atol=1e-8 * expected)


def test_moment_presses_on_the_intrados(solved, mission):
    intrados, extrados = (h.loads for h in solved(0.4, mission).histories)
    assert np.all(intrados.P[:8] > extrados.P[:8])


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.4, 0.8])
@pytest.mark.parametrize("angle", ANGLES)
def test_flanks_carry_the_pull(structure_of, solved, symmetric, angle, mu):
    """Check F = 2 (P sin θ - Qx cos θ) at every increment, the same on both flanks."""
    theta = angle * DEGREES
    structure, _ = structure_of(flank_angle=theta)
    cycle = solved(mu, symmetric, flank_angle=theta)
    assert cycle.converged
    force = pull(structure, symmetric.amplitudes())
    both = [h.loads for h in cycle.histories]
    total = sum(load.P * np.sin(theta) - load.Qx * np.cos(theta) for load in both)
    np.testing.assert_allclose(total, force, atol=1e-6 * force.max())
    for name in ("P", "Qx"):
        one, two = (getattr(load, name) for load in both)
        # The problems are mirror images, each solved to friction.TOLERANCE.
        np.testing.assert_allclose(one, two, atol=1e-6 * force.max())


def test_flanks_are_alike_to_the_last_digits(structure, joint, symmetric, monkeypatch):
    """Check both flanks on a mirrored mesh, which differ only by the solver's error."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-12)
    frictional = FrictionalJoint(joint.resolvent(), 0.4)
    cycle = structure.solve_cycle(frictional, symmetric.amplitudes(), structure.gap(), 0.4)
    assert cycle.converged
    intrados, extrados = (h.loads for h in cycle.histories)
    largest = intrados.P.max()
    for name, sign in (("P", 1), ("Qx", 1), ("Qy", -1), ("Mx", -1), ("My", 1), ("Mz", -1)):
        one, two = getattr(intrados, name), getattr(extrados, name)
        # The axis y has opposite directions on the two flanks.
        np.testing.assert_allclose(one, sign * two, atol=1e-9 * largest)
    for name in ("Edx", "Edy"):
        one, two = getattr(intrados, name), getattr(extrados, name)
        np.testing.assert_allclose(one, two, atol=1e-9 * one.max())


@pytest.mark.parametrize("mu", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("angle", [*(slow(angle) for angle in (40, 60)), 50])
def test_gross_slip_up_and_reversed(structure_of, solved, symmetric, angle, mu):
    """Check P = F / 2 (sin θ ± µ cos θ), with minus once the flanks slide back.

    The rest, well below 1 %, is friction along y: the flanks also lengthen along the slot.
    """
    theta = angle * DEGREES
    changes = COMPLIANT | {"flank_angle": theta}
    structure, _ = structure_of(**changes)
    cycle = solved(mu, symmetric, **changes)
    assert cycle.converged
    force = pull(structure, symmetric.amplitudes())
    sine, cosine = np.sin(theta), np.cos(theta)
    for history in cycle.histories:
        loads = history.loads
        assert loads.sliding[: PEAK + 1].all()
        rising = 0.5 * force[: PEAK + 1] / (sine + mu * cosine)
        np.testing.assert_allclose(loads.P[: PEAK + 1], rising, rtol=1e-2)
        assert np.all(loads.Qx[: PEAK + 1] < 0.0)
        # Past the peak it sticks: less shear than Coulomb allows, and P above that of sliding.
        assert not loads.sliding[PEAK + 1]
        assert abs(loads.Qx[PEAK + 1]) < 0.95 * mu * loads.P[PEAK + 1]
        assert loads.P[PEAK + 1] > 1.01 * 0.5 * force[PEAK + 1] / (sine + mu * cosine)
        # Only the rims of the flanks still creep.
        assert loads.Edx[PEAK + 1] < 0.2 * loads.Edx[PEAK]
        # The last loaded increment slides back.
        assert loads.sliding[-2]
        assert loads.Qx[-2] > 0.0
        falling = 0.5 * force[-2] / (sine - mu * cosine)
        assert loads.P[-2] == pytest.approx(falling, rel=1e-2)


def test_self_locking_joint_stays_loaded(structure_of, solved, symmetric):
    """Check that with tan 35° < 0.8 the blade stays locked by friction without pull."""
    changes = {"flank_angle": 35.0 * DEGREES}
    cycle = solved(0.8, symmetric, **changes)
    assert cycle.converged
    loads = cycle.histories[0].loads
    assert loads.P[-1] > 0.1 * loads.P.max()
    # The remaining forces are in balance: P sin θ = Qx cos θ.
    assert loads.Qx[-1] == pytest.approx(loads.P[-1] * np.tan(35.0 * DEGREES), rel=1e-5)


def test_unloaded_end_leaves_nothing(solved, mission):
    """Check that at rest the flanks carry exactly nothing, not even solver errors."""
    for history in solved(0.4, mission).histories:
        for name in ("P", "Qx", "Qy", "Mx", "My", "Mz"):
            assert getattr(history.loads, name)[-1] == 0.0
        assert not history.loads.sliding[-1]


def test_energy_is_never_negative_and_adds_up(solved, mission):
    """Compare energies with the work of the shears over the slips at each node.

    In total, the mean pressure of both ends gives a little less while the load grows, and more
    while it falls.
    """
    for history in solved(0.4, mission).histories:
        total = history.loads.Edx + history.loads.Edy
        assert total.min() >= 0.0
        nodal = -np.sum(history.force[:, :2] * history.slip, axis=1)
        assert nodal.min() >= -1e-9 * nodal.max()
        pressing = history.force[:, 2] + np.roll(history.force[:, 2], 1, axis=0)
        slid = np.hypot(history.slip[:, 0], history.slip[:, 1])
        lost = 0.5 * 0.4 * np.sum(pressing * slid, axis=1)
        np.testing.assert_allclose(total[:-1], lost[:-1], rtol=1e-12)
        assert total[-1] == 0.0  # The bodies separate.
        slides = total > 0.0
        more = slides & (np.roll(history.loads.P, 1) < history.loads.P)
        assert (total[more] < nodal.sum(axis=1)[more]).all()
        assert (total[slides & ~more] > nodal.sum(axis=1)[slides & ~more]).all()


def test_frictionless_joint_dissipates_nothing(structure, solved, symmetric):
    cycle = solved(0.0, symmetric)
    force = pull(structure, symmetric.amplitudes())
    for history in cycle.histories:
        np.testing.assert_allclose(history.loads.Edx, 0.0, atol=1e-9)
        np.testing.assert_allclose(history.loads.Qx, 0.0, atol=1e-9)
        # Without friction P depends on the load alone, rising or falling.
        expected = 0.5 * force / np.sin(45.0 * DEGREES)
        np.testing.assert_allclose(history.loads.P, expected, atol=1e-6 * expected.max())


def test_resultants_are_those_of_the_forces(structure, solved, mission):
    """Compare moments about the face's centre with cross products in space."""
    for history in solved(0.4, mission).histories:
        face = history.interface
        at = structure.mesh.bodies[1].mesh.p[:, face.nodes_2].T - face.frame.origin
        forces = face.frame.to_global(history.force[PEAK].T)
        moment = face.frame.components(np.cross(at, forces).sum(axis=0))
        force = face.frame.components(forces.sum(axis=0))
        loads = history.loads
        # By the sign convention Mx, My are moments of the pressure, those of r × f.
        expected = [loads.Qx[PEAK], loads.Qy[PEAK], loads.P[PEAK]]
        np.testing.assert_allclose(force, expected, rtol=1e-9)
        expected = [loads.Mx[PEAK], loads.My[PEAK], loads.Mz[PEAK]]
        np.testing.assert_allclose(moment, expected, atol=1e-7 * np.abs(moment).max())


def test_equilibrium_error_sees_a_wrong_force(structure, joint, mission):
    """Check that 1 % more pressure on all nodes is about 1 % of imbalance."""
    frictional = FrictionalJoint(joint.resolvent(), 0.4)
    amplitudes = mission.amplitudes()
    state = list(frictional.march(amplitudes[:8], structure.gap()))[-1]

    def error(force):
        states = [replace(state, force=force)]
        return structure.equilibrium_errors(states, amplitudes[PEAK : PEAK + 1])[0]

    applied = np.linalg.norm(structure.bodies[1].load_resultants(amplitudes[PEAK], np.zeros(3))[0])
    scale = applied + np.abs(state.force).sum()
    assert error(state.force) < 1e-6
    assert error(1.01 * state.force) * scale == pytest.approx(0.01 * applied, rel=2e-2)
    # Opposite changes at both ends of a flank: no force, but a moment.
    turned = state.force.copy()
    ends = structure.mesh.interfaces[0].coordinates[:, 1].argsort()[[0, -1]]
    turned[2, ends] += [-1000.0, 1000.0]
    assert error(turned) * scale > 500.0


def test_skewed_joint(structure_of, solved, symmetric):
    """Check a slot turned by 15°, which half a turn about the load axis maps to itself.

    The mesh is not exactly symmetric, so the flanks agree up to discretisation.
    """
    changes = {"skew": 15.0 * DEGREES}
    cycle = solved(0.4, symmetric, **changes)
    assert cycle.converged
    assert cycle.equilibrium.max() <= 1e-6
    intrados, extrados = (h.loads for h in cycle.histories)
    for name in ("P", "Qx", "Qy"):
        one, two = getattr(intrados, name), getattr(extrados, name)
        np.testing.assert_allclose(one, two, atol=1e-2 * intrados.P.max())


def test_load_history_of_one_node(coarse_mesh):
    """Check that with all load on one node the moments are coordinates times pressure.

    The pressure rises linearly from zero while the node slides; nothing is counted while the bodies
    are apart.
    """
    face = coarse_mesh.interfaces[0]
    force, slip = np.zeros((2, 3, len(face))), np.zeros((2, 2, len(face)))
    node = 17
    force[0, :, node] = [-4.0, 3.0, 10.0]
    slip[:, :, node] = [0.8e-3, -0.6e-3]
    loads = load_history(face, force, slip, 0.5)
    x, y = face.coordinates[node]
    assert isinstance(loads, LoadHistory)
    resultants = [getattr(loads, name)[0] for name in ("P", "Qx", "Qy", "Mx", "My", "Mz")]
    expected = [10.0, -4.0, 3.0, 10.0 * y, -10.0 * x, 3.0 * x + 4.0 * y]
    np.testing.assert_allclose(resultants, expected)
    np.testing.assert_allclose([loads.Edx, loads.Edy], [[1.6e-3, 0.0], [0.9e-3, 0.0]])
    assert loads.sliding.tolist() == [True, False]
    assert not load_history(face, force, slip, 0.6).sliding[0]
