"""Results of a vibration case with wear: contact and responses, state by state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sa_solver.types import Array, Grid
from wear import worn
from wear.steps.step_errors import step_errors
from workflow.analyses.vibration.output.outcome import Response
from workflow.analyses.vibration_wear.case import VibrationWearCaseBase
from workflow.layout.declared import Arrays

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
    fields: Mapping[str, Arrays]
    responses: tuple[Response, ...]


@dataclass(frozen=True)
class WornNodes:
    """Nodes of a contact: data that do not wear, and ``names`` ``(j,)`` if the nodes have any.

    ``arrays`` are the area and, as far as known, position, normal, and x and y on the plane.
    """

    arrays: Arrays
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


def step_error(state: worn.WornState, areas: Array | float = 1.0) -> float:
    """Return the larger wear-step error of depth and volume; ``areas`` as for ``step_errors``."""
    return max((step_errors(state, areas) or NOTHING_WORN).values())
