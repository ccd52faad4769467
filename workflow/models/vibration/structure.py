"""A structure with joints under an excitation: its state at rest and its linear limits."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg as sl

from fe_models.dynamics.periodic.harmonic_balance import HarmonicBalance
from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.receptance import Receptance
from sa_solver.types import Array
from wear.joints.friction_contact import FrictionContact
from wear.joints.mixed import MixedLaw
from wear.joints.periodic.march import PeriodicMarch
from workflow.errors import MethodFailed
from workflow.models.rig.laws import Laws, grouped
from workflow.models.rig.rig_model import RigModel
from workflow.models.vibration.excitation import Driving

# Number of frequencies of the linear limits, in addition to the natural frequencies. Each takes the
# inverse of a matrix of all joints' directions, which is slow for many joints.
LINEAR_POINTS, FEWER_POINTS, FEW_DIRECTIONS = 2000, 200, 12
# Relative distance from an undamped natural frequency: shows four digits of an unbounded peak.
BESIDE = 1e-5
# Frequencies at once: each needs a matrix of all joints' directions.
AT_ONCE = 20
# Joints for which a further thread pays off, and most threads.
JOINTS_PER_THREAD, MOST_THREADS = 16, 8


@dataclass(frozen=True)
class VibratingStructure:
    """A structure, the ``law`` of each of its joints, its excitation, and their balance."""

    rig: RigModel
    law: Laws
    problem: HarmonicBalance
    driving: Driving

    @classmethod
    def of(
        cls,
        rig: RigModel,
        law: Laws,
        driving: Driving,
        resolution: Resolution,
        normal_load: float = 0.0,
    ) -> VibratingStructure:
        """Return a rig whose joints have a law; ``normal_load`` [N] presses two bodies together."""
        threads = max(1, min(rig.joints // JOINTS_PER_THREAD, os.cpu_count() or 1, MOST_THREADS))
        static = rig.preload(law)
        if rig.pressing is not None:
            static = normal_load * rig.pressing
        of_joints = (
            law.march(threads) if isinstance(law, MixedLaw) else PeriodicMarch(law, threads),
            replace(driving.load, static=static if static.any() else None),
            resolution,
        )
        if rig.sector is None:
            problem = HarmonicBalance(rig.model, *of_joints)
        else:
            problem = HarmonicBalance.of_sector(rig.sector, *of_joints)
        return cls(rig, law, problem, driving)

    @cached_property
    def rest(self) -> HarmonicSolution:
        """State of the structure under its static load alone.

        Raises MethodFailed if the joints cannot balance it.
        """
        rest = self.problem.solve(1.0, 0.0)
        if not rest.converged:
            raise MethodFailed(
                "the joints do not balance the static load; change normal_load or "
                f"normal_stiffness of the joint ({rest.message})"
            )
        return rest

    def time_share(self, motion: HarmonicSolution, state: int, rows: slice = slice(None)) -> float:
        """Return the share of the cycle in which joints have a ``state``.

        This is the mean over those joints of ``rows`` that touch at rest.
        """
        states = motion.cycle.states[:, rows][:, self.touching[rows]]
        return float((states == state).mean()) if states.size else 0.0

    @property
    def resting(self) -> Array | None:
        """Displacements ``(j, d)`` of joints by the static load [mm], None without such a load."""
        return None if self.rig.pressing is None else self.rest.coefficients[:, 0]

    @cached_property
    def touching(self) -> np.ndarray:
        """Mask ``(j,)`` of the joints that touch at rest."""
        touching = np.ones(self.rig.joints, dtype=bool)
        for group, rows in grouped(self.law, self.rig.joints).rows():
            if isinstance(group.law, FrictionContact):
                touching[rows] = self.rest.cycle.samples[0, rows, 2] > 0.0
        return touching

    @property
    def undamped(self) -> bool:
        """True if only the joints limit a resonance."""
        receptance = self._first
        return not (receptance.damping.any() or receptance.loss.any())

    @property
    def _first(self) -> Receptance:
        """Receptance of the structure at harmonic 1: for a sector, at its nodal diameters."""
        return self.problem.receptance.of(1)

    @cached_property
    def natural(self) -> dict[str, list[float]]:
        """Lowest natural frequencies [Hz] with the joints free, stuck and sliding."""
        return {"free": self.rig.free(), **self.rig.modes(self.law, self.resting)}

    def linear(self, span: tuple[float, float]) -> dict[str, Array]:
        """Return the linear limits of the main observed amplitude over a span of frequencies.

        These are ``frequency`` ``(f,)`` [Hz], and the amplitudes over force or level with joints
        ``free`` and ``stuck``, for harmonic 1. The natural frequencies are among the points;
        without damping, where the amplitude has no bound there, points close to them are used.
        """
        natural = np.array([*self.natural["free"], *self.natural["stuck"]])
        if self.undamped:
            natural = np.concatenate([(1.0 - BESIDE) * natural, (1.0 + BESIDE) * natural])
        inside = natural[(natural > span[0]) & (natural < span[1])]
        directions = self.rig.joints * self.rig.directions
        points = LINEAR_POINTS if directions <= FEW_DIRECTIONS else FEWER_POINTS
        frequency = np.union1d(np.geomspace(*span, points), inside)
        parts = np.array_split(frequency, -(-len(frequency) // AT_ONCE))
        free, stuck = np.concatenate([self._limits(part) for part in parts], axis=1)
        return {"frequency": frequency, "free": free, "stuck": stuck}

    def _limits(self, frequency: Array) -> Array:
        """Return amplitudes over force ``(2, f)`` [mm/N], with joints free and stuck."""
        seen = self.rig.seen[-1] @ self._first.at_points
        moved, held, _ = self._moved(frequency)
        return np.abs(np.array([moved @ seen, held @ seen]))

    def stuck_slope(self, frequency: float) -> float:
        """Return the slope [N/mm] of the loop of all joints if all that touch at rest stuck.

        This is their force along the loop over the relative displacement of the targets, in a rig
        with targets. Only the part in phase counts; damping adds another.
        """
        assert self.rig.stretch is not None
        _, held, pulled = self._moved(np.array([frequency]))
        along = pulled.reshape(self.rig.joints, self.rig.directions)[:, self.rig.along]
        opened = held[0] @ (self.rig.stretch @ self._first.at_points)
        return float((along.sum() / opened).real)

    def _moved(self, frequency: Array) -> tuple[Array, Array, Array]:
        """Return motions of all points under harmonic 1 of the load, and forces of stuck joints.

        The motions ``(f, n)`` are with joints free and stuck. The forces ``(f, m)`` are k u, with u
        = (1 + R k)⁻¹ u_free.
        """
        receptance = self._first
        angular = 2.0 * np.pi * frequency
        steady = receptance.at(angular)
        # Multiplied by i, so that a sine is real.
        moved = steady.respond(1j * self.problem.first_wave(angular))
        tangent = sl.block_diag(*self.rig.stuck(self.law, self.resting))
        free = moved @ receptance.at_joints.T
        coupled = np.eye(len(tangent)) + steady.between_joints() @ tangent
        stuck = np.linalg.solve(coupled, free[..., None])[..., 0]
        pulled = stuck @ tangent.T
        return moved, moved - steady.respond(pulled @ receptance.at_joints.conj()), pulled
