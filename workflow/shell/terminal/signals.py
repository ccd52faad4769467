"""Handling of the signals that end a program."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)
# Set while a signal has arrived that may not have ended the program yet.
_pressed = threading.Event()


def end_tidily() -> None:
    """Treat the signal by which a batch system ends a program like Ctrl-C, unless it is ignored."""
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def ignore_signals() -> None:
    """Ignore further signals, so that a second Ctrl-C does not disturb the end of a program."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def remembering_interruptions() -> Iterator[None]:
    """Remember Ctrl-C, so that :func:`end_if_interrupted` raises it again where it was lost.

    Python raises KeyboardInterrupt wherever the main thread is. In a callback that a library calls,
    such as that of a weak reference, Python prints the exception and goes on.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def remember(number: int, frame: FrameType | None) -> None:
        _pressed.set()
        handler = before[signal.Signals(number)]
        assert callable(handler)
        handler(number, frame)

    before = {number: signal.getsignal(number) for number in SIGNALS}
    try:
        for number, handler in before.items():
            if callable(handler):
                signal.signal(number, remember)
        yield
    finally:
        for number, handler in before.items():
            if callable(handler):
                signal.signal(number, handler)
        _pressed.clear()


def end_if_interrupted() -> None:
    """Raise KeyboardInterrupt in the main thread if an earlier one was lost."""
    if _pressed.is_set() and threading.current_thread() is threading.main_thread():
        _pressed.clear()
        raise KeyboardInterrupt
