"""Stress under the contacts for ParaView: sections at their place, fretting maps on the faces."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from sa_solver.types import Array, Frame
from workflow.analyses.wear.layout import Contents
from workflow.pictures.vtk import Fields, Step, attach, cells, write_series
from workflow.shell.results import frame_of

if TYPE_CHECKING:
    import pyvista


def life_fields(contents: Contents, file: h5py.File, interface: str, jump: str) -> Fields:
    """Maps of the fretting parameter and what it is made of, by name and body; scalars only.

    They are computed before the first and after the last jump: not a number in between.
    """
    if interface not in contents.life:
        return {}
    life = file["stress/life"][interface]
    moment = {last: moment for moment, last in contents.ends}.get(jump)
    fields: Fields = {}
    for body in (1, 2):
        for key, values in life["unworn"][f"body_{body}"].items():
            if values.ndim == 2:
                known = values if moment is None else life[moment][f"body_{body}"][key]
                field = cells(known) if moment else np.full(values.size, np.nan)
                fields[f"{key}_{body}"] = field, str(values.attrs["unit"])
    return fields


def write_sections(contents: Contents, file: h5py.File, interface: str, folder: Path) -> list[Path]:
    """The section through both bodies, unworn and worn, and the series that lists them."""
    if not contents.sections:
        return []
    path = folder / f"section_{interface}.pvd"
    return write_series(path, _sections(contents, file, interface, folder / "section"))


def _sections(contents: Contents, file: h5py.File, interface: str, folder: Path) -> Iterator[Step]:
    frame = frame_of(file["grid"][interface])
    contact, section = file["contact"][interface], file["stress/section"][interface]
    for moment, jump in contents.ends:
        for body in (1, 2):
            mesh = _section(section, f"{moment}/body_{body}", body, frame)
            path = folder / f"{interface}_{moment}_{body}.vts"
            yield float(contact[jump].attrs["cycles"]), f"body_{body}", path, mesh


def _section(group: h5py.Group, state: str, body: int, frame: Frame) -> pyvista.StructuredGrid:
    """One body's section; the components of stress are those of the interface frame."""
    import pyvista

    places = _places(group, body)
    mesh = pyvista.StructuredGrid()
    mesh.points = frame.to_global(places.reshape(-1, 3)) + frame.origin
    mesh.dimensions = (places.shape[1], places.shape[0], 1)
    fields: Fields = {"von_mises": (np.ravel(group[state]["von_mises"][()]), "MPa")}
    for component, values in zip(group.attrs["components"], group[state]["stress"], strict=True):
        fields[f"stress_{component}"] = np.ravel(values), "MPa"
    attach(mesh.point_data, fields)
    return mesh


def _places(group: h5py.Group, body: int) -> Array:
    """The section's points in the interface frame ``(n, k, 3)`` [mm]."""
    along, depths = np.meshgrid(group["along"][()], group["depths"][()], indexing="ij")
    across = np.full_like(along, float(group.attrs["at"]))
    in_plane = (along, across) if group.attrs["axis"] == "x" else (across, along)
    return np.stack([*in_plane, -depths if body == 1 else depths], axis=-1)
