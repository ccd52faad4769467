"""Loads of the contacts of a wear run: their interface, and sources that wear does not change."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol, Self

import numpy as np

from fe_models.meshes.structure_mesh import Face
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Frame, Grid, Indices
from wear import load_sources
from wear.contact.drive import Drive
from wear.contact.face_loads import CycleLoads, FaceLoads
from workflow.models.checks.names import check_face_name

BODIES: tuple[Literal[1, 2], ...] = (1, 2)
# Without a mesh, the grid that shows the resolution error has cells larger by this factor.
COARSER = 4
# Least number of cells along an axis that can represent a contact.
FEWEST = 8


@dataclass(frozen=True)
class ContactFace:
    """A nominal contact face and the gap of the unloaded, unworn bodies over it.

    Parameters
    ----------
    face : Face
        Nodes and facets at which the loads are known, in the frame of the face.
    size : (float, float)
        Extent of the contact grid along x and y [mm].
    gap : callable
        Returns the distance of the unloaded bodies [mm] at ``x`` ``(n, 1)`` and ``y`` ``(1, m)``.
    coarse : (int, int)
        About as many cells as the face has nodes.
    remedy : str
        Advice if the contact reaches the end of the face, for messages.
    drive : Drive
        Motions that are imposed instead of forces of the loads.

    Examples
    --------
    A cylinder of 10 mm on a flat, of which no mesh is known:

    >>> import fretscale
    >>> gap = lambda x, y: x**2 / 20.0
    >>> face = fretscale.ContactFace.nominal("pad", (1.4, 1.0), gap, line=True)
    >>> print(face.face.name, face.grid((70, 1)).shape)
    pad (70, 1)
    """

    face: Face
    size: tuple[float, float]
    gap: Callable[[Array, Array], Array]
    coarse: tuple[int, int]
    remedy: str = "make the face larger or round its edges"
    drive: Drive = field(default_factory=Drive)

    def __post_init__(self) -> None:
        checks.instances(self, face=Face, gap=Callable, remedy=str, drive=Drive)
        check_face_name(self.face.name)
        check_size("ContactFace.size", self.size, self.face.line)

    @classmethod
    def nominal(
        cls,
        name: str,
        size: tuple[float, float],
        gap: Callable[[Array, Array], Array],
        *,
        line: bool = False,
        drive: Drive | None = None,
    ) -> Self:
        """Return a face without a mesh, of a ``size`` [mm]; its nodes are its corners.

        A ``line`` contact extends along x, with loads per length.
        """
        if not isinstance(line, bool):
            raise InputError(f"line is {checks.shown(line)}: give True or False")
        check_size("size", size, line)
        coarse = FEWEST, 1 if line else FEWEST
        face = nominal_face(name, size, line)
        return cls(face, size, gap, coarse, drive=drive or Drive())

    def grid(self, cells: tuple[int, int]) -> Grid:
        """Return the grid of this many cells along x and y over the face."""
        return Grid.over(self.size, cells, self.face.line)


@dataclass(frozen=True)
class UserFace:
    """Nodes with numbers of the user's mesh, on the face of body 1 or body 2 of an interface.

    They are the nodes of the contact face, or lie at ``points`` ``(n, 3)`` [mm] in the user's axes,
    in which ``frame`` is the frame of the face.
    """

    body: Literal[1, 2]
    numbers: Indices
    frame: Frame
    points: Array | None = None


class LoadSource(load_sources.CycleSource, Protocol):
    """A source of loads for the coupled loop, with the further data that a run needs."""

    @property
    def faces(self) -> tuple[ContactFace, ...]: ...

    @property
    def peak(self) -> int:
        """Index of the increment of peak load."""
        ...

    @property
    def line(self) -> bool:
        """True if the contacts are line contacts, all forces per length."""
        ...

    @property
    def slip_known(self) -> bool:
        """True if the loads include slip and dissipated energy; otherwise both are 0."""
        ...

    def prepare(self) -> None:
        """Carry out the costly part of the computation now."""
        ...

    def unworn(self) -> Sequence[FaceLoads]:
        """Return the closed cycle with unworn faces."""
        ...

    def user_faces(self, number: int) -> Sequence[UserFace]:
        """Return the user's nodes that receive the worn surfaces of interface ``number``."""
        ...


