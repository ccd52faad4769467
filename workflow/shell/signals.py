"""How a program takes the signals that are to end it."""

from __future__ import annotations

import signal


def end_tidily() -> None:
    """Let what a batch system ends a program with do as Ctrl-C does, unless that is ignored."""
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def hear_no_more() -> None:
    """Let nobody who presses Ctrl-C again disturb the end of a program."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
