"""Shear where a contact sticks, from nodes of a structure that know it.

Where slip is given (wear method 1), shear is µp against it, and nothing is told of what sticks. A
structure knows the tangential forces of its nodes there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sa_solver.types import Array
from wear.interface import CycleTractions


def with_sticking_shear(cycle: CycleTractions, spread: Array, cell_area: float) -> CycleTractions:
    """The same tractions, known where the contact sticks too.

    There shear is that of the nodes, ``spread`` ``(t, 2, nx, ny)`` over the cells [MPa], and, in
    the share of the pressure, what is lacking of the loads' Qx and Qy; at most µp.
    """
    shear = cycle.shear.copy()
    for t in np.flatnonzero(cycle.unknown > 0.0):
        pressure = np.where(cycle.slip[t].any(axis=0), 0.0, cycle.pressure[t])
        limit = cycle.friction * pressure
        shear[t] += _bounded(spread[t], limit)
        given = np.array([cycle.loads.Qx[t], cycle.loads.Qy[t]])
        lacking = given / cell_area - shear[t].sum(axis=(1, 2))
        more = lacking[:, None, None] * pressure / pressure.sum()
        sticks = pressure > 0.0
        shear[t][:, sticks] = _bounded(shear[t] + more, limit)[:, sticks]
    return replace(cycle, shear=shear, unknown=np.zeros_like(cycle.unknown))


def _bounded(shear: Array, limit: Array) -> Array:
    """``shear`` ``(2, ...)`` no larger than a ``limit`` ``(...)``."""
    size = np.hypot(*shear)
    share = np.divide(limit, size, out=np.ones_like(size), where=size > limit)
    return shear * share
