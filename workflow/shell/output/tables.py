"""Tables as CSV files: a row of headings, each ``name [unit]``, and a row for every point.

:mod:`workflow.case.files.table_file` reads them.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workflow.layout.declared import Arrays, Declarations
from workflow.shell.folders.store import replacing

# Digits of curves: more than their accuracy, fewer than an exact copy needs.
DIGITS = 9


def write_curves(path: Path, curves: Arrays, declared: Declarations) -> None:
    """Write curves as columns; several values at a point become several columns."""
    columns: dict[str, NDArray[Any]] = {}
    for name, values in curves.items():
        unit = declared[name].unit
        if values.ndim == 1:
            columns[heading(name, unit)] = values
        else:
            for number, column in enumerate(values.T, start=1):
                columns[heading(f"{name}_{number}", unit)] = column
    write_table(path, columns, DIGITS)


def write_table(
    path: Path,
    columns: Mapping[str, Sequence[Any] | NDArray[Any]],
    digits: int | None = None,
    note: str = "",
) -> None:
    """Write ``columns`` of equal length with their headings, after a comment line ``note``, if any.

    Numbers are written with ``digits`` digits, or with as many as an exact copy needs. None becomes
    an empty cell.
    """
    values = [v.tolist() if isinstance(v, np.ndarray) else v for v in columns.values()]
    with replacing(path) as partial, partial.open("w", encoding="utf-8", newline="") as file:
        if note:
            file.write(f"# {note}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*values, strict=True):
            writer.writerow(row if digits is None else [_rounded(cell, digits) for cell in row])


def heading(name: str, unit: str) -> str:
    """Return the heading of a column, with its unit if there is one."""
    return f"{name} [{unit}]" if unit else name


def _rounded(cell: object, digits: int) -> object:
    return f"{cell:.{digits}g}" if isinstance(cell, float) else cell
