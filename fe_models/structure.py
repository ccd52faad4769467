"""Supported bodies with their interfaces: condensation, contact history, equilibrium."""

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
from fe_models.joints.joint import JointResolvent, JointStiffness, join, join_halves
from fe_models.meshes.structure_mesh import Face, Interface, StructureMesh, in_space
from fe_models.solvers.pardiso import sharing
from fe_models.supported_body import SupportedBody
from sa_solver.cycles.increments import dissipated, in_rows, mean_of_ends
from sa_solver.transforms.threads import at_once
from sa_solver.types import Array, Indices, LoadHistory, Progress, Tally, resultants, unseen

T = TypeVar("T")

# Unknowns of all bodies up to which factors are found side by side: some 2 GB. Larger ones gain as
# much from PARDISO's own threads, and each would count on all the memory that is free.
MOST_AT_ONCE = 300_000
# A face slides as a whole when nodes that stick carry less than this share of its load.
STICKING_SHARE = 1e-2
# Below this share of the cycle's largest P the resultants are the friction solver's remainder.
UNLOADED_SHARE = 1e-6
# A cycle is closed when its contact forces are those of the one before within this share of the
# largest: a tenth of what discretisation leaves of them, and a hundred times what friction's own
# tolerance leaves. Dovetails close to 1e-5 in two cycles.
CLOSED = 1e-3
# Slip that shakes down does so by a steady share in each cycle: a crowned pad took 12. One that
# walks never closes.
MOST_CYCLES = 20
# What a history holds of each increment, over the nodes of its interface.
FIELDS = ("force", "displacement", "slip")
# A node slips when its shear reaches this share of Coulomb's limit.
LIMIT_SHARE = 1.0 - 1e-6


@dataclass(frozen=True)
class InterfaceHistory:
    """What one interface does over the increments of a cycle, in its frame.

    ``loads`` are the resultants; ``force`` ``(t, 3, n)`` on body 2 [N], ``displacement`` ``(t, 3,
    n)`` relative [mm], ``slip`` ``(t, 2, n)`` of each increment [mm], zero where a node sticks.
    Loads and forces of a line contact are per length.
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
    """The closed cycle of a structure, with what the solver says of itself.

    ``states`` are the splitting's, by increment, and ``last_displacement`` ``(3, n)`` the one that
    the next cycle starts from. ``closure`` is the largest difference of contact forces between the
    last two of the ``cycles`` that were marched, relative to the largest force (0 if one was);
    ``equilibrium`` ``(t,)`` the relative error of the balance of a body that is free to move.
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
        """Force, displacement and slip over all interfaces, to keep and to restore from."""
        return {
            name: np.concatenate([getattr(history, name) for history in self.histories], axis=-1)
            for name in FIELDS
        }


