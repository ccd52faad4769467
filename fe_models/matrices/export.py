"""Reduced models in the formats of other programs, which :func:`external_matrices` can read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

from fe_models.joints.reduction import ReducedModel
from fe_models.matrices.reduction import require_names
from fe_models.matrices.unknowns import MODAL, MatrixError, Unknown, unknown_of
from sa_solver import checks
from sa_solver.types import Array

# Number of digits that represent a number exactly.
DIGITS = 17
NPZ, MAT, MTX = "npz", "mat", "mtx"


def write_matrices(model: ReducedModel, folder: Path, stem: str, formats: tuple[str, ...]) -> None:
    """Write a model with names as ``npz``, ``mat`` or ``mtx``, in N, mm and t.

    The first two contain ``stiffness``, ``mass``, ``loads`` and if present ``damping`` on kept
    displacements, then modes; ``names`` of all of them, and ``places`` of the kept ones. ``mtx`` is
    a file of each matrix in the Matrix Market format, and one of the unknowns in CSV. Raises
    :class:`MatrixError` for a model without names, and for another format.

    Examples
    --------
    Matrices are read back unchanged:

    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models.matrices import ExternalMatrices, Unknown, external_matrices
    >>> from fe_models.matrices import on_all, write_matrices
    >>> unknowns = Unknown("tip", "x"), Unknown("mode 1", "modal")
    >>> K, M = sp.diags([1e3, 4e6]).tocsr(), sp.diags([1e-3, 1.0]).tocsr()
    >>> model = on_all(ExternalMatrices(K, M, None, np.zeros((2, 0)), unknowns))
    >>> folder = Path(tempfile.mkdtemp())
    >>> write_matrices(model, folder, "body", ("npz",))
    >>> back = external_matrices({}, folder / "body.npz")
    >>> print(back.unknowns[1].name, bool((back.stiffness != K).nnz))
    mode 1 modal False
    """
    writers: Mapping[str, Callable[[ReducedModel, Path, str], None]] = {
        NPZ: _write_npz,
        MAT: _write_mat,
        MTX: _write_mtx,
    }
    require_names(model)
    for each in formats:
        checks.choice("format", each, list(writers), MatrixError)
    for each in formats:
        writers[each](model, Path(folder), stem)


def _matrices(model: ReducedModel) -> dict[str, Array]:
    """Return the matrices by the names of their parts."""
    given = {"stiffness": model.stiffness, "mass": model.mass, "damping": model.damping}
    loads = {"loads": model.loads} if model.loads.size else {}
    return {name: matrix for name, matrix in given.items() if matrix is not None} | loads


def _unknowns(model: ReducedModel) -> list[Unknown]:
    # The caller has checked that there are names.
    assert model.names is not None
    modes = range(1, len(model.frequencies) + 1)
    return [*map(unknown_of, model.names), *(Unknown(f"mode {mode}", MODAL) for mode in modes)]


def _described(model: ReducedModel) -> dict[str, Any]:
    names: dict[str, Any] = {"names": np.array([unknown.name for unknown in _unknowns(model)])}
    return names if model.places is None else names | {"places": model.places}


def _write_npz(model: ReducedModel, folder: Path, stem: str) -> None:
    arrays: dict[str, Any] = _matrices(model) | _described(model)
    np.savez_compressed(folder / f"{stem}.npz", **arrays)


def _write_mat(model: ReducedModel, folder: Path, stem: str) -> None:
    described = _described(model)
    # Texts of different lengths are stored as a cell array.
    described["names"] = described["names"].astype(object)
    scipy.io.savemat(folder / f"{stem}.mat", _matrices(model) | described, do_compression=True)


def _write_mtx(model: ReducedModel, folder: Path, stem: str) -> None:
    for name, matrix in _matrices(model).items():
        symmetry = "general" if name == "loads" else "symmetric"
        scipy.io.mmwrite(folder / f"{stem}_{name}.mtx", matrix, precision=DIGITS, symmetry=symmetry)
    lines = "\n".join(_rows(model))
    (folder / f"{stem}_unknowns.csv").write_text(f"{lines}\n", encoding="utf-8")


def _rows(model: ReducedModel) -> Iterator[str]:
    """Yield a line for each unknown, as a case reads them."""
    places = model.places
    yield "point,direction" + ("" if places is None else ",x [mm],y [mm],z [mm]")
    for k, (point, direction) in enumerate(_unknowns(model)):
        if places is None:
            yield f"{point},{direction}"
        else:
            place = places[k] if k < len(places) else np.zeros(3)
            yield f"{point},{direction}," + ",".join(repr(float(x)) for x in place)
