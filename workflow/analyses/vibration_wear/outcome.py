"""What a vibration case with wear has found: the contact and the responses, state by state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sa_solver.types import Array, Grid
from workflow.analyses.vibration.outcome import DATASETS as VIBRATION
from workflow.analyses.vibration.outcome import Response
from workflow.analyses.vibration_wear.case import VibrationWearScene

# Groups of a state, and the one that holds the states.
CONTACT, SLIDERS, RESPONSES = "contact", "sliders", "responses"
LOOP, HALF_SPACE = "loop", "half_space_loop"
# The same of specimens, whose contact is at nodes, and the group of what does not wear.
NODES, PLACES = "nodes", "places"
WORN, EVOLUTION = "worn", "evolution"


@dataclass(frozen=True)
class WornState:
    """The contact after so many ``cycles``, and what the rig does on it.

    ``fields`` by group and name of :data:`DATASETS`; ``numbers`` for the summary.
    """

    cycles: float
    numbers: Mapping[str, Any]
    fields: Mapping[str, Mapping[str, Array]]
    responses: tuple[Response, ...]


@dataclass(frozen=True)
class VibrationWearOutcome:
    """All states of a run, the unworn one first.

    The contact is on a ``grid``, or at nodes with ``places``: of :data:`DATASETS`.
    """

    case: VibrationWearScene
    states: tuple[WornState, ...]
    grid: Grid | None = None
    places: Mapping[str, Array] | None = None

    @property
    def evolution(self) -> dict[str, Array]:
        """Numbers that every state of this kind has, against cycles: of :data:`DATASETS`."""

        def column(name: str) -> Array:
            return np.array([state.numbers[name] for state in self.states])

        def by_force(name: str) -> Array:
            return np.array([[own.numbers[name] for own in s.responses] for s in self.states])

        names = [name for name in DATASETS[EVOLUTION] if name in self.states[0].numbers]
        columns = {name: column(name) for name in names}
        return columns | {name: by_force(name) for name in BY_FORCE}


# Columns of the evolution with a value for each force.
BY_FORCE = ("resonance", "receptance")

# Unit and description of every dataset, by group and name.
DATASETS: dict[str, dict[str, tuple[str, str]]] = {
    CONTACT: {
        "pressure": ("MPa", "at rest"),
        "gap": ("mm", "at rest"),
        "depth_1": ("mm", "worn from body 1"),
        "depth_2": ("mm", "worn from body 2"),
        "onset": ("mm", "motion of the joint from rest up to which each cell sticks"),
        "path": ("mm", "of slip in a cycle under the force that wears"),
        "energy": ("N/mm", "per area, in such a cycle"),
    },
    SLIDERS: {
        "reach": ("mm", "motion at which each slider gives way"),
        "stiffness": ("N/mm", "of its spring"),
        "normal_load": ("N", "that presses it"),
        "energy": ("N mm", "that it dissipates in a cycle under the force that wears"),
    },
    PLACES: {
        "x": ("mm", "of each node on the contact plane"),
        "y": ("mm", "of each node on the contact plane"),
        "area": ("mm^2", "that belongs to each node"),
    },
    NODES: {
        "gap": ("mm", "of the worn bodies without load"),
        "depth_1": ("mm", "worn from body 1"),
        "depth_2": ("mm", "worn from body 2"),
        "normal_force": ("N", "of each node at rest"),
        "path": ("mm", "of slip in a cycle under the force that wears"),
        "energy": ("N mm", "that each node dissipates in such a cycle"),
    },
    LOOP: {
        "displacement": ("mm", "of the joint, or between the targets, under the force that wears"),
        "force": ("N", "of the joint along it"),
    },
    HALF_SPACE: {
        "displacement": ("mm", "of the bodies, as far to and fro"),
        "force": ("N", "between them, of the whole tangential problem"),
    },
    RESPONSES: VIBRATION[RESPONSES],
    EVOLUTION: {
        "cycles": ("1", "under the force that wears"),
        "energy": ("N mm", "dissipated so far"),
        "volume": ("mm^3", "worn from both bodies"),
        "depth": ("mm", "largest of both bodies together"),
        "area": ("mm^2", "in contact at rest"),
        "touching": ("1", "nodes in contact at rest"),
        "peak_pressure": ("MPa", "at rest"),
        "friction": ("1", "coefficient"),
        "stiffness": ("N/mm", "of the stuck contact; between targets, that of the loop"),
        "full_slip": ("mm", "motion of the joint from rest at which all of it slides"),
        "stroke": ("mm", "of the joint from end to end, under the force that wears"),
        "energy_per_cycle": ("N mm", "under the force that wears"),
        "stuck": ("Hz", "natural frequencies with the contact stuck"),
        "resonance": ("Hz", "under each force"),
        "receptance": ("mm/N", "largest amplitude of the last mass over the force, under each"),
    },
}
