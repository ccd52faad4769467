"""Plane structures: compared with slices of space, closed forms of two flanks, and transfer."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import MeshTet, MeshTri

from fe_models.dovetail import dovetail_structure
from fe_models.elasticity.body import ElasticBody
from fe_models.joints.friction import FrictionalJoint
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import Body, MeshError
from fe_models.meshes.transfer import FaceTransfer
from sa_solver.types import Grid, Material

ORDERS = [1, 2]
DEPTH = 0.7
PEAK = 7
# Nodes across each flank, and element size far from it; the laws hold on any mesh.
NODES, SIZE = 12, 8.0


# --- One body --------------------------------------------------------------------------------


def section():
    """Return triangles of 1 x 2 with inner vertices moved, away from the origin."""
    mesh = MeshTri.init_tensor(np.linspace(3.0, 4.0, 4), np.linspace(5.0, 7.0, 5))
    points = mesh.p.copy()
    inner = np.setdiff1d(np.arange(mesh.nvertices), mesh.boundary_nodes())
    points[:, inner] += np.random.default_rng(0).uniform(-0.08, 0.08, (2, len(inner)))
    sides = {"top": lambda x: np.isclose(x[1], 7.0), "right": lambda x: np.isclose(x[0], 4.0)}
    return MeshTri(points, mesh.t).with_boundaries(sides)


def slice_of(mesh):
    """Return one layer of tetrahedra over the triangles, from Y = 0 to ``DEPTH``."""
    low = np.insert(mesh.p, 1, 0.0, axis=0)
    points = np.hstack([low, low + np.array([[0.0], [DEPTH], [0.0]])])
    # Split by rising vertex numbers, so that neighbours share their diagonals.
    a, b, c = np.sort(mesh.t, axis=0)
    up = mesh.nvertices
    cells = np.hstack([[a, b, c, c + up], [a, b, b + up, c + up], [a, a + up, b + up, c + up]])
    sides = {"top": lambda x: np.isclose(x[2], 7.0), "right": lambda x: np.isclose(x[0], 4.0)}
    return MeshTet(points, cells).with_boundaries(sides)


@pytest.fixture(params=ORDERS)
def pair(request, titanium):
    """Return a plane body, its slice, and the map from plane displacements to the slice's.

    Displacements are constant along Y and zero in its direction: every node of the slice moves as
    that of the plane with its X and Z.
    """
    plane = ElasticBody(Body("plane", section()), titanium, request.param)
    solid = ElasticBody(Body("slice", slice_of(section())), titanium, request.param)
    apart = np.linalg.norm((solid.nodes[:, None] - plane.nodes)[..., [0, 2]], axis=2)
    twin = apart.argmin(axis=1)
    assert apart.min(axis=1).max() < 1e-12
    rows = 3 * np.arange(len(twin))
    places = np.append(rows, rows + 2), np.append(2 * twin, 2 * twin + 1)
    shape = solid.size, plane.size
    return plane, solid, sp.csr_matrix((np.ones(2 * len(twin)), places), shape=shape)


@pytest.mark.parametrize("matrix", ["stiffness", "mass"])
def test_plane_is_a_slice_that_cannot_lengthen(pair, matrix):
    plane, solid, motion = pair
    in_plane, other = (getattr(elastic, matrix).toarray() for elastic in (plane, solid))
    restricted = motion.T @ other @ motion
    np.testing.assert_allclose(DEPTH * in_plane, restricted, atol=1e-12 * np.abs(restricted).max())


def test_loads_are_those_of_the_slice_per_length(pair):
    plane, solid, motion = pair
    size, sense = (lambda x: x[0] * x[2]), np.array([0.6, 0.0, 0.8])
    loads = [
        (elastic.centrifugal_load(), elastic.traction_load("top", size, sense))
        for elastic in (plane, solid)
    ]
    for in_plane, other in zip(*loads, strict=True):
        restricted = motion.T @ other
        np.testing.assert_allclose(
            DEPTH * in_plane, restricted, atol=1e-12 * np.abs(restricted).max()
        )


def test_stress_is_that_of_the_slice(pair, titanium):
    """Check that the stress out of the plane is ν (σxx + σzz), as lengths along Y are fixed."""
    plane, solid, motion = pair
    u = np.random.default_rng(1).standard_normal(plane.size)
    stress = plane.stress(u)
    scale = np.abs(stress).max()
    xx, yy, zz, xy, yz, zx = stress
    np.testing.assert_allclose(yy, titanium.poisson * (xx + zz), atol=1e-12 * scale)
    assert not np.any([xy, yz])
    assert zx.any()
    # Three tetrahedra stand on each triangle; those of order 2 hold different parts of its strain.
    volumes = np.abs(element_volumes(solid.body.mesh)).reshape(3, -1)
    sums = np.sum(solid.stress(motion @ u).reshape(6, 3, -1) * volumes, axis=1)
    means = sums / volumes.sum(axis=0)
    np.testing.assert_allclose(means, stress, atol=1e-11 * scale)


def test_a_spinning_plane_pulls_with_its_mass(pair, titanium):
    """Check ρ A (X, Z) of the centre per ω² and length, without moment about the axis."""
    plane, _, _ = pair
    mesh = plane.body.mesh
    areas = np.abs(element_volumes(mesh))
    assert areas.sum() == pytest.approx(2.0, rel=1e-12)
    expected = titanium.density * mesh.p[:, mesh.t].mean(axis=1) @ areas
    load = plane.centrifugal_load().reshape(-1, 2)
    np.testing.assert_allclose(load.sum(axis=0), expected, rtol=1e-12)
    # A radial force has no moment about the axis.
    x, _, z = plane.nodes.T
    turning = np.sum(x * load[:, 1] - z * load[:, 0])
    assert abs(turning) < 1e-12 * np.linalg.norm(expected) * 7.0
    translation = np.tile([1.0, 0.0], len(plane.nodes))
    mass = translation @ plane.mass @ translation
    assert mass == pytest.approx(2.0 * titanium.density, rel=1e-12)


def test_midsides_lie_between_the_ends_of_their_edges(pair):
    plane, _, _ = pair
    middle, parents = plane.midsides("right")
    assert len(middle) == (4 if plane.order == 2 else 0)
    np.testing.assert_allclose(plane.nodes[middle], plane.nodes[parents].mean(axis=1), atol=1e-14)
    nodes, normals = plane.boundary_normals("right")
    np.testing.assert_allclose(normals, np.tile([1.0, 0.0], (len(nodes), 1)), atol=1e-14)


# --- Dovetail --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def plane_cycle(dovetail, titanium):
    """Return structure and closed cycle of a plane dovetail with some fields changed."""

    @cache
    def solve(mission, friction=0.4, order=1, **changes):
        changed = replace(dovetail, **changes)
        mesh = changed.mesh((NODES, 2), SIZE, 2)
        structure = dovetail_structure(changed, mesh, titanium, titanium, mission, order)
        joint = FrictionalJoint(structure.condense().resolvent(), friction)
        cycle = structure.solve_cycle(joint, mission.amplitudes(), structure.gap(), friction)
        assert cycle.converged
        return structure, cycle

    return solve


def pull(structure, amplitudes):
    """Return the pull on the blade at every increment [N/mm]."""
    return np.array([structure.bodies[1].load_resultants(a, np.zeros(3))[0, 2] for a in amplitudes])


@pytest.mark.slow
def test_pull_is_that_of_the_whole_blade_per_length(dovetail, structure_of, plane_cycle, mission):
    """Check F = Ω² (ρ A Z + m R / L), with a section's share of the airfoil and the moment."""
    structure, _ = plane_cycle(mission)
    per_length = structure.bodies[1].load_resultants(mission.amplitudes()[PEAK], np.zeros(3))
    # Sections have the same size along the flank on any mesh; fillets differ slightly.
    whole = structure_of()[0].bodies[1].load_resultants(mission.amplitudes()[PEAK], np.zeros(3))
    assert dovetail.slot_length * per_length[0, 2] == pytest.approx(whole[0, 2], rel=1e-4)
    np.testing.assert_allclose(
        dovetail.slot_length * per_length[1], whole[1], atol=1e-9 * whole[0, 2]
    )


