"""Tests of complete runs of mesh cases, in space and in the plane, and of refusals."""

import json

import h5py
import numpy as np
import pytest

from fe_models.joints import friction
from fe_models.meshes.gmsh_session import gmsh_model
from fe_models.structure import CLOSED
from tests.marks import slow
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import (
    ASSEMBLY,
    BLOCKS,
    TO_AND_FRO,
    WEAR,
    cube,
    edit,
    refused,
    run,
    write_case,
)
from workflow.analyses.wear.output.quantities import main_results
from workflow.analyses.wear.structures.mesh.model import mesh_assembly
from workflow.analyses.wear.translation import structure_loads
from workflow.errors import MethodFailed
from workflow.kinds import load_case

pytestmark = pytest.mark.usefixtures("reads_here")

# --- in space, run --------------------------------------------------------------------------------


def test_density_is_for_loads_on_the_mass(blocks):
    """Rotation and acceleration need a density, and the message says so; pressures do not."""
    steel = "{young: 200 GPa, poisson: 0.3}"
    bare = [f"materials.body_{number}={steel}" for number in (1, 2)]
    assert load_case(blocks, bare).material(1).density == 0.0
    load = "{kind: acceleration, acceleration: [0, 0, 9810], path: [1, 1, 1, 1]}"
    line = refused(blocks, *bare, f"structure.loads.1={load}")
    assert (
        "materials.body_1.density: missing, but a load of acceleration acts on the mass; allowed: "
        "mass per volume [t/mm^3], such as 4430 kg/m^3" in line
    )
    named = ["materials.body_1=304L", "materials.body_2=304L"]
    case = load_case(blocks, [*named, f"structure.loads.1={load}"])
    assert case.material(2).density == 7.9e-9


def test_parts_and_instances_run(blocks, tmp_path):
    summary = run(blocks, tmp_path / "out")
    peak = summary["foot"]["peak_load"]["unworn"]
    assert peak["P"] == pytest.approx(40.0, rel=1e-6)
    # Forces are those on body 2: they hold it against its load.
    assert peak["Qx"] == pytest.approx(-4.0, rel=1e-5)
    assert summary["structure"]["equilibrium_error"] < 1e-6
    assert summary["structure"]["closure"] <= CLOSED
    found = main_results(load_case(blocks), summary)
    groups = {quantity.group for quantity in found}
    assert groups == {"foot", *summary["structure"]["nodes"]}  # bodies as their file names them
    reported = {quantity.name for quantity in found if quantity.group == "Foot-1"}
    assert {"elements", "median element (longest edge)"} <= reported
    assert "largest von Mises stress on the free surface, unworn" in reported


def test_worn_faces_come_back_at_the_users_nodes(blocks, tmp_path):
    """The top of the base and the bottom of the foot have the node numbers of the file."""
    edit(blocks, "4 N", "18 N")  # of the 20 N at which all of the foot slides: some of it does
    summary = run(blocks, tmp_path / "out")["foot"]
    for body, numbers, into in ((1, range(19, 28), -1.0), (2, range(1, 10), 1.0)):
        reported = summary["worn_nodes"][f"body_{body}"]
        rows = np.loadtxt(tmp_path / "out" / reported["file"], delimiter=",", skiprows=1)
        assert sorted(rows[:, 0].astype(int)) == list(numbers)
        np.testing.assert_allclose(rows[:, 1:3], 0.0, atol=1e-15)
        assert np.all(into * rows[:, 3] >= 0.0)
        assert np.max(into * rows[:, 3]) > 1e-10
        assert reported["volume_share"] == pytest.approx(1.0, abs=1e-12)
    ending = invoke("resultants", blocks, "--out", tmp_path / "files")
    assert ending.exit_code == 0, ending.stderr
    with h5py.File(tmp_path / "files" / "resultants.h5") as file:
        assert sorted(file["foot/nodes_2"]) == list(range(1, 10))


