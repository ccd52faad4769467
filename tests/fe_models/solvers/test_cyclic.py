"""Cyclic symmetry: a sector with its cuts tied equals the whole wheel."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from scipy.spatial import cKDTree

from fe_models.cyclic.cuts import Cuts, hold_normal
from fe_models.cyclic.recovery import SectorRecovery
from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.recovery import StressRecovery
from fe_models.loads.applied_loads import BoundaryForce
from fe_models.loads.constraints import Constraints
from fe_models.loads.imposed import tie_rigid
from fe_models.meshes.structure_mesh import Body, MeshError
from fe_models.supported_body import SupportedBody
from sa_solver import von_mises
from sa_solver.types import Material
from tests.marks import slow
from tests.wheels import INNER, OBLIQUE, OUTER, THROUGH, Y, about, curved, sector, wheel

STEEL = Material(200e3, 0.3, 7.8e-9)
NONE = np.empty(0, np.int64)


def supported(body, order, cuts, hold):
    """Return the body with supports that ``hold`` adds to constraints, and no loads."""
    elastic = ElasticBody(body, STEEL, order)
    constraints = Constraints(len(elastic.nodes), elastic.dimension)
    hold(constraints, elastic, cuts)
    for pair in cuts:
        pair.tie(constraints, elastic)
    return elastic, constraints


def held_bore(constraints, elastic, cuts):
    constraints.hold(elastic.boundary_nodes("bore"))


def sliding_bore(constraints, elastic, cuts):
    hold_normal(constraints, elastic, "bore", cuts)


def solved(elastic, constraints, load):
    """Return displacements ``(n, d)`` under a load, with the least rigid motion that is free."""
    t = constraints.transformation()
    stiffness, forces = (t.T @ elastic.stiffness @ t).tocsc(), t.T @ load
    return (t @ spsolve(stiffness, forces)).reshape(-1, elastic.dimension)


def of_wheel(part, cyclic, order, hold, load):
    """Return displacements of sector and wheel, each with its elastic body."""
    answers, whole = [], wheel(part, cyclic)
    if part.midsides is not None:
        whole = curved(whole)
    for body, cuts in ((part, [Cuts.of(part, cyclic)]), (whole, [])):
        elastic, constraints = supported(body, order, cuts, hold)
        answers.append((elastic, constraints, solved(elastic, constraints, load(elastic))))
    return answers


def same_places(elastic, whole):
    """Return the nodes of the wheel at the positions of the sector's nodes."""
    distance, place = cKDTree(whole.nodes).query(elastic.nodes)
    assert distance.max() < 1e-9
    return place


def pressed(axis, through):
    """Return centrifugal forces, pressure on pads, and shear of a pad along the axis."""

    def load(elastic):
        forces = 1e3**2 * elastic.centrifugal_load(axis, through) + 30.0 * elastic.pressure_load(
            "pad"
        )
        if elastic.dimension == 3:
            forces += elastic.traction_load("pad", lambda x: np.full_like(x[0], 20.0), axis)
        return forces

    return load


CASES = [
    (2, 6, 1, INNER, Y, (0.0, 0.0, 0.0)),
    (2, 3, 2, INNER, Y, (0.0, 0.0, 0.0)),
    (2, 2, 1, INNER, Y, (0.0, 0.0, 0.0)),
    (3, 4, 1, INNER, OBLIQUE, THROUGH),
    slow(3, 5, 2, INNER, Y, (0.0, 0.0, 0.0)),
]


@pytest.mark.parametrize(("dimension", "sectors", "order", "inner", "axis", "through"), CASES)
def test_sector_is_the_wheel(dimension, sectors, order, inner, axis, through):
    """Compare displacements and stresses, on the cuts and their edges, too."""
    part = sector(sectors, dimension=dimension, axis=axis, through=through)
    check_wheel(part, about(axis, through, sectors), order)


