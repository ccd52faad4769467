"""Displacements and stresses of both bodies at one state of the joint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_models.elasticity import maximum_principal, von_mises
from fe_models.mesh import in_space
from fe_models.structure import Structure
from sa_solver.types import Array


@dataclass(frozen=True)
class StressField:
    """At the vertices of one body: displacement ``(n, 3)`` [mm], stresses ``(n,)`` [MPa]."""

    displacement: Array
    von_mises: Array
    maximum_principal: Array


def stress_state(
    structure: Structure, force: Array, relative: Array, amplitudes: Array
) -> tuple[StressField, StressField]:
    """Stress fields of body 1 and body 2.

    ``force`` ``(3, n)`` on body 2 and ``relative`` displacement ``(3, n)`` over all interfaces, in
    their frames; ``amplitudes`` of the load cases.
    """
    displacements = deformation(structure, force, relative, amplitudes)
    fields = []
    for body, displacement in zip(structure.bodies, displacements, strict=True):
        stress = body.elastic.at_vertices(body.elastic.stress(displacement))
        nodal = displacement.reshape(-1, body.elastic.dimension)
        vertices = in_space(nodal[: body.elastic.body.mesh.nvertices])
        fields.append(StressField(np.array(vertices), von_mises(stress), maximum_principal(stress)))
    return fields[0], fields[1]


def deformation(
    structure: Structure, force: Array, relative: Array, amplitudes: Array
) -> tuple[Array, Array]:
    """All displacements of body 1 and body 2, each ``(size,)`` [mm].

    Body 1 carries the forces, body 2 follows it at the relative displacements.
    """
    axes = structure.mesh.body_1.axes
    forces, gaps = force[axes, :].T.ravel(), relative[axes, :].T.ravel()
    projection = structure.projection
    on_body_1 = forces if projection is None else projection.T @ forces
    displacement_1, interface_1 = structure.body_1.respond(-on_body_1, amplitudes)
    if projection is not None:
        interface_1 = projection @ interface_1
    return displacement_1, structure.body_2.recover(interface_1 + gaps, amplitudes)
