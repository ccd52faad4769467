"""Supports, loads and contacts of bodies from a user's mesh, named by its groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import scipy.sparse as sp

from fe_models.cyclic.cuts import Cuts, Cyclic, hold_normal
from fe_models.cyclic.sector import (
    check_jumps,
    check_off_cuts,
    check_same_in_all_sectors,
    check_temperatures,
    sector_cuts,
)
from fe_models.elasticity.body import ElasticBody
from fe_models.elasticity.spin_softening import spin_softening
from fe_models.elasticity.thermal import Temperature, check_temperature, thermal_strains
from fe_models.geometry.imported import ImportedMesh
from fe_models.joints.mortar import frame_of_faces, mortar_interface
from fe_models.loads.applied_loads import (
    AppliedLoad,
    BoundaryForce,
    RemoteDisplacement,
    Rotation,
    boundary_of,
    turning_of,
    vector_of,
)
from fe_models.loads.constraints import Constraints
from fe_models.loads.imposed import (
    check_against_each_other,
    check_against_supports,
)
from fe_models.loads.load_cases import LoadCases
from fe_models.loads.nodal_force import shared
from fe_models.loads.pretension import Pretension, check_pretension
from fe_models.loads.rest import AXIS_NAMES, check_held_faces, check_rest
from fe_models.meshes.curved_face import Surface, edges_of
from fe_models.meshes.cut_face import cut_interface
from fe_models.meshes.second_order import set_nodes
from fe_models.meshes.structure_mesh import (
    Body,
    MatchError,
    MeshError,
    StructureMesh,
    matched_interface,
)
from fe_models.meshes.trace import LinearTrace
from fe_models.readers.set_faces import facets_within
from fe_models.structure import Structure
from fe_models.supported_body import SupportedBody, interface_nodes
from sa_solver.types import Array, Frame, Indices, Material

# Supports do not depend on the material of the bodies.
ANY = Material(1.0, 0.0)


@dataclass(frozen=True)
class ContactPair:
    """Contact between ``face_1`` of body 1 and ``face_2`` of body 2 of a user's mesh.

    Attributes
    ----------
    name
        Name of the contact.
    bodies
        Names of body 1 and body 2.
    face_1, face_2
        Boundaries, seams included, that together are the contact face of each body.
    x_direction
        Direction ``(3,)`` close to the x axis of the contact's frame.
    """

    name: str
    bodies: tuple[str, str]
    face_1: Sequence[str]
    face_2: Sequence[str]
    x_direction: Array

    def boundaries(self, number: int) -> Sequence[str]:
        """Return the boundaries that are the contact face of body ``number``, 1 or 2."""
        return (self.face_1, self.face_2)[number - 1]

    def boundary(self, number: int) -> str:
        """Return one name for the contact face of body ``number``, 1 or 2."""
        return " + ".join(self.boundaries(number))


@dataclass(frozen=True)
class Support:
    """Displacements held at a boundary or node set.

    ``hold`` names the global axes, such as ``"xz"``, or is ``"normal"``, or names the axis along
    which only the mean over a boundary is held, such as ``"mean_y"``.
    """

    group: str
    hold: str


def imported_mesh(
    imported: ImportedMesh,
    names: Sequence[str],
    pairs: Sequence[ContactPair],
    supports: Sequence[Support] = (),
) -> StructureMesh:
    """Return the named bodies of a user's mesh with the interfaces between them.

    The contact faces become boundaries with the name of their interface; their nodes need not
    match. Raises :class:`MeshError` for names that are not in the file or faces that do not meet.

    Parameters
    ----------
    imported
        The user's mesh.
    names
        Names of the bodies.
    pairs
        Contacts between the bodies.
    supports
        Supports, which may make planes of symmetry of the contacts
        (:mod:`fe_models.meshes.cut_face`).
    """
    bodies = {name: _with_interfaces(imported, named_body(imported, name), pairs) for name in names}
    held = {
        name: _held(imported, ElasticBody(body, ANY), supports).transformation()
        for name, body in bodies.items()
    }
    interfaces = []
    for pair in pairs:
        body_1, body_2 = meeting = [bodies[name] for name in pair.bodies]
        faces = (body_1, pair.boundary(1), body_2, pair.boundary(2))
        frame, _ = frame_of_faces(*faces, pair.x_direction)
        try:
            interface = matched_interface(pair.name, body_1, body_2, pair.name, frame)
        except MatchError:
            surfaces = (
                _surface(imported, body_1, pair.name, frame),
                _surface(imported, body_2, pair.name, frame),
            )
            interface = mortar_interface(pair.name, *faces, frame, surfaces)
        one, two = (list(bodies).index(name) for name in pair.bodies)
        cut = cut_interface(interface, meeting, [held[name] for name in pair.bodies])
        interfaces.append(replace(cut, bodies=(one, two)))
    return StructureMesh(tuple(bodies.values()), tuple(interfaces))


def imported_structure(
    mesh: StructureMesh,
    imported: ImportedMesh,
    materials: Sequence[Material],
    supports: Sequence[Support],
    loads: Sequence[AppliedLoad],
    order: int,
    cyclic: Sequence[Cyclic] = (),
) -> Structure:
    """Return all bodies with their supports and a load case for each of the ``loads``.

    Parameters
    ----------
    mesh
        Bodies and interfaces from :func:`imported_mesh`.
    imported
        The user's mesh.
    materials
        Material of each body.
    supports
        Supports of all bodies.
    loads
        Loads, one load case each.
    order
        Order of the elements, 1 or 2. Elements of order 2 are curved where bodies have midside
        nodes, which :func:`fe_models.meshes.second_order.with_midsides` gives them.
    cyclic
        Cyclic cuts, if the bodies are one sector of a wheel.

    Raises
    ------
    MeshError
        If no body has a group, if supports leave a rigid motion although all faces stick, or if
        they hold a contact face in a way that is no plane of symmetry.
    """
    for support in supports:
        check_support(imported, mesh.bodies, support)
    cuts = sector_cuts(mesh, cyclic)
    for support in supports:
        check_off_cuts(mesh.bodies, support.group, cyclic)
    for load in loads:
        check_load(imported, mesh.bodies, load)
        check_same_in_all_sectors(mesh.bodies, load, cyclic)
        check_temperatures(mesh, imported.node_numbers, load, cuts)
    bodies = [
        _supported(number, mesh, imported, material, supports, loads, order, cuts[number])
        for number, material in enumerate(materials)
    ]
    structure = Structure(mesh.weighted(order), tuple(bodies))
    check_held_faces(structure)
    check_rest(structure)
    return structure


def named_body(imported: ImportedMesh, name: str) -> Body:
    """Return the body of that name. Raises :class:`MeshError` if there is none."""
    if name not in imported.bodies:
        raise MeshError(f"no body {name}; allowed: {', '.join(imported.bodies)}")
    return imported.bodies[name]


def contact_facets(imported: ImportedMesh, body: Body, boundary: str) -> Indices:
    """Return the facets of a boundary of a body, or those with all vertices in a node set.

    Raises :class:`MeshError` if the name is not on that body, or if the nodes of a set are not a
    face.
    """
    boundaries, node_sets = body.mesh.boundaries or {}, imported.points[body.name]
    if boundary in boundaries:
        return np.asarray(boundaries[boundary])
    known = ", ".join([*boundaries, *node_sets]) or "none"
    others = [b.name for b in imported.bodies.values() if boundary in (b.mesh.boundaries or {})]
    if others:
        wrong = f"boundary {boundary} is on body {', '.join(others)}, not on {body.name}"
    elif boundary in node_sets:
        facets = facets_within(body, node_sets[boundary])
        left = len(np.setdiff1d(node_sets[boundary], body.mesh.facets[:, facets]))
        if not left:
            return facets
        wrong = (
            f"{boundary} is a node set; {left} of its nodes are on no facet with all corners in it"
        )
    else:
        wrong = f"no boundary {boundary} on body {body.name}"
    raise MeshError(f"{wrong}; allowed: {known}")


def check_support(imported: ImportedMesh, bodies: Sequence[Body], support: Support) -> None:
    """Raise :class:`MeshError` if no body has the group, or if it cannot be held that way."""
    boundaries, node_sets = _groups(imported, bodies)
    group, hold = support.group, support.hold
    if group not in boundaries | node_sets:
        raise MeshError(
            f"no boundary or node set {group} on {_any_of(bodies)}; allowed: "
            f"{', '.join(sorted(boundaries | node_sets)) or 'none'}"
        )
    if group not in boundaries and (hold == "normal" or hold.startswith("mean_")):
        raise MeshError(
            f"node set {group} has no area to hold {hold}; allowed: axes such as xz, or a boundary"
        )


def check_load(imported: ImportedMesh, bodies: Sequence[Body], load: AppliedLoad) -> None:
    """Raise :class:`MeshError` if no body has the boundary, or if the plane lacks the direction."""
    if isinstance(load, Pretension):
        check_pretension(load, bodies)
    if isinstance(load, Temperature):
        check_temperature(load, {body.name: imported.node_numbers[body.name] for body in bodies})
    boundaries, node_sets = _groups(imported, bodies)
    group = boundary_of(load)
    if isinstance(load, BoundaryForce) and group in node_sets - boundaries:
        _check_shared(imported, bodies, load)
    elif group is not None and group not in boundaries:
        wrong = (
            f"{group} is a node set that is not a face, so it has no area and takes only forces"
            if group in node_sets
            else f"no boundary {group} on {_any_of(bodies)}"
        )
        raise MeshError(f"{wrong}; allowed: {', '.join(sorted(boundaries)) or 'none'}")
    having = [body for body in bodies if group in _names(imported, body)]
    if isinstance(load, BoundaryForce | RemoteDisplacement) and len(having) > 1:
        what = "take all of the force" if isinstance(load, BoundaryForce) else "be tied to it"
        raise MeshError(
            f"{group} is a boundary of {' and '.join(body.name for body in having)}, and each "
            f"would {what}; allowed: boundaries of one body"
        )
    if bodies[0].mesh.dim() == 3:
        return
    vector = vector_of(load)
    if vector is not None and vector[1] != 0.0:
        raise MeshError("a load acts along y, across the plane; allowed: along x and z")
    turning = turning_of(load)
    if turning is not None and np.any(turning[[0, 2]]):
        what = "moment" if isinstance(load, BoundaryForce) else "rotation"
        raise MeshError(f"a {what} about x or z, which lie in the plane; allowed: about y")


def _check_shared(imported: ImportedMesh, bodies: Sequence[Body], load: BoundaryForce) -> None:
    """Raise :class:`MeshError` unless the nodes of a set that is not a face can carry a force."""
    if getattr(load, "rigid", False):
        raise MeshError(
            f"{load.boundary} is a node set that is not a face, so it cannot be made rigid; "
            "allowed: a rigid boundary"
        )
    for body in bodies:
        if load.boundary in imported.points[body.name]:
            shared(load, body.points[imported.points[body.name][load.boundary]])


def _any_of(bodies: Sequence[Body]) -> str:
    return " or ".join(body.name for body in bodies)


def _with_interfaces(imported: ImportedMesh, body: Body, pairs: Sequence[ContactPair]) -> Body:
    """Return the body with its contact faces as boundaries that have the interfaces' names.

    A contact face of several boundaries is also a boundary under all their names joined together,
    and node sets that are faces become boundaries.
    """
    named = dict(imported.set_faces[body.name])
    for pair in pairs:
        for number in (n for n, name in enumerate(pair.bodies, start=1) if name == body.name):
            parts = [contact_facets(imported, body, name) for name in pair.boundaries(number)]
            facets = np.unique(np.concatenate(parts))
            named |= {pair.name: facets, pair.boundary(number): facets}
    return replace(body, mesh=body.mesh.with_boundaries(named))


def _surface(imported: ImportedMesh, body: Body, boundary: str, frame: Frame) -> Surface:
    """Return the surface that the mesh of a boundary approximates, in a frame."""
    facets, midsides = body.facets(boundary), None
    if body.name in imported.midsides:
        edges = edges_of(facets)
        found = imported.midsides[body.name].at(edges.reshape(-1, 2))
        midsides = frame.coordinates(found).reshape(*edges.shape[:2], 3)
    nodes = body.vertices(boundary)
    points = frame.coordinates(body.points[nodes])
    return Surface.of(points, np.searchsorted(nodes, facets), midsides)


def _groups(imported: ImportedMesh, bodies: Sequence[Body]) -> tuple[set[str], set[str]]:
    """Return the names of the boundaries and of the node sets of the bodies."""
    boundaries = {
        name
        for body in bodies
        for name in [*imported.bodies[body.name].mesh.boundaries, *imported.set_faces[body.name]]
    }
    return boundaries, {name for body in bodies for name in imported.points[body.name]}


def _supported(
    number: int,
    mesh: StructureMesh,
    imported: ImportedMesh,
    material: Material,
    supports: Sequence[Support],
    loads: Sequence[AppliedLoad],
    order: int,
    cuts: Sequence[Cuts],
) -> SupportedBody:
    body = mesh.bodies[number]
    elastic = ElasticBody(body, material, order)
    constraints, groups = _held(imported, elastic, supports, cuts), _names(imported, body)
    free, supported_motions = constraints.free, constraints.transformation()
    thermal = thermal_strains(loads, elastic, imported.node_numbers[body.name])
    cases = LoadCases(elastic, thermal, groups, imported.points[body.name])
    # Rigid faces come first, because they leave few displacements for means.
    for case, load in sorted(enumerate(loads), key=lambda e: not getattr(e[1], "rigid", False)):
        cases.add(case, load, constraints)
    check_against_supports(loads, cases.imposed, supported_motions @ cases.imposed[free])
    check_against_each_other(elastic, cases.moved)
    check_jumps(body, cases.jumps, cuts)
    _check_separate(mesh, number)
    faces = mesh.faces_of(number)
    try:
        trace = LinearTrace.of(elastic, {i.name: i.nodes(side) for i, side in faces})
        supported = SupportedBody(
            elastic,
            constraints,
            *interface_nodes(faces, body),
            cases.forces + cases.straining,
            cases.imposed if cases.imposed.any() else None,
            cases.loaded,
            trace,
            thermal,
            cuts,
            cases.jumps if cases.jumps.any() else None,
            cases.straining,
        )
    except ValueError as error:
        raise MeshError(f"body {body.name}: {error}") from error
    if len(constraints.free) <= np.sum(~supported.held):
        raise MeshError(
            f"body {body.name}: every node is held or on a contact face; refine its mesh"
        )
    return supported


def _check_separate(mesh: StructureMesh, number: int) -> None:
    """Raise if a node of body ``number`` is on two of its contact faces."""
    for (one, side), (other, other_side) in combinations(mesh.faces_of(number), 2):
        if len(np.intersect1d(one.nodes(side), other.nodes(other_side))):
            raise MeshError(
                f"contacts {one.name} and {other.name} share nodes of body "
                f"{mesh.bodies[number].name}; divide the face between them, or make them one "
                "contact"
            )


def _held(
    imported: ImportedMesh,
    elastic: ElasticBody,
    supports: Sequence[Support],
    cuts: Sequence[Cuts] = (),
) -> Constraints:
    """Return the constraints of a body by supports and by the ties between its cyclic cuts."""
    body = elastic.body
    constraints = Constraints(len(elastic.nodes), elastic.dimension)
    for support in supports:
        if support.group in _names(imported, body):
            _hold(constraints, elastic, imported, support, cuts)
    for pair in cuts:
        pair.tie(constraints, elastic)
    return constraints


def _names(imported: ImportedMesh, body: Body) -> set[str]:
    """Return the names of the boundaries and node sets of a body."""
    return set[str]().union(*_groups(imported, [body]))


def _hold(
    constraints: Constraints,
    elastic: ElasticBody,
    imported: ImportedMesh,
    support: Support,
    cuts: Sequence[Cuts],
) -> None:
    """Add one support to the constraints of a body."""
    group, hold = support.group, support.hold
    is_boundary = group in elastic.body.mesh.boundaries
    if hold == "normal":
        hold_normal(constraints, elastic, group, cuts)
        return
    if hold.startswith("mean_"):
        constraints.zero_mean(*elastic.boundary_weights(group), _unit(hold[-1], elastic.body))
        return
    nodes = elastic.boundary_nodes(group) if is_boundary else set_nodes(elastic, imported, group)
    for axis in hold:
        direction = _unit(axis, elastic.body)
        if direction.any():
            constraints.slide(nodes, np.tile(direction, (len(nodes), 1)))


def _unit(axis: str, body: Body) -> Array:
    """Return the unit vector of a named global axis in the body's components."""
    return np.eye(3)[AXIS_NAMES.index(axis), list(body.axes)]


def imported_softening(
    structure: Structure, loads: Sequence[AppliedLoad], amplitudes: Array
) -> tuple[sp.csr_matrix, ...]:
    """Return the spin softening ``(size, size)`` [N/mm] of every body under the loads.

    ``amplitudes`` are those of the loads; only rotations contribute.
    """
    softening = []
    for body in structure.bodies:
        total = sp.csr_matrix(body.elastic.stiffness.shape)
        for load, amplitude in zip(loads, amplitudes, strict=True):
            if isinstance(load, Rotation):
                one = spin_softening(body.elastic, load.speed, axis=load.direction)
                total = total + amplitude * one
        softening.append(total.tocsr())
    return tuple(softening)
