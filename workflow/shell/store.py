"""Files that are never half written, and that are known to be what was written.

A file is written beside its place and renamed: whoever is killed in the middle leaves the old one.
A file of arrays begins with the digest of its name and of all that follows.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BufferedRandom, BufferedReader
from pathlib import Path
from typing import Any

import h5py

from workflow.errors import UserError

# Ending of files that are being written.
PARTIAL = ".part"
# Bytes at the beginning of a file that HDF5 leaves to others: the digest is there.
SEAL = 512


class DamagedFile(UserError):
    """A file that is not, bit for bit, what was written under its name."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to; it takes the place of ``path`` once the writing has ended well."""
    partial = path.with_name(f".{path.name}.{os.getpid()}{PARTIAL}")
    try:
        yield partial
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text."""
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a dictionary of numbers and texts."""
    write_text(path, json.dumps(content, indent=2) + "\n")


def write_arrays(
    path: Path, arrays: Mapping[str, Any], attributes: Mapping[str, Any] | None = None
) -> str:
    """Write named arrays (names may hold slashes) and attributes of the root; the digest of it."""
    with replacing(path) as partial:
        with h5py.File(partial, "w", userblock_size=SEAL) as file:
            for name, values in arrays.items():
                file.create_dataset(name, data=values)
            file.attrs.update(attributes or {})
        with partial.open("r+b") as raw:
            digest = _digest(raw, path.name)
            raw.seek(0)
            raw.write(digest.encode("ascii"))
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


def checked_digest(path: Path) -> str:
    """The digest of a file of arrays. Raises :class:`DamagedFile` if it is not what was written."""
    with path.open("rb") as raw:
        kept = raw.read(SEAL).rstrip(b"\0").decode("ascii", "replace")
        if _digest(raw, path.name) != kept:
            raise DamagedFile(f"{path}: damaged: not what was written there")
    return kept


def file_digest(path: Path) -> str:
    """SHA-256 of any file; empty for one that cannot be read."""
    try:
        with path.open("rb") as raw:
            return hashlib.file_digest(raw, "sha256").hexdigest()
    except OSError:
        return ""


def json_digest(content: Any) -> str:
    """SHA-256 of what JSON can say, whatever the order of its keys."""
    as_read = json.loads(json.dumps(content))
    return hashlib.sha256(json.dumps(as_read, sort_keys=True).encode("utf-8")).hexdigest()


def _digest(raw: BufferedReader | BufferedRandom, name: str) -> str:
    """SHA-256 of a file's name and of all that follows the place of its digest."""
    raw.seek(SEAL)
    return hashlib.file_digest(raw, lambda: hashlib.sha256(name.encode("utf-8"))).hexdigest()
