"""A loading history: the increments of a frictional contact, all of them or only those that count.

Friction remembers, so in general every increment is solved from the one before (``full``). Where
the bodies are alike and pressure stays while the shear load moves back and forth along one line,
the contact remembers only the turning points of the load, and legs are taken in one step
(``reversals``): exact for line contacts and for ν = 0, where slip keeps its direction during a leg,
and measured otherwise. A shear force that only grows is one leg; in a line contact two normal
problems give its end (``ciavarella_jaeger``: :mod:`sa_solver.ciavarella_jaeger`).

Source: Spinu & Frunza 2015, J. Phys. Conf. Ser. (reversals).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from sa_solver.contact import ContactLoad, ContactState, FrictionalContact
from sa_solver.errors import InputError
from sa_solver.half_space import HalfSpace
from sa_solver.rigid_modes import NORMAL, PLANAR
from sa_solver.types import Array

Method = Literal["full", "reversals", "ciavarella_jaeger"]
Progress = Callable[[int, ContactState], None]

STRAIGHT = 1e-9
"""How far two increments of the shear load may be from parallel: rounding of a straight leg."""


class HistoryError(InputError):
    """The method asked for does not suffice for the load path."""


@dataclass(frozen=True)
class ContactLoadPath:
    """Loads at the ends of n increments, from bodies apart.

    ``values`` ``(n, 6)``, ``motion`` (6,) and ``strain`` ``(n,)`` as in
    :class:`~sa_solver.contact.ContactLoad`; ``energy`` ``(n, 2)`` or None.
    """

    values: Array
    motion: tuple[bool, ...] = (False,) * 6
    strain: Array | None = None
    energy: Array | None = None

    def __len__(self) -> int:
        return len(self.values)

    def load(self, row: int) -> ContactLoad:
        """The load at the end of increment ``row``."""
        strain = 0.0 if self.strain is None else float(self.strain[row])
        energy = None if self.energy is None else self.energy[row]
        return ContactLoad(self.values[row], self.motion, strain, energy)

    @property
    def shear(self) -> Array:
        """Shear load and mismatch strain, ``(n, 4)``: Qx, Qy, Mz (or their motions), strain."""
        strain = np.zeros(len(self)) if self.strain is None else self.strain
        return np.column_stack([self.values[:, list(PLANAR)], strain])


@dataclass(frozen=True)
class History:
    """The increments solved: ``states`` at the rows ``indices`` of the path.

    ``method`` is what was taken and ``reason`` why. ``error`` is the measured error of the last
    shear over the largest µp, by what ``error_of`` says; None where none was asked for or the
    method is exact.
    """

    states: list[ContactState]
    indices: list[int]
    method: Method
    reason: str
    error: float | None = None
    error_of: str = ""


def march_history(
    half_space: HalfSpace,
    height: Array,
    path: ContactLoadPath,
    friction: float,
    *,
    history: Literal["auto", "full", "reversals"] = "auto",
    tolerance: float = 1e-8,
    estimate_error: bool = False,
    progress: Progress = lambda row, state: None,
) -> History:
    """Solve a history on surfaces that do not wear.

    ``height`` ``(nx, ny)`` [mm] is the gap of the unloaded bodies. ``history`` ``auto`` takes the
    cheapest method that suffices; ``reversals`` raises HistoryError where legs cannot be taken in
    one step. ``estimate_error`` adds a coarser full march, half as long (none where the load turns
    back at every increment). An increment that has not converged ends the march: it is the last
    state. ``progress`` is called with each row and its state.

    Raises what :meth:`FrictionalContact.advance` raises.
    """
    contact = FrictionalContact(half_space, friction, tolerance)
    obstacle = _obstacle_to_legs(half_space, path)
    if history == "reversals" and obstacle:
        raise HistoryError(f"legs cannot be taken in one step, {obstacle}: use full or auto")
    if not obstacle and history == "auto" and not _proportional(path.shear):
        obstacle = "the shear load changes direction"
    if history == "full" or (obstacle and history == "auto"):
        reason = obstacle or "asked for"
        return _full(contact, height, path, reason, estimate_error, progress)
    return _reversals(contact, height, path, progress)


def turning_points(path: ContactLoadPath) -> list[int]:
    """Rows where a load, normal or shear, is about to begin or to leave its direction; the last."""
    changes = _changes(np.column_stack([path.values[:, list(NORMAL)], path.shear]))
    rows = [row for row, pair in enumerate(pairwise(changes)) if _turns(*pair)]
    return [*rows, len(path) - 1]


def _obstacle_to_legs(half_space: HalfSpace, path: ContactLoadPath) -> str:
    """Why a leg of the shear load may not be taken in one step; empty if it may."""
    if not half_space.pair.similar:
        return "the bodies are dissimilar"
    if path.energy is not None:
        return "sliding is given by its energy"
    sheared = np.flatnonzero(path.shear.any(axis=1))
    # The row before the shear begins has the pressure that must stay.
    pressed = path.values[max(sheared[0] - 1, 0) if len(sheared) else -1 :, list(NORMAL)]
    if np.any(pressed != pressed[0]):
        return "the normal load changes while shear is on"
    return ""


def _changes(loads: Array) -> Array:
    """Changes of loads ``(n, k)`` in each increment, ``(n, k)``, by the largest of each kind."""
    scale = np.abs(loads).max(axis=0)
    changes: Array = np.diff(loads, axis=0, prepend=np.zeros((1, loads.shape[1])))
    return changes / np.where(scale > 0.0, scale, 1.0)


def _turns(change: Array, following: Array) -> bool:
    """Whether the next increment leaves the direction of this one."""
    if not following.any():
        return False
    along = float(change @ following)
    lengths = float(np.linalg.norm(change) * np.linalg.norm(following))
    return along <= lengths * (1.0 - STRAIGHT)


def _proportional(shear: Array) -> bool:
    """Whether all changes of the shear load are along one line."""
    singular = np.linalg.svd(_changes(shear), compute_uv=False)
    return bool(len(singular) < 2 or singular[1] <= STRAIGHT * singular[0])


def _solve(
    contact: FrictionalContact,
    height: Array,
    path: ContactLoadPath,
    rows: list[int],
    progress: Progress = lambda row, state: None,
) -> list[ContactState]:
    """States at the given rows; ends with the first that has not converged."""
    states, state = [], contact.apart(height)
    for row in rows:
        state = contact.advance(state, height, path.load(row))
        states.append(state)
        progress(row, state)
        if not state.converged:
            break
    return states


def _full(
    contact: FrictionalContact,
    height: Array,
    path: ContactLoadPath,
    reason: str,
    estimate_error: bool,
    progress: Progress,
) -> History:
    rows = list(range(len(path)))
    states = _solve(contact, height, path, rows, progress)
    history = History(states, rows[: len(states)], "full", reason)
    if not (estimate_error and states[-1].converged):
        return history
    half = _every_second(path)
    coarse = _solve(contact, height, path, half) if len(half) < len(rows) else []
    if not (coarse and coarse[-1].converged):
        return history
    # Backward Euler: with twice the steps the error halves, so the difference is the finer's error.
    error = _shear_difference(contact, states[-1], coarse[-1])
    return replace(history, error=error, error_of="the same path with half the increments")


def _reversals(
    contact: FrictionalContact,
    height: Array,
    path: ContactLoadPath,
    progress: Progress,
) -> History:
    rows = turning_points(path)
    states = _solve(contact, height, path, rows, progress)
    reason = "similar bodies, pressure constant while the shear load turns"
    method: Method = "ciavarella_jaeger" if _one_leg(contact, states, path, rows) else "reversals"
    history = History(states, rows[: len(states)], method, reason)
    alike = contact.grid.line or contact.half_space.pair.poisson == 0.0
    exact = alike and _proportional(path.shear)
    if exact or len(states) < 2 or not states[-1].converged:
        return history
    halved = _with_midpoint(path, rows[-2], rows[-1])
    middle = contact.advance(states[-2], height, halved)
    end = contact.advance(middle, height, path.load(rows[-1]))
    if not end.converged:
        return history
    # One step against two: the error of the one is about twice the difference.
    error = 2.0 * _shear_difference(contact, states[-1], end)
    return replace(history, error=error, error_of="the last leg in two steps")


def _one_leg(
    contact: FrictionalContact, states: list[ContactState], path: ContactLoadPath, rows: list[int]
) -> bool:
    """Whether the last leg is the first loading of a line contact."""
    begun = len(states) == len(rows) > 1
    return begun and contact.two_normal_problems(states[-2], path.load(rows[-1]))


def _with_midpoint(path: ContactLoadPath, first: int, last: int) -> ContactLoad:
    """The load half way along a leg."""
    begin, end = path.load(first), path.load(last)
    return ContactLoad(
        0.5 * (begin.values + end.values), path.motion, 0.5 * (begin.strain + end.strain)
    )


def _every_second(path: ContactLoadPath) -> list[int]:
    """Every second row, with the last and those where the shear load turns back kept.

    There it goes sideways or back, rather than on along a curve.
    """
    changes = _changes(path.shear)
    pairs = enumerate(pairwise(changes))
    back = {row for row, (now, then) in pairs if then.any() and now @ then <= 0.0}
    return sorted({*range(1, len(path), 2), *back, len(path) - 1})


def _shear_difference(contact: FrictionalContact, one: ContactState, other: ContactState) -> float:
    """Largest difference of shear over the largest µp."""
    limit = contact.friction * float(one.pressure.max())
    if limit <= 0.0:
        return 0.0
    return float(np.abs(one.shear - other.shear).max()) / limit
