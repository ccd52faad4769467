"""Approximate receptance between joints, in which high modes respond quasi-statically.

The dynamic response of a mode of frequency ω_n to a force of frequency ω differs from its static
one by (ω/ω_n)². For a finely meshed contact nearly all modes are that stiff. The few others are
kept, and the rest form one matrix between joints, the residual flexibility (MacNeal 1971,
doi:10.1016/0045-7949(71)90031-9). This is accurate enough for a preconditioner, but not for the
equations themselves.
"""

from __future__ import annotations

import numpy as np

from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.receptance import Receptance
from sa_solver.types import Array

# Natural frequency over the highest forcing frequency above which a mode responds quasi-statically.
AT_REST = 300.0
# The number of kept modes is a multiple of this, because each number needs a matrix of its own.
MODES_STEP = 16


class ResidualReceptance:
    """Map from forces on some directions of the joints to displacements of all.

    At ω = 0 the structure is held by the holding springs.

    Parameters
    ----------
    structure
        The structure, whose damping must not couple its modes.
    resolution
        Harmonics of the motion.
    angular
        Angular frequencies ``(k,)`` [rad/s] of the harmonics.
    some
        Rows of the joints' directions on which the forces act.
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
        # Modal flexibility (k, l), 0 for constant forces.
        self._flexibility = np.where(at_rest[:, None], 0.0, 1.0 / stiffness)
        self._resolution, self._first_moving = resolution, int(at_rest[0])
        self._modes = structure.at_joints[:, :count]
        self._some_modes = self._modes[some]
        self._residual = structure.residual_flexibility(count)[some]
        self._static = structure.static_flexibility[some]

    def respond(self, force: Array) -> Array:
        """Return coefficients ``(m, j d)`` of displacements for those of forces ``(m, s)``."""
        motion = self._resolution.complex_from_real(force @ self._some_modes)
        motion *= self._flexibility
        response = self._resolution.real_from_complex(motion) @ self._modes.T
        first_moving = self._first_moving
        response[first_moving:] += force[first_moving:] @ self._residual
        response[:first_moving] = force[:first_moving] @ self._static
        return np.asarray(response)


def modes_that_move(structure: Receptance, highest: float) -> int:
    """Return the number of modes that respond dynamically to forces up to ``highest`` [rad/s]."""
    modes = len(structure.squares)
    needed = int(np.searchsorted(structure.squares, (AT_REST * highest) ** 2))
    return min(-(-needed // MODES_STEP) * MODES_STEP, modes)
