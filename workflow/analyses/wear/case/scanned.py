"""Measured surfaces on the contact faces of a wear case, in addition to their nominal form."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from sa_solver.surfaces.scans import rms
from sa_solver.types import Array, Grid
from workflow.analyses.contact.surfaces import LOST, SurfacesOfTwo
from workflow.case.sections import disagreement
from workflow.case.text.plain import plain
from workflow.messages.warning_kinds import Notice

if TYPE_CHECKING:
    from fe_models.meshes.structure_mesh import Interface
    from fe_models.meshes.transfer import FaceTransfer
    from workflow.models.gaps import GapFunction

# Least number of cells per facet. With 1.5 cells, nodal forces under a cylinder had errors of up to
# 4 % of the largest force, with 4 cells 0.02 %. The steps between cells cause an error of a
# hundredth of the rise over a facet.
IN_A_FACET = 8
# Heights may differ by this share of their range across a symmetry plane, as files are rounded.
MIRRORED = 1e-6


@dataclass(frozen=True)
class ScannedFace:
    """A contact ``name`` with measured ``surfaces``, given at the entry ``key``, and its ``grid``.

    ``face`` has the nodes of a finite element structure, and planes of symmetry may cut it; the
    grid covers the whole face. It is None without a structure.
    """

    name: str
    key: str
    surfaces: SurfacesOfTwo
    grid: Grid
    face: Interface | None = None

    def at_nodes(self) -> Array:
        """Return the surfaces' part of the gap at the nodes ``(n,)`` [mm], fitted with the facets.

        The fit preserves means under the shape functions of the nodes, as a grid preserves cell
        means.
        """
        assert self.face is not None
        # The nodes of the meshed part come first among those of the whole face.
        return self._fine.fitted(self.surfaces.gap(self._fine.grid))[: len(self.face)]

    def at_nodes_of(self, face: Interface) -> Array:
        """Return :meth:`at_nodes` for the face of another mesh."""
        return replace(self, face=face).at_nodes()

    @property
    def over(self) -> GapFunction:
        """Gap of the surfaces on the cells of any grid over the face."""
        from workflow.analyses.wear.gaps import MeasuredHeights

        return MeasuredHeights(self.surfaces, self.grid)

    @cached_property
    def _fine_grid(self) -> Grid:
        """Grid so fine that the steps between its cells are negligible compared with the facets."""
        face, grid = self.face, self.grid
        assert face is not None
        facets = np.median(np.ptp(face.coordinates[face.facets], axis=1), axis=0)
        axes = zip(grid.shape, grid.pitch, facets, strict=True)
        nx, ny = (n * ceil(IN_A_FACET * pitch / facet) if facet else n for n, pitch, facet in axes)
        return Grid.over(grid.size, (nx, ny), grid.line)

    @cached_property
    def _fine(self) -> FaceTransfer:
        """Transfer from the fine grid to the nodes of the whole face."""
        from fe_models.meshes.cut_face import whole_face
        from fe_models.meshes.transfer import FaceTransfer

        assert self.face is not None
        return FaceTransfer.between(whole_face(self.face), self._fine_grid)

    def check_mirrored(self) -> None:
        """Refuse surfaces that are not symmetric about the planes that cut the face."""
        face = self.face
        if face is None or not face.planes:
            return
        for name, on in self.surfaces.on(self._fine_grid).items():
            for axis in face.planes:
                apart = float(np.abs(on.heights - np.flip(on.heights, axis)).max())
                if apart > MIRRORED * np.ptp(on.heights):
                    raise disagreement(
                        f"{self.surfaces.bodies[name].file}: not symmetric about the plane of "
                        f"symmetry across {'xy'[axis]} that cuts the face: it differs by up to "
                        f"{plain(apart, 'mm', 3)}; allowed: symmetric heights, or a mesh of the "
                        "whole face",
                        f"{self.key}.{name}.file",
                    )

    def summary(self) -> dict[str, Any]:
        """Return the numbers of each body's surface, in base units, and the part lost at nodes."""
        numbers = self.surfaces.summary(self.grid)
        if self.face is not None:
            for name, on in self.surfaces.on(self._fine_grid).items():
                numbers[name]["lost_by_nodes"] = self._lost_by_nodes(on.heights)
        return numbers

    def _lost_by_nodes(self, heights: Array) -> float:
        """Return the rms [mm] of the part of ``heights`` ``(nx, ny)`` that facets do not follow."""
        left = heights - self._fine.to_cells(self._fine.fitted(heights))
        return rms(np.where(self._fine.inside, left, np.nan))

    def outline(self) -> Iterator[tuple[str, str]]:
        """Yield a row for each body's surface."""
        for name, text in self.surfaces.reported(self.summary()).items():
            yield f"surface {name.removeprefix('body_')}", f"{self.name}: {text}"

    def plausibility_warnings(self) -> Iterator[Notice]:
        """Yield plausibility warnings about units and a grid too coarse for the roughness."""
        yield from self.surfaces.plausibility_warnings(self.grid, self.key)

    def finer_than_nodes(self, rest: str) -> Iterator[str]:
        """Yield a remark on each surface finer than the nodes; ``rest`` says what resolves it."""
        for name, numbers in self.summary().items():
            lost, height = numbers["lost_by_nodes"], numbers["rms"]
            if lost > LOST * height:
                yield (
                    f"{self.name}, {name.replace('_', ' ')}: the nodes of the face lose "
                    f"{plain(lost, 'mm', 3)} of the measured surface, {plain(height, 'mm', 3)} "
                    "rms, because it is finer than they are: they get the mean around each of "
                    f"them; {rest}"
                )


class WithScans:
    """Reports of a case on faces with measured surfaces; by default there are none."""

    def scanned(self) -> Iterator[ScannedFace]:
        """Yield the faces with measured surfaces."""
        yield from ()

    def surfaces_summary(self) -> dict[str, Any]:
        """Return the summary's entry on measured surfaces; empty if there are none."""
        faces = {face.name: face.summary() for face in self.scanned()}
        return {"surfaces": faces} if faces else {}

    def surface_warnings(self) -> Iterator[Notice]:
        """Yield the plausibility warnings about measured surfaces."""
        for face in self.scanned():
            yield from face.plausibility_warnings()

    def finer_than_nodes(self, rest: str) -> Iterator[str]:
        """Yield remarks on surfaces finer than the nodes; ``rest`` says what resolves them."""
        for face in self.scanned():
            yield from face.finer_than_nodes(rest)