def test_cycle_of_another_peak_is_not_taken_from_the_cache(blocks, tmp_path, monkeypatch):
    """The cycle is the same, but its stiffness is taken at another load."""
    forces = []
    for leg, cache in ((4, "one"), (3, "one"), (3, "other")):
        monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / cache))
        settings = [f"load_path.peak_leg={leg}", "nonlinearity.stiffness=relinearised"]
        (history,) = structure_loads(load_case(blocks, settings), mesh_assembly).unworn()
        forces.append(history.force)
    np.testing.assert_array_equal(forces[1], forces[2])
    assert np.abs(forces[1] - forces[0]).max() > 1e-6 * np.abs(forces[0]).max()


@pytest.mark.parametrize("stiffness", ["linear", "relinearised"])
def test_a_peak_that_does_not_converge_is_an_error(blocks, stiffness, monkeypatch):
    """Neither the drift probe nor the state for the stiffness may count as a solution."""
    stage = structure_loads(
        load_case(blocks, [f"nonlinearity.stiffness={stiffness}"]), mesh_assembly
    )
    monkeypatch.setattr(friction, "MAX_ITERATIONS", 1)
    with pytest.raises(MethodFailed, match="did not converge"):
        stage.probe([np.zeros(len(face.face)) for face in stage.faces])


@pytest.mark.slow
def test_load_beyond_the_middles_of_coarse_cells_costs_no_run(blocks, tmp_path):
    """A foot nearly tips over: nine nodes make 3 x 3 cells, and the grid holds the moments."""
    loads = json.dumps([BLOCKS["loads"][0], BLOCKS["loads"][1] | {"force": ["16 N", 0, 0]}])
    overrides = f"structure.loads={loads}", "friction.coefficient=0.9", "output.figures=true"
    run(blocks, tmp_path / "out", *overrides)
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        assert "coarse" not in file["contact/foot"]
        assert file["contact/foot/00002/pressure"].shape == (16, 16)


@pytest.mark.parametrize(
    ("factor", "wear"), [(1.0, "is open at peak load"), (-1.0, "is never closed")]
)
def test_open_faces_give_a_warning(blocks, tmp_path, factor, wear):
    """A face that is open at the shown increment may still wear."""
    lift = {"kind": "displacement", "group": "foot_high", "displacement": [0.0, 0.0, -1e-3]}
    supports = json.dumps([*BLOCKS["supports"], {"group": "foot_high", "hold": "xy"}])
    summary = run(
        blocks,
        tmp_path / "out",
        f"structure.supports={supports}",
        f"structure.loads={json.dumps([lift | {'path': [factor, -1.0]}])}",
        "load_path={increments: [2, 2], peak_leg: 2}",
    )
    assert any(line.startswith(f"foot {wear}") for line in summary["warnings"])


# --- in the plane ---------------------------------------------------------------------------------

RADIUS, FINE = 400.0, 0.1
SECTION = {
    "file": "section.msh",
    "body_1": "block",
    "body_2": "pad",
    "contacts": [{"name": "foot", "face_1": "top", "face_2": "foot", "x": [1, 0, 0]}],
    "supports": [{"group": "base", "hold": "all"}, {"group": "lid", "hold": "x"}],
    "loads": [{"kind": "pressure", "group": "lid", "pressure": "20 MPa", "path": [1, 0.5]}],
}


