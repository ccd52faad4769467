"""A rig made of a reduced body: joints, masses and springs at the points that it is reduced to."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from contextlib import suppress

import numpy as np
import scipy.linalg as sl

from fe_models.dynamics.ground_motion import Translation, translation_of
from fe_models.dynamics.model import DynamicModel
from fe_models.dynamics.receptance import RIGID
from fe_models.dynamics.rig import Link, RigError, reduced_rig, unit_force
from fe_models.matrices import MatrixError
from fe_models.matrices.reduction import listed_names
from fe_models.mesh import MeshError
from fe_models.reduction import STEPS, ReducedModel
from sa_solver.types import Array, Progress, Tally
from workflow.analyses.rig.matrix_body import LoadCase, MatrixBody
from workflow.analyses.rig.place_names import PlaceNames, link_along
from workflow.analyses.rig.places import Moved
from workflow.analyses.rig.rig_model import RigModel
from workflow.analyses.rig.structure import JointedBody, JointPlaces, ReducedBody
from workflow.analyses.specimens.case import SpecimensCase
from workflow.analyses.specimens.memory import memory
from workflow.analyses.specimens.model import SpecimensModel
from workflow.case.loading import load_case
from workflow.errors import UserError
from workflow.shell.reporter import Reporter

AXES = "xyz"


def reduced_rig_model(body: JointedBody, directions: int, reporter: Reporter) -> RigModel:
    """The rig that a reduced body makes, with joints of so many ``directions``, 1 or 3.

    Raises UserError for a file without such a body, and for points that it does not have.
    """
    with reporter.stage("reduction", "steps") as told:
        reduced, massless = _reduced_body(body, reporter, told)
    try:
        return _rig_on(reduced, body, directions)
    except UserError as error:
        if not massless:
            raise
        raise UserError(f"{error}{_told(massless)}") from error


def _rig_on(reduced: ReducedModel, body: JointedBody, directions: int) -> RigModel:
    """The rig on a reduced model."""
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
        driven = _driven(body, reduced, model, points)
        seen = _shape(model, points, body.seen, "structure.seen")
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


def _driven(
    body: JointedBody, reduced: ReducedModel, model: DynamicModel, points: _Points
) -> Array:
    """Forces ``(n,)`` of an excitation of 1 N, none where nothing is driven here."""
    driven: Moved | LoadCase | None = body.driven
    if driven is None:
        return np.zeros(len(model.mass))
    if isinstance(driven, Moved):
        return _shape(model, points, driven, "structure.driven")
    return reduced.loads[:, driven.load - 1]


def _along(directions: int, body: JointedBody) -> int:
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


def _reduced_body(
    body: JointedBody, reporter: Reporter, progress: Progress
) -> tuple[ReducedModel, tuple[str, ...]]:
    """The model, and names of displacements without mass that are none of it."""
    if isinstance(body, MatrixBody):
        return _of_matrices(body, reporter, progress)
    assert isinstance(body, ReducedBody)
    if body.body is None:
        return body.stored(), ()
    specimens = reduced_specimens("structure.file", body.file, reporter, progress)
    return specimens.reduction.models[body.body - 1], ()


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
        reporter.log(f"{count}{_told(massless)}")
    else:
        light = listed_names(massless) or "none"
        reporter.log(f"{count}; given mass for {body.massless:g} Hz: motions mostly of {light}")
        massless = ()
    _warn_of_slow(body, reduced, reporter)
    return reduced, massless


def _warn_of_slow(body: MatrixBody, reduced: ReducedModel, reporter: Reporter) -> None:
    """Tell of modes so slow beside the fastest that they are taken for rigid motions."""
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
            f"the mode of {slowest:.3g} Hz is taken for a rigid motion beside the fastest, "
            f"{fastest:.3g} Hz; reduce by structure.retained and structure.modes"
        )


def _told(massless: tuple[str, ...]) -> str:
    """What is none of the model, behind a sentence."""
    if not massless:
        return ""
    return (
        f"; {listed_names(massless)} have no mass and follow the others statically; allowed there: "
        "structure.masses"
    )


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

    def masses(self, body: JointedBody) -> dict[str, float]:
        """Masses added to displacements [t]."""
        added: defaultdict[str, float] = defaultdict(float)
        for number, point_mass in enumerate(body.masses):
            points = self.of(point_mass.points, f"structure.masses.{number}.points")
            for name in self.names:
                point, _, direction = name.rpartition(" ")
                # Not to rotations.
                if point in points and direction in AXES:
                    added[name] += point_mass.mass / len(points)
        return added

    def springs(self, body: JointedBody) -> dict[Link, float]:
        """Springs added between displacements [N/mm]."""
        added: defaultdict[Link, float] = defaultdict(float)
        for number, spring in enumerate(body.springs):
            pairs = self.pairs(spring, f"structure.springs.{number}")
            for point, opposite in pairs:
                link = link_along(point, opposite, spring.direction)
                added[link] += spring.stiffness / len(pairs)
        return added
