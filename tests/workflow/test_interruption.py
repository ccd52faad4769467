"""A run that is interrupted, killed or fails goes on as if nothing had happened."""

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from multiprocessing import resource_tracker, spawn
from pathlib import Path

import h5py
import numpy as np
import pytest

import wear.coupled
import workflow.analyses.wear.run
from tests.workflow.commands import AS_PROCESS
from workflow.analyses.wear import contact_workers
from workflow.analyses.wear.recording import Recorder
from workflow.shell import processes as workers
from workflow.shell.store import read_arrays, write_arrays

# Many quick jumps, so that a random moment mostly falls among them.
MANY = "wear.step.cycles=1500", "coupling.drift=2e-4"
JUMPS = 20
# Seconds a run of these needs; kills come at any moment of it, and some too late.
RUN_SECONDS = 6.0
# Kills of it at random moments; test_kills.py has seven of every kind of run.
KILLS = 8
# Seconds within which everything must have ended.
PATIENCE = 60.0

posix_only = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


def assert_equal(run, reference):
    """Same surfaces and kinetics, bit for bit."""
    assert run.ending.exit_code == 0, run.ending.stderr
    heights, expected = run.heights(), reference.heights()
    assert heights.keys() == expected.keys()
    for name, height in expected.items():
        np.testing.assert_array_equal(heights[name], height, err_msg=name)
    assert run.summary["kinetics"] == reference.summary["kinetics"]
    structure, other = run.summary["structure"], reference.summary["structure"]
    assert structure["solutions"] == other["solutions"]
    assert structure["drift"] == other["drift"]


def jumps_kept(folder: Path) -> int:
    """Whole jumps in the checkpoint."""
    path = folder / "checkpoint.h5"
    return len(read_arrays(path)[0]["jumps"]) - 1 if path.exists() else -1


# --- in this process ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stopped(start, tmp_path_factory):
    """A run that got Ctrl-C once two jumps were kept; not to be changed."""
    keep = Recorder.keep

    def interrupting(recorder, state):
        keep(recorder, state)
        if state.jump == 2:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Recorder, "keep", interrupting)
        run = start(tmp_path_factory.mktemp("stopped") / "out")
    assert run.ending.exit_code == 130
    assert run.ending.stderr.splitlines()[-1].startswith("fretscale: interrupted")
    return run


@pytest.fixture
def interrupted(stopped, tmp_path):
    """A copy of it to go on with."""
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


def test_what_a_kill_left_half_written_does_not_matter(interrupted, resume, whole):
    """A torn checkpoint beside the whole one, a torn jump, torn results."""
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
    """One worn depth, by whoever knows HDF5."""
    with h5py.File(folder / "checkpoint.h5", "r+") as file:
        file["kinetics"][1, 0, 0] *= 2.0


def without_energies(folder):
    with h5py.File(folder / "checkpoint.h5", "r+") as file:
        del file["interface_0/scalars"]


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
    """A whole file of that name, such as another run has left."""
    path = folder / "jumps/00001.h5"
    arrays, attributes = read_arrays(path)
    write_arrays(path, arrays, attributes | {"cycles": 1.0})


def chosen_otherwise(folder):
    (folder / "jumps/fidelity.json").write_text("{}")


def chosen_unreadably(folder):
    (folder / "jumps/fidelity.json").write_bytes(b"\xff{")


