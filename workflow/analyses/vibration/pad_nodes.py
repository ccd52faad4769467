"""Nodes of a contact that are in rows and columns, found from their places."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array, Indices

# Of the pad's side: nodes closer than that are in one row, and rows are further apart, as those of
# fewer than 50 elements are.
ROW_SHARE = 0.01


def rows_and_columns(x: Array, y: Array) -> Indices | None:
    """Numbers of the nodes ``(nx, ny)``, x and y ascending, of places ``(j,)`` each [mm].

    None where they are not in two or more rows and columns, each crossing with one node.
    """
    row, column = _lines(x), _lines(y)
    shape = int(row.max()) + 1, int(column.max()) + 1
    if min(shape) < 2 or shape[0] * shape[1] != len(x):
        return None
    numbers = np.full(shape, -1, dtype=np.int64)
    numbers[row, column] = np.arange(len(x))
    return None if (numbers < 0).any() else numbers


def _lines(places: Array) -> Indices:
    """Which line every node is on ``(j,)``, counted from the smallest coordinate."""
    order = np.argsort(places, kind="stable")
    new = np.diff(places[order]) > ROW_SHARE * np.ptp(places)
    lines = np.zeros(len(places), dtype=np.int64)
    lines[order[1:]] = np.cumsum(new)
    return lines
