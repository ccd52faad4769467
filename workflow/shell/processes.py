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

# The workers share the cores among themselves; threads inside each would fight over them.
THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
COMMAND = "from workflow.shell.processes import main; main()"
# Bytes that say how long a message is.
LENGTH = 8


Task = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function that can be pickled, and its arguments."""

Answering = Callable[..., Any]
"""What a worker is: given a method's name and its arguments, it answers."""

Done = Callable[[], None]
"""Called whenever a part of longer work is done, from any thread."""


def _unheard() -> None:
    """Nobody wants to know."""


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

    def call(self, method: str, *arguments: Sequence[Any], done: Done = _unheard) -> list[Any]:
        """Call a method of every worker, each with its own share of the ``arguments``.

        ``done`` is called whenever one of them says that something is done. Raises what one of them
        raised, once all have answered; :class:`MethodFailed` if one is gone.
        """
        return self.begin(method, *arguments, done=done)()

    def begin(
        self, method: str, *arguments: Sequence[Any], done: Done = _unheard
    ) -> Callable[[], list[Any]]:
        """Begin with such a call; what is returned waits for the answers, and raises as it does.

        Nothing else may be asked of the workers before.
        """
        shares = zip(*arguments, strict=True)
        for process, share in zip(self._processes, shares, strict=True):
            process.tell(method, share)
        return partial(_answers, [_Hearing(process, done) for process in self._processes])


@contextmanager
def workers(make: Callable[[Any, Done], Answering], settings: Sequence[Any]) -> Iterator[Workers]:
    """Start a worker of one thread for each of the ``settings``, and end them all at the end.

    What ``make`` makes of them lives in the worker; it says by the second argument of ``make`` that
    something is done.
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

    def begin(self, function: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
        """Begin with a function; what is returned waits for its answer, and raises what it raised.

        Raises :class:`MethodFailed` if the process is gone.
        """
        if self._process is None:
            self._process = Process(one_thread=True)
            self._process.tell(_do_each, ())
        return self._asking.submit(_asked, self._process, function, arguments).result

    def close(self) -> None:
        """End it."""
        process, self._process = self._process, None
        if process is not None:
            process.end()
        self._asking.shutdown(cancel_futures=True)


def share_out(
    tasks: Sequence[Task], beside: Beside | None = None, done: Done = _unheard, own: int = 0
) -> list[Any]:
    """Do tasks, those from the beginning on here, those from the end on in a process ``beside``.

    The first ``own`` are done here in any case. ``done`` is called whenever one is. Returns what
    each of them returned. Raises what one of them raised; if that was one here, or Ctrl-C, the
    process beside ends as it is.
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

    if beside is None:
        here()
        return answers
    with ThreadPoolExecutor(1) as pool:
        there = pool.submit(work, left.pop, lambda *task: beside.begin(*task)())
        try:
            here()
        except BaseException:
            left.clear()
            beside.close()
            raise
        there.result()
    return answers


def _asked(process: Process, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """What a process answers."""
    process.tell(function, arguments)
    answer = process.answer()
    if isinstance(answer, Exception):
        raise answer
    return answer


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


class _Done:
    """What a process says whenever a part of its work is done."""


class _Hearing:
    """Takes what a process says as it comes, whatever others say meanwhile."""

    def __init__(self, process: Process, done: Done) -> None:
        self._process, self._done = process, done
        self._answer: Any = None
        self._gone: Exception | None = None
        # No thread of a pool: Ctrl-C does not wait for it.
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        try:
            while isinstance(said := self._process.answer(), _Done):
                self._done()
            self._answer = said
        except Exception as error:
            self._gone = error

    def answer(self) -> Any:
        """Its answer, once it is there."""
        self._thread.join()
        if self._gone is not None:
            raise self._gone
        return self._answer


def _answers(hearings: list[_Hearing]) -> list[Any]:
    """An answer from every process; raises the first that is an exception."""
    answers = [hearing.answer() for hearing in hearings]
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
    # Whatever a library prints is no part of the answer. It goes to stderr line by line: what is in
    # a buffer is lost where the parent ends this process.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    sys.stdout = sys.stderr
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
    make: Callable[[Any, Done], Answering],
    settings: Any,
) -> None:
    """Answer calls, one after the other, and tell what of them is done."""
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
