"""Worn surfaces written back to the user's nodes at the end of a run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from fe_models.mesh import Face
from sa_solver.types import Array, Frame, Indices
from wear.interface import InterfaceState
from workflow.analyses.wear.contact_stage import ContactStage
from workflow.analyses.wear.load_source import UserFace
from workflow.analyses.wear.worn_nodes import (
    NodalDepths,
    nodal_depths,
    worn_displacement,
    write_worn_nodes,
)
from workflow.shell.folder import OutputFolder
from workflow.shell.reporter import Reporter

# Nodes that carry less than this share of the worn volume leave some of the wear out.
FULL_SHARE = 0.99


@dataclass(frozen=True)
class WornFace:
    """The user's nodes of the face of one body of an ``interface``, and what they lose."""

    interface: str
    body: Literal[1, 2]
    numbers: Indices
    frame: Frame
    worn: NodalDepths


def write_worn_faces(
    faces: Iterable[WornFace], folder: OutputFolder, reporter: Reporter
) -> dict[str, dict[str, Any]]:
    """Write the worn surfaces; what the summary says of them, by interface."""
    summary: dict[str, dict[str, Any]] = {}
    for face in faces:
        name = f"worn_nodes_{face.interface}_body_{face.body}.csv"
        what = f"what the nodes of body {face.body} lose at {face.interface}, as displacements"
        path = folder.reserve(name, what)
        displacement = worn_displacement(face.worn.depth, face.frame, face.body)
        write_worn_nodes(path, face.numbers, displacement)
        _warn_of_share(face.worn, f"{face.interface}, body_{face.body}", reporter)
        # JSON has no NaN: no share where nothing is worn.
        share = None if np.isnan(face.worn.volume_share) else face.worn.volume_share
        summary.setdefault(face.interface, {})[f"body_{face.body}"] = {
            "file": name,
            "nodes": len(face.numbers),
            "volume_share": share,
        }
    return summary


def worn_faces(
    faces: Iterable[UserFace], stage: ContactStage, state: InterfaceState
) -> Iterator[WornFace]:
    """What the user's nodes of an interface lose."""
    depths, nodal = state.surfaces.depths, stage.depths_of_bodies(state)
    for face in faces:
        depth = depths[face.body - 1]
        if face.points is not None:
            worn = nodal_depths(face.points, face.frame, stage.grid, depth)
        else:
            worn = _on_nodes(stage, stage.face_of(face.body), nodal[face.body - 1], depth)
        yield WornFace(stage.name, face.body, face.numbers, face.frame, worn)


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
