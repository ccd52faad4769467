"""Stress of a sector at its cuts, where the next sectors go on: their displacements are known.

Patches of vertices near a cut take the elements of the next sectors that the turn makes of the
body's own, as in the mesh of the whole wheel: the cut is no surface, and the edge where the body's
surface meets it is none either. Cuts must match node to node; beside others patches end at the cut,
and tractions on it stay as they are.
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
from fe_models.meshes.structure_mesh import Body, named_mesh
from sa_solver.types import Array, Indices, Mask

if TYPE_CHECKING:
    from skfem import MeshTet, MeshTri

# Rings of elements that the widest patches reach.
RINGS = 3
# Nodes this share of the body's size apart are one, beside what cuts are off.
SAME = 1e-9


class SectorRecovery(StressRecovery):
    """As :class:`StressRecovery`, of a body whose ``cuts`` go on in the next sectors."""

    def __init__(self, elastic: ElasticBody, free: Indices, cuts: Sequence[Cuts]) -> None:
        super().__init__(elastic, free)
        self._cuts = cuts

    def stress(
        self, displacement: Array, thermal: Array | None = None, vertices: Indices | None = None
    ) -> Array:
        every = np.arange(self._elastic.body.mesh.nvertices) if vertices is None else vertices
        stress = super().stress(displacement, thermal, every)
        here, there = self._beyond.find(every)
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

    def beside(self, vertices: Indices) -> Indices:
        # Across a cut, too.
        beyond = self._beyond
        images = np.flatnonzero(np.isin(beyond.vertices, vertices))
        near = beyond.vertices[beyond.recovery.beside(images)]
        return np.union1d(super().beside(vertices), near)

    def _joined(self, within: Indices, beyond: Indices) -> Indices:
        """Vertices found of the body, but near its cuts those found with the next sectors."""
        near = self._beyond.own
        own = self._beyond.vertices[np.intersect1d(beyond, np.arange(len(near)))]
        return np.union1d(np.setdiff1d(within, near), own)

    @cached_property
    def _beyond(self) -> _Beyond:
        return _Beyond(self._elastic, self._free, _alike(self._cuts), self._neighbours)


class _Beyond:
    """The elements near cuts with those of the next sectors, and what is found there.

    ``own`` ``(n,)`` are the body's vertices whose patches reach a cut. They are the first of all
    vertices here, of which ``vertices`` ``(m,)`` are the body's own or those that they are images
    of. ``near`` ``(v, v)`` tells which vertices of the body share an element.
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
        self._same = SAME * size + len(parts) * max(pair.apart for pair in cuts)
        body = self._meshed(parts, free)
        wide = ElasticBody(body, elastic.material, elastic.order)
        self.recovery = StressRecovery(wide, body.mesh.boundaries["free"])
        self._sources, self._turns = self._images(wide.nodes, list(parts))

    def find(self, vertices: Indices) -> tuple[Indices, Indices]:
        """Which of the body's ``vertices`` are near a cut, and where they are among those here."""
        place = np.minimum(np.searchsorted(self.own, vertices), len(self.own) - 1)
        here = np.flatnonzero(self.own[place] == vertices)
        return here, place[here]

    def seen(self, own: Array, thermal: Array | None) -> tuple[Array, Array | None]:
        """Displacements ``(size, ...)`` and expansions here, from all of the body's."""
        nodal = own.reshape(len(self._elastic.nodes), self._elastic.dimension, -1)
        turned = np.einsum("nab,nbt->nat", self._turns, nodal[self._sources])
        expanded = None if thermal is None else thermal[self.vertices]
        return np.asarray(turned.reshape(-1, *own.shape[1:])), expanded

    def _meshed(self, parts: dict[int, Indices], free: Indices) -> Body:
        """The mesh of elements of the body, by the sectors that they are turned by."""
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
        """Nodes that ``nodes`` ``(n, 3)`` are images of, and their turns ``(n, d, d)``."""
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
    """Edges of some elements: their ends ``(m, 2)`` and midsides ``(m, 3)`` [mm]."""
    mesh = body.mesh
    ends = mesh.edges if mesh.dim() == 3 else mesh.facets
    used = np.unique(body.element_nodes[elements][:, mesh.t.shape[0] :]) - mesh.nvertices
    return ends[:, used].T, body.nodes[mesh.nvertices + used]


def _midsides(mesh: MeshTet | MeshTri, edges: Sequence[tuple[Indices, Array]]) -> Array:
    """Midsides ``(m, 3)`` of a mesh's edges, from those that some ends ``(n, 2)`` are known of."""
    known = np.sort(np.concatenate([ends for ends, _ in edges]), axis=1)
    asked = np.sort((mesh.edges if mesh.dim() == 3 else mesh.facets).T, axis=1)
    key = np.array([mesh.nvertices, 1])
    keys, first = np.unique(known @ key, return_index=True)
    middles = np.concatenate([middles for _, middles in edges])
    return np.asarray(middles[first[np.searchsorted(keys, asked @ key)]])


def _alike(cuts: Sequence[Cuts]) -> list[Cuts]:
    """All cuts turned in the sense of the first, low for high where they are not."""
    turn = cuts[0].turn
    return [
        pair
        if np.abs(pair.turn - turn).max() <= np.abs(pair.turn - turn.T).max()
        else replace(pair, low=pair.high, high=pair.low, turn=turn)
        for pair in cuts
    ]


def _reached(near: sp.csr_matrix, vertices: Indices) -> Mask:
    """Vertices that the widest patches reach from some ``(v,)``."""
    reached = np.zeros(near.shape[0])
    reached[vertices] = 1.0
    for _ in range(RINGS):
        reached = (near @ reached > 0.0).astype(float)
    return np.asarray(reached > 0.0)


def _elements_at(cells: Indices, vertices: Mask) -> Indices:
    """Elements with any of the marked vertices."""
    return np.flatnonzero(vertices[cells].any(axis=0))


def _of_next_sectors(
    cells: Indices, near: sp.csr_matrix, cuts: tuple[Indices, Indices], sectors: int
) -> dict[int, Indices]:
    """Elements of the sectors beyond the cuts, low and high, that patches reach; by their turns.

    Of a sector so thin that patches reach through it, all elements near either cut, several times.
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
