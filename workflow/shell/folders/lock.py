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
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from workflow.errors import FolderInUse, UserError
from workflow.shell.folders.store import check_regular

LOCK = ".fretscale.lock"
# Seconds between two checks of a lock that another process holds.
LOOK = 0.2
# How often another process may remove a folder just as this one makes it. Some file systems, such
# as /proc, report every time that the folder to be made does not exist.
MOST_REMOVED = 1000
# A link is not followed: its target does not belong to us.
FLAGS = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
# The name of the holder follows the first byte: Windows locks that byte, and lets nobody else read
# it.
NAME = 1


@contextmanager
def locked(root: Path, patience: float = 0.0, take_over: bool = False) -> Iterator[str]:
    """Hold a folder, made if necessary; yield a message about a process that left its lock, or "".

    Waits up to ``patience`` seconds for a process that works there. With ``take_over``, the caller
    states that processes of other machines have ended. Raises UserError if the folder stays in use.
    """
    fresh = not _is_folder(root)
    path = root / LOCK
    file, alone = _opened(path, patience)
    taken = False
    try:
        left = _read(file)
        holder = _holder(left)
        if left and not take_over and not (alone and left.get("host") == socket.gethostname()):
            raise FolderInUse(
                f"{root}: apparently in use by {holder}; wait for its end, or remove {path} if it "
                "is gone"
            )
        taken = True
        _write(file, path)
        yield f"{holder} is gone and left its lock on {root}, which is removed" if left else ""
    finally:
        _close(file, path if taken else None)
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
    from filelock import lock_descriptor

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
            alone = lock_descriptor(file, blocking=False)
        except OSError:  # a file system without locks
            return file, False
        if alone:
            # The last holder may have removed the file meanwhile, and another one may exist by now.
            with suppress(OSError):
                if os.path.samestat(os.fstat(file), path.stat()):
                    return file, True
            os.close(file)
            continue
        holder = _holder(_read(file))
        os.close(file)
        if time.monotonic() >= end:
            raise FolderInUse(
                f"{path.parent}: in use by {holder}; wait for its end, or give another folder"
            )
        time.sleep(LOOK)


def _close(file: int, path: Path | None) -> None:
    """Close the lock file, and remove it if its ``path`` is given."""
    kept = path
    try:
        # Removed while it is still locked: afterwards it may belong to another process.
        if path is not None:
            with suppress(PermissionError):
                path.unlink(missing_ok=True)
                kept = None
    finally:
        os.close(file)
    # Windows removes only a closed file, and none that another process has opened meanwhile.
    if kept is not None:
        with suppress(OSError):
            kept.unlink()


def _read(file: int) -> dict[str, object]:
    """Return what the holder wrote; empty if it has not written anything yet."""
    try:
        os.lseek(file, NAME, os.SEEK_SET)
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
        os.write(file, b" " * NAME + json.dumps(content).encode())
    except OSError as error:
        error.filename = str(path)
        raise
