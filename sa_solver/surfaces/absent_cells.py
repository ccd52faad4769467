"""Cells without a surface, whose height is +infinity: they never touch.

The solvers know finite heights only. Such cells are therefore put so high above all others that
nothing reaches them, which the state then shows: as long as they carry no pressure it is that of
the cells with a surface alone. Between bodies that do not turn the first height is a bound (what
all the load on one cell would move that); where they turn it may have to grow.
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
"""Heights that are tried, over the first: digits of a displacement are lost beyond."""

Control = tuple[float, float, float, float]


class Pressed(Protocol):
    """A state, frozen, with ``pressure`` and ``gap`` ``(nx, ny)``."""

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
    """The state that ``solve`` finds for ``height`` ``(nx, ny)`` with infinite ones in it [mm].

    ``control`` is P [N] and the imposed δz [mm], φx and φy [rad], 0 where they are not imposed.
    Raises ``error`` where no cell has a surface, or where the load can be carried by none that has.
    """
    absent = np.isinf(height)
    if not absent.any():
        return solve(height)
    if absent.all():
        raise error("heights are infinite or masked in all cells: nothing can touch")
    there, grid = height[~absent], half_space.grid
    P, delta, tilt_x, tilt_y = map(abs, control)
    far = P / grid.cell_area * half_space.self_compliance(Z) + delta + float(np.ptp(there))
    far += 0.5 * (tilt_x * grid.size[1] + tilt_y * grid.size[0])
    for times in LIFTS:
        state = solve(np.where(absent, there.max() + times * far, height))
        if not state.pressure[absent].any():
            return replace(state, gap=np.where(absent, np.inf, state.gap))
    raise error(
        "the load acts beyond the cells that have a surface, those whose height is neither "
        "infinite nor masked: hold the tilt, or move the load"
    )
