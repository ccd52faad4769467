"""The dovetail at peak load with finite displacements, and the linear models that follow it."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fe_models.dovetail import dovetail_softening, dovetail_structure
from fe_models.elasticity import nonlinear
from fe_models.elasticity.nonlinear import check_nonlinearity, face_sizes, slip_change
from fe_models.elasticity.relinearised import mean_rotation, relinearised, stress_stiffened
from fe_models.elasticity.total_lagrangian import TotalLagrangian
from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.motion import deformation
from fe_models.structure import Structure
from fe_models.supported_body import SupportedBody
from sa_solver.types import resultant_change

MU, PEAK = 0.4, 7


class Peak:
    """Structure at peak load, all that its checks need, and their results."""

    def __init__(self, structure, joint, dovetail, mission, share=1.0):
        """Solve at a ``share`` of the peak load."""
        self.structure, self.like = structure, joint.resolvent()
        self.amplitudes = share * mission.amplitudes()[PEAK]
        slower = replace(mission, rotation_speed=np.sqrt(share) * mission.rotation_speed)
        self.softening = dovetail_softening(structure, dovetail, slower)
        (self.linear,) = self.march(self.like)
        self.deformed = deformation(
            structure, self.linear.force, self.linear.displacement, self.amplitudes
        )

    def check(self):
        gap = self.structure.gap()
        return check_nonlinearity(
            self.structure, self.like, MU, self.amplitudes, gap, self.softening
        )

    def march(self, joint):
        return FrictionalJoint(joint, MU).march(self.amplitudes[None], self.structure.gap())

    def stressed(self):
        return stress_stiffened(self.structure, self.deformed, self.amplitudes, self.softening)

    def left(self, model, check):
        """Return the errors of a linear model's resultants and slips against the nonlinear ones."""
        (state,) = self.march(model.condense(self.like).resolvent())
        resultants = model.interface_resultants(state)
        change = resultant_change(resultants, check.nonlinear, face_sizes(self.structure))
        return np.abs(change).max(), slip_change(state.slip, check.slip)


@pytest.fixture(scope="module", autouse=True)
def _exact_friction():
    """Solve friction exactly, so that only the error of Newton's method remains."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "TOLERANCE", 1e-10)
        yield


@pytest.fixture(scope="module")
def coarse(dovetail, titanium, mission):
    """Return structure and joint with half the elements of other tests, to condense quickly."""
    mesh = dovetail.mesh((6, 6), 15.0)
    structure = dovetail_structure(dovetail, mesh, titanium, titanium, mission, 1)
    return structure, structure.condense()


@pytest.fixture(scope="module")
def peak(coarse, dovetail, mission):
    return Peak(*coarse, dovetail, mission)


@pytest.fixture(scope="module")
def check(peak):
    """Check with one more iteration than a run needs."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nonlinear, "TOLERANCE", 1e-8)
        return peak.check()


def test_newton_converges(peak, check):
    """Check two iterations to the tolerance; then the delayed frames set the rate."""
    first = peak.check()
    assert first.converged
    assert first.iterations == 2
    assert first.residual < nonlinear.TOLERANCE
    assert check.converged
    assert check.iterations <= 4
    assert check.residual < 1e-8
    np.testing.assert_allclose(first.change, check.change, atol=20.0 * nonlinear.TOLERANCE)


@pytest.fixture(scope="module")
def tangent(peak, check):
    """Return the structure tangent to the nonlinear state, and its state at peak."""
    model = relinearised(peak.structure, check.displacements, peak.amplitudes, peak.softening)
    (state,) = peak.march(model.condense(peak.like).resolvent())
    return model, state


def nodal_balance(peak, number, displacement):
    """Return internal less external forces ``(n, 3)`` of a body, without those of contact."""
    body = peak.structure.bodies[number - 1]
    force = TotalLagrangian(body.elastic).internal_force(displacement)
    force -= body.loads @ peak.amplitudes + peak.softening[number - 1] @ displacement
    return force.reshape(-1, 3)


def test_every_node_is_balanced(peak, check, tangent):
    """Check nonlinear inner forces, contact forces in the turned frames, spin and loads.

    Supported nodes are excepted: held and guided ones of the disk, and along the slot the bottom of
    the root.
    """
    model, state = tangent
    faces = model.mesh.interfaces
    shares = np.split(state.force, np.cumsum([len(i) for i in faces])[:-1], axis=1)
    balances = [nodal_balance(peak, k, u) for k, u in zip((1, 2), check.displacements, strict=True)]
    scale = np.abs(state.force).max()
    for face, force in zip(faces, shares, strict=True):
        # Body 2 receives the forces, body 1 their opposites.
        balances[1][face.nodes_2] -= face.frame.to_global(force.T)
        balances[0][face.nodes_1] += face.frame.to_global(force.T)
    disk, blade = model.bodies[0].elastic, model.bodies[1].elastic
    supported = [disk.boundary_nodes(name) for name in ("inner", "sides")]
    inside = np.delete(balances[0], np.concatenate(supported), axis=0)
    np.testing.assert_allclose(inside, 0.0, atol=1e-5 * scale)
    balances[1][blade.boundary_nodes("root_bottom"), 1] = 0.0
    np.testing.assert_allclose(balances[1], 0.0, atol=1e-5 * scale)


