"""Loads of contacts from a structure of finite elements: joint, cycles, stress and worn mesh."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.linalg import eigvalsh

from fe_models.elasticity.nonlinear import NonlinearCheck, check_nonlinearity
from fe_models.elasticity.relinearised import (
    PrestressedStructure,
    relinearised,
    stress_stiffened,
)
from fe_models.elasticity.stress import CycleStress, cycle_stresses
from fe_models.joints.friction import FrictionalJoint, FrictionState
from fe_models.joints.joint import JointResolvent, Resolvent
from fe_models.joints.sparse_joint import SparseResolvent
from fe_models.loads.pretension import Bolt, tightened
from fe_models.meshes.cut_face import whole_history, whole_resultants
from fe_models.meshes.remesh import worn_mesh
from fe_models.meshes.structure_mesh import MeshError, StructureMesh
from fe_models.motion import deformation
from fe_models.structure import CycleSolution, InterfaceHistory, Structure, mixed
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array
from workflow.errors import MethodFailed
from workflow.models.loads import BODIES, ContactFace, UserFace
from workflow.models.progress import ReportsProgress
from workflow.models.structure_model import (
    LoadCycle,
    NoStore,
    Remark,
    StructureModel,
    StructureStore,
)

Solved = TypeVar("Solved", CycleSolution, FrictionState)


class StructureLoads(ReportsProgress):
    """Loads of the contacts of a structure, with its stresses and worn mesh.

    It is a :class:`workflow.models.loads.LoadSource`. Condensed bodies, joints and unworn cycles
    are taken from the ``store`` if they are there. ``friction`` returns the coefficient of an
    unworn interface by its name; methods take one coefficient per interface after wear.

    Worn depths are nodal, ``(n,)`` per contact face, the sum of both bodies [mm]. Where planes of
    symmetry cut a face, the contact is the whole face, and its first nodes are the meshed ones;
    cycles, stresses and worn meshes describe the meshed part.
    """

    slip_known = True

    def __init__(
        self,
        model: StructureModel,
        friction: Callable[[str], float],
        store: StructureStore | None = None,
    ) -> None:
        self.model = model
        self._friction = friction
        self.peak = model.peak
        self._store = NoStore() if store is None else store
        self.from_cache = False
        self._worn: tuple[Array, CycleSolution] | None = None

    @cached_property
    def mesh(self) -> StructureMesh:
        """The unworn mesh."""
        return self.model.meshed().weighted(self.model.order)

    @cached_property
    def friction(self) -> tuple[float, ...]:
        """Coulomb's coefficient of every interface before any wear."""
        return tuple(self._friction(interface.name) for interface in self.mesh.interfaces)

    def remarks(self) -> Iterable[Remark]:
        """Return remarks on the structure for the user."""
        return self.model.remarks(self.structure, self.friction)

    @property
    def faces(self) -> tuple[ContactFace, ...]:
        return tuple(self.model.contact_face(interface) for interface in self.mesh.interfaces)

    @property
    def line(self) -> bool:
        return self.mesh.interfaces[0].line

    @cached_property
    def joint(self) -> FrictionalJoint:
        """The joint before any wear, from the cache if it is there."""
        return FrictionalJoint(self._resolvent, self._nodal_friction())

    @cached_property
    def _resolvent(self) -> Resolvent:
        """The joint with the stiffness that the case asks for."""
        resolvent = self._linear_resolvent
        # Only a nonlinear stiffness needs the structure itself, which takes seconds to build.
        if self.model.nonlinearity.stiffness != "linear":
            assert isinstance(self.structure, PrestressedStructure)
            resolvent = self.structure.condense_path(resolvent)
        return resolvent

    @property
    def rigid_modes(self) -> int:
        """Number of rigid motions that contact alone prevents."""
        return self._linear_resolvent.rigid_modes

    @property
    def sparse(self) -> bool:
        """True if the joint has sparse factors, since full matrices do not fit into memory."""
        return isinstance(self._linear_resolvent, SparseResolvent)

    @cached_property
    def _linear_resolvent(self) -> Resolvent:
        def condense() -> Resolvent:
            if self.model.nonlinearity.stiffness == "linear":
                return self._linear.resolvent(self._progress, self._store.body)
            # The joint along the path of a nonlinear stiffness has full matrices.
            return self._linear.condense(None, self._progress, self._store.body).resolvent()

        joint, self.from_cache = self._store.joint(self.model.key, condense)
        return joint

    @cached_property
    def _linear(self) -> Structure:
        return self.model.structure(self.mesh)

    @cached_property
    def structure(self) -> Structure:
        """All unworn bodies with supports and loads, with the stiffness that the case asks for."""
        return self._prestressed(self._linear)

    def _prestressed(self, structure: Structure) -> Structure:
        """Return the structure with the stiffness that the case asks for."""
        kind = self.model.nonlinearity.stiffness
        if kind == "linear":
            return structure
        amplitudes = self.peak_amplitudes
        softening = self.model.softening(structure)
        how = {"stress_stiffened": stress_stiffened, "relinearised": relinearised}
        return how[kind](structure, self._linear_peak, amplitudes, softening)

    @cached_property
    def _linear_peak(self) -> tuple[Array, ...]:
        """Displacements of all bodies of the linear structure at peak load."""
        amplitudes = self.peak_amplitudes
        linear = FrictionalJoint(self._linear_resolvent, self._nodal_friction())
        (state,) = map(_converged, linear.march(amplitudes[None], self._linear.gap()))
        return deformation(self._linear, state.force, state.displacement, amplitudes)

    @cached_property
    def nonlinear_check(self) -> NonlinearCheck:
        """Comparison of the linear structure with the total Lagrangian one at peak load."""
        linear = self._linear
        check = check_nonlinearity(
            linear,
            self._linear_resolvent,
            self._nodal_friction(),
            self.peak_amplitudes,
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
        """Return the number of nodes of all bodies, midside nodes included."""
        return self.mesh.node_count(self.model.order)

    def interface_count(self) -> int:
        """Return the number of nodes of all interfaces."""
        return sum(len(interface) for interface in self.mesh.interfaces)

    def prepare(self) -> None:
        """Condense the structure now, which is costly, or find it in the cache."""
        _ = self.joint

    @cached_property
    def unworn_cycle(self) -> CycleSolution:
        """The closed cycle from rest with unworn faces, of all missions one after the other."""
        return self._mixed(self._unworn_missions)

    def cycle_under(self, missions: Sequence[LoadCycle]) -> CycleSolution:
        """Return the unworn cycle under other missions, which use the load cases of the model."""
        cycles = [self._unworn_mission(self._tight(mission)) for mission in missions]
        return mixed(cycles, [mission.share for mission in missions])

    @cached_property
    def _unworn_missions(self) -> tuple[CycleSolution, ...]:
        return tuple(map(self._unworn_mission, self.load_cycles))

    @cached_property
    def load_cycles(self) -> tuple[LoadCycle, ...]:
        """Closed cycles of the loads, with the bolts at their tightened shortening."""
        return tuple(map(self._tight, self.model.load_cycles))

    @cached_property
    def bolts(self) -> tuple[Bolt, ...]:
        """The bolts of the structure; empty if the loads tighten none."""
        return self.model.bolts(self._linear) if self.model.tightening else ()

    @cached_property
    def shortenings(self) -> Array:
        """Shortening of each tightened bolt relative to that of its load case ``(bolts,)``."""
        found = np.ones(len(self.bolts))
        asked = [k for k, bolt in enumerate(self.bolts) if bolt.force is not None]
        if asked:
            mission = self.model.load_cycles[0]
            path = mission.preload[: self.model.tightening]
            bolts = [self.bolts[k] for k in asked]
            try:
                found[asked] = tightened(self.structure, self.joint, path, bolts)
            except MeshError as error:
                raise MethodFailed(str(error)) from error
        return found

    def _tight(self, mission: LoadCycle) -> LoadCycle:
        """Return the mission with the bolts at their tightened shortening."""
        if not self.bolts:
            return mission
        factors = np.ones(mission.amplitudes.shape[1])
        factors[[bolt.case for bolt in self.bolts]] = self.shortenings
        amplitudes, preload = mission.amplitudes * factors, mission.preload * factors
        return replace(mission, amplitudes=amplitudes, preload=preload)

    def tensions(self, loads: Sequence[LoadHistory]) -> Array:
        """Return bolt tensions ``(bolts, t)`` [N] under the loads of all whole contacts."""
        if not self.bolts:
            return np.empty((0, len(self._amplitudes)))
        sides = [2.0 ** len(interface.planes) for interface in self.mesh.interfaces]
        resultants = np.stack([of.resultants / n for of, n in zip(loads, sides, strict=True)], 1)
        return np.array([b.section.tension(resultants, self._amplitudes) for b in self.bolts])

    def _unworn_mission(self, mission: LoadCycle) -> CycleSolution:
        """Return the closed cycle of one mission from rest, from the cache if it is there."""
        friction = self._nodal_friction()
        loads = [path.tolist() for path in (mission.preload, mission.amplitudes)]
        stiffness = self.model.nonlinearity.stiffness
        at = None if stiffness == "linear" else self.peak_amplitudes.tolist()
        gaps = [interface.gap.tobytes() for interface in self.mesh.interfaces]
        key = *self.model.key, *loads, stiffness, at, self.friction, gaps
        return self._store.cycle(
            key,
            self.structure,
            friction,
            lambda: self._cycle(mission, self._no_wear(), None, None),
        )

    def unworn(self) -> tuple[InterfaceHistory, ...]:
        return self.on_faces(self.unworn_cycle)

    def on_faces(self, cycle: CycleSolution) -> tuple[InterfaceHistory, ...]:
        """Return the cycle of each contact face; a face that symmetry cuts is completed."""
        return tuple(map(whole_history, cycle.histories))

    def worn_cycle(
        self,
        depths: list[Array],
        friction: Sequence[float] | None = None,
        after: CycleSolution | None = None,
    ) -> CycleSolution:
        """Return the cycle that follows the unworn one when worn depths widen the gaps.

        A single mission may start from a cycle ``after`` less wear, which is faster.
        """
        missions, asked = self._unworn_missions, np.concatenate([*depths, friction or ()])
        if after is not None:
            (unworn,) = missions
            missions = (replace(after, cycles=unworn.cycles),)
        elif self._worn is not None and np.array_equal(asked, self._worn[0]):
            # The cycle at the end is requested again where the loads have just been updated.
            return self._worn[1]
        pairs = zip(self.load_cycles, missions, strict=True)
        cycles = [self._cycle(mission, depths, unworn, friction) for mission, unworn in pairs]
        cycle = self._mixed(cycles)
        if after is None:
            self._worn = asked, cycle
        return cycle

    def worn(
        self, depths: list[Array], friction: Sequence[float] | None = None
    ) -> tuple[InterfaceHistory, ...]:
        return self.on_faces(self.worn_cycle(depths, friction))

    def _mixed(self, cycles: Sequence[CycleSolution]) -> CycleSolution:
        return mixed(cycles, [mission.share for mission in self.load_cycles])

    def _cycle(
        self,
        mission: LoadCycle,
        depths: list[Array],
        after: CycleSolution | None,
        friction: Sequence[float] | None,
    ) -> CycleSolution:
        nodal = self._nodal_friction(friction)
        joint, gap = self._joint_of(nodal), self._gap(depths)
        amplitudes, preload = mission.amplitudes, mission.preload
        return _converged(
            self.structure.solve_cycle(
                joint, amplitudes, gap, nodal, after, preload, self._progress
            )
        )

    def stiffest(self, areas: Array) -> float:
        """Return the largest rise of nodal pressure per change of gap, for ``areas`` [MPa/mm]."""
        scale = np.divide(1.0, np.sqrt(areas), out=np.zeros_like(areas), where=areas > 0.0)
        assert isinstance(self._resolvent, JointResolvent), "the run needs its full matrices"
        stiffness = self._resolvent.normal_stiffness(len(areas))
        last = len(areas) - 1
        (largest,) = eigvalsh(scale[:, None] * stiffness * scale, subset_by_index=[last, last])
        return float(largest)

    def user_faces(self, number: int) -> tuple[UserFace, ...]:
        """Return the nodes of the interface's faces that have numbers in the user's mesh."""
        interface = self.mesh.interfaces[number]
        return tuple(
            UserFace(body, numbers[interface.nodes(body)], interface.frame)
            for body, place in zip(BODIES, interface.bodies, strict=True)
            if (numbers := self.model.node_numbers(place)) is not None
        )

    def probe(self, depths: list[Array], friction: Sequence[float] | None = None) -> Array:
        """Return the resultants ``(interfaces, 6)`` at peak load, reached in a single increment.

        They are cheap, and wear and friction change them as they change those of the full cycle.
        """
        state = self._march_to_peak(depths, [self._unworn_peak.state], friction)
        pairs = zip(self.mesh.interfaces, self.structure.interface_resultants(state), strict=True)
        return np.array([whole_resultants(*pair) for pair in pairs])

    @cached_property
    def _unworn_peak(self) -> FrictionState:
        return self._march_to_peak(self._no_wear(), [], None)

    def _no_wear(self) -> list[Array]:
        return [np.zeros(len(interface)) for interface in self.mesh.interfaces]

    def _march_to_peak(
        self, depths: list[Array], guess: list[Array], friction: Sequence[float] | None
    ) -> FrictionState:
        joint = self._joint_of(self._nodal_friction(friction))
        path = self.peak_amplitudes[None]
        (state,) = map(_converged, joint.march(path, self._gap(depths), guess=guess))
        return state

    def _nodal_friction(self, friction: Sequence[float] | None = None) -> float | Array:
        """Return the coefficients of friction at all nodes ``(n,)``, or the one that all share."""
        if friction is None:
            friction = self.friction
            if len(set(friction)) == 1:
                return friction[0]
        return np.repeat(friction, [len(interface) for interface in self.mesh.interfaces])

    def _joint_of(self, friction: float | Array) -> FrictionalJoint:
        if isinstance(friction, float):
            return self.joint
        return FrictionalJoint(self._resolvent, friction)

    @property
    def _amplitudes(self) -> Array:
        """Amplitudes of the load cases in all increments ``(t, cases)``."""
        return np.concatenate([mission.amplitudes for mission in self.load_cycles])

    @property
    def peak_amplitudes(self) -> Array:
        """Amplitudes of the load cases at peak load ``(cases,)``."""
        peak: Array = self._amplitudes[self.peak]
        return peak

    def stresses(
        self,
        cycles: Mapping[str, CycleSolution],
        shown: Sequence[int] = (),
        done: Callable[[], None] = lambda: None,
    ) -> dict[str, CycleStress]:
        """Return the stress of all bodies by cycle: at peak load and in the increments ``shown``.

        Worn faces act by the forces of their cycle: depths of micrometres do not change how bodies
        deform. In the increments ``shown``, stress is that of the surface. For ``done`` see
        :func:`fe_models.elasticity.stress.cycle_stresses`.
        """
        fields = [cycle.fields() for cycle in cycles.values()]
        given = [(of["force"], of["displacement"]) for of in fields]
        amplitudes = self._amplitudes
        stresses = cycle_stresses(self.structure, given, amplitudes, self.peak, shown, done)
        return dict(zip(cycles, stresses, strict=True))

    def worn_mesh(self, depths: list[tuple[Array, Array]]) -> StructureMesh:
        """Return the mesh whose faces have lost nodal ``depths`` ``(n,)`` of body 1 and 2 [mm].

        Raises as :func:`fe_models.meshes.remesh.worn_mesh`.
        """
        return worn_mesh(self.mesh, depths)

    def _gap(self, depths: list[Array]) -> Array:
        pairs = zip(self.mesh.interfaces, depths, strict=True)
        meshed = [depth[: len(interface)] for interface, depth in pairs]
        return self.structure.gap() + np.concatenate(meshed)


def _converged(solved: Solved) -> Solved:
    """Return a solution that has converged. Raises MethodFailed otherwise."""
    if not solved.converged:
        raise MethodFailed(
            f"structural friction did not converge: residual {solved.residual:.1e} after "
            f"{solved.iterations} iterations; see that contacts and supports can carry the loads "
            "and leave no face open, take more increments or lower the friction"
        )
    return solved
