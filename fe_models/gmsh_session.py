"""A gmsh model that is always closed again, and sizes that grow away from its faces."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal


@contextmanager
def gmsh_model(name: str) -> Iterator[Any]:
    """Open a silent gmsh model of that name and yield the gmsh module."""
    import gmsh

    # Signals stay with Python, so that Ctrl-C during meshing ends the run tidily.
    gmsh.initialize(interruptible=False)
    # Its libraries let the system end a process that writes to another one that has gone.
    if hasattr(signal, "SIGPIPE") and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        # One thread: the same mesh, node for node, on every machine.
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.add(name)
        yield gmsh
    finally:
        gmsh.finalize()


def grow_from(
    gmsh: Any,
    kind: Literal["CurvesList", "SurfacesList"],
    entities: list[int],
    fine: float,
    coarse: float,
    growth: float,
) -> int:
    """Mesh size: ``fine`` on the entities, up to ``coarse``, by ``growth`` times the distance.

    Returns the number of the distance field, for further settings of it.
    """
    field = gmsh.model.mesh.field
    distance = field.add("Distance")
    field.setNumbers(distance, kind, entities)
    growing = field.add("MathEval")
    field.setString(growing, "F", f"{fine!r} + {growth!r} * F{distance}")
    field.setAsBackgroundMesh(growing)
    gmsh.option.setNumber("Mesh.MeshSizeMax", coarse)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
    return int(distance)
