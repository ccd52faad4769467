"""Tests of two dimensions: a section and the slot it represents, validity, and choice."""

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from fe_models.meshes.structure_mesh import Face
from fe_models.meshes.transfer import FaceTransfer
from fe_models.structure import InterfaceHistory, load_history
from sa_solver.types import Frame, Grid
from tests.marks import slow
from tests.workflow.command_line import command
from tests.workflow.conftest import Run
from tests.workflow.output.shown_files import check_arrays, check_scene
from workflow.analyses.wear import ANALYSIS
from workflow.analyses.wear.checks.uniformity import Uniformity, sections, uniformities
from workflow.analyses.wear.fidelity import choosing
from workflow.analyses.wear.fidelity.decisions import choose_dimension
from workflow.analyses.wear.model import loads_of
from workflow.analyses.wear.translation import face_contact
from workflow.case.text.readable import percent
from workflow.case.text.writing import dump_case
from workflow.errors import CaseError
from workflow.kinds import load_case
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.folders.folder import OutputFolder

# Coarse enough to run in a second; probes have a mesh of their own.
COARSE = "mesh.flank_nodes=[11, 11]", "mesh.size=8", "contact.grid=[64, 64]"
QUIET = "output.paraview=false", "output.figures=false"
FRICTION = 0.4


@pytest.fixture(scope="module")
def plane_path(dovetail_path: Path) -> Path:
    return dovetail_path.with_name("dovetail_2d.yaml")


def run_case(path: Path, folder: Path, *overrides: str) -> Run:
    return Run(command("run", path, "--out", folder, overrides=overrides), folder)


@pytest.fixture(scope="module")
def plane(plane_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return the section of the default dovetail, which tests must not change."""
    run = run_case(plane_path, tmp_path_factory.mktemp("plane") / "out", *QUIET)
    assert run.ending.exit_code == 0, run.ending.stderr
    return run


@pytest.fixture(scope="module")
def pictured(plane_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return the same run with its pictures."""
    run = run_case(plane_path, tmp_path_factory.mktemp("pictured") / "out")
    assert run.ending.exit_code == 0, run.ending.stderr
    return run


# --- A case in the plane ---------------------------------------------------------------------


def test_only_three_dimensions_need_rounded_ends(plane_path, tmp_path):
    """A section is the same without them; in space, and for probes there, they are required."""
    path = tmp_path / "section.yaml"
    ends = ("end_width", "end_radius")
    lines = plane_path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join(line for line in lines if not line.strip().startswith(ends)))
    straight, rounded = load_case(path), load_case(plane_path)
    x = np.linspace(-6.0, 6.0, 101)
    gaps = [case.structure.geometry().flank_gap(x, 0.0 * x, 1) for case in (straight, rounded)]
    assert np.array_equal(*gaps)
    for setting in ("structure.dimension=3", "fidelity=auto"):
        with pytest.raises(CaseError, match="end_width and"):
            load_case(path, [setting])


# --- A run in the plane ----------------------------------------------------------------------


def test_a_section_meets_its_closed_forms(plane, plane_path):
    summary = plane.summary
    assert summary["per_length"]
    for expected in load_case(plane_path).expect:
        value = summary
        for key in expected.quantity.split("."):
            value = value[key]
        limit = expected.tolerance * (abs(expected.value) or 1.0)
        assert value == pytest.approx(expected.value, abs=limit), expected.quantity


def test_flanks_wear_alike_and_by_their_energy(plane):
    """Volume per length = α x energy, and the wear of the cells is in the mesh."""
    one, two = (plane.summary[name] for name in ("intrados", "extrados"))
    for key in ("depth_1", "volume_1", "energy"):
        assert one[key] == pytest.approx(two[key], rel=1e-4)
    assert one["volume_1"] == pytest.approx(1e-8 * one["energy"], rel=1e-6)
    assert one["mesh_volume_1"] == pytest.approx(one["volume_1"], rel=1e-2)


def test_results_are_per_length(plane):
    with h5py.File(plane.folder / "results.h5") as file:
        assert file["structure/intrados/load_history/P"].attrs["unit"] == "N/mm"
        assert file["kinetics/intrados/volume_1"].attrs["unit"] == "mm^3/mm"
        assert file["contact/intrados/00000/pressure"].shape == (128, 1)


