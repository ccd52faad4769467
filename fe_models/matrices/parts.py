"""Matrices of a structure in files: found by their names, and checked one by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import scipy.sparse as sp

from fe_models.matrices.arrays import read_hdf5, read_mat, read_npz
from fe_models.matrices.nastran import read_op4, read_punch
from fe_models.matrices.text import read_mtx
from fe_models.matrices.unknowns import MatrixError, MatrixFile, Unknown, Values, listed_names
from sa_solver import checks

AnyRead = TypeVar("AnyRead")

# Reader of files with each ending.
READERS: dict[str, Callable[[Path], MatrixFile]] = {
    ".npz": read_npz,
    ".mat": read_mat,
    ".h5": read_hdf5,
    ".hdf5": read_hdf5,
    ".mtx": read_mtx,
    ".pch": read_punch,
    ".bdf": read_punch,
    ".op4": read_op4,
}
# Endings of files that may contain several named matrices.
SEVERAL = tuple(ending for ending in READERS if ending != ".mtx")
# Names by which a matrix is found if none is given, in upper or lower case. Those of Nastran are as
# PARAM,EXTOUT and EXTSEOUT write them.
STIFFNESS, MASS, DAMPING, LOADS = "stiffness", "mass", "damping", "loads"
USUAL_NAMES = {
    STIFFNESS: (STIFFNESS, "k", "kaax", "kaa", "kgg", "k2gg"),
    MASS: (MASS, "m", "maax", "maa", "mgg", "m2gg"),
    DAMPING: (DAMPING, "c", "baax", "baa", "bgg", "b2gg"),
    LOADS: (LOADS, "f", "pax", "pa"),
}
PARTS = tuple(USUAL_NAMES)
NEEDED = STIFFNESS, MASS
# Datasets of fretscale's reduced models that are not matrices of the structure.
DESCRIBING = "kept", "mode_shapes", "frequencies"
# Limit of the number of unknowns: a larger one is a mistake or damage, and cannot be condensed.
MOST_UNKNOWNS = 5_000_000
# Tolerated asymmetry relative to the largest entries in the rows: rounding to single precision, in
# which some programs write. The mean of both entries is used.
SYMMETRIC = 1e-6


@dataclass(frozen=True)
class Part:
    """Matrix of a file that is used as stiffness, mass, damping or loads."""

    part: str
    file: MatrixFile
    name: str
    values: Values

    def refuse(self, wrong: str) -> MatrixError:
        named = f": {self.name}" if self.name else ""
        return MatrixError(f"{self.file.path}{named}: {wrong}", self.part)


def read_matrix_file(path: Path) -> MatrixFile:
    r"""Return the content of a file of matrices, read according to its ending.

    Raises :class:`MatrixError` for a file that cannot be read.

    Examples
    --------
    Abaqus writes by ``*MATRIX OUTPUT, STIFFNESS`` one triangle, with nodes and components:

    >>> import tempfile
    >>> from pathlib import Path
    >>> from fe_models.matrices import read_matrix_file
    >>> path = Path(tempfile.mkdtemp()) / "job_STIF1.mtx"
    >>> _ = path.write_text("1,1, 1,1, 2.0e+03\n2,1, 1,1, -1.0e+03\n2,1, 2,1, 1.0e+03\n")
    >>> file = read_matrix_file(path)
    >>> print([unknown.name for unknown in file.unknowns])
    ['1 x', '2 x']
    >>> print(file.matrices[""]().toarray())
    [[ 2000. -1000.]
     [-1000.  1000.]]
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MatrixError(f"{path}: not a file of matrices; allowed: {', '.join(READERS)}")
    return _reading(path, lambda: reader(path))


# --- files --------------------------------------------------------------------------------------


