"""The standard streams of a process, of which a program may be started without some."""

from __future__ import annotations

import os


def hold_standard_streams() -> None:
    """Let no file get the number of a stream that is closed, here or in processes of ours."""
    while (free := os.open(os.devnull, os.O_RDWR)) <= 2:
        os.set_inheritable(free, True)
    os.close(free)
