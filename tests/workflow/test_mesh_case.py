"""Mesh cases through the whole road: files of all kinds, in space and in the plane, refusals."""

import json

import h5py
import numpy as np
import pytest

from fe_models import friction
from fe_models.geometry.imported import patch, read_bodies
from fe_models.gmsh_session import gmsh_model
from fe_models.structure import CLOSED
from tests.marks import slow
from tests.workflow.commands import invoke
from tests.workflow.mesh_scenes import WEAR, refused, run, write_case
from workflow.analyses.wear.quantities import main_results
from workflow.analyses.wear.structure_stage import StructureStage
from workflow.analyses.wear.structures.mesh.model import MeshModel
from workflow.errors import MethodFailed
from workflow.kinds import load_case, template

pytestmark = pytest.mark.usefixtures("reads_here")

# --- files of all kinds, run ----------------------------------------------------------------------


def cube(name, size):
    """A part: a cube of 2 x 2 x 2 elements, with surfaces below, above and at y = 0."""
    axis = np.linspace(0.0, size, 3).tolist()
    places = [(x, y, z) for z in axis for y in axis for x in axis]
    lines = [f"*Part, name={name}", "*Node"]
    lines += [f"{n}, {x}, {y}, {z}" for n, (x, y, z) in enumerate(places, 1)]
    lines.append("*Element, type=C3D8R")
    firsts = [1 + i + 3 * j + 9 * k for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    for n, first in enumerate(firsts, 1):
        below = [first, first + 1, first + 4, first + 3]
        lines.append(f"{n}, {', '.join(str(m) for m in [*below, *(m + 9 for m in below)])}")
    for side, face, elements in (
        ("low", "S1", (1, 2, 3, 4)),
        ("high", "S2", (5, 6, 7, 8)),
        ("cut", "S3", (1, 2, 5, 6)),
    ):
        lines.append(f"*Surface, type=ELEMENT, name={name}_{side}")
        lines += [f"{n}, {face}" for n in elements]
    return "\n".join([*lines, "*End Part", ""])


ASSEMBLY = """\
*Assembly, name=Assembly
*Instance, name=Base-1, part=base
*End Instance
*Instance, name=Foot-1, part=foot
0.5, 0.5, 2.
*End Instance
*End Assembly
*Step
*Static
*End Step
"""
# Two blocks, pressed together and then pushed to and fro without sliding off.
BLOCKS = {
    "body_1": "Base-1",
    "body_2": "Foot-1",
    "contacts": [{"name": "foot", "face_1": "base_high", "face_2": "foot_low", "x": [1, 0, 0]}],
    "supports": [{"group": "base_low", "hold": "all"}],
    "loads": [
        {"kind": "pressure", "group": "foot_high", "pressure": "40 MPa", "path": [1, 1, 1, 1]},
        {"kind": "force", "group": "foot_high", "force": ["4 N", 0, 0], "path": [0, 1, -1, 1]},
    ],
}
TO_AND_FRO = {"increments": [1, 2, 2, 2], "cycle_from": 3, "peak_leg": 4}


@pytest.fixture
def blocks(tmp_path):
    """A cube of 1 mm on one of 2 mm, as CAE would write them."""
    text = cube("base", 2.0) + cube("foot", 1.0) + ASSEMBLY
    (tmp_path / "blocks.inp").write_text(text, encoding="utf-8")
    return write_case(tmp_path / "blocks.yaml", {"file": "blocks.inp", **BLOCKS}, TO_AND_FRO)


def test_density_is_for_loads_on_the_mass(blocks):
    """Pressures need none; what turns or is accelerated does, and says why."""
    steel = "{young: 200 GPa, poisson: 0.3}"
    bare = [f"materials.body_{number}={steel}" for number in (1, 2)]
    assert load_case(blocks, bare).material(1).density == 0.0
    load = "{kind: acceleration, acceleration: [0, 0, 9810], path: [1, 1, 1, 1]}"
    line = refused(blocks, *bare, f"structure.loads.1={load}")
    assert line.endswith(
        "materials.body_1.density: missing, and a load of acceleration acts on the mass; allowed: "
        "mass per volume [t/mm^3], such as 4430 kg/m^3"
    )
    named = ["materials.body_1=304L", "materials.body_2=304L"]
    case = load_case(blocks, [*named, f"structure.loads.1={load}"])
    assert case.material(2).density == 7.9e-9


def edit(path, old, new):
    """Replace text in a file and give its lines."""
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path.read_text("utf-8").splitlines()


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
    told = {quantity.name for quantity in found if quantity.group == "Foot-1"}
    assert {"elements", "median element (longest edge)"} <= told
    assert "largest von Mises stress on the free surface, unworn" in told


def test_what_a_file_says_besides_is_named(blocks, tmp_path):
    """Loads, supports and contact of the other program, by line; nothing where there is none."""
    file = tmp_path / "blocks.inp"
    assert "not taken over" not in invoke("check", blocks).output
    assert "not taken over" not in invoke("describe", file).output
    given = "*Boundary\nBase-1.low, 1, 3\n*Cload, amplitude=up\n5, 3, -100.\n6, 3, -50.\n"
    given += "*Friction\n0.3\n"
    line = 1 + edit(file, "*Static\n", f"*Static\n{given}").index("*Static")
    told = invoke("describe", file).output.splitlines()[-3:]
    assert told == [
        f"not taken over: blocks.inp:{line + 1}: *boundary: Base-1.low, 1, 3",
        f"not taken over: blocks.inp:{line + 3}: *cload, amplitude=up: 5, 3, -100. ...",
        f"not taken over: blocks.inp:{line + 6}: *friction: 0.3",
    ]
    said = " ".join(invoke("check", blocks).output.split())
    assert "3 keywords with loads, supports, contact or materials not taken over" in said


def test_a_face_in_two_parts(blocks, tmp_path):
    """Named both, they are the whole; named one, a check doubts it; twice, or none, is refused."""
    edit(
        tmp_path / "blocks.inp",
        "*Surface, type=ELEMENT, name=foot_low\n1, S1\n2, S1\n3, S1\n4, S1\n",
        "*Surface, type=ELEMENT, name=low_a\n1, S1\n2, S1\n"
        "*Surface, type=ELEMENT, name=low_b\n3, S1\n4, S1\n",
    )
    face = "structure.contacts.0.face_2="
    said = invoke("check", blocks, "--set", f"{face}[low_a, low_b]").output
    assert "its faces share" not in said
    assert "1 mm² of 4 and 1 mm²" in said
    assert "its faces share" not in invoke("check", blocks, "--set", f"{face}low_a").output
    summary = run(blocks, tmp_path / "out", f"{face}[low_a, low_b]")
    assert summary["foot"]["peak_load"]["unworn"]["P"] == pytest.approx(40.0, rel=1e-6)
    assert "a boundary twice; allowed: each once" in refused(blocks, f"{face}[low_a, low_a]")
    assert "none; allowed: a boundary, or several" in refused(blocks, f"{face}[]")
    assert "no boundary low_c on body Foot-1" in refused(blocks, f"{face}[low_a, low_c]")


def test_a_node_set_may_be_a_face(blocks, tmp_path):
    """Its facets are those with all their corners in it; one with nodes elsewhere is none."""
    surface = "*Surface, type=ELEMENT, name=foot_low\n1, S1\n2, S1\n3, S1\n4, S1\n"
    nodes = "*Nset, nset=foot_low\n1, 2, 3, 4, 5, 6, 7, 8, 9\n"
    whole = run(blocks, tmp_path / "whole")["foot"]
    edit(tmp_path / "blocks.inp", surface, nodes)
    by_nodes = run(blocks, tmp_path / "nodes")["foot"]
    for name in ("depth_1", "volume_2", "energy"):
        assert by_nodes[name] == pytest.approx(whole[name], rel=1e-9)
    edit(tmp_path / "blocks.inp", "7, 8, 9\n", "7, 8, 9, 19\n")
    line = refused(blocks)
    assert "contacts.0.face_2: foot_low is a node set; 1 of its nodes are on no facet" in line
    assert "allowed: foot_high, foot_cut, foot_low" in line


def test_a_face_that_is_half_named_is_doubted(blocks, tmp_path):
    """Of the lower cube's top one half: the foot overhangs it."""
    edit(
        tmp_path / "blocks.inp",
        "*Surface, type=ELEMENT, name=base_high\n5, S2\n6, S2\n7, S2\n8, S2\n",
        "*Surface, type=ELEMENT, name=base_high\n5, S2\n6, S2\n",
    )
    said = " ".join(invoke("check", blocks).output.split())
    assert "foot: its faces share 0.5 mm² of 2 and 1; if one is in several parts" in said


def test_a_contact_may_be_called_as_a_body(blocks, tmp_path):
    """Both have errors of their own."""
    edit(blocks, "name: foot", "name: Foot-1")
    summary = run(blocks, tmp_path / "out")
    assert {"depth", "volume", "peak_pressure"} <= summary["Foot-1"]["error"].keys()
    assert summary["structure"]["error"]["Foot-1"].keys() == {"notch_stress"}
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        assert "depth" in file["error/Foot-1"]
        assert list(file["bodies/Foot-1/error"]) == ["notch_stress"]


def test_worn_faces_come_back_at_the_users_nodes(blocks, tmp_path):
    """By the numbers of the file: the top of the base and the bottom of the foot."""
    edit(blocks, "4 N", "18 N")  # of the 20 N at which all of the foot slides: some of it does
    summary = run(blocks, tmp_path / "out")["foot"]
    for body, numbers, into in ((1, range(19, 28), -1.0), (2, range(1, 10), 1.0)):
        told = summary["worn_nodes"][f"body_{body}"]
        rows = np.loadtxt(tmp_path / "out" / told["file"], delimiter=",", skiprows=1)
        assert sorted(rows[:, 0].astype(int)) == list(numbers)
        np.testing.assert_allclose(rows[:, 1:3], 0.0, atol=1e-15)
        assert np.all(into * rows[:, 3] >= 0.0)
        assert np.max(into * rows[:, 3]) > 1e-10
        assert told["volume_share"] == pytest.approx(1.0, abs=1e-12)
    ending = invoke("resultants", blocks, "--out", tmp_path / "files")
    assert ending.exit_code == 0, ending.stderr
    with h5py.File(tmp_path / "files" / "resultants.h5") as file:
        assert sorted(file["foot/nodes_2"]) == list(range(1, 10))


def test_cycle_of_another_peak_is_not_taken_from_the_cache(blocks, tmp_path, monkeypatch):
    """The same cycle, but stiff as at another of its loads."""
    forces = []
    for leg, cache in ((4, "one"), (3, "one"), (3, "other")):
        monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / cache))
        settings = [f"load_path.peak_leg={leg}", "nonlinearity.stiffness=relinearised"]
        (history,) = StructureStage(MeshModel(load_case(blocks, settings))).unworn()
        forces.append(history.force)
    np.testing.assert_array_equal(forces[1], forces[2])
    assert np.abs(forces[1] - forces[0]).max() > 1e-6 * np.abs(forces[0]).max()


