"""Tests of measured surfaces on mesh faces and file loads, compared with the given form."""

import json
import pickle

import numpy as np
import pytest
from ruamel.yaml import YAML

from fe_models.meshes.remesh import form_of
from fe_models.meshes.transfer import FaceTransfer
from sa_solver import ElasticPair, Grid, Material
from sa_solver.reference.hertz import HertzCylinder
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import pressed_blocks, refused, run
from tests.workflow.wear.mesh.plane_blocks import RADIUS, Blocks, solved
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.structures.mesh.model import mesh_assembly
from workflow.kinds import load_case

pytestmark = pytest.mark.usefixtures("reads_here")

PLANE = Blocks((-40, 40), 40, (-20, 20), 20, (-14, 14), line_contact=128)
BARE = {"unit": "mm", "level": "none"}


def with_surfaces(path, **surfaces):
    """Return the case with measured surfaces instead of a gap in its only contact."""
    case = YAML(typ="safe").load(path.read_text("utf-8"))
    (contact,) = case["structure"]["contacts"]
    contact.pop("gap", None)
    contact["surfaces"] = surfaces
    with path.open("w", encoding="utf-8") as stream:
        YAML().dump(json.loads(json.dumps(case)), stream)
    return path


def test_a_form_from_scans_is_the_form(tmp_path):
    """A cylinder, partly on either body and off-centre, agrees in half-space and nodes.

    Nodes have the straight lines next to the arc where they had its points, 4e-5 mm apart; the
    force of a node at the edge of the contact, which this moves, is off by 5e-4 of the largest.
    """
    path = PLANE.press(tmp_path, 1.0, 50.0)
    nodes, _, given = solved(path)
    x = (np.arange(120) + 0.5) / 120 * 48.0 - 24.0
    np.save(tmp_path / "lower.npy", -0.3 * x[:, None] ** 2 / (2.0 * RADIUS))
    np.save(tmp_path / "upper.npy", -0.7 * (x[:, None] - 1.5) ** 2 / (2.0 * RADIUS))
    scan = {**BARE, "pitch": [0.4, 1.0]}
    with_surfaces(
        path,
        body_1={"file": "lower.npy", **scan},
        body_2={"file": "upper.npy", "shift": [-1.5, 0], **scan},
    )
    scanned, _, first = solved(path)
    assert first.link.corrects
    largest = given.pressure.max()
    np.testing.assert_allclose(first.pressure, given.pressure, rtol=0.0, atol=1e-5 * largest)
    pulled = nodes.force[:, 2]
    np.testing.assert_allclose(scanned.force[:, 2], pulled, rtol=0.0, atol=1e-3 * pulled.max())
    np.testing.assert_allclose(scanned.loads.P, [50.0, 25.0], rtol=1e-5)
    # Meshes that are written have the form on body 2.
    mesh = mesh_assembly(load_case(path)).meshed()
    (face,), form = mesh.interfaces, form_of(mesh)
    np.testing.assert_allclose(form[1][face.nodes_2, 1], face.gap, atol=1e-12)


def test_scans_on_a_shape_are_there_in_another_process_and_on_a_finer_mesh(tmp_path):
    """Probe runs in the plane wear in a process of their own; a sum of gaps goes there too."""
    path, scan = PLANE.press(tmp_path, 1.0, 50.0), {**BARE, "pitch": [0.4, 1.0]}
    np.save(tmp_path / "lower.npy", np.linspace(0.0, 1e-3, 120)[:, None])
    shape = YAML(typ="safe").load(path.read_text("utf-8"))["structure"]["contacts"][0]["gap"]
    with_surfaces(path, body_1={"file": "lower.npy", **scan})
    model = mesh_assembly(load_case(path, [f"structure.contacts.0.gap={json.dumps(shape)}"]))
    (face,) = model.meshed().interfaces
    sent = pickle.loads(pickle.dumps(model))
    (finer,) = sent.finer_mesh().structure.meshed().interfaces  # with the same vertices
    np.testing.assert_allclose(finer.gap, face.gap, atol=1e-12)


@pytest.fixture
def blocks(tmp_path):
    """Return a cube of 1 mm on one of 2 mm, and scans of 1.2 mm: a plane, and waves of 0.2 mm."""
    x, y = np.meshgrid(*2 * [(np.arange(120) + 0.5) / 100 - 0.6], indexing="ij")
    np.save(tmp_path / "plane.npy", 1e-3 * x - 2e-3 * y)
    np.save(tmp_path / "waves.npy", 1e-3 * np.sin(2 * np.pi * x / 0.2))
    return pressed_blocks(tmp_path)


