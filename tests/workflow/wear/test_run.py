"""Tests of runs of the small case: files, conserved quantities, and unusual endings."""

import re

import h5py
import numpy as np
import pytest

from fe_models import structure
from fe_models.geometry.imported import read_bodies
from tests.marks import slow
from tests.workflow.command_line import invoke
from tests.workflow.conftest import Run, made_once, manifest_has_all
from tests.workflow.scenes import ROLLER_LOADS, ROLLER_WEAR
from workflow.kinds import load_case
from workflow.messages.warning_kinds import WarningKind, kinds_in
from workflow.shell import memory
from workflow.shell.output.results import frame_of

UM3_PER_J = 1e-12
# What warnings of a coarse mesh speak of.
MESH = re.compile("link|what the structure carries past the contact|raise mesh.notch")
# Few and quick increments for the odd cases, where a run is only to end well.
QUICK = (*("load_path.increments=[2, 3]", "contact.grid=[16, 24]"),)


def balances(run, laws):
    """Assert volume of surfaces = volume of kinetics = coefficient x energy, for each body."""
    with h5py.File(run.folder / "results.h5") as file:
        for name in file["grid"]:
            surfaces, kinetics = file["surfaces"][name], file["kinetics"][name]
            area = np.prod(file["grid"][name].attrs["pitch"])
            unworn = surfaces["00000"]
            for number, jump in enumerate(sorted(surfaces)):
                for body, sign in ((1, -1.0), (2, 1.0)):
                    depth = sign * (surfaces[jump][f"body_{body}"][()] - unworn[f"body_{body}"])
                    volume = kinetics[f"volume_{body}"][number]
                    energy = kinetics["energy"][number]
                    # Heights of the other body are large beside its depths: rounding.
                    assert depth.sum() * area == pytest.approx(volume, rel=1e-9, abs=1e-12)
                    assert depth.max() == pytest.approx(
                        kinetics[f"depth_{body}"][number], rel=1e-9, abs=1e-14
                    )
                    assert volume == pytest.approx(laws[body] * energy, rel=1e-10, abs=0.0)
            for key, column in run.summary["kinetics"][name].items():
                np.testing.assert_array_equal(kinetics[key], column)
                assert run.summary[name][key] == column[-1]


# --- what a run leaves --------------------------------------------------------------------------


def test_largest_stresses_have_place_and_error(whole):
    """They equal the results; the largest principal stress in notches is along the surface."""
    reported = whole.summary["structure"]["peak_stress"]
    with h5py.File(whole.folder / "results.h5") as file:
        for moment, bodies in reported.items():
            for name, peak in bodies.items():
                group = file[f"bodies/{name}/{moment}"]
                values, points = group["von_mises"][()], group["points"][()]
                notch = peak["notch"]
                # A local model has finer elements and is at the place of the coarse peak.
                assert "local_model" in notch
                parts = notch["local_model"].values()
                assert notch["error"] == pytest.approx(sum(parts))
                local, fine = group["notch/von_mises"][()], group["notch/points"][()]
                at = np.argmin(np.linalg.norm(fine - notch["at"], axis=1))
                assert fine[at] == pytest.approx(notch["at"], abs=1e-9)
                assert local[at] == pytest.approx(notch["von_mises"])
                assert 0.0 < notch["error"] < 0.5
                if peak["von_mises"] != notch["von_mises"]:
                    # Faces of body 2 are shown in their form, and solved flat.
                    at = np.argmin(np.linalg.norm(points - peak["at"], axis=1))
                    assert points[at] == pytest.approx(peak["at"], abs=0.1)
                    assert peak["von_mises"] == pytest.approx(values.max(), rel=1e-5)
                assert peak["von_mises"] >= notch["von_mises"]
                assert peak["at_contact"] or peak["von_mises"] == notch["von_mises"]
                assert 0.85 < notch["von_mises"] / notch["maximum_principal"] < 1.0
                if notch["error"] > 0.05:
                    assert any(
                        warning.startswith(f"{name}: ")
                        and WarningKind.UNCERTAIN_NOTCH_STRESS.code in warning
                        for warning in whole.summary["warnings"]
                    )
                assert f"{name}: von Mises stress up to" in (whole.folder / "run.log").read_text()


