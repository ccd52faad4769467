"""What a file of another program says besides its mesh, as far as a case can say it too."""

from __future__ import annotations

from dataclasses import dataclass, field

from sa_solver.errors import InputError

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class SaidContact:
    """Two faces that touch, and friction between them if the file gives any."""

    faces: tuple[str, str]
    friction: float | None
    line: str


@dataclass(frozen=True)
class SaidSupport:
    """A group whose displacements are held along the axes of the file, such as ``xz``."""

    group: str
    axes: str
    line: str


@dataclass(frozen=True)
class SaidLoad:
    """A load on a group, or on the mass of all bodies, and its factors at the ends of the steps.

    ``kind`` is that of a case's load. ``value`` is a pressure [MPa], or a vector along the axes of
    the file: a force or, as a ``traction``, a force per area; a displacement, an acceleration; of a
    rotation it is the axis times the speed, ``through`` a point.
    """

    kind: str
    group: str
    value: float | Vector
    path: tuple[float, ...]
    line: str
    through: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Scene:
    """Materials by body, contacts, supports and loads of a file, and lines that are neither.

    ``materials`` have ``young`` and ``poisson``, and ``density`` and ``expansion`` where these are
    given, as the file has them, and the line of each. ``steps`` is how many the file goes through;
    ``ignored`` are lines with why a case does not have them.
    """

    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    contacts: tuple[SaidContact, ...] = ()
    supports: tuple[SaidSupport, ...] = ()
    loads: tuple[SaidLoad, ...] = ()
    steps: int = 0
    ignored: tuple[str, ...] = ()


class NotTakenError(InputError):
    """Why a line of a file is ignored."""
