"""Supported bodies with their interfaces: condensation, contact history and equilibrium."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeVar

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.joints.condensation import Keep, made_anew
from fe_models.joints.friction import LOAD_FLOOR, FrictionalJoint, FrictionState
from fe_models.joints.joint import JointStiffness, Resolvent, join, join_halves
from fe_models.joints.sparse_joint import (
    SparseBody,
    SparseResolvent,
    expected_rho,
    relative_displacements,
)
from fe_models.meshes.structure_mesh import Face, Interface, StructureMesh, in_space
from fe_models.mirrored_bodies import Halves, mirrored_halves
from fe_models.solvers.memory import available_bytes, full_matrices_bytes
from fe_models.solvers.pardiso import in_parallel
from fe_models.solvers.symmetry import Mirror
from fe_models.supported_body import SupportedBody
from sa_solver.cycles.increments import dissipated, in_rows, mean_of_ends
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array, Indices, Progress, Tally, resultants, unseen

T = TypeVar("T")

# Number of unknowns of all bodies up to which they are factorised in parallel, which takes some
# 2 GB. Larger bodies gain as much from PARDISO's own threads, and each factorisation would count
# on all the free memory.
MOST_AT_ONCE = 300_000
# A face is in gross slip when its sticking nodes carry less than this share of its load.
STICKING_SHARE = 1e-2
# Below this share of the cycle's largest P the resultants are errors of the friction solver.
UNLOADED_SHARE = 1e-6
# A cycle is closed when its contact forces differ from those of the previous cycle by less than
# this share of the largest force: a tenth of the discretisation error, and a hundred times the
# error due to the tolerance of the friction solver. Dovetails close to 1e-5 in two cycles.
CLOSED = 1e-3
# Slip that shakes down decays by a constant factor per cycle; a crowned pad took 12 cycles. A
# contact that ratchets never closes.
MOST_CYCLES = 20
# Nodal fields that a history holds for each increment.
FIELDS = ("force", "displacement", "slip")
# A node slips when its shear reaches this share of the Coulomb limit.
LIMIT_SHARE = 1.0 - 1e-6


@dataclass(frozen=True)
class InterfaceHistory:
    """Loads and nodal fields of one ``interface`` over the increments of a cycle, in its frame.

    ``loads`` are the resultants and dissipated energies. ``force`` ``(t, 3, n)`` is that on body 2
    [N], ``displacement`` ``(t, 3, n)`` that of body 2 relative to body 1 [mm], and ``slip``
    ``(t, 2, n)`` that of each increment [mm], zero where a node sticks. Loads and forces of a line
    contact are per length.
    """

    interface: Face
    loads: LoadHistory
    force: Array
    displacement: Array
    slip: Array

    @property
    def pressure(self) -> Array:
        """Nodal pressure ``(t, n)`` [MPa]."""
        return self.force[:, 2] / self.interface.nodal_areas


@dataclass(frozen=True)
class CycleSolution:
    """Closed cycle of a structure, with the convergence measures of the solver.

    ``histories`` are those of the interfaces and ``states`` those of the splitting, by increment.
    The next cycle starts from ``last_displacement`` ``(3, n)`` [mm]. ``iterations`` is the sum of
    the solver's, ``residual`` its largest, and ``converged`` whether all increments have converged.
    ``closure`` is the largest change of the contact forces between the last two of the ``cycles``
    that were marched, relative to the largest force, or 0 if only one was. ``equilibrium`` ``(t,)``
    is the error that :meth:`Structure.equilibrium_errors` returns.
    """

    histories: tuple[InterfaceHistory, ...]
    states: tuple[Array, ...]
    last_displacement: Array
    iterations: int
    residual: float
    converged: bool
    closure: float
    equilibrium: Array
    cycles: int = 2

    def fields(self) -> dict[str, Array]:
        """Return force, displacement and slip over all interfaces, for storing and restoring."""
        return {
            name: np.concatenate([getattr(history, name) for history in self.histories], axis=-1)
            for name in FIELDS
        }


@dataclass(frozen=True)
class Structure:
    """Assembly of supported and loaded ``bodies`` on a ``mesh``.

    The supports must prevent rigid motion when all faces stick; contact alone may hold some bodies.

    Examples
    --------
    Two plane blocks lie on each other. The lower one is held, the upper one is pressed by 5 and 10
    MPa over 1 mm. The contact carries the applied loads.

    >>> import numpy as np
    >>> from skfem import MeshTri
    >>> from fe_models import *
    >>> from fe_models.meshes.structure_mesh import matched_interface
    >>> from fe_models.supported_body import interface_nodes
    >>> from sa_solver import Frame, Material
    >>> steel, side = Material(210e3, 0.3), np.linspace(0.0, 1.0, 4)
    >>> ends = {"contact": lambda x: x[1] == 0.0, "end": lambda x: abs(x[1]) == 1.0}
    >>> lower, upper = (
    ...     ElasticBody(Body("block", MeshTri.init_tensor(side, z).with_boundaries(ends)), steel)
    ...     for z in (side - 1.0, side)
    ... )
    >>> frame = Frame(np.array([0.5, 0.0, 0.0]), np.eye(3))
    >>> face = matched_interface("joint", lower.body, upper.body, "contact", frame)
    >>> held, free = Constraints(len(lower.nodes), 2), Constraints(len(upper.nodes), 2)
    >>> held.hold(lower.boundary_nodes("end"))
    >>> nothing, pressed = np.zeros((lower.size, 1)), upper.pressure_load("end")[:, None]
    >>> bodies = (
    ...     SupportedBody(lower, held, *interface_nodes([(face, 1)], lower.body), nothing),
    ...     SupportedBody(upper, free, *interface_nodes([(face, 2)], upper.body), pressed),
    ... )
    >>> structure = Structure(StructureMesh((lower.body, upper.body), (face,)), bodies)
    >>> joint = FrictionalJoint(structure.condense().resolvent(), friction=0.5)
    >>> cycle = structure.solve_cycle(joint, np.array([[5.0], [10.0]]), structure.gap(), 0.5)
    >>> print(cycle.histories[0].loads.P.round(4), "N/mm")
    [ 5. 10.] N/mm
    """

    mesh: StructureMesh
    bodies: tuple[SupportedBody, ...]

    @property
    def dimension(self) -> int:
        """Dimension of the bodies, 2 or 3."""
        return self.bodies[0].elastic.dimension

    @cached_property
    def places(self) -> tuple[Indices, ...]:
        """Positions of each body's interface displacements in the vector of all faces.

        That vector holds the displacements of faces 1, interface by interface, and then of faces 2.
        """
        d, faces = self.dimension, self.mesh.interfaces
        order = [(i, side) for side in (1, 2) for i in range(len(faces))]
        sizes = [d * len(faces[i].nodes(side)) for i, side in order]
        ends = np.cumsum(sizes)
        place = {
            key: np.arange(end - n, end) for key, n, end in zip(order, sizes, ends, strict=True)
        }
        return tuple(
            np.concatenate([place[key] for key in self.mesh.sides_of(number)])
            for number in range(len(self.bodies))
        )

    @cached_property
    def held(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Flags of the displacements of faces 1 and of faces 2 that supports hold at zero."""
        held = np.zeros(sum(map(len, self.places)), bool)
        for body, place in zip(self.bodies, self.places, strict=True):
            held[place] = body.held
        faces_1 = sum(len(interface.nodes_1) for interface in self.mesh.interfaces)
        return held[: self.dimension * faces_1], held[self.dimension * faces_1 :]

    def resolvent(
        self,
        progress: Progress = unseen,
        keep: Keep = made_anew,
        memory: float | None = None,
    ) -> Resolvent:
        """Return the resolvent of the joint, which the friction solver needs.

        It has full matrices, which are fast, if these fit into ``memory`` [bytes], by default what
        is free. Otherwise it has the sparse factors of all bodies. Bodies of second-order elements
        always have full matrices. For ``progress`` and ``keep`` see :meth:`condense`.
        """
        done = self._steps(progress)
        halves = self._halves(done, keep)
        size, limit = len(self.held[1]), available_bytes() if memory is None else memory
        if full_matrices_bytes(size, len(self.bodies), halves is not None) > limit:
            sparse = [body.uncondensed() for body in self.bodies]
            found = [body for body in sparse if body is not None]
            if len(found) == len(sparse):
                return self._sparse_resolvent(found)
        return self._condensed(done, keep, None, halves).resolvent()

    def condense(
        self,
        like: Resolvent | None = None,
        progress: Progress = unseen,
        keep: Keep = made_anew,
    ) -> JointStiffness:
        """Return stiffness and loads of the joint on the interface displacements.

        Parameters
        ----------
        like
            A joint that differs little from this one and whose ρ is used for this one.
        progress
            Called with the number of steps done and the total.
        keep
            Store that may return bodies condensed before.
        """
        done = self._steps(progress)
        halves = self._halves(done, keep) if like is None else None
        return self._condensed(done, keep, like, halves)

    def _steps(self, progress: Progress) -> Tally:
        """Return the step counter of a condensation: two steps per body, and one for the joint."""
        return Tally(progress, 2 * len(self.bodies) + 1)

    def _condensed(
        self, done: Tally, keep: Keep, like: Resolvent | None, halves: Halves | None
    ) -> JointStiffness:
        """Return the joint of condensed bodies, or of their ``halves``."""
        if halves is not None:
            condensed = self.run_parallel(*halves.of_1, *halves.of_2)
            joint = join_halves(condensed[:2], condensed[2:], halves.mirror)
        else:
            jobs = (partial(body.condense, done, keep) for body in self.bodies)
            condensed = self.run_parallel(*jobs)
            joint = join(condensed, self._free_projection, self._free_places, self.held[1], like)
        done()
        return joint

    @property
    def _free_places(self) -> list[Indices]:
        """Positions of each body's free interface displacements among those of all faces."""
        among_free = np.cumsum(~np.concatenate(self.held)) - 1
        pairs = zip(self.bodies, self.places, strict=True)
        return [among_free[place[~body.held]] for body, place in pairs]

    @property
    def _free_projection(self) -> sp.csr_matrix | None:
        """Projection of the free displacements of faces 1, or None if all faces match."""
        held_1, held_2 = self.held
        projection = self.projection
        if not held_1.any() and not held_2.any():
            return projection
        every = sp.identity(len(held_2), format="csr") if projection is None else projection
        return every[~held_2][:, ~held_1]

    def _halves(self, done: Tally, keep: Keep) -> Halves | None:
        """Return what condenses two bodies in halves of a mirror symmetry, or None without one."""
        held_1, held_2 = self.held
        if self.projection is not None or held_1.any() or held_2.any() or len(self.bodies) != 2:
            return None
        return mirrored_halves(*self.bodies, self.run_parallel, done, keep)

    def _sparse_resolvent(self, bodies: Sequence[SparseBody]) -> SparseResolvent:
        """Return the resolvent of all bodies as one sparse system."""
        order = np.concatenate(self._free_places)
        relative = relative_displacements(self._free_projection, self.held, order)
        rho = expected_rho(bodies, self.mesh.interfaces)
        rigid_modes = sum(body.rigid_modes for body in self.bodies)
        return SparseResolvent(bodies, relative, rho, rigid_modes, self._mirror())

    def _mirror(self) -> Mirror | None:
        """Return a mirror of the free displacements of all bodies, if their nodes have one."""
        for axis in self.bodies[0].elastic.body.axes:
            mirrors = [body.mirror(axis) for body in self.bodies]
            found = [mirror for mirror in mirrors if mirror is not None]
            if len(found) == len(mirrors):
                return Mirror.beside(found)
        return None

    def run_parallel(self, *jobs: Callable[[], T]) -> list[T]:
        """Run jobs that each factorise a body, in parallel if memory surely suffices."""
        if sum(body.elastic.size for body in self.bodies) > MOST_AT_ONCE:
            return [job() for job in jobs]
        return in_parallel(jobs)

    @property
    def projection(self) -> sp.csr_matrix | None:
        """Projection of displacements of faces 1 to the nodes of faces 2, in the interface frames.

        None if all interfaces meet node to node.
        """
        interfaces = self.mesh.interfaces
        if all(i.projection is None for i in interfaces):
            return None
        blocks = [sp.identity(len(i)) if i.projection is None else i.projection for i in interfaces]
        components = sp.identity(self.dimension)
        return sp.kron(sp.block_diag(blocks), components, format="csr")

    def carried(self, moved: Array) -> Array:
        """Return displacements ``(d n, ...)`` at the nodes of faces 2 that move with faces 1.

        ``moved`` ``(d n_1, ...)`` are the displacements of faces 1.
        """
        projection = self.projection
        return moved if projection is None else np.asarray(projection @ moved)

    @property
    def held_faces(self) -> dict[str, float]:
        """Share of its nodes that supports hold along one direction, by name of the interface.

        A plane of symmetry holds some nodes; a slice in plane strain holds all of them. Interfaces
        without held nodes are left out.
        """
        held = self.held[1].reshape(-1, self.dimension)
        shares = {i.name: float(held[nodes].mean(axis=0).max()) for i, nodes in self.shares()}
        return {name: share for name, share in shares.items() if share > 0.0}

    def gap(self) -> Array:
        """Return the unworn gaps of all interfaces one after the other ``(n,)`` [mm]."""
        return np.concatenate([i.gap for i in self.mesh.interfaces])

    def solve_cycle(
        self,
        joint: FrictionalJoint,
        amplitudes: Array,
        gap: Array,
        friction: float | Array,
        after: CycleSolution | None = None,
        preload: Array | None = None,
        progress: Progress = unseen,
    ) -> CycleSolution:
        """Solve one closed cycle of a load path.

        The first cycle starts from rest and passes ``preload`` once. Cycles are then repeated until
        one equals the previous one, at most ``MOST_CYCLES`` times; ``closure`` of the result tells
        whether the cycle has closed. A cycle that follows ``after`` repeats as many cycles as that
        solution had repeated.

        Parameters
        ----------
        joint
            The joint with friction.
        amplitudes
            Amplitudes of the load cases in every increment ``(t, cases)``.
        gap
            Gaps of all interfaces ``(n,)`` [mm].
        friction
            Friction coefficient of the joint, one or by node ``(n,)``.
        after
            Solution from whose last state this cycle starts.
        preload
            Amplitudes ``(s, cases)`` passed once before the first cycle.
        progress
            Called with the number of increments solved and the number up to the end of the second
            cycle, or of the next one.
        """
        if after is None:
            once = amplitudes[:0] if preload is None else preload
            path = np.concatenate([once, amplitudes])
            first = joint.march(path, gap)
            marched = [_reported(first, 0, len(path) + len(amplitudes), progress)[len(once) :]]
            displacement, guess = marched[0][-1].displacement, [s.state for s in marched[0]]
            most = MOST_CYCLES
        else:
            marched = []
            displacement, guess = after.last_displacement, list(after.states)
            most = max(after.cycles - 1, 1)
        closure = np.inf
        while len(marched) < most and closure > CLOSED:
            if marched and not all(state.converged for state in marched[-1]):
                break
            done = len(amplitudes) * len(marched)
            cycle = joint.march(amplitudes, gap, displacement, guess)
            marched.append(_reported(cycle, done, done + len(amplitudes), progress))
            displacement, guess = marched[-1][-1].displacement, [s.state for s in marched[-1]]
            if len(marched) > 1:
                closure = _closure(*marched[-2:])
        states, last = [state for cycle in marched for state in cycle], marched[-1]
        # Fields from the cache are contiguous: sums over these must be rounded in the same way.
        fields = {
            name: np.ascontiguousarray(np.stack([getattr(s, name) for s in last]))
            for name in FIELDS
        }
        return CycleSolution(
            histories=self.histories(**fields, friction=friction),
            states=tuple(s.state for s in last),
            last_displacement=displacement,
            iterations=sum(s.iterations for s in states),
            residual=max(s.residual for s in states),
            converged=all(s.converged for s in states),
            closure=closure if len(marched) > 1 else 0.0,
            equilibrium=self.equilibrium_errors(last, amplitudes),
            cycles=len(marched),
        )

    def histories(
        self, force: Array, displacement: Array, slip: Array, friction: float | Array
    ) -> tuple[InterfaceHistory, ...]:
        """Return the interface histories from fields ``(t, components, n)`` over all interfaces.

        ``friction`` is µ, one value or by node ``(n,)``.
        """
        histories = []
        nodal = np.broadcast_to(friction, force.shape[-1:])
        for interface, nodes in self.shares():
            parts = force[..., nodes], displacement[..., nodes], slip[..., nodes]
            loads = load_history(interface, parts[0], parts[2], nodal[nodes])
            histories.append(InterfaceHistory(interface, loads, *parts))
        return tuple(histories)

    def interface_resultants(self, state: FrictionState) -> Array:
        """Return ``(P, Qx, Qy, Mx, My, Mz)`` of every interface, ``(interfaces, 6)``."""
        return np.array(
            [
                resultants(state.force[:, nodes], *interface.coordinates.T)
                for interface, nodes in self.shares()
            ]
        )

    def on_faces(self, force: Array) -> Array:
        """Return the contact forces on the bodies at all faces ``(places, t)``.

        ``force`` ``(t, 3, n)`` are the forces on body 2 in the interface frames.
        """
        axes = self.mesh.bodies[0].axes
        on_2 = np.asarray(force)[:, axes, :].transpose(2, 1, 0).reshape(-1, len(force))
        projection = self.projection
        on_1 = on_2 if projection is None else projection.T @ on_2
        return np.concatenate([-on_1, on_2])

    def equilibrium_errors(self, states: Sequence[FrictionState], amplitudes: Array) -> Array:
        """Return the relative error of the force and moment balance in each state, ``(t,)``.

        The error is the part of the forces and moments along the motions that supports leave free;
        the value of the worst body is returned. It is relative to the applied load plus the nodal
        contact forces, or to ``LOAD_FLOOR`` of the largest of these over all increments where the
        load is small. Moments are taken about the centre of the body's contacts and divided by
        their size.
        """
        forces = self.on_faces(np.stack([state.force for state in states]))
        worst = np.zeros(len(states))
        for number, place in enumerate(self.places):
            np.maximum(worst, self._unbalanced(number, forces[place], amplitudes), out=worst)
        return worst

    def _unbalanced(self, number: int, forces: Array, amplitudes: Array) -> Array:
        """Return the errors of one body under ``forces`` ``(d n, t)`` in its faces' frames."""
        body = self.bodies[number]
        faces = self.mesh.faces_of(number)
        points = np.concatenate([body.elastic.body.points[i.nodes(side)] for i, side in faces])
        middle = points.mean(axis=0)
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        free = body.free_motions(middle, size)
        if not len(free):
            return np.zeros(len(amplitudes))
        ends = np.cumsum([len(i.nodes(side)) for i, side in faces])[:-1]
        errors, scales = np.empty((2, len(amplitudes)))
        for t, of_t in enumerate(in_space(forces.T.reshape(len(amplitudes), -1, self.dimension))):
            parts = zip(faces, np.split(of_t, ends), strict=True)
            acting = np.concatenate([i.frame.to_global(part) for (i, _), part in parts])
            places, borne = body.borne(acting)
            moments = np.cross(places - middle, borne).sum(axis=0)
            applied = body.load_resultants(amplitudes[t], middle)
            force, moment = applied + np.array([acting.sum(axis=0), moments])
            errors[t] = np.linalg.norm(free @ np.append(force, moment / size))
            scales[t] = np.linalg.norm(applied[0]) + np.abs(of_t).sum()
        floor = LOAD_FLOOR * scales.max()
        return errors / np.maximum(scales, floor) if floor > 0.0 else errors

    def shares(self) -> list[tuple[Interface, slice]]:
        """Return every interface with the slice of its nodes among all interface nodes."""
        ends = np.cumsum([len(i) for i in self.mesh.interfaces]).tolist()
        return [
            (interface, slice(end - len(interface), end))
            for interface, end in zip(self.mesh.interfaces, ends, strict=True)
        ]


