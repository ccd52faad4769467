"""Which bodies of a structure could move as rigid ones though all faces stick."""

from __future__ import annotations

import numpy as np

from fe_models.loads.rigid_motions import rigid_motions
from fe_models.structure import Structure
from fe_models.supported_body import FREE_MOTION
from sa_solver.types import Array


def rigid_assemblies(structure: Structure) -> Array:
    """Rigid motions that neither supports nor sticking faces hold, ``(k, bodies, 6)``.

    Columns: displacement of the middle of all bodies' faces [mm] and rotation about it times the
    size of these [mm], along the global axes; orthonormal over all bodies.
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
        # Which motions there are does not hang on how fine a face is.
        sticking.append(rows / np.sqrt(len(places)))
    stacked = np.concatenate(sticking)
    shares, shapes = np.linalg.eigh(stacked.T @ stacked)
    left = shapes[:, shares <= FREE_MOTION * max(float(shares.max()), 1.0)]
    motions = [left[own].T @ basis for own, basis in zip(columns, free, strict=True)]
    return np.stack(motions, axis=1)
