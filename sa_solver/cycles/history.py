"""A loading history: the increments of a frictional contact, all of them or only those that count.

Friction remembers, so in general every increment is solved from the one before (``full``), to
first order in its length: unlike bodies pressed in one increment stick over half the radius that a
growing load leaves (Spence 1968, Proc. R. Soc. A 305, 55). Such increments are split until little
error is left. Where the bodies are alike and pressure stays while the shear load moves back and
forth along one line, the contact remembers only the turning points of the load, and legs are taken
in one step (``reversals``): exact for line contacts and for ν = 0, where slip keeps its direction
during a leg, and measured otherwise. A shear force that only grows is one leg; in a line contact
two normal problems give its end (``ciavarella_jaeger``:
:mod:`sa_solver.tangential.ciavarella_jaeger`).

Source: Spinu & Frunza 2015, J. Phys. Conf. Ser. (reversals).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import ceil, inf
from typing import Literal

import numpy as np

from sa_solver import checks
from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad, ContactState
from sa_solver.errors import InputError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.rigid_modes import NORMAL, PLANAR
from sa_solver.types import Array

Method = Literal["full", "reversals", "ciavarella_jaeger"]
Progress = Callable[[int, ContactState, float], None]
"""Told the row of a path, the state that it has got to, and how much of the whole is behind."""

STRAIGHT = 1e-9
"""How far two increments of the shear load may be from parallel: rounding of a straight leg."""

ACCURACY = 0.02
"""Default bound on the error of increments: it leaves 0.02 of c/a of pressed unlike bodies."""

MOST_INCREMENTS = 256
"""So many are chosen for a path, or twice its own where these are more than half as many. In one
leg 9 to 15 keep 2 %; more is for who asks for it."""

USUAL_PARTS = 10
"""About so many increments of a path that must be split are mostly enough: to say what is to
come."""

PARTS_OF_LEGS = 4
"""Two halves of a leg differ little from the whole: they tell a sixth of its error, these half."""

NO_ENERGY = 1e-3
"""Share of the work of the shear loads below which energies are none: what sticks by all rules."""

IN_PARTS = "the same path, its increments in parts:"


class HistoryError(InputError):
    """The method asked for does not suffice for the load path."""


@dataclass(frozen=True)
class ContactLoadPath:
    """Loads at the ends of n increments, from bodies apart.

    ``values`` ``(n, 6)``, ``motion`` (6,) and ``strain`` ``(n,)`` as in
    :class:`~sa_solver.contact_state.ContactLoad`; ``energy`` ``(n, 2)`` or None. Moments of 0 let
    the bodies turn: to hold their tilt, take (False, False, False, True, True, False) for
    ``motion``.

    Examples
    --------
    Pressed with 100 N/mm, sheared and sheared back:

    >>> import numpy as np
    >>> from sa_solver import ContactLoadPath
    >>> values = np.zeros((3, 6))
    >>> values[:, 0], values[:, 1] = 100.0, [0.0, 30.0, -30.0]
    >>> path = ContactLoadPath(values)
    >>> print(len(path), path.load(2, share=0.5).values[:2])
    3 [100.   0.]
    """

    values: Array
    motion: tuple[bool, ...] = (False,) * 6
    strain: Array | None = None
    energy: Array | None = None

    def __post_init__(self) -> None:
        values = checks.array("values of a load path", self.values, (None, 6), finite=False)
        checks.settle(self, values=values)
        if not len(values) or np.shape(self.motion) != (6,):
            raise InputError("a load path needs one increment or more, and six switches")
        for name, shape in (("strain", (len(values),)), ("energy", (len(values), 2))):
            column = getattr(self, name)
            if column is not None:
                column = checks.array(f"values of {name}", column, shape, finite=False)
                checks.settle(self, **{name: column})

    def __len__(self) -> int:
        return len(self.values)

    def load(self, row: int, share: float = 1.0) -> ContactLoad:
        """The load after that share of increment ``row``, passed in a straight line."""

        def reached(column: Array) -> Array:
            before = column[row - 1] if row else np.zeros_like(column[0])
            return np.asarray((1.0 - share) * before + share * column[row])

        strain = 0.0 if self.strain is None else float(reached(self.strain))
        energy = None if self.energy is None else self.energy[row]
        return ContactLoad(reached(self.values), self.motion, strain, energy)

    def at(self, rows: list[int]) -> ContactLoadPath:
        """The path that leads straight to each of these rows."""
        strain = None if self.strain is None else self.strain[rows]
        energy = None if self.energy is None else self.energy[rows]
        return ContactLoadPath(self.values[rows], self.motion, strain, energy)

    @property
    def shear(self) -> Array:
        """Shear load and mismatch strain, ``(n, 4)``: Qx, Qy, Mz (or their motions), strain."""
        strain = np.zeros(len(self)) if self.strain is None else self.strain
        return np.column_stack([self.values[:, list(PLANAR)], strain])


@dataclass(frozen=True)
class History:
    """The increments solved: ``states`` at the rows ``indices`` of the path.

    ``method`` is what was taken and ``reason`` why, every increment in so many ``parts``. ``error``
    is the measured error of the shear, summed over all cells, over the largest µP of the path, by
    what ``error_of`` says, and largest at row ``error_at``; ``energy_error`` that of the energy of
    all rows, relative; both None where increments do not matter. Then ``others`` are the states at
    the same rows, by another number of parts, and any result of ``states`` has an estimated error
    of ``share`` times what it differs from theirs.
    """

    states: list[ContactState]
    indices: list[int]
    method: Method
    reason: str
    parts: int = 1
    error: float | None = None
    error_of: str = ""
    error_at: int = 0
    energy_error: float | None = None
    others: list[ContactState] = field(default_factory=list)
    share: float = 0.0


def march_history(
    half_space: HalfSpace,
    height: Array,
    path: ContactLoadPath,
    friction: float,
    *,
    history: Literal["auto", "full", "reversals"] = "auto",
    accuracy: float = ACCURACY,
    tolerance: float = 1e-8,
    progress: Progress = lambda row, state, share: None,
) -> History:
    """Solve a history on surfaces that do not wear.

    ``height`` ``(nx, ny)`` [mm] is the gap of the unloaded bodies. ``history`` ``auto`` takes the
    cheapest method that suffices, and splits increments that matter until shear and energy are
    within ``accuracy``; ``full`` takes those of the path, and estimates what they leave;
    ``reversals`` raises HistoryError where legs cannot be taken in one step. An increment that has
    not converged ends the march: it is the last state. ``progress`` is called with each row, its
    state and about what share of the work is done; anew when increments are split.

    Raises what :meth:`FrictionalContact.advance` raises.

    Examples
    --------
    A cylinder sheared to and fro. Alike bodies remember the turning points only, and only these
    are solved:

    >>> import numpy as np
    >>> from sa_solver import ContactLoadPath, ElasticPair, Grid, HalfSpace, Material, march_history
    >>> from sa_solver.reference.hertz import HertzCylinder
    >>> from sa_solver.reference.line_partial_slip import ShearedCylinder
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.strips(1.0, 128)
    >>> half_space = HalfSpace(grid, ElasticPair(steel, steel))
    >>> hertz = HertzCylinder(200.0, 50.0, half_space.pair.contact_modulus)
    >>> values = np.zeros((31, 6))
    >>> values[:, 0] = 200.0
    >>> values[1:, 1] = np.append(np.linspace(6, 60, 10), np.linspace(54, -60, 20))
    >>> path = ContactLoadPath(values)
    >>> history = march_history(half_space, hertz.gap(grid.x), path, friction=0.5)
    >>> print(history.method, history.indices)
    reversals [0, 10, 30]
    >>> exact = ShearedCylinder(hertz, 0.5).shear_after(grid.x, [60.0, -60.0])
    >>> error = np.abs(history.states[-1].shear[0] - exact).max()
    >>> print(f"{error:.1f} of {np.abs(exact).max():.1f} MPa")
    2.8 of 146.2 MPa
    """
    contact = FrictionalContact(half_space, friction, tolerance)
    checks.choice("history", history, ("auto", "full", "reversals"), HistoryError)
    accuracy = checks.number("accuracy", accuracy, above=0.0, error=HistoryError)
    obstacle = _obstacle_to_legs(half_space, path)
    if history == "reversals" and obstacle:
        raise HistoryError(f"legs cannot be taken in one step, {obstacle}: use full or auto")
    if not obstacle and history != "reversals" and not _proportional(path.shear):
        obstacle = "the shear load changes direction"

    march = _Marches(contact, height, path, progress)
    if history == "full":
        return _as_given(contact, march, "asked for", 2 if obstacle else 1)
    if obstacle and history == "auto":
        most = max(2, MOST_INCREMENTS // len(path))
        return _split(contact, march, obstacle, accuracy, most)
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
    # The row before the shear begins, or the bodies apart, has the pressure that must stay.
    normal = np.vstack([np.zeros(len(NORMAL)), path.values[:, list(NORMAL)]])
    pressed = normal[sheared[0] if len(sheared) else -1 :]
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


class _Marches:
    """Marches over one path, in ever more parts, and how much of their work is done."""

    def __init__(
        self, contact: FrictionalContact, height: Array, path: ContactLoadPath, progress: Progress
    ) -> None:
        self._contact, self._height, self._path = contact, height, path
        self._progress, self._solved, self.rows = progress, 0, len(path)

    def __call__(self, parts: int, ahead: int = 0) -> list[ContactState]:
        """States at all rows; marches in ``ahead`` parts are expected after this one."""
        solved = self._solved
        whole = solved + self.rows * (parts + ahead)

        def passed_row(row: int, state: ContactState) -> None:
            self._solved = solved + (row + 1) * parts
            self._progress(row, state, self._solved / whole)

        return _march(self._contact, self._height, self._path, parts, passed_row)


def _march(
    contact: FrictionalContact,
    height: Array,
    path: ContactLoadPath,
    parts: int,
    passed_row: Callable[[int, ContactState], None],
) -> list[ContactState]:
    """States at all rows, each increment passed in ``parts``; ends where one has not converged."""
    states, state = [], contact.apart(height)
    for row in range(len(path)):
        passed = []
        for part in range(1, parts + 1):
            load = path.load(row, part / parts)
            if load.energy is not None:
                load = replace(load, energy=load.energy / parts)
            state = contact.advance(state, height, load)
            passed.append(state)
            if not state.converged:
                break
        states.append(
            replace(
                state,
                slip=np.sum([part.slip for part in passed], axis=0),
                energy=np.sum([part.energy for part in passed], axis=0),
                residual=max(part.residual for part in passed),
                convolutions=sum(part.convolutions for part in passed),
            )
        )
        passed_row(row, states[-1])
        if not state.converged:
            break
    return states


def _as_given(contact: FrictionalContact, march: _Marches, reason: str, parts: int) -> History:
    """The increments of the path, with their error by as many ``parts``; none if that is 1."""
    history = _history(march(1, parts if parts > 1 else 0), reason)
    if parts == 1 or not history.states[-1].converged:
        return history
    finer = march(parts)
    if not finer[-1].converged:
        return history
    # Backward Euler is of first order: the parts leave their share of the error.
    return _estimated(contact, history, finer, parts / (parts - 1), parts)


def _split(
    contact: FrictionalContact, march: _Marches, reason: str, accuracy: float, most: int
) -> History:
    """The increments in as many parts as keep ``accuracy``, or in up to ``most``."""
    more = USUAL_PARTS // march.rows
    history, error = _history(march(1, 2 + more), reason), inf
    while history.states[-1].converged and error > accuracy and 2 * history.parts <= most:
        parts = history.parts
        # Energy converges faster where pressure changes, after a first error that tells little.
        wanted = 2 if parts == 1 else ceil(parts * (history.error or 0.0) / accuracy)
        finer = min(most, max(2 * parts, wanted))
        ahead = more if parts == 1 else 0
        coarse, history = history.states, _history(march(finer, ahead), reason, finer)
        if not history.states[-1].converged:
            break
        # First order: errors are as lengths, and the change is their difference.
        history = _estimated(contact, history, coarse, parts / (finer - parts), parts)
        error = max(history.error or 0.0, history.energy_error or 0.0)
    return history


def _estimated(
    contact: FrictionalContact,
    history: History,
    others: list[ContactState],
    share: float,
    parts: int,
) -> History:
    """The history with its errors, ``share`` of what it differs from ``others`` in ``parts``."""
    change, row = _shear_difference(contact, history.states, others)
    return replace(
        history,
        error=share * change,
        error_of=f"{IN_PARTS} {parts}",
        error_at=row,
        energy_error=share * _energy_difference(history.states, others),
        others=others,
        share=share,
    )


def _history(states: list[ContactState], reason: str, parts: int = 1) -> History:
    return History(states, list(range(len(states))), "full", reason, parts)


def _reversals(
    contact: FrictionalContact,
    height: Array,
    path: ContactLoadPath,
    progress: Progress,
) -> History:
    rows = turning_points(path)
    legs = path.at(rows)

    march = _Marches(
        contact, height, legs, lambda leg, state, share: progress(rows[leg], state, share)
    )
    alike = contact.grid.line or contact.half_space.pair.poisson == 0.0
    exact = alike and _proportional(path.shear)
    reason = "similar bodies, pressure constant while the shear load turns"
    parts = 1 if exact or len(rows) == 1 else PARTS_OF_LEGS
    history = _as_given(contact, march, reason, parts)
    states = history.states
    method: Method = "ciavarella_jaeger" if _one_leg(contact, states, legs) else "reversals"
    indices = rows[: len(states)]
    return replace(history, indices=indices, method=method, error_at=rows[history.error_at])


def _one_leg(contact: FrictionalContact, states: list[ContactState], legs: ContactLoadPath) -> bool:
    """Whether the last leg is the first loading of a line contact."""
    begun = len(states) == len(legs) > 1
    return begun and contact.two_normal_problems(states[-2], legs.load(len(legs) - 1))


def _energy_difference(ones: list[ContactState], others: list[ContactState]) -> float:
    """Difference of the energies of all rows, relative, rows that cancel added by their sizes."""
    found, known = (np.array([state.energy.sum() for state in states]) for states in (ones, others))
    planar = list(PLANAR)
    forces, motions = (
        np.array([getattr(state, name)[planar] for state in ones])
        for name in ("resultants", "rigid")
    )
    worked = np.abs(np.sum(forces * np.diff(motions, axis=0, prepend=0.0), axis=1)).sum()
    scale = max(float(found.sum()), NO_ENERGY * float(worked))
    return float(np.abs(found - known).sum()) / scale if scale > 0.0 else 0.0


def _shear_difference(
    contact: FrictionalContact, ones: list[ContactState], others: list[ContactState]
) -> tuple[float, int]:
    """Largest difference of shear, summed over all cells, over the largest µP; and its place."""
    pairs = zip(ones, others, strict=True)
    apart = [float(np.hypot(*(one.shear - other.shear)).sum()) for one, other in pairs]
    limit = contact.friction * max(float(state.pressure.sum()) for state in ones)
    worst = int(np.argmax(apart))
    return (apart[worst] / limit if limit > 0.0 else 0.0), worst
