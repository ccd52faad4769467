"""Steady motion of a structure under harmonic forces: (K + iD + iωC - ω²M)⁻¹, by its modes.

In the coordinates of its modes without joints the structure is diagonal if its damping is that of
the modes, and small otherwise: none is left out. Complex amplitudes x stand for Re x exp(iωt), and
``k`` frequencies ω [rad/s] ascend from 0 or above; structural damping D is not there at 0.

At ω = 0 a structure that only its joints hold is singular. It is then solved with springs of one
stiffness κ, ``held``, in every direction of the joints, and whoever uses it takes κ times the
joints' displacement off their force: the same equations, but regular.
"""

from __future__ import annotations

from copy import copy

import numpy as np
import scipy.linalg as sl
from numba import njit

from fe_models.dynamics.harmonics import ComplexArray
from fe_models.dynamics.model import DynamicModel
from sa_solver.errors import InputError
from sa_solver.types import Array

# Square of a natural frequency, over the largest one, below which a mode is a rigid motion: above
# rounding, and far below what any elastic body's first mode is.
RIGID = 1e-13
# Stiffness that holds what only joints hold, over that of the structure: soft, so that the balance
# of forces stands out of the rounding of what the springs take (with 1, 1e-11 of it is left, with
# this 3e-13 on pads of 121 nodes).
HELD = 1e-2
# Damping between different modes, over the largest, below which there is none: rounding.
DIAGONAL = 1e-10
# Products of frequencies, directions of joints and modes up to which calls cost more than loops.
FEW = 4000


class ReceptanceError(InputError):
    """A structure without a steady motion."""


class SteadyMotion:
    """The structure at frequencies ``(k,)`` that ascend from 0 or above: one inverse for all uses.

    Displacements and forces are those of the modes ``(k, n)``.
    """

    def __init__(self, structure: Receptance, angular: Array) -> None:
        self.structure, self.angular = structure, angular
        # The first frequency that is not 0.
        self._moving = int(angular[0] == 0.0)
        moving, damping, squares = angular[self._moving :], structure.damping, structure.squares
        loss = structure.loss
        # Whether damping mixes the modes: then their stiffnesses are matrices (k, n, n), and
        # otherwise their flexibilities are numbers (k, n).
        self._mixed = damping.ndim == 2
        if not self._mixed:
            self._flexibility = _flexibilities(moving, squares, damping, loss)
        else:
            turning = moving[:, None, None]
            inertia = np.diag(squares) - turning * turning * np.eye(len(squares))
            self._stiffness = inertia + 1j * (turning * damping + loss)

    def respond(self, force: ComplexArray) -> ComplexArray:
        """Displacements under forces; held at ω = 0."""
        response = self.vibrate(force)
        if self._moving:
            response[0] = self.structure.respond_at_rest(force[0].real)
        return response

    def vibrate(self, force: ComplexArray) -> ComplexArray:
        """:meth:`respond` without what constant forces do: 0 at ω = 0."""
        moving = self._moving
        if not self._mixed and not moving:
            return np.asarray(force * self._flexibility)
        response = np.empty(force.shape, dtype=complex)
        response[:moving] = 0.0
        if not self._mixed:
            np.multiply(force[moving:], self._flexibility, out=response[moving:])
        else:
            response[moving:] = np.linalg.solve(self._stiffness, force[moving:, :, None])[..., 0]
        return response

    def per_force(self, weights: ComplexArray) -> ComplexArray:
        """wᵀ x per force on the modes ``(k, n)``, of ``weights`` w ``(k, n)`` at ω > 0."""
        if not self._mixed:
            return np.asarray(weights * self._flexibility)
        turned = self._stiffness.transpose(0, 2, 1)
        return np.asarray(np.linalg.solve(turned, weights[..., None])[..., 0])

    def stiffness_slope(self, motion: ComplexArray) -> ComplexArray:
        """∂(K + iD + iωC - ω²M)/∂ω x: forces that a motion needs more per rad/s."""
        damping = self.structure.damping
        if not self._mixed:
            return _stiffness_slopes(motion, self.angular, damping)
        return np.asarray(1j * (motion @ damping.T) - (2.0 * self.angular)[:, None] * motion)

    def between_joints(self) -> ComplexArray:
        """Displacements of joints by forces on joints ``(k, j d, j d)`` [mm/N]; held at ω = 0."""
        at_joints, moving = self.structure.at_joints, self._moving
        on_modes = at_joints.conj().T
        size = len(at_joints)
        between = np.empty((len(self.angular), size, size), dtype=complex)
        if moving:
            between[0] = self.structure.static_flexibility
        if not self._mixed:
            if len(self._flexibility) * at_joints.size <= FEW:
                _few_between_joints(self._flexibility, at_joints, between[moving:])
                return between
            inverse = self._flexibility[:, None, :]
            if np.iscomplexobj(at_joints):
                between[moving:] = (at_joints * inverse) @ on_modes
                return between
            # Two real products cost half of a complex one.
            between.real[moving:] = (at_joints * inverse.real) @ on_modes
            between.imag[moving:] = (at_joints * inverse.imag) @ on_modes
        else:
            between[moving:] = at_joints @ np.linalg.solve(self._stiffness, on_modes)
        return between


