"""A run that is interrupted, killed or fails is resumed with identical results."""

import os
import re
import shutil
import sys
import time
from concurrent.futures import CancelledError
from contextlib import closing
from dataclasses import replace

import h5py
import pytest

import wear.coupled
import workflow.analyses.wear.run
from tests.workflow.shell.interruptions import (
    assert_equal,
    ctrl_c_after_jumps,
    jumps_kept,
    posix_only,
)
from workflow.analyses.wear import contact_workers
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
    assert last.endswith(f"continue with `fretscale resume {run.folder}`")
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


def emptied(folder):
    (folder / "checkpoint.h5").write_bytes(b"")


def written_by_others(folder):
    with h5py.File(folder / "checkpoint.h5", "w") as file:
        file["something"] = 1.0


def deeper(folder):
    """Change one number, as a user of HDF5 could."""
    with h5py.File(folder / "checkpoint.h5", "r+") as file:
        file["values"][100] += 1


def without_values(folder):
    with h5py.File(folder / "checkpoint.h5", "r+") as file:
        del file["values"]


def flipped(folder):
    path = folder / "jumps/00001.h5"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def lost(folder):
    (folder / "jumps/00001.h5").unlink()


def exchanged(folder):
    one, two, aside = (folder / f"jumps/{name}" for name in ("00001.h5", "00002.h5", "aside"))
    one.rename(aside)
    two.rename(one)
    aside.rename(two)


def rewritten(folder):
    """Write a complete file of that name, as another run would."""
    path = folder / "jumps/00001.h5"
    arrays, attributes = read_arrays(path)
    write_arrays(path, arrays, attributes | {"cycles": 1.0})


def chosen_otherwise(folder):
    (folder / "jumps/choice.json").write_text("{}")


def chosen_unreadably(folder):
    (folder / "jumps/choice.json").write_bytes(b"\xff{")


@pytest.mark.parametrize(
    ("damage", "place", "wrong"),
    [
        (truncated, "checkpoint.h5", "damaged"),
        (emptied, "checkpoint.h5", "damaged"),
        (written_by_others, "checkpoint.h5", "damaged"),
        (deeper, "checkpoint.h5", "damaged"),
        (without_values, "checkpoint.h5", "damaged"),
        (flipped, "jumps/00001.h5", "damaged"),
        (lost, "jumps/00001.h5", "missing"),
        (exchanged, "jumps/00001.h5", "damaged"),
        (rewritten, "jumps/00001.h5", "of another run than"),
        (chosen_otherwise, "jumps/choice.json", "has changed since the run was begun"),
        (chosen_unreadably, "jumps/choice.json", "damaged"),
    ],
)
def test_what_is_not_of_the_run_is_one_line_before_it_computes(
    interrupted, resume, damage, place, wrong
):
    log = (interrupted.folder / "run.log").read_text("utf-8")
    damage(interrupted.folder)
    run = resume(interrupted.folder)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert line.startswith(f"fretscale: {interrupted.folder / place}: {wrong}")
    assert f"start again with `fretscale run {interrupted.folder}/case.yaml" in line
    assert (interrupted.folder / "run.log").read_text("utf-8") == log


def edit(path, written, instead):
    """Replace the first occurrence of ``written``."""
    text = path.read_text("utf-8")
    assert written in text
    path.write_text(text.replace(written, instead, 1), encoding="utf-8")


def test_state_that_the_manifest_does_not_list_is_not_touched(interrupted, resume):
    """It would be renamed as a file that does not belong to the run."""
    edit(interrupted.folder / "manifest.json", "jumps", "jump5")
    run = resume(interrupted.folder)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert "its manifest.json does not list its files" in line
    assert jumps_kept(interrupted.folder) == 2


def test_state_of_another_version_is_one_line(interrupted, resume):
    path = interrupted.folder / "checkpoint.h5"
    arrays, attributes = read_arrays(path)
    del arrays["values"]
    write_arrays(path, arrays, attributes)
    run = resume(interrupted.folder)
    assert run.ending.exit_code == 2
    line = run.ending.stderr.splitlines()[-1]
    jumps = interrupted.folder / "jumps"
    assert line.startswith(f"fretscale: {jumps}: of another version of fretscale ('values')")


def test_another_case_does_not_go_on(interrupted, resume):
    edit(interrupted.folder / "case.yaml", "coefficient: 0.4 ", "coefficient: 0.45 ")
    run = resume(interrupted.folder)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert line.startswith(
        f"fretscale: {interrupted.folder}/case.yaml: friction.coefficient: 0.45, but 0.4 when the "
        "run was begun; put that back, or start again with `fretscale run"
    )


def test_state_of_another_case_is_not_taken(interrupted, start, resume, tmp_path, monkeypatch):
    """It is not used even with all of its jumps."""
    with monkeypatch.context() as patch:
        patch.setattr(workflow.analyses.wear.run, "write_output", refuse)
        other = start(tmp_path / "other", "wear.cycles=1e4", "friction.coefficient=0.45")
    for name in ("checkpoint.h5", "jumps/00000.h5", "jumps/00001.h5"):
        shutil.copy(other.folder / name, interrupted.folder / name)
    run = resume(interrupted.folder)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert f"{interrupted.folder}/case.yaml: friction.coefficient: 0.4, but 0.45 when" in line


