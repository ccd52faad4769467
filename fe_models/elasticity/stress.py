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
from fe_models.elasticity.local_model import LocalModel
from fe_models.elasticity.recovery import StressRecovery
from fe_models.elasticity.thermal import thermal_gradient
from fe_models.meshes.structure_mesh import Body, in_space
from fe_models.motion import structure_motion
from fe_models.structure import Structure
from fe_models.supported_body import SupportedBody
from sa_solver.half_space.stress import von_mises
from sa_solver.ties import first_largest
from sa_solver.types import Array, Frame, Indices

# Distance outside an element, as a share of it, up to which a point is on its border.
ON_BORDER = 1e-9

# Ratio of the error of the largest stress to its change by other fits, by the order of elements.
# It is the median over the notches of five dovetails with 10 to 40 nodes across the flank. The
# estimate is within a factor of two of the true error in nine cases of ten (order 2: three of
# four), and at least 0.37 of it where the true error exceeds 0.5 %.
MISSING = {1: 1.4, 2: 0.75}


def steps(bodies: int) -> int:
    """Return the number of steps of :func:`cycle_stresses`: the motion, and one for each body."""
    return bodies + 1


@dataclass(frozen=True)
class PeakStress:
    """Largest von Mises and largest principal stress at some vertices [MPa].

    Attributes
    ----------
    von_mises, maximum_principal
        Largest values [MPa].
    place
        Position X, Y, Z [mm] of the largest von Mises stress.
    at_contact
        Whether it is on a contact face.
    error
        Estimated discretisation error of the less certain value, relative to the larger one. It is
        1 next to a sharp re-entrant corner or the end of a clamped face, where stress is unbounded.
    """

    von_mises: float
    maximum_principal: float
    place: tuple[float, ...]
    at_contact: bool
    error: float

    @property
    def bounded(self) -> bool:
        """True if the stress converges to a bounded value under mesh refinement."""
        return self.error < 1.0


@dataclass(frozen=True)
class StressField:
    """Displacement and stress at the vertices of one ``body``.

    Attributes
    ----------
    body
        The meshed body.
    displacement
        Displacements ``(n, 3)`` [mm].
    stress
        Stress ``(6, n)`` [MPa], ordered xx, yy, zz, xy, yz, zx of the global axes.
    peak
        Largest stress of all vertices.
    notch
        Largest stress on the free surface, which the mesh can resolve; contact pressure has steep
        edges. None if there is no free surface.
    local
        Local model that ``notch`` is from, if it is not from the vertices of the body.
    """

    body: Body
    displacement: Array
    stress: Array
    peak: PeakStress
    notch: PeakStress | None
    local: LocalModel | None = None

    @cached_property
    def von_mises(self) -> Array:
        """Equivalent stress ``(n,)`` [MPa]."""
        return von_mises(self.stress)

    @cached_property
    def maximum_principal(self) -> Array:
        """Largest principal stress ``(n,)`` [MPa]."""
        return maximum_principal(self.stress)

    def with_notch(self, local: LocalModel) -> StressField:
        """Return the field with the largest stress on the free surface from a local model."""
        equivalent, principal = local.largest.tolist()
        notch = PeakStress(equivalent, principal, local.place, at_contact=False, error=local.error)
        largest = self.peak == self.notch or notch.von_mises > self.peak.von_mises
        return replace(self, notch=notch, peak=notch if largest else self.peak, local=local)

    def at(self, points: Array, frame: Frame) -> Array:
        """Return stress ``(6, n)`` [MPa] along the axes of a ``frame`` at points ``(n, 3)`` in it.

        It is linear between the vertices, and NaN outside the body.
        """
        corners, weights = _in_elements(self.body, frame.to_global(points) + frame.origin)
        return turned(np.einsum("cin,in->cn", self.stress[:, corners.T], weights), frame)


