"""Wear of contacts at nodes, whose cycle is known at once: what each node is pressed and slips by.

A reduced structure finds the pressures and slips of a whole cycle on given surfaces, and no solver
can be asked on the way: nodes wear by explicit steps, at the mean of two cycles (Heun), or by steps
of many stages (:mod:`wear.steps.stabilised`). Laws are those of :mod:`wear.laws`, with nodes in the
place of cells.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sa_solver.types import Array
from wear.laws import SlidingConditions, WearLaw
from wear.worn import Spent, WearStep, WornState


class NodalCycle(Protocol):
    """What a closed cycle does to ``n`` nodes of a contact.

    ``slip`` ``(t, n)`` is the size of the slip in each increment [mm], or in stretches of constant
    ``pressure`` ``(t, n)`` [MPa] which lie against each other; ``friction`` Coulomb's coefficient;
    ``areas`` ``(n,)`` those of the nodes [mm²]; ``start`` what a solver may begin from on surfaces
    that are little different.
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
        """Longest explicit step in which no error of shape grows.

        ``depth_per_pressure`` ``(n,)`` is that of both bodies in a cycle [mm/MPa].
        """
        ...


@dataclass(frozen=True)
class NodalState(WornState):
    """What the wear of nodes must remember: ``start`` is that of the cycle that led to it."""

    start: object = None


@dataclass(frozen=True)
class NodalContact:
    """Nodes that wear under a cycle, or the mean of several; ``laws`` are those of both bodies."""

    laws: tuple[WearLaw, WearLaw]
    cycles: tuple[NodalCycle, ...]

    def averaged(self, other: NodalContact) -> NodalContact:
        """The contact that takes off the mean of what both do."""
        return NodalContact(self.laws, self.cycles + other.cycles)

    @property
    def work(self) -> Array:
        """Energy per area that each node dissipates in a cycle ``(n,)`` [N/mm]."""
        return _mean([c.friction * (c.slip * c.pressure).sum(axis=0) for c in self.cycles])

    @property
    def areas(self) -> Array:
        """Of the nodes ``(n,)`` [mm²]."""
        return self.cycles[0].areas

    def wear(self, state: NodalState, cycles: float = 0.0) -> tuple[Array, Array]:
        """Depths that body 1 and body 2 lose per cycle in a step of so many, ``(n,)`` each [mm]."""
        lost: tuple[list[Array], list[Array]] = [], []
        for cycle in self.cycles:
            for body, depth in zip(lost, self._per_pressure(cycle, state, cycles), strict=True):
                body.append((depth * cycle.pressure).sum(axis=0))
        return _mean(lost[0]), _mean(lost[1])

    def stable_cycles(self, state: NodalState, cycles: float = 0.0) -> float:
        """Longest explicit step in which no error grows, by the laws of a step of ``cycles``."""
        limits = []
        for cycle in self.cycles:
            wear_1, wear_2 = self._per_pressure(cycle, state, cycles)
            limits.append(cycle.stable_cycles((wear_1 + wear_2).sum(axis=0)))
        return min(limits)

    def comparable_cycles(self, state: NodalState) -> float:
        """Any step: all increments wear together (:mod:`wear.steps.stepping` has them in turn)."""
        return np.inf

    def rates(self, state: NodalState, cycles: float = 0.0) -> Array:
        """What a cycle of a step takes ``(3, n)``: depths of both bodies [mm], energy per area."""
        return np.stack([*self.wear(state, cycles), self.work])

    def worn(self, state: NodalState, lost: Array, cycles: float) -> NodalState:
        """The state in which nodes have lost so much ``(3, n)``, as :meth:`rates` has it."""
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
        """Wear ``cycles`` cycles at these pressures and slips."""
        after = self.worn(state, cycles * self.rates(state, cycles), cycles)
        # One cycle has been solved for it: of a mean, the other one was before.
        return WearStep(after, cycles, Spent(1, 0, 1))

    def _per_pressure(
        self, cycle: NodalCycle, state: NodalState, cycles: float
    ) -> tuple[Array, Array]:
        """Depth per pressure of both bodies in each increment, ``(t, n)`` each [mm/MPa].

        Laws that change with energy are told that of the state, and what a step will have added.
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
