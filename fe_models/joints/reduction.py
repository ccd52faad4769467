"""Static condensation (Guyan) and Craig-Bampton reduction of one elastic body.

The displacements are split into kept ones c and inner ones i, and u = T q with

    T = [ I  0 ]     Ψ = -K_ii⁻¹ K_ic,     K_ii Φ = M_ii Φ Λ,  Φᵀ M_ii Φ = I:
        [ Ψ  Φ ]

the kept displacements with the static response of the inner ones to them, and the lowest modes with
the kept displacements fixed. The reduced stiffness is block diagonal, with the Schur complement and
Λ as blocks. Without modes it is the static condensation, which is exact in statics.

Sources: Guyan 1965, AIAA J. 3, 380, doi:10.2514/3.2874; Craig & Bampton 1968, AIAA J. 6, 1313,
doi:10.2514/3.4741.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, eigsh

from fe_models.solvers.linear_solver import COLUMNS_AT_ONCE, Factorisation, condense, factorise
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Indices

# Shift of the eigenvalue search for a free body over the median of K_jj/M_jj, which does not depend
# on the coordinates. It is small enough to separate rigid motions, and large enough that K - σ M is
# not singular.
SHIFT_SHARE = 1e-7

# Steps of a reduction with mass and modes: condensation, factorisation, modes, mass.
STEPS = 4

# Unit and description of every dataset of a stored model.
DATASETS = {
    "kept": ("1", "displacements of the full model that are kept, in this order"),
    "stiffness": ("N/mm", "stiffness on kept displacements, then modes (modes: 1/s^2)"),
    "mass": ("t", "mass on kept displacements, then modes (modes: 1, mixed: t^0.5)"),
    "damping": ("N s/mm", "damping on kept displacements, then modes (modes: 1/s)"),
    "loads": ("N", "load cases on kept displacements, then modes (modes: N/t^0.5)"),
    "mode_shapes": ("1/t^0.5", "fixed-interface modes over all displacements of the full model"),
    "frequencies": ("Hz", "natural frequencies of the fixed-interface modes"),
    "names": ("1", "of the kept displacements: point and direction, such as pad 17 x"),
    "places": ("mm", "x, y, z of the point of each kept displacement"),
}
# Datasets that a stored model may lack.
OPTIONAL = "mass", "damping", "names", "places"


@dataclass(frozen=True)
class ReducedModel:
    """Model of a body on ``c`` kept displacements and its ``m`` lowest fixed-interface modes.

    With mm, N, s and t a modal coordinate has the unit t^0.5 mm.

    Attributes
    ----------
    kept
        Numbers of the kept displacements in the full model ``(c,)``.
    stiffness, mass
        Matrices ``(c + m, c + m)``; the mass may be None.
    loads
        Load cases ``(c + m, cases)``.
    mode_shapes
        Modes ``(n, m)`` of unit modal mass, zero at the kept displacements.
    frequencies
        Natural frequencies of the modes ``(m,)`` [Hz].
    names
        Names of the kept displacements ``(c,)``, point and direction as in ``pad 17 x``, if known.
    places
        Positions of their points ``(c, 3)`` [mm], if known.
    damping
        Damping matrix ``(c + m, c + m)``, if the body has one.

    Examples
    --------
    Ten equal springs in a row are pulled apart by 5 mm at the ends. Each is stretched by 0.5 mm.

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models import reduce_body
    >>> row = sp.diags([-100.0, 200.0, -100.0], [-1, 0, 1], shape=(11, 11), format="lil")
    >>> row[0, 0] = row[10, 10] = 100.0
    >>> K = row.tocsr()
    >>> model = reduce_body(K, None, kept=np.array([0, 10]))
    >>> print(model.recover(K, np.array([0.0, 5.0])))
    [0.  0.5 1.  1.5 2.  2.5 3.  3.5 4.  4.5 5. ]
    """

    kept: Indices
    stiffness: Array
    mass: Array | None
    loads: Array
    mode_shapes: Array
    frequencies: Array
    names: tuple[str, ...] | None = None
    places: Array | None = None
    damping: Array | None = None

    @property
    def static_stiffness(self) -> Array:
        """Schur complement ``(c, c)``: stiffness on the kept displacements [N/mm]."""
        return self.stiffness[: len(self.kept), : len(self.kept)]

    def recover(self, stiffness: sp.csr_matrix, coordinates: Array) -> Array:
        """Return displacements ``(n, ...)`` of the full model for ``coordinates`` ``(c + m, ...)``.

        ``stiffness`` is that of the full model. Loads on inner displacements have an effect only
        through the modes.
        """
        static, modal = np.split(coordinates, [len(self.kept)])
        inner = _others(stiffness.shape[0], self.kept)
        displacement = self.mode_shapes @ modal
        displacement[self.kept] = static
        coupling = stiffness[inner][:, self.kept] @ static
        displacement[inner] -= factorise(stiffness[inner][:, inner].tocsr())(coupling)
        return displacement


def reduce_body(
    stiffness: sp.csr_matrix,
    mass: sp.csr_matrix | None,
    kept: Indices,
    modes: int = 0,
    loads: Array | None = None,
    done: Callable[[], None] = lambda: None,
    damping: sp.csr_matrix | None = None,
) -> ReducedModel:
    """Reduce a body to its ``kept`` displacements and ``modes`` fixed-interface modes.

    Parameters
    ----------
    stiffness, mass, damping
        Symmetric matrices ``(n, n)`` of the full model. The mass may be None without modes and
        damping; the damping may always be None.
    kept
        Numbers of the kept displacements, in the order of the result.
    modes
        Number of fixed-interface modes.
    loads
        Load cases ``(n, cases)``.
    done
        Called after each of ``STEPS`` steps if there are mass and modes.

    Raises
    ------
    InputError
        If the body has fewer modes than requested, if modes or damping are given without a mass, or
        if ``kept`` are not the numbers of different displacements.
    SolverError
        If the body can move while the kept displacements are held.

    Examples
    --------
    Ten springs of 100 N/mm in a row, of which only the ends are kept, are one of 10 N/mm:

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models import reduce_body
    >>> row = sp.diags([-100.0, 200.0, -100.0], [-1, 0, 1], shape=(11, 11), format="lil")
    >>> row[0, 0] = row[10, 10] = 100.0
    >>> K = row.tocsr()
    >>> model = reduce_body(K, None, kept=np.array([0, 10]))
    >>> print(model.static_stiffness.round(6))
    [[ 10. -10.]
     [-10.  10.]]
    """
    size = np.shape(stiffness)[0]
    stiffness, mass, damping = (_sparse(matrix, size) for matrix in (stiffness, mass, damping))
    kept = checks.places("kept displacements", kept, size)
    if kept.ndim != 1 or len(np.unique(kept)) < len(kept):
        raise InputError(
            "the kept displacements are not a list of different numbers: give each number once"
        )
    inner = _others(size, kept)
    if (modes > 0 or damping is not None) and mass is None:
        raise InputError("fixed-interface modes, and damping, need a mass matrix")
    if modes >= len(inner) > 0 or modes < 0:
        raise InputError(
            f"{modes} modes requested of {len(inner)} inner displacements: ask for at least 0 and "
            "fewer than there are inner displacements"
        )
    full_loads = np.zeros((size, 0))
    if loads is not None:
        full_loads = checks.array("loads", loads, (size, None), order="K")
    static, static_loads = condense(stiffness, full_loads, kept)
    done()
    values, shapes, reduced_mass = np.empty(0), np.zeros((size, modes)), None
    reduced_damping = None
    if mass is not None:
        solve = factorise(stiffness[inner][:, inner].tocsr())
        done()
        if modes > 0:
            values, shapes[inner] = _lowest_modes(stiffness, mass, inner, modes, solve)
            done()
        static_shapes = _static_shapes(stiffness, kept, inner, solve)
        reduced_mass = _projected(mass, kept, inner, static_shapes, shapes)
        # The modes have unit mass; this removes the rounding errors off the diagonal.
        reduced_mass[len(kept) :, len(kept) :] = np.eye(modes)
        if damping is not None:
            reduced_damping = _projected(damping, kept, inner, static_shapes, shapes)
        done()
    return ReducedModel(
        kept=kept,
        stiffness=sl.block_diag(static, np.diag(values)),
        mass=reduced_mass,
        loads=np.concatenate([static_loads, shapes.T @ full_loads]),
        mode_shapes=shapes,
        frequencies=np.sqrt(values) / (2.0 * np.pi),
        damping=reduced_damping,
    )


def free_frequencies(
    stiffness: sp.csr_matrix | Array, mass: sp.csr_matrix | Array, count: int
) -> Array:
    """Return the ``count`` lowest natural frequencies ``(count,)`` [Hz], rigid motions included.

    The body may be free. Dense matrices are taken as those of a reduced model. Due to rounding a
    rigid motion has a small frequency, the root of its |ω²|. Raises ``ValueError`` if there are
    fewer frequencies.
    """
    size = stiffness.shape[0]
    # Lanczos iterations cannot find all of them.
    if not 0 < count < size + isinstance(stiffness, np.ndarray):
        raise ValueError(
            f"{count} frequencies requested of {size} displacements: ask for at least 1 and fewer "
            "than there are displacements"
        )
    # A shift below zero makes a free body's K - σ M definite, and keeps rigid motions exact next to
    # frequencies that are many orders higher.
    moved = mass.diagonal() > 0.0
    shift = -SHIFT_SHARE * float(np.median(stiffness.diagonal()[moved] / mass.diagonal()[moved]))
    shifted = stiffness - shift * mass
    if isinstance(shifted, np.ndarray):
        largest = size - count, size - 1
        inverses = sl.eigh(mass, shifted, eigvals_only=True, subset_by_index=largest)
        squares = 1.0 / inverses + shift
    else:
        inverse = LinearOperator(shifted.shape, matvec=factorise(shifted.tocsr()), dtype=np.float64)
        squares = eigsh(
            stiffness, count, mass, sigma=shift, OPinv=inverse, v0=_start(size),
            return_eigenvectors=False,
        )  # fmt: skip
    return np.sqrt(np.abs(np.sort(squares))) / (2.0 * np.pi)


def save_reduced(path: Path, model: ReducedModel) -> None:
    """Write a model to an HDF5 file."""
    with h5py.File(path, "w") as file:
        write_reduced(file, model)


def write_reduced(file: h5py.File, model: ReducedModel) -> None:
    """Write a model to an open HDF5 file, with unit and description of every dataset."""
    for name, (unit, description) in DATASETS.items():
        values = getattr(model, name)
        if values is not None:
            file.create_dataset(name, data=values).attrs.update(unit=unit, description=description)


def load_reduced(path: Path) -> ReducedModel:
    """Read a model that :func:`save_reduced` has written.

    Raises ``OSError`` for a file that is not HDF5, ``ValueError`` for one that holds no model.
    """
    with h5py.File(path, "r") as file:
        datasets: dict[str, Any] = {
            name: np.asarray(file[name][()]) for name in DATASETS if name in file
        }
    missing = [name for name in DATASETS if name not in datasets and name not in OPTIONAL]
    if missing:
        raise ValueError(f"{path} is not a reduced model: it has no dataset {missing[0]}")
    _check_shapes(path, datasets)
    if "names" in datasets:
        datasets["names"] = tuple(name.decode() for name in datasets["names"])
    return ReducedModel(**({"mass": None} | datasets))


def _check_shapes(path: Path, datasets: Mapping[str, Any]) -> None:
    """Raise ValueError unless the arrays fit together and their numbers are finite."""
    kept, modes = datasets["kept"].size, datasets["frequencies"].size
    size, names = kept + modes, datasets.get("names", np.empty(0)).ravel()
    shapes: dict[str, tuple[int, ...]] = {
        "kept": (kept,),
        "frequencies": (modes,),
        "stiffness": (size, size),
        "mass": (size, size),
        "damping": (size, size),
        "loads": (size, *datasets["loads"].shape[-1:]),
        "mode_shapes": (*datasets["mode_shapes"].shape[:1], modes),
        "names": (kept,),
        "places": (kept, 3),
    }
    for name, values in datasets.items():
        if values.shape != shapes[name]:
            wanted = " x ".join(map(str, shapes[name]))
            raise ValueError(f"{path}: {name}: shape {values.shape}; allowed: {wanted}")
        if name != "names" and not (values.dtype.kind in "iuf" and np.isfinite(values).all()):
            raise ValueError(f"{path}: {name}: not all finite numbers")
    if not all(isinstance(name, bytes) for name in names):
        raise ValueError(f"{path}: names: not texts")


def _sparse(matrix: sp.csr_matrix | None, size: int) -> sp.csr_matrix | None:
    """Return a matrix ``(size, size)`` in compressed rows, from any format."""
    if matrix is None or sp.issparse(matrix):
        found = matrix
    else:
        found = sp.csr_matrix(checks.array("numbers of a matrix", matrix, (size, size)))
    if found is not None and found.shape != (size, size):
        raise InputError(f"a matrix of shape {found.shape}: give {(size, size)}")
    return found


def _others(size: int, kept: Indices) -> Indices:
    return np.setdiff1d(np.arange(size), kept)


def _start(size: int) -> Array:
    """Return the same start vector for every Lanczos search.

    It has no symmetry that would hide modes.
    """
    return np.random.default_rng(0).standard_normal(size)


def _lowest_modes(
    stiffness: sp.csr_matrix,
    mass: sp.csr_matrix,
    inner: Indices,
    modes: int,
    solve: Factorisation,
) -> tuple[Array, Array]:
    """Return the lowest ω² ``(m,)`` and modes ``(i, m)`` of unit modal mass.

    The kept displacements are fixed. Each mode has the sign for which its product with one fixed
    random vector is positive. The sign of its largest entry would not be unique, because a
    symmetric body has several largest entries of either sign.
    """
    K, M = (matrix[inner][:, inner].tocsr() for matrix in (stiffness, mass))
    inverse = LinearOperator(K.shape, matvec=solve, dtype=np.float64)
    start = _start(len(inner))
    values, shapes = eigsh(K, modes, M, sigma=0.0, OPinv=inverse, v0=start)
    order = np.argsort(values)
    values, shapes = values[order], shapes[:, order]
    shapes *= np.where(start @ shapes < 0.0, -1.0, 1.0)
    return values, shapes / np.sqrt(np.einsum("im,im->m", shapes, M @ shapes))


def _static_shapes(
    stiffness: sp.csr_matrix, kept: Indices, inner: Indices, solve: Factorisation
) -> Array:
    """Return the static shapes Ψ ``(i, c)`` as a dense matrix."""
    coupling = stiffness[inner][:, kept].tocsc()
    static = np.empty((len(inner), len(kept)))
    for start in range(0, len(kept), COLUMNS_AT_ONCE):
        block = slice(start, start + COLUMNS_AT_ONCE)
        static[:, block] = -solve(coupling[:, block].toarray())
    return static


def _projected(
    matrix: sp.csr_matrix, kept: Indices, inner: Indices, static: Array, shapes: Array
) -> Array:
    """Return Tᵀ M T of a mass or damping matrix, with the static shapes Ψ ``(i, c)``."""
    within, coupling = matrix[inner][:, inner], matrix[inner][:, kept]
    half = coupling.T @ static
    on_kept = matrix[kept][:, kept].toarray() + half + half.T + static.T @ (within @ static)
    modal = shapes[inner]
    moved = within @ modal
    mixed = static.T @ moved + coupling.T @ modal
    symmetric = 0.5 * (on_kept + on_kept.T)
    return np.block([[symmetric, mixed], [mixed.T, modal.T @ moved]])
