"""Files that are never half written.

A file is written beside its place and renamed: whoever is killed in the middle leaves the old one.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py

# Ending of files that are being written.
PARTIAL = ".part"


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
) -> None:
    """Write named arrays (names may hold slashes) and attributes of the root."""
    with replacing(path) as partial, h5py.File(partial, "w") as file:
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
