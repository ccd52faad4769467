"""One run of many: its folder, and the separate process that computes it.

After an interruption :func:`workflow.runs.run.bring_to_end` resumes the run from its folder.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

from fe_models.interpreter import Process, do_each
from sa_solver.errors import FretscaleError
from workflow.case.sections import Case
from workflow.errors import UserError, marked_line, one_line
from workflow.kinds import load_case
from workflow.messages.error_kinds import ErrorKind
from workflow.runs.run import bring_to_end
from workflow.shell.folders.folder import OutputFolder

# Seconds between two checks of whether a run is still wanted.
LOOK = 0.2


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


def _compute(job: Job, out: Path, take_over: bool) -> str:
    """Compute a job; return the error in one line, or "" if there is none."""
    root = out / job.name
    try:
        bring_to_end(job.load(), root, take_over)
    except FretscaleError as ending:
        return marked_line(ending)
    except Exception as ending:
        # What one line cannot say is kept in the log of the run.
        with suppress(OSError), OutputFolder(root).reserve_log().open("a", encoding="utf-8") as log:
            log.write(traceback.format_exc())
        lacking = isinstance(ending, MemoryError)
        kind = ErrorKind.OUT_OF_MEMORY if lacking else ErrorKind.DEFECT
        return kind.marked(one_line(f"{type(ending).__name__}: {ending}"))
    return ""


# --- in the process that waits ------------------------------------------------------------------


def run_job(
    job: Job,
    out: Path,
    abandoned: Callable[[], bool],
    one_thread: bool = True,
    take_over: bool = False,
) -> str:
    """Compute a job in a new process; return the error in one line, or "" if there is none.

    The process is ended if ``abandoned`` returns true. For ``take_over`` see
    :func:`workflow.shell.folders.lock.locked`.
    """
    with TemporaryFile() as stderr, ThreadPoolExecutor(1) as waiting:
        process = Process(one_thread, stderr)
        try:
            process.tell(do_each, ())
            absolute = replace(job, case=job.case.absolute())
            answer = waiting.submit(process.ask, _compute, absolute, out.absolute(), take_over)
            while not wait([answer], LOOK).done:
                if abandoned():
                    process.end()
            return one_line(answer.result())
        except (EOFError, OSError):
            return _ending(process.exit_code(), stderr)
        finally:
            process.end()


def _ending(code: int, stderr: IO[bytes]) -> str:
    """Return why a process has ended without an answer, in one line."""
    if code < 0:
        text = f"the process of this run got signal {-code}: did it run out of memory?"
        return ErrorKind.PROCESS_LOST.marked(text)
    stderr.seek(0)
    last = (stderr.read().decode(errors="replace").strip().splitlines() or ["no message"])[-1]
    text = f"the process of this run ended with exit code {code}: {last}"
    return ErrorKind.PROCESS_LOST.marked(text)


def finished(job: Job, out: Path, error: str) -> Finished:
    """Return a job that has ended, with the summary of its run."""
    root = out / job.name
    if not error and not OutputFolder(root).summary.exists():
        text = f"{root}: finished, but its summary is not visible here: is the folder shared?"
        error = ErrorKind.RUN_CHANGED.marked(text)
    try:
        return Finished(job, root, None if error else OutputFolder(root).read_summary(), error)
    except UserError as damaged:
        return Finished(job, root, None, marked_line(damaged))
