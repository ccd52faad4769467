"""Faces, surfaces and kinetics of worn contacts, for all analyses that have them."""

from __future__ import annotations

from fe_models.meshes.structure_mesh import Face
from sa_solver.types import Array
from wear.contact.drive import TILTS, Drive
from wear.contact.face_loads import FaceLoads
from workflow.analyses.contact.output.layout import load_columns
from workflow.analyses.wear.output.layout import KINETICS, OTHER_FACE
from workflow.layout.declared import Arrays, declared
from workflow.shell.output.results import ResultsWriter


def mesh_of(face: Face) -> Arrays:
    """Return nodes ``(n, 2)`` and facets ``(m, 3)``, in a line contact ``(m, 2)``, of a face."""
    return {"coordinates": face.coordinates, "facets": face.facets}


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
    slip = {"slip": carried.slip} if slip_known else {}
    writer.put(group, {**mesh_of(face), **slip}, weighted=face.weighted or None)
    if (other := face.face(1)) is not face:
        writer.put(f"{group}/{OTHER_FACE}", mesh_of(other))
    force, displacement = carried.force, carried.displacement
    if force is not None and displacement is not None:
        pressure, shear = force[:, 2] / face.nodal_areas, force[:, :2] / face.nodal_areas
        solution = {"force": force, "displacement": displacement}
        writer.put(group, {"pressure": pressure, "shear": shear, **solution})


def kinetics_columns(kinetics: Array, area: Array) -> dict[str, Array]:
    """Return wear, dissipated energy and contact area over the cycles, ``(n,)`` each.

    ``kinetics`` ``(n, 5)`` has depths and volumes of both bodies, and the energy.
    """
    return dict(zip(declared(KINETICS), (*kinetics.T, area), strict=True))
