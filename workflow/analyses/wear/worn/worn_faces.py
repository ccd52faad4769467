"""Transfer of worn surfaces to the user's nodes at the end of a run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from workflow.analyses.wear.worn.worn_nodes import (
    NodalDepths,
    nodal_depths,
    worn_displacement,
    write_worn_nodes,
)
from workflow.case.text.readable import percent
from workflow.messages.warning_kinds import WarningKind
from workflow.models.contact import FaceContact, FaceState, WornFaces
from workflow.models.loads import LoadSource, UserFace
from workflow.shell.folders.folder import OutputFolder
from workflow.shell.terminal.reporter import Reporter

# Share of the worn volume that the nodes must carry to avoid a warning.
FULL_SHARE = 0.99


def write_worn_faces(
    source: LoadSource, faces: WornFaces, folder: OutputFolder, reporter: Reporter
) -> dict[str, dict[str, Any]]:
    """Write the wear at the user's nodes, if there are any; return its summary by interface."""
    summary: dict[str, dict[str, Any]] = {}
    for number, (stage, state) in enumerate(faces):
        for face in source.user_faces(number):
            name = f"worn_nodes_{stage.name}_body_{face.body}.csv"
            what = f"what the nodes of body {face.body} lose at {stage.name}, as displacements"
            path, worn = folder.reserve(name, what), _worn_nodes(face, stage, state)
            displacement = worn_displacement(worn.depth, face.frame, face.body)
            write_worn_nodes(path, face.numbers, displacement)
            if worn.volume_share < FULL_SHARE:
                reporter.warn(
                    WarningKind.WEAR_OFF_THE_NODES,
                    f"{stage.name}, body_{face.body}: the nodes carry only "
                    f"{percent(worn.volume_share)} of the worn volume, as the rest lies outside "
                    "their face",
                )
            summary.setdefault(stage.name, {})[f"body_{face.body}"] = {
                "file": name,
                "nodes": len(face.numbers),
                # JSON has no NaN, so there is no share where nothing is worn.
                "volume_share": None if np.isnan(worn.volume_share) else worn.volume_share,
            }
    return summary


def _worn_nodes(face: UserFace, stage: FaceContact, state: FaceState) -> NodalDepths:
    """Return the worn depth at the user's nodes, on the contact face or at separate points."""
    depth = stage.on_grid(state).depths[face.body - 1]
    if face.points is not None:
        return nodal_depths(face.points, face.frame, stage.grid, depth)
    nodal = stage.depths_of_bodies(state)[face.body - 1]
    worn = NodalDepths.of(nodal, stage.face.face(face.body).facet_shares, stage.grid, depth)
    # The meshed nodes come first among those of a whole face.
    return replace(worn, depth=worn.depth[: len(face.numbers)])