def test_folder_holds_what_it_promises(whole):
    names = {path.name for path in whole.folder.iterdir()}
    assert names == {
        *("case.yaml", "summary.json", "results.h5", "checkpoint.h5", "run.log", "worn.msh"),
        *("manifest.json", "report.html"),
    }
    assert manifest_has_all(whole.folder)
    assert whole.summary["jumps"] == 3
    assert whole.summary["kinetics"]["cycles"] == [0.0, 1e4, 2e4, 3e4]
    # Eight nodes across a flank are few, and it says so.
    assert all(MESH.search(warning) for warning in whole.summary["warnings"])
    assert "Traceback" not in whole.ending.stderr


def test_every_dataset_has_unit_and_description(whole):
    lacking = []

    def look(name, item):
        if isinstance(item, h5py.Dataset) and not (
            item.attrs.get("unit") and item.attrs.get("description")
        ):
            lacking.append(name)

    with h5py.File(whole.folder / "results.h5") as file:
        file.visititems(look)
        assert file["case"].attrs["text"] == (whole.folder / "case.yaml").read_text("utf-8")
    assert lacking == []


def test_volumes_heights_and_energies_agree(whole):
    balances(whole, {1: 1e4 * UM3_PER_J, 2: 1e4 * UM3_PER_J})


def test_worn_mesh_holds_the_worn_volume(whole):
    """The wear of the grid moves the mesh by its volume; discretisation loses 1e-4."""
    for name in ("intrados", "extrados"):
        flank = whole.summary[name]
        for body in (1, 2):
            assert flank[f"mesh_volume_{body}"] == pytest.approx(flank[f"volume_{body}"], rel=1e-3)


def test_written_bodies_are_as_far_apart_as_their_surfaces(whole):
    """The blade has its rounded edges and ends, the disk is flat; both move back by wear."""
    structure = load_case(whole.folder / "case.yaml").structure
    worn_bodies = read_bodies(whole.folder / "worn.msh").bodies
    with h5py.File(whole.folder / "results.h5") as file:
        for name in ("intrados", "extrados"):
            frame = frame_of(file[f"grid/{name}"])
            for body, into in (("disk", -1.0), ("blade", 1.0)):
                flank = worn_bodies[body].vertices(f"{body}_{name}")
                points = [file[f"bodies/{body}/{when}/points"][()] for when in ("unworn", "worn")]
                np.testing.assert_allclose(worn_bodies[body].points, points[1], atol=1e-12)
                unworn, worn = (frame.coordinates(places[flank]) for places in points)
                across, along = np.abs(unworn[:, :2]).T
                height = arc(across - 0.5 * structure.flank_length, structure.edge_radius)
                flat = 0.5 * structure.slot_length - structure.end_width
                height += arc(along - flat, structure.end_radius)
                expected = height if body == "blade" else 0.0
                np.testing.assert_allclose(unworn[:, 2], expected, atol=1e-12)
                np.testing.assert_allclose(worn[:, :2], unworn[:, :2], atol=1e-12)
                depth = into * (worn - unworn)[:, 2]
                assert depth.min() > -1e-12
                assert depth.max() > 1e-4


def arc(along, radius):
    """Return the height of a circle at a distance along its tangent [mm]."""
    return radius - np.sqrt(radius**2 - np.maximum(along, 0.0) ** 2)


def test_symmetric_load_wears_both_flanks_alike(whole):
    one, other = (whole.summary[name] for name in ("intrados", "extrados"))
    for key in ("volume_1", "depth_1", "energy"):
        assert one[key] == pytest.approx(other[key], rel=1e-6)


@pytest.mark.slow
def test_explicit_run_with_a_law_for_each_body_and_its_overrides_on_record(start, tmp_path):
    run = start(
        tmp_path / "out",
        *("wear.step.kind=explicit", "wear.step.cycles=2000", "wear.cycles=4000"),
        *("wear.disk.coefficient=500 um^3/J", "wear.blade.coefficient=2000 um^3/J"),
    )
    assert run.ending.exit_code == 0
    assert all(MESH.search(warning) for warning in run.summary["warnings"])
    balances(run, {1: 500 * UM3_PER_J, 2: 2000 * UM3_PER_J})
    recorded = load_case(run.folder / "case.yaml")
    assert (recorded.wear.step.kind, recorded.wear.cycles) == ("explicit", 4000.0)


