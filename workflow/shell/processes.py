"""Processes beside the main one: workers that answer calls, and jobs side by side.

A process of ours ends with its parent, however the parent ends, and leaves Ctrl-C to it. It is a
fresh Python that is told over its stdin what to do and answers on its stdout: multiprocessing would
run the parent's ``__main__`` again, which may have no guard, or be a notebook.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from queue import SimpleQueue
from typing import IO, Any

from fe_models.interpreter import fresh_python
from workflow.errors import MethodFailed

# The workers share the cores among themselves; threads inside each would fight over them.
THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
COMMAND = "from workflow.shell.processes import main; main()"
# Bytes that say how long a message is.
LENGTH = 8


Answering = Callable[..., Any]
"""What a worker is: given a method's name and its arguments, it answers."""


class Process:
    """A process of ours, from the side of its parent; of ``one_thread`` if so."""

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
        """Say what to do. Raises :class:`MethodFailed` if it is gone."""
        try:
            _write(self._questions, message)
        except OSError as error:
            raise _gone(error) from error

    def answer(self) -> Any:
        """Wait for its next answer. Raises :class:`MethodFailed` if it is gone."""
        try:
            return pickle.loads(_read(self._answers))
        except (EOFError, OSError) as error:
            raise _gone(error) from error

    def end(self) -> None:
        """End it, busy or not."""
        self._process.kill()
        self._process.communicate()


class Workers:
    """Objects in processes of their own, called all together."""

    def __init__(self, processes: list[Process]) -> None:
        self._processes = processes

    def call(self, method: str, *arguments: Sequence[Any]) -> list[Any]:
        """Call a method of every worker, each with its own share of the ``arguments``.

        Raises what one of them raised, once all have answered; :class:`MethodFailed` if one is
        gone.
        """
        shares = zip(*arguments, strict=True)
        for process, share in zip(self._processes, shares, strict=True):
            process.tell(method, share)
        return _answers(self._processes)


@contextmanager
def workers(make: Callable[[Any], Answering], settings: Sequence[Any]) -> Iterator[Workers]:
    """Start a worker of one thread for each of the ``settings``, and end them all at the end.

    What ``make`` makes of them lives in the worker.
    """
    with _processes(
        _serve, [(make, setting) for setting in settings], one_thread=True
    ) as processes:
        yield Workers(processes)


class Beside:
    """A process of one thread that does jobs one after the other, while this one works.

    It begins with the first job, and ends, busy or not, with :meth:`close`.
    """

    def __init__(self) -> None:
        self._process: Process | None = None
        self._asking = ThreadPoolExecutor(1)

    def begin(
        self,
        function: Callable[..., Any],
        arguments: tuple[Any, ...] = (),
        done: Callable[[], None] = lambda: None,
    ) -> Callable[[], Any]:
        """Begin with a function; what is returned waits for its answer, and raises what it raised.

        ``done`` is called, in another thread, whenever it yields, if it is a generator.
        """
        if self._process is None:
            self._process = Process(one_thread=True)
            self._process.tell(_do_each, ())
        return self._asking.submit(_heard, self._process, (function, arguments), done).result

    def close(self) -> None:
        """End it."""
        if self._process is not None:
            self._process.end()
        self._asking.shutdown(cancel_futures=True)


def side_by_side(
    jobs: Sequence[tuple[Callable[..., Any], tuple[Any, ...]]],
    done: Callable[[], None] = lambda: None,
    team: Sequence[Beside] = (),
) -> list[Any]:
    """Run functions, given with their arguments: the first one here, others in processes.

    Those of a ``team`` first. ``done`` is called whenever one of them yields, of those that are
    generators. Returns what each of them returned. Raises what one of them raised.
    """
    (here, arguments), *others = jobs
    with ExitStack() as stack:
        new = [stack.enter_context(closing(Beside())) for _ in others[len(team) :]]
        begun = [
            process.begin(*other, done)
            for process, other in zip([*team, *new], others, strict=False)
        ]
        answer = _last(here(*arguments), done)
        return [answer, *(answered() for answered in begun)]


def _heard(process: Process, job: tuple[Any, ...], done: Callable[[], None]) -> Any:
    """What a process answers to a job."""
    process.tell(*job)
    while isinstance(said := process.answer(), _Done):
        done()
    if isinstance(said, Exception):
        raise said
    return said


class _Done:
    """What a process says whenever its function yields."""


def _last(work: Any, done: Callable[[], None]) -> Any:
    """What a generator returns, ``done`` called whenever it yields; anything else as it is."""
    while isinstance(work, Generator):
        try:
            next(work)
        except StopIteration as end:
            return end.value
        done()
    return work


@contextmanager
def _processes(
    target: Callable[..., None], arguments: Sequence[tuple[Any, ...]], one_thread: bool = False
) -> Iterator[list[Process]]:
    """Processes that run ``target``; ended, busy or not, at the end."""
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


def _answers(processes: list[Process]) -> list[Any]:
    """An answer from every process; raises the first that is an exception."""
    answers = [process.answer() for process in processes]
    for answer in answers:
        if isinstance(answer, Exception):
            raise answer
    return answers


def _gone(error: Exception) -> MethodFailed:
    return MethodFailed(
        f"a process of the run has gone ({type(error).__name__}): was it killed for memory?"
    )


# --- messages: their length, and what pickle makes of them ---------------------------------------


def _write(stream: IO[bytes], message: Any) -> None:
    data = pickle.dumps(message)
    stream.write(len(data).to_bytes(LENGTH, "little"))
    stream.write(data)
    stream.flush()


def _read(stream: IO[bytes]) -> bytes:
    """A message that is not unpickled yet. Raises EOFError where the other end has gone."""
    length = int.from_bytes(_bytes(stream, LENGTH), "little")
    return _bytes(stream, length)


def _bytes(stream: IO[bytes], number: int) -> bytes:
    data = stream.read(number)
    if len(data) < number:
        raise EOFError
    return data


# --- in the process -------------------------------------------------------------------------------


def main() -> None:
    """Do what is told on stdin, and leave Ctrl-C to the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Whatever a library prints is no part of the answer.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    messages: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_listen, args=(messages,), daemon=True).start()
    # Here, for what is imported with a message may want to be in the main thread.
    target, parts = pickle.loads(messages.get())
    target(messages, answers, *parts)


def _listen(messages: SimpleQueue[bytes]) -> None:
    """Take in what the parent says; end when it ends, however busy this process is."""
    # Not sys.stdin, whose lock the end of this process would wait for.
    with os.fdopen(os.dup(0), "rb") as questions:
        try:
            while True:
                messages.put(_read(questions))
        finally:
            os._exit(1)


def _serve(
    messages: SimpleQueue[bytes],
    answers: IO[bytes],
    make: Callable[[Any], Answering],
    settings: Any,
) -> None:
    """Answer calls, one after the other."""
    answering = _attempt(make, (settings,))
    while True:
        method, arguments = pickle.loads(messages.get())
        if isinstance(answering, Exception):
            _write(answers, answering)
        else:
            _write(answers, _attempt(answering, (method, *arguments)))


def _do_each(messages: SimpleQueue[bytes], answers: IO[bytes]) -> None:
    """Run one function after the other: answer with what it returned or raised, tell its yields."""
    while True:
        message = messages.get()

        def run(message: bytes = message) -> Any:
            function, arguments = pickle.loads(message)
            return _last(function(*arguments), lambda: _write(answers, _Done()))

        _write(answers, _attempt(run, ()))


def _attempt(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """What the function returned or, as a value, what it raised."""
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
