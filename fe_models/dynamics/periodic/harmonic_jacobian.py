"""Between the joints of a structure and its modes, harmonic by harmonic, and the Jacobian of that.

With the receptances R_k between joints, and the derivative J of the joints' forces by their
displacements, the balance of harmonics u - ... + R F(u) has the Jacobian 1 + R J. Where only joints
hold the structure, R is that of a structure held by springs κ in every direction of the joints, and
κ u is taken off the joints' forces at harmonic 0: see
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

# Share of the largest derivative below which one that differs from a spring's is rounding.
SAME = 1e-9


@dataclass(frozen=True)
class HarmonicTransfer:
    """Between coefficients of joints of so many ``directions`` and amplitudes of the modes."""

    resolution: Resolution
    receptance: Receptance
    directions: int

    @cached_property
    def joints(self) -> int:
        """How many there are."""
        return len(self.receptance.at_joints) // self.directions

    @cached_property
    def size(self) -> int:
        """Coefficients of all joints."""
        return self.joints * self.resolution.size * self.directions

    @property
    def mean(self) -> bool:
        """Whether harmonic 0 is one of the motion."""
        return self.resolution.harmonics[0] == 0

    @cached_property
    def held(self) -> float:
        """κ [N/mm], 0 where it is not needed."""
        return self.receptance.held if self.mean else 0.0

    def steady(self, angular: Array) -> SteadyMotion:
        """The structure at the angular frequencies ``(k,)`` of the harmonics [rad/s]."""
        return self.receptance.at(angular)

    def load_on_modes(self, load: ComplexArray, row: int) -> ComplexArray:
        """Forces on the modes ``(n,)`` by those on the structure, of the harmonic of this row."""
        return np.asarray(load @ self.receptance.at_points)

    def displacement(self, motion: ComplexArray) -> ComplexArray:
        """That of the structure ``(k, n)`` by a motion of its modes."""
        return self.receptance.displacement(motion)

    def shaped(self, unknowns: Array) -> Array:
        """Coefficients ``(j, m, d)`` from all in a row."""
        return unknowns.reshape(self.joints, self.resolution.size, self.directions)

    def on_modes(self, force: Array, unknowns: Array) -> ComplexArray:
        """Forces on the modes ``(k, n)``, of the opposite sign, by joints' ``force`` ``(j, m, d)``.

        It is their ``unknowns`` by which they are held at harmonic 0.
        """
        if self.held:
            force = force.copy()
            force[:, 0] -= self._holding(unknowns).reshape(-1, self.directions)
        return self.modal(force)

    def modal(self, force: Array) -> ComplexArray:
        """Forces on the modes ``(k, n)`` by coefficients ``(j, m, d)`` of forces on the joints."""
        if self._few:
            return _few_on_modes(force, self.receptance.at_joints, *self.resolution.places)
        return self.resolution.combined(by_function(force) @ self.receptance.at_joints)

    def at_joints(self, motion: ComplexArray) -> Array:
        """Coefficients ``(j m d,)`` of the joints' displacements, of a motion of the modes."""
        if self._few:
            few = np.empty((self.joints, self.resolution.size, self.directions))
            _few_at_joints(motion, self.receptance.at_joints, *self.resolution.places, few)
            return few.ravel()
        rows = self.resolution.separated(motion) @ self.receptance.at_joints.T
        return by_joint(rows, self.directions).ravel()

    @cached_property
    def _few(self) -> bool:
        """Whether a compiled loop over all harmonics, joints and modes is the shortest."""
        return len(self.resolution.harmonics) * self.receptance.at_joints.size <= FEW

    def mean_response(self, force: Array, unknowns: Array) -> Array:
        """Coefficients ``(j m d,)`` of the mean displacement by the mean of forces on joints.

        The forces are ``force`` ``(j, m, d)`` less those by which the ``unknowns`` are held.
        """
        response = np.zeros(self.size)
        mean = self.receptance.static_flexibility @ (force[:, 0].ravel() - self._holding(unknowns))
        self.shaped(response)[:, 0] = mean.reshape(-1, self.directions)
        return response

    def _holding(self, unknowns: Array) -> Array:
        """Forces ``(j d,)`` of the springs that hold the joints at harmonic 0."""
        return self.held * self.shaped(unknowns)[:, 0].ravel()