def test_a_contact_in_a_process_of_its_own_is_the_same(tmp_path, request):
    """Results agree up to rounding, as a process with fewer libraries may sum differently."""
    (tmp_path / "loads.csv").write_text(ROLLER_LOADS, encoding="utf-8")
    (tmp_path / "case.yaml").write_text(ROLLER_WEAR, encoding="utf-8")
    here = Run(invoke("run", tmp_path / "case.yaml", "--out", tmp_path / "here"), tmp_path / "here")
    request.getfixturevalue("separate_processes")
    there = invoke("run", tmp_path / "case.yaml", "--out", tmp_path / "there")
    elsewhere = Run(there, tmp_path / "there")
    deepest = here.summary["interface"]["depth_1"]
    assert deepest > 0.0
    for name, height in here.heights().items():
        other = elsewhere.heights()[name]
        np.testing.assert_allclose(other, height, rtol=1e-12, atol=1e-9 * deepest, err_msg=name)
    for name, column in here.summary["kinetics"]["interface"].items():
        np.testing.assert_allclose(
            elsewhere.summary["kinetics"]["interface"][name], column, rtol=1e-9, err_msg=name
        )


@pytest.mark.slow
def test_two_runs_are_bitwise_equal(start, whole, tmp_path):
    """The second one takes the structure from the cache, which each test process has for itself."""
    start(tmp_path / "before")
    again = start(tmp_path / "out")
    first, second = whole.heights(), again.heights()
    assert first.keys() == second.keys()
    for name, height in first.items():
        np.testing.assert_array_equal(height, second[name], err_msg=name)
    assert again.summary["structure"]["from_cache"]
    assert again.summary["kinetics"] == whole.summary["kinetics"]


@pytest.mark.slow
def test_structure_without_full_matrices_wears_alike(start, tmp_path, monkeypatch):
    """The sparse run comes first, since full matrices are used wherever the cache has them."""
    settings = ("mesh.flank_nodes=[7, 9]", "coupling.resultants=every", *QUICK)
    with monkeypatch.context() as scarce:
        scarce.setattr(structure, "available_bytes", lambda: 0.0)
        sparse = start(tmp_path / "sparse", *settings)
    full = start(tmp_path / "full", *settings)
    kinds = [run.summary["structure"]["joint"] for run in (sparse, full)]
    assert kinds == ["sparse factors", "full matrices"]
    assert "sparse factors" in (sparse.folder / "run.log").read_text(encoding="utf-8")
    for name, height in full.heights().items():
        deepest = full.summary["intrados"]["depth_1"]
        np.testing.assert_allclose(
            sparse.heights()[name], height, atol=1e-4 * deepest, err_msg=name
        )


@pytest.mark.slow
def test_last_jump_is_clipped_to_the_cycles_left(start, tmp_path):
    run = start(tmp_path / "out", "wear.cycles=25000", *QUICK)
    assert run.summary["kinetics"]["cycles"] == [0.0, 1e4, 2e4, 2.5e4]


# --- steps and stops ----------------------------------------------------------------------------


@pytest.mark.slow
def test_step_and_stop_by_depth(start, tmp_path):
    """No jump wears much more than the step; the last ones are shortened to end at the stop."""
    small, stop = 0.1e-3, 0.35e-3
    run = start(
        tmp_path / "out",
        *("wear.step.cycles=", "wear.step.depth=0.1 um", "wear.stop.depth=0.35 um", *QUICK),
    )
    assert run.ending.exit_code == 0, run.ending.stderr
    kinetics = run.summary["kinetics"]
    depths = np.max([kinetics[name]["depth_1"] for name in ("intrados", "extrados")], axis=0)
    assert run.summary["cycles"] < 3e4
    assert np.all(np.diff(depths) <= 1.2 * small)
    assert depths[-1] == pytest.approx(stop, rel=1e-3)


