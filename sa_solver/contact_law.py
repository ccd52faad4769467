"""The pointwise laws of dry contact: unilateral pressure and Coulomb's bound on shear.

Half-space and structural solvers share them: each law is the local step of the splitting in
:mod:`sa_solver.splitting`.
"""

from __future__ import annotations

import numpy as np

from sa_solver.types import Array, Mask

ROUNDING = 1e-12
"""How far below its limit shear on the limit may be."""


def unilateral(pressure: Array) -> Array:
    """``max(0, p)``: surfaces push and never pull; any shape, any unit."""
    return np.maximum(pressure, 0.0)


def project_on_disk(shear: Array, limit: Array) -> Array:
    """Shear scaled back, where it exceeds ``limit``, to the disk of that radius.

    ``shear`` has shape ``(2, ...)``, ``limit`` shape ``(...)`` in the same unit; a limit below zero
    counts as zero. Returns shape ``(2, ...)``.
    """
    magnitude = np.hypot(shear[0], shear[1])
    radius = np.maximum(limit, 0.0)
    # Where nothing exceeds the limit the factor is exactly 1, so stuck cells stay bit for bit.
    factor: Array = np.divide(
        radius, magnitude, out=np.ones_like(magnitude), where=magnitude > radius
    )
    return shear * factor


def sticking(traction: Array, friction: float) -> Mask:
    """Cells ``(nx, ny)`` in contact whose shear is below µp; ``traction`` ``(3, nx, ny)``."""
    limit = friction * traction[2]
    below = np.hypot(*traction[:2]) < limit * (1.0 - ROUNDING)
    return np.asarray((traction[2] > 0.0) & below)


def coulomb(traction: Array, friction: float | Array) -> Array:
    """Unilateral pressure and shear within ``friction`` times that pressure.

    ``traction`` has shape ``(3, ...)`` ordered x, y, z (the z component is the pressure);
    ``friction`` is µ, a number or shape ``(...)``. Returns shape ``(3, ...)``.
    """
    admissible = np.empty_like(traction)
    admissible[2] = unilateral(traction[2])
    admissible[:2] = project_on_disk(traction[:2], friction * admissible[2])
    return admissible
