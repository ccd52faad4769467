"""A wear run for ParaView: faces as they wear, the structure before and after, worn surfaces.

The folder has these files:

- ``view.py``, to be opened first, and ``view_mission.py``: scripts that show the results;
- ``<interface>.pvd``: time series over the cycles; every step has the points of the contact grid
  that lie on the face (``<interface>/<jump>.vtp``, a line in line contacts), in its nominal
  plane. Warp By Vector on ``surface_1`` or ``surface_2`` shows the true surface of a body, with
  rounded edges and wear; on ``worn_1`` or ``worn_2`` the wear alone;
- ``life_<interface>.pvd``: the fretting parameter on the same points, unworn and worn;
- ``section_<interface>.pvd``: stress in a plane through both bodies under the contact, unworn and
  worn (``section/<interface>_<state>_<body>.vtu``);
- ``structure.pvd``: all bodies at peak load, unworn at 0 and worn at the last computed number of
  cycles (``structure/<body>_<state>.vtu``); Warp By Vector on ``displacement`` deforms them;
- ``notch.pvd``: the local models of the notches of bodies, in the same way;
- ``mission_unworn.pvd`` and ``mission_worn.pvd``: their surfaces over the increments of the load;
- ``flank_<interface>_<body>.stl``: the worn surfaces at true scale in global coordinates, except
  for line contacts.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from fe_models.meshes.structure_mesh import Face
from fe_models.meshes.transfer import FaceTransfer
from workflow.analyses.wear.output.layout import OTHER_FACE, WearContents, jump_name
from workflow.analyses.wear.paraview.structure import write_structure
from workflow.analyses.wear.paraview.subsurface import write_life, write_sections
from workflow.analyses.wear.paraview.views import write_views
from workflow.pictures.vtk import (
    CYCLES,
    FacePoints,
    Fields,
    Step,
    traction_fields,
    write_series,
    write_stl,
)
from workflow.shell.output.results import frame_of, grid_of


def write_wear(contents: WearContents, file: h5py.File, folder: Path) -> list[Path]:
    """Write the files that show a wear run, and return their paths."""
    written: list[Path] = []
    for name in contents.names:
        points = _face_points(file, name)
        steps = _faces(contents, file, name, points, folder / name)
        written += write_series(folder / f"{name}.pvd", CYCLES, steps)
        written += write_life(contents, file, name, points, folder)
        written += write_sections(contents, file, name, folder)
        if not contents.line:
            written += _write_worn_surfaces(contents, file, name, points, folder)
    if contents.structure:
        written += write_structure(contents, file, folder)
    return [*written, *write_views(contents, file, folder)]


# --- faces --------------------------------------------------------------------------------------


def _face_points(file: h5py.File, interface: str) -> FacePoints:
    """Return the cells of an interface's grid that lie on the finite element contact faces.

    Rounded edges are included. Cells beyond the faces are not part of the bodies.
    """
    grid, frame = grid_of(file["grid"][interface]), frame_of(file["grid"][interface])
    group = file["structure"][interface]
    meshes = [group, *([group[OTHER_FACE]] if OTHER_FACE in group else [])]
    faces = [Face("", frame, m["coordinates"][()], m["facets"][()]) for m in meshes]
    inside = [FaceTransfer.between(face, grid).inside for face in faces]
    return FacePoints(grid, frame, np.all(inside, axis=0))


def _faces(
    contents: WearContents, file: h5py.File, interface: str, points: FacePoints, folder: Path
) -> Iterator[Step]:
    """Yield one face after every jump."""
    contact, surfaces = file["contact"][interface], file["surfaces"][interface]
    for jump in contents.jump_names:
        fields = traction_fields(contact[jump], points) | _surface_fields(surfaces, jump, points)
        path = folder / f"{jump}.vtp"
        yield float(contact[jump].attrs["cycles"]), interface, path, points.mesh(fields)


def _surface_fields(surfaces: h5py.Group, jump: str, points: FacePoints) -> Fields:
    """Return depths, and vectors from the nominal plane for surfaces and their wear."""
    fields: Fields = {}
    depths = []
    for body in (1, 2):
        height = points.of(surfaces[jump][f"body_{body}"])
        worn = height - points.of(surfaces[jump_name(0)][f"body_{body}"])
        depths.append(np.abs(worn))
        fields[f"depth_{body}"] = depths[-1], "mm"
        fields[f"worn_{body}"] = points.normal(worn), "mm"
        fields[f"surface_{body}"] = points.normal(height), "mm"
    return fields | {"depth": (depths[0] + depths[1], "mm")}


# --- worn surfaces ------------------------------------------------------------------------------


def _write_worn_surfaces(
    contents: WearContents, file: h5py.File, interface: str, points: FacePoints, folder: Path
) -> list[Path]:
    """Write STL files of both worn surfaces of one face, for CAD and meshers.

    Vertices are the points of the face. Normals point out of the body. An STL file has single
    precision: about 1e-5 mm at 250 mm from the origin.
    """
    import pyvista

    last, written = contents.jump_names[-1], []
    for body, name in enumerate(contents.bodies, start=1):
        height = points.of(file["surfaces"][interface][last][f"body_{body}"])
        triangles = points.triangles if body == 1 else points.triangles[:, ::-1]
        surface = pyvista.PolyData.from_regular_faces(
            points.places + points.normal(height), triangles
        )
        path = folder / f"flank_{interface}_{name}.stl"
        write_stl(surface, path)
        written.append(path)
    return written