@pytest.mark.parametrize("order", ORDERS)
def test_blade_is_in_balance(plane_cycle, mission, order):
    structure, cycle = plane_cycle(mission, order=order)
    # A free blade in the plane has three motions: two forces and a moment must balance.
    assert structure.bodies[1].free_motions(np.zeros(3), 250.0).shape == (3, 6)
    assert cycle.equilibrium.max() < 1e-6


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.6])
@pytest.mark.parametrize("angle", [40.0, 50.0, 60.0])
def test_flanks_carry_the_pull(plane_cycle, symmetric, angle, mu):
    """Check F = 2 (P sin θ - Qx cos θ) at every increment, with nothing along y."""
    theta = np.deg2rad(angle)
    structure, cycle = plane_cycle(symmetric, mu, flank_angle=theta)
    force = pull(structure, symmetric.amplitudes())
    one, two = (history.loads for history in cycle.histories)
    for loads in (one, two):
        carried = 2.0 * (loads.P * np.sin(theta) - loads.Qx * np.cos(theta))
        np.testing.assert_allclose(carried, force, atol=1e-6 * force.max())
        assert not np.any([loads.Qy, loads.Mx, loads.Mz, loads.Edy])
    for name in ("P", "Qx", "My"):
        scale = np.abs(getattr(one, name)).max()
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), atol=1e-5 * scale)


