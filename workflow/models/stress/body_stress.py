"""Stress of one body under its contact: a section at peak load, a history at a depth.

Tractions on the fine grid load a half-space; a structure adds the stress that it carries past the
contact. On the face and just below it, that part follows from the motion of the nodes
(:mod:`wear.cracking.bulk_stress`). From the depth of one element on, it is the stress of the mesh
minus that of half-spaces under the nodal forces: there the total is the stress of the mesh, because
fine tractions and nodal forces have nearly the same effect.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fe_models.meshes.cut_face import WholeStress
from sa_solver.half_space import subsurface
from sa_solver.half_space.subsurface import SubsurfaceStress
from sa_solver.types import Array, Grid, Mask, Material
from wear.contact.face_loads import FaceLoads
from wear.contact.sticking import with_sticking_shear
from wear.contact.tractions import CycleTractions
from wear.cracking.bulk_stress import SIDE, BodyFace, BulkStress
from wear.cracking.life import tension_along
from workflow.models.contact import FaceContact
from workflow.models.stress.settings import Stress


class Planes:
    """Places of computed stress: the points of the section and the depth of the maps."""

    def __init__(self, settings: Stress, grid: Grid) -> None:
        self.settings = settings
        self.grid = grid
        centres = grid.x.ravel(), grid.y.ravel()
        self._along = 1 if settings.section == "y" else 0
        self.along, across = centres[self._along], centres[1 - self._along]
        self._row = int(np.argmin(np.abs(across - settings.at)))
        self.at = float(across[self._row])
        first, share = settings.critical_distance, np.linspace(0.0, 1.0, settings.points)
        self.depths: Array = first + (settings.depth - first) * share**2

    def sections(self, wanted: Sequence[tuple[SubsurfaceStress, Array, Array]]) -> list[Array]:
        """Return stresses ``(6, n, k)`` in the section, per solver, tractions and depths.

        See :func:`sa_solver.half_space.subsurface.sections`.
        """
        return subsurface.sections(wanted, "y" if self._along else "x", self.at)

    def row(self, values: np.ndarray) -> np.ndarray:
        """Return the section's values ``(c, n, 1)`` of those at all cells ``(c, nx, ny)``."""
        return np.expand_dims(np.take(values, self._row, axis=2 - self._along), -1)

    def points(self, heights: Array) -> Array:
        """Return the section's points at ``heights`` ``(k,)`` in the frame ``(n k, 3)`` [mm]."""
        along, z = (axis.ravel() for axis in np.meshgrid(self.along, heights, indexing="ij"))
        across = np.full_like(along, self.at)
        return np.stack([across, along, z] if self._along else [along, across, z], axis=1)


@dataclass(frozen=True)
class StressedCycle:
    """One contact over a cycle: tractions, loads, and the structure's solution near it.

    ``tractions`` lie on the grid and belong to the ``loads``. With a structure there are also the
    displacements ``(t, 3, n)`` [mm] of the ``faces`` of both bodies, the stress ``fields`` of both
    at peak load and, where temperatures change, the ``expansions`` ``(t, 2, n)`` of the faces, with
    their slopes along z [1/mm].
    """

    tractions: CycleTractions
    loads: FaceLoads
    faces: tuple[Array, Array] | None = None
    fields: tuple[WholeStress, WholeStress] | None = None
    expansions: tuple[Array, Array] | None = None

    def traction(self, t: int) -> Array:
        """Return the tractions qx, qy, p of increment ``t`` ``(3, nx, ny)`` [MPa]."""
        return np.concatenate([self.tractions.shear[t], self.tractions.pressure[t, None]])


def with_known_shear(stage: FaceContact, cycle: CycleTractions, loads: FaceLoads) -> CycleTractions:
    """Return tractions with the shear of sticking areas, if the nodal loads provide it."""
    if loads.force is None or not cycle.unknown.any():
        return cycle
    nodal = stage.transfer.spread(loads.force)
    return with_sticking_shear(cycle, nodal, stage.grid.cell_area)


