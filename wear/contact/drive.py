"""Forces and motions that drive the bodies of a contact through a closed cycle.

A structure presses and shears its contacts by forces. In a rig, actuators may impose motions
instead: motions of body 1 relative to body 2 far from the contact, measured from where the bodies
first met. The contact then determines the forces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from sa_solver.contact_state import ContactLoad
from sa_solver.cycles.history import ContactLoadPath
from sa_solver.load_history import LoadHistory
from sa_solver.rigid_modes import NORMAL
from sa_solver.types import Array, Grid, Tilt

FORCES = (False,) * 6
TILTS = NORMAL[1:]
# Names of the normal forces and of the normal motions, in the same order, as keyword arguments of
# the normal contact.
PRESSING = ("P", "Mx", "My"), ("approach", "tilt_x", "tilt_y")


@dataclass(frozen=True)
class Drive:
    """Motions that are imposed on a contact over a cycle in place of forces, and its bulk strain.

    Parameters
    ----------
    motion
        For each of (P, Qx, Qy, Mx, My, Mz), whether the motion (δz, δx, δy, φx, φy, φz) is imposed
        instead of the force.
    motions
        Motions at the ends of the increments ``(t, 6)`` [mm, rad]; None: 0 throughout.
    strain
        Mismatch strain ε_2 - ε_1 of the unloaded surfaces along x due to bulk stress ``(t,)``;
        None: none.
    """

    motion: tuple[bool, ...] = FORCES
    motions: Array | None = None
    strain: Array | None = None

    @classmethod
    def by_forces(cls, tilt: Tilt = "free") -> Self:
        """Return a drive by the forces of the loads alone, with the ``tilt`` free or held."""
        return cls(tuple(tilt == "held" and k in TILTS for k in range(6)))

    @property
    def tilt(self) -> Tilt:
        """Free if the imposed moments determine the tilt about both axes, else held."""
        return "held" if any(self.motion[k] for k in TILTS) else "free"

    @property
    def presses(self) -> bool:
        """True if a normal motion is imposed: an approach or a tilt."""
        return any(self.motion[k] for k in NORMAL)

    def values(self, loads: LoadHistory) -> Array:
        """Return the imposed force or motion at the ends of the increments ``(t, 6)``."""
        motions = np.zeros((len(loads), 6)) if self.motions is None else self.motions
        values: Array = np.where(self.motion, motions, loads.resultants)
        return values

    def pressing(self, loads: LoadHistory, increment: int) -> dict[str, float]:
        """Return the normal forces and motions of an increment, as normal contact arguments."""
        values = self.values(loads)[increment]
        forces, motions = PRESSING
        return {
            (motions if self.motion[k] else forces)[place]: float(values[k])
            for place, k in enumerate(NORMAL)
        }

    def carried(self, grid: Grid, loads: LoadHistory, pressure: Array) -> LoadHistory:
        """Return ``loads`` with the resultants of a pressure where normal motions are imposed.

        ``pressure`` ``(t, nx, ny)`` [MPa] is that on the cells of ``grid``.
        """
        arms = {"P": np.ones(1), "Mx": grid.y, "My": -grid.x}
        imposed = zip(arms.items(), NORMAL, strict=True)
        driven = {name: arm for (name, arm), k in imposed if self.motion[k]}
        if not driven:
            return loads
        force = pressure * grid.cell_area
        found = {name: np.sum(force * arm, axis=(1, 2)) for name, arm in driven.items()}
        return replace(loads, **found)

    def increments(self, loads: LoadHistory) -> list[ContactLoad]:
        """Return the imposed load of each increment, with the friction energies of the loads."""
        moved = any(self.motion[k] for k in (1, 2, 5))
        energy = None if moved else np.stack([loads.Edx, loads.Edy], axis=1)
        path = ContactLoadPath(self.values(loads), self.motion, self.strain, energy)
        return [path.load(t) for t in range(len(path))]
