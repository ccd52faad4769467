"""A vibrating structure with joints: M x'' + C x' + K x = f(t) - Bᵀ F(B x)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from sa_solver import checks
from sa_solver.types import Array


@dataclass(frozen=True)
class DynamicModel:
    """``mass``, ``damping`` and ``stiffness`` ``(n, n)`` without joints, in t, N s/mm and N/mm.

    ``connection`` ``(j d, n)`` is B: it takes displacements of the structure to those of its ``j``
    joints of ``d`` directions, one joint after the other. ``names`` ``(n,)`` are those of the
    degrees of freedom. ``structural`` ``(n, n)`` D [N/mm], None for none, is damping in phase with
    the velocity that does not grow with it: in steady vibration the stiffness is K + iD. There is
    none in time. ``dashpots`` ``(r, n)`` G tells what part of ``damping`` a few dashpots are, GᵀG:
    steady vibration is found the sooner. Raises InputError for other shapes, and for numbers that
    are masked or not finite.

    Examples
    --------
    A mass of 1 kg on a spring of 1 N/µm, with a joint between it and the ground: ω = √(k/m)

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
    """What joints answer to an increment of displacement; see :class:`Joints`."""

    @property
    def force(self) -> Array: ...
    @property
    def tangent(self) -> Array: ...
    @property
    def state(self) -> Array: ...
    @property
    def dissipated(self) -> Array: ...


class Joints(Protocol):
    """A law of joints: :class:`wear.joints.law.JointLaw` is one.

    ``respond`` answers to increments ``(j, d)`` [mm] with resisting forces ``(j, d)`` [N], tangents
    ``(j, d, d)``, a new state and the energies dissipated ``(j,)`` [N mm].
    """

    @property
    def directions(self) -> int: ...
    def rest(self, joints: int) -> Array: ...
    def respond(self, state: Array, increment: Array) -> IncrementResponse: ...
