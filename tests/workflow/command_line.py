"""Command line in the process of the test, with the jobs and workers that it would start."""

import pickle
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from workflow.analyses.wear import contact_workers
from workflow.cli import cli
from workflow.errors import Ending, one_line
from workflow.pictures import drawing
from workflow.runs import jobs, run
from workflow.runs.job import Job
from workflow.runs.run import bring_to_end
from workflow.shell import processes

AS_PROCESS = (
    # What is started in the background of a shell is born deaf to Ctrl-C.
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "from workflow.cli import main; main()"
)
"""The command line as the code of a process that Ctrl-C ends, whoever has started the tests."""


def invoke(*arguments: object) -> Result:
    """Call ``fretscale`` with these arguments; any exception except an exit is raised."""
    result = CliRunner().invoke(cli, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def command(name: str, *arguments: object, overrides: Sequence[str] = ()) -> Result:
    """Call ``fretscale name`` with overrides (``"wear.cycles=1e4"``)."""
    return invoke(name, *arguments, *(part for entry in overrides for part in ("--set", entry)))


# --- replacements of other processes, whose start takes longer than their work --------------------


def sent(message: Any) -> Any:
    """Return what arrives at the other end of a pipe: a copy, with arrays in C order."""
    return pickle.loads(pickle.dumps(message))


class InThisProcess:
    """Replacement of the workers of a run; they answer here, one after the other."""

    def __init__(self, make: Callable[..., Callable[..., Any]], settings: Sequence[Any]) -> None:
        self.done: Callable[[], None] = lambda: None
        self._answering = [make(sent(setting), lambda: self.done()) for setting in settings]

    def call(
        self, method: str, *arguments: Sequence[Any], done: Callable[[], None] | None = None
    ) -> list[Any]:
        self.done = done or (lambda: None)
        shares = sent(list(zip(*arguments, strict=True)))
        return [
            sent(answer(method, *share))
            for answer, share in zip(self._answering, shares, strict=True)
        ]

    def begin(self, method: str, *arguments: Sequence[Any]) -> Callable[[], list[Any]]:
        return lambda: self.call(method, *arguments)


@contextmanager
def _workers(
    make: Callable[..., Callable[..., Any]], settings: Sequence[Any]
) -> Iterator[InThisProcess]:
    yield InThisProcess(make, settings)


class _BesideHere:
    """Replacement of the background process of a run; a job runs when its answer is needed."""

    def begin(self, function: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
        return lambda: function(*arguments)

    def close(self) -> None:
        pass


def _in_order(
    tasks: Sequence[processes.Task], worker: Any, done: Callable[[], None], own: int
) -> list[Any]:
    return processes.share_out(tasks, done=done)


@contextmanager
def runs_here() -> Iterator[None]:
    """Compute the contacts and pictures of a run in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(contact_workers, "workers", _workers)
        patch.setattr(run, "WorkerProcess", _BesideHere)
        patch.setattr(drawing, "share_out", _in_order)
        yield


_ALONE = threading.Lock()


def _run_job(job: Job, out: Path, abandoned: Callable[[], bool], one_thread: bool = True) -> str:
    try:
        with _ALONE:
            bring_to_end(job.load(), out / job.name)
    except Ending as error:
        return one_line(error)
    return ""


@contextmanager
def jobs_here() -> Iterator[None]:
    """Compute the runs of sweeps and other jobs in this process, one after the other."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jobs, "run_job", _run_job)
        yield
