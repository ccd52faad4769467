"""Loading history of a frictional contact: all increments, or only the turning points of the load.

Friction depends on the path, so that in general every increment is solved from the one before
(``full``). This is of first order in the length of the increments: dissimilar bodies pressed in one
increment stick over half the radius that results from a growing load (Spence 1968, Proc. R. Soc. A
305, 55). Such increments are split until the error is small.

Where the bodies are similar and the pressure is constant while the shear load moves back and forth
along one line, the contact remembers only the turning points of the load, and each leg between them
is taken in one step (``reversals``). This is exact for line contacts and for ν = 0, where slip
keeps its direction during a leg; otherwise the error is measured. A shear force that only grows is
a single leg. In a line contact its end follows from two normal problems (``ciavarella_jaeger``:
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
from sa_solver.contact import FrictionalContact, FrictionFactor
from sa_solver.contact_state import ContactLoad, ContactState
from sa_solver.errors import InputError
from sa_solver.half_space.operator import HalfSpace
from sa_solver.rigid_modes import NORMAL, PLANAR
from sa_solver.types import Array

Method = Literal["full", "reversals", "ciavarella_jaeger"]
Progress = Callable[[int, ContactState, float], None]
"""Callback that receives the row of a path, the state at its end, and the share of the work done.
"""

STRAIGHT = 1e-9
"""Deviation from parallel of two increments of a straight leg, due to rounding."""

ACCURACY = 0.02
"""Default bound on the error of increments: c/a of pressed dissimilar bodies is then within 0.02.
"""

MOST_INCREMENTS = 256
"""Most increments into which a path is split automatically, or twice the number of its own
increments if these are more than half as many. 9 to 15 increments per leg give 2 %."""

USUAL_PARTS = 10
"""Usual number of increments of a path that must be split, to predict the remaining work."""

PARTS_OF_LEGS = 4
"""Parts of a leg for its error estimate. Two halves differ little from the whole leg and show only
a sixth of its error; four parts show half of it."""

NO_ENERGY = 1e-3
"""Share of the work of the shear loads to which errors of the energy are relative at least: where
bodies stick, the energy is 0."""

IN_PARTS = "the same path, its increments in parts:"


class HistoryError(InputError):
    """Invalid method for a load path."""


@dataclass(frozen=True)
class ContactLoadPath:
    """Loads at the ends of n increments, starting from bodies that are apart.

    ``values`` ``(n, 6)``, ``motion`` (6,), ``strain`` ``(n,)`` and ``energy`` ``(n, 2)`` are those
    of :class:`~sa_solver.contact_state.ContactLoad`. Moments of 0 let the bodies turn. To hold
    their tilt, set ``motion`` to (False, False, False, True, True, False).

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
            raise InputError(
                "a load path needs at least one increment, and motion needs six truth values"
            )
        for name, shape in (("strain", (len(values),)), ("energy", (len(values), 2))):
            column = getattr(self, name)
            if column is not None:
                column = checks.array(f"values of {name}", column, shape, finite=False)
                checks.settle(self, **{name: column})

    def __len__(self) -> int:
        return len(self.values)

    def load(self, row: int, share: float = 1.0) -> ContactLoad:
        """Return the load after a ``share`` of increment ``row``, by linear interpolation."""

        def reached(column: Array) -> Array:
            before = column[row - 1] if row else np.zeros_like(column[0])
            return np.asarray((1.0 - share) * before + share * column[row])

        strain = 0.0 if self.strain is None else float(reached(self.strain))
        energy = None if self.energy is None else self.energy[row]
        return ContactLoad(reached(self.values), self.motion, strain, energy)

    def at(self, rows: list[int]) -> ContactLoadPath:
        """Return the path that leads directly from one of these ``rows`` to the next."""
        strain = None if self.strain is None else self.strain[rows]
        energy = None if self.energy is None else self.energy[rows]
        return ContactLoadPath(self.values[rows], self.motion, strain, energy)

    @property
    def shear(self) -> Array:
        """Shear load Qx, Qy, Mz (or their motions) and mismatch strain ``(n, 4)``."""
        strain = np.zeros(len(self)) if self.strain is None else self.strain
        return np.column_stack([self.values[:, list(PLANAR)], strain])


