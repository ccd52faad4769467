"""Reading of files in a separate process.

A damaged file can crash the process that reads it, because gmsh and OpenCASCADE trust its content.
"""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fe_models.interpreter import Process, do_each
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.grouped import GroupedMesh

# Exit code after signal 9, which the system sends if memory runs out.
KILLED = -9
# Limit of the processor time for reading a shape [s], and per megabyte: ten times the usual time.
LONGEST_READ, LONGEST_READ_OF_A_MB = 20.0, 50.0
# Number of characters shown of a library's error message.
LONGEST = 160


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn any error in reading a file into a :class:`MeshError` of one line with its name.

    Damaged files raise many kinds of errors, such as for invalid numbers, arrays that do not fit,
    or names in an unknown encoding.
    """
    try:
        yield
    except MeshError:
        raise
    except MemoryError as error:
        raise MeshError(f"{path}: needs more memory than is available: is it damaged?") from error
    except UnicodeDecodeError as error:
        raise MeshError(
            f"{path}: has names that are not in UTF-8: is it damaged? Otherwise save it as UTF-8, "
            "or export it again with names of plain letters"
        ) from error
    except Exception as error:
        message = " ".join(str(error).split())[:LONGEST]
        why = f"{type(error).__name__}{f': {message}' * bool(message)}"
        raise MeshError(
            f"{path}: cannot be read ({why}): it may be damaged; export it again"
        ) from error


def read_in_subprocess(
    read: Callable[..., GroupedMesh], path: Path, *arguments: Any
) -> GroupedMesh:
    """Return the mesh that ``read`` returns for a file and further ``arguments``, in a new process.

    Raises :class:`MeshError` if it raises anything, or if the file crashes the process.
    """
    # What libraries print is discarded.
    process = Process(stderr=subprocess.DEVNULL)
    try:
        process.tell(do_each, ())
        mesh = process.ask(_read, read, path, *arguments)
    except (EOFError, OSError) as error:
        raise MeshError(f"{path}: {_ending(process.exit_code())}") from error
    finally:
        process.end()
    if isinstance(mesh, Exception):
        raise mesh
    assert isinstance(mesh, GroupedMesh)
    return mesh


def _read(read: Callable[..., GroupedMesh], path: Path, *arguments: Any) -> GroupedMesh:
    """Read a file in the separate process."""
    with reading(path):
        return read(path, *arguments)


@contextmanager
def cpu_limited(path: Path) -> Iterator[None]:
    """End the process if a file takes far more processor time than its size warrants.

    A damaged file may send a library into an endless loop. Only POSIX systems have such a limit.
    """
    try:
        import resource
    except ImportError:
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
    limit = int(
        time.process_time() + LONGEST_READ + LONGEST_READ_OF_A_MB * path.stat().st_size / 1e6
    )
    if soft == resource.RLIM_INFINITY or limit < soft:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_CPU, (soft, hard))


def _ending(code: int) -> str:
    """Return why a process has ended without an answer."""
    if code == KILLED:
        return "the process that read it was killed, perhaps because memory ran out"
    how = signal.strsignal(-code) if code < 0 else f"exit code {code}"
    return f"gmsh crashed as it read it ({how}): it may be damaged; repair it, or export it again"
