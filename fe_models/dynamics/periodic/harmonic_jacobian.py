"""Transfer between joints and modes, harmonic by harmonic, and the Jacobian of the balance.

Let R_k be the receptances between joints, and J the derivative of the joints' forces with respect
to their displacements. Then the harmonic balance u - ... + R F(u) has the Jacobian 1 + R J. Where
only joints hold the structure, R is that of a structure held by springs κ in every direction of the
joints, and κ u is subtracted from the joints' forces at harmonic 0: see
:mod:`fe_models.dynamics.periodic.receptance`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit

from fe_models.dynamics.joint_rest import Rest, SpringJoints
from fe_models.dynamics.periodic.harmonics import ComplexArray, Resolution, by_function, by_joint
from fe_models.dynamics.periodic.modal_inverse import FEW
from fe_models.dynamics.periodic.receptance import Receptance, SteadyMotion
from fe_models.dynamics.periodic.static_residual import ResidualReceptance
from sa_solver.types import Array

# Difference between a derivative and that of a spring, relative to the largest derivative, below
# which it counts as rounding.
SPRING_TOLERANCE = 1e-9


@dataclass(frozen=True)
class HarmonicTransfer:
    """Transfer between joint coefficients and complex amplitudes of the modes.

    Parameters
    ----------
    resolution
        Harmonics of the motion and samples of a period.
    receptance
        The structure.
    directions
        Number of directions of each joint.
    """

    resolution: Resolution
    receptance: Receptance
    directions: int

    @cached_property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.receptance.at_joints) // self.directions

    @cached_property
    def size(self) -> int:
        """Number of coefficients of all joints."""
        return self.joints * self.resolution.size * self.directions

    @property
    def mean(self) -> bool:
        """True if the motion has harmonic 0."""
        return self.resolution.harmonics[0] == 0

    @cached_property
    def holding_stiffness(self) -> float:
        """Stiffness κ [N/mm] of the holding springs; 0 where none are needed."""
        return self.receptance.holding_stiffness if self.mean else 0.0

    def steady(self, angular: Array) -> SteadyMotion:
        """Return the structure at the angular frequencies ``(k,)`` [rad/s] of the harmonics."""
        return self.receptance.at(angular)

    def load_on_modes(self, load: ComplexArray, row: int) -> ComplexArray:
        """Return modal forces ``(n,)`` for a load on the structure in the harmonic of a row."""
        return np.asarray(load @ self.receptance.at_points)

    def displacement(self, motion: ComplexArray) -> ComplexArray:
        """Return the structure's displacements ``(k, n)`` for displacements of its modes."""
        return self.receptance.displacement(motion)

    def shaped(self, unknowns: Array) -> Array:
        """Return coefficients in one row as ``(j, m, d)``."""
        return unknowns.reshape(self.joints, self.resolution.size, self.directions)

    def on_modes(self, force: Array, unknowns: Array) -> ComplexArray:
        """Return the modal forces ``(k, n)`` of joints, with the opposite sign.

        ``force`` ``(j, m, d)`` are the coefficients of the joints' forces. The holding springs act
        at harmonic 0 on the displacements ``unknowns``.
        """
        if self.holding_stiffness:
            force = force.copy()
            force[:, 0] -= self._holding(unknowns).reshape(-1, self.directions)
        return self.modal(force)

    def modal(self, force: Array) -> ComplexArray:
        """Return modal forces ``(k, n)`` for coefficients ``(j, m, d)`` of forces on the joints."""
        if self._few:
            force = np.ascontiguousarray(force)  # so that the loop is compiled only once
            return _few_on_modes(force, self.receptance.at_joints, *self.resolution.places)
        return self.resolution.complex_from_real(by_function(force) @ self.receptance.at_joints)

    def at_joints(self, motion: ComplexArray) -> Array:
        """Return coefficients ``(j m d,)`` of the joints' displacements for a modal motion."""
        if self._few:
            few = np.empty((self.joints, self.resolution.size, self.directions))
            _few_at_joints(motion, self.receptance.at_joints, *self.resolution.places, few)
            return few.ravel()
        rows = self.resolution.real_from_complex(motion) @ self.receptance.at_joints.T
        return by_joint(rows, self.directions).ravel()

    @cached_property
    def _few(self) -> bool:
        """True if a compiled loop over harmonics, joints and modes beats matrix products."""
        return len(self.resolution.harmonics) * self.receptance.at_joints.size <= FEW

    def mean_response(self, force: Array, unknowns: Array) -> Array:
        """Return coefficients ``(j m d,)`` of the mean displacement due to mean forces on joints.

        The forces are ``force`` ``(j, m, d)`` less those of the holding springs on the
        displacements ``unknowns``.
        """
        response = np.zeros(self.size)
        mean = self.receptance.static_flexibility @ (force[:, 0].ravel() - self._holding(unknowns))
        self.shaped(response)[:, 0] = mean.reshape(-1, self.directions)
        return response

    def _holding(self, unknowns: Array) -> Array:
        """Return the forces ``(j d,)`` of the springs that hold the joints at harmonic 0."""
        return self.holding_stiffness * self.shaped(unknowns)[:, 0].ravel()


