"""Stress under the contacts for ParaView: sections at their place, fretting maps on the faces."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from fe_models.elasticity.stress import turned
from sa_solver.types import Array, Frame
from workflow.analyses.wear.output.layout import WearContents
from workflow.pictures.vtk import (
    CYCLES,
    FacePoints,
    Fields,
    Step,
    attach,
    quadrilaterals,
    write_series,
)
from workflow.shell.output.results import frame_of

if TYPE_CHECKING:
    import pyvista


def write_life(
    contents: WearContents, file: h5py.File, interface: str, points: FacePoints, folder: Path
) -> list[Path]:
    """Write maps of the fretting parameter and its factors, unworn and worn, by body."""
    if interface not in contents.life:
        return []
    path = folder / f"life_{interface}.pvd"
    return write_series(path, CYCLES, _maps(contents, file, interface, points, folder / "life"))


def _maps(
    contents: WearContents, file: h5py.File, interface: str, points: FacePoints, folder: Path
) -> Iterator[Step]:
    contact, life = file["contact"][interface], file["stress/life"][interface]
    for state, jump in contents.states:
        fields: Fields = {}
        for body in contents.strained:
            for key, values in life[state][f"body_{body}"].items():
                if values.ndim == 2:
                    fields[f"{key}_{body}"] = points.of(values), str(values.attrs["unit"])
        path = folder / f"{interface}_{state}.vtp"
        yield float(contact[jump].attrs["cycles"]), interface, path, points.mesh(fields)


def write_sections(
    contents: WearContents, file: h5py.File, interface: str, folder: Path
) -> list[Path]:
    """Write the section through the bodies, unworn and worn, and the series that lists them."""
    if not contents.sections:
        return []
    path = folder / f"section_{interface}.pvd"
    return write_series(path, CYCLES, _sections(contents, file, interface, folder / "section"))


def _sections(
    contents: WearContents, file: h5py.File, interface: str, folder: Path
) -> Iterator[Step]:
    frame = frame_of(file["grid"][interface])
    contact, section = file["contact"][interface], file["stress/section"][interface]
    for state, jump in contents.states:
        for body in contents.strained:
            mesh = _section(section, f"{state}/body_{body}", body, frame)
            path = folder / f"{interface}_{state}_{body}.vtu"
            yield float(contact[jump].attrs["cycles"]), f"body_{body}", path, mesh


def _section(group: h5py.Group, state: str, body: int, frame: Frame) -> pyvista.UnstructuredGrid:
    """Return the mesh of one body's section, without points outside the body."""
    import pyvista

    places, equivalent = _places(group, body), group[state]["von_mises"][()]
    number = np.arange(equivalent.size).reshape(equivalent.shape)
    quads = quadrilaterals(number)
    inside = np.isfinite(equivalent.ravel()[quads]).all(axis=1)
    points, cells = np.unique(quads[inside], return_inverse=True)
    mesh = pyvista.UnstructuredGrid(
        {pyvista.CellType.QUAD: cells.reshape(-1, 4)},
        frame.to_global(places.reshape(-1, 3)[points]) + frame.origin,
    )
    along_face = group[state]["stress"][()].reshape(6, -1)[:, points]
    # The transposed axes turn components from the face's axes to the global ones.
    along_global = turned(along_face, Frame(frame.origin, frame.axes.T))
    fields: Fields = {
        "von_mises": (equivalent.ravel()[points], "MPa"),
        "stress": (along_global.T, "MPa"),
        "face_stress": (along_face.T, "MPa"),
    }
    attach(mesh.point_data, fields)
    return mesh


def _places(group: h5py.Group, body: int) -> Array:
    """Return the section's points in the interface frame ``(n, k, 3)`` [mm]."""
    along, depths = np.meshgrid(group["along"][()], group["depths"][()], indexing="ij")
    across = np.full_like(along, float(group.attrs["at"]))
    in_plane = (along, across) if group.attrs["axis"] == "x" else (across, along)
    return np.stack([*in_plane, -depths if body == 1 else depths], axis=-1)