@pytest.mark.parametrize("dimension", [2, slow(3)])
def test_curved_sector_is_the_curved_wheel(dimension):
    """Compare elements of second order whose edges follow circles."""
    check_wheel(curved(sector(5, dimension=dimension)), about(sectors=5), 2)


def check_wheel(part, cyclic, order):
    """Check that displacements and recovered stresses of a sector are those of its wheel."""
    load = pressed(cyclic.direction, cyclic.through)
    mine, theirs = of_wheel(part, cyclic, order, held_bore, load)
    place = same_places(mine[0], theirs[0])
    size = np.abs(theirs[2]).max()
    np.testing.assert_allclose(mine[2], theirs[2][place], atol=1e-10 * size)

    stresses = []
    for elastic, moved, kind in (
        (mine[0], mine[2], lambda e, free: SectorRecovery(e, free, [Cuts.of(part, cyclic)])),
        (theirs[0], theirs[2], StressRecovery),
    ):
        mesh = elastic.body.mesh
        names = {"rim", "front", "back"} & set(mesh.boundaries)
        free = np.concatenate([mesh.boundaries[name] for name in sorted(names)])
        recovery = kind(elastic, np.setdiff1d(free, mesh.boundaries["pad"]))
        stresses.append((recovery, recovery.stress(moved.ravel())))
    (mine_, one), (theirs_, two) = stresses
    count = part.mesh.nvertices
    np.testing.assert_allclose(one, two[:, place[:count]], atol=1e-8 * np.abs(two).max())
    for name in ("untouched", "inward_edges"):
        there = np.isin(place[:count], getattr(theirs_, name))
        np.testing.assert_array_equal(getattr(mine_, name), np.flatnonzero(there))


def unchanged(body):
    return body


@pytest.mark.parametrize(("dimension", "order"), [(2, 1), (2, 2), (3, 1)])
def test_rigid_bore_turns_as_that_of_the_wheel(dimension, order):
    """Check a rigid bore under a moment and, in space, a force along the axis."""
    sectors, through = 4, np.zeros(3)
    part, cyclic = sector(sectors, dimension=dimension), about(Y, (0.0, 0.0, 0.0), sectors)
    push = np.zeros(3) if dimension == 2 else 500.0 * np.array(Y)
    moved = []
    for body, cuts, share in (
        (part, [Cuts.of(part, cyclic)], 1.0 / sectors),
        (wheel(part, cyclic), [], 1.0),
    ):
        elastic, constraints = supported(
            body, order, cuts, lambda c, e, _: c.hold(e.boundary_nodes("rim"))
        )
        tie_rigid(constraints, elastic, "bore", through)
        load = BoundaryForce("bore", share * push, through, share * 2e4 * np.array(Y))
        found = solved(elastic, constraints, load.forces(elastic))
        moved.append((elastic, found))
    (one, mine), (two, theirs) = moved
    size = np.abs(theirs).max()
    np.testing.assert_allclose(mine, theirs[same_places(one, two)], atol=1e-9 * size)


def free_motions(elastic, constraints, cuts=()):
    """Return the free rigid motions of a body with its pad as a contact face."""
    nodes = elastic.body.vertices("pad")
    frames = np.tile(np.eye(elastic.dimension), (len(nodes), 1, 1))
    body = SupportedBody(
        elastic, constraints, nodes, frames, np.zeros((elastic.size, 1)), cuts=cuts
    )
    return body.free_motions(np.zeros(3), OUTER)


def squeezed(elastic):
    """Return centrifugal forces about Y and pressure on pads, without any resultant."""
    return 1e3**2 * elastic.centrifugal_load() + 30.0 * elastic.pressure_load("pad")


