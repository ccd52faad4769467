"""Structures of one sector: their contacts are those of all sectors; refusals."""

from dataclasses import replace

import numpy as np
import pytest

from fe_models import structure
from fe_models.cyclic.cuts import Cuts
from fe_models.cyclic.sector import check_jumps, sector_cuts
from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.stress import cycle_stresses
from fe_models.elasticity.thermal import NodalTemperature
from fe_models.geometry.imported import ImportedMesh
from fe_models.imported_structure import ContactPair, Support, imported_mesh, imported_structure
from fe_models.joints import friction
from fe_models.joints.friction import FrictionalJoint
from fe_models.loads.applied_loads import (
    Acceleration,
    BoundaryForce,
    Displacement,
    Pressure,
    Rotation,
)
from fe_models.loads.constraints import Constraints
from fe_models.meshes.structure_mesh import MeshError
from fe_models.motion import deformation
from fe_models.supported_body import SupportedBody
from sa_solver.types import Material
from tests.marks import slow
from tests.wheels import WIDTH, Y, about, sector, shoe, turned, wheel

STEEL = Material(200e3, 0.3, 7.8e-9)
MU = 0.3
SECTORS = 4
COUNTS = (4, 7, 1)
CYCLIC = about(sectors=SECTORS)
BORE = Support("bore", "xyz")
# The shoes are pressed, pushed back and forth around so that part of the face slides, and spun.
PATH = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [1.0, -1.0, 1.0]])
PUSH = np.array([215.0, 0.0, -115.0])
# Forces are per length in the plane.
DEPTH = {2: 1.0, 3: WIDTH}
SPIN = Rotation(Y, np.zeros(3), 500.0)


def structure_of(disk, shoes, forces, cyclic, order, supports=(BORE,)):
    """Return a disk with shoes on its pads, each with its own force on the top."""
    named = {body.name: body for body in (disk, *shoes)}
    imported = ImportedMesh(
        named,
        {name: np.arange(body.mesh.nvertices) for name, body in named.items()},
        {name: {} for name in named},
    )
    pairs = [
        ContactPair(
            f"pad {k}", (disk.name, body.name), ["pad" if cyclic else f"pad_{k}"],
            [f"pad_{k}"], CYCLIC.turn(k) @ [1.0, 0.0, 0.0],
        )
        for k, body in enumerate(shoes)
    ]  # fmt: skip
    mesh = imported_mesh(imported, list(named), pairs, supports)
    loads = [Pressure("top", 30.0), *forces, SPIN]
    materials = [STEEL] * len(named)
    return imported_structure(mesh, imported, materials, supports, loads, order, cyclic)


def sector_of(order=1, cyclic=(CYCLIC,), part=None, dimension=2, **changes):
    """Return one sector with its shoe."""
    body = turned(shoe(SECTORS, COUNTS, dimension), CYCLIC, 0)
    force = BoundaryForce("top_0", PUSH * DEPTH[dimension])
    part = part or sector(SECTORS, COUNTS, dimension)
    return structure_of(part, [body], [force], cyclic, order, **changes)


def cycle_of(joined, path):
    """Return a closed cycle, and its load amplitudes."""
    joint = FrictionalJoint(joined.condense().resolvent(), MU)
    return joined.solve_cycle(joint, path, joined.gap(), MU)


IN_SPACE = [Support("bore", "normal"), Support("front", "mean_y")]


