"""Two specimens in a vibrating rig: how their contacts move, and what that takes off every node.

Energy law: in a cycle a node loses the depth α e / A, with A its area, α the sum of both bodies'
coefficients and e what its contact dissipates in the rig's steady motion by harmonic balance. The
gap grows by the depth, and rest and motion are found anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_models.dynamics.harmonic_balance import HarmonicBalance
from fe_models.dynamics.harmonic_solution import HarmonicSolution
from sa_solver.types import Array
from wear.joints.friction_contact import FrictionContact
from wear.joints.periodic import PeriodicMarch
from wear.stepping import ContactFailure
from workflow.analyses.vibration.model import VibrationModel


@dataclass(frozen=True)
class RubbedPads:
    """Pads of one shape, and the ``motion`` under the force that wears them.

    ``model`` is the rig on them, ``coefficient`` α [1/MPa].
    """

    model: VibrationModel
    motion: HarmonicSolution
    coefficient: float

    @property
    def energy(self) -> Array:
        """What each contact dissipates in a cycle ``(j,)`` [N mm]."""
        return self.motion.cycle.dissipated

    @property
    def rate(self) -> Array:
        """Depth of both bodies that each node loses in a cycle ``(j,)`` [mm]."""
        return self.coefficient * self.energy / self.area

    @property
    def area(self) -> Array:
        """Of each node ``(j,)`` [mm²]."""
        assert self.model.rig.area is not None
        return self.model.rig.area

    @property
    def law(self) -> FrictionContact:
        """That of each contact."""
        assert isinstance(self.model.law, FrictionContact)
        return self.model.law

    @cached_property
    def path(self) -> Array:
        """Way that each slider moves in a cycle while it is pressed ``(j,)`` [mm]."""
        motion = self.motion
        moved = (motion.resolution.basis @ motion.coefficients).transpose(1, 0, 2)
        force = motion.cycle.samples
        slider = moved[:, :, :2] - force[:, :, :2] / np.reshape(self.law.stiffness, (1, -1, 1))
        steps = np.linalg.norm(slider - np.roll(slider, 1, axis=0), axis=2)
        pressed = force[:, :, 2] > 0.0
        return np.asarray((steps * (pressed | np.roll(pressed, 1, axis=0))).sum(axis=0))

    @property
    def longest_step(self) -> float:
        """Cycles of a step in which no error of the shape changes its sign, to first order.

        A depth δ that is wrong changes the normal forces by -K δ, K = (1/kn + C)⁻¹: the contact
        springs in series with the elastic bodies, whose compliance C is not negative, be it under
        constant load or not. Energies change by µ s K δ at the paths s, depths per cycle by -D K δ
        with D = α µ s / A. The eigenvalues of D K lie between 0 and max kn D: in ΔN = 1/(max kn D)
        an Euler step multiplies errors by 1 - x, x between 0 and 1, and a step of second order by
        1 - x + x²/2. Both are stable up to twice that length. The path is the longest of all nodes,
        as those that do not touch yet may touch before the step ends.
        """
        rubbed = self.coefficient * float(np.max(self.law.friction)) * float(self.path.max())
        fastest = float(np.max(self.law.normal_stiffness / self.area)) * rubbed
        return 1.0 / fastest if fastest > 0.0 else np.inf


@dataclass(frozen=True)
class WearingPads:
    """Pads that wear under a ``force`` [N] at a ``frequency`` [Hz].

    ``unworn`` is the rig before, ``coefficients`` are those of body 1 and 2 [1/MPa].
    """

    unworn: VibrationModel
    coefficients: tuple[float, float]
    force: float
    frequency: float

    def at(self, depth: Array, start: HarmonicSolution | None = None) -> RubbedPads:
        """The pads that have lost a ``depth`` ``(j,)`` [mm], and their motion, from a near one.

        Raises :class:`wear.stepping.ContactFailure` where no motion is found.
        """
        model = worn_model(self.unworn, depth)
        motion = model.problem.solve(self.frequency, self.force, start)
        if not motion.converged:
            raise ContactFailure(
                f"no motion under {self.force:g} N at {self.frequency:g} Hz: {motion.message}"
            )
        return RubbedPads(model, motion, sum(self.coefficients))

    def depths(self, depth: Array) -> tuple[Array, Array]:
        """What body 1 and body 2 have lost ``(j,)`` each [mm]."""
        one, two = self.coefficients
        return one / (one + two) * depth, two / (one + two) * depth


def worn_model(unworn: VibrationModel, depth: Array) -> VibrationModel:
    """The rig whose contacts have lost a ``depth`` ``(j,)`` [mm]: only their law is new."""
    rig, problem = unworn.rig, unworn.problem
    assert isinstance(unworn.law, FrictionContact)
    assert isinstance(problem.joints, PeriodicMarch)
    assert rig.gap is not None
    gap = rig.gap + depth
    law = replace(unworn.law, gap=gap)
    worn = HarmonicBalance(
        problem.model,
        replace(problem.joints, law=law),
        problem.load,
        problem.resolution,
        problem.receptance,
    )
    return VibrationModel(replace(rig, gap=gap), law, worn)
