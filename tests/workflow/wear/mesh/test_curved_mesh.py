"""Tests of a meshed cylinder and ball pressed on a plane: Hertz, whatever the file format."""

import re
from itertools import pairwise
from pathlib import Path

import fretscale
import numpy as np
import pytest

from fe_models.geometry.imported import patch, read_bodies
from fe_models.meshes.gmsh_session import gmsh_model
from sa_solver.reference.hertz import HertzCylinder, HertzSphere
from sa_solver.types import ElasticPair, Material
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import WEAR, run, write_case
from workflow.analyses.wear.structures.mesh.case import MeshCase
from workflow.kinds import load_case

pytestmark = [pytest.mark.usefixtures("reads_here")]

RADIUS, FORCE = 30.0, 250.0
SIZE = {2: 0.35, 3: 0.5}
STEEL = Material(200e3, 0.3)
MODULUS = ElasticPair(STEEL, STEEL).contact_modulus
PEAK = {
    2: HertzCylinder(FORCE, RADIUS, MODULUS).peak_pressure,
    3: HertzSphere(FORCE, RADIUS, MODULUS).peak_pressure,
}
FORM = "the form of its faces is uncertain"
GRID = {2: (512, 1), 3: (128, 128)}


def bodies(gmsh, dimension):
    """Return the tags of a block and of a segment of a cylinder or a cap of a ball on it."""
    occ = gmsh.model.occ
    if dimension == 2:
        block, foot = occ.addRectangle(-15, -12, 0, 30, 12), segment(occ)
    else:
        block, disk = occ.addBox(-4, -4, -3, 8, 8, 3), occ.addSphere(0, 0, RADIUS, RADIUS)
        cut = occ.addCylinder(0, 0, -1, 0, 0, 4, 3)
        ((_, foot),) = occ.intersect([(3, disk)], [(3, cut)])[0]
    occ.synchronize()
    return block, foot


def segment(occ):
    """Return a segment of 12 x 10 mm with an arc below; the contact ends before the corners."""
    centre = occ.addPoint(0, RADIUS, 0)
    ends = [occ.addPoint(x, RADIUS - np.sqrt(RADIUS**2 - x**2), 0) for x in (-6, -5, 5, 6)]
    arcs = [occ.addCircleArc(start, centre, end) for start, end in pairwise(ends)]
    top = [occ.addPoint(x, 10, 0) for x in (6, -6)]
    lines = [occ.addLine(*pair) for pair in pairwise([ends[3], *top, ends[0]])]
    return occ.addPlaneSurface([occ.addCurveLoop([*arcs, *lines])])


def sides(gmsh, dimension, body):
    """Return the boundaries of a body with the heights of their centres."""
    up = 1 if dimension == 2 else 2
    return {
        tag: gmsh.model.occ.getCenterOfMass(dim, tag)[up]
        for dim, tag in gmsh.model.getBoundary([(dimension, body)], oriented=False)
    }