def test_contact_is_met_on_the_displaced_faces(peak, check, tangent):
    """Compare displacements of both bodies, in the turned frames, with the contact law."""
    model, state = tangent
    disk, blade = (u.reshape(-1, 3) for u in check.displacements)
    relative = np.concatenate(
        [i.frame.components(blade[i.nodes_2] - disk[i.nodes_1]) for i in model.mesh.interfaces]
    )
    scale = np.abs(state.displacement).max()
    np.testing.assert_allclose(relative.T, state.displacement, atol=1e-5 * scale)
    gap = peak.structure.gap() + relative[:, 2]
    assert gap.min() > -1e-5 * scale
    pressed = state.force[2] > 1e-6 * state.force[2].max()
    assert np.abs(gap[pressed]).max() < 1e-5 * scale


def test_load_in_gross_slip(coarse, dovetail, symmetric):
    """Check P by the closed form for flanks turned by φ under a pull grown by δF.

    F = 2 P (sin θ + µ cos θ): δP/P = δF/F + φ (cos θ - µ sin θ) / (sin θ + µ cos θ), θ falling by φ
    where the lugs open. A few nodes stick and bear a little more.
    """
    peak = Peak(*coarse, dovetail, symmetric)
    check = peak.check()
    blade = peak.structure.bodies[1]
    pull = blade.load_resultants(peak.amplitudes, np.zeros(3))[0][2]
    growth = (peak.softening[1] @ check.displacements[1]).reshape(-1, 3)[:, 2].sum() / pull
    theta = dovetail.flank_angle
    slope = (np.cos(theta) - MU * np.sin(theta)) / (np.sin(theta) + MU * np.cos(theta))
    change = check.nonlinear[:, 0] / check.linear[:, 0] - 1.0
    np.testing.assert_allclose(change, growth + slope * check.face_rotation, rtol=0.02)
    np.testing.assert_allclose(change, check.change[:, 0])


def test_small_strains_small_changes(check):
    """Check that strains and rotations of 0.5 % change nothing by more than 1 %."""
    assert 1e-3 < check.largest_strain < 1e-2
    assert 1e-3 < check.largest_rotation < 1e-2
    assert 1e-3 < np.abs(check.change).max() < 1e-2


def test_changes_vanish_with_the_load(check, coarse, dovetail, mission):
    """Check that changes relative to the linear model are of first order in the load."""
    small = Peak(*coarse, dovetail, mission, share=0.01).check()
    assert small.converged
    assert np.abs(small.change).max() < 0.05 * np.abs(check.change).max()


def test_flanks_stay_alike(coarse, dovetail, symmetric):
    one, two = Peak(*coarse, dovetail, symmetric).check().nonlinear
    np.testing.assert_allclose(one[:2], two[:2], rtol=1e-7)


def test_relinearised_at_the_nonlinear_state_is_there(peak, check, tangent):
    """Check that the tangent structure passes through the state that it is tangent to."""
    resultants, slips = peak.left(tangent[0], check)
    assert resultants < 1e-6
    assert slips < 1e-6


def test_how_far_linear_models_get(peak, check):
    """Check that one re-linearisation leaves at most a twentieth of the nonlinear change.

    Stress stiffness and spin softening alone leave most of the change of P, which comes from the
    turned flanks.
    """
    once = relinearised(peak.structure, peak.deformed, peak.amplitudes, peak.softening)
    resultants, slips = peak.left(once, check)
    assert resultants < 0.05 * np.abs(check.change).max()
    assert slips < 0.05 * check.slip_change
    stressed = peak.stressed()
    resultants, slips = peak.left(stressed, check)
    assert resultants > 0.3 * np.abs(check.change).max()
    assert slips < check.slip_change


@pytest.mark.parametrize(("kind", "balance"), [("relinearised", 1e-6), ("stressed", 1e-5)])
def test_mission_of_a_prestressed_structure(kind, balance, peak, tangent, mission):
    """Check the balance down to no load, with the stiffness forces of rigid motions as loads.

    The stressed structure takes these at displacements of the linear one, which differ by 1 %.
    """
    model = tangent[0] if kind == "relinearised" else peak.stressed()
    joint = FrictionalJoint(model.condense_path(peak.like), MU)
    path = mission.amplitudes()
    states = list(joint.march(path, peak.structure.gap()))
    assert all(state.converged for state in states)
    assert model.equilibrium_errors(states, path).max() < balance
    largest = np.abs(states[PEAK].force).max()
    assert np.abs(states[-1].force).max() < 1e-6 * largest
    plain = Structure(model.mesh, model.bodies)
    assert plain.equilibrium_errors(states, path)[PEAK] > 1e-4


