"""Stress under the contacts for ParaView: sections at their place, fretting maps on the faces."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from sa_solver.types import Array, Frame
from workflow.analyses.wear.layout import jump_names
from workflow.pictures.vtk import Fields, Step, attach, cells, write_series, write_xml


def life_fields(file: h5py.File, interface: str, jump: str) -> Fields:
    """Maps of the fretting parameter and what it is made of, by name and body; scalars only.

    They are computed before the first and after the last jump: not a number in between.
    """
    name = f"stress/life/{interface}"
    if name not in file:
        return {}
    jumps = jump_names(file, interface)
    moment = {jumps[0]: "unworn", jumps[-1]: "worn"}.get(jump)
    fields: Fields = {}
    for body in (1, 2):
        for key, values in file[name]["unworn"][f"body_{body}"].items():
            if values.ndim == 2:
                known = values if moment is None else file[name][moment][f"body_{body}"][key]
                field = cells(known) if moment else np.full(values.size, np.nan)
                fields[f"{key}_{body}"] = field, str(values.attrs["unit"])
    return fields


def write_sections(file: h5py.File, interface: str, frame: Frame, folder: Path) -> list[Path]:
    """The section through both bodies, unworn and worn, and the series that lists them."""
    name = f"stress/section/{interface}"
    if name not in file:
        return []
    contact, jumps = file["contact"][interface], jump_names(file, interface)
    steps: list[Step] = []
    for moment, jump in (("unworn", jumps[0]), ("worn", jumps[-1])):
        for body in (1, 2):
            path = folder / "section" / f"{interface}_{moment}_{body}.vts"
            _write_section(file[name], f"{moment}/body_{body}", body, frame, path)
            steps.append((float(contact[jump].attrs["cycles"]), f"body_{body}", path))
    return write_series(folder / f"section_{interface}.pvd", steps)


def _write_section(group: h5py.Group, state: str, body: int, frame: Frame, path: Path) -> None:
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
    write_xml(mesh, path)


def _places(group: h5py.Group, body: int) -> Array:
    """The section's points in the interface frame ``(n, k, 3)`` [mm]."""
    along, depths = np.meshgrid(group["along"][()], group["depths"][()], indexing="ij")
    across = np.full_like(along, float(group.attrs["at"]))
    in_plane = (along, across) if group.attrs["axis"] == "x" else (across, along)
    return np.stack([*in_plane, -depths if body == 1 else depths], axis=-1)
