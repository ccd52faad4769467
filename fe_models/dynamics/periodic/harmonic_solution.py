"""A periodic motion of a structure with joints, by its harmonics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.dynamics.periodic.harmonics import ComplexArray, Resolution
from fe_models.dynamics.periodic.joints import CycleRecord
from sa_solver.types import Array


@dataclass(frozen=True)
class ResolutionError:
    """By how much a richer resolution would change a motion, to first order.

    ``vibration`` of the joints, as a share of itself, and ``energy`` that the joints take in a
    cycle, as a share of all that is lost. ``harmonics`` ``(k + 1,)`` is the part of the larger of
    them that each harmonic 0, 1, 2, ... left out has, and ``sampling`` that of the samples.
    """

    vibration: float
    energy: float
    harmonics: Array
    sampling: float

    @property
    def largest(self) -> float:
        """The larger of the two."""
        return max(self.vibration, self.energy)


@dataclass(frozen=True)
class HarmonicSolution:
    """A periodic motion.

    ``frequency`` [Hz], ``force`` (the factor a of the load), ``coefficients`` ``(j, m, d)`` [mm] of
    the joints' displacements, ``motion`` ``(k, n)`` the complex amplitudes of the structure's [mm],
    ``cycle`` what the joints do, ``iterations`` and ``residual`` of Newton's method. ``message`` is
    empty, or says why this is not a solution.

    ``shares`` ``(k + 1,)`` of the joints' vibration are what their forces would cause in each
    harmonic 0, 1, 2, ... left out, as if those of the ``resolution`` would not change for it;
    ``error``, what a richer resolution would change, is None if not asked for.
    """

    frequency: float
    force: float
    resolution: Resolution
    coefficients: Array
    motion: ComplexArray
    cycle: CycleRecord
    iterations: int
    residual: float
    shares: Array
    error: ResolutionError | None
    message: str

    @property
    def left_out(self) -> float:
        """Of all harmonics left out together."""
        return float(np.linalg.norm(self.shares))

    @property
    def converged(self) -> bool:
        return not self.message

    def amplitude(self, place: int, harmonic: int = 1) -> complex:
        """Complex amplitude of a degree of freedom [mm]."""
        return complex(self.motion[self.resolution.harmonics.index(harmonic), place])

    def displacement(self, samples: int) -> Array:
        """Displacement of the structure ``(t, n)`` [mm] at equal times of a period."""
        return _in_time(self.motion, self.resolution, samples)

    def velocity(self, samples: int) -> Array:
        """Velocity of the structure ``(t, n)`` [mm/s]."""
        rates = 2j * np.pi * self.frequency * np.array(self.resolution.harmonics)
        return _in_time(rates[:, None] * self.motion, self.resolution, samples)


def _in_time(amplitudes: ComplexArray, resolution: Resolution, samples: int) -> Array:
    """Re Σ a_k exp(ikωt) ``(t, n)`` at equal times of a period."""
    turns = np.outer(np.arange(samples), resolution.harmonics) % samples / samples
    return np.asarray((np.exp(2j * np.pi * turns) @ amplitudes).real)
