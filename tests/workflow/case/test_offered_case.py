"""Tests of ``fretscale describe --case``: a file becomes a case, and ignored parts are listed."""

import json

import numpy as np
import pytest
from ruamel.yaml import YAML

from fe_models.meshes.gmsh_session import gmsh_model
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import ASSEMBLY, BLOCKS, TO_AND_FRO, WEAR, cube, run, write_case
from workflow.commands.offered_case import TO_FILL

pytestmark = pytest.mark.usefixtures("reads_here")

# The model of the blocks of the other tests, as CAE writes it: 40 MPa, then 4 N back and forth.
SECTION = "*Elset, elset=all, generate\n1, 8, 1\n*Solid Section, elset=all, material=Steel\n,\n"
MODEL = """\
*Material, name=Steel
*Density
7.85e-09,
*Elastic
206843.5, 0.29
*Expansion
1.2e-05,
*Surface Interaction, name=dry
1.,
*Friction, slip tolerance=0.005
0.55,
*Surface Behavior, pressure-overclosure=HARD
*Contact Pair, interaction=dry, type=SURFACE TO SURFACE
Foot-1.foot_low, Base-1.base_high
*Initial Conditions, type=TEMPERATURE
Foot-1.foot_nodes, 20.
*Boundary
Base-1.base_nodes, ENCASTRE
*Step, name=Press
*Static
*Dsload
Foot-1.foot_high, P, 40.
*End Step
*Step, name=Push
*Static
*Dsload
Foot-1.foot_high, TRVEC, 4., 1., 0., 0.
*End Step
*Step, name=Pull
*Static
*Dsload, amplitude=Ramp
Foot-1.foot_high, TRVEC, -4., 1., 0., 0.
*Cload
Foot-1.foot_nodes, 4, 7.
3, 1, 5.
*Restart, write
*End Step
"""


def deck(folder, model=MODEL):
    """Write a file of both blocks and a model, and return its path."""
    nodes = "*Nset, nset={}_nodes, generate\n1, 9, 1\n"
    text = "".join(
        cube(name, size).replace("*End Part", nodes.format(name) + SECTION + "*End Part")
        for name, size in (("base", 2.0), ("foot", 1.0))
    )
    path = folder / "deck.inp"
    path.write_text(text + ASSEMBLY.replace("*Step\n*Static\n*End Step\n", model), "utf-8")
    return path


def offered(path, *options):
    """Return the offered case as data, and the lines that it leaves out."""
    case = path.with_suffix(".yaml")
    ending = invoke("describe", path, "--case", case, *options)
    assert ending.exit_code == 0, ending.stderr
    lines = [line for line in ending.output.splitlines() if line.startswith("not in the case: ")]
    with case.open(encoding="utf-8") as stream:
        return YAML(typ="safe").load(stream), [
            line.removeprefix("not in the case: ") for line in lines
        ]


def line_of(path, text):
    return path.name + f":{path.read_text('utf-8').splitlines().index(text) + 1}"


def test_an_abaqus_model_becomes_a_case(tmp_path):
    path = deck(tmp_path)
    case, ignored = offered(path)
    structure = case["structure"]
    assert (structure["body_1"], structure["body_2"]) == ("Base-1", "Foot-1")
    (contact,) = structure["contacts"]
    assert (contact["face_1"], contact["face_2"]) == ("base_high", "foot_low")
    assert contact["x"] == [1.0, 0.0, 0.0]
    assert structure["supports"] == [{"group": "base_nodes", "hold": "all"}]
    press, push = structure["loads"]
    assert press == {
        "kind": "pressure", "group": "foot_high", "pressure": 40, "path": [1, 1, 1, 0]
    }  # fmt: skip
    assert push == {
        "kind": "force", "group": "foot_high", "force": [4, 0, 0], "path": [0, 1, -1, 0]
    }  # fmt: skip
    steel = {"young": 206843.5, "poisson": 0.29, "density": 7.85e-9, "expansion": 1.2e-5}
    assert case["materials"] == {"body_1": steel, "body_2": steel}
    assert case["friction"] == {"coefficient": 0.55}
    left_out = (
        "*Surface Behavior, pressure-overclosure=HARD",
        "*Initial Conditions, type=TEMPERATURE",
        "*Dsload, amplitude=Ramp",
        "Foot-1.foot_nodes, 4, 7.",
        "3, 1, 5.",
    )
    assert [line.partition(": ")[0] for line in ignored] == [line_of(path, x) for x in left_out]


