"""Loads of our own structures as files, in the form in which they are read."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from sa_solver.types import Array, LoadHistory
from workflow.analyses.wear.structures.resultants.consistency import MIX
from workflow.analyses.wear.structures.resultants.imported import base_units
from workflow.shell.store import ResultsWriter, replacing

if TYPE_CHECKING:
    from fe_models.mesh import Interface
    from fe_models.structure import InterfaceHistory

NOTE = "# forces and moments of body 1 on body 2, in the frame of each interface; one closed cycle"
# Unit and description of what only these files hold.
NODAL = {
    "nodes_1": ("1", "node numbers of body 1"),
    "nodes_2": ("1", "node numbers of body 2"),
    "nodal_height": ("mm", "gap before loading, at the nodes"),
}


def write_resultants_csv(
    path: Path, histories: Mapping[str, LoadHistory], line: bool = False
) -> None:
    """Write the loads of every interface; numbers read back are the same, bit for bit.

    Loads of a ``line`` contact are per mm.
    """
    units = base_units(line)
    with replacing(path) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        stream.write(NOTE + "\n")
        writer = csv.writer(stream, lineterminator="\n")
        header = [f"{name} [{unit}]" for name, unit in units.items()]
        mixed = [name for name in MIX if any(loads.mixed for loads in histories.values())]
        writer.writerow(["interface", "increment", *header, "sliding", *mixed])
        for interface, loads in histories.items():
            columns = np.array([getattr(loads, name) for name in units]).T.tolist()
            marks = zip(loads.sliding, *(getattr(loads, name) for name in mixed), strict=True)
            for number, (row, (slides, *mix)) in enumerate(zip(columns, marks, strict=True), 1):
                cells = map(repr, [*row, int(slides), *(own.item() for own in mix)])
                writer.writerow([interface, number, *cells])


def write_resultants_h5(
    path: Path,
    histories: Mapping[str, InterfaceHistory],
    heights: Mapping[str, Array] | None = None,
) -> None:
    """Write loads and slip of every interface with its face, frame and node numbers.

    ``heights`` ``(nx, ny)`` [mm] are the unworn gaps on the grid of the case, by interface.
    """
    from fe_models.mesh import Interface

    line = any(history.interface.line for history in histories.values())
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        writer = ResultsWriter(file, per_length=line)
        for name, history in histories.items():
            face = history.interface
            writer.put(f"{name}/load_history", **history.loads.columns())
            writer.put(name, coordinates=face.coordinates, facets=face.facets, slip=history.slip)
            file[name].attrs.update({"origin": face.frame.origin, "axes": face.frame.axes})
            if heights is not None:
                writer.put(name, height=heights[name])
            if isinstance(face, Interface):
                _put_nodes(file[name], face)


def _put_nodes(group: h5py.Group, face: Interface) -> None:
    """Gap and node numbers at the nodes of the face; body 1's where both meet node to node."""
    for name, (unit, description) in NODAL.items():
        values = {"nodes_1": face.nodes_1, "nodes_2": face.nodes_2, "nodal_height": face.gap}[name]
        if len(values) == len(face):
            dataset = group.create_dataset(name, data=values)
            dataset.attrs.update({"unit": unit, "description": description})
