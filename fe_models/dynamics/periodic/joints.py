"""What joints do in a period of a given motion: the protocol of the laws that are handed over."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from sa_solver.types import Array, Indices


class Cycle(Protocol):
    """What joints do in a period; see :class:`PeriodicJoints`."""

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
    """What joints make of small deviations: :class:`wear.joints.periodic.linearised.LinearisedMarch` is one.

    From each of ``t`` times of a period to the next, deviations of what ``j`` joints remember
    ``(p,)`` and of their displacements ``(d,)`` go on as δs_end = A δs + E δu + D δu_end, and their
    forces are S δs_end + T δu_end: ``kept`` A, ``by_start`` E, ``by_end`` D ``(t, j, ...)``,
    ``pull`` S ``(j, d, p)`` and ``tangent`` T. ``regimes`` ``(t, j)`` tell what joints do, and
    ``force`` ``(t, j, d)`` [N] is that of the motion itself at the times. Of the numbers each joint
    has ``remembered`` ``(j,)``: further ones, of which others have more, stay as they are.
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
    """:class:`PeriodicJoints` that also know what becomes of small deviations from their period.

    Without them nothing can be said of the stability of a motion. The times of ``basis`` ascend
    from the beginning of the period; the last increment leads back to it. Joints that remember more
    in some motions than in others have room for at least ``memory`` numbers.
    """

    def linearise(
        self, coefficients: Array, basis: Array, lead: Array, memory: int = 0
    ) -> Deviations: ...


class PeriodicJoints(Protocol):
    """Joints that are marched through a period: :class:`wear.joints.periodic.march.PeriodicMarch` is one.

    The displacement of joint j at sample t is ``basis[t] @ coefficients[j]``, from ``basis``
    ``(t, m)`` and ``coefficients`` ``(j, m, d)`` [mm]; ``lead`` ``(p, m)`` gives the points through
    which they are marched from rest to the first sample, the last. Answers ``force`` ``(j, m, d)``
    [N], the samples times ``weights`` ``(m, t)``, its derivative ``jacobian``
    ``(j, m, d, m, d)``, the ``samples`` ``(t, j, d)`` and ``states`` ``(t, j)`` (0 stick, 1 slip,
    2 separated), the energy ``dissipated`` ``(j,)`` [N mm] per period, and the relative ``change``
    ``(j,)`` of the force from one period to the next.
    """

    @property
    def directions(self) -> int: ...
    def settle(
        self, coefficients: Array, basis: Array, weights: Array, lead: Array | None
    ) -> Cycle: ...


@dataclass(frozen=True)
class CycleRecord:
    """What is kept of a :class:`Cycle`: all but its derivative."""

    force: Array
    samples: Array
    states: np.ndarray
    dissipated: Array
    change: Array

    @classmethod
    def of(cls, cycle: Cycle) -> CycleRecord:
        """Of a cycle whose derivative is no longer needed."""
        return cls(cycle.force, cycle.samples, cycle.states, cycle.dissipated, cycle.change)
