"""Tests of measured surfaces on the flanks of the dovetail: forms, balance, symmetry."""

import numpy as np
import pytest

from fe_models.meshes.remesh import form_of
from sa_solver.surfaces.shapes import rounded_edge
from tests.conftest import CASES
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import settings
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.analyses.wear.translation import face_contact
from workflow.kinds import load_case

PLANE, SPACE = CASES / "dovetail_2d.yaml", CASES / "dovetail_small.yaml"
BARE = {"unit": "mm", "level": "none"}
FLANKS = {"intrados": 1, "extrados": -1}


def solved(path, *changes):
    """Return loads of both flanks, and the first cycle of their contacts."""
    case = load_case(path, list(changes))
    source = loads_of(case)
    pairs = zip(source.unworn(), source.faces, strict=True)
    return [
        (history.loads, face_contact(case, face).contact.begin(history, 1.0)[1])
        for history, face in pairs
    ]


def surfaces(**flanks):
    return f"structure.surfaces={flanks}"


def scan(folder, name, heights, pitch):
    """Write heights [mm] to a file and return its entry."""
    np.save(folder / f"{name}.npy", heights)
    return {**BARE, "file": str(folder / f"{name}.npy"), "pitch": list(pitch)}


def test_a_finer_mesh_of_the_joint_has_the_scans_at_its_own_nodes(tmp_path):
    """A slope is that of the scan within the steps of eight cells a facet, half of 1.2 mm / 8."""
    x, tilt = (np.arange(1100) + 0.5) / 100.0 - 5.5, 1e-4
    slope = scan(tmp_path, "slope", -tilt * x[:, None], (0.01, 1.0))
    sets = "mesh.flank_nodes=[11, 9]", "mesh.size=8 mm", "contact.grid=[64, 1]"
    joints = [
        dovetail_joint(load_case(PLANE, [*sets, *given])).section().finer_mesh().structure
        for given in ([], [surfaces(intrados={"disk": slope})])
    ]
    bare, scanned = (joint.meshed().interfaces[0] for joint in joints)
    assert len(scanned) == 2 * (11 - 1) + 1
    expected = tilt * scanned.coordinates[:, 0]
    np.testing.assert_allclose(scanned.gap - bare.gap, expected, atol=0.5 * tilt * 1.2 / 8)


@pytest.mark.slow
def test_edges_from_scans_are_the_edges(tmp_path):
    """Arcs are given as profiles, partly on either body; balance and pressure converge.

    F = 2 P (sin θ + µ cos θ) is that of the case. Cells carry means of the arc, not its middles,
    next to the flat's end, to first order of their width.
    """
    x = (np.arange(1100) + 0.5) / 100.0 - 5.5
    edges = rounded_edge(np.abs(x), 5.5, 1.5, 30.0)[:, None]
    both = {
        body: scan(tmp_path, body, -share * edges, (0.01, 1.0))
        for body, share in (("disk", 0.4), ("blade", 0.6))
    }
    coarse = ["mesh.flank_nodes=[40, 8]", "mesh.size=8 mm", "load_path.increments=[1, 1]"]
    off = []
    for strips in (64, 128):
        sets = [*coarse, "mesh.order=1", f"contact.grid=[{strips}, 1]"]
        as_scan = ["structure.edge_radius=1e6 mm", surfaces(intrados=both, extrados=both)]
        given, scanned = solved(PLANE, *sets), solved(PLANE, *sets, *as_scan)
        for (loads, first), (rough_loads, rough) in zip(given, scanned, strict=True):
            assert rough_loads.P[0] == pytest.approx(1301.33, rel=2e-4)
            assert rough_loads.P[0] == pytest.approx(loads.P[0], rel=1e-6)
            largest = first.pressure.max()
            off.append(np.abs(rough.pressure - first.pressure).max() / largest)
        # One profile on both flanks: one is the mirror image of the other.
        np.testing.assert_allclose(
            scanned[0][1].pressure, scanned[1][1].pressure, rtol=0.0, atol=1e-10 * largest
        )
    assert max(off[2:]) < 0.01
    assert max(off[2:]) < 0.5 * min(off[:2])


def test_mirrored_scans_have_mirrored_pressures(tmp_path):
    """The joint is its own image across X = 0, and y along its flanks has opposite senses."""
    x, y = np.meshgrid((np.arange(61) - 30) * 0.2, (np.arange(311) - 155) * 0.2, indexing="ij")
    waves = 2e-3 * np.sin(0.9 * x + 0.3) * np.cos(0.27 * y + 0.7) + 1e-5 * y
    waves += 5e-4 * np.random.default_rng(0).standard_normal(x.shape)
    rough = scan(tmp_path, "rough", waves, (0.2, 0.2))
    coarse = ["mesh.flank_nodes=[7, 9]", "mesh.size=10 mm", "load_path.increments=[1, 1]"]
    mirrored = surfaces(intrados={"disk": rough}, extrados={"disk": rough | {"flipped": True}})
    (loads, first), (other_loads, other) = solved(SPACE, mirrored, *coarse)
    largest = first.pressure.max()
    assert np.abs(first.pressure - other.pressure).max() > 0.3 * largest
    image = other.pressure[..., ::-1]
    np.testing.assert_allclose(first.pressure, image, rtol=0.0, atol=1e-8 * largest)
    assert loads.P[0] == pytest.approx(other_loads.P[0], rel=1e-9)
    assert loads.Mx[0] == pytest.approx(-other_loads.Mx[0], rel=1e-6)
    # The blade's is seen from the other side.
    on_blade = surfaces(intrados={"disk": rough}, extrados={"blade": rough})
    np.testing.assert_allclose(solved(SPACE, on_blade, *coarse)[1][1].pressure, other.pressure)


