"""One process per interface, so that all of them compute side by side.

A worker builds its contact stage once and answers calls of its methods. It ends with its parent,
however the parent ends: the pipe between them closes.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from multiprocessing.connection import Connection
from typing import Any

from workflow.contact_stage import ContactStage, StageSettings

# The workers share the cores among themselves; threads inside each would fight over them.
THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Workers:
    """Contact stages in processes of their own, called all together."""

    def __init__(self, connections: list[Connection]) -> None:
        self._connections = connections

    def call(self, method: str, *arguments: Sequence[Any]) -> list[Any]:
        """Call a method of every stage, each with its own share of the ``arguments``.

        Raises what a stage raised, once all have answered.
        """
        for connection, own in zip(self._connections, zip(*arguments, strict=True), strict=True):
            connection.send((method, own))
        answers = [connection.recv() for connection in self._connections]
        for answer in answers:
            if isinstance(answer, Exception):
                raise answer
        return answers


@contextmanager
def contact_workers(settings: Sequence[StageSettings]) -> Iterator[Workers]:
    """Start a worker for every interface and end them all at the end."""
    context = multiprocessing.get_context("spawn")
    connections, processes = [], []
    with ExitStack() as stack:
        stack.enter_context(_environment(dict.fromkeys(THREAD_SETTINGS, "1")))
        for own in settings:
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs, own), daemon=True)
            process.start()
            theirs.close()
            connections.append(ours)
            processes.append(process)
    try:
        yield Workers(connections)
    finally:
        for connection in connections:
            connection.close()
        for process in processes:
            process.join()


def _serve(connection: Connection, settings: StageSettings) -> None:
    """Answer calls until the other end of the pipe closes."""
    # Ctrl-C reaches every process of a terminal; only the parent is to act on it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    stage = ContactStage(settings)
    while True:
        try:
            method, arguments = connection.recv()
        except EOFError:
            return
        try:
            answer = getattr(stage, method)(*arguments)
        except Exception as error:
            answer = error
        try:
            connection.send(answer)
        except BrokenPipeError:
            return


@contextmanager
def _environment(changes: dict[str, str]) -> Iterator[None]:
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
