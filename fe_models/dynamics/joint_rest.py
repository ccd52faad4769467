"""Static equilibrium of the joints under a constant load, and the structure stiffened by them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_models.dynamics.model import DynamicModel, stiffened
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.joints import Cycle, PeriodicJoints
from fe_models.dynamics.periodic.receptance import Receptance
from sa_solver.types import Array

# Residual of the static equilibrium, relative to the joint displacements that load and joints
# cause. The result is only an initial guess, which Newton's method on all harmonics improves. If
# MAX_ITERATIONS do not suffice, no joint closes.
TOLERANCE, MAX_ITERATIONS = 1e-12, 60
# Initial stiffness of the springs added to joints, over that of the structure at the joints.
INITIAL_SPRING = 1e-3
# Number of samples of a period without motion.
REST_SAMPLES = 8
# Number of tangential directions of a joint, at most.
TANGENTIAL_DIRECTIONS = 2
# Share of the tangential stiffness at rest below which joints count as sliding.
STICKING_SHARE = 0.5


@dataclass(frozen=True)
class SpringJoints:
    """Structure whose joints are springs of the symmetric ``tangents`` ``(j, d, d)`` [N/mm]."""

    model: DynamicModel
    tangents: Array

    @cached_property
    def stiffened(self) -> Receptance:
        """Receptance of the structure with these springs; damping between modes is left out."""
        return Receptance(stiffened(self.model, self.tangents), mixed=False)


class Rest:
    """Static equilibrium of the joints under a constant load ``(n,)`` on the modes.

    Parameters
    ----------
    model
        The structure.
    receptance
        Receptance of the structure without joints.
    joints
        The joint law.
    load
        Constant modal forces ``(n,)``.
    """

    def __init__(
        self, model: DynamicModel, receptance: Receptance, joints: PeriodicJoints, load: Array
    ) -> None:
        self._model, self._receptance, self._joints, self._load = model, receptance, joints, load
        self._shape = len(model.connection) // joints.directions, joints.directions

    @cached_property
    def loaded(self) -> Array:
        """Displacements ``(j d,)`` of the joints under the load without joint forces.

        If only the joints hold the structure, the springs of ``Receptance.holding_stiffness`` act.
        """
        motion = self._receptance.at(np.zeros(1)).respond(self._load[None])
        return np.asarray((motion @ self._receptance.at_joints.T)[0].real)

    @cached_property
    def displacement(self) -> Array:
        """Displacements ``(j, d)`` of the joints at rest, or an approximation; 0 without a load.

        Newton's method solves for them. Where joints are open, nothing may hold the structure.
        Therefore a spring is added to each joint and made softer from iteration to iteration, so
        that the structure moves until the joints close.
        """
        compliance, held = self._receptance.static_flexibility, self._receptance.holding_stiffness
        if not (self._load.any() and compliance.any()):
            # Joints between sectors are not displaced by a motion that is the same in all sectors.
            return np.zeros(self._shape)
        displacement = np.zeros(len(compliance))
        structure_stiffness = 1.0 / float(np.diagonal(compliance).mean())
        previous_norm, spring = np.inf, 10.0 * INITIAL_SPRING * structure_stiffness
        for _ in range(MAX_ITERATIONS):
            cycle = self._settled(displacement)
            force = cycle.force.ravel() - held * displacement
            residual = displacement - self.loaded + compliance @ force
            norm = float(np.linalg.norm(residual))
            by_joints = float(np.linalg.norm(compliance @ cycle.force.ravel()))
            if norm <= TOLERANCE * (np.linalg.norm(self.loaded) + by_joints):
                break
            spring = 0.1 * spring if norm < previous_norm else INITIAL_SPRING * structure_stiffness
            previous_norm = norm
            tangents = cycle.jacobian.reshape(*self._shape, self._shape[1])
            springs = tangents + (spring - held) * np.eye(self._shape[1])
            by_joint = compliance.reshape(len(compliance), *self._shape)
            product = np.einsum("pjd,jde->pje", by_joint, springs)
            matrix = np.eye(len(compliance)) + product.reshape(compliance.shape)
            displacement = displacement - np.linalg.solve(matrix, residual)
        return displacement.reshape(self._shape)

    @cached_property
    def stuck(self) -> SpringJoints:
        """Structure with springs that are the tangents of the joints for small motions from rest.

        They are not the tangents on the loading path, on which a joint may have closed last.
        """
        mean_and_wave = Resolution((0, 1), REST_SAMPLES)
        coefficients = np.zeros((self._shape[0], mean_and_wave.size, self._shape[1]))
        coefficients[:, 0] = self.displacement
        cycle = self._joints.settle(
            coefficients, mean_and_wave.basis, mean_and_wave.weights, mean_and_wave.lead
        )
        tangents = cycle.jacobian[:, 1, :, 1]
        return SpringJoints(self._model, 0.5 * (tangents + tangents.transpose(0, 2, 1)))

    @cached_property
    def sliding(self) -> SpringJoints:
        """Structure as in :attr:`stuck`, but with the normal springs alone.

        The first two directions of a joint are tangential, a third one is normal.
        """
        tangents, normal = np.zeros_like(self.stuck.tangents), slice(TANGENTIAL_DIRECTIONS, None)
        tangents[:, normal, normal] = self.stuck.tangents[:, normal, normal]
        return SpringJoints(self._model, tangents)

    def springs_like(self, slopes: Array) -> SpringJoints:
        """Return :attr:`stuck` or :attr:`sliding`, whichever is nearer to joint derivatives.

        ``slopes`` ``(j, m, d, m, d)`` are the derivatives of the joints' forces.
        """
        # Compare the first function of time that is not the mean.
        stuck, first = self.stuck.tangents, slopes[:, 1, :, 1]
        tangential = slice(TANGENTIAL_DIRECTIONS)
        present = np.vdot(stuck[:, tangential, tangential], first[:, tangential, tangential])
        at_rest = np.vdot(stuck[:, tangential, tangential], stuck[:, tangential, tangential])
        return self.sliding if present < STICKING_SHARE * at_rest else self.stuck

    def _settled(self, displacement: Array) -> Cycle:
        one = np.ones((1, 1))
        joints, directions = self._shape
        return self._joints.settle(displacement.reshape(joints, 1, directions), one, one, one)
