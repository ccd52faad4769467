"""A cycle whose shear and slip come from the half-space itself (wear method 2 of Gallego 2007).

The resultants of each increment are those of the structure; where these let the contact slide as a
whole, the energies dissipated there say how far. Bodies without a structure may have their motions
imposed instead (:mod:`wear.contact.drive`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sa_solver.contact import FrictionalContact
from sa_solver.contact_state import ContactLoad, ContactStart, ContactState
from sa_solver.cycles.increments import before
from sa_solver.errors import ContactProblemError
from sa_solver.normal.contact import NormalStart
from sa_solver.types import Array, LoadHistory, Mask
from wear.contact.drive import Drive
from wear.steps.stepping import ContactFailure

CLOSED = 2e-3
"""A cycle repeats where its shear ends as it began, to this share of the largest µp."""

MOST_PASSES = 12
"""Under loads that turn and let it creep, a contact takes 3 to 12; most take 2."""

NEARLY_CLOSED = 2e-2
"""What is left of that after so many passes is more than this only where the cycle drifts."""


@dataclass(frozen=True)
class CycleStart:
    """What a cycle near this one may begin from: its shear, where it slips and how it moves.

    ``shear`` ``(t, 2, nx, ny)`` [MPa], ``slipping`` ``(t, nx, ny)``, ``motion`` ``(t, 2)`` [mm].
    """

    shear: Array
    slipping: Mask
    motion: Array

    @classmethod
    def of(cls, cycle: Sequence[ContactState]) -> CycleStart:
        """That of a cycle found."""
        return cls(
            shear=np.stack([state.shear for state in cycle]),
            slipping=np.stack([state.slipping for state in cycle]),
            motion=np.stack([state.rigid[1:3] for state in cycle]),
        )


def starts_near(
    known: CycleStart | None, pressed: Mapping[int, NormalStart], count: int
) -> list[ContactStart]:
    """Where ``count`` increments may begin: from those of a cycle, and what has ``pressed`` some.

    Their numbers are those of the increments; the pressures may be newer than the cycle.
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
    """Cells ``(t, nx, ny)`` whose slip a cycle of the half-space knows: pressed at either end.

    None where there is no such cycle.
    """
    if not cycle:
        return None
    pressures = np.stack([state.pressure for state in cycle])
    return np.asarray((pressures > 0.0) | (before(pressures, loads.missions) > 0.0))


def march_cycle(
    contact: FrictionalContact,
    height: Array,
    loads: LoadHistory,
    drive: Drive | None = None,
    moved: Array | None = None,
    starts: Sequence[ContactStart] | None = None,
    solved: Callable[[], None] = lambda: None,
) -> list[ContactState]:
    """States at the ends of the increments of one closed cycle, on surfaces that do not change.

    ``height`` ``(nx, ny)`` [mm] is the gap of the unloaded bodies, or ``(t, nx, ny)`` that at the
    place of each increment. A cycle that ends with the bodies apart is closed; any other is marched
    until it repeats, twice at least, and the last pass counts. In a mix every mission is such a
    cycle of its own, begun with the bodies apart. A ``drive`` may impose motions in the place of
    forces; without one all is forces. What the bodies' own deformation has ``moved``
    ``(t, 3, nx, ny)`` [mm] at the end of an increment lies along the surfaces in its first two
    components; the third is part of ``height``. ``starts`` are near the states of all increments.
    ``solved`` is called after every increment, in every pass.

    Raises :class:`ContactFailure` where an increment does not converge, its load is more than the
    contact can carry, or the cycle does not repeat.
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
    """States of one closed cycle, whose first increment is number ``first`` of all."""
    # Bodies apart at the end are so at the beginning: what their surfaces have moved is the same.
    last, apart = loads[-1], _lifted(loads[-1])
    state = contact.apart(heights[-1], last.along)
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
        # Not shear: where bodies stick it would keep what the last search left of slip, which a
        # pass from the increment before does not.
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
    """Whether nothing presses the bodies together: an imposed approach may still."""
    return not load.motion[0] and float(load.values[0]) <= 0.0


def _apart(contact: FrictionalContact, height: Array, load: ContactLoad) -> ContactState:
    """The bodies apart, but where motions and bulk stress have them: they may meet elsewhere."""
    rigid = np.where(load.motion, load.values, 0.0)
    return replace(contact.apart(height, load.along), rigid=rigid, strain=load.strain)


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