class UncoupledSource(ABC):
    """Base of sources of loads that wear does not change.

    A subclass has the ``faces``, whether they are ``line`` contacts, the increment of ``peak`` load
    and :meth:`unworn`, which returns the closed cycle of loads and slips.

    Examples
    --------
    A cylinder pressed by 50 N/mm that slides by 40 µm in each of two increments:

    >>> import numpy as np
    >>> from sa_solver import LoadHistory, Material
    >>> from wear import ArchardLaw, CycleLoads
    >>> import fretscale
    >>> gap = lambda x, y: x**2 / 20.0
    >>> class Reciprocation(fretscale.UncoupledSource):
    ...     peak, line = 0, True
    ...     faces = (fretscale.ContactFace.nominal("pad", (1.4, 1.0), gap, line=True),)
    ...
    ...     def unworn(self):
    ...         zero, slip = np.zeros(2), np.zeros((2, 2, 2))
    ...         slip[0, 0], slip[1, 0] = 0.04, -0.04
    ...         loads = LoadHistory(zero + 50.0, *[zero] * 7, sliding=zero == 0.0)
    ...         return (CycleLoads(loads, slip),)
    >>> steel, law = Material(210e3, 0.3), ArchardLaw(1e-4, 3000.0)
    >>> contact = fretscale.Contact((160, 1), (steel, steel), (law, law), friction=0.5)
    >>> results = fretscale.WearModel(Reciprocation(), contact, fretscale.Wear(2000.0)).run()
    >>> volume = results["pad"]["volume_1"]
    >>> print(f"{float(volume[-1]):.3e} {volume.attrs['units']}")
    2.667e-04 mm^3/mm
    """

    peak: int
    line: bool
    slip_known: bool = True

    @property
    @abstractmethod
    def faces(self) -> tuple[ContactFace, ...]:
        """The contact faces."""

    @abstractmethod
    def unworn(self) -> tuple[CycleLoads, ...]:
        """Return the closed cycle of each face."""

    def prepare(self) -> None:  # noqa: B027 - nothing is costly here
        """Do nothing: no part of such loads is costly."""

    def worn(
        self, depths: Sequence[Array], friction: Sequence[float] | None = None
    ) -> tuple[CycleLoads, ...]:
        """Return the unworn cycle: no structure responds to wear."""
        return self.unworn()

    def probe(self, depths: Sequence[Array], friction: Sequence[float] | None = None) -> Array:
        """Return the resultants ``(faces, 6)`` at peak load."""
        cycles = self.worn(depths, friction)
        return np.array([cycle.loads.resultants[self.peak] for cycle in cycles])

    def user_faces(self, number: int) -> tuple[UserFace, ...]:
        """Return no faces: the loads have no mesh with the user's node numbers."""
        return ()


def check_size(name: str, size: object, line: bool) -> None:
    """Raise InputError unless ``size`` is an extent along x and y, both above 0 [mm].

    A ``line`` contact uses the first one only.
    """
    lengths = checks.array(f"lengths of {name}", size, (2,), finite=False).tolist()
    for length in lengths[: 1 if line else 2]:
        checks.number(f"a length of {name} [mm]", length, above=0.0)


def nominal_face(
    name: str, size: tuple[float, float], line: bool, frame: Frame | None = None
) -> Face:
    """Return a face of which only the ``size`` [mm] is known: its nodes are its corners."""
    x, y = 0.5 * size[0], 0.5 * size[1]
    corners, facets = [[-x, -y], [x, -y], [x, y], [-x, y]], [[0, 1, 2], [0, 2, 3]]
    if line:
        corners, facets = [[-x, 0.0], [x, 0.0]], [[0, 1]]
    frame = frame or Frame(np.zeros(3), np.eye(3))
    return Face(name, frame, np.array(corners), np.array(facets))


def coarse_cells(nx: float, ny: float, line: bool) -> tuple[int, int]:
    """Return a grid of about nx by ny cells, but enough for a contact."""
    return max(FEWEST, round(nx)), 1 if line else max(FEWEST, round(ny))
