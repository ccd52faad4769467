"""Tests of wear models that are built and run in Python."""

import subprocess
import sys
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location

import fretscale
import numpy as np
import pytest
import xarray

from sa_solver import InputError, Material
from tests.conftest import CASES
from wear import EnergyLaw
from wear.evolution import CoulombFriction, EnergyTable
from workflow.analyses.wear.model import wear_model
from workflow.messages.warning_kinds import WarningKind

ROOT = CASES.parent
SCRIPTS = ROOT / "docs" / "scripts"
# Names that a program which builds a model has no use for.
UNNEEDED = {"pydantic", "ruamel", "click", "rich", "matplotlib", "pyvista", "workflow.case"}


def script(name):
    """Return a script of the documentation as a module."""
    spec = spec_from_file_location(name, SCRIPTS / f"{name}.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def model():
    """Return a cylinder that slides: four jumps of 500 cycles."""
    own = script("own_loads")
    wear = fretscale.Wear(2000.0, jump=fretscale.JumpSize(cycles=500.0))
    return fretscale.WearModel(own.Reciprocation(), own.contact, wear)


class Interrupted(fretscale.Observer):
    """Observer that raises KeyboardInterrupt after some jumps."""

    def __init__(self, jumps):
        self.jumps = jumps

    def jump_finished(self, before, after):
        if after.jump == self.jumps:
            raise KeyboardInterrupt


def test_the_default_dovetail_is_built_in_python():
    """Equal models give equal numbers, so a run depends on nothing else."""
    assert script("dovetail_joint").model == wear_model(
        fretscale.load_case(CASES / "dovetail.yaml")
    )


@pytest.mark.slow
def test_a_model_wears_as_its_case(tmp_path, monkeypatch):
    # A structure that other processor instructions condensed differs in its last digits.
    monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / "cache"))
    case = fretscale.load_case(
        CASES / "dovetail_small.yaml",
        load_path__increments=[3, 5],
        error_budget="known",
        output__paraview=False,
        output__figures=False,
    )
    written = fretscale.run(case, tmp_path / "out", quiet=True)
    results = wear_model(case).run()
    for flank in ("intrados", "extrados"):
        kinetics = written.summary["kinetics"][flank]
        assert results[flank]["largest_depth_1"].values.tolist() == kinetics["depth_1"]
        assert results[flank]["volume_2"].values.tolist() == kinetics["volume_2"]
        surfaces = written[f"surfaces/{flank}"].xarray()["body_1"]
        np.testing.assert_array_equal(results[flank]["depth_1"].values, -surfaces.values)
    same_stress(results, written)


def same_stress(results, written):
    """Check that a model has the stress of the run of its case, bit for bit."""
    for flank in ("intrados", "extrados"):
        for kind in ("section", "life"):
            found = results[flank][kind]
            for name in found.data_vars:
                for state, moment in enumerate(found["state"].values):
                    for body, number in enumerate(found["body"].values):
                        path = f"stress/{kind}/{flank}/{moment}/body_{number}/{name}"
                        np.testing.assert_array_equal(found[name][state, body], written[path])
    peaks = written.summary["structure"]["peak_stress"]
    for body in ("disk", "blade"):
        found = results[f"bodies/{body}"]
        for state, moment in enumerate(found["state"].values):
            for name in ("points", "displacement", "stress", "von_mises", "maximum_principal"):
                expected = written[f"bodies/{body}/{moment}/{name}"]
                np.testing.assert_array_equal(found[name][state], expected)
            notch = peaks[moment][body]["notch"]
            assert found["notch_stress"].values[state] == notch["von_mises"]
            assert found["notch_error"].values[state] == notch["error"]


@pytest.mark.slow
def test_a_plane_joint_has_the_stress_of_its_case(tmp_path, monkeypatch):
    monkeypatch.setenv("FRETSCALE_CACHE", str(tmp_path / "cache"))
    case = fretscale.load_case(
        CASES / "dovetail_2d.yaml",
        mesh__flank_nodes=[11, 11],
        mesh__size=8.0,
        contact__grid=48,
        load_path__increments=[3, 5],
        wear__cycles=1e4,
        error_budget="known",
        output__paraview=False,
        output__figures=False,
    )
    written = fretscale.run(case, tmp_path / "out", quiet=True)
    same_stress(wear_model(case).run(), written)


def test_stress_under_a_contact_balances_its_loads(model):
    """The section carries the force, and the work of Ruiz is that of friction in a cycle."""
    stress = fretscale.Stress(depth=0.5, points=4, critical_distance=0.01)
    face = replace(model, stress=stress).run()["pad"]
    cell = 1.4 / 160
    friction = face["life"]["friction_parameter"].sum(("x", "y")) * cell
    # F1 is a quarter of the work: friction 0.5 times 50 N/mm over 2 x 40 um.
    np.testing.assert_allclose(friction, 0.25 * 0.5 * 50.0 * 0.08, rtol=1e-7)
    carried = (
        face["section"]["stress"].sel(stress_component="zz").isel(depths=0).sum("along") * cell
    )
    np.testing.assert_allclose(carried, -50.0, rtol=1e-2)  # some of it beside the grid
    assert "bodies" not in face


