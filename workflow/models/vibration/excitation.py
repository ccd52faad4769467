"""Periodic excitations of a structure: their loads, and the ground that moves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.load import PeriodicLoad
from sa_solver.types import Array
from workflow.models.vibration.amount import FORCE, ExcitationSize


@dataclass(frozen=True)
class MovingGround:
    """A harmonic of the ground's motion at level 1, along the translation ``rigid`` ``(n,)``.

    ``amplitude`` is a in Re a exp(ikωt) of its displacement [mm], or of its acceleration [mm/s²] if
    it is ``accelerated``.
    """

    harmonic: int
    amplitude: complex
    accelerated: bool
    rigid: Array

    def displacement(self, frequency: float) -> complex:
        """Return the complex displacement [mm] of the ground at a frequency [Hz]."""
        angular = 2.0 * np.pi * frequency * self.harmonic
        return -self.amplitude / angular**2 if self.accelerated else self.amplitude


@dataclass(frozen=True)
class Driving:
    """The periodic ``load`` at level 1 without its static part, and the ``ground`` that moves.

    ``amount`` says whether the load is for 1 N or for level 1. ``left_out`` is, for each record,
    the share above its highest harmonic.
    """

    load: PeriodicLoad
    ground: tuple[MovingGround, ...] = ()
    amount: ExcitationSize = FORCE
    left_out: tuple[float, ...] = ()

    @classmethod
    def sine(cls, driven: Array) -> Driving:
        """Return the excitation by sines at t = 0, as forces ``(n,)`` at an amplitude of 1 N."""
        # Re (-i) exp(iωt).
        return cls(PeriodicLoad({1: -1j * driven}))

    def absolute(self, motion: HarmonicSolution) -> HarmonicSolution:
        """Return a motion with absolute displacements, in place of those relative to the ground."""
        absolute = motion.motion.copy()
        for moving in self.ground:
            row = motion.resolution.harmonics.index(moving.harmonic)
            absolute[row] += motion.force * moving.displacement(motion.frequency) * moving.rigid
        return replace(motion, motion=absolute)
