"""Bodies of a mesh or CAD file of the user's own, in contact, under loads."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from fe_models.cyclic.cuts import Cyclic
from fe_models.elasticity.local_model import LocalModel
from fe_models.elasticity.relinearised import Softening
from fe_models.geometry.imported import ImportedMesh
from fe_models.imported_structure import (
    ContactPair,
    Support,
    imported_mesh,
    imported_softening,
    imported_structure,
)
from fe_models.joints.face_traction import FaceTraction
from fe_models.loads.applied_loads import Acceleration, AppliedLoad, Rotation
from fe_models.loads.pretension import Bolt, Pretension, bolt_section
from fe_models.meshes.curved_face import Surface
from fe_models.meshes.cut_face import whole_face
from fe_models.meshes.second_order import with_midsides
from fe_models.meshes.structure_mesh import Face, Interface, StructureMesh
from fe_models.notch_stress import notch_models
from fe_models.structure import Structure
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.surfaces.shapes import PARTING_SLOPE
from sa_solver.types import Array, Indices, Material
from workflow.messages.warning_kinds import WarningKind
from workflow.models.checks.limits import MOST_INCREMENTS
from workflow.models.checks.names import check_face_name
from workflow.models.checks.warnings import weightless_warnings
from workflow.models.faces import face_size, planes_of_symmetry
from workflow.models.gaps import AddedGap, GapFunction
from workflow.models.loads import ContactFace
from workflow.models.structure_model import FinerMesh, LoadCycle, Nonlinearity, Remark

# Largest number of nodes in space for cheap second-order elements, which have seven times as many.
MOST_NODES = 4000


@dataclass(frozen=True)
class LegPath:
    """Loads that change linearly from leg to leg; the last legs are one closed cycle.

    Parameters
    ----------
    increments : tuple of int
        Increments of each leg.
    factors : tuple of tuple of float
        For each load, its factor at the end of each leg; every load begins at 0.
    cycle_from : int
        First leg of the cycle, counted from 1; those before it are passed once.
    peak_leg : int
        Leg at whose end the load peaks, counted from 1.
    mix : tuple of (tuple of float, float)
        Cycles that take turns on these legs: a factor for each load, and the share of all cycles.
        Without it there is one cycle.

    Examples
    --------
    A constant pressure, and a force that goes forward and backward after it:

    >>> import fretscale
    >>> path = fretscale.LegPath((2, 4, 4), ((1, 1, 1), (0, 1, -1)), cycle_from=2, peak_leg=2)
    >>> print(path.peak, path.amplitudes((1.0, 1.0))[:4, 1])
    3 [0.   0.   0.25 0.5 ]
    """

    increments: tuple[int, ...]
    factors: tuple[tuple[float, ...], ...]
    cycle_from: int = 1
    peak_leg: int = 1
    mix: tuple[tuple[tuple[float, ...], float], ...] = ()

    def __post_init__(self) -> None:
        checks.members(self, increments=int | np.integer, factors=list | tuple, mix=list | tuple)
        for count in self.increments:
            checks.whole("LegPath.increments of a leg", count, least=1, most=MOST_INCREMENTS)
        if any(len(of_load) != len(self.increments) for of_load in self.factors):
            raise InputError(
                f"{len(self.increments)} legs: give as many factors for every load, one at the end "
                "of each leg"
            )
        checks.array("LegPath.factors", self.factors, (None, None))
        legs = len(self.increments)
        checks.wholes(self, "cycle_from", least=1, most=legs)
        checks.wholes(self, "peak_leg", least=self.cycle_from, most=legs)

    @property
    def before(self) -> int:
        """Increments before the cycle."""
        return sum(self.increments[: self.cycle_from - 1])

    @property
    def peak(self) -> int:
        """Increment of peak load, counted from 0 in the cycle."""
        return sum(self.increments[: self.peak_leg]) - 1 - self.before

    def amplitudes(self, factors: Sequence[float]) -> Array:
        """Return the factors of all loads in all increments ``(t, loads)``, times ``factors``."""
        ends = np.insert(np.cumsum(self.increments), 0, 0)
        steps = np.arange(1, ends[-1] + 1)
        columns = [
            factor * np.interp(steps, ends, (0.0, *of_load))
            for factor, of_load in zip(factors, self.factors, strict=True)
        ]
        return np.stack(columns, axis=1)


@dataclass(frozen=True)
class TightenedBolt:
    """A bolt whose pretension is one of the loads of an assembly.

    Parameters
    ----------
    load : int
        Place of its pretension among the loads.
    name : str
        Name of the bolt in the results.
    force : float, optional
        Force [N] to which it is tightened in the first leg; without it its shortening is given.

    Examples
    --------
    >>> import fretscale
    >>> print(fretscale.TightenedBolt(0, "bolt_1", force=10e3).force)
    10000.0
    """

    load: int
    name: str
    force: float | None = None

    def __post_init__(self) -> None:
        checks.wholes(self, "load", least=0)
        checks.instances(self, name=str)
        checks.numbers(self, "force", above=0.0)


@dataclass(frozen=True, eq=False)
class MeshAssembly:
    """Bodies of a mesh or CAD file, which touch each other, under loads.

    Parameters
    ----------
    imported : ImportedMesh
        Bodies of the file, from :func:`fe_models.geometry.read_bodies`.
    bodies : mapping of str to Material
        The bodies that take part and their materials; body 1 and body 2 first.
    contacts : tuple of ContactPair
        Faces that meet.
    supports : tuple of Support
        Where displacements are held.
    loads : tuple of AppliedLoad
        What is applied, for a factor of 1.
    path : LegPath
        Factors of the loads over the cycle. Those of a rotation belong to its speed.
    bolts_tightened : tuple of TightenedBolt
        Bolts among the loads.
    cyclic : tuple of Cyclic
        Cuts of bodies that are a sector of a wheel.
    order : {1, 2}
        Order of the elements.
    added : mapping of str to AddedGap
        Gaps on top of those of the meshes, by the name of the contact.
    nonlinearity : Nonlinearity
        Geometric nonlinearity that is taken into account.
    finer : str
        Advice on how to refine the mesh, for messages.
    joined : StructureMesh, optional
        The mesh with its interfaces, if it has been made already.

    Examples
    --------
    The assembly of a case, with elements of first order:

    >>> from dataclasses import replace
    >>> import fretscale
    >>> joint = fretscale.wear_model("cases/lap_joint.yaml", mesh__size=4.0).structure
    >>> coarse = replace(joint, order=1, joined=None)
    >>> print(list(coarse.bodies), [contact.name for contact in coarse.contacts])
    ['solid_1', 'solid_2', 'solid_3'] ['lap', 'head', 'nut']
    """

    imported: ImportedMesh
    bodies: Mapping[str, Material]
    contacts: tuple[ContactPair, ...]
    supports: tuple[Support, ...]
    loads: tuple[AppliedLoad, ...]
    path: LegPath
    bolts_tightened: tuple[TightenedBolt, ...] = ()
    cyclic: tuple[Cyclic, ...] = ()
    order: Literal[1, 2] = 1
    added: Mapping[str, AddedGap] = field(default_factory=dict)
    nonlinearity: Nonlinearity = field(default_factory=Nonlinearity)
    finer: str = "refine the mesh there, or take elements of order 2"
    joined: StructureMesh | None = None

    def __post_init__(self) -> None:
        checks.instances(
            self,
            imported=ImportedMesh,
            bodies=Mapping,
            path=LegPath,
            added=Mapping,
            nonlinearity=Nonlinearity,
            joined=StructureMesh | None,
        )
        checks.members(
            self, bodies=Material, contacts=ContactPair, supports=Support, added=AddedGap
        )
        checks.wholes(self, "order", least=1, most=2)
        for contact in self.contacts:
            check_face_name(contact.name)

    @property
    def tightening(self) -> int:
        return self.path.increments[0] if self.bolts_tightened else 0

    @property
    def peak(self) -> int:
        return self.path.peak

    @property
    def key(self) -> tuple[object, ...]:
        meshes = [(body.name, body.mesh.p, body.mesh.t) for body in self._plain.bodies]
        faces = [(face.name, face.nodes_1, face.nodes_2) for face in self._plain.interfaces]
        parts = meshes, faces, self.contacts, self.supports, self.loads, self.cyclic
        content = pickle.dumps((parts, self.order, dict(self.bodies), self.imported.midsides))
        return (hashlib.sha256(content).hexdigest(),)

    @property
    def load_cycles(self) -> tuple[LoadCycle, ...]:
        before, cycles = self.path.before, []
        for factors, share in self.path.mix or (((1.0,) * len(self.loads), 1.0),):
            amplitudes = self.path.amplitudes(factors)
            # The forces of a rotation grow with the square of its speed.
            for column, load in enumerate(self.loads):
                if isinstance(load, Rotation):
                    amplitudes[:, column] **= 2
            cycles.append(LoadCycle(amplitudes[before:], amplitudes[:before], share))
        return tuple(cycles)

    def meshed(self) -> StructureMesh:
        return self._mesh

    @cached_property
    def _plain(self) -> StructureMesh:
        """The mesh without added gaps."""
        if self.joined is not None:
            return self.joined
        supports = list(self.supports)
        mesh = imported_mesh(self.imported, tuple(self.bodies), list(self.contacts), supports)
        return mesh if self.order == 1 else with_midsides(mesh, self.imported)

    @cached_property
    def _mesh(self) -> StructureMesh:
        interfaces = tuple(map(self._with_gap, self._plain.interfaces))
        return replace(self._plain, interfaces=interfaces)

    def _with_gap(self, interface: Interface) -> Interface:
        """Return the interface with the gap that is added to that of the meshes."""
        if interface.name not in self.added:
            return interface
        nodal = self.added[interface.name].at_nodes(interface)
        return replace(interface, gap=interface.gap + nodal)

    def structure(self, mesh: StructureMesh) -> Structure:
        materials, supports = list(self.bodies.values()), list(self.supports)
        loads, cuts = list(self.loads), list(self.cyclic)
        return imported_structure(mesh, self.imported, materials, supports, loads, self.order, cuts)

    def bolts(self, structure: Structure) -> tuple[Bolt, ...]:
        found = []
        for bolt in self.bolts_tightened:
            pretension = self.loads[bolt.load]
            assert isinstance(pretension, Pretension)
            section = bolt_section(structure, pretension)
            found.append(Bolt(bolt.name, bolt.load, section, bolt.force))
        return tuple(found)

    def softening(self, structure: Structure) -> Softening:
        amplitudes = self.load_cycles[0].amplitudes[self.peak]
        return imported_softening(structure, list(self.loads), amplitudes)

    def contact_face(self, interface: Interface) -> ContactFace:
        size, face = face_size(interface), whole_face(interface)
        gap: GapFunction = MeshGap(face)
        if interface.name in self.added:
            gap = self.added[interface.name].on(gap)
        return ContactFace(face, size, gap, _coarse(face, size))

    def node_numbers(self, place: int) -> Indices:
        return self.imported.node_numbers[self._mesh.bodies[place].name]

    def section(self) -> None:
        """Return None: bodies of a file need not be the same all along."""

    def along_slot(self) -> None:
        """Return None: nothing is known of the direction of a mesh."""

    def finer_mesh(self) -> FinerMesh | None:
        """Return the bodies with elements of second order, if they are of first order and few."""
        cheap = self._plain.interfaces[0].line or self._plain.node_count(1) <= MOST_NODES
        if self.order == 2 or not cheap:
            return None
        return FinerMesh(replace(self, order=2, joined=None))

    def notch_models(
        self, tractions: Sequence[FaceTraction], amplitudes: Array
    ) -> list[list[LocalModel | None]] | None:
        """Return local models driven by the bodies of second order.

        Bodies of many nodes in space and faces that do not meet node to node have none.
        """
        cheap = self._plain.interfaces[0].line or self._plain.node_count(1) <= MOST_NODES
        matching = all(face.projection is None for face in self._plain.interfaces)
        if not (cheap and matching):
            return None
        second = self if self.order == 2 else replace(self, order=2, joined=None)
        structure = second.structure(second.meshed().weighted(2))
        return notch_models(structure, tractions, amplitudes)

    def remarks(self, structure: Structure, friction: Sequence[float]) -> Iterator[Remark]:
        """Return the unit of the mesh, bodies without mass, and contacts that are cut.

        Supports or planes of symmetry cut contacts.
        """
        if any(isinstance(load, Rotation | Acceleration) for load in self.loads):
            for kind, text in weightless_warnings(self.bodies):
                yield Remark(text, kind)
        unit = self.imported.unit
        if unit.size != 1.0:
            yield Remark(
                f"lengths of the mesh file are {unit}; worn.msh, worn_nodes and ParaView files are "
                "in mm"
            )
        for interface in structure.mesh.interfaces:
            name, planes = interface.name, interface.planes
            if planes:
                yield Remark(
                    f"{name}: cut by {planes_of_symmetry(planes)}: its half-space has the mirror "
                    "image too, and all results of the contact are those of the whole face; "
                    "worn.msh and worn_nodes are the meshed part"
                )
            elif name in structure.held_faces:
                yield Remark(
                    f"{name}: supports hold some of its nodes along it, but not as a plane of "
                    "symmetry does (across x or y of the contact, with all nodes of both bodies "
                    "there); the half-space does not know of this, and its pressure is that of a "
                    "face that ends there: mesh the whole face",
                    WarningKind.SUPPORT_ON_FACE,
                )


@dataclass(frozen=True, eq=False)
class MeshGap:
    """Gap of meshed surfaces; beyond the ends of their faces the bodies part."""

    face: Face

    def __call__(self, x: Array, y: Array) -> Array:
        """Return the gap ``(nx, ny)`` [mm] at ``x`` ``(nx, 1)`` and ``y`` ``(1, ny)``."""
        gap = _parting(self.face, x, y)
        if (other := self.face.face(1)) is not self.face:
            gap -= _parting(other, x, y, sign=-1.0)
        return gap


def _parting(face: Face, x: Array, y: Array, sign: float = 1.0) -> Array:
    """Return the height of a face; beyond its ends it leaves the other one, towards ``sign``.

    Nodes that meet have the height 0.
    """
    surface = face.surface or Surface.flat(len(face), face.facets)
    height = surface.over(face.coordinates, face.facets, x, y)
    outside = np.isnan(height)
    points = np.stack(np.broadcast_arrays(x, y), axis=-1)[outside]
    distance, nearest = cKDTree(face.coordinates).query(points)
    height[outside] = surface.heights[nearest] + sign * PARTING_SLOPE * distance
    return height


def _coarse(face: Face, size: tuple[float, float]) -> tuple[int, int]:
    """Return about as many cells as nodes, as square as may be."""
    if face.line:
        return len(face), 1
    across = max(int(np.sqrt(len(face) * size[0] / size[1])), 1)
    return across, max(len(face) // across, 1)
