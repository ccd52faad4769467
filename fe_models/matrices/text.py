"""Matrices in text: Matrix Market, and the ``.mtx`` files of Abaqus.

Abaqus' ``*MATRIX OUTPUT`` writes one matrix to a file: with ``FORMAT=MATRIX INPUT`` node, degree of
freedom, node, degree of freedom, value; with ``FORMAT=COORDINATE`` row, column, value; for a load
node, degree of freedom, value. A symmetric matrix has one triangle or both in the file.
``*SUBSTRUCTURE MATRIX OUTPUT, OUTPUT FILE=USER DEFINED`` and CalculiX write a linear
``*USER ELEMENT``: nodes, degrees of freedom, and the lower triangles of stiffness and mass, row by
row (Abaqus Keywords Guide: MATRIX INPUT, USER ELEMENT, MATRIX).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

from fe_models.matrices.unknowns import (
    MatrixError,
    MatrixFile,
    Unknown,
    Values,
    by_number,
    mirrored,
    number,
    once,
    whole,
)
from fe_models.readers.abaqus.cards import SourceLine
from fe_models.readers.text_files import open_text
from sa_solver.types import Array, Indices

MATRIX_MARKET, USER_ELEMENT = "%%MatrixMarket", "*USERELEMENT"
NODES = "ELEMENT NODES"
# Diagonal values from this mark displacements that a *BOUNDARY holds: Abaqus adds 1e36.
PENALTY = 1e35
# Number of bits for a degree of freedom next to its node in one whole number.
DOF_BITS = 6

Line = tuple[int, str]


def read_mtx(path: Path) -> MatrixFile:
    """Read a file of one matrix, or a substructure with its stiffness and mass.

    Raises :class:`MatrixError` with file and line.
    """
    with open_text(path) as file:
        first = file.readline()
        if first.startswith(MATRIX_MARKET):
            return MatrixFile(path, {"": lambda: _matrix_market(path)})
        rest = enumerate(file, start=2)
        lines = [(k, text.strip()) for k, text in ((1, first), *rest) if text.strip()]
    if any(_keyword(text).startswith(USER_ELEMENT) for _, text in lines[:100]):
        return _substructure(path, lines)
    return _entries(path, [(k, text) for k, text in lines if not text.startswith("**")])


def _matrix_market(path: Path) -> Values:
    values = scipy.io.mmread(path)
    return values.tocsr() if sp.issparse(values) else np.asarray(values)


# --- entries ------------------------------------------------------------------------------------


def _entries(path: Path, lines: list[Line]) -> MatrixFile:
    """Read lines of labels and a value each, all of one kind."""
    if not lines:
        raise MatrixError(f"{path}: empty; allowed: a matrix")
    separator = "," if "," in lines[0][1] else None
    table = _table(path, lines, separator)
    width = table.shape[1]
    if separator and width == 5:
        return _labelled(path, lines, table)
    if separator and width == 3:
        return _labelled_load(path, table)
    if width in (2, 3):
        return MatrixFile(path, {"": lambda: _coordinates(path, lines, table)})
    raise MatrixError(
        f"{path}:{lines[0][0]}: {width} values; allowed: Matrix Market, which begins with "
        f"{MATRIX_MARKET}, or what Abaqus writes: node, degree of freedom, node, degree of "
        "freedom, value, or row, column, value"
    )


def _table(path: Path, lines: list[Line], separator: str | None) -> Array:
    """Return all numbers ``(lines, k)``; invalid ones are reported with their line."""
    try:
        return np.loadtxt([text for _, text in lines], delimiter=separator, ndmin=2, comments=None)
    except ValueError:
        rows = []
        for k, text in lines:
            place = SourceLine(path, k)
            cells = text.rstrip(",").split(separator)
            rows.append([number(place, cell) for cell in cells])
            if len(cells) != len(rows[0]):
                raise MatrixError(
                    f"{place}: {len(cells)} values; allowed: {len(rows[0])}, as in the first line"
                ) from None
        return np.array(rows)


def _wholes(path: Path, columns: Array) -> Indices:
    """Return labels as whole numbers. Raises :class:`MatrixError` if one is not whole."""
    rounded = np.rint(columns)
    if not (np.abs(columns) < 2**52).all() or (columns != rounded).any():
        raise MatrixError(f"{path}: labels that are not whole numbers; allowed: whole numbers")
    return rounded.astype(np.int64)


def _labelled(path: Path, lines: list[Line], table: Array) -> MatrixFile:
    """Read lines of node, degree of freedom, node, degree of freedom, value."""
    labels = _wholes(path, table[:, :4]).reshape(-1, 2)
    # Node and degree of freedom are combined in one number, a hundred times faster than by rows.
    _, first, place = np.unique(
        labels[:, 0] * 2**DOF_BITS + labels[:, 1], return_index=True, return_inverse=True
    )
    ends = place.reshape(-1, 2)
    unknowns = tuple(by_number(path, *pair) for pair in labels[first].tolist())
    values = _whole_matrix(path, lines, ends, table[:, 4], len(first))
    free = ~(values.diagonal() >= PENALTY)
    held = frozenset(u for u, kept in zip(unknowns, free, strict=True) if not kept)
    unknowns = tuple(u for u, kept in zip(unknowns, free, strict=True) if kept)
    return MatrixFile(path, {"": lambda: values[free][:, free]}, unknowns, held=held)


def _labelled_load(path: Path, table: Array) -> MatrixFile:
    """Read lines of node, degree of freedom, value."""
    labels = _wholes(path, table[:, :2]).tolist()
    unknowns = once(path, [by_number(path, *label) for label in labels])
    return MatrixFile(path, {"": lambda: table[:, 2:]}, unknowns)


def _coordinates(path: Path, lines: list[Line], table: Array) -> Values:
    """Read lines of row, column, value; for a load row, value, or all in column 1."""
    places = _wholes(path, table[:, :-1]) - 1
    if places.min() < 0:
        raise MatrixError(f"{path}: a row or column below 1; allowed: counted from 1")
    size = int(places.max()) + 1
    if places.shape[1] == 1 or (size > 1 and not places[:, 1].any()):
        load = np.zeros((size, 1))
        load[places[:, 0], 0] = table[:, -1]
        return load
    values = _whole_matrix(path, lines, places, table[:, 2], size)
    if (values.diagonal() >= PENALTY).any():
        row = int(np.argmax(values.diagonal() >= PENALTY)) + 1
        raise MatrixError(
            f"{path}: row {row} is held by 1e36 on its diagonal; allowed: FORMAT=MATRIX INPUT, "
            "from which held displacements are left out, or matrices without *BOUNDARY"
        )
    return values


def _whole_matrix(
    path: Path, lines: list[Line], ends: Indices, values: Array, size: int
) -> sp.csr_matrix:
    """Return the matrix of its entries: both triangles, or one that is mirrored."""
    matrix = sp.coo_matrix((values, (ends[:, 0], ends[:, 1])), shape=(size, size))
    once_each = matrix.tocsr()
    if once_each.nnz < len(values):
        _, first = np.unique(ends, axis=0, return_index=True)
        again = np.setdiff1d(np.arange(len(ends)), first)[0]
        raise MatrixError(f"{path}:{lines[again][0]}: an entry given twice; allowed: once")
    lower, upper = (ends[:, 0] > ends[:, 1]).any(), (ends[:, 0] < ends[:, 1]).any()
    return once_each if lower and upper else mirrored(matrix)


# --- substructures ------------------------------------------------------------------------------


def _substructure(path: Path, lines: list[Line]) -> MatrixFile:
    """Read a linear user element: its unknowns, and its matrices by their type."""
    blocks = list(_blocks(lines))
    head = next(block for block in blocks if _keyword(block[0][1]).startswith(USER_ELEMENT))
    if "UNSYM" in _keyword(head[0][1]):
        raise MatrixError(
            f"{path}:{head[0][0]}: an unsymmetric substructure; allowed: a symmetric one, *STEP "
            "with UNSYMM=NO"
        )
    unknowns = _user_element(path, head)
    matrices = {}
    for (k, title), *rows in blocks:
        if not _keyword(title).startswith("*MATRIX,"):
            continue
        kind = _keyword(title).partition("TYPE=")[2].partition(",")[0].lower()
        values = _lower_triangle(path, k, [row for row in rows if row[1][:1] != "*"], len(unknowns))
        matrices[kind] = values
    return MatrixFile(path, {kind: _known(v) for kind, v in matrices.items()}, unknowns)


def _known(values: Array) -> Callable[[], Values]:
    return lambda: values


def _keyword(text: str) -> str:
    """Return a keyword line without blanks in upper case; empty for a comment."""
    return "" if text.startswith("**") else "".join(text.split()).upper()


def _blocks(lines: list[Line]) -> Iterator[list[Line]]:
    """Yield each keyword with all lines that follow it, comments included."""
    block: list[Line] = []
    for line in lines:
        if line[1].startswith("*") and not line[1].startswith("**"):
            if block:
                yield block
            block = []
        if block or not line[1].startswith("**"):
            block.append(line)
    if block:
        yield block


def _user_element(path: Path, block: list[Line]) -> tuple[Unknown, ...]:
    """Return the unknowns of a user element, node by node.

    A node has the degrees of freedom of the line for its position, or of the last one before. The
    nodes are in the comment below ``** ELEMENT NODES``.
    """
    nodes: list[int] = []
    active: dict[int, list[int]] = {}
    listing = False
    for k, text in block[1:]:
        place, data = SourceLine(path, k), text.lstrip("* ")
        if text.startswith("**"):
            listing = listing or data.upper().startswith(NODES)
            if listing and data[:1].isdigit():
                nodes += [whole(place, cell) for cell in data.strip(" ,").split(",")]
            continue
        numbers = [whole(place, cell) for cell in text.strip(" ,").split(",")]
        position, numbers = (numbers[0], numbers[1:]) if active else (1, numbers)
        active[position] = numbers
    if not nodes or not active:
        raise MatrixError(
            f"{path}:{block[0][0]}: nodes or degrees of freedom of the element are missing; "
            f"allowed: as Abaqus writes them, nodes in a comment below ** {NODES}"
        )
    unknowns, current = [], active[1]
    for position, node in enumerate(nodes, start=1):
        current = active.get(position, current)
        unknowns += [by_number(path, node, component) for component in current]
    return once(path, unknowns)


def _lower_triangle(path: Path, line: int, rows: Sequence[Line], size: int) -> Array:
    """Return the symmetric matrix ``(n, n)`` of its lower triangle, given row by row."""
    given = [
        number(SourceLine(path, k), cell)
        for k, text in rows
        for cell in text.split(",")
        if cell.strip()
    ]
    if len(given) != size * (size + 1) // 2:
        raise MatrixError(
            f"{path}:{line}: {len(given)} values for {size} unknowns; allowed: the lower triangle, "
            f"{size * (size + 1) // 2}"
        )
    matrix = np.zeros((size, size))
    matrix[np.tril_indices(size)] = given
    return matrix + np.tril(matrix, -1).T
