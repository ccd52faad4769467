"""Files left by a run that was killed after its summary are removed when the run is resumed."""

import json
import shutil
import socket
import warnings
from dataclasses import dataclass
from pathlib import Path

import h5py
import pytest
import xarray

from tests.marks import slow
from tests.workflow.command_line import invoke, jobs_here
from tests.workflow.shell.test_kills import RUNS, run_here
from workflow.kinds import analysis_of, load_case
from workflow.runs.job import Job
from workflow.runs.jobs import run_jobs
from workflow.runs.run import bring_to_end
from workflow.shell.folders import steps
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.folders.lock import LOCK
from workflow.shell.output.curves import curves_in

PARTIAL = ".results.h5.123.part.h5"


@dataclass(frozen=True)
class CutOffRun:
    """Undisturbed run, and the files left by a process that was killed after its summary."""

    whole: Path
    cut: Path


def cut_off(kind, folder) -> list[CutOffRun]:
    """Return runs killed at each removal at their end: before it, and before it is listed."""
    whole, cut = folder / "whole", []
    gone = {"process": 123, "host": socket.gethostname(), "since": "before"}

    def snapshot(run: OutputFolder) -> None:
        assert run.summary.exists()
        cut.append(shutil.copytree(run.root, folder / f"runs_{len(cut)}/cut"))
        (cut[-1] / LOCK).write_text(json.dumps(gone))
        (cut[-1] / PARTIAL).write_text("of a process that was killed")

    def discard(run: OutputFolder, name: str) -> None:
        snapshot(run)
        run._remove(name)
        snapshot(run)
        leave(run, name)

    leave = OutputFolder.discard
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(steps, "SHARE", float("inf"))
        patch.setattr(OutputFolder, "discard", discard)
        run_here(RUNS[kind].command(folder, whole))
    assert list((cut[0] / "jumps").glob("*.h5"))
    return [CutOffRun(whole, place) for place in cut]


@pytest.fixture(scope="module")
def joints(tmp_path_factory):
    return cut_off("joint", tmp_path_factory.mktemp("joint"))


@pytest.fixture(params=["before it removes", "before it lists"])
def joint(request, joints):
    return joints[request.param == "before it lists"]


def check_clean(runs, cut):
    names = [sorted(p.relative_to(f).as_posix() for p in f.rglob("*")) for f in (runs.whole, cut)]
    assert names[0] == names[1]
    assert OutputFolder(runs.whole).manifest == OutputFolder(cut).manifest


def resumed(cut):
    ended = invoke("resume", cut)
    assert ended.exit_code == 0
    assert "this run is finished" in ended.output


def taken_up(cut):
    assert not bring_to_end(load_case(cut / "case.yaml"), cut)


def one_of_many(cut):
    case = shutil.copy(cut / "case.yaml", cut.parent / "case.yaml")
    with jobs_here():
        (done,) = run_jobs([Job(cut.name, Path(case))], cut.parent)
    assert not done.error


@pytest.mark.parametrize("take_up", [resumed, taken_up, one_of_many])
def test_whoever_takes_up_a_finished_run_clears_it(joint, take_up, tmp_path):
    cut = shutil.copytree(joint.cut, tmp_path / "runs/cut")
    written = (cut / "summary.json").read_bytes()
    take_up(cut)
    check_clean(joint, cut)
    assert (cut / "summary.json").read_bytes() == written


def check_units_of_curves(run):
    """Assert that the units against which measured points are checked are those of the results."""
    folder = OutputFolder(run)
    case = load_case(folder.case)
    analysis = analysis_of(case)
    layout = analysis.layout(case)
    with h5py.File(folder.results) as file:
        for wanted in analysis.curves:
            for curve in curves_in(file, wanted):
                units = [layout.units(wanted.y, wanted.x, line) for line in (False, True)]
                assert (curve.x_unit, curve.y_unit) in units, curve.title


def check_opens_in_xarray(run):
    """Assert that xarray reads the results by itself, without a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with xarray.open_datatree(OutputFolder(run).results, engine="h5netcdf") as tree:
            for node in tree.subtree:
                assert all(array.units for array in node.to_dataset(inherit=False).values())
            tree.load()


EVERY_KIND = [slow(kind) for kind in RUNS if kind != "joint"]


@pytest.mark.parametrize("kind", EVERY_KIND)
def test_runs_of_every_kind_are_cleared(kind, tmp_path):
    runs = cut_off(kind, tmp_path)
    for run in runs:
        resumed(run.cut)
        check_clean(run, run.cut)
    check_units_of_curves(runs[0].whole)
    check_opens_in_xarray(runs[0].whole)
