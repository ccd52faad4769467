"""What a case in time has found, whatever drove the joint: states at several energies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sa_solver.types import Array
from workflow.analyses.time.case import JointCase, RigCase
from workflow.shell.dataset import Dataset, Datasets
from workflow.shell.results import Along

# The parameters of a joint that evolve, in the order in which they are told.
PARAMETERS = {
    "friction": ("1", "coefficient of friction"),
    "stiffness": ("N/mm", "slope of the stuck joint"),
    "residual_stiffness": ("N/mm", "slope of the sliding joint"),
    "normal_load": ("N", "normal load"),
}
# Groups of curves of a state.
LOOP, MOTION, RESPONSE, RING_DOWN = "loop", "motion", "frequency_response", "ring_down"
# What they are over; a loop is over nothing.
ALONG = {
    LOOP: None,
    MOTION: Along("time"),
    RESPONSE: Along("frequency"),
    RING_DOWN: Along("amplitude"),
}


@dataclass(frozen=True)
class State:
    """The joint after it has dissipated ``energy`` [N mm] in so many ``cycles``, if they are known.

    ``parameters`` by the names of :data:`PARAMETERS`, ``numbers`` for the summary, and ``curves``
    by group, the first axis of each along the curve.
    """

    energy: float
    cycles: float | None
    parameters: Mapping[str, float]
    numbers: Mapping[str, Any]
    curves: Mapping[str, Datasets]


@dataclass(frozen=True)
class TimeOutcome:
    """Everything a case in time has found.

    ``evolution`` are columns ``(k,)`` over the energy, from nothing to the last; ``numbers`` go
    into the summary as they are. ``seen`` names the displacements that are kept of a rig, the last
    of which is looked at.
    """

    case: JointCase | RigCase
    states: tuple[State, ...]
    evolution: Datasets
    numbers: Mapping[str, Any] = field(default_factory=dict)
    seen: tuple[str, ...] = ()

    @property
    def contents(self) -> Contents:
        """What ``results.h5`` holds of it."""
        curves: dict[str, tuple[str, ...]] = {}
        for number, state in enumerate(self.states):
            for group in state.curves:
                curves[group] = (*curves.get(group, ()), f"{number:05d}")
        changes = len(self.evolution["energy"].values) > 1
        evolution = tuple(self.evolution) if changes else ()
        return Contents(curves, evolution, aged=self.states[0].cycles is not None)


@dataclass(frozen=True)
class Contents:
    """What ``results.h5`` of a case in time holds.

    ``curves`` are the states that have each group of them, ``evolution`` the columns over the
    energy, none where nothing changes. States of an ``aged`` joint know their cycles.
    """

    curves: Mapping[str, tuple[str, ...]]
    evolution: tuple[str, ...]
    aged: bool


def loop_curves(displacement: Array, force: Array) -> dict[str, Dataset]:
    """A loop of the joint, or of several together."""
    moved = "displacement of the joint, or the mean of several, in a cycle"
    return {
        "displacement": Dataset(displacement, "mm", moved),
        "force": Dataset(force, "N", "force that resists it"),
    }
