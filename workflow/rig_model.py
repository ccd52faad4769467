"""The rig of a case in time: what vibrates, where it is driven, and what is seen of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.dynamics.excitation import Force, Recorded, Together
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.motion import Motion
from fe_models.dynamics.rig import Link, lumped_rig, natural_frequencies, unit_force
from sa_solver.types import Array
from wear.joints.friction_contact import FrictionContact
from workflow.case import RigCase
from workflow.case.rig_structure import ReducedBody, Rig
from workflow.joint_model import Law
from workflow.reporter import Reporter

# Natural frequencies that are told, from the lowest on: those of a row of masses, all.
MOST_FREQUENCIES = 20


@dataclass(frozen=True)
class RigModel:
    """A vibrating structure with joints of ``directions`` directions.

    ``driven`` ``(n,)`` are the forces of an excitation of 1 N; ``seen`` ``(k, n)`` takes
    displacements to those that are kept, the last of which is looked at. Loops are those along the
    joints' direction number ``along``. Of masses ``in_a_row`` the second mode is looked for too.
    """

    model: DynamicModel
    driven: Array
    seen: Array
    directions: int = 1
    along: int = 0
    in_a_row: bool = True

    @property
    def joints(self) -> int:
        """How many there are."""
        return len(self.model.connection) // self.directions

    def shaken(self, law: Law, force: Force) -> Together:
        """An excitation, with the static load that balances the joints at rest.

        Displacements count from there: what the load has done to the structure before does not
        matter, as it is linear.
        """
        still = np.zeros((self.joints, self.directions))
        preload = law.respond(law.rest(self.joints), still).force.ravel() @ self.model.connection
        if not preload.any():
            return Together((force,))
        return Together((force, Recorded(preload, np.zeros(1), np.ones(1))))

    def loop(self, motion: Motion) -> tuple[Array, Array]:
        """Mean displacement [mm] and force [N] of all joints ``(t,)``, along one direction."""
        stretch, force = (
            values[:, :, self.along] for values in (motion.joint_displacement, motion.joint_force)
        )
        return stretch.mean(axis=1), force.sum(axis=1)

    def looked_at(self, values: Array) -> Array:
        """Displacement or acceleration ``(t,)`` that is looked at, of all of them ``(t, n)``."""
        return values @ self.seen[-1]

    def contact(self, motion: Motion) -> dict[str, Any]:
        """How friction contacts press in a motion; nothing of joints along one direction."""
        if self.directions == 1:
            return {}
        normal = motion.joint_force[:, :, 2]
        total = normal.sum(axis=1)
        return {
            "smallest_normal_force": float(total.min()),
            "largest_normal_force": float(total.max()),
            "most_open": int((normal <= 0.0).sum(axis=1).max()),
        }

    def free(self) -> list[float]:
        """The lowest natural frequencies without the joints [Hz]."""
        return _lowest(natural_frequencies(self.model))

    def modes(self, law: Law) -> dict[str, list[float]]:
        """The lowest natural frequencies with all joints stuck, and with all sliding [Hz]."""
        still = np.zeros((self.joints, self.directions))
        stuck = law.respond(law.rest(self.joints), still).tangent
        sliding = np.zeros_like(stuck)
        if isinstance(law, FrictionContact):
            sliding[:, 2, 2] = stuck[:, 2, 2]
        else:
            sliding[:, 0, 0] = law.residual_stiffness
        return {
            "stuck": _lowest(natural_frequencies(self.model, stuck)),
            "sliding": _lowest(natural_frequencies(self.model, sliding)),
        }


def _lowest(frequencies: Array) -> list[float]:
    found: list[float] = frequencies[:MOST_FREQUENCIES].tolist()
    return found


def rig_model(case: RigCase, reporter: Reporter) -> RigModel:
    """The rig of a case. Raises UserError where a reduced body cannot be what the case says."""
    if isinstance(case.structure, ReducedBody):
        from workflow.reduced_rig import reduced_rig_model

        return reduced_rig_model(case, case.structure, reporter)
    return row_of_masses(case.structure, case.excitation.mass or 1)


def row_of_masses(rig: Rig, driven: int = 1) -> RigModel:
    """Masses m1, m2, ... in a row from the ground on, the last held to the ground by the joint."""
    names = [f"m{number}" for number in range(1, len(rig.masses) + 1)]
    links = [Link(name, before) for name, before in zip(names, [None, *names], strict=False)]
    model = lumped_rig(
        dict(zip(names, rig.masses, strict=True)),
        dict(zip(links, rig.springs, strict=True)),
        [[Link(names[-1])]],
        rig.damping_ratio,
    )
    return RigModel(model, unit_force(model, f"m{driven}"), np.eye(len(names)))