@dataclass(frozen=True)
class SurfaceHistory:
    """Surface of a body over some increments; in the plane, all of the body.

    Attributes
    ----------
    vertices
        Vertices of the body's mesh ``(n,)``.
    triangles
        Triangles ``(m, 3)``, numbered in these vertices.
    displacement
        Displacements ``(t, n, 3)`` [mm].
    stress
        Stress ``(t, 6, n)`` [MPa], ordered as in :class:`StressField`.
    """

    vertices: Indices
    triangles: Indices
    displacement: Array
    stress: Array


@dataclass(frozen=True)
class CycleStress:
    """Stress of all bodies over a cycle.

    Attributes
    ----------
    fields
        Fields of the bodies at one increment.
    faces
        Displacements of body 1 and body 2 ``(t, 3, n)`` [mm] at the nodes of each interface, in its
        frame.
    surfaces
        Surfaces of the bodies in the requested increments.
    expansions
        Thermal strains of body 1 and body 2 of each interface and their slopes along z of its frame
        [1/mm], ``(t, 2, n)``. None if no temperature changes.
    """

    fields: tuple[StressField, ...]
    faces: tuple[tuple[Array, Array], ...]
    surfaces: tuple[SurfaceHistory, ...]
    expansions: tuple[tuple[Array, Array], ...] | None = None


def cycle_stresses(
    structure: Structure,
    cycles: Sequence[tuple[Array, Array]],
    amplitudes: Array,
    at: int,
    shown: Sequence[int] = (),
    done: Callable[[], None] = lambda: None,
) -> list[CycleStress]:
    """Return the stress of every cycle in increment ``at``, surfaces in others, and face motions.

    The bodies are factorised once for all cycles.

    Parameters
    ----------
    structure
        The structure.
    cycles
        Contact forces ``(t, 3, n)`` and relative displacements ``(t, 3, n)`` of each cycle, as in
        :func:`fe_models.motion.deformation`.
    amplitudes
        Amplitudes of the load cases ``(t, cases)``, which all cycles share.
    at
        Increment of the stress fields.
    shown
        Increments in which the surfaces are returned.
    done
        Called after each of the :func:`steps`.
    """
    # Increments of all cycles are columns of one solution; the first of a cycle is that of fields.
    count, each = len(amplitudes), [at, *shown]
    starts = count * np.arange(len(cycles))
    increments = np.add.outer(starts, each).ravel()
    force, relative = (np.concatenate(fields) for fields in zip(*cycles, strict=True))
    loads = np.tile(amplitudes, (len(cycles), 1))
    motion = structure_motion(structure, force, relative, loads, increments.tolist())
    done()
    of_bodies = []
    for body, displacement in zip(structure.bodies, motion.displacements, strict=True):
        thermal = body.thermal_strain(amplitudes[each].T)
        displacements = np.split(displacement, len(cycles), axis=1)
        straining = [body.straining(moved, amplitudes[each].T) for moved in displacements]
        of_bodies.append(_body_stresses(body, displacements, straining, thermal))
        done()
    heated = any(body.expands for body in structure.bodies)
    expansions = _face_expansions(structure, amplitudes) if heated else None
    faces = [
        tuple((one[start : start + count], two[start : start + count]) for one, two in motion.faces)
        for start in starts
    ]
    return [
        CycleStress(
            tuple(field for field, _ in of_cycle),
            moved,
            tuple(surface for _, surface in of_cycle if surface is not None),
            expansions,
        )
        for of_cycle, moved in zip(zip(*of_bodies, strict=True), faces, strict=True)
    ]


def _body_stresses(
    body: SupportedBody, displacements: list[Array], straining: list[Array], thermal: Array
) -> list[tuple[StressField, SurfaceHistory | None]]:
    """Return the stress in the first increment of each cycle, and the surface in the others.

    Parameters
    ----------
    body
        The body.
    displacements
        Displacements in each cycle ``(size, k)`` [mm].
    straining
        The same without those that cause no strain.
    thermal
        Thermal expansions ``(vertices, k)``, the same in all cycles.
    """
    elastic, free, recovery = body.elastic, body.free_facets, body.recovery
    context = free, body.nodes, body.clamped
    found = []
    for displacement, strained in zip(displacements, straining, strict=True):
        field = stress_field(elastic, strained[:, 0], *context, thermal[:, 0], recovery)
        moved, *others = _of_vertices(elastic, displacement)
        surface = None
        if others:
            surface = surface_history(elastic, strained[:, 1:], recovery, thermal[:, 1:])
            surface = replace(surface, displacement=np.array(others)[:, surface.vertices])
        found.append((replace(field, displacement=moved), surface))
    return found


