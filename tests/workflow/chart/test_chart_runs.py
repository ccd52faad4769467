"""Tests of charts with runs: a contact with known errors, artificial runs, interruptions."""

import csv
import json
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from click.testing import CliRunner, Result

import workflow.chart.run
from sa_solver.reference.hertz import HertzSphere
from tests.workflow.scenes import BALL, ROLLER_LOADS, ROLLER_WEAR
from workflow.analyses.wear.approximations import ladders
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.chart import chart_case
from workflow.chart.ladder import Ladder
from workflow.cli import cli
from workflow.errors import UserError
from workflow.runs.job import Finished, Job
from workflow.runs.run import run_case
from workflow.shell.folders.folder import OutputFolder

HERTZ = HertzSphere(load=400.0, radius=10.0, contact_modulus=0.5 * 115e3 / (1.0 - 0.29**2))
HERTZ_EXPECTED = f"""\
expect:
  - quantity: states.-1.approach
    value: {HERTZ.approach!r}
    tolerance: 1 %
    kind: closed_form
    source: Hertz
    exact: true
  - quantity: states.-1.central_pressure
    value: {HERTZ.peak_pressure!r}
    tolerance: 1 %
    kind: closed_form
    source: Hertz
    exact: true
"""

RunJobs = Callable[..., list[Finished]]


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    path = tmp_path / "sphere.yaml"
    pressed = BALL.replace("    - {Qx: 210 N, increments: 4}\n", "").replace("[16, 16]", "[32, 32]")
    path.write_text(pressed + HERTZ_EXPECTED, encoding="utf-8")
    return path


def in_process(run: Callable[[Job, Path], None]) -> RunJobs:
    """Return a function that runs the jobs of a chart in this process."""

    def run_jobs(
        jobs: Sequence[Job],
        out: Path,
        *,
        alone: bool,
        report: Callable[[Finished], None],
        running: Callable[[Sequence[str]], None],
    ) -> list[Finished]:
        assert alone
        ended = []
        for job in jobs:
            folder = OutputFolder(out / job.name)
            try:
                run(job, folder.root)
                summary = json.loads(folder.summary.read_text("utf-8"))
                ended.append(Finished(job, folder.root, summary))
            except RuntimeError as error:
                ended.append(Finished(job, folder.root, None, str(error)))
            report(ended[-1])
        return ended

    return run_jobs


def chart(case: Path, out: Path, *options: str) -> Result:
    """Call ``fretscale chart`` in this process."""
    result = CliRunner().invoke(cli, ["chart", str(case), "--out", str(out), *options])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


# --- a contact whose errors are known -----------------------------------------------------------


def test_grids_of_a_sphere_go_to_hertz_at_second_order(ball, tmp_path, monkeypatch):
    run = in_process(lambda job, folder: run_case(job.load(), folder, force=True))
    monkeypatch.setattr(workflow.chart.run, "run_jobs", run)
    result = chart(ball, tmp_path / "out", "--axis", "grid", "--accuracy", "0.1 %")
    assert result.exit_code == 0, result.stderr
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    grid = summary["axes"]["grid"]
    # Central pressure: (dx / a)^2 to within the cells that the rim cuts; both are exact limits.
    reference = grid["references"]["states.-1.central_pressure"]
    assert reference["exact"]
    assert reference["order"] == pytest.approx(2.0, abs=0.4)
    assert grid["floor"] == 0.0
    names = [rung["name"] for rung in grid["rungs"]]
    assert names == ["16 x 16", "32 x 32", "64 x 64", "128 x 128"]
    errors = np.array([rung["error"] for rung in grid["rungs"]])
    pitches = 1.0 / np.array([16, 32, 64, 128])
    assert np.all(np.diff(errors) < 0.0)
    assert np.all(errors < (pitches / HERTZ.contact_radius) ** 2)
    assert [rung["own"] for rung in grid["rungs"]] == [False, True, False, False]
    assert f"for 0.1 % take {grid['chosen']}: " in result.stdout
    chosen = names.index(grid["chosen"])
    assert errors[chosen] <= 1e-3
    assert chosen == 0 or errors[chosen - 1] > 1e-3
    assert all(rung["cost"]["convolutions"] > 0 for rung in grid["rungs"])
    figure = tmp_path / "out" / "figures" / "chart_grid.png"
    assert figure.exists()
    assert f"  figure    {figure}" in result.stdout.splitlines()[-2:]
    rows = list(csv.DictReader((tmp_path / "out" / "chart.csv").open(encoding="utf-8")))
    assert [row["rung"] for row in rows] == names
    assert float(rows[-1]["error"]) == pytest.approx(errors[-1])


