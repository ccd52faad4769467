"""Stress of a sector at its cuts, recovered with the known displacements of the next sectors.

Patches of vertices near a cut include elements of the next sectors, which are the body's elements
rotated, as in the mesh of the whole wheel. The cut is therefore not a surface, and the line where
the body's surface meets it is not an edge. Cuts must match node to node; at other cuts patches end
at the cut, and tractions on it are not removed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fe_models.cyclic.cuts import Cuts
from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.recovery import StressRecovery
from fe_models.meshes.structure_mesh import Body, mesh_edges, named_mesh
from sa_solver.types import Array, Indices, Mask

if TYPE_CHECKING:
    from skfem import MeshTet, MeshTri

# Number of rings of elements in the widest patches.
RINGS = 3
# Distance, as a share of the body's size, up to which nodes count as one; the mismatch of the cuts
# is added to it.
SAME = 1e-9


class SectorRecovery(StressRecovery):
    """Recovery of the stress of a body that continues beyond its ``cuts``."""

    def __init__(self, elastic: ElasticBody, free: Indices, cuts: Sequence[Cuts]) -> None:
        super().__init__(elastic, free)
        self._cuts = cuts

    def stress(
        self, displacement: Array, thermal: Array | None = None, vertices: Indices | None = None
    ) -> Array:
        all_vertices = (
            np.arange(self._elastic.body.mesh.nvertices) if vertices is None else vertices
        )
        stress = super().stress(displacement, thermal, all_vertices)
        here, there = self._beyond.find(all_vertices)
        if len(here):
            seen = self._beyond.seen(displacement, thermal)
            stress[:, here] = self._beyond.recovery.stress(*seen, there)
        return stress

    def histories(
        self, displacements: Array, vertices: Indices, thermal: Array | None = None
    ) -> Array:
        stress = super().histories(displacements, vertices, thermal)
        here, there = self._beyond.find(vertices)
        if len(here):
            moved, expanded = self._beyond.seen(displacements, thermal)
            stress[:, :, here] = self._beyond.recovery.histories(moved, there, expanded)
        return stress

    def alternatives(
        self, displacement: Array, vertices: Indices, thermal: Array | None = None
    ) -> Array:
        found = super().alternatives(displacement, vertices, thermal)
        here, there = self._beyond.find(vertices)
        if len(here):
            moved, expanded = self._beyond.seen(displacement, thermal)
            found[:, :, here] = self._beyond.recovery.alternatives(moved, there, expanded)
        return found

    @cached_property
    def untouched(self) -> Indices:
        return self._joined(super().untouched, self._beyond.recovery.untouched)

    @cached_property
    def inward_edges(self) -> Indices:
        return self._joined(super().inward_edges, self._beyond.recovery.inward_edges)

    def with_neighbours(self, vertices: Indices) -> Indices:
        # Elements across a cut count, too.
        beyond = self._beyond
        images = np.flatnonzero(np.isin(beyond.vertices, vertices))
        near = beyond.vertices[beyond.recovery.with_neighbours(images)]
        return np.union1d(super().with_neighbours(vertices), near)

    def _joined(self, within: Indices, beyond: Indices) -> Indices:
        """Return vertices found on the body, replaced near its cuts by those found beyond.

        ``beyond`` are vertices found with the elements of the next sectors.
        """
        near = self._beyond.own
        own = self._beyond.vertices[np.intersect1d(beyond, np.arange(len(near)))]
        return np.union1d(np.setdiff1d(within, near), own)

    @cached_property
    def _beyond(self) -> _Beyond:
        return _Beyond(self._elastic, self._free, _in_first_sense(self._cuts), self._neighbours)


class _Beyond:
    """Elements near cuts together with those of the next sectors, and the stress recovered there.

    ``own`` ``(n,)`` are the body's vertices whose patches reach a cut. They come first among all
    vertices of this part; ``vertices`` ``(m,)`` are the body's vertices of which these are images.
    ``near`` ``(v, v)`` marks vertices of the body that share an element.
    """

    def __init__(
        self, elastic: ElasticBody, free: Indices, cuts: Sequence[Cuts], near: sp.csr_matrix
    ) -> None:
        self._elastic, self._first = elastic, cuts[0]
        mesh = elastic.body.mesh
        low, high = (
            np.unique(mesh.facets[:, np.concatenate(facets)])
            for facets in ([pair.low for pair in cuts], [pair.high for pair in cuts])
        )
        self.own = np.flatnonzero(_reached(near, np.union1d(low, high)))
        parts = {0: _elements_at(mesh.t, _reached(near, self.own))}
        parts |= _of_next_sectors(mesh.t, near, (low, high), self._first.count)
        size = float(np.linalg.norm(np.ptp(elastic.nodes, axis=0)))
        self._same = SAME * size + len(parts) * max(pair.max_distance for pair in cuts)
        body = self._meshed(parts, free)
        wide = ElasticBody(body, elastic.material, elastic.node_order)
        self.recovery = StressRecovery(wide, body.mesh.boundaries["free"], elastic.order)
        self._sources, self._turns = self._images(wide.nodes, list(parts))

    def find(self, vertices: Indices) -> tuple[Indices, Indices]:
        """Return which ``vertices`` of the body are near a cut, and their positions here."""
        place = np.minimum(np.searchsorted(self.own, vertices), len(self.own) - 1)
        here = np.flatnonzero(self.own[place] == vertices)
        return here, place[here]

    def seen(self, own: Array, thermal: Array | None) -> tuple[Array, Array | None]:
        """Return displacements ``(size, ...)`` and expansions here, from those of the body."""
        nodal = own.reshape(len(self._elastic.nodes), self._elastic.dimension, -1)
        turned = np.einsum("nab,nbt->nat", self._turns, nodal[self._sources])
        expanded = None if thermal is None else thermal[self.vertices]
        return np.asarray(turned.reshape(-1, *own.shape[1:])), expanded

    def _meshed(self, parts: dict[int, Indices], free: Indices) -> Body:
        """Return the mesh of ``parts``: elements of the body, by the number of sectors turned."""
        mesh, points = self._elastic.body.mesh, self._elastic.body.points
        others = np.setdiff1d(mesh.t[:, parts[0]], self.own)
        self.vertices = np.append(self.own, others)
        placed, cells, facets, edges = points[self.vertices], [], [], []
        for sectors, elements in parts.items():
            vertices = np.unique(mesh.t[:, elements])
            images = self._first.images(points[vertices], sectors)
            distance, place = cKDTree(placed).query(images)
            new = distance > self._same
            place[new] = len(placed) + np.arange(np.sum(new))
            placed = np.concatenate([placed, images[new]])
            self.vertices = np.append(self.vertices, vertices[new])
            of_free = free[np.isin(mesh.f2t[0, free], elements)]
            cells.append(place[np.searchsorted(vertices, mesh.t[:, elements])].T)
            facets.append(place[np.searchsorted(vertices, mesh.facets[:, of_free])].T)
            if self._elastic.curved:
                ends, middles = _curved_edges(self._elastic.body, elements)
                ends = place[np.searchsorted(vertices, ends)]
                edges.append((ends, self._first.images(middles, sectors)))
        named = {"free": np.concatenate(facets)}
        axes = list(self._elastic.body.axes)
        joined = named_mesh(placed[:, axes], np.concatenate(cells), named)
        midsides = _midsides(joined, edges)[:, axes] if edges else None
        return Body(self._elastic.body.name, joined, midsides=midsides)

    def _images(self, nodes: Array, sectors: Sequence[int]) -> tuple[Indices, Array]:
        """Return the nodes of which ``nodes`` ``(n, 3)`` are images, and the rotations.

        These are ``(n, d, d)``.
        """
        tree, first = cKDTree(self._elastic.nodes), self._first
        sources = np.full(len(nodes), -1)
        turns = np.empty((len(nodes), self._elastic.dimension, self._elastic.dimension))
        turn = first.of_turn(self._elastic.body)
        for count in sectors:
            left = np.flatnonzero(sources < 0)
            distance, nearest = tree.query(first.images(nodes[left], -count))
            found = distance <= self._same
            sources[left[found]] = nearest[found]
            turns[left[found]] = np.linalg.matrix_power(turn, count)
        if np.any(sources < 0):
            raise RuntimeError("nodes beyond the cuts of a sector are none of its images")
        return sources, turns


def _curved_edges(body: Body, elements: Indices) -> tuple[Indices, Array]:
    """Return the edges of some elements: their ends ``(m, 2)`` and midside points ``(m, 3)``."""
    mesh = body.mesh
    used = np.unique(body.element_nodes[elements][:, mesh.t.shape[0] :]) - mesh.nvertices
    return mesh_edges(mesh)[used], body.nodes[mesh.nvertices + used]


def _midsides(mesh: MeshTet | MeshTri, edges: Sequence[tuple[Indices, Array]]) -> Array:
    """Return the midside points ``(m, 3)`` of a mesh's edges from ``edges`` with known ones."""
    known = np.sort(np.concatenate([ends for ends, _ in edges]), axis=1)
    asked = np.sort(mesh_edges(mesh), axis=1)
    key = np.array([mesh.nvertices, 1])
    keys, first = np.unique(known @ key, return_index=True)
    middles = np.concatenate([middles for _, middles in edges])
    return np.asarray(middles[first[np.searchsorted(keys, asked @ key)]])


