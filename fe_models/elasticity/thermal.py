"""Temperatures of bodies of a user's mesh, and their thermal strains.

A change ΔT from the temperature at which a body is free of stress expands it by θ = α ΔT in all
directions. With the strain ε of its displacements the stress is

    σ = λ tr(ε) 1 + 2 G ε - (3 λ + 2 G) θ 1.

The last part loads the nodes by ∫ (3 λ + 2 G) θ div φ_i and is subtracted where stress is
recovered. In plane strain θ acts across the plane as well: a section that is free in its plane has
σ_yy = -E θ.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.elasticity.body import ElasticBody
from fe_models.meshes.structure_mesh import MeshError
from sa_solver.types import Array, Indices


@dataclass(frozen=True)
class TemperatureChange:
    """Uniform change of temperature [K] from the stress-free state, of one ``body`` or of all.

    Without a body it applies to all bodies.
    """

    change: float
    body: str | None = None

    def at(self, numbers: Indices) -> Array:
        """Return the changes ``(n,)`` [K] at vertices with ``numbers`` ``(n,)`` in their file."""
        return np.full(len(numbers), self.change)


@dataclass(frozen=True)
class NodalTemperature:
    """Changes of temperature ``(m,)`` [K] at nodes, by their ``numbers`` in the mesh file.

    The temperature is linear between vertices; values at midside nodes, and at nodes of other
    bodies, are ignored. It applies to one ``body``, or to all bodies if this is None.
    """

    numbers: Indices
    changes: Array
    body: str | None = None

    def at(self, numbers: Indices) -> Array:
        """Return the changes as :meth:`TemperatureChange.at`.

        Raises :class:`MeshError` if a vertex has none.
        """
        order = np.argsort(self.numbers)
        known = self.numbers[order]
        places = np.minimum(np.searchsorted(known, numbers), len(known) - 1)
        missing = numbers[known[places] != numbers]
        if len(missing):
            raise MeshError(
                f"{len(missing)} of {len(numbers)} nodes have no temperature, the first is "
                f"{missing[0]}; allowed: one for each node of the bodies that are heated"
            )
        return np.asarray(self.changes[order[places]])


Temperature = TemperatureChange | NodalTemperature


def check_temperature(load: Temperature, numbers: Mapping[str, Indices]) -> None:
    """Raise :class:`MeshError` unless a load fits the bodies.

    ``numbers`` are the node numbers of each body, by its name.
    """
    if load.body is not None and load.body not in numbers:
        raise MeshError(f"no body {load.body}; allowed: {', '.join(numbers)}")
    for name, body_numbers in numbers.items():
        if load.body in (None, name):
            load.at(body_numbers)


def thermal_strains(loads: Sequence[object], elastic: ElasticBody, numbers: Indices) -> Array:
    """Return the expansion θ of a body's vertices under each load, ``(vertices, loads)`` [1].

    ``numbers`` ``(vertices,)`` are the numbers of the vertices in their file. Loads that are not
    temperatures, or are those of other bodies, cause no expansion.
    """
    strains = np.zeros((len(numbers), len(loads)))
    for case, load in enumerate(loads):
        if isinstance(load, Temperature) and load.body in (None, elastic.body.name):
            strains[:, case] = elastic.material.expansion * load.at(numbers)
    return strains


def thermal_gradient(elastic: ElasticBody, strains: Array, vertices: Indices) -> Array:
    """Return the gradient ``(3, n, ...)`` [1/mm] of strains ``(vertices, ...)`` at some vertices.

    It is the mean over the elements around each vertex, weighted by volume; strains are linear in
    them.
    """
    mesh, axes = elastic.body.mesh, elastic.body.axes
    edges = (mesh.p[:, mesh.t[1:]] - mesh.p[:, mesh.t[:1]]).transpose(2, 1, 0)
    differences = strains[mesh.t[1:]] - strains[mesh.t[:1]]
    rows = differences.swapaxes(0, 1).reshape(len(edges), len(axes), -1)
    slopes, volumes = np.linalg.solve(edges, rows), np.abs(np.linalg.det(edges))
    corners, elements = mesh.t.ravel(), np.tile(np.arange(len(edges)), len(mesh.t))
    shape = mesh.nvertices, len(edges)
    means = sp.csr_matrix((volumes[elements], (corners, elements)), shape)[vertices]
    total = np.asarray(means.sum(axis=1)).ravel()
    gradient = np.zeros((3, len(vertices), rows.shape[2]))
    for axis, slope in zip(axes, slopes.swapaxes(0, 1), strict=True):
        gradient[axis] = (means @ slope) / total[:, None]
    return gradient.reshape(3, len(vertices), *strains.shape[1:])