def mixed(cycles: Sequence[CycleSolution], shares: Sequence[float]) -> CycleSolution:
    """Combine closed ``cycles`` of one structure, passed one after the other in given ``shares``.

    Iterations are summed; of the errors the largest is taken. A later cycle must start from one of
    ``cycles``, not from the combination.
    """
    if len(cycles) == 1:
        return cycles[0]
    histories = []
    for parts in zip(*(cycle.histories for cycle in cycles), strict=True):
        fields = {name: np.concatenate([getattr(p, name) for p in parts]) for name in FIELDS}
        loads = LoadHistory.mix([part.loads for part in parts], shares)
        histories.append(InterfaceHistory(parts[0].interface, loads, **fields))
    return CycleSolution(
        histories=tuple(histories),
        states=tuple(state for cycle in cycles for state in cycle.states),
        last_displacement=cycles[-1].last_displacement,
        iterations=sum(cycle.iterations for cycle in cycles),
        residual=max(cycle.residual for cycle in cycles),
        converged=all(cycle.converged for cycle in cycles),
        closure=max(cycle.closure for cycle in cycles),
        equilibrium=np.concatenate([cycle.equilibrium for cycle in cycles]),
        cycles=max(cycle.cycles for cycle in cycles),
    )


def _reported(
    states: Iterable[FrictionState], before: int, total: int, progress: Progress
) -> list[FrictionState]:
    """Return all states, and report each as increment ``before`` + 1, + 2, ... of ``total``."""
    solved = []
    for number, state in enumerate(states, before + 1):
        solved.append(state)
        progress(number, total)
    return solved


