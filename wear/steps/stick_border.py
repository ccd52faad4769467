"""What whole cells leave of wear in partial slip: the place of the border of the stick zone.

Where a contact slips it wears until nothing presses there any more; where it sticks it never wears
(Popov 2014, doi:10.1038/srep03749; Dimaki et al. 2014, Int. J. Solids Struct. 51, 4215). In the end
the zone that always sticks carries all the load, as a punch with a singular pressure at its border,
and its width decides on the wear around it. Slip close to the border is small, so that this counts
only once the cells there have lost their pressure. On a grid the zone consists of whole cells, and
presses as one with another border, for two reasons:

- Cells stick or slip as a whole. Where the border is that they stand for is told by the reserve
  µp - |q| of the unworn contact, whose square falls to zero linearly there (Cattaneo and Mindlin).
  Where wear moves the border it does so cell by cell, until those left stick.
- A punch of whole cells presses as a narrower one (:data:`EDGE`). That only matters where the
  border is still the unworn one: one that has moved is where such a punch sticks.

How much wear depends on the border is found by two short lives at the last slips: one in which the
zone sticks, and one in which the cells next to it stick as well.
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
"""By how much of a cell a flat punch of cells is narrower than these at either side: the limit of
many cells in the plane, from the force at a given indentation. Crossings of both axes counted, it
holds for a circle too (0.11 of a cell by them, 0.12 found)."""

PLACED = 0.04
"""How well the border is known, in cells: root mean square over 18 spheres and cylinders of 5 to 27
cells from the middle of the zone to its border."""

ROUNDED, ALIKE = 12.0**-0.5, 8
"""How well that is known of a border that wear has moved, by one cell after the other until those
left stick: root mean square of a place somewhere in a cell. So many of the zone's borders are at
the same place by symmetry."""

STICKING = 1e-6
"""A cell that slips has no reserve but for rounding, in shares of the largest µp."""

FITTED, LEAST = 8, 3
"""Cells inward of the border that tell where it is, the outermost left out, and the fewest of them.
Its own reserve is that of no place in particular, since shear and pressure are singular there."""


def border_errors(
    contact: WearingContact,
    state: WearState,
    cycles: tuple[CycleTractions, CycleTractions],
    worn: float,
) -> dict[str, float]:
    """Return by how much the largest ``depth`` and the ``volume`` are too large, relative.

    Parameters
    ----------
    contact, state
        The contact at the end of a run and its state there.
    cycles
        Its tractions before and after wear.
    worn
        How many cycles it has worn.

    Returns
    -------
    dict
        The sign is that of what the border's place is found to make; the size has besides what that
        is uncertain by. 0 where no zone sticks all the time beside places that wear.

    Raises
    ------
    ContactFailure
        If one of the short lives does not converge.
    """
    none = {"depth": 0.0, "volume": 0.0}
    if not state.surfaces.depth.any():
        return none
    (before, reserve), (stuck, _) = map(_always_stuck, cycles)
    wears = ~stuck & (state.surfaces.depth > 0.0)
    ring = _next_to(stuck) & wears
    if not ring.any():
        return none
    slip = _slip_everywhere(cycles)
    few, _ = _lived(contact, state, np.where(stuck, 0.0, slip), worn)
    more, held = _lived(contact, state, np.where(stuck | ring, 0.0, slip), worn)
    now, most = (sum(float(p[t][ring].sum()) for t in held) for p in (cycles[1].pressure, held))
    gone = float(np.clip(1.0 - now / most, 0.0, 1.0)) if most > 0.0 else 1.0
    axes = [_too_wide(reserve, before, stuck, wears)]
    if not contact.grid.line:
        axes.append(_too_wide(reserve.T, before.T, stuck.T, wears.T))
    wide, uncertain = np.mean(axes, axis=0)
    size = gone * float(np.hypot(wide, uncertain))
    share = float(np.copysign(size, wide)) / np.count_nonzero(ring)
    return {
        name: share * _relative(float(of(more)), float(of(few)))
        for name, of in (("depth", np.max), ("volume", np.sum))
    }


def _always_stuck(cycle: CycleTractions) -> tuple[Mask, Array]:
    """Cells that stick in every increment that presses, and their least reserve [MPa]."""
    pressing = cycle.loads.P > 0.0
    limit = cycle.friction * cycle.pressure[pressing]
    shear = np.hypot(*cycle.shear[pressing].swapaxes(0, 1))
    reserve = (limit - shear).min(axis=0)
    return reserve > STICKING * limit.max(), reserve


def _next_to(zone: Mask) -> Mask:
    """Cells beside those of a ``zone``, along either axis."""
    from scipy import ndimage

    beside: Mask = ndimage.binary_dilation(zone) & ~zone
    return beside


def _too_wide(reserve: Array, before: Mask, stuck: Mask, wears: Mask) -> tuple[float, float]:
    """By how many cells the zone that ``stuck`` presses as one too wide, and how uncertain that is.

    By its borders across the first axis, beside cells that wear. ``reserve`` is that of the unworn
    cycle, and tells where borders are that are still where they were ``before``.
    """
    wide, still, moved = 0.0, 0, 0
    for cells, beyond in _ends(stuck):
        if not wears[beyond]:
            continue
        if before[beyond] or not before[cells[0], beyond[1]]:
            moved += 1
            continue
        wide -= EDGE + _beyond(reserve[cells[1 : 1 + FITTED], beyond[1]] ** 2)
        still += 1
    rounded = ROUNDED * float(np.sqrt(moved * min(moved, ALIKE)))
    return wide, float(np.hypot(PLACED * still, rounded))


def _ends(stuck: Mask) -> Iterator[tuple[NDArray[np.intp], tuple[int, int]]]:
    """Cells of every run along the first axis from either end of it, and the cell beyond that."""
    count = len(stuck)
    for line in np.flatnonzero(stuck.any(axis=0)):
        cells = np.flatnonzero(stuck[:, line])
        for run in np.split(cells, np.flatnonzero(np.diff(cells) > 1) + 1):
            for inward, beyond in ((run, run[0] - 1), (run[::-1], run[-1] + 1)):
                if 0 <= beyond < count:
                    yield inward, (int(beyond), int(line))


def _beyond(squares: Array) -> float:
    """How many cells beyond the border of the zone ``squares`` are 0, of cells inward from it.

    The first is that of the second cell; -1 to 1, and 0 where these are too few to tell.
    """
    if len(squares) < LEAST:
        return 0.0
    inward = np.arange(len(squares)) + 1.5
    zeros = np.roots(np.polyfit(-inward, squares, 2))
    outside = zeros.real[(np.abs(zeros.imag) == 0.0) & (zeros.real > -inward[0])]
    return float(np.clip(outside.min(), -1.0, 1.0)) if outside.size else 0.0


def _slip_everywhere(cycles: tuple[CycleTractions, CycleTractions]) -> Array:
    """Slip of either cycle ``(t, nx, ny)`` [mm], and where neither has any the largest.

    Surfaces that wear has parted have none in the last cycle, nor those that have yet to meet in
    the first.
    """
    slip = np.maximum(*(acting_slip(cycle.slip, cycle.loads) for cycle in cycles))
    path = slip.sum(axis=0)
    apart = path <= STICKING * path.max()
    everywhere: Array = np.where(apart, slip.max(axis=(1, 2), keepdims=True), slip)
    return everywhere


def _lived(
    contact: WearingContact, state: WearState, slip: Array, cycles: float
) -> tuple[Array, dict[int, Array]]:
    """Worn depth ``(nx, ny)`` [mm] after one implicit step over all ``cycles`` at given slips.

    And the pressures of its increments [MPa].
    """
    unworn = Surfaces.unworn(state.surfaces.initial_gap)
    begun = replace(state, surfaces=unworn, starts={}, coarse=None)
    given = replace(contact, sliding=replace(contact.sliding, slip=slip))
    after = given.implicit_step(begun, cycles).state
    return after.surfaces.depth, {t: start.pressure for t, start in after.starts.items()}


def _relative(value: float, other: float) -> float:
    return value / other - 1.0 if other > 0.0 else 0.0
