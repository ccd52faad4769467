"""Conditions of a contact, evaluated from its fields, independently of the method."""

import numpy as np

from sa_solver.half_space.operator import HalfSpace
from tests.oracles.uniform_traction import love_displacement

SMALLEST = 1e-4
"""Tangential displacements count as at least this share of the normal ones."""


def love_matrix(grid, contact_modulus):
    """Return the normal displacement of every cell under unit pressure on every other (Love)."""
    x, y = (coordinate.ravel() for coordinate in np.broadcast_arrays(grid.x, grid.y))
    half = 0.5 * grid.pitch[0], 0.5 * grid.pitch[1]
    return love_displacement(
        np.subtract.outer(x, x), np.subtract.outer(y, y), half, contact_modulus
    )


def normal_error(grid, contact_modulus, height, state):
    """Return the largest of penetration, complementarity and missing load, by a dense matrix."""
    p = state.pressure
    moved = (love_matrix(grid, contact_modulus) @ p.ravel()).reshape(grid.shape)
    gap = height + moved - (state.approach + state.tilt_x * grid.y - state.tilt_y * grid.x)
    force = p * grid.cell_area
    loads = np.array([force.sum(), (force * grid.y).sum(), -(force * grid.x).sum()])
    given = np.array([state.P, state.Mx, state.My])
    lengths = np.array([1.0, *grid.size[::-1]]) * force.sum()
    assert p.min() >= 0.0
    return max(
        -gap.min() / moved.max(),
        np.abs(p * gap).max() / (p.max() * moved.max()),
        np.abs((loads - given) / lengths).max(),
    )


def frictional_error(contact, before, height, state, load):
    """Return the largest relative violation of any condition of an increment."""
    grid, pair = contact.grid, contact.half_space.pair
    moved = HalfSpace(grid, pair).displacement(state.traction)
    shear, pressure = state.shear, state.pressure
    dz, dx, dy, tilt_x, tilt_y, twist = state.rigid
    gap = height + moved[2] - dz - tilt_x * grid.y + tilt_y * grid.x
    dx, dy, twist = np.array([dx, dy, twist]) - before.rigid[[1, 2, 5]]
    slip = moved[:2] - before.displacement[:2]
    slip[0] += (load.strain - before.strain) * grid.x - dx + twist * grid.y
    slip[1] -= dy + twist * grid.x
    limit = contact.friction * pressure
    size, amount = np.hypot(*shear), np.hypot(*slip)
    depth = moved[2].max()
    # That of the increment, which tolerances are shares of.
    reach = max(np.hypot(*(moved - before.displacement)[:2]).max(), SMALLEST * depth)
    slipping = size >= limit * (1.0 - 1e-6)
    stuck = (pressure > 0.0) & ~slipping
    opposed = (np.sum(shear * slip, axis=0) + size * amount)[slipping]
    return max(
        -gap.min() / depth,
        np.abs(pressure * gap).max() / (pressure.max() * depth),
        (size - limit).max() / pressure.max(),
        amount[stuck].max(initial=0.0) / reach,
        opposed.max(initial=0.0) / (pressure.max() * reach),
    )