@pytest.mark.parametrize(
    ("dimension", "order", "shape"),
    [
        (2, 1, unchanged),
        (2, 2, unchanged),
        (2, 2, curved),
        (3, 1, unchanged),
        slow(3, 2, unchanged),
    ],
)
def test_sliding_boundary_goes_on_beyond_the_cuts(dimension, order, shape):
    """Check that normals at cuts are those of the wheel, so that it turns freely."""
    part, cyclic = shape(sector(5, dimension=dimension)), about(sectors=5)
    rim = np.setdiff1d(part.vertices("rim"), Cuts.of(part, cyclic).vertices(part))
    place = part.points[rim[0]]
    across = np.cross(Y, place) / np.linalg.norm(place)
    answers = []
    for body, cuts in ((part, [Cuts.of(part, cyclic)]), (shape(wheel(part, cyclic)), [])):
        elastic, constraints = supported(body, order, cuts, sliding_bore)
        # The different normals of a bore's facets in space prevent the rotation.
        turns = dimension == 2
        assert len(free_motions(elastic, constraints)) == dimension - 2 + turns
        node = np.array([np.argmin(np.linalg.norm(elastic.nodes - place, axis=1))])
        for direction in [across] * turns + [Y] * (dimension - 2):
            constraints.slide(node, direction[None, list(elastic.body.axes)])
        answers.append((elastic, solved(elastic, constraints, squeezed(elastic))))
    (mine, one), (whole, two) = answers
    np.testing.assert_allclose(one, two[same_places(mine, whole)], atol=1e-10 * np.abs(two).max())


@pytest.mark.parametrize("dimension", [2, 3])
def test_rigid_motions_that_cuts_leave(dimension):
    """Check that only the rotation about the axis and, in space, the shift along it remain."""
    axis, through = (OBLIQUE, THROUGH) if dimension == 3 else (Y, (0.0, 0.0, 0.0))
    part, cyclic = (
        sector(7, dimension=dimension, axis=axis, through=through),
        about(axis, through, 7),
    )
    cuts = [Cuts.of(part, cyclic)]
    elastic, constraints = supported(part, 1, cuts, lambda *_: None)
    nodes = part.vertices("pad")
    frames = np.tile(np.eye(dimension), (len(nodes), 1, 1))
    nothing = np.zeros((elastic.size, 1))
    body = SupportedBody(elastic, constraints, nodes, frames, nothing, cuts=cuts)
    motions = body.free_motions(cyclic.through, OUTER)
    assert len(motions) == dimension - 1
    e = cyclic.direction
    allowed = np.array([np.append(np.zeros(3), e), np.append(e, np.zeros(3))])[: dimension - 1]
    np.testing.assert_allclose(motions @ allowed.T @ allowed, motions, atol=1e-8)
    surface = part.mesh.boundary_facets()
    on_cuts = np.append(part.mesh.boundaries["low"], part.mesh.boundaries["high"])
    contact = part.mesh.boundaries["pad"]
    free = np.setdiff1d(surface, np.append(on_cuts, contact))
    np.testing.assert_array_equal(body.free_facets, free)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("dimension", [2, 3])
def test_solid_wheel(dimension, order):
    """Check that nodes on the axis are on both cuts, and move along it only."""
    part, cyclic = sector(4, dimension=dimension, inner=0.0, counts=(4, 4, 2)), about(sectors=4)
    mine, theirs = of_wheel(part, cyclic, order, no_drift, squeezed)
    place = same_places(mine[0], theirs[0])
    one, two = mine[2], theirs[2][place]
    np.testing.assert_allclose(one, two, atol=1e-9 * np.abs(two).max())
    on_axis = np.linalg.norm(mine[0].nodes[:, [0, 2]], axis=1) < 1e-9
    assert on_axis.any()
    assert np.abs(one[on_axis][:, [0, -1]]).max() <= 1e-9 * np.abs(one).max()


