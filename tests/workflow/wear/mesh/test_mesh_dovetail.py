"""The dovetail as a mesh file of another code gives the same results as the built-in one."""

from pathlib import Path

import numpy as np
import pytest

from fe_models.joints import friction
from fe_models.meshes.structure_mesh import write_msh
from tests.workflow.mesh_scenes import ABAQUS_FACES, write_case
from workflow.analyses.wear.structures.dovetail.model import dovetail_joint
from workflow.analyses.wear.structures.mesh.model import mesh_assembly
from workflow.analyses.wear.translation import structure_loads
from workflow.kinds import load_case
from workflow.models.stress.notch_stress import with_local_models

pytestmark = pytest.mark.usefixtures("reads_here")


def write_inp(path: Path, mesh) -> None:
    """Write both bodies to a flat Abaqus file, with element sets and element surfaces."""
    nodes, cells, surfaces = ["*NODE"], [], []
    node, element = 1, 1
    for body in mesh.bodies:
        corners = body.mesh.t.T
        for number, (x, y, z) in enumerate(body.points.tolist(), node):
            nodes.append(f"{number}, {x!r}, {y!r}, {z!r}")
        cells.append(f"*ELEMENT, TYPE=C3D4, ELSET={body.name}")
        for number, vertices in enumerate(corners + node, element):
            cells.append(f"{number}, {', '.join(map(str, vertices))}")
        for name, index in body.mesh.boundaries.items():
            surfaces.append(f"*SURFACE, TYPE=ELEMENT, NAME={body.name}_{name}")
            for facet in index:
                cell = body.mesh.f2t[0, facet]
                places = [corners[cell].tolist().index(v) for v in body.mesh.facets[:, facet]]
                side = [set(face) for face in ABAQUS_FACES].index(set(places))
                surfaces.append(f"{element + cell}, S{side + 1}")
        node, element = node + len(body.points), element + len(corners)
    path.write_text("\n".join([*nodes, *cells, *surfaces, ""]), encoding="utf-8")


def dovetail_as_mesh(folder, dovetail, ending, *, curved=False):
    """Write the dovetail's mesh to a file, and the case that describes it.

    If it is ``curved``, its elements are of second order and follow the fillets. Every increment is
    a separate leg, as the pull follows the square of the speed.
    """
    model = dovetail_joint(dovetail)
    mesh, own = model.meshed(), model.mesh
    if curved:
        mesh = model.geometry.mesh(own.flank_nodes, own.size, 3, own.notch, curved=True)
    file = folder / f"joint{ending}"
    (write_msh if ending == ".msh" else write_inp)(file, mesh)
    path, shape = dovetail.load_path, dovetail.structure
    speeds = np.sqrt(model.load_cycles[0].amplitudes[:, 0]) / path.rotation_speed
    pull = path.airfoil_mass * path.airfoil_radius * path.rotation_speed**2
    widths = ("edge_width", "edge_radius", "end_width", "end_radius")
    rounded = {"shape": "rounded"} | {name: getattr(shape, name) for name in widths}
    contacts = [
        {
            "name": face.name,
            "face_1": f"disk_{face.name}",
            "face_2": f"blade_{face.name}",
            "x": face.frame.axes[0].tolist(),
            "gap": rounded,
        }
        for face in mesh.interfaces
    ]
    spin = {"kind": "rotation", "axis": [0.0, 1.0, 0.0], "through": [0.0, 0.0, 0.0]}
    spin |= {"speed": path.rotation_speed, "path": speeds.tolist()}
    airfoil = {"kind": "force", "group": "blade_shank_top", "force": [0.0, 0.0, pull]}
    structure = {
        "file": file.name,
        "body_1": "disk",
        "body_2": "blade",
        "contacts": contacts,
        "supports": [
            {"group": "disk_inner", "hold": "all"},
            {"group": "disk_sides", "hold": "normal"},
            {"group": "blade_root_bottom", "hold": "mean_y"},
        ],
        "loads": [spin, airfoil | {"path": (speeds**2).tolist()}],
    }
    materials = {
        f"body_{n}": {"young": m.young, "poisson": m.poisson, "density": m.density}
        for n, m in ((1, dovetail.material(1)), (2, dovetail.material(2)))
    }
    legs = {"increments": [1] * len(speeds), "peak_leg": path.legs[0]}
    mu = dovetail.friction.coefficient
    return write_case(folder / "joint.yaml", structure, legs, mu, materials=materials)