@dataclass(frozen=True)
class HarmonicJacobian:
    """1 + R (J - κ): what it does to a vector, and its assembly.

    ``steady`` is the structure at the harmonics of a frequency, ``slopes`` ``(j, m, d, m, d)`` J,
    and ``rest`` knows springs that are like the joints.
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
        """The inverse P of the matrix with springs D like the joints, for J, times a vector.

        P = (1 + R (D - κ))⁻¹ = 1 - R' (D - κ), with receptances R' of the structure stiffened by D.
        Where D does not hold it, springs κ' do: then D + κ' at harmonic 0. Of R' the high modes
        answer as at rest.
        """
        shaped = vector.reshape(self.slopes.shape[:3])
        force = shaped @ self._springs.tangents
        if self.transfer.mean:
            held = self._springs.stiffened.held - self.transfer.held
            force[:, 0] += held * shaped[:, 0]
        response = self._everywhere.respond(by_function(force))
        return vector - by_joint(response, self.transfer.directions).ravel()

    def preconditioned(self, vector: Array) -> Array:
        """P times the matrix times a vector: P (1 + R (J - κ)) = 1 + R' (J - D), in one step.

        Only joints that do not do as these springs have a part in it.
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
        """Joints ``(a,)`` whose J is not D, their J - D ``(a, m d, m d)``, and R' of these."""
        directions, springs = self.slopes.shape[2], self._springs
        held = springs.stiffened.held if self.transfer.mean else 0.0
        differing, excess = _excess(self.slopes, springs.tangents, held)
        places = (differing[:, None] * directions + np.arange(directions)).ravel()
        return differing, excess, self._residual(places)

    @cached_property
    def _everywhere(self) -> ResidualReceptance:
        return self._residual(slice(None))

    def _residual(self, some: np.ndarray | slice) -> ResidualReceptance:
        resolution = self.transfer.resolution
        return ResidualReceptance(self._springs.stiffened, resolution, self.steady.angular, some)

    def assembled(self) -> Array:
        """The matrix ``(n, n)``."""
        transfer = self.transfer
        slopes = self.slopes.reshape(*self.slopes.shape[:3], -1)
        jacobian = np.zeros((transfer.size, transfer.size))
        places = transfer.resolution.places
        _assemble(self.steady.between_joints(), slopes, transfer.held, *places, jacobian)
        return jacobian


@njit(cache=True, nogil=True)
def _largest(slopes: Array, tangents: Array, held: float) -> tuple[float, float]:
    """Largest derivative ``(m, d, m, d)`` of a joint, and largest difference from its springs'."""
    largest = most = 0.0
    for to, along, function, by in np.ndindex(slopes.shape):
        slope = float(slopes[to, along, function, by])
        spring = float(tangents[along, by]) if function == to else 0.0
        if function == 0 and to == 0 and by == along:
            spring += held
        largest, most = max(largest, abs(slope)), max(most, abs(slope - spring))
    return largest, most


@njit(cache=True, nogil=True)
def _excess(slopes: Array, tangents: Array, held: float) -> tuple[np.ndarray, Array]:
    """Joints ``(a,)`` whose derivatives ``(j, m, d, m, d)`` are not those of springs, and by how
    much ``(a, m d, m d)``; at harmonic 0 with springs that hold them."""
    joints, size, directions = slopes.shape[:3]
    # Derivatives of many harmonics are gigabytes: no copies but of what differs.
    each = np.empty((joints, 2))
    for joint in range(joints):
        each[joint, 0], each[joint, 1] = _largest(slopes[joint], tangents[joint], held)
    differing = np.flatnonzero(each[:, 1] > SAME * each[:, 0].max())
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
    """Amplitudes of forces on modes ``(k, n)`` by coefficients of joints' forces ``(j, m, d)``."""
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
    """Write the coefficients ``(j, m, d)`` of joints by the amplitudes of modes ``(k, n)``."""
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
    """1 + R (J - κ), added to ``jacobian`` of zeros.

    ``between`` ``(k, j d, j d)`` R; ``slopes`` ``(j, m, d, m d)`` J of the joints' forces, from
    which ``held`` κ is taken off at harmonic 0.
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
