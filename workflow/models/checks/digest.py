"""Digest of the content of a model: equal models have equal digests, in any process."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def content_digest(value: object) -> str:
    """Return a digest of the entries of dataclasses, of arrays, and of all that they hold.

    Functions count by their names.
    """
    digest = hashlib.sha256()
    for part in _content(value):
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.hexdigest()


def _content(value: Any) -> Iterator[bytes]:
    """Yield the content of a value as bytes."""
    if isinstance(value, np.ndarray):
        yield f"{value.dtype.str} {value.shape}".encode()
        yield value.tobytes()
    elif is_dataclass(value) and not isinstance(value, type):
        yield type(value).__qualname__.encode()
        for field in fields(value):
            yield field.name.encode()
            yield from _content(getattr(value, field.name))
    elif isinstance(value, Mapping):
        yield from _content(list(value.items()))
    elif isinstance(value, list | tuple):
        yield f"{len(value)} entries".encode()
        for entry in value:
            yield from _content(entry)
    elif callable(value) and hasattr(value, "__qualname__"):
        yield f"{value.__module__}.{value.__qualname__}".encode()
    else:
        yield from _other_content(value)


def _other_content(value: Any) -> Iterator[bytes]:
    """Yield the content of an object that is no dataclass; its attributes if it has no pickle."""
    try:
        yield pickle.dumps(value)
    except (pickle.PicklingError, AttributeError, TypeError):
        yield type(value).__qualname__.encode()
        if hasattr(value, "__dict__"):
            yield from _content(vars(value))
