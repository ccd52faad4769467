"""Files that are never half written, and whose content is verified when they are read.

A new file is written next to the old one, flushed to disk and renamed, so the old file survives if
the process is killed in the middle, even by a power failure. A file of arrays begins with a digest
of its name and of all following bytes.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any
from uuid import uuid4

import h5py

from workflow.errors import UNWRITTEN, RunChanged

# Part of the names of files that are being written; it precedes their ending, which some writers
# depend on.
PARTIAL = ".part"
PARTIAL_NAME = re.compile(rf"\..+\.\d+{re.escape(PARTIAL)}(\.\w+)?")

# Size of the user block at the beginning of an HDF5 file, which holds the digest [bytes].
SEAL = 512


class DamagedFile(RunChanged):
    """Error for a file whose content differs from what was written under its name."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a path to write to; the file replaces ``path`` once it is written without error.

    An error of the disk names ``path``.
    """
    partial = path.with_name(f".{path.name}.{os.getpid()}{PARTIAL}{path.suffix}")
    try:
        yield partial
        with partial.open("rb+") as file:
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError as error:
        if error.errno in UNWRITTEN and error.filename in (None, str(partial)):
            error.filename = str(path)
        raise
    finally:
        partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file."""
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a dictionary of numbers and texts as JSON."""
    write_text(path, json.dumps(content, indent=2) + "\n")


@contextmanager
def replacing_hdf5(path: Path) -> Iterator[h5py.File]:
    """Yield an HDF5 file in memory that replaces ``path`` once it is complete.

    HDF5 never writes to the disk itself: it aborts the whole process if the disk is full, and
    loses an interruption (Ctrl-C) that arrives while it writes to a Python file object.
    """
    with _hdf5_in_memory() as file:
        yield file
        image = _image(file)
    with replacing(path) as partial:
        partial.write_bytes(image)


def _hdf5_in_memory() -> h5py.File:
    # HDF5 takes two files in memory of one name for the same file, also in separate threads.
    return h5py.File(uuid4().hex, "w", driver="core", backing_store=False)


def _image(file: h5py.File) -> bytes:
    """Return the bytes of an HDF5 file."""
    file.flush()
    return file.id.get_file_image()


def write_arrays(
    path: Path, arrays: Mapping[str, Any], attributes: Mapping[str, Any] | None = None
) -> str:
    """Write named arrays (slashes allowed) and attributes of the root; return the digest."""
    with _hdf5_in_memory() as file:
        for name, values in arrays.items():
            file.create_dataset(name, data=values)
        file.attrs.update(attributes or {})
        image = _image(file)
    digest = _digest(io.BytesIO(image), path.name)
    with replacing(path) as partial, partial.open("wb") as raw:
        raw.write(digest.encode("ascii").ljust(SEAL, b"\0"))
        raw.write(image)
    return digest


def read_arrays(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return all arrays of a file by their full names, and the attributes of its root.

    Raises :class:`DamagedFile`, before HDF5 opens the file, if its content has changed.
    """
    checked_digest(path)
    arrays: dict[str, Any] = {}

    def collect(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            arrays[name] = item[()]

    with h5py.File(path, "r") as file:
        file.visititems(collect)
        return arrays, dict(file.attrs)


def check_regular(path: Path) -> None:
    """Raise :class:`DamagedFile` if a pipe or a device is in the place of one of our files.

    Reading a pipe would block; a device may have no end.
    """
    # A single system call, because another process may remove its lock between two of them.
    with suppress(OSError):
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
            raise DamagedFile(f"{path}: not a file: a pipe or a device")


def opened(path: Path) -> io.BufferedReader:
    """Open one of our files to read it.

    Raises OSError, or :class:`DamagedFile` if it is not a regular file.
    """
    check_regular(path)
    return path.open("rb")


def read_bytes(path: Path) -> bytes:
    """Return the bytes of one of our files.

    Raises OSError, or :class:`DamagedFile` if it is not a regular file.
    """
    with opened(path) as file:
        return file.read()


def checked_digest(path: Path) -> str:
    """Return the digest of a file of arrays. Raises :class:`DamagedFile` if it does not match."""
    with opened(path) as raw:
        kept = raw.read(SEAL).rstrip(b"\0").decode("ascii", "replace")
        raw.seek(SEAL)
        if _digest(raw, path.name) != kept:
            raise DamagedFile(f"{path}: damaged: it differs from what was written")
    return kept


def file_digest(path: Path) -> str:
    """Return the SHA-256 of any file, or an empty text if it cannot be read.

    Raises :class:`DamagedFile` for a pipe or a device.
    """
    try:
        with opened(path) as raw:
            return hashlib.file_digest(raw, "sha256").hexdigest()
    except OSError:
        return ""


def json_digest(content: Any) -> str:
    """Return the SHA-256 of a JSON value, independent of the order of its keys."""
    as_read = json.loads(json.dumps(content))
    return hashlib.sha256(json.dumps(as_read, sort_keys=True).encode("utf-8")).hexdigest()


def _digest(rest: io.BufferedIOBase, name: str) -> str:
    """Return the SHA-256 of a file's name and of all remaining bytes of its content."""
    return hashlib.file_digest(rest, lambda: hashlib.sha256(name.encode("utf-8"))).hexdigest()
