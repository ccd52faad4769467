"""HDF5 files that are never half written, and the layout of ``results.h5``.

A file is written beside its place and renamed: whoever is killed in the middle leaves the old one.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from sa_solver.types import Array, Frame, Grid

if TYPE_CHECKING:
    from fe_models.mesh import Face
    from wear.interface import FaceLoads

# Name of the only interface of a contact case.
BODIES = "bodies"

# Units of the forces and moments of a line contact, by those of a contact over an area.
PER_LENGTH = {"N": "N/mm", "N mm": "N mm/mm", "mm^2": "mm^2/mm", "mm^3": "mm^3/mm"}

# Ending of files that are being written.
PARTIAL = ".part"

# Unit and description of every dataset, by its own name.
DATASETS = {
    "P": ("N", "normal force on body 2"),
    "Qx": ("N", "tangential force on body 2 along x"),
    "Qy": ("N", "tangential force on body 2 along y"),
    "Mx": ("N mm", "moment of the pressure about x"),
    "My": ("N mm", "moment of the pressure about y"),
    "Mz": ("N mm", "moment of the shear about z"),
    "Edx": ("N mm", "energy dissipated in the increment by slip along x"),
    "Edy": ("N mm", "energy dissipated in the increment by slip along y"),
    "sliding": ("1", "whether the whole face slides"),
    "share": ("1", "of the mission's cycles among all cycles of the mix"),
    "block": ("1", "mission of the mix, counted from 0"),
    "coordinates": ("mm", "nodes in the interface frame"),
    "facets": ("1", "corner nodes of the triangles, or of the segments of a line contact"),
    "gap": ("mm", "distance of the deformed faces"),
    "pressure": ("MPa", "contact pressure"),
    "shear": (
        "MPa",
        "shear on body 2, x and y; in a wear run µp where the structure slips, else 0",
    ),
    "slip": ("mm", "slip of body 2 over body 1 in the increment, x and y"),
    "increment": ("1", "row of the path, counted from 1"),
    "approach": ("mm", "motion of body 1 towards body 2"),
    "shift_x": ("mm", "motion of body 1 relative to body 2 along x"),
    "shift_y": ("mm", "motion of body 1 relative to body 2 along y"),
    "tilt_x": ("rad", "rotation of body 1 relative to body 2 about x"),
    "tilt_y": ("rad", "rotation of body 1 relative to body 2 about y"),
    "twist": ("rad", "rotation of body 1 relative to body 2 about z"),
    "bulk_stress_1": ("MPa", "stress along x in body 1 far below the contact"),
    "bulk_stress_2": ("MPa", "stress along x in body 2 far above the contact"),
    "height": ("mm", "gap before loading"),
    "sticking": ("1", "whether the cell is pressed and its shear below µp"),
    "energy_half_space": ("N mm", "energy dissipated in each increment, half-space pressure"),
    "body_1": ("mm", "height of body 1 in the interface frame"),
    "body_2": ("mm", "height of body 2 in the interface frame"),
    "cycles": ("1", "cycles"),
    "depth_1": ("mm", "largest worn depth of body 1"),
    "depth_2": ("mm", "largest worn depth of body 2"),
    "volume_1": ("mm^3", "worn volume of body 1"),
    "volume_2": ("mm^3", "worn volume of body 2"),
    "energy": ("N mm", "energy dissipated so far"),
    "points": ("mm", "vertices"),
    "elements": ("1", "corner vertices of the tetrahedra, or of the triangles in the plane"),
    "displacement": ("mm", "displacement at peak load"),
    "von_mises": ("MPa", "von Mises stress at peak load"),
    "maximum_principal": ("MPa", "largest principal stress at peak load"),
    "full": ("Hz", "natural frequencies of the free body, finite elements"),
    "reduced": ("Hz", "natural frequencies of the free body, reduced model"),
    "worn_1": ("mm", "worn depth of body 1"),
    "worn_2": ("mm", "worn depth of body 2"),
    "shear_x": ("MPa", "shear on body 2 along x at the end of first loading"),
    "cycle_slip": ("mm", "path of slip along x in a cycle"),
    "area": ("mm^2", "area in contact"),
    "peak_pressure": ("MPa", "largest pressure"),
    "pressure_deviation": ("1", "root mean square of pressure/mean - 1 over the pad"),
    "energy_per_cycle": ("N mm", "energy dissipated in a cycle"),
    "friction": ("1", "largest tangential over normal force"),
    "stick_stiffness": ("N/mm", "tangential stiffness with all that touches stuck"),
    "secant_stiffness": ("N/mm", "slope of the loop up to half of its largest force"),
    "stable_cycles": ("1", "cycles of constant shape beyond which errors of shape grow"),
    "ring_displacement": ("mm", "motion of body 2's ring along x"),
    "ring_force": ("N", "force along x that moves body 2's ring"),
    "along": ("mm", "centres of the section's cells, along its axis"),
    "depths": ("mm", "of the section's points below the surface"),
    "stress": (
        "MPa",
        "xx, yy, zz, xy, yz, zx in the section at peak load under the contact's tractions alone",
    ),
    "friction_parameter": ("N/mm", "Ruiz's F1: a quarter of the friction work of a cycle per area"),
    "tension": (
        "MPa",
        "largest tension along the surface over a cycle, under the contact's tractions alone",
    ),
    "cracking_parameter": ("N^2/mm^3", "Ruiz's F2: F1 times tension"),
    "smith_watson_topper": ("MPa", "largest normal stress times strain amplitude, worst plane"),
    "strain_amplitude": ("1", "amplitude of the normal strain on the worst plane"),
    "findley": ("MPa", "shear stress amplitude plus k largest normal stress, worst plane"),
    "shear_amplitude": ("MPa", "amplitude of the shear stress on the worst plane"),
    "normal_stress": ("MPa", "largest normal stress over a cycle on the worst plane"),
    "normal": ("1", "unit normal of the worst plane, in the interface frame"),
    "left_out": ("1", "increments without full knowledge of the shear, not in the life map"),
}


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to; it takes the place of ``path`` once the writing has ended well."""
    partial = path.with_name(f".{path.name}.{os.getpid()}{PARTIAL}")
    try:
        yield partial
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def write_arrays(
    path: Path, arrays: Mapping[str, Any], attributes: Mapping[str, Any] | None = None
) -> None:
    """Write named arrays (names may hold slashes) and attributes of the root."""
    with replacing(path) as partial, h5py.File(partial, "w") as file:
        for name, values in arrays.items():
            file.create_dataset(name, data=values)
        file.attrs.update(attributes or {})


