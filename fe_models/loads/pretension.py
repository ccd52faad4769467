"""Pretension of bolts, whose shanks are cut and shortened.

Across the cut the displacement of a shank jumps by its shortening δ along the bolt's axis:
u = ũ + δ e, with ũ continuous and e the unit shift of the part beyond the cut. The strain is that
of ũ, so the jump loads the nodes by K e δ and is subtracted where stress is recovered. The result
does not depend on the position of the cut, because a shift causes no strain. The tension is the
work of all forces on the part beyond the cut in a unit shift of it,

    F = e · f,

with e away from the cut and f the contact forces and loads together, as long as no support resists
the shift. Bolts that are given by their force are shortened until they have it. From then on the
shortening is constant, and the force falls as the clamped faces wear (Bickford, Introduction to the
Design and Behavior of Bolted Joints, 4th ed. 2007, joint diagrams).
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

# Change of a unit shift by supports up to which they do not resist it.
UNRESISTED = 1e-9
# Relative error up to which a bolt has the force that was requested.
TIGHT = 1e-6
# A bolt with less than this share of its force at the first trial is still loose: the slope is
# limited so that the next trial is at most ten times as large. MOST_TRIALS limits the trials.
LOOSE, MOST_TRIALS = 0.1, 30


@dataclass(frozen=True)
class Pretension:
    """Pretension of the bolt ``body`` by a ``shortening`` [mm] where a plane cuts its shank.

    The plane goes ``through`` a point ``(3,)`` [mm] and is normal to the ``axis`` ``(3,)`` of the
    bolt.
    """

    body: str
    through: Array
    axis: Array
    shortening: float = 1.0

    def jump(self, elastic: ElasticBody) -> Array:
        """Return the shift of the nodes beyond the cut ``(size,)`` [mm], towards it.

        Raises :class:`MeshError` if the plane leaves all elements on one side.
        """
        axis = self.axis / np.linalg.norm(self.axis)
        components = axis[list(elastic.body.axes)]
        shift = -self.shortening * self.beyond(elastic)[:, None] * components
        return np.asarray(shift.ravel())

    def beyond(self, elastic: ElasticBody) -> Mask:
        """Return flags ``(nodes,)`` of nodes of only the elements beyond the cut.

        Raises :class:`MeshError` as :meth:`jump` does.
        """
        beyond = np.ones(len(elastic.nodes), bool)
        beyond[elastic.element_nodes[:, ~self.far(elastic.body)]] = False
        return beyond

    def far(self, body: Body) -> Mask:
        """Return flags ``(elements,)`` of the elements beyond the cut.

        Raises :class:`MeshError` as :meth:`jump` does.
        """
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
    """Coefficients of the force along a bolt on the part of it on one side of its cut.

    Attributes
    ----------
    shares
        Coefficients of P, Qx and Qy of each interface in the force ``(interfaces, 3)``.
    loads
        Force due to each load case ``(cases,)`` [N].
    compliance
        Compliance of a bar of the bolt's length and volume [mm/N], used for the first trial.
    """

    shares: Array
    loads: Array
    compliance: float

    def tension(self, resultants: Array, amplitudes: Array) -> Array:
        """Return the tension of the bolt as far as it is meshed ``(t,)`` [N].

        ``resultants`` ``(t, interfaces, 6)`` are P, Qx, Qy and the moments of the meshed parts of
        all interfaces, and ``amplitudes`` ``(t, cases)`` those of the loads.
        """
        carried = np.einsum("tic,ic->t", resultants[:, :, :3], self.shares)
        return np.asarray(carried + amplitudes @ self.loads)


@dataclass(frozen=True)
class Bolt:
    """Bolt ``name`` with its load case and ``section``, and a ``force`` [N] if it is given.

    Without a force, the amplitude of its load case is its shortening. With a force, the shortening
    is found by :func:`tightened`.
    """

    name: str
    case: int
    section: BoltSection
    force: float | None = None


def check_pretension(load: Pretension, bodies: Sequence[Body]) -> None:
    """Raise :class:`MeshError` unless the bolt's body exists and the plane cuts it."""
    found = [body for body in bodies if body.name == load.body]
    if not found:
        allowed = ", ".join(body.name for body in bodies)
        raise MeshError(f"no body {load.body}; allowed: {allowed}")
    load.far(found[0])


def bolt_section(structure: Structure, bolt: Pretension) -> BoltSection:
    """Return the section of a bolt, from the part that no support holds along it.

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
            f"supports hold body {bolt.body} along its axis on both sides of the cut, so its "
            "tension cannot be determined; hold one side at most"
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
    """Return whether supports do not change a ``shift`` ``(size,)`` of a part of a body."""
    constraints = body.constraints
    left = constraints.transformation() @ shift[constraints.free] - shift
    return bool(np.abs(left).max() <= UNRESISTED)


def tightened(
    structure: Structure,
    joint: FrictionalJoint,
    path: Array,
    bolts: Sequence[Bolt],
) -> Array:
    """Return shortenings ``(bolts,)`` [mm] that give the bolts their forces at the end of a path.

    All are found together by Broyden's method, starting from those that would stretch the bolts
    alone. Raises :class:`MeshError` if it does not converge.

    Parameters
    ----------
    structure
        The structure with the bolts.
    joint
        Its joint with friction.
    path
        Amplitudes ``(t, cases)`` from rest, in which those of the bolts are shares of their
        shortenings.
    bolts
        Bolts with given forces.
    """
    columns, sections = [bolt.case for bolt in bolts], [bolt.section for bolt in bolts]
    forces = np.array([bolt.force for bolt in bolts], dtype=np.float64)

    def missing(shortenings: Array) -> Array:
        amplitudes = path.copy()
        amplitudes[:, columns] *= shortenings
        *_, end = joint.march(amplitudes, structure.gap())
        resultants = structure.interface_resultants(end)[None]
        tensions = [section.tension(resultants, amplitudes[-1:])[0] for section in sections]
        return np.array(tensions) - forces

    tried = forces * [section.compliance for section in sections]
    left = missing(tried)
    # The limit on the slope gives bolts that are still loose a larger, but bounded, next step.
    slopes = np.diag(np.maximum(left + forces, LOOSE * forces) / tried)
    for _ in range(MOST_TRIALS):
        if np.all(np.abs(left) <= TIGHT * forces):
            return tried
        step = -np.linalg.solve(slopes, left)
        after = missing(tried + step)
        slopes += np.outer(after - left - slopes @ step, step) / (step @ step)
        tried, left = tried + step, after
    raise MeshError(
        "no shortening was found that gives the bolts their forces: "
        f"{', '.join(f'{f:.4g} N' for f in left)} are missing; check that all parts that a bolt "
        "clamps are in contact"
    )