def test_a_section_beside_the_grid_is_refused(model):
    for wrong in (fretscale.Stress(at=2.0), fretscale.Stress("y")):
        with pytest.raises(InputError, match="contact"):
            replace(model, stress=wrong).run()
    with pytest.raises(InputError, match="depth"):
        fretscale.Stress(depth=0.01)


def test_own_loads_wear_by_archard():
    """Each body loses V = K P s / H for any pressure: 50 N/mm over 80 um and 2000 cycles."""
    face = script("own_loads").model.run()["pad"]
    for body in (1, 2):
        worn = 1e-4 / 3000.0 * 50.0 * 0.08 * 2000.0
        assert face[f"volume_{body}"].values[-1] == pytest.approx(worn, rel=1e-12)
        cell = 1.4 / 160
        by_depth = face[f"depth_{body}"].isel(cycles=-1).sum() * cell
        assert float(by_depth) == pytest.approx(worn, rel=1e-12)
    assert face["P"].attrs["units"] == "N/mm"
    force = face["pressure"].sum(("x", "y")) * cell
    np.testing.assert_allclose(force, 50.0, rtol=1e-7)


def test_results_open_as_netcdf(tmp_path, model):
    results = model.run()
    results.to_netcdf(tmp_path / "results.nc", engine="h5netcdf")
    again = xarray.open_datatree(tmp_path / "results.nc", engine="h5netcdf")
    np.testing.assert_array_equal(again["pad"]["depth_1"], results["pad"]["depth_1"])
    assert again["pad"]["depth_1"].attrs == results["pad"]["depth_1"].attrs


def test_a_run_goes_on_from_a_checkpoint(tmp_path, model):
    checkpoint = fretscale.Checkpoint(tmp_path / "state.h5")
    assert checkpoint.state() is None
    with pytest.raises(KeyboardInterrupt):
        model.run([checkpoint, Interrupted(2)])
    assert checkpoint.state().jump == 2
    whole, rest = model.run(), model.run(start=checkpoint.state())
    assert rest["pad"]["cycles"].values.tolist() == [1000.0, 1500.0, 2000.0]
    np.testing.assert_array_equal(
        rest["pad"]["depth_1"].values, whole["pad"]["depth_1"].values[-3:]
    )


def test_a_state_of_another_model_is_refused(tmp_path, model):
    checkpoint = fretscale.Checkpoint(tmp_path / "state.h5")
    with pytest.raises(KeyboardInterrupt):
        model.run([checkpoint, Interrupted(1)])
    own = script("own_loads")

    class Heavier(own.Reciprocation):
        def unworn(self):
            (cycle,) = super().unworn()
            heavier = type(cycle.loads)(**vars(cycle.loads) | {"P": 2.0 * cycle.loads.P})
            return (type(cycle)(heavier, cycle.slip),)

    coarse = fretscale.Contact((50, 1), *(getattr(own.contact, k) for k in ("bodies", "laws")), 0.5)
    for other in (
        fretscale.WearModel(Heavier(), own.contact, model.wear),
        fretscale.WearModel(own.Reciprocation(), coarse, model.wear),
    ):
        with pytest.raises(InputError, match="another model"):
            other.run(start=checkpoint.state())
    (tmp_path / "state.h5").write_bytes(b"nothing")
    with pytest.raises(fretscale.UserError):
        checkpoint.state()


def test_a_state_belongs_to_its_laws_materials_and_contacts(tmp_path, model):
    """A run from a state that other settings have worn would be a mixture of both."""
    checkpoint = fretscale.Checkpoint(tmp_path / "state.h5")
    with pytest.raises(KeyboardInterrupt):
        model.run([checkpoint, Interrupted(2)])
    state, contact = checkpoint.state(), model.contacts
    softer, faster = Material(100e3, 0.3), EnergyLaw(1e-6)
    for changed in (
        {"bodies": (softer, softer)},
        {"laws": (contact.laws[0], faster)},
        {"friction": 0.3},
        {"method": "full"},
        {"tolerance": 1e-6},
    ):
        other = replace(model, contacts=replace(contact, **changed))
        with pytest.raises(InputError, match="another model: its contacts differ"):
            other.run(start=state)
    stepped = replace(model, wear=replace(model.wear, steps="second_order"))
    with pytest.raises(InputError, match="another model: its wear settings differ"):
        stepped.run(start=state)
    with pytest.raises(InputError, match="give a state"):
        model.run(start=tmp_path / "state.h5")