def meshed(path: Path, dimension: int, order: int) -> dict[str, str]:
    """Write both bodies as a mesh, or for order 0 as CAD; return the names of bodies and faces."""
    with gmsh_model("bodies") as gmsh:
        block, foot = bodies(gmsh, dimension)
        below, above = sides(gmsh, dimension, block), sides(gmsh, dimension, foot)
        faces = {
            "base": min(below, key=below.__getitem__),
            "seat": max(below, key=below.__getitem__),
            "sole": min(above, key=above.__getitem__),
            "head": max(above, key=above.__getitem__),
        }
        if order == 0:
            gmsh.write(str(path))
        else:
            for name, tag in (("block", block), ("foot", foot)):
                gmsh.model.addPhysicalGroup(dimension, [tag], name=name)
            for name, tag in faces.items():
                gmsh.model.addPhysicalGroup(dimension - 1, [tag], name=name)
            if dimension == 2:  # upright edges, at half of the height
                upright = [tag for tag, z in above.items() if 5.0 < z < 6.0]
                gmsh.model.addPhysicalGroup(1, upright, name="sides")
            field = gmsh.model.mesh.field
            field.add("Box", 1)
            near = {
                "VIn": SIZE[dimension],
                "VOut": 2.0 if dimension == 2 else SIZE[3],
                "Thickness": 6.0,
            }
            near |= {"XMin": -2.5, "XMax": 2.5, "YMin": -2.0, "YMax": 2.0}
            for entry, value in near.items():
                field.setNumber(1, entry, value)
            field.setAsBackgroundMesh(1)
            for option in ("ExtendFromBoundary", "FromPoints"):
                gmsh.option.setNumber(f"Mesh.MeshSize{option}", 0)
            gmsh.model.mesh.generate(dimension)
            gmsh.model.mesh.setOrder(order)
            gmsh.write(str(path))
    if order == 0:
        return named_by_cad(path)
    return {name: name for name in ("block", "foot", "base", "seat", "sole", "head")}


def named_by_cad(path: Path) -> dict[str, str]:
    """Return the names of solids and faces of a CAD file, found by their positions."""
    names = {"block": "solid_1", "foot": "solid_2"}
    for solid, low, high in (("solid_1", "base", "seat"), ("solid_2", "sole", "head")):
        body = read_bodies(path, SIZE[3]).bodies[solid]
        heights = {name: patch(body, name).centroid[2] for name in body.mesh.boundaries or {}}
        names |= {low: min(heights, key=heights.get), high: max(heights, key=heights.get)}
    return names


def pressed(folder: Path, dimension: int, order: int) -> Path:
    """Write the case of a foot that is pressed and moved back and forth without sliding."""
    file = folder / ("bodies.msh" if order else "bodies.step")
    names = meshed(file, dimension, order)
    structure = {
        "file": file.name,
        "body_1": names["block"],
        "body_2": names["foot"],
        "contacts": [
            {"name": "sole", "face_1": names["seat"], "face_2": names["sole"], "x": [1, 0, 0]}
        ],
        "supports": [{"group": names["base"], "hold": "all"}],
        "loads": [
            {"kind": "force", "group": names["head"], "force": [0, 0, -FORCE], "path": [1, 1, 1]},
            {
                "kind": "displacement",
                "group": names["head"],
                "displacement": ["1 um", 0, 0],
                "path": [0, 1, -1],
            },
        ],
    }
    return write_case(
        folder / "case.yaml",
        structure,
        {"increments": [2, 2, 2], "cycle_from": 2, "peak_leg": 2},
        grid=GRID[dimension],
        wear=WEAR | {"cycles": 1.0, "step": {"kind": "explicit", "cycles": 1.0}},
        error_budget="known",
        **({"mesh": {"size": SIZE[3]}} if order == 0 else {}),
    )


@pytest.mark.parametrize(
    ("dimension", "order"),
    [
        (2, 1),
        (2, 2),
        pytest.param(3, 1, marks=pytest.mark.slow),
        pytest.param(3, 2, marks=pytest.mark.slow),
        pytest.param(3, 0, marks=pytest.mark.slow),
    ],
)
def test_hertz_of_a_mesh_that_is_coarser_than_the_contact(tmp_path, dimension: int, order: int):
    """Facets alone would give 955 MPa instead of Hertz's 540 MPa, or more on a facet.

    The small number of nodes is reported, by number and name.
    """
    case = pressed(tmp_path, dimension, order)
    summary = run(case, tmp_path / "out")
    assert summary["sole"]["peak_pressure"]["unworn"] == pytest.approx(PEAK[dimension], rel=0.015)
    reported = [line for line in summary["warnings"] if line.startswith("sole: ")]
    assert any("carry the peak load" in line for line in reported), reported
    assert not any(FORM in line for line in reported), reported


