"""Files with the loads of a structure, in the form in which they are read."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe_models.meshes.structure_mesh import Interface
from fe_models.structure import CycleSolution, InterfaceHistory
from sa_solver.load_history import LoadHistory
from sa_solver.types import Array
from workflow.analyses.contact.output.layout import LOAD_HISTORY, load_columns
from workflow.analyses.wear.output.datasets import mesh_of
from workflow.analyses.wear.output.layout import FACE
from workflow.analyses.wear.structures.resultants.consistency import MIX
from workflow.analyses.wear.structures.resultants.imported import CLOSURE, base_units
from workflow.layout.declared import Arrays, Layout
from workflow.shell.output.results import ResultsWriter, writing
from workflow.shell.output.tables import heading, write_table

LAYOUT = Layout.read(
    f"""
<face>{FACE}
    height | mm | x y | gap before loading
    nodes_1, nodes_2 | 1 | node | node numbers of body #
    nodal_height | mm | node | gap before loading, at the nodes
<face>/load_history{LOAD_HISTORY}
"""
)
NOTE = "forces and moments of body 1 on body 2, in the frame of each interface"


def marched(cycle: CycleSolution) -> str:
    """Return a note on which cycle the loads are, and how well it is closed."""
    return (
        f"the last of {cycle.cycles} cycles marched from rest; the contact forces differ from the "
        f"cycle before by {cycle.closure:.1e} of the largest"
    )


def write_resultants_csv(
    path: Path,
    histories: Mapping[str, LoadHistory],
    line: bool = False,
    cycle: CycleSolution | None = None,
) -> None:
    """Write the loads of every interface, with all digits of the numbers.

    Loads of a ``line`` contact are per mm. ``cycle`` is the solution that they come from, if any.
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
    if cycle is not None:
        columns[CLOSURE] = np.full(sum(lengths), cycle.closure)
    write_table(path, columns, note=NOTE if cycle is None else f"{NOTE}; {marched(cycle)}")


def write_resultants_h5(
    path: Path,
    histories: Mapping[str, InterfaceHistory],
    heights: Mapping[str, Array] | None = None,
    cycle: CycleSolution | None = None,
) -> None:
    """Write the loads and nodal fields of every interface, with its face, frame and node numbers.

    ``heights`` ``(nx, ny)`` [mm] are the unworn gaps on the grid of the case, by interface.
    ``cycle`` is the solution that the loads come from, if any.
    """
    line = any(history.interface.line for history in histories.values())
    with writing(path, LAYOUT, line) as writer:
        for name, history in histories.items():
            face = history.interface
            writer.put(f"{name}/load_history", load_columns(history.loads))
            solution = {"force": history.force, "displacement": history.displacement}
            arrays = {**mesh_of(face), "slip": history.slip, **solution}
            if heights is not None:
                arrays["height"] = heights[name]
            if isinstance(face, Interface):
                arrays |= _at_nodes(face)
            placed = {"origin": face.frame.origin, "axes": face.frame.axes}
            writer.put(name, arrays, **placed, weighted=face.weighted or None)
            if cycle is not None:
                put_closure(writer, name, cycle)


def put_closure(writer: ResultsWriter, group: str, cycle: CycleSolution) -> None:
    """Write the number of marched cycles and the closure of the last one, to be read back."""
    writer.put(group, {}, cycles=cycle.cycles, **{CLOSURE: cycle.closure})


def _at_nodes(face: Interface) -> Arrays:
    """Return gap and node numbers at the face's nodes; those of body 1 only if meshes match."""
    arrays = {"nodes_1": face.nodes_1, "nodes_2": face.nodes_2, "nodal_height": face.gap}
    return {name: array for name, array in arrays.items() if len(array) == len(face)}