def no_drift(constraints, elastic, cuts):
    """Hold the free motions of a wheel without supports at its axis."""
    points = elastic.nodes
    middle = np.flatnonzero(np.linalg.norm(points[:, [0, 2]], axis=1) < 1e-9)
    constraints.hold(middle[:1])
    far = np.flatnonzero(np.linalg.norm(points - OUTER * np.eye(3)[2], axis=1) < 1e-9)
    constraints.slide(far, np.eye(3)[[0], :][:, list(elastic.body.axes)])
    if elastic.dimension == 3:
        constraints.slide(middle[1:2], np.eye(3)[[0]])
        constraints.slide(middle[1:2], np.eye(3)[[2]])


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("dimension", [2, 3])
def test_cuts_that_do_not_match_pass_a_uniform_stress(dimension, order):
    """Run the patch test across cuts: a linear displacement gives uniform strain."""
    part = sector(6, dimension=dimension, moved=0.3)
    cuts = Cuts.of(part, about(sectors=6))
    assert not cuts.matched
    elastic, constraints = supported(part, order, [cuts], lambda *_: None)
    strain = np.diag([2e-3, -1e-3 * (dimension - 2), 2e-3])
    exact = (elastic.nodes @ strain)[:, list(elastic.body.axes)]
    t = constraints.transformation()
    free = constraints.free
    np.testing.assert_allclose(t @ exact.ravel()[free], exact.ravel(), atol=1e-14)
    # Tractions of that stress act on all of the surface except the cuts, in balance.
    stress = elastic.cauchy(np.repeat(strain[:, :, None], 1, axis=2))[:, 0]
    forces = np.zeros(elastic.size)
    for name in {"bore", "rim", "front", "back"} & set(part.mesh.boundaries):
        forces += surface_forces(elastic, name, stress)
    residual = t.T @ (elastic.stiffness @ exact.ravel() - forces)
    assert np.abs(residual).max() <= 1e-10 * np.abs(forces).max()


def surface_forces(elastic, name, stress):
    """Return forces of a uniform ``stress`` ``(6,)`` on a boundary of plane facets."""
    mesh, total = elastic.body.mesh, np.zeros(elastic.size)
    facets = mesh.boundaries[name]
    normals = elastic.body.outward_of(facets)
    tensor = np.array(
        [
            [stress[0], stress[3], stress[5]],
            [stress[3], stress[1], stress[4]],
            [stress[5], stress[4], stress[2]],
        ]
    )
    tractions = (normals / np.linalg.norm(normals, axis=1)[:, None]) @ tensor
    for axis in elastic.body.axes:
        for value in np.unique(tractions[:, axis].round(9)):
            group = facets[tractions[:, axis].round(9) == value]
            part = ElasticBody(
                type(elastic.body)("part", mesh.with_boundaries({"group": group})),
                STEEL,
                elastic.order,
            )
            total += part.traction_load(
                "group", lambda x, v=value: np.full_like(x[0], v), np.eye(3)[axis]
            )
    return total


@pytest.mark.parametrize("order", [1, 2])
def test_vertices_near_and_far_from_cuts(order):
    """Check that stress at single vertices equals that of all, near cuts and far from them."""
    part = sector(3, (3, 16, 1))
    elastic = ElasticBody(part, STEEL, order)
    cuts = Cuts.of(part, about(sectors=3))
    free = np.append(part.mesh.boundaries["rim"], part.mesh.boundaries["bore"])
    recovery = SectorRecovery(elastic, free, [cuts])
    moved = np.random.default_rng(3).standard_normal(elastic.size)
    every = np.arange(part.mesh.nvertices)
    stress, others = recovery.stress(moved), recovery.alternatives(moved, every)
    angle = np.arctan2(part.points[:, 0], part.points[:, 2])
    middle = np.flatnonzero(np.abs(angle - np.pi / 3.0) < 0.1)
    size = np.abs(stress).max()
    for some in (cuts.vertices(part)[:2], middle, np.append(middle, cuts.vertices(part)[:2])):
        np.testing.assert_allclose(
            recovery.stress(moved, None, some), stress[:, some], atol=1e-12 * size
        )
        reported = recovery.histories(moved[:, None], some)[0]
        np.testing.assert_allclose(reported, stress[:, some], atol=1e-10 * size)
        np.testing.assert_allclose(
            recovery.alternatives(moved, some), others[:, :, some], atol=1e-10 * size
        )


