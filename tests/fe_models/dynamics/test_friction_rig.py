"""Two reduced specimens in the rig: masses, signs, and the stiffnesses of the parts alone."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models.dynamics.friction_rig import friction_rig
from fe_models.dynamics.rig import RigError, natural_frequencies, unit_force
from fe_models.geometry.specimens import Specimen
from fe_models.joints.reduced_contact import ReducedPair
from fe_models.specimens import pad_stiffness, reduced_specimens
from sa_solver.types import Material
from tests.oracles.two_mass_rig import two_mass_rig

SPECIMEN = Specimen(pad_elements=2, ring_nodes=4)
STEEL = Material(200e3, 0.3, density=7.8e-9)
MASSES, SPRINGS = (21.152e-3, 1.189e-3), (1.3469e3, 273e3)
MODES = 2
RIGID = 1e12


@pytest.fixture(scope="module")
def mesh():
    return SPECIMEN.mesh(3.0)


@pytest.fixture(scope="module")
def bodies(mesh):
    return reduced_specimens(
        SPECIMEN, mesh, (STEEL, STEEL), order=1, modes=MODES, target_distance=1.0
    )


@pytest.fixture(scope="module")
def rig(bodies):
    return friction_rig(*bodies, MASSES, SPRINGS, 1e-3)


def together(model, axis):
    """Return all displacements of a rig whose moving parts move as one along an axis."""
    return np.array(
        [name.endswith(f" {axis}") and not name.startswith("lower") for name in model.names]
    ).astype(float)


def test_its_displacements_are_those_of_both_specimens_and_the_masses(rig, bodies):
    kept = 3 * (9 + 1)
    assert len(rig.names) == 2 * (kept + MODES) + 3
    assert {"m1 x", "m2 x", "m2 z", "upper target 1 x", "lower pad 9 z"} <= set(rig.names)
    assert not any("ring" in name for name in rig.names)
    assert rig.connection.shape == (27, len(rig.names))


def test_targets_are_vertices_of_the_side_close_to_where_they_are_wanted(bodies, mesh):
    for body, part, side in zip(bodies, mesh.bodies, (-1.0, 1.0), strict=True):
        target = body.places[body.names.index("target 1 x")]
        boundary = part.mesh.p[:, part.mesh.boundary_nodes()].T
        away = np.linalg.norm(boundary - [4.0, 0.0, side], axis=1)
        assert np.linalg.norm(target - [4.0, 0.0, side]) == pytest.approx(away.min())
        np.testing.assert_allclose(target[:2], [4.0, 0.0], atol=1e-9)


def test_moved_as_one_it_has_the_mass_of_its_parts_and_only_the_leaf_spring(rig):
    """A rigid motion does not strain the upper specimen, whose mass is that of its volume."""
    volume = np.pi * SPECIMEN.diameter**2 / 4.0 * SPECIMEN.length
    for axis, masses in (("x", sum(MASSES)), ("z", MASSES[1])):
        motion = together(rig, axis)
        mass = motion @ rig.mass @ motion - masses
        # The cross-section is a polygon of a few edges, narrowed to its strip.
        assert mass == pytest.approx(STEEL.density * volume, rel=0.15)
    along = together(rig, "x")
    assert along @ rig.stiffness @ along == pytest.approx(SPRINGS[0], rel=1e-6)
    up = together(rig, "z")
    assert abs(up @ rig.stiffness @ up) < 1e-6 * SPRINGS[0]


def test_joints_close_as_the_upper_specimen_comes_down_and_slide_as_it_goes_along(rig):
    for axis, stretch in (("x", [1.0, 0.0, 0.0]), ("z", [0.0, 0.0, -1.0])):
        moved = (rig.connection @ together(rig, axis)).reshape(-1, 3)
        np.testing.assert_allclose(moved, np.tile(stretch, (9, 1)), atol=1e-12)


def test_open_it_is_the_rig_with_the_specimens_mass(rig, bodies):
    """The first frequency is that of the two masses, with the specimen (1 %) on the second."""
    motion = together(rig, "x")
    added = motion @ rig.mass @ motion - sum(MASSES)
    masses = MASSES[0], MASSES[1] + added
    wanted = natural_frequencies(two_mass_rig(masses, SPRINGS))
    frequencies = natural_frequencies(rig)
    assert abs(frequencies[0]) < 0.1
    np.testing.assert_allclose(frequencies[1:3], wanted, rtol=1e-3)


def test_tied_pads_are_as_stiff_as_the_reduced_pair(rig, bodies, mesh):
    """Statically, with m1 held, the stiffness is k2 plus that of the pair with its pads tied."""
    joint = RIGID * rig.connection.T @ rig.connection
    force = unit_force(rig, "m2 x")
    held = rig.stiffness + joint + RIGID * np.diag(unit_force(rig, "m1 x"))
    stiffness = 1.0 / (force @ np.linalg.solve(held, force))
    alone = reduced_specimens(SPECIMEN, mesh, (STEEL, STEEL), order=1, modes=MODES)
    pair = ReducedPair.from_stiffness(
        mesh.interfaces[0], *(pad_stiffness(body, SPECIMEN) for body in alone)
    )
    moved = np.tile([1.0, 0.0, 0.0], 9)
    tied = moved @ np.linalg.solve(pair.compliance.reshape(27, 27), moved)
    assert stiffness - SPRINGS[1] == pytest.approx(tied, rel=1e-5)


def test_specimens_that_do_not_match_are_refused(bodies):
    lower, upper = bodies
    with pytest.raises(RigError, match="no mass or no names"):
        friction_rig(replace(lower, mass=None), upper, MASSES, SPRINGS)
    with pytest.raises(RigError, match="no mass or no names"):
        friction_rig(lower, replace(upper, names=None), MASSES, SPRINGS)
    renamed = tuple(name.replace("pad 9 ", "corner 9 ") for name in upper.names)
    with pytest.raises(RigError, match="pads of 9 and 8 nodes"):
        friction_rig(lower, replace(upper, names=renamed), MASSES, SPRINGS)
