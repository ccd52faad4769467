"""Steady motion of a structure under harmonic forces: (K + iD + iωC - ω²M)⁻¹, by its modes.

In the coordinates of all its modes without joints, the structure is diagonal if its damping is
modal; no mode is left out. Complex amplitudes x stand for Re x exp(iωt). The ``k`` frequencies ω
[rad/s] ascend from 0 or above. Structural damping D does not act at ω = 0.

At ω = 0, a structure that only its joints hold is singular. It is then solved with auxiliary
springs of one stiffness κ, ``holding_stiffness``, in every direction of the joints, and the caller
subtracts κ times the joints' displacements from their forces. The equations are the same, but
regular.
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

# Squared natural frequency, over the largest one, below which a mode is a rigid motion. The limit
# is above rounding, and far below the first mode of any elastic body.
RIGID = 1e-13
# Stiffness of the holding springs over that of the structure. They are soft, so that the residual
# of the balance stands out of the rounding errors of their forces: with 1 the residual is 1e-11 of
# them, with this value 3e-13, on pads of 121 nodes.
HOLDING = 1e-2
# Damping between different modes, over the largest, below which it is rounding.
DIAGONAL = 1e-10
# Largest ratio of inertia and stiffness terms to their sum for which dashpots are treated by the
# Woodbury formula. Closer to a natural frequency without other damping it would lose too many
# digits.
MAX_CANCELLATION = 1e5


class ReceptanceError(InputError):
    """Error for a structure that has no steady motion."""


class SteadyMotion:
    """Structure at frequencies ``(k,)`` that ascend from 0 or above, with one inverse for all uses.

    Displacements and forces are modal, ``(k, n)``.
    """

    def __init__(self, structure: Receptance, angular: Array) -> None:
        self.structure, self.angular = structure, angular
        # Index of the first frequency that is not 0.
        self._moving = int(angular[0] == 0.0)
        self._inverse = structure.inverse_at(angular[self._moving :])

    def respond(self, force: ComplexArray) -> ComplexArray:
        """Return displacements due to forces; at ω = 0 with the holding springs."""
        response = self.vibrate(force)
        if self._moving:
            response[0] = self.structure.respond_at_rest(force[0].real)
        return response

    def vibrate(self, force: ComplexArray) -> ComplexArray:
        """Return displacements due to forces, as :meth:`respond` does, but 0 at ω = 0."""
        moving = self._moving
        if not moving:
            return self._inverse.apply(force)
        response = np.empty(force.shape, dtype=complex)
        response[:moving], response[moving:] = 0.0, self._inverse.apply(force[moving:])
        return response

    def per_force(self, weights: ComplexArray) -> ComplexArray:
        """Return wᵀ x per unit modal force ``(k, n)``, for weights w ``(k, n)`` at ω > 0."""
        return self._inverse.apply_transposed(weights)

    def stiffness_slope(self, motion: ComplexArray) -> ComplexArray:
        """Return ∂(K + iD + iωC - ω²M)/∂ω x: the change of force that keeps a motion, per rad/s."""
        structure = self.structure
        if structure.damping.ndim == 1:
            return _stiffness_slopes(motion, self.angular, structure.damping)
        lagging = 1j * structure.damp(motion)
        return np.asarray(lagging - (2.0 * self.angular)[:, None] * motion)

    def between_joints(self) -> ComplexArray:
        """Return receptances between joints ``(k, j d, j d)`` [mm/N].

        At ω = 0 the holding springs act.
        """
        at_joints, moving = self.structure.at_joints, self._moving
        size = len(at_joints)
        between = np.empty((len(self.angular), size, size), dtype=complex)
        if moving:
            between[0] = self.structure.static_flexibility
        self._inverse.write_between_joints(at_joints, between[moving:])
        return between


@njit(cache=True)
def _stiffness_slopes(motion: ComplexArray, angular: Array, damping: Array) -> ComplexArray:
    """Return (i c_n - 2 ω) x ``(k, n)``."""
    slopes = np.empty_like(motion)
    for k in range(len(angular)):
        for n in range(len(damping)):
            slopes[k, n] = complex(-2.0 * angular[k], damping[n]) * motion[k, n]
    return slopes


def _is_diagonal(damping: Array, largest: float) -> bool:
    """Return whether damping ``(n, n)`` leaves the modes uncoupled.

    ``largest`` is the largest entry of the matrices, to which off-diagonal entries are compared.
    """
    between_modes = np.abs(damping - np.diag(np.diag(damping))).max()
    return bool(between_modes <= DIAGONAL * largest)


class Receptance:
    """Receptance of a structure in modal coordinates.

    Matrices may be Hermitian, those of a sector in a wave. Then mode shapes are complex.

    Parameters
    ----------
    model
        The structure.
    mixed
        Whether damping between different modes is kept.

    Raises
    ------
    ReceptanceError
        If the mass matrix is not positive definite, or if the structure can move freely without
        moving a joint.
    """

    def __init__(self, model: DynamicModel, *, mixed: bool = True) -> None:
        try:
            squares, shapes = sl.eigh(model.stiffness, model.mass)
        except np.linalg.LinAlgError:
            raise ReceptanceError(
                "the mass matrix is not positive definite: give every point mass above 0"
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
        # Viscous and structural modal damping: (n,), or (n, n) where one of them couples the modes.
        self.damping, self.loss = (
            np.diag(part).real.copy() if diagonal else part for part in (damping, loss)
        )
        # Modal rows (r, n) of the dashpots, if nothing else couples the modes.
        self._dashpots: Array | None = None
        if not diagonal and unmixed and model.dashpots is not None:
            rows = model.dashpots @ shapes
            smaller = len(rows) <= len(squares)
            if smaller and _is_diagonal(damping - rows.T @ rows, largest):
                self._dashpots = rows
        self.holding_stiffness = self._stiffness_to_hold() if rigid.any() else 0.0
        try:
            self.static_factors = sl.cho_factor(
                np.diag(self.squares)
                + self.holding_stiffness * self.at_joints.conj().T @ self.at_joints
            )
        except np.linalg.LinAlgError:
            raise ReceptanceError(
                "the structure can move freely without moving a joint: hold it"
            ) from None
        # Displacements of joints due to constant forces on joints (j d, j d), with holding springs.
        self.static_flexibility = self.at_joints @ sl.cho_solve(
            self.static_factors, self.at_joints.conj().T
        )
        # Only the last one is cached: along a branch the number of modes hardly changes.
        self._residuals: dict[int, Array] = {}

    def of(self, harmonic: int) -> Receptance:
        """Return the receptance for a harmonic, here the same for all."""
        return self

    def at(self, angular: Array) -> SteadyMotion:
        """Return the structure at ``k`` frequencies [rad/s]."""
        return SteadyMotion(self, angular)

    def inverse_at(self, angular: Array) -> ModalInverse:
        """Return the inverse that maps modal forces to displacements, at ``k`` frequencies.

        ``angular`` ``(k,)`` [rad/s] are above 0.
        """
        if self.damping.ndim == 1:
            return UnmixedModes(flexibilities(angular, self.squares, self.damping, self.loss))
        if self._dashpots is not None:
            own_damping, loss = self._without_dashpots, np.diag(self.loss)
            flexibility = flexibilities(angular, self.squares, own_damping, loss)
            terms = self.squares + np.square(angular)[:, None]
            if (np.abs(flexibility) * terms).max(initial=0.0) < MAX_CANCELLATION:
                return ModesWithDashpots(flexibility, angular, self._dashpots)
        return MixedModes(self.squares, self.damping, self.loss, angular)

    def damp(self, motion: ComplexArray) -> ComplexArray:
        """Return C x ``(k, n)``, where damping couples the modes."""
        if self._dashpots is None:
            return np.asarray(motion @ self.damping.T)
        by_dashpots = (motion @ self._dashpots.T) @ self._dashpots
        return np.asarray(self._without_dashpots * motion + by_dashpots)

    @property
    def _without_dashpots(self) -> Array:
        """Damping ``(n,)`` of each mode by all but the dashpots."""
        assert self._dashpots is not None
        return np.asarray(np.diag(self.damping) - np.square(self._dashpots).sum(axis=0))

    def less_damped(self, rate: float) -> Receptance:
        """Return the structure with its damping reduced to C - ``rate`` M, ``rate`` in 1/s."""
        other = copy(self)
        share = np.eye(len(self.squares)) if self.damping.ndim == 2 else 1.0
        other.damping = self.damping - rate * share
        return other

    def displacement(self, motion: ComplexArray) -> ComplexArray:
        """Return the structure's displacements ``(k, n)`` for displacements of its modes."""
        # Real mode shapes are not converted to complex, which would dominate the cost with many
        # modes.
        at_points = self.at_points.T
        return np.asarray(motion.real @ at_points + 1j * (motion.imag @ at_points))

    def respond_at_rest(self, force: Array) -> Array:
        """Return modal displacements ``(n,)`` under constant modal forces, with holding springs."""
        if not self.holding_stiffness:
            return np.asarray(force / self.squares)
        # This is part of every product with a Jacobian: the caller notices values that are not
        # finite.
        return np.asarray(sl.cho_solve(self.static_factors, force, check_finite=False))

    def residual_flexibility(self, count: int) -> Array:
        """Return the static flexibility between joints ``(j d, j d)`` of all but the lowest modes.

        ``count`` is the number of lowest modes that are left out.
        """
        if count not in self._residuals:
            high = self.at_joints[:, count:]
            self._residuals = {count: (high / self.squares[count:]) @ high.T}
        return self._residuals[count]

    def _stiffness_to_hold(self) -> float:
        """Return κ [N/mm], a share of the structure's elastic stiffness at its joints."""
        elastic = self.squares > 0.0
        at_joints = self.at_joints[:, elastic]
        flexibility = float((np.abs(at_joints) ** 2 / self.squares[elastic]).sum())
        if flexibility > 0.0:
            return HOLDING * len(at_joints) / flexibility
        return 1.0