def _closure(one: Sequence[FrictionState], two: Sequence[FrictionState]) -> float:
    """Return the largest change of contact forces between cycles, relative to the largest force."""
    largest = max(float(np.abs(state.force).max()) for state in two)
    pairs = zip(one, two, strict=True)
    change = max(float(np.abs(first.force - second.force).max()) for first, second in pairs)
    return change / largest if largest > 0.0 else 0.0


def load_history(
    interface: Face, force: Array, slip: Array, friction: float | Array
) -> LoadHistory:
    """Return resultants and energies of nodal ``force`` ``(t, 3, n)`` and ``slip`` ``(t, 2, n)``.

    The increments must form one closed cycle. Energies are accurate to second order
    (:mod:`sa_solver.cycles.increments`). ``friction`` is µ, one value or by node ``(n,)``.
    """
    x, y = interface.coordinates.T
    columns = np.array([resultants(f, x, y) for f in force]).T
    shear = np.hypot(force[:, 0], force[:, 1])
    sticks = shear < LIMIT_SHARE * friction * force[:, 2]
    load = columns[0]
    apart = load < UNLOADED_SHARE * load.max()
    columns[:, apart] = 0.0
    limit = friction * mean_of_ends(force[:, 2])
    energy = dissipated(limit, in_rows(slip, ~apart)).sum(axis=2).T
    sliding = np.sum(force[:, 2] * sticks, axis=1) < STICKING_SHARE * load
    P, Qx, Qy, Mx, My, Mz = columns
    Edx, Edy = energy
    return LoadHistory(P, Qx, Qy, Mx, My, Mz, Edx, Edy, sliding)
