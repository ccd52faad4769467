"""Checks that supports hold a structure, and hold both faces of a contact in the same way."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from fe_models.loads.rigid_motions import rigid_motions
from fe_models.meshes.structure_mesh import MeshError
from fe_models.structure import Structure
from fe_models.supported_body import FREE_MOTION
from sa_solver.ties import first_largest
from sa_solver.types import Array

AXIS_NAMES = "xyz"


def rigid_assemblies(structure: Structure) -> Array:
    """Return the rigid motions that neither supports nor sticking faces hold, ``(k, bodies, 6)``.

    The columns are the displacement of the centre of all bodies' faces [mm] and the rotation about
    it times their size [mm], along the global axes. The motions are orthonormal over all bodies.
    """
    mesh = structure.mesh
    points = np.concatenate([mesh.bodies[i.bodies[1]].points[i.nodes_2] for i in mesh.interfaces])
    nodes = np.concatenate([body.elastic.nodes for body in structure.bodies])
    middle, size = points.mean(axis=0), float(np.ptp(nodes, axis=0).max())
    free = [body.free_motions(middle, size) for body in structure.bodies]
    ends = np.cumsum([len(motions) for motions in free])
    columns = [slice(end - len(motions), end) for motions, end in zip(free, ends, strict=True)]
    if not ends[-1]:
        return np.zeros((0, len(free), 6))
    sticking = []
    for interface in mesh.interfaces:
        one, two = interface.bodies
        places = (mesh.bodies[two].points[interface.nodes_2] - middle) / size
        moved = rigid_motions(places)
        rows = np.zeros((len(moved), ends[-1]))
        rows[:, columns[two]] += moved @ free[two].T
        rows[:, columns[one]] -= moved @ free[one].T
        # Scale the rows so that the result does not depend on how finely a face is meshed.
        sticking.append(rows / np.sqrt(len(places)))
    stacked = np.concatenate(sticking)
    shares, shapes = np.linalg.eigh(stacked.T @ stacked)
    left = shapes[:, shares <= FREE_MOTION * max(float(shares.max()), 1.0)]
    motions = [left[part].T @ basis for part, basis in zip(columns, free, strict=True)]
    return np.stack(motions, axis=1)


def check_held_faces(structure: Structure) -> None:
    """Raise unless body 1's contact faces are held in the same way as those of body 2.

    Meshes that do not match are held at different nodes, which may be one facet apart.
    """
    d, interfaces = structure.dimension, structure.mesh.interfaces
    held_1, held_2 = (
        np.split(held.reshape(-1, d), np.cumsum([len(i.nodes(side)) for i in interfaces])[:-1])
        for side, held in enumerate(structure.held, start=1)
    )
    for interface, one, two in zip(interfaces, held_1, held_2, strict=True):
        name_1, name_2 = (structure.mesh.bodies[k].name for k in interface.bodies)
        if two[:, -1].any():
            raise MeshError(
                f"nodes of {interface.name} on body {name_2} are held along the contact's normal, "
                "so they cannot carry pressure; leave them out of the support or of the face"
            )
        face = interface.face(1)
        corners = face.coordinates[face.facets]
        reach = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
        for axis in range(d - 1):
            places = face.coordinates[one[:, axis]], interface.coordinates[two[:, axis]]
            if not _are_near(*places, reach):
                raise MeshError(
                    f"nodes of {interface.name} are held along the face on body {name_2} and not "
                    f"on {name_1}; hold both in the same way, as on a plane of symmetry, or neither"
                )


def _are_near(places: Array, points: Array, reach: float) -> bool:
    """Return whether each of the points ``(n, 2)`` is within reach of a place ``(m, 2)``."""
    if not len(points):
        return True
    return len(places) > 0 and bool(cKDTree(places).query(points)[0].max() <= reach)


def check_rest(structure: Structure) -> None:
    """Raise :class:`MeshError` if bodies can move rigidly although all faces stick."""
    motions = rigid_assemblies(structure)
    if not len(motions):
        return
    # Sum the squares over all motions: these do not depend on the basis of the motions.
    among = np.sum(motions**2, axis=0)
    moving = [
        body.elastic.body.name
        for body, share in zip(structure.bodies, among.sum(axis=1), strict=True)
        if share > FREE_MOTION * among.sum()
    ]
    motion = first_largest(among.sum(axis=0))
    freely = f"{'shift along' if motion < 3 else 'turn about'} {AXIS_NAMES[motion % 3]}"
    raise MeshError(
        f"the supports let {' and '.join(moving)} {freely}, although all contacts stick; hold more "
        "of it, or add a contact with a body that is held"
    )
