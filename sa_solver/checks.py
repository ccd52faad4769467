"""Validation of the arrays, numbers and choices that are passed to public functions and classes.

Invalid values raise an :class:`~sa_solver.errors.InputError` that says what to give instead.
Without these checks numpy would ignore the mask of a masked array, read texts and truth values as
numbers, and fail far from the cause where a list or a single number is given in place of a field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from operator import index
from types import NoneType
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from sa_solver.errors import FretscaleError, InputError

REAL = "fiu"
"""Kinds of numpy data types that hold real numbers: floats, signed and unsigned integers."""

FLOATS = (float, np.float64)
"""Types of most numbers, which need no further look: a masked array of them takes far longer."""

Shape = Sequence[int | None]

LONGEST_SHOWN = 60
"""Length of a wrong value in a message, which must stay one readable line."""


def array(
    name: str,
    values: object,
    shape: Shape | None,
    *,
    error: type[FretscaleError] = InputError,
    masked: float | None = None,
    infinite: bool = False,
    finite: bool = True,
    order: Literal["C", "K"] = "C",
) -> NDArray[np.float64]:
    """Return ``values`` as an array of 64-bit floats of ``shape``, without a copy if possible.

    Parameters
    ----------
    name
        Name of the values in messages, in the plural.
    values
        An array or nested lists of real numbers.
    shape
        Required shape, with None for axes that may have any length; None alone allows any shape.
    error
        Class of the exception to raise.
    masked
        Value that replaces masked ones; None refuses masked values.
    infinite
        Whether +infinity is allowed.
    finite
        Whether the values are checked to be finite. False skips the check, where a later step
        makes it.
    order
        Memory layout: ``C`` for contiguous rows, ``K`` to keep the layout of large matrices.
    """
    plain = values if type(values) is np.ndarray else _without_mask(name, values, masked, error)
    if plain.dtype.kind not in REAL:
        raise error(f"{name} have the type {plain.dtype}: give real numbers")
    found: NDArray[np.float64] = np.asarray(plain, dtype=np.float64, order=order)
    if shape is not None and not _fits(shape, found.shape):
        raise error(f"{name} have shape {found.shape}: give {_shown(shape, found.shape)}")
    if finite and not _all_finite(found, infinite):
        bad = "NaN or -infinity" if infinite else "NaN or infinity"
        raise error(f"{name} hold {bad}: give finite numbers, or fill or crop what is missing")
    return found


def complex_array(
    name: str,
    values: object,
    shape: Shape | None,
    *,
    error: type[FretscaleError] = InputError,
) -> NDArray[Any]:
    """Return ``values``, real or complex, as an array of ``shape``; what :func:`array` refuses."""
    plain = _without_mask(name, values, None, error)
    if plain.dtype.kind != "c":
        return array(name, plain, shape, error=error, order="K")
    for part in (plain.real, plain.imag):
        array(name, part, shape, error=error)
    return np.asarray(plain, dtype=np.complex128)


def number(
    name: str,
    value: object,
    *,
    above: float = -np.inf,
    least: float = -np.inf,
    most: float = np.inf,
    infinite: bool = False,
    error: type[FretscaleError] = InputError,
) -> float:
    """Return ``value`` as a float, or raise ``error`` unless it is one number within the bounds.

    The bounds are ``above`` (exclusive), ``least`` and ``most`` (both inclusive). The number must
    be finite; ``infinite`` also allows +infinity. ``name`` is the name of the value in messages.
    """
    plain: Any = value
    if type(value) not in FLOATS:
        plain = np.ma.asanyarray(value)
        if plain.ndim or np.ma.getmaskarray(plain).any() or plain.dtype.kind not in REAL:
            raise error(f"{name} is {shown(value)}: give one real number")
    found = float(plain)
    inside = found > above and least <= found <= most
    if not (inside and (isfinite(found) or (infinite and found == np.inf))):
        bounds = [f"above {above:g}"] if above > -np.inf else []
        bounds += [f"of {least:g} or more"] if least > -np.inf else []
        bounds += [f"of {most:g} or less"] if most < np.inf else []
        kind = "number" if infinite else "finite number"
        raise error(f"{name} = {found:g}: give a {kind} {' and '.join(bounds)}".rstrip())
    return found


def numbers(holder: object, *names: str, **bounds: Any) -> None:
    """Check the fields ``names`` of ``holder``, an instance of a class, by :func:`number`.

    A field may be None where None is its default.
    """
    for name, value in _given(holder, names):
        number(field(holder, name), value, **bounds)


def whole(
    name: str,
    value: Any,
    error: type[FretscaleError] = InputError,
    *,
    least: float = -np.inf,
    most: float = np.inf,
) -> int:
    """Return ``value`` as an integer from ``least`` to ``most``, or raise ``error``.

    A truth value is no number.
    """
    try:
        found = None if isinstance(value, bool) else index(value)
    except TypeError:
        found = None
    if found is None:
        raise error(f"{name} is {shown(value)}: give a whole number")
    if not least <= found <= most:
        bounds = [f"{least:g} or more"] if least > -np.inf else []
        bounds += [f"at most {most:g}"] if most < np.inf else []
        raise error(f"{name} = {found}: give {' and '.join(bounds)}")
    return found


def wholes(holder: object, *names: str, **bounds: Any) -> None:
    """Check the fields ``names`` of ``holder`` by :func:`whole`; see :func:`numbers`."""
    for name, value in _given(holder, names):
        whole(field(holder, name), value, **bounds)


def instances(holder: object, **kinds: Any) -> None:
    """Raise InputError unless the named fields of ``holder`` are of these kinds.

    A kind is a class, several as a union such as ``str | None``, or :data:`Callable`.
    """
    for name, kind in kinds.items():
        if not isinstance(value := getattr(holder, name), kind):
            raise InputError(f"{field(holder, name)} is {shown(value)}: give {_called(kind)}")


def members(holder: object, **kinds: Any) -> None:
    """Raise InputError unless the named fields of ``holder`` hold values of these kinds only.

    The fields are lists or tuples, which become tuples, or mappings, which stay as they are.
    """
    for name, kind in kinds.items():
        values = getattr(holder, name)
        if not isinstance(values, list | tuple | Mapping):
            raise InputError(
                f"{field(holder, name)} is {shown(values)}: give several, each {_called(kind)}"
            )
        keys: Any = values if isinstance(values, Mapping) else range(len(values))
        for key in keys:
            if not isinstance(values[key], kind):
                raise InputError(
                    f"{field(holder, name)}[{key!r}] is {shown(values[key])}: give {_called(kind)}"
                )
        if not isinstance(values, Mapping):
            settle(holder, **{name: tuple(values)})


def places(
    name: str, values: object, count: int, error: type[FretscaleError] = InputError
) -> NDArray[np.int64]:
    """Return ``values``, of any shape, as indices from 0 to ``count`` - 1, or raise ``error``."""
    found = values if type(values) is np.ndarray else _without_mask(name, values, None, error)
    if found.size and (found.dtype.kind not in "iu" or found.min() < 0 or found.max() >= count):
        raise error(f"{name} {np.unique(found)}: give whole numbers from 0 to {count - 1}")
    return np.asarray(found, dtype=np.int64)


def choice(
    name: str, value: object, allowed: Sequence[str], error: type[FretscaleError] = InputError
) -> None:
    """Raise ``error`` unless ``value`` is one of those ``allowed``."""
    if not isinstance(value, str) or value not in allowed:
        raise error(f"{name} is {shown(value)}: give {' or '.join(allowed)}")


def choices(holder: object, **allowed: Sequence[str]) -> None:
    """Raise InputError unless the named fields of ``holder`` are among those ``allowed``."""
    for name, values in allowed.items():
        choice(field(holder, name), getattr(holder, name), values)


def settle(frozen: object, **fields: object) -> None:
    """Set checked ``fields`` of a ``frozen`` dataclass instance during its construction."""
    for name, value in fields.items():
        object.__setattr__(frozen, name, value)


def field(holder: object, name: str) -> str:
    """Return the name of a field of ``holder`` in messages, such as ``Wear.cycles``."""
    return f"{type(holder).__name__}.{name}"


def shown(value: object) -> str:
    """Return ``value`` as text for a message of one line."""
    if isinstance(value, np.ndarray) and value.ndim:
        return f"an array of shape {value.shape}"
    text = " ".join(repr(value).split())
    return text if len(text) <= LONGEST_SHOWN else text[:LONGEST_SHOWN] + "..."


def _given(holder: object, names: Sequence[str]) -> list[tuple[str, Any]]:
    """Return names and values of fields, without those that are None by default."""
    values = [(name, getattr(holder, name)) for name in names]
    return [(n, v) for n, v in values if v is not None or getattr(type(holder), n, ...) is not None]


def _called(kind: Any) -> str:
    """Return a class, or the classes of a union, in words."""
    names = {Callable: "a function", Mapping: "a mapping", NoneType: "None", bool: "True or False"}
    return " or ".join(
        names.get(each) or f"{'an' if each.__name__[0] in 'AEIO' else 'a'} {each.__name__}"
        for each in get_args(kind) or (kind,)
    )


def _without_mask(
    name: str, values: object, masked: float | None, error: type[FretscaleError]
) -> NDArray[Any]:
    """Return ``values`` as an array without a mask.

    Masked values are replaced by ``masked``, or raise ``error`` if that is None.
    """
    if type(values) in FLOATS:
        return np.asarray(values)
    try:
        # Lists may hold masked arrays, whose masks np.asarray would lose.
        found: Any = np.ma.asanyarray(values)
    except ValueError as problem:
        raise error(f"{name} are no array: {problem}") from problem
    missing = np.ma.getmaskarray(found)
    if not missing.any():
        return np.asarray(found.data)
    if masked is None:
        raise error(
            f"{name} are masked in {np.count_nonzero(missing)} places: give numbers there, or "
            "leave these places out"
        )
    return np.asarray(found.astype(np.float64).filled(masked))


def _all_finite(found: NDArray[np.float64], infinite: bool) -> bool:
    """Return whether all values are finite, or +infinity where ``infinite`` allows it."""
    finite = np.isfinite(found)
    return bool(finite.all() or (infinite and (finite | (found == np.inf)).all()))


def _fits(shape: Shape, given: tuple[int, ...]) -> bool:
    """Return whether the ``given`` shape is the one asked for."""
    pairs = zip(shape, given, strict=False)
    return len(given) == len(shape) and all(wanted in (None, n) for wanted, n in pairs)


def _shown(shape: Shape, given: tuple[int, ...]) -> str:
    """Return the required ``shape`` as text for a message, with a hint if axes seem swapped."""
    sizes = ", ".join("any" if wanted is None else str(wanted) for wanted in shape)
    text = f"({sizes},)" if len(shape) == 1 else f"({sizes})"
    turned = None not in shape and tuple(shape) == given[::-1] and len(given) > 1
    return text + (", with x along the first axis: transpose them" if turned else "")
