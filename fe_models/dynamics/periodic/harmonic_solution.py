"""Periodic motion of a structure with joints, as a result of harmonic balance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fe_models.dynamics.periodic.harmonics import ComplexArray, Resolution
from fe_models.dynamics.periodic.joints import CycleRecord
from sa_solver.types import Array


@dataclass(frozen=True)
class ResolutionError:
    """Estimated change of a motion by a richer resolution, to first order.

    Parameters
    ----------
    vibration
        Change of the joints' vibration, relative to that vibration.
    energy
        Change of the energy that the joints dissipate per cycle, relative to all energy that is
        lost.
    harmonics
        Contribution ``(k + 1,)`` of each neglected harmonic 0, 1, 2, ... to the larger of the two.
    sampling
        Contribution of the sampling to the larger of the two.
    """

    vibration: float
    energy: float
    harmonics: Array
    sampling: float

    @property
    def largest(self) -> float:
        """Larger of the errors of vibration and energy."""
        return max(self.vibration, self.energy)


@dataclass(frozen=True)
class HarmonicSolution:
    """Periodic motion of a structure with joints.

    Parameters
    ----------
    frequency
        Frequency [Hz].
    force
        Force factor a of the load.
    resolution
        Harmonics of the motion and samples of a period.
    coefficients
        Coefficients ``(j, m, d)`` [mm] of the joints' displacements.
    motion
        Complex amplitudes ``(k, n)`` [mm] of the structure's displacements.
    cycle
        Response of the joints over one period.
    iterations
        Number of iterations of Newton's method.
    residual
        Relative residual of the equations.
    shares
        Estimated share ``(k + 1,)`` of each neglected harmonic 0, 1, 2, ... in the joints'
        vibration, for joint forces that do not change in the other harmonics.
    error
        Estimated change by a richer resolution, or None if it was not computed.
    message
        Empty, or the reason why this is not a solution.
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
        """Estimated share of all neglected harmonics together in the joints' vibration."""
        return float(np.linalg.norm(self.shares))

    @property
    def converged(self) -> bool:
        return not self.message

    def amplitude(self, place: int, harmonic: int = 1) -> complex:
        """Return the complex amplitude [mm] of one degree of freedom in one harmonic."""
        return complex(self.motion[self.resolution.harmonics.index(harmonic), place])

    def displacement(self, samples: int) -> Array:
        """Return displacements ``(t, n)`` [mm] of the structure at equal times of a period."""
        return _in_time(self.motion, self.resolution, samples)

    def velocity(self, samples: int) -> Array:
        """Return velocities ``(t, n)`` [mm/s] of the structure at equal times of a period."""
        rates = 2j * np.pi * self.frequency * np.array(self.resolution.harmonics)
        return _in_time(rates[:, None] * self.motion, self.resolution, samples)


def _in_time(amplitudes: ComplexArray, resolution: Resolution, samples: int) -> Array:
    """Return Re Σ a_k exp(ikωt) ``(t, n)`` at equally spaced times of a period."""
    return np.asarray((_waves(resolution.harmonics, samples) @ amplitudes).real)


# All motions of a curve mostly share one table, which takes longer to compute than to apply.
@lru_cache(maxsize=2)
def _waves(harmonics: tuple[int, ...], samples: int) -> ComplexArray:
    """Return exp(ikωt) ``(t, k)`` of harmonics at equally spaced times of a period."""
    turns = np.outer(np.arange(samples), harmonics) % samples / samples
    waves: ComplexArray = np.exp(2j * np.pi * turns)
    waves.flags.writeable = False
    return waves
