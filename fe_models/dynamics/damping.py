"""Damping added to a structure without its joints: Rayleigh damping, dashpots, structural damping.

- Rayleigh damping is C = α M + β K.
- Dashpots act between two points, or between a point and the ground.
- The force of structural damping is in phase with the velocity but does not grow with the
  frequency. At every harmonic k > 0 the stiffness is K + iD, with D = η K for one loss factor η. It
  is defined in steady vibration only: in time it is not causal (Crandall 1970, J. Sound Vib. 11, 3,
  doi:10.1016/S0022-460X(70)80105-5).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.rig import Link, RigError, stretch_of
from sa_solver import checks
from sa_solver.types import Array


def damped(
    model: DynamicModel,
    mass_factor: float = 0.0,
    stiffness_factor: float = 0.0,
    loss_factor: float = 0.0,
    dashpots: Mapping[Link, float] | None = None,
) -> DynamicModel:
    """Return a copy of a model with damping added: C + α M + β K + Σ c g gᵀ, and D + η K.

    M and K are those of the structure without joints.

    Parameters
    ----------
    model
        The structure.
    mass_factor
        Rayleigh factor α [1/s].
    stiffness_factor
        Rayleigh factor β [s].
    loss_factor
        Loss factor η of structural damping.
    dashpots
        Coefficients c [N s/mm], by the link whose stretch each dashpot resists.

    Raises
    ------
    RigError
        If a factor or a dashpot is below zero, or if a link names a point that does not exist.

    Examples
    --------
    At resonance a loss factor η limits the amplitude to F / (η k):

    >>> import numpy as np
    >>> from fe_models.dynamics import *
    >>> from wear.joints import Jenkins, PeriodicMarch
    >>> rig = damped(lumped_rig({"m": 1e-3}, {Link("m"): 1e3}, [[Link("m")]]), loss_factor=0.05)
    >>> load = PeriodicLoad({1: -1j * unit_force(rig, "m")})
    >>> free = PeriodicMarch(Jenkins(stiffness=1e3, friction=0.0, normal_load=10.0))
    >>> problem = HarmonicBalance(rig, free, load, Resolution((1,), 64))
    >>> motion = problem.solve(natural_frequencies(rig)[0], force=2.0)
    >>> print(f"{abs(motion.amplitude(0)):.4f} mm of {2.0 / (0.05 * 1e3):.4f}")
    0.0400 mm of 0.0400
    """
    dashpots = dashpots or {}
    for value in (mass_factor, stiffness_factor, loss_factor, *dashpots.values()):
        checks.number("a damping", value, error=RigError)
    if min(mass_factor, stiffness_factor, loss_factor, *dashpots.values(), 0.0) < 0.0:
        raise RigError("damping below zero would feed energy into vibrations: give 0 or more")
    damping = model.damping + mass_factor * model.mass + stiffness_factor * model.stiffness
    rows = [] if model.dashpots is None else [*model.dashpots]
    for link, coefficient in dashpots.items():
        rows.append(np.sqrt(coefficient) * stretch_of(model.names, link))
        damping = damping + np.outer(rows[-1], rows[-1])
    structural = model.structural
    if loss_factor > 0.0:
        by_stiffness = loss_factor * model.stiffness
        structural = by_stiffness if structural is None else structural + by_stiffness
    together = np.array(rows) if rows else None
    return replace(model, damping=damping, structural=structural, dashpots=together)


def rayleigh_factors(frequencies: Array, ratios: Array) -> tuple[float, float]:
    """Return Rayleigh factors α [1/s] and β [s] that give two modes their damping ratios.

    The factors solve 2 ζ = α / ω + β ω for both modes. One of them is below zero if the ratio of
    the damping ratios exceeds that of the frequencies.

    Parameters
    ----------
    frequencies
        The two natural frequencies [Hz].
    ratios
        The two damping ratios ζ.

    Examples
    --------
    Damping ratios in proportion to the frequencies need stiffness damping alone:

    >>> import numpy as np
    >>> from fe_models.dynamics.damping import rayleigh_factors
    >>> alpha, beta = rayleigh_factors(np.array([50.0, 100.0]), np.array([0.01, 0.02]))
    >>> print(f"{alpha:.9f} {2.0 * 0.01 / (100.0 * np.pi) / beta:.9f}")
    0.000000000 1.000000000
    """
    angular = 2.0 * np.pi * checks.array("frequencies", frequencies, (2,), error=RigError)
    given = checks.array("damping ratios", ratios, (2,), error=RigError)
    if angular.min() <= 0.0 or angular[0] == angular[1]:
        raise RigError("frequencies that are equal or not above 0: give two that differ")
    alpha, beta = np.linalg.solve(np.stack([1.0 / angular, angular], axis=1), 2.0 * given)
    return float(alpha), float(beta)
