"""Files of other programs are read in a process of their own.

A damaged one can end the process that reads it: gmsh and OpenCASCADE follow what a file says. The
process ends with whoever started it, and leaves Ctrl-C to it.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from fe_models.interpreter import fresh_python
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.grouped import GroupedMesh

COMMAND = "from fe_models.readers.reader_process import main; main()"
# Exit code of a process that got signal 9, as the system sends it where memory runs out.
KILLED = -9
# Processor time of reading a shape [s], and of each megabyte of it: ten times what it takes.
LONGEST_READ, LONGEST_READ_OF_A_MB = 20.0, 50.0
# Letters of what a library says of a file that it cannot read.
LONGEST = 160


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn whatever reading a file raises into a :class:`MeshError` of one line with its name.

    Damage ends in a dozen ways: numbers that are none, arrays that do not fit, names in no code.
    """
    try:
        yield
    except MeshError:
        raise
    except MemoryError as error:
        raise MeshError(f"{path}: needs more memory than there is: damaged?") from error
    except UnicodeDecodeError as error:
        raise MeshError(
            f"{path}: has names that are not in UTF-8: damaged? otherwise save it as UTF-8, or "
            "export it again with names of plain letters"
        ) from error
    except Exception as error:
        said = " ".join(str(error).split())[:LONGEST]
        why = f"{type(error).__name__}{f': {said}' * bool(said)}"
        raise MeshError(f"{path}: cannot be read ({why}): damaged? export it again") from error


def read_apart(read: Callable[..., GroupedMesh], path: Path, *arguments: Any) -> GroupedMesh:
    """Return what ``read`` makes of a file and of the ``arguments`` behind it, in another process.

    Raises :class:`MeshError` where it raises anything, or the process dies of the file.
    """
    # Its stdin stays open as long as this process lives; what it says besides is no answer.
    with subprocess.Popen(
        fresh_python(COMMAND),
        bufsize=0,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            with suppress(BrokenPipeError):
                pickle.dump((read, path, arguments), process.stdin)
            answer = process.stdout.read()
            process.wait()
        except BaseException:
            process.kill()
            raise
    if process.returncode or not answer:
        raise MeshError(f"{path}: {_ending(process.returncode)}")
    mesh = pickle.loads(answer)
    if isinstance(mesh, MeshError):
        raise mesh
    assert isinstance(mesh, GroupedMesh)
    return mesh


@contextmanager
def cpu_limited(path: Path) -> Iterator[None]:
    """End the process where a file takes far more of its processor time than files of its size do.

    Damage may send a library round in circles. Only POSIX systems have such a limit.
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
    """What became of a process that has given no answer."""
    if code == KILLED:
        return "the process that read it was killed: for its memory?"
    how = signal.strsignal(-code) if code < 0 else f"exit code {code}"
    return f"gmsh broke down as it read it ({how}): damaged? repair it, or export it again"


def main() -> None:
    """Read the file that stdin names, and write what was read, or raised, to stdout."""
    # Whatever a library prints is no part of the answer.
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    read, path, arguments = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    mesh: GroupedMesh | MeshError
    try:
        with reading(path):
            mesh = read(path, *arguments)
    except MeshError as error:
        mesh = error
    with answer:
        pickle.dump(mesh, answer, protocol=pickle.HIGHEST_PROTOCOL)


def _end_with_parent() -> None:
    """End when the other end of stdin closes: nothing more is written to it."""
    os.read(0, 1)
    os._exit(1)
