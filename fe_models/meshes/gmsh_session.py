"""Sessions of gmsh that are always closed, and mesh sizes that grow away from faces."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

# Signals whose handlers gmsh's libraries reset to the system's default, which ends the process: on
# a pipe without a reader, a terminal closed despite `nohup`, or a batch system's stop request.
RESET_BY_GMSH = ("SIGPIPE", "SIGHUP", "SIGQUIT", "SIGTERM")


@contextmanager
def gmsh_model(name: str) -> Iterator[Any]:
    """Open a silent gmsh model of that name and yield the gmsh module."""
    import gmsh

    # Signals stay with Python, so that Ctrl-C during meshing ends the run tidily.
    gmsh.initialize(interruptible=False)
    _restore_signals()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        # With one thread the mesh is the same, node for node, on every machine.
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.add(name)
        yield gmsh
    finally:
        gmsh.finalize()


def _restore_signals() -> None:
    """Restore Python's signal handlers; only its main thread may set them."""
    if threading.current_thread() is not threading.main_thread():
        return
    for name in RESET_BY_GMSH:
        number = getattr(signal, name, None)
        if number is not None and (handler := signal.getsignal(number)) is not None:
            signal.signal(number, handler)


def grow_from(
    gmsh: Any,
    kind: Literal["CurvesList", "SurfacesList"],
    sources: Sequence[tuple[list[int], float, float]],
    coarse: float,
) -> list[int]:
    """Set the mesh size to the smallest one that the sources require, at most ``coarse``.

    Each source is a list of entities, the size on them, and the growth of the size per distance
    from them. The numbers of the distance fields are returned, for further settings of them.
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
