"""Serialisation of the results of the steps of a run to bytes.

Numbers, arrays and the dataclasses of our packages can be packed, and nothing else. Arrays keep
their memory order, since the rounding of sums and products may depend on it. Nothing that a file
names is called, except that the dataclasses of our packages are created from their entries.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev

# Packages whose dataclasses and named tuples may be packed.
PACKAGES = ("sa_solver", "wear", "fe_models", "workflow")
# Types stored as they are; every other value becomes a tuple that begins with its kind.
SIMPLE = frozenset((float, int, str, bool, bytes, type(None)))
TUPLE, LIST, DICT, ARRAY, SCALAR, OBJECT, NAMED, POLYNOMIAL = range(8)
# Exceptions that bytes packed by another version may cause.
WRONG = (ValueError, TypeError, LookupError, AttributeError, ImportError, pickle.UnpicklingError)


class PackingError(ValueError):
    """Error for bytes that this version did not pack."""


def packed(value: Any) -> tuple[bytes, bool]:
    """Return the bytes of a value, and whether reading them restores the same memory layout.

    Raises TypeError for a value that cannot be packed.
    """
    strided: list[Any] = []
    data = pickle.dumps(_plain(value, strided), protocol=pickle.HIGHEST_PROTOCOL)
    return data, not strided


def unpacked(data: bytes) -> Any:
    """Return the value that was packed. Raises PackingError."""
    try:
        return _restored(_Plain(io.BytesIO(data)).load())
    except WRONG as error:
        raise PackingError(str(error)) from error


class _Plain(pickle.Unpickler):
    """Unpickler that accepts only built-in types."""

    def find_class(self, module: str, name: str) -> Any:
        raise pickle.UnpicklingError(f"{module}.{name} is not read")


@cache
def _entries_of(kind: Any) -> tuple[str, ...] | None:
    """Return the names of the entries of a dataclass, or None for other types."""
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else None


@cache
def _described(kind: Any) -> str:
    """Return where a dataclass or named tuple is defined, and its entries."""
    if kind.__module__.partition(".")[0] not in PACKAGES:
        raise TypeError(f"{kind.__module__}.{kind.__qualname__} cannot be packed")
    names = _entries_of(kind) or kind._fields
    return f"{kind.__module__}:{kind.__qualname__}:{','.join(names)}"


@cache
def _kind(described: str) -> Any:
    """Return the dataclass or named tuple with this description. Raises ValueError."""
    module, name, _ = described.split(":")
    kind = getattr(import_module(module), name) if module.partition(".")[0] in PACKAGES else None
    ours = isinstance(kind, type) and (is_dataclass(kind) or hasattr(kind, "_fields"))
    if not ours or _described(kind) != described:
        raise ValueError(f"{described} is not read")
    return kind


def _plain(value: Any, strided: list[Any]) -> Any:
    """Return a value as built-in types; arrays with other strides are appended to ``strided``."""
    kind: Any = type(value)
    if kind in SIMPLE:
        return value
    if kind is np.ndarray:
        return _plain_array(value, strided)
    names = _entries_of(kind)
    if names is not None:
        entries = value.__dict__
        return OBJECT, _described(kind), [_plain(entries[name], strided) for name in names]
    return _plain_others(kind, value, strided)


def _plain_array(array: Any, strided: list[Any]) -> Any:
    if array.dtype.hasobject:
        raise TypeError("an array of objects cannot be packed")
    flags = array.flags
    if not flags.forc:
        strided.append(array)
    order = "F" if flags.fnc else "C"
    return ARRAY, array.dtype.str, array.shape, order, array.tobytes(order)


def _plain_others(kind: Any, value: Any, strided: list[Any]) -> Any:
    if kind is dict:
        return DICT, [(_plain(k, strided), _plain(v, strided)) for k, v in value.items()]
    if kind in (tuple, list):
        return TUPLE if kind is tuple else LIST, [_plain(part, strided) for part in value]
    if isinstance(value, tuple):
        return NAMED, _described(kind), [_plain(part, strided) for part in value]
    if isinstance(value, np.generic):
        return SCALAR, value.dtype.str, value.tobytes()
    if kind is Chebyshev:
        return POLYNOMIAL, [_plain(part, strided) for part in (value.coef, value.domain)]
    raise TypeError(f"{kind.__module__}.{kind.__qualname__} cannot be packed")


def _restored(plain: Any) -> Any:
    """Return the value that :func:`_plain` converted."""
    return plain if type(plain) in SIMPLE else RESTORED[plain[0]](*plain[1:])


def _all(parts: list[Any]) -> list[Any]:
    return [_restored(part) for part in parts]


def _object(described: str, entries: list[Any]) -> Any:
    kind = _kind(described)
    restored = object.__new__(kind)
    restored.__dict__.update(zip(_entries_of(kind) or (), _all(entries), strict=True))
    return restored


RESTORED: dict[int, Callable[..., Any]] = {
    TUPLE: lambda parts: tuple(_all(parts)),
    LIST: _all,
    DICT: lambda pairs: {_restored(key): _restored(value) for key, value in pairs},
    ARRAY: lambda dtype, shape, order, data: np.ndarray(shape, dtype, data, order=order).copy(
        order=order
    ),
    SCALAR: lambda dtype, data: np.frombuffer(data, dtype)[0],
    OBJECT: _object,
    NAMED: lambda described, parts: _kind(described)(*_all(parts)),
    POLYNOMIAL: lambda parts: Chebyshev(*_all(parts)),
}
