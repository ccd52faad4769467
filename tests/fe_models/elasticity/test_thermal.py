"""Temperatures of bodies: free expansion, held bars, plane strain, bimetal strips, rings."""

import numpy as np
import pytest
from skfem import MeshTet, MeshTri

from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.relinearised import relinearised
from fe_models.elasticity.stress import cycle_stresses, stress_field
from fe_models.elasticity.thermal import NodalTemperature, TemperatureChange, thermal_gradient
from fe_models.geometry.imported import ImportedMesh
from fe_models.imported_structure import (
    ContactPair,
    Support,
    check_load,
    imported_mesh,
    imported_structure,
)
from fe_models.joints.friction import FrictionalJoint
from fe_models.meshes.structure_mesh import Body, MeshError
from fe_models.solvers.linear_solver import prepare
from sa_solver.types import Material
from tests.mirrored_blocks import along, with_faces

STEEL = Material(200e3, 0.3, expansion=12e-6)
HOT = 100.0  # K
FREE = STEEL.expansion * HOT


def box(order, size=(2.0, 1.0, 1.0), counts=(4, 2, 2), material=STEEL):
    mesh = MeshTet.init_tensor(
        *(along((0, end, count)) for end, count in zip(size, counts, strict=True))
    )
    faces = {f"{axis}{k}": (a, k * size[a]) for a, axis in enumerate("xyz") for k in (0, 1)}
    return ElasticBody(Body("box", with_faces(mesh, faces)), material, order)


def plate(order, material=STEEL):
    mesh = MeshTri.init_tensor(along((0, 2, 4)), along((0, 1, 3)))
    faces = {f"{axis}{k}": (a, k * (2.0, 1.0)[a]) for a, axis in enumerate("xz") for k in (0, 1)}
    return ElasticBody(Body("plate", with_faces(mesh, faces)), material, order)


def moved(elastic, strain, held):
    """Return displacements under an expansion, with displacements ``held`` ``(size,)`` zero."""
    free = np.flatnonzero(~held)
    displacement = np.zeros(elastic.size)
    stiffness = elastic.stiffness[free][:, free].tocsr()
    displacement[free] = prepare(stiffness)(elastic.thermal_load(strain)[free])
    return displacement


def axes_held(elastic, **where):
    """Return flags of the displacements of a boundary's nodes along an axis."""
    held = np.zeros((len(elastic.nodes), elastic.dimension), bool)
    names = "xyz" if elastic.dimension == 3 else "xz"
    for boundary, components in where.items():
        for axis in components:
            held[elastic.boundary_nodes(boundary), names.index(axis)] = True
    return held.ravel()


def field(elastic, displacement, strain):
    nothing = np.empty(0, np.int64)
    mesh = elastic.body.mesh
    return stress_field(
        elastic, displacement, mesh.boundary_facets()[:0], nothing, nothing, strain
    ).stress


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("make", [box, plate])
def test_free_expansion_stresses_nothing(make, order):
    """Check displacements θ x, in plane strain (1 + ν) θ x with -E θ across the plane."""
    elastic = make(order)
    plane = elastic.dimension == 2
    strain = np.full(elastic.body.mesh.nvertices, FREE)
    where = {"x0": "x", "z0": "z"} | ({} if plane else {"y0": "y"})
    displacement = moved(elastic, strain, axes_held(elastic, **where))
    grown = FREE * (1.0 + STEEL.poisson) if plane else FREE
    exact = grown * elastic.nodes[:, list(elastic.body.axes)]
    np.testing.assert_allclose(displacement.reshape(exact.shape), exact, atol=1e-12 * grown)
    stress = field(elastic, displacement, strain)
    across = -STEEL.young * FREE if plane else 0.0
    expected = np.outer([0.0, across, 0.0, 0.0, 0.0, 0.0], np.ones(len(strain)))
    np.testing.assert_allclose(stress, expected, atol=1e-8 * STEEL.young * FREE)


