"""All sectors of a ring whose motion is a travelling wave, for the analysis of its stability.

Deviations from the wave need not travel as the wave does. Therefore stability is a property of the
whole ring, not of one sector.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace

import numpy as np

from fe_models.dynamics.periodic.harmonic_solution import HarmonicSolution
from fe_models.dynamics.periodic.joints import Deviations
from fe_models.dynamics.periodic.receptance import Receptance
from fe_models.dynamics.rings.sector import CyclicSector, Ring
from fe_models.dynamics.stability.deviating_structure import ModalStructure
from sa_solver.types import Array, Indices

# Axes of the joints in the arrays of deviations in which they do not come second.
JOINT_AXES = {"pull": 0, "remembered": 0}


@dataclass(frozen=True)
class JoinedDeviations:
    """:class:`Deviations` of several sets of joints, one after the other."""

    kept: Array
    by_start: Array
    by_end: Array
    pull: Array
    tangent: Array
    regimes: np.ndarray
    force: Array
    remembered: Indices

    @classmethod
    def of(cls, parts: Iterable[Deviations]) -> JoinedDeviations:
        """Return the deviations of all parts, which have room for equally many state variables."""
        every = tuple(parts)
        return cls(
            **{
                field.name: np.concatenate(
                    [getattr(part, field.name) for part in every], JOINT_AXES.get(field.name, 1)
                )
                for field in fields(cls)
            }
        )


def ring_structure(sector: CyclicSector, directions: int) -> ModalStructure:
    """Return the modes of all sectors without joints, which have ``directions`` directions each."""
    return ModalStructure.without_joints(Receptance(sector.whole()), directions)


def motion_of(ring: Ring, motion: HarmonicSolution, sector: int) -> HarmonicSolution:
    """Return the motion of a sector, counted from 0, given that of sector 0: the same, later.

    Examples
    --------
    The first of four sectors under engine order 1 moves a quarter of a period after sector 0:

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from fe_models.dynamics.rings.sector import Ring, lumped_sector
    >>> from fe_models.dynamics.rings.whole_ring import motion_of
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> sector = lumped_sector({"a": 1e-3}, {Link("a"): 1e3}, [[Link("a")]], Ring(4, 1), 0.01)
    >>> joints = PeriodicMarch(Jenkins(stiffness=1e3, friction=0.0, normal_load=1.0))
    >>> load = PeriodicLoad({1: np.ones(1)})
    >>> problem = HarmonicBalance.of_sector(sector, joints, load, Resolution((1,), 64))
    >>> motion = problem.solve(100.0, force=1.0)
    >>> later = motion_of(sector.ring, motion, 1)
    >>> print(np.isclose(later.amplitude(0), -1j * motion.amplitude(0)))
    True
    """
    harmonics = motion.resolution.harmonics
    later = np.array([ring.phase(sector * ring.shift(harmonic)) for harmonic in harmonics])
    amplitudes = later[:, None] * motion.resolution.amplitudes(motion.coefficients)
    coefficients = motion.resolution.coefficients(amplitudes, motion.coefficients.shape[2])
    return replace(motion, coefficients=coefficients, motion=later[:, None] * motion.motion)
