"""Matrices in files of arrays: numpy's ``.npz``, Matlab's ``.mat``, HDF5."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io
import scipy.sparse as sp

from fe_models.matrices.unknowns import (
    MODAL,
    MatrixError,
    MatrixFile,
    Unknown,
    Values,
    once,
    unknown_of,
)
from sa_solver.types import Array

# Datasets that describe the rows of the matrices, as fretscale writes them.
NAMES, PLACES, FREQUENCIES = "names", "places", "frequencies"
# Arrays of a sparse matrix: by columns in Matlab's files of version 7.3, and by rows in scipy's.
MATLAB, SCIPY = ("data", "ir", "jc"), ("data", "indices", "indptr")
# Attributes of Matlab's datasets: the number of rows of a sparse matrix, and the class.
MATLAB_ROWS, MATLAB_CLASS = "MATLAB_sparse", "MATLAB_class"


def read_npz(path: Path) -> MatrixFile:
    """Read a sparse matrix of scipy's ``save_npz``, or the arrays of numpy's ``savez``."""
    with np.load(path, allow_pickle=False) as file:
        names = list(file)
        if {"format", "shape", "data"} <= set(names):
            return MatrixFile(path, {"": lambda: sp.csr_matrix(sp.load_npz(path))})
        description = {name: file[name] for name in (NAMES, PLACES) if name in names}

    def read(name: str) -> Values:
        with np.load(path, allow_pickle=False) as file:
            return np.asarray(file[name])

    return _file(path, names, read, description)


def read_mat(path: Path) -> MatrixFile:
    """Read Matlab's file: versions 4 to 7.2 through scipy, 7.3 as HDF5."""
    if h5py.is_hdf5(path):
        return read_hdf5(path)
    names = [name for name, _, _ in scipy.io.whosmat(str(path))]

    def read(name: str) -> Any:
        return scipy.io.loadmat(str(path), variable_names=[name])[name]

    description = {name: read(name) for name in (NAMES, PLACES) if name in names}
    return _file(path, names, read, description)


def read_hdf5(path: Path) -> MatrixFile:
    """Read datasets, and groups that are sparse matrices, of an HDF5 file, by their paths in it."""
    with h5py.File(path, "r") as file:
        names: list[str] = []
        file.visititems(lambda name, item: names.append(name) if _is_matrix(item) else None)
        description = {
            name: file[name][()]
            for name in (NAMES, PLACES, FREQUENCIES)
            # Matlab's texts are references to other arrays in the file and are not read.
            if isinstance(file.get(name), h5py.Dataset) and MATLAB_CLASS not in file[name].attrs
        }

    def read(name: str) -> Values:
        with h5py.File(path, "r") as file:
            return _values(file[name])

    return _file(path, names, read, description)


def _file(
    path: Path, names: Sequence[str], read: Callable[[str], Values], description: dict[str, Any]
) -> MatrixFile:
    """Return the content of a file, with the unknowns that its ``description`` gives."""
    unknowns, places = None, description.get(PLACES)
    if NAMES in description:
        texts = [_text(name) for name in np.ravel(description[NAMES])]
        try:
            unknowns = once(path, [unknown_of(text) for text in texts])
        except MatrixError as error:
            raise MatrixError(f"{path}: {NAMES}: {error}") from None
        # Fretscale's reduced models describe their modes only by the frequencies.
        modes = range(1, np.size(description.get(FREQUENCIES, ())) + 1)
        unknowns += tuple(Unknown(f"mode {mode}", MODAL) for mode in modes)
        places = None if places is None else _placed(path, places, len(unknowns))
    matrices = {name: partial(read, name) for name in names if name not in (NAMES, PLACES)}
    return MatrixFile(path, matrices, unknowns, places if unknowns else None)


def _text(name: Any) -> str:
    """Return a name in an array of texts: bytes, or a nested array in Matlab's files."""
    if isinstance(name, np.ndarray):
        name = name.item() if name.size == 1 else ""
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name).strip()


def _placed(path: Path, places: Any, count: int) -> Array:
    """Return the positions ``(n, 3)`` of all unknowns, NaN for modes."""
    given = np.asarray(places)
    if (
        given.ndim != 2
        or given.shape[1] != 3
        or len(given) > count
        or given.dtype.kind not in "iuf"
    ):
        raise MatrixError(f"{path}: {PLACES}: shape {given.shape}; allowed: x, y, z of every name")
    all_places = np.full((count, 3), np.nan)
    all_places[: len(given)] = given
    return all_places


def _is_matrix(item: Any) -> bool:
    """Return whether an item of HDF5 may be a matrix: an array of numbers or a sparse matrix."""
    if isinstance(item, h5py.Group):
        return set(MATLAB) <= set(item) or set(SCIPY) <= set(item)
    return isinstance(item, h5py.Dataset) and item.ndim in (1, 2) and item.dtype.kind in "iufcV"


def _values(item: Any) -> Values:
    """Return the matrix of an item; Matlab stores columns where others store rows."""
    if isinstance(item, h5py.Dataset):
        values = item[()]
        if values.dtype.names:  # A complex number is a pair with names.
            raise MatrixError(f"{item.file.filename}: {item.name}: complex; allowed: real numbers")
        return np.asarray(values.T if MATLAB_CLASS in item.attrs else values)
    if set(MATLAB) <= set(item):
        data, rows, ends = (item[name][()] for name in MATLAB)
        shape = int(item.attrs[MATLAB_ROWS]), len(ends) - 1
        return sp.csc_matrix((data, rows.astype(np.int64), ends.astype(np.int64)), shape).tocsr()
    data, columns, ends = (item[name][()] for name in SCIPY)
    shape = item["shape"][()] if "shape" in item else item.attrs.get("shape")
    rows = len(ends) - 1
    width = rows if shape is None else int(shape[1])
    return sp.csr_matrix((data, columns, ends), (rows, width))
