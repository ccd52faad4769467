"""Matrices in files of arrays: numpy's ``.npz``, Matlab's ``.mat``, HDF5."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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

# What a file may say of its rows beside its matrices: as fretscale writes it.
NAMES, PLACES, FREQUENCIES = "names", "places", "frequencies"
# Arrays of a sparse matrix by columns: in Matlab's files of version 7.3; and by rows, as scipy's.
MATLAB, SCIPY = ("data", "ir", "jc"), ("data", "indices", "indptr")
# The first says how many rows a sparse matrix of Matlab has, both that a dataset is Matlab's.
MATLAB_ROWS, MATLAB_CLASS = "MATLAB_sparse", "MATLAB_class"


def read_npz(path: Path) -> MatrixFile:
    """A sparse matrix of scipy's ``save_npz``, or the arrays of numpy's ``savez``."""
    with np.load(path, allow_pickle=False) as file:
        names = list(file)
        if {"format", "shape", "data"} <= set(names):
            return MatrixFile(path, {"": lambda: sp.csr_matrix(sp.load_npz(path))})
        told = {name: file[name] for name in (NAMES, PLACES) if name in names}

    def read(name: str) -> Values:
        with np.load(path, allow_pickle=False) as file:
            return np.asarray(file[name])

    return _file(path, names, read, told)


def read_mat(path: Path) -> MatrixFile:
    """Matlab's file: versions 4 to 7.2 through scipy, 7.3 as the HDF5 that it is."""
    if h5py.is_hdf5(path):
        return read_hdf5(path)
    names = [name for name, _, _ in scipy.io.whosmat(str(path))]

    def read(name: str) -> Any:
        return scipy.io.loadmat(str(path), variable_names=[name])[name]

    told = {name: read(name) for name in (NAMES, PLACES) if name in names}
    return _file(path, names, read, told)


def read_hdf5(path: Path) -> MatrixFile:
    """Datasets, and groups that are sparse matrices, of an HDF5 file, by their paths in it."""
    with h5py.File(path, "r") as file:
        names: list[str] = []
        file.visititems(lambda name, item: names.append(name) if _is_matrix(item) else None)
        told = {
            name: file[name][()]
            for name in (NAMES, PLACES, FREQUENCIES)
            # Matlab's texts are references to arrays elsewhere in the file.
            if isinstance(file.get(name), h5py.Dataset) and MATLAB_CLASS not in file[name].attrs
        }

    def read(name: str) -> Values:
        with h5py.File(path, "r") as file:
            return _values(file[name])

    return _file(path, names, read, told)


def _file(
    path: Path, names: Sequence[str], read: Callable[[str], Values], told: dict[str, Any]
) -> MatrixFile:
    """The file, with what it tells of its rows."""
    unknowns, places = None, told.get(PLACES)
    if NAMES in told:
        texts = [_text(name) for name in np.ravel(told[NAMES])]
        try:
            unknowns = once(path, [unknown_of(text) for text in texts])
        except MatrixError as error:
            raise MatrixError(f"{path}: {NAMES}: {error}") from None
        # Models that fretscale reduces say nothing of their modes but the frequencies.
        modes = range(1, np.size(told.get(FREQUENCIES, ())) + 1)
        unknowns += tuple(Unknown(f"mode {mode}", MODAL) for mode in modes)
        places = None if places is None else _placed(path, places, len(unknowns))
    matrices = {name: _later(read, name) for name in names if name not in (NAMES, PLACES)}
    return MatrixFile(path, matrices, unknowns, places if unknowns else None)


def _later(read: Callable[[str], Values], name: str) -> Callable[[], Values]:
    return lambda: read(name)


def _text(name: Any) -> str:
    """A name of an array of texts: bytes, or an array of its own in Matlab's files."""
    if isinstance(name, np.ndarray):
        name = name.item() if name.size == 1 else ""
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name).strip()


def _placed(path: Path, places: Any, count: int) -> Array:
    """Places ``(n, 3)`` of all unknowns: modes have none."""
    given = np.asarray(places)
    if (
        given.ndim != 2
        or given.shape[1] != 3
        or len(given) > count
        or given.dtype.kind not in "iuf"
    ):
        raise MatrixError(f"{path}: {PLACES}: shape {given.shape}; allowed: x, y, z of every name")
    every = np.full((count, 3), np.nan)
    every[: len(given)] = given
    return every


def _is_matrix(item: Any) -> bool:
    """Whether an item of HDF5 may be one: numbers in rows and columns, or a sparse matrix."""
    if isinstance(item, h5py.Group):
        return set(MATLAB) <= set(item) or set(SCIPY) <= set(item)
    return isinstance(item, h5py.Dataset) and item.ndim in (1, 2) and item.dtype.kind in "iufcV"


def _values(item: Any) -> Values:
    """The matrix of an item; Matlab stores columns where others store rows."""
    if isinstance(item, h5py.Dataset):
        values = item[()]
        if values.dtype.names:  # a complex number is a pair with names
            raise MatrixError(f"{item.file.filename}: {item.name}: complex; allowed: real numbers")
        return np.asarray(values.T if MATLAB_CLASS in item.attrs else values)
    if set(MATLAB) <= set(item):
        data, rows, ends = (item[name][()] for name in MATLAB)
        shape = int(item.attrs[MATLAB_ROWS]), len(ends) - 1
        return sp.csc_matrix((data, rows.astype(np.int64), ends.astype(np.int64)), shape).tocsr()
    data, columns, ends = (item[name][()] for name in SCIPY)
    told = item["shape"][()] if "shape" in item else item.attrs.get("shape")
    rows = len(ends) - 1
    columns_there = rows if told is None else int(told[1])
    return sp.csr_matrix((data, columns, ends), (rows, columns_there))
