"""Model of a vibrating structure with joints: M x'' + C x' + K x = f(t) - Bᵀ F(B x)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

from sa_solver import checks
from sa_solver.types import Array


@dataclass(frozen=True)
class DynamicModel:
    """Matrices of a structure without its joints, and the connection to the joints.

    Parameters
    ----------
    mass, damping, stiffness
        Matrices M [t], C [N s/mm] and K [N/mm], ``(n, n)``.
    connection
        Matrix B ``(j d, n)``. It maps displacements of the structure to those of its ``j`` joints
        of ``d`` directions, one joint after the other.
    names
        Names ``(n,)`` of the degrees of freedom.
    structural
        Structural damping matrix D ``(n, n)`` [N/mm], or None. Its force is in phase with the
        velocity but does not grow with the frequency: in steady vibration the stiffness is K + iD.
        Time integration does not support it.
    dashpots
        Rows G ``(r, n)`` of a few dashpots whose damping GᵀG is already part of ``damping``, or
        None. They only make steady vibration faster to compute.

    Examples
    --------
    A mass of 1 kg stands on a spring of 1 N/µm, with a joint to the ground: ω = √(k/m).

    >>> import numpy as np
    >>> from fe_models.dynamics import DynamicModel, natural_frequencies
    >>> mass, damping, stiffness = np.array([[1e-3]]), np.zeros((1, 1)), np.array([[1e3]])
    >>> model = DynamicModel(mass, damping, stiffness, connection=np.eye(1), names=("m",))
    >>> print((2.0 * np.pi * natural_frequencies(model)).round(6), "rad/s")
    [1000.] rad/s
    """

    mass: Array
    damping: Array
    stiffness: Array
    connection: Array
    names: tuple[str, ...]
    structural: Array | None = None
    dashpots: Array | None = None

    def __post_init__(self) -> None:
        size, found = len(self.names), {}
        for name in ("mass", "damping", "stiffness", "structural", "connection", "dashpots"):
            if (matrix := getattr(self, name)) is not None:
                rows = None if name in ("connection", "dashpots") else size
                what = f"values of {name} of a model of {size} names"
                found[name] = checks.complex_array(what, matrix, (rows, size))
        checks.settle(self, **found)


class IncrementResponse(Protocol):
    """Response of joints to an increment of displacement; see :class:`Joints`."""

    @property
    def force(self) -> Array: ...
    @property
    def tangent(self) -> Array: ...
    @property
    def state(self) -> Array: ...
    @property
    def dissipated(self) -> Array: ...


class Joints(Protocol):
    """Protocol of a joint law for time integration, e.g. :class:`wear.joints.law.JointLaw`.

    ``respond`` takes increments of displacement ``(j, d)`` [mm]. It returns the resisting forces
    ``(j, d)`` [N], the tangents ``(j, d, d)`` [N/mm], the new state and the dissipated energies
    ``(j,)`` [N mm].
    """

    @property
    def directions(self) -> int: ...
    def rest(self, joints: int) -> Array: ...
    def respond(self, state: Array, increment: Array) -> IncrementResponse: ...


def stiffened(model: DynamicModel, tangents: Array) -> DynamicModel:
    """Return a model with springs ``(j, d, d)`` [N/mm] in parallel to its joints."""
    connection = model.connection
    by_joint = connection.reshape(*tangents.shape[:2], -1)
    springs = (tangents @ by_joint).reshape(connection.shape)
    return replace(model, stiffness=model.stiffness + connection.conj().T @ springs)
