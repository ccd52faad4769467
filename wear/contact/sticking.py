"""Shear of a contact where it sticks, from the nodal tractions of a structure.

Where slip is given (wear method 1), shear is µp against the slip, and unknown where the contact
sticks. A structure knows at its nodes the ratio of shear to Coulomb's limit, and its direction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sa_solver.types import Array
from wear.contact.tractions import CycleTractions


def with_sticking_shear(cycle: CycleTractions, nodal: Array, cell_area: float) -> CycleTractions:
    """Return the tractions with shear also in the increments in which the contact sticks.

    In these the ratio of shear to pressure is that of the ``nodal`` tractions ``(t, 3, nx, ny)`` on
    the grid [MPa]. The difference to the resultants Qx and Qy is distributed over cells with shear
    below µp in proportion to the remaining friction capacity.
    """
    shear = cycle.shear.copy()
    for t in np.flatnonzero(cycle.unknown > 0.0):
        pressure, (*along, pressed) = cycle.pressure[t], nodal[t]
        given = np.divide(along, pressed, out=np.zeros_like(shear[t]), where=pressed > 0.0)
        shear[t] = np.where(pressed > 0.0, given * pressure, shear[t])
        limit = cycle.friction * pressure
        size = np.hypot(*shear[t])
        shear[t] *= np.divide(limit, size, out=np.ones_like(size), where=size > limit)
        room = np.maximum(limit - size, 0.0)
        loads = np.array([cycle.loads.Qx[t], cycle.loads.Qy[t]])
        lacking = loads / cell_area - shear[t].sum(axis=(1, 2))
        most = max(float(room.sum()), float(np.hypot(*lacking)))
        if most > 0.0:
            shear[t] += lacking[:, None, None] * room / most
    return replace(cycle, shear=shear, unknown=np.zeros_like(cycle.unknown))
