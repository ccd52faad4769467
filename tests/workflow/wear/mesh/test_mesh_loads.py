"""Tests of loads of mesh cases other than forces: temperatures, and motions of tied points."""

import json

import h5py
import numpy as np
import pytest

from sa_solver.half_space.subsurface_influence import YY
from tests.workflow.mesh_scenes import STEEL, refused, run
from tests.workflow.wear.mesh.plane_blocks import Blocks, solved
from workflow.analyses.wear.structures.mesh.model import mesh_assembly
from workflow.analyses.wear.translation import structure_loads
from workflow.kinds import load_case

pytestmark = pytest.mark.usefixtures("reads_here")

ALPHA = 12e-6
HOT_STEEL = {"expansion": f"{ALPHA} 1/K"}
# Half of a foot on half of a block, free to expand away from their plane of symmetry.
SCENE = Blocks(
    *((0.0, 6.0), 6.0, (0.0, 2.0), 3.0, (0.0, 1.0), "z", (HOT_STEEL, HOT_STEEL)),
    line_contact=32,
    half=True,
)
HELD = [
    {"group": "base_z0", "hold": "z"},
    {"group": "base_x0", "hold": "normal"},
    {"group": "foot_x0", "hold": "normal"},
]
PRESSED = {"kind": "pressure", "group": "foot_z1", "pressure": "50 MPa", "path": [1, 0.5]}
HEATED = {"kind": "temperature", "change": "100 K", "path": [0.5, 1]}
LEGS = {"increments": [1, 2]}
STRESS = "stress={section: x, depth: 1 mm, points: 9, life: {parameter: findley, depth: 20 um, "
STRESS += "sensitivity: 0.3}}"


def scene(folder, *loads, size=0.5):
    folder.mkdir(exist_ok=True)
    return SCENE.write(folder, size, [PRESSED, *loads], LEGS, friction=0.3)


def settings(supports):
    return STRESS, f"structure.supports={json.dumps(supports)}"


def write_temperatures(path, nodes, values):
    rows = "".join(f"{n},{v}\n" for n, v in zip(nodes, values, strict=True))
    path.write_text(f"node,temperature [K]\n{rows}", encoding="utf-8")


def sections(out):
    with h5py.File(out / "results.h5") as file:
        group = file["stress/section/foot/unworn"]
        return [group[f"body_{body}/stress"][()] for body in (1, 2)]


@pytest.mark.slow
def test_bodies_that_expand_alike_are_pressed_across_their_plane(tmp_path):
    """They expand freely in the plane; along y the stress is -E θ, under contacts too."""
    cold = run(scene(tmp_path / "cold"), tmp_path / "a", *settings(HELD))
    hot = run(scene(tmp_path / "hot", HEATED), tmp_path / "b", *settings(HELD))
    assert hot["foot"]["depth_1"] == pytest.approx(cold["foot"]["depth_1"], rel=1e-3)
    least = 200e3 * ALPHA * 50.0  # peak load is at the end of the first leg
    largest = max(np.nanmax(np.abs(stress)) for stress in sections(tmp_path / "a"))
    for one, two in zip(sections(tmp_path / "a"), sections(tmp_path / "b"), strict=True):
        change = two - one
        change[YY] += least
        assert np.nanmax(np.abs(change)) < 1e-9 * largest


@pytest.fixture
def heated(tmp_path):
    """Return a case with a uniform temperature, and one with the same temperature by nodes."""
    path = scene(tmp_path / "case", HEATED)
    imported = load_case(path).structure.read(None)
    numbers = np.concatenate([imported.node_numbers[name] for name in ("base", "foot")])
    write_temperatures(path.with_name("t.csv"), numbers, np.full(len(numbers), 120.0))
    return path


NODAL = {"kind": "nodal_temperature", "file": "t.csv", "reference": "20 K", "path": [0.5, 1]}


def with_loads(*loads):
    return f"structure.loads={json.dumps([PRESSED, *loads])}"


def test_temperatures_of_nodes_that_are_all_alike(heated):
    """Forces equal those of one temperature for all nodes; a changed file is a new load."""
    supports = settings(HELD)[1]
    models = [
        mesh_assembly(load_case(heated, [supports, with_loads(load)])) for load in (HEATED, NODAL)
    ]
    one, two = (
        [body.loads[:, 1] for body in model.structure(model.meshed()).bodies] for model in models
    )
    for uniform, nodal in zip(one, two, strict=True):
        np.testing.assert_allclose(nodal, uniform, atol=1e-12 * np.abs(uniform).max())
    key = models[1].key
    text = heated.with_name("t.csv").read_text("utf-8")
    heated.with_name("t.csv").write_text(text.replace("120.0", "121.0", 1), "utf-8")
    assert mesh_assembly(load_case(heated, [supports, with_loads(NODAL)])).key != key