def read_arrays(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """All arrays of a file by their full name, and the attributes of its root."""
    arrays: dict[str, Any] = {}

    def collect(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            arrays[name] = item[()]

    with h5py.File(path, "r") as file:
        file.visititems(collect)
        return arrays, dict(file.attrs)


def grid_of(group: h5py.Group) -> Grid:
    """The grid that a group's attributes describe."""
    (nx, ny), (dx, dy) = group.attrs["shape"], group.attrs["pitch"]
    return Grid((int(nx), int(ny)), (float(dx), float(dy)), bool(group.attrs.get("line", False)))


def frame_of(group: h5py.Group) -> Frame:
    """The frame that a group's attributes describe."""
    return Frame(np.array(group.attrs["origin"]), np.array(group.attrs["axes"]))


def body_names(file: h5py.File) -> dict[int, str]:
    """Names of body 1 and body 2 in a wear run."""
    name_1, name_2 = file.attrs["bodies"]
    return {1: str(name_1), 2: str(name_2)}


def jump_names(file: h5py.File, interface: str) -> list[str]:
    """Names of the jumps that have both surfaces and a contact solution, ascending."""
    return sorted(set(file["surfaces"][interface]) & set(file["contact"][interface]))


class ResultsWriter:
    """Fills an open ``results.h5``; every dataset gets its unit and description."""

    def __init__(self, file: h5py.File, per_length: bool = False) -> None:
        """Forces and energies are ``per_length`` in a line contact."""
        self.file = file
        self._units = PER_LENGTH if per_length else {}

    def put(self, group: str, **datasets: Any) -> None:
        """Write datasets into a group."""
        for name, values in datasets.items():
            values = np.asarray(values)
            large = {"compression": "gzip", "compression_opts": 1} if values.size > 4096 else {}
            dataset = self.file.create_dataset(f"{group}/{name}", data=values, **large)
            unit, dataset.attrs["description"] = DATASETS[name]
            dataset.attrs["unit"] = self._units.get(unit, unit)

    def put_grid(self, name: str, grid: Grid, frame: Frame) -> None:
        """Grid of an interface and its place in space."""
        group = self.file.create_group(f"grid/{name}")
        group.attrs.update(
            {"shape": grid.shape, "pitch": grid.pitch, "origin": frame.origin, "axes": frame.axes}
        )
        if grid.line:
            group.attrs["line"] = True

    def put_face(self, group: str, face: Face, loads: FaceLoads) -> None:
        """A contact face over a cycle; nodal pressure and shear where a structure gives them."""
        self.put(f"{group}/load_history", **loads.loads.columns())
        self.put(group, coordinates=face.coordinates, facets=face.facets, slip=loads.slip)
        force = getattr(loads, "force", None)
        if force is not None:
            pressure, shear = force[:, 2] / face.nodal_areas, force[:, :2] / face.nodal_areas
            self.put(group, pressure=pressure, shear=shear)

    def put_body(self, group: str, points: Array, elements: Any, field: Any) -> None:
        """Mesh and stress of one body."""
        self.put(group, points=points, elements=elements, **vars(field))
