"""A gmsh model that is always closed again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def gmsh_model(name: str) -> Iterator[Any]:
    """Open a silent gmsh model of that name and yield the gmsh module."""
    import gmsh

    # Signals stay with Python, so that Ctrl-C during meshing ends the run tidily.
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        # One thread: the same mesh, node for node, on every machine.
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.add(name)
        yield gmsh
    finally:
        gmsh.finalize()
