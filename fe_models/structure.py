"""Two supported bodies with their interfaces: condensation, contact history, equilibrium."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.friction import FrictionalJoint, FrictionState
from fe_models.joint import JointStiffness, join
from fe_models.mesh import Interface, StructureMesh
from fe_models.supported_body import SupportedBody
from sa_solver.types import Array, LoadHistory, resultants

# A flank slides as a whole when nodes that stick carry less than this share of its load.
STICKING_SHARE = 1e-2
# Below this share of the cycle's largest P the resultants are the friction solver's remainder.
UNLOADED_SHARE = 1e-6
# What a history holds of each increment, over the nodes of its interface.
FIELDS = ("force", "displacement", "slip")
# A node slips when its shear reaches this share of Coulomb's limit.
LIMIT_SHARE = 1.0 - 1e-6


@dataclass(frozen=True)
class InterfaceHistory:
    """What one interface does over the increments of a cycle, in its frame.

    ``loads`` are the resultants; ``force`` ``(t, 3, n)`` on body 2 [N], ``displacement`` ``(t, 3,
    n)`` relative [mm], ``slip`` ``(t, 2, n)`` of each increment [mm], zero where a node sticks.
    """

    interface: Interface
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
    first and the second cycle, relative to the largest force (0 for a cycle that follows another);
    ``equilibrium`` ``(t, 2)`` the relative error of forces and moments.
    """

    histories: tuple[InterfaceHistory, ...]
    states: tuple[Array, ...]
    last_displacement: Array
    iterations: int
    residual: float
    converged: bool
    closure: float
    equilibrium: Array

    def fields(self) -> dict[str, Array]:
        """Force, displacement and slip over all interfaces, to keep and to restore from."""
        return {
            name: np.concatenate([getattr(own, name) for own in self.histories], axis=-1)
            for name in FIELDS
        }


@dataclass(frozen=True)
class Structure:
    """Body 1 is held, body 2 is held by contact and by one support along ``support_direction``.

    The support acts at ``support_point`` on the mean displacement of a boundary.
    """

    mesh: StructureMesh
    body_1: SupportedBody
    body_2: SupportedBody
    support_direction: Array
    support_point: Array

    def condense(self) -> JointStiffness:
        """Stiffness and loads of the joint on its interface displacements."""
        return join(self.body_1.condense(), self.body_2.condense())

    def gap(self) -> Array:
        """Gaps of all interfaces one after the other, unworn ``(n,)`` [mm]."""
        return np.concatenate([i.gap for i in self.mesh.interfaces])

    def solve_cycle(
        self,
        joint: FrictionalJoint,
        amplitudes: Array,
        gap: Array,
        friction: float,
        after: CycleSolution | None = None,
    ) -> CycleSolution:
        """Solve one closed cycle: the second from rest, or the one that follows ``after``."""
        if after is None:
            first = list(joint.march(amplitudes, gap))
            displacement, guess = first[-1].displacement, [s.state for s in first]
        else:
            first = []
            displacement, guess = after.last_displacement, list(after.states)
        last = list(joint.march(amplitudes, gap, displacement, guess))
        pairs = zip(first, last, strict=False)
        change = [float(np.abs(one.force - two.force).max()) for one, two in pairs]
        largest = max(float(np.abs(s.force).max()) for s in last)
        states = first + last
        fields = {name: np.stack([getattr(s, name) for s in last]) for name in FIELDS}
        return CycleSolution(
            histories=self.histories(**fields, friction=friction),
            states=tuple(s.state for s in last),
            last_displacement=last[-1].displacement,
            iterations=sum(s.iterations for s in states),
            residual=max(s.residual for s in states),
            converged=all(s.converged for s in states),
            closure=max(change, default=0.0) / largest if largest > 0.0 else 0.0,
            equilibrium=np.array(
                [self.equilibrium_error(s, a) for s, a in zip(last, amplitudes, strict=True)]
            ),
        )

    def histories(
        self, force: Array, displacement: Array, slip: Array, friction: float
    ) -> tuple[InterfaceHistory, ...]:
        """Histories of the interfaces from the fields ``(t, components, n)`` over all of them."""
        histories = []
        for interface, own in self._shares():
            parts = force[..., own], displacement[..., own], slip[..., own]
            loads = load_history(interface, parts[0], parts[2], friction)
            histories.append(InterfaceHistory(interface, loads, *parts))
        return tuple(histories)

    def interface_resultants(self, state: FrictionState) -> Array:
        """``(P, Qx, Qy, Mx, My, Mz)`` of every interface, ``(interfaces, 6)``."""
        return np.array(
            [
                resultants(state.force[:, own], *interface.coordinates.T)
                for interface, own in self._shares()
            ]
        )

    def equilibrium_error(self, state: FrictionState, amplitudes: Array) -> tuple[float, float]:
        """Relative error of forces and of moments on body 2, support included.

        Moments are taken about the support and measured against applied force x joint size where
        no moment is applied.
        """
        contact = np.zeros((2, 3))
        points = []
        for interface, own in self._shares():
            forces = interface.frame.to_global(state.force[:, own].T)
            at = self.mesh.body_2.mesh.p[:, interface.nodes_2].T - self.support_point
            contact += forces.sum(axis=0), np.cross(at, forces).sum(axis=0)
            points.append(at)
        applied = self.body_2.load_resultants(amplitudes, self.support_point)
        balance = contact + applied
        balance[0] -= (balance[0] @ self.support_direction) * self.support_direction
        force = float(np.linalg.norm(applied[0]))
        if force == 0.0:
            return 0.0, 0.0
        size = float(np.linalg.norm(np.ptp(np.concatenate(points), axis=0)))
        moment = max(float(np.linalg.norm(applied[1])), force * size)
        errors = np.linalg.norm(balance, axis=1) / (force, moment)
        return float(errors[0]), float(errors[1])

    def _shares(self) -> list[tuple[Interface, slice]]:
        """Every interface and its nodes' place among those of all of them."""
        ends = np.cumsum([len(i) for i in self.mesh.interfaces]).tolist()
        return [
            (interface, slice(end - len(interface), end))
            for interface, end in zip(self.mesh.interfaces, ends, strict=True)
        ]


def load_history(interface: Interface, force: Array, slip: Array, friction: float) -> LoadHistory:
    """Resultants and energies of nodal ``force`` ``(t, 3, n)`` and ``slip`` ``(t, 2, n)``."""
    x, y = interface.coordinates.T
    columns = np.array([resultants(f, x, y) for f in force]).T
    energy = -np.einsum("tan,tan->at", force[:, :2], slip)
    shear = np.hypot(force[:, 0], force[:, 1])
    sticks = shear < LIMIT_SHARE * friction * force[:, 2]
    load = columns[0]
    columns[:, load < UNLOADED_SHARE * load.max()] = 0.0
    sliding = np.sum(force[:, 2] * sticks, axis=1) < STICKING_SHARE * load
    P, Qx, Qy, Mx, My, Mz = columns
    Edx, Edy = energy
    return LoadHistory(P, Qx, Qy, Mx, My, Mz, Edx, Edy, sliding)
