"""Pointwise laws of dry contact: unilateral pressure and Coulomb's bound on shear.

The half-space solvers and the structural solvers share these laws. Each law is the local step of
the splitting in :mod:`sa_solver.splitting`.
"""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array, Mask

ROUNDING = 1e-12
"""Relative distance below the friction limit up to which a cell counts as slipping."""


def unilateral(pressure: Array) -> Array:
    """Return ``max(0, p)`` for any shape and unit: surfaces push and never pull."""
    return np.maximum(pressure, 0.0)


def project_on_disk(shear: Array, limit: Array) -> Array:
    """Return ``shear`` with vectors longer than ``limit`` shortened to that length.

    ``shear`` has the shape ``(2, ...)`` and ``limit`` the shape ``(...)``, in the same unit. A
    negative limit counts as zero. The result has the shape ``(2, ...)``.
    """
    magnitude = np.hypot(shear[0], shear[1])
    radius = np.maximum(limit, 0.0)
    # Below the limit the factor is exactly 1, so that stuck cells do not change in any digit.
    factor: Array = np.divide(
        radius, magnitude, out=np.ones_like(magnitude), where=magnitude > radius
    )
    return shear * factor


def sticking(traction: Array, friction: float) -> Mask:
    """Return which cells ``(nx, ny)`` stick: those in contact whose shear is below µp.

    ``traction`` ``(3, nx, ny)`` is ordered qx, qy, p, and ``friction`` is µ.
    """
    limit = friction * traction[2]
    below = np.hypot(*traction[:2]) < limit * (1.0 - ROUNDING)
    return np.asarray((traction[2] > 0.0) & below)


def coulomb(traction: Array, friction: float | Array) -> Array:
    """Return ``traction`` projected on unilateral pressure and Coulomb's bound on shear.

    ``traction`` ``(3, ...)`` is ordered x, y, z, where the z component is the pressure, and
    ``friction`` is µ, a number or an array ``(...)``. The result has the shape ``(3, ...)``.
    """
    admissible = np.empty_like(traction)
    admissible[2] = unilateral(traction[2])
    admissible[:2] = project_on_disk(traction[:2], friction * admissible[2])
    return admissible
