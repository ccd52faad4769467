"""Values that say what they are: unit and description go with them from where they are made."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

# Units of the forces and moments of a line contact, by those of a contact over an area.
PER_LENGTH = {"N": "N/mm", "N mm": "N mm/mm", "mm^2": "mm^2/mm", "mm^3": "mm^3/mm"}


@dataclass(frozen=True)
class Dataset:
    """``values`` of any shape in ``unit``, a base unit ("1" for none), and what they are.

    Extensive quantities of a line contact, which are per mm, have the unit of a contact over an
    area: whoever writes them knows which contact it is (:func:`unit_in`).
    """

    values: NDArray[Any]
    unit: str
    description: str


Datasets = Mapping[str, Dataset]
"""Datasets by name."""


def unit_in(line: bool, unit: str) -> str:
    """The ``unit`` in a contact over an area, or in a ``line`` contact, where forces are per mm."""
    return PER_LENGTH.get(unit, unit) if line else unit


def described(
    quantities: Mapping[str, tuple[str, str]], values: Iterable[NDArray[Any]]
) -> dict[str, Dataset]:
    """Values as datasets, given in the order of ``quantities``: unit and description by name."""
    pairs = zip(quantities.items(), values, strict=True)
    return {name: Dataset(array, *what) for (name, what), array in pairs}
