"""Check that a contact covers enough cells of its grid."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import Any

from sa_solver.surfaces.resolution import fewest_across, is_point, peak_error, too_few_across
from sa_solver.types import Array, Grid
from workflow.case.text.readable import percent
from workflow.errors import TooCoarse
from workflow.messages.warning_kinds import WarningKind
from workflow.shell.terminal.reporter import Reporter

# Largest number of cells of a contact grid along a direction.
MOST_CELLS = 4096
# A proposed grid has this factor more cells than needed, since the counted cells may reach beyond
# the contact.
MARGIN = 1.25
# A grid that is made smaller has this factor more cells than the contact, for room around it.
ROOM = 1.25


def check_cells(
    name: str,
    settings: Any,
    grid: Grid,
    pressure: Array,
    reporter: Reporter,
    *,
    fixed: bool = True,
    worn: bool = False,
) -> None:
    """Warn if a ``pressure`` field ``(nx, ny)`` covers too few cells, and propose a finer grid.

    ``settings`` is the section ``contact`` of a case, whose size stays the same if it is ``fixed``.
    Raises UserError if the contact is a single point on its grid. If the contact is ``worn``, the
    run is almost finished by then, so a warning is given instead.
    """
    pressed, enough = pressure > 0.0, fewest_across(grid.line)
    across = too_few_across(pressed, grid.line)
    if not across:
        return
    given = settings.grid
    factors = [MARGIN * enough / count if count < enough else 1.0 for count in across]
    finer = [2 * ceil(0.5 * n * f) if f > 1.0 else n for n, f in zip(given, factors, strict=False)]
    finer += given[len(finer) :]
    grids = []
    if max(finer) <= MOST_CELLS:
        grids.append(f"contact.grid: {_entry(finer, settings.grid)}")
    room = ROOM * MARGIN * enough
    if not fixed and all(n >= room for n, f in zip(given, factors, strict=False) if f > 1.0):
        less = [f"{mm / f:.3g} mm" for mm, f in zip(grid.size, factors, strict=False)]
        grids.append(f"contact.size: {_entry(less, settings.size)}")
    cells, remedy = " x ".join(map(str, across)), " or ".join(grids or ["a finer contact.grid"])
    if is_point(pressed) and not worn:
        raise TooCoarse(
            f"contact.grid: {name} is only {cells} cells across, so its size and pressure are "
            f"meaningless: finer cells are needed than those of {remedy}"
        )
    after = " after wear" if worn else ""
    reporter.warn(
        WarningKind.FEW_CELLS,
        f"{name} is only {cells} cells across{after}, and {enough} are needed: the largest "
        f"pressure may have an error of {percent(peak_error(min(across)))}, and the width one of a "
        f"cell; take {remedy}",
    )


def _entry(values: Sequence[object], like: object) -> str:
    """Format values as the case writes them: a single value or a list."""
    listed = ", ".join(map(str, values))
    return f"[{listed}]" if isinstance(like, tuple) else listed