@dataclass(frozen=True)
class Structure:
    """The ``bodies`` of a ``mesh``, supported and loaded.

    Supports hold them where all faces stick; contact alone may hold some of them.

    Examples
    --------
    Two plane blocks on each other, the lower held, the upper pressed by 5 and 10 MPa over
    1 mm: the contact carries as much.

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
        """Of the bodies, 2 or 3."""
        return self.bodies[0].elastic.dimension

    @cached_property
    def places(self) -> tuple[Indices, ...]:
        """Where each body's interface displacements are among those of all faces.

        These are displacements of faces 1, interface by interface, and then of faces 2.
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
        """Displacements of faces 1 and of faces 2 that supports hold at zero."""
        held = np.zeros(sum(map(len, self.places)), bool)
        for body, place in zip(self.bodies, self.places, strict=True):
            held[place] = body.held
        faces_1 = sum(len(interface.nodes_1) for interface in self.mesh.interfaces)
        return held[: self.dimension * faces_1], held[self.dimension * faces_1 :]

    def condense(
        self,
        like: JointResolvent | None = None,
        progress: Progress = unseen,
        keep: Keep = made_anew,
    ) -> JointStiffness:
        """Stiffness and loads of the joint on its interface displacements.

        ``like`` is a joint that differs little from this one and lends it its ρ. ``progress`` is
        told the steps of it that are done, ``keep`` may know bodies that were condensed before.
        """
        held_1, held_2 = self.held
        projection, held = self.projection, held_1.any() or held_2.any()
        if like is None and projection is None and not held and len(self.bodies) == 2:
            halves = self._condense_halves(progress, keep)
            if halves is not None:
                return halves
        if held:
            every = sp.identity(len(held_2), format="csr") if projection is None else projection
            projection = every[~held_2][:, ~held_1]
        done = self._steps(progress)
        condensed = self.at_once(*(partial(body.condense, done, keep) for body in self.bodies))
        among_free = np.cumsum(~np.concatenate(self.held)) - 1
        pairs = zip(self.bodies, self.places, strict=True)
        places = [among_free[place[~body.held]] for body, place in pairs]
        joint = join(condensed, projection, places, held_2, like)
        done()
        return joint

    def _steps(self, progress: Progress) -> Tally:
        """Steps of a condensation: two of each body, and the joint of all."""
        return Tally(progress, 2 * len(self.bodies) + 1)

    def _condense_halves(self, progress: Progress, keep: Keep) -> JointStiffness | None:
        """As :meth:`condense`, by a mirror symmetry of two bodies; None if there is none."""
        body_1, body_2 = self.bodies
        for axis in body_1.elastic.body.axes:
            mirrors = body_1.mirror(axis), body_2.mirror(axis)
            if mirrors[0] is None or mirrors[1] is None:
                continue
            on_1 = body_1.on_interface(mirrors[0])
            if on_1 is None or on_1 != body_2.on_interface(mirrors[1]):
                continue
            done = self._steps(progress)
            halves = self.at_once(
                partial(body_1.halves, mirrors[0], on_1, done, keep),
                partial(body_2.halves, mirrors[1], on_1, done, keep),
            )
            if halves[0] is not None and halves[1] is not None:
                condensed = self.at_once(*halves[0], *halves[1])
                joint = join_halves(condensed[:2], condensed[2:], on_1)
                done()
                return joint
        return None

    def at_once(self, *jobs: Callable[[], T]) -> list[T]:
        """What jobs give that each factorise such bodies: side by side if that surely fits."""
        if sum(body.elastic.size for body in self.bodies) > MOST_AT_ONCE:
            return [job() for job in jobs]
        return at_once(sharing(jobs))

    @property
    def projection(self) -> sp.csr_matrix | None:
        """Displacements of faces 1 to those at the nodes of faces 2, in the interface frames.

        None where all interfaces meet node to node.
        """
        interfaces = self.mesh.interfaces
        if all(i.projection is None for i in interfaces):
            return None
        blocks = [sp.identity(len(i)) if i.projection is None else i.projection for i in interfaces]
        components = sp.identity(self.dimension)
        return sp.kron(sp.block_diag(blocks), components, format="csr")

    def carried(self, moved: Array) -> Array:
        """Displacements ``(d n, ...)`` of faces 1 at faces 2's nodes, from ``(d n_1, ...)``."""
        projection = self.projection
        return moved if projection is None else np.asarray(projection @ moved)

    @property
    def held_faces(self) -> dict[str, float]:
        """Interfaces that supports hold along one direction, with the share of nodes they hold.

        A plane of symmetry holds some of them, a slice in plane strain all.
        """
        held = self.held[1].reshape(-1, self.dimension)
        shares = {i.name: float(held[nodes].mean(axis=0).max()) for i, nodes in self.shares()}
        return {name: share for name, share in shares.items() if share > 0.0}

    def gap(self) -> Array:
        """Gaps of all interfaces one after the other, unworn ``(n,)`` [mm]."""
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
        """Solve one closed cycle of ``amplitudes`` ``(t, cases)``; ``friction`` is the joint's.

        From rest and ``preload`` ``(s, cases)``, which is passed once, the first that repeats the
        one before it; or one that follows ``after``, as many cycles on as that one had repeated.
        Not closed after ``MOST_CYCLES``, it says so by its closure. ``progress`` is told the
        increments that are solved, of those to the second end of the cycle or the next one.
        """
        if after is None:
            once = amplitudes[:0] if preload is None else preload
            path = np.concatenate([once, amplitudes])
            first = joint.march(path, gap)
            marched = [_told(first, 0, len(path) + len(amplitudes), progress)[len(once) :]]
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
            marched.append(_told(cycle, done, done + len(amplitudes), progress))
            displacement, guess = marched[-1][-1].displacement, [s.state for s in marched[-1]]
            if len(marched) > 1:
                closure = _closure(*marched[-2:])
        states, last = [state for cycle in marched for state in cycle], marched[-1]
        # As fields from the cache lie in memory: sums over them must have the same rounding.
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
        """Histories of the interfaces from the fields ``(t, components, n)`` over all of them."""
        histories = []
        nodal = np.broadcast_to(friction, force.shape[-1:])
        for interface, nodes in self.shares():
            parts = force[..., nodes], displacement[..., nodes], slip[..., nodes]
            loads = load_history(interface, parts[0], parts[2], nodal[nodes])
            histories.append(InterfaceHistory(interface, loads, *parts))
        return tuple(histories)

    def interface_resultants(self, state: FrictionState) -> Array:
        """``(P, Qx, Qy, Mx, My, Mz)`` of every interface, ``(interfaces, 6)``."""
        return np.array(
            [
                resultants(state.force[:, nodes], *interface.coordinates.T)
                for interface, nodes in self.shares()
            ]
        )

    def on_faces(self, force: Array) -> Array:
        """Contact forces on the bodies at all faces, ``(places, t)``, from ``(t, 3, n)``."""
        axes = self.mesh.bodies[0].axes
        on_2 = np.asarray(force)[:, axes, :].transpose(2, 1, 0).reshape(-1, len(force))
        projection = self.projection
        on_1 = on_2 if projection is None else projection.T @ on_2
        return np.concatenate([-on_1, on_2])

    def equilibrium_errors(self, states: Sequence[FrictionState], amplitudes: Array) -> Array:
        """Forces and moments on a body that neither contacts nor supports balance, ``(t,)``.

        Those of the body that is worst off, relative to what is applied to it and what its nodes
        carry, or to ``LOAD_FLOOR`` of the largest of all increments where there is hardly a load.
        Moments are taken about the middle of its contacts and divided by their size.
        """
        forces = self.on_faces(np.stack([state.force for state in states]))
        worst = np.zeros(len(states))
        for number, place in enumerate(self.places):
            np.maximum(worst, self._unbalanced(number, forces[place], amplitudes), out=worst)
        return worst

    def _unbalanced(self, number: int, forces: Array, amplitudes: Array) -> Array:
        """The errors of one body under ``forces`` ``(d n, t)`` in the frames of its faces."""
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
        """Every interface and its nodes' place among those of all of them."""
        ends = np.cumsum([len(i) for i in self.mesh.interfaces]).tolist()
        return [
            (interface, slice(end - len(interface), end))
            for interface, end in zip(self.mesh.interfaces, ends, strict=True)
        ]


