"""Shear where a contact sticks, from nodes of a structure that know it.

Where slip is given (wear method 1), shear is µp against it, and nothing is told of what sticks. A
structure knows at its nodes which share of Coulomb's limit shear is, and in which direction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sa_solver.types import Array
from wear.contact.tractions import CycleTractions


def with_sticking_shear(cycle: CycleTractions, nodal: Array, cell_area: float) -> CycleTractions:
    """The same tractions, with shear known in the increments in which the contact sticks too.

    There it is to pressure as in the ``nodal`` tractions ``(t, 3, nx, ny)`` on the grid [MPa]. What
    that lacks of the loads' Qx and Qy goes where shear is below µp, as far below as it is.
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
