"""A blade root in a disk sector, in contact along two flanks (dovetail attachment)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from math import ceil
from numbers import Real
from typing import Literal

import numpy as np

from fe_models.dovetail import Mission, dovetail_softening, dovetail_structure
from fe_models.elasticity.local_model import LocalModel
from fe_models.elasticity.relinearised import Softening
from fe_models.geometry.dovetail import Dovetail
from fe_models.joints.face_traction import FaceTraction
from fe_models.loads.pretension import Bolt
from fe_models.meshes.structure_mesh import Interface, StructureMesh
from fe_models.notch_stress import extruded_notch_models, notch_models
from fe_models.structure import Structure
from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array, Material
from workflow.messages.warning_kinds import WarningKind
from workflow.models.budget.convergence import MESH_ORDER, share_of_difference
from workflow.models.checks.warnings import weightless_warnings
from workflow.models.gaps import AddedGap, GapFunction
from workflow.models.loads import ContactFace
from workflow.models.structure_model import (
    FinerMesh,
    LoadCycle,
    MeshesAlongSlot,
    Nonlinearity,
    Remark,
)

SIDES = {"intrados": 1, "extrados": -1}
"""Flanks by name: the one at X > 0 and the one at X < 0."""

# Increments up to the peak and after it in probe runs. Differences of probe runs hardly depend on
# them.
FEW_INCREMENTS = 4, 7
# Section that drives local models of the notches: nodes across a flank, growth of the elements from
# it, and elements round a full circle of a fillet.
NOTCH_FLANK_NODES, NOTCH_GROWTH, NOTCH_ELEMENTS = 11, 0.35, 24
# Least number of nodes across and along a flank.
FEWEST_NODES = 3
# Nodes across a flank, and round a fillet, of probe runs that compare meshes along the slot. With 5
# to 11 nodes across, 13 and 27 nodes along the slot of the default differ by 2 to 4 % in depth.
NODES_ACROSS, NOTCH_NODES = 7, 8
# Layers of elements along the slot from which on they are compared with half as many, and otherwise
# with twice as many: compared with three layers an estimate was 20 times too large.
MANY_LAYERS = 10


@dataclass(frozen=True)
class DovetailMesh:
    """Finite elements of a dovetail joint.

    Parameters
    ----------
    flank_nodes : (int, int)
        Nodes across each flank and along the slot; odd numbers with elements of order 2.
    size : float
        Distance of the nodes away from the flanks [mm].
    notch : int
        Nodes round a full circle of a fillet.
    order : {1, 2}
        Order of the elements. Those of order 2 take the same nodes and are twice as long.

    Examples
    --------
    >>> import fretscale
    >>> fine = fretscale.DovetailMesh(flank_nodes=(41, 45), size=6.0)
    >>> print(fine.notch)
    16
    """

    flank_nodes: tuple[int, int] = (21, 27)
    size: float = 12.0
    notch: int = 16
    order: Literal[1, 2] = 2

    def __post_init__(self) -> None:
        checks.wholes(self, "order", least=1, most=2)
        checks.wholes(self, "notch", least=3)
        checks.numbers(self, "size", above=0.0)
        checks.members(self, flank_nodes=int | np.integer)
        if len(self.flank_nodes) != 2 or min(self.flank_nodes) < FEWEST_NODES:
            raise InputError(
                f"DovetailMesh.flank_nodes is {self.flank_nodes}: give two numbers of nodes, "
                f"{FEWEST_NODES} or more across a flank and along the slot"
            )
        if self.order == 2 and not all(count % 2 for count in self.flank_nodes):
            raise InputError(
                f"DovetailMesh.flank_nodes is {self.flank_nodes}: elements of order 2 have three "
                "nodes along an edge, so give odd numbers of nodes"
            )

    def refined(self, factor: float) -> DovetailMesh:
        """Return the mesh with elements that are finer by ``factor``; its notches stay the same."""
        across, along = (
            max(FEWEST_NODES, 1 + self.order * round(factor * (count - 1) / self.order))
            for count in self.flank_nodes
        )
        return replace(self, flank_nodes=(across, along), size=self.size / factor)

    def of_order(self, order: Literal[1, 2]) -> DovetailMesh:
        """Return the mesh with elements of an ``order``, and a node more where that takes one."""
        across, along = (1 + order * ceil((count - 1) / order) for count in self.flank_nodes)
        return replace(self, flank_nodes=(across, along), order=order)


@dataclass(frozen=True)
class DovetailJoint:
    """A dovetail joint under its missions.

    Body 1 is the disk, body 2 the blade; the interfaces are called ``intrados`` (X > 0) and
    ``extrados``.

    Parameters
    ----------
    geometry : Dovetail
        The section of both bodies and the slot.
    disk, blade : Material
        Their materials, with density.
    missions : tuple of Mission
        Closed cycles of the loads, which take turns. All have the same airfoil.
    mesh : DovetailMesh
        Finite elements.
    dimension : {3, 2}
        In space, or the section in the middle of the slot in plane strain, loads per length.
    sides : {"guided", "cyclic"}
        Sides of the disk's sector: guided along their planes, or as those of the next sectors.
    shares : tuple of float
        Share of each mission in all cycles.
    added : mapping of str to AddedGap
        Gaps on top of the form of the flanks, by their names.
    nonlinearity : Nonlinearity
        Geometric nonlinearity that is taken into account.
    finer : str
        Advice on how to refine the mesh, for messages.

    Examples
    --------
    The joint of a case, with a groove of 2 µm across one flank:

    >>> from dataclasses import replace
    >>> import fretscale
    >>> import numpy as np
    >>> joint = fretscale.wear_model("cases/dovetail.yaml").structure
    >>> groove = fretscale.AddedGap(lambda x, y: 2e-3 * np.exp(-(x**2)) + 0.0 * y)
    >>> grooved = replace(joint, added={"intrados": groove})
    >>> print(grooved.peak, list(grooved.added))
    7 ['intrados']
    """

    geometry: Dovetail
    disk: Material
    blade: Material
    missions: tuple[Mission, ...]
    mesh: DovetailMesh = field(default_factory=DovetailMesh)
    dimension: Literal[2, 3] = 3
    sides: Literal["guided", "cyclic"] = "guided"
    shares: tuple[float, ...] = (1.0,)
    added: Mapping[str, AddedGap] = field(default_factory=dict)
    nonlinearity: Nonlinearity = field(default_factory=Nonlinearity)
    finer: str = field(
        default="give flanks and notches more nodes, or take elements of order 2",
        compare=False,
    )

    def __post_init__(self) -> None:
        checks.instances(
            self,
            geometry=Dovetail,
            disk=Material,
            blade=Material,
            mesh=DovetailMesh,
            added=Mapping,
            nonlinearity=Nonlinearity,
            finer=str,
        )
        checks.members(self, missions=Mission, shares=Real, added=AddedGap)
        checks.wholes(self, "dimension", least=2, most=3)
        if len(self.missions) != len(self.shares) or not self.missions:
            raise InputError(
                f"{len(self.missions)} missions and {len(self.shares)} shares: give as many of "
                "both, one at least"
            )
        if min(self.shares) < 0.0 or not np.isclose(sum(self.shares), 1.0):
            raise InputError(f"shares {self.shares}: give 0 or more, which add up to 1")
        checks.choices(self, sides=("guided", "cyclic"))
        if unknown := self.added.keys() - SIDES.keys():
            raise InputError(f"no flank called {', '.join(unknown)}: give intrados or extrados")

    tightening = 0

    @property
    def heaviest(self) -> int:
        """Index of the mission with the highest speed and, among equal ones, the largest moment."""
        peaks = [(m.rotation_speed, abs(m.aerodynamic_moment)) for m in self.missions]
        return peaks.index(max(peaks))

    @property
    def peak(self) -> int:
        before = sum(mission.increments for mission in self.missions[: self.heaviest])
        return before + self.missions[self.heaviest].peak_at - 1

    @property
    def order(self) -> Literal[1, 2]:
        return self.mesh.order

    @property
    def key(self) -> tuple[object, ...]:
        mission = self.missions[self.heaviest]
        pull = mission.airfoil_mass, mission.airfoil_radius
        return self.geometry, self.dimension, self.sides, self.mesh, self.disk, self.blade, pull

    @property
    def load_cycles(self) -> tuple[LoadCycle, ...]:
        paths = [mission.amplitudes() for mission in self.missions]
        pairs = zip(paths, self.shares, strict=True)
        return tuple(LoadCycle(path, path[:0], share) for path, share in pairs)

    def meshed(self) -> StructureMesh:
        mesh = dovetail_mesh(self.geometry, self.mesh, self.dimension)
        return replace(mesh, interfaces=tuple(map(self._with_gap, mesh.interfaces)))

    def _with_gap(self, flank: Interface) -> Interface:
        """Return the flank with the gap that is added to its form."""
        if flank.name not in self.added:
            return flank
        nodal = self.added[flank.name].at_nodes(flank)
        return replace(flank, gap=flank.gap + nodal)

    def structure(self, mesh: StructureMesh) -> Structure:
        mission, cyclic = self.missions[self.heaviest], self.sides == "cyclic"
        given = self.geometry, mesh, self.disk, self.blade, mission, self.order
        return dovetail_structure(*given, cyclic)

    def bolts(self, structure: Structure) -> tuple[Bolt, ...]:
        """Return no bolts."""
        return ()

    def softening(self, structure: Structure) -> Softening:
        return dovetail_softening(structure, self.geometry, self.missions[self.heaviest])

    def contact_face(self, interface: Interface) -> ContactFace:
        side = SIDES[interface.name]
        gap: GapFunction = partial(self.geometry.flank_gap, side=side)
        if interface.name in self.added:
            gap = self.added[interface.name].on(gap)
        size, nodes = self.geometry.flank_size(side), self.mesh.flank_nodes
        widen = "widen edge_width or end_width"
        return ContactFace(interface, size, gap, nodes, widen)

    def node_numbers(self, place: int) -> None:
        """Return None: the mesh is generated."""

    def section(self) -> DovetailJoint:
        """Return the section in plane strain under few increments, with the same mesh in it.

        The gaps that are added to a joint in space are not part of it.
        """
        return replace(
            self._in_few_increments(),
            geometry=replace(self.geometry, skew=0.0),
            dimension=2,
            added=self.added if self.dimension == 2 else {},
        )

    def _in_few_increments(self) -> DovetailJoint:
        up, down = FEW_INCREMENTS
        few = [replace(mission, increments=up + down, peak_at=up) for mission in self.missions]
        return replace(self, missions=tuple(few))

    def along_slot(self) -> MeshesAlongSlot | None:
        """Return the joint in space with few nodes across the flanks and few increments."""
        if self.dimension == 2:
            return None
        across, along = self.mesh.flank_nodes
        layers = (along - 1) // self.order
        other = 1 + self.order * (layers // 2 if layers >= MANY_LAYERS else 2 * layers)
        across, size = min(across, NODES_ACROSS), max(self.mesh.size, self.geometry.flank_width)
        notch = min(self.mesh.notch, NOTCH_NODES)

        def meshed(nodes: int) -> DovetailJoint:
            mesh = replace(self.mesh, flank_nodes=(across, nodes), size=size, notch=notch)
            return replace(self._in_few_increments(), mesh=mesh)

        share = share_of_difference((other - 1) / (along - 1), MESH_ORDER)
        return MeshesAlongSlot(meshed(along), meshed(other), share)

    def finer_mesh(self) -> FinerMesh:
        """Return the joint on a mesh of half the size and second order.

        The difference is all of the error of a mesh of first order, and is extrapolated for one of
        second order.
        """
        share = 1.0 if self.order == 1 else share_of_difference(2.0, MESH_ORDER)
        return FinerMesh(replace(self, mesh=self.mesh.of_order(2).refined(2.0)), share)

    def notch_models(
        self, tractions: Sequence[FaceTraction], amplitudes: Array
    ) -> list[list[LocalModel | None]] | None:
        """Return local models driven by the section with round fillets, extruded along the slot.

        A skewed slot and cyclic sides in space have none.
        """
        geometry, cyclic = self.geometry, self.sides == "cyclic"
        if self.dimension == 3 and (geometry.skew != 0.0 or cyclic):
            return None
        width, length = geometry.flank_width, geometry.slot_length
        nodes = NOTCH_FLANK_NODES, FEWEST_NODES
        mesh = geometry.mesh(nodes, width, 2, NOTCH_ELEMENTS, growth=NOTCH_GROWTH, curved=True)
        mission = self.missions[self.heaviest]
        section = dovetail_structure(geometry, mesh, self.disk, self.blade, mission, 2, cyclic)
        if self.dimension == 2:
            return notch_models(section, tractions, amplitudes)
        # Elements along the slot are at most as long as the flank is wide, and even in number.
        elements = 2 * int(np.ceil(0.5 * length / width))
        ends = 0.5 * length * np.linspace(-1.0, 1.0, elements + 1)
        return extruded_notch_models(section, tractions, amplitudes, ends)

    def remarks(self, structure: Structure, friction: Sequence[float]) -> Iterator[Remark]:
        """Yield remarks: sides that a moment would move, and a joint that locks itself."""
        for kind, text in weightless_warnings({"the disk": self.disk, "the blade": self.blade}):
            yield Remark(text, kind)
        moments = any(mission.aerodynamic_moment for mission in self.missions)
        if moments and self.sides == "guided" and self.geometry.skew == 0.0:
            yield Remark(
                "the sides of the disk's sector are guided, so they carry no moment; with "
                "cyclic sides they move as those of the next sectors do"
            )
        slope, largest = float(np.tan(self.geometry.flank_angle)), max(friction)
        if largest > slope:
            yield Remark(
                f"friction of {largest:g} exceeds the tangent of the flank angle, "
                f"{slope:.3g}: the joint locks, and the blade does not move back when the load "
                "falls",
                WarningKind.JOINT_LOCKS,
            )


@lru_cache(maxsize=1)
def dovetail_mesh(
    geometry: Dovetail, mesh: DovetailMesh, dimension: Literal[2, 3]
) -> StructureMesh:
    """Return the mesh of both bodies without added gaps; the last mesh is cached.

    Raises MeshError where the section cannot be drawn.
    """
    return geometry.mesh(mesh.flank_nodes, mesh.size, dimension, mesh.notch, mesh.order)