@pytest.fixture
def section(tmp_path):
    """Return a pad 8 mm wide with a round foot over a block, in the plane (X, Z)."""
    with gmsh_model("section") as gmsh:
        occ, sag = gmsh.model.occ, RADIUS - np.sqrt(RADIUS**2 - 16.0)
        corners = [occ.addPoint(x, 0, z) for x, z in ((-8, -8), (8, -8), (8, 0), (-8, 0))]
        lines = [occ.addLine(corners[k], corners[(k + 1) % 4]) for k in range(4)]
        block = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        ends = [occ.addPoint(x, 0, z) for x, z in ((-4, sag), (4, sag), (4, 8), (-4, 8))]
        arc = occ.addCircleArc(ends[0], occ.addPoint(0, 0, RADIUS), ends[1])
        sides = [occ.addLine(ends[k], ends[(k + 1) % 4]) for k in (1, 2, 3)]
        pad = occ.addPlaneSurface([occ.addCurveLoop([arc, *sides])])
        occ.synchronize()
        groups = {"block": (2, block), "pad": (2, pad), "base": (1, lines[0]), "top": (1, lines[2])}
        groups |= {"foot": (1, arc), "lid": (1, sides[1])}
        for name, (dimension, tag) in groups.items():
            gmsh.model.addPhysicalGroup(dimension, [tag], name=name)
        field = gmsh.model.mesh.field
        box = {"VIn": FINE, "VOut": 1.0, "Thickness": 3.0, "XMin": -1.5, "XMax": 1.5}
        number = field.add("Box")
        for name, value in (box | {"YMin": -1, "YMax": 1, "ZMin": -0.5, "ZMax": 0.5}).items():
            field.setNumber(number, name, value)
        field.setAsBackgroundMesh(number)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1.0)
        gmsh.model.mesh.generate(2)
        gmsh.write(str(tmp_path / "section.msh"))
    legs = {"increments": [1, 1]}
    return write_case(tmp_path / "section.yaml", SECTION, legs, mu=0.0, grid=(128, 8))


def test_round_foot_in_the_plane_presses_as_hertz_says(section, tmp_path):
    """P per length and the peak pressure of nodes and cells are close to Hertz.

    Bodies 8 mm high are nearly half-spaces to a contact of half-width 1.1 mm, and nodes 0.1 mm
    apart round off its peak.
    """
    summary = run(section, tmp_path / "out")
    load = 20.0 * 8.0
    assert summary["foot"]["peak_load"]["unworn"]["P"] == pytest.approx(load, rel=1e-6)
    modulus = 200e3 / (2.0 * (1.0 - 0.3**2))
    half = np.sqrt(4.0 * load * RADIUS / (np.pi * modulus))
    hertz = 2.0 * load / (np.pi * half)
    (history,) = structure_loads(load_case(section), mesh_assembly).unworn()
    assert history.pressure[0].max() == pytest.approx(hertz, rel=0.05)
    assert summary["foot"]["peak_pressure"]["unworn"] == pytest.approx(hertz, rel=0.02)


@pytest.mark.slow
def test_nodes_under_a_sliding_foot_wear_to_its_shape(section, tmp_path):
    """Worn much deeper than pressed, the block conforms: δ - x²/2R, of volume 2a³/3R."""
    loads = [
        SECTION["loads"][0] | {"pressure": "10 MPa", "path": [1, 1, 1, 1]},
        {"kind": "displacement", "group": "lid", "displacement": [0.05, 0, 0],
         "path": [0, 1, -1, 0]},
    ]  # fmt: skip
    structure = SECTION | {"supports": [{"group": "base", "hold": "all"}], "loads": loads}
    wear = WEAR | {
        "body_1": {"coefficient": "3.2e7 um^3/J"},
        "body_2": {"coefficient": "0 um^3/J"},
        "cycles": 1e4,
        "step": {"kind": "second_order"},
    }
    legs = {"increments": [2, 4, 8, 4], "cycle_from": 2, "peak_leg": 4}
    case = tmp_path / "slide.yaml"
    write_case(case, structure, legs, mu=0.01, grid=(128, 8), wear=wear)  # which hardly tilts it
    foot = run(case, tmp_path / "out", "contact.method=nodes")["foot"]
    assert foot["volume_1"] == pytest.approx(3.2e-5 * foot["energy"], rel=1e-12)
    # Of the way there and back the bodies' own shear takes some.
    sliding = 3.2e-5 * 0.01 * 80.0 * 4.0 * 0.05 * 1e4
    assert 0.97 * sliding < foot["volume_1"] < sliding
    half = np.cbrt(1.5 * RADIUS * foot["volume_1"])
    assert foot["depth_1"] == pytest.approx(half**2 / (2.0 * RADIUS), rel=0.015)
    assert foot["depth_2"] == 0.0