@pytest.mark.parametrize(
    ("damage", "place", "wrong"),
    [
        (truncated, "checkpoint.h5", "damaged"),
        (emptied, "checkpoint.h5", "damaged"),
        (written_by_others, "checkpoint.h5", "damaged"),
        (deeper, "checkpoint.h5", "damaged"),
        (without_energies, "checkpoint.h5", "damaged"),
        (flipped, "jumps/00001.h5", "damaged"),
        (lost, "jumps/00001.h5", "missing"),
        (exchanged, "jumps/00001.h5", "damaged"),
        (rewritten, "jumps/00001.h5", "of another run than"),
        (chosen_otherwise, "jumps/fidelity.json", "has changed since the run was begun"),
        (chosen_unreadably, "jumps/fidelity.json", "damaged"),
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
    """Write something else where it is ``written`` first."""
    text = path.read_text("utf-8")
    assert written in text
    path.write_text(text.replace(written, instead, 1), encoding="utf-8")


def test_state_that_the_manifest_does_not_list_is_not_touched(interrupted, resume):
    """It would be set aside as what is not of the run."""
    edit(interrupted.folder / "manifest.json", "jumps", "jump5")
    run = resume(interrupted.folder)
    assert run.ending.exit_code == 2
    (line,) = run.ending.stderr.splitlines()
    assert "its manifest.json does not list its files" in line
    assert jumps_kept(interrupted.folder) == 2


def test_state_of_another_version_is_one_line(interrupted, resume):
    path = interrupted.folder / "checkpoint.h5"
    arrays, attributes = read_arrays(path)
    del arrays["interface_0/scalars"]
    write_arrays(path, arrays, attributes)
    run = resume(interrupted.folder)
    assert run.ending.exit_code == 2
    line = run.ending.stderr.splitlines()[-1]
    assert line.startswith(f"fretscale: {path}: of another version of fretscale (no 'interface_0/")


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
    """Nor with all of its jumps."""
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
    assert "no state was kept: from the start" in run.ending.stderr


def refuse(*_):
    raise KeyboardInterrupt


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
    from wear.stepping import ContactFailure

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


def die(connection, code):
    """A worker that is killed."""
    os._exit(code)


@pytest.mark.slow
def test_worker_that_dies_is_one_line():
    from workflow.errors import MethodFailed

    with workers._processes(die, [(9,)]) as connections, pytest.raises(MethodFailed, match="gone"):
        workers._answers(connections)


@posix_only
def test_worker_killed_before_its_first_word_is_one_line(monkeypatch):
    """It ends while it is told what to do: a large setting does not go into the pipe at once."""
    from workflow.errors import MethodFailed

    resource_tracker.ensure_running()
    monkeypatch.setattr(spawn, "_python_exe", b"/bin/true")
    with pytest.raises(MethodFailed, match="a process of the run has gone"):
        workers.side_by_side([(len, (bytes(1_000_000),))])


@pytest.mark.slow
def test_worker_that_cannot_be_set_up_says_why(separate_processes):
    """What goes wrong in a worker is raised here, not printed there."""
    with (
        contact_workers.contact_workers(None, [None]) as team,
        pytest.raises(AttributeError, match="'NoneType'"),
    ):
        team.call("begin", [None])


@posix_only
def test_workers_are_born_deaf_to_ctrl_c():
    """From their first instruction, the first of a process included."""
    code = """
import signal
from workflow.shell.processes import _answers, _do, _processes
ask = signal.pthread_sigmask, (signal.SIG_BLOCK, ())
with _processes(_do, [ask, ask]) as connections:
    assert all(signal.SIGINT in mask for mask in _answers(connections))
assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=PATIENCE)


# --- signals ------------------------------------------------------------------------------------


class Process:
    """The command as a process with its own group."""

    def __init__(self, *arguments: object) -> None:
        command = [sys.executable, "-c", AS_PROCESS, *map(str, arguments)]
        self._process = subprocess.Popen(
            command, stderr=subprocess.PIPE, text=True, start_new_session=True
        )

    def descendants(self) -> list[int]:
        """Processes below it, where the system tells."""
        descendants, queue = [], [self._process.pid]
        while queue:
            path = Path(f"/proc/{queue.pop()}/task")
            try:
                tasks = list(path.iterdir())
                children = [
                    int(n) for task in tasks for n in (task / "children").read_text().split()
                ]
            except OSError:
                continue
            descendants += children
            queue += children
        return descendants

    def ended(self, seconds: float) -> bool:
        """Whether it ends within so many seconds."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def kill(self) -> None:
        """Kill it and nothing below it."""
        self._process.kill()
        self._process.wait()

    def interrupt(self) -> None:
        """Ctrl-C: the whole group gets it."""
        os.killpg(self._process.pid, signal.SIGINT)

    def finish(self) -> tuple[int, str]:
        """Exit code and everything on stderr."""
        _, text = self._process.communicate(timeout=PATIENCE)
        return self._process.returncode, text


def alive(pid: int) -> bool:
    """Whether a process runs; one that only waits to be buried does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until(condition, seconds: float) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return bool(condition())


def command(small_path: Path, folder: Path) -> list[object]:
    settings = ("output.figures=false", *MANY)
    overrides = [part for entry in settings for part in ("--set", entry)]
    return ["run", small_path, "--out", folder, *overrides]


@pytest.fixture(scope="module")
def reference(start, tmp_path_factory):
    """The run of many jumps, undisturbed, its contacts in processes of their own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(contact_workers, "workers", workers.workers)
        run = start(tmp_path_factory.mktemp("reference") / "out", *MANY)
    assert run.summary["jumps"] == JUMPS
    assert run.summary["structure"]["solutions"] > 1
    return run


def kill_and_resume(small_path, folder, moments):
    """Kill the run, and every resumption; returns how many were hit.

    ``moments`` are pairs: the jump to wait for, or None, and the seconds after it.
    """
    arguments, kills = command(small_path, folder), 0
    for jump, seconds in moments:
        process = Process(*arguments)
        if jump is not None:
            file = folder / "jumps" / f"{jump:05d}.h5"
            assert wait_until(lambda file=file: file.exists(), PATIENCE)
        if process.ended(seconds):
            code, text = process.finish()
            assert code == 0, text
            continue
        below = process.descendants()
        process.kill()
        kills += 1
        assert wait_until(lambda pids=below: not any(map(alive, pids)), 10.0), "orphans"
        if not (folder / "case.yaml").exists():
            continue  # killed before it began: start again
        arguments = ["resume", folder]
        log = (folder / "run.log").read_text("utf-8") if (folder / "run.log").exists() else ""
        done = [int(number) for number in re.findall(r"jump (\d+):", log)]
        assert jumps_kept(folder) >= max(done, default=0) - 1
    return kills


@posix_only
@pytest.mark.slow
def test_three_kills_lose_nothing(small_path, resume, reference, separate_processes, tmp_path):
    moments = [(0, 0.0), (3, 0.02), (8, 0.05)]
    assert kill_and_resume(small_path, tmp_path / "out", moments) == 3
    assert_equal_after(resume, tmp_path / "out", reference)


@posix_only
@pytest.mark.slow
def test_kills_at_random_moments_lose_nothing(
    small_path, resume, reference, separate_processes, tmp_path
):
    """At random moments of the run, of its output and of its start."""
    dice, kills, number = random.Random(20), 0, 0
    while kills < KILLS:
        folder = tmp_path / f"out{number}"
        moments = [(None, dice.uniform(0.2, RUN_SECONDS)) for _ in range(4)]
        kills += kill_and_resume(small_path, folder, moments)
        assert_equal_after(resume, folder, reference)
        number += 1


def assert_equal_after(resume, folder, reference):
    """Resume to the end, if it is not reached, and compare."""
    run = resume(folder)
    assert_equal(run, reference)
    assert not list(folder.rglob("*.part.*"))


@posix_only
@pytest.mark.slow
def test_kill_while_the_checkpoint_is_written(
    small_path, resume, reference, separate_processes, tmp_path
):
    """The half of it that is on disk is not the checkpoint."""
    code = """
import os, signal, sys
from workflow.shell import checkpoint, store
whole, written = store.write_arrays, []
def torn(path, arrays, attributes):
    written.append(path)
    if len(written) < 4:
        return whole(path, arrays, attributes)
    with store.replacing(path) as partial:
        whole(partial, arrays, attributes)
        os.truncate(partial, 2000)
        os.kill(os.getpid(), signal.SIGKILL)
checkpoint.write_arrays = torn
from workflow.cli import main
main()
"""
    folder = tmp_path / "out"
    arguments = [sys.executable, "-c", code, *map(str, command(small_path, folder))]
    done = subprocess.run(arguments, capture_output=True, check=False, timeout=PATIENCE)
    assert done.returncode == -signal.SIGKILL
    assert list(folder.glob(".checkpoint.h5.*"))
    assert jumps_kept(folder) == 2
    assert_equal_after(resume, folder, reference)


def interrupt(small_path, folder, began):
    """Ctrl-C as soon as the run has begun what ``began`` looks for: one line, and all gone."""
    process = Process(*command(small_path, folder))
    assert wait_until(lambda: began(process), PATIENCE)
    below = process.descendants()
    process.interrupt()
    code, text = process.finish()
    assert code == 130, text
    lines = [line for line in text.splitlines() if line.strip()]
    assert lines[-1].startswith("fretscale: interrupted")
    # Before it only what the run itself had said: no traceback, nothing of the workers.
    assert [line for line in lines[:-1] if not line.startswith("run: ")] == []
    assert wait_until(lambda: not any(map(alive, below)), 10.0)


@posix_only
def test_ctrl_c_while_workers_start_ends_in_one_line(small_path, tmp_path):
    interrupt(small_path, tmp_path / "out", lambda process: len(process.descendants()) >= 2)


@posix_only
@pytest.mark.slow
def test_ctrl_c_among_jumps_ends_in_one_line_and_resumes(
    small_path, resume, reference, separate_processes, tmp_path
):
    folder = tmp_path / "out"
    interrupt(small_path, folder, lambda process: (folder / "checkpoint.h5").exists())
    assert_equal_after(resume, folder, reference)
