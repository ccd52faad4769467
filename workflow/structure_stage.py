"""The structural stage of a run: mesh, condensed joint, cycles, stress, worn mesh."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Protocol

import numpy as np

from fe_models.friction import FrictionalJoint, FrictionState
from fe_models.joint import JointResolvent
from fe_models.mesh import Interface, StructureMesh
from fe_models.nonlinear import NonlinearCheck, check_nonlinearity
from fe_models.relinearised import (
    PrestressedStructure,
    Softening,
    relinearised,
    stress_stiffened,
)
from fe_models.stress import StressField, deformation, stress_state
from fe_models.structure import CycleSolution, InterfaceHistory, Structure
from sa_solver.types import Array
from workflow.cache import content_key, load_cycle, load_joint, save_cycle, save_joint
from workflow.case.wear_sections import Nonlinearity
from workflow.errors import MethodFailed
from workflow.load_source import ContactFace
from workflow.reporter import Reporter


class StructureModel(Protocol):
    """A structure as a case describes it.

    ``key`` is everything that its condensed joint depends on, ``amplitudes`` ``(t, cases)`` those
    of its load cases over a cycle and ``preload`` ``(s, cases)`` those before the first one;
    ``peak`` is the increment of peak load, counted from 0.
    """

    @property
    def key(self) -> tuple[object, ...]: ...
    @property
    def preload(self) -> Array: ...
    @property
    def amplitudes(self) -> Array: ...
    @property
    def peak(self) -> int: ...
    @property
    def friction(self) -> float: ...
    @property
    def nonlinearity(self) -> Nonlinearity: ...

    def softening(self, structure: Structure) -> Softening:
        """Spin softening of both bodies at peak load."""
        ...

    def mesh(self) -> StructureMesh:
        """The unworn mesh."""
        ...

    def structure(self, mesh: StructureMesh) -> Structure:
        """Both bodies with supports and loads, on the mesh as it is or worn."""
        ...

    def contact_face(self, interface: Interface) -> ContactFace:
        """What the contact stage needs of an interface."""
        ...

    def warn(self, reporter: Reporter) -> None:
        """Say what only this kind of structure can know."""
        ...


class StructureStage:
    """Everything the run asks of the structure: a load source, and stress and worn mesh after it.

    Worn depths are nodal, ``(n,)`` per interface, of both bodies together [mm].
    """

    def __init__(self, model: StructureModel, order: int) -> None:
        self.model = model
        self.peak = model.peak
        self.from_cache = False
        self._order = order

    @cached_property
    def mesh(self) -> StructureMesh:
        """The unworn mesh."""
        return self.model.mesh()

    @property
    def faces(self) -> tuple[ContactFace, ...]:
        return tuple(self.model.contact_face(interface) for interface in self.mesh.interfaces)

    @property
    def line(self) -> bool:
        return self.mesh.interfaces[0].line

    @cached_property
    def joint(self) -> FrictionalJoint:
        """The condensed joint, from the cache when it is there."""
        resolvent = self._linear_resolvent
        if isinstance(self.structure, PrestressedStructure):
            resolvent = self.structure.condense_path(resolvent)
        self.rigid_modes = resolvent.rigid_modes
        return FrictionalJoint(resolvent, self.model.friction)

    @cached_property
    def _linear_resolvent(self) -> JointResolvent:
        key = content_key(*self.model.key)
        joint = load_joint(key)
        self.from_cache = joint is not None
        if joint is None:
            joint = self._linear.condense().resolvent()
            save_joint(key, joint)
        return joint

    @cached_property
    def _linear(self) -> Structure:
        return self.model.structure(self.mesh)

    @cached_property
    def structure(self) -> Structure:
        """Both bodies with supports and loads, unworn, as stiff as the case asks for."""
        return self._prestressed(self._linear)

    def _prestressed(self, structure: Structure) -> Structure:
        """The structure with the stiffness that the case asks for."""
        kind = self.model.nonlinearity.stiffness
        if kind == "linear":
            return structure
        amplitudes = self.model.amplitudes[self.peak]
        softening = self.model.softening(structure)
        how = {"stress_stiffened": stress_stiffened, "relinearised": relinearised}
        return how[self.model.nonlinearity.stiffness](
            structure, self._linear_peak, amplitudes, softening
        )

    @cached_property
    def _linear_peak(self) -> tuple[Array, Array]:
        """Displacements of both bodies of the linear structure at peak load."""
        amplitudes = self.model.amplitudes[self.peak]
        linear = FrictionalJoint(self._linear_resolvent, self.model.friction)
        (state,) = linear.march(amplitudes[None], self._linear.gap())
        return deformation(self._linear, state.force, state.displacement, amplitudes)

    @cached_property
    def nonlinear_check(self) -> NonlinearCheck:
        """The linear structure at peak load beside the total Lagrangian one."""
        linear = self._linear
        check = check_nonlinearity(
            linear,
            self._linear_resolvent,
            self.model.friction,
            self.model.amplitudes[self.peak],
            linear.gap(),
            self.model.softening(linear),
        )
        if not check.converged:
            raise MethodFailed(
                f"the total Lagrangian check left a residual of {check.residual:.1e} after "
                f"{check.iterations} iterations: run without nonlinearity.check, or lower the load"
            )
        return check

    def node_count(self) -> int:
        """Nodes of both bodies, midsides included."""
        meshes = self.mesh.body_1.mesh, self.mesh.body_2.mesh
        midsides = [
            mesh.nedges if mesh.dim() == 3 else mesh.nfacets for mesh in meshes if self._order == 2
        ]
        return int(sum(mesh.nvertices for mesh in meshes) + sum(midsides))

    def prepare(self) -> None:
        """Do the costly part now: condense the structure, or find it in the cache."""
        _ = self.joint

    @cached_property
    def unworn_cycle(self) -> CycleSolution:
        """The closed cycle from rest with unworn faces, from the cache if it is there."""
        friction = self.model.friction
        loads = [path.tolist() for path in (self.model.preload, self.model.amplitudes)]
        key = content_key(*self.model.key, *loads, self.model.nonlinearity.stiffness, friction)
        cycle = load_cycle(key, self.structure, friction)
        if cycle is None:
            cycle = self._cycle([np.zeros(len(i)) for i in self.mesh.interfaces], None)
            save_cycle(key, cycle)
        return cycle

    def unworn(self) -> tuple[InterfaceHistory, ...]:
        return self.unworn_cycle.histories

    def worn_cycle(self, depths: list[Array]) -> CycleSolution:
        """The cycle that follows the unworn one when the gaps are wider by the worn depths."""
        return self._cycle(depths, self.unworn_cycle)

    def worn(self, depths: list[Array]) -> tuple[InterfaceHistory, ...]:
        return self.worn_cycle(depths).histories

    def _cycle(self, depths: list[Array], after: CycleSolution | None) -> CycleSolution:
        model = self.model
        solution = self.structure.solve_cycle(
            self.joint, model.amplitudes, self._gap(depths), model.friction, after, model.preload
        )
        if not solution.converged:
            raise MethodFailed(
                f"structural friction did not converge: residual {solution.residual:.1e} after "
                f"{solution.iterations} iterations; refine load_path.increments or lower "
                "friction.coefficient, and see that the loads leave no face open"
            )
        return solution

    def probe(self, depths: list[Array]) -> Array:
        """Resultants ``(interfaces, 6)`` at peak load reached in a single increment.

        Cheap, and moved by wear as those of the full cycle are.
        """
        (state,) = self._march_to_peak(depths, [self._unworn_peak.state])
        return self.structure.interface_resultants(state)

    @cached_property
    def _unworn_peak(self) -> FrictionState:
        (state,) = self._march_to_peak([np.zeros(len(i)) for i in self.mesh.interfaces], [])
        return state

    def _march_to_peak(self, depths: list[Array], guess: list[Array]) -> Iterator[FrictionState]:
        amplitudes = self.model.amplitudes[self.peak : self.peak + 1]
        return self.joint.march(amplitudes, self._gap(depths), guess=guess)

    def stress(self, mesh: StructureMesh, solution: CycleSolution) -> tuple[StressField, ...]:
        """Stress of both bodies at peak load, on the unworn or the worn mesh."""
        worn = mesh is not self.mesh
        structure = self._prestressed(self.model.structure(mesh)) if worn else self.structure
        fields = {name: values[self.peak] for name, values in solution.fields().items()}
        amplitudes = self.model.amplitudes[self.peak]
        return stress_state(structure, fields["force"], fields["displacement"], amplitudes)

    def _gap(self, depths: list[Array]) -> Array:
        return self.structure.gap() + np.concatenate(depths)
