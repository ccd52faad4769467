"""Rigs made of a reduced body with joints, masses and springs at its kept points."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from contextlib import suppress

import numpy as np
import scipy.linalg as sl

from fe_models.dynamics.ground_motion import Translation, along, translation_of
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.periodic.receptance import RIGID
from fe_models.dynamics.rig import Link, RigError, reduced_rig, unit_force
from fe_models.dynamics.rings.sector import CyclicSector, reduced_sector
from fe_models.joints.reduction import STEPS, ReducedModel
from fe_models.matrices import MatrixError
from fe_models.matrices.unknowns import listed_names
from fe_models.meshes.structure_mesh import MeshError
from sa_solver.types import Array, Progress, Tally
from workflow.analyses.rig.bodies.matrix_body import LoadCase, MatrixBody
from workflow.analyses.rig.bodies.placeholder import matrices_by_name, specimen_by_name
from workflow.analyses.rig.bodies.point_body import PointBody
from workflow.analyses.rig.bodies.ring import RingOfSectors, with_next
from workflow.analyses.rig.joint_sections import ElasticJoint, FrictionContactJoint, Joint
from workflow.analyses.rig.place_names import PlaceNames, link_along
from workflow.analyses.rig.places import Moved
from workflow.analyses.rig.structure import JointedBody, JointPlaces, ReducedBody, own_laws
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.memory import memory
from workflow.analyses.specimens.model import reduced_pair
from workflow.case.loading import load_case
from workflow.errors import EntryError, UserError
from workflow.messages.warning_kinds import WarningKind
from workflow.models.rig.rig_model import JointEntry, JointNodes, RigModel
from workflow.models.specimens.reduced import ReducedSpecimens
from workflow.shell.terminal.reporter import Reporter

AXES = "xyz"


def reduced_rig_model(
    body: JointedBody,
    joint: Joint | ElasticJoint | None,
    reporter: Reporter,
    ring: RingOfSectors | None = None,
    engine_order: int = 1,
) -> RigModel:
    """Return the rig of a reduced body; ``joint`` is the law of entries without one of their own.

    Joints have three directions if any of them is a contact. The body may be a sector of a ``ring``
    that is driven by an ``engine_order``. Raises UserError for a file without such a body, and for
    points that it does not have.
    """
    with reporter.stage("reduction", "steps") as reported:
        found = _reduced_body(body, reporter, reported)
    return _rig_of(found, body, joint, ring, engine_order)


def known_rig_model(
    body: JointedBody,
    joint: Joint | ElasticJoint | None,
    ring: RingOfSectors | None = None,
    engine_order: int = 1,
) -> RigModel | None:
    """Return the rig as far as its places are known before a run, None if there are too many.

    A body that the run must reduce first, which may take long, is replaced by a stand-in:
    :mod:`.stand_in`.
    """
    found = _known_body(body)
    return None if found is None else _rig_of(found, body, joint, ring, engine_order)


def _rig_of(
    found: tuple[ReducedModel, tuple[str, ...]],
    body: JointedBody,
    joint: Joint | ElasticJoint | None,
    ring: RingOfSectors | None,
    engine_order: int,
) -> RigModel:
    """Return the rig on the model found for a body, from which massless names may be missing."""
    reduced, massless = found
    try:
        return _rig_on(reduced, body, [own or joint for own in own_laws(body)], ring, engine_order)
    except EntryError as error:
        if not massless:
            raise
        raise EntryError(error.key, f"{error.message}{_reported(massless)}") from error


def _rig_on(
    reduced: ReducedModel,
    body: JointedBody,
    laws: Sequence[Joint | ElasticJoint | None],
    of_ring: RingOfSectors | None,
    engine_order: int,
) -> RigModel:
    """Return the rig on a reduced model, whose entries of joints have these laws."""
    if reduced.names is None:
        raise EntryError(
            "structure.file",
            "a model whose kept displacements have no names; allowed: one of a specimens run, or "
            "one written with names",
        )
    further = _further_masses(body, reduced.names)
    points, ring, sector = _Points([*reduced.names, *further]), None, None
    linked = points
    if of_ring is not None:
        ring = of_ring.of_order(engine_order, points)
        linked = _Points(with_next(points.names, ring))
    contacts = [isinstance(law, FrictionContactJoint) for law in laws]
    directions = 3 if any(contacts) else 1
    joints = [
        linked.joints(places, contact, directions, f"structure.joints.{number}")
        for number, (places, contact) in enumerate(zip(body.joints, contacts, strict=True))
    ]
    every = [joint for entry in joints for joint in entry]
    masses = {**points.masses(body), **further}
    added = masses, linked.springs(body), np.array(body.damping_ratio)
    try:
        if ring is None:
            model = reduced_rig(reduced, reduced.names, every, *added)
        else:
            sector = reduced_sector(reduced, reduced.names, every, ring, *added)
            model, points = sector.at(0), _Points([n for n in points.names if n not in ring.ties])
        driven = _driven(body, reduced, model, points, sector)
        seen = _shape(model, points, body.seen, "structure.seen")
    except RigError as error:
        raise EntryError("structure", str(error)) from error
    label = f"{body.seen.points} {body.seen.direction}"
    entries = tuple(
        JointEntry(
            len(entry), _along(contact, places, body.seen), contact, places.joint is not None
        )
        for entry, contact, places in zip(joints, contacts, body.joints, strict=True)
    )
    # The direction of joints which have the law of the case, if there are any.
    looked_at = min(entries, key=lambda entry: entry.own).along
    return RigModel(
        *(model, driven, seen[None], (label,), directions, looked_at, entries),
        in_a_row=False,
        translations={} if sector is not None else _translations(reduced, model),
        nodes=_nodes(reduced, body, linked),
        sector=sector,
    )


def _nodes(reduced: ReducedModel, body: JointedBody, points: PlaceNames) -> JointNodes:
    """Return names, normals and places of the joints."""
    assert reduced.names is not None
    names, normals = [], []
    for number, joint in enumerate(body.joints):
        found = points.of(joint.points, f"structure.joints.{number}.points")
        # Joints close along their direction.
        normal = np.eye(3)[AXES.index(joint.direction[-1])]
        names += found
        normals += [normal if joint.direction.startswith("-") else 0.0 - normal] * len(found)
    places = None
    of = {name.rpartition(" ")[0]: k for k, name in enumerate(reduced.names)}
    # Points of a next sector and masses that are not part of the body have no places.
    if reduced.places is not None and all(name in of for name in names):
        places = reduced.places[[of[name] for name in names]]
    if places is not None and not np.isfinite(places).all():
        places = None
    return JointNodes(tuple(names), np.array(normals), places)


def _shape(model: DynamicModel, points: PlaceNames, moved: Moved, key: str) -> Array:
    """Return even shares ``(n,)`` of the displacements of points along a direction."""
    shares = points.shared(moved, key)
    return np.sum([share * unit_force(model, name) for name, share in shares], axis=0)


def _translations(body: ReducedModel, model: DynamicModel) -> dict[str, Translation]:
    """Return the rigid translations of the rig with the ground, by axis.

    An axis is left out where the body is held to something other than the rig.
    """
    found = {}
    for axis in AXES:
        with suppress(RigError):
            rigid = np.zeros(len(model.mass))
            rigid[: len(body.stiffness)] = translation_of(body, axis)
            # Of the further masses, only those that move along the axis.
            rigid[len(body.stiffness) :] = along(model.names[len(body.stiffness) :], axis)
            found[axis] = Translation(rigid, model.mass @ rigid)
    return found


def _driven(
    body: JointedBody,
    reduced: ReducedModel,
    model: DynamicModel,
    points: _Points,
    sector: CyclicSector | None,
) -> Array:
    """Return forces ``(n,)`` of an excitation of 1 N, zeros where nothing is driven here."""
    driven: Moved | LoadCase | None = body.driven
    if driven is None:
        return np.zeros(len(model.mass))
    if isinstance(driven, Moved):
        return _shape(model, points, driven, "structure.driven")
    load = reduced.loads[:, driven.load - 1]
    # Masses that are not part of the body are not in its matrices.
    if sector is None:
        return np.pad(load, (0, len(model.mass) - len(load)))
    # Forces on the face shared with the next sector act on that sector.
    shared = np.pad(load, (0, len(sector.model.mass) - len(load)))
    return sector.force(shared, sector.ring.shift(1))


def _along(contact: bool, places: JointPlaces, seen: Moved) -> int:
    """Return the observed direction of the joints.

    This is their only direction, or of a contact the one of its two tangential directions that is
    observed.
    """
    if not contact:
        return 0
    across, axis = _across(places.direction), seen.direction[-1]
    return across.index(axis) if axis in across else 0


def _across(direction: str) -> list[str]:
    """Return the two axes perpendicular to a direction."""
    return [axis for axis in AXES if axis != direction[-1]]


# --- the body -----------------------------------------------------------------------------------


def _reduced_body(
    body: JointedBody, reporter: Reporter, progress: Progress
) -> tuple[ReducedModel, tuple[str, ...]]:
    """Return the model, and names of displacements without mass that are not part of it."""
    if isinstance(body, PointBody):
        return body.body(), ()
    if isinstance(body, MatrixBody):
        return _of_matrices(body, reporter, progress)
    assert isinstance(body, ReducedBody)
    if body.body is None:
        return body.stored(), ()
    _, specimens = reduced_specimens("structure.file", body.file, reporter, progress)
    return specimens.reduction.models[body.body - 1], ()


def _known_body(body: JointedBody) -> tuple[ReducedModel, tuple[str, ...]] | None:
    """Return the model that a run would find, or a stand-in; None where neither is known."""
    if isinstance(body, PointBody):
        return body.body(), ()
    if isinstance(body, MatrixBody) and body.small:
        model, massless = body.reduced()
        return model, massless if body.massless is None else ()
    if isinstance(body, MatrixBody):
        named = matrices_by_name(body)
    else:
        assert isinstance(body, ReducedBody)
        named = body.stored() if body.body is None else specimen_by_name(body.file)
    return None if named is None else (named, ())


def _of_matrices(
    body: MatrixBody, reporter: Reporter, progress: Progress
) -> tuple[ReducedModel, tuple[str, ...]]:
    body.memory().check()
    try:
        reduced, massless = body.reduced(Tally(progress, STEPS))
    except MatrixError as error:
        raise UserError(f"structure.{error.part or 'matrices'}: {error}") from error
    count = f"matrices: {len(reduced.stiffness)} unknowns in the rig"
    if body.massless is None:
        reporter.log(f"{count}{_reported(massless)}")
    else:
        light = listed_names(massless) or "none"
        reporter.log(f"{count}; given mass for {body.massless:g} Hz: motions mostly of {light}")
        massless = ()
    _warn_of_slow(body, reduced, reporter)
    return reduced, massless


def _warn_of_slow(body: MatrixBody, reduced: ReducedModel, reporter: Reporter) -> None:
    """Warn of modes so slow, relative to the fastest, that they are treated as rigid motions."""
    lowest = body.lowest_frequencies()
    if lowest is None or not (lowest > 0.0).any():
        return
    assert reduced.names is not None
    assert reduced.mass is not None
    laden = np.zeros(len(reduced.stiffness))
    laden[: len(reduced.names)] = [body.laden.get(name, 0.0) for name in reduced.names]
    slowest = float(lowest[lowest > 0.0][0])
    last = 2 * [len(laden) - 1]
    square = sl.eigvalsh(reduced.stiffness, reduced.mass + np.diag(laden), subset_by_index=last)
    fastest = np.sqrt(square[0]) / (2.0 * np.pi)
    if slowest < np.sqrt(RIGID) * fastest:
        reporter.warn(
            WarningKind.MODE_TAKEN_AS_RIGID,
            f"the mode of {slowest:.3g} Hz is so far below the fastest, {fastest:.3g} Hz, that it "
            "is taken for a rigid motion: reduce by structure.retained and structure.modes",
        )


def _reported(massless: tuple[str, ...]) -> str:
    """Return a clause on displacements that are not in the model, to append to a message."""
    if not massless:
        return ""
    return (
        f"; {listed_names(massless)} have no mass and follow the others statically; to give them "
        "mass: structure.masses"
    )


def reduced_specimens(
    key: str,
    file: str,
    reporter: Reporter,
    progress: Progress,
    target_distance: float | None = None,
) -> tuple[SpecimensCase, ReducedSpecimens]:
    """Return the case in a ``file`` and its reduced specimens; ``progress`` is called on the way.

    Raises UserError for a file that is not a specimens case, or for bodies that cannot be meshed.
    """
    case = load_case(file, [SpecimensCase])
    model = reduced_pair(case, target_distance)
    try:
        memory(case, model.node_count()).check()
        model.prepare(progress)
    except MeshError as error:
        raise UserError(f"{key}: {file}: {error}") from error
    if model.from_cache:
        reporter.log("reduction: from the cache")
    return case, model


# --- its points ---------------------------------------------------------------------------------


def _further_masses(body: JointedBody, names: Sequence[str]) -> dict[str, float]:
    """Return masses that are not part of a body of these ``names``, by their displacements [t]."""
    points = {name.rpartition(" ")[0] for name in names}
    for number, mass in enumerate(body.further_masses):
        if mass.name in points:
            raise EntryError(
                f"structure.further_masses.{number}.name",
                f"'{mass.name}': a point of the body; allowed: other names, or structure.masses, "
                "which adds to points",
            )
    return {
        f"{mass.name} {axis}": mass.mass for mass in body.further_masses for axis in mass.directions
    }


class _Points(PlaceNames):
    """The kept points of a body by name, and the parts that are attached to them."""

    def joints(
        self, places: JointPlaces, contact: bool, directions: int, key: str
    ) -> list[list[Link]]:
        """Return the links of every joint of an entry, ``directions`` per joint.

        In a contact, the given direction is the last of three. In other joints it is the first, and
        the further ones are links that never stretch.
        """
        across = _across(places.direction) if contact else []
        axes, pairs = [*across, places.direction], self.pairs(places, key)
        for point in (end for pair in pairs for end in pair if end is not None):
            for axis in axes:
                self.moving(point, axis[-1], f"{key}.direction")
        nowhere = [Link(None)] * (directions - len(axes))
        return [[*(link_along(*pair, axis) for axis in axes), *nowhere] for pair in pairs]

    def masses(self, body: JointedBody) -> dict[str, float]:
        """Return masses added to displacements [t]."""
        added: defaultdict[str, float] = defaultdict(float)
        for number, point_mass in enumerate(body.masses):
            points = self.of(point_mass.points, f"structure.masses.{number}.points")
            for name in self.names:
                point, _, direction = name.rpartition(" ")
                # Rotations get no mass.
                if point in points and direction in AXES:
                    added[name] += point_mass.mass / len(points)
        return added

    def springs(self, body: JointedBody) -> dict[Link, float]:
        """Return springs added between displacements [N/mm]."""
        added: defaultdict[Link, float] = defaultdict(float)
        for number, spring in enumerate(body.springs):
            pairs = self.pairs(spring, f"structure.springs.{number}")
            for point, opposite in pairs:
                link = link_along(point, opposite, spring.direction)
                added[link] += spring.stiffness / len(pairs)
        return added
