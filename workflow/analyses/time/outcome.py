"""Results of a case in time, whatever drove the joint: states at several energies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sa_solver.types import Array
from workflow.analyses.time.case import JointCase, RigCase
from workflow.shell.output.dataset import Dataset, Datasets
from workflow.shell.output.results import CurveAxis

# The parameters of a joint that evolve, in the order of reports.
PARAMETERS = {
    "friction": ("1", "coefficient of friction"),
    "stiffness": ("N/mm", "slope of the stuck joint"),
    "residual_stiffness": ("N/mm", "slope of the sliding joint"),
    "normal_load": ("N", "normal load"),
}
# Groups of curves of a state.
LOOP, MOTION, RESPONSE, RING_DOWN = "loop", "motion", "frequency_response", "ring_down"
# First axis of each group; loops have none.
ALONG = {
    LOOP: None,
    MOTION: CurveAxis("time"),
    RESPONSE: CurveAxis("frequency"),
    RING_DOWN: CurveAxis("amplitude"),
}


@dataclass(frozen=True)
class State:
    """The joint after a dissipated ``energy`` [N mm] and a number of ``cycles``, if known.

    ``parameters`` are by the names of :data:`PARAMETERS`, ``numbers`` are for the summary, and
    ``curves`` are by group, with the first axis of each along the curve.
    """

    energy: float
    cycles: float | None
    parameters: Mapping[str, float]
    numbers: Mapping[str, Any]
    curves: Mapping[str, Datasets]


@dataclass(frozen=True)
class TimeOutcome:
    """All results of a case in time.

    ``evolution`` are columns ``(k,)`` over the energy, from 0 to the last; ``numbers`` go into the
    summary unchanged. ``seen`` names the observed displacements of a rig, the last of which is the
    main one.
    """

    case: JointCase | RigCase
    states: tuple[State, ...]
    evolution: Datasets
    numbers: Mapping[str, Any] = field(default_factory=dict)
    seen: tuple[str, ...] = ()

    @property
    def contents(self) -> MotionContents:
        """Description of what ``results.h5`` holds of this outcome."""
        curves: dict[str, tuple[str, ...]] = {}
        for number, state in enumerate(self.states):
            for group in state.curves:
                curves[group] = (*curves.get(group, ()), f"{number:05d}")
        changes = len(self.evolution["energy"].values) > 1
        evolution = tuple(self.evolution) if changes else ()
        return MotionContents(curves, evolution, aged=self.states[0].cycles is not None)


@dataclass(frozen=True)
class MotionContents:
    """Contents of ``results.h5`` of a case in time.

    ``curves`` are the states that have each group of curves. ``evolution`` are the columns over the
    energy, empty where nothing changes. States of an ``aged`` joint have a number of cycles.
    """

    curves: Mapping[str, tuple[str, ...]]
    evolution: tuple[str, ...]
    aged: bool


def loop_curves(displacement: Array, force: Array) -> dict[str, Dataset]:
    """Return a loop of the joint, or of several together."""
    moved = "displacement of the joint, or the mean of several, in a cycle"
    return {
        "displacement": Dataset(displacement, "mm", moved),
        "force": Dataset(force, "N", "force that resists it"),
    }
