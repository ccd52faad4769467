"""Tests of stress under a contact with a rigid body: that of the elastic body, and pictures."""

import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from sa_solver.reference.hertz import HertzCylinder, HertzSphere
from sa_solver.reference.subsurface import cylinder_stress, sphere_axis_stress
from tests.marks import slow
from tests.workflow.command_line import command
from tests.workflow.conftest import contents_of
from tests.workflow.output.shown_files import check_arrays, check_scene
from workflow.analyses.wear.figures.wear import figures_of
from workflow.analyses.wear.paraview.wear import write_wear
from workflow.kinds import template
from workflow.shell.output.results import own

POISSON = 0.3
MODULUS = 115e3 / (1.0 - POISSON**2)
SPHERE = HertzSphere(50.0, 10.0, MODULUS)
CYLINDER = HertzCylinder(50.0, 10.0, MODULUS)
# Largest shear stress on the axis over p0 and its depth over a (Johnson 1985, 4.2 and 3.4).
MOST_SHEARED = {"sphere": (0.310, 0.48), "cylinder": (0.300, 0.786)}


@pytest.mark.parametrize(
    ("shape", "rigid"), [("sphere", 2), ("cylinder", 1), slow("sphere", 1), slow("cylinder", 2)]
)
def test_the_elastic_body_is_stressed_as_hertz_says(tmp_path: Path, shape: str, rigid: int) -> None:
    """The stress on the axis under pressure agrees from 0.05 to two contact radii of depth.

    Cells of a/16 have an error of 1 % of p0.
    """
    kind = "bodies_wear" if shape == "sphere" else "line_wear"
    hertz = SPHERE if shape == "sphere" else CYLINDER
    a = SPHERE.contact_radius if shape == "sphere" else CYLINDER.half_width
    size, cells = (f"[{2.5 * a}, {2.5 * a}]", "[41, 41]") if shape == "sphere" else (3 * a, 97)
    elastic = 3 - rigid
    (tmp_path / "case.yaml").write_text(template(kind), encoding="utf-8")
    ending = command(
        *("run", tmp_path / "case.yaml", "--out", tmp_path / "out"),
        overrides=[
            f"materials.body_{rigid}=rigid",
            f"materials.body_{elastic}={{young: 115 GPa, poisson: {POISSON}}}",
            *("friction.coefficient=0", "load_path.stroke=1e-6", "load_path.increments=1"),
            *(f"contact.grid={cells}", f"contact.size={size}"),
            *("wear.cycles=1", "wear.step.cycles=1", "error_budget=known"),
            f"stress={{depth: {2 * a}, points: 60, life: {{depth: {0.05 * a}}}}}",
            "output={figures: false, paraview: false, report: false}",
        ],
    )
    assert ending.exit_code == 0, ending.stderr
    reported = json.loads((tmp_path / "out/summary.json").read_text())["interface"]["stress"]
    assert list(reported["von_mises"]) == list(reported["tension"]) == [f"body_{elastic}"]
    with h5py.File(tmp_path / "out/results.h5") as file:
        section = file["stress/section/interface"]
        assert list(section["unworn"]) == [f"body_{elastic}"]
        assert set(own(file["stress/life/interface/worn"])) == {f"body_{elastic}", "left_out"}
        depths, stress = section["depths"][()], section[f"unworn/body_{elastic}/stress"][()]
    axis = stress[:, stress.shape[1] // 2]
    if shape == "sphere":
        expected = sphere_axis_stress(SPHERE, depths, POISSON)
    else:
        expected = cylinder_stress(CYLINDER, 0.0, np.zeros_like(depths), depths, POISSON)
    np.testing.assert_allclose(axis, expected, atol=0.01 * hertz.peak_pressure)
    shear = 0.5 * (axis[0] - axis[2]) / hertz.peak_pressure
    largest, depth = MOST_SHEARED[shape]
    assert shear.max() == pytest.approx(largest, rel=0.015)
    assert depths[shear.argmax()] / a == pytest.approx(depth, abs=0.06)
    if rigid == 1:
        _shown(tmp_path / "out", f"body_{elastic}")


def _shown(folder: Path, elastic: str) -> None:
    """Assert that figures and files for ParaView leave the rigid body out, and name it."""
    contents = contents_of(folder)
    with h5py.File(folder / "results.h5") as file:
        figure = figures_of(contents)["subsurface_stress"](file)
        assert figure.get_supxlabel().startswith(f"{elastic} above z = 0")
        assert "body_1 is rigid" in figure.get_supxlabel()
        assert figure.axes[0].get_ylim()[0] == 0.0
        write_wear(contents, file, folder / "shown")
    sections = sorted(path.stem for path in (folder / "shown/section").iterdir())
    assert sections == ["interface_unworn_2", "interface_worn_2"]
    check_arrays(folder / "shown")
    check_scene(folder / "shown/view.py")
