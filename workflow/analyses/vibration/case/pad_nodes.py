"""Rows and columns of the nodes of a contact, found from their places."""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array, Indices

# Share of the pad's side. Nodes closer than this are in one row; rows of fewer than 50 elements are
# further apart.
ROW_SHARE = 0.01


def rows_and_columns(x: Array, y: Array) -> Indices | None:
    """Return node numbers ``(nx, ny)``, x and y ascending, for places ``(j,)`` each [mm].

    Returns None unless there are two or more rows and columns with one node at each crossing.
    """
    row, column = _lines(x), _lines(y)
    shape = int(row.max()) + 1, int(column.max()) + 1
    if min(shape) < 2 or shape[0] * shape[1] != len(x):
        return None
    numbers = np.full(shape, -1, dtype=np.int64)
    numbers[row, column] = np.arange(len(x))
    return None if (numbers < 0).any() else numbers


def _lines(places: Array) -> Indices:
    """Return the number of the line of every node ``(j,)``, from the smallest coordinate."""
    order = np.argsort(places, kind="stable")
    new = np.diff(places[order]) > ROW_SHARE * np.ptp(places)
    lines = np.zeros(len(places), dtype=np.int64)
    lines[order[1:]] = np.cumsum(new)
    return lines
