"""A cycle whose shear and slip come from the half-space itself (wear method 2 of Gallego 2007).

The resultants of each increment are those of the structure; where these let the contact slide as a
whole, the energies dissipated there say how far.
"""

from __future__ import annotations

import numpy as np

from sa_solver.contact import ContactState, FrictionalContact, Load
from sa_solver.coupled import CoupledContactError
from sa_solver.normal import NormalContactError
from sa_solver.tangential import TangentialContactError
from sa_solver.types import Array, LoadHistory
from wear.stepping import ContactFailure

# Loads that no contact can carry.
IMPOSSIBLE = (NormalContactError, TangentialContactError, CoupledContactError)


def full_cycle(contact: FrictionalContact, height: Array, loads: LoadHistory) -> list[ContactState]:
    """States at the ends of the increments of one closed cycle, on surfaces that do not change.

    ``height`` ``(nx, ny)`` [mm] is the gap of the unloaded bodies. A cycle that ends with the
    bodies apart is closed; any other is marched twice, and the second pass counts.

    Raises :class:`ContactFailure` where an increment does not converge, or its load is more than
    the contact can carry.
    """
    state = contact.apart(height)
    for _ in range(1 if loads.P[-1] == 0.0 else 2):
        states = []
        for t in range(len(loads)):
            state = _advance(contact, state, height, loads, t)
            states.append(state)
    return states


def _advance(
    contact: FrictionalContact, before: ContactState, height: Array, loads: LoadHistory, t: int
) -> ContactState:
    if loads.P[t] <= 0.0:
        return contact.apart(height)
    columns = (loads.P, loads.Qx, loads.Qy, loads.Mx, loads.My, loads.Mz)
    values = np.array([column[t] for column in columns])
    energy = np.array([loads.Edx[t], loads.Edy[t]])
    try:
        state = contact.advance(before, height, Load(values, energy=energy))
    except IMPOSSIBLE as error:
        raise ContactFailure(f"increment {t + 1}: {error}") from error
    if not state.converged:
        raise ContactFailure(f"increment {t + 1}: {state.message}")
    return state
