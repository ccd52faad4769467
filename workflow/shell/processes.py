"""Processes that work together with the main one: workers that answer calls, and background jobs.

Each process ends with its parent, however the parent ends, and leaves Ctrl-C to it. Each is a
fresh Python that receives messages on stdin and answers on stdout. The multiprocessing module would
instead run the parent's ``__main__`` again, which may have no guard, or be a notebook.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from queue import SimpleQueue
from typing import IO, Any

from fe_models.interpreter import fresh_python
from workflow.errors import MethodFailed

# The workers share the cores among themselves; threads inside each would compete for them.
THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
COMMAND = "from workflow.shell.processes import main; main()"
# Number of bytes that hold the length of a message.
LENGTH = 8


Task = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function that can be pickled, and its arguments."""

Answering = Callable[..., Any]
"""Function that a worker serves: given a method, or its name, and arguments, it answers."""

Done = Callable[[], None]
"""Called whenever a part of longer work is done, from any thread."""


def _ignore_progress() -> None:
    """Ignore the report of progress."""


class Process:
    """Worker process, seen from its parent; with ``one_thread`` its libraries use one thread."""

    def __init__(self, one_thread: bool = False) -> None:
        self._process = subprocess.Popen(
            fresh_python(COMMAND),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | (dict.fromkeys(THREAD_SETTINGS, "1") if one_thread else {}),
            start_new_session=True,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._questions, self._answers = self._process.stdin, self._process.stdout

    def tell(self, *message: Any) -> None:
        """Send a message. Raises :class:`MethodFailed` if the process has ended."""
        try:
            _write(self._questions, message)
        except OSError as error:
            raise _worker_gone(error) from error

    def answer(self) -> Any:
        """Wait for the next answer. Raises :class:`MethodFailed` if the process has ended."""
        try:
            return pickle.loads(_read(self._answers))
        except (EOFError, OSError) as error:
            raise _worker_gone(error) from error

    def end(self) -> None:
        """Kill the process, busy or not."""
        self._process.kill()
        self._process.communicate()


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
            process.tell(method, share)
        return partial(_answers, [_Hearing(process, done) for process in self._processes])


@contextmanager
def workers(make: Callable[[Any, Done], Answering], settings: Sequence[Any]) -> Iterator[Workers]:
    """Start a worker with one thread for each of the ``settings``, and end them all at the end.

    ``make`` is called in the worker; its second argument is a function that reports that a part of
    the work is done.
    """
    with _processes(
        _serve, [(make, setting) for setting in settings], one_thread=True
    ) as processes:
        yield Workers(processes)


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
            self._process.tell(_do_each, ())
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
    process.tell(function, arguments)
    answer = process.answer()
    if isinstance(answer, Exception):
        raise answer
    return answer


@contextmanager
def _processes(
    target: Callable[..., None], arguments: Sequence[tuple[Any, ...]], one_thread: bool = False
) -> Iterator[list[Process]]:
    """Yield processes that run ``target``, and end them, busy or not, at the end."""
    processes: list[Process] = []
    try:
        for _ in arguments:
            processes.append(Process(one_thread))
        for process, parts in zip(processes, arguments, strict=True):
            process.tell(target, parts)
        yield processes
    finally:
        for process in processes:
            process.end()


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
            while isinstance(printed := self._process.answer(), _Done):
                self._done()
            self._answer = printed
        except Exception as error:
            self._worker_gone = error

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


def _worker_gone(error: Exception) -> MethodFailed:
    return MethodFailed(
        f"a process of the run is gone ({type(error).__name__}): did it run out of memory?"
    )


# --- messages: their length, followed by the pickled content --------------------------------------


def _write(stream: IO[bytes], message: Any) -> None:
    data = pickle.dumps(message)
    stream.write(len(data).to_bytes(LENGTH, "little"))
    stream.write(data)
    stream.flush()


def _read(stream: IO[bytes]) -> bytes:
    """Return a message, still pickled. Raises EOFError if the other end has closed."""
    length = int.from_bytes(_bytes(stream, LENGTH), "little")
    return _bytes(stream, length)


def _bytes(stream: IO[bytes], number: int) -> bytes:
    data = stream.read(number)
    if len(data) < number:
        raise EOFError
    return data


# --- in the process -------------------------------------------------------------------------------


def main() -> None:
    """Run the function received on stdin, and leave Ctrl-C to the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Output of libraries is not part of the answer. It goes to stderr line by line, because a
    # buffer would be lost when the parent ends this process.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    messages: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_listen, args=(messages,), daemon=True).start()
    # Unpickled here, because modules imported with a message may need the main thread.
    target, parts = pickle.loads(messages.get())
    target(messages, answers, *parts)


def _listen(messages: SimpleQueue[bytes]) -> None:
    """Receive messages of the parent; end this process with the parent, even while it is busy."""
    # Not sys.stdin: the end of this process would wait for its lock.
    with os.fdopen(os.dup(0), "rb") as questions:
        try:
            while True:
                messages.put(_read(questions))
        finally:
            os._exit(1)


def _serve(
    messages: SimpleQueue[bytes],
    answers: IO[bytes],
    make: Callable[[Any, Done], Answering],
    settings: Any,
) -> None:
    """Answer calls, one after the other, and report which parts are done."""
    answering = attempt(make, (settings, lambda: _write(answers, _Done())))
    while True:
        method, arguments = pickle.loads(messages.get())
        if isinstance(answering, Exception):
            _write(answers, answering)
        else:
            _write(answers, attempt(answering, (method, *arguments)))


def _do_each(messages: SimpleQueue[bytes], answers: IO[bytes]) -> None:
    """Run functions, one after the other, and answer with what each returned or raised."""

    def run(message: bytes) -> Any:
        function, arguments = pickle.loads(message)
        return function(*arguments)

    while True:
        _write(answers, attempt(run, (messages.get(),)))


def attempt(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Return what the function returned or, as a value, what it raised."""
    try:
        return function(*arguments)
    except Exception as error:
        return error


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
