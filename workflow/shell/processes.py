"""Work in separate processes: workers that answer calls together, and jobs in the background."""

from __future__ import annotations

import os
import pickle
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from queue import SimpleQueue
from typing import IO, Any

from fe_models.interpreter import Process, attempt, do_each, write_message
from workflow.errors import ProcessLost

Task = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function that can be pickled, and its arguments."""

Answering = Callable[..., Any]
"""Function that a worker serves: given a method, or its name, and arguments, it answers."""

Done = Callable[[], None]
"""Called whenever a part of longer work is done, from any thread."""


def _ignore_progress() -> None:
    """Ignore the report of progress."""


class Workers:
    """Objects in separate processes, called all together."""

    def __init__(self, processes: list[Process]) -> None:
        self._processes = processes

    def call(
        self, method: object, *arguments: Sequence[Any], done: Done = _ignore_progress
    ) -> list[Any]:
        """Have every worker answer for a ``method``, each with its share of the ``arguments``.

        ``done`` is called whenever a worker reports that a part is done. Once all have answered, an
        exception of a worker is raised; :class:`MethodFailed` if a process has ended.
        """
        return self.begin(method, *arguments, done=done)()

    def begin(
        self, method: object, *arguments: Sequence[Any], done: Done = _ignore_progress
    ) -> Callable[[], list[Any]]:
        """Begin such a call; return a function that waits for the answers and raises as it does.

        No other call may be made to the workers until then.
        """
        shares = zip(*arguments, strict=True)
        for process, share in zip(self._processes, shares, strict=True):
            with _watched():
                process.tell(method, share)
        return partial(_answers, [_Hearing(process, done) for process in self._processes])


@contextmanager
def workers(make: Callable[[Any, Done], Answering], settings: Sequence[Any]) -> Iterator[Workers]:
    """Start a worker with one thread for each of the ``settings``, and end them all at the end.

    ``make`` is called in the worker; its second argument is a function that reports that a part of
    the work is done.
    """
    processes: list[Process] = []
    try:
        for _ in settings:
            processes.append(Process(one_thread=True))
        for process, setting in zip(processes, settings, strict=True):
            with _watched():
                process.tell(_serve, (make, setting))
        yield Workers(processes)
    finally:
        for process in processes:
            process.end()


class WorkerProcess:
    """Background process with one thread that does jobs one after the other.

    It starts with the first job, and :meth:`close` ends it, busy or not.
    """

    def __init__(self) -> None:
        self._process: Process | None = None
        self._asking = ThreadPoolExecutor(1)

    def begin(self, function: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
        """Begin a function; the returned function waits for its result, or raises its exception.

        Raises :class:`MethodFailed` if the process has ended.
        """
        if self._process is None:
            self._process = Process(one_thread=True)
            with _watched():
                self._process.tell(do_each, ())
        return self._asking.submit(_asked, self._process, function, arguments).result

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.end()
        self._asking.shutdown(cancel_futures=True)


def share_out(
    tasks: Sequence[Task],
    worker: WorkerProcess | None = None,
    done: Done = _ignore_progress,
    own: int = 0,
) -> list[Any]:
    """Do tasks here from the first onwards, and in the process ``worker`` from the last backwards.

    The first ``own`` tasks are done here in any case. ``done`` is called after each task. Returns
    the results of the tasks. Raises the exception of a task; if a task here raised it, or after
    Ctrl-C, the process ``worker`` is ended at once.
    """
    answers: list[Any] = [None] * len(tasks)
    first, left = deque(range(own)), deque(range(own, len(tasks)))

    def work(take: Callable[[], int], do: Callable[..., Any]) -> None:
        while True:
            try:
                number = take()
            except IndexError:
                return
            function, arguments = tasks[number]
            answers[number] = do(function, *arguments)
            done()

    def here() -> None:
        for numbers in (first, left):
            work(numbers.popleft, lambda function, *arguments: function(*arguments))

    if worker is None:
        here()
        return answers
    with ThreadPoolExecutor(1) as pool:
        there = pool.submit(work, left.pop, lambda *task: worker.begin(*task)())
        try:
            here()
        except BaseException:
            left.clear()
            worker.close()
            raise
        there.result()
    return answers


def _asked(process: Process, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Send a function to a process and return its answer, or raise its exception."""
    with _watched():
        answer = process.ask(function, *arguments)
    if isinstance(answer, Exception):
        raise answer
    return answer


@contextmanager
def _watched() -> Iterator[None]:
    """Raise :class:`MethodFailed` if a process to which something is sent has ended."""
    try:
        yield
    except (EOFError, OSError) as error:
        raise ProcessLost(
            f"a process of the run is gone ({type(error).__name__}): did it run out of memory?"
        ) from error


class _Done:
    """Message that a part of the work of a process is done."""


class _Hearing:
    """Thread that receives the messages of one process, independently of other processes."""

    def __init__(self, process: Process, done: Done) -> None:
        self._process, self._done = process, done
        self._answer: Any = None
        self._worker_gone: Exception | None = None
        # Not a thread of a pool, so that Ctrl-C does not wait for it.
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        try:
            while isinstance(answer := self._next(), _Done):
                self._done()
            self._answer = answer
        except Exception as error:
            self._worker_gone = error

    def _next(self) -> Any:
        with _watched():
            return self._process.answer()

    def answer(self) -> Any:
        """Wait for the answer and return it."""
        self._thread.join()
        if self._worker_gone is not None:
            raise self._worker_gone
        return self._answer


def _answers(hearings: list[_Hearing]) -> list[Any]:
    """Return the answer of every process; raise the first that is an exception."""
    answers = [hearing.answer() for hearing in hearings]
    for answer in answers:
        if isinstance(answer, Exception):
            raise answer
    return answers


def _serve(
    messages: SimpleQueue[bytes],
    answers: IO[bytes],
    make: Callable[[Any, Done], Answering],
    settings: Any,
) -> None:
    """Answer calls, one after the other, and report which parts are done."""
    answering = attempt(make, (settings, lambda: write_message(answers, _Done())))
    while True:
        method, arguments = pickle.loads(messages.get())
        if isinstance(answering, Exception):
            write_message(answers, answering)
        else:
            write_message(answers, attempt(answering, (method, *arguments)))


@contextmanager
def environment(changes: dict[str, str]) -> Iterator[None]:
    """Set environment variables for processes started within."""
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