def test_only_what_the_user_knows_is_missing(tmp_path):
    """A check names it; with it, the case equals the one written by hand, to all digits."""
    path = deck(tmp_path)
    offered(path)
    case = path.with_suffix(".yaml")
    refusal = invoke("check", case)
    assert refusal.exit_code == 2
    assert "wear.body_1.coefficient" in refusal.stderr
    assert "structure" not in refusal.stderr
    text = case.read_text("utf-8")
    head, _, tail = text.partition("wear:\n")
    assert TO_FILL not in head.split("analysis:")[1]
    case.write_text(head + f"wear: {json.dumps(WEAR)}\n" + tail[tail.index("stress:") :], "utf-8")
    assert invoke("check", case).exit_code == 0, invoke("check", case).stderr
    shared = "output={paraview: false, figures: false}", "contact.grid=[16, 16]"
    legs = "load_path.increments=[1, 2, 2, 2]"
    found = run(case, tmp_path / "offered", *shared, legs)["contact_1"]
    paths = [1, 1, 1, 0], [0, 1, -1, 0]
    loads = [load | {"path": path} for load, path in zip(BLOCKS["loads"], paths, strict=True)]
    structure = {"file": path.name, **BLOCKS, "loads": loads}
    steel = {"young": 206843.5, "poisson": 0.29}
    hand = write_case(
        tmp_path / "hand.yaml",
        structure,
        TO_AND_FRO | {"cycle_from": 1, "peak_leg": 3},
        mu=0.55,
        materials={"body_1": steel, "body_2": steel},
        stress={"section": "none", "life": {"parameter": "none"}},
    )
    expected = run(hand, tmp_path / "hand")["foot"]
    for name in ("depth_1", "volume_2", "energy"):
        assert found[name] == pytest.approx(expected[name], rel=1e-9)


def test_loads_of_every_kind(tmp_path):
    """Loads of a step persist until op=new ends them; a rotating load is a separate one."""
    model = MODEL[: MODEL.index("*Boundary")] + (
        "*Boundary\nBase-1.base_nodes, 1, 3\nFoot-1.foot_high, 2\n"
        "*Step\n*Static\n*Cload\nFoot-1.foot_nodes, 3, -2.\n*Dload\n, GRAV, 9810., 0., 0., -1.\n"
        "*Boundary\nFoot-1.foot_high, 1, 1, 0.01\n*End Step\n"
        "*Step\n*Static\n*Cload, op=NEW\n*Boundary\nFoot-1.foot_high, 1, 1, -0.02\n"
        "*Dload\n, CENTRIF, 90000., 1., 2., 3., 0., 2., 0.\n, BX, 3.\n*End Step\n"
    )
    model = model.replace("Foot-1.foot_high", "Foot-1.foot_top")
    path = deck(tmp_path, model)
    head, tail = path.read_text("utf-8").split("*Part, name=foot\n")
    tops = "*Nset, nset=foot_top, generate\n19, 27, 1\n*End Part"
    path.write_text(head + "*Part, name=foot\n" + tail.replace("*End Part", tops, 1), "utf-8")
    case, ignored = offered(path)
    structure = case["structure"]
    assert structure["supports"] == [
        {"group": "base_nodes", "hold": "all"}, {"group": "foot_top", "hold": "y"}
    ]  # fmt: skip
    named = {load["kind"]: load for load in structure["loads"]}
    assert named["force"]["force"] == [0, 0, -18]  # of 9 nodes
    assert named["force"]["path"] == [1, 0, 0]
    assert named["acceleration"]["acceleration"] == [0, 0, 9810]
    assert named["acceleration"]["path"] == [1, 1, 0]
    assert named["displacement"]["displacement"] == [0.01, 0, 0]
    assert named["displacement"]["path"] == [1, -2, 0]
    assert named["rotation"]["speed"] == 300
    assert named["rotation"]["axis"] == [0, 1, 0]
    assert named["rotation"]["through"] == [1, 2, 3]
    assert named["rotation"]["path"] == [0, 1, 0]
    assert any(line.endswith("a load of type BX: allowed: GRAV, CENTRIF, or *Dsload")
               for line in ignored)  # fmt: skip