@pytest.mark.parametrize("stiffness", ["linear", "relinearised"])
def test_peak_that_does_not_converge_is_told(blocks, stiffness, monkeypatch):
    """Neither the drift probe nor what a stiffness is taken at may pass for a solution."""
    stage = StructureStage(MeshModel(load_case(blocks, [f"nonlinearity.stiffness={stiffness}"])))
    monkeypatch.setattr(friction, "MAX_ITERATIONS", 1)
    with pytest.raises(MethodFailed, match="did not converge"):
        stage.probe([np.zeros(len(face.face)) for face in stage.faces])


@pytest.mark.slow
def test_load_beyond_the_middles_of_coarse_cells_costs_no_run(blocks, tmp_path):
    """A foot that nearly tips over: nine nodes make 3 x 3 cells, and the grid holds what they do
    not."""
    loads = json.dumps([BLOCKS["loads"][0], BLOCKS["loads"][1] | {"force": ["16 N", 0, 0]}])
    overrides = f"structure.loads={loads}", "friction.coefficient=0.9", "output.figures=true"
    run(blocks, tmp_path / "out", *overrides)
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        assert "coarse" not in file["contact/foot"]
        assert file["contact/foot/00002/pressure"].shape == (16, 16)


@pytest.mark.parametrize(("factor", "wear"), [(1.0, "at peak load"), (-1.0, "all the time")])
def test_open_faces_are_told(blocks, tmp_path, factor, wear):
    """One that is open at the increment that is shown may wear all the same."""
    lift = {"kind": "displacement", "group": "foot_high", "displacement": [0.0, 0.0, -1e-3]}
    supports = json.dumps([*BLOCKS["supports"], {"group": "foot_high", "hold": "xy"}])
    summary = run(
        blocks,
        tmp_path / "out",
        f"structure.supports={supports}",
        f"structure.loads={json.dumps([lift | {'path': [factor, -1.0]}])}",
        "load_path={increments: [2, 2], peak_leg: 2}",
    )
    assert any(line.startswith(f"foot is open {wear}") for line in summary["warnings"])


