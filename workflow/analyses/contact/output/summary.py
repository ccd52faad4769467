"""Numbers of a contact run: of every computed increment, and of its last closed cycle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from sa_solver.contact_state import ContactState
from sa_solver.cycles.history import History
from sa_solver.ties import first_largest
from sa_solver.types import Array, Grid, Mask
from workflow.models.uncoupled.load_table import FORCES, MOTIONS, LoadTable

# A cell sticks where its shear is below µp by more than this share, which covers rounding.
STICK_MARGIN = 1e-6
# A cycle is closed where shear returns to within this share of µ times the peak pressure.
CLOSED = 0.05
# Relative changes below this value are rounding, and so are forces and motions below this share of
# the largest.
ROUNDING = 1e-6
# Numbers about the solution that are no results.
NO_RESULTS = {"residual", "border_load", "closure"}


def state_summaries(grid: Grid, friction: float, history: History) -> list[dict[str, Any]]:
    """Return numbers of every computed increment in base units; for a line contact, per mm.

    ``full_slip_force`` and ``full_slip_moment`` (about the grid's centre) are the friction limits
    at the present pressure; ``radial_shear_share`` is the largest shear along a radius from that
    centre over the largest shear.
    """
    energies = np.cumsum([np.sum(state.energy) for state in history.states])
    return [
        {
            "increment": index + 1,
            **dict(zip(FORCES, map(float, state.resultants), strict=True)),
            **dict(zip(MOTIONS, map(float, state.rigid), strict=True)),
            **_pressure_summary(grid, state),
            **_shear_summary(grid, friction, state),
            **_yield_summary(grid, state),
            "energy": float(np.sum(state.energy)),
            "cumulative_energy": float(energy),
            "sliding": slides(state, friction),
            "residual": float(state.residual),
            "convolutions": int(state.convolutions),
            "border_load": float(state.border_load),
        }
        for index, state, energy in zip(history.indices, history.states, energies, strict=True)
    ]


def increments_errors(
    grid: Grid, friction: float, table: LoadTable, history: History, strain: Array
) -> dict[str, dict[str, float]]:
    """Estimate the error due to increments of the numbers of the ``last`` state and the ``loop``.

    Errors are relative, and given for the numbers that change. The result is empty where increments
    do not matter, or there is no estimate.
    """
    if not history.others:
        return {}
    other = replace(history, states=history.others)
    both = history, other
    last, last_other = (state_summaries(grid, friction, each)[-1] for each in both)
    loop, loop_other = (loop_summary(grid, friction, table, each, strain) or {} for each in both)
    return {
        "last": _changes(last, last_other, history.share),
        "loop": _changes(loop, loop_other, history.share),
    }


def _changes(
    numbers: Mapping[str, Any], others: Mapping[str, Any], share: float
) -> dict[str, float]:
    """Return a ``share`` of the changes of all numbers, relative to the numbers."""
    largest = {
        name: max(abs(numbers.get(other, 0.0)) for other in group)
        for group in (FORCES, MOTIONS)
        for name in group
    }
    found = {
        name: share * abs(value - others[name]) / abs(value)
        for name, value in numbers.items()
        if isinstance(value, float)
        and name in others.keys() - NO_RESULTS
        and abs(value) > ROUNDING * largest.get(name, 0.0)
    }
    return {name: error for name, error in found.items() if error > ROUNDING}


def stick_zone(state: ContactState, friction: float) -> Mask:
    """Return the mask ``(nx, ny)`` of cells that are pressed and whose shear is below µp."""
    pressure = state.traction[2]
    shear = np.hypot(*state.traction[:2])
    return (pressure > 0.0) & (shear < _limit(state, friction) * (1.0 - STICK_MARGIN))


def _limit(state: ContactState, friction: float) -> Array:
    """Return the largest shear ``(nx, ny)`` [MPa]."""
    return friction * state.traction[2] if state.limit is None else state.limit


def slides(state: ContactState, friction: float) -> bool:
    """Return whether the contact is pressed and slips everywhere."""
    pressed = bool((state.traction[2] > 0.0).any())
    return bool(state.sliding) or (pressed and not stick_zone(state, friction).any())


def _pressure_summary(grid: Grid, state: ContactState) -> dict[str, float]:
    pressure = state.traction[2]
    near = (np.abs(grid.x) < 0.75 * grid.pitch[0]) & (np.abs(grid.y) < 0.75 * grid.pitch[1])
    return {
        "peak_pressure": float(pressure.max()),
        "central_pressure": float(pressure[near].mean()),
        **_extent(grid, pressure > 0.0, "contact"),
    }


def _shear_summary(grid: Grid, friction: float, state: ContactState) -> dict[str, Any]:
    qx, qy, _ = state.traction
    limit = _limit(state, friction)
    shear, radius = np.hypot(qx, qy), np.hypot(grid.x, grid.y)
    sticks = stick_zone(state, friction)
    radial = np.abs(qx * grid.x + qy * grid.y) / np.where(radius > 0.0, radius, 1.0)
    numbers = {
        "peak_shear": float(shear.max()),
        **_extent(grid, sticks, "stick"),
        "stick_centre": _centre(grid, sticks),
        "full_slip_force": float(limit.sum() * grid.cell_area),
    }
    if grid.line:
        return numbers
    moment = np.sum(limit * radius) * grid.cell_area
    share = float(radial.max() / shear.max()) if shear.any() else 0.0
    return numbers | {"radial_shear_share": share, "full_slip_moment": float(moment)}


def _yield_summary(grid: Grid, state: ContactState) -> dict[str, float]:
    """Return by how much the surfaces have yielded, for bodies with a hardness."""
    if state.flattening is None:
        return {}
    return {
        "flattening": float(state.flattening.max()),
        "flattened_volume": float(state.flattening.sum()) * grid.cell_area,
        "flattened_area": float(np.count_nonzero(state.flattening)) * grid.cell_area,
    }


def _extent(grid: Grid, cells: Mask, name: str) -> dict[str, float]:
    """Return the area of ``cells``, with the radius of an equal disk or half width of a line."""
    area = float(np.count_nonzero(cells)) * grid.cell_area
    if grid.line:
        return {f"{name}_area": area, f"{name}_half_width": 0.5 * area}
    return {f"{name}_area": area, f"{name}_radius": float(np.sqrt(area / np.pi))}


def _centre(grid: Grid, cells: Mask) -> list[float] | None:
    """Return the centroid of ``cells`` [mm], None where there are none."""
    if not cells.any():
        return None
    along, across = np.broadcast_arrays(grid.x, grid.y)
    return [float(along[cells].mean()), float(across[cells].mean())]


def loop_summary(
    grid: Grid, friction: float, table: LoadTable, history: History, strain: Array
) -> dict[str, Any] | None:
    """Return the last closed cycle of the path, None if no cycle closes.

    ``energy`` is dissipated by slip. ``area`` is the work ∮ F dδ (- Σ qx x S dε under bulk strain
    ``strain`` ``(n,)``) by trapezoids, which needs every increment. ``amplitude`` is half the range
    of ``motion``, the rigid motion with the most work in the cycle, and ``force_amplitude`` that of
    its ``force``.
    """
    span = _last_cycle(friction, table, history)
    if span is None:
        return None
    first, last = span
    states = history.states[first : last + 1]
    forces = np.array([state.resultants for state in states])
    motions = np.array([state.rigid for state in states])
    driven = first_largest(np.ptp(forces, axis=0) * np.ptp(motions, axis=0))
    loop: dict[str, Any] = {
        "from_increment": history.indices[first] + 1,
        "to_increment": history.indices[last] + 1,
        "energy": float(sum(np.sum(state.energy) for state in states[1:])),
        "force": FORCES[driven],
        "motion": MOTIONS[driven],
        "amplitude": 0.5 * float(np.ptp(motions[:, driven])),
        "force_amplitude": 0.5 * float(np.ptp(forces[:, driven])),
        "closure": _shear_change(friction, states[0], states[-1]),
    }
    if history.method == "full":
        stretching = [np.sum(state.traction[0] * grid.x) * grid.cell_area for state in states]
        strains = strain[history.indices[first : last + 1]]
        work = np.trapezoid(forces, motions, axis=0).sum() - np.trapezoid(stretching, strains)
        loop["area"] = float(work)
    return loop


def _last_cycle(friction: float, table: LoadTable, history: History) -> tuple[int, int] | None:
    """Return the first and last state of the last closed cycle, None if there is none."""
    loads = np.stack([column[history.indices] for column in table.columns.values()], axis=1)
    for last in range(len(loads) - 1, 1, -1):
        same = np.flatnonzero(np.all(loads[: last - 1] == loads[last], axis=1))
        for first in same[::-1]:
            # Between the two, the load must have changed, and the shear must have returned.
            moves = any(np.any(a != b) for a, b in pairwise(loads[first : last + 1]))
            ends = history.states[first], history.states[last]
            if moves and _shear_change(friction, *ends) <= CLOSED:
                return int(first), last
    return None


def _shear_change(friction: float, before: ContactState, after: ContactState) -> float:
    """Return the largest change of shear over µ times the peak pressure."""
    limit = friction * float(before.traction[2].max())
    change = np.hypot(*(after.traction[:2] - before.traction[:2])).max()
    return float(change / limit) if limit > 0.0 else 0.0