# --- made-up runs -------------------------------------------------------------------------------


class MadeUp:
    """Artificial runs whose depth has known errors: of the grid, of the jumps, of two dimensions.

    Condensation takes 8 s, or 0.1 s if it is cached; the explicit limit is 1 cycle.
    """

    def __init__(self, explicit_limit: float) -> None:
        self.ran: list[Job] = []
        self._limit = explicit_limit
        self._condensed: set[Any] = set()

    def __call__(self, job: Job, folder: Path) -> None:
        self.ran.append(job)
        case = job.load()
        assert isinstance(case, DovetailCase)
        if case.contact.method == "full":
            raise RuntimeError("made up to fail")
        step = case.wear.step.cycles or 100.0
        depth = 1e-2 * (1.0 + step / case.wear.cycles + 1.0 / case.contact.grid[0] ** 2)
        if case.structure.dimension == 2:
            depth *= 1.05
        folder.mkdir(parents=True)
        self._write(case, folder, depth)

    def _write(self, case: DovetailCase, folder: Path, depth: float) -> None:
        key = case.mesh, case.structure
        seconds = {
            "condensation": 0.1 if key in self._condensed else 8.0,
            "wear": case.contact.grid[0] / 10.0,
            "paraview and figures": 50.0,
        }
        self._condensed.add(key)
        log = "".join(f"10:00:00 {name}: {spent:.2f} s\n" for name, spent in seconds.items())
        (folder / "run.log").write_text(log, encoding="utf-8")
        length = 1.0 if case.structure.dimension == 2 else case.structure.slot_length
        wear = {
            "depth_1": depth,
            "depth_2": 0.0,
            "volume_1": 10.0 * depth * length,
            "volume_2": 0.0,
            "peak_pressure": {"worn": 100.0},
            "explicit_limit": self._limit,
        }
        work = {"convolutions": case.contact.grid[0], "contact_solves": 7}
        summary = {"intrados": wear, "work": work, "seconds": seconds}
        (folder / "summary.json").write_text(json.dumps(summary), encoding="utf-8")
        line = case.structure.dimension == 2
        shape, pitch = ((8, 1), (1.25, 1.0)) if line else ((8, 6), (1.25, 10.0))
        with h5py.File(folder / "results.h5", "w") as file:
            file.create_group("grid/intrados").attrs.update(shape=shape, pitch=pitch, line=line)
            for jump, worn in enumerate((0.0, depth)):
                group = f"surfaces/intrados/{jump:05d}"
                file[f"{group}/body_1"] = np.full(shape, -worn)
                file[f"{group}/body_2"] = np.zeros(shape)


def made_up(
    monkeypatch: pytest.MonkeyPatch, case: Path, out: Path, *, limit: float = 1e3, **settings: Any
) -> tuple[MadeUp, dict[str, Ladder]]:
    """Return the ladders of artificial runs, by axis."""
    runs = MadeUp(limit)
    monkeypatch.setattr(workflow.chart.run, "run_jobs", in_process(runs))
    charted = chart_case(case, out, **settings)
    return runs, {ladder.axis.name: ladder for ladder in charted.ladders}


def test_every_different_case_runs_once_and_the_own_one_first(small_path, tmp_path, monkeypatch):
    chosen = {"axes": ("grid", "stepper", "dimension", "method")}
    runs, ladders = made_up(monkeypatch, small_path, tmp_path, **chosen)
    assert runs.ran[0].name == "own"
    assert len({str(job.load()) for job in runs.ran}) == len(runs.ran)
    assert list(ladders) == ["grid", "method", "stepper", "dimension"]
    for ladder in ladders.values():
        assert ladder.baseline is not None
        assert ladder.baseline.folder == "own"
    for job in runs.ran:
        case = job.load()
        assert isinstance(case, DovetailCase)
        assert (case.output.figures, case.fidelity) == (False, "fixed")
        assert not case.stress.described().under_contacts


