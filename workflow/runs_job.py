"""One run of many: its folder, and the process of its own that computes it.

The process ends when whoever started it ends, however that ends, and its contact workers with it.
Interrupted or killed it leaves a folder that :func:`compute` takes up again.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from workflow import fidelity
from workflow.case import (
    Case,
    CaseError,
    DovetailCase,
    MeshCase,
    ResultantsCase,
    WearCase,
    dump_case,
    load_case,
)
from workflow.errors import Ending, MethodFailed, UserError, one_line
from workflow.folder import OutputFolder
from workflow.workers import THREAD_SETTINGS

# Held while a process works in the folder: one that was cut off may still be about to end.
LOCK = ".lock"
# Seconds between two looks at whether a run is still wanted.
LOOK = 0.2
# What the process runs; its only argument is the job.
COMMAND = "from workflow.runs_job import main; main()"

Kept = Literal["finished", "unfinished", "other", "nothing"]


@dataclass(frozen=True)
class Job:
    """A case with overrides (``"wear.cycles=1e4"``) to run in the folder ``name``."""

    name: str
    case: Path
    overrides: tuple[str, ...] = ()

    def load(self) -> Case:
        """The case to run. Raises CaseError."""
        return load_case(self.case, self.overrides)


@dataclass(frozen=True)
class Finished:
    """How a job ended: ``summary`` is that of its run, None where ``error`` says why not."""

    job: Job
    folder: Path
    summary: dict[str, Any] | None
    error: str = ""


def cores_of(case: Case) -> int:
    """Processes of a run that compute at the same time: its contacts, one at least."""
    if isinstance(case, DovetailCase):
        return 2
    if isinstance(case, MeshCase):
        return len(case.structure.contacts)
    return len(case.loads()) if isinstance(case, ResultantsCase) else 1


def kept_in(root: Path, case: Case) -> Kept:
    """What a folder has of this case; "other" is a run of another case."""
    folder = OutputFolder(root)
    if not folder.case.exists():
        return "nothing"
    finished = folder.summary.exists()
    record = read_summary(root).get("fidelity") if finished else fidelity.kept(folder)
    if not _is_case(folder.case, _as_chosen(case, record)):
        return "other"
    if finished:
        return "finished"
    return "unfinished" if isinstance(case, WearCase) and folder.checkpoint.exists() else "nothing"


def _is_case(path: Path, case: Case) -> bool:
    """Whether the file says this case, perhaps in the words of another version."""
    if path.read_text(encoding="utf-8") == dump_case(case):
        return True
    try:
        return load_case(path) == case
    except CaseError:
        return False


def read_summary(root: Path) -> dict[str, Any]:
    """``summary.json`` of a finished run."""
    summary: dict[str, Any] = json.loads(OutputFolder(root).summary.read_text(encoding="utf-8"))
    return summary


def _as_chosen(case: Case, record: dict[str, Any] | None) -> Case:
    """The case as a run of it was claimed, after ``fidelity`` had chosen."""
    return fidelity.changed(case, (record or {}).get("chosen", {}))


# --- in the process that computes ---------------------------------------------------------------


def compute(job: Job, out: Path) -> None:
    """Bring a job to its end, from where its folder has got to.

    A finished run of the same case stays, an unfinished wear run goes on from its last jump, and
    what else the folder has of earlier runs gives way. Raises Ending.
    """
    case, root = job.load(), out / job.name
    _refuse_foreign(root)
    with _locked(root):
        kept = kept_in(root, case)
        if kept == "finished":
            return
        from workflow.run import resume_run, run_case

        if kept == "unfinished" and _readable(root):
            resume_run(root)
        else:
            run_case(case, root, force=True)


def _refuse_foreign(root: Path) -> None:
    """Leave alone what no run of ours has made."""
    if not root.exists():
        return
    ours = any((root / name).exists() for name in (LOCK, OutputFolder(root).case.name))
    if not root.is_dir() or (any(root.iterdir()) and not ours):
        raise UserError(f"{root}: not empty and no run of fretscale; give another folder")


@contextmanager
def _locked(root: Path) -> Iterator[None]:
    """Wait for the folder, as long as another process works in it."""
    root.mkdir(parents=True, exist_ok=True)
    with (root / LOCK).open("w") as file:
        if sys.platform != "win32":
            import fcntl

            with suppress(OSError):  # a file system without locks
                fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _readable(root: Path) -> bool:
    """Whether the state to go on from is whole."""
    from workflow import checkpoint

    try:
        checkpoint.load(OutputFolder(root).checkpoint)
    except UserError:
        return False
    return True


def main() -> None:
    """Compute the job given as the only argument and say on stdout how it ended."""
    # Whatever a library prints goes to stderr; stdout is for the answer.
    answer = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    given = json.loads(sys.argv[1])
    job = Job(given["name"], Path(given["case"]), tuple(given["overrides"]))
    error = ""
    try:
        compute(job, Path(given["out"]))
    except Ending as ending:
        error = str(ending)
    except Exception as ending:
        error = f"{type(ending).__name__}: {ending}"
        _log(OutputFolder(Path(given["out"]) / job.name).log, traceback.format_exc())
    answer.write(json.dumps({"error": error}))
    answer.close()


def _log(path: Path, text: str) -> None:
    """Keep what one line cannot say where the run has told of itself."""
    with suppress(OSError), path.open("a", encoding="utf-8") as log:
        log.write(text)


def _end_with_parent() -> None:
    """End when the other end of stdin closes: nobody writes to it."""
    os.read(0, 1)
    os._exit(1)


# --- in the process that waits ------------------------------------------------------------------


def run_job(job: Job, out: Path, unwanted: Callable[[], bool], one_thread: bool = True) -> str:
    """Compute a job in a fresh process; the error in one line, "" if none.

    It is ended when it is ``unwanted``. It has a process group of its own, so that Ctrl-C comes to
    whoever waits, and only there.
    """
    given = asdict(job) | {"case": str(job.case.absolute()), "out": str(out.absolute())}
    # Held open as long as this process lives: its end is the end of the other.
    theirs, lifeline = os.pipe()
    try:
        process = subprocess.Popen(
            [sys.executable, "-c", COMMAND, json.dumps(given)],
            stdin=theirs,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            env=os.environ | (dict.fromkeys(THREAD_SETTINGS, "1") if one_thread else {}),
            start_new_session=True,
        )
        try:
            return _ending(process, *_wait(process, unwanted))
        finally:
            process.kill()
            process.wait()
    finally:
        os.close(theirs)
        os.close(lifeline)


def _wait(process: subprocess.Popen[str], unwanted: Callable[[], bool]) -> tuple[str, str]:
    """What the process wrote to stdout and stderr until its end."""
    while True:
        try:
            return process.communicate(timeout=LOOK)
        except subprocess.TimeoutExpired:
            if unwanted():
                process.kill()


def _ending(process: subprocess.Popen[str], answer: str, said: str) -> str:
    """Why the job failed, in one line; "" if it did not."""
    if process.returncode == 0:
        return one_line(json.loads(answer)["error"])
    if process.returncode < 0:
        number = -process.returncode
        return str(MethodFailed(f"the process of this run got signal {number}: for its memory?"))
    last = (said.strip().splitlines() or ["it said nothing"])[-1]
    return f"the process of this run ended with exit code {process.returncode}: {last}"


def finished(job: Job, out: Path, error: str) -> Finished:
    """A job that has ended, with the summary that its run left."""
    root = out / job.name
    if not error and not OutputFolder(root).summary.exists():
        error = f"{root}: finished, but its summary is not to be seen here: is the folder shared?"
    return Finished(job, root, None if error else read_summary(root), error)