def test_keyword_that_is_not_read_is_refused_with_its_line(blocks):
    file = blocks.with_name("blocks.inp")
    lines = edit(file, "*Step\n", "*Tie, name=T\na, b\n*Step\n")
    message = refused(blocks)
    assert "structure.file: " in message
    assert f"blocks.inp:{lines.index('*Tie, name=T') + 1}: " in message


def face_at(imported, body, height, normal):
    """The boundary of a body at a height that looks along z."""
    for name in imported.bodies[body].mesh.boundaries:
        surface = patch(imported.bodies[body], name)
        if np.allclose(surface.normal, [0, 0, normal]) and np.isclose(surface.centroid[2], height):
            return name
    raise AssertionError((body, height, normal))


@pytest.fixture
def cad(tmp_path):
    """Boxes of 4 and 2 mm in a STEP file, its faces found by where they are."""
    file = tmp_path / "boxes.step"
    with gmsh_model("boxes") as gmsh:
        gmsh.model.occ.addBox(-2, -2, -2, 4, 4, 2)
        gmsh.model.occ.addBox(-1, -1, 0, 2, 2, 1)
        gmsh.model.occ.synchronize()
        gmsh.write(str(file))
    imported = read_bodies(file, 1.0)
    lower, upper = imported.bodies
    text = json.dumps(BLOCKS)
    for group, place in {
        "base_low": (lower, -2.0, -1.0),
        "base_high": (lower, 0.0, 1.0),
        "foot_low": (upper, 0.0, -1.0),
        "foot_high": (upper, 1.0, 1.0),
    }.items():
        text = text.replace(json.dumps(group), json.dumps(face_at(imported, *place)))
    structure = json.loads(text) | {"body_1": lower, "body_2": upper, "file": file.name}
    return write_case(tmp_path / "cad.yaml", structure, TO_AND_FRO, mesh={"size": "0.5 mm"})


