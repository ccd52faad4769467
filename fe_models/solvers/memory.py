"""Memory that this process may still use."""

from __future__ import annotations

from pathlib import Path

import psutil

# Folder with a container's memory limit and use (Linux control groups, version 2).
CONTAINER = Path("/sys/fs/cgroup")


def available_bytes() -> float:
    """Return the free memory, reclaimable caches included.

    In a container with a memory limit, it is the part of the limit that is free, if that is less.
    """
    machine, container = float(psutil.virtual_memory().available), _container()
    return machine if container is None else min(machine, container)


def _container() -> float | None:
    try:
        limit = float((CONTAINER / "memory.max").read_text(encoding="ascii"))
        used = float((CONTAINER / "memory.current").read_text(encoding="ascii"))
        statistics = (CONTAINER / "memory.stat").read_text(encoding="ascii").split("\n")
        caches = dict(line.split() for line in statistics if line)
        return limit - used + float(caches["inactive_file"])
    except (OSError, KeyError, ValueError):
        # There is no such file, or the limit is the word "max".
        return None
