"""Stress in a notch by a local model: elements round it, refined and driven by the body's motion.

The elements round the largest stress on the free surface are cut out of a body of second order and
halved, on the same curved surface. On the cut they move as the body does; elsewhere they carry the
same loads. The error is estimated from two sizes of the elements, those of the body and of the
local model, and from two distances of the cut.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fe_models.elasticity.body import ElasticBody, maximum_principal
from fe_models.elasticity.recovery import StressRecovery
from fe_models.meshes.patch import CUT, MeshPatch
from fe_models.meshes.structure_mesh import Body, MeshError, in_space, numbered_as
from fe_models.solvers.linear_solver import SolverError, prepare
from sa_solver.half_space.stress import von_mises
from sa_solver.ties import first_largest
from sa_solver.types import Array, Indices

# Layers of elements round the largest stress, up to the near and up to the far cut.
NEAR, FAR = 2, 3
# Error of the stress on halved elements over the difference that halving them makes, for a stress
# of second order.
SIZE_SHARE = 1.0 / 3.0
# Error of the stress by the tractions over the change by smoothing them along each axis.
TRACTION_SHARE = 1.4
# Cosine of the angle between facets that are one plane up to rounding.
FLAT = 1.0 - 1e-9
# Boundary of a body without any load or support.
FREE = "free"


@dataclass(frozen=True)
class NotchedBody:
    """Body of second order and its motion in ``k`` states, from which local models are cut.

    Attributes
    ----------
    elastic
        The body, with elements of second order.
    displacement
        Displacements that strain it ``(size, k)`` [mm].
    free
        Facets of the surface without support, load or contact.
    contacts
        Names of the boundaries that carry contact tractions.
    variants
        Displacements ``(j, size, k)`` under the contact tractions smoothed by their mesh.
    traction
        Nodal forces ``(size, k)`` of the contact tractions on any part of the body.
    density
        Force per volume at the vertices ``(k, vertices, 3)`` [N/mm³].
    thermal
        Thermal expansion of the vertices ``(vertices, k)``.
    clamped
        Vertices that cannot move.
    """

    elastic: ElasticBody
    displacement: Array
    free: Indices
    contacts: tuple[str, ...]
    variants: Array
    traction: Callable[[ElasticBody], Array]
    density: Array
    thermal: Array
    clamped: Indices


@dataclass(frozen=True)
class LocalModel:
    """Local model of a notch, with its largest stress.

    Attributes
    ----------
    body
        The elements of the local model.
    displacement
        Displacements of its vertices ``(n, 3)`` [mm].
    stress
        Stress at its vertices ``(6, n)`` [MPa], ordered as in
        :class:`fe_models.elasticity.stress.StressField`.
    largest
        Largest von Mises and largest principal stress on the free surface ``(2,)`` [MPa].
    place
        Position X, Y, Z [mm] of the largest von Mises stress.
    size_error, cut_error, traction_error
        Estimated errors of the stress by the size of its elements, by the place of the cut and by
        the contact tractions, relative to the larger stress.
    """

    body: Body
    displacement: Array
    stress: Array
    largest: Array
    place: tuple[float, ...]
    size_error: float
    cut_error: float
    traction_error: float

    @cached_property
    def von_mises(self) -> Array:
        """Equivalent stress at its vertices ``(n,)`` [MPa]."""
        return von_mises(self.stress)

    @cached_property
    def maximum_principal(self) -> Array:
        """Largest principal stress at its vertices ``(n,)`` [MPa]."""
        return maximum_principal(self.stress)

    def compared(self, near: Array, sizes: Sequence[Array], smooth: Sequence[Array]) -> LocalModel:
        """Return the model with its errors from the largest stresses ``(2,)`` of others.

        These are of a model with a ``near`` cut, on elements of twice the size, and under smoothed
        tractions. The first of the ``sizes`` is the body itself, as are those that are ``smooth``.
        """
        scale = float(np.abs(self.largest).max())

        def share(one: Array, other: Array) -> float:
            return float(np.abs(one - other).max()) / scale if scale > 0.0 else 0.0

        return replace(
            self,
            size_error=SIZE_SHARE * sum(share(self.largest, values) for values in sizes),
            cut_error=share(self.largest, near),
            traction_error=TRACTION_SHARE * sum(share(sizes[0], values) for values in smooth),
        )

    @property
    def error(self) -> float:
        """Estimated error of the less certain stress, relative to the larger one."""
        return self.size_error + self.cut_error + self.traction_error


def local_models(notched: NotchedBody) -> list[LocalModel | None]:
    """Return the local model of the largest stress on the free surface in each state.

    The value is None where the surface round the largest stress carries loads other than contact
    tractions, or is supported; where the stress has no bound; and where the surface is round but
    the elements have straight sides.
    """
    elastic = notched.elastic
    recovery = StressRecovery(elastic, notched.free)
    clamped = np.intersect1d(notched.clamped, elastic.body.mesh.facets[:, notched.free])
    unbounded = recovery.with_neighbours(np.append(recovery.inward_edges, clamped))
    candidates = recovery.untouched
    count = notched.displacement.shape[1]
    if not len(candidates):
        return [None] * count
    stresses = recovery.histories(notched.displacement, candidates, notched.thermal)
    rows = np.array([first_largest(von_mises(stress)) for stress in stresses])
    found: list[LocalModel | None] = [None] * count
    for row in np.unique(rows[~np.isin(candidates[rows], unbounded)]).tolist():
        vertex, states = int(candidates[row]), np.flatnonzero(rows == row)
        thermal = notched.thermal[:, states]
        if not _is_round(notched, vertex):
            continue
        try:
            far = _cut_out(notched, vertex, FAR, states)
            near = _cut_out(notched, vertex, NEAR, states)
        except (MeshError, SolverError):
            continue
        if far is not None and near is not None:
            largest = largest_of(stresses[:, :, row])
            at = np.array([vertex])
            smooth = [
                largest_of(recovery.histories(of[:, states], at, thermal)[:, :, 0])
                for of in notched.variants
            ]
            for k, state in enumerate(states.tolist()):
                sizes = [largest[state]]
                found[state] = far[k].compared(near[k].largest, sizes, [of[k] for of in smooth])
    return found


def largest_of(stress: Array) -> Array:
    """Return the von Mises and the largest principal stress ``(n, 2)`` of stresses ``(n, 6)``."""
    return np.stack([von_mises(stress.T), maximum_principal(stress.T)], axis=1)


def refined_patch(
    elastic: ElasticBody, free: Indices, contacts: tuple[str, ...], vertex: int, rings: int
) -> MeshPatch | None:
    """Return the halved elements round a vertex, or None where other loads than contact act there.

    ``rings`` are the layers of elements round the vertex before they are halved; ``free`` and
    ``contacts`` are as in :class:`NotchedBody`.
    """
    mesh = elastic.body.mesh
    sides = {name: mesh.boundaries[name] for name in contacts}
    plain = numbered_as(mesh, type(mesh)(mesh.p, mesh.t))
    named = numbered_as(mesh, plain.with_boundaries(sides | {FREE: free}))
    patch = MeshPatch.around(replace(elastic.body, mesh=named), np.array([vertex]), rings)
    surface = patch.body.mesh
    known = [surface.boundaries[name] for name in surface.boundaries]
    if len(np.setdiff1d(surface.boundary_facets(), np.concatenate(known))):
        return None
    return patch.refined()


def marked(local: ElasticBody) -> Indices:
    """Return the free facets of a :func:`refined_patch`."""
    return np.asarray(local.body.mesh.boundaries[FREE])


def at_largest(patch: MeshPatch, elastic: ElasticBody, vertex: int) -> np.ndarray:
    """Return flags of the vertices of a patch at which the largest stress may be.

    The largest one of the body is at its ``vertex``; the true place is in the elements there.
    """
    corners = elastic.body.mesh.t
    return patch.inside(corners[:, (corners == vertex).any(axis=0)])


def _is_round(notched: NotchedBody, vertex: int) -> bool:
    """Return whether elements follow the free surface: they are curved, or it is flat there.

    Straight sides make corners in a fillet, whose stress grows when elements are halved.
    """
    if notched.elastic.curved:
        return True
    body = notched.elastic.body
    facets = notched.free[(body.mesh.facets[:, notched.free] == vertex).any(axis=0)]
    normals = body.outward_of(facets)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return bool((normals @ normals[0]).min() > FLAT)


def _cut_out(
    notched: NotchedBody, vertex: int, rings: int, states: Indices
) -> list[LocalModel] | None:
    """Return local models without errors, in some states, or None where loads act on them."""
    elastic = notched.elastic
    patch = refined_patch(elastic, notched.free, notched.contacts, vertex, rings)
    if patch is None:
        return None
    local = ElasticBody(patch.body, elastic.material, 2)
    displacement = _solved(notched, local, patch, states)
    thermal = patch.of_vertices @ notched.thermal[:, states]
    recovery = StressRecovery(local, marked(local))
    vertices = np.arange(local.body.mesh.nvertices)
    stresses = recovery.histories(displacement, vertices, thermal)
    inner = at_largest(patch, elastic, vertex)
    return [
        _largest(local, displacement[:, k], stress, recovery.untouched, inner)
        for k, stress in enumerate(stresses)
    ]


def _solved(notched: NotchedBody, local: ElasticBody, patch: MeshPatch, states: Indices) -> Array:
    """Return the displacements ``(size, k)`` of a local model."""
    d, count = local.dimension, len(states)
    nodal = notched.displacement[:, states].reshape(-1, d * count)
    moved = (patch.of_nodes @ nodal).reshape(-1, count)
    loads = notched.traction(local)[:, states]
    for k, state in enumerate(states.tolist()):
        loads[:, k] += local.nodal_density_load(patch.of_vertices @ notched.density[state])
        loads[:, k] += local.thermal_load(patch.of_vertices @ notched.thermal[:, state])
    held = local.boundary_nodes(CUT)
    fixed = (d * held[:, None] + np.arange(d)).ravel()
    free = np.setdiff1d(np.arange(local.size), fixed)
    displacement = np.zeros_like(moved)
    displacement[fixed] = moved[fixed]
    rhs = loads - local.stiffness @ displacement
    displacement[free] = prepare(local.stiffness[free][:, free].tocsr())(rhs[free])
    return displacement


def _largest(
    local: ElasticBody,
    displacement: Array,
    stress: Array,
    untouched: Indices,
    inner: np.ndarray,
) -> LocalModel:
    """Return the model with its largest stresses in the elements of the body's largest stress."""
    equivalent, principal = von_mises(stress), maximum_principal(stress)
    within = untouched[inner[untouched]]
    at = within[first_largest(equivalent[within])]
    nodal = displacement.reshape(-1, local.dimension)[: local.body.mesh.nvertices]
    return LocalModel(
        body=local.body,
        displacement=np.array(in_space(nodal)),
        stress=stress,
        largest=np.array([equivalent[at], principal[within].max()]),
        place=tuple(local.body.points[at].tolist()),
        size_error=0.0,
        cut_error=0.0,
        traction_error=0.0,
    )