SCAN = {**BARE, "pitch": [0.01, 0.01]}


def test_planes_are_exact_on_nodes_and_cells(blocks):
    """Planes of either body are seen from its own side, or from the other if flipped."""
    for body, flipped, sign in ((1, False, 1), (2, False, -1), (2, True, 1), (1, True, -1)):
        scan = {"file": "plane.npy", "flipped": flipped, **SCAN}
        case = load_case(with_surfaces(blocks, **{f"body_{body}": scan}))
        model = mesh_assembly(case)
        (face,) = model.meshed().interfaces

        def gap(x, y, sign=sign):
            return -1e-3 * x + sign * 2e-3 * y

        # Eight cells a facet: 1/128 of the rise of 1.5 µm over each.
        np.testing.assert_allclose(face.gap, gap(*face.coordinates.T), atol=1.5e-3 / 128)
        contact = model.contact_face(face)
        grid = contact.grid((24, 20))
        inside = contact.gap(grid.x, grid.y)
        np.testing.assert_allclose(inside, gap(grid.x, grid.y), atol=1e-12)


def test_the_part_of_a_scan_lost_by_nodes_is_reported(blocks):
    """Waves are a fifth of the face long, elements a half."""
    case = load_case(with_surfaces(blocks, body_1={"file": "waves.npy", **SCAN}))
    (face,) = case.scanned()
    # Their mean over the face is that of the waves, which is none.
    assert abs(face.face.nodal_areas @ face.at_nodes()) < 1e-9
    numbers = face.summary()["body_1"]
    assert 0.9 < numbers["lost_by_nodes"] / numbers["rms_on_grid"] < 1.0
    ((name, reported),) = face.outline()
    assert name == "surface 1"
    assert reported.startswith("foot: 120 x 120 points 10 µm apart, 0.707 µm rms, ")
    assert reported.endswith(" µm finer than the nodes")
    grid = Grid.over(face.grid.size, (8, 8), line=False)
    transfer = FaceTransfer.between(face.face, grid)
    cells = np.random.default_rng(0).normal(size=grid.shape)
    balance = face.face.nodal_areas @ transfer.fitted(cells) - cells.sum() * grid.cell_area
    assert abs(balance) < 1e-12


def test_scans_that_do_not_fit_a_face_are_refused(blocks):
    place = "structure.contacts.0.surfaces.body_1.file"
    with_surfaces(blocks, body_1={"file": "plane.npy", "shift": [0.2, 0], **SCAN})
    printed = refused(blocks)
    assert f"{place}: " in printed
    assert "1.2 mm x 1.2 mm, ends within the grid of 1 mm x 1 mm where it is put" in printed
    mirrored = "structure.contacts.0.surfaces.body_1.beyond=mirrored"
    reported = invoke("check", blocks, "--set", mirrored).stdout
    assert "mirrored over 12.5 % of the grid, middle at 0.2 mm, 0 mm" in reported


def test_a_scan_on_flat_bodies_is_pressed_as_a_cylinder(tmp_path):
    """The peak exceeds Hertz's by 1.03 %, as with the form given: bodies are no half-planes.

    Elements are two thirds of the half-width of the contact.
    """
    steel = Material(200e3, 0.3)
    hertz = HertzCylinder(250.0, 30.0, ElasticPair(steel, steel).contact_modulus)
    blocks = Blocks((-15, 15), 12, (-6, 6), 10, (-1, 1), line_contact=512, materials=({}, {}))
    path = blocks.press(tmp_path, 0.2, 250.0)
    x = (np.arange(600) + 0.5) / 600 * 13.0 - 6.5
    np.save(tmp_path / "upper.npy", -(x[:, None] ** 2) / 60.0)
    with_surfaces(path, body_2={"file": "upper.npy", **BARE, "pitch": [13.0 / 600, 1.0]})
    _, _, first = solved(path)
    assert first.pressure.max() == pytest.approx(hertz.peak_pressure, rel=0.015)


