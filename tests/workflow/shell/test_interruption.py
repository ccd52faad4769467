"""A run that is interrupted, killed or fails is resumed with identical results."""

import os
import re
import shutil
import sys
import time
from contextlib import closing
from dataclasses import replace

import pytest

import wear.coupled
from tests.workflow.conftest import without_notches
from tests.workflow.shell.interruptions import (
    assert_equal,
    ctrl_c_after_jumps,
    jumps_kept,
    posix_only,
)
from workflow.errors import MethodFailed
from workflow.shell import processes as workers
from workflow.shell.folders.store import read_arrays, write_arrays

# --- in this process ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stopped(start, tmp_path_factory):
    """Return a run that got Ctrl-C after two stored jumps, which tests must not change."""
    with ctrl_c_after_jumps(2):
        run = start(tmp_path_factory.mktemp("stopped") / "out")
    assert run.ending.exit_code == 130
    last = run.ending.stderr.splitlines()[-1]
    assert last.startswith("fretscale: interrupted")
    assert f"continue with `fretscale resume {run.folder}`" in last
    return run


@pytest.fixture
def interrupted(stopped, tmp_path):
    """Return a copy of the interrupted run, to resume it."""
    folder = tmp_path / "out"
    shutil.copytree(stopped.folder, folder)
    return replace(stopped, folder=folder)


def test_resumed_run_equals_an_uninterrupted_one(interrupted, resume, whole):
    assert jumps_kept(interrupted.folder) == 2
    assert not (interrupted.folder / "results.h5").exists()
    with without_notches():
        run = resume(interrupted.folder)
    assert_equal(run, whole)
    log = (run.folder / "run.log").read_text("utf-8")
    assert log.count("run: ") == log.count("resume: ") == 1
    assert re.findall(r"jump (\d+):", log) == ["1", "2", "3"]


def test_unfinished_run_is_not_started_again(interrupted, start):
    run = start(interrupted.folder)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert f"fretscale resume {interrupted.folder}" in line
    assert jumps_kept(interrupted.folder) == 2


@pytest.mark.slow
def test_what_a_kill_left_half_written_does_not_matter(interrupted, resume, whole):
    """There is a torn checkpoint next to the complete one, a torn jump, and torn results."""
    torn = (interrupted.folder / "checkpoint.h5").read_bytes()[:1000]
    for name in (".checkpoint.h5.99999.part.h5", "jumps/.00003.h5.9.part.h5", "jumps/00003.h5"):
        (interrupted.folder / name).write_bytes(torn)
    (interrupted.folder / "results.h5").write_bytes(torn)
    assert_equal(resume(interrupted.folder), whole)
    assert not list(interrupted.folder.rglob("*.part.*"))


def truncated(folder):
    path = folder / "checkpoint.h5"
    path.write_bytes(path.read_bytes()[:1000])


def flipped(folder):
    path = folder / "jumps/00001.h5"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def lost(folder):
    (folder / "jumps/00001.h5").unlink()


def rewritten(folder):
    """Write a complete file of that name, as another run would."""
    path = folder / "jumps/00001.h5"
    arrays, attributes = read_arrays(path)
    write_arrays(path, arrays, attributes | {"cycles": 1.0})


def chosen_otherwise(folder):
    (folder / "jumps/choice.json").write_text("{}")


@pytest.mark.parametrize(
    ("damage", "place"),
    [
        (truncated, "checkpoint.h5"),
        (flipped, "jumps/00001.h5"),
        (lost, "jumps/00001.h5"),
        (rewritten, "jumps/00001.h5"),
        (chosen_otherwise, "jumps/choice.json"),
    ],
)
def test_damaged_files_of_a_run_are_named_before_it_is_resumed(interrupted, resume, damage, place):
    log = (interrupted.folder / "run.log").read_text("utf-8")
    damage(interrupted.folder)
    run = resume(interrupted.folder)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert f"{interrupted.folder / place}:" in line
    assert (interrupted.folder / "run.log").read_text("utf-8") == log


def edit(path, written, instead):
    """Replace the first occurrence of ``written``."""
    text = path.read_text("utf-8")
    assert written in text
    path.write_text(text.replace(written, instead, 1), encoding="utf-8")


def test_a_changed_case_is_not_resumed(interrupted, resume):
    edit(interrupted.folder / "case.yaml", "coefficient: 0.4 ", "coefficient: 0.45 ")
    run = resume(interrupted.folder)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert "friction.coefficient: 0.45" in line


@pytest.mark.slow
def test_what_no_number_depends_on_may_change(interrupted, resume, whole):
    edit(interrupted.folder / "case.yaml", "title: ", "title: Another one # ")
    edit(interrupted.folder / "case.yaml", "figures: false", "figures: true")
    run = resume(interrupted.folder)
    assert_equal(run, whole)
    assert run.summary["title"] == "Another one"
    assert (run.folder / "figures").is_dir()


def refuse(*_):
    raise KeyboardInterrupt


def test_ctrl_c_before_the_first_step_names_the_folder(start, monkeypatch, tmp_path):
    monkeypatch.setattr("workflow.runs.run.provenance_of", refuse)
    run = start(tmp_path / "out")
    assert run.ending.exit_code == 130
    assert f"fretscale resume {run.folder}" in run.ending.stderr.splitlines()[-1]


@pytest.mark.slow
def test_a_method_that_fails_later_can_be_resumed(start, resume, whole, monkeypatch, tmp_path):
    from wear.steps.stepping import ContactFailure

    jump = wear.coupled.CoupledWear._jump

    def failing(loop, state):
        if state.jump == 1:
            raise ContactFailure("increment 3: residual 1e-3 after 500 iterations")
        return jump(loop, state)

    with monkeypatch.context() as patch:
        patch.setattr(wear.coupled.CoupledWear, "_jump", failing)
        run = start(tmp_path / "out")
    assert run.ending.exit_code == 3
    last = run.ending.stderr.splitlines()[-1]
    assert "residual 1e-3" in last
    assert f"fretscale resume {run.folder}" in last
    assert jumps_kept(run.folder) == 1
    assert_equal(resume(run.folder), whole)


# --- workers ------------------------------------------------------------------------------------


@posix_only
def test_worker_killed_before_its_first_word_is_one_line(monkeypatch):
    """It ends while it receives its task: a large setting does not fit into the pipe at once."""
    monkeypatch.setattr(sys, "executable", "/bin/true")
    gone = pytest.raises(MethodFailed, match="a process of the run is gone")
    with closing(workers.WorkerProcess()) as worker, gone:
        worker.begin(len, bytes(1_000_000))()


def test_a_worker_process_does_one_job_after_the_other():
    with closing(workers.WorkerProcess()) as worker:
        failing, *processes = worker.begin(divmod, 1, 0), *(worker.begin(os.getpid) for _ in "two")
        assert len({process() for process in processes} | {os.getpid()}) == 2
        with pytest.raises(ZeroDivisionError):
            failing()


def test_tasks_are_shared_with_a_worker_process():
    reported, tasks = [], [(time.sleep, (0.2,)), (abs, (-1,)), (abs, (-2,)), (os.getpid, ())]
    with closing(workers.WorkerProcess()) as worker:
        _, *numbers, process = workers.share_out(tasks, worker, lambda: reported.append(1))
    assert (numbers, len(reported)) == ([1, 2], 4)
    assert process != os.getpid()
    with closing(workers.WorkerProcess()) as worker:
        *own, process = workers.share_out([(os.getpid, ())] * 3, worker, own=2)
    assert own == [os.getpid()] * 2
    assert process != os.getpid()
    assert workers.share_out(tasks)[-1] == os.getpid()
