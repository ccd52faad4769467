"""Unknowns of a matrix by name, the error of its readers, and what a file of matrices has."""

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
# Those that nodes have by their numbers 1 to 6, in Abaqus and in Nastran.
BY_NUMBER = (*TRANSLATIONS, *ROTATIONS)
DIRECTIONS = (*BY_NUMBER, MODAL)

Values: TypeAlias = Array | sp.csr_matrix


class MatrixError(InputError):
    """Matrices that cannot be taken; ``part`` says which entry they were asked for by, if one."""

    def __init__(self, message: str, part: str = "") -> None:
        super().__init__(message)
        self.part = part


class Unknown(NamedTuple):
    """A displacement of a ``point``: along x, y or z, about them (rx, ry, rz), or of a mode.

    Examples
    --------
    The rotation of node 17 about z, and a coordinate of a superelement that is no displacement:

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
    """What a file at ``path`` has of matrices, each read when it is asked for.

    ``matrices`` by name, "" where the format has no names. Where the file says them, ``unknowns``
    are those of the rows of all of them, ``places`` ``(n, 3)`` of their points, and ``held`` those
    that the file holds.

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
    """What a name such as ``pad 17 x`` says. Raises :class:`MatrixError`."""
    point, _, direction = name.strip().rpartition(" ")
    if not point or direction not in DIRECTIONS:
        raise MatrixError(
            f"{name!r}: no name of an unknown; allowed: a point and one of "
            f"{', '.join(DIRECTIONS)}, such as 'pad 17 x'"
        )
    return Unknown(point, direction)


def by_number(place: object, node: int, component: int) -> Unknown:
    """The unknown of a component 1 to 6 of a node; 0 is that of a scalar point, a mode."""
    if component == 0:
        return Unknown(str(node), MODAL)
    if not 1 <= component <= len(BY_NUMBER):
        raise MatrixError(
            f"{place}: degree of freedom {component}; allowed: displacements 1 to 3 and rotations "
            "4 to 6"
        )
    return Unknown(str(node), BY_NUMBER[component - 1])


def once(place: object, unknowns: Sequence[Unknown]) -> tuple[Unknown, ...]:
    """The same unknowns. Raises :class:`MatrixError` where one is there twice."""
    seen: set[Unknown] = set()
    for unknown in unknowns:
        if unknown in seen:
            raise MatrixError(f"{place}: {unknown.name}: twice; allowed: every unknown once")
        seen.add(unknown)
    return tuple(unknowns)


def number(place: object, text: str) -> float:
    """A number as Fortran writes it. Raises :class:`MatrixError`."""
    try:
        value = fortran_real(text)
    except ValueError:
        raise MatrixError(f"{place}: {text.strip()!r} is no number; allowed: numbers") from None
    if not np.isfinite(value):
        raise MatrixError(f"{place}: {text.strip()!r}; allowed: finite numbers")
    return value


def whole(place: object, text: str) -> int:
    """A whole number of a label or a place. Raises :class:`MatrixError`."""
    try:
        return int(text)
    except ValueError:
        raise MatrixError(
            f"{place}: {text.strip()!r} is no whole number; allowed: whole numbers"
        ) from None


def mirrored(given: sp.coo_matrix) -> sp.csr_matrix:
    """A symmetric matrix of entries in either triangle, of each pair one."""
    both = given + given.T
    return (both - sp.diags(given.diagonal())).tocsr()
