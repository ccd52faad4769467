"""Protocols of joint laws over one period of a given motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from sa_solver.types import Array, Indices


class Cycle(Protocol):
    """Response of joints over one period; see :class:`PeriodicJoints`."""

    @property
    def force(self) -> Array: ...
    @property
    def jacobian(self) -> Array: ...
    @property
    def samples(self) -> Array: ...
    @property
    def states(self) -> np.ndarray: ...
    @property
    def dissipated(self) -> Array: ...
    @property
    def change(self) -> Array: ...


class Deviations(Protocol):
    """Maps of small deviations through the joints over one period.

    :class:`wear.joints.periodic.linearised.LinearisedMarch` is one.

    The period has ``t`` times, and there are ``j`` joints. From each time to the next, the
    deviations δs ``(p,)`` of a joint's state and δu ``(d,)`` of its displacements become δs_end = A
    δs + E δu + D δu_end. The deviation of its forces is S δs_end + T δu_end. The attributes are:

    - ``kept`` A, ``by_start`` E and ``by_end`` D ``(t, j, ...)``, ``pull`` S ``(j, d, p)`` and
      ``tangent`` T ``(t, j, d, d)``
    - ``regimes`` ``(t, j)``: a number for the state of each joint, such as sticking or sliding
    - ``force`` ``(t, j, d)`` [N]: the force in the motion itself
    - ``remembered`` ``(j,)``: how many of the ``p`` numbers are the state of a joint; the others
      are padding and stay as they are
    """

    @property
    def kept(self) -> Array: ...
    @property
    def by_start(self) -> Array: ...
    @property
    def by_end(self) -> Array: ...
    @property
    def pull(self) -> Array: ...
    @property
    def tangent(self) -> Array: ...
    @property
    def regimes(self) -> np.ndarray: ...
    @property
    def force(self) -> Array: ...
    @property
    def remembered(self) -> Indices: ...


@runtime_checkable
class DeviatingJoints(Protocol):
    """Protocol of :class:`PeriodicJoints` that can also be linearised about a period.

    The stability of a motion can only be computed with such joints. The times of ``basis`` ascend
    from the beginning of the period, and the last increment leads back to it. ``memory`` is the
    least number of state variables for which the result has room, since joints may have more of
    them in some motions than in others.
    """

    def linearise(
        self, coefficients: Array, basis: Array, lead: Array, memory: int = 0
    ) -> Deviations: ...


class PeriodicJoints(Protocol):
    """Protocol of joint laws that are marched through a period until their forces repeat.

    :class:`wear.joints.periodic.march.PeriodicMarch` is one.

    The displacement of joint j at sample t is ``basis[t] @ coefficients[j]``, from ``basis``
    ``(t, m)`` and ``coefficients`` ``(j, m, d)`` [mm]. ``lead`` ``(p, m)`` gives the points through
    which the joints are marched from rest; the last one is the first sample. The result has

    - ``force`` ``(j, m, d)`` [N]: the samples times ``weights`` ``(m, t)``
    - ``jacobian`` ``(j, m, d, m, d)`` [N/mm]: its derivative with respect to the coefficients
    - ``samples`` ``(t, j, d)`` [N] and ``states`` ``(t, j)``: 0 stick, 1 slip, 2 separated
    - ``dissipated`` ``(j,)`` [N mm]: energy dissipated per period
    - ``change`` ``(j,)``: relative change of the force from one period to the next
    """

    @property
    def directions(self) -> int: ...
    def settle(
        self, coefficients: Array, basis: Array, weights: Array, lead: Array | None
    ) -> Cycle: ...


@dataclass(frozen=True)
class CycleRecord:
    """Part of a :class:`Cycle` that is stored: all but its derivative, which is large."""

    force: Array
    samples: Array
    states: np.ndarray
    dissipated: Array
    change: Array

    @classmethod
    def of(cls, cycle: Cycle) -> CycleRecord:
        """Return the record of a cycle."""
        return cls(cycle.force, cycle.samples, cycle.states, cycle.dissipated, cycle.change)