def _face_expansions(structure: Structure, amplitudes: Array) -> tuple[tuple[Array, Array], ...]:
    """Return the expansions of :class:`CycleStress`, projected to the nodes of body 2."""
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
    """Return the stress of a body from its displacements.

    Parameters
    ----------
    elastic
        The elastic body.
    displacement
        Displacements ``(size,)`` [mm].
    free
        Facets without traction.
    contact
        Vertices of contact faces.
    clamped
        Vertices that cannot move.
    thermal
        Thermal expansions ``(vertices,)``.
    recovery
        Recovery of the stress, which may use more than the body itself.
    """
    count = elastic.body.mesh.nvertices
    recovery = recovery or StressRecovery(elastic, free)
    clamped = np.intersect1d(clamped, elastic.body.mesh.facets[:, free])
    unbounded = recovery.with_neighbours(np.append(recovery.inward_edges, clamped))
    stress = recovery.stress(displacement, thermal)
    equivalent, principal = von_mises(stress), maximum_principal(stress)

    def largest(vertices: Indices) -> PeakStress:
        """Return the largest stress of some vertices."""
        at = vertices[[first_largest(values[vertices]) for values in (equivalent, principal)]]
        values_at = np.array([equivalent[at[0]], principal[at[1]]])
        others = recovery.alternatives(displacement, at, thermal)
        apart = [
            (von_mises(s)[0] - values_at[0], maximum_principal(s)[1] - values_at[1]) for s in others
        ]
        change = MISSING[elastic.order] * np.abs(apart).max(axis=0)
        # Under compression the largest principal stress is nearly zero, so do not divide by it.
        size = np.maximum(np.abs(values_at), values_at[0])
        error = np.divide(change, size, out=np.zeros(2), where=size > 0.0)
        error[np.isin(at, unbounded) & (size > 0.0)] = 1.0
        place = tuple(elastic.body.points[at[0]].tolist())
        at_contact = bool(np.isin(at[0], contact))
        return PeakStress(
            float(values_at[0]), float(values_at[1]), place, at_contact, float(error.max())
        )

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
    """Return the surface of a body under displacements ``(size, t)``.

    ``recovery`` recovers its stress, and ``thermal`` are expansions ``(vertices, t)``. In the plane
    the result is all of the body.
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
    """Return displacements of the vertices ``(t, n, 3)`` from all displacements ``(size, t)``."""
    nodal = displacements.T.reshape(displacements.shape[1], -1, elastic.dimension)
    return np.array(in_space(nodal[:, : elastic.body.mesh.nvertices]))


def turned(stress: Array, frame: Frame) -> Array:
    """Return the stress ``(6, n)`` along the axes of a ``frame`` from that along global axes."""
    return components(np.einsum("ai,ijn,bj->abn", frame.axes, tensors(stress), frame.axes))


def _in_elements(body: Body, points: Array) -> tuple[Indices, Array]:
    """Return the vertices ``(n, d + 1)`` of the elements that contain ``points``, and weights.

    The points are ``(n, 3)``. The weights ``(d + 1, n)`` are NaN where no element contains the
    point.
    """
    mesh, places = body.mesh, points[:, body.axes]
    low, high = (pick(mesh.p[:, mesh.t], axis=1) for pick in (np.min, np.max))
    first, last = places.min(axis=0)[:, None], places.max(axis=0)[:, None]
    near = np.flatnonzero(np.all((low <= last) & (high >= first), axis=0))
    corners = np.zeros((len(points), len(mesh.t)), dtype=np.int64)
    weights = np.full((len(mesh.t), len(points)), np.nan)
    # Only points within an element's range along the first axis can be in it.
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
