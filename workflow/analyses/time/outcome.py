"""What a case in time has found, whatever drove the joint: states at several energies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sa_solver.types import Array
from workflow.analyses.time.case import JointCase, RigCase

# The parameters of a joint that evolve, in the order in which they are told.
PARAMETERS = ("friction", "stiffness", "residual_stiffness", "normal_load")
# Groups of curves of a state.
LOOP, MOTION, RESPONSE, RING_DOWN = "loop", "motion", "frequency_response", "ring_down"


@dataclass(frozen=True)
class State:
    """The joint after it has dissipated ``energy`` [N mm] in so many ``cycles``, if they are known.

    ``parameters`` by the names of :data:`PARAMETERS`, ``numbers`` for the summary, and ``curves``
    by group and dataset (:data:`DATASETS`), the first axis of each along the curve.
    """

    energy: float
    cycles: float | None
    parameters: Mapping[str, float]
    numbers: Mapping[str, Any]
    curves: Mapping[str, Mapping[str, Array]]


@dataclass(frozen=True)
class TimeOutcome:
    """Everything a case in time has found.

    ``evolution`` are columns ``(k,)`` over the energy, from nothing to the last; ``numbers`` go
    into the summary as they are. ``seen`` names the displacements that are kept of a rig, the last
    of which is looked at.
    """

    case: JointCase | RigCase
    states: tuple[State, ...]
    evolution: Mapping[str, Array]
    numbers: Mapping[str, Any] = field(default_factory=dict)
    seen: tuple[str, ...] = ()


# Unit and description of every dataset, by group and name.
DATASETS: dict[str, dict[str, tuple[str, str]]] = {
    "evolution": {
        "energy": ("N mm", "energy dissipated so far in the joint"),
        "cycles": ("1", "cycles so far"),
        "energy_per_cycle": ("N mm", "energy dissipated in a cycle"),
        "friction": ("1", "coefficient of friction"),
        "stiffness": ("N/mm", "slope of the stuck joint"),
        "residual_stiffness": ("N/mm", "slope of the sliding joint"),
        "normal_load": ("N", "normal load"),
    },
    LOOP: {
        "displacement": ("mm", "displacement of the joint, or the mean of several, in a cycle"),
        "force": ("N", "force that resists it"),
    },
    MOTION: {
        "time": ("s", "time"),
        "excitation": ("N", "force of the excitation"),
        "displacement": ("mm", "displacements of what is seen"),
        "acceleration": ("mm/s^2", "accelerations of what is seen"),
        "joint_force": ("N", "force of the joint, or the sum of several, resisting"),
        "dissipated": ("N mm", "energy that the joint has dissipated since the beginning"),
    },
    RESPONSE: {
        "frequency": ("Hz", "frequency"),
        "magnitude": (
            "mm/(s^2 N)",
            "acceleration of what is looked at, over the excitation",
        ),
        "phase": ("rad", "of the acceleration before the excitation"),
    },
    RING_DOWN: {
        "amplitude": ("mm", "amplitude of what is looked at, in its first mode"),
        "frequency": ("Hz", "instantaneous frequency"),
        "damping_ratio": ("1", "instantaneous damping ratio"),
    },
}
