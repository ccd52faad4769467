"""Results of a vibration case with wear: contact and responses, state by state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sa_solver.types import Array, Grid
from wear import worn
from wear.steps.step_errors import step_errors
from workflow.analyses.vibration.output.outcome import Response
from workflow.analyses.vibration_wear.case import VibrationWearCaseBase
from workflow.shell.output.dataset import Dataset, Datasets

# Groups of a state.
CONTACT, SLIDERS, RESPONSES = "contact", "sliders", "responses"
LOOP, HALF_SPACE = "loop", "half_space_loop"
# Groups for contacts at nodes: fields of a state, and data that do not wear.
NODES, PLACES = "nodes", "places"
WORN, EVOLUTION = "worn", "evolution"
# Coordinates of nodes in space, where they are known.
POSITION = "position"
# Error of wear steps before the first one.
NOTHING_WORN = {"depth": 0.0}


@dataclass(frozen=True)
class VibrationWearContents:
    """Contents of ``results.h5`` of a vibration case with wear.

    The contact is ``at_nodes``, or on a grid with loops of its tangential problem. Nodes are
    ``placed`` where their coordinates are known, and ``on_plane`` where they have one normal.
    """

    at_nodes: bool
    placed: bool = True
    on_plane: bool = True


@dataclass(frozen=True)
class WornRig:
    """The contact after a number of ``cycles``, and the responses of the rig on it.

    ``fields`` are by group, ``numbers`` for the summary.
    """

    cycles: float
    numbers: Mapping[str, Any]
    fields: Mapping[str, Datasets]
    responses: tuple[Response, ...]


@dataclass(frozen=True)
class WornNodes:
    """Nodes of a contact: data that do not wear, and ``names`` ``(j,)`` if the nodes have any.

    ``datasets`` are the area and, as far as known, position, normal, and x and y on the plane.
    """

    datasets: Datasets
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class VibrationWearOutcome:
    """All states of a run, the unworn one first.

    The contact is on a ``grid``, or at ``nodes``.
    """

    case: VibrationWearCaseBase
    states: tuple[WornRig, ...]
    grid: Grid | None = None
    nodes: WornNodes | None = None

    @property
    def evolution(self) -> dict[str, Dataset]:
        """Numbers of all states, against cycles ``(k,)``.

        Numbers for each force are ``(k, forces)``.
        """
        rows = [
            {
                **state.numbers,
                "resonance": [response.numbers["resonance"] for response in state.responses],
                "receptance": [response.numbers["receptance"] for response in state.responses],
            }
            for state in self.states
        ]
        columns = {
            "cycles": ("1", "cycles under the force that wears"),
            "energy": ("N mm", "energy dissipated so far"),
            "volume": ("mm^3", "volume worn from both bodies"),
            "depth": ("mm", "largest depth of both bodies together"),
            "area": ("mm^2", "area in contact at rest"),
            "touching": ("1", "nodes in contact at rest"),
            "peak_pressure": ("MPa", "at rest"),
            "step_error": ("1", "error of depth or volume due to wear steps, the larger"),
            "friction": ("1", "coefficient"),
            "stiffness": (
                "N/mm",
                "of all that touches, stuck; over what opens between the targets, or their mean",
            ),
            "full_slip": ("mm", "motion of the joint from rest at which all of it slides"),
            "stroke": ("mm", "of the joint from end to end, under the force that wears"),
            "frequency": ("Hz", "frequency of the motion that wears"),
            "energy_per_cycle": (
                "N mm",
                "energy dissipated by the joints under the force that wears",
            ),
            "work_per_cycle": ("N mm", "amplitude of the force that wears"),
            "damped_per_cycle": (
                "N mm",
                "energy dissipated by the damping of the structure in the same motion",
            ),
            "stuck": ("Hz", "natural frequencies with the contact stuck"),
            "resonance": ("Hz", "under each force"),
            "receptance": ("mm/N", "largest amplitude of the last mass over the force, under each"),
        }
        return {
            name: Dataset(np.array([row[name] for row in rows]), *described)
            for name, described in columns.items()
            if name in rows[0]
        }


def step_error(state: worn.WornState, areas: Array | float = 1.0) -> float:
    """Return the larger wear-step error of depth and volume; ``areas`` as for ``step_errors``."""
    return max((step_errors(state, areas) or NOTHING_WORN).values())


def depth_fields(depth_1: Array, depth_2: Array) -> dict[str, Dataset]:
    """Return the worn depths of both bodies, at cells or nodes."""
    return {
        "depth_1": Dataset(depth_1, "mm", "worn from body 1"),
        "depth_2": Dataset(depth_2, "mm", "worn from body 2"),
    }


def path_field(path: Array) -> Dataset:
    """Return the slip path of a cycle, at cells or nodes."""
    return Dataset(path, "mm", "of slip in a cycle under the force that wears")


def wearing_loop(displacement: Array, force: Array) -> dict[str, Dataset]:
    """Return the loop of the joint in the motion that wears it."""
    moved = "of the joint or the mean of all, or between the targets, under the force that wears"
    return {
        "displacement": Dataset(displacement, "mm", moved),
        "force": Dataset(force, "N", "of the joint along it"),
    }
