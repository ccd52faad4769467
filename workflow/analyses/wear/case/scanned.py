"""Surfaces as measured on the contact faces of a wear case, beside the form of these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from sa_solver.surfaces.scans import rms
from sa_solver.types import Array, Grid
from workflow.analyses.contact.surfaces import LOST, SurfacesOfTwo
from workflow.case.plain import plain
from workflow.case.sections import disagreement

if TYPE_CHECKING:
    from fe_models.meshes.structure_mesh import Interface
    from fe_models.meshes.transfer import FaceTransfer
    from workflow.models.gaps import GapFunction

# Cells along a facet at least: with one and a half of them nodal forces under a cylinder were up to
# 4 % of the largest off, with four 0.02 %. Their steps leave a hundredth of the rise over a facet.
IN_A_FACET = 8
# Heights on both sides of a plane of symmetry may differ by this share of their range: files round.
MIRRORED = 1e-6


@dataclass(frozen=True)
class ScannedFace:
    """A contact of this ``name`` whose entry ``key`` has ``surfaces``, and its ``grid``.

    ``face`` has the nodes on which a structure of ours meets, which planes of symmetry may cut; the
    grid covers the whole of it. None without one.
    """

    name: str
    key: str
    surfaces: SurfacesOfTwo
    grid: Grid
    face: Interface | None = None

    def at_nodes(self) -> Array:
        """What they add to the gap at the nodes ``(n,)`` [mm], as near as facets come to it.

        Means under the nodes' shape functions are kept, as those of cells are on a grid.
        """
        assert self.face is not None
        # Of a whole face the nodes of the part that is meshed come first.
        return self._fine.fitted(self.surfaces.gap(self._fine.grid))[: len(self.face)]

    @property
    def over(self) -> GapFunction:
        """The gap of the surfaces on the cells of any grid over the face."""
        from workflow.analyses.wear.gaps import MeasuredHeights

        return MeasuredHeights(self.surfaces, self.grid)

    @cached_property
    def _fine_grid(self) -> Grid:
        """One so fine that the steps of its cells hardly count beside the facets."""
        face, grid = self.face, self.grid
        assert face is not None
        facets = np.median(np.ptp(face.coordinates[face.facets], axis=1), axis=0)
        axes = zip(grid.shape, grid.pitch, facets, strict=True)
        nx, ny = (n * ceil(IN_A_FACET * pitch / facet) if facet else n for n, pitch, facet in axes)
        return Grid.over(grid.size, (nx, ny), grid.line)

    @cached_property
    def _fine(self) -> FaceTransfer:
        """From that grid to the nodes of the whole face."""
        from fe_models.meshes.cut_face import whole_face
        from fe_models.meshes.transfer import FaceTransfer

        assert self.face is not None
        return FaceTransfer.between(whole_face(self.face), self._fine_grid)

    def check_mirrored(self) -> None:
        """Refuse those that are not their own image across the planes that cut the face."""
        face = self.face
        if face is None or not face.planes:
            return
        for name, on in self.surfaces.on(self._fine_grid).items():
            for axis in face.planes:
                apart = float(np.abs(on.heights - np.flip(on.heights, axis)).max())
                if apart > MIRRORED * np.ptp(on.heights):
                    raise disagreement(
                        f"{self.surfaces.bodies[name].file}: not the same on both sides of the "
                        f"plane of symmetry across {'xy'[axis]} that cuts the face, by up to "
                        f"{plain(apart, 'mm', 3)}; allowed: heights that are, or a mesh of the "
                        "whole face",
                        f"{self.key}.{name}.file",
                    )

    def summary(self) -> dict[str, Any]:
        """Numbers of each body's, in base units; with nodes, what these do not carry."""
        numbers = self.surfaces.summary(self.grid)
        if self.face is not None:
            for name, on in self.surfaces.on(self._fine_grid).items():
                numbers[name]["lost_by_nodes"] = self._lost_by_nodes(on.heights)
        return numbers

    def _lost_by_nodes(self, heights: Array) -> float:
        """Root mean square [mm] of ``heights`` ``(nx, ny)`` that the facets do not follow."""
        left = heights - self._fine.to_cells(self._fine.fitted(heights))
        return rms(np.where(self._fine.inside, left, np.nan))

    def outline(self) -> Iterator[tuple[str, str]]:
        """A row for each body's surface."""
        for name, text in self.surfaces.told(self.summary()).items():
            yield f"surface {name.removeprefix('body_')}", f"{self.name}: {text}"

    def doubts(self) -> Iterator[str]:
        """About units, and a grid that does not carry the roughness."""
        yield from self.surfaces.doubts(self.grid, self.key)

    def finer_than_nodes(self, rest: str) -> Iterator[str]:
        """What the nodes of the structure do not carry; ``rest`` says what does."""
        for name, numbers in self.summary().items():
            lost, height = numbers["lost_by_nodes"], numbers["rms"]
            if lost > LOST * height:
                yield (
                    f"{self.name}, {name.replace('_', ' ')}: {plain(lost, 'mm', 3)} of the surface "
                    f"as measured, {plain(height, 'mm', 3)} rms, is finer than the nodes of the "
                    f"face, which have means about them; {rest}"
                )


class WithScans:
    """What cases tell of contact faces that have surfaces as measured; they are none here."""

    def scanned(self) -> Iterator[ScannedFace]:
        """These faces."""
        yield from ()

    def told_surfaces(self) -> dict[str, Any]:
        """What the summary has of surfaces as measured; nothing where there are none."""
        faces = {face.name: face.summary() for face in self.scanned()}
        return {"surfaces": faces} if faces else {}

    def surface_doubts(self) -> Iterator[str]:
        """About surfaces as measured, for a run to warn of."""
        for face in self.scanned():
            yield from face.doubts()

    def finer_than_nodes(self, rest: str) -> Iterator[str]:
        """What of them is finer than the nodes of a structure; ``rest`` says what has it."""
        for face in self.scanned():
            yield from face.finer_than_nodes(rest)
