"""A body of a rig that is masses at points, which springs and joints connect."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from workflow.analyses.rig.point_kinds import matching
from workflow.analyses.rig.structure import JointedBody
from workflow.case.plain import counted
from workflow.case.sections import Title, disagreement, entry

if TYPE_CHECKING:
    from fe_models.reduction import ReducedModel


class PointBody(JointedBody):
    """Masses at points, with joints and springs between them, or to the ground."""

    kind: Literal["points"] = entry("masses at points", "points")
    points: Annotated[tuple[Title, ...], Field(min_length=1, max_length=100)] = entry(
        "their names", ["disk", "blade"]
    )
    directions: Annotated[tuple[Literal["x", "y", "z"], ...], Field(min_length=1, max_length=3)] = (
        entry("in which all of them move: x, y, z", ["x"])
    )

    @model_validator(mode="after")
    def _names_them_once(self) -> PointBody:
        for name, given in (("points", self.points), ("directions", self.directions)):
            twice = [each for each in given if given.count(each) > 1]
            if twice:
                raise disagreement(f"{twice[0]}: given twice; allowed: each once", name)
        return self

    @model_validator(mode="after")
    def _gives_them_mass(self) -> PointBody:
        heavy = {point for mass in self.masses for point in matching(self.points, mass.points)}
        light = [point for point in self.points if point not in heavy]
        if light:
            raise disagreement(
                f"{light[0]}: without a mass; allowed: one for each of points", "masses", "points"
            )
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Of displacements."""
        return tuple(f"{point} {axis}" for point in self.points for axis in self.directions)

    def body(self) -> ReducedModel:
        """The points, without what is added to them: neither mass nor stiffness."""
        from fe_models.reduction import ReducedModel

        size = len(self.names)
        nothing, none = np.zeros((size, size)), np.zeros((size, 0))
        return ReducedModel(
            np.arange(size), nothing, nothing, none, none, np.zeros(0), names=self.names
        )

    @property
    def joint_count(self) -> int:
        """How many joints there are."""
        return sum(len(matching(self.points, joint.points)) for joint in self.joints)

    @property
    def text(self) -> str:
        along = ", ".join(self.directions)
        return f"{counted(len(self.points), 'point')} that move along {along}, {self.added}"
