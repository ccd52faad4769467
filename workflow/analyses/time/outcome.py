"""Results of a case in time, whatever drove the joint: states at several energies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from workflow.analyses.time.case import JointCase, RigCase
from workflow.layout.declared import Arrays, Layout, over

# The parameters of a joint that evolve, in the order of reports.
PARAMETERS = over(
    "",
    friction=("1", "coefficient of friction"),
    stiffness=("N/mm", "slope of the stuck joint"),
    residual_stiffness=("N/mm", "slope of the sliding joint"),
    normal_load=("N", "normal load"),
)
# Groups of curves of a state.
LOOP, MOTION, RESPONSE, RING_DOWN = "loop", "motion", "frequency_response", "ring_down"
EVOLUTION = "evolution"
_EACH = "of the joints of each entry of structure.joints"
LAYOUT = Layout(
    {
        EVOLUTION: {
            **over(
                "energy",
                energy=("N mm", "energy dissipated so far in the joint"),
                cycles=("1", "cycles so far"),
                energy_per_cycle=("N mm", "energy dissipated in a cycle"),
            ),
            **{name: declared._replace(dims=("energy",)) for name, declared in PARAMETERS.items()},
        },
        f"states/<state>/{LOOP}": over(
            "point",
            displacement=("mm", "displacement of the joint, or the mean of several, in a cycle"),
            force=("N", "force that resists it"),
        ),
        f"states/<state>/{MOTION}": {
            **over("time", time=("s", "time"), excitation=("N", "force of the excitation")),
            **over(
                "time seen",
                displacement=("mm", "displacements of the reported points"),
                acceleration=("mm/s^2", "accelerations of the reported points"),
            ),
            **over(
                "time", joint_force=("N", "force of the joint, or the sum of several, resisting")
            ),
            **over(
                "time entry",
                joints_displacement=("mm", f"mean displacement {_EACH}"),
                joints_force=("N", f"sum of the forces {_EACH}, resisting"),
            ),
            **over(
                "time",
                dissipated=("N mm", "energy that the joint has dissipated since the beginning"),
            ),
        },
        f"states/<state>/{RESPONSE}": over(
            "frequency",
            frequency=("Hz", "frequency"),
            magnitude=("mm/(s^2 N)", "acceleration of the reported point over the excitation"),
            phase=("rad", "phase of the acceleration to the excitation"),
        ),
        f"states/<state>/{RING_DOWN}": over(
            "amplitude",
            amplitude=("mm", "amplitude of the reported point, in its first mode"),
            frequency=("Hz", "instantaneous frequency"),
            damping_ratio=("1", "instantaneous damping ratio"),
        ),
    }
)


@dataclass(frozen=True)
class State:
    """The joint after a dissipated ``energy`` [N mm] and a number of ``cycles``, if known.

    ``parameters`` are by the names of :data:`PARAMETERS`, ``numbers`` are for the summary, and
    ``curves`` are by group, each an array by name.
    """

    energy: float
    cycles: float | None
    parameters: Mapping[str, float]
    numbers: Mapping[str, Any]
    curves: Mapping[str, Arrays]


@dataclass(frozen=True)
class TimeOutcome:
    """All results of a case in time.

    ``evolution`` are columns ``(k,)`` over the energy, from 0 to the last; ``numbers`` go into the
    summary unchanged. ``seen`` names the observed displacements of a rig, the last of which is the
    main one.
    """

    case: JointCase | RigCase
    states: tuple[State, ...]
    evolution: Arrays
    numbers: Mapping[str, Any] = field(default_factory=dict)
    seen: tuple[str, ...] = ()

    @property
    def contents(self) -> MotionContents:
        """Description of what ``results.h5`` holds of this outcome."""
        curves: dict[str, tuple[str, ...]] = {}
        for number, state in enumerate(self.states):
            for group in state.curves:
                curves[group] = (*curves.get(group, ()), f"{number:05d}")
        changes = len(self.evolution["energy"]) > 1
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
