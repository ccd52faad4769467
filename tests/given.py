"""Inputs of public functions: equal numbers in other containers, and values that are no number."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import pytest

NO_NUMBERS = np.nan, "100", [[100.0]], True, np.ma.masked, 1j


def held_otherwise(field: np.ndarray) -> list[Any]:
    """Return lists, single precision, column order, strided views, and arrays without a mask."""
    longer = np.repeat(field, 2, axis=-1)[..., ::2]
    unmasked = np.ma.array(field, mask=False)
    return [field.tolist(), field.astype(np.float32), np.asfortranarray(field), longer, unmasked]


def spoilt(field: np.ndarray, kind: str) -> Any:
    """Return what is no such field of numbers."""
    most = field == field.max()
    return {
        "complex": lambda: field + 0j,
        "text": lambda: field.astype(str),
        "flags": lambda: field > 0.0,
        "none": lambda: None,
        "one": lambda: 1.0,
        "masked": lambda: np.ma.array(field, mask=most),
        "missing": lambda: np.where(most, np.nan, field),
        "deep": lambda: field[None],
        "short": lambda: field[1:],
        "turned": lambda: field.swapaxes(-1, -2),
        "skewed": lambda: field + np.eye(*field.shape, k=1),
    }[kind]()


def assert_refused(error: type[Exception], attempts: Iterable[Callable[[], Any]]) -> None:
    """Assert that each attempt ends with the error."""
    for attempt in attempts:
        with pytest.raises(error):
            attempt()
