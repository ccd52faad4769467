"""Length of a coupled run: its jumps, its stops, and when its loads are solved again."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from sa_solver import checks
from sa_solver.errors import InputError
from sa_solver.types import Array
from wear.coupled_state import CoupledState, largest_depth, total_volume
from wear.steps.steppers import ROUNDING
from wear.worn import WornState

AT_STOP = 1e-3
"""Relative tolerance of a stop. A jump that would pass the stop is shortened to end within it."""


@dataclass(frozen=True)
class JumpSize:
    """Length of one jump, as a number of cycles or as an amount of wear at the present rates.

    Give one size at most. Without any, a jump is as long as the automatic steps of all contacts
    allow.

    Parameters
    ----------
    cycles
        Number of cycles.
    depth
        Largest depth that any body loses in the jump [mm].
    volume
        Volume that all bodies together lose in the jump [mm³].

    Examples
    --------
    A jump lasts until a micrometre is worn; two sizes at once are refused:

    >>> from wear import JumpSize
    >>> print(JumpSize(depth=1e-3))
    JumpSize(cycles=None, depth=0.001, volume=None)
    >>> JumpSize(cycles=1000.0, depth=1e-3)
    Traceback (most recent call last):
        ...
    sa_solver.errors.InputError: a jump has more than one size: give one of cycles, depth and volume
    """

    cycles: float | None = None
    depth: float | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        if sum(size is not None for size in vars(self).values()) > 1:
            raise InputError("a jump has more than one size: give one of cycles, depth and volume")
        checks.numbers(self, "cycles", "depth", "volume", above=0.0)


@dataclass(frozen=True)
class Stop:
    """Wear limits that end a run before its last cycle, each reached to 0.1 %.

    The run ends at the limit that it reaches first.

    Parameters
    ----------
    depth
        Largest depth of any body [mm].
    volume
        Volume of all bodies together [mm³].

    Examples
    --------
    A run of 10⁶ cycles ends earlier if 20 µm are worn:

    >>> from wear import CoupledSettings, Stop
    >>> settings = CoupledSettings(cycles=1e6, stop=Stop(depth=0.02))
    >>> print(settings.stop)
    Stop(depth=0.02, volume=None)
    """

    depth: float | None = None
    volume: float | None = None

    def __post_init__(self) -> None:
        checks.numbers(self, "depth", "volume", above=0.0)


class Schedule(ABC):
    """Base class of the lengths of the jumps of a run, and of its end.

    ``resultants``, ``drift`` and ``friction`` are those of :class:`CoupledSettings`: without them,
    loads are never solved again.
    """

    resultants: Literal["constant", "drift", "every"] = "constant"
    drift: float = 0.0
    friction: Literal["constant", "evolving"] = "constant"

    @property
    def automatic(self) -> bool:
        """True if jumps are as long as the steps of the contacts, which grow."""
        return False

    @abstractmethod
    def ended(self, state: CoupledState[Any]) -> bool:
        """Return whether a run that has reached ``state`` is over."""

    @abstractmethod
    def next_jump(self, state: CoupledState[Any]) -> float:
        """Return the cycles of the next jump."""

    @abstractmethod
    def left(self, state: CoupledState[Any]) -> float:
        """Return the cycles to the end of the run at the present rates."""

    def share_to_stop(self, before: CoupledState[Any], kinetics: Array) -> float:
        """Return the share of a jump at which it passed the end, or 1 if it did not.

        ``kinetics`` is the row of kinetics after the jump.
        """
        return 1.0


@dataclass(frozen=True)
class CoupledSettings(Schedule):
    """Settings of a coupled run: its cycles, its jumps, and when the loads are solved again.

    Parameters
    ----------
    cycles
        Number of cycles of the run.
    jump
        Length of one jump.
    stop
        Wear limits at which the run ends earlier.
    resultants
        When the load source is solved again. "constant": never; "every": after each jump; "drift":
        where the relative change since the last solution exceeds ``drift``. The change is the
        larger of that of the probed resultants (:func:`sa_solver.types.resultant_change`) and that
        expected of slips and energies from the load that wear has moved across a face
        (:data:`RESPONSE`).
    drift
        Largest relative change without a new solution.
    friction
        "evolving": the load source is given the present coefficients of friction of the contacts.

    Examples
    --------
    A run of 10⁵ cycles in jumps of 10⁴ solves its loads again after each jump:

    >>> from wear import CoupledSettings, JumpSize
    >>> settings = CoupledSettings(cycles=1e5, jump=JumpSize(cycles=1e4), resultants="every")
    >>> print(settings.cycles / settings.jump.cycles, settings.stop)
    10.0 Stop(depth=None, volume=None)
    """

    cycles: float
    jump: JumpSize = JumpSize()
    stop: Stop = Stop()
    resultants: Literal["constant", "drift", "every"] = "drift"
    drift: float = 0.02
    friction: Literal["constant", "evolving"] = "constant"

    def __post_init__(self) -> None:
        checks.numbers(self, "cycles", "drift", least=0.0)
        checks.choice("resultants", self.resultants, ("constant", "drift", "every"))
        checks.choice("friction", self.friction, ("constant", "evolving"))

    @property
    def automatic(self) -> bool:
        return self.jump == JumpSize()

    def ended(self, state: CoupledState[Any]) -> bool:
        stop, reached = self.stop, 1.0 - AT_STOP
        return bool(
            state.cycles[-1] >= self.cycles * (1.0 - ROUNDING)
            or (stop.depth is not None and state.depth >= stop.depth * reached)
            or (stop.volume is not None and state.volume >= stop.volume * reached)
        )

    def next_jump(self, state: CoupledState[Any]) -> float:
        """Return the cycles of the next jump, from the requested size at the present rates."""
        size, left = self.jump, self._left(state)
        if size.cycles is not None:
            cycles = size.cycles
        elif size.depth is not None or size.volume is not None:
            cycles = _cycles_to(size.depth, size.volume, state)
        else:
            cycles = _cycles_of_steps(state.interfaces, left)
        cycles = min(cycles, self._to_stop(state))
        return left if cycles > left * (1.0 - ROUNDING) else float(cycles)

    def left(self, state: CoupledState[Any]) -> float:
        return min(self._left(state), self._to_stop(state))

    def share_to_stop(self, before: CoupledState[Any], kinetics: Array) -> float:
        stop, share = self.stop, 1.0
        for limit, then, now in (
            (stop.depth, before.depth, largest_depth(kinetics)),
            (stop.volume, before.volume, total_volume(kinetics)),
        ):
            if limit is not None and now > limit * (1.0 + AT_STOP):
                share = min(share, (limit - then) / (now - then))
        return share

    def _left(self, state: CoupledState[Any]) -> float:
        """Return the cycles to the last one."""
        return self.cycles - float(state.cycles[-1])

    def _to_stop(self, state: CoupledState[Any]) -> float:
        """Return the cycles to the nearest stop at the present rates, at least one."""
        stop = self.stop
        depth = None if stop.depth is None else stop.depth - state.depth
        volume = None if stop.volume is None else stop.volume - state.volume
        return max(1.0, _cycles_to(depth, volume, state))


def _cycles_of_steps(interfaces: Sequence[WornState], left: float) -> float:
    """Return the cycles of a jump as long as the contacts' own steps, out of the ``left`` ones.

    Where a contact has done one of two steps that are judged together, the jump ends with the
    second.
    """
    half_way = [interface.next_cycles for interface in interfaces if interface.half_way]
    if half_way:
        return min(max(half_way), left)
    # The cycles left are divided evenly, so that no jump is a mere remainder.
    proposed = min(interface.next_cycles for interface in interfaces)
    return left / float(max(1.0, np.ceil(left / proposed * (1.0 - ROUNDING))))


def _cycles_to(depth: float | None, volume: float | None, state: CoupledState[Any]) -> float:
    """Return the cycles in which the present rates wear so much more, infinite without wear.

    ``depth`` is that of the fastest wearing body [mm], ``volume`` that of all bodies [mm³].
    """
    limits = (
        (depth, max(interface.depth_rate for interface in state.interfaces)),
        (volume, sum(interface.volume_rate for interface in state.interfaces)),
    )
    cycles = [limit / rate for limit, rate in limits if limit is not None and rate > 0.0]
    return min(cycles, default=np.inf)