@pytest.mark.slow
def test_only_what_a_section_has_is_warned_of(plane, plane_path, tmp_path):
    """The coarse grid misses the peaks at the edges along the slot; there are no slot ends."""
    assert not any("end" in line.split() for line in plane.summary["warnings"])
    coarse = run_case(
        plane_path, tmp_path / "out", "contact.grid=[16, 32]", "wear.cycles=3e4", *QUIET
    )
    warned = [
        line for line in coarse.summary["warnings"] if WarningKind.EDGE_PEAK_MISSED.code in line
    ]
    assert warned
    assert all("at the edge" in line and "end" not in line for line in warned)


@pytest.mark.slow
def test_paraview_shows_lines_and_plane_bodies(pictured):
    import pyvista as pv

    check_arrays(pictured.folder / "paraview")
    for script in ("view.py", "view_mission.py"):
        check_scene(pictured.folder / "paraview" / script)
    reader = pv.get_reader(pictured.folder / "paraview/intrados.pvd")
    reader.set_active_time_value(reader.time_values[0])
    line = reader.read()[0]
    assert line.n_lines == 1
    assert np.all(line.points[:, 1] == 0.0)  # in the plane of the bodies
    force = line["pressure [MPa]"].sum() * 11.0 / 128
    assert force == pytest.approx(
        pictured.summary["intrados"]["peak_load"]["unworn"]["P"], rel=1e-5
    )
    reader = pv.get_reader(pictured.folder / "paraview/mission_worn.pvd")
    assert reader.time_values == list(range(1, 23))
    reader = pv.get_reader(pictured.folder / "paraview/structure.pvd")
    assert reader.time_values == [0.0, 3e5]
    for body in reader.read():
        assert set(body.celltypes) == {pv.CellType.TRIANGLE}
        assert np.all(body.points[:, 1] == 0.0)
        assert not body["displacement [mm]"][:, 1].any()


# --- Sections of a slot ----------------------------------------------------------------------

SIZE, ROWS = (4.0, 24.0), 49


def history_of(profile):
    """Return a face with ``profile`` over its nodes' y, even across, that slips by 2 and -1 µm."""
    x, y = (np.linspace(-0.5 * s, 0.5 * s, n) for s, n in zip(SIZE, (5, ROWS), strict=True))
    nodes = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    index = np.arange(len(nodes)).reshape(5, ROWS)
    corners = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    a, b, c, d = (corner.ravel() for corner in corners)
    facets = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    face = Face("flank", Frame(np.zeros(3), np.eye(3)), nodes, facets)
    pressure = profile(nodes[:, 1])
    force = np.zeros((2, 3, len(nodes)))
    force[:, 2] = pressure * face.nodal_areas
    slip = np.zeros((2, 2, len(nodes)))
    slip[:, 0] = np.array([[2e-3], [-1e-3]])
    force[:, 0] = -FRICTION * np.sign(slip[:, 0]) * force[:, 2]
    loads = load_history(face, force, slip, FRICTION)
    return InterfaceHistory(face, loads, force, np.zeros_like(force), slip)


def test_sections_are_forces_and_energies_per_length():
    """For p = 10 + y, P per length is 4 (10 + y), Qx = -µP, energy µP Σ|Δs|, all exact."""
    history = history_of(lambda y: 20.0 + y)
    transfer = FaceTransfer.between(history.interface, Grid.covering(SIZE, (7, 30)))
    rows = sections(transfer, history, 0, FRICTION)
    expected = SIZE[0] * (20.0 + transfer.grid.y.ravel())
    np.testing.assert_allclose(rows.P, expected, rtol=1e-12)
    np.testing.assert_allclose(rows.Qx, -FRICTION * expected, rtol=1e-12)
    np.testing.assert_allclose(rows.energy, FRICTION * expected * 3e-3, rtol=1e-12)
    np.testing.assert_allclose(rows.slip, 3e-3, rtol=1e-12)
    # The two rows about y = 0 together stand for the middle.
    assert rows.middle["P"] == pytest.approx(SIZE[0] * 20.0, rel=1e-12)


def test_sections_add_up_to_the_resultants():
    history = history_of(lambda y: 20.0 + np.cos(y))
    grid = Grid.covering(SIZE, (7, 30))
    rows = sections(FaceTransfer.between(history.interface, grid), history, 0, FRICTION)
    loads = history.loads
    for per_length, whole in (
        (rows.P, loads.P[0]),
        (rows.Qx, loads.Qx[0]),
        (rows.energy, (loads.Edx + loads.Edy).sum()),
    ):
        assert per_length.sum() * grid.pitch[1] == pytest.approx(whole, rel=1e-12)


