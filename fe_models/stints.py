"""Wear of two reduced specimens in stints of constant shape: explicit steps within stability."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fe_models.reduced_contact import ReducedPair, RubbedContact, Rubbing
from sa_solver.errors import InputError
from sa_solver.types import Array

# Share of the stability limit that a stint takes: 0.5 damps the stiffest error without overshoot.
STINT_SHARE = 0.5


class StintError(InputError):
    """A stint of constant geometry would be unstable; the message says which length is not."""


@dataclass(frozen=True)
class StintState:
    """A worn pair after ``cycles``.

    ``gap`` ``(n,)`` of the unloaded faces and ``depths`` ``(2, n)`` worn off each body [mm],
    ``energy`` dissipated since the start [N mm] and the ``contact`` at this shape.
    """

    cycles: float
    gap: Array
    depths: Array
    energy: float
    contact: RubbedContact


def wear_in_stints(
    pair: ReducedPair,
    gap: Array,
    rubbing: Rubbing,
    cycles: float,
    share: float = STINT_SHARE,
    stint: float | None = None,
) -> Iterator[StintState]:
    """States of a contact of unworn ``gap`` ``(n,)`` that is rubbed up to ``cycles``.

    Energy law: every node of each body loses α times the energy it dissipates per area, Σ|q||Δs|.
    Shape, forces and slip are those at the start of each stint (explicit), which lasts ``share`` <=
    1 of its stability limit, or ``stint`` cycles if they are given. The last state is the one at
    ``cycles``. Raises :class:`StintError` where a stint would be beyond its limit.
    """
    if not 0.0 < share <= 1.0:
        raise StintError(f"stints of {share:g} of their stability limit: take above 0 and up to 1")
    done, energy, depths = 0.0, 0.0, np.zeros((2, len(gap)))
    touching = None
    while True:
        worn = gap + depths.sum(axis=0)
        contact = pair.rub(worn, rubbing, touching)
        yield StintState(done, worn, depths, energy, contact)
        if done >= cycles:
            return
        step = share * contact.stint_limit if stint is None else stint
        if not 0.0 < step <= contact.stint_limit:
            raise StintError(
                f"a stint of {step:g} cycles: take at most {contact.stint_limit:.4g} cycles"
            )
        step = min(step, cycles - done)
        depths = depths + step * contact.wear
        energy += step * contact.energy
        done += step
        touching = contact.normal.touching
