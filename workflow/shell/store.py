"""Files that are never half written, and that are known to be what was written.

A file is written beside its place, brought to the disk and renamed: whoever is killed in the
middle, by a power failure even, leaves the old one. A file of arrays begins with the digest of its
name and of all that follows.
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
from typing import Any, BinaryIO

import h5py

from workflow.errors import UNWRITTEN, UserError

# In the names of files that are being written: before their ending, which some writers go by.
PARTIAL = ".part"
PARTIAL_NAME = re.compile(rf"\..+\.\d+{re.escape(PARTIAL)}(\.\w+)?")

# Bytes at the beginning of a file that HDF5 leaves to others: the digest is there.
SEAL = 512


class DamagedFile(UserError):
    """A file that is not, bit for bit, what was written under its name."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to; it takes the place of ``path`` once the writing has ended well.

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
    """Write a text."""
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a dictionary of numbers and texts."""
    write_text(path, json.dumps(content, indent=2) + "\n")


class _Outlet(io.RawIOBase):
    """A file that takes every byte, whatever becomes of the disk: ``error`` says what did.

    HDF5 ends the whole process where it cannot write. From where the disk is full the file goes on
    in memory.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.error: OSError | None = None

    def write(self, data: Any) -> int:
        place, left = self._file.tell(), memoryview(data).cast("B")
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError as error:
            self.error = error
            self._file.seek(0)
            self._file = io.BytesIO(self._file.read())
            self._file.seek(place)
            self._file.write(data)
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        try:
            return self._file.truncate(size)
        except OSError as error:
            self.error = error
            return self._file.tell() if size is None else size

    def readinto(self, buffer: Any) -> int:
        data = self._file.read(len(buffer))
        buffer[: len(data)] = data
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def readable(self) -> bool:
        return True


@contextmanager
def replacing_hdf5(path: Path) -> Iterator[io.RawIOBase]:
    """The same for HDF5: a file to open with h5py, which may end well where the disk is full.

    Raises OSError then.
    """
    with replacing(path) as partial, partial.open("wb+", buffering=0) as file:
        outlet = _Outlet(file)
        yield outlet
        if outlet.error is not None:
            raise outlet.error


def write_arrays(
    path: Path, arrays: Mapping[str, Any], attributes: Mapping[str, Any] | None = None
) -> str:
    """Write named arrays (names may hold slashes) and attributes of the root; the digest of it."""
    with replacing_hdf5(path) as stream:
        with h5py.File(stream, "w", userblock_size=SEAL) as file:
            for name, values in arrays.items():
                file.create_dataset(name, data=values)
            file.attrs.update(attributes or {})
        digest = _digest(stream, path.name)
        stream.seek(0)
        stream.write(digest.encode("ascii"))
    return digest


def read_arrays(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """All arrays of a file by their full name, and the attributes of its root.

    Raises :class:`DamagedFile` before HDF5 has seen a file that is not what was written.
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
    """Raise :class:`DamagedFile` where a pipe, say, is in the place of a file of ours.

    It would be waited for; a device may have no end.
    """
    # Looked at once: another process may remove its lock meanwhile.
    with suppress(OSError):
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
            raise DamagedFile(f"{path}: not a file: a pipe or a device")


def opened(path: Path) -> io.BufferedReader:
    """A file of ours, open to be read. Raises OSError; :class:`DamagedFile` for what is none."""
    check_regular(path)
    return path.open("rb")


def read_bytes(path: Path) -> bytes:
    """All of a file of ours. Raises OSError; :class:`DamagedFile` for what is none."""
    with opened(path) as file:
        return file.read()


def checked_digest(path: Path) -> str:
    """The digest of a file of arrays. Raises :class:`DamagedFile` if it is not what was written."""
    with opened(path) as raw:
        kept = raw.read(SEAL).rstrip(b"\0").decode("ascii", "replace")
        if _digest(raw, path.name) != kept:
            raise DamagedFile(f"{path}: damaged: not what was written there")
    return kept


def file_digest(path: Path) -> str:
    """SHA-256 of any file; empty for one that cannot be read.

    Raises :class:`DamagedFile` for what is no file.
    """
    try:
        with opened(path) as raw:
            return hashlib.file_digest(raw, "sha256").hexdigest()
    except OSError:
        return ""


def json_digest(content: Any) -> str:
    """SHA-256 of what JSON can say, whatever the order of its keys."""
    as_read = json.loads(json.dumps(content))
    return hashlib.sha256(json.dumps(as_read, sort_keys=True).encode("utf-8")).hexdigest()


def _digest(raw: io.BufferedReader | io.RawIOBase, name: str) -> str:
    """SHA-256 of a file's name and of all that follows the place of its digest."""
    raw.seek(SEAL)
    return hashlib.file_digest(raw, lambda: hashlib.sha256(name.encode("utf-8"))).hexdigest()
