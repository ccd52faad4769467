"""A gmsh model that is always closed again, and sizes that grow away from its faces."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

# Signals that gmsh's libraries give back to the system, which ends the process at each: a pipe that
# nobody reads any more, a terminal that is closed in spite of `nohup`, a batch system.
GIVEN_BACK = ("SIGPIPE", "SIGHUP", "SIGQUIT", "SIGTERM")


@contextmanager
def gmsh_model(name: str) -> Iterator[Any]:
    """Open a silent gmsh model of that name and yield the gmsh module."""
    import gmsh

    # Signals stay with Python, so that Ctrl-C during meshing ends the run tidily.
    gmsh.initialize(interruptible=False)
    _take_signals()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        # One thread: the same mesh, node for node, on every machine.
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.add(name)
        yield gmsh
    finally:
        gmsh.finalize()


def _take_signals() -> None:
    """Handle signals as before, as far as Python knows how; only its main thread may say so."""
    if threading.current_thread() is not threading.main_thread():
        return
    for name in GIVEN_BACK:
        number = getattr(signal, name, None)
        if number is not None and (handler := signal.getsignal(number)) is not None:
            signal.signal(number, handler)


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
