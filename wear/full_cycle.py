"""A cycle whose shear and slip come from the half-space itself (wear method 2 of Gallego 2007).

The resultants of each increment are those of the structure; where these let the contact slide as a
whole, the energies dissipated there say how far. Bodies without a structure have their motion
imposed instead of the tangential force.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sa_solver.contact import ContactLoad, ContactState, FrictionalContact
from sa_solver.errors import ContactProblemError
from sa_solver.history import ContactLoadPath
from sa_solver.types import Array, LoadHistory, Tilt
from wear.stepping import ContactFailure


def march_cycle(
    contact: FrictionalContact,
    height: Array,
    loads: LoadHistory,
    motion: Array | None = None,
    tilt: Tilt = "free",
    moved: Array | None = None,
) -> list[ContactState]:
    """States at the ends of the increments of one closed cycle, on surfaces that do not change.

    ``height`` ``(nx, ny)`` [mm] is the gap of the unloaded bodies, or ``(t, nx, ny)`` that at the
    place of each increment. A cycle that ends with the bodies apart is closed; any other is marched
    twice, and the second pass counts. In a mix every mission is such a cycle of its own, begun with
    the bodies apart. ``motion`` ``(t, 2)`` [mm] of body 2 over body 1 in each increment, far from
    the contact, is imposed in the place of Qx, Qy and Mz, without twist; the bodies meet in the
    middle of it. A ``tilt`` that is held is imposed in the place of Mx and My. What the bodies'
    own deformation has ``moved`` ``(t, 3, nx, ny)`` [mm] at the end of an increment lies along the
    surfaces in its first two components; the third is part of ``height``.

    Raises :class:`ContactFailure` where an increment does not converge, or its load is more than
    the contact can carry.
    """
    states: list[ContactState] = []
    heights = np.broadcast_to(height, (len(loads), *contact.grid.shape))
    path = _path(loads, motion, held=tilt == "held")
    for mission in loads.missions:
        increments = [path.load(t) for t in range(mission.start, mission.stop)]
        if moved is not None:
            pairs = zip(increments, moved[mission, :2], strict=True)
            increments = [replace(load, along=along) for load, along in pairs]
        states += _closed_cycle(contact, heights[mission], increments, mission.start)
    return states


def _closed_cycle(
    contact: FrictionalContact, heights: Array, loads: list[ContactLoad], first: int
) -> list[ContactState]:
    """States of one closed cycle, whose first increment is number ``first`` of all."""
    # Bodies apart at the end are so at the beginning: what their surfaces have moved is the same.
    state = contact.apart(heights[-1], loads[-1].along)
    for _ in range(1 if loads[-1].values[0] == 0.0 else 2):
        states = []
        for t, (height, load) in enumerate(zip(heights, loads, strict=True), first):
            state = _advance(contact, state, height, load, t)
            states.append(state)
    return states


def _shifts(motion: Array) -> Array:
    """Motions ``(t, 2)`` of body 1 relative to body 2 since they met, half way of the ``motion``.

    A contact that slips in part remembers from where it first moved: met at one end of the way,
    its loop would not be centred.
    """
    path = np.concatenate([np.zeros((1, 2)), np.cumsum(motion, axis=0)])
    shifts: Array = 0.5 * (path.max(axis=0) + path.min(axis=0)) - path[1:]
    return shifts


def _path(loads: LoadHistory, motion: Array | None, held: bool) -> ContactLoadPath:
    """The resultants of all increments and what these dissipate, or the shifts of body 1.

    A tilt that is ``held`` is 0.
    """
    values, moved = loads.resultants, motion is not None
    if held:
        values[:, 3:5] = 0.0
    imposed = (False, moved, moved, held, held, moved)
    if motion is None:
        energy = np.stack([loads.Edx, loads.Edy], axis=1)
        return ContactLoadPath(values, imposed, energy=energy)
    values[:, 1:3] = np.concatenate([_shifts(motion[mission]) for mission in loads.missions])
    values[:, 5] = 0.0
    return ContactLoadPath(values, imposed)


def _advance(
    contact: FrictionalContact, before: ContactState, height: Array, load: ContactLoad, t: int
) -> ContactState:
    if load.values[0] <= 0.0:
        return contact.apart(height, load.along)
    try:
        state = contact.advance(before, height, load)
    except ContactProblemError as error:
        raise ContactFailure(f"increment {t + 1}: {error}") from error
    if not state.converged:
        raise ContactFailure(f"increment {t + 1}: {state.message}")
    return state