def test_increments_that_are_auto_are_chosen_once(small_path, tmp_path, monkeypatch):
    """They stay the same on the rungs of other axes."""
    auto = {"axes": ("increments", "mesh"), "overrides": ("load_path.increments=auto",)}
    runs, ladders = made_up(monkeypatch, small_path, tmp_path, **auto)
    own = runs.ran[0].load().load_path
    meshes = [r.folder for r in ladders["mesh"].rungs]
    assert {job.load().load_path for job in runs.ran if job.name in meshes} == {own}
    counts = [job.load().load_path.increments for job in runs.ran]
    divided = {tuple(round(f * n) for n in own.increments) for f in (0.5, 1.0, 2.0)}
    assert divided <= set(counts)


@pytest.mark.slow
def test_quantities_of_wear_and_what_they_cost(small_path, tmp_path, monkeypatch):
    _, ladders = made_up(monkeypatch, small_path, tmp_path, axes=("grid", "method", "stepper"))
    grid = ladders["grid"]
    # Nothing wears of body 2, so that nothing is relative to it.
    assert list(grid.references) == ["intrados.depth_1", "intrados.volume_1"]
    assert grid.references["intrados.depth_1"].order == pytest.approx(2.0, rel=1e-6)
    seconds = [rung.cost.seconds for rung in grid.rungs]
    # All found the condensation of the first, and pay for it as if they had not.
    assert seconds == pytest.approx([8.0 + rung_cells / 10.0 for rung_cells in (16, 32, 64)])
    assert [rung.cost.convolutions for rung in grid.rungs] == [16, 32, 64]
    first = grid.rungs[0].extras
    assert first["intrados.peak_pressure.worn"] == 100.0
    assert first["depth anywhere"] == pytest.approx(grid.rungs[0].error)
    assert ladders["method"].failed == {"full": "made up to fail"}
    # Of two choices the better failed: the other is not right for that.
    (normal,) = ladders["method"].rungs
    assert (normal.name, normal.bound) == ("normal", np.inf)
    assert ladders["method"].cheapest(1.0) is None


def test_dimensions_are_compared_in_the_middle(small_path, tmp_path, monkeypatch):
    _, ladders = made_up(monkeypatch, small_path, tmp_path, axes=("dimension",))
    two, three = ladders["dimension"].rungs
    assert set(two.values) == {"middle.intrados.depth_1", "middle.intrados.area_1"}
    assert two.error == pytest.approx(0.05)
    assert three.error == 0.0
    assert "depth anywhere" not in two.extras


def test_quantities_can_be_picked(small_path, tmp_path, monkeypatch):
    settings = {"axes": ("grid",), "quantities": ("intrados.volume_1",)}
    _, ladders = made_up(monkeypatch, small_path, tmp_path / "a", **settings)
    assert list(ladders["grid"].references) == ["intrados.volume_1"]
    for path, wrong in {"intrados.depht": "no number there", "intrados.depth_2": "0, and"}.items():
        settings = {"axes": ("grid",), "quantities": (path,)}
        with pytest.raises(UserError, match=f"--quantity {path}: {wrong}"):
            made_up(monkeypatch, small_path, tmp_path / path, **settings)


# --- runs in processes --------------------------------------------------------------------------


@pytest.mark.slow
def test_steppers_of_a_line_contact(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Implicit steps have an order between one and two; second-order ones are better."""
    longer = ROLLER_WEAR.replace("  cycles: 4e4", "  cycles: 1e5")
    (tmp_path / "line.yaml").write_text(longer, encoding="utf-8")
    (tmp_path / "loads.csv").write_text(ROLLER_LOADS, encoding="utf-8")
    monkeypatch.setattr(ladders, "JUMPS", (5, 10, 20))
    monkeypatch.setattr(ladders, "ERRORS", ())
    monkeypatch.setattr(ladders, "EXPLICIT", ())
    run = in_process(lambda job, folder: run_case(job.load(), folder, force=True))
    monkeypatch.setattr(workflow.chart.run, "run_jobs", run)
    charted = chart_case(tmp_path / "line.yaml", tmp_path / "out", axes=("stepper",))
    (ladder,) = charted.ladders
    errors = {rung.name: rung.error for rung in ladder.rungs}
    first = [errors[f"implicit, {count} jumps"] for count in (5, 10, 20)]
    for coarse, fine in pairwise(first):
        # Forward and backward over different increments: see wear.steps.implicit.
        assert 0.8 < np.log2(coarse / fine) < 2.0
    assert errors["second order, 10 jumps"] < 0.1 * errors["implicit, 10 jumps"]
    assert [rung.name for rung in ladder.rungs if rung.baseline] == ["implicit, 10 jumps"]
    assert all(rung.cost.solves > 0 for rung in ladder.rungs)