def test_planes_are_exact_on_flanks(tmp_path):
    """They follow both frames, also of a skewed slot, and the mesh has them on the blade."""
    x, y = np.meshgrid((np.arange(70) - 34.5) * 0.2, (np.arange(90) - 44.5) * 0.8, indexing="ij")
    tilted = scan(tmp_path, "tilted", 1e-3 * x - 2e-4 * y, (0.2, 0.8))
    down = scan(tmp_path, "down", 2e-4 * y - 1e-3 * x, (0.2, 0.8))
    coarse = ["mesh.flank_nodes=[7, 9]", "mesh.size=10 mm", "structure.skew=10 deg"]
    cancels = {"disk": tilted, "blade": down | {"flipped": True}}
    for body, sign in (("disk", -1.0), ("blade", 1.0)):
        changes = [surfaces(intrados={body: tilted}, extrados=cancels), *coarse]
        model = dovetail_joint(load_case(SPACE, changes))
        mesh = model.meshed()
        for face, on in zip(mesh.interfaces, (1.0, 0.0), strict=True):
            side, form = FLANKS[face.name], model.geometry.flank_gap
            contact = model.contact_face(face)
            grid = contact.grid((24, 20))

            def added(x, y, on=on, sign=sign):
                return on * (-1e-3 * x - sign * 2e-4 * y)

            extra = contact.gap(grid.x, grid.y) - form(grid.x, grid.y, side)
            np.testing.assert_allclose(extra, added(grid.x, grid.y), atol=1e-12)
            # Eight cells a facet: 1/128 of what rises over each, 2.2 and 1.7 µm.
            at = face.coordinates.T
            nodal = face.gap - form(*at, side)
            np.testing.assert_allclose(nodal, added(*at), atol=3.9e-3 / 128)
            meshed = form_of(mesh)[1][face.nodes_2] @ face.frame.axes[2]
            np.testing.assert_allclose(meshed, face.gap, atol=1e-12)


@pytest.mark.parametrize(
    ("case", "columns", "change", "words"),
    [
        (PLANE, 9, "title=A profile", "disk.npy: a scan of 9 columns: give a profile, of one"),
        (SPACE, 9, "title=Too short", "ends within the grid of 12 mm x 60 mm: take a smaller"),
        (PLANE, 1, "fidelity=auto", "measured surfaces belong to"),
    ],
)
def test_surfaces_that_do_not_suit_a_flank_are_refused(tmp_path, case, columns, change, words):
    disk = scan(tmp_path, "disk", np.zeros((60, columns)), (0.2, 1.0))
    ended = invoke("check", case, *settings([surfaces(extrados={"disk": disk}), change]))
    assert ended.exit_code == 2
    assert words in ended.stderr


@pytest.mark.slow
def test_a_run_wears_what_was_measured(tmp_path):
    """Ridges on the blade's flank wear first; the unworn gap is the scan plus the form."""
    x = (np.arange(600) + 0.5) / 50.0 - 6.0
    ridges = np.repeat(2e-3 * np.cos(2.0 * np.pi * x / 1.5)[:, None], 620, axis=1)
    blade = scan(tmp_path, "ridges", ridges, (0.02, 0.1))
    coarse = ["mesh.flank_nodes=[9, 9]", "mesh.size=10 mm", "load_path.increments=[2, 2]"]
    quiet = ["output.figures=false", "stress.section=none", "stress.life.parameter=none"]
    out = tmp_path / "out"
    changes = [surfaces(intrados={"blade": blade}), *coarse, *quiet, "error_budget=known"]
    ended = invoke("run", SPACE, "--out", out, *settings(changes))
    assert ended.exit_code in (0, 1), ended.stderr
    assert "the section that chooses increments" in (out / "run.log").read_text("utf-8")
    heights = []
    for unworn in (["--unworn"], []):
        file = tmp_path / f"blade{len(unworn)}.npz"
        at = ["--body", "2", "--interface", "intrados"]
        assert invoke("surface", out, file, *at, *unworn).exit_code == 0
        heights.append(np.load(file)["heights"])
    before, after = heights
    model = dovetail_joint(load_case(out / "case.yaml"))
    contact = model.contact_face(model.meshed().interfaces[0])
    grid = contact.grid(before.shape)
    # It lies turned over about x.
    np.testing.assert_allclose(before, -contact.gap(grid.x, grid.y)[:, ::-1], atol=1e-12)
    worn, x = before - after, grid.x[:, 0]
    assert worn.min() > -1e-12
    crests = np.cos(2.0 * np.pi * x / 1.5) * (np.abs(x) < 4.0)
    assert worn[crests > 0.7].mean() > 2.0 * worn[crests < -0.7].mean()