@pytest.mark.slow
def test_local_models_of_a_mesh_agree_with_those_of_the_dovetail(tmp_path, small_path, monkeypatch):
    """Tetrahedra of a file and extruded sections differ by no more than their estimated errors."""
    monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / "cache"))
    dovetail = load_case(small_path)
    file = dovetail_as_mesh(tmp_path, dovetail, ".msh", curved=True)
    stages = (
        structure_loads(dovetail, dovetail_joint),
        structure_loads(load_case(file), mesh_assembly),
    )
    fields = []
    for stage in stages:
        cycles = {"unworn": stage.unworn_cycle}
        stresses = stage.stresses(cycles)
        local = with_local_models(stage, cycles, stresses)
        fields.append(local["unworn"].fields)
        for before, after in zip(stresses["unworn"].fields, fields[-1], strict=True):
            assert after.local is not None
            assert after.notch.error < before.notch.error
    for ours, theirs in zip(*fields, strict=True):
        apart = theirs.notch.von_mises / ours.notch.von_mises - 1.0
        assert abs(apart) < ours.local.error + theirs.local.error


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".msh", ".inp"])
def test_dovetail_as_a_mesh_is_the_dovetail(tmp_path, small_path, ending, monkeypatch):
    """Loads, slips and energies of every increment agree to the solver's accuracy."""
    monkeypatch.setattr(friction, "TOLERANCE", 1e-11)
    monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / "cache"))
    dovetail = load_case(small_path)
    ours = structure_loads(dovetail, dovetail_joint)
    theirs = structure_loads(load_case(dovetail_as_mesh(tmp_path, dovetail, ending)), mesh_assembly)
    assert theirs.peak == ours.peak
    for one, two in zip(ours.unworn(), theirs.unworn(), strict=True):
        assert one.interface.name == two.interface.name
        here, there = one.interface.coordinates, two.interface.coordinates
        order = [int(np.argmin(np.linalg.norm(there - place, axis=1))) for place in here]
        np.testing.assert_allclose(there[order], here, atol=1e-9)
        np.testing.assert_allclose(two.interface.gap[order], one.interface.gap, atol=1e-12)
        load, size = one.loads.P.max(), np.abs(here).max()
        work = one.loads.Edx.max()
        scales = {"P": load, "Qx": load, "Qy": load, "Edx": work, "Edy": work}
        for name, scale in (scales | dict.fromkeys(("Mx", "My", "Mz"), load * size)).items():
            values = getattr(one.loads, name), getattr(two.loads, name)
            np.testing.assert_allclose(values[1], values[0], atol=1e-6 * scale, err_msg=name)
        np.testing.assert_array_equal(two.loads.sliding, one.loads.sliding)
        np.testing.assert_allclose(
            two.slip[..., order], one.slip, atol=1e-6 * np.abs(one.slip).max()
        )
    # Nobody tells which surfaces are free but supports, loads and contacts.
    fields = [
        stage.stresses({"unworn": stage.unworn_cycle})["unworn"].fields for stage in (ours, theirs)
    ]
    for one, two in zip(*fields, strict=True):
        for here, there in ((one.peak, two.peak), (one.notch, two.notch)):
            assert there.von_mises == pytest.approx(here.von_mises, rel=1e-6)
            assert there.maximum_principal == pytest.approx(here.maximum_principal, rel=1e-6)
            assert there.error == pytest.approx(here.error, rel=1e-4)
            assert there.at_contact == here.at_contact
    face, original = theirs.faces[0], ours.faces[0]
    np.testing.assert_allclose(face.size, original.size, rtol=1e-9)
    x, y = np.linspace(-5.0, 5.0, 7)[:, None], np.linspace(-28.0, 28.0, 5)[None, :]
    np.testing.assert_allclose(face.gap(x, y), original.gap(x, y), atol=1e-9)