@pytest.mark.slow
def test_step_and_stop_by_volume(start, tmp_path):
    run = start(
        tmp_path / "out",
        *("wear.step.cycles=", "wear.step.volume=0.05 mm^3", "wear.stop.volume=0.12 mm^3", *QUICK),
    )
    kinetics = run.summary["kinetics"]
    names = [f"volume_{body}" for body in (1, 2)]
    volumes = np.sum(
        [kinetics[flank][name] for flank in ("intrados", "extrados") for name in names], axis=0
    )
    np.testing.assert_allclose(np.diff(volumes)[:2], 0.05, rtol=0.02)
    assert volumes[-1] == pytest.approx(0.12, rel=1e-3)


# --- back to the structure ----------------------------------------------------------------------


@pytest.mark.slow
def test_small_drift_limit_solves_the_structure_again(start, whole, tmp_path):
    run = start(tmp_path / "out", "coupling.drift=1e-5")
    assert whole.summary["structure"]["solutions"] == 1
    assert run.summary["structure"]["solutions"] == 4
    assert max(run.summary["structure"]["drift"]) > 1e-5
    # Measured from the last solution: the drift of a single jump, where it adds up without.
    (_, first, _, last), (_, begun, _, added) = (
        done.summary["structure"]["drift"] for done in (run, whole)
    )
    assert first == begun
    assert last < 1.5 * first
    assert added > 2.0 * begun
    volumes = [done.summary["intrados"]["volume_1"] for done in (whole, run)]
    assert volumes[0] != volumes[1]
    assert volumes[0] == pytest.approx(volumes[1], rel=0.02)


@pytest.mark.slow
def test_constant_resultants_never_drift(start, whole, tmp_path):
    run = start(tmp_path / "out", "coupling.resultants=constant")
    assert run.summary["structure"]["solutions"] == 1
    assert run.summary["structure"]["drift"] == [0.0] * 4
    # Where nothing drifts beyond the limit, both ways are one.
    for name, height in whole.heights().items():
        np.testing.assert_array_equal(height, run.heights()[name], err_msg=name)


# --- warnings -----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("overrides", "kinds"),
    [
        (
            ["wear.step.kind=explicit", "wear.step.cycles=5e5", "friction.coefficient=1.2"],
            [WarningKind.UNSTABLE_STEPS, WarningKind.JOINT_LOCKS],
        ),
        (
            [
                *("structure.edge_radius=3 mm", "structure.edge_width=0.2 mm"),
                *("materials.disk.yield_stress=100 MPa", "wear.cycles=1e4"),
            ],
            [
                *(WarningKind.EDGE_PEAK_MISSED, WarningKind.CONTACT_AT_BORDER),
                WarningKind.PRESSURE_ABOVE_YIELD,
            ],
        ),
    ],
    ids=["steps and locking", "edges and yield"],
)
def test_warnings(start, tmp_path, overrides, kinds):
    run = start(tmp_path / "out", "wear.cycles=1e6", *QUICK, *overrides)
    assert run.ending.exit_code == 0, run.ending.stderr
    for kind in kinds:
        assert kind in kinds_in(run.summary["warnings"])
        assert kind.code in run.ending.stderr


# --- odd cases ----------------------------------------------------------------------------------


