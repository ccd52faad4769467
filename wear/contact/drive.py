"""How the bodies of a contact are driven through a closed cycle: by forces, or by their motions.

A structure presses and shears its contacts by forces, whatever they do. In a rig actuators may
impose motions as well: those of body 1 relative to body 2 far from the contact, counted from where
the bodies met. What they take is then for the contact to find.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from sa_solver.contact_state import ContactLoad
from sa_solver.cycles.history import ContactLoadPath
from sa_solver.rigid_modes import NORMAL
from sa_solver.types import Array, LoadHistory, Tilt

FORCES = (False,) * 6
TILTS = NORMAL[1:]
# Of forces and motions that press, in the same order, as the normal contact takes them.
PRESSING = ("P", "Mx", "My"), ("approach", "tilt_x", "tilt_y")


@dataclass(frozen=True)
class Drive:
    """What is imposed on a contact over a cycle beside, or in the place of, its loads.

    ``motion`` (6,) says of which of (P, Qx, Qy, Mx, My, Mz) the motion is imposed and not the
    force: (δz, δx, δy, φx, φy, φz), ``motions`` ``(t, 6)`` [mm, rad] at the ends of the increments;
    None: 0 throughout. ``strain`` ``(t,)`` is the mismatch ε_2 - ε_1 along x that bulk stress makes
    of the unloaded surfaces; None: none.
    """

    motion: tuple[bool, ...] = FORCES
    motions: Array | None = None
    strain: Array | None = None

    @classmethod
    def by_forces(cls, tilt: Tilt = "free") -> Self:
        """All by the forces of the loads, but for a ``tilt`` that is held."""
        return cls(tuple(tilt == "held" and k in TILTS for k in range(6)))

    @property
    def tilt(self) -> Tilt:
        """Free where the bodies turn as imposed moments make them about both axes."""
        return "held" if any(self.motion[k] for k in TILTS) else "free"

    @property
    def presses(self) -> bool:
        """Whether a motion across the face is imposed: an approach or a tilt."""
        return any(self.motion[k] for k in NORMAL)

    def values(self, loads: LoadHistory) -> Array:
        """Force or motion imposed at the ends of the increments ``(t, 6)``."""
        motions = np.zeros((len(loads), 6)) if self.motions is None else self.motions
        values: Array = np.where(self.motion, motions, loads.resultants)
        return values

    def pressing(self, loads: LoadHistory, increment: int) -> dict[str, float]:
        """What presses the bodies in an increment, as the normal contact takes it."""
        values = self.values(loads)[increment]
        forces, motions = PRESSING
        return {
            (motions if self.motion[k] else forces)[place]: float(values[k])
            for place, k in enumerate(NORMAL)
        }

    def increments(self, loads: LoadHistory) -> list[ContactLoad]:
        """What is imposed at the end of each increment; energies are those of the loads."""
        moved = any(self.motion[k] for k in (1, 2, 5))
        energy = None if moved else np.stack([loads.Edx, loads.Edy], axis=1)
        path = ContactLoadPath(self.values(loads), self.motion, self.strain, energy)
        return [path.load(t) for t in range(len(path))]
