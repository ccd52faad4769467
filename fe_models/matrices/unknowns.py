"""Unknowns of a matrix by name, the error of its readers, and the content of a matrix file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
import scipy.sparse as sp

from fe_models.readers.nastran.cards import fortran_real
from sa_solver.errors import InputError
from sa_solver.types import Array

TRANSLATIONS, ROTATIONS, MODAL = ("x", "y", "z"), ("rx", "ry", "rz"), "modal"
# Directions in the order of their numbers 1 to 6 in Abaqus and in Nastran.
BY_NUMBER = (*TRANSLATIONS, *ROTATIONS)
DIRECTIONS = (*BY_NUMBER, MODAL)
# Largest number of names listed in a message.
MOST_LISTED = 12

Values: TypeAlias = Array | sp.csr_matrix


class MatrixError(InputError):
    """Error of matrices that cannot be used.

    ``part`` is the entry by which they were requested, if any.
    """

    def __init__(self, message: str, part: str = "") -> None:
        super().__init__(message)
        self.part = part


def listed_names(names: Sequence[str]) -> str:
    """Return names as text that fits into one line."""
    more = f" and {len(names) - MOST_LISTED} more" if len(names) > MOST_LISTED else ""
    return ", ".join(names[:MOST_LISTED]) + more


class Unknown(NamedTuple):
    """Displacement of a ``point``: along x, y or z, about them (rx, ry, rz), or of a mode.

    Examples
    --------
    The rotation of node 17 about z, and a coordinate of a superelement that is not a displacement:

    >>> from fe_models.matrices import Unknown
    >>> print(Unknown("17", "rz").name, "|", Unknown("mode 1", "modal").name)
    17 rz | mode 1 modal
    """

    point: str
    direction: str

    @property
    def name(self) -> str:
        """Point and direction, as in ``pad 17 x``."""
        return f"{self.point} {self.direction}"


@dataclass(frozen=True)
class MatrixFile:
    """Content of a file of matrices at ``path``, each of which is read on demand.

    Attributes
    ----------
    path
        The file.
    matrices
        Functions that read the matrices, by name; "" if the format has no names.
    unknowns
        Unknowns of the rows of all matrices, if the file gives them.
    places
        Positions of their points ``(n, 3)``, if the file gives them.
    held
        Unknowns that the file holds.

    Examples
    --------
    >>> from fe_models.matrices import read_matrix_file
    >>> import numpy as np, pathlib, tempfile
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "two.npz"
    >>> np.savez(path, K=np.eye(2), names=["tip x", "tip rz"])
    >>> file = read_matrix_file(path)
    >>> print(list(file.matrices), file.unknowns[1].name, file.held)
    ['K'] tip rz frozenset()
    """

    path: Path
    matrices: Mapping[str, Callable[[], Values]]
    unknowns: tuple[Unknown, ...] | None = None
    places: Array | None = None
    held: frozenset[Unknown] = field(default_factory=frozenset)


def unknown_of(name: str) -> Unknown:
    """Return the unknown with a name such as ``pad 17 x``. Raises :class:`MatrixError`."""
    point, _, direction = name.strip().rpartition(" ")
    if not point or direction not in DIRECTIONS:
        raise MatrixError(
            f"{name!r}: not the name of an unknown; allowed: a point and one of "
            f"{', '.join(DIRECTIONS)}, such as 'pad 17 x'"
        )
    return Unknown(point, direction)


def by_number(place: object, node: int, component: int) -> Unknown:
    """Return the unknown of a component 1 to 6 of a node; 0 stands for a scalar point, a mode."""
    if component == 0:
        return Unknown(str(node), MODAL)
    if not 1 <= component <= len(BY_NUMBER):
        raise MatrixError(
            f"{place}: degree of freedom {component}; allowed: displacements 1 to 3 and rotations "
            "4 to 6"
        )
    return Unknown(str(node), BY_NUMBER[component - 1])


def once(place: object, unknowns: Sequence[Unknown]) -> tuple[Unknown, ...]:
    """Return the unknowns. Raises :class:`MatrixError` if one occurs twice."""
    seen: set[Unknown] = set()
    for unknown in unknowns:
        if unknown in seen:
            raise MatrixError(f"{place}: {unknown.name}: twice; allowed: every unknown once")
        seen.add(unknown)
    return tuple(unknowns)


def number(place: object, text: str) -> float:
    """Return a number in Fortran's forms. Raises :class:`MatrixError`."""
    try:
        value = fortran_real(text)
    except ValueError:
        raise MatrixError(f"{place}: {text.strip()!r} is not a number; allowed: numbers") from None
    if not np.isfinite(value):
        raise MatrixError(f"{place}: {text.strip()!r}; allowed: finite numbers")
    return value


def whole(place: object, text: str) -> int:
    """Return a whole number of a label or a position. Raises :class:`MatrixError`."""
    try:
        return int(text)
    except ValueError:
        raise MatrixError(
            f"{place}: {text.strip()!r} is not a whole number; allowed: whole numbers"
        ) from None


def mirrored(given: sp.coo_matrix) -> sp.csr_matrix:
    """Return the symmetric matrix of entries in either triangle, one of each pair."""
    both = given + given.T
    return (both - sp.diags(given.diagonal())).tocsr()
