"""A dovetail case as a structure."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, partial
from typing import Self

import numpy as np

from fe_models.dovetail import Mission, dovetail_softening, dovetail_structure
from fe_models.elasticity.relinearised import Softening
from fe_models.loads.pretension import Bolt
from fe_models.meshes.structure_mesh import Interface, StructureMesh
from fe_models.structure import Structure
from workflow.analyses.wear.case.scanned import ScannedFace
from workflow.analyses.wear.gaps import GapFunction, with_measured
from workflow.analyses.wear.load_source import ContactFace
from workflow.analyses.wear.structure_stage import MissionLoads
from workflow.analyses.wear.structures.dovetail.case import SIDES, DovetailCase
from workflow.case.changing import changed
from workflow.shell.reporter import Reporter


class DovetailModel:
    """The joint, its mission and its mesh as the case gives them."""

    def __init__(self, case: DovetailCase) -> None:
        self._case = case
        self.dovetail = case.structure.geometry()
        self._missions = [Mission(**entries) for entries in case.load_path.missions()]
        heaviest = case.load_path.heaviest
        self._mission = self._missions[heaviest]
        self.friction: tuple[float, ...] = (case.friction.at(0.0),)
        self.peak = heaviest * sum(case.legs) + case.legs[0] - 1
        self.nonlinearity = case.nonlinearity
        self.order = case.mesh.order

    @classmethod
    def in_plane(cls, case: DovetailCase) -> Self:
        """The section of a case in plane strain, under the same missions."""
        return cls(changed(case, case.to_plane))

    @property
    def key(self) -> tuple[object, ...]:
        case, mission = self._case, self._mission
        pull = mission.airfoil_mass, mission.airfoil_radius
        materials = case.material(1), case.material(2)
        structure = case.structure.dimension, case.structure.sides
        return self.dovetail, structure, case.mesh, materials, pull

    @property
    def missions(self) -> tuple[MissionLoads, ...]:
        paths = [mission.amplitudes() for mission in self._missions]
        shares = self._case.load_path.shares
        return tuple(MissionLoads(p, p[:0], share) for p, share in zip(paths, shares, strict=True))

    @property
    def finer(self) -> str:
        along = " or mesh.flank_nodes" if self._case.structure.dimension == 3 else ""
        return f"raise mesh.notch{along}{', or take mesh.order: 2' if self.order == 1 else ''}"

    def mesh(self) -> StructureMesh:
        meshed = self._case.structure.meshed(self._case.mesh)
        return replace(meshed, interfaces=tuple(map(self._with_gap, meshed.interfaces)))

    def _with_gap(self, flank: Interface) -> Interface:
        """The flank with what surfaces as measured add to its gap."""
        if flank.name not in self._scanned:
            return flank
        return replace(flank, gap=flank.gap + self._scanned[flank.name].at_nodes())

    @cached_property
    def _scanned(self) -> dict[str, ScannedFace]:
        """Flanks with surfaces as measured, by name."""
        return {face.name: face for face in self._case.scanned()}

    def structure(self, mesh: StructureMesh) -> Structure:
        disk, blade = self._case.material(1), self._case.material(2)
        cyclic = self._case.structure.sides == "cyclic"
        given = self.dovetail, mesh, disk, blade, self._mission, self.order
        return dovetail_structure(*given, cyclic)

    tightening = 0

    def bolts(self, structure: Structure) -> tuple[Bolt, ...]:
        """None."""
        return ()

    def softening(self, structure: Structure) -> Softening:
        return dovetail_softening(structure, self.dovetail, self._mission)

    def contact_face(self, interface: Interface) -> ContactFace:
        side = SIDES[interface.name]
        gap: GapFunction = partial(self.dovetail.flank_gap, side=side)
        if interface.name in self._scanned:
            scanned = self._scanned[interface.name]
            gap = with_measured(gap, scanned.surfaces, scanned.grid)
        nodes = self._case.mesh.flank_nodes
        widen = "widen structure.edge_width or structure.end_width"
        return ContactFace(interface, self.dovetail.flank_size(side), gap, nodes, widen)

    def node_numbers(self, place: int) -> None:
        """Nobody but us knows the nodes."""

    def warn(self, structure: Structure, reporter: Reporter) -> None:
        """Self-locking joints, sides that a moment would move, and surfaces as measured that are
        finer than the mesh.
        """
        for told in self._case.told_of_nodes():
            reporter.say(told)
        if self._scanned and self._case.structure.dimension == 3:
            reporter.say(
                "structure.surfaces: the section by which increments are chosen and the error of "
                "the mesh is estimated is without them"
            )
        moments = any(mission["aerodynamic_moment"] for mission in self._case.load_path.missions())
        if moments and self._case.structure.sides == "guided" and self.dovetail.skew == 0.0:
            reporter.say(
                "the sides of the disk's sector are guided, as the next sectors do without a "
                "moment; structure.sides: cyclic has them move as those do with one"
            )
        slope = np.tan(self.dovetail.flank_angle)
        (friction,) = self.friction
        if friction > slope:
            reporter.warn(
                f"friction.coefficient {friction:g} exceeds the tangent of the flank angle, "
                f"{slope:.3g}: the joint locks itself and the blade does not come back when the "
                "load falls"
            )