@pytest.mark.parametrize("mu", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("angle", [40.0, 50.0, 60.0])
def test_gross_slip_in_closed_form(plane_cycle, symmetric, angle, mu):
    """Check P = F / 2 (sin θ ± µ cos θ), with minus once the flanks slide back.

    It holds to the solver's tolerance wherever every node slides, since there is no friction along
    y.
    """
    theta = np.deg2rad(angle)
    compliant = {"disk_height": 200.0, "blades": 16}  # The slot opens: flanks slide.
    light = replace(symmetric, airfoil_mass=0.4e-3)
    structure, cycle = plane_cycle(light, mu, flank_angle=theta, **compliant)
    force = pull(structure, light.amplitudes())
    for history in cycle.histories:
        loads, normal = history.loads, history.force[:, 2]
        closed = normal > 1e-6 * normal.max()
        slips = np.abs(history.force[:, 0]) > (1.0 - 1e-6) * mu * normal
        whole = np.all(slips | ~closed, axis=1) & (loads.P > 0.0)
        assert whole[:5].all()
        assert whole[-2]
        friction = mu * np.where(loads.Qx < 0.0, 1.0, -1.0)
        expected = 0.5 * force / (np.sin(theta) + friction * np.cos(theta))
        np.testing.assert_allclose(loads.P[whole], expected[whole], rtol=1e-5)


@pytest.mark.parametrize("play", [1e-4, 3e-3, 1e-1])
def test_blade_crosses_the_play_of_worn_flanks(plane_cycle, symmetric, play):
    """Check worn flanks, which are apart until the load moves the blade across the gap.

    Then all is as before. On the way nothing holds the blade, and the solver's residual stays the
    same.
    """
    structure, unworn = plane_cycle(symmetric)
    joint = FrictionalJoint(structure.condense().resolvent(), 0.4)
    cycle = structure.solve_cycle(joint, symmetric.amplitudes(), structure.gap() + play, 0.4)
    assert cycle.converged
    for before, after in zip(unworn.histories, cycle.histories, strict=True):
        largest = before.loads.P.max()
        np.testing.assert_allclose(after.loads.P, before.loads.P, atol=1e-5 * largest)
        np.testing.assert_allclose(after.loads.Qx, before.loads.Qx, atol=1e-5 * largest)
        energy = before.loads.Edx.max()
        np.testing.assert_allclose(after.loads.Edx, before.loads.Edx, atol=1e-4 * energy)


def test_skewed_slot_is_refused(dovetail):
    with pytest.raises(MeshError, match="skewed slot"):
        replace(dovetail, skew=0.1).mesh((NODES, 2), SIZE, 2)


def rows_in_middle(history):
    """Return P and Qx per length at peak load and the slip of a cycle, at nodes near y = 0."""
    y = history.interface.coordinates[:, 1]
    levels = np.unique(np.round(y, 6))
    row = len(levels) // 2
    middle = np.abs(y - levels[row]) < 1e-6
    spacing = 0.5 * (levels[row + 1] - levels[row - 1])
    force = history.force[PEAK][:, middle].sum(axis=1) / spacing
    slip = np.abs(history.slip[:, 0, middle]).sum(axis=0)
    order = np.argsort(history.interface.coordinates[middle, 0])
    return force[2], force[0], slip[order]


@pytest.mark.slow
def test_space_tends_to_the_plane_without_poisson_and_roundings(dovetail, mission):
    """Check that the middle of a slot, whose sections are all the same, is the plane solution.

    The mesh causes a difference: tetrahedra at the two ends hold their share of a prism's forces at
    some nodes and not at others. Its effect in the middle falls with the spacing of the rows, or
    faster.
    """
    cork = Material(115e3, 0.0, 4.43e-9)
    straight = replace(dovetail, end_radius=1e6, end_width=0.1)

    def solve(nodes, dimension):
        mesh = straight.mesh(nodes, 10.0, dimension)
        structure = dovetail_structure(straight, mesh, cork, cork, mission, 1)
        joint = FrictionalJoint(structure.condense().resolvent(), 0.4)
        return structure.solve_cycle(joint, mission.amplitudes(), structure.gap(), 0.4).histories

    plane = solve((7, 2), 2)
    differences = []
    for rows in (5, 19):  # four times as close to each other in the middle
        for history, other in zip(plane, solve((7, rows), 3), strict=True):
            pressed, sheared, slip = rows_in_middle(other)
            order = np.argsort(history.interface.coordinates[:, 0])
            expected = np.abs(history.slip[:, 0]).sum(axis=0)[order]
            differences.append(
                [
                    abs(pressed / history.loads.P[PEAK] - 1.0),
                    abs(sheared / history.loads.Qx[PEAK] - 1.0),
                    np.abs(slip - expected).max() / expected.max(),
                ]
            )
    coarse, fine = np.max(differences[:2], axis=0), np.max(differences[2:], axis=0)
    assert np.all(fine < 0.25 * coarse)
    assert np.all(fine < 1e-3)


# --- Transfer --------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=[0, 1], ids=["intrados", "extrados"])
def strips(request, dovetail):
    """Return a line face, strips that cover it and extend beyond it, and their transfer."""
    face = dovetail.mesh((NODES, 2), SIZE, 2).interfaces[request.param]
    assert face.line
    grid = Grid.line_contact(dovetail.flank_size()[0] * 1.1, 37)
    return face, grid, FaceTransfer.between(face, grid)


def test_linear_fields_keep_their_integral_over_every_strip(strips):
    """Check ∫ (1 + x) over the part that a strip shares with the face, in closed form."""
    face, grid, transfer = strips
    x = face.coordinates[:, 0]
    low = np.clip(grid.x.ravel() - 0.5 * grid.pitch[0], x.min(), x.max())
    high = np.clip(grid.x.ravel() + 0.5 * grid.pitch[0], x.min(), x.max())
    exact = (high - low) * (1.0 + 0.5 * (high + low))
    np.testing.assert_allclose(transfer.shared @ (1.0 + x), exact, atol=1e-13)
    covered = high > low
    means = transfer.to_cells(1.0 + x).ravel()
    np.testing.assert_allclose(means[covered], (exact / (high - low + ~covered))[covered])
    assert np.all(np.isin(means[~covered], 1.0 + x))


def test_what_wears_off_strips_wears_off_the_face(strips):
    """Check volumes per length and constants, and that the transfers are adjoint."""
    face, grid, transfer = strips
    rng = np.random.default_rng(0)
    inside = np.abs(grid.x.ravel()) < 0.45 * np.ptp(face.coordinates[:, 0])
    depth = np.where(inside, rng.random(grid.shape[0]), 0.0).reshape(grid.shape)
    nodal = transfer.to_nodes(depth)
    assert nodal @ face.nodal_areas == pytest.approx(depth.sum() * grid.pitch[0], rel=1e-12)
    np.testing.assert_allclose(transfer.to_cells(np.full(len(face), 7.5)), 7.5, rtol=1e-13)
    pressure = rng.random(len(face))
    work = transfer.to_cells(pressure).ravel() @ depth.ravel() * grid.pitch[0]
    assert work == pytest.approx(pressure @ (face.nodal_areas * nodal), rel=1e-12)


def test_nodal_forces_arrive_on_the_strips(strips, plane_cycle, mission):
    """Check P to rounding and My to the square of the strips' width."""
    face, grid, transfer = strips
    _, cycle = plane_cycle(mission)
    history = next(h for h in cycle.histories if h.interface.name == face.name)
    pressure = transfer.to_cells(history.pressure[PEAK]) * (
        np.asarray(transfer.shared.sum(axis=1)).reshape(grid.shape) > 0.0
    )
    covered = np.asarray(transfer.shared.sum(axis=1)).reshape(grid.shape)
    assert np.sum(pressure * covered) == pytest.approx(history.loads.P[PEAK], rel=1e-12)
    moment = -np.sum(pressure * covered * grid.x)
    scale = history.loads.P[PEAK] * 0.5 * grid.size[0]
    assert moment == pytest.approx(history.loads.My[PEAK], abs=5e-3 * scale)
