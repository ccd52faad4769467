"""Cycle-jumped wear of one interface: pressures of a cycle, and the depth of many alike.

Pressure comes from the half-space solver under the resultants of each increment. Slip is given: by
the structure (wear method 1 of Gallego 2007) or by the half-space (method 2, see
:mod:`wear.full_cycle`), and does not change during a step. Where it slips, q = µ p.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sa_solver.normal import NormalContact, NormalStart, NormalState
from sa_solver.types import Array, LoadHistory
from wear.laws import WearLaw
from wear.surfaces import Surfaces

# In explicit steps a roughness of the grid's shortest wavelength grows when the depth lost per
# pressure in one step exceeds this many pitches over E*, its stiffness being 2/1.161 E*/pitch.
EXPLICIT_LIMIT = 1.161

States = dict[int, NormalState]
Starts = dict[int, NormalStart]


class ContactFailure(RuntimeError):
    """The half-space solver did not converge; the message is its own."""


@dataclass(frozen=True)
class CycleResult:
    """A cycle on given surfaces.

    ``states`` by increment; ``energy`` ``(t,)`` dissipated in each increment of one cycle [N mm];
    ``depth_1`` and ``depth_2`` ``(nx, ny)`` worn per cycle [mm]; ``convolutions`` spent.
    """

    states: States
    energy: Array
    depth_1: Array
    depth_2: Array
    convolutions: int

    def per_cycle(self, cell_area: float) -> tuple[float, float]:
        """Largest depth [mm] and volume of both bodies [mm³] worn per cycle."""
        depth = max(self.depth_1.max(), self.depth_2.max())
        return float(depth), float((self.depth_1 + self.depth_2).sum() * cell_area)


class WearingContact:
    """One interface under the loads and slips of a cycle.

    ``slip`` ``(t, nx, ny)`` is the size of the slip in each increment [mm]; ``laws`` are those of
    body 1 and body 2. ``uplift`` ``(t, nx, ny)`` [mm] is the normal displacement under the shear of
    each increment, None for similar bodies.
    """

    def __init__(
        self,
        contact: NormalContact,
        laws: tuple[WearLaw, WearLaw],
        friction: float,
        loads: LoadHistory,
        slip: Array,
        tolerance: float,
        uplift: Array | None = None,
    ) -> None:
        self.contact = contact
        self._friction = friction
        self._loads = loads
        self._slip = slip
        self._uplift = uplift
        self._tolerance = tolerance
        self._wear_1, self._wear_2 = (law.depth_per_pressure(slip, friction) for law in laws)

    @property
    def working(self) -> list[int]:
        """Increments that dissipate, loaded and with slip somewhere, the heaviest load last.

        Over thousands of cycles it does not matter where a cycle begins. A step that ends with the
        widest contact leaves no unworn rim for the next one.
        """
        slipping = [bool(slip.any()) for slip in self._slip]
        count, heaviest = len(self._loads), int(np.argmax(self._loads.P))
        order = [(heaviest + 1 + k) % count for k in range(count)]
        return [t for t in order if slipping[t] and self._loads.P[t] > 0.0]

    def stable_cycles(self) -> float:
        """Largest explicit jump that does not amplify the grid's shortest wavelength.

        From the decay of a roughness mode per update, 1 - w ΔN E* k/2, with w the depth of both
        bodies per pressure and cycle.
        """
        fastest = float((self._wear_1 + self._wear_2).sum(axis=0).max())
        pitch = min(self.contact.grid.pitch)
        limit = EXPLICIT_LIMIT * pitch / self.contact.half_space.pair.contact_modulus
        return limit / fastest if fastest > 0.0 else np.inf

    def solve(self, surfaces: Surfaces, increment: int, start: NormalStart | None) -> NormalState:
        """Contact state of one increment on given surfaces."""
        return self._solve(surfaces.gap, increment, start, None)

    def cycle(self, surfaces: Surfaces, starts: Starts, increments: list[int]) -> CycleResult:
        """Solve the given increments on surfaces that do not change."""
        found: States = {}
        for t in increments:
            before = found[t - 1].start if t - 1 in found else None
            found[t] = self.solve(surfaces, t, starts.get(t, before))
        return self._result(found)

    def explicit_step(
        self, surfaces: Surfaces, starts: Starts, cycles: float
    ) -> tuple[Surfaces, CycleResult]:
        """Wear ``cycles`` cycles at the pressures of the present surfaces."""
        result = self.cycle(surfaces, starts, self.working)
        return surfaces.worn(result.depth_1 * cycles, result.depth_2 * cycles), result

    def implicit_step(
        self, surfaces: Surfaces, starts: Starts, cycles: float
    ) -> tuple[Surfaces, CycleResult]:
        """Wear ``cycles`` cycles, increment after increment, each at the pressure it ends with.

        The depth of an increment enters its contact problem as the local compliance
        D = (w1 + w2) ΔN. First order in ΔN and stable for any, at given slips.
        """
        found: States = {}
        for t in self.working:
            per_pressure = (self._wear_1[t] + self._wear_2[t]) * cycles
            found[t] = self._solve(surfaces.gap, t, starts.get(t), per_pressure)
            pressure = found[t].pressure * cycles
            surfaces = surfaces.worn(self._wear_1[t] * pressure, self._wear_2[t] * pressure)
        return surfaces, self._result(found)

    def _solve(
        self, gap: Array, increment: int, start: NormalStart | None, compliance: Array | None
    ) -> NormalState:
        loads = self._loads
        state = self.contact.solve(
            gap if self._uplift is None else gap + self._uplift[increment],
            float(loads.P[increment]),
            float(loads.Mx[increment]),
            float(loads.My[increment]),
            tolerance=self._tolerance,
            start=start,
            compliance=compliance,
        )
        if not state.converged:
            raise ContactFailure(f"increment {increment + 1}: {state.message}")
        return state

    def _result(self, states: States) -> CycleResult:
        energy = np.zeros(len(self._loads))
        depth_1, depth_2 = np.zeros_like(self._slip[0]), np.zeros_like(self._slip[0])
        area = self.contact.grid.cell_area
        for t, state in states.items():
            energy[t] = self._friction * np.sum(state.pressure * self._slip[t]) * area
            depth_1 += self._wear_1[t] * state.pressure
            depth_2 += self._wear_2[t] * state.pressure
        convolutions = sum(state.convolutions for state in states.values())
        return CycleResult(states, energy, depth_1, depth_2, convolutions)