def found(
    sources: Mapping[str, tuple[Path, str]], file: Path | None
) -> tuple[dict[str, Part], tuple[str, ...], dict[str, tuple[str, ...]]]:
    """Return the matrices by their parts, the names of unused ones, and suggestions for these.

    The suggestions are, for damping and loads that are missing, unused matrices of the right shape,
    written as in a case.
    """
    files: dict[Path, MatrixFile] = {}
    parts = {}
    for part in PARTS:
        given, name = sources.get(part, (file, ""))
        path = None if given is None else Path(given)
        if path is None:
            if part in NEEDED:
                raise MatrixError("missing; allowed: a file of its own, or one of all", part)
            continue
        if path not in files:
            try:
                files[path] = read_matrix_file(path)
            except MatrixError as error:
                raise MatrixError(str(error), part if part in sources else "") from None
        chosen = _chosen(files[path], part, name, part in sources)
        if chosen is not None:
            values = _reading(path, files[path].matrices[chosen])
            parts[part] = _checked(Part(part, files[path], chosen, values))
    used = {(id(part.file), part.name) for part in parts.values()}
    left = [
        (each, name)
        for each in files.values()
        for name in each.matrices
        if name and name not in DESCRIBING and (id(each), name) not in used
    ]
    return parts, tuple(name for _, name in left), _offered(parts, left)


def _offered(
    parts: Mapping[str, Part], left: Sequence[tuple[MatrixFile, str]]
) -> dict[str, tuple[str, ...]]:
    """Return the unused matrices whose shapes fit a missing damping or load."""
    size = parts[STIFFNESS].values.shape[0]
    offered: dict[str, tuple[str, ...]] = {}
    for file, name in left if {DAMPING, LOADS} - set(parts) else ():
        try:
            values = file.matrices[name]()
        except Exception:  # A suggestion is optional, so unreadable matrices are skipped.
            continue
        shape = values.shape if min(values.shape, default=0) > 1 else (values.size, 1)
        part = DAMPING if shape == (size, size) else LOADS
        if (
            values.dtype.kind in "iuf"
            and len(shape) == 2
            and shape[0] == size
            and part not in parts
        ):
            offered[part] = (*offered.get(part, ()), f"{file.path.name}:{name}")
    return offered


def _chosen(file: MatrixFile, part: str, name: str, own: bool) -> str | None:
    """Return the name in the file of the matrix for a part.

    It is the name given, the only name, or a usual name. ``own`` tells whether the file was given
    for this part.
    """
    known = list(file.matrices)
    if name:
        matching = [k for k in known if k.lower() == name.lower()]
        if not matching:
            raise MatrixError(f"{file.path}: {name}: no such matrix; {_listed(known)}", part)
        return name if name in known else matching[0]
    if own and len(known) == 1:
        return known[0]
    for usual in USUAL_NAMES[part]:
        for k in known:
            if k.lower() == usual:
                return k
    if not own and part not in NEEDED:
        return None
    ending = file.path.suffix
    raise MatrixError(
        f"{file.path}: which is the {part}? {_listed(known)}, named behind the file, such as "
        f"{part}: {file.path.stem}{ending}:{next(iter(known), 'K') or 'K'}",
        part if own else "",
    )


def _listed(names: Sequence[str]) -> str:
    return f"allowed: one of {listed_names([name for name in names if name]) or 'none'}"


def _reading(path: Path, read: Callable[[], AnyRead]) -> AnyRead:
    """Read a file or a matrix of it, with any error in one line."""
    try:
        return read()
    except MatrixError:
        raise
    except Exception as error:  # Libraries raise many kinds of errors for damaged files.
        message = " ".join(str(error).split())[:120] or type(error).__name__
        raise MatrixError(
            f"{path}: cannot be read ({message}); allowed: a file as its program writes it"
        ) from error


# --- checks -------------------------------------------------------------------------------------