def test_half_a_face_takes_scans_that_are_their_own_image(tmp_path):
    """Its nodes have the values of the whole; other scans are refused."""
    x = (np.arange(150) + 0.5) * 0.4 - 30.0
    np.save(tmp_path / "arc.npy", -(x[:, None] ** 2) / (2.0 * RADIUS))
    np.save(tmp_path / "slope.npy", 1e-3 * x[:, None])
    scan = {**BARE, "pitch": [0.4, 1.0]}
    found = []
    for half, low in ((False, -40), (True, 0)):
        blocks = Blocks(
            (low, 40), 40, (low // 2, 20), 20, (low // 2, 14), line_contact=127, half=half
        )
        path = with_surfaces(blocks.press(tmp_path, 1.0, 50.0), body_2={"file": "arc.npy", **scan})
        (face,) = mesh_assembly(load_case(path)).meshed().interfaces
        found.append(dict(zip(np.round(face.coordinates[:, 0], 6), face.gap, strict=True)))
    whole, part = found
    assert min(part) == 0.0
    for place, gap in part.items():
        assert gap == pytest.approx(whole[place], abs=1e-12)
    printed = refused(with_surfaces(path, body_1={"file": "slope.npy", **scan}))
    assert "body_1.file: " in printed
    assert "slope.npy: not symmetric about the plane of symmetry across x" in printed


@pytest.mark.slow
def test_a_run_keeps_what_was_measured(blocks, tmp_path):
    """For flat wearing blocks, the unworn lower surface is the scan, and so is the gap."""
    with_surfaces(blocks, body_1={"file": "waves.npy", **SCAN})
    summary = run(blocks, tmp_path / "out")
    reported = summary["surfaces"]["foot"]["body_1"]
    assert reported["lost_by_nodes"] > 0.9 * reported["rms_on_grid"]
    for unworn in (["--unworn"], []):
        file = tmp_path / f"lower{len(unworn)}.npz"
        ended = invoke("surface", tmp_path / "out", file, "--body", "1", *unworn)
        assert ended.exit_code == 0, ended.stderr
    before, after = (np.load(tmp_path / f"lower{n}.npz")["heights"] for n in (1, 0))
    case = load_case(blocks)
    (face,) = case.scanned()
    scan = face.surfaces.on(face.grid)["body_1"].heights
    np.testing.assert_allclose(before, scan, atol=1e-12)
    assert (before - after).min() > -1e-12
    assert (before - after).max() > 0.0


def test_loads_from_a_file_take_them_too(tmp_path):
    """The form comes from a scan alone, without a gap, per interface: means over the cells."""
    (tmp_path / "loads.csv").write_text(
        "P [N],Qx [N],Qy [N],Mz [N*mm],Edx [mJ],Edy [mJ]\n100,0,0,0,0,0\n100,5,0,0,0,0\n",
        encoding="utf-8",
    )
    x, y = np.meshgrid(*2 * [(np.arange(90) + 0.5) / 30 - 1.5], indexing="ij")
    np.save(tmp_path / "cap.npy", -(x**2 + y**2) / 200.0)
    scan = {"file": "cap.npy", **BARE, "pitch": [1.0 / 30, 1.0 / 30]}
    steel = {"young": "200 GPa", "poisson": 0.3}
    wears = {"coefficient": "1e3 um^3/J"}
    case = {
        "title": "A cap",
        "analysis": "wear",
        "structure": {
            "kind": "resultants",
            "file": "loads.csv",
            "size": [2.0, 2.0],
            "surfaces": {"body_2": scan},
        },
        "materials": {"body_1": steel, "body_2": steel},
        "friction": {"coefficient": 0.5},
        "contact": {"grid": [32, 32]},
        "wear": {"law": "energy", "body_1": wears, "body_2": wears, "cycles": 10},
    }
    with (tmp_path / "case.yaml").open("w", encoding="utf-8") as stream:
        YAML().dump(case, stream)
    loaded = load_case(tmp_path / "case.yaml")
    (face,) = loads_of(loaded).faces
    grid = face.grid((32, 32))
    # Points of a pitch of 1/30, taken for means, are 1/30² / 24 R below them along each axis.
    exact = (grid.x**2 + grid.y**2) / 200.0
    off = face.gap(grid.x, grid.y) - exact
    assert np.ptp(off) < 1e-12
    rows = dict(loaded.outline())
    assert rows["surface 2"].startswith("interface: 90 x 90 points")
    assert "plane" in rows["face"]
