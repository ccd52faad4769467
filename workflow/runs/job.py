"""One run of many: its folder, and the separate process that computes it.

The process and its contact workers end when the process that started them ends, in whatever way.
After an interruption :func:`workflow.runs.run.bring_to_end` resumes the run from its folder.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fe_models.interpreter import fresh_python
from sa_solver.errors import FretscaleError
from workflow.case.sections import Case
from workflow.errors import MethodFailed, UserError, one_line
from workflow.kinds import load_case
from workflow.runs.run import bring_to_end
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.processes import THREAD_SETTINGS

# Seconds between two checks of whether a run is still wanted.
LOOK = 0.2
# Code that the process runs; its only argument is the job.
COMMAND = "from workflow.runs.job import main; main()"


@dataclass(frozen=True)
class Job:
    """Case with overrides (``"wear.cycles=1e4"``) to run in the folder ``name``."""

    name: str
    case: Path
    overrides: tuple[str, ...] = ()

    def load(self) -> Case:
        """Return the case to run. Raises CaseError."""
        return load_case(self.case, self.overrides)


@dataclass(frozen=True)
class Finished:
    """Result of a job: the ``summary`` of its run, or None if ``error`` says why there is none."""

    job: Job
    folder: Path
    summary: dict[str, Any] | None
    error: str = ""


# --- in the process that computes ---------------------------------------------------------------


def main() -> None:
    """Compute the job given as the only argument, and report on stdout how it ended."""
    # Output of libraries goes to stderr, because stdout is for the answer.
    answer = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    arguments = json.loads(sys.argv[1])
    job = Job(arguments["name"], Path(arguments["case"]), tuple(arguments["overrides"]))
    root, error = Path(arguments["out"]) / job.name, ""
    try:
        bring_to_end(job.load(), root, arguments["take_over"])
    except FretscaleError as ending:
        error = str(ending)
    except Exception as ending:
        error = f"{type(ending).__name__}: {ending}"
        # What one line cannot say is kept in the log of the run.
        with suppress(OSError), OutputFolder(root).reserve_log().open("a", encoding="utf-8") as log:
            log.write(traceback.format_exc())
    answer.write(json.dumps({"error": error}))
    answer.close()


def _end_with_parent() -> None:
    """End this process when stdin, to which nobody writes, is closed by the end of the parent."""
    os.read(0, 1)
    os._exit(1)


# --- in the process that waits ------------------------------------------------------------------


def run_job(
    job: Job,
    out: Path,
    abandoned: Callable[[], bool],
    one_thread: bool = True,
    take_over: bool = False,
) -> str:
    """Compute a job in a new process; return the error in one line, or "" if there is none.

    The process is ended if ``abandoned`` returns true. It has a separate process group, so that
    only
    the waiting process receives Ctrl-C. For ``take_over`` see
    :func:`workflow.shell.folders.lock.locked`.
    """
    arguments = asdict(job) | {"case": str(job.case.absolute()), "out": str(out.absolute())}
    arguments["take_over"] = take_over
    # Held open as long as this process lives: its end is the end of the other.
    theirs, lifeline = os.pipe()
    try:
        process = subprocess.Popen(
            [*fresh_python(COMMAND), json.dumps(arguments)],
            stdin=theirs,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            env=os.environ | (dict.fromkeys(THREAD_SETTINGS, "1") if one_thread else {}),
            start_new_session=True,
        )
        try:
            return _ending(process, *_wait(process, abandoned))
        finally:
            process.kill()
            process.wait()
    finally:
        os.close(theirs)
        os.close(lifeline)


def _wait(process: subprocess.Popen[str], abandoned: Callable[[], bool]) -> tuple[str, str]:
    """Wait for the end of the process, and return what it wrote to stdout and stderr."""
    while True:
        try:
            return process.communicate(timeout=LOOK)
        except subprocess.TimeoutExpired:
            if abandoned():
                process.kill()


def _ending(process: subprocess.Popen[str], answer: str, stderr: str) -> str:
    """Return why the job failed, in one line, or "" if it did not."""
    if process.returncode == 0 and answer:
        return one_line(json.loads(answer)["error"])
    if process.returncode < 0:
        number = -process.returncode
        return str(
            MethodFailed(f"the process of this run got signal {number}: did it run out of memory?")
        )
    last = (stderr.strip().splitlines() or ["no message"])[-1]
    return f"the process of this run ended with exit code {process.returncode}: {last}"


def finished(job: Job, out: Path, error: str) -> Finished:
    """Return a job that has ended, with the summary of its run."""
    root = out / job.name
    if not error and not OutputFolder(root).summary.exists():
        error = f"{root}: finished, but its summary is not visible here: is the folder shared?"
    try:
        return Finished(job, root, None if error else OutputFolder(root).read_summary(), error)
    except UserError as damaged:
        return Finished(job, root, None, one_line(damaged))