def mixed(cycles: Sequence[CycleSolution], shares: Sequence[float]) -> CycleSolution:
    """Closed ``cycles`` of one structure one after the other, each so large a share of all.

    Solvers' counts are sums, their errors the largest. A cycle that follows it must follow one of
    ``cycles``.
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


def _told(
    states: Iterable[FrictionState], before: int, total: int, progress: Progress
) -> list[FrictionState]:
    """All states, each of them told: so many of the ``total`` were ``before`` them."""
    solved = []
    for number, state in enumerate(states, before + 1):
        solved.append(state)
        progress(number, total)
    return solved


def _closure(one: Sequence[FrictionState], two: Sequence[FrictionState]) -> float:
    """Largest difference of the contact forces of two cycles, relative to the largest force."""
    largest = max(float(np.abs(state.force).max()) for state in two)
    pairs = zip(one, two, strict=True)
    change = max(float(np.abs(first.force - second.force).max()) for first, second in pairs)
    return change / largest if largest > 0.0 else 0.0


def load_history(
    interface: Face, force: Array, slip: Array, friction: float | Array
) -> LoadHistory:
    """Resultants and energies of nodal ``force`` ``(t, 3, n)`` and ``slip`` ``(t, 2, n)``.

    Those of one closed cycle; energies are of second order (:mod:`sa_solver.cycles.increments`).
    ``friction`` is µ, one or by node ``(n,)``.
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
