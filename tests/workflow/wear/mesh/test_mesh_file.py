"""Tests of cases of a mesh file: names, other contents, CAD, and missing names."""

import json

import numpy as np
import pytest

from fe_models.geometry.imported import patch, read_bodies
from fe_models.meshes.gmsh_session import gmsh_model
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import BLOCKS, TO_AND_FRO, edit, refused, run, write_case
from workflow.kinds import load_case

pytestmark = pytest.mark.usefixtures("reads_here")


def test_cards_that_are_not_used_are_listed(blocks, tmp_path):
    """Loads, supports and contact of the other program are listed by line, if there are any."""
    file = tmp_path / "blocks.inp"
    assert "not taken over" not in invoke("check", blocks).output
    assert "not taken over" not in invoke("describe", file).output
    given = "*Boundary\nBase-1.low, 1, 3\n*Cload, amplitude=up\n5, 3, -100.\n6, 3, -50.\n"
    given += "*Friction\n0.3\n"
    line = 1 + edit(file, "*Static\n", f"*Static\n{given}").index("*Static")
    reported = invoke("describe", file).output.splitlines()[-3:]
    assert reported == [
        f"not taken over: blocks.inp:{line + 1}: *boundary: Base-1.low, 1, 3",
        f"not taken over: blocks.inp:{line + 3}: *cload, amplitude=up: 5, 3, -100. ...",
        f"not taken over: blocks.inp:{line + 6}: *friction: 0.3",
    ]
    printed = " ".join(invoke("check", blocks).output.split())
    assert "3 lines with loads, supports, contacts or materials not used" in printed


def test_a_face_in_two_parts(blocks, tmp_path):
    """Both names give the whole; one alone is warned of; a repeated or missing one is refused."""
    edit(
        tmp_path / "blocks.inp",
        "*Surface, type=ELEMENT, name=foot_low\n1, S1\n2, S1\n3, S1\n4, S1\n",
        "*Surface, type=ELEMENT, name=low_a\n1, S1\n2, S1\n"
        "*Surface, type=ELEMENT, name=low_b\n3, S1\n4, S1\n",
    )
    face = "structure.contacts.0.face_2="
    printed = invoke("check", blocks, "--set", f"{face}[low_a, low_b]").output
    assert "its faces share" not in printed
    assert "1 mm² of 4 and 1 mm²" in printed
    assert "its faces share" not in invoke("check", blocks, "--set", f"{face}low_a").output
    summary = run(blocks, tmp_path / "out", f"{face}[low_a, low_b]")
    assert summary["foot"]["peak_load"]["unworn"]["P"] == pytest.approx(40.0, rel=1e-6)
    assert "a boundary twice; allowed: each once" in refused(blocks, f"{face}[low_a, low_a]")
    assert "none; allowed: one boundary or several" in refused(blocks, f"{face}[]")
    assert "no boundary low_c on body Foot-1" in refused(blocks, f"{face}[low_a, low_c]")


def test_a_node_set_may_be_a_face(blocks, tmp_path):
    """Its facets have all their corners in the set; a set with other nodes is no face."""
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


def test_faces_that_share_only_half_give_a_warning(blocks, tmp_path):
    """Only half of the lower cube's top is named, so the foot overhangs it."""
    edit(
        tmp_path / "blocks.inp",
        "*Surface, type=ELEMENT, name=base_high\n5, S2\n6, S2\n7, S2\n8, S2\n",
        "*Surface, type=ELEMENT, name=base_high\n5, S2\n6, S2\n",
    )
    printed = " ".join(invoke("check", blocks).output.split())
    assert "foot: its faces share only 0.5 mm² of 2 and 1" in printed


def face_at(imported, body, height, normal):
    """Return the boundary of a body at a height with a normal along z."""
    for name in imported.bodies[body].mesh.boundaries:
        surface = patch(imported.bodies[body], name)
        if np.allclose(surface.normal, [0, 0, normal]) and np.isclose(surface.centroid[2], height):
            return name
    raise AssertionError((body, height, normal))


@pytest.fixture
def cad(tmp_path):
    """Return boxes of 4 and 2 mm in a STEP file, with their faces found by position."""
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


def test_node_sets_that_are_no_faces(blocks, tmp_path):
    """They accept forces, shared by their nodes, but no pressure; one node accepts no moment."""
    part = "*End Part\n*Assembly"
    tips = "*Nset, nset=tip\n5\n*Nset, nset=top\n19, 21, 25, 27\n"
    edit(blocks.with_name("blocks.inp"), part, f"{tips}{part}")
    at_tip = "structure.loads.1.group=tip"
    assert invoke("check", blocks, "--set", at_tip).exit_code == 0
    line = refused(blocks, at_tip, "structure.loads.1.at=[9, 0, 0]")
    assert "the 1 nodes of tip cannot carry its moment" in line
    assert "tip is a node set that is not a face" in refused(blocks, "structure.loads.0.group=tip")
    assert "tip is a node set" in refused(blocks, "structure.contacts.0.face_2=tip")
    overrides = "structure.supports.0.group=tip", "structure.supports.0.hold=normal"
    assert "node set tip has no area to hold normal" in refused(blocks, *overrides)
    peak = run(blocks, tmp_path / "out", "structure.loads.1.group=top")["foot"]["peak_load"]
    assert peak["unworn"]["Qx"] == pytest.approx(-4.0, rel=1e-5)


def test_node_sets_that_are_faces_take_what_faces_take(blocks, tmp_path):
    """Pressure and forces on the nodes of a face equal those on the face, to all digits."""
    high = "*Surface, type=ELEMENT, name=foot_high\n5, S2\n6, S2\n7, S2\n8, S2\n"
    low = "*Surface, type=ELEMENT, name=base_low\n1, S1\n2, S1\n3, S1\n4, S1\n"
    whole = run(blocks, tmp_path / "whole")["foot"]
    file = blocks.with_name("blocks.inp")
    edit(file, high, "*Nset, nset=foot_high, generate\n19, 27, 1\n")
    edit(file, low, "*Nset, nset=base_low, generate\n1, 9, 1\n")
    normal = "structure.supports=[{group: base_low, hold: normal}, {group: base_low, hold: xy}]"
    by_nodes = run(blocks, tmp_path / "nodes", normal)["foot"]
    for name in ("depth_1", "volume_2", "energy"):
        assert by_nodes[name] == pytest.approx(whole[name], rel=1e-9)


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("body_1", "Nix"),
        ("contacts.0.face_1", "foot_low"),
        ("contacts.0.face_2", "nix"),
        ("supports.0.group", "nix"),
        ("loads.1.group", "nix"),
    ],
)
def test_names_that_are_not_in_the_file_are_refused(blocks, key, name):
    message = refused(blocks, f"structure.{key}={name}")
    assert message.startswith(f"--set structure.{key}={name}: ")