@pytest.fixture(scope="module")
def slot(small_path):
    """Return source and unworn contacts of the small case, coarse, in three dimensions."""
    case = load_case(
        small_path, ["mesh.flank_nodes=[6, 8]", "mesh.size=12", "contact.grid=[24, 48]"]
    )
    source = loads_of(case)
    stages = [face_contact(case, face) for face in source.faces]
    return source, [
        (stage, stage.contact.begin(history, case.wear.cycles)[0])
        for stage, history in zip(stages, source.unworn(), strict=True)
    ]


def test_uniformity_of_a_slot(slot):
    """Both flanks are equal; ends carry more than the middle; the text fits the numbers."""
    source, faces = slot
    stages = [stage for stage, _ in faces]
    flanks = uniformities(*slot)
    assert set(flanks) == {"intrados", "extrados"}
    one, two = flanks.values()
    assert one.mean_load == pytest.approx(two.mean_load, rel=1e-4)
    assert one.wear == 0.0  # nothing has worn yet
    transfer = stages[0].transfer
    rows = sections(transfer, source.unworn()[0], source.peak, FRICTION)
    middle = np.abs(transfer.grid.y.ravel()) <= 0.25 * stages[0].grid.size[1]
    assert one.pressure == pytest.approx(np.abs(rows.P / rows.middle["P"] - 1.0)[middle].max())
    mean = source.unworn()[0].loads.P[source.peak] / stages[0].grid.size[1]
    assert one.mean_load == pytest.approx(mean / rows.middle["P"], rel=1e-6)
    assert 0.0 < one.share_of_length_within < 1.0
    assert percent(one.share_of_length_within) in one.sentence("intrados")


def test_what_has_worn_unevenly_is_not_uniform(slot):
    source, ((stage, state), other) = slot
    before = uniformities(*slot)["intrados"]
    y = stage.grid.y
    worn = np.where(np.abs(y) > 6.0, 2e-3, 1e-3) * np.ones(stage.grid.shape)
    surfaces = replace(state.surfaces, depth_1=worn)
    after = uniformities(source, [(stage, replace(state, surfaces=surfaces)), other])
    uniformity = after["intrados"]
    assert uniformity.wear == pytest.approx(1.0)
    # The last row of the middle is the one before the step.
    rows = np.abs(y.ravel())
    assert uniformity.share_of_length_within == pytest.approx(
        min((rows[rows > 6.0].min() - 0.5 * stage.grid.pitch[1]) / 30.0,
            before.share_of_length_within)
    )  # fmt: skip
    assert not uniformity.uniform
    assert "too uneven" in uniformity.sentence("intrados")


# --- Who chooses -----------------------------------------------------------------------------


@pytest.fixture
def dimension_only(monkeypatch):
    """Let the other axes leave the case unchanged."""
    monkeypatch.setattr(choosing, "SHARES", {})


def auto(path: Path, *overrides: str):
    return load_case(path, ["fidelity=auto", "structure.dimension=3", *COARSE, *overrides])


@pytest.mark.parametrize(("accuracy", "dimension"), [("5 %", 2), slow("3 %", 3)])
@pytest.mark.usefixtures("dimension_only")
def test_dimension_follows_the_accuracy(plane_path, accuracy, dimension):
    case = auto(plane_path, f"accuracy={accuracy}")
    chosen, record = ANALYSIS.choose(case)
    assert chosen.structure.dimension == dimension
    assert record["chosen"] == {"structure.dimension": dimension}
    (decision,) = record["decisions"]
    largest = max(v for flank in decision["probe"]["differences"].values() for v in flank.values())
    assert (largest <= case.accuracy) == (dimension == 2)
    assert percent(largest) in decision["why"]
    # Whatever the case says itself, the same is chosen, and a case so written stands.
    structure = case.structure.model_copy(update={"dimension": 2})
    assert ANALYSIS.choose(case.model_copy(update={"structure": structure}))[0] == chosen


def test_probe_finds_the_closed_form_and_the_mean_load(plane_path):
    """P = F / 2 (sin θ + µ cos θ) per length in the plane; mid-slot carries less than the mean."""
    probe = choose_dimension(auto(plane_path), 0.045).probe
    for flank in ("intrados", "extrados"):
        assert probe["two"][flank]["P"] == pytest.approx(1301.33, rel=1e-3)
        assert 0.9 < probe["three"][flank]["P"] / probe["two"][flank]["P"] < 1.0
        assert probe["two"][flank]["Qx"] == pytest.approx(-FRICTION * 1301.33, rel=1e-3)


