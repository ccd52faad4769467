"""Tests of contacts cut by planes of symmetry: mesh cases of a part and of the whole."""

import h5py
import numpy as np
import pytest

from fe_models import structure
from fe_models.meshes.structure_mesh import StructureMesh, write_msh
from tests.mirrored_blocks import pad_on_block
from tests.workflow.command_line import invoke
from tests.workflow.mesh_scenes import WEAR, refused, run, write_case
from tests.workflow.wear.mesh.plane_blocks import RADIUS, Blocks, error, solved

pytestmark = pytest.mark.usefixtures("reads_here")

# Solvers leave 1e-7 and 1e-8 of pressures and slips; energies of slips that hardly are some 1e-6.
SAME = 1e-5


def test_hertz_from_half_a_cylinder(tmp_path):
    """Blocks are 40 times as thick as the contact is wide; half of them carry P/2."""
    blocks = Blocks(
        (0, 80), 80, (0, 80), 80, (0, 2.5), materials=({}, {}), line_contact=4096, half=True
    )
    modulus = 200e3 / (2.0 * (1.0 - 0.3**2))
    load, peak = np.pi * modulus / (4.0 * RADIUS), 0.5 * modulus / RADIUS  # 1 mm to either side
    case = blocks.press(tmp_path, 0.4, 0.5 * load)
    history, stage, first = solved(case)
    assert history.loads.P[0] == pytest.approx(load, rel=1e-6)
    assert stage.grid.size[0] == pytest.approx(160.0)
    np.testing.assert_allclose(stage.grid.x.ravel(), -stage.grid.x.ravel()[::-1], atol=1e-12)
    hertz = peak * np.sqrt(np.maximum(1.0 - stage.grid.x**2, 0.0))
    assert error(first.pressure[0], hertz) < 0.015


PRESS = {"kind": "pressure", "group": "pad_lid", "pressure": 60, "path": [1, 1, 1, 1]}


def pushed(planes):
    """Return loads along x, back and forth, by 60 N in total."""
    force = [60.0 * 0.5 ** len(planes), 0, 0]
    return {"kind": "force", "group": "pad_lid", "force": force, "path": [0, 1, -1, 1]}


def stretched(planes):
    """Return equal tractions along x, back and forth, on both sides of the pad."""
    return {"kind": "pressure", "group": "pad_rims", "pressure": -60, "path": [0, 1, -1, 1]}


def write(folder, planes, load=pushed, match=True, gap=None, **changes):
    """Write the pad on its block, cut by ``planes``, pressed and then under another load."""
    bodies, name = pad_on_block(planes, match), f"cut{len(planes)}"
    write_msh(folder / f"{name}.msh", StructureMesh(bodies, ()))
    cuts = [(body.name, "xy"[axis]) for axis in planes for body in bodies]
    gap = gap or {"shape": "paraboloid", "radius_x": 200.0, "radius_y": 300.0}
    contact = {"name": "foot", "face_1": "block_top", "face_2": "pad_bottom", "x": [1, 0, 0]}
    described = {
        "file": f"{name}.msh",
        "body_1": "block",
        "body_2": "pad",
        "contacts": [contact | {"gap": gap}],
        "supports": [
            {"group": "block_base", "hold": "all"},
            *({"group": f"{body}_cut_{axis}", "hold": axis} for body, axis in cuts),
        ],
        "loads": [PRESS, load(planes)],
    }
    legs = {"increments": [2, 2, 3, 3], "cycle_from": 3, "peak_leg": 4}
    return write_case(folder / f"{name}.yaml", described, legs, 0.3, (16, 16), **changes)


def reported(out):
    """Return fields on the grid and load histories of a run, by their names."""
    found = {}

    def keep(name, item):
        grids = ("surfaces/", "contact/", "kinetics/", "stress/life/", "error/")
        if isinstance(item, h5py.Dataset) and (name.startswith(grids) or "load_history" in name):
            found[name] = np.asarray(item[()], dtype=float)

    with h5py.File(out / "results.h5") as file:
        file.visititems(keep)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("planes", "load", "match", "method", "order"),
    [
        ((1,), pushed, True, "full", 1),
        ((0, 1), stretched, False, "normal", 2),
        ((1,), pushed, False, "nodes", 1),
    ],
)
def test_part_wears_as_the_whole_does(tmp_path, monkeypatch, planes, load, match, method, order):
    """Pressures, shears, slips, surfaces, loads, life and errors agree; the mesh is halved."""
    # As many cycles of either: what closes within CLOSED in two may be told to go on in the other.
    monkeypatch.setattr(structure, "CLOSED", -1.0)
    monkeypatch.setattr(structure, "MOST_CYCLES", 3)
    wear = WEAR | {"cycles": 1e5, "step": {"kind": "implicit", "cycles": 1e5}}
    if method == "nodes":
        wear["step"] = {"kind": "second_order"}
    stress = {"section": "none", "life": {"parameter": "smith_watson_topper"}}
    settings = f"contact.method={method}", f"mesh.order={order}"
    summaries, fields = [], []
    for cut in (planes, ()):
        budget = "known" if method == "full" else "probed"
        case = write(tmp_path, cut, load, match, wear=wear, stress=stress, error_budget=budget)
        out = tmp_path / f"out{len(cut)}"
        summaries.append(run(case, out, *settings)["foot"])
        fields.append(reported(out))
    part, whole = fields
    assert part.keys() == whole.keys()
    for name, values in whole.items():
        largest = np.nanmax(np.abs(values), initial=0.0)
        if name.split("/")[-1] in ODD[planes]:
            largest = np.abs(whole["structure/foot/load_history/P"]).max()
        np.testing.assert_allclose(part[name], values, atol=SAME * largest, err_msg=name)
    mine, theirs = summaries
    assert theirs["depth_1"] > 0.0
    for number in (1, 2):
        assert mine[f"mesh_volume_{number}"] * 2 ** len(planes) == pytest.approx(
            theirs[f"mesh_volume_{number}"], rel=SAME
        )
        shares = [s["worn_nodes"][f"body_{number}"] for s in summaries]
        assert shares[0]["nodes"] < shares[1]["nodes"]
        assert [s["volume_share"] for s in shares] == pytest.approx([1.0, 1.0], abs=1e-9)
    if method != "nodes":
        assert mine["mesh_volume_1"] * 2 ** len(planes) == pytest.approx(mine["volume_1"], rel=1e-9)


# What forces that are each other's images do not have, but for rounding.
ODD = {(1,): {"Qy", "Mx", "Mz"}, (0, 1): {"Qx", "Qy", "Mx", "My", "Mz"}}


def test_heights_of_another_shape_beyond_the_plane_are_refused(tmp_path):
    """The heights are those of the whole face, half of which would be ignored."""
    gap = np.add.outer(np.linspace(0.0, 1e-3, 16), np.zeros(16))
    np.save(tmp_path / "gap.npy", gap)
    heights = {"shape": "heights", "file": "gap.npy"}
    across_y, across_x = (write(tmp_path, planes, gap=heights) for planes in ((1,), (0, 1)))
    assert invoke("check", across_y).exit_code == 0
    line = refused(across_x)
    assert "gap.npy: not symmetric about a plane of symmetry across x" in line
