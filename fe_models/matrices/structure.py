"""Structure given by matrices from files: assembled, converted to base units, and checked.

The conversion preserves energy, which gives one rule for all kinds of unknowns. With x = S x_file
the stiffness is K = e S⁻¹ K_file S⁻¹, and mass and damping likewise, where e is the file's unit of
energy in base units (force times length; for the mass, mass times length² over s²). S is the file's
length in mm for displacements, 1 for rotations, and for coordinates of modes the length times the
root of the mass, so that modal masses of 1 stay 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_models.matrices.parts import (
    DAMPING,
    LOADS,
    MASS,
    PARTS,
    STIFFNESS,
    Part,
    found,
    shape_of,
    symmetric,
    symmetric_matrix,
)
from fe_models.matrices.unknowns import DIRECTIONS, MODAL, TRANSLATIONS, MatrixError, Unknown, once
from sa_solver import checks
from sa_solver.types import Array, Indices


@dataclass(frozen=True)
class FileUnits:
    """Units of matrices by their size: ``length`` in mm, ``force`` in N, and ``mass`` in t.

    Without a ``mass`` the unit is the mass that the force accelerates by one length per s².

    Examples
    --------
    With m and N the unit of mass is kg:

    >>> from fe_models.matrices import FileUnits
    >>> print(FileUnits(length=1000.0, force=1.0).mass)
    0.001
    """

    length: float = 1.0
    force: float = 1.0
    mass: float = 0.0

    def __post_init__(self) -> None:
        checks.numbers(self, "length", "force", above=0.0, error=MatrixError)
        checks.numbers(self, "mass", least=0.0, error=MatrixError)
        if not self.mass:
            object.__setattr__(self, "mass", self.force / self.length)

    def scales(self, unknowns: Sequence[Unknown]) -> Array:
        """Return S ``(n,)``: unknowns in base units over those of the file."""
        modal = self.length * np.sqrt(self.mass)
        sizes = dict.fromkeys(TRANSLATIONS, self.length) | {MODAL: modal}
        return np.array([sizes.get(unknown.direction, 1.0) for unknown in unknowns])


@dataclass(frozen=True)
class ExternalMatrices:
    """Structure of ``n`` unknowns, given by its matrices.

    Attributes
    ----------
    stiffness, mass, damping
        Matrices ``(n, n)``; the damping may be None.
    loads
        Forces of a load of 1 N ``(n, cases)``.
    unknowns
        Unknowns of the rows ``(n,)``.
    places
        Positions of their points ``(n, 3)`` [mm], if known.
    held
        Unknowns that a file holds and that are left out.
    taken
        Name of the matrix used for each part.
    unused
        Names of the matrices in the files that are not used.
    offered
        Unused matrices that a missing damping or load could be, as ``plant.mat:D``.

    Examples
    --------
    Matrices without files, and the mass that moves along x:

    >>> import numpy as np
    >>> import scipy.sparse as sp
    >>> from fe_models.matrices import ExternalMatrices, Unknown
    >>> unknowns = Unknown("a", "x"), Unknown("b", "x")
    >>> K, M = 1e3 * sp.identity(2, format="csr"), 1e-3 * sp.identity(2, format="csr")
    >>> print(ExternalMatrices(K, M, None, np.zeros((2, 0)), unknowns).moved_mass())
    {'x': 0.002}
    """

    stiffness: sp.csr_matrix
    mass: sp.csr_matrix
    damping: sp.csr_matrix | None
    loads: Array
    unknowns: tuple[Unknown, ...]
    places: Array | None = None
    held: tuple[Unknown, ...] = ()
    taken: Mapping[str, str] | None = None
    unused: tuple[str, ...] = ()
    offered: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        unknowns = once("unknowns", self.unknowns)
        size = len(unknowns)
        found = {
            name: symmetric_matrix(name, getattr(self, name), size)
            for name in (STIFFNESS, MASS, DAMPING)
            if name != DAMPING or self.damping is not None
        }
        loads = checks.array("values of loads", self.loads, (size, None), error=MatrixError)
        checks.settle(self, unknowns=unknowns, loads=loads, **found)
        if self.places is not None:
            places = checks.array("places", self.places, (size, 3), error=MatrixError, finite=False)
            checks.settle(self, places=places)

    def moved_mass(self) -> dict[str, float]:
        """Return the mass [t] that moves along x, y and z if all points move together.

        For a free body it is the whole mass.
        """
        shares = {}
        for axis in TRANSLATIONS:
            along = np.array([float(unknown.direction == axis) for unknown in self.unknowns])
            if along.any():
                shares[axis] = float(along @ (self.mass @ along))
        return shares


@dataclass(frozen=True)
class GivenUnknowns:
    """Information on unknowns in addition to the files.

    Attributes
    ----------
    rows
        Unknowns of the rows ``(n,)`` of matrices in files that do not give them.
    nodes
        Names of points by node, as an alternative.
    places
        Positions of the rows ``(n, 3)``, or by point [mm].

    Examples
    --------
    Rows of a matrix without names, and names of nodes:

    >>> from fe_models.matrices import GivenUnknowns, Unknown
    >>> rows = GivenUnknowns(rows=(Unknown("tip", "x"), Unknown("tip", "rz")))
    >>> nodes = GivenUnknowns(nodes={"17": "tip", "101": "pad 1"})
    """

    rows: tuple[Unknown, ...] | None = None
    nodes: Mapping[str, str] | None = None
    places: Array | Mapping[str, Array] | None = None

    def __post_init__(self) -> None:
        given = self.places
        if given is None or isinstance(given, Mapping):
            return
        rows = None if self.rows is None else len(self.rows)
        places = checks.array("places", given, (rows, 3), error=MatrixError, finite=False)
        checks.settle(self, places=places)


def external_matrices(
    sources: Mapping[str, tuple[Path, str]],
    file: Path | None = None,
    given: GivenUnknowns | None = None,
    units: FileUnits | None = None,
) -> ExternalMatrices:
    """Return matrices from files, in mm, N, s and t.

    Parameters
    ----------
    sources
        File and matrix name for each of the parts stiffness, mass, damping and loads. The name may
        be empty if the file has one matrix or uses usual names.
    file
        File in which other parts are looked for by the usual names.
    given
        Information on the unknowns in addition to the files.
    units
        Units of the files.

    Raises
    ------
    MatrixError
        If stiffness or mass are missing, if matrices do not fit each other or are not real, finite
        and symmetric, or if their unknowns are not known.

    Examples
    --------
    Two masses in a row, in a file of arrays in m, N and kg:

    >>> import tempfile
    >>> from pathlib import Path
    >>> import numpy as np
    >>> from fe_models.matrices import FileUnits, GivenUnknowns, Unknown, external_matrices
    >>> path = Path(tempfile.mkdtemp()) / "row.npz"
    >>> np.savez(path, K=np.array([[2e6, -1e6], [-1e6, 1e6]]), M=np.diag([2.0, 1.0]))
    >>> rows = Unknown("a", "x"), Unknown("b", "x")
    >>> row = external_matrices({}, path, GivenUnknowns(rows), FileUnits(length=1e3))
    >>> print(row.stiffness.toarray(), row.moved_mass(), row.taken)
    [[ 2000. -1000.]
     [-1000.  1000.]] {'x': 0.003} {'stiffness': 'K', 'mass': 'M'}
    """
    for part in sources:
        checks.choice("part of the sources", part, PARTS, MatrixError)
    parts, left, offered = found(sources, None if file is None else Path(file))
    unknowns, places = _unknowns(parts, given or GivenUnknowns())
    held = {unknown for part in parts.values() for unknown in part.file.held}
    size = len(unknowns)
    aligned = {name: _aligned(part, unknowns) for name, part in parts.items()}
    free = np.array([unknown not in held for unknown in unknowns], dtype=bool)
    units = units or FileUnits()
    kept = tuple(unknown for unknown, is_free in zip(unknowns, free, strict=True) if is_free)
    scale = sp.diags(1.0 / units.scales(kept))

    def square(part: str, energy: float) -> sp.csr_matrix | None:
        if part not in aligned:
            return None
        values = symmetric(parts[part], aligned[part], unknowns)
        return energy * (scale @ values[free][:, free] @ scale).tocsr()

    loads = aligned.get(LOADS, sp.csr_matrix((size, 0))).toarray()[free]
    energy = units.force * units.length
    return _named(
        ExternalMatrices(
            _there(square(STIFFNESS, energy)),
            _there(square(MASS, units.mass * units.length**2)),
            square(DAMPING, energy),
            # Loads are per unit force, so the file's unit of force cancels.
            units.length * (scale @ loads),
            kept,
            None if places is None else places[free],
            tuple(sorted(held)),
            {name: part.name for name, part in parts.items()},
            left,
            offered,
        ),
        given,
    )


def _there(matrix: sp.csr_matrix | None) -> sp.csr_matrix:
    assert matrix is not None
    return matrix


# --- unknowns -----------------------------------------------------------------------------------


def _unknowns(
    parts: Mapping[str, Part], given: GivenUnknowns
) -> tuple[tuple[Unknown, ...], Array | None]:
    """Return the unknowns of the rows, and the positions of their points if known."""
    naming = [part for part in parts.values() if part.file.unknowns is not None]
    if given.rows is not None:
        if naming:
            raise MatrixError(
                f"{naming[0].file.path} names its rows itself; allowed: columns node and point, "
                "which name its nodes",
                "unknowns",
            )
        for part in parts.values():
            if part.values.shape[0] != len(given.rows):
                raise MatrixError(
                    f"{len(given.rows)} unknowns for {shape_of(part.values)} in {part.file.path}; "
                    "allowed: one for each row",
                    "unknowns",
                )
        assert not isinstance(given.places, Mapping)
        return once("unknowns", given.rows), given.places
    if len(naming) < len(parts):
        nameless = next(part for part in parts.values() if part.file.unknowns is None)
        raise MatrixError(
            f"{nameless.file.path} does not say what its {nameless.values.shape[0]} rows are; "
            "allowed: unknowns, a CSV file with columns point and direction and a row for each",
            "unknowns",
        )
    all_unknowns = dict.fromkeys(u for part in naming for u in (*_rows(part), *part.file.held))
    files = {part.file.path for part in naming}
    unknowns = tuple(all_unknowns) if len(files) == 1 else tuple(sorted(all_unknowns, key=_order))
    places = next((part.file.places for part in naming if part.file.places is not None), None)
    return unknowns, places if places is not None and len(places) == len(unknowns) else None


def _rows(part: Part) -> tuple[Unknown, ...]:
    unknowns = part.file.unknowns or ()
    if len(unknowns) != part.values.shape[0]:
        raise part.refuse(
            f"{shape_of(part.values)} for {len(unknowns)} unknowns that the file names; allowed: "
            "as many"
        )
    return unknowns


def _order(unknown: Unknown) -> tuple:
    """Return the key that sorts unknowns by node, then by direction."""
    point, direction = unknown.point, DIRECTIONS.index(unknown.direction)
    numbered = point.lstrip("-").isdecimal()
    return (0, int(point), "", direction) if numbered else (1, 0, point, direction)


def _aligned(part: Part, unknowns: tuple[Unknown, ...]) -> sp.csr_matrix:
    """Return the matrix on all unknowns, in their order.

    Raises :class:`MatrixError` if it does not fit.
    """
    rows, size = part.file.unknowns, len(unknowns)
    if rows is None:
        if part.values.shape[0] != size:
            raise part.refuse(f"{shape_of(part.values)}; allowed: {size} rows, as the unknowns")
        return part.values
    if rows == unknowns:
        return part.values
    places: dict[Unknown, int] = {unknown: k for k, unknown in enumerate(unknowns)}
    to: Indices = np.array([places[row] for row in rows], dtype=np.int64)
    entries = sp.coo_matrix(part.values)
    if part.part == LOADS:
        shape, columns = (size, entries.shape[1]), entries.col
    else:
        shape, columns = (size, size), to[entries.col]
    return sp.csr_matrix((entries.data, (to[entries.row], columns)), shape=shape)


def _named(matrices: ExternalMatrices, given: GivenUnknowns | None) -> ExternalMatrices:
    """Return the matrices with the names and positions that are given for nodes."""
    if given is None or given.nodes is None:
        return matrices
    known = {unknown.point for unknown in matrices.unknowns}
    for node in given.nodes:
        if node not in known:
            raise MatrixError(f"node {node}: not in the matrices; allowed: its nodes", "unknowns")
    unknowns = [
        Unknown(given.nodes.get(unknown.point, unknown.point), unknown.direction)
        for unknown in matrices.unknowns
    ]
    places = matrices.places
    if isinstance(given.places, Mapping):
        nowhere = np.full(3, np.nan)
        places = np.array([given.places.get(unknown.point, nowhere) for unknown in unknowns])
    return replace(matrices, unknowns=once("unknowns", unknowns), places=places)