@pytest.mark.slow
def test_what_no_number_depends_on_may_change(interrupted, resume, whole):
    edit(interrupted.folder / "case.yaml", "title: ", "title: Another one # ")
    edit(interrupted.folder / "case.yaml", "figures: false", "figures: true")
    run = resume(interrupted.folder)
    assert_equal(run, whole)
    assert run.summary["title"] == "Another one"
    assert (run.folder / "figures").is_dir()


@pytest.mark.slow
def test_run_whose_state_is_gone_begins_anew_and_says_so(interrupted, resume, whole):
    (interrupted.folder / "checkpoint.h5").unlink()
    run = resume(interrupted.folder)
    assert_equal(run, whole)
    assert "no state was stored: from the start" in run.ending.stderr


def refuse(*_):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("place", "reported"),
    [
        ("workflow.shell.folders.folder.OutputFolder.claim", "is still empty; start again with"),
        ("workflow.runs.run.provenance_of", "keeps what is done; continue with `fretscale resume"),
    ],
)
def test_ctrl_c_before_anything_is_computed_names_the_folder(
    start, monkeypatch, tmp_path, place, reported
):
    monkeypatch.setattr(place, refuse)
    run = start(tmp_path / "out")
    assert run.ending.exit_code == 130
    (*_, line) = run.ending.stderr.splitlines()
    assert line.startswith(f"fretscale: interrupted: {run.folder} {reported}")


@pytest.mark.slow
def test_interruption_after_the_last_jump_writes_the_output(start, resume, monkeypatch, tmp_path):
    quick = "wear.cycles=1e4", "contact.grid=[16, 24]"
    reference = start(tmp_path / "reference", *quick)
    with monkeypatch.context() as patch:
        patch.setattr(workflow.analyses.wear.run, "write_output", refuse)
        run = start(tmp_path / "out", *quick)
    assert run.ending.exit_code == 130
    assert jumps_kept(run.folder) == 1
    assert_equal(resume(run.folder), reference)


@pytest.mark.slow
def test_method_that_fails_later_says_how_to_go_on(start, resume, whole, monkeypatch, tmp_path):
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


def die(messages, answers, code):
    """Act as a worker that is killed."""
    os._exit(code)


@pytest.mark.slow
def test_worker_that_dies_is_one_line():
    with workers._processes(die, [(9,)]) as processes, pytest.raises(MethodFailed, match="gone"):
        workers._answers([workers._Hearing(process, lambda: None) for process in processes])


def stepwise(to, done):
    """Act as a worker that counts up from its last number and reports each step."""
    steps = iter(range(to))

    def answer(method, count):
        assert method == "count"
        for _ in range(count):
            next(steps)
            done()
        return count

    return answer


def test_workers_tell_what_they_have_done_before_they_answer():
    reported = []
    with workers.workers(stepwise, [5, 3]) as team:
        assert team.call("count", [2, 3], done=lambda: reported.append(1)) == [2, 3]
        assert len(reported) == 5
        assert team.call("count", [3, 0]) == [3, 0]
    assert len(reported) == 5


@posix_only
def test_worker_killed_before_its_first_word_is_one_line(monkeypatch):
    """It ends while it receives its task: a large setting does not fit into the pipe at once."""
    monkeypatch.setattr(sys, "executable", "/bin/true")
    gone = pytest.raises(MethodFailed, match="a process of the run is gone")
    with closing(workers.WorkerProcess()) as worker, gone:
        worker.begin(len, bytes(1_000_000))()


@pytest.mark.slow
def test_worker_that_cannot_be_set_up_says_why(separate_processes):
    """An error in a worker is raised here, not printed there."""
    with (
        contact_workers.contact_workers(None, [None]) as team,
        pytest.raises(AttributeError, match="'NoneType'"),
    ):
        team.call("begin", [None])


@posix_only
def test_workers_are_born_deaf_to_ctrl_c():
    """Workers ignore it from the start: the terminal sends it to the parent's session."""
    with closing(workers.WorkerProcess()) as one, closing(workers.WorkerProcess()) as other:
        sessions = [process.begin(os.getsid, 0)() for process in (one, other)]
    assert len({os.getsid(0), *sessions}) == 3


def test_a_process_beside_does_one_job_after_the_other():
    with closing(workers.WorkerProcess()) as worker:
        failing, *processes = worker.begin(divmod, 1, 0), *(worker.begin(os.getpid) for _ in "two")
        assert len({process() for process in processes} | {os.getpid()}) == 2
        with pytest.raises(ZeroDivisionError):
            failing()


@posix_only
def test_a_process_beside_ends_busy_or_not():
    with closing(workers.WorkerProcess()) as worker:
        answer = worker.begin(time.sleep, 600.0)
    # Had it been waited for, it would have answered.
    with pytest.raises((MethodFailed, CancelledError)):
        answer()


def test_tasks_are_shared_with_a_process_beside():
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


@pytest.mark.parametrize("place", [0, -1])
def test_what_a_task_raises_is_raised_here_and_there(place):
    tasks = [(time.sleep, (0.05,)) for _ in range(4)]
    tasks[place] = divmod, (1, 0)
    with closing(workers.WorkerProcess()) as worker, pytest.raises(ZeroDivisionError):
        workers.share_out(tasks, worker)