def test_supported_body_keeps_its_stiffness(peak, tangent, monkeypatch):
    """Check that a supported body 2 has no rigid motion to be released."""
    monkeypatch.setattr(SupportedBody, "free_motions", lambda *_: np.zeros((0, 6)))
    path, exact = (tangent[0].condense_path(peak.like), tangent[0].condense(peak.like).resolvent())
    np.testing.assert_allclose(path.inverse, exact.inverse, rtol=1e-12)
    np.testing.assert_allclose(path.loads, exact.loads, rtol=1e-12)


def test_path_goes_through_the_peak(peak, check, tangent):
    """Check that rigid motions as loads or as stiffness agree at the load of both."""
    model, state = tangent
    (reached,) = peak.march(model.condense_path(peak.like))
    scale = np.abs(state.force).max()
    np.testing.assert_allclose(reached.force, state.force, atol=1e-6 * scale)


@pytest.mark.slow
def test_half_the_load(peak, check, tangent, coarse, dovetail, mission):
    """Check the relative change of P at half the peak load, half as large as at peak.

    With the stiffness of the peak it is as large as there. A few nodes that stick at only one of
    the loads are tolerated.
    """
    half = Peak(*coarse, dovetail, mission, share=0.5)
    exact = half.check()
    np.testing.assert_allclose(exact.change[:, 0], 0.5 * check.change[:, 0], rtol=0.05)
    (state,) = half.march(tangent[0].condense_path(peak.like))
    resultants = tangent[0].interface_resultants(state)
    change = resultant_change(resultants, exact.linear, face_sizes(half.structure))[:, 0]
    np.testing.assert_allclose(change, check.change[:, 0], rtol=0.05)


def test_order_and_units_of_load_cases_do_not_matter(peak):
    """Check that the share depends on the forces, not on the amplitudes' units."""
    amplitudes, units = peak.amplitudes + np.array([0.0, 3e4]), np.array([1e-6, 1e3])
    other = tuple(map(copy, peak.structure.bodies))
    for body in other:
        body.loads = (body.loads / units)[:, ::-1]
    swapped = Structure(peak.structure.mesh, other)
    one = relinearised(peak.structure, peak.deformed, amplitudes, peak.softening)
    two = relinearised(swapped, peak.deformed, (amplitudes * units)[::-1], peak.softening)
    np.testing.assert_allclose(two.share, (one.share / units)[::-1], rtol=1e-10)
    assert one.share @ amplitudes == pytest.approx(1.0, rel=1e-12)
    assert one.share @ (amplitudes * [1.0, -1.0]) > 0.9  # the centrifugal force is most of it


def test_without_load_there_is_nothing_to_linearise_at(peak):
    with pytest.raises(ValueError, match="all amplitudes are zero"):
        relinearised(peak.structure, peak.deformed, 0.0 * peak.amplitudes, peak.softening)


def test_plane_dovetail(dovetail, titanium, mission, check):
    """Compare P of the section in plane strain with that of the slot's length."""
    mesh = dovetail.mesh((12, 2), 6.0, 2)
    structure = dovetail_structure(dovetail, mesh, titanium, titanium, mission, 2)
    section = Peak(structure, structure.condense(), dovetail, mission).check()
    assert section.converged
    np.testing.assert_allclose(section.change[:, 0], check.change[:, 0], rtol=0.3)


@pytest.mark.parametrize("dimension", [2, 3])
def test_mean_rotation(dimension):
    """Check points of a plane, or on a line, rotated and slightly disturbed."""
    rng = np.random.default_rng(0)
    points = rng.standard_normal((30, dimension))
    points[:, -1] = 0.0
    rotation = Rotation.from_rotvec([0.0, 0.0, 0.4] if dimension == 2 else [0.3, 0.2, -0.5])
    matrix = rotation.as_matrix()[:dimension, :dimension]
    weights = rng.random(30)
    mean = mean_rotation(points, points @ matrix.T + 2.0, weights)
    np.testing.assert_allclose(mean, matrix, atol=1e-12)
    blurred = points @ matrix.T + 1e-3 * rng.standard_normal(points.shape)
    mean = mean_rotation(points, blurred, weights)
    np.testing.assert_allclose(mean, matrix, atol=3e-3)
    np.testing.assert_allclose(mean @ mean.T, np.eye(dimension), atol=1e-12)
    assert np.linalg.det(mean) == pytest.approx(1.0)


def test_open_face_is_measured_by_the_loaded_one(coarse):
    structure, _ = coarse
    then = np.array([[0.0] * 6, [100.0] + [0.0] * 5])
    now = then + 1.0
    change = resultant_change(now, then, face_sizes(structure))
    np.testing.assert_allclose(change[0], change[1])
    np.testing.assert_allclose(change[:, :3], 0.01)
    half = 0.5 * np.ptp(structure.mesh.interfaces[0].coordinates, axis=0)
    np.testing.assert_allclose(change[0, 3:], 0.01 / np.array([half[1], half[0], half.max()]))


def test_slip_change():
    slip = np.array([[3.0, 0.0], [4.0, 1.0]])
    moved = np.array([[3.3, 0.0], [4.4, 1.0]])
    assert slip_change(moved, slip) == pytest.approx(0.1)
    assert slip_change(slip, 0.0 * slip) == pytest.approx(5.0)
