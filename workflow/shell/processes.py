"""Processes beside the main one: workers that answer calls, and jobs side by side.

A process of ours ends with its parent, however the parent ends, and leaves Ctrl-C to it.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from workflow.errors import MethodFailed

# The workers share the cores among themselves; threads inside each would fight over them.
THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


Answering = Callable[..., Any]
"""What a worker is: given a method's name and its arguments, it answers."""


class Workers:
    """Objects in processes of their own, called all together."""

    def __init__(self, connections: list[Connection]) -> None:
        self._connections = connections

    def call(self, method: str, *arguments: Sequence[Any]) -> list[Any]:
        """Call a method of every worker, each with its own share of the ``arguments``.

        Raises what one of them raised, once all have answered; :class:`MethodFailed` if one is
        gone.
        """
        try:
            shares = zip(*arguments, strict=True)
            for connection, share in zip(self._connections, shares, strict=True):
                connection.send((method, share))
        except OSError as error:
            raise _gone(error) from error
        return _answers(self._connections)


@contextmanager
def workers(make: Callable[[Any], Answering], settings: Sequence[Any]) -> Iterator[Workers]:
    """Start a worker of one thread for each of the ``settings``, and end them all at the end.

    What ``make`` makes of them lives in the worker.
    """
    with _processes(
        _serve, [(make, setting) for setting in settings], one_thread=True
    ) as connections:
        yield Workers(connections)


def side_by_side(jobs: Sequence[tuple[Callable[..., Any], tuple[Any, ...]]]) -> list[Any]:
    """Run functions, given with their arguments: the first one here, others in processes.

    Returns what each of them returned. Raises what one of them raised.
    """
    (here, arguments), *others = jobs
    with _processes(_do, others) as connections:
        return [here(*arguments), *_answers(connections)]


@contextmanager
def _processes(
    target: Callable[..., None], arguments: Sequence[tuple[Any, ...]], one_thread: bool = False
) -> Iterator[list[Connection]]:
    """Processes that run ``target`` with their end of a pipe; ended, busy or not, at the end."""
    context = multiprocessing.get_context("spawn")
    connections: list[Connection] = []
    processes: list[SpawnProcess] = []
    try:
        with ExitStack() as stack:
            if one_thread:
                stack.enter_context(environment(dict.fromkeys(THREAD_SETTINGS, "1")))
            stack.enter_context(_interrupts_held())
            for _ in arguments:
                ours, theirs = context.Pipe()
                process = context.Process(target=_run, args=(target, theirs), daemon=True)
                process.start()
                theirs.close()
                connections.append(ours)
                processes.append(process)
        # Python itself would wait forever for a process that is killed before it has read them.
        for connection, parts in zip(connections, arguments, strict=True):
            try:
                connection.send(parts)
            except OSError as error:
                raise _gone(error) from error
        yield connections
    finally:
        for connection in connections:
            connection.close()
        for process in processes:
            process.terminate()
            process.join()


def _run(target: Callable[..., None], connection: Connection) -> None:
    """First thing in a new process: leave Ctrl-C to the parent, and end when it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        target(connection, *connection.recv())
    except (EOFError, BrokenPipeError):
        return


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)


def _serve(connection: Connection, make: Callable[[Any], Answering], settings: Any) -> None:
    """Answer calls until the other end of the pipe closes."""
    answering = _attempt(make, (settings,))
    while True:
        method, arguments = connection.recv()
        if isinstance(answering, Exception):
            connection.send(answering)
        else:
            connection.send(_attempt(answering, (method, *arguments)))


def _do(connection: Connection, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Run a function and answer once, with what it returned or raised."""
    connection.send(_attempt(function, arguments))


def _attempt(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """What the function returned or, as a value, what it raised."""
    try:
        return function(*arguments)
    except Exception as error:
        return error


def _answers(connections: list[Connection]) -> list[Any]:
    """An answer from every process; raises the first that is an exception."""
    try:
        answers = [connection.recv() for connection in connections]
    except (EOFError, OSError) as error:
        raise _gone(error) from error
    for answer in answers:
        if isinstance(answer, Exception):
            raise answer
    return answers


def _gone(error: Exception) -> MethodFailed:
    return MethodFailed(
        f"a process of the run has gone ({type(error).__name__}): was it killed for memory?"
    )


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold Ctrl-C back; processes started within never see it, not even while they import."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    # It starts with the first process, and lets Ctrl-C through again when it has.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


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
