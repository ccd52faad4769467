"""Supports, loads and contacts of bodies from a user's mesh, named by its groups."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.constraints import Constraints
from fe_models.elasticity import ElasticBody
from fe_models.geometry.imported import ImportedMesh
from fe_models.mesh import (
    Body,
    Indices,
    MeshError,
    StructureMesh,
    matched_interface,
    meet_node_to_node,
)
from fe_models.mortar import frame_of_faces, mortar_interface
from fe_models.structure import Structure
from fe_models.supported_body import SupportedBody, interface_frames
from sa_solver.types import Array, Material

AXIS_NAMES = "xyz"


@dataclass(frozen=True)
class ContactPair:
    """``face_1`` of body 1 meets ``face_2`` of body 2; their frame's x is near ``x_direction``."""

    name: str
    face_1: str
    face_2: str
    x_direction: Array


@dataclass(frozen=True)
class Support:
    """Displacements held at a boundary or node set.

    ``hold`` names the global axes, such as ``"xz"``, or is ``"normal"``, or the axis along which
    only the mean over a boundary is held, such as ``"mean_y"``.
    """

    group: str
    hold: str


@dataclass(frozen=True)
class Pressure:
    """Pressure [MPa] on a boundary, into the body."""

    boundary: str
    pressure: float


@dataclass(frozen=True)
class Force:
    """Force ``(3,)`` [N] on a boundary, spread evenly; per length in the plane [N/mm]."""

    boundary: str
    force: Array


@dataclass(frozen=True)
class Displacement:
    """Displacement ``(3,)`` [mm] imposed on a boundary along its own direction; free across it."""

    boundary: str
    displacement: Array


@dataclass(frozen=True)
class Rotation:
    """Rotation of both bodies at ``speed`` [rad/s] about an axis ``(3,)`` through a point ``(3,)``.

    Its forces go with the square of the speed.
    """

    axis: Array
    through: Array
    speed: float


@dataclass(frozen=True)
class Acceleration:
    """Acceleration ``(3,)`` [mm/s²] of the frame of reference: bodies are pulled against it."""

    acceleration: Array


Load = Pressure | Force | Displacement | Rotation | Acceleration


def imported_mesh(
    imported: ImportedMesh, names: tuple[str, str], pairs: Sequence[ContactPair]
) -> StructureMesh:
    """The two bodies of those names and the interfaces between them.

    The contact faces become boundaries named as their interface, whose nodes need not match.
    Raises :class:`MeshError` for names that are not in the file or faces that do not meet.
    """
    bodies = [_body(imported, name) for name in names]
    faces = [[pair.face_1 for pair in pairs], [pair.face_2 for pair in pairs]]
    for number, own in enumerate(faces):
        bodies[number] = _with_interfaces(bodies[number], own, [pair.name for pair in pairs])
    body_1, body_2 = bodies
    interfaces = []
    for pair in pairs:
        frame, _ = frame_of_faces(body_1, pair.name, body_2, pair.name, pair.x_direction)
        if meet_node_to_node(body_1, body_2, pair.name):
            interfaces.append(matched_interface(pair.name, body_1, body_2, pair.name, frame))
        else:
            interfaces.append(
                mortar_interface(pair.name, body_1, pair.name, body_2, pair.name, frame)
            )
    return StructureMesh(body_1, body_2, tuple(interfaces))


def imported_structure(
    mesh: StructureMesh,
    imported: ImportedMesh,
    materials: tuple[Material, Material],
    supports: Sequence[Support],
    loads: Sequence[Load],
    order: int,
) -> Structure:
    """Both bodies with their supports and a load case for each of the ``loads``.

    Raises :class:`MeshError` for a group that neither body has, and if contact faces are supported.
    """
    groups = {group for body in (mesh.body_1, mesh.body_2) for group in _groups(imported, body)}
    for group in [s.group for s in supports] + [b for b in map(_boundary, loads) if b]:
        if group not in groups:
            raise MeshError(
                f"no boundary or node set {group} on either body; there are "
                f"{', '.join(sorted(groups))}"
            )
    bodies = [
        _supported(number, mesh, imported, material, supports, loads, order)
        for number, material in enumerate(materials, start=1)
    ]
    return Structure(mesh, *bodies)


def _body(imported: ImportedMesh, name: str) -> Body:
    if name not in imported.bodies:
        raise MeshError(f"no body {name}; there are {', '.join(imported.bodies)}")
    return imported.bodies[name]


def _with_interfaces(body: Body, faces: Sequence[str], names: Sequence[str]) -> Body:
    """The body with its contact faces as boundaries of the interfaces' names as well."""
    boundaries = body.mesh.boundaries or {}
    for face in faces:
        if face not in boundaries:
            known = ", ".join(boundaries) or "none"
            raise MeshError(f"body {body.name} has no boundary {face}; it has {known}")
    named = {name: boundaries[face] for name, face in zip(names, faces, strict=True)}
    return Body(body.name, body.mesh.with_boundaries(named))