def test_cad_file_runs(cad, tmp_path):
    summary = run(cad, tmp_path / "out")
    peak = summary["foot"]["peak_load"]["unworn"]
    assert peak["P"] == pytest.approx(160.0, rel=1e-6)
    assert peak["Qx"] == pytest.approx(-4.0, rel=1e-5)


def test_describe_lists_what_a_case_may_name(cad):
    listed = invoke("describe", cad.with_name("boxes.step"), "--size", "1 mm")
    assert listed.exit_code == 0
    structure = load_case(cad).structure
    for name in (structure.body_1, structure.body_2):
        assert f"body {name}: " in listed.stdout
    for support in structure.supports:
        assert f"boundary {support.group}: " in listed.stdout


@pytest.mark.parametrize(
    ("file", "size", "wrong"),
    [
        ("boxes.step", [], "needs a mesh size"),
        ("boxes.step", ["--size", "thick"], "--size: 'thick': not a number with a unit"),
        ("nix.msh", [], "no such file"),
    ],
)
def test_describe_refuses_in_one_line(cad, file, size, wrong):
    ending = invoke("describe", cad.with_name(file), *size)
    assert ending.exit_code == 2
    (line,) = ending.stderr.splitlines()
    assert wrong in line


def test_size_is_for_cad_files_alone(cad, blocks):
    assert "mesh.size=0.5: 0.5 mm: the file is a mesh" in refused(blocks, "mesh.size=0.5")
    told = "structure.size=0.5: of the elements; allowed: as mesh.size"
    assert refused(blocks, "structure.size=0.5").endswith(told)
    told = "structure.order=2: of the elements; allowed: as mesh.order"
    assert refused(blocks, "structure.order=2").endswith(told)
    edit(cad, "mesh:\n  size: 0.5 mm\n", "")
    assert "mesh.size: missing" in refused(cad)


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
    """A pad 8 mm wide with a round foot over a block, in the plane (X, Z), fine where they meet."""
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
    """P per length, and the peak pressure of nodes and strips: bodies 8 mm high are nearly
    half-spaces to a contact of half-width 1.1 mm, and nodes 0.1 mm apart round its peak off."""
    summary = run(section, tmp_path / "out")
    load = 20.0 * 8.0
    assert summary["foot"]["peak_load"]["unworn"]["P"] == pytest.approx(load, rel=1e-6)
    modulus = 200e3 / (2.0 * (1.0 - 0.3**2))
    half = np.sqrt(4.0 * load * RADIUS / (np.pi * modulus))
    hertz = 2.0 * load / (np.pi * half)
    (history,) = StructureStage(MeshModel(load_case(section))).unworn()
    assert history.pressure[0].max() == pytest.approx(hertz, rel=0.05)
    assert summary["foot"]["peak_pressure"]["unworn"] == pytest.approx(hertz, rel=0.02)


