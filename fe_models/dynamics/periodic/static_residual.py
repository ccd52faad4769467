"""What harmonic forces do between joints, where modes far above them answer as at rest.

A mode of frequency ω_n answers a force of frequency ω as one at rest to (ω/ω_n)². For a finely
meshed contact nearly all modes do: the few others are kept, and all else is one matrix between
joints, the residual flexibility (MacNeal 1971, doi:10.1016/0045-7949(71)90031-9). Good enough to
precondition with, not for what is balanced in the end.
"""

from __future__ import annotations

import numpy as np

from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.receptance import Receptance
from sa_solver.types import Array

# Frequency of a mode over the highest of the forces from which on it answers as at rest.
AT_REST = 300.0
# Modes that move are counted in steps: each count has a matrix of its own.
MODES_STEP = 16


class ResidualReceptance:
    """Displacements of joints by forces on ``some`` of their directions; held at ω = 0.

    ``structure`` has damping that does not mix its modes; ``angular`` ``(k,)`` [rad/s] are those of
    the harmonics of the ``resolution``.
    """

    def __init__(
        self,
        structure: Receptance,
        resolution: Resolution,
        angular: Array,
        some: np.ndarray | slice = slice(None),
    ) -> None:
        count = modes_that_move(structure, float(angular[-1]))
        turning, at_rest = angular[:, None], angular == 0.0
        squares, damping = structure.squares[:count], structure.damping[:count]
        loss = structure.loss[:count]
        stiffness = squares - turning * turning + 1j * (turning * damping + loss)
        stiffness[at_rest] = 1.0
        # (k, l): no mode moves where the forces are constant.
        self._flexibility = np.where(at_rest[:, None], 0.0, 1.0 / stiffness)
        self._resolution, self._moving = resolution, int(at_rest[0])
        self._modes = structure.at_joints[:, :count]
        self._of_some = self._modes[some]
        self._residual = structure.residual_flexibility(count)[some]
        self._static = structure.static_flexibility[some]

    def respond(self, force: Array) -> Array:
        """Coefficients ``(m, j d)`` of displacements by those of forces ``(m, s)``."""
        motion = self._resolution.combined(force @ self._of_some)
        motion *= self._flexibility
        response = self._resolution.separated(motion) @ self._modes.T
        moving = self._moving
        response[moving:] += force[moving:] @ self._residual
        response[:moving] = force[:moving] @ self._static
        return np.asarray(response)


def modes_that_move(structure: Receptance, highest: float) -> int:
    """How many modes do not answer forces up to so many rad/s as at rest."""
    modes = len(structure.squares)
    moving = int(np.searchsorted(structure.squares, (AT_REST * highest) ** 2))
    return min(-(-moving // MODES_STEP) * MODES_STEP, modes)
