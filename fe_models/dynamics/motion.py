"""How a structure with joints has moved, whichever integrator found it, and its energies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.model import DynamicModel
from sa_solver import checks
from sa_solver.types import Array


@dataclass(frozen=True)
class Start:
    """State at the first time: at rest in every respect unless given.

    ``displacement`` and ``velocity`` ``(n,)`` [mm, mm/s]. Without a ``joint_state`` ``(j, k)`` the
    joints have been loaded from rest straight to the displacement. ``companion`` is where the same
    motion is by steps of twice the length, if not there.
    """

    displacement: Array | None = None
    velocity: Array | None = None
    joint_state: Array | None = None
    time: float = 0.0
    companion: Start | None = None

    def motion(self, size: int) -> Array:
        """Displacements, then velocities ``(2 n,)``. Raises InputError for others than ``(n,)``."""
        given = {"displacements": self.displacement, "velocities": self.velocity}
        return np.concatenate(
            [
                np.zeros(size)
                if part is None
                else checks.array(f"{name} of a start", part, (size,))
                for name, part in given.items()
            ]
        )


@dataclass(frozen=True)
class Energies:
    """Energies [N mm] at each time.

    ``kinetic`` and ``elastic`` ``(t,)`` of the structure; from the start until then: ``excitation``
    ``(t,)``, the work of the excitation, ``damping`` ``(t,)``, what the structure's damping has
    dissipated, ``joint_work`` ``(t,)``, the work done on the joints, and ``joints`` ``(t, j)``,
    what each of them has dissipated of it. The rest of the work they store.
    """

    kinetic: Array
    elastic: Array
    excitation: Array
    damping: Array
    joint_work: Array
    joints: Array

    @property
    def missing(self) -> Array:
        """What is missing ``(t,)`` [N mm] of what the excitation and the start have brought in."""
        held = self.kinetic + self.elastic
        return self.excitation - (held - held[0]) - self.damping - self.joint_work

    @property
    def balance_error(self) -> float:
        """The largest of what is missing, relative to the largest energy there is."""
        terms = (self.kinetic, self.elastic, self.excitation, self.damping, self.joint_work)
        largest = max(float(np.abs(term).max(initial=0.0)) for term in terms)
        return float(np.abs(self.missing).max(initial=0.0)) / largest if largest > 0.0 else 0.0


@dataclass(frozen=True)
class Motion:
    """A motion at ``times`` ``(t,)`` [s], up to where it was found.

    ``displacement``, ``velocity`` and ``acceleration`` ``(t, n)`` [mm, s]; of the joints
    ``joint_displacement`` [mm] and the resisting ``joint_force`` [N] ``(t, j, d)``, and
    ``joint_state`` ``(j, k)`` and ``companion`` at the end. ``error`` estimates the largest error
    of displacement that the steps leave, those before the start included, relative to the largest
    displacement, both as norms weighted by mass; ``residual`` is the largest residual of the
    joints' equilibrium, relative to their largest force; ``steps`` counts all steps, and
    ``message`` is empty unless the integration has stopped early: then it says why and what to try.
    """

    times: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    joint_displacement: Array
    joint_force: Array
    joint_state: Array
    companion: Start | None
    energies: Energies
    error: float
    residual: float
    steps: int
    message: str

    @property
    def converged(self) -> bool:
        return not self.message

    @property
    def end(self) -> Start:
        """The last state, to go on from."""
        return Start(
            self.displacement[-1],
            self.velocity[-1],
            self.joint_state,
            float(self.times[-1]),
            self.companion,
        )


def quadratic(matrix: Array, values: Array) -> Array:
    """½ vᵀ A v ``(t,)`` of vectors ``(t, n)``: the energy held in a mass or a stiffness."""
    return np.asarray(0.5 * np.einsum("ti,ti->t", values @ matrix, values))


def accelerations(model: DynamicModel, motion: Array, force: Array, joint_force: Array) -> Array:
    """M⁻¹ (f - Bᵀ F - C v - K x) ``(t, n)``.

    ``motion`` ``(t, 2 n)`` are displacements, then velocities; ``force`` ``(t, n)``,
    ``joint_force`` ``(t, j d)``.
    """
    displacement, velocity = np.split(motion, 2, axis=1)
    unbalanced = (
        force
        - joint_force @ model.connection
        - velocity @ model.damping.T
        - displacement @ model.stiffness.T
    )
    return np.asarray(np.linalg.solve(model.mass, unbalanced.T).T)
