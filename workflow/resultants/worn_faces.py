"""Worn surfaces written back to the user's nodes at the end of a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sa_solver.types import Array, Frame, Grid, Indices
from workflow.case import ResultantsCase
from workflow.contact_stage import ContactStage, InterfaceState
from workflow.reporter import Reporter
from workflow.resultants.source import ResultantsSource
from workflow.resultants.worn_nodes import (
    NodalDepths,
    nodal_depths,
    read_nodes,
    worn_displacement,
    write_worn_nodes,
)

# Nodes that carry less than this share of the worn volume leave some of the wear out.
FULL_SHARE = 0.99

BODIES: tuple[Literal[1, 2], ...] = (1, 2)


def check_nodes(file: str, frame: Frame, size: tuple[float, float], line: bool) -> None:
    """Raise unless the file has the nodes of a face of ``size`` [mm] in that frame.

    InputFileError where the file is wrong, FaceError where its nodes are.
    """
    grid = Grid.over(size, (1, 1), line)
    nodal_depths(read_nodes(file).points, frame, grid, np.zeros(grid.shape))


def write_worn_faces(
    case: ResultantsCase,
    source: ResultantsSource,
    stages: Sequence[ContactStage],
    states: Sequence[InterfaceState],
    folder: Path,
    reporter: Reporter,
) -> dict[str, dict[str, Any]]:
    """Write the worn surfaces of all faces whose nodes are known; what the summary says of them."""
    summary: dict[str, dict[str, Any]] = {}
    for stage, state in zip(stages, states, strict=True):
        for face in _faces(case, source, stage, state):
            path = folder / f"worn_nodes_{stage.name}_body_{face.body}.csv"
            displacement = worn_displacement(face.worn.depth, face.frame, face.body)
            write_worn_nodes(path, face.numbers, displacement)
            _warn_of_share(face.worn, f"{stage.name}, body_{face.body}", reporter)
            # JSON has no NaN: no share where nothing is worn.
            share = None if np.isnan(face.worn.volume_share) else face.worn.volume_share
            summary.setdefault(stage.name, {})[f"body_{face.body}"] = {
                "file": path.name,
                "nodes": len(face.numbers),
                "volume_share": share,
            }
    return summary


@dataclass(frozen=True)
class _WornFace:
    """The user's nodes of the face of one body, and what they lose."""

    body: Literal[1, 2]
    numbers: Indices
    frame: Frame
    worn: NodalDepths


def _faces(
    case: ResultantsCase, source: ResultantsSource, stage: ContactStage, state: InterfaceState
) -> Iterator[_WornFace]:
    """Faces by body: over the nodes of the case's tables, else over those of the file of loads."""
    frame, own = source.frame(stage.name), source.imported[stage.name]
    if frame is None:
        return
    files = case.structure.nodes_of(stage.name)
    depths, numbers = (state.surfaces.depth_1, state.surfaces.depth_2), (own.nodes_1, own.nodes_2)
    for body in BODIES:
        depth, imported = depths[body - 1], numbers[body - 1]
        if body in files:
            table = read_nodes(files[body])
            worn = nodal_depths(table.points, frame, stage.grid, depth)
            yield _WornFace(body, table.numbers, frame, worn)
        elif imported is not None:
            yield _WornFace(body, imported, frame, _on_face(stage, depth))


def _on_face(stage: ContactStage, depth: Array) -> NodalDepths:
    """Worn depth at the nodes of the face that the loads came with."""
    nodal = stage.transfer.to_nodes(depth)
    worn = float(depth.sum()) * stage.grid.cell_area
    carried = float(nodal @ stage.face.facet_shares)
    return NodalDepths(nodal, carried / worn if worn else np.nan)


def _warn_of_share(nodal: NodalDepths, whose: str, reporter: Reporter) -> None:
    if nodal.volume_share < FULL_SHARE:
        reporter.warn(
            f"{whose}: the nodes carry {nodal.volume_share:.1%} of the worn volume: the rest lies "
            "outside their face"
        )
