"""One process at a time in a folder: a lock that says who holds it.

The system gives a lock back when its process ends, however that ends; so what a process that was
killed leaves is told from one that works, and nobody goes by a number that another process may have
by now. Where the holder was on another machine, the file system may not have carried the lock over:
only whoever knows that machine can say that the process has gone.
"""

from __future__ import annotations

import json
import os
import socket
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from workflow.errors import UserError
from workflow.shell.store import check_regular

if sys.platform != "win32":
    import fcntl

LOCK = ".fretscale.lock"
# Seconds between two looks at a lock that another process has.
LOOK = 0.2
# How often another process may remove a folder just as this one makes it. Some file systems, as
# /proc, say each time that what is to be made is not there.
MOST_REMOVED = 1000
# A link is not followed: what it leads to is not ours.
FLAGS = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)


@contextmanager
def locked(root: Path, patience: float = 0.0, take_over: bool = False) -> Iterator[str]:
    """Hold a folder, made if there is none; yields what to tell of a process that left its lock.

    Waits so many seconds for a process that works there. Whoever is to ``take_over`` knows that
    processes of other machines have gone. Raises UserError where the folder stays in use.
    """
    fresh = not _is_folder(root)
    path = root / LOCK
    file, alone = _opened(path, patience)
    try:
        left = _read(file)
        holder = _holder(left)
        if left and not take_over and not (alone and left.get("host") == socket.gethostname()):
            raise UserError(
                f"{root}: in use by {holder}, as far as can be seen from here; wait for its end, "
                f"or remove {path} if it has gone"
            )
        try:
            _write(file, path)
            yield f"{holder} has gone and left its lock on {root}, which is taken" if left else ""
        finally:
            path.unlink(missing_ok=True)
    finally:
        os.close(file)
        if fresh:
            with suppress(OSError):  # not empty: something was written
                root.rmdir()


def _is_folder(root: Path) -> bool:
    """False where nothing is; raises UserError for what is no folder."""
    # Looked at once: another process may remove it meanwhile.
    try:
        mode = root.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return False
    if not stat.S_ISDIR(mode):
        raise UserError(f"{root}: is a file; give a folder to --out")
    return True


def _opened(path: Path, patience: float) -> tuple[int, bool]:
    """The lock file, open, and whether the system says that no other process has it."""
    end, removed = time.monotonic() + patience, 0
    while True:
        # Its last holder may remove the folder, left empty, between any two of these steps.
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            check_regular(path)
            file = os.open(path, FLAGS, 0o666)
        except (FileNotFoundError, FileExistsError) as error:
            to_nowhere = not _is_folder(path.parent) and path.parent.is_symlink()
            removed += 1
            if to_nowhere or removed > MOST_REMOVED:
                raise OSError(error.errno, error.strerror, str(path.parent)) from error
            continue
        try:
            if sys.platform != "win32":
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _holder(_read(file))
            os.close(file)
            if time.monotonic() >= end:
                raise UserError(
                    f"{path.parent}: in use by {holder}; wait for its end, or give another folder"
                ) from None
            time.sleep(LOOK)
            continue
        except OSError:  # a file system without locks
            return file, False
        # Its last holder may have removed it meanwhile: then another one may be there by now.
        with suppress(OSError):
            if sys.platform == "win32" or os.path.samestat(os.fstat(file), path.stat()):
                return file, sys.platform != "win32"
        os.close(file)


def _read(file: int) -> dict[str, object]:
    """What the holder wrote; nothing where it has not come to that."""
    try:
        os.lseek(file, 0, os.SEEK_SET)
        told = json.loads(os.read(file, 4096))
    except ValueError:
        return {}
    return told if isinstance(told, dict) else {}


def _holder(told: dict[str, object]) -> str:
    if not told:
        return "another process"
    return f"process {told.get('process')} on {told.get('host')} since {told.get('since')}"


def _write(file: int, path: Path) -> None:
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    told = {"process": os.getpid(), "host": socket.gethostname(), "since": since}
    try:
        os.ftruncate(file, 0)
        os.lseek(file, 0, os.SEEK_SET)
        os.write(file, json.dumps(told).encode())
    except OSError as error:
        error.filename = str(path)
        raise
