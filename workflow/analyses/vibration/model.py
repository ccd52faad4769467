"""The structure of a vibration case with its joints: its state at rest and its linear limits."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

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
from workflow.analyses.rig.building import rig_model
from workflow.analyses.rig.laws import Laws, grouped, law_of, law_of_all, laws_of
from workflow.analyses.rig.rig_model import RigModel
from workflow.analyses.rig.structure import FrictionRig
from workflow.analyses.vibration.case.excitation import FORCE
from workflow.analyses.vibration.case.load import Driving, driving_of
from workflow.analyses.vibration.case.ring import frequencies_by_diameters
from workflow.analyses.vibration.case.vibration_case import VibrationCase
from workflow.analyses.vibration.memory import memory
from workflow.analyses.vibration.output.outcome import RING
from workflow.errors import MethodFailed
from workflow.shell.output.dataset import Dataset
from workflow.shell.terminal.reporter import Reporter

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
class VibrationModel:
    """A structure, the ``law`` of each of its joints, and its excitation."""

    rig: RigModel
    law: Laws
    problem: HarmonicBalance
    driving: Driving

    @classmethod
    def of(cls, case: VibrationCase, reporter: Reporter) -> VibrationModel:
        """Return the model of a case. Raises UserError for an impossible structure or joint."""
        order = round(case.engine_order or 1)
        rig = rig_model(case.structure, case.joint, case.mass, reporter, case.ring, order)
        return cls.on(case, rig, _law(case, rig))

    @classmethod
    def on(cls, case: VibrationCase, rig: RigModel, law: Laws) -> VibrationModel:
        """Return the model of a case on a rig whose joints have this law."""
        memory(case, len(rig.model.mass), rig.joints).check()
        threads = max(1, min(rig.joints // JOINTS_PER_THREAD, os.cpu_count() or 1, MOST_THREADS))
        static = rig.preload(law)
        if rig.pressing is not None:
            static = case.laws[0].normal_load * rig.pressing
        driving = driving_of(case.excitation, rig, case.resolution.harmonics[-1])
        of_joints = (
            law.march(threads) if isinstance(law, MixedLaw) else PeriodicMarch(law, threads),
            replace(driving.load, static=static if static.any() else None),
            Resolution(case.harmonics, case.resolution.samples),
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
                "the joints do not balance the static load: change normal_load or "
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
    def _natural(self) -> dict[str, list[float]]:
        """Lowest natural frequencies [Hz] with the joints free, stuck and sliding."""
        return {"free": self.rig.free(), **self.rig.modes(self.law, self.resting)}

    def numbers(self) -> dict[str, Any]:
        """Return natural frequencies, and the contact of joints at rest, for the summary."""
        rig = self.rig
        numbers: dict[str, Any] = {
            **self._natural,
            "damping_stuck": rig.stuck_damping(self.law, self.resting),
        }
        if rig.sector is not None:
            ring = rig.sector.ring
            numbers[RING] = {"sectors": ring.sectors, "engine_order": ring.engine_order}
        if self.driving.left_out:
            numbers["left_out_of_records"] = list(self.driving.left_out)
        if self.rig.pressing is not None:
            numbers["touching"] = int(self.touching.sum())
            numbers["joints"] = self.rig.joints
        return numbers

    def diameters(self) -> dict[str, Dataset] | None:
        """Return natural frequencies by nodal diameters for a sector of a ring, else None."""
        sector = self.rig.sector
        if sector is None:
            return None
        return frequencies_by_diameters(sector, self.rig.stuck(self.law, self.resting))

    def contact(self) -> dict[str, Dataset] | None:
        """Return places of the joints and their state at rest, None if they have no places."""
        rig = self.rig
        if rig.pressing is None:
            return None
        force, closing = self.rest.cycle.samples[0, :, 2], self.rest.coefficients[:, 0, 2]
        return {
            "x": Dataset(rig.places[:, 0], "mm", "place of each joint on the contact plane"),
            "y": Dataset(rig.places[:, 1], "mm", "place of each joint on the contact plane"),
            "gap": Dataset(rig.gap, "mm", "gap of the bodies without load"),
            "area": Dataset(rig.area, "mm^2", "area that belongs to each joint"),
            "normal_force": Dataset(force, "N", "gap of each joint at rest"),
            "normal_displacement": Dataset(
                closing, "mm", "closing of each joint by the load at rest"
            ),
        }

    def linear(self, span: tuple[float, float]) -> dict[str, Dataset]:
        """Return the linear limits: observed amplitude over force or level, joints free and stuck.

        Both are for harmonic 1. The natural frequencies are among the points; without damping,
        where the amplitude has no bound there, points close to them are used.
        """
        natural = np.array([*self._natural["free"], *self._natural["stuck"]])
        if self.undamped:
            natural = np.concatenate([(1.0 - BESIDE) * natural, (1.0 + BESIDE) * natural])
        inside = natural[(natural > span[0]) & (natural < span[1])]
        directions = self.rig.joints * self.rig.directions
        points = LINEAR_POINTS if directions <= FEW_DIRECTIONS else FEWER_POINTS
        frequency = np.union1d(np.geomspace(*span, points), inside)
        parts = np.array_split(frequency, -(-len(frequency) // AT_ONCE))
        free, stuck = np.concatenate([self._limits(part) for part in parts], axis=1)
        amount = self.driving.amount
        unit, _ = amount.receptance
        first = "" if amount is FORCE else ", of harmonic 1"
        size = f"amplitude of the reported point over the {amount.name}{first}"
        return {
            "frequency": Dataset(frequency, "Hz", "frequency of the force"),
            "free": Dataset(free, unit, f"{size}, without the joints"),
            "stuck": Dataset(stuck, unit, f"{size}, all joints stuck"),
        }

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


def _law(case: VibrationCase, rig: RigModel) -> Laws:
    """Return the law of each joint: joints of an entry, or all, share stiffness and load evenly.

    Between two bodies that a load presses together, joints have the gap of the bodies and no load
    of their own. They may share the stiffness by their areas.
    """
    if not isinstance(case.structure, FrictionRig):
        shared, *own = laws_of([case.joint, *case.own_laws])
        return law_of_all(shared, own, rig.counts)
    whole = law_of(case.laws[0])
    assert isinstance(whole, FrictionContact)
    even = case.structure.sharing == "even"
    share = 1.0 / rig.joints if even else rig.area / rig.area.sum()
    return replace(
        whole,
        stiffness=share * whole.stiffness,
        normal_stiffness=share * whole.normal_stiffness,
        normal_load=0.0,
        gap=rig.gap,
    )
