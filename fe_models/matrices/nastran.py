"""Matrices of Nastran: ``DMIG`` entries of punch and bulk data files, and ``.op4``.

``DMIG`` includes the points and components of its rows and columns, ``.op4`` does not. The latter
is read by pyYeti if it is installed (Nastran Quick Reference Guide: DMIG).
"""

from __future__ import annotations

import warnings
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_models.matrices.unknowns import (
    MatrixError,
    MatrixFile,
    Unknown,
    Values,
    by_number,
    mirrored,
)
from fe_models.meshes.structure_mesh import MeshError
from fe_models.readers.nastran.cards import BulkEntry, bulk_data

DMIG = "DMIG"
# Forms of a matrix: square, rectangular with numbered columns, and symmetric with one triangle.
SQUARE, RECTANGULAR, SYMMETRIC = 1, (2, 9), 6
REAL = (1, 2)
# Positions of form and type in the header after the name, and number of fields of an entry.
FORM, TYPE, ENTRIES = 2, 3, 4

Label = tuple[int, int]


def read_punch(path: Path) -> MatrixFile:
    """Read all ``DMIG`` matrices of a punch or bulk data file, on the unknowns of all of them.

    Raises :class:`MatrixError` with file and line.
    """
    try:
        entries = [entry for entry in bulk_data(path).entries if entry.name == DMIG]
        matrices = _gathered(entries)
    except MeshError as error:
        raise MatrixError(str(error)) from None
    if not matrices:
        raise MatrixError(f"{path}: no {DMIG} entries; allowed: a file with matrices")
    labels = sorted({label for matrix in matrices.values() for label in matrix.labels()})
    row = {label: k for k, label in enumerate(labels)}
    unknowns: tuple[Unknown, ...] = tuple(by_number(path, *label) for label in labels)
    return MatrixFile(path, {n: partial(m.values, row) for n, m in matrices.items()}, unknowns)


def read_op4(path: Path) -> MatrixFile:
    """Read the matrices of an ``.op4`` file, text or binary. Raises :class:`MatrixError`."""
    try:
        from pyyeti.nastran import op4
    except ImportError:
        raise MatrixError(
            f"{path}: .op4 is read by pyYeti, which is not installed: pip install "
            "'fretscale[nastran]', or write the matrices as DMIG (.pch)"
        ) from None
    with warnings.catch_warnings():
        # pyYeti only warns about damage that it ignores.
        warnings.simplefilter("error", RuntimeWarning)
        names, values, _, _ = op4.load(str(path), into="list", sparse=None)
    return MatrixFile(path, {n: _plain(v) for n, v in zip(names, values, strict=True)})


def _plain(values: Any) -> Callable[[], Values]:
    return lambda: values.tocsr() if sp.issparse(values) else np.asarray(values)


class _Dmig:
    """Matrix in DMIG entries: its header, and its values by row and column."""

    def __init__(self, header: BulkEntry) -> None:
        self.header, self.form = header, header.whole(FORM)
        if self.form not in (SQUARE, SYMMETRIC, *RECTANGULAR):
            raise header.wrong(f"form {self.form}; allowed: 1, 2, 6 or 9")
        if header.whole(TYPE) not in REAL:
            raise header.wrong("complex numbers; allowed: real ones, type 1 or 2")
        self.entries: dict[tuple[Label, Label], float] = {}

    def take(self, column: BulkEntry) -> None:
        """Add the entries of a column."""
        to = _label(column, 1)
        for first in range(ENTRIES, len(column.fields), ENTRIES):
            if not any(column.fields[first : first + ENTRIES]):
                continue
            row = _label(column, first)
            if (row, to) in self.entries or (self.form == SYMMETRIC and (to, row) in self.entries):
                raise column.wrong(
                    f"point {row[0]}, component {row[1]}: given twice; allowed: once"
                )
            self.entries[row, to] = column.real(first + 2)

    def labels(self) -> set[Label]:
        """Return the labels of its rows, and of its columns where these are unknowns, too."""
        rows = {row for row, _ in self.entries}
        return rows if self.form in RECTANGULAR else rows | {to for _, to in self.entries}

    def values(self, row: dict[Label, int]) -> Values:
        """Return the matrix with rows by their labels; columns of loads are sorted by number."""
        ends, size = list(self.entries), len(row)
        rows = [row[end] for end, _ in ends]
        if self.form in RECTANGULAR:
            numbers = {to: k for k, to in enumerate(sorted({to for _, to in ends}))}
            columns, width = [numbers[to] for _, to in ends], len(numbers)
        else:
            columns, width = [row[to] for _, to in ends], size
        given = list(self.entries.values())
        matrix = sp.coo_matrix((given, (rows, columns)), shape=(size, width))
        if self.form != SYMMETRIC:
            return matrix.toarray() if self.form in RECTANGULAR else matrix.tocsr()
        return mirrored(matrix)


def _label(entry: BulkEntry, first: int) -> Label:
    """Return point and component; the component of a scalar point may be left out."""
    component = entry.text(first + 1)
    return entry.whole(first), entry.whole(first + 1) if component else 0


def _gathered(entries: list[BulkEntry]) -> dict[str, _Dmig]:
    """Return the matrices by name, each with its columns."""
    found: dict[str, _Dmig] = {}
    columns: defaultdict[str, list[BulkEntry]] = defaultdict(list)
    for entry in entries:
        name = entry.text(0).upper()
        # A header has 0 where a column has its point, followed by its form.
        if entry.text(1) == "0" and entry.text(FORM):
            if name in found:
                raise entry.wrong(f"{name}: a second header; allowed: one")
            found[name] = _Dmig(entry)
        else:
            columns[name].append(entry)
    for name, given in columns.items():
        if name not in found:
            raise given[0].wrong(f"{name}: no header; allowed: one, with 0 for the point")
        for column in given:
            found[name].take(column)
    return found
