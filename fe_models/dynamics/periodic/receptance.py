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

from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.periodic.harmonics import ComplexArray
from fe_models.dynamics.periodic.modal_inverse import (
    MixedModes,
    ModalInverse,
    ModesWithDashpots,
    UnmixedModes,
    flexibilities,
)
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
# Inertia and stiffness of a mode over what is left of them without dashpots, at most, for these to
# be taken apart: nearer to a natural frequency without other damping too many digits are lost.
MOST_RESONANT = 1e5


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
        self._inverse = structure.inverse_at(angular[self._moving :])

    def respond(self, force: ComplexArray) -> ComplexArray:
        """Displacements under forces; held at ω = 0."""
        response = self.vibrate(force)
        if self._moving:
            response[0] = self.structure.respond_at_rest(force[0].real)
        return response

    def vibrate(self, force: ComplexArray) -> ComplexArray:
        """:meth:`respond` without what constant forces do: 0 at ω = 0."""
        moving = self._moving
        if not moving:
            return self._inverse.times(force)
        response = np.empty(force.shape, dtype=complex)
        response[:moving], response[moving:] = 0.0, self._inverse.times(force[moving:])
        return response

    def per_force(self, weights: ComplexArray) -> ComplexArray:
        """wᵀ x per force on the modes ``(k, n)``, of ``weights`` w ``(k, n)`` at ω > 0."""
        return self._inverse.turned(weights)

    def stiffness_slope(self, motion: ComplexArray) -> ComplexArray:
        """∂(K + iD + iωC - ω²M)/∂ω x: forces that a motion needs more per rad/s."""
        structure = self.structure
        if structure.damping.ndim == 1:
            return _stiffness_slopes(motion, self.angular, structure.damping)
        lagging = 1j * structure.damp(motion)
        return np.asarray(lagging - (2.0 * self.angular)[:, None] * motion)

    def between_joints(self) -> ComplexArray:
        """Displacements of joints by forces on joints ``(k, j d, j d)`` [mm/N]; held at ω = 0."""
        at_joints, moving = self.structure.at_joints, self._moving
        size = len(at_joints)
        between = np.empty((len(self.angular), size, size), dtype=complex)
        if moving:
            between[0] = self.structure.static_flexibility
        self._inverse.between(at_joints, between[moving:])
        return between


@njit(cache=True)
def _stiffness_slopes(motion: ComplexArray, angular: Array, damping: Array) -> ComplexArray:
    """(i c_n - 2 ω) x ``(k, n)``."""
    slopes = np.empty_like(motion)
    for k in range(len(angular)):
        for n in range(len(damping)):
            slopes[k, n] = complex(-2.0 * angular[k], damping[n]) * motion[k, n]
    return slopes


def _is_diagonal(damping: Array, largest: float) -> bool:
    """Whether damping ``(n, n)``, of matrices of so large values, does not mix the modes."""
    between_modes = np.abs(damping - np.diag(np.diag(damping))).max()
    return bool(between_modes <= DIAGONAL * largest)


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
        largest, unmixed = np.abs(damping).max(), _is_diagonal(loss, np.abs(loss).max())
        diagonal = not mixed or (unmixed and _is_diagonal(damping, largest))
        # Viscous and structural (n,), or (n, n) where one of them mixes the modes.
        self.damping, self.loss = (
            np.diag(part).real.copy() if diagonal else part for part in (damping, loss)
        )
        # Rows of dashpots (r, n), where nothing else mixes the modes.
        self._dashpots: Array | None = None
        if not diagonal and unmixed and model.dashpots is not None:
            rows = model.dashpots @ shapes
            few = len(rows) <= len(squares)
            if few and _is_diagonal(damping - rows.T @ rows, largest):
                self._dashpots = rows
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

    def inverse_at(self, angular: Array) -> ModalInverse:
        """Displacements of modes by forces on them, at ``k`` frequencies above 0 [rad/s]."""
        if self.damping.ndim == 1:
            return UnmixedModes(flexibilities(angular, self.squares, self.damping, self.loss))
        if self._dashpots is not None:
            alone, loss = self._without_dashpots, np.diag(self.loss)
            flexibility = flexibilities(angular, self.squares, alone, loss)
            terms = self.squares + np.square(angular)[:, None]
            if (np.abs(flexibility) * terms).max(initial=0.0) < MOST_RESONANT:
                return ModesWithDashpots(flexibility, angular, self._dashpots)
        return MixedModes(self.squares, self.damping, self.loss, angular)

    def damp(self, motion: ComplexArray) -> ComplexArray:
        """C x ``(k, n)``, where damping mixes the modes."""
        if self._dashpots is None:
            return np.asarray(motion @ self.damping.T)
        by_dashpots = (motion @ self._dashpots.T) @ self._dashpots
        return np.asarray(self._without_dashpots * motion + by_dashpots)

    @property
    def _without_dashpots(self) -> Array:
        """Damping of each mode ``(n,)`` by all else."""
        assert self._dashpots is not None
        return np.asarray(np.diag(self.damping) - np.square(self._dashpots).sum(axis=0))

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
