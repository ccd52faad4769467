"""Joints of a structure at rest under a constant load, and the structure with their stiffness."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.periodic.harmonics import Resolution
from fe_models.dynamics.periodic.joints import Cycle, PeriodicJoints
from fe_models.dynamics.periodic.receptance import Receptance
from sa_solver.types import Array

# Of rest under a constant load, as shares of what loads and joints do to the joints: a guess that
# Newton's method on all harmonics improves. More iterations mean that nothing closes.
TOLERANCE, MAX_ITERATIONS = 1e-12, 60
# First stiffness added to joints that hold nothing, over that of the structure they are held by.
SOFT = 1e-3
# Of a period without motion.
SMALL_SAMPLES = 8
# Directions along a joint, at most.
ALONG = 2
# Of the stiffness that resists along joints at rest: below it they are nearer to sliding.
HALF = 0.5


@dataclass(frozen=True)
class SpringJoints:
    """A structure whose joints are springs of the symmetric ``tangents`` ``(j, d, d)`` [N/mm]."""

    model: DynamicModel
    tangents: Array

    @cached_property
    def stiffened(self) -> Receptance:
        """The structure with these springs; damping between modes left out."""
        connection = self.model.connection
        by_joint = connection.reshape(*self.tangents.shape[:2], -1)
        springs = (self.tangents @ by_joint).reshape(connection.shape)
        stiffness = self.model.stiffness + connection.T @ springs
        return Receptance(replace(self.model, stiffness=stiffness), mixed=False)


class Rest:
    """The joints at rest under a constant load ``(n,)`` on the modes."""

    def __init__(
        self, model: DynamicModel, receptance: Receptance, joints: PeriodicJoints, load: Array
    ) -> None:
        self._model, self._receptance, self._joints, self._load = model, receptance, joints, load
        self._shape = len(model.connection) // joints.directions, joints.directions

    @cached_property
    def loaded(self) -> Array:
        """Displacement ``(j d,)`` of the joints under the load without them; held."""
        motion = self._receptance.at(np.zeros(1)).respond(self._load[None])
        return np.asarray((motion @ self._receptance.at_joints.T)[0].real)

    @cached_property
    def displacement(self) -> Array:
        """Displacement ``(j, d)`` of the joints at rest, or a guess of it; 0 without a load.

        Newton's method. Where joints are open, nothing may hold the structure: a spring added to
        each joint, ever softer, then lets it go as far as it must to close them.
        """
        compliance, held = self._receptance.static_flexibility, self._receptance.held
        if not (self._load.any() and compliance.any()):
            # Joints from sector to sector are not moved by what is the same in all.
            return np.zeros(self._shape)
        displacement = np.zeros(len(compliance))
        softest = 1.0 / float(np.diagonal(compliance).mean())
        previous, added = np.inf, 10.0 * SOFT * softest
        for _ in range(MAX_ITERATIONS):
            cycle = self._settled(displacement)
            force = cycle.force.ravel() - held * displacement
            residual = displacement - self.loaded + compliance @ force
            norm = float(np.linalg.norm(residual))
            by_joints = float(np.linalg.norm(compliance @ cycle.force.ravel()))
            if norm <= TOLERANCE * (np.linalg.norm(self.loaded) + by_joints):
                break
            added = 0.1 * added if norm < previous else SOFT * softest
            previous = norm
            tangents = cycle.jacobian.reshape(*self._shape, self._shape[1])
            springs = tangents + (added - held) * np.eye(self._shape[1])
            by_joint = compliance.reshape(len(compliance), *self._shape)
            product = np.einsum("pjd,jde->pje", by_joint, springs)
            matrix = np.eye(len(compliance)) + product.reshape(compliance.shape)
            displacement = displacement - np.linalg.solve(matrix, residual)
        return displacement.reshape(self._shape)

    @cached_property
    def stuck(self) -> SpringJoints:
        """As stiff as the joints are against small motions from rest.

        Not that of the way to rest, on which a joint may have touched last.
        """
        mean_and_wave = Resolution((0, 1), SMALL_SAMPLES)
        coefficients = np.zeros((self._shape[0], mean_and_wave.size, self._shape[1]))
        coefficients[:, 0] = self.displacement
        cycle = self._joints.settle(
            coefficients, mean_and_wave.basis, mean_and_wave.weights, mean_and_wave.lead
        )
        tangents = cycle.jacobian[:, 1, :, 1]
        return SpringJoints(self._model, 0.5 * (tangents + tangents.transpose(0, 2, 1)))

    @cached_property
    def sliding(self) -> SpringJoints:
        """:attr:`stuck` without what resists along the joints: a third direction is normal."""
        tangents, normal = np.zeros_like(self.stuck.tangents), slice(ALONG, None)
        tangents[:, normal, normal] = self.stuck.tangents[:, normal, normal]
        return SpringJoints(self._model, tangents)

    def springs_like(self, slopes: Array) -> SpringJoints:
        """Of the two whichever is nearer to joints of the derivatives ``(j, m, d, m, d)``."""
        # By a function of the first wave; the very first may be the mean.
        stuck, first, along = self.stuck.tangents, slopes[:, 1, :, 1], slice(ALONG)
        held = np.vdot(stuck[:, along, along], first[:, along, along])
        whole = np.vdot(stuck[:, along, along], stuck[:, along, along])
        return self.sliding if held < HALF * whole else self.stuck

    def _settled(self, displacement: Array) -> Cycle:
        one = np.ones((1, 1))
        joints, directions = self._shape
        return self._joints.settle(displacement.reshape(joints, 1, directions), one, one, one)
