"""The link of a structure to the half-space, against contacts with known solutions."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import Delaunay

from fe_models.meshes.structure_mesh import Face
from fe_models.meshes.transfer import FaceTransfer
from sa_solver.half_space.operator import HalfSpace
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, ElasticPair, Frame, Grid, Material
from tests.oracles.elastic_layer import layer_compliance, press
from wear.contact.drive import Drive
from wear.contact.face_loads import CycleLoads
from wear.contact.interface import FirstContact, InterfaceContact
from wear.contact.link import linked
from wear.contact.settings import InterfaceSettings
from wear.laws import EnergyLaw
from wear.steps.implicit import ImplicitStepper

BODY, RIGID = Material(100e3, 0.3), Material(np.inf, 0.3)
# A face of 10 mm and a cylinder that touches 5 of them, in N/mm and mm.
WIDTH, RADIUS, LOAD = 10.0, 400.0, 300.0
GRID = Grid.line_contact(WIDTH, 256)
GAP = GRID.x**2 / (2.0 * RADIUS)
PAIR = ElasticPair(RIGID, BODY)


def line_face(nodes: int, width: float = WIDTH) -> Face:
    """Return a face with ``count`` nodes along x."""
    x = np.linspace(-0.5 * width, 0.5 * width, nodes)
    coordinates = np.stack([x, np.zeros(nodes)], axis=1)
    segments = np.stack([np.arange(nodes - 1), np.arange(1, nodes)], axis=1)
    return Face("pad", Frame(np.zeros(3), np.eye(3)), coordinates, segments)


def contact(face: Face, grid: Grid = GRID, **settings) -> InterfaceContact:
    given = {
        "name": "pad",
        "grid": grid,
        "gap": GAP,
        "transfer": FaceTransfer.between(face, grid),
        "pair": PAIR,
        "laws": (EnergyLaw(0.0), EnergyLaw(1e-9)),
        "friction": lambda energy: 0.4,
        "stepper": ImplicitStepper(None),
    }
    return InterfaceContact(InterfaceSettings(**(given | settings)))


def pressed(face: Face, force: Array, displacement: Array, pressure: float = LOAD) -> CycleLoads:
    """Return a cycle that presses and releases, with fields ``(n,)`` along z."""
    zero = np.zeros(2)
    loads = LoadHistory(np.array([pressure, 0.0]), *(zero,) * 7, sliding=zero > 0.0)
    nodal = np.zeros((2, 2, 3, len(face)))
    nodal[:, 0, 2] = force, displacement
    return CycleLoads(loads, np.zeros((2, 2, len(face))), *nodal)


def on_layer(face: Face, depth: float) -> CycleLoads:
    """Return the cylinder on a layer, as the nodes of its surface see it."""
    x, areas = face.coordinates[:, 0], face.facet_shares
    compliance = layer_compliance(x, x[1] - x[0], PAIR.contact_modulus, depth, hats=True)
    pressure = press(compliance, x**2 / (2.0 * RADIUS), areas, LOAD)
    return pressed(face, pressure * areas, compliance @ pressure)


def first(stage: InterfaceContact, loads: CycleLoads) -> FirstContact:
    return stage.begin(loads, 1e3)[1]


def pressure_of(stage: InterfaceContact, loads: CycleLoads) -> Array:
    """Return the pressure across the unworn contact ``(nx,)``."""
    return first(stage, loads).pressure[0, :, 0]


def layer_pressure(depth: float) -> Array:
    """Return the pressure on the layer, from its compliance on the cells."""
    x = GRID.x.ravel()
    compliance = layer_compliance(x, GRID.pitch[0], PAIR.contact_modulus, depth, hats=False)
    return press(compliance, GAP.ravel(), np.full(len(x), GRID.pitch[0]), LOAD)


# --- a layer on a rigid base ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("depth", "nodes", "wrong", "left"),
    [(5.0, 11, 0.01, 1e-3), (5.0, 41, 0.01, 1e-3), (2.0, 21, 0.07, 0.012), (2.0, 41, 0.07, 2e-3)],
)
def test_layer_on_a_rigid_base(depth: float, nodes: int, wrong: float, left: float) -> None:
    """Nodes of a layer pass its compliance to the half-space, with a few nodes across the contact.

    The contact is 2.2 to 2.4 mm wide. Without the link the error of the half-space within it is
    more than ``wrong`` of the largest pressure, with the link less than ``left``.
    """
    face, exact = line_face(nodes), layer_pressure(depth)
    loads, inner = on_layer(face, depth), exact > 0.5 * exact.max()
    for link, wanted in (("half_space", False), ("corrected", True)):
        pressure = pressure_of(contact(face, link=link), loads)
        error = float(np.abs(pressure - exact)[inner].max() / exact.max())
        assert error < left if wanted else error > wrong


def test_error_falls_with_the_mesh_and_is_reported() -> None:
    """For a layer thinner than the width of the contact, the residual is about the error."""
    exact, errors = layer_pressure(1.0), []
    inner = exact > 0.5 * exact.max()
    for nodes, reported in ((21, True), (41, False), (81, False)):
        face = line_face(nodes)
        result = first(contact(face), on_layer(face, 1.0))
        pressure = result.pressure[0, :, 0]
        errors.append(float(np.abs(pressure - exact)[inner].max() / exact.max()))
        left = float(np.hypot(*result.link.quality[1:]))
        assert 0.5 * left < errors[-1] < 3.0 * left
        assert result.link.coarse is reported
        assert not result.link.grainy
    assert errors[0] < 0.07
    assert errors[1] < 0.3 * errors[0]
    assert errors[2] < 0.3 * errors[1]


# --- bodies that are half-spaces, and what does not count -----------------------------------------


def on_half_space(face: Face) -> CycleLoads:
    """Return a pressure similar to the cylinder's, and its displacement of half-planes."""
    x, areas = face.coordinates[:, 0], face.facet_shares
    pressure = np.sqrt(np.maximum(0.0, 1.0 - (x / 2.4) ** 2))
    force = LOAD * pressure * areas / (pressure @ areas)
    fine = Grid.line_contact(WIDTH, 4096)
    transfer = FaceTransfer.between(face, fine)
    deflection = HalfSpace(fine, PAIR).normal(transfer.spread(force))
    return pressed(face, force, transfer.sample(deflection))


