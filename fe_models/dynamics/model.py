"""A vibrating structure with joints: M x'' + C x' + K x = f(t) - Bᵀ F(B x)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from sa_solver.types import Array


@dataclass(frozen=True)
class DynamicModel:
    """Matrices ``(n, n)`` of the structure without joints, in t, N s/mm and N/mm.

    ``connection`` ``(j d, n)`` is B: it takes displacements of the structure to those of its ``j``
    joints of ``d`` directions, one joint after the other. ``names`` ``(n,)`` are those of the
    degrees of freedom.
    """

    mass: Array
    damping: Array
    stiffness: Array
    connection: Array
    names: tuple[str, ...]


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
