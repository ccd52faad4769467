"""Run processes that are killed or get Ctrl-C lose no results and leave nothing behind."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fe_models import interpreter
from tests.workflow.command_line import AS_PROCESS
from tests.workflow.shell.interruptions import PATIENCE, assert_equal, jumps_kept, posix_only
from workflow.analyses.wear import contact_workers
from workflow.shell import processes as workers

# Many quick jumps, so that a random moment mostly falls among them.
MANY = (*("wear.step.cycles=1500", "coupling.drift=2e-4"), "load_path.increments=[5, 7]")
JUMPS = 20
# Kills of it at random moments; test_kills.py has six of every kind of run.
KILLS = 8


# Every jump is kept at once, not now and then.
EVERY_JUMP = "from workflow.shell.folders import steps; steps.SHARE = float('inf'); "


class Process:
    """Command as a process with its own group."""

    def __init__(self, *arguments: object) -> None:
        command = [sys.executable, "-c", EVERY_JUMP + AS_PROCESS, *map(str, arguments)]
        self._process = subprocess.Popen(
            command, stderr=subprocess.PIPE, text=True, start_new_session=True
        )

    def descendants(self) -> list[int]:
        """Return the processes below it, if the system reports them."""
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
        """Return whether it ends within this number of seconds."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def kill(self) -> None:
        """Kill the process itself, but no process below it."""
        self._process.kill()
        self._process.wait()

    def interrupt(self) -> None:
        """Send Ctrl-C to the whole group."""
        os.killpg(self._process.pid, signal.SIGINT)

    def terminate(self) -> None:
        """Send the first signal of a batch system, only to the command."""
        self._process.terminate()

    def finish(self) -> tuple[int, str]:
        """Return the exit code and everything on stderr."""
        _, text = self._process.communicate(timeout=PATIENCE)
        return self._process.returncode, text


def alive(pid: int) -> bool:
    """Return whether a process runs; a zombie does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def works(pid: int) -> bool:
    """Return whether it is a worker: libraries also start short processes while imported."""
    try:
        return interpreter.COMMAND.encode() in Path(f"/proc/{pid}/cmdline").read_bytes()
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
    """Return an undisturbed run of many jumps, with its contacts in separate processes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(contact_workers, "workers", workers.workers)
        run = start(tmp_path_factory.mktemp("reference") / "out", *MANY)
    assert run.summary["jumps"] == JUMPS
    assert run.summary["structure"]["solutions"] > 1
    return run


def kill_and_resume(small_path, folder, moments):
    """Kill the run, and every resumption; return how many were hit.

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


def assert_equal_after(resume, folder, reference):
    """Resume to the end, if necessary, and compare."""
    run = resume(folder)
    assert_equal(run, reference)
    assert not list(folder.rglob("*.part.*"))


@posix_only
@pytest.mark.slow
def test_kill_while_the_checkpoint_is_written(
    small_path, resume, reference, separate_processes, tmp_path
):
    """A half-written file is not taken for the checkpoint."""
    code = """
import os, signal, sys
from workflow.shell.folders import checkpoint, store
whole, written = store.write_arrays, []
def torn(path, arrays, attributes):
    written.append(path)
    if len(written) < 3:
        return whole(path, arrays, attributes)
    with store.replacing(path) as partial:
        whole(partial, arrays, attributes)
        os.truncate(partial, 2000)
        os.kill(os.getpid(), signal.SIGKILL)
checkpoint.write_arrays = torn
from workflow.shell.folders import steps
steps.SHARE = float("inf")
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


def interrupt(small_path, folder, began, stop=Process.interrupt):
    """Stop a run once it has begun what ``began`` looks for; one line is left, no process."""
    process = Process(*command(small_path, folder))
    assert wait_until(lambda: began(process), PATIENCE)
    below = process.descendants()
    stop(process)
    code, text = process.finish()
    assert code == 130, text
    lines = [line for line in text.splitlines() if line.strip()]
    assert lines[-1].startswith(
        f"fretscale: interrupted: {folder} keeps what is done; continue with"
    )
    # Before it only what the run itself had said: no traceback, nothing of the workers.
    assert [line for line in lines[:-1] if not line.startswith(("run: ", "warning: "))] == []
    assert wait_until(lambda: not any(map(alive, below)), PATIENCE)


@posix_only
@pytest.mark.parametrize("stop", [Process.interrupt, Process.terminate])
def test_ctrl_c_while_workers_start_ends_in_one_line(small_path, tmp_path, stop):
    def began(process):
        return sum(map(works, process.descendants())) >= 2

    interrupt(small_path, tmp_path / "out", began, stop)


@posix_only
@pytest.mark.slow
def test_ctrl_c_among_jumps_ends_in_one_line_and_resumes(
    small_path, resume, reference, separate_processes, tmp_path
):
    folder = tmp_path / "out"
    interrupt(small_path, folder, lambda process: (folder / "checkpoint.h5").exists())
    assert_equal_after(resume, folder, reference)