@pytest.mark.slow
def test_nodes_under_a_sliding_foot_wear_to_its_shape(section, tmp_path):
    """Worn many times deeper than pressed, the block conforms: δ - x²/2R, of volume 2a³/3R."""
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


@pytest.mark.parametrize(
    ("key", "name", "wrong"),
    [
        ("body_1", "Nix", "no body Nix; allowed: Base-1, Foot-1"),
        ("body_2", "Nix", "no body Nix; allowed: Base-1, Foot-1"),
        ("contacts.0.face_1", "foot_low",
         "boundary foot_low is on body Foot-1, not on Base-1; allowed: base_low, base_high, "),
        ("contacts.0.face_2", "nix",
         "no boundary nix on body Foot-1; allowed: foot_low, foot_high, "),
        ("supports.0.group", "nix", "no boundary or node set nix on Base-1 or Foot-1; allowed: "),
        ("loads.1.group", "nix", "no boundary nix on Base-1 or Foot-1; allowed: base_cut, "),
    ],
)  # fmt: skip
def test_names_that_are_not_there(blocks, key, name, wrong):
    """The line says which names there are."""
    message = refused(blocks, f"structure.{key}={name}")
    assert message.startswith(f"--set structure.{key}={name}: ")
    assert wrong in message


def test_place_in_the_file_is_named(blocks):
    lines = edit(blocks, "group: base_low", "group: nix")
    number = next(n for n, line in enumerate(lines, 1) if "group: nix" in line)
    assert refused(blocks).startswith(f"{blocks}:{number}: structure.supports.0.group: ")


def test_faces_that_miss_each_other(blocks):
    edit(blocks.with_name("blocks.inp"), "0.5, 0.5, 2.", "9.5, 0.5, 2.")
    message = refused(blocks)
    assert "structure.contacts.0: the two contact faces do not lie on each other" in message


def test_faces_that_look_the_same_way(blocks):
    message = refused(blocks, "structure.contacts.0.face_2=foot_high")
    assert "faces base_high and foot_high do not face each other" in message