@dataclass(frozen=True)
class History:
    """Solved increments of a load path, with error estimates.

    Attributes
    ----------
    states
        States at the rows ``indices`` of the path.
    indices
        Rows of the path that were solved.
    method, reason
        Method that was used, and why.
    parts
        Number of parts into which every increment was split.
    error
        Estimated error of the shear, summed over all cells, over the largest µP of the path. It is
        None where the size of the increments does not matter.
    error_of
        Description of the calculation with which the history was compared.
    error_at
        Row of the path with the largest error.
    energy_error
        Estimated relative error of the energies of all rows, or None.
    others
        States at the same rows with another number of parts.
    share
        Ratio of the error of any result of ``states`` to its difference from that of ``others``.
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
    hardness: float | None = None,
    factor: FrictionFactor | None = None,
    progress: Progress = lambda row, state, share: None,
) -> History:
    """Solve a loading history on surfaces that do not wear.

    The march ends at an increment that has not converged, which is then the last state.

    Parameters
    ----------
    half_space
        Half-space of the two bodies.
    height
        Gap of the unloaded bodies ``(nx, ny)`` [mm].
    path
        Loads at the ends of the increments.
    friction
        Coefficient of friction µ.
    history
        Method. ``auto`` uses the cheapest valid method and splits increments until shear and energy
        are within ``accuracy``. ``full`` solves the increments of the path and estimates their
        error. ``reversals`` solves only the turning points of the load.
    accuracy
        Bound on the errors of shear and energy due to increments.
    tolerance
        Tolerance of the contact problems.
    hardness
        Largest pressure [MPa] before similar bodies yield: :mod:`sa_solver.normal.hardness`.
    factor
        Factor of µ as a function of the pressure, for similar bodies: :class:`FrictionalContact`.
    progress
        Callback that receives the row, its state and the approximate share of the work done; rows
        are repeated when increments are split.

    Raises
    ------
    HistoryError
        If ``reversals`` is not valid for the path. The exceptions of
        :meth:`FrictionalContact.advance` may be raised as well.

    Examples
    --------
    A cylinder sheared back and forth. Similar bodies remember only the turning points, so that only
    these are solved:

    >>> import numpy as np
    >>> from sa_solver import ContactLoadPath, ElasticPair, Grid, HalfSpace, Material, march_history
    >>> from sa_solver.reference.hertz import HertzCylinder
    >>> from sa_solver.reference.line_partial_slip import ShearedCylinder
    >>> steel, grid = Material(young=210e3, poisson=0.3), Grid.line_contact(1.0, 128)
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
    contact = FrictionalContact(half_space, friction, tolerance, hardness=hardness, factor=factor)
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
    """Return the last row and those after which a load, normal or shear, changes its direction.

    A load that begins after a row counts as well.
    """
    changes = _changes(np.column_stack([path.values[:, list(NORMAL)], path.shear]))
    rows = [row for row, pair in enumerate(pairwise(changes)) if _turns(*pair)]
    return [*rows, len(path) - 1]


def _obstacle_to_legs(half_space: HalfSpace, path: ContactLoadPath) -> str:
    """Return why a leg of the shear load may not be taken in one step, or an empty text."""
    if not half_space.pair.similar:
        return "the bodies are dissimilar"
    if path.energy is not None:
        return "sliding is given by its energy"
    sheared = np.flatnonzero(path.shear.any(axis=1))
    # The pressure must not change from the row before the shear begins, or from bodies apart.
    normal = np.vstack([np.zeros(len(NORMAL)), path.values[:, list(NORMAL)]])
    pressed = normal[sheared[0] if len(sheared) else -1 :]
    if np.any(pressed != pressed[0]):
        return "the normal load changes while shear is on"
    return ""


def _changes(loads: Array) -> Array:
    """Return the changes ``(n, k)`` of loads in each increment, over the largest of each kind."""
    scale = np.abs(loads).max(axis=0)
    changes: Array = np.diff(loads, axis=0, prepend=np.zeros((1, loads.shape[1])))
    return changes / np.where(scale > 0.0, scale, 1.0)


def _turns(change: Array, following: Array) -> bool:
    """Return whether the increment ``following`` leaves the direction of ``change``."""
    if not following.any():
        return False
    along = float(change @ following)
    lengths = float(np.linalg.norm(change) * np.linalg.norm(following))
    return along <= lengths * (1.0 - STRAIGHT)


def _proportional(shear: Array) -> bool:
    """Return whether all changes of the shear load are along one line."""
    singular = np.linalg.svd(_changes(shear), compute_uv=False)
    return bool(len(singular) < 2 or singular[1] <= STRAIGHT * singular[0])