@pytest.mark.parametrize(
    ("dimension", "order", "supports"),
    [(2, 1, [BORE]), (2, 2, [BORE]), (3, 1, [BORE]), slow(3, 1, IN_SPACE), slow(3, 2, [BORE])],
)
def test_contacts_of_a_sector_are_those_of_the_wheel(dimension, order, supports, monkeypatch):
    """Compare forces, slips, displacements and stresses of four shoes on a ring."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-13)
    monkeypatch.setattr(structure, "CLOSED", -1.0)
    monkeypatch.setattr(structure, "MOST_CYCLES", 3)
    part = sector_of(order, dimension=dimension, supports=supports)
    shoes = [turned(shoe(SECTORS, COUNTS, dimension), CYCLIC, k) for k in range(SECTORS)]
    push = PUSH * DEPTH[dimension]
    pushes = [BoundaryForce(f"top_{k}", CYCLIC.turn(k) @ push) for k in range(SECTORS)]
    disk = wheel(sector(SECTORS, COUNTS, dimension), CYCLIC)
    ring = structure_of(disk, shoes, pushes, (), order, supports)
    every = PATH[:, [0, *[1] * SECTORS, 2]]
    mine, theirs = cycle_of(part, PATH), cycle_of(ring, every)
    (one,) = mine.histories
    slides = np.abs(one.slip[1:, 0]).max(axis=0) > 1e-6 * np.abs(one.displacement).max()
    assert slides.any()
    size, slide = np.abs(one.force).max(), np.abs(one.displacement).max()
    for other in theirs.histories:
        np.testing.assert_allclose(one.force, other.force, atol=1e-8 * size)
        np.testing.assert_allclose(one.displacement, other.displacement, atol=1e-8 * slide)
    assert mine.equilibrium.max() < 1e-10

    fields = []
    for joined, cycle, path in ((part, mine, PATH), (ring, theirs, every)):
        all_ = cycle.fields()
        given = [(all_["force"], all_["displacement"])]
        fields += cycle_stresses(joined, given, path, at=1, shown=[0, 2])
    for own, whole, *surfaces in zip(
        fields[0].fields,
        fields[1].fields[:2],
        fields[0].surfaces,
        fields[1].surfaces[:2],
        strict=True,
    ):
        apart = np.linalg.norm(whole.body.points[:, None] - own.body.points[None], axis=2)
        place = apart.argmin(axis=0)
        stress = np.abs(own.stress).max()
        np.testing.assert_allclose(own.stress, whole.stress[:, place], atol=1e-7 * stress)
        reported, of_ring = (surface.stress for surface in surfaces)
        np.testing.assert_allclose(reported, of_ring[:, :, place], atol=1e-7 * stress)
        for name in ("peak", "notch"):
            a, b = getattr(own, name), getattr(whole, name)
            assert a.von_mises == pytest.approx(b.von_mises, rel=1e-7)
            assert a.error == pytest.approx(b.error, rel=1e-6)


def test_forces_do_not_depend_on_how_cuts_are_named():
    """Check that exchanging high and low gives the same structure."""
    forward, backward = (
        cycle_of(sector_of(cyclic=[cyclic]), PATH).histories[0].force
        for cyclic in (CYCLIC, replace(CYCLIC, low=("high",), high=("low",), axis=-Y))
    )
    np.testing.assert_allclose(forward, backward, atol=1e-6 * np.abs(forward).max())


def test_cuts_that_do_not_match_change_little():
    """Compare contact forces with a mortar on the cuts and with matching nodes."""
    exact = cycle_of(sector_of(), PATH).histories[0].force
    tied = cycle_of(sector_of(part=sector(SECTORS, COUNTS, moved=0.3)), PATH).histories[0].force
    change = np.abs(tied - exact).max() / np.abs(exact).max()
    assert 1e-6 < change < 0.02


@pytest.mark.parametrize("moved", [0.0, 0.3])
def test_deformed_cuts_are_images(moved):
    """Check a sliding bore with tied cuts, where only the cuts hold the rotation."""
    part = sector(SECTORS, COUNTS, moved=moved)
    joined = sector_of(part=part, supports=[Support("bore", "xyz")])
    cycle = cycle_of(joined, PATH)
    fields = cycle.fields()
    disk, _ = deformation(joined, fields["force"][1], fields["displacement"][1], PATH[1])
    (pair,), _ = sector_cuts(joined.mesh, [CYCLIC])
    u, low, high = disk.reshape(-1, 2), *(part.vertices(name) for name in ("low", "high"))
    images = u[low] @ pair.of_turn(part).T
    radius = [np.linalg.norm(part.points[nodes], axis=1) for nodes in (low, high)]
    order = [np.argsort(r) for r in radius]
    there = np.stack(
        [np.interp(radius[1][order[1]], radius[0][order[0]], c[order[0]]) for c in images.T], axis=1
    )
    allowed = 1e-10 if moved == 0.0 else 0.05
    np.testing.assert_allclose(u[high][order[1]], there, atol=allowed * np.abs(there).max())


REFUSED = [
    ({"cyclic": [about(sectors=SECTORS, high=("edge",))]}, "no boundary edge on body wheel"),
    (
        {"cyclic": [about(sectors=SECTORS, high=("top",))]},
        "no boundary top on body wheel",
    ),
    ({"cyclic": [about(sectors=5)]}, "is not low turned about the axis by 360°/5"),
    ({"cyclic": [about((0.0, 0.0, 1.0), sectors=SECTORS)]}, "an axis in the plane"),
    (
        {"cyclic": [CYCLIC, about(sectors=8, low=("bore",), high=("rim",))]},
        "the axis or the number",
    ),
    (
        {"cyclic": [CYCLIC, about(sectors=SECTORS, low=("high",), high=("low",))]},
        "pairs of cuts of",
    ),
]


@pytest.mark.parametrize(("changes", "printed"), REFUSED)
def test_wrong_cuts_are_refused(changes, printed):
    with pytest.raises(MeshError, match=printed):
        sector_of(**changes)


@pytest.mark.parametrize(
    ("load", "printed"),
    [
        (Rotation(Y, np.array([1.0, 0.0, 0.0]), 500.0), "a rotation about another axis"),
        (Acceleration(np.array([0.0, 0.0, 9810.0])), "an acceleration across the axis"),
        (Pressure("low", 5.0), "low is on a cut"),
        (Displacement("rim", np.array([0.01, 0.0, 0.0])), "rim meets a cut of structure.cyclic"),
    ],
)
def test_loads_that_are_not_alike_in_all_sectors(load, printed):
    body = turned(shoe(SECTORS, COUNTS), CYCLIC, 0)
    with pytest.raises(MeshError, match=printed):
        structure_of(sector(SECTORS, COUNTS), [body], [load], [CYCLIC], 1)
    structure_of(wheel(sector(SECTORS, COUNTS), CYCLIC), [body], [load][:0], (), 1)


def test_contact_face_that_meets_a_cut():
    """Check the refusal, since it would continue in the next sector."""
    part = sector(SECTORS, COUNTS)
    boundaries = part.mesh.boundaries | {"pad": part.mesh.boundaries["rim"]}
    part = replace(part, mesh=part.mesh.with_boundaries(boundaries))
    with pytest.raises(MeshError, match="contact pad 0 on body wheel"):
        sector_of(part=part)


@pytest.mark.parametrize("moved", [0.0, 0.3])
def test_temperatures_are_alike_on_both_cuts(moved):
    """Check that a function of the radius is accepted, and one that rises along X is not."""
    part, body = sector(SECTORS, COUNTS, moved=moved), turned(shoe(SECTORS, COUNTS), CYCLIC, 0)
    numbers = np.arange(part.mesh.nvertices)
    for changes, alike in ((np.linalg.norm(part.points, axis=1), True), (part.points[:, 0], False)):
        load = NodalTemperature(numbers, changes, "wheel")
        if alike:
            structure_of(part, [body], [load], [CYCLIC], 1)
        else:
            with pytest.raises(MeshError, match="temperatures of body wheel"):
                structure_of(part, [body], [load], [CYCLIC], 1)


def test_heated_sector_is_the_heated_wheel():
    """Compare the stress of a disk with a hotter rim, on the cuts, too."""
    steel = replace(STEEL, expansion=1e-5)
    part, whole = sector(5), wheel(sector(5), about(sectors=5))
    stresses = []
    for body, pairs in ((part, [Cuts.of(part, about(sectors=5))]), (whole, [])):
        elastic = ElasticBody(body, steel)
        hot = 1e-5 * np.linalg.norm(body.points, axis=1)
        constraints = Constraints(len(elastic.nodes), 2)
        constraints.hold(elastic.boundary_nodes("bore"))
        for pair in pairs:
            pair.tie(constraints, elastic)
        pad = body.vertices("pad")
        given = constraints, pad, np.tile(np.eye(2), (len(pad), 1, 1))
        load = elastic.thermal_load(hot)[:, None]
        held = SupportedBody(elastic, *given, load, thermal=hot[:, None], cuts=pairs)
        moved, _ = held.respond(np.zeros(2 * len(pad)), np.ones(1))
        stresses.append(held.recovery.stress(moved, hot))
    apart = np.linalg.norm(whole.points[:, None] - part.points[None], axis=2)
    scale = np.abs(stresses[1]).max()
    np.testing.assert_allclose(stresses[0], stresses[1][:, apart.argmin(axis=0)], atol=1e-8 * scale)


def test_bolts_shift_cuts_alike():
    """Check that bolts shift cuts along the axis, or not at all."""
    part = sector(SECTORS, COUNTS, 3)
    pair, nothing = Cuts.of(part, CYCLIC), np.zeros((len(part.points), 3, 1))
    within, along, across = nothing.copy(), nothing.copy(), nothing.copy()
    within[part.vertices("pad")] = 1.0
    along[:, 1] = across[:, 0] = 1.0
    for jumps in (nothing, within, along):
        check_jumps(part, jumps.reshape(-1, 1), [pair])
    with pytest.raises(MeshError, match="not the same in all sectors"):
        check_jumps(part, across.reshape(-1, 1), [pair])
