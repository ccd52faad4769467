"""Validation of the arrays, numbers and choices that are passed to public functions and classes.

Invalid values raise an :class:`~sa_solver.errors.InputError` that says what to give instead.
Without these checks numpy would ignore the mask of a masked array, read texts and truth values as
numbers, and fail far from the cause where a list or a single number is given in place of a field.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import index
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sa_solver.errors import FretscaleError, InputError

REAL = "fiu"
"""Kinds of numpy data types that hold real numbers: floats, signed and unsigned integers."""

Shape = Sequence[int | None]


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
    if finite and not np.all(np.isfinite(found) | (infinite & (found == np.inf))):
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
    plain: Any = np.ma.asanyarray(value)
    if plain.ndim or np.ma.getmaskarray(plain).any() or plain.dtype.kind not in REAL:
        raise error(f"{name} is {value!r}: give one real number")
    found = float(plain)
    inside = found > above and least <= found <= most
    if not (inside and (np.isfinite(found) or (infinite and found == np.inf))):
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
    for name in names:
        value, optional = getattr(holder, name), getattr(type(holder), name, ...) is None
        if value is not None or not optional:
            number(name.replace("_", " "), value, **bounds)


def whole(name: str, value: Any, error: type[FretscaleError] = InputError) -> int:
    """Return ``value`` as an integer, or raise ``error``: a truth value is no number."""
    try:
        if not isinstance(value, bool):
            return index(value)
    except TypeError:
        pass
    raise error(f"{name} is {value!r}: give a whole number")


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
    if value not in allowed:
        raise error(f"{name} is {value!r}: give {' or '.join(allowed)}")


def settle(frozen: object, **fields: object) -> None:
    """Set checked ``fields`` of a ``frozen`` dataclass instance during its construction."""
    for name, value in fields.items():
        object.__setattr__(frozen, name, value)


def _without_mask(
    name: str, values: object, masked: float | None, error: type[FretscaleError]
) -> NDArray[Any]:
    """Return ``values`` as an array without a mask.

    Masked values are replaced by ``masked``, or raise ``error`` if that is None.
    """
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