def loads_of_steps(folder, *steps):
    """Return the offered loads of steps, by kind and group, and the messages."""
    model = MODEL[: MODEL.index("*Step")]
    text = "".join(f"*Step\n*Static\n{step}*End Step\n" for step in steps)
    case, ignored = offered(deck(folder, model + text))
    return {(load["kind"], load["group"]): load for load in case["structure"]["loads"]}, ignored


def test_several_cards_of_a_step_end_the_loads_before_them_once(tmp_path):
    """CAE writes op=NEW on each card; loads of the first card remain after the second."""
    high, low = "Foot-1.foot_high", "Foot-1.foot_low"
    loads, _ = loads_of_steps(
        tmp_path,
        f"*Dsload\n{high}, P, 40.\n{low}, P, 8.\n",
        f"*Dsload, op=NEW\n{high}, P, 20.\n*Dsload, op=NEW\nFoot-1.foot_cut, P, 5.\n",
    )
    assert loads["pressure", "foot_high"]["path"] == [1, 0.5, 0]
    assert loads["pressure", "foot_low"]["path"] == [1, 0, 0]
    assert loads["pressure", "foot_cut"]["path"] == [0, 1, 0]


def test_loads_of_nothing_end_those_before_them(tmp_path):
    """A moved face returns where a later step says zero; nothing new holds it."""
    high, nodes = "Foot-1.foot_high", "Foot-1.foot_nodes"
    loads, ignored = loads_of_steps(
        tmp_path,
        f"*Dsload\n{high}, P, 0.\n*Cload\n{nodes}, 1, 2.\n{nodes}, 3, 0.\n"
        f"*Boundary\n{high}, 1, 1, 0.01\n",
        f"*Dsload\n{high}, P, 40.\n*Cload\n{nodes}, 1, 0.\n*Boundary\n{high}, 1, 1, 0.\n",
    )
    assert loads["pressure", "foot_high"]["path"] == [0, 1, 0]
    assert loads["force", "foot_nodes"]["path"] == [1, 0, 0]
    assert loads["force", "foot_nodes"]["force"] == [18, 0, 0]  # on 9 nodes
    assert loads["displacement", "foot_high"]["path"] == [1, 0, 0]
    assert not any("from the beginning" in line for line in ignored)


def test_friction_that_a_file_does_not_give_is_asked_for(tmp_path):
    """A contact without friction in Abaqus has none; that of another contact does not apply."""
    pair = "*Contact Pair, interaction=dry, type=SURFACE TO SURFACE\n"
    smooth = "*Surface Interaction, name=smooth\n1.,\n*Contact Pair, interaction=smooth\n"
    faces = "Foot-1.foot_cut, Base-1.base_cut\n"
    model = MODEL.replace(pair, smooth + faces + pair)
    case, _ = offered(deck(tmp_path, model))
    one, two = case["structure"]["contacts"]
    assert one["friction"] == {"coefficient": TO_FILL}
    assert "friction" not in two
    assert case["friction"] == {"coefficient": 0.55}


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ("206843.5, 0.29", "2.1e11, 0.29", "other units"),
        ("*Elastic\n", "*Elastic, type=ORTHOTROPIC\n", "isotropic"),
        ("Foot-1.foot_high, P, 40.", "Foot-1.foot_high, HP, 40., 1., 2.", "type HP"),
        ("*Dsload\nFoot-1.foot_high, TRVEC", "*Boundary, type=VELOCITY\nFoot-1.foot_high, 1, 1, 2.",
         "VELOCITY"),
        ("Base-1.base_nodes, ENCASTRE", "Base-1.base_nodes, ENCASTRE\nBase-1.gone, 1",
         "Base-1.gone"),
    ],
)  # fmt: skip
def test_cards_left_out_are_reported(tmp_path, old, new, reported):
    assert old in MODEL
    _, ignored = offered(deck(tmp_path, MODEL.replace(old, new, 1)))
    assert any(reported in line for line in ignored), ignored


