"""A mesh case as a structure."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from fe_models.geometry.imported import ImportedMesh, read_bodies
from fe_models.imported_structure import (
    Acceleration,
    ContactPair,
    Displacement,
    Force,
    Load,
    Pressure,
    Rotation,
    Support,
    imported_mesh,
    imported_structure,
)
from fe_models.mesh import Interface, StructureMesh
from fe_models.structure import Structure
from sa_solver.types import Array
from workflow.case import MeshCase
from workflow.case.mesh_case import (
    AccelerationLoad,
    DisplacementLoad,
    ForceLoad,
    PressureLoad,
    RotationLoad,
)
from workflow.load_source import ContactFace
from workflow.reporter import Reporter

CaseLoad = PressureLoad | ForceLoad | DisplacementLoad | RotationLoad | AccelerationLoad

# Slope at which the bodies part beyond their common face.
PARTING_SLOPE = 1.0
# A point is still on a facet when it is off by this share of it: edges belong to both sides.
INSIDE = 1e-9


class MeshModel:
    """The bodies of the file with supports, loads and cycle as the case gives them."""

    def __init__(self, case: MeshCase) -> None:
        self._case = case
        self.friction = case.friction.coefficient
        path = case.load_path
        self._begun = sum(path.increments[: path.cycle_from - 1])
        self.peak = sum(path.increments[: path.peak_leg]) - 1 - self._begun

    @cached_property
    def imported(self) -> ImportedMesh:
        """Everything in the file."""
        structure = self._case.structure
        return read_bodies(Path(structure.file), structure.size)

    @property
    def key(self) -> tuple[object, ...]:
        structure = self._case.structure
        contents = Path(structure.file).read_bytes()
        loads = [load.model_dump(exclude={"path"}) for load in structure.loads]
        described = structure.model_dump(exclude={"file", "loads"})
        return contents, described, loads, self._case.materials

    @property
    def preload(self) -> Array:
        return self._path()[: self._begun]

    @property
    def amplitudes(self) -> Array:
        return self._path()[self._begun :]

    def _path(self) -> Array:
        """Factors of the loads, ``(t, loads)``; squared where a load is a rotation."""
        legs, loads = self._case.load_path.increments, self._case.structure.loads
        ends = np.insert(np.cumsum(legs), 0, 0)
        steps = np.arange(1, ends[-1] + 1)
        columns = [np.interp(steps, ends, (0.0, *load.path)) for load in loads]
        squared = [isinstance(load, RotationLoad) for load in loads]
        return np.stack([c**2 if s else c for c, s in zip(columns, squared, strict=True)], axis=1)

    def mesh(self) -> StructureMesh:
        structure = self._case.structure
        pairs = [
            ContactPair(pair.name, pair.face_1, pair.face_2, np.array(pair.x))
            for pair in structure.contacts
        ]
        return imported_mesh(self.imported, (structure.body_1, structure.body_2), pairs)

    def structure(self, mesh: StructureMesh) -> Structure:
        case = self._case
        supports = [
            Support(s.group, "xyz" if s.hold == "all" else s.hold) for s in case.structure.supports
        ]
        materials = case.material(1), case.material(2)
        loads = [_load(load) for load in case.structure.loads]
        return imported_structure(
            mesh, self.imported, materials, supports, loads, case.structure.order
        )

    def contact_face(self, interface: Interface) -> ContactFace:
        reach = np.abs(interface.coordinates).max(axis=0)
        size = 2.0 * float(reach[0]), 2.0 * float(reach[1])
        return ContactFace(interface, size, _MeshGap(interface), _coarse(interface, size))

    def warn(self, reporter: Reporter) -> None:
        """Nothing that the solver would not say."""


class _MeshGap:
    """Gap of the meshed faces, linear between nodes; the bodies part beyond them."""

    def __init__(self, interface: Interface) -> None:
        self._face, self._gap = interface, interface.gap

    def __call__(self, x: Array, y: Array) -> Array:
        """Gap ``(nx, ny)`` [mm] at ``x`` ``(nx, 1)`` and ``y`` ``(1, ny)``."""
        gap = self._on_segments(x, y) if self._face.line else self._on_triangles(x, y)
        outside = np.isnan(gap)
        points = np.stack(np.broadcast_arrays(x, y), axis=-1)[outside]
        distance, nearest = cKDTree(self._face.coordinates).query(points)
        gap[outside] = self._gap[nearest] + PARTING_SLOPE * distance
        return gap

    def _on_segments(self, x: Array, y: Array) -> Array:
        gap = np.full((x.size, y.size), np.nan)
        for segment in self._face.facets:
            start, end = self._face.coordinates[segment, 0]
            share = (x.ravel() - start) / (end - start)
            met = (share >= -INSIDE) & (share <= 1.0 + INSIDE)
            ends = self._gap[segment]
            gap[met, 0] = ends[0] + share[met] * (ends[1] - ends[0])
        return gap

    def _on_triangles(self, x: Array, y: Array) -> Array:
        gap = np.full((x.size, y.size), np.nan)
        for triangle in self._face.facets:
            corners = self._face.coordinates[triangle]
            low, high = corners.min(axis=0), corners.max(axis=0)
            i = slice(*np.searchsorted(x.ravel(), (low[0], high[0])))
            j = slice(*np.searchsorted(y.ravel(), (low[1], high[1])))
            arms = np.stack(np.broadcast_arrays(x[i] - corners[0, 0], y[:, j] - corners[0, 1]))
            shares = np.einsum("ab,bij->aij", np.linalg.inv((corners[1:] - corners[0]).T), arms)
            shares = np.concatenate([1.0 - shares.sum(axis=0, keepdims=True), shares])
            met = np.all(shares >= -INSIDE, axis=0)
            gap[i, j][met] = np.einsum("a,an->n", self._gap[triangle], shares[:, met])
        return gap


def _coarse(interface: Interface, size: tuple[float, float]) -> tuple[int, int]:
    """About as many cells as nodes, as square as may be."""
    if interface.line:
        return len(interface), 1
    across = max(int(np.sqrt(len(interface) * size[0] / size[1])), 1)
    return across, max(len(interface) // across, 1)


def _load(load: CaseLoad) -> Load:
    match load:
        case PressureLoad():
            return Pressure(load.group, load.pressure)
        case ForceLoad():
            return Force(load.group, np.array(load.force))
        case DisplacementLoad():
            return Displacement(load.group, np.array(load.displacement))
        case RotationLoad():
            return Rotation(np.array(load.axis), np.array(load.through), load.speed)
        case AccelerationLoad():
            return Acceleration(np.array(load.acceleration))
