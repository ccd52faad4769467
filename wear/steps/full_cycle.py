"""A cycle with the half-space's own shear and slip (wear method 2 of Gallego 2007).

The resultants of each increment are those of the structure. Where they make the contact slide as a
whole, the energies dissipated in the structure determine how far. Bodies without a structure may
have their motions imposed instead (:mod:`wear.contact.drive`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad, ContactStart, ContactState
from sa_solver.cycles.increments import before, of_nearest
from sa_solver.errors import ContactProblemError
from sa_solver.load_history import LoadHistory
from sa_solver.normal.state import NormalStart
from sa_solver.types import Array, Grid, Mask
from wear.contact.drive import Drive
from wear.steps.stepping import ContactFailure

CLOSED = 2e-3
"""A cycle repeats if its shear ends as it began, up to this share of the largest µp."""

MOST_PASSES = 12
"""Limit of passes. Most cycles take 2, and 3 to 12 where rotating loads make the contact creep."""

NEARLY_CLOSED = 2e-2
"""Acceptable change of shear, over the largest µp, in the last pass allowed. It is exceeded only
where the cycle drifts.
"""


@dataclass(frozen=True)
class CycleStart:
    """Starting point for the solution of a similar cycle.

    ``shear`` is ``(t, 2, nx, ny)`` [MPa], ``slipping`` the slipping cells ``(t, nx, ny)``, and
    ``motion`` the rigid motion along x and y ``(t, 2)`` [mm].
    """

    shear: Array
    slipping: Mask
    motion: Array

    @classmethod
    def of(cls, cycle: Sequence[ContactState]) -> CycleStart:
        """Return the starting point that a solved cycle gives."""
        return cls(
            shear=np.stack([state.shear for state in cycle]),
            slipping=np.stack([state.slipping for state in cycle]),
            motion=np.stack([state.rigid[1:3] for state in cycle]),
        )


def starts_near(
    known: CycleStart | None, pressed: Mapping[int, NormalStart], count: int
) -> list[ContactStart]:
    """Return starting points of ``count`` increments from a similar cycle and normal states.

    ``known`` is the starting point of a similar cycle, if any. ``pressed`` holds normal contact
    states by increment, whose pressures may be newer than the cycle.
    """
    if known is None:
        return [ContactStart(pressed.get(t)) for t in range(count)]
    starts = []
    for t, (shear, slipping, motion) in enumerate(zip(*vars(known).values(), strict=True)):
        normal = pressed.get(t)
        together = None if normal is None else np.stack([*shear, normal.pressure])
        starts.append(ContactStart(normal, shear, slipping, motion, together))
    return starts


def slip_known(cycle: Sequence[ContactState], loads: LoadHistory) -> Mask | None:
    """Return the cells ``(t, nx, ny)`` whose slip the cycle determines: pressed at either end.

    Return None without a cycle of the half-space.
    """
    if not cycle:
        return None
    pressures = np.stack([state.pressure for state in cycle])
    return np.asarray((pressures > 0.0) | (before(pressures, loads.missions) > 0.0))


def slip_around(cycle: Sequence[ContactState], loads: LoadHistory, grid: Grid) -> Array:
    """Return the size of the slip of each increment ``(t, nx, ny)`` [mm], also around the contact.

    Cells that are apart slip as the nearest cell in contact. They do not wear, because nothing
    presses there, but a contact that grows onto them within a wear step wears them.
    """
    sizes, known = np.stack([np.hypot(*state.slip) for state in cycle]), slip_known(cycle, loads)
    assert known is not None
    for size, pressed in zip(sizes, known, strict=True):
        if pressed.any() and not pressed.all():
            size[~pressed] = of_nearest(size, pressed, grid.pitch)[~pressed]
    return sizes


def march_cycle(
    contact: FrictionalContact,
    height: Array,
    loads: LoadHistory,
    drive: Drive | None = None,
    moved: Array | None = None,
    starts: Sequence[ContactStart] | None = None,
    solved: Callable[[], None] = lambda: None,
) -> list[ContactState]:
    """Solve the increments of one closed cycle on surfaces that do not change.

    Return the states at the ends of the increments. A cycle that ends with the bodies apart is
    closed. Any other is repeated at least once, until it closes, and the last pass counts. In a mix
    every mission is such a cycle of its own that begins with the bodies apart.

    Parameters
    ----------
    contact
        Contact with its own friction.
    height
        Gap of the unloaded bodies ``(nx, ny)`` [mm], or ``(t, nx, ny)`` at the place of each
        increment.
    loads
        Resultants of the cycle.
    drive
        Motions imposed in place of forces, if any.
    moved
        Displacement of the surfaces by the deformation of the bodies at the end of each increment
        ``(t, 3, nx, ny)`` [mm]. Only the tangential components are used: the normal one is part of
        ``height``.
    starts
        Starting points near the states of all increments.
    solved
        Callback after every increment, in every pass.

    Raises
    ------
    ContactFailure
        If an increment does not converge, a load is more than the contact can carry, or the cycle
        does not close.
    """
    states: list[ContactState] = []
    heights = np.broadcast_to(height, (len(loads), *contact.grid.shape))
    imposed = (drive or Drive()).increments(loads)
    begun = starts or [ContactStart()] * len(loads)
    for mission in loads.missions:
        increments = imposed[mission]
        if moved is not None:
            pairs = zip(increments, moved[mission, :2], strict=True)
            increments = [replace(load, along=along) for load, along in pairs]
        cycle = contact, heights[mission], increments, begun[mission], mission.start, solved
        states += _closed_cycle(*cycle)
    return states


def _closed_cycle(
    contact: FrictionalContact,
    heights: Array,
    loads: list[ContactLoad],
    starts: Sequence[ContactStart],
    first: int,
    solved: Callable[[], None],
) -> list[ContactState]:
    """Return the states of one closed cycle, whose first increment has the number ``first``."""
    # Bodies that are apart at the end are apart at the beginning, with the same surface motion.
    last, apart = loads[-1], _lifted(loads[-1])
    state = contact.unloaded_state(heights[-1], last.along)
    if apart:
        state = _apart(contact, heights[-1], last)
    change, limit = np.inf, 0.0
    states: list[ContactState] = []
    for passed in range(1, MOST_PASSES + 1):
        begun, states = state, []
        increments = zip(heights, loads, starts, strict=True)
        for t, (height, load, start) in enumerate(increments, first):
            state = _advance(contact, state, height, load, start, t)
            states.append(state)
            solved()
        # Shear is not reused: where bodies stick, it would retain the error in slip of the last
        # solution, which a solution from the increment before does not have.
        starts = [replace(ended.as_start, shear=None) for ended in states]
        limit = contact.friction * max(float(s.pressure.max()) for s in states)
        change = float(np.abs(state.shear - begun.shear).max())
        if apart or (passed > 1 and change <= CLOSED * limit):
            return states
    if change <= NEARLY_CLOSED * limit:
        return states
    raise ContactFailure(
        f"the cycle has not closed after {MOST_PASSES} passes: its shear still changes by "
        f"{change / limit:.1%} of the largest µp; take smaller increments"
    )


def _lifted(load: ContactLoad) -> bool:
    """Return whether no force presses the bodies together; an imposed approach may still do so."""
    return not load.motion[0] and float(load.values[0]) <= 0.0


def _apart(contact: FrictionalContact, height: Array, load: ContactLoad) -> ContactState:
    """Return the state of separated bodies under imposed motions and bulk strain.

    The bodies may then meet elsewhere.
    """
    rigid = np.where(load.motion, load.values, 0.0)
    return replace(contact.unloaded_state(height, load.along), rigid=rigid, strain=load.strain)


def _advance(
    contact: FrictionalContact,
    before: ContactState,
    height: Array,
    load: ContactLoad,
    start: ContactStart,
    t: int,
) -> ContactState:
    if _lifted(load):
        return _apart(contact, height, load)
    try:
        state = contact.advance(before, height, load, start)
    except ContactProblemError as error:
        raise ContactFailure(f"increment {t + 1}: {error}") from error
    if not state.converged:
        raise ContactFailure(f"increment {t + 1}: {state.message}")
    return state