@pytest.mark.parametrize("order", [1, 2])
def test_cuts_that_do_not_match_converge(order):
    """Compare a ring under internal pressure with Lamé: as accurate as with matching cuts."""
    errors = {}
    for moved in (0.0, 0.3):
        for fine in (1, 2, 4):
            part = sector(6, (4 * fine, 4 * fine, 1), moved=moved)
            cuts = [Cuts.of(part, about(sectors=6))]
            elastic, constraints = supported(part, order, cuts, lambda *_: None)
            node = part.vertices("rim")[1:2]
            place = part.points[node]
            across = np.cross(Y, place)[:, [0, 2]]
            constraints.slide(node, across / np.linalg.norm(across))
            u = solved(elastic, constraints, 100.0 * elastic.pressure_load("bore"))
            radius = np.linalg.norm(elastic.nodes, axis=1, keepdims=True)
            a, b, g, nu = INNER, OUTER, STEEL.shear_modulus, STEEL.poisson
            size = 100.0 * a**2 / (2.0 * g * (b**2 - a**2))
            exact = size * ((1.0 - 2.0 * nu) * radius + b**2 / radius) * elastic.nodes / radius
            errors[moved, fine] = np.abs(u - exact[:, [0, 2]]).max() / np.abs(exact).max()
    for fine in (1, 2, 4):
        assert errors[0.3, fine] < 2.0 * errors[0.0, fine]
    assert errors[0.3, 4] < 0.1 * errors[0.3, 1]


@pytest.mark.parametrize("moved", [0.0, 0.3])
def test_curved_elements_converge(moved):
    """Compare a ring under internal pressure with Lamé: a twentieth of the straight error."""
    part = curved(sector(6, (8, 8, 1), moved=moved))
    cuts = [Cuts.of(part, about(sectors=6))]
    elastic, constraints = supported(part, 2, cuts, lambda *_: None)
    node = part.vertices("bore")[2:3]
    across = np.cross(Y, part.points[node])[:, [0, 2]]
    constraints.slide(node, across / np.linalg.norm(across))
    u = solved(elastic, constraints, 100.0 * elastic.pressure_load("bore"))
    radius = np.linalg.norm(elastic.nodes, axis=1, keepdims=True)
    size = 100.0 * INNER**2 / (2.0 * STEEL.shear_modulus * (OUTER**2 - INNER**2))
    scaled = (1.0 - 2.0 * STEEL.poisson) * radius + OUTER**2 / radius
    exact = size * scaled * elastic.nodes / radius
    assert np.abs(u - exact[:, [0, 2]]).max() < 1e-4 * np.abs(exact).max()


def test_curved_cuts_of_other_meshes():
    """Check that cuts with curved edges that do not match are refused for second order."""
    part = bend(sector(6))
    middles = part.points[part.mesh.facets.T].mean(axis=1)[:, [0, 2]]
    rng = np.random.default_rng(0)
    shaken = replace(part, midsides=middles + 0.01 * rng.standard_normal(middles.shape))
    with pytest.raises(MeshError, match="midside nodes of its cuts"):
        supported(shaken, 2, [Cuts.of(shaken, about(sectors=6))], lambda *_: None)
    other = sector(6, moved=0.3)
    middles = other.points[other.mesh.facets.T].mean(axis=1)[:, [0, 2]]
    shaken = replace(other, midsides=middles + 0.01 * rng.standard_normal(middles.shape))
    with pytest.raises(MeshError, match="edges of the cuts are curved"):
        supported(shaken, 2, [Cuts.of(shaken, about(sectors=6))], lambda *_: None)


