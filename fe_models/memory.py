"""Memory this process may still take."""

from __future__ import annotations

import os
from pathlib import Path

MEMORY_TABLE = Path("/proc/meminfo")
# A container's own limit and use (Linux control groups, version 2).
CONTAINER = Path("/sys/fs/cgroup")


def available_bytes() -> float | None:
    """Free memory, reclaimable caches included; None where the system does not tell.

    In a container with a limit of its own, what that leaves if it is less.
    """
    amounts = [amount for amount in (_machine(), _container()) if amount is not None]
    return min(amounts, default=None)


def _machine() -> float | None:
    try:
        with MEMORY_TABLE.open(encoding="ascii") as file:
            lines = dict(line.split(":") for line in file)
        return 1024.0 * float(lines["MemAvailable"].split()[0])
    except (OSError, KeyError):
        pass
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (ValueError, AttributeError):
        return None


def _container() -> float | None:
    try:
        limit = float((CONTAINER / "memory.max").read_text(encoding="ascii"))
        used = float((CONTAINER / "memory.current").read_text(encoding="ascii"))
        statistics = (CONTAINER / "memory.stat").read_text(encoding="ascii").split("\n")
        caches = dict(line.split() for line in statistics if line)
        return limit - used + float(caches["inactive_file"])
    except (OSError, KeyError, ValueError):
        # No such file, or the limit is the word "max".
        return None