@pytest.mark.parametrize(("rows", "named"), [("1,20\n", "loads.1: 47"), ("1,20\n1,30\n", "t.csv")])
def test_temperatures_of_some_nodes_are_refused(heated, rows, named):
    heated.with_name("t.csv").write_text(f"node,temperature\n{rows}", encoding="utf-8")
    assert named in refused(heated, with_loads(NODAL))


def test_expansion_is_asked_for_where_it_counts(heated):
    """Only the heated body needs it, and only in linear structures."""
    cold = f"materials.body_2={json.dumps(STEEL)}"
    assert "materials.body_2.expansion: missing, but a temperature of foot changes" in refused(
        heated, cold
    )
    load_case(heated, [cold, with_loads(HEATED | {"body": "base"})])
    assert "nonlinearity: temperatures change" in refused(heated, "nonlinearity.check=true")
    assert "12: out of range; allowed: at least -0.001" in refused(
        heated, "materials.body_1.expansion=12"
    )


# --- points tied to faces -------------------------------------------------------------------------

LID = {"group": "foot_z1", "at": [1.0, 0.0, 8.0]}
DOWN = {"kind": "remote_displacement", **LID, "displacement": [0, 0, "-2 um"], "path": [1, 1]}
BASE = [{"group": "base_z0", "hold": "all"}]
WHOLE = Blocks((-6.0, 6.0), 6.0, (-2.0, 2.0), 3.0, (-1.0, 1.0), line_contact=32)


@pytest.fixture
def blocks(tmp_path):
    return WHOLE.write(tmp_path, 0.5, [PRESSED], LEGS, friction=0.3)


def first_cycle(path, *loads):
    supports = f"structure.supports={json.dumps(BASE)}"
    case = load_case(path, [supports, f"structure.loads={json.dumps(loads)}"])
    return structure_loads(case, mesh_assembly).unworn_cycle


def test_rigid_face_that_does_not_turn_is_imposed_a_displacement(blocks):
    """The forces equal those with each of its nodes moved."""
    aside = {"displacement": ["1 um", 0, 0], "path": [0, 1]}
    tied = first_cycle(blocks, DOWN | {"tie": "rigid"}, DOWN | aside | {"tie": "rigid"})
    moved = [
        {"kind": "displacement", "group": "foot_z1", "displacement": d, "path": p}
        for d, p in (([0, 0, "-2 um"], [1, 1]), (["1 um", 0, 0], [0, 1]))
    ]
    nodal = first_cycle(blocks, *moved)
    largest = np.abs(nodal.histories[0].force).max()
    np.testing.assert_allclose(
        tied.histories[0].force, nodal.histories[0].force, atol=1e-6 * largest
    )
    averaged = first_cycle(blocks, DOWN, DOWN | aside)
    change = np.abs(averaged.histories[0].force - nodal.histories[0].force).max()
    assert 0.0 < change < 1e-3 * largest  # far below, it is the resultant that counts


@pytest.mark.parametrize(("stroke", "slides"), [("0.5 um", 0), ("6 um", 0), ("300 um", 6)])
def test_half_space_follows_a_point_that_is_moved(blocks, stroke, slides):
    """With friction it sticks, slips in part or slides, with the energies of the nodes."""
    down = DOWN | {"at": [0, 0, 3], "displacement": [0, 0, "-80 um"], "path": [1, 1, 1, 1]}
    aside = down | {"displacement": [stroke, 0, 0], "path": [0, 1, -1, 1]}
    history, _, first = solved(
        blocks,
        f"structure.supports={json.dumps(BASE)}",
        f"structure.loads={json.dumps([down, aside])}",
        "load_path={increments: [1, 2, 4, 4], cycle_from: 3, peak_leg: 4}",
        *("contact.method=full", "friction.coefficient=0.5"),
    )
    assert history.loads.sliding.sum() == slides
    found = first.energy.sum()
    assert found == pytest.approx(history.loads.mean_energy, rel=0.05, abs=1e-6)


@pytest.mark.parametrize("tie", ["averaged", "rigid"])
def test_moment_of_a_force_next_to_the_contact(blocks, tie):
    """The contact carries 100 N/mm and its moment, at a distance of 0.2 mm from the middle."""
    load = {"kind": "force", "group": "foot_z1", "force": [0, 0, "-100 N"], "path": [1, 0.5]}
    (history,) = first_cycle(blocks, load | {"at": [0.2, 0, 5], "tie": tie}).histories
    np.testing.assert_allclose(history.loads.P, [100.0, 75.0, 50.0], rtol=1e-6)
    np.testing.assert_allclose(np.abs(history.loads.My), [20.0, 15.0, 10.0], rtol=1e-5)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"free": ["z"]}, "free"),
        ({"rotation": ["0.1 deg", 0, 0]}, "structure.loads.0.group"),
        ({"group": "foot_z0"}, "foot"),
        ({"group": "head"}, "head"),
    ],
)
def test_motions_of_points_that_do_not_fit_are_refused(blocks, change, named):
    assert named in refused(blocks, f"structure.loads={json.dumps([DOWN | change])}")