def _checked(part: Part) -> Part:
    """Return the matrix as rows and columns of finite real numbers; a load may be a single list."""
    values = part.values
    if values.dtype.kind == "c":
        raise part.refuse("complex; allowed: real numbers, structural damping apart")
    if values.dtype.kind not in "iuf":
        raise part.refuse(f"numbers of type {values.dtype}; allowed: real numbers")
    if not sp.issparse(values):
        values = np.asarray(values, dtype=np.float64)
        values = values.reshape(len(values), -1) if values.ndim == 1 else values
        if values.ndim != 2:
            raise part.refuse(f"{values.ndim} dimensions; allowed: rows and columns")
        if part.part == LOADS and values.shape[0] == 1:
            values = values.T
    values = sp.csr_matrix(values, dtype=np.float64)
    if not 0 < values.shape[0] <= MOST_UNKNOWNS or values.shape[1] > MOST_UNKNOWNS:
        raise part.refuse(f"{shape_of(values)}; allowed: 1 to {MOST_UNKNOWNS:,} unknowns")
    if not np.isfinite(values.data).all():
        coordinates = values.tocoo()
        place = np.flatnonzero(~np.isfinite(coordinates.data))[0]
        row, column = coordinates.row[place] + 1, coordinates.col[place] + 1
        raise part.refuse(
            f"row {row}, column {column}: {coordinates.data[place]}; allowed: finite numbers"
        )
    if part.part != LOADS and values.shape[0] != values.shape[1]:
        raise part.refuse(f"{shape_of(values)}; allowed: as many rows as columns")
    return replace(part, values=values)


def shape_of(values: Values) -> str:
    """Return the numbers of rows and columns as text."""
    return " x ".join(map(str, values.shape))


def symmetric_matrix(name: str, values: object, size: int) -> sp.csr_matrix:
    """Return a symmetric matrix of ``size`` rows, given as a sparse or dense one, by its rows.

    Raises :class:`MatrixError` for other shapes, numbers that are not finite, and a matrix that is
    not symmetric.
    """
    if sp.issparse(values):
        rows: sp.csr_matrix = sp.csr_matrix(values)
        data = checks.array(f"numbers of {name}", rows.data, (None,), error=MatrixError)
        matrix = sp.csr_matrix((data, rows.indices, rows.indptr), shape=rows.shape)
    else:
        dense = checks.array(f"values of {name}", values, (None, None), error=MatrixError)
        matrix = sp.csr_matrix(dense)
    if matrix.shape != (size, size):
        raise MatrixError(
            f"{name}: {shape_of(matrix)}; allowed: {size} rows, as the unknowns", name
        )
    apart = abs(matrix - matrix.T)
    if apart.nnz and apart.max() > SYMMETRIC * abs(matrix).max():
        raise MatrixError(f"{name}: not symmetric; allowed: a symmetric matrix", name)
    return matrix


def symmetric(part: Part, matrix: sp.csr_matrix, unknowns: Sequence[Unknown]) -> sp.csr_matrix:
    """Return the symmetric part of a matrix that is symmetric up to rounding.

    Raises :class:`MatrixError` for a larger asymmetry.
    """
    apart = abs(matrix - matrix.T).tocoo()
    if not apart.nnz:
        return matrix
    largest = np.sqrt(np.asarray(abs(matrix).max(axis=1).todense()).ravel())
    sizes = largest[apart.row] * largest[apart.col]
    # An entry whose counterpart's row or column is empty has the largest relative asymmetry.
    relative = apart.data / np.where(sizes > 0.0, sizes, apart.data)
    worst = int(np.argmax(relative))
    if relative[worst] > SYMMETRIC:
        row, column = int(apart.row[worst]), int(apart.col[worst])
        one, other = matrix[row, column], matrix[column, row]
        where = f"{unknowns[row].name} and {unknowns[column].name}"
        hint = ""
        if not (sp.triu(matrix, 1).nnz and sp.tril(matrix, -1).nnz):
            hint = ", or one triangle in a format that says so: Matrix Market, Abaqus, DMIG form 6"
        raise part.refuse(
            f"not symmetric: {one:.6g} and {other:.6g} between {where}, row {row + 1} and "
            f"{column + 1}; allowed: a symmetric matrix{hint}"
        )
    return (0.5 * (matrix + matrix.T)).tocsr()
