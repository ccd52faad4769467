"""Faces, surfaces and kinetics of worn contacts as datasets, for all analyses that have them.

Extensive quantities have the units of a contact over an area.
"""

from __future__ import annotations

from fe_models.meshes.structure_mesh import Face
from sa_solver.types import Array
from wear.contact.drive import TILTS, Drive
from wear.contact.face_loads import FaceLoads
from workflow.analyses.contact.output.datasets import (
    load_columns,
    pressure_field,
    shear_field,
    slip_field,
)
from workflow.shell.output.dataset import Dataset
from workflow.shell.output.results import ResultsWriter

# Group of the face of body 1, below that of the contact, which is the face of body 2.
OTHER_FACE = "face_1"


def face_mesh(face: Face) -> dict[str, Dataset]:
    """Return nodes ``(n, 2)`` and facets ``(m, 3)``, in a line contact ``(m, 2)``, of a face."""
    facets = "corner nodes of the triangles, or of the segments of a line contact"
    return {
        "coordinates": Dataset(face.coordinates, "mm", "nodes in the interface frame"),
        "facets": Dataset(face.facets, "1", facets),
    }


def put_face(
    writer: ResultsWriter,
    group: str,
    face: Face,
    carried: FaceLoads,
    drive: Drive | None = None,
    slip_known: bool = True,
) -> None:
    """Write a contact face over a cycle, with forces, tractions and displacements if known.

    Where a ``drive`` imposes a tilt, the loads have no moment of the pressure about its axis. Slip
    and energies are left out where the loads do not include them.
    """
    columns = load_columns(carried.loads)
    for name, k in zip(("Mx", "My"), TILTS, strict=True):
        if drive is not None and drive.motion[k]:
            del columns[name]
    if not slip_known:
        del columns["Edx"], columns["Edy"]
    writer.put(f"{group}/load_history", columns)
    datasets = face_mesh(face) | ({"slip": slip_field(carried.slip)} if slip_known else {})
    writer.put(group, datasets, weighted=face.weighted or None)
    if (other := face.face(1)) is not face:
        writer.put(f"{group}/{OTHER_FACE}", face_mesh(other))
    force, displacement = carried.force, carried.displacement
    if force is not None and displacement is not None:
        pressure, shear = force[:, 2] / face.nodal_areas, force[:, :2] / face.nodal_areas
        writer.put(group, {"pressure": pressure_field(pressure), "shear": shear_field(shear)})
        writer.put(group, nodal_solution(force, displacement))


def nodal_solution(force: Array, displacement: Array) -> dict[str, Dataset]:
    """Return the datasets of forces and displacements ``(t, 3, n)`` at the nodes of a face."""
    moved = "of body 2 relative to body 1 since both were unloaded and unworn, x, y and z"
    return {
        "force": Dataset(force, "N", "of body 1 on body 2 at the nodes, x, y and z"),
        "displacement": Dataset(displacement, "mm", moved),
    }


def surface_heights(body_1: Array, body_2: Array) -> dict[str, Dataset]:
    """Return the datasets of the heights ``(nx, ny)`` of both bodies."""
    return {
        f"body_{body}": Dataset(height, "mm", f"height of body {body} in the interface frame")
        for body, height in enumerate((body_1, body_2), start=1)
    }


def cycles_column(cycles: Array) -> Dataset:
    """Return the dataset of the cycles ``(n,)`` of the kinetics."""
    return Dataset(cycles, "1", "cycles")


def kinetics_columns(kinetics: Array, area: Array) -> dict[str, Dataset]:
    """Return datasets of wear, dissipated energy and contact area over the cycles, ``(n,)`` each.

    ``kinetics`` ``(n, 5)`` has depths and volumes of both bodies, and the energy.
    """
    depth_1, depth_2, volume_1, volume_2, energy = kinetics.T
    return {
        "depth_1": Dataset(depth_1, "mm", "largest worn depth of body 1"),
        "depth_2": Dataset(depth_2, "mm", "largest worn depth of body 2"),
        "volume_1": Dataset(volume_1, "mm^3", "worn volume of body 1"),
        "volume_2": Dataset(volume_2, "mm^3", "worn volume of body 2"),
        "energy": Dataset(energy, "N mm", "energy dissipated so far"),
        "area": Dataset(area, "mm^2", "area in contact"),
    }
