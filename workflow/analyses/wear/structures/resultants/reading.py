"""Reading of the loads of a structure's interfaces from a CSV or an HDF5 file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sa_solver.load_history import LoadHistory
from sa_solver.types import Array
from workflow.analyses.wear.structures.resultants.consistency import (
    MIX,
    Bounds,
    checked_loads,
)
from workflow.analyses.wear.structures.resultants.hdf5 import read_h5
from workflow.analyses.wear.structures.resultants.imported import (
    CLOSURE,
    UNNAMED,
    ImportedLoads,
    base_units,
    required_columns,
    tilt_of,
)
from workflow.case.fields import Quantity, shown, split_dataset
from workflow.case.files.input_files import InputFileError
from workflow.case.files.table_file import TableFile, read_table_file

INTERFACE, INCREMENT, SLIDING = "interface", "increment", "sliding"
# Allowed names: they become groups of results and columns of tables.
NAME = re.compile(r"\w[\w .-]*")
HDF5 = (".h5", ".hdf5")


def read_resultants(
    path: str | Path,
    line: bool = False,
    friction: float | None = None,
    face_sizes: Mapping[str, tuple[float, float]] | None = None,
) -> dict[str, ImportedLoads]:
    """Return the loads by interface, in base units; per mm in a ``line`` contact.

    The path of an ``.h5`` file may include the group to read: ``results.h5:structure``.
    ``friction`` µ and the ``face_sizes`` (x, y) [mm] by interface, where given, bound forces and
    moments. Sliding increments are those that the file marks or, without marks, those within 1 % of
    Coulomb's limit that dissipate.

    Raises InputFileError, ``file:line: column: what is wrong; allowed: ...``.
    """
    sizes = face_sizes or {}
    file, group = split_dataset(str(path))

    def bounds(name: str) -> Bounds:
        return Bounds(friction, sizes.get(name), line)

    if file.endswith(HDF5):
        return _alike(file, read_h5(file, group, bounds, line))
    table, units = read_table_file(file), _columns(line)
    table.check(units)
    required, tilt = required_columns(line, table.names), tilt_of(line, table.names)
    table.require(
        required, f"{', '.join(required)} in every file (Mx and My, or neither: held tilt)"
    )
    numbers = {
        name: table.column(name, Quantity(unit))
        for name, unit in units.items()
        if unit is not None and name in table.names
    }
    rows = _rows_of(table)
    _check_counts(table, rows)
    closures = (
        table.column(CLOSURE, Quantity("1", at_least=0.0)) if CLOSURE in table.names else None
    )
    read = {
        name: ImportedLoads(
            _loads(table, numbers, places, bounds(name)),
            tilt,
            None if closures is None else float(closures[places].max()),
        )
        for name, places in rows.items()
    }
    return _alike(file, read)


def _alike(file: str, read: dict[str, ImportedLoads]) -> dict[str, ImportedLoads]:
    """Return the loads if all interfaces have the same mix of cycles; refuse others."""
    first, *others = read
    expected = read[first].loads
    for name in others:
        loads = read[name].loads
        if not all(
            map(np.array_equal, (loads.block, loads.share), (expected.block, expected.share))
        ):
            raise InputFileError(
                f"{file}: blocks or shares of {name} and {first} differ; allowed: the same for "
                "every interface"
            )
    return read


def _columns(line: bool) -> dict[str, str | None]:
    """Return the base units of all columns of a CSV file; None stands for text."""
    bare = dict.fromkeys((SLIDING, *MIX, CLOSURE), "1")
    return {INTERFACE: None, INCREMENT: "1", **base_units(line), **bare}


def _rows_of(table: TableFile) -> dict[str, list[int]]:
    """Return the rows of every interface, in the order of its increments."""
    named = INTERFACE in table.names
    names = table.cells(INTERFACE) if named else [UNNAMED] * len(table)
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        if not NAME.fullmatch(name):
            allowed = "letters, digits, '_', '-', '.' and spaces between them"
            raise table.refusal(row, INTERFACE, "no name", allowed)
        rows.setdefault(name, []).append(row)
    if INCREMENT in table.names:
        for places in rows.values():
            _check_increments(table, places)
    return rows


def _check_increments(table: TableFile, rows: list[int]) -> None:
    increments = table.whole(INCREMENT)
    for count, row in enumerate(rows, start=1):
        if increments[row] != count:
            before = increments[row] in [increments[r] for r in rows[: count - 1]]
            wrong = "increment given twice" if before else "increments are left out"
            raise table.refusal(row, INCREMENT, wrong, f"{count}: they count from 1")


def _check_counts(table: TableFile, rows: dict[str, list[int]]) -> None:
    longest = max(rows, key=lambda name: len(rows[name]))
    for name, places in rows.items():
        if len(places) != len(rows[longest]):
            raise InputFileError(
                f"{table.file}:{table.rows[places[-1]][0]}: {shown(name)} ends after {len(places)} "
                f"increments; allowed: as many for every interface, {longest} has "
                f"{len(rows[longest])}"
            )


def _loads(
    table: TableFile, numbers: Mapping[str, Array], rows: list[int], bounds: Bounds
) -> LoadHistory:
    zeros = np.zeros(len(rows))
    columns: dict[str, Any] = {
        name: numbers[name][rows] if name in numbers else zeros for name in base_units(bounds.line)
    }

    def refusal(increment: int, column: str, wrong: str, allowed: str) -> InputFileError:
        return table.refusal(rows[increment], column, wrong, allowed)

    mix = {name: numbers[name][rows] for name in MIX if name in numbers}
    sliding = None
    if SLIDING in numbers:
        marks = numbers[SLIDING][rows]
        for increment in np.flatnonzero(~np.isin(marks, (0.0, 1.0))).tolist():
            raise refusal(increment, SLIDING, "neither yes nor no", "0 or 1")
        sliding = marks == 1.0
    return checked_loads(columns, sliding, mix, bounds, refusal)
