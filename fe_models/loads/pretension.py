"""Bolts that are tightened: cut through their shanks, shortened and held so.

Across the cut the displacement of a shank jumps by its shortening δ along the bolt's axis: u = ũ +
δ e, with ũ continuous and e the unit shift of what lies beyond the cut. Strain is that of ũ, so
that the jump loads the nodes by K e δ and is taken off where stress is recovered. Wherever a shank
is cut, what it does is the same: a shift strains nothing. The tension is the work of all forces on
the part beyond the cut in a shift of it,

    F = e · f,

e away from the cut, contact forces and loads f together, as long as no support resists it. Bolts
that are given by their force are shortened until they have it; from then on the shortening stays,
and with what the clamped faces lose goes the force (Bickford, Introduction to the Design and
Behavior of Bolted Joints, 4th ed. 2007, joint diagrams).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fe_models.elasticity.body import ElasticBody
from fe_models.meshes.remesh import element_volumes
from fe_models.meshes.structure_mesh import Body, MeshError, in_space
from sa_solver.types import Array, Mask

if TYPE_CHECKING:
    from fe_models.joints.friction import FrictionalJoint
    from fe_models.structure import Structure
    from fe_models.supported_body import SupportedBody

# What supports leave of a shift of the part beyond a cut that they do not resist.
UNRESISTED = 1e-9
# A bolt is tight when its force is that asked for but for this share.
TIGHT = 1e-6
# A bolt that has less of its force at the first trial is still loose: the next one pulls it by at
# most ten times as much.
LOOSE, MOST_TRIALS = 0.1, 30


@dataclass(frozen=True)
class Pretension:
    """The bolt ``body``, shortened by ``shortening`` [mm] where a plane cuts its shank.

    The plane goes ``through`` a point ``(3,)`` [mm] across the ``axis`` ``(3,)`` of the bolt.
    """

    body: str
    through: Array
    axis: Array
    shortening: float = 1.0

    def jump(self, elastic: ElasticBody) -> Array:
        """Shift of the nodes beyond the cut ``(size,)`` [mm], towards it.

        Raises :class:`MeshError` if the plane leaves all elements on one side.
        """
        axis = self.axis / np.linalg.norm(self.axis)
        components = axis[list(elastic.body.axes)]
        shift = -self.shortening * self.beyond(elastic)[:, None] * components
        return np.asarray(shift.ravel())

    def beyond(self, elastic: ElasticBody) -> Mask:
        """Nodes of the elements beyond the cut alone, ``(nodes,)``. Raises as :meth:`jump`."""
        beyond = np.ones(len(elastic.nodes), bool)
        beyond[elastic.element_nodes[:, ~self.far(elastic.body)]] = False
        return beyond

    def far(self, body: Body) -> Mask:
        """Elements beyond the cut ``(elements,)``. Raises as :meth:`jump`."""
        middles = in_space(body.mesh.p[:, body.mesh.t].mean(axis=1).T)
        far: Mask = (middles - self.through) @ self.axis > 0.0
        if far.all() or not far.any():
            raise MeshError(
                f"the plane through ({', '.join(f'{x:g}' for x in self.through)}) does not cut "
                f"body {body.name}; allowed: a point within its shank"
            )
        return far


@dataclass(frozen=True)
class BoltSection:
    """What acts along a bolt on the part of it on one side of its cut.

    ``shares`` ``(interfaces, 3)`` are what P, Qx and Qy of each interface have of that, ``loads``
    ``(cases,)`` is that of the load cases [N]; ``compliance`` [mm/N] that of a bar of its length
    and volume, from which to begin.
    """

    shares: Array
    loads: Array
    compliance: float

    def tension(self, resultants: Array, amplitudes: Array) -> Array:
        """Of the bolt as far as it is meshed ``(t,)`` [N].

        From P, Qx, Qy and more of the meshed parts of all interfaces, ``(t, interfaces, 6)``, and
        ``amplitudes`` ``(t, cases)`` of the loads.
        """
        carried = np.einsum("tic,ic->t", resultants[:, :, :3], self.shares)
        return np.asarray(carried + amplitudes @ self.loads)


@dataclass(frozen=True)
class Bolt:
    """The bolt ``name``, load case ``case``, of a ``section``; with a ``force`` [N], or as short.

    What a case without force says is its shortening; with one it is found (:func:`tightened`).
    """

    name: str
    case: int
    section: BoltSection
    force: float | None = None


def check_pretension(load: Pretension, bodies: Sequence[Body]) -> None:
    """Raise :class:`MeshError` unless a plane cuts the body that a bolt is."""
    found = [body for body in bodies if body.name == load.body]
    if not found:
        allowed = ", ".join(body.name for body in bodies)
        raise MeshError(f"no body {load.body}; allowed: {allowed}")
    load.far(found[0])


def bolt_section(structure: Structure, bolt: Pretension) -> BoltSection:
    """The section of a bolt, by the part that no support holds along it.

    Raises :class:`MeshError` where supports resist both parts, or the plane cuts a contact face.
    """
    names = [body.elastic.body.name for body in structure.bodies]
    place = names.index(bolt.body)
    body, axis = structure.bodies[place], bolt.axis / np.linalg.norm(bolt.axis)
    beyond = bolt.beyond(body.elastic)
    faces = [
        (number, side, beyond[structure.mesh.interfaces[number].nodes(side)])
        for number, side in structure.mesh.sides_of(place)
    ]
    for number, _, far in faces:
        if far.any() and not far.all():
            raise MeshError(
                f"the cut of {bolt.body} goes through its contact face "
                f"{structure.mesh.interfaces[number].name}; allowed: a point of the shank away "
                "from contacts"
            )
    components = list(body.elastic.body.axes)
    parts = (True, beyond, axis), (False, ~beyond, -axis)
    free = [
        (is_far, outwards, shift)
        for is_far, part, outwards in parts
        if _is_free(body, shift := np.outer(part, outwards[components]).ravel())
    ]
    if not free:
        raise MeshError(
            f"supports hold body {bolt.body} along its axis on both sides of the cut, so that its "
            "tension is not known; hold one side at most"
        )
    is_far, outwards, shift = free[0]
    shares = np.zeros((len(structure.mesh.interfaces), 3))
    for number, side, far in faces:
        if far.all() == is_far:
            frame = structure.mesh.interfaces[number].frame
            x, y, z = {1: -1.0, 2: 1.0}[side] * (frame.axes @ outwards)
            shares[number] += z, x, y
    length = float(np.ptp(body.elastic.nodes @ axis))
    volume = float(np.abs(element_volumes(body.elastic.body.mesh)).sum())
    return BoltSection(
        shares, shift @ body.acting, length**2 / (body.elastic.material.young * volume)
    )


def _is_free(body: SupportedBody, shift: Array) -> bool:
    """Whether supports leave a ``shift`` ``(size,)`` of a part of a body as it is."""
    constraints = body.constraints
    left = constraints.transformation() @ shift[constraints.free] - shift
    return bool(np.abs(left).max() <= UNRESISTED)


def tightened(
    structure: Structure,
    joint: FrictionalJoint,
    path: Array,
    bolts: Sequence[Bolt],
) -> Array:
    """Shortenings ``(bolts,)`` [mm] by which bolts have their forces at the end of a ``path``.

    ``path`` ``(t, cases)`` are amplitudes from rest in which those of the bolts are shares of
    their shortenings. All are found together by Broyden's method, from those that would stretch
    the bolts alone. Raises :class:`MeshError` where none are found.
    """
    columns, sections = [bolt.case for bolt in bolts], [bolt.section for bolt in bolts]
    forces = np.array([bolt.force for bolt in bolts], dtype=np.float64)

    def missing(shortenings: Array) -> Array:
        amplitudes = path.copy()
        amplitudes[:, columns] *= shortenings
        *_, end = joint.march(amplitudes, structure.gap())
        resultants = structure.interface_resultants(end)[None]
        told = [section.tension(resultants, amplitudes[-1:])[0] for section in sections]
        return np.array(told) - forces

    tried = forces * [section.compliance for section in sections]
    left = missing(tried)
    # What is still loose is pulled on by more.
    slopes = np.diag(np.maximum(left + forces, LOOSE * forces) / tried)
    for _ in range(MOST_TRIALS):
        if np.all(np.abs(left) <= TIGHT * forces):
            return tried
        step = -np.linalg.solve(slopes, left)
        after = missing(tried + step)
        slopes += np.outer(after - left - slopes @ step, step) / (step @ step)
        tried, left = tried + step, after
    raise MeshError(
        f"no shortening of the bolts gives their forces: {', '.join(f'{f:.4g} N' for f in left)} "
        "are missing; see that all that a bolt clamps is in contact"
    )
