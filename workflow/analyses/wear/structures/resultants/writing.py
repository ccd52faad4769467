"""Loads of our structures as files, in the form in which they are read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe_models.mesh import Interface
from fe_models.structure import InterfaceHistory
from sa_solver.types import Array, LoadHistory
from workflow.analyses.contact.datasets import load_columns, slip_field
from workflow.analyses.wear.datasets import face_mesh
from workflow.analyses.wear.structures.resultants.consistency import MIX
from workflow.analyses.wear.structures.resultants.imported import base_units
from workflow.shell.dataset import Dataset
from workflow.shell.results import writing
from workflow.shell.tables import heading, write_table

NOTE = "forces and moments of body 1 on body 2, in the frame of each interface; one closed cycle"


def write_resultants_csv(
    path: Path, histories: Mapping[str, LoadHistory], line: bool = False
) -> None:
    """Write the loads of every interface; numbers read back are the same, bit for bit.

    Loads of a ``line`` contact are per mm.
    """
    loads = list(histories.values())
    units = base_units(line) | {"sliding": ""}
    if any(history.mixed for history in loads):
        units |= dict.fromkeys(MIX, "")
    lengths = [len(history) for history in loads]
    columns: dict[str, NDArray[Any]] = {
        "interface": np.repeat(list(histories), lengths),
        "increment": np.concatenate([np.arange(1, length + 1) for length in lengths]),
    }
    for name, unit in units.items():
        values = np.concatenate([getattr(history, name) for history in loads])
        columns[heading(name, unit)] = values.astype(int) if name == "sliding" else values
    write_table(path, columns, note=NOTE)


def write_resultants_h5(
    path: Path,
    histories: Mapping[str, InterfaceHistory],
    heights: Mapping[str, Array] | None = None,
) -> None:
    """Write loads and slip of every interface with its face, frame and node numbers.

    ``heights`` ``(nx, ny)`` [mm] are the unworn gaps on the grid of the case, by interface.
    """
    line = any(history.interface.line for history in histories.values())
    with writing(path, line) as writer:
        for name, history in histories.items():
            face = history.interface
            writer.put(f"{name}/load_history", load_columns(history.loads))
            datasets = face_mesh(face) | {"slip": slip_field(history.slip)}
            if heights is not None:
                datasets["height"] = Dataset(heights[name], "mm", "gap before loading")
            if isinstance(face, Interface):
                datasets |= _at_nodes(face)
            writer.put(name, datasets, origin=face.frame.origin, axes=face.frame.axes)


def _at_nodes(face: Interface) -> dict[str, Dataset]:
    """Gap and node numbers at the nodes of the face; body 1's where both meet node to node."""
    datasets = {
        "nodes_1": Dataset(face.nodes_1, "1", "node numbers of body 1"),
        "nodes_2": Dataset(face.nodes_2, "1", "node numbers of body 2"),
        "nodal_height": Dataset(face.gap, "mm", "gap before loading, at the nodes"),
    }
    return {name: dataset for name, dataset in datasets.items() if len(dataset.values) == len(face)}
