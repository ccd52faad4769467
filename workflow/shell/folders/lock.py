"""Lock that allows one process at a time in a folder and names its holder.

The system releases the lock when its process ends, in whatever way. So the lock file of a killed
process can be distinguished from that of a running one without the process number, which another
process may have by then. If the holder ran on another machine, the file system may not have
transferred the lock: then only the user can know whether the process has ended.
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
from workflow.shell.folders.store import check_regular

if sys.platform != "win32":
    import fcntl

LOCK = ".fretscale.lock"
# Seconds between two checks of a lock that another process holds.
LOOK = 0.2
# How often another process may remove a folder just as this one makes it. Some file systems, such
# as /proc, report every time that the folder to be made does not exist.
MOST_REMOVED = 1000
# A link is not followed: its target does not belong to us.
FLAGS = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)


@contextmanager
def locked(root: Path, patience: float = 0.0, take_over: bool = False) -> Iterator[str]:
    """Hold a folder, made if necessary; yield a message about a process that left its lock, or "".

    Waits up to ``patience`` seconds for a process that works there. With ``take_over``, the caller
    states that processes of other machines have ended. Raises UserError if the folder stays in use.
    """
    fresh = not _is_folder(root)
    path = root / LOCK
    file, alone = _opened(path, patience)
    try:
        left = _read(file)
        holder = _holder(left)
        if left and not take_over and not (alone and left.get("host") == socket.gethostname()):
            raise UserError(
                f"{root}: apparently in use by {holder}; wait for its end, or remove {path} if it "
                "is gone"
            )
        try:
            _write(file, path)
            yield f"{holder} is gone and left its lock on {root}, which is removed" if left else ""
        finally:
            path.unlink(missing_ok=True)
    finally:
        os.close(file)
        if fresh:
            with suppress(OSError):  # not empty: something was written
                root.rmdir()


def _is_folder(root: Path) -> bool:
    """Return whether the folder exists. Raises UserError if it is a file."""
    # A single system call, because another process may remove the folder between two of them.
    try:
        mode = root.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return False
    if not stat.S_ISDIR(mode):
        raise UserError(f"{root}: is a file; give a folder to --out")
    return True


def _opened(path: Path, patience: float) -> tuple[int, bool]:
    """Return the open lock file, and whether the system confirms that no other process holds it."""
    end, removed = time.monotonic() + patience, 0
    while True:
        # The last holder may remove the empty folder between any two of these steps.
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
        # The last holder may have removed the file meanwhile, and another one may exist by now.
        with suppress(OSError):
            if sys.platform == "win32" or os.path.samestat(os.fstat(file), path.stat()):
                return file, sys.platform != "win32"
        os.close(file)


def _read(file: int) -> dict[str, object]:
    """Return what the holder wrote; empty if it has not written anything yet."""
    try:
        os.lseek(file, 0, os.SEEK_SET)
        content = json.loads(os.read(file, 4096))
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _holder(content: dict[str, object]) -> str:
    if not content:
        return "another process"
    return f"process {content.get('process')} on {content.get('host')} since {content.get('since')}"


def _write(file: int, path: Path) -> None:
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    content = {"process": os.getpid(), "host": socket.gethostname(), "since": since}
    try:
        os.ftruncate(file, 0)
        os.lseek(file, 0, os.SEEK_SET)
        os.write(file, json.dumps(content).encode())
    except OSError as error:
        error.filename = str(path)
        raise
