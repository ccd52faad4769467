"""The structure for ParaView: bodies and notches at peak load, bodies over a mission."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from workflow.analyses.wear.output.body_mesh import body_mesh
from workflow.analyses.wear.output.layout import WearContents
from workflow.pictures.vtk import CYCLES, INCREMENTS, Step, attach, write_series

if TYPE_CHECKING:
    import pyvista

# Fields of a body, with units; its surface over the increments has no tensors.
SURFACE = {"displacement": "mm", "von_mises": "MPa", "maximum_principal": "MPa"}
NODAL = SURFACE | {"stress": "MPa"}


def write_structure(contents: WearContents, file: h5py.File, folder: Path) -> list[Path]:
    """Write the series of both bodies at peak load, and those over the increments if present."""
    bodies = _bodies(contents, file, folder / "structure")
    written = write_series(folder / "structure.pvd", CYCLES, bodies)
    if contents.notches:
        notches = _notches(contents, file, folder / "notch")
        written += write_series(folder / "notch.pvd", CYCLES, notches)
    for state, _ in contents.states if contents.mission else ():
        steps = _mission(file, state, folder / "mission")
        written += write_series(folder / f"mission_{state}.pvd", INCREMENTS, steps)
    return written


def _bodies(contents: WearContents, file: h5py.File, folder: Path) -> Iterator[Step]:
    """Yield all bodies at peak load, unworn and worn, with nodal displacement and stresses."""
    cycles = file["kinetics/cycles"][()]
    for (state, _), time in zip(contents.states, cycles[[0, -1]].tolist(), strict=False):
        for body, states in file["bodies"].items():
            yield time, body, folder / f"{body}_{state}.vtu", _stressed(states[state])


def _notches(contents: WearContents, file: h5py.File, folder: Path) -> Iterator[Step]:
    """Yield the local models of the notches at peak load, unworn and worn."""
    cycles = file["kinetics/cycles"][()]
    for (state, _), time in zip(contents.states, cycles[[0, -1]].tolist(), strict=False):
        for body in contents.notches:
            mesh = _stressed(file["bodies"][body][state]["notch"])
            yield time, body, folder / f"{body}_{state}.vtu", mesh


def _stressed(group: h5py.Group) -> pyvista.UnstructuredGrid:
    """Return a body with its displacements and stresses."""
    mesh = body_mesh(group)
    fields = {name: (np.atleast_1d(group[name][()]), unit) for name, unit in NODAL.items()}
    tensor, unit = fields["stress"]
    attach(mesh.point_data, fields | {"stress": (tensor.T, unit)})
    return mesh


def _mission(file: h5py.File, state: str, folder: Path) -> Iterator[Step]:
    """Yield the surfaces of all bodies in every stored increment."""
    import pyvista

    missions = {body: states[state]["mission"] for body, states in file["bodies"].items()}
    increments = next(iter(missions.values()))["increments"][()].tolist()
    for number, increment in enumerate(increments):
        for body, mission in missions.items():
            points = mission["points"][()].astype(np.float32)
            mesh = pyvista.PolyData.from_regular_faces(points, mission["triangles"][()])
            fields = {name: (mission[name][number], unit) for name, unit in SURFACE.items()}
            attach(mesh.point_data, fields)
            yield float(increment), body, folder / f"{body}_{state}_{increment:04d}.vtp", mesh
