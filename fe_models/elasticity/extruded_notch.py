"""Local models of notches along bodies with the same section all along, as long as these are.

The cut goes round the notch in the section and all along the body. Otherwise the models are those
of :mod:`fe_models.elasticity.local_model`, with one more size: that of the elements along the body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from skfem import MeshTet

from fe_models.elasticity.body import ElasticBody, maximum_principal
from fe_models.elasticity.extruded import ExtrudedBody
from fe_models.elasticity.local_model import (
    FAR,
    NEAR,
    LocalModel,
    at_largest,
    largest_of,
    marked,
    refined_patch,
)
from fe_models.elasticity.recovery import StressRecovery
from fe_models.meshes.patch import CUT
from fe_models.meshes.structure_mesh import Body, MeshError
from fe_models.solvers.linear_solver import SolverError, prepare
from sa_solver.half_space.stress import von_mises
from sa_solver.ties import first_largest
from sa_solver.types import Array, Indices


@dataclass(frozen=True)
class ExtrudedNotch:
    """Extruded body and its motion in ``k`` states, from which local models are cut.

    Attributes
    ----------
    body
        The body; its section has elements of second order, and an even number of them along Y.
    displacement
        Displacements ``(size, k)`` [mm].
    free
        Facets of the section without support, load or contact.
    contacts
        Names of the boundaries that carry contact tractions.
    variants
        Displacements ``(j, size, k)`` under the contact tractions smoothed by their mesh.
    traction
        Nodal forces ``(size, k)`` of the contact tractions on any part of the body.
    density
        Force per volume at the vertices of the section ``(k, vertices, 3)`` [N/mm³].
    """

    body: ExtrudedBody
    displacement: Array
    free: Indices
    contacts: tuple[str, ...]
    variants: Array
    traction: Callable[[ExtrudedBody], Array]
    density: Array


def extruded_models(notch: ExtrudedNotch) -> list[LocalModel | None]:
    """Return the local model of the largest stress on the free surface in each state.

    For None see :func:`fe_models.elasticity.local_model.local_models`.
    """
    section = notch.body.section
    recovery = StressRecovery(section, notch.free)
    unbounded = recovery.with_neighbours(recovery.inward_edges)
    candidates = np.setdiff1d(recovery.untouched, unbounded)
    found: list[LocalModel | None] = [None] * notch.displacement.shape[1]
    places: dict[int, list[int]] = {}
    wholes: list[Array] = []
    smooth: list[list[Array]] = []
    for state, moved in enumerate(notch.displacement.T):
        stress = notch.body.stress(moved, recovery.untouched, recovery)
        equivalent = von_mises(stress)
        row, level = np.unravel_index(first_largest(equivalent), equivalent.shape)
        vertex = int(recovery.untouched[row])
        wholes.append(largest_of(stress[:, row, [level]].T)[0])
        others = [
            notch.body.stress(of[:, state], np.array([vertex]), recovery)[:, 0, [level]]
            for of in notch.variants
        ]
        smooth.append([largest_of(of.T)[0] for of in others])
        if vertex in candidates:
            places.setdefault(vertex, []).append(state)
    for vertex, states in places.items():
        try:
            far, near, short = (
                _cut_out(notch, vertex, states, rings, stride)
                for rings, stride in ((FAR, 1), (NEAR, 1), (FAR, 2))
            )
        except (MeshError, SolverError):
            continue
        if far is not None and near is not None and short is not None:
            for k, state in enumerate(states):
                sizes = wholes[state], short[k].largest
                found[state] = far[k].compared(near[k].largest, sizes, smooth[state])
    return found


def _cut_out(
    notch: ExtrudedNotch, vertex: int, states: list[int], rings: int, stride: int
) -> list[LocalModel] | None:
    """Return local models without errors, or None where other loads than contact act on them.

    Along the body they have every ``stride``-th end of an element.
    """
    whole = notch.body
    patch = refined_patch(whole.section, notch.free, notch.contacts, vertex, rings)
    if patch is None:
        return None
    section = ElasticBody(patch.body, whole.section.material, 2)
    local = ExtrudedBody(section, whole.ends[::stride])
    levels = np.searchsorted(whole.levels, local.levels)
    moved = notch.displacement[:, states].reshape(len(whole.section.nodes), 3, -1, len(states))
    at_levels = moved[:, :, levels].reshape(len(moved), -1)
    solution = (patch.of_nodes @ at_levels).reshape(local.size, len(states))
    load = notch.traction(local)[:, states]
    for k, state in enumerate(states):
        volume = section.nodal_density_load(patch.of_vertices @ notch.density[state])
        load[:, k] += local.along(volume[:, None])[:, 0]
    held = np.zeros((len(section.nodes), 3 * len(local.levels)), bool)
    held[section.boundary_nodes(CUT)] = True
    free = np.flatnonzero(~held.ravel())
    solution[free] = 0.0
    rhs = load - local.stiffness @ solution
    solution[free] = prepare(local.stiffness[free][:, free].tocsr())(rhs[free])
    recovery = StressRecovery(section, marked(section))
    inner = recovery.untouched[at_largest(patch, whole.section, vertex)[recovery.untouched]]
    shape = _prisms(section.body, local.levels)
    return [_largest(local, moved, recovery, inner, shape) for moved in solution.T]


def _largest(
    local: ExtrudedBody, displacement: Array, recovery: StressRecovery, inner: Indices, shape: Body
) -> LocalModel:
    """Return the local model with its largest stresses at the ``inner`` vertices of the section."""
    section = local.section
    vertices = np.arange(section.body.mesh.nvertices)
    stress = local.stress(displacement, vertices, recovery)
    equivalent, principal = von_mises(stress)[inner], maximum_principal(stress)[inner]
    row, level = np.unravel_index(first_largest(equivalent), equivalent.shape)
    x, _, z = section.body.points[inner[row]].tolist()
    nodal = displacement.reshape(len(section.nodes), 3, -1)[vertices]
    return LocalModel(
        body=shape,
        displacement=nodal.transpose(0, 2, 1).reshape(-1, 3),
        stress=stress.reshape(6, -1),
        largest=np.array([equivalent[row, level], principal.max()]),
        place=(x, float(local.levels[level]), z),
        size_error=0.0,
        cut_error=0.0,
        traction_error=0.0,
    )


def _prisms(section: Body, levels: Array) -> Body:
    """Return the tetrahedra between copies of a section at all levels; these come first."""
    mesh, count = section.mesh, len(levels)
    x, z = np.repeat(mesh.p, count, axis=1)
    points = np.stack([x, np.tile(levels, mesh.nvertices), z])
    # Corners in rising order split neighbouring prisms along the same diagonals.
    a, b, c = np.sort(mesh.t, axis=0) * count
    cells = []
    for k in range(count - 1):
        low, high = (a + k, b + k, c + k), (a + k + 1, b + k + 1, c + k + 1)
        cells += [
            (low[0], low[1], low[2], high[2]),
            (low[0], low[1], high[1], high[2]),
            (low[0], high[0], high[1], high[2]),
        ]
    return Body(section.name, MeshTet(points, np.hstack([np.stack(cell) for cell in cells])))
