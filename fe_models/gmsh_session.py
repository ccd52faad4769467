"""A gmsh model that is always closed again, and sizes that grow away from its faces."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Sequence
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
    sources: Sequence[tuple[list[int], float, float]],
    coarse: float,
) -> list[int]:
    """Mesh size: the least of what the sources ask for, up to ``coarse``.

    Each source is entities, the size on them, and the share of the distance from them by which it
    grows. Returns the numbers of the distance fields, for further settings of them.
    """
    field = gmsh.model.mesh.field
    distances, growing = [], []
    for entities, fine, growth in sources:
        distances.append(field.add("Distance"))
        field.setNumbers(distances[-1], kind, entities)
        growing.append(field.add("MathEval"))
        field.setString(growing[-1], "F", f"{fine!r} + {growth!r} * F{distances[-1]}")
    least = field.add("Min")
    field.setNumbers(least, "FieldsList", growing)
    field.setAsBackgroundMesh(least)
    gmsh.option.setNumber("Mesh.MeshSizeMax", coarse)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
    return distances