@pytest.mark.parametrize("moved", [0.0, 0.3])
def test_stress_of_cuts_is_as_good_as_elsewhere(moved):
    """Compare a ring under internal pressure with Lamé: tractions at tied cuts remain."""
    part = sector(6, (8, 8, 1), moved=moved)
    cuts = [Cuts.of(part, about(sectors=6))]
    elastic, constraints = supported(part, 2, cuts, lambda *_: None)
    node = part.vertices("bore")[2:3]
    across = np.cross(Y, part.points[node])[:, [0, 2]]
    constraints.slide(node, across / np.linalg.norm(across))
    press = 100.0 * elastic.pressure_load("bore")
    pad = part.vertices("pad")
    frames = np.tile(np.eye(2), (len(pad), 1, 1))
    body = SupportedBody(
        elastic, constraints, pad, frames, press[:, None], loaded=["bore"], cuts=cuts
    )
    u = solved(elastic, constraints, press)
    square, size = np.sum(part.points**2, axis=1), 100.0 * INNER**2 / (OUTER**2 - INNER**2)
    radial, hoop = size * (1.0 - OUTER**2 / square), size * (1.0 + OUTER**2 / square)
    along = STEEL.poisson * (radial + hoop)
    exact = np.sqrt(0.5 * ((radial - hoop) ** 2 + (hoop - along) ** 2 + (along - radial) ** 2))
    error = np.abs(von_mises(body.recovery.stress(u.ravel())) - exact) / exact.max()
    on_cuts = np.isin(np.arange(len(error)), cuts[0].vertices(part))
    assert error[on_cuts].max() < 1.1 * error[~on_cuts].max() < 0.01


@pytest.mark.parametrize(
    ("cyclic", "changed", "printed"),
    [
        (about(sectors=5), {}, "the centres of both are 60° apart, as for 6 sectors"),
        (about(sectors=7), {"moved": 0.3}, "is not low turned about the axis by 360°/7"),
        (about(sectors=6, through=(0.5, 0.0, 0.0)), {}, "up to 0.25 mm off"),
        (about(sectors=6, high=("rim",)), {}, "rim is not low turned"),
        (about(sectors=6, high=("low",)), {}, "share facets"),
    ],
)
def test_cuts_that_are_no_images(cyclic, changed, printed):
    with pytest.raises(MeshError, match=printed):
        Cuts.of(sector(6, **changed), cyclic)


def test_cuts_of_which_a_part_is_named():
    """Check two cuts in image planes that do not cover each other."""
    part = sector(6)
    low = part.mesh.boundaries["low"]
    body = Body("wheel", part.mesh.with_boundaries({"half": low[:2]}))
    cyclic = about(low=("half",))
    with pytest.raises(MeshError, match="one cut is not covered"):
        supported(body, 1, [Cuts.of(body, cyclic)], lambda *_: None)
    every = about(low=("half", "low"))
    assert Cuts.of(body, every).matched


def test_cuts_that_are_not_plane():
    """Check that they are tied node by node if they are images, and refused otherwise."""
    part = sector(6, counts=(4, 5, 2))
    bent = bend(part)
    assert Cuts.of(bent, about(sectors=6)).matched
    with pytest.raises(MeshError, match="must have matching meshes"):
        Cuts.of(bend(sector(6, moved=0.3)), about(sectors=6))


def bend(part):
    """Return the sector with its cuts bent by a rotation that depends on the radius."""
    radius = np.linalg.norm(part.points, axis=1)
    angle = 0.01 * (radius - INNER) ** 2 / INNER
    x, _, z = part.points.T
    cosine, sine = np.cos(angle), np.sin(angle)
    points = np.stack([cosine * x + sine * z, cosine * z - sine * x])
    mesh = part.mesh
    return Body("wheel", type(mesh)(points, mesh.t).with_boundaries(mesh.boundaries))
