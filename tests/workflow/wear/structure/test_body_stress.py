"""Tests of the stress of a body under its contact: meshes, the other method, balances."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from skfem import MeshTet

from fe_models.elasticity.stress import StressField
from fe_models.meshes.structure_mesh import Body, Face
from fe_models.meshes.transfer import FaceTransfer
from sa_solver.half_space.subsurface import SubsurfaceStress
from sa_solver.types import Array, Frame, Grid, Material
from tests.conftest import CASES
from wear.cracking.bulk_stress import SIDE
from wear.cracking.life import ruiz, smith_watson_topper
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.translation import face_contact
from workflow.kinds import load_case
from workflow.models.contact import FaceContact
from workflow.models.stress.body_stress import (
    Planes,
    StressedBody,
    StressedCycle,
    with_known_shear,
)
from workflow.models.stress.settings import Stress
from workflow.models.structure import StructureLoads

PLANE = CASES / "dovetail_2d.yaml"
COARSE = (
    *("mesh={flank_nodes: [12, 10], size: 8 mm, order: 1}", "contact.grid=[64, 64]"),
    "load_path.increments=[3, 5]",
)
FRICTION = 0.4
DEPTH = 0.02
FLAT = Frame(np.zeros(3), np.eye(3))


@dataclass
class Flank:
    """Unworn intrados of the section."""

    source: StructureLoads
    stage: FaceContact
    cycle: StressedCycle
    stuck: Array
    planes: Planes
    bodies: tuple[StressedBody, StressedBody]

    @classmethod
    def of(cls, *overrides: str) -> "Flank":
        case = load_case(PLANE, overrides)
        source = loads_of(case)
        assert isinstance(source, StructureLoads)
        stress = source.stresses({"unworn": source.unworn_cycle})["unworn"]
        stage, loads = face_contact(case, source.faces[0]), source.unworn()[0]
        given = stage.contact.unworn_tractions(loads, stage.contact.begin(loads, 1.0)[1])
        known = with_known_shear(stage, given, loads)
        cycle = StressedCycle(known, loads, stress.faces[0], stress.fields)
        bodies = StressedBody(stage, case.material(1), 1), StressedBody(stage, case.material(2), 2)
        return cls(
            source, stage, cycle, given.unknown, Planes(case.stress.described(), stage.grid), bodies
        )

    def history(self, body: int, cycle: StressedCycle | None = None) -> Array:
        """Return the stress at the critical distance ``(t, 6, nx)``."""
        cycle, stressed = cycle or self.cycle, self.bodies[body - 1]
        known = np.ones(len(self.stuck), dtype=bool)
        return stressed.history(cycle, stressed.bulk(cycle), DEPTH, known)[..., 0]


@pytest.fixture(scope="module")
def coarse() -> Flank:
    return Flank.of(*COARSE)


def bare(cycle: StressedCycle) -> StressedCycle:
    """Return the cycle without what the structure knows about its bodies."""
    return StressedCycle(cycle.tractions, cycle.loads)


@pytest.mark.parametrize("body", [1, 2])
def test_without_a_structure_it_is_that_of_the_tractions(coarse: Flank, body) -> None:
    alone, peak, planes = bare(coarse.cycle), coarse.source.peak, coarse.planes
    stressed = coarse.bodies[body - 1]
    solver = SubsurfaceStress(coarse.stage.grid, stressed.material, body)
    assert stressed.bulk(alone) is None
    section = stressed.section(alone, None, planes, peak)
    for depth, column in zip(planes.depths, np.moveaxis(section, 2, 0), strict=True):
        direct = solver.at_depth(alone.traction(peak), float(depth))[..., 0]
        np.testing.assert_allclose(column, direct, atol=1e-10 * np.abs(direct).max())
    known = np.arange(len(coarse.stuck)) != peak
    history = stressed.history(alone, None, DEPTH, known)
    assert not history[peak].any()
    direct = solver.at_depth(alone.traction(1), DEPTH)
    np.testing.assert_allclose(history[1], direct, atol=1e-10 * np.abs(direct).max())


@pytest.mark.parametrize("body", [1, 2])
def test_the_largest_tension_is_that_of_the_history(coarse: Flank, body) -> None:
    stressed, known = coarse.bodies[body - 1], coarse.stuck < 0.5
    bulk = stressed.bulk(coarse.cycle)
    history = stressed.history(coarse.cycle, bulk, DEPTH, known)
    expected = ruiz(history, np.zeros(history.shape[2:])).tension
    tension = stressed.tension(coarse.cycle, bulk, DEPTH, known)
    assert tension.max() > 0.0
    np.testing.assert_allclose(tension, expected, atol=1e-12 * expected.max())


@pytest.mark.parametrize("body", [1, 2])
def test_below_one_element_it_is_that_of_the_mesh(coarse: Flank, body) -> None:
    """Fine and nodal tractions differ by self-balanced tractions over a length h of 1-2 elements.

    Within the contact such a traction stresses a half-space like exp(-2πz/h); at the edge, where
    its moment does not vanish, like (h/z)² (Saint-Venant; Johnson 1985, 2.5).
    """
    stressed, peak, planes = coarse.bodies[body - 1], coarse.source.peak, coarse.planes
    field, frame = coarse.cycle.fields[body - 1], coarse.stage.face.frame
    whole = field.body.depth("intrados")
    assert whole == pytest.approx(1.0, abs=0.15)  # 11 mm over 11 elements
    planes = Planes(coarse.planes.settings, coarse.stage.grid)
    planes.depths = whole * np.array([0.05, 1.01, 2.0])
    section = stressed.section(coarse.cycle, stressed.bulk(coarse.cycle), planes, peak)
    heights = SIDE[body] * planes.depths
    mesh = field.at(planes.points(heights), frame).reshape(section.shape)
    error = np.abs(section - mesh) / np.abs(mesh).max()
    inside = np.abs(planes.along) < 2.0  # two elements from the edges
    assert error[..., 0].max() > 0.3
    assert error[:, inside, 1].max() < 0.03
    assert error[..., 1].max() < 0.15
    assert error[..., 2].max() < 0.3 * error[..., 1].max() + 0.01


def test_nothing_jumps_at_the_depth_of_an_element(coarse: Flank) -> None:
    settings = coarse.planes.settings
    for body, stressed in zip((1, 2), coarse.bodies, strict=True):
        whole = coarse.cycle.fields[body - 1].body.depth("intrados")
        planes = Planes(settings, coarse.stage.grid)
        planes.depths = whole * np.array([1.0 - 1e-6, 1.0 + 1e-6])
        peak, bulk = coarse.source.peak, stressed.bulk(coarse.cycle)
        above, below = np.moveaxis(stressed.section(coarse.cycle, bulk, planes, peak), 2, 0)
        assert np.nanmax(np.abs(above - below)) < 1e-4 * np.nanmax(np.abs(above))


def test_increments_that_stick_balance_their_shear(coarse: Flank) -> None:
    tractions, loads = coarse.cycle.tractions, coarse.cycle.loads.loads
    assert coarse.stuck.max() > 0.5
    assert not tractions.unknown.any()
    sheared = tractions.shear.sum(axis=(2, 3)).T * coarse.stage.grid.cell_area
    scale = FRICTION * loads.P.max()
    for t in np.flatnonzero(coarse.stuck > 0.1):
        np.testing.assert_allclose(sheared[:, t], [loads.Qx[t], loads.Qy[t]], atol=1e-9 * scale)
    size = np.hypot(tractions.shear[:, 0], tractions.shear[:, 1])
    assert np.all(size <= FRICTION * tractions.pressure * (1.0 + 1e-9))


def test_unloaded_flanks_are_not_stressed(coarse: Flank) -> None:
    """The stress vanishes in the last increment of the mission, in which nothing spins."""
    for body in (1, 2):
        history = coarse.history(body)
        assert np.abs(history[-1]).max() < 1e-9 * np.abs(history).max()


@pytest.mark.parametrize("body", [1, 2])
def test_there_is_no_stress_where_the_body_is_not(body) -> None:
    """A foot over x > 0 on a plate over x < 1 is pressed, on a grid from -2 to 2 mm."""
    reach = {1: (-2.0, 1.0), 2: (0.0, 2.0)}
    faces, fields = {}, []
    for number, (low, high) in reach.items():
        x, z = np.linspace(low, high, 7), SIDE[number] * np.linspace(0.0, 1.0, 4)
        mesh = MeshTet.init_tensor(x, np.linspace(-2.0, 2.0, 5), np.sort(z))
        solid = Body("", mesh.with_boundaries({"face": lambda p: p[2] == 0.0}))
        nodes, facets = np.unique(solid.facets("face"), return_inverse=True)
        corners = solid.points[nodes, :2]
        faces[number] = Face("face", FLAT, corners, facets.reshape(-1, 3))
        still, free = np.zeros((mesh.nvertices, 3)), np.zeros((6, mesh.nvertices))
        fields.append(StressField(solid, still, free, None, None))
    grid = Grid.over((4.0, 4.0), (16, 8), line=False)
    to = {number: FaceTransfer.between(face, grid) for number, face in faces.items()}
    stage = SimpleNamespace(grid=grid, transfer=to[2], transfer_of=to.get, face=faces[2])
    pressed = np.ones((1, *grid.shape))
    loads = SimpleNamespace(force=np.zeros((1, 3, len(faces[2]))))
    tractions = SimpleNamespace(pressure=pressed, shear=np.zeros((1, 2, *grid.shape)))
    stressed = StressedBody(stage, Material(1.0, 0.3), body)
    cycle = StressedCycle(tractions, loads, fields=tuple(fields))
    history = stressed.history(cycle, None, DEPTH, np.array([True]))
    low, high = reach[body]
    there = (grid.x[:, 0] > low) & (grid.x[:, 0] < high)
    assert history[0, 2][there].max() < 0.0
    assert not history[0, :, ~there].any()
    planes = Planes(Stress(depth=0.9), grid)
    past = SimpleNamespace(increment=lambda _: past, at=lambda row, z: np.zeros((1, 6, 16, len(z))))
    section = stressed.section(cycle, past, planes, 0)
    assert np.isfinite(section[:, there]).all()
    assert np.isnan(section[:, ~there]).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "bounds"),
    [
        (("mesh={flank_nodes: [20, 34], size: 5 mm, notch: 48, order: 1}",), (0.05, 0.06)),
        ((), (0.025, 0.045)),
    ],
    ids=["20 nodes", "as shipped"],
)
def test_a_fine_mesh_finds_the_same_next_to_the_face(settings, bounds) -> None:
    """Tension along the face at 0.1 mm agrees with 321 nodes of order 2, 0.034 mm apart.

    The tolerance is relative to the largest value. It excludes two cells at either edge of the
    contact, and the elements at the corners of the flank, where fillets begin. Half-spaces are off
    by half.
    """
    depth = 0.1
    fine, found = Flank.of("mesh.flank_nodes=[321, 35]"), Flank.of(*settings)
    x, pitch = found.stage.grid.x[:, 0], found.stage.grid.pitch[0]
    peak, frame = found.source.peak, found.stage.face.frame
    edges = x[found.cycle.tractions.pressure[peak, :, 0] > 0.0][[0, -1]]
    beside = np.all(np.abs(x[:, None] - edges) > 2.5 * pitch, axis=1)
    contact = beside & (x > edges[0]) & (x < edges[1])
    nodes = np.sort(found.source.mesh.interfaces[0].coordinates[:, 0])
    places = contact, beside & (np.abs(x) < nodes[-1] - 0.5 * np.diff(nodes).max())
    for body in (1, 2):
        points = np.stack([x, 0.0 * x, np.full_like(x, SIDE[body] * depth)], axis=1)
        right = fine.cycle.fields[body - 1].at(points, frame)[0]
        stressed = found.bodies[body - 1]
        known = np.ones(len(found.stuck), dtype=bool)
        errors = []
        for cycle in (found.cycle, bare(found.cycle)):
            tension = stressed.history(cycle, stressed.bulk(cycle), depth, known)[peak, 0, :, 0]
            error = np.abs(tension - right) / np.abs(right).max()
            errors += [error[place].max() for place in places]
        bulk = stressed.bulk(found.cycle)
        assert bulk is not None
        # What the mesh itself leaves is not told: all there is on elements of second order.
        assert errors[0] < max(3.0 * bulk.rest.residual, 0.01)
        assert errors[0] < bounds[0]
        assert errors[1] < bounds[1]
        assert errors[2] > 0.4


@pytest.mark.slow
def test_where_it_sticks_it_is_as_with_friction_of_the_half_space() -> None:
    """An independent method agrees; its shear below the resolution of the mesh is its own."""
    nodes = Flank.of()
    own = Flank.of("contact.method=full")
    assert nodes.stuck.max() > 0.9
    assert not own.stuck.any()
    for body in (1, 2):
        values = [
            smith_watson_topper(flank.history(body), flank.bodies[0].material).value
            for flank in (nodes, own)
        ]
        assert values[0].max() == pytest.approx(values[1].max(), rel=2e-3)