@pytest.mark.slow
def test_vertices_that_are_off_their_surface_give_a_warning(tmp_path):
    """The reported effect on the peak pressure is at least the actual one."""
    case = pressed(tmp_path, 2, 1)
    with gmsh_model("moved") as gmsh:
        gmsh.open(str(tmp_path / "bodies.msh"))
        tags, points, _ = gmsh.model.mesh.getNodes()
        points = points.reshape(-1, 3)
        height = RADIUS - np.sqrt(RADIUS**2 - np.clip(points[:, 0], -5.0, 5.0) ** 2)
        arc = (np.abs(points[:, 1] - height) < 1e-9) & (np.abs(points[:, 0]) > 1e-9)
        off = 2e-4 * np.random.default_rng(0).uniform(-1.0, 1.0, arc.sum())
        for tag, (x, y, z), up in zip(tags[arc], points[arc], off, strict=True):
            gmsh.model.mesh.setNode(int(tag), [x, y + up, z], [])
        gmsh.write(str(tmp_path / "bodies.msh"))
    summary = run(case, tmp_path / "out")
    (reported,) = [line for line in summary["warnings"] if FORM in line]
    share = float(re.search(r"(\d+) %", reported)[1]) / 100.0
    true = abs(summary["sole"]["peak_pressure"]["unworn"] / PEAK[2] - 1.0)
    assert 0.02 < true < share < 10.0 * true


def test_check_reports_the_curvature_of_a_face(tmp_path):
    """Outer facets are 2 mm long, and their chords deviate from the circle by 17 µm."""
    case = pressed(tmp_path, 2, 1)
    printed = invoke("check", case).output
    assert "body 2 up to" in printed
    assert "off its facets (fitted through nodes, to" in printed
    loaded = load_case(case)
    assert isinstance(loaded, MeshCase)
    (sole,) = loaded.structure.mesh(None).interfaces
    surface = sole.surface
    assert surface is not None
    lengths = np.abs(np.diff(sole.coordinates[sole.facets, 0], axis=1))[:, 0]
    exact = -(lengths**2) / (8.0 * RADIUS)
    np.testing.assert_allclose(surface.bulges[:, 0], exact, rtol=0.05)


@pytest.mark.parametrize("method", ["normal", pytest.param("full", marks=pytest.mark.slow)])
def test_scar_of_a_cylinder_that_slides(tmp_path, method: str):
    """The scar equals that of a cylinder in closed form, worn over the relative stroke.

    The upright sides move by 20 µm back and forth; elastic deformation takes up 3.3 µm of it.
    """
    case, cycles = pressed(tmp_path, 2, 2), 1e5
    moved = "{kind: displacement, group: sides, displacement: [20 um, 0, 0], path: [0, 1, -1]}"
    wear = f"wear.cycles={cycles}", "wear.step={kind: implicit}", f"contact.method={method}"
    summary = run(case, tmp_path / "out", f"structure.loads.1={moved}", *wear)["sole"]
    stroke = summary["energy_per_cycle"]["structure"] / (2.0 * 0.5 * FORCE)
    assert 0.030 < stroke < 0.040
    same = {
        "title": "The cylinder itself",
        "analysis": "wear",
        "structure": {"kind": "bodies", "shape": "cylinder", "radius": RADIUS},
        "materials": {f"body_{k}": {"young": STEEL.young, "poisson": 0.3} for k in (1, 2)},
        "friction": {"coefficient": 0.5},
        "load_path": {"P": FORCE, "stroke": stroke, "increments": 1},
        "contact": {"grid": 512, "size": 4.0},
        "wear": WEAR | {"cycles": cycles, "step": {"kind": "implicit"}},
        "output": {"paraview": False, "figures": False},
    }
    alone = fretscale.run(same, tmp_path / "alone").summary["interface"]
    for name in ("depth_1", "volume_1", "depth_2", "volume_2"):
        assert summary[name] == pytest.approx(alone[name], rel=0.02), name