def test_a_longer_run_goes_on_from_the_state_of_a_shorter_one(tmp_path, model):
    checkpoint = fretscale.Checkpoint(tmp_path / "state.h5")
    replace(model, wear=replace(model.wear, cycles=1000.0)).run([checkpoint])
    rest = model.run(start=checkpoint.state())["pad"]
    assert rest["cycles"].values.tolist() == [1000.0, 1500.0, 2000.0]
    worn = 1e-4 / 3000.0 * 50.0 * 0.08 * 2000.0  # Archard's law
    assert rest["volume_1"].values[-1] == pytest.approx(worn, rel=1e-12)


def test_a_contact_at_the_border_is_warned_of(model):
    own = script("own_loads")

    class Small(own.Reciprocation):
        faces = (
            fretscale.ContactFace.nominal("pad", (0.12, 1.0), lambda x, y: x**2 / 20.0, line=True),
        )

    still = fretscale.Wear(cycles=10.0, motion="neglect")
    small = fretscale.WearModel(Small(), model.contacts, still)
    with pytest.warns(fretscale.ModelWarning, match=WarningKind.CONTACT_AT_BORDER.code):
        small.run()


@pytest.mark.slow
def test_errors_of_the_steps_are_near_the_true_ones():
    """Automatic steps at 1 % report the change that steps of a tenth of the tolerance make."""
    own = script("own_loads")
    coarse, fine = (
        fretscale.WearModel(
            own.Reciprocation(), own.contact, fretscale.Wear(2000.0, tolerance=t)
        ).run()["pad"]
        for t in (0.03, 0.0003)
    )
    depth, exact = (face["depth_1"].isel(cycles=-1).values for face in (coarse, fine))
    true = np.linalg.norm(depth - exact) / np.linalg.norm(exact)
    assert coarse.attrs["depth_error_by_steps"] == pytest.approx(true, rel=0.5)


def test_cases_without_a_model_are_refused():
    with pytest.raises(fretscale.UserError, match="only the wear of contacts"):
        fretscale.wear_model(CASES / "sphere_normal.yaml")


def test_nodes_that_wear_need_no_other_loads():
    """Every step solves the structure, so that its loads are never followed as well."""
    joint = script("dovetail_joint").model.structure
    plane = replace(joint, dimension=2, mesh=fretscale.DovetailMesh((11, 11), 8.0))
    titanium, law = Material(115e3, 0.29), EnergyLaw(1e-8)
    contact = fretscale.Contact(
        (24, 1), (titanium, titanium), (law, law), friction=0.4, method="nodes"
    )
    wear = fretscale.Wear(1e4, drift=1e-9)
    results = fretscale.WearModel(plane, contact, wear).run()
    assert results.attrs["solutions_of_the_loads"] == 1
    volume, energy = (results["intrados"][name].values[-1] for name in ("volume_1", "energy"))
    assert volume == pytest.approx(1e-8 * energy, rel=1e-12)
    evolving = CoulombFriction(0.4, EnergyTable((0.0, 1.0), (1.0, 2.0)))
    changing = fretscale.WearModel(plane, replace(contact, friction=evolving), wear)
    with pytest.raises(InputError, match="friction that does not evolve"):
        changing.run()


def test_contacts_are_found_by_name(model):
    named = fretscale.WearModel(model.structure, {"pad": model.contacts}, model.wear)
    assert named.contact("pad") is model.contacts
    lacking = fretscale.WearModel(model.structure, {"foot": model.contacts}, model.wear)
    with pytest.raises(InputError, match="no contact for the face 'pad'"):
        lacking.run()


def test_a_profile_is_added_to_structure_and_contact():
    joint = script("dovetail_joint").model.structure
    groove = fretscale.AddedGap(lambda x, y: 2e-3 * np.exp(-(x**2)) + 0.0 * y)
    changed = {"dimension": 2, "mesh": fretscale.DovetailMesh((11, 11), 8.0)}
    plain, grooved = (
        type(joint)(**vars(joint) | changed | {"added": added})
        for added in ({}, {"intrados": groove})
    )
    for before, after in zip(plain.meshed().interfaces, grooved.meshed().interfaces, strict=True):
        x = after.coordinates[:, 0]
        rise = 2e-3 * np.exp(-(x**2)) if after.name == "intrados" else 0.0 * x
        np.testing.assert_allclose(after.gap - before.gap, rise, atol=1e-15)
        at = np.linspace(-4.0, 4.0, 9)[:, None], np.zeros((1, 1))
        form, gap = (m.contact_face(f).gap(*at) for m, f in ((plain, before), (grooved, after)))
        expected = 2e-3 * np.exp(-(at[0] ** 2)) if after.name == "intrados" else 0.0 * at[0]
        np.testing.assert_allclose(gap - form, expected, atol=1e-15)


def test_models_load_nothing_of_cases():
    code = (
        "import fretscale, sys; fretscale.WearModel; fretscale.DovetailJoint; "
        "print(*(name for name in sys.modules))"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert not UNNEEDED & set(run.stdout.split())
