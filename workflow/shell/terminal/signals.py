"""Handling of the signals that end a program."""

from __future__ import annotations

import signal


def end_tidily() -> None:
    """Treat the signal by which a batch system ends a program like Ctrl-C, unless it is ignored."""
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def ignore_signals() -> None:
    """Ignore further signals, so that a second Ctrl-C does not disturb the end of a program."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