@pytest.mark.parametrize("figures", ["false", slow("true")])
def test_without_friction_nothing_wears(start_without_notches, tmp_path, figures):
    run = start_without_notches(
        tmp_path / "out", "friction.coefficient=0", *QUICK, f"output.figures={figures}"
    )
    assert run.ending.exit_code == 0, run.ending.stderr
    flank = run.summary["intrados"]
    assert (flank["energy"], flank["depth_1"], flank["volume_2"]) == (0.0, 0.0, 0.0)
    # Exact without friction: P = F / (2 sin θ); F is that of the case's own expectation.
    load = 78523.5 * (np.sin(np.pi / 4) + 0.4 * np.cos(np.pi / 4)) / np.sin(np.pi / 4)
    assert flank["peak_load"]["unworn"]["P"] == pytest.approx(load, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("step", ["wear.step.cycles=1e4", "wear.step.depth=1 um"])
def test_without_wear_coefficient_nothing_wears(start, tmp_path, step):
    zero = "wear.disk.coefficient=0", "wear.blade.coefficient=0"
    run = start(tmp_path / "out", "wear.step.cycles=", *zero, *QUICK, step)
    assert run.ending.exit_code == 0, run.ending.stderr
    assert run.summary["cycles"] == 3e4
    assert run.summary["intrados"]["volume_1"] == 0.0
    assert run.summary["intrados"]["energy"] > 0.0


@pytest.mark.slow
def test_blade_without_airfoil_pulls_by_its_own_mass(start, tmp_path):
    run = start(tmp_path / "out", "load_path.airfoil_mass=0", "wear.cycles=1e4", *QUICK)
    assert run.ending.exit_code == 0, run.ending.stderr
    force = 628.3185**2 * 0.28976e-3 * 254.72
    load = force / (2.0 * np.sin(np.pi / 4) * 1.4)
    assert run.summary["intrados"]["peak_load"]["unworn"]["P"] == pytest.approx(load, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("moment", ["1000 N*m", "3000 N*m"])
def test_moment_that_opens_a_flank_ends_well(start, tmp_path, moment):
    """It gives either a result, or one line that explains why there is none."""
    run = start(
        tmp_path / "out", f"load_path.aerodynamic_moment={moment}", "wear.cycles=1e4", *QUICK
    )
    assert run.ending.exit_code in (0, 3), run.ending.stderr
    assert "Traceback" not in run.ending.stderr
    if run.ending.exit_code == 3:
        assert run.ending.stderr.splitlines()[-1].startswith("fretscale: ")
    else:
        text = (run.folder / "summary.json").read_text("utf-8")
        assert "NaN" not in text
        assert "Infinity" not in text


def test_too_little_memory_ends_before_anything_is_done(start, monkeypatch, tmp_path):
    monkeypatch.setattr(memory, "_available_bytes", lambda: 1e9)
    run = start(tmp_path / "out")
    assert run.ending.exit_code == 4
    (line,) = run.ending.stderr.splitlines()
    assert "1.0 GB are free: lower mesh.flank_nodes" in line
    assert not run.folder.exists()


# --- method full ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def full(start_without_notches, tmp_path_factory):
    def make(folder):
        return start_without_notches(folder, *QUICK, "contact.method=full")

    return made_once(tmp_path_factory, "full", make)


def test_volumes_and_energies_agree(full):
    balances(full, {1: 1e4 * UM3_PER_J, 2: 1e4 * UM3_PER_J})


@pytest.mark.parametrize("flank", ["intrados", "extrados"])
def test_where_the_flank_slides_energy_is_the_structures(full, flank):
    increments = full.summary[flank]["by_increment"]
    sliding = np.array(increments["sliding"])
    assert sliding.any()
    assert not sliding.all()
    energy = {
        side: np.array(increments["Edx"][side]) + np.array(increments["Edy"][side])
        for side in ("half_space", "structure")
    }
    np.testing.assert_allclose(
        energy["half_space"][sliding], energy["structure"][sliding], rtol=1e-5
    )
    force = {side: np.array(increments["Qx"][side]) for side in ("half_space", "structure")}
    np.testing.assert_allclose(force["half_space"], force["structure"], rtol=0.02, atol=1e-3)


@pytest.mark.slow
def test_both_directions_of_sliding_give_the_same_energy(start, full, tmp_path):
    other = start(tmp_path / "out", *QUICK, "contact.method=full", "contact.gross_slip=energies")
    for flank in ("intrados", "extrados"):
        one, two = (run.summary[flank]["energy_per_cycle"]["half_space"] for run in (full, other))
        assert two == pytest.approx(one, rel=0.01)


@pytest.mark.slow
def test_dissimilar_materials_run_coupled_and_give_a_warning_otherwise(start, tmp_path):
    steel = "materials.disk.young=200 GPa"
    coupled = start(tmp_path / "full", *QUICK, steel, "contact.method=full")
    assert WarningKind.DISSIMILAR_NEGLECTED not in kinds_in(coupled.summary["warnings"])
    normal = start(tmp_path / "normal", *QUICK, steel)
    assert WarningKind.DISSIMILAR_NEGLECTED in kinds_in(normal.summary["warnings"])