def test_cad_files_leave_supports_and_loads_to_fill_in(tmp_path):
    """CAD gives touching faces; supports and loads have to be added."""
    path = tmp_path / "boxes.step"
    with gmsh_model("boxes") as gmsh:
        gmsh.model.occ.addBox(-2, -2, -2, 4, 4, 2)
        gmsh.model.occ.addBox(-1, -1, 0, 2, 2, 1)
        gmsh.model.occ.addBox(-1, -1, 1, 2, 2, 1)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    case, ignored = offered(path, "--size", "1 mm")
    structure = case["structure"]
    assert [body["name"] for body in structure["other_bodies"]] == ["solid_3"]
    faces = [(pair["face_1"], pair["face_2"]) for pair in structure["contacts"]]
    assert faces == [
        ("solid_1.face_6", "solid_2.face_5"), ("solid_2.face_6", "solid_3.face_5")
    ]  # fmt: skip
    assert structure["contacts"][1]["bodies"] == ["solid_2", "solid_3"]
    assert structure["supports"] == [{"group": TO_FILL, "hold": "all"}]
    assert case["mesh"] == {"size": "1 mm"}
    assert case["friction"] == {"coefficient": TO_FILL}
    assert ignored == []


# --- Nastran --------------------------------------------------------------------------------------

BULK = """\
BEGIN BULK
{grid}CHEXA,1,1,1,2,3,4,5,6,+
+,7,8
CHEXA,2,2,9,10,11,12,13,14,+
+,15,16
PSOLID,1,7
PSOLID,2,8
MAT1,7,210000.,,0.3,7.85-9
MAT1,8,,26316.,.33
BSURFS,1,,,,1,5,6,7
BSURFS,2,,,,2,9,10,11
BCTSET,4,2,1,0.45
SPC1,1,123456,1,THRU,4
SPC1,1,2,13,14
PLOAD4,3,2,25.,,,,13,15
FORCE,3,13,,2.,1.,0.,0.
FORCE,3,14,,2.,1.,0.,0.
FORCE,3,15,5,2.,1.,0.,0.
GRAV,3,,9810.,0.,0.,-1.
RFORCE,3,,,50.,0.,0.,1.
TEMP,3,1,400.
ENDDATA
"""


def bulk(folder, **changes):
    cube_at = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    places = [*cube_at, *((x, y, z + 1) for x, y, z in cube_at)]
    grid = "".join(f"GRID,{n},,{x}.,{y}.,{z}.\n" for n, (x, y, z) in enumerate(places, 1))
    text = BULK.format(grid=grid)
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new)
    path = folder / "deck.bdf"
    path.write_text(text, "utf-8")
    return path


def test_a_nastran_deck_becomes_a_case(tmp_path):
    path = bulk(tmp_path)
    case, ignored = offered(path)
    structure = case["structure"]
    assert (structure["body_1"], structure["body_2"]) == ("1", "2")
    (contact,) = structure["contacts"]
    assert (contact["face_1"], contact["face_2"]) == ("bsurfs_1", "bsurfs_2")
    assert structure["supports"] == [
        {"group": "spc_1_xyz", "hold": "all"}, {"group": "spc_1_y", "hold": "y"}
    ]  # fmt: skip
    loads = {load.pop("kind"): load for load in structure["loads"]}
    assert loads["pressure"] == {"group": "pload4_3", "pressure": 25, "path": [1, 0]}
    assert loads["force"] == {"group": "force_3", "force": [4, 0, 0], "path": [1, 0]}
    assert loads["acceleration"] == {"acceleration": [0, 0, 9810], "path": [1, 0]}
    assert loads["rotation"]["speed"] == pytest.approx(100 * np.pi, rel=1e-9)
    one, two = case["materials"]["body_1"], case["materials"]["body_2"]
    assert one == {"young": 210000, "poisson": 0.3, "density": 7.85e-9}
    assert two["young"] == pytest.approx(2 * 26316 * 1.33, rel=1e-9)
    assert case["friction"] == {"coefficient": 0.45}
    left_out = "FORCE,3,15,5,2.,1.,0.,0.", "TEMP,3,1,400."
    assert [line.partition(": ")[0] for line in ignored] == [line_of(path, x) for x in left_out]


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        (("PLOAD4,3,2,25.,,", "PLOAD4,3,2,25.,30.,"), "corners"),
        (("FORCE,3,14,,2.", "FORCE,3,14,,3."), "force_3"),
        (("BCTSET,4,2,1", "BCTSET,4,2,9"), "contact surface 9"),
        (("FORCE,3,13", "FORCE,6,13"), "3, 6"),
    ],
)
def test_nastran_cards_left_out_are_reported(tmp_path, change, reported):
    _, ignored = offered(bulk(tmp_path, change=change))
    assert any(reported in line for line in ignored), ignored
