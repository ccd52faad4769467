"""CSV files that describe the rows of matrices, or name the nodes of matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from workflow.case.fields import Quantity, shown
from workflow.case.files.table_file import TableFile, read_table_file

if TYPE_CHECKING:
    from fe_models.matrices import GivenUnknowns

DIRECTIONS = "x", "y", "z", "rx", "ry", "rz", "modal"
AXES = "x", "y", "z"
PLACE = Quantity("mm", at_least=-1e7, at_most=1e7)


def given_unknowns(file: str | None) -> GivenUnknowns | None:
    """Return the unknowns that a file describes: columns point and direction, or node and point.

    With columns x, y and z, places are read too. Raises InputFileError.
    """
    from fe_models.matrices import GivenUnknowns, Unknown

    if file is None:
        return None
    table = read_table_file(file)
    by_node = "node" in table.names
    key = "node" if by_node else "direction"
    table.require(("point", key), "columns point and direction, or node and point")
    table.check({"point": None, key: None, **dict.fromkeys(AXES, "mm")})
    points, places = _names(table, "point"), None
    if any(axis in table.names for axis in AXES):
        table.require(AXES, "x, y and z together")
        places = np.stack([table.column(axis, PLACE) for axis in AXES], axis=1)
    if by_node:
        nodes = _names(table, "node")
        for row, node in enumerate(nodes):
            if node in nodes[:row]:
                raise table.refusal(row, "node", "given twice", "every node once")
        placed = None if places is None else dict(zip(points, places, strict=True))
        return GivenUnknowns(nodes=dict(zip(nodes, points, strict=True)), places=placed)
    directions = table.cells("direction")
    for row, direction in enumerate(directions):
        if direction not in DIRECTIONS:
            raise table.refusal(row, "direction", "no direction", ", ".join(DIRECTIONS))
    unknowns = tuple(Unknown(*row) for row in zip(points, directions, strict=True))
    return GivenUnknowns(unknowns, places=places)


def _names(table: TableFile, name: str) -> list[str]:
    cells = table.cells(name)
    for row, cell in enumerate(cells):
        if not cell or not cell.isprintable():
            raise table.refusal(row, name, f"{shown(cell)}: no name", "a name")
    return cells
