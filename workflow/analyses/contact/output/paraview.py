"""ParaView files of a contact run: ``contact.pvd``, the face at every computed increment.

Its steps have the cells of the grid as points of a surface, or of a line in line contacts
(``contact/<increment>.vtp``). ``view.py`` shows them.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py

from workflow.analyses.contact.output.layout import BODIES, ContactContents
from workflow.pictures.view import FIRST, PictureScene, Shown, View, write_view
from workflow.pictures.vtk import (
    INCREMENTS,
    PROFILE,
    FacePoints,
    Step,
    named,
    traction_fields,
    write_series,
)
from workflow.shell.output.results import frame_of, grid_of

# Titles of the views, the fields that they show and their units.
VIEWS = {
    "Contact pressure": ("pressure", "MPa"),
    "Shear on body 2": ("shear", "MPa"),
    "Slip of body 2 over body 1": ("slip", "mm"),
}


def write_contact(contents: ContactContents, file: h5py.File, folder: Path) -> list[Path]:
    """Write the faces, their series over the increments, and the script; return their paths."""
    written = write_series(folder / "contact.pvd", INCREMENTS, _faces(file, folder))
    states = file["contact"][BODIES].values()
    last = max(float(state.attrs["increment"]) for state in states)
    warps = {"pressure": PROFILE} if contents.line else {}
    views = [
        View(title, [Shown("contact.pvd", named(name, unit), warps.get(name, ""))])
        for title, (name, unit) in VIEWS.items()
        if name == "pressure" or any(state[name][()].any() for state in states)
    ]
    scene = PictureScene(str(file.attrs["title"]), INCREMENTS, last, views)
    return [*written, write_view(scene, folder / FIRST)]


def _faces(file: h5py.File, folder: Path) -> Iterator[Step]:
    points = FacePoints(grid_of(file["grid"][BODIES]), frame_of(file["grid"][BODIES]))
    for name, state in file["contact"][BODIES].items():
        distances = [field for field in ("gap", "flattening") if field in state]
        fields = traction_fields(state, points) | {
            field: (points.of(state[field]), "mm") for field in distances
        }
        path = folder / "contact" / f"{name}.vtp"
        yield float(state.attrs["increment"]), BODIES, path, points.mesh(fields)