class _Marches:
    """Marches over one path, each in more parts than the last, with their progress."""

    def __init__(
        self, contact: FrictionalContact, height: Array, path: ContactLoadPath, progress: Progress
    ) -> None:
        self._contact, self._height, self._path = contact, height, path
        self._progress, self._solved, self.rows = progress, 0, len(path)

    def __call__(self, parts: int, ahead: int = 0) -> list[ContactState]:
        """Return the states at all rows, with each increment split into ``parts``.

        ``ahead`` is the number of parts of later marches that are expected, for the progress.
        """
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
    """Return the states at all rows, up to one that has not converged.

    Each increment is split into ``parts``.
    """
    states, state = [], contact.unloaded_state(height)
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
    """Return the increments of the path, with their error by a march in ``parts``.

    The error is not estimated if ``parts`` is 1.
    """
    history = _history(march(1, parts if parts > 1 else 0), reason)
    if parts == 1 or not history.states[-1].converged:
        return history
    finer = march(parts)
    if not finer[-1].converged:
        return history
    # Backward Euler is of first order: the error is inversely proportional to the parts.
    return _estimated(contact, history, finer, parts / (parts - 1), parts)


def _split(
    contact: FrictionalContact, march: _Marches, reason: str, accuracy: float, most: int
) -> History:
    """Return the increments in as many parts as ``accuracy`` requires, but at most ``most``."""
    more = USUAL_PARTS // march.rows
    history, error = _history(march(1, 2 + more), reason), inf
    while history.states[-1].converged and error > accuracy and 2 * history.parts <= most:
        parts = history.parts
        # The first error is not reliable where the pressure changes and the energy converges
        # faster, so that the first split is in two parts.
        wanted = 2 if parts == 1 else ceil(parts * (history.error or 0.0) / accuracy)
        finer = min(most, max(2 * parts, wanted))
        ahead = more if parts == 1 else 0
        coarse, history = history.states, _history(march(finer, ahead), reason, finer)
        if not history.states[-1].converged:
            break
        # Errors are of first order in the length of the parts; the change is their difference.
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
    """Return the history with its errors: ``share`` times its difference from ``others``.

    ``parts`` is the number of parts of ``others``.
    """
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
    pair = contact.half_space.pair
    plain = not pair.layered and contact.factor is None
    keeps_direction = plain and (contact.grid.line or pair.poisson == 0.0)
    exact = keeps_direction and _proportional(path.shear)
    reason = "similar bodies, pressure constant while the shear load turns"
    parts = 1 if exact or len(rows) == 1 else PARTS_OF_LEGS
    history = _as_given(contact, march, reason, parts)
    states = history.states
    method: Method = "ciavarella_jaeger" if _one_leg(contact, states, legs) else "reversals"
    indices = rows[: len(states)]
    return replace(history, indices=indices, method=method, error_at=rows[history.error_at])


def _one_leg(contact: FrictionalContact, states: list[ContactState], legs: ContactLoadPath) -> bool:
    """Return whether the last leg is the first loading of a line contact."""
    begun = len(states) == len(legs) > 1
    return begun and contact.two_normal_problems(states[-2], legs.load(len(legs) - 1))


def _energy_difference(ones: list[ContactState], others: list[ContactState]) -> float:
    """Return the relative difference of energies, added over all rows without regard to sign."""
    one, other = (np.array([state.energy.sum() for state in states]) for states in (ones, others))
    planar = list(PLANAR)
    forces, motions = (
        np.array([getattr(state, name)[planar] for state in ones])
        for name in ("resultants", "rigid")
    )
    worked = np.abs(np.sum(forces * np.diff(motions, axis=0, prepend=0.0), axis=1)).sum()
    scale = max(float(one.sum()), NO_ENERGY * float(worked))
    return float(np.abs(one - other).sum()) / scale if scale > 0.0 else 0.0


def _shear_difference(
    contact: FrictionalContact, ones: list[ContactState], others: list[ContactState]
) -> tuple[float, int]:
    """Return the largest difference of shear, over the largest µP, and its row.

    The difference is summed over all cells.
    """
    pairs = zip(ones, others, strict=True)
    apart = [float(np.hypot(*(one.shear - other.shear)).sum()) for one, other in pairs]
    limit = contact.friction * max(float(state.pressure.sum()) for state in ones)
    worst = int(np.argmax(apart))
    return (apart[worst] / limit if limit > 0.0 else 0.0), worst
