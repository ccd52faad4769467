"""Bodies of a rig that are masses at points, connected by springs and joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from workflow.analyses.rig.bodies.point_kinds import matching
from workflow.analyses.rig.places import NEXT
from workflow.analyses.rig.structure import JointedBody, Mass
from workflow.case.sections import Section, Title, disagreement, entry

if TYPE_CHECKING:
    from fe_models.joints.reduction import ReducedModel


class PointMass(Section):
    """A point with mass."""

    name: Title = entry("name of the point in joints, springs and forces", "pad")
    mass: Mass = entry("mass in every direction in which it moves [t]", "1.2 kg")


class PointBody(JointedBody):
    """Masses at points, with joints and springs between them, or to the ground."""

    kind: Literal["points"] = entry("masses at points", "points")
    points: Annotated[tuple[PointMass, ...], Field(min_length=1, max_length=100)] = entry(
        "names and masses of the points"
    )
    directions: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = entry(
        "directions in which all of them move: one, two, or xyz", "xyz"
    )

    @model_validator(mode="after")
    def _names_them_once(self) -> PointBody:
        names = self.point_names
        twice = [name for name in names if names.count(name) > 1]
        if twice:
            raise disagreement(f"{twice[0]}: given twice; allowed: each once", "points")
        return self

    @property
    def point_names(self) -> tuple[str, ...]:
        """Names of the points."""
        return tuple(point.name for point in self.points)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the displacements."""
        return tuple(f"{point} {axis}" for point in self.point_names for axis in self.directions)

    def body(self) -> ReducedModel:
        """Return the masses, not held by anything."""
        from fe_models.joints.reduction import ReducedModel

        size = len(self.names)
        masses = np.repeat([point.mass for point in self.points], len(self.directions))
        none = np.zeros((size, 0))
        return ReducedModel(
            *(np.arange(size), np.zeros((size, size)), np.diag(masses)),
            *(none, none, np.zeros(0)),
            names=self.names,
        )

    @property
    def joint_count(self) -> int:
        """Number of joints."""
        return sum(
            len(matching(self.point_names, joint.points.removeprefix(NEXT)))
            for joint in self.joints
        )

    @property
    def text(self) -> str:
        points = ", ".join(f"{1e3 * point.mass:g} kg at {point.name}" for point in self.points)
        return f"{points}, moving along {', '.join(self.directions)}, {self.added}"
