"""A dovetail case as a structure."""

from __future__ import annotations

from functools import partial
from typing import Self

import numpy as np

from fe_models.dovetail import Mission, dovetail_softening, dovetail_structure
from fe_models.mesh import Interface, StructureMesh
from fe_models.pretension import Bolt
from fe_models.relinearised import Softening
from fe_models.structure import Structure
from workflow.analyses.wear.load_source import ContactFace
from workflow.analyses.wear.structure_stage import MissionLoads
from workflow.analyses.wear.structures.dovetail.case import DovetailCase
from workflow.case.changing import changed
from workflow.shell.reporter import Reporter

# The flank at X > 0 and the one at X < 0.
SIDES = {"intrados": 1, "extrados": -1}


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
        return cls(changed(case, {"structure.dimension": 2, "structure.skew": 0.0}))

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
        mesh = self._case.mesh
        dimension = self._case.structure.dimension
        return self.dovetail.mesh(mesh.flank_nodes, mesh.size, dimension, mesh.notch)

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
        gap = partial(self.dovetail.flank_gap, side=side)
        nodes = self._case.mesh.flank_nodes
        widen = "widen structure.edge_width or structure.end_width"
        return ContactFace(interface, self.dovetail.flank_size(side), gap, nodes, widen)

    def node_numbers(self, place: int) -> None:
        """Nobody but us knows the nodes."""

    def warn(self, structure: Structure, reporter: Reporter) -> None:
        """Self-locking joints, and sides that a moment would move."""
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
