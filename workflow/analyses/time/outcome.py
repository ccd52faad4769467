"""Results of a case in time, whatever drove the joint: states at several energies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from workflow.analyses.time.case import JointCase, RigCase
from workflow.layout.declared import Arrays, Layout, declared
from workflow.models.rig import layout

PARAMETERS = declared(layout.PARAMETERS)
LAYOUT = Layout.read(
    f"""
evolution{layout.EVOLUTION}
states/<state>/loop
    displacement | mm | point | displacement of the joint, or the mean of several, in a cycle
    force | N | point | force that resists it
states/<state>/motion{layout.CURVES}
    joints_displacement | mm | time entry | mean displacement of each entry of structure.joints
    joints_force | N | time entry | sum of the forces of each entry of structure.joints, resisting
states/<state>/frequency_response
    frequency | Hz | frequency | frequency
    magnitude | mm/(s^2 N) | frequency | acceleration of the reported point over the excitation
    phase | rad | frequency | phase of the acceleration to the excitation
states/<state>/ring_down
    amplitude | mm | amplitude | amplitude of the reported point, in its first mode
    frequency | Hz | amplitude | instantaneous frequency
    damping_ratio | 1 | amplitude | instantaneous damping ratio
"""
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
