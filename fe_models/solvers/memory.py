"""Memory that this process may still use."""

from __future__ import annotations

from pathlib import Path

import psutil

# Number of full matrices on all contact displacements that are held while a joint of two bodies is
# made, and of more bodies: 5.1 for dovetails and 9.6 for a stack of 12 blocks.
OF_TWO, OF_MANY = 6, 10
BYTES = 8
# Folder with a container's memory limit and use (Linux control groups, version 2).
CONTAINER = Path("/sys/fs/cgroup")


def available_bytes() -> float:
    """Return the free memory, reclaimable caches included.

    In a container with a memory limit, it is the part of the limit that is free, if that is less.
    """
    machine, container = float(psutil.virtual_memory().available), _container()
    return machine if container is None else min(machine, container)


def full_matrices_bytes(displacements: int, bodies: int, mirrored: bool = False) -> float:
    """Return the memory of a joint's full matrices while the joint is made [bytes].

    ``displacements`` is the number of contact displacements. A joint that is ``mirrored`` has two
    matrices of half the size in place of each.
    """
    matrices = OF_TWO if bodies == 2 else OF_MANY
    return BYTES * matrices * float(displacements) ** 2 / (2.0 if mirrored else 1.0)


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