def test_bodies_that_are_half_spaces_add_nothing() -> None:
    """The link vanishes but for the discrete hats: a thousandth of the deflection."""
    face = line_face(21)
    loads = on_half_space(face)
    corrected, plain = first(contact(face), loads), first(contact(face, link="half_space"), loads)
    assert corrected.link.quality[0] < 1e-3
    assert not plain.link.corrects
    apart = np.abs(corrected.pressure - plain.pressure).max()
    assert apart < 2e-3 * plain.pressure.max()


def test_rigid_motions_change_nothing_where_forces_are_imposed() -> None:
    face = line_face(21)
    loads = on_layer(face, 2.0)
    moved = loads.displacement + (3.0 - 0.2 * face.coordinates[:, 0])
    one, other = (
        pressure_of(contact(face), replace(loads, displacement=displacement))
        for displacement in (loads.displacement, moved)
    )
    np.testing.assert_allclose(one, other, atol=1e-6 * one.max())


def test_a_tilt_that_is_held_is_that_of_the_structure() -> None:
    """Half-spaces that are turned by 1e-3 before they are held act as tilted gaps."""
    face, tilt = line_face(21), 1e-3
    loads = on_half_space(face)
    turned = replace(loads, displacement=loads.displacement + tilt * face.coordinates[:, 0])
    held = pressure_of(contact(face, drive=Drive.by_forces("held")), turned)
    gap = GAP + tilt * GRID.x
    imposed = pressure_of(
        contact(face, drive=Drive.by_forces("held"), link="half_space", gap=gap), loads
    )
    np.testing.assert_allclose(held, imposed, atol=5e-3 * imposed.max())


def test_open_faces_are_linked_as_half_spaces() -> None:
    face = line_face(21)
    loads = replace(on_layer(face, 2.0), force=None)
    assert not first(contact(face), loads).link.corrects


def test_one_node_determines_no_link() -> None:
    """A contact narrower than the mesh is that of half-spaces."""
    face = line_face(5)
    assert not first(contact(face), on_layer(face, 0.5)).link.corrects


# --- the fit --------------------------------------------------------------------------------------


def test_a_round_face_gives_nothing_wild_in_its_corners() -> None:
    """Under a square grid, d beyond a disk of nodes is that of the nearest node."""
    x, y = np.meshgrid(np.linspace(-5.0, 5.0, 21), np.linspace(-5.0, 5.0, 21))
    nodes = np.stack([x.ravel(), y.ravel()], axis=1)
    nodes = nodes[np.hypot(*nodes.T) < 5.1]
    facets = Delaunay(nodes).simplices
    face = Face("disk", Frame(np.zeros(3), np.eye(3)), nodes, facets)
    transfer = FaceTransfer.between(face, Grid.covering((12.0, 12.0), (48, 48)))
    force = np.zeros((1, 3, len(face)))
    force[0, 2] = np.hypot(*nodes.T) < 4.0
    known = 1e-3 * np.cos(0.6 * nodes[:, 0]) * np.cos(0.6 * nodes[:, 1])
    loads = LoadHistory(force[:, 2].sum(axis=1), *(np.zeros(1),) * 7, sliding=np.zeros(1, bool))
    half_space = HalfSpace(transfer.grid, PAIR)
    link = linked(half_space, transfer, loads, force, np.broadcast_to(known, force.shape), False)
    d = link.fields(transfer.places)[0, 0]
    assert np.ptp(d) < 1.2 * np.ptp(known)
