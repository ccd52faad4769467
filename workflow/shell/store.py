"""Files that are never half written.

A file is written beside its place, brought to the disk and renamed: whoever is killed in the
middle, by a power failure even, leaves the old one.
"""

from __future__ import annotations

import io
import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import h5py

from workflow.errors import UNWRITTEN

# In the names of files that are being written: before their ending, which some writers go by.
PARTIAL = ".part"
PARTIAL_NAME = re.compile(rf"\..+\.\d+{re.escape(PARTIAL)}(\.\w+)?")


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
) -> None:
    """Write named arrays (names may hold slashes) and attributes of the root."""
    with replacing_hdf5(path) as stream, h5py.File(stream, "w") as file:
        for name, values in arrays.items():
            file.create_dataset(name, data=values)
        file.attrs.update(attributes or {})


def read_arrays(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """All arrays of a file by their full name, and the attributes of its root."""
    arrays: dict[str, Any] = {}

    def collect(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            arrays[name] = item[()]

    with h5py.File(path, "r") as file:
        file.visititems(collect)
        return arrays, dict(file.attrs)