@dataclass(frozen=True)
class HarmonicJacobian:
    """Jacobian 1 + R (J - κ): its products with vectors, its preconditioner, its assembly.

    Parameters
    ----------
    transfer
        Transfer between joints and modes.
    rest
        Static equilibrium of the joints, which knows springs that resemble the joints.
    steady
        The structure at the harmonics of a frequency.
    slopes
        Derivatives J ``(j, m, d, m, d)`` [N/mm] of the joints' forces.
    """

    transfer: HarmonicTransfer
    rest: Rest
    steady: SteadyMotion
    slopes: Array

    def __matmul__(self, vector: Array) -> Array:
        joints = len(self.slopes)
        size = self.slopes.shape[1] * self.slopes.shape[2]
        columns = vector.reshape(joints, size, 1)
        force = (self.slopes.reshape(joints, size, size) @ columns).reshape(self.slopes.shape[:3])
        motion = self.steady.vibrate(self.transfer.on_modes(force, vector))
        response = vector + self.transfer.at_joints(motion)
        if self.transfer.mean:
            response += self.transfer.mean_response(force, vector)
        return response

    def precondition(self, vector: Array) -> Array:
        """Return P times a vector, with P the inverse of the Jacobian for springs D instead of J.

        P = (1 + R (D - κ))⁻¹ = 1 - R' (D - κ), with receptances R' of the structure stiffened by D,
        springs that resemble the joints. If D does not hold the structure, springs κ' do: then D +
        κ' replaces D at harmonic 0. In R' the high modes respond quasi-statically.
        """
        shaped = vector.reshape(self.slopes.shape[:3])
        force = shaped @ self._springs.tangents
        if self.transfer.mean:
            held = self._springs.stiffened.holding_stiffness - self.transfer.holding_stiffness
            force[:, 0] += held * shaped[:, 0]
        response = self._at_all_joints.respond(by_function(force))
        return vector - by_joint(response, self.transfer.directions).ravel()

    def preconditioned(self, vector: Array) -> Array:
        """Return P times the Jacobian times a vector: P (1 + R (J - κ)) = 1 + R' (J - D).

        Only joints that differ from the springs D contribute.
        """
        joints, excess, receptance = self._differing
        shaped = vector.reshape(self.slopes.shape[:3])
        force = (excess @ shaped[joints].reshape(*excess.shape[:2], 1)).reshape(
            -1, *shaped.shape[1:]
        )
        response = receptance.respond(by_function(force))
        return vector + by_joint(response, self.transfer.directions).ravel()

    @cached_property
    def _springs(self) -> SpringJoints:
        return self.rest.springs_like(self.slopes)

    @cached_property
    def _differing(self) -> tuple[np.ndarray, Array, ResidualReceptance]:
        """Joints ``(a,)`` whose J differs from D, their J - D ``(a, m d, m d)``, and their R'."""
        directions, springs = self.slopes.shape[2], self._springs
        holding = springs.stiffened.holding_stiffness if self.transfer.mean else 0.0
        differing, excess = _excess(self.slopes, springs.tangents, holding)
        places = (differing[:, None] * directions + np.arange(directions)).ravel()
        return differing, excess, self._residual_receptance(places)

    @cached_property
    def _at_all_joints(self) -> ResidualReceptance:
        return self._residual_receptance(slice(None))

    def _residual_receptance(self, some: np.ndarray | slice) -> ResidualReceptance:
        resolution = self.transfer.resolution
        return ResidualReceptance(self._springs.stiffened, resolution, self.steady.angular, some)

    def assembled(self) -> Array:
        """Return the matrix ``(n, n)``."""
        transfer = self.transfer
        slopes = self.slopes.reshape(*self.slopes.shape[:3], -1)
        jacobian = np.zeros((transfer.size, transfer.size))
        places = transfer.resolution.places
        _assemble(
            self.steady.between_joints(), slopes, transfer.holding_stiffness, *places, jacobian
        )
        return jacobian


