"""Tightened bolts: compared with springs, the joint diagram, and balances."""

import numpy as np
import pytest
from skfem import MeshTet

from fe_models.elasticity.stress import cycle_stresses
from fe_models.imported_structure import Support
from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.loads.applied_loads import Pressure
from fe_models.loads.pretension import Bolt, Pretension, bolt_section, tightened
from fe_models.meshes.structure_mesh import Body, MeshError
from fe_models.motion import deformation
from sa_solver.types import Material
from tests.fe_models.joints.test_many_bodies import box, built, imported, pair
from tests.mirrored_blocks import along

STEEL = Material(200e3, 0.0, 7.8e-9)
UP = np.array([0.0, 0.0, 1.0])
# Height of the clamped block and of the frame's beams, and areas of the block and the rods.
HEIGHT, BEAM = 4.0, 2.0
BOLT = Pretension("frame", np.array([3.0, 0.5, 0.5 * HEIGHT + 0.1]), UP)


@pytest.fixture(autouse=True)
def precise(monkeypatch):
    monkeypatch.setattr(friction, "TOLERANCE", 1e-11)


def clamp(bars=(0.5, 0.5)):
    """Return a frame around a block: two rods of ``bars`` mm between stiff beams.

    It is a plane model of a bolt: rods and beams are one body, whose upper beam presses on the
    block.
    """
    x = along((0, bars[0], 1), (bars[0], 2.0, 2), (2.0, 4.0, 4), (4.0, 6.0 - bars[1], 2),
              (6.0 - bars[1], 6.0, 1))  # fmt: skip
    z = along((-BEAM, 0, 2), (0, HEIGHT, 6), (HEIGHT, HEIGHT + BEAM, 2))
    y = along((0, 1, 1))
    whole = MeshTet.init_tensor(x, y, z)
    middle = whole.p[:, whole.t].mean(axis=1)
    window = (middle[2] > 0) & (middle[2] < HEIGHT) & (middle[0] > bars[0])
    window &= middle[0] < 6.0 - bars[1]
    frame = whole.restrict(np.flatnonzero(~window))
    mesh = imported(block=box(along((2, 4, 4)), y, along((0, HEIGHT, 6))))
    faces = {
        "frame_under": frame.facets_satisfying(
            lambda p: np.isclose(p[2], 0.0) & (abs(p[0] - 3.0) < 1.0)
        ),
        "frame_over": frame.facets_satisfying(
            lambda p: np.isclose(p[2], HEIGHT) & (abs(p[0] - 3.0) < 1.0)
        ),
        "frame_foot": frame.facets_satisfying(lambda p: np.isclose(p[2], -BEAM)),
    }
    mesh.bodies["frame"] = Body("frame", frame.with_boundaries(faces))
    mesh.node_numbers["frame"] = np.arange(frame.nvertices)
    mesh.points["frame"] = {}
    return mesh


def clamped(loads=(), order=1, materials=None, support="xyz"):
    mesh = clamp()
    pairs = [pair("under", "frame_under", "block_z0"), pair("over", "block_z1", "frame_over")]
    every = [BOLT, *loads]
    structure = built(
        mesh, pairs, [Support("frame_foot", support)], every, order, materials or [STEEL, STEEL]
    )
    return structure, bolt_section(structure, BOLT)


def marched(structure, amplitudes, gap=None):
    joint = FrictionalJoint(structure.condense().resolvent(), 0.4)
    states = list(joint.march(np.atleast_2d(amplitudes), structure.gap() if gap is None else gap))
    assert all(state.converged for state in states)
    return states


def tensions(structure, section, states, amplitudes):
    resultants = np.stack([structure.interface_resultants(state) for state in states])
    return section.tension(resultants, np.atleast_2d(amplitudes))


@pytest.mark.parametrize("order", [1, 2])
def test_tension_is_what_the_faces_carry_and_the_rods_are_strained_by(order):
    structure, section = clamped(order=order)
    (state,) = states = marched(structure, [0.01])
    (tension,) = tensions(structure, section, states, [0.01])
    under, over = structure.interface_resultants(state)[:, 0]
    assert tension == pytest.approx(over, rel=1e-9)
    assert under == pytest.approx(over, rel=1e-9)
    assert structure.equilibrium_errors(states, np.array([[0.01]])).max() < 1e-9
    # Stress of both rods together, off their ends, over their areas of 0.5 mm² each.
    fields = state.force[None], state.displacement[None]
    (stress,) = cycle_stresses(structure, [fields], np.array([[0.01]]), 0)
    frame = stress.fields[1]
    points = frame.body.points
    rods = np.isclose(points[:, 2], HEIGHT / 2) | np.isclose(points[:, 2], HEIGHT / 3)
    assert rods.any()
    axial = frame.stress[2, rods].mean()
    assert axial * 1.0 == pytest.approx(tension, rel=0.02)