def _in_first_sense(cuts: Sequence[Cuts]) -> list[Cuts]:
    """Return all cuts turned in the sense of the first, with low and high exchanged if needed."""
    turn = cuts[0].turn
    return [
        pair
        if np.abs(pair.turn - turn).max() <= np.abs(pair.turn - turn.T).max()
        else replace(pair, low=pair.high, high=pair.low, turn=turn)
        for pair in cuts
    ]


def _reached(near: sp.csr_matrix, vertices: Indices) -> Mask:
    """Return flags of the vertices that the widest patches reach from given ones ``(v,)``."""
    reached = np.zeros(near.shape[0])
    reached[vertices] = 1.0
    for _ in range(RINGS):
        reached = (near @ reached > 0.0).astype(float)
    return np.asarray(reached > 0.0)


def _elements_at(cells: Indices, vertices: Mask) -> Indices:
    """Return the elements with any of the marked vertices."""
    return np.flatnonzero(vertices[cells].any(axis=0))


def _of_next_sectors(
    cells: Indices, near: sp.csr_matrix, cuts: tuple[Indices, Indices], sectors: int
) -> dict[int, Indices]:
    """Return the elements of next sectors that patches reach, by the number of sectors turned.

    If a sector is so thin that patches reach through it, these are all elements near either cut,
    from several sectors.
    """
    reached = [_reached(near, side) for side in cuts]
    thin = bool(np.any(reached[0][cuts[1]]))
    parts: dict[int, Indices] = {}
    for count in range(1, RINGS + 1 if thin else 2):
        for sense, marked in ((1, reached[0]), (-1, reached[1])):
            elements = _elements_at(cells, reached[0] | reached[1] if thin else marked)
            place = sense * count % sectors
            if place:
                parts[place] = np.union1d(parts.get(place, elements), elements)
    return parts
