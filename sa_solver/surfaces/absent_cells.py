"""Cells without a surface, which have an infinite height and never touch.

The solvers accept finite heights only. Such cells are therefore given a height so large that the
other body does not reach them. If they carry no pressure in the resulting state, the state is that
of the cells with a surface alone. For bodies that do not turn, the first height tried is a bound:
the displacement of a single cell that carries the whole load. For bodies that turn it may have to
be increased.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from sa_solver.errors import ContactProblemError
from sa_solver.half_space.influence import Z
from sa_solver.half_space.operator import HalfSpace
from sa_solver.types import Array

LIFTS = (1.0, 1e2, 1e4)
"""Factors of the first height that are tried; larger ones would cost digits of displacements."""

Control = tuple[float, float, float, float]


class Pressed(Protocol):
    """Frozen dataclass of a state with ``pressure`` and ``gap`` ``(nx, ny)``."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def pressure(self) -> Array: ...
    @property
    def gap(self) -> Array: ...


State = TypeVar("State", bound=Pressed)


def without_absent(
    height: Array,
    half_space: HalfSpace,
    control: Control,
    solve: Callable[[Array], State],
    error: type[ContactProblemError],
) -> State:
    """Return the state for heights of which some are infinite.

    Parameters
    ----------
    height
        Heights ``(nx, ny)`` [mm], infinite in cells without a surface.
    half_space
        Half-space of the contact.
    control
        Imposed P [N], δz [mm], φx and φy [rad]; 0 where they are not imposed.
    solve
        Function that returns the state for finite heights.
    error
        Class of the exception to raise if no cell has a surface, or if the cells with a surface
        cannot carry the load.
    """
    absent = np.isinf(height)
    if not absent.any():
        return solve(height)
    if absent.all():
        raise error("heights are infinite or masked in all cells: nothing can touch")
    present, grid = height[~absent], half_space.grid
    P, delta, tilt_x, tilt_y = map(abs, control)
    far = P / grid.cell_area * half_space.self_compliance(Z) + delta + float(np.ptp(present))
    far += 0.5 * (tilt_x * grid.size[1] + tilt_y * grid.size[0])
    for times in LIFTS:
        state = solve(np.where(absent, present.max() + times * far, height))
        if not state.pressure[absent].any():
            return replace(state, gap=np.where(absent, np.inf, state.gap))
    raise error(
        "the load acts beyond the cells that have a surface, those whose height is neither "
        "infinite nor masked: hold the tilt, or move the load towards them"
    )
