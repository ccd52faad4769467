"""ParaView files of a contact that a rig wears: ``contact.pvd``, its faces over the cycles.

Every step is the contact as it wears (``contact/<state>``): the cells of the grid as points of a
surface, or the nodes of the contacts. Warp By Vector on ``worn_1`` or ``worn_2`` shows a body's
worn shape. The axes are those of the face, or of the body where this is reduced. ``view.py`` shows
the fields.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from sa_solver.types import Array, Frame
from workflow.analyses.vibration.case.pad_nodes import rows_and_columns
from workflow.analyses.vibration.output.paraview import pad_mesh
from workflow.analyses.vibration_wear.output.outcome import VibrationWearContents
from workflow.pictures.view import FIRST, PictureScene, Shown, View, write_view
from workflow.pictures.vtk import (
    CYCLES,
    FacePoints,
    Fields,
    Step,
    attach,
    quadrilaterals,
    write_series,
)
from workflow.shell.output.results import grid_of

if TYPE_CHECKING:
    import pyvista

SERIES = "contact.pvd"
FACE = Frame(np.zeros(3), np.eye(3))
# Sign along the normal of the motion of each surface by wear.
INTO_BODY = {1: -1.0, 2: 1.0}
# Unit of energy per area and cycle; results at nodes have plain energy.
PER_AREA = "N/mm"


def write_vibration_wear(
    contents: VibrationWearContents, file: h5py.File, folder: Path
) -> list[Path]:
    """Write the states, their series over the cycles, and the script; return their paths.

    Writes nothing where the places of the nodes are not known.
    """
    if not contents.placed:
        return []
    steps = _nodes(file, folder) if contents.at_nodes else _cells(file, folder)
    written = write_series(folder / SERIES, CYCLES, steps)
    return [*written, _write_view(file, folder)]


def _cells(file: h5py.File, folder: Path) -> Iterator[Step]:
    points = FacePoints(grid_of(file["grid"]), FACE)
    for name, state in file["worn"].items():
        contact = state["contact"]
        shown = {key: points.of(contact[key]) for key in ("pressure", "energy")}
        path = folder / "contact" / f"{name}.vtp"
        mesh = points.mesh(_fields(contact, shown, points.of, "gap", FACE.axes[2]))
        yield float(state.attrs["cycles"]), "contact", path, mesh


def _nodes(file: h5py.File, folder: Path) -> Iterator[Step]:
    places = file["places"]
    area, placed = places["area"][()], "position" in places
    normal = places["normal"][()] if placed else FACE.axes[2]
    for name, state in file["worn"].items():
        nodes = state["nodes"]
        shown = {"pressure": nodes["normal_force"][()] / area, "energy": nodes["energy"][()] / area}
        mesh = _body_mesh(places) if placed else pad_mesh(places)
        fields = _fields(nodes, shown, lambda dataset: dataset[()], "unloaded_gap", normal)
        attach(mesh.point_data, fields | {"area": (area, "mm^2")})
        yield float(state.attrs["cycles"]), "contact", folder / "contact" / f"{name}.vtu", mesh


def _body_mesh(places: h5py.Group) -> pyvista.UnstructuredGrid:
    """Return quadrilaterals between nodes in rows and columns, for each normal; or nodes alone."""
    import pyvista

    position, normals = places["position"][()], places["normal"][()]
    faces, alone = [], []
    for normal in np.unique(normals, axis=0):
        nodes = np.flatnonzero((normals == normal).all(axis=1))
        numbers = rows_and_columns(*position[nodes][:, normal == 0.0].T)
        if numbers is None:
            alone.append(nodes[:, None])
        else:
            faces.append(quadrilaterals(nodes[numbers]))
    kinds = {pyvista.CellType.QUAD: faces, pyvista.CellType.VERTEX: alone}
    cells = {kind: np.concatenate(parts) for kind, parts in kinds.items() if parts}
    return pyvista.UnstructuredGrid(cells, position)


def _fields(
    contact: h5py.Group, shown: dict[str, Array], of: Any, gap: str, normal: Array
) -> Fields:
    """Return fields of a state: pressure and gap at rest, slip and energy of a cycle, and wear.

    ``gap`` is the name of the gap in the results: at rest, or of bodies without load. ``normal``
    ``(3,)``, or one for each point, points out of body 1.
    """
    depths = {body: of(contact[f"depth_{body}"]) for body in INTO_BODY}
    fields: Fields = {
        "pressure": (shown["pressure"], "MPa"),
        gap: (of(contact["gap"]), "mm"),
        "cycle_slip": (of(contact["path"]), "mm"),
        "cycle_energy": (shown["energy"], PER_AREA),
        "depth": (depths[1] + depths[2], "mm"),
    }
    for body, depth in depths.items():
        fields[f"depth_{body}"] = depth, "mm"
        fields[f"worn_{body}"] = INTO_BODY[body] * depth[:, None] * normal, "mm"
    return fields


def _write_view(file: h5py.File, folder: Path) -> Path:
    """Write the script, which begins at the last state, and return its path."""
    states = list(file["worn"].values())
    last = states[-1]["nodes" if "nodes" in states[-1] else "contact"]
    most = 1 if np.max(last["depth_1"][()]) >= np.max(last["depth_2"][()]) else 2
    views = [
        View("Worn depth of both bodies", [Shown(SERIES, "depth [mm]", f"worn_{most} [mm]")]),
        View("Contact pressure at rest", [Shown(SERIES, "pressure [MPa]")]),
        View("Slip in a cycle that wears", [Shown(SERIES, "cycle_slip [mm]")]),
        View("Energy of such a cycle per area", [Shown(SERIES, f"cycle_energy [{PER_AREA}]")]),
    ]
    cycles = float(states[-1].attrs["cycles"])
    return write_view(PictureScene(str(file.attrs["title"]), CYCLES, cycles, views), folder / FIRST)