def _groups(imported: ImportedMesh, body: Body) -> set[str]:
    return {*body.mesh.boundaries, *imported.points[body.name]}


def _boundary(load: Load) -> str | None:
    return getattr(load, "boundary", None)


def _supported(
    number: int,
    mesh: StructureMesh,
    imported: ImportedMesh,
    material: Material,
    supports: Sequence[Support],
    loads: Sequence[Load],
    order: int,
) -> SupportedBody:
    body = (mesh.body_1, mesh.body_2)[number - 1]
    elastic = ElasticBody(body, material, order)
    constraints = Constraints(len(elastic.nodes), elastic.dimension)
    own = _groups(imported, body)
    for support in supports:
        if support.group in own:
            _hold(constraints, elastic, imported.points[body.name], support)
    imposed = np.zeros((elastic.size, len(loads)))
    forces = np.zeros((elastic.size, len(loads)))
    for case, load in enumerate(loads):
        if isinstance(load, Displacement):
            if load.boundary in own:
                imposed[:, case] = _impose(constraints, elastic, load)
        elif _boundary(load) is None or _boundary(load) in own:
            forces[:, case] = _forces(elastic, load)
    for interface in mesh.interfaces:
        constraints.average(*elastic.midsides(interface.name))
    nodes = [(i.nodes_1, i.nodes_2)[number - 1] for i in mesh.interfaces]
    frames = interface_frames(mesh.interfaces, number, body)
    try:
        return SupportedBody(
            elastic, constraints, np.concatenate(nodes), frames, forces,
            imposed if imposed.any() else None,
        )  # fmt: skip
    except ValueError as error:
        raise MeshError(
            f"body {body.name}: a support or an imposed displacement holds nodes of a contact face"
        ) from error


def _hold(
    constraints: Constraints, elastic: ElasticBody, points: dict[str, Indices], support: Support
) -> None:
    """Add one support to a body's constraints."""
    group, hold = support.group, support.hold
    is_boundary = group in elastic.body.mesh.boundaries
    if not is_boundary and (hold == "normal" or hold.startswith("mean_")):
        raise MeshError(f"node set {group} has no area to hold {hold}; name a boundary")
    if hold == "normal":
        constraints.slide(*elastic.boundary_normals(group))
        return
    if hold.startswith("mean_"):
        constraints.zero_mean(*elastic.boundary_weights(group), _unit(hold[-1], elastic.body))
        return
    nodes = elastic.boundary_nodes(group) if is_boundary else points[group]
    for axis in hold:
        direction = _unit(axis, elastic.body)
        if direction.any():
            constraints.slide(nodes, np.tile(direction, (len(nodes), 1)))


def _unit(axis: str, body: Body) -> Array:
    """Unit vector of a named global axis in the body's components."""
    return np.eye(3)[AXIS_NAMES.index(axis), list(body.axes)]


def _impose(constraints: Constraints, elastic: ElasticBody, load: Displacement) -> Array:
    """Hold a boundary along a displacement and return it, ``(size,)``."""
    nodes = elastic.boundary_nodes(load.boundary)
    displacement = load.displacement[list(elastic.body.axes)]
    direction = displacement / np.linalg.norm(displacement)
    constraints.slide(nodes, np.tile(direction, (len(nodes), 1)))
    imposed = np.zeros((len(elastic.nodes), elastic.dimension))
    imposed[nodes] = displacement
    return imposed.ravel()


def _forces(elastic: ElasticBody, load: Load) -> Array:
    """Nodal forces ``(size,)`` of a load."""
    density = elastic.material.density
    match load:
        case Pressure():
            return load.pressure * elastic.pressure_load(load.boundary)
        case Force():
            area = elastic.boundary_integral(load.boundary, lambda x: np.ones_like(x[0]))
            return elastic.traction_load(
                load.boundary, lambda x: np.full_like(x[0], 1.0 / area), load.force
            )
        case Rotation():
            return elastic.body_load(_centrifugal(load, density))
        case Acceleration():
            pull = -density * load.acceleration
            return elastic.body_load(lambda x: np.broadcast_to(pull[:, None, None], x.shape))
    raise AssertionError(load)


def _centrifugal(load: Rotation, density: float) -> Callable[[Array], Array]:
    axis = load.axis / np.linalg.norm(load.axis)

    def force(points: Array) -> Array:
        arm = points - load.through[:, None, None]
        radial = arm - axis[:, None, None] * np.einsum("a,a...->...", axis, arm)
        return density * load.speed**2 * radial

    return force