def test_body_1_that_is_not_held(blocks):
    message = refused(blocks, "structure.supports.0.hold=xy")
    assert "structure.supports: the supports let Base-1 and Foot-1 " in message


def test_node_sets_take_no_force_and_no_normal(blocks):
    part = "*End Part\n*Assembly"
    edit(blocks.with_name("blocks.inp"), part, f"*Nset, nset=tip\n5\n{part}")
    assert "tip is a node set" in refused(blocks, "structure.loads.1.group=tip")
    assert "tip is a node set" in refused(blocks, "structure.contacts.0.face_2=tip")
    overrides = "structure.supports.0.group=tip", "structure.supports.0.hold=normal"
    assert "node set tip has no area to hold normal" in refused(blocks, *overrides)


@pytest.mark.parametrize(
    ("gap", "wrong"),
    [
        ("{shape: rounded, edge_width: 0.6, edge_radius: 30}", "0.6 mm: too large; allowed: up to"),
        ("{shape: heights, file: gap.npy}", "allowed: [3, 4]"),
        ("{shape: heights, file: nix.npy}", "no such file"),
    ],
)
def test_gap_that_does_not_fit_the_face(blocks, gap, wrong):
    np.save(blocks.with_name("gap.npy"), np.zeros((3, 4)))
    assert wrong in refused(blocks, f"structure.contacts.0.gap={gap}")


def test_heights_are_those_of_the_paraboloid(blocks):
    """Two ways to say the same gap, at the nodes of the face of 1 mm."""
    axis = (np.arange(16) + 0.5) / 16.0 - 0.5
    np.save(blocks.with_name("gap.npy"), np.tile(axis[:, None] ** 2 / 20.0, 16))
    gaps = ("{shape: paraboloid, radius_x: 10}", "{shape: heights, file: gap.npy}")
    cases = [load_case(blocks, [f"structure.contacts.0.gap={gap}"]) for gap in gaps]
    one, two = (MeshModel(case).mesh().interfaces[0] for case in cases)
    np.testing.assert_allclose(one.gap, one.coordinates[:, 0] ** 2 / 20.0, atol=1e-15)
    # Linear between the centres of cells, and straight on beyond the last, half a cell inside.
    np.testing.assert_allclose(two.gap, one.gap, atol=(1.0 / 16.0) ** 2 / 20.0)


@pytest.mark.slow
def test_gap_that_the_mesh_cannot_show_costs_no_run(blocks, tmp_path):
    """A hole under the middle node of the foot, deeper than its elements are large."""
    gap = np.zeros((16, 16))
    gap[7:9, 7:9] = 0.9
    np.save(blocks.with_name("gap.npy"), gap)
    hole = "structure.contacts.0.gap={shape: heights, file: gap.npy}"
    summary = run(blocks, tmp_path / "out", hole)
    assert any("show what is worn alone" in line for line in summary["warnings"])
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        low = file["bodies/Foot-1/unworn/points"][:, 2].min()
    assert low == 2.0


@pytest.mark.parametrize("group", ["cut", slow("edge")])
def test_supports_on_a_contact_face(tmp_path, group):
    """On a plane of symmetry the contact is the whole one; a held edge is none, and warned of."""
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
    """Its contact would be a narrow strip: the plane says what is meant."""
    held = [{"group": group, "hold": "y"} for group in ("base_high", "foot_low", "foot_high")]
    supports = json.dumps([*BLOCKS["supports"], *held])
    assert "as in a slice in plane strain" in refused(blocks, f"structure.supports={supports}")


def test_template_lacks_its_file(tmp_path):
    path = tmp_path / "mesh.yaml"
    path.write_text(template("mesh"), encoding="utf-8")
    ending = invoke("check", path)
    assert ending.exit_code == 2
    assert "structure.file: 'joint.msh': no such file" in ending.stderr


def test_lists_hold_something(blocks):
    for name in ("contacts", "supports", "loads"):
        line = refused(blocks, f"structure.{name}=[]")
        assert f"structure.{name}=[]: a list of 0: too short; allowed: a list of at least 1" in line
