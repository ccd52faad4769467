"""Motion of a structure with joints in time, and its energies, from any integrator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.model import DynamicModel
from sa_solver import checks
from sa_solver.types import Array


@dataclass(frozen=True)
class Start:
    """Initial state of a time integration; at rest unless given.

    Parameters
    ----------
    displacement, velocity
        Initial displacement [mm] and velocity [mm/s], ``(n,)``.
    joint_state
        State ``(j, k)`` of the joints. If None, the joints are loaded from rest straight to the
        initial displacement.
    time
        Initial time [s].
    coarse_run
        Initial state of the companion run, which integrates the same motion with steps of twice the
        length. If None, it starts from this state.
    """

    displacement: Array | None = None
    velocity: Array | None = None
    joint_state: Array | None = None
    time: float = 0.0
    coarse_run: Start | None = None

    def motion(self, size: int) -> Array:
        """Return displacements, then velocities, as one vector ``(2 n,)``.

        Raise InputError unless they are ``(n,)``.
        """
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
    """Energies [N mm] of a structure with joints at each time.

    ``kinetic`` and ``elastic`` ``(t,)`` are those of the structure. The others are summed from the
    start: ``excitation`` ``(t,)`` is the work of the excitation, ``damping`` ``(t,)`` the energy
    that the damping of the structure has dissipated, ``joint_work`` ``(t,)`` the work done on the
    joints, and ``joints`` ``(t, j)`` the part of it that each joint has dissipated. The joints
    store the rest of that work.
    """

    kinetic: Array
    elastic: Array
    excitation: Array
    damping: Array
    joint_work: Array
    joints: Array

    @property
    def missing(self) -> Array:
        """Error ``(t,)`` [N mm] of the energy balance: energy supplied less energy found."""
        held = self.kinetic + self.elastic
        return self.excitation - (held - held[0]) - self.damping - self.joint_work

    @property
    def balance_error(self) -> float:
        """Largest error of the energy balance, relative to the largest energy that occurs."""
        terms = (self.kinetic, self.elastic, self.excitation, self.damping, self.joint_work)
        largest = max(float(np.abs(term).max(initial=0.0)) for term in terms)
        return float(np.abs(self.missing).max(initial=0.0)) / largest if largest > 0.0 else 0.0


@dataclass(frozen=True)
class Motion:
    """Motion of a structure with joints at ``times`` ``(t,)`` [s].

    Parameters
    ----------
    times
        Times ``(t,)`` [s] at which the motion is recorded.
    displacement, velocity, acceleration
        Motion ``(t, n)`` of the structure [mm, mm/s, mm/s²].
    joint_displacement, joint_force
        Displacements [mm] and resisting forces [N] of the joints, ``(t, j, d)``.
    joint_state
        State ``(j, k)`` of the joints at the last time.
    coarse_run
        State of the companion run at the last time, or None; see :class:`Start`.
    energies
        Energies at all times.
    error
        Estimate of the largest displacement error due to the time steps, those before the start
        included, relative to the largest displacement. Both are norms weighted by mass.
    residual
        Largest residual of the joints' equilibrium, relative to their largest force.
    steps
        Number of all time steps.
    message
        Empty, or the reason why the integration stopped early and what to change.
    """

    times: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    joint_displacement: Array
    joint_force: Array
    joint_state: Array
    coarse_run: Start | None
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
        """Last state, from which the integration can be continued."""
        return Start(
            self.displacement[-1],
            self.velocity[-1],
            self.joint_state,
            float(self.times[-1]),
            self.coarse_run,
        )


def quadratic(matrix: Array, values: Array) -> Array:
    """Return ½ vᵀ A v ``(t,)`` for vectors ``(t, n)``: the energy held in a mass or a stiffness."""
    return np.asarray(0.5 * np.einsum("ti,ti->t", values @ matrix, values))


def accelerations(model: DynamicModel, motion: Array, force: Array, joint_force: Array) -> Array:
    """Return the accelerations M⁻¹ (f - Bᵀ F - C v - K x) ``(t, n)`` [mm/s²].

    Parameters
    ----------
    model
        The structure.
    motion
        Displacements, then velocities, ``(t, 2 n)``.
    force
        Forces ``(t, n)`` [N] on the structure.
    joint_force
        Resisting forces ``(t, j d)`` [N] of the joints.
    """
    displacement, velocity = np.split(motion, 2, axis=1)
    unbalanced = (
        force
        - joint_force @ model.connection
        - velocity @ model.damping.T
        - displacement @ model.stiffness.T
    )
    return np.asarray(np.linalg.solve(model.mass, unbalanced.T).T)