@njit(cache=True)
def _few_between_joints(flexibility: ComplexArray, at_joints: Array, between: ComplexArray) -> None:
    """Write what so many frequencies ``(k, n)`` make between joints ``(k, j d, j d)``."""
    for k in range(len(flexibility)):
        for to in range(len(at_joints)):
            for by in range(len(at_joints)):
                response = 0.0j
                for n in range(at_joints.shape[1]):
                    response += flexibility[k, n] * (at_joints[to, n] * np.conj(at_joints[by, n]))
                between[k, to, by] = response


@njit(cache=True)
def _stiffness_slopes(motion: ComplexArray, angular: Array, damping: Array) -> ComplexArray:
    """(i c_n - 2 ω) x ``(k, n)``."""
    slopes = np.empty_like(motion)
    for k in range(len(angular)):
        for n in range(len(damping)):
            slopes[k, n] = complex(-2.0 * angular[k], damping[n]) * motion[k, n]
    return slopes


@njit(cache=True)
def _flexibilities(angular: Array, squares: Array, damping: Array, loss: Array) -> ComplexArray:
    """1 / (ω_n² - ω² + i (ω c_n + d_n)) ``(k, n)``."""
    flexibilities = np.empty((len(angular), len(squares)), np.complex128)
    for k in range(len(angular)):
        for n in range(len(squares)):
            lagging = angular[k] * damping[n] + loss[n]
            stiffness = complex(squares[n] - angular[k] * angular[k], lagging)
            flexibilities[k, n] = 1.0 / stiffness
    return flexibilities


def _is_diagonal(damping: Array) -> bool:
    """Whether damping ``(n, n)`` does not mix the modes."""
    between_modes = np.abs(damping - np.diag(np.diag(damping))).max()
    return bool(between_modes <= DIAGONAL * np.abs(damping).max())


class Receptance:
    """What harmonic forces do to a structure, in displacements and forces of its modes.

    With ``mixed`` false, damping between different modes is left out. Matrices may be Hermitian,
    those of a sector in a wave: then shapes are complex.
    """

    def __init__(self, model: DynamicModel, *, mixed: bool = True) -> None:
        try:
            squares, shapes = sl.eigh(model.stiffness, model.mass)
        except np.linalg.LinAlgError:
            raise ReceptanceError(
                "the mass matrix is not positive definite: give every point mass"
            ) from None
        self.model = model
        # Rows are points and joints, columns modes (n, n) and (j d, n).
        self.at_points, self.at_joints = shapes, model.connection @ shapes
        rigid = squares < RIGID * squares[-1]
        self.squares = np.where(rigid, 0.0, squares)
        damping = shapes.conj().T @ model.damping @ shapes
        loss = np.zeros_like(damping)
        if model.structural is not None:
            loss = shapes.conj().T @ model.structural @ shapes
        diagonal = not mixed or (_is_diagonal(damping) and _is_diagonal(loss))
        # Viscous and structural (n,), or (n, n) where one of them mixes the modes.
        self.damping, self.loss = (
            np.diag(part).real.copy() if diagonal else part for part in (damping, loss)
        )
        self.held = self._holding_stiffness() if rigid.any() else 0.0
        try:
            self.static_factors = sl.cho_factor(
                np.diag(self.squares) + self.held * self.at_joints.conj().T @ self.at_joints
            )
        except np.linalg.LinAlgError:
            raise ReceptanceError(
                "the structure moves freely without moving a joint: hold it"
            ) from None
        # Displacements of joints by constant forces on joints (j d, j d), held.
        self.static_flexibility = self.at_joints @ sl.cho_solve(
            self.static_factors, self.at_joints.conj().T
        )
        # The last one asked for: along a branch it hardly changes.
        self._residuals: dict[int, Array] = {}

    def of(self, harmonic: int) -> Receptance:
        """That of a harmonic: the same for all."""
        return self

    def at(self, angular: Array) -> SteadyMotion:
        """The structure at ``k`` frequencies [rad/s]."""
        return SteadyMotion(self, angular)

    def less_damped(self, rate: float) -> Receptance:
        """The structure with C - ``rate`` M [1/s] in the place of its damping."""
        other = copy(self)
        share = np.eye(len(self.squares)) if self.damping.ndim == 2 else 1.0
        other.damping = self.damping - rate * share
        return other

    def displacement(self, motion: ComplexArray) -> ComplexArray:
        """That of the structure ``(k, n)`` by a motion of its modes."""
        # Real shapes are not made complex for that: of many modes the dearer part.
        at_points = self.at_points.T
        return np.asarray(motion.real @ at_points + 1j * (motion.imag @ at_points))

    def respond_at_rest(self, force: Array) -> Array:
        """Displacements ``(n,)`` under constant forces ``(n,)``, held."""
        if not self.held:
            return np.asarray(force / self.squares)
        # Of every product with a Jacobian: numbers that are not finite are found in what it leaves.
        return np.asarray(sl.cho_solve(self.static_factors, force, check_finite=False))

    def residual_flexibility(self, count: int) -> Array:
        """Displacements of joints by constant forces on joints ``(j d, j d)``, by all modes but so
        many of the lowest."""
        if count not in self._residuals:
            high = self.at_joints[:, count:]
            self._residuals = {count: (high / self.squares[count:]) @ high.T}
        return self._residuals[count]

    def _holding_stiffness(self) -> float:
        """κ, a share of what the structure opposes to its joints where it strains."""
        strained = self.squares > 0.0
        at_joints = self.at_joints[:, strained]
        flexibility = float((np.abs(at_joints) ** 2 / self.squares[strained]).sum())
        if flexibility > 0.0:
            return HELD * len(at_joints) / flexibility
        return 1.0