@pytest.mark.parametrize("order", [1, 2])
def test_bar_between_walls(order):
    """Check -E α ΔT along it and nothing across."""
    elastic = box(order)
    strain = np.full(elastic.body.mesh.nvertices, FREE)
    held = axes_held(elastic, x0="x", x1="x", y0="y", z0="z")
    stress = field(elastic, moved(elastic, strain, held), strain)
    exact = np.outer([-STEEL.young * FREE, 0, 0, 0, 0, 0], np.ones(len(strain)))
    np.testing.assert_allclose(stress, exact, atol=1e-8 * STEEL.young * FREE)


def test_linear_temperature_bends_a_bar_without_stress():
    """Check with second order that a temperature g z bends the bar to the curvature α g."""
    elastic = box(2)
    slope = 30.0
    strain = STEEL.expansion * slope * elastic.body.points[:, 2]
    x, y, z = elastic.nodes.T
    g = STEEL.expansion * slope
    exact = np.stack([g * x * z, g * y * z, 0.5 * g * (z**2 - x**2 - y**2)], axis=1).ravel()
    residual = elastic.stiffness @ exact - elastic.thermal_load(strain)
    scale = np.abs(elastic.thermal_load(strain)).max()
    np.testing.assert_allclose(residual, 0.0, atol=1e-11 * scale)
    np.testing.assert_allclose(
        field(elastic, exact, strain), 0.0, atol=1e-8 * STEEL.young * strain.max()
    )
    vertices = np.arange(3, 9)
    gradient = thermal_gradient(elastic, np.stack([strain, 2.0 * strain], axis=1), vertices)
    expected = np.multiply.outer([0.0, 0.0, g], np.multiply.outer(np.ones(6), [1.0, 2.0]))
    np.testing.assert_allclose(gradient, expected, atol=1e-12 * g)


def test_forces_of_a_temperature_balance_themselves():
    """Check that they do no work in a rigid motion, whatever the field."""
    elastic = box(2)
    strain = np.random.default_rng(0).random(elastic.body.mesh.nvertices)
    forces = elastic.thermal_load(strain).reshape(-1, 3)
    scale = np.abs(forces).sum()
    assert np.abs(forces.sum(axis=0)).max() < 1e-14 * scale
    assert np.abs(np.cross(elastic.nodes, forces).sum(axis=0)).max() < 1e-14 * scale


@pytest.mark.parametrize("order", [1, 2])
def test_strip_of_two_metals_bends_as_timoshenko_found(order):
    """Check the curvature 12 ∫ θ (z - h/2) dz / h³, 3/2 Δα ΔT / h for a jump (1925).

    In the plane it is larger by 1 + ν. Between vertices a jump rises over two elements, of t each:
    ∫ = h²/8 - t²/6.
    """
    count = 16 if order == 1 else 8
    strip = MeshTri.init_tensor(along((0, 12, 12 * count)), along((0, 1, count)))
    elastic = ElasticBody(Body("strip", strip), STEEL, order)
    height = elastic.body.points[:, 2]
    strain = FREE * (0.5 * (np.sign(height - 0.5) + 1.0))
    x, _, z = elastic.nodes.T
    held = np.zeros((len(x), 2), bool)
    held[x == 0.0, 0] = True
    held[(x == 0.0) & (z == 0.0), 1] = True
    displacement = moved(elastic, strain, held.ravel()).reshape(-1, 2)
    line = (z == 0.5) & (x > 2.0) & (x < 10.0)  # away from ends
    curvature = -2.0 * np.polyfit(x[line], displacement[line, 1], 2)[0]
    exact = 12.0 * (0.125 - 1.0 / (6.0 * count**2)) * FREE * (1.0 + STEEL.poisson)
    assert curvature == pytest.approx(exact, rel={1: 0.02, 2: 1e-4}[order])