@pytest.mark.parametrize("place", [0.2, 0.5, 0.8])
def test_wherever_the_shank_is_cut(place):
    """Check that the tension and all displacements, except the shift, do not depend on the cut."""
    mesh = clamp()
    pairs = [pair("under", "frame_under", "block_z0"), pair("over", "block_z1", "frame_over")]
    through = np.array([3.0, 0.5, place * HEIGHT + 0.01])
    loads = [Pretension("frame", through, UP)]
    structure = built(mesh, pairs, [Support("frame_foot", "xyz")], loads, materials=[STEEL, STEEL])
    (state,) = marched(structure, [0.01])
    reference, _ = clamped()
    (other,) = marched(reference, [0.01])
    np.testing.assert_allclose(state.force, other.force, atol=1e-9 * np.abs(other.force).max())
    moved, same = (
        deformation(s, at.force, at.displacement, np.array([0.01]))
        for s, at in ((structure, state), (reference, other))
    )
    np.testing.assert_allclose(moved[0], same[0], atol=1e-10)


def test_joint_diagram():
    """Check F = δ k_b k_c / (k_b + k_c) for the frame as a spring k_b and k_c = E A / L.

    k_b is measured on the frame alone, pushed apart by the block's forces; a gap opened by wear h
    costs ΔF = h k_b k_c / (k_b + k_c).
    """
    structure, section = clamped()
    soft, same = clamped(materials=[Material(20.0, 0.0), STEEL])
    stiff = 200e3 * 2.0 / HEIGHT
    forces = {}
    for name, of, at in (("block", structure, section), ("soft", soft, same)):
        forces[name] = tensions(of, at, marched(of, [0.01]), [0.01])[0]
    compliance = 0.01 / forces["block"]
    # With a block of 20 MPa, the block takes nearly all of the shortening.
    assert forces["soft"] == pytest.approx(0.01 / (1 / 10.0 + compliance - 1 / stiff), rel=0.02)
    for worn in (1e-3, 2e-3):
        gap = structure.gap() + np.repeat([worn, 0.0], [len(i) for i in structure.mesh.interfaces])
        (left,) = tensions(structure, section, marched(structure, [0.01], gap), [0.01])
        lost = (forces["block"] - left) / (worn / compliance)
        assert lost == pytest.approx(1.0, rel=2e-3)


def test_bolts_are_shortened_until_they_have_their_force():
    structure, section = clamped()
    joint = FrictionalJoint(structure.condense().resolvent(), 0.4)
    path = np.linspace(0.25, 1.0, 4)[:, None]
    (shortening,) = tightened(structure, joint, path, [Bolt("rods", 0, section, 700.0)])
    states = marched(structure, shortening * path)
    reported = tensions(structure, section, states, shortening * path)
    assert reported[-1] == pytest.approx(700.0, rel=2e-6)
    np.testing.assert_allclose(reported, 700.0 * path[:, 0], rtol=1e-2)


def test_a_load_on_the_clamped_parts_divides_as_stiffness_says():
    """Check a pressure between the beams, of which the rods take a constant share.

    This holds while the block is clamped; then the rods carry all of it.
    """
    opening = [Pressure("frame_over", 1.0)]
    structure, section = clamped(opening)
    path = np.array([[0.01, 0.0], [0.01, 10.0], [0.01, 20.0], [0.01, 1e4]])
    states = marched(structure, path)
    reported = tensions(structure, section, states, path)
    pressed = np.array([structure.interface_resultants(s)[1, 0] for s in states])
    # The pressure acts on 2 mm²; the rods carry the block's remaining force and the pressure.
    np.testing.assert_allclose(reported, pressed + 2.0 * path[:, 1], rtol=1e-9)
    shares = np.diff(reported[:3]) / 20.0
    assert shares[0] == pytest.approx(shares[1], rel=2e-3)
    assert 0.0 < shares[0] < 1.0
    assert reported[3] == pytest.approx(2e4, rel=1e-6)


def test_cuts_that_cannot_be_are_refused():
    mesh = clamp()
    pairs = [pair("under", "frame_under", "block_z0"), pair("over", "block_z1", "frame_over")]
    held = [Support("frame_foot", "xyz")]
    far = Pretension("frame", np.array([0.0, 0.0, 50.0]), UP)
    with pytest.raises(MeshError, match="does not cut body frame"):
        built(mesh, pairs, held, [far], materials=[STEEL, STEEL])
    sideways = Pretension("frame", np.array([3.0, 0.5, 1.0]), np.array([1.0, 0.0, 0.0]))
    structure = built(mesh, pairs, held, [sideways], materials=[STEEL, STEEL])
    with pytest.raises(MeshError, match="goes through its contact face"):
        bolt_section(structure, sideways)
    held = [*held, Support("frame_over", "z")]
    structure = built(mesh, pairs[:1], held, [BOLT], materials=[STEEL, STEEL])
    with pytest.raises(MeshError, match="on both sides of the cut"):
        bolt_section(structure, BOLT)
