"""Contacts that lie on few cells of their grid: warned of, or refused where no field is left."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import Any

from sa_solver.resolution import FEWEST_CELLS, cells_across, is_point, peak_error
from sa_solver.types import Array, Grid
from workflow.errors import UserError
from workflow.shell.reporter import Reporter

# A grid of a contact may have so many cells along a direction.
MOST_CELLS = 4096
# Cells across that proposed grids give: those counted may reach beyond the contact by one.
PROPOSED = 20
# A grid that is made smaller has at least so many cells, for room around the contact.
ROOMY = 26


def check_cells(
    name: str, settings: Any, grid: Grid, pressure: Array, reporter: Reporter, *, worn: bool = False
) -> None:
    """Warn of a ``pressure`` ``(nx, ny)`` on few cells, with a grid that would do.

    ``settings`` is the section ``contact`` of a case. Raises UserError where the contact is a
    point on its grid, unless it is ``worn``: then all but the end has been computed.
    """
    pressed = pressure > 0.0
    if not pressed.any():
        return
    across = cells_across(pressed)[: 1 if grid.line else 2]
    if min(across) >= FEWEST_CELLS:
        return
    cells = " x ".join(map(str, across))
    if is_point(pressed) and not worn:
        raise UserError(
            f"contact.grid: {name} is only {cells} cells across, which says nothing of its size "
            f"and pressure: {_remedy(settings, across, 'more cells than', 'less than')}"
        )
    after = " after wear" if worn else ""
    reporter.warn(
        f"{name} is {cells} cells across{after}, where {FEWEST_CELLS} resolve it: the largest "
        f"pressure may be {peak_error(min(across)):.1%} off and the width a cell: "
        f"{_remedy(settings, across, 'take', 'take')}"
    )


def _remedy(settings: Any, across: Sequence[int], of_grid: str, of_size: str) -> str:
    """The entries with which the contact has enough cells, and what to do with either."""
    given = settings.grid if isinstance(settings.grid, tuple) else (settings.grid,)
    size = getattr(settings, "size", ())
    size = size if isinstance(size, tuple) else (size,)
    factors = [PROPOSED / count if count < FEWEST_CELLS else 1.0 for count in across]
    finer = [2 * ceil(0.5 * n * f) if f > 1.0 else n for n, f in zip(given, factors, strict=False)]
    finer += given[len(finer) :]
    ways = []
    if max(finer) <= MOST_CELLS:
        ways.append(f"{of_grid} contact.grid: {_entry(finer, settings.grid)}")
    if size and all(n >= ROOMY for n, f in zip(given, factors, strict=False) if f > 1.0):
        less = [f"{mm / f:.3g} mm" for mm, f in zip(size, factors, strict=False)]
        ways.append(f"{of_size} contact.size: {_entry(less, settings.size)}")
    return ", or ".join(ways or ["take a finer contact.grid"])


def _entry(values: Sequence[object], like: object) -> str:
    """Values as the case has them: one, or a list."""
    listed = ", ".join(map(str, values))
    return f"[{listed}]" if isinstance(like, tuple) else listed
