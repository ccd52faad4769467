"""The matrices of a structure in files: found by their names, and looked at one by one."""

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
from fe_models.matrices.unknowns import MatrixError, MatrixFile, Unknown, Values
from sa_solver import checks

AnyRead = TypeVar("AnyRead")

# Endings of files, and what reads them.
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
# Those of files that may hold several matrices, each with a name.
SEVERAL = tuple(ending for ending in READERS if ending != ".mtx")
# Names that a matrix is looked for by, in any case, where none is given; Nastran's as PARAM,EXTOUT
# and EXTSEOUT write them.
STIFFNESS, MASS, DAMPING, LOADS = "stiffness", "mass", "damping", "loads"
USUAL_NAMES = {
    STIFFNESS: (STIFFNESS, "k", "kaax", "kaa", "kgg", "k2gg"),
    MASS: (MASS, "m", "maax", "maa", "mgg", "m2gg"),
    DAMPING: (DAMPING, "c", "baax", "baa", "bgg", "b2gg"),
    LOADS: (LOADS, "f", "pax", "pa"),
}
PARTS = tuple(USUAL_NAMES)
NEEDED = STIFFNESS, MASS
# Of models that fretscale reduces: what is no matrix of theirs.
DESCRIBING = "kept", "mode_shapes", "frequencies"
# More unknowns than any machine with this program condenses: a slip, or a damaged file.
MOST_UNKNOWNS = 5_000_000
# Entries on either side of the diagonal may differ by so much of the largest in their rows: what
# single precision leaves, in which some programs write. Their mean is taken.
SYMMETRIC = 1e-6
# Names that fit into a message.
MOST_LISTED = 12


@dataclass(frozen=True)
class Part:
    """A matrix of a file that is taken for a part."""

    part: str
    file: MatrixFile
    name: str
    values: Values

    def refuse(self, wrong: str) -> MatrixError:
        named = f": {self.name}" if self.name else ""
        return MatrixError(f"{self.file.path}{named}: {wrong}", self.part)


def read_matrix_file(path: Path) -> MatrixFile:
    """What a file of matrices has, by its ending.

    Raises :class:`MatrixError` for a file that cannot be read: damage ends in a dozen ways.

    Examples
    --------
    What Abaqus writes by ``*MATRIX OUTPUT, STIFFNESS``: one triangle, with nodes and components

    >>> import tempfile
    >>> from pathlib import Path
    >>> from fe_models.matrices import read_matrix_file
    >>> path = Path(tempfile.mkdtemp()) / "job_STIF1.mtx"
    >>> _ = path.write_text("1,1, 1,1, 2.0e+03\\n2,1, 1,1, -1.0e+03\\n2,1, 2,1, 1.0e+03\\n")
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
        raise MatrixError(f"{path}: no file of matrices; allowed: {', '.join(READERS)}")
    return _reading(path, lambda: reader(path))


# --- files --------------------------------------------------------------------------------------


def found(
    sources: Mapping[str, tuple[Path, str]], file: Path | None
) -> tuple[dict[str, Part], tuple[str, ...], dict[str, tuple[str, ...]]]:
    """The matrices by their parts, the names of those that are none, and what these could be.

    The last are, for damping and loads that are missing, matrices of the right shape, each as a
    case names it.
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
    """Return the matrices not used so far whose shapes fit a missing damping or load."""
    size = parts[STIFFNESS].values.shape[0]
    offered: dict[str, tuple[str, ...]] = {}
    for file, name in left if {DAMPING, LOADS} - set(parts) else ():
        try:
            values = file.matrices[name]()
        except Exception:  # nothing depends on it
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
    """The name in the file of the matrix for a part: the one given, the only one, a usual one."""
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
    more = ", ..." if len(names) > MOST_LISTED else ""
    return f"allowed: one of {', '.join(filter(None, names[:MOST_LISTED])) or 'none'}{more}"


def _reading(path: Path, read: Callable[[], AnyRead]) -> AnyRead:
    """What reads a file or a matrix of it, its errors in one line."""
    try:
        return read()
    except MatrixError:
        raise
    except Exception as error:  # libraries end damage in a dozen ways
        said = " ".join(str(error).split())[:120] or type(error).__name__
        raise MatrixError(
            f"{path}: cannot be read ({said}); allowed: a file as its program leaves it"
        ) from error


# --- checks -------------------------------------------------------------------------------------


def _checked(part: Part) -> Part:
    """The matrix as rows and columns of finite real numbers; a load may be a single list."""
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
    """Rows and columns, as they are told."""
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
    """The matrix without what rounding leaves of an asymmetry. Raises MatrixError for more."""
    apart = abs(matrix - matrix.T).tocoo()
    if not apart.nnz:
        return matrix
    largest = np.sqrt(np.asarray(abs(matrix).max(axis=1).todense()).ravel())
    sizes = largest[apart.row] * largest[apart.col]
    # A row of nothing beside a column of something is as far apart as it can be.
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