class StressedBody:
    """Body 1 or 2 under the contact of a ``stage``."""

    def __init__(self, stage: FaceContact, material: Material, number: Literal[1, 2]) -> None:
        self.material, self.number = material, number
        self._stage = stage
        # The solver caches the coefficients of one depth, so one solver serves unworn and worn
        # states.
        self._solver = SubsurfaceStress(stage.grid, material, number)
        self._face = BodyFace(stage.grid, stage.transfer, material, number)
        # Where bodies overhang, the contact face extends to the end of an element.
        self._on_face = stage.transfer.inside & stage.transfer_of(number).inside

    @property
    def convolutions(self) -> int:
        """Number of convolutions so far."""
        return self._solver.count + self._face.half_space.count

    def bulk(self, cycle: StressedCycle) -> BulkStress | None:
        """Return the stress that the structure carries past the contact, or None if unknown."""
        if cycle.faces is None or cycle.loads.force is None:
            return None
        moved = cycle.faces[self.number - 1]
        expansion = cycle.expansions and cycle.expansions[self.number - 1]
        return self._face.bulk_stress(cycle.loads.loads, cycle.loads.force, moved, expansion)

    def history(
        self, cycle: StressedCycle, bulk: BulkStress | None, depth: float, known: Mask
    ) -> Array:
        """Return stress ``(t, 6, nx, ny)`` at ``depth``; 0 in increments not ``known`` ``(t,)``.

        It is 0 outside the body. Without a structure it is the stress due to the contact alone.
        """
        stress = np.zeros((len(known), 6, *self._stage.grid.shape))
        if bulk is not None:
            stress += bulk.at(self._stage.transfer.places, depth)
        for t in self._acting(cycle, known):
            stress[t] += self._solver.at_depth(cycle.traction(t), depth)
        stress[~known] = 0.0
        stress[:, :, ~self._below(cycle, depth)] = 0.0
        return stress

    def tension(
        self, cycle: StressedCycle, bulk: BulkStress | None, depth: float, known: Mask
    ) -> Array:
        """Return the largest tension along the face in that history ``(nx, ny)`` [MPa], or 0."""
        tension = np.zeros(self._stage.grid.shape)
        carried = np.zeros((len(known), 3, *tension.shape))
        if bulk is not None:
            carried = bulk.along_face(self._stage.transfer.places, depth)
        acting = self._acting(cycle, known)
        for t in np.flatnonzero(known).tolist():
            stress = carried[t]
            if t in acting:
                stress = stress + self._solver.along_surface(cycle.traction(t), depth)
            np.maximum(tension, tension_along(*stress), out=tension)
        tension[~self._below(cycle, depth)] = 0.0
        return tension

    def _acting(self, cycle: StressedCycle, known: Mask) -> list[int]:
        """Return the ``known`` increments in which tractions act."""
        pressed = cycle.tractions.pressure.any(axis=(1, 2))
        return np.flatnonzero(known & pressed).tolist()

    def _below(self, cycle: StressedCycle, depth: float) -> Mask:
        """Return the mask of cells ``(nx, ny)`` with the body below them at ``depth``."""
        grid = self._stage.grid
        x, y = grid.centres.reshape(2, -1)
        places = np.stack([x, y, np.full_like(x, SIDE[self.number] * depth)], axis=1)
        there = self._there(cycle, places, self._on_face.ravel())
        return there.reshape(grid.shape)

    def _there(self, cycle: StressedCycle, points: Array, on_face: Mask) -> Mask:
        """Return the mask of ``points`` ``(n, 3)`` below the contact face or inside the mesh.

        A face need not be flat: points ``on_face`` ``(n,)`` are taken as inside the body at any
        small depth. Without a mesh all points count as inside.
        """
        there = np.ones_like(on_face)
        if cycle.fields is not None and not on_face.all():
            field, frame = cycle.fields[self.number - 1], self._stage.face.frame
            there = on_face.copy()
            there[~on_face] = np.isfinite(field.at(points[~on_face], frame)[0])
        return there

    def section(
        self, cycle: StressedCycle, bulk: BulkStress | None, planes: Planes, peak: int
    ) -> Array:
        """Return stress ``(6, n, k)`` in the section at peak load, as :func:`sections` does."""
        return sections([(self, cycle, bulk)], planes, peak)[0]

    def section_parts(
        self, cycle: StressedCycle, bulk: BulkStress | None, planes: Planes, peak: int
    ) -> tuple[list[tuple[SubsurfaceStress, Array, Array]], Callable[[list[Array]], Array]]:
        """Return the half-space problems for :func:`sections`, and how to combine the solutions."""
        fine, solver = cycle.traction(peak), self._solver
        if bulk is None or cycle.fields is None or cycle.loads.force is None:
            return [(solver, fine, planes.depths)], lambda contact: contact[0]
        face, field, places = self._stage.face, cycle.fields[self.number - 1], planes.points
        whole = field.body.depth(face.name)
        near, below = np.split(planes.depths, [np.searchsorted(planes.depths, whole)])
        heights = SIDE[self.number] * np.append(whole, below)
        nodal = self._stage.transfer.spread(cycle.loads.force[peak])
        row = planes.row(self._stage.transfer.places)
        surface = bulk.increment(peak).at(row, np.append(whole, near))[0]

        def joined(contact: list[Array]) -> Array:
            of_nodal, shallow, deep = contact
            mesh = field.at(places(heights), face.frame).reshape(6, -1, len(heights))
            # Where the mesh ends above that depth, only the face provides the stress.
            bend = np.nan_to_num(mesh[..., :1] - of_nodal - surface[..., :1])
            shallow = shallow + surface[..., 1:] + bend * (near / whole) ** 2
            on_face = np.repeat(planes.row(self._on_face[None])[0], len(near), axis=1)
            there = self._there(cycle, places(SIDE[self.number] * near), on_face.ravel())
            shallow[:, ~there.reshape(on_face.shape)] = np.nan
            return np.concatenate([shallow, deep + mesh[..., 1:]], axis=2)

        wanted = [(nodal, np.array([whole])), (fine, near), (fine - nodal, below)]
        return [(solver, *tractions) for tractions in wanted], joined


Stressed = tuple[StressedBody, StressedCycle, BulkStress | None]
"""A body, the data of its contact over a cycle, and the stress carried past the contact."""


def sections(stressed: Sequence[Stressed], planes: Planes, peak: int) -> list[Array]:
    """Return stress ``(6, n, k)`` of each body in the section at peak load; nan outside the body.

    Without a structure it is the stress due to the contact alone. From the depth h of one element
    on, it is the stress of the mesh plus that of half-spaces under the difference of fine tractions
    and nodal forces. Above h, the part that is not due to the contact has the value and slope of
    the face at the surface and meets its value at h. Common influence coefficients are shared.
    """
    parts = [body.section_parts(cycle, bulk, planes, peak) for body, cycle, bulk in stressed]
    found = iter(planes.sections([part for tractions, _ in parts for part in tractions]))
    return [joined([next(found) for _ in tractions]) for tractions, joined in parts]
