"""Where a wear run gets the loads of its contacts from: a structure of ours, or a file."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

from fe_models.meshes.structure_mesh import Face
from sa_solver.types import Array, Frame, Grid, Indices
from wear import load_sources
from wear.contact.drive import Drive
from wear.contact.face_loads import CycleLoads, FaceLoads

BODIES: tuple[Literal[1, 2], ...] = (1, 2)
# Without a mesh, the grid that shows what a coarse one misses has cells so many times larger.
COARSER = 4
# Cells below which a contact is hardly one.
FEWEST = 8


@dataclass(frozen=True)
class ContactFace:
    """A nominal contact face and the gap of the unloaded, unworn bodies over it.

    ``size`` (x, y) [mm] is what the contact grid covers, ``gap`` gives the distance [mm] at x and y
    of the face, and ``coarse`` as many cells as the face has nodes. ``remedy`` is what to do where
    the contact reaches the end of the face. A ``drive`` may impose motions in the place of the
    forces of its loads.
    """

    face: Face
    size: tuple[float, float]
    gap: Callable[[Array, Array], Array]
    coarse: tuple[int, int]
    remedy: str = "make the face larger or round its edges"
    drive: Drive = field(default_factory=Drive)

    def grid(self, cells: tuple[int, int]) -> Grid:
        """The grid of so many cells along x and y over the face."""
        return Grid.over(self.size, cells, self.face.line)


@dataclass(frozen=True)
class UserFace:
    """Nodes that the user has numbered, of the face of body 1 or 2 of an interface.

    They are those of the contact's own face, or lie at ``points`` ``(n, 3)`` [mm] in the user's
    axes, in which the face has its ``frame``.
    """

    body: Literal[1, 2]
    numbers: Indices
    frame: Frame
    points: Array | None = None


class LoadSource(load_sources.LoadSource, Protocol):
    """A source of loads for the coupled loop, with what a run asks of it beside that."""

    @property
    def faces(self) -> tuple[ContactFace, ...]: ...

    @property
    def peak(self) -> int:
        """Index of the increment of peak load."""
        ...

    @property
    def line(self) -> bool:
        """Whether the contacts are line contacts, all forces per length."""
        ...

    @property
    def slip_known(self) -> bool:
        """Whether its loads say how faces slip and what that dissipates; else both are 0 there."""
        ...

    def prepare(self) -> None:
        """Do the costly part now."""
        ...

    def unworn(self) -> Sequence[FaceLoads]:
        """The closed cycle with unworn faces."""
        ...

    def user_faces(self, number: int) -> Sequence[UserFace]:
        """Where the worn surfaces of interface ``number`` go back to nodes of the user's own."""
        ...


class UncoupledSource(ABC):
    """Base of load sources without a structure of ours: nothing to solve, no response to wear."""

    peak: int
    slip_known: bool = True

    def prepare(self) -> None:  # noqa: B027 - nothing is costly here
        """Nothing."""

    @abstractmethod
    def unworn(self) -> tuple[CycleLoads, ...]:
        """The closed cycle."""

    def worn(
        self, depths: Sequence[Array], friction: Sequence[float] | None = None
    ) -> tuple[CycleLoads, ...]:
        """As unworn: no structure responds to wear."""
        return self.unworn()

    def probe(self, depths: Sequence[Array], friction: Sequence[float] | None = None) -> Array:
        """Resultants ``(faces, 6)`` at peak load, whatever the wear."""
        cycles = self.worn(depths, friction)
        return np.array([cycle.loads.resultants[self.peak] for cycle in cycles])


def nominal_face(
    name: str, size: tuple[float, float], line: bool, frame: Frame | None = None
) -> Face:
    """A face of which nothing is known but its ``size`` [mm]: its nodes are its corners."""
    x, y = 0.5 * size[0], 0.5 * size[1]
    corners, facets = [[-x, -y], [x, -y], [x, y], [-x, y]], [[0, 1, 2], [0, 2, 3]]
    if line:
        corners, facets = [[-x, 0.0], [x, 0.0]], [[0, 1]]
    frame = frame or Frame(np.zeros(3), np.eye(3))
    return Face(name, frame, np.array(corners), np.array(facets))


def coarse_cells(nx: float, ny: float, line: bool) -> tuple[int, int]:
    """About so many cells along x and y, but enough for a contact."""
    return max(FEWEST, round(nx)), 1 if line else max(FEWEST, round(ny))
