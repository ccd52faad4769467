"""What slips dissipate and wear over the increments of closed cycles, to second order.

The states at the ends of the increments are solved; between two of them pressure is taken to change
evenly with slip. An increment of slip Δs then dissipates µ (p before + p after)/2 |Δs|, or, summed
the other way round, each state acts over half the slip before it and half the slip after it:

    Σ_t (p_{t-1} + p_t)/2 |Δs_t| = Σ_t p_t (|Δs_t| + |Δs_{t+1}|)/2      (cycles are closed)

Taking the pressure at the end alone is of first order: 6 % too much on a dovetail of 22 increments,
where this leaves 0.3 %. Cells that part while others stay in contact work at half of their pressure
before over the slip of the increment, which is no more than that of the cells beside them
(:meth:`sa_solver.contact.FrictionalContact.advance`). Where bodies part altogether within an
increment nothing says how far they had slid by then: it counts for none.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from sa_solver.types import Array, Mask

EVERY = (slice(None),)
"""All increments are those of one closed cycle."""

STICKS = 1e-6
"""Slips below this share of the largest are what solvers leave where bodies stick."""

UNTOLD = 0.5
"""Share of the work whose errors no neighbour tells, above which those of all are not known."""


def before(values: Array, missions: Sequence[slice] = EVERY) -> Array:
    """Values ``(t, ...)`` of the state before each increment, that of a cycle's first its last."""
    return np.concatenate([np.roll(values[mission], 1, axis=0) for mission in missions])


def mean_of_ends(values: Array, missions: Sequence[slice] = EVERY) -> Array:
    """Mean of ``values`` ``(t, ...)`` before and after each increment."""
    mean: Array = 0.5 * (values + before(values, missions))
    return mean


def in_rows(values: Array, rows: Mask) -> Array:
    """``values`` ``(t, ...)`` in the ``rows`` ``(t,)`` that are marked, 0 in the others."""
    return np.where(rows.reshape(-1, *[1] * (values.ndim - 1)), values, 0.0)


def slip_of_states(slip: Array, loaded: Mask, missions: Sequence[slice] = EVERY) -> Array:
    """Slip ``(t, ...)`` over which each state acts, of the sizes ``slip`` of the increments' own.

    ``loaded`` ``(t,)`` says which increments end with the bodies in contact.
    """
    counts = in_rows(slip, loaded)
    after = np.concatenate([np.roll(counts[mission], -1, axis=0) for mission in missions])
    return np.asarray(0.5 * (counts + after))


def friction_work(
    limit: Array, slip: Array, loaded: Mask, missions: Sequence[slice] = EVERY
) -> Array:
    """Work ``(t, ...)`` of each increment in a ``slip`` ``(t, 2, ...)``; ``limit`` µp at its end.

    ``loaded`` as for :func:`slip_of_states`.
    """
    size = in_rows(np.hypot(slip[:, 0], slip[:, 1]), loaded)
    return mean_of_ends(limit, missions) * size


def dissipated(limit: Array, slip: Array) -> Array:
    """Work ``(..., 2, n)`` of friction along x and y in slips ``(..., 2, n)``.

    ``limit`` ``(..., n)`` is µ times the mean pressure or force of both ends; friction opposes it.
    """
    size = np.hypot(slip[..., 0, :], slip[..., 1, :])[..., None, :]
    work = limit[..., None, :] * slip**2
    return np.divide(work, size, out=np.zeros_like(work), where=size > 0.0)


def errors_of_increments(
    pressure: Array, slip: Array, loaded: Mask, missions: Sequence[slice] = EVERY
) -> Array | None:
    """Estimated errors ``(t, ...)`` of the terms of Σ (p_{t-1} + p_t)/2 |Δs_t|.

    ``slip`` ``(t, 2, ...)`` is that of the increments. What their terms are too large by, of three
    causes. Pressure over slip that bends: a third of what two increments along one way change when
    they are taken as one (Richardson), half in each. Slip that begins within an increment: a sixth
    of the change of pressure, the mean over all times at which it may. Bodies that part: half of
    what the pressure before would do over the slip that is left to close the cycle, but for that of
    the increment in which they meet again: worn ones have come some way apart by then.
    None where more than :data:`UNTOLD` of the work is done in increments that go on from slip, but
    next to which none goes along the same way: nothing then tells how pressure bends.
    """
    parts = [_errors(pressure[mission], slip[mission], loaded[mission]) for mission in missions]
    work = np.abs(friction_work(pressure, slip, loaded, missions))
    told = np.concatenate([known for _, known in parts])
    if np.sum(work[~told]) > UNTOLD * np.sum(work) or not told.any():
        return None
    return np.concatenate([errors for errors, _ in parts])


def depth_and_energy(work: Array, areas: Array | float = 1.0) -> Array:
    """Size ``(2,)`` of what ``work`` ``(n,)`` per area wears: root of squares, and the sum."""
    return np.array([np.sqrt(np.sum(areas * work**2)), abs(np.sum(areas * work))])


def _errors(pressure: Array, slip: Array, loaded: Mask) -> tuple[Array, Mask]:
    """The same of one cycle, and which are told: next to one along its way, or as slip begins."""
    slip = in_rows(slip, loaded)
    size, p_last = np.hypot(slip[:, 0], slip[:, 1]), np.roll(pressure, 1, axis=0)
    size_last, last = np.roll(size, 1, axis=0), np.roll(slip, 1, axis=0)
    rise = pressure - p_last
    slips = size > STICKS * size.max(initial=0.0)
    begins = slips & ~np.roll(slips, 1, axis=0)
    # Two increments along one way, and what they share if taken as one.
    pair = (np.sum(slip * last, axis=1) > 0.0) & slips & ~np.roll(begins, 1, axis=0)
    turned = 0.5 * (rise * size_last - np.roll(rise, 1, axis=0) * size)
    share, count = (
        values + np.roll(values, -1, axis=0)
        for values in (np.where(pair, turned / 6.0, 0.0), pair.astype(float))
    )
    bent = share / np.maximum(count, 1.0)
    begun = np.where(begins & (p_last > 0.0), -size * rise / 6.0, 0.0)
    meets = loaded & ~np.roll(loaded, 1)
    closing = np.linalg.norm(in_rows(slip, ~meets).sum(axis=0), axis=0)
    parted = in_rows(-0.5 * p_last * closing, ~loaded & np.roll(loaded, 1))
    return np.asarray(bent + begun + parted), (count > 0.0) | begins


def of_nearest(values: Array, where: Mask, pitch: tuple[float, float]) -> Array:
    """Return for each cell ``(nx, ny)`` the value of the nearest cell of ``where``.

    Of cells that are equally near it is the mean of those that a search from each of the four
    corners finds first: a field that is its own mirror image stays one.
    """
    from scipy.ndimage import distance_transform_edt  # takes a while to load, and is rarely wanted

    found = np.zeros_like(values)
    for ways in product((1, -1), repeat=2):
        view = tuple(slice(None, None, way) for way in ways)
        nearest = distance_transform_edt(
            ~where[view], sampling=pitch, return_distances=False, return_indices=True
        )
        found += 0.25 * values[view][tuple(nearest)][view]
    return found
