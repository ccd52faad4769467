"""Arrays together with their units and descriptions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

# Units in a line contact for the units of extensive quantities of a contact over an area.
PER_LENGTH = {"N": "N/mm", "N mm": "N mm/mm", "mm^2": "mm^2/mm", "mm^3": "mm^3/mm"}


@dataclass(frozen=True)
class Dataset:
    """Array with its unit and description.

    ``values`` may have any shape; ``unit`` is a base unit ("1" for none). Extensive quantities of a
    line contact are per mm but carry the unit of a contact over an area: the code that writes them
    knows the kind of contact and converts the unit (:func:`unit_in`).
    """

    values: NDArray[Any]
    unit: str
    description: str


Datasets = Mapping[str, Dataset]
"""Datasets by name."""


def unit_in(line: bool, unit: str) -> str:
    """Return the unit of a quantity in a contact over an area, or per mm in a ``line`` contact."""
    return PER_LENGTH.get(unit, unit) if line else unit


def described(
    quantities: Mapping[str, tuple[str, str]], values: Iterable[NDArray[Any]]
) -> dict[str, Dataset]:
    """Return values as datasets, in the order of ``quantities``: unit and description by name."""
    pairs = zip(quantities.items(), values, strict=True)
    return {name: Dataset(array, *what) for (name, what), array in pairs}
