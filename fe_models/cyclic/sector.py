"""Checks of a structure that is one sector of a wheel (:mod:`fe_models.cyclic.cuts`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fe_models.cyclic.cuts import Cuts, Cyclic
from fe_models.elasticity.thermal import NodalTemperature
from fe_models.loads.applied_loads import (
    Acceleration,
    AppliedLoad,
    BoundaryForce,
    Displacement,
    RemoteDisplacement,
    Rotation,
    boundary_of,
)
from fe_models.meshes.structure_mesh import Body, MeshError, StructureMesh
from sa_solver.types import Array, Indices

# Relative difference from which directions and lines differ: cases give six digits.
ALONG = 1e-6
# Difference, as a share of the largest, from which temperatures differ: files store four digits.
UNLIKE = 1e-3


def sector_cuts(mesh: StructureMesh, cyclic: Sequence[Cyclic]) -> list[list[Cuts]]:
    """Return the cuts of every body, in the order of the bodies.

    Raises :class:`MeshError` if a body has only one of two cuts, if the cuts are not images of each
    other, if the entries belong to different wheels, or if a contact face meets a cut.
    """
    for entry in cyclic:
        check_cuts(mesh.bodies, entry, entry.boundaries)
        check_wheel(mesh.bodies, cyclic[0], entry)
    return [
        _of_body(mesh, place, [entry for entry in cyclic if _has(body, entry.low)])
        for place, body in enumerate(mesh.bodies)
    ]


def check_wheel(bodies: Sequence[Body], first: Cyclic, entry: Cyclic) -> None:
    """Raise :class:`MeshError` unless both entries are of one wheel.

    In the plane the axis must also be normal to it.
    """
    if bodies[0].mesh.dim() == 2 and np.abs(entry.direction[[0, 2]]).max() > ALONG:
        raise MeshError("an axis in the plane; allowed: [0, 1, 0], across the plane")
    size = max(float(np.linalg.norm(np.ptp(body.points, axis=0))) for body in bodies)
    if entry.sectors != first.sectors or not _same_axis(
        (first.direction, first.through), (entry.direction, entry.through), size
    ):
        raise MeshError(
            "the axis or the number of sectors differs from the first entry; allowed: one wheel"
        )


def check_cuts(bodies: Sequence[Body], entry: Cyclic, names: Sequence[str]) -> None:
    """Raise :class:`MeshError` unless the boundaries ``names`` are on the bodies that are cut."""
    having = [body for body in bodies if _has(body, entry.low)]
    having = having or [body for body in bodies if _has(body, entry.high)] or [bodies[0]]
    for body in having:
        known = body.mesh.boundaries or {}
        for name in names:
            if name not in known:
                raise MeshError(
                    f"no boundary {name} on body {body.name}, which needs both cuts; allowed: "
                    f"{', '.join(known) or 'none'}"
                )


def check_temperatures(
    mesh: StructureMesh,
    numbers: Mapping[str, Indices],
    load: AppliedLoad,
    cuts: Sequence[Sequence[Cuts]],
) -> None:
    """Raise :class:`MeshError` if temperatures of two cuts differ, at nodes with ``numbers``."""
    if not isinstance(load, NodalTemperature):
        return
    for body, pairs in zip(mesh.bodies, cuts, strict=True):
        if not pairs or load.body not in (None, body.name):
            continue
        changes = load.at(numbers[body.name])
        unlike = max(pair.relative_difference(body, changes) for pair in pairs)
        if unlike > UNLIKE:
            raise MeshError(
                f"temperatures of body {body.name} differ between both cuts by {unlike:.2g} of the "
                "largest change; allowed: temperatures that are the same in all sectors"
            )


def check_jumps(body: Body, jumps: Array, cuts: Sequence[Cuts]) -> None:
    """Raise :class:`MeshError` unless ``jumps`` ``(size, loads)`` of both cuts are images.

    They are the displacements that bolts impose on a part of a body
    (:mod:`fe_models.loads.pretension`).
    """
    if not jumps.any():
        return
    nodal = jumps.reshape(-1, body.mesh.dim(), jumps.shape[1])
    if any(pair.off_images(body, nodal) > ALONG * np.abs(jumps).max() for pair in cuts):
        raise MeshError(
            f"the pretension of body {body.name} shifts its cuts by displacements that are not the "
            "same in all sectors; allowed: bolts within the sector, or along its axis"
        )


def check_same_in_all_sectors(
    bodies: Sequence[Body], load: AppliedLoad, cyclic: Sequence[Cyclic]
) -> None:
    """Raise :class:`MeshError` if a load cannot be the same in all sectors, or is on a cut."""
    if not cyclic:
        return
    axis = cyclic[0].direction
    _check_direction(bodies, load, cyclic[0])
    group = boundary_of(load)
    along = isinstance(load, Displacement) and not _crosses(axis, load.displacement)
    tied = isinstance(load, RemoteDisplacement) or (isinstance(load, BoundaryForce) and load.rigid)
    if group is not None and (tied or isinstance(load, Displacement)) and not along:
        _check_within(bodies, group, cyclic)
    if group is not None:
        check_off_cuts(bodies, group, cyclic)


def check_off_cuts(bodies: Sequence[Body], group: str, cyclic: Sequence[Cyclic]) -> None:
    """Raise :class:`MeshError` if a support or a load is on a cut, which is not a surface."""
    for body in bodies:
        boundaries = body.mesh.boundaries or {}
        for entry in cyclic:
            cuts = [boundaries[name] for name in entry.boundaries if name in boundaries]
            held = boundaries.get(group, [])
            if cuts and len(np.intersect1d(held, np.concatenate(cuts))):
                raise MeshError(
                    f"{group} is on a cut of structure.cyclic, where the next sector begins; "
                    "allowed: boundaries of the surface"
                )


def _check_direction(bodies: Sequence[Body], load: AppliedLoad, wheel: Cyclic) -> None:
    """Raise :class:`MeshError` for inertia loads that differ between the sectors."""
    axis = wheel.direction
    if isinstance(load, Rotation):
        size = max(float(np.linalg.norm(np.ptp(body.points, axis=0))) for body in bodies)
        if not _same_axis((axis, wheel.through), (load.direction, load.through), size):
            raise MeshError(
                "a rotation about another axis than structure.cyclic is not the same in all "
                "sectors; allowed: about that axis"
            )
    if isinstance(load, Acceleration) and _crosses(axis, load.acceleration):
        raise MeshError(
            "an acceleration across the axis of structure.cyclic is not the same in all sectors; "
            "allowed: along it"
        )


def _check_within(bodies: Sequence[Body], group: str, cyclic: Sequence[Cyclic]) -> None:
    """Raise :class:`MeshError` if a boundary with an imposed motion meets a cut."""
    for body in bodies:
        known = body.mesh.boundaries or {}
        cuts = [body.vertices(n) for entry in cyclic for n in entry.boundaries if n in known]
        if group not in known or not cuts:
            continue
        if len(np.intersect1d(body.vertices(group), np.concatenate(cuts))):
            raise MeshError(
                f"{group} meets a cut of structure.cyclic: a displacement across the axis, or a "
                "point that it is tied to, is not the same in all sectors; allowed: a boundary "
                "within the sector, or a displacement along the axis"
            )


def _crosses(axis: Array, direction: Array) -> bool:
    """Return whether a direction differs from a unit axis."""
    return bool(np.linalg.norm(np.cross(axis, direction)) > ALONG * np.linalg.norm(direction))


def _has(body: Body, names: Sequence[str]) -> bool:
    """Return whether a body has a boundary of those names."""
    return any(name in (body.mesh.boundaries or {}) for name in names)


def _of_body(mesh: StructureMesh, place: int, entries: Sequence[Cyclic]) -> list[Cuts]:
    """Return the cuts of the body at a place."""
    body = mesh.bodies[place]
    found = [Cuts.of(body, entry) for entry in entries]
    vertices = [pair.vertices(body) for pair in found]
    all_vertices = np.concatenate([np.empty(0, np.int64), *vertices])
    if len(np.unique(all_vertices)) < len(all_vertices):
        raise MeshError(
            f"pairs of cuts of body {body.name} share nodes; make them one, low: [a, b]"
        )
    for interface, side in mesh.faces_of(place):
        if len(np.intersect1d(interface.nodes(side), all_vertices)):
            raise MeshError(
                f"the face of contact {interface.name} on body {body.name} meets a cut, beyond "
                "which it would continue; allowed: faces within the sector, so cut the wheel "
                "elsewhere"
            )
    return found


def _same_axis(one: tuple[Array, Array], other: tuple[Array, Array], size: float) -> bool:
    """Return whether two lines, each a unit direction and a point, coincide.

    The tolerance is relative to the ``size`` of the bodies.
    """
    apart = np.linalg.norm(np.cross(one[1] - other[1], one[0]))
    turned = np.linalg.norm(np.cross(one[0], other[0]))
    return bool(turned <= ALONG and apart <= ALONG * size)
