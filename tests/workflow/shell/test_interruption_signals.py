"""Run processes that are killed or get Ctrl-C lose no results and leave nothing behind."""

import os
import signal
import subprocess
import sys
import time
import weakref
from contextlib import closing
from pathlib import Path

import pytest

from fe_models import interpreter
from tests.workflow.command_line import AS_PROCESS
from tests.workflow.shell.interruptions import PATIENCE, posix_only
from workflow.shell.terminal.reporter import Reporter
from workflow.shell.terminal.screen import Loudness
from workflow.shell.terminal.signals import remembering_interruptions

# Many quick jumps, so that a random moment mostly falls among them.
MANY = (*("wear.step.cycles=1500", "coupling.drift=2e-4"), "load_path.increments=[5, 7]")


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


def begun(small_path: Path, folder: Path) -> tuple[Process, list[int]]:
    """Return a run that has started its workers, and all processes below it."""
    process = Process(*command(small_path, folder))
    assert wait_until(lambda: sum(map(works, process.descendants())) >= 2, PATIENCE)
    return process, process.descendants()


@posix_only
@pytest.mark.parametrize("stop", [Process.interrupt, Process.terminate])
def test_an_interrupted_run_ends_in_one_line_and_without_processes(small_path, tmp_path, stop):
    process, below = begun(small_path, tmp_path / "out")
    stop(process)
    code, text = process.finish()
    assert code == 130, text
    *before, last = (line for line in text.splitlines() if line.strip())
    assert str(tmp_path / "out") in last
    # Before it only what the run itself had said: no traceback, nothing of the workers.
    assert [line for line in before if not line.startswith(("run: ", "warning: "))] == []
    assert wait_until(lambda: not any(map(alive, below)), PATIENCE)


@posix_only
@pytest.mark.slow
def test_workers_end_with_a_run_that_is_killed(small_path, tmp_path):
    process, below = begun(small_path, tmp_path / "out")
    process.kill()
    assert wait_until(lambda: not any(map(alive, below)), PATIENCE)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_ctrl_c_that_a_library_loses_ends_the_run_at_its_next_stage(tmp_path):
    class Held:
        """Object whose end runs a callback, in which Python loses exceptions."""

    held = Held()
    watch = weakref.ref(held, lambda _: signal.raise_signal(signal.SIGINT))
    before = signal.default_int_handler
    inherited = signal.signal(signal.SIGINT, before)  # ignored in a shell's background
    reporter = Reporter(tmp_path / "run.log", loudness=Loudness.QUIET)
    with closing(reporter), remembering_interruptions():
        del held
        assert watch() is None
        with pytest.raises(KeyboardInterrupt), reporter.stage("next"):
            pass
        with reporter.stage("cleaning up"):
            pass
    assert signal.signal(signal.SIGINT, inherited) is before
