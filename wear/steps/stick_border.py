"""Error of wear in partial slip due to whole cells: the position of the border of the stick zone.

Where a contact slips it wears until it carries no pressure; where it sticks it never wears (Popov
2014, doi:10.1038/srep03749; Dimaki et al. 2014, Int. J. Solids Struct. 51, 4215). In the end the
zone that always sticks carries all the load, as a punch with a singular pressure at its border, and
its width determines the wear around it. Slip close to the border is small, so that this error only
matters once the cells there have lost their pressure. On a grid the zone consists of whole cells,
and acts as one with another border, for two reasons:

- Cells stick or slip as a whole. The true border follows from the reserve µp - |q| of the unworn
  contact, whose square falls to zero linearly there (Cattaneo and Mindlin). Where wear moves the
  border, it does so cell by cell, until those left stick.
- A punch of whole cells acts as a narrower one (:data:`EDGE`). This only matters where the border
  is still the unworn one: one that has moved is where such a punch sticks.

The sensitivity of wear to the border is found by two probe runs at the last slips: in one the zone
sticks, in the other the cells next to it stick as well.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sa_solver.types import Array, Mask
from wear.contact.tractions import CycleTractions, acting_slip
from wear.steps.stepping import WearingContact, WearState
from wear.surfaces import Surfaces

EDGE = 0.1746
"""Width, in cells, by which a flat punch of whole cells acts narrower on either side. It is the
limit of many cells in two dimensions, from the force at a given indentation. For a circle, counted
along both axes, it predicts 0.11 of a cell where 0.12 was found.
"""

BORDER_ERROR = 0.04
"""Uncertainty of an unworn border, in cells: root mean square over 18 spheres and cylinders with 5
to 27 cells from the middle of the zone to its border.
"""

MOVED_BORDER_ERROR, SYMMETRIC_BORDERS = 12.0**-0.5, 8
"""Uncertainty of a border that wear has moved cell by cell, in cells: the root mean square of a
position anywhere in a cell. By symmetry up to this number of the zone's borders share their error.
"""

STICKING = 1e-6
"""Reserve, over the largest µp, up to which a cell slips: it is 0 but for rounding."""

FITTED_CELLS, FEWEST_CELLS = 8, 3
"""Number of cells inside the border from which its position is fitted, and the fewest of them. The
outermost cell is left out: shear and pressure are singular there, so that its reserve belongs to no
definite position.
"""


def border_errors(
    contact: WearingContact,
    state: WearState,
    cycles: tuple[CycleTractions, CycleTractions],
    worn: float,
) -> dict[str, float]:
    """Return the relative errors of the largest ``depth`` and of the ``volume`` due to the border.

    Positive errors mean too much wear.

    Parameters
    ----------
    contact, state
        The contact at the end of a run and its state there.
    cycles
        Its tractions before and after wear.
    worn
        Number of cycles that it has worn.

    Returns
    -------
    dict
        The sign is that of the estimated error. The size also contains its uncertainty. It is 0
        where no zone that always sticks lies next to worn cells.

    Raises
    ------
    ContactFailure
        If one of the probe runs does not converge.
    """
    none = {"depth": 0.0, "volume": 0.0}
    if not state.surfaces.depth.any():
        return none
    (before, reserve), (stuck, _) = map(_always_stuck, cycles)
    wears = ~stuck & (state.surfaces.depth > 0.0)
    ring = _neighbours(stuck) & wears
    if not ring.any():
        return none
    slip = _slip_everywhere(cycles)
    few, _ = _probe_run(contact, state, np.where(stuck, 0.0, slip), worn)
    more, held = _probe_run(contact, state, np.where(stuck | ring, 0.0, slip), worn)
    now, most = (sum(float(p[t][ring].sum()) for t in held) for p in (cycles[1].pressure, held))
    gone = float(np.clip(1.0 - now / most, 0.0, 1.0)) if most > 0.0 else 1.0
    axes = [_excess_width(reserve, before, stuck, wears)]
    if not contact.grid.line:
        axes.append(_excess_width(reserve.T, before.T, stuck.T, wears.T))
    wide, uncertain = np.mean(axes, axis=0)
    size = gone * float(np.hypot(wide, uncertain))
    share = float(np.copysign(size, wide)) / np.count_nonzero(ring)
    return {
        name: share * _relative(float(of(more)), float(of(few)))
        for name, of in (("depth", np.max), ("volume", np.sum))
    }


def _always_stuck(cycle: CycleTractions) -> tuple[Mask, Array]:
    """Return the cells that stick in every loaded increment, and their least reserve [MPa]."""
    pressing = cycle.loads.P > 0.0
    limit = cycle.friction * cycle.pressure[pressing]
    shear = np.hypot(*cycle.shear[pressing].swapaxes(0, 1))
    reserve = (limit - shear).min(axis=0)
    return reserve > STICKING * limit.max(), reserve


def _neighbours(zone: Mask) -> Mask:
    """Return the cells next to a ``zone`` along either axis."""
    from scipy import ndimage

    neighbours: Mask = ndimage.binary_dilation(zone) & ~zone
    return neighbours


def _excess_width(reserve: Array, before: Mask, stuck: Mask, wears: Mask) -> tuple[float, float]:
    """Return by how many cells the ``stuck`` zone acts too wide, and the uncertainty.

    Only borders across the first axis next to worn cells count. ``reserve``, that of the unworn
    cycle, gives the position of borders that are still where they were ``before``.
    """
    wide, still, moved = 0.0, 0, 0
    for cells, beyond in _borders(stuck):
        if not wears[beyond]:
            continue
        if before[beyond] or not before[cells[0], beyond[1]]:
            moved += 1
            continue
        wide -= EDGE + _border_offset(reserve[cells[1 : 1 + FITTED_CELLS], beyond[1]] ** 2)
        still += 1
    rounded = MOVED_BORDER_ERROR * float(np.sqrt(moved * min(moved, SYMMETRIC_BORDERS)))
    return wide, float(np.hypot(BORDER_ERROR * still, rounded))


def _borders(stuck: Mask) -> Iterator[tuple[NDArray[np.intp], tuple[int, int]]]:
    """Yield the cells of every run along the first axis from either end, and the cell beyond it."""
    count = len(stuck)
    for line in np.flatnonzero(stuck.any(axis=0)):
        cells = np.flatnonzero(stuck[:, line])
        for run in np.split(cells, np.flatnonzero(np.diff(cells) > 1) + 1):
            for inward, beyond in ((run, run[0] - 1), (run[::-1], run[-1] + 1)):
                if 0 <= beyond < count:
                    yield inward, (int(beyond), int(line))


def _border_offset(squares: Array) -> float:
    """Return how many cells beyond the border of the zone the reserve vanishes, from -1 to 1.

    ``squares`` are the squared reserves of cells inward from the second one. The result is 0 if
    there are too few of them.
    """
    if len(squares) < FEWEST_CELLS:
        return 0.0
    inward = np.arange(len(squares)) + 1.5
    zeros = np.roots(np.polyfit(-inward, squares, 2))
    outside = zeros.real[(np.abs(zeros.imag) == 0.0) & (zeros.real > -inward[0])]
    return float(np.clip(outside.min(), -1.0, 1.0)) if outside.size else 0.0


def _slip_everywhere(cycles: tuple[CycleTractions, CycleTractions]) -> Array:
    """Return the larger slip of both cycles ``(t, nx, ny)`` [mm], without gaps.

    Cells without slip in either cycle get the largest slip: surfaces that wear has parted do not
    slip in the last cycle, and those that have yet to meet do not slip in the first.
    """
    slip = np.maximum(*(acting_slip(cycle.slip, cycle.loads) for cycle in cycles))
    path = slip.sum(axis=0)
    apart = path <= STICKING * path.max()
    everywhere: Array = np.where(apart, slip.max(axis=(1, 2), keepdims=True), slip)
    return everywhere


def _probe_run(
    contact: WearingContact, state: WearState, slip: Array, cycles: float
) -> tuple[Array, dict[int, Array]]:
    """Run a probe: one implicit step over all ``cycles`` from the unworn surfaces at given slips.

    Return the worn depth ``(nx, ny)`` [mm] and the pressures of the increments [MPa].
    """
    unworn = Surfaces.unworn(state.surfaces.initial_gap)
    begun = replace(state, surfaces=unworn, starts={}, coarse=None)
    given = replace(contact, sliding=replace(contact.sliding, slip=slip))
    after = given.implicit_step(begun, cycles).state
    return after.surfaces.depth, {t: start.pressure for t, start in after.starts.items()}


def _relative(value: float, other: float) -> float:
    return value / other - 1.0 if other > 0.0 else 0.0
