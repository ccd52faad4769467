"""A rig made of a reduced body: joints, masses and springs at the points that it is reduced to."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from fe_models.dynamics.ground_motion import Translation, translation_of
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.rig import Link, RigError, reduced_rig, unit_force
from fe_models.mesh import MeshError
from fe_models.reduction import ReducedModel
from sa_solver.types import Array, Progress
from workflow.analyses.rig.place_names import PlaceNames, link_along
from workflow.analyses.rig.places import Moved
from workflow.analyses.rig.rig_model import RigModel
from workflow.analyses.rig.structure import JointPlaces, ReducedBody
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.memory import memory
from workflow.analyses.specimens.model import SpecimensModel
from workflow.case.loading import load_case
from workflow.errors import UserError
from workflow.shell.reporter import Reporter

AXES = "xyz"


def reduced_rig_model(body: ReducedBody, directions: int, reporter: Reporter) -> RigModel:
    """The rig that a reduced body makes, with joints of so many ``directions``, 1 or 3.

    Raises UserError for a file without such a body, and for points that it does not have.
    """
    with reporter.stage("reduction", "steps") as told:
        reduced = _reduced_body(body, reporter, told)
    if reduced.names is None:
        raise UserError(
            "structure.file: a model whose kept displacements have no names; allowed: one of a "
            "specimens run, or written with names"
        )
    points = _Points(reduced.names)
    joints = [
        joint
        for number, places in enumerate(body.joints)
        for joint in points.joints(places, directions, f"structure.joints.{number}")
    ]
    try:
        model = reduced_rig(
            reduced,
            reduced.names,
            joints,
            points.masses(body),
            points.springs(body),
            np.array(body.damping_ratio),
        )
        seen = _shape(model, points, body.seen, "structure.seen")
        driven = np.zeros_like(seen)
        if body.driven is not None:
            driven = _shape(model, points, body.driven, "structure.driven")
    except RigError as error:
        raise UserError(f"structure: {error}") from error
    label = f"{body.seen.points} {body.seen.direction}"
    along = _along(directions, body)
    return RigModel(
        *(model, driven, seen[None], (label,), directions, along),
        in_a_row=False,
        translations=_translations(reduced, model),
    )


def _shape(model: DynamicModel, points: PlaceNames, moved: Moved, key: str) -> Array:
    """Even shares ``(n,)`` of the displacements of points along a direction."""
    shares = points.shared(moved, key)
    return np.sum([share * unit_force(model, name) for name, share in shares], axis=0)


def _translations(body: ReducedModel, model: DynamicModel) -> dict[str, Translation]:
    """Those of the rig with the ground, none of a body that something else holds inside."""
    found = {}
    for axis in AXES:
        with suppress(RigError):
            rigid = np.zeros(len(model.mass))
            rigid[: len(body.stiffness)] = translation_of(body, axis)
            found[axis] = Translation(rigid, model.mass @ rigid)
    return found


def _along(directions: int, body: ReducedBody) -> int:
    """The joints' direction that is looked at: their only one, or of two across the one seen."""
    if directions == 1:
        return 0
    across = _across(body.joints[0].direction)
    axis = body.seen.direction[-1]
    return across.index(axis) if axis in across else 0


def _across(direction: str) -> list[str]:
    """The two axes across a direction."""
    return [axis for axis in AXES if axis != direction[-1]]


# --- the body -----------------------------------------------------------------------------------


def _reduced_body(body: ReducedBody, reporter: Reporter, progress: Progress) -> ReducedModel:
    if body.body is None:
        return body.stored()
    specimens = reduced_specimens("structure.file", body.file, reporter, progress)
    return specimens.reduction.models[body.body - 1]


def reduced_specimens(
    key: str,
    file: str,
    reporter: Reporter,
    progress: Progress,
    target_distance: float | None = None,
) -> SpecimensModel:
    """The specimens of the case in a ``file``, reduced, of which ``progress`` is told.

    Raises UserError for one that is no case of specimens, or that cannot be meshed.
    """
    case = load_case(file, [SpecimensCase])
    model = SpecimensModel(case, target_distance)
    try:
        memory(case, model.node_count()).check()
        model.prepare(progress)
    except MeshError as error:
        raise UserError(f"{key}: {file}: {error}") from error
    if model.from_cache:
        reporter.log("reduction: from the cache")
    return model


# --- its points ---------------------------------------------------------------------------------


class _Points(PlaceNames):
    """The kept points of a body by name, and what is put there."""

    def joints(self, places: JointPlaces, directions: int, key: str) -> Iterator[list[Link]]:
        """The links of every joint: that along its direction; three with it as the last."""
        across = _across(places.direction) if directions > 1 else []
        for point, opposite in self.pairs(places, key):
            yield [link_along(point, opposite, axis) for axis in (*across, places.direction)]

    def masses(self, body: ReducedBody) -> dict[str, float]:
        """Masses added to displacements [t]."""
        added: defaultdict[str, float] = defaultdict(float)
        for number, point_mass in enumerate(body.masses):
            points = self.of(point_mass.points, f"structure.masses.{number}.points")
            for name in self.names:
                if name.rpartition(" ")[0] in points:
                    added[name] += point_mass.mass / len(points)
        return added

    def springs(self, body: ReducedBody) -> dict[Link, float]:
        """Springs added between displacements [N/mm]."""
        added: defaultdict[Link, float] = defaultdict(float)
        for number, spring in enumerate(body.springs):
            pairs = self.pairs(spring, f"structure.springs.{number}")
            for point, opposite in pairs:
                link = link_along(point, opposite, spring.direction)
                added[link] += spring.stiffness / len(pairs)
        return added
