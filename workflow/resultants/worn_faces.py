"""Worn surfaces written back to the user's nodes at the end of a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fe_models.mesh import Face
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

if TYPE_CHECKING:
    from workflow.structure_stage import StructureStage

# Nodes that carry less than this share of the worn volume leave some of the wear out.
FULL_SHARE = 0.99

BODIES: tuple[Literal[1, 2], ...] = (1, 2)


def check_nodes(file: str, frame: Frame, size: tuple[float, float], line: bool) -> None:
    """Raise unless the file has the nodes of a face of ``size`` [mm] in that frame.

    InputFileError where the file is wrong, FaceError where its nodes are.
    """
    grid = Grid.over(size, (1, 1), line)
    nodal_depths(read_nodes(file).points, frame, grid, np.zeros(grid.shape))


@dataclass(frozen=True)
class WornFace:
    """The user's nodes of the face of one body of an ``interface``, and what they lose."""

    interface: str
    body: Literal[1, 2]
    numbers: Indices
    frame: Frame
    worn: NodalDepths


def write_worn_faces(
    faces: Iterable[WornFace], folder: Path, reporter: Reporter
) -> dict[str, dict[str, Any]]:
    """Write the worn surfaces; what the summary says of them, by interface."""
    summary: dict[str, dict[str, Any]] = {}
    for face in faces:
        path = folder / f"worn_nodes_{face.interface}_body_{face.body}.csv"
        displacement = worn_displacement(face.worn.depth, face.frame, face.body)
        write_worn_nodes(path, face.numbers, displacement)
        _warn_of_share(face.worn, f"{face.interface}, body_{face.body}", reporter)
        # JSON has no NaN: no share where nothing is worn.
        share = None if np.isnan(face.worn.volume_share) else face.worn.volume_share
        summary.setdefault(face.interface, {})[f"body_{face.body}"] = {
            "file": path.name,
            "nodes": len(face.numbers),
            "volume_share": share,
        }
    return summary


def imported_faces(
    case: ResultantsCase, source: ResultantsSource, stage: ContactStage, state: InterfaceState
) -> Iterator[WornFace]:
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
            yield WornFace(stage.name, body, table.numbers, frame, worn)
        elif imported is not None:
            worn = _on_nodes(stage, stage.face, stage.transfer.to_nodes(depth), depth)
            yield WornFace(stage.name, body, imported, frame, worn)


def meshed_faces(
    source: StructureStage, number: int, stage: ContactStage, state: InterfaceState
) -> Iterator[WornFace]:
    """Faces of interface ``number`` by body, where the user has numbered the nodes."""
    interface = source.mesh.interfaces[number]
    depths = (state.surfaces.depth_1, state.surfaces.depth_2)
    nodal = stage.depths_of_bodies(state)
    for body in BODIES:
        numbers = source.model.node_numbers(body)
        if numbers is not None:
            worn = _on_nodes(stage, interface.face(body), nodal[body - 1], depths[body - 1])
            own = numbers[interface.nodes(body)]
            yield WornFace(stage.name, body, own, interface.frame, worn)


def _on_nodes(stage: ContactStage, face: Face, nodal: Array, depth: Array) -> NodalDepths:
    """Worn depth at the nodes of a face, and the share of what the grid loses that they carry."""
    worn = float(depth.sum()) * stage.grid.cell_area
    carried = float(nodal @ face.facet_shares)
    return NodalDepths(nodal, carried / worn if worn else np.nan)


def _warn_of_share(nodal: NodalDepths, whose: str, reporter: Reporter) -> None:
    if nodal.volume_share < FULL_SHARE:
        reporter.warn(
            f"{whose}: the nodes carry {nodal.volume_share:.1%} of the worn volume: the rest lies "
            "outside their face"
        )
