"""Temperatures of bodies of a user's mesh, and the strain that their expansion makes of them.

A change ΔT from the temperature at which a body is free of stress expands it by θ = α ΔT in all
directions. With the strain ε of its displacements the stress is

    σ = λ tr(ε) 1 + 2 G ε - (3 λ + 2 G) θ 1,

of which the last part loads the nodes by ∫ (3 λ + 2 G) θ div φ_i and is taken off where stress is
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
    """Change of temperature [K] from the stress-free one, of a ``body``, of all without a name."""

    change: float
    body: str | None = None

    def at(self, numbers: Indices) -> Array:
        """Of a body whose vertices have such ``numbers`` ``(n,)`` in its file, ``(n,)`` [K]."""
        return np.full(len(numbers), self.change)


@dataclass(frozen=True)
class NodalTemperature:
    """Changes of temperature ``(m,)`` [K] of nodes, by their ``numbers`` ``(m,)`` in the mesh file.

    They are linear between vertices; nodes on edges, and of other bodies, count for nothing. Of a
    ``body``, or of all without a name.
    """

    numbers: Indices
    changes: Array
    body: str | None = None

    def at(self, numbers: Indices) -> Array:
        """As :meth:`TemperatureChange.at`. Raises :class:`MeshError` where a vertex has none."""
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
    """Raise :class:`MeshError` unless a load fits the bodies of such node ``numbers``, by name."""
    if load.body is not None and load.body not in numbers:
        raise MeshError(f"no body {load.body}; allowed: {', '.join(numbers)}")
    for name, own in numbers.items():
        if load.body in (None, name):
            load.at(own)


def thermal_strains(loads: Sequence[object], elastic: ElasticBody, numbers: Indices) -> Array:
    """Expansion θ of a body's vertices under each of the loads, ``(vertices, loads)`` [1].

    ``numbers`` ``(vertices,)`` are the nodes' own in their file. Loads that are no temperatures, or
    those of other bodies, expand nothing.
    """
    strains = np.zeros((len(numbers), len(loads)))
    for case, load in enumerate(loads):
        if isinstance(load, Temperature) and load.body in (None, elastic.body.name):
            strains[:, case] = elastic.material.expansion * load.at(numbers)
    return strains


def thermal_gradient(elastic: ElasticBody, strains: Array, vertices: Indices) -> Array:
    """Gradient ``(3, n, ...)`` [1/mm] of strains ``(vertices, ...)`` at some of these.

    The mean of the elements round each vertex, by their volumes; strains are linear in them.
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