# --- refusals -------------------------------------------------------------------------------------


def test_faces_that_miss_each_other(blocks):
    edit(blocks.with_name("blocks.inp"), "0.5, 0.5, 2.", "9.5, 0.5, 2.")
    message = refused(blocks)
    assert "structure.contacts.0: the two contact faces do not lie on each other" in message


def test_body_1_that_is_not_held(blocks):
    message = refused(blocks, "structure.supports.0.hold=xy")
    assert "structure.supports: the supports let Base-1 and Foot-1 " in message


def test_heights_are_those_of_the_paraboloid(blocks):
    """Two descriptions of the same gap agree at the nodes of the face of 1 mm."""
    axis = (np.arange(16) + 0.5) / 16.0 - 0.5
    np.save(blocks.with_name("gap.npy"), np.tile(axis[:, None] ** 2 / 20.0, 16))
    gaps = ("{shape: paraboloid, radius_x: 10}", "{shape: heights, file: gap.npy}")
    cases = [load_case(blocks, [f"structure.contacts.0.gap={gap}"]) for gap in gaps]
    one, two = (mesh_assembly(case).meshed().interfaces[0] for case in cases)
    np.testing.assert_allclose(one.gap, one.coordinates[:, 0] ** 2 / 20.0, atol=1e-15)
    # Linear between the centres of cells, and straight on beyond the last, half a cell inside.
    np.testing.assert_allclose(two.gap, one.gap, atol=(1.0 / 16.0) ** 2 / 20.0)


@pytest.mark.slow
def test_gap_that_the_mesh_cannot_show_costs_no_run(blocks, tmp_path):
    """The hole under the middle node of the foot is deeper than its elements are large."""
    gap = np.zeros((16, 16))
    gap[7:9, 7:9] = 0.9
    np.save(blocks.with_name("gap.npy"), gap)
    hole = "structure.contacts.0.gap={shape: heights, file: gap.npy}"
    summary = run(blocks, tmp_path / "out", hole)
    assert any("show only the worn shape" in line for line in summary["warnings"])
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        low = file["bodies/Foot-1/unworn/points"][:, 2].min()
    assert low == 2.0


@pytest.mark.parametrize("group", ["cut", slow("edge")])
def test_supports_on_a_contact_face(tmp_path, group):
    """A plane of symmetry leaves the contact whole; a held edge does not, and is warned of."""
    text = cube("base", 2.0) + cube("foot", 1.0) + ASSEMBLY.replace("0.5, 0.5, 2.", "0.5, 0., 2.")
    for part, first in (("base", 19), ("foot", 1)):
        edge = f"*Nset, nset={part}_edge\n{first}, {first + 1}, {first + 2}\n*End Part"
        head, tail = text.split(f"*Part, name={part}\n")
        text = head + f"*Part, name={part}\n" + tail.replace("*End Part", edge, 1)
    (tmp_path / "half.inp").write_text(text, encoding="utf-8")
    held = [{"group": f"{name}_{group}", "hold": "y"} for name in ("base", "foot")]
    structure = BLOCKS | {"file": "half.inp", "supports": [*BLOCKS["supports"], *held]}
    case = write_case(tmp_path / "half.yaml", structure, TO_AND_FRO, error_budget="known")
    summary = run(case, tmp_path / "out")
    warned = any("not as a plane of symmetry" in line for line in summary["warnings"])
    foot, whole = summary["foot"], group == "cut"
    assert warned is not whole
    assert foot["peak_load"]["unworn"]["P"] == pytest.approx(80.0 if whole else 40.0, rel=1e-6)
    assert foot.get("mirrored_across") == (["y"] if whole else None)


def test_slice_in_plane_strain_is_refused(blocks):
    """Its contact would be a narrow strip; the plane model is the right choice."""
    held = [{"group": group, "hold": "y"} for group in ("base_high", "foot_low", "foot_high")]
    supports = json.dumps([*BLOCKS["supports"], *held])
    assert "as in a slice in plane strain" in refused(blocks, f"structure.supports={supports}")