@pytest.mark.slow
def test_a_slot_rounded_far_in_stays_in_space(plane_path):
    """Its middle carries the load of its ends as well: far more than the mean."""
    decision = choose_dimension(auto(plane_path, "structure.end_width=20 mm"), 0.045)
    assert decision.value == 3
    for flank in ("intrados", "extrados"):
        assert decision.probe["differences"][flank]["P"] > 0.2
        assert decision.probe["three"][flank]["P"] > decision.probe["two"][flank]["P"]


@pytest.mark.usefixtures("dimension_only")
def test_choice_is_kept_until_the_run_is_finished(plane_path, tmp_path):
    """A run that is interrupted and resumed therefore still has the reasons."""
    case, record = ANALYSIS.choose(auto(plane_path, "structure.skew=5 deg"))
    folder = OutputFolder(tmp_path / "out")
    folder.claim(case, force=False, resumable=True)
    assert folder.choice is None
    folder.keep_choice(record)
    assert folder.choice == json.loads(json.dumps(record))
    assert load_case(folder.case) == case


@pytest.mark.slow
@pytest.mark.usefixtures("dimension_only")
def test_run_writes_what_was_chosen_and_why(plane_path, tmp_path):
    settings = "fidelity=auto", "structure.dimension=3", "accuracy=5 %", "wear.cycles=3e4"
    run = run_case(plane_path, tmp_path / "out", *settings, *COARSE, *QUIET)
    assert run.ending.exit_code == 0, run.ending.stderr
    assert "chosen: structure.dimension: 2: in a coarse probe" in run.ending.stderr
    case = load_case(run.folder / "case.yaml")
    assert case.structure.dimension == 2
    assert dump_case(case) == (run.folder / "case.yaml").read_text("utf-8")
    chosen = run.summary["choice"]
    assert chosen["chosen"] == {"structure.dimension": 2}
    assert chosen["seconds"] > 0.0
    assert "uniformity" not in run.summary["intrados"]


def test_a_run_in_space_reports_its_uniformity(whole):
    """In the small case the ends are rounded gently, so the middle is nearly a section."""
    assert "choice" not in whole.summary
    for name in ("intrados", "extrados"):
        uniformity = Uniformity(**whole.summary[name]["uniformity"])
        assert uniformity.sentence(name) in whole.ending.stderr
        assert uniformity.mean_load == pytest.approx(1.04, abs=0.02)
        assert uniformity.pressure < 0.1


# --- Two and three dimensions ----------------------------------------------------------------


def in_the_middle(run: Run, name: str) -> dict[str, float]:
    """Return P, Qx at peak load, mean slip and energy of a cycle, and worn depth, in mid-slot."""
    case = load_case(run.folder / "case.yaml")
    source = loads_of(case)
    faces = {face.face.name: number for number, face in enumerate(source.faces)}
    stage = face_contact(case, source.faces[faces[name]])
    unworn, friction = source.unworn()[faces[name]], case.friction.at(0.0)
    middle = sections(stage.transfer, unworn, source.peak, friction).middle
    with h5py.File(run.folder / "results.h5") as file:
        surfaces = file[f"surfaces/{name}"]
        first, last = (surfaces[sorted(surfaces)[end]] for end in (0, -1))
        depths = [np.abs(last[body][()] - first[body][()]) for body in ("body_1", "body_2")]
    worn = np.sum(depths, axis=0)
    row = worn[:, worn.shape[1] // 2]
    return middle | {"depth": row.max(), "area": row.sum() * stage.grid.pitch[0]}


# What the middle section of 60 mm differs by: see cases/dovetail_2d.yaml.
DIFFERENCES = {"P": 0.04, "Qx": 0.04, "slip": 0.01, "energy": 0.05, "depth": 0.03, "area": 0.04}


@pytest.mark.slow
@pytest.mark.long
def test_plane_strain_is_the_middle_of_the_slot(plane_path, tmp_path):
    """Both have equal discretisation, so only the slot's ends differ, in the expected sense.

    The middle carries less than the mean.
    """
    alike = (
        "mesh={flank_nodes: [15, 25], size: 12 mm}",
        "contact.grid=[64, 128]",
        *QUIET,
    )
    section = run_case(plane_path, tmp_path / "section", *alike)
    run = run_case(plane_path, tmp_path / "slot", *alike, "structure.dimension=3")
    assert section.ending.exit_code == run.ending.exit_code == 0, run.ending.stderr
    for name in ("intrados", "extrados"):
        two, three = in_the_middle(section, name), in_the_middle(run, name)
        for quantity, limit in DIFFERENCES.items():
            assert two[quantity] == pytest.approx(three[quantity], rel=limit), quantity
        assert two["P"] > three["P"]
        assert run.summary[name]["uniformity"]["uniform"]
