"""Normal contact of bodies that yield: a hardness bounds the pressure, and the surplus flattens.

Where the pressure p reaches the hardness H, the softer surface flattens by f, so far that it
carries no more. The flattening is permanent. Pressure, gap g and flattening of heights h obey

    0 <= p <= H,  g = h + f + K p - R c >= 0,  p g = 0,  f >= 0,  f (H - p) = 0

The set of cells that yield is guessed. These carry H, and the other cells are an elastic contact
under the rest of the load. Cells of it above H join the set; cells whose surfaces would have to
grow leave it. This goes on until the set stays.

Source: Almqvist et al. 2007, Tribol. Int. 40, 574 (the conditions, for rough surfaces).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from sa_solver.half_space.operator import HalfSpace
from sa_solver.normal.control import NormalContactError, NormalControl
from sa_solver.normal.problem import border_share, messages
from sa_solver.normal.state import NormalStart, NormalState
from sa_solver.types import Array, Grid

PASSES = 60
"""Most sets of yielding cells. Spheres and rough surfaces took at most 20."""

ABOVE = 1e-6
"""Relative excess of a pressure over the hardness that is left, as the error of a solution."""

Elastic = Callable[[Array, NormalControl, NormalStart | None], NormalState]
"""Function that solves for heights, infinite where cells carry nothing, from a guess."""


def yielding_state(
    elastic: Elastic,
    half_space: HalfSpace,
    height: Array,
    control: NormalControl,
    hardness: float,
    start: NormalStart | None,
) -> NormalState:
    """Return the state of bodies of this ``hardness`` [MPa], with its flattening.

    ``height`` ``(nx, ny)`` [mm] may be infinite. Raises NormalContactError for a load that the
    hardness cannot carry, and where all cells yield.
    """
    grid, present = half_space.grid, np.isfinite(height)
    _check_hardness(hardness, int(present.sum()), control, grid)
    yields = np.zeros(grid.shape, dtype=bool)
    convolutions = 0
    for _ in range(PASSES):
        if yields[present].all():
            raise NormalContactError(
                f"all cells yield at the hardness of {hardness:g} MPa: enlarge the grid, or lower "
                "the approach"
            )
        carried = np.where(yields, hardness, 0.0)
        moved = half_space.normal(carried) if yields.any() else carried
        others = np.where(yields, np.inf, height + moved)
        found = elastic(others, _remaining(control, carried, grid), start)
        convolutions += found.convolutions + int(yields.any())
        tilt = found.tilt_x * grid.y - found.tilt_y * grid.x
        gap = height + moved + found.displacement - found.approach - tilt
        before = yields
        yields = np.where(before, gap < 0.0, found.pressure > (1.0 + ABOVE) * hardness)
        if not found.converged or np.array_equal(before, yields):
            break
        left = np.where(yields, 0.0, found.pressure)
        start = replace(found.start, pressure=left, displacement=half_space.normal(left))
        convolutions += 1
    settled = np.array_equal(before, yields)
    failure = "" if settled else f"the cells that yield do not settle in {PASSES} passes"
    if not found.converged:
        failure = found.message
    pressure, force = found.pressure + carried, carried * grid.cell_area
    border_load = 0.0 if half_space.periodic else border_share(pressure)
    return replace(
        found,
        pressure=pressure,
        gap=np.where(before, 0.0, found.gap),
        displacement=found.displacement + moved,
        P=found.P + float(force.sum()),
        Mx=found.Mx + float((force * grid.y).sum()),
        My=found.My - float((force * grid.x).sum()),
        converged=found.converged and settled,
        message=messages(failure, border_load),
        convolutions=convolutions,
        border_load=border_load,
        flattening=np.where(before, -gap, 0.0),
    )


def _remaining(control: NormalControl, carried: Array, grid: Grid) -> NormalControl:
    """Return the control of the other cells, for the pressure ``carried`` by those that yield."""
    force = carried * grid.cell_area
    sums = float(force.sum()), float((force * grid.y).sum()), -float((force * grid.x).sum())
    changes = {
        name: given - part
        for name, part in zip(("P", "Mx", "My"), sums, strict=True)
        if (given := getattr(control, name)) is not None
    }
    return replace(control, **changes)


def _check_hardness(hardness: float, cells: int, control: NormalControl, grid: Grid) -> None:
    """Raise NormalContactError if all ``cells`` at the hardness cannot carry the load."""
    largest = hardness * cells * grid.cell_area
    if control.P is not None and largest <= control.P:
        raise NormalContactError(
            f"P = {control.P:g} N is more than the whole grid carries at the hardness of "
            f"{hardness:g} MPa, {largest:g} N: enlarge the grid, or check the unit of the hardness"
        )
