"""The structural stage of a dovetail case: mesh, condensed joint, cycles, stress, worn mesh."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from fe_models.dovetail import Mission, dovetail_structure
from fe_models.friction import FrictionalJoint, FrictionState
from fe_models.mesh import Interface, StructureMesh
from fe_models.stress import StressField, stress_state
from fe_models.structure import CycleSolution, Structure
from sa_solver.types import Array
from workflow.cache import content_key, load_cycle, load_joint, save_cycle, save_joint
from workflow.case import WearCase
from workflow.errors import MethodFailed

SIDES = {"intrados": 1, "extrados": -1}


class StructureStage:
    """Everything the run asks of the structure. Worn depths are nodal, ``(n,)`` per interface."""

    def __init__(self, case: WearCase) -> None:
        self._case = case
        self.dovetail = case.structure.geometry()
        self.mission = Mission(**case.load_path.model_dump())
        self.from_cache = False

    @cached_property
    def mesh(self) -> StructureMesh:
        """The unworn mesh."""
        return self.dovetail.mesh(self._case.mesh.flank_nodes, self._case.mesh.size)

    @property
    def interfaces(self) -> tuple[Interface, ...]:
        return self.mesh.interfaces

    @property
    def peak(self) -> int:
        """Index of the increment of peak load."""
        return self.mission.peak_at - 1

    @cached_property
    def joint(self) -> FrictionalJoint:
        """The condensed joint, from the cache when it is there."""
        key = content_key(*self._joint_parts())
        joint = load_joint(key)
        self.from_cache = joint is not None
        if joint is None:
            joint = self.structure.condense().resolvent()
            save_joint(key, joint)
        self.rigid_modes = joint.rigid_modes
        return FrictionalJoint(joint, self._case.friction.coefficient)

    def _joint_parts(self) -> tuple[object, ...]:
        """Everything the condensed joint depends on."""
        mission = self.mission.airfoil_mass, self.mission.airfoil_radius
        return self.dovetail, self._case.mesh, self._case.materials, mission

    @cached_property
    def structure(self) -> Structure:
        """Both bodies with supports and loads, unworn."""
        return self._structure(self.mesh)

    def node_count(self) -> int:
        """Nodes of both bodies, midsides included."""
        meshes = self.mesh.body_1.mesh, self.mesh.body_2.mesh
        midsides = [mesh.nedges for mesh in meshes if self._case.mesh.order == 2]
        return int(sum(mesh.nvertices for mesh in meshes) + sum(midsides))

    def self_locking(self) -> bool:
        """Whether friction alone can hold the blade in the slot."""
        return self._case.friction.coefficient > np.tan(self.dovetail.flank_angle)

    def prepare(self) -> None:
        """Do the costly part now: condense the structure, or find it in the cache."""
        _ = self.joint

    def unworn_cycle(self) -> CycleSolution:
        """The closed mission cycle from rest with unworn flanks, from the cache if it is there."""
        friction = self._case.friction.coefficient
        key = content_key(*self._joint_parts(), self.mission, friction)
        cycle = load_cycle(key, self.structure, friction)
        if cycle is None:
            cycle = self.cycle([np.zeros(len(i)) for i in self.interfaces])
            save_cycle(key, cycle)
        return cycle

    def cycle(self, depths: list[Array], after: CycleSolution | None = None) -> CycleSolution:
        """The closed mission cycle with the gaps widened by the worn depth of both bodies.

        From rest, or as the mission that follows ``after``.
        """
        solution = self.structure.solve_cycle(
            self.joint,
            self.mission.amplitudes(),
            self._gap(depths),
            self._case.friction.coefficient,
            after,
        )
        if not solution.converged:
            raise MethodFailed(
                f"structural friction did not converge: residual {solution.residual:.1e} after "
                f"{solution.iterations} iterations; refine load_path.increments or lower "
                "friction.coefficient, and see that load_path.aerodynamic_moment opens no flank"
            )
        return solution

    def peak_resultants(self, depths: list[Array]) -> Array:
        """Resultants ``(interfaces, 6)`` at peak load reached in a single increment.

        Cheap, and moved by wear as those of the full cycle are: the probe for drift.
        """
        (state,) = self._march_to_peak(depths, [self._unworn_peak.state])
        return self.structure.interface_resultants(state)

    @cached_property
    def _unworn_peak(self) -> FrictionState:
        (state,) = self._march_to_peak([np.zeros(len(i)) for i in self.interfaces], [])
        return state

    def _march_to_peak(self, depths: list[Array], guess: list[Array]) -> Iterator[FrictionState]:
        amplitudes = self.mission.amplitudes()[self.peak : self.peak + 1]
        return self.joint.march(amplitudes, self._gap(depths), guess=guess)

    def stress(self, solution: CycleSolution) -> tuple[StressField, StressField]:
        """Stress of disk and blade at peak load on the unworn mesh."""
        return self._stress(self.structure, solution)

    def worn_stress(
        self, mesh: StructureMesh, solution: CycleSolution
    ) -> tuple[StressField, StressField]:
        """Stress of disk and blade at peak load on the worn mesh."""
        return self._stress(self._structure(mesh), solution)

    def _stress(
        self, structure: Structure, solution: CycleSolution
    ) -> tuple[StressField, StressField]:
        fields = {name: values[self.peak] for name, values in solution.fields().items()}
        amplitudes = self.mission.amplitudes()[self.peak]
        return stress_state(structure, fields["force"], fields["displacement"], amplitudes)

    def _structure(self, mesh: StructureMesh) -> Structure:
        return dovetail_structure(
            self.dovetail,
            mesh,
            self._case.materials.disk.elastic(),
            self._case.materials.blade.elastic(),
            self.mission,
            self._case.mesh.order,
        )

    def _gap(self, depths: list[Array]) -> Array:
        return self.structure.gap() + np.concatenate(depths)