def test_ring_that_is_hotter_outside():
    """Check a change c r² in a long hollow cylinder, held along its axis.

    Source: Timoshenko and Goodier, Theory of Elasticity, 150. The model is a quarter of the section
    between planes of symmetry.
    """
    inner, outer, hot = 10.0, 20.0, 0.1
    mesh = MeshTri.init_tensor(along((inner, outer, 16)), along((0, 1, 24)))
    r, turn = mesh.p[0], 0.5 * np.pi * mesh.p[1]
    ring = MeshTri(np.stack([r * np.cos(turn), r * np.sin(turn)]), mesh.t)
    ring = with_faces(ring, {"x0": (0, 0.0), "z0": (1, 0.0)})
    elastic = ElasticBody(Body("ring", ring), STEEL, 2)
    strain = STEEL.expansion * hot * r**2
    displacement = moved(elastic, strain, axes_held(elastic, x0="x", z0="z"))
    stress = field(elastic, displacement, strain)
    on_axis = np.flatnonzero((turn == 0.0) & (r > inner) & (r < outer))
    a, b, r = inner**2, outer**2, r[on_axis] ** 2
    scale = STEEL.expansion * STEEL.young * hot / (4.0 * (1.0 - STEEL.poisson))
    radial = scale * ((r - a) * (b + a) / r - (r**2 - a**2) / r)
    hoop = scale * ((r + a) * (b + a) / r + (r**2 - a**2) / r - 4.0 * r)
    along_axis = STEEL.poisson * (radial + hoop) - STEEL.young * STEEL.expansion * hot * r
    largest = np.abs(along_axis).max()
    for component, exact in ((0, radial), (2, hoop), (1, along_axis)):
        np.testing.assert_allclose(stress[component, on_axis], exact, atol=3e-3 * largest)


# --- in a structure -------------------------------------------------------------------------------


def two_pieces(order, loads, materials=(STEEL, STEEL), supports=()):
    """Return a bar in two pieces that meet at z = 3, its ends held along z."""
    lower = MeshTet.init_tensor(along((0, 2, 2)), along((0, 1, 2)), along((0, 3, 3)))
    upper = MeshTet.init_tensor(along((0, 2, 3)), along((0, 1, 2)), along((3, 4, 2)))
    planes = {"x0": (0, 0.0), "y0": (1, 0.0)}
    bodies = {
        "lower": Body("lower", with_faces(lower, {"top": (2, 3.0), "base": (2, 0.0)} | planes)),
        "upper": Body("upper", with_faces(upper, {"bottom": (2, 3.0), "lid": (2, 4.0)} | planes)),
    }
    numbers = {"lower": 1 + np.arange(lower.nvertices), "upper": 100 + np.arange(upper.nvertices)}
    imported = ImportedMesh(bodies, numbers, {"lower": {}, "upper": {}})
    pair = ContactPair("cut", ("lower", "upper"), ["top"], ["bottom"], np.array([1.0, 0.0, 0.0]))
    held = [Support("base", "z"), Support("lid", "z"), Support("x0", "x"), Support("y0", "y")]
    mesh = imported_mesh(imported, ("lower", "upper"), [pair], held)
    return imported_structure(mesh, imported, materials, held, loads, order), imported


def cycle_of(joined, amplitudes):
    joint = FrictionalJoint(joined.condense().resolvent(), 0.0)
    return joined.solve_cycle(joint, np.array(amplitudes), joined.gap(), 0.0)


