"""Fresh Python processes that receive messages of their parent and answer them.

Each process ends with its parent, however the parent ends, and leaves Ctrl-C to it. It receives
messages on stdin and answers on stdout. The process pools of the multiprocessing module would
instead run the parent's ``__main__`` again, which may have no guard, or be a notebook; those of
loky survive a killed parent, and need standard streams.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from typing import IO, Any

ROOT = str(Path(__file__).parents[1])
# The processes share the cores among themselves; threads inside each would compete for them.
THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
COMMAND = "from fe_models.interpreter import main; main()"
# Ctrl-C in a terminal reaches only the parent: POSIX takes a session for that, Windows a group.
NEW_GROUP = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
# Number of bytes that hold the length of a message.
LENGTH = 8


class Process:
    """Separate process, seen from its parent; with ``one_thread`` its libraries use one thread.

    It has the ``stderr`` of its parent, or the one given, and prints nothing on stdout.
    """

    def __init__(self, one_thread: bool = False, stderr: IO[Any] | int | None = None) -> None:
        self._process = subprocess.Popen(
            _fresh_python(COMMAND),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stderr,
            env=os.environ | (dict.fromkeys(THREAD_SETTINGS, "1") if one_thread else {}),
            start_new_session=True,
            creationflags=NEW_GROUP,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._questions, self._answers = self._process.stdin, self._process.stdout

    def tell(self, *message: Any) -> None:
        """Send a message. Raises OSError if the process has ended.

        The first message is a function that serves all others, such as :func:`do_each`, and a tuple
        of its further arguments.
        """
        write_message(self._questions, message)

    def answer(self) -> Any:
        """Wait for the next answer. Raises EOFError or OSError if the process has ended."""
        return pickle.loads(_read(self._answers))

    def ask(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Run a function in a process that runs :func:`do_each`; return its result or exception.

        Raises EOFError or OSError if the process has ended.
        """
        self.tell(function, arguments)
        return self.answer()

    def exit_code(self) -> int:
        """Wait for the end of the process; return its exit code, or minus its signal."""
        return self._process.wait()

    def end(self) -> None:
        """Kill the process, busy or not."""
        self._process.kill()
        self._process.communicate()


def _fresh_python(code: str) -> list[str]:
    """Return the command that runs ``code`` in a separate Python process.

    The process searches modules where this one does, but not in its working directory: a file there
    may have the name of one of our packages. It does not know the ``__main__`` of this process,
    which may be a notebook, a script without a guard, or standard input.
    """
    places = [place for place in sys.path if isinstance(place, str) and place] + [ROOT]
    return [sys.executable, "-c", f"import sys; sys.path[:] = {places!r}; {code}"]


# --- messages: their length, followed by the pickled content --------------------------------------


def write_message(stream: IO[bytes], message: Any) -> None:
    """Write a message to a stream."""
    data = pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL)
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
    serve, parts = pickle.loads(messages.get())
    serve(messages, answers, *parts)


def _listen(messages: SimpleQueue[bytes]) -> None:
    """Receive messages of the parent; end this process with the parent, even while it is busy."""
    # Not sys.stdin: the end of this process would wait for its lock.
    with os.fdopen(os.dup(0), "rb") as questions:
        try:
            while True:
                messages.put(_read(questions))
        finally:
            os._exit(1)


def do_each(messages: SimpleQueue[bytes], answers: IO[bytes]) -> None:
    """Run functions, one after the other, and answer with what each returned or raised."""

    def run(message: bytes) -> Any:
        function, arguments = pickle.loads(message)
        return function(*arguments)

    while True:
        write_message(answers, attempt(run, (messages.get(),)))


def attempt(function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
    """Return what the function returned or, as a value, what it raised."""
    try:
        return function(*arguments)
    except Exception as error:
        return error
