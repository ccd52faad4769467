"""Surfaces that move over each other within a cycle.

The grid goes with body 2, which carries the form of the contact. With body 2 at an offset s from
its mean position, the cell at x of the grid lies over the point x + s of body 1, whose surface is
kept in the frame of that mean position. Each state of a cycle acts from half an increment before
its place to half an increment after it (:mod:`sa_solver.cycles.increments`). On such a way,

    carried  c_i = Σ_k w_k f_{i+k}          deposited  d_{i+k} = Σ_i w_k p_i

the grid sees the mean c of body 1's field f along the path, and what wears at p on the grid is
spread over body 1 by the adjoint. The weights are those of cells that overlap, averaged over the
path: w_k = ∫₀¹ Λ(s_x/dx - k_x) Λ(s_y/dy - k_y) dt with the hat Λ(u) = max(0, 1 - |u|). They are 0
or more and their sum is 1, so that constants stay, nothing rises that only falls, and depositing
keeps volume. Between the places where the path passes into the next cell the integrand is a
quadratic of t, which two Gauss points integrate exactly.

To let each state act, ever less, as far as the states next to it would pass pressure on evenly, but
blurs twice as much: of a cylinder over 50 µm of a scar of 0.17 mm, 1, 2, 4 and 8 increments each
way leave 1.2, 0.7, 0.2 and 0.06 % of the depth of the flat, and would leave 3, 1.5, 0.5 and 0.13 %.
Its worn peak pressure needs more of them: 162, 121, 92 and 84 MPa with 2, 4, 8 and 16.

Cells blur what they carry. Against the motion they stand for, the second moment of the weights is
too large by dx²/6 for a long path, and for one of length L < 2 dx about its middle by L dx/4 -
L²/12: the blur is then more than the motion itself, L²/12, unless L > 3 dx/2. A shorter stroke is
therefore better taken for none (``LEAST_RESOLVED``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from sa_solver.errors import InputError
from sa_solver.ties import exceeds
from sa_solver.types import Array, Grid, Mask

LEAST_RESOLVED = 1.5
"""Strokes, in pitches, below which moving cells blur a surface more than the motion does."""

LARGE_STROKE = 0.1
"""Strokes, in widths of the contact, above which the motion counts: what neglecting it costs grows
with their square. Depth and volume (the sum of what is too much or too little) of either body of a
cylinder, worn from 0.2 to 1 mm of width by 8 increments a cycle, were wrong by 0.2 % to 0.9 % at
0.1, and by 0.5 % to 1.8 % at 0.15, with a quarter, half or three quarters of the wear on body 1;
those of a sphere, half and half, by 0.6 % to 0.8 %, by 1.3 % to 1.5 % and, at 0.2, by 2.2 % to
2.5 %. Where only one body wears it is less: nothing where that is body 2."""

GAUSS = 0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)
"""Gauss points of the unit interval, of weight one half."""


class TravelError(InputError):
    """What wears is carried beyond the grid."""


@dataclass(frozen=True)
class Passage:
    """Body 2 on its way along ``path`` ``(k, 2)`` [mm], straight from one offset to the next.

    Offsets (x, y) are those from its mean place. In a line contact motion along y changes nothing
    and is left out.
    """

    grid: Grid
    path: Array

    @cached_property
    def _weights(self) -> Array:
        """Weight w_k of each shift k in cells ``(2 m + 1, 2 n + 1)``, no shift in the middle.

        The mean over the path, by the length of its legs.
        """
        path = self.path / self.grid.pitch
        if self.grid.line:
            path[:, 1] = 0.0
        reach = np.floor(np.abs(path).max(axis=0)).astype(int) + 1
        lengths = np.hypot(*np.diff(path * self.grid.pitch, axis=0).T)
        shares = lengths / lengths.sum() if lengths.any() else np.ones_like(lengths) / len(lengths)
        weights = np.zeros(2 * reach + 1)
        for share, leg in zip(shares, pairwise(path), strict=True):
            _add_leg(weights, share, *leg)
        return weights

    def carry(self, field: Array) -> Array:
        """Body 1's ``field`` ``(nx, ny)`` as the grid sees it, the mean over the path.

        Beyond the grid it is taken for 0: nothing wears there.
        """
        return _weighted(field, self._weights)

    def deposit(self, field: Array) -> Array:
        """What lies on the grid, ``(nx, ny)``, spread over body 1: the adjoint of ``carry``.

        Raises TravelError where some of it would leave the grid.
        """
        self._check_room(field)
        return _weighted(field, self._weights[::-1, ::-1])

    def _check_room(self, field: Array) -> None:
        occupied = np.nonzero(field)
        if len(occupied[0]) == 0:
            return
        for axis, name in enumerate("xy"):
            shifts = np.nonzero(self._weights)[axis] - self._weights.shape[axis] // 2
            first, last = int(occupied[axis].min()), int(occupied[axis].max())
            beyond = max(-(first + shifts.min()), last + shifts.max() + 1 - field.shape[axis])
            if beyond > 0:
                raise TravelError(
                    f"the stroke carries wear {beyond} cells beyond the end of the grid along "
                    f"{name}: make the grid (contact.size) longer by "
                    f"{2 * beyond * self.grid.pitch[axis]:.3g} mm or more"
                )


def _add_leg(weights: Array, share: float, start: Array, end: Array) -> None:
    """Add the ``share`` of a path that leads straight from ``start`` to ``end`` [cells]."""
    reach = np.array(weights.shape) // 2
    times = _crossings(start, end)
    for begin, length in zip(times[:-1], np.diff(times), strict=True):
        for point in GAUSS:
            shift = start + (begin + point * length) * (end - start)
            # It lies over two cells along either axis, with these shares.
            cell = np.floor(shift).astype(int)
            (u, v), (i, j) = shift - cell, reach + cell
            shares = np.outer([1.0 - u, u], [1.0 - v, v])
            weights[i : i + 2, j : j + 2] += 0.5 * share * length * shares


def _weighted(field: Array, weights: Array) -> Array:
    """Sum of the ``field`` from as many cells away as each of ``weights`` is from their middle."""
    nx, ny = field.shape
    padded = np.pad(field, [(count // 2, count // 2) for count in weights.shape])
    total = np.zeros_like(field)
    for i, j in np.argwhere(weights):
        total += weights[i, j] * padded[i : i + nx, j : j + ny]
    return total


def _crossings(start: Array, end: Array) -> Array:
    """Times from 0 to 1 at which a path passes into another cell, ends included."""
    times = [0.0, 1.0]
    for begin, stop in zip(start, end, strict=True):
        low, high = min(begin, stop), max(begin, stop)
        borders = np.arange(np.floor(low) + 1.0, np.ceil(high))
        times += ((borders - begin) / (stop - begin)).tolist() if len(borders) else []
    return np.unique(np.clip(times, 0.0, 1.0))


def offsets(slip: Array, weight: Array) -> Array:
    """Offsets ``(t + 1, 2)`` [mm] of body 2 before the first and after each increment of a cycle.

    The motion is the mean of ``slip`` ``(t, 2, nx, ny)`` [mm] weighted by ``weight`` ``(nx, ny)``,
    such as the pressure of the cycle, or ``(t, nx, ny)`` where slip is not known of all cells in
    each increment, and counts from the middle between its extremes. A closed cycle comes back to
    where it began; what is missing is spread evenly over its increments.
    """
    weight = np.broadcast_to(weight, (len(slip), *slip.shape[2:]))
    total = weight.sum(axis=(1, 2))[:, None]
    steps = np.einsum("tcij,tij->tc", slip, weight) / np.where(total > 0.0, total, 1.0)
    path = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    path -= np.linspace(0.0, 1.0, len(path))[:, None] * path[-1]
    middle: Array = 0.5 * (path.max(axis=0) + path.min(axis=0))
    return path - middle


def moves(path: Array, pressed: Mask, grid: Grid) -> bool:
    """Whether the motion along ``path`` ``(t + 1, 2)`` [mm] counts, and the grid can follow it.

    The stroke is held against the extent of the cells ``pressed`` ``(nx, ny)`` along it.
    """
    if grid.line:
        path = path * [1.0, 0.0]
    stroke, (x, y) = stroke_of(path)
    along = np.broadcast_to(grid.x * x + grid.y * y, grid.shape)[pressed]
    pitch = float(np.hypot(grid.pitch[0] * x, grid.pitch[1] * y))
    if exceeds(LEAST_RESOLVED * pitch, stroke) or not len(along):
        return False
    width = np.ptp(along) + abs(grid.pitch[0] * x) + abs(grid.pitch[1] * y)
    return exceeds(stroke, LARGE_STROKE * float(width))


def followed(
    grid: Grid,
    slip: Array,
    pressure: Array,
    missions: Sequence[slice] = (slice(None),),
    forced: bool | None = None,
    known: Mask | None = None,
) -> Array:
    """Paths of body 2 over which each state of a cycle acts ``(t, 3, 2)`` [mm], if they count.

    From half way before its offset over that to half way after; ``(0, 3, 2)`` where the motion does
    not count. ``slip`` ``(t, 2, nx, ny)`` [mm] is that of the increments and ``pressure``
    ``(nx, ny)`` that of the whole cycle, see :func:`offsets`; ``missions`` are the increments of
    each closed cycle of a mix. Motion that counts in one (:func:`moves`) is followed in all;
    ``forced`` says instead whether to follow it. ``known`` ``(t, nx, ny)`` are the cells whose slip
    each increment knows; None: all.
    """
    weight = np.broadcast_to(pressure, (len(slip), *pressure.shape))
    if known is not None:
        weight = weight * known
    paths = [offsets(slip[mission], weight[mission]) for mission in missions]
    if forced is None:
        forced = any(moves(path, pressure > 0.0, grid) for path in paths)
    if not forced:
        return np.empty((0, 3, 2))
    return np.concatenate([ways_of_states(path) for path in paths])


def ways_of_states(path: Array) -> Array:
    """Ways over which the states at the offsets of a closed ``path`` ``(t + 1, 2)`` [mm] act.

    ``(t, 3, 2)``: from half way before each over it to half way after it.
    """
    middles = 0.5 * (path[1:] + path[:-1])
    return np.stack([middles, path[1:], np.roll(middles, -1, axis=0)], axis=1)


def passages(grid: Grid, paths: Array) -> tuple[Passage, ...] | None:
    """The passages along ``paths`` ``(t, k, 2)`` [mm]; None where there are none."""
    if not len(paths):
        return None
    return tuple(Passage(grid, path) for path in paths)


def stroke_of(path: Array) -> tuple[float, Array]:
    """Longest distance of two offsets of ``path`` ``(t + 1, 2)`` [mm], and its direction (2,)."""
    apart = path[:, None] - path[None]
    lengths = np.hypot(apart[..., 0], apart[..., 1])
    longest = np.unravel_index(int(lengths.argmax()), lengths.shape)
    stroke = float(lengths[longest])
    return stroke, apart[longest] / stroke if stroke > 0.0 else np.array([1.0, 0.0])
