"""Surfaces as measured on the contact faces of a wear case, beside the form of these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from sa_solver.scans import rms
from sa_solver.types import Array, Grid
from workflow.analyses.contact.surfaces import MeasuredSurfaces

if TYPE_CHECKING:
    from fe_models.mesh import Face
    from fe_models.transfer import FaceTransfer

# Cells along a facet at least: with one and a half of them nodal forces under a cylinder were up to
# 4 % of the largest off, with four 0.02 %. Their steps leave a hundredth of the rise over a facet.
IN_A_FACET = 8


@dataclass(frozen=True)
class ScannedFace:
    """A contact of this ``name`` whose entry ``key`` has ``surfaces``, and its ``grid``.

    ``face`` has the nodes on which a structure of ours meets; None without one.
    """

    name: str
    key: str
    surfaces: MeasuredSurfaces
    grid: Grid
    face: Face | None = None

    def at_nodes(self) -> Array:
        """What they add to the gap at the nodes ``(n,)`` [mm], as near as facets come to it.

        Means under the nodes' shape functions are kept, as those of cells are on a grid.
        """
        return self._fine.fitted(self.surfaces.gap(self._fine.grid))

    @cached_property
    def _fine(self) -> FaceTransfer:
        """To the nodes from a grid so fine that the steps of its cells hardly count."""
        from fe_models.transfer import FaceTransfer

        face, grid = self.face, self.grid
        assert face is not None
        facets = np.median(np.ptp(face.coordinates[face.facets], axis=1), axis=0)
        axes = zip(grid.shape, grid.pitch, facets, strict=True)
        nx, ny = (n * ceil(IN_A_FACET * pitch / facet) if facet else n for n, pitch, facet in axes)
        return FaceTransfer.between(face, Grid.over(grid.size, (nx, ny), grid.line))

    def summary(self) -> dict[str, Any]:
        """Numbers of each body's, in base units; with nodes, what these do not carry."""
        numbers = self.surfaces.summary(self.grid)
        if self.face is not None:
            for name, on in self.surfaces.on(self._fine.grid).items():
                numbers[name]["lost_by_nodes"] = self._lost_by_nodes(on.heights)
        return numbers

    def _lost_by_nodes(self, heights: Array) -> float:
        """Root mean square [mm] of ``heights`` ``(nx, ny)`` that the facets do not follow."""
        left = heights - self._fine.to_cells(self._fine.fitted(heights))
        return rms(np.where(self._fine.inside, left, np.nan))

    def outline(self) -> Iterator[tuple[str, str]]:
        """A row for each body's surface."""
        for name, text in self.surfaces.told(self.summary()).items():
            yield f"surface {name[-1]}", f"{self.name}: {text}"

    def doubts(self) -> Iterator[str]:
        """About units, and a grid that does not carry the roughness."""
        yield from self.surfaces.doubts(self.grid, self.key)