@pytest.mark.parametrize("order", [1, 2])
def test_heated_bar_of_two_pieces_presses(order):
    """Check E α ΔT between its ends, and the share of each piece by its length."""
    numbers = np.arange(1, 200)
    loads = [TemperatureChange(HOT), NodalTemperature(numbers, np.full(199, 0.5 * HOT), "lower")]
    joined, _ = two_pieces(order, loads)
    cycle = cycle_of(joined, [[0.5, 0.0], [1.0, 0.0], [0.0, 1.0]])
    (history,) = cycle.histories
    whole = STEEL.young * FREE
    pressed = whole * np.array([0.5, 1.0, 0.5 * 3.0 / 4.0])
    np.testing.assert_allclose(history.loads.P, 2.0 * pressed, rtol=1e-8)
    assert cycle.equilibrium.max() < 1e-9
    amplitudes = np.array([[0.5, 0.0], [1.0, 0.0], [0.0, 1.0]])
    fields = history.force, history.displacement
    (found,) = cycle_stresses(joined, [fields], amplitudes, 1, [0, 2])
    for stress in found.fields:
        exact = np.outer([0, 0, -whole, 0, 0, 0], np.ones(stress.stress.shape[1]))
        np.testing.assert_allclose(stress.stress, exact, atol=1e-6 * whole)
        assert stress.peak.error < 1e-6
    for surface in found.surfaces:
        left = surface.stress[:, 2] + pressed[[0, 2], None]
        np.testing.assert_allclose(left, 0.0, atol=1e-6 * whole)
    ((one, two),) = found.expansions
    np.testing.assert_allclose(one[:, 0].T, [FREE * np.array([0.5, 1.0, 0.5])] * one.shape[2])
    np.testing.assert_allclose(two[:, 0].T, [FREE * np.array([0.5, 1.0, 0.0])] * two.shape[2])
    np.testing.assert_allclose(one[:, 1], 0.0, atol=1e-15)


def test_no_temperature_changes_nothing():
    joined, _ = two_pieces(1, [TemperatureChange(HOT)], (Material(200e3, 0.3),) * 2)
    assert not any(body.expands for body in joined.bodies)
    force = np.zeros((1, 3, len(joined.gap())))
    (found,) = cycle_stresses(joined, [(force, force)], np.ones((1, 1)), 0)
    assert found.expansions is None


@pytest.mark.parametrize(
    ("load", "wrong"),
    [
        (TemperatureChange(HOT, "middle"), "no body middle; allowed: lower, upper"),
        (NodalTemperature(np.arange(2, 100), np.ones(98), "lower"), "1 of 36 nodes have no"),
        (NodalTemperature(np.arange(100), np.ones(100)), "36 of 36 nodes"),
    ],
)
def test_temperatures_that_do_not_fit_are_refused(load, wrong):
    _, imported = two_pieces(1, [TemperatureChange(HOT)])
    with pytest.raises(MeshError, match=wrong):
        check_load(imported, list(imported.bodies.values()), load)


def test_nonlinear_structures_know_no_temperature():
    joined, _ = two_pieces(1, [TemperatureChange(HOT)])
    still = tuple(np.zeros(body.elastic.size) for body in joined.bodies)
    with pytest.raises(ValueError, match="a temperature changes"):
        relinearised(joined, still, np.ones(1), (0.0, 0.0))


@pytest.mark.parametrize("dimension", [2, 3])
def test_curved_elements_expand_freely(dimension):
    """Check that forces with moved midside nodes are those of θ x, in the plane (1 + ν) θ x."""
    grid = np.linspace(0.0, 1.0, 3)
    mesh = MeshTri.init_tensor(grid, grid) if dimension == 2 else MeshTet.init_tensor(*[grid] * 3)
    edges = mesh.facets if dimension == 2 else mesh.edges
    middles = mesh.p[:, edges].mean(axis=1).T
    off = np.random.default_rng(3).uniform(-0.03, 0.03, middles.shape)
    elastic = ElasticBody(Body("block", mesh, midsides=middles + off), STEEL, 2)
    assert elastic.curved
    strain = np.full(mesh.nvertices, FREE)
    forces = elastic.thermal_load(strain)
    grown = FREE * (1.0 + STEEL.poisson) if dimension == 2 else FREE
    free = grown * elastic.nodes[:, list(elastic.body.axes)].ravel()
    np.testing.assert_allclose(elastic.stiffness @ free, forces, atol=1e-11 * np.abs(forces).max())
