"""Wear of two reduced specimens in cycle blocks: explicit steps within their stability limit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fe_models.reduced_contact import FrettingConditions, FrettingCycle, ReducedPair
from sa_solver.errors import InputError
from sa_solver.types import Array

# Share of the stability limit that a cycle block takes: 0.5 damps the stiffest error without
# overshoot.
STABLE_SHARE = 0.5


class CycleBlockError(InputError):
    """A cycle block would be unstable; the message says which length is not."""


@dataclass(frozen=True)
class BlockState:
    """A worn pair after ``cycles``, at the start of a cycle block.

    ``gap`` ``(n,)`` of the unloaded faces and ``depths`` ``(2, n)`` worn off each body [mm],
    ``energy`` dissipated since the start [N mm] and the ``contact`` at this shape.
    """

    cycles: float
    gap: Array
    depths: Array
    energy: float
    contact: FrettingCycle


def wear_in_cycle_blocks(
    pair: ReducedPair,
    gap: Array,
    conditions: FrettingConditions,
    cycles: float,
    share: float = STABLE_SHARE,
    block: float | None = None,
) -> Iterator[BlockState]:
    """States of a contact of unworn ``gap`` ``(n,)`` that frets up to ``cycles``.

    Energy law: every node of each body loses α times the energy it dissipates per area, Σ|q||Δs|.
    Shape, forces and slip are those at the start of each cycle block (explicit), which lasts
    ``share`` <= 1 of its stability limit, or ``block`` cycles if they are given. The last state is
    the one at ``cycles``. Raises :class:`CycleBlockError` where a cycle block would be beyond its
    limit.
    """
    if not 0.0 < share <= 1.0:
        raise CycleBlockError(
            f"cycle blocks of {share:g} of their stability limit: take above 0 and up to 1"
        )
    done, energy, depths = 0.0, 0.0, np.zeros((2, len(gap)))
    touching = None
    while True:
        worn = gap + depths.sum(axis=0)
        contact = pair.fretting_cycle(worn, conditions, touching)
        yield BlockState(done, worn, depths, energy, contact)
        if done >= cycles:
            return
        step = share * contact.stable_cycles if block is None else block
        if not 0.0 < step <= contact.stable_cycles:
            raise CycleBlockError(
                f"a cycle block of {step:g} cycles: take at most {contact.stable_cycles:.4g} cycles"
            )
        step = min(step, cycles - done)
        depths = depths + step * contact.wear
        energy += step * contact.energy
        done += step
        touching = contact.normal.touching