@njit(cache=True, nogil=True)
def _largest_derivative(slopes: Array, tangents: Array, held: float) -> tuple[float, float]:
    """Return the largest derivative of a joint, and its largest difference from its springs."""
    largest = largest_difference = 0.0
    for to, along, function, by in np.ndindex(slopes.shape):
        slope = float(slopes[to, along, function, by])
        spring = float(tangents[along, by]) if function == to else 0.0
        if function == 0 and to == 0 and by == along:
            spring += held
        largest, largest_difference = (
            max(largest, abs(slope)),
            max(largest_difference, abs(slope - spring)),
        )
    return largest, largest_difference


@njit(cache=True, nogil=True)
def _excess(slopes: Array, tangents: Array, held: float) -> tuple[np.ndarray, Array]:
    """Return the joints ``(a,)`` that differ from their springs, and by how much ``(a, m d, m d)``.

    Parameters
    ----------
    slopes
        Derivatives ``(j, m, d, m, d)`` of the joints' forces.
    tangents
        Springs ``(j, d, d)``.
    held
        Stiffness of the holding springs at harmonic 0.
    """
    joints, size, directions = slopes.shape[:3]
    # The derivatives of many harmonics take gigabytes: only copy those that differ.
    each = np.empty((joints, 2))
    for joint in range(joints):
        each[joint, 0], each[joint, 1] = _largest_derivative(slopes[joint], tangents[joint], held)
    differing = np.flatnonzero(each[:, 1] > SPRING_TOLERANCE * each[:, 0].max())
    excess = slopes[differing]
    for place in range(len(differing)):
        for along in range(directions):
            for function in range(size):
                excess[place, function, along, function] -= tangents[differing[place], along]
            excess[place, 0, along, 0, along] -= held
    return differing, excess.reshape(len(differing), size * directions, size * directions)


@njit(cache=True)
def _few_on_modes(
    force: Array, at_joints: Array, cosines: np.ndarray, sines: np.ndarray
) -> ComplexArray:
    """Return modal forces ``(k, n)`` for coefficients ``(j, m, d)`` of the joints' forces."""
    joints, _, directions = force.shape
    on_modes = np.zeros((len(cosines), at_joints.shape[1]), np.complex128)
    for k in range(len(cosines)):
        for joint in range(joints):
            for direction in range(directions):
                sine = force[joint, sines[k], direction] if sines[k] >= 0 else 0.0
                amplitude = complex(force[joint, cosines[k], direction], -sine)
                for mode in range(at_joints.shape[1]):
                    on_modes[k, mode] += amplitude * at_joints[joint * directions + direction, mode]
    return on_modes


@njit(cache=True)
def _few_at_joints(
    motion: ComplexArray, at_joints: Array, cosines: np.ndarray, sines: np.ndarray, few: Array
) -> None:
    """Write coefficients ``(j, m, d)`` of the joints for complex amplitudes ``(k, n)`` of modes."""
    joints, _, directions = few.shape
    for k in range(len(cosines)):
        for joint in range(joints):
            for direction in range(directions):
                amplitude = 0.0j
                for mode in range(at_joints.shape[1]):
                    amplitude += motion[k, mode] * at_joints[joint * directions + direction, mode]
                few[joint, cosines[k], direction] = amplitude.real
                if sines[k] >= 0:
                    few[joint, sines[k], direction] = -amplitude.imag


@njit(cache=True, nogil=True)
def _assemble(
    between: ComplexArray,
    slopes: Array,
    held: float,
    cosines: np.ndarray,
    sines: np.ndarray,
    jacobian: Array,
) -> None:
    """Add 1 + R (J - κ) to ``jacobian``, which is zero at first.

    ``between`` ``(k, j d, j d)`` is R, ``slopes`` ``(j, m, d, m d)`` is J of the joints' forces,
    and ``held`` is κ, which is subtracted at harmonic 0.
    """
    joints, size, directions, columns = slopes.shape
    for k in range(len(cosines)):
        cosine, sine = cosines[k], sines[k]
        for to in range(joints * directions):
            to_joint, to_direction = to // directions, to % directions
            row = (to_joint * size + cosine) * directions + to_direction
            other = (to_joint * size + sine) * directions + to_direction
            for joint in range(joints):
                first = joint * columns
                for direction in range(directions):
                    by = between[k, to, joint * directions + direction]
                    in_phase = slopes[joint, cosine, direction]
                    for c in range(columns):
                        jacobian[row, first + c] += by.real * in_phase[c]
                    if sine < 0:
                        jacobian[row, first + direction] -= by.real * held
                        continue
                    quadrature = slopes[joint, sine, direction]
                    for c in range(columns):
                        jacobian[row, first + c] += by.imag * quadrature[c]
                        jacobian[other, first + c] += (
                            by.real * quadrature[c] - by.imag * in_phase[c]
                        )
    for row in range(len(jacobian)):
        jacobian[row, row] += 1.0
