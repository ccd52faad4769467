"""Error of a cycle of two bodies with friction due to its increments.

The loads of such a cycle vary linearly from increment to increment, so that values in between are
known. A solution in twice as many increments measures their error, that of friction and that of
sums over increments together: backward Euler is of first order, and halving the increments removes
half of the error.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sa_solver.cycles.history import ACCURACY, NO_ENERGY
from sa_solver.cycles.increments import depth_and_energy
from sa_solver.rigid_modes import PLANAR
from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads
from wear.contact.interface import FirstContact, InterfaceContact
from workflow.messages.warning_kinds import Notice, WarningKind


class CycleWork(NamedTuple):
    """Friction work of an unworn cycle, in which the half-space finds the slip.

    Parameters
    ----------
    rubbed
        Friction work per area on the cells of the grid ``(nx, ny)`` [N/mm].
    moved
        Sum of the absolute work of the shear loads in all increments, per area of a cell [N/mm].
    """

    rubbed: Array
    moved: float

    @classmethod
    def of(cls, contact: InterfaceContact, loads: FaceLoads, first: FirstContact) -> CycleWork:
        """Return the work of the ``first`` cycle of a contact under its unworn ``loads``."""
        planar = list(PLANAR)
        forces, motions = (
            np.array([getattr(state, name)[planar] for state in first.cycle])
            for name in ("resultants", "rigid")
        )
        moved = np.abs(np.sum(forces * (motions - np.roll(motions, 1, axis=0)), axis=1)).sum()
        rubbed = contact.unworn_tractions(loads, first).work.sum(axis=0)
        return cls(rubbed, float(moved) / contact.grid.cell_area)

    def change(self, finer: CycleWork) -> float:
        """Return the larger relative change of depth and energy in the ``finer`` cycle.

        It is inf where only the finer cycle dissipates nothing. An energy that is small compared
        with the work of the shear loads counts as that share of the work.
        """
        energy = float(finer.rubbed.sum())
        if energy <= 0.0:
            return 0.0 if self.rubbed.sum() <= 0.0 else np.inf
        scale = max(1.0, NO_ENERGY * finer.moved / energy)
        change = depth_and_energy(finer.rubbed - self.rubbed) / depth_and_energy(finer.rubbed)
        return float(np.max(change) / scale)


def increment_warnings(name: str, given: CycleWork, halved: CycleWork) -> list[Notice]:
    """Return the warning for increments too long for the friction of the contact ``name``.

    ``halved`` is the work of the cycle with each increment in two parts.
    """
    error = 2.0 * given.change(halved)
    if error <= ACCURACY:
        return []
    return [
        Notice(
            WarningKind.LONG_INCREMENTS,
            f"{name}: the increments of the loads cause an error of about {100.0 * error:.2g} % of "
            f"depth and energy, above {100.0 * ACCURACY:g} %: split them with in_parts of the "
            "bodies",
        )
    ]
