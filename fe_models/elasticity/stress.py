"""Stresses of all bodies at a state of the joint, and over a cycle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_models.elasticity.body import (
    ElasticBody,
    components,
    maximum_principal,
    tensors,
)
from fe_models.elasticity.recovery import StressRecovery
from fe_models.elasticity.thermal import thermal_gradient
from fe_models.meshes.structure_mesh import Body, in_space
from fe_models.motion import structure_motion
from fe_models.structure import Structure
from sa_solver.half_space.stress import von_mises
from sa_solver.ties import first_largest
from sa_solver.types import Array, Frame, Indices

# A point this share of an element outside of it is on its border.
ON_BORDER = 1e-9

# How much of what other fits change is missing from the largest stress, by the order of elements:
# of notches in five dovetails with 10 to 40 nodes across the flank the median, and nine tenths (of
# order 2 three quarters) within a factor of two. Least 0.37 of the true error, where that is over
# 0.5 %.
MISSING = {1: 1.4, 2: 0.75}


# Of the stress over a cycle: its motion, and the stress of each body.
def steps(bodies: int) -> int:
    """How many steps the stress of so many bodies over a cycle takes."""
    return bodies + 1


@dataclass(frozen=True)
class PeakStress:
    """Largest von Mises and principal stress of some vertices [MPa], and where the former is.

    ``place`` is X, Y, Z [mm]; ``at_contact`` tells whether it is on a contact face. ``error`` is
    what the mesh leaves of the less certain of both, estimated and relative to the larger: all of
    it beside a sharp inward corner or the end of a clamped face, where stress has no bound.
    """

    von_mises: float
    maximum_principal: float
    place: tuple[float, ...]
    at_contact: bool
    error: float

    @property
    def bounded(self) -> bool:
        """Whether stress there has a bound that finer meshes go to."""
        return self.error < 1.0


@dataclass(frozen=True)
class StressField:
    """At the vertices of one ``body``: ``displacement`` ``(n, 3)`` [mm], ``stress`` ``(6, n)``.

    Stress [MPa] is ordered xx, yy, zz, xy, yz, zx of the global axes. ``peak`` is the largest of
    all and ``notch`` that of the surface on which nothing acts, which is what the mesh can resolve:
    contact pressure has steep edges. None where there is no such surface.
    """

    body: Body
    displacement: Array
    stress: Array
    peak: PeakStress
    notch: PeakStress | None

    @cached_property
    def von_mises(self) -> Array:
        """Equivalent stress ``(n,)`` [MPa]."""
        return von_mises(self.stress)

    @cached_property
    def maximum_principal(self) -> Array:
        """Largest principal stress ``(n,)`` [MPa]."""
        return maximum_principal(self.stress)

    def at(self, points: Array, frame: Frame) -> Array:
        """Stress ``(6, n)`` along the axes of a ``frame`` at points ``(n, 3)`` there [MPa].

        Linear between the vertices, not a number outside the body.
        """
        corners, weights = _in_elements(self.body, frame.to_global(points) + frame.origin)
        return turned(np.einsum("cin,in->cn", self.stress[:, corners.T], weights), frame)


@dataclass(frozen=True)
class SurfaceHistory:
    """What is seen of a body over some increments: its surface, or all of it in the plane.

    ``vertices`` ``(n,)`` are those of the body's mesh, ``triangles`` ``(m, 3)`` count among them;
    ``displacement`` ``(t, n, 3)`` [mm], ``stress`` ``(t, 6, n)`` [MPa] as in :class:`StressField`.
    """

    vertices: Indices
    triangles: Indices
    displacement: Array
    stress: Array


@dataclass(frozen=True)
class CycleStress:
    """All bodies over a cycle: their ``fields`` at one increment, and how their faces move.

    ``faces`` are displacements ``(t, 3, n)`` [mm] of body 1 and body 2, by interface, in the frame
    and at the nodes of that; ``surfaces`` the bodies in the increments that are shown, if any are.
    ``expansions`` ``(t, 2, n)`` are thermal strains of body 1 and body 2 there, and their slopes
    along z of the frame [1/mm], None if no temperature changes.
    """

    fields: tuple[StressField, ...]
    faces: tuple[tuple[Array, Array], ...]
    surfaces: tuple[SurfaceHistory, ...]
    expansions: tuple[tuple[Array, Array], ...] | None = None


def cycle_stress(
    structure: Structure,
    force: Array,
    relative: Array,
    amplitudes: Array,
    at: int,
    shown: Sequence[int] = (),
    done: Callable[[], None] = lambda: None,
) -> CycleStress:
    """Stress in increment ``at`` and on the surface in those ``shown``; how the faces move in all.

    ``force`` ``(t, 3, n)``, ``relative`` ``(t, 3, n)`` and ``amplitudes`` ``(t, cases)`` as in
    :func:`fe_models.motion.deformation`. ``done`` is called after each of the :func:`steps`.
    """
    # The first is that of the fields; all of them by one factorisation.
    increments = [at, *shown]
    motion = structure_motion(structure, force, relative, amplitudes, increments)
    done()
    fields, surfaces = [], []
    for body, displacement in zip(structure.bodies, motion.displacements, strict=True):
        elastic, free = body.elastic, body.free_facets
        thermal, recovery = body.thermal_strain(amplitudes[increments].T), body.recovery
        seen = free, body.nodes, body.clamped
        straining = body.straining(displacement, amplitudes[increments].T)
        field = stress_field(elastic, straining[:, 0], *seen, thermal[:, 0], recovery)
        (moved,) = _of_vertices(elastic, displacement[:, :1])
        fields.append(replace(field, displacement=moved))
        if shown:
            surface = surface_history(elastic, straining[:, 1:], recovery, thermal[:, 1:])
            moved = _of_vertices(elastic, displacement[:, 1:])[:, surface.vertices]
            surfaces.append(replace(surface, displacement=moved))
        done()
    heated = any(body.expands for body in structure.bodies)
    expansions = _face_expansions(structure, amplitudes) if heated else None
    return CycleStress(tuple(fields), motion.faces, tuple(surfaces), expansions)


def _face_expansions(structure: Structure, amplitudes: Array) -> tuple[tuple[Array, Array], ...]:
    """Of :class:`CycleStress`; where meshes do not match, projected to the nodes of body 2."""
    strains = [body.thermal_strain(amplitudes.T) for body in structure.bodies]
    found = []
    for interface in structure.mesh.interfaces:
        sides = []
        for side, place in enumerate(interface.bodies, start=1):
            nodes, elastic = interface.nodes(side), structure.bodies[place].elastic
            slopes = thermal_gradient(elastic, strains[place], nodes)
            along = np.einsum("a,ant->nt", interface.frame.axes[2], slopes)
            nodal = np.stack([strains[place][nodes], along])
            if side == 1:
                nodal = np.stack([interface.carried(values) for values in nodal])
            sides.append(nodal.transpose(2, 0, 1))
        found.append((sides[0], sides[1]))
    return tuple(found)


def stress_field(
    elastic: ElasticBody,
    displacement: Array,
    free: Indices,
    contact: Indices,
    clamped: Indices,
    thermal: Array | None = None,
    recovery: StressRecovery | None = None,
) -> StressField:
    """Stress of a body from its displacements ``(size,)`` and expansions ``(vertices,)``.

    ``free`` are the facets on which nothing acts, ``contact`` the vertices of contact faces and
    ``clamped`` those that cannot move. ``recovery`` may see more than the body itself.
    """
    count = elastic.body.mesh.nvertices
    recovery = recovery or StressRecovery(elastic, free)
    clamped = np.intersect1d(clamped, elastic.body.mesh.facets[:, free])
    unbounded = recovery.beside(np.append(recovery.inward_edges, clamped))
    stress = recovery.stress(displacement, thermal)
    equivalent, principal = von_mises(stress), maximum_principal(stress)

    def largest(vertices: Indices) -> PeakStress:
        """The largest stress of some vertices."""
        at = vertices[[first_largest(values[vertices]) for values in (equivalent, principal)]]
        told = np.array([equivalent[at[0]], principal[at[1]]])
        others = recovery.alternatives(displacement, at, thermal)
        apart = [(von_mises(s)[0] - told[0], maximum_principal(s)[1] - told[1]) for s in others]
        change = MISSING[elastic.order] * np.abs(apart).max(axis=0)
        # Under compression the largest principal stress is next to nothing.
        size = np.maximum(np.abs(told), told[0])
        error = np.divide(change, size, out=np.zeros(2), where=size > 0.0)
        error[np.isin(at, unbounded) & (size > 0.0)] = 1.0
        place = tuple(elastic.body.points[at[0]].tolist())
        at_contact = bool(np.isin(at[0], contact))
        return PeakStress(float(told[0]), float(told[1]), place, at_contact, float(error.max()))

    untouched = recovery.untouched
    return StressField(
        body=elastic.body,
        displacement=_of_vertices(elastic, displacement[:, None])[0],
        stress=stress,
        peak=largest(np.arange(count)),
        notch=largest(untouched) if len(untouched) else None,
    )


def surface_history(
    elastic: ElasticBody,
    displacements: Array,
    recovery: StressRecovery,
    thermal: Array | None = None,
) -> SurfaceHistory:
    """The surface of a body with displacements ``(size, t)`` and expansions ``(vertices, t)``.

    ``recovery`` finds its stress. In the plane all of the body is seen.
    """
    mesh = elastic.body.mesh
    cells = mesh.t if elastic.dimension == 2 else mesh.facets[:, mesh.boundary_facets()]
    vertices, corners = np.unique(cells, return_inverse=True)
    return SurfaceHistory(
        vertices=vertices,
        triangles=corners.reshape(cells.shape).T,
        displacement=_of_vertices(elastic, displacements)[:, vertices],
        stress=recovery.histories(displacements, vertices, thermal),
    )


def _of_vertices(elastic: ElasticBody, displacements: Array) -> Array:
    """Of the vertices in space ``(t, n, 3)``, from all displacements ``(size, t)``."""
    nodal = displacements.T.reshape(displacements.shape[1], -1, elastic.dimension)
    return np.array(in_space(nodal[:, : elastic.body.mesh.nvertices]))


def turned(stress: Array, frame: Frame) -> Array:
    """Stress ``(6, n)`` of the global axes along those of a ``frame``."""
    return components(np.einsum("ai,ijn,bj->abn", frame.axes, tensors(stress), frame.axes))


def _in_elements(body: Body, points: Array) -> tuple[Indices, Array]:
    """Vertices ``(n, d + 1)`` of the elements that hold ``points`` ``(n, 3)``, and their weights.

    The weights ``(d + 1, n)`` are not numbers where no element does.
    """
    mesh, places = body.mesh, points[:, body.axes]
    low, high = (pick(mesh.p[:, mesh.t], axis=1) for pick in (np.min, np.max))
    first, last = places.min(axis=0)[:, None], places.max(axis=0)[:, None]
    near = np.flatnonzero(np.all((low <= last) & (high >= first), axis=0))
    corners = np.zeros((len(points), len(mesh.t)), dtype=np.int64)
    weights = np.full((len(mesh.t), len(points)), np.nan)
    # Only points between an element's ends along the first axis can be in it.
    order = np.argsort(places[:, 0], kind="stable")
    margin = len(mesh.t) * ON_BORDER * (high[0] - low[0])
    ends = np.stack([low[0] - margin, high[0] + margin])[:, near]
    begins, stops = np.searchsorted(places[order, 0], ends)
    for element, begin, stop in zip(near, begins, stops, strict=True):
        points_near = order[begin:stop]
        vertices = mesh.t[:, element]
        edges = (mesh.p[:, vertices[1:]] - mesh.p[:, vertices[:1]]).T
        inner = np.linalg.solve(edges.T, (places[points_near] - mesh.p[:, vertices[0]]).T)
        shares = np.concatenate([1.0 - inner.sum(axis=0, keepdims=True), inner])
        held = np.all(shares >= -ON_BORDER, axis=0)
        corners[points_near[held]], weights[:, points_near[held]] = vertices, shares[:, held]
    return corners, weights
