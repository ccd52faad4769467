"""Translation of a mesh case into a model of its structure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from fe_models.elasticity.relinearised import Softening
from fe_models.imported_structure import imported_softening, imported_structure
from fe_models.loads.pretension import Bolt, Pretension, bolt_section
from fe_models.meshes.curved_face import Surface
from fe_models.meshes.cut_face import whole_face
from fe_models.meshes.structure_mesh import Face, Interface, StructureMesh
from fe_models.structure import Structure
from sa_solver.surfaces.shapes import PARTING_SLOPE
from sa_solver.types import Array, Grid, Indices
from workflow.analyses.wear.case.scanned import ScannedFace
from workflow.analyses.wear.gaps import gap_over
from workflow.analyses.wear.structures.dovetail.model import added_gap
from workflow.analyses.wear.structures.mesh.case import MeshCase
from workflow.analyses.wear.structures.mesh.faces import face_size, planes_of_symmetry
from workflow.analyses.wear.structures.mesh.loads import RotationLoad
from workflow.analyses.wear.structures.mesh.pretension import BoltLoad
from workflow.models.gaps import GapFunction
from workflow.models.loads import ContactFace
from workflow.models.structure import LoadCycle, Remark


class MeshModel:
    """The bodies of the file with supports, loads and cycle of the case."""

    def __init__(self, case: MeshCase) -> None:
        self._case = case
        self.nonlinearity = case.nonlinearity.described()
        self.order = case.mesh.order
        path = case.load_path
        tightens = any(isinstance(load, BoltLoad) for load in case.structure.loads)
        self.tightening = path.legs[0] if tightens else 0
        self._increments_before = sum(path.legs[: path.cycle_from - 1])
        self.peak = sum(path.legs[: path.peak_leg]) - 1 - self._increments_before

    @property
    def key(self) -> tuple[object, ...]:
        structure = self._case.structure
        contents = Path(structure.file).read_bytes()
        loads = [(load.model_dump(exclude={"path"}), load.contents) for load in structure.loads]
        # Properties of the contacts do not change how the bodies deform.
        of_contacts = {"__all__": {"friction", "wear", "grid", "gap", "surfaces"}}
        described = structure.model_dump(
            exclude={"file": True, "loads": True, "contacts": of_contacts}
        )
        materials = [solid.elastic() for solid in self._case.solids.values()]
        return contents, described, loads, self._case.mesh, materials

    @property
    def load_cycles(self) -> tuple[LoadCycle, ...]:
        before, missions = self._increments_before, []
        for factors, share in self._case.load_path.mixed(len(self._case.structure.loads)):
            path = self._path(factors)
            missions.append(LoadCycle(path[before:], path[:before], share))
        return tuple(missions)

    @property
    def finer(self) -> str:
        how = "refine the file's mesh there"
        if self._case.mesh.size is not None:
            how = "lower mesh.size"
        return how + (", or take mesh.order: 2" if self.order == 1 else "")

    def _path(self, factors: tuple[float, ...]) -> Array:
        """Return the amplitudes of the loads ``(t, loads)``, squared for rotations."""
        legs, loads = self._case.load_path.legs, self._case.structure.loads
        ends = np.insert(np.cumsum(legs), 0, 0)
        steps = np.arange(1, ends[-1] + 1)
        columns = [
            factor * np.interp(steps, ends, (0.0, *load.path))
            for factor, load in zip(factors, loads, strict=True)
        ]
        squared = [isinstance(load, RotationLoad) for load in loads]
        return np.stack([c**2 if s else c for c, s in zip(columns, squared, strict=True)], axis=1)

    def meshed(self) -> StructureMesh:
        return self._mesh

    @cached_property
    def _mesh(self) -> StructureMesh:
        interfaces = tuple(map(self._with_gap, self._meshed.interfaces))
        return replace(self._meshed, interfaces=interfaces)

    @cached_property
    def _meshed(self) -> StructureMesh:
        """Mesh of the file, without the gaps that the case adds."""
        return self._case.structure.mesh(self._case.mesh.size, self.order)

    def _with_gap(self, interface: Interface) -> Interface:
        """Return the interface with the gap of the case added to that of the meshes.

        Nodes get the local means of measured surfaces.
        """
        extra, gap = self._case_gap(interface), interface.gap
        if extra is not None:
            points = interface.coordinates[:, :, None, None]
            gap = gap + np.array([float(extra(x, y)[0, 0]) for x, y in points])
        if interface.name in self._scanned:
            gap = gap + self._scanned[interface.name].at_nodes()
        return interface if gap is interface.gap else replace(interface, gap=gap)

    @cached_property
    def _scanned(self) -> dict[str, ScannedFace]:
        """Faces with measured surfaces, by name."""
        return {face.name: face for face in self._case.scanned()}

    def _case_gap(self, interface: Interface) -> GapFunction | None:
        """Return the gap that the case gives for an interface, or None."""
        (pair,) = (p for p in self._case.structure.contacts if p.name == interface.name)
        if pair.gap is None:
            return None
        grid = self._case.terms(interface.name).grid
        over = Grid.over(face_size(interface), grid, interface.line)
        return gap_over(pair.gap, None, over)

    def structure(self, mesh: StructureMesh) -> Structure:
        case, described = self._case, self._case.structure
        return imported_structure(
            mesh,
            described.read(case.mesh.size),
            [solid.elastic() for solid in case.solids.values()],
            [support.described() for support in described.supports],
            [load.described() for load in described.loads],
            self.order,
            [cuts.described() for cuts in described.cyclic],
        )

    def bolts(self, structure: Structure) -> tuple[Bolt, ...]:
        given = self._case.structure.loads
        loads = [load.described() for load in given]
        return tuple(
            Bolt(bolt.name, case, bolt_section(structure, load), bolt.tension)
            for case, (bolt, load) in enumerate(zip(given, loads, strict=True))
            if isinstance(bolt, BoltLoad) and isinstance(load, Pretension)
        )

    def softening(self, structure: Structure) -> Softening:
        loads = [load.described() for load in self._case.structure.loads]
        return imported_softening(structure, loads, self.load_cycles[0].amplitudes[self.peak])

    def contact_face(self, interface: Interface) -> ContactFace:
        size, extra = face_size(interface), self._case_gap(interface)
        face = whole_face(interface)
        gap: GapFunction = _MeshGap(face, extra)
        if interface.name in self._scanned:
            gap = added_gap(self._scanned[interface.name]).on(gap)
        return ContactFace(face, size, gap, _coarse(face, size))

    def node_numbers(self, place: int) -> Indices:
        numbers = self._case.structure.read(self._case.mesh.size).node_numbers
        return numbers[self._mesh.bodies[place].name]

    def remarks(self, structure: Structure, friction: Sequence[float]) -> Iterator[Remark]:
        """Yield the unit of the mesh, and contacts that supports or planes of symmetry cut."""
        unit = self._case.structure.read(self._case.mesh.size).unit
        if unit.size != 1.0:
            yield Remark(
                f"lengths of the mesh file are {unit}; worn.msh, worn_nodes and ParaView files are "
                "in mm",
                is_warning=False,
            )
        for interface in structure.mesh.interfaces:
            name, planes = interface.name, interface.planes
            if planes:
                yield Remark(
                    f"{name}: cut by {planes_of_symmetry(planes)}: its half-space has the mirror "
                    "image too, and what is told of the contact is that of the whole face; "
                    "worn.msh and worn_nodes are the part that is meshed",
                    is_warning=False,
                )
            elif name in structure.held_faces:
                yield Remark(
                    f"{name}: supports hold some of its nodes along it, and not as a plane of "
                    "symmetry does, across x or y of the contact with all nodes that both bodies "
                    "have on it: the structure knows of them, the half-space of the contact does "
                    "not, whose pressure is that of a face that ends there; mesh the whole face"
                )


class _MeshGap:
    """Gap of the meshed surfaces; beyond the ends of the faces it widens.

    ``extra`` is a gap of the case to add.
    """

    def __init__(self, face: Face, extra: GapFunction | None) -> None:
        self._face, self._extra = face, extra

    def __call__(self, x: Array, y: Array) -> Array:
        """Return the gap ``(nx, ny)`` [mm] at ``x`` ``(nx, 1)`` and ``y`` ``(1, ny)``."""
        gap = _parting(self._face, x, y)
        if (other := self._face.face(1)) is not self._face:
            gap -= _parting(other, x, y, sign=-1.0)
        return gap if self._extra is None else gap + self._extra(x, y)


def _parting(face: Face, x: Array, y: Array, sign: float = 1.0) -> Array:
    """Return the height of a face over its nodes; beyond it, the height moves towards ``sign``."""
    surface = face.surface or Surface.flat(len(face), face.facets)
    height = surface.over(face.coordinates, face.facets, x, y)
    outside = np.isnan(height)
    points = np.stack(np.broadcast_arrays(x, y), axis=-1)[outside]
    distance, nearest = cKDTree(face.coordinates).query(points)
    height[outside] = surface.heights[nearest] + sign * PARTING_SLOPE * distance
    return height


def _coarse(face: Face, size: tuple[float, float]) -> tuple[int, int]:
    """Return a grid of about as many cells as nodes, with nearly square cells."""
    if face.line:
        return len(face), 1
    across = max(int(np.sqrt(len(face) * size[0] / size[1])), 1)
    return across, max(len(face) // across, 1)
