"""Wear of contacts at nodes, whose pressures and slips are known for a whole cycle at once.

A reduced structure finds the pressures and slips of a whole cycle on given surfaces, and its
increments cannot be solved one by one within a wear step. Nodes therefore wear by explicit steps,
at the mean of two cycles (Heun), or by steps of many stages (:mod:`wear.steps.stabilised`). The
laws are those of :mod:`wear.laws`, with nodes instead of cells.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol

import numpy as np

from sa_solver.load_history import LoadHistory
from sa_solver.types import Array
from wear.contact.face_loads import FaceLoads
from wear.laws import SlidingConditions, WearLaw
from wear.steps.stepping import Starts
from wear.worn import Cost, WearStep, WornState


class NodalCycle(Protocol):
    """Protocol of a closed cycle at the ``n`` nodes of a contact.

    Its ``t`` parts are increments, or longer periods of constant pressure. ``slip`` ``(t, n)`` is
    the size of the slip in each part [mm] and ``pressure`` ``(t, n)`` the pressure [MPa].
    ``friction`` is Coulomb's coefficient, ``areas`` ``(n,)`` are those of the nodes [mm²], and
    ``start`` is a starting point for the solver on surfaces that differ little.
    """

    @property
    def slip(self) -> Array: ...
    @property
    def pressure(self) -> Array: ...
    @property
    def friction(self) -> float | Array: ...
    @property
    def areas(self) -> Array: ...
    @property
    def start(self) -> object: ...

    def stable_cycles(self, depth_per_pressure: Array) -> float:
        """Return the longest explicit step in which no error of shape grows [cycles].

        ``depth_per_pressure`` ``(n,)`` is that of both bodies in a cycle [mm/MPa].
        """
        ...


@dataclass(frozen=True)
class NodalState(WornState):
    """State of wearing nodes; ``start`` is the solver's starting point from the last cycle."""

    start: object = None


@dataclass(frozen=True, kw_only=True)
class NodalFaceState(WornState):
    """State of the nodes of one face: a view of the :class:`NodalState` of all faces.

    ``cycle`` returns the loads of the face on these surfaces. The contact has no starting points of
    a half-space, and its motion is not followed.
    """

    cycle: Callable[[], FaceLoads]
    starts: ClassVar[Starts] = {}
    paths: ClassVar[Array] = np.empty((0, 3, 2))

    @property
    def loads(self) -> LoadHistory:
        """Resultants of the face on the present surfaces."""
        return self.cycle().loads


@dataclass(frozen=True)
class NodalContact:
    """Nodes that wear under a cycle, or under the mean of several.

    ``laws`` are those of body 1 and body 2.
    """

    laws: tuple[WearLaw, WearLaw]
    cycles: tuple[NodalCycle, ...]

    def averaged(self, other: NodalContact) -> NodalContact:
        """Return the contact whose wear is the mean of this one's and the other one's."""
        return NodalContact(self.laws, self.cycles + other.cycles)

    @property
    def work(self) -> Array:
        """Energy per area that each node dissipates in a cycle ``(n,)`` [N/mm]."""
        return _mean([c.friction * (c.slip * c.pressure).sum(axis=0) for c in self.cycles])

    @property
    def areas(self) -> Array:
        """Areas of the nodes ``(n,)`` [mm²]."""
        return self.cycles[0].areas

    def wear(self, state: NodalState, cycles: float = 0.0) -> tuple[Array, Array]:
        """Return the depths lost per cycle by both bodies ``(n,)`` [mm] in a step of ``cycles``."""
        lost: tuple[list[Array], list[Array]] = [], []
        for cycle in self.cycles:
            for body, depth in zip(lost, self._per_pressure(cycle, state, cycles), strict=True):
                body.append((depth * cycle.pressure).sum(axis=0))
        return _mean(lost[0]), _mean(lost[1])

    def stable_cycles(self, state: NodalState, cycles: float = 0.0) -> float:
        """Return the longest explicit step in which no error grows [cycles].

        Laws that change with energy are those of a step of ``cycles``.
        """
        limits = []
        for cycle in self.cycles:
            wear_1, wear_2 = self._per_pressure(cycle, state, cycles)
            limits.append(cycle.stable_cycles((wear_1 + wear_2).sum(axis=0)))
        return min(limits)

    def comparable_cycles(self, state: NodalState) -> float:
        """Return infinity: all increments wear together, so that steps of any length compare."""
        return np.inf

    def rates(self, state: NodalState, cycles: float = 0.0) -> Array:
        """Return the wear per cycle ``(3, n)``: both depths [mm] and the energy per area [N/mm]."""
        return np.stack([*self.wear(state, cycles), self.work])

    def worn(self, state: NodalState, lost: Array, cycles: float) -> NodalState:
        """Return the state after further wear ``lost`` ``(3, n)``, in the rows of :meth:`rates`."""
        depth_1, depth_2, work = lost
        return replace(
            state,
            surfaces=state.surfaces.worn(depth_1, depth_2, work, work),
            energy=state.energy + float(work @ self.areas),
            depth_rate=float(lost[:2].max()) / cycles,
            volume_rate=float((depth_1 + depth_2) @ self.areas) / cycles,
            start=self.cycles[-1].start,
        )

    def explicit_step(self, state: NodalState, cycles: float) -> WearStep[NodalState]:
        """Wear ``cycles`` cycles at the present pressures and slips."""
        after = self.worn(state, cycles * self.rates(state, cycles), cycles)
        # The step cost one solved cycle: the other cycle of a mean is counted by its own step.
        return WearStep(after, cycles, Cost(1, 0, 1))

    def _per_pressure(
        self, cycle: NodalCycle, state: NodalState, cycles: float
    ) -> tuple[Array, Array]:
        """Return the depth per pressure of both bodies in each increment, ``(t, n)`` each [mm/MPa].

        Laws that change with energy receive the energy of the state and that expected after the
        step.
        """
        further = cycles * self.work
        energies = state.energy, state.energy + float(further @ self.areas)
        surfaces = state.surfaces
        first, second = (
            law.depth_per_pressure(
                SlidingConditions(cycle.slip, cycle.friction, (work, work + further), energies)
            )
            for law, work in zip(self.laws, (surfaces.work_1, surfaces.work_2), strict=True)
        )
        return first, second


def _mean(fields: list[Array]) -> Array:
    mean: Array = np.mean(fields, axis=0)
    return mean
