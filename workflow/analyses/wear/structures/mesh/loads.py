"""Loads on the bodies of a user's mesh, as sections of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from workflow.analyses.wear.structures.mesh.load import (
    KINDS,
    Coordinate,
    Direction,
    MeshLoad,
    Name,
)
from workflow.analyses.wear.structures.mesh.pretension import PretensionLoad, ShorteningLoad
from workflow.analyses.wear.structures.mesh.temperatures import (
    NodalTemperatureLoad,
    TemperatureLoad,
)
from workflow.case.fields import Quantity, Word
from workflow.case.sections import disagreement, entry

if TYPE_CHECKING:
    from fe_models.loads import applied_loads as fe

ForceComponent = Annotated[float, Quantity("N", at_least=-1e9, at_most=1e9)]
MomentComponent = Annotated[float, Quantity("N mm", at_least=-1e12, at_most=1e12)]
PressureValue = Annotated[float, Quantity("MPa", at_least=-1e5, at_most=1e5)]
DisplacementComponent = Annotated[float, Quantity("mm", at_least=-1e3, at_most=1e3)]
AngularSpeed = Annotated[float, Quantity("rad/s", above=0.0, at_most=1e5)]
# Rotations are small: their squares are neglected.
Angle = Annotated[float, Quantity("rad", at_least=-1.0, at_most=1.0)]
AccelerationComponent = Annotated[float, Quantity("mm/s^2", at_least=-1e12, at_most=1e12)]

MOTIONS = "x", "y", "z", "rotation_x", "rotation_y", "rotation_z"
Motion = Annotated[str, Word(MOTIONS)]
Tie = Literal["averaged", "rigid"]
TIE: Any = entry(
    "link of the point to the boundary; averaged: it stays free to deform and follows by least "
    "squares; rigid: it keeps its form",
    "averaged",
    default="averaged",
)


class PressureLoad(MeshLoad):
    """Pressure on a boundary, into the body."""

    kind: Literal["pressure"] = entry(KINDS, "pressure")
    group: Name = entry("boundary", "blade_top")
    pressure: PressureValue = entry("pressure into the body [MPa]", "10 MPa")

    def described(self) -> fe.Pressure:
        """Return the load as the structure takes it."""
        from fe_models.loads.applied_loads import Pressure

        return Pressure(self.group, self.pressure)


class ForceLoad(MeshLoad):
    """Force on a boundary: spread evenly, or transferred from a point tied to the boundary."""

    kind: Literal["force"] = entry(KINDS, "force")
    group: Name = entry("boundary", "blade_top")
    force: tuple[ForceComponent, ForceComponent, ForceComponent] = entry(
        "force along the global axes; in two dimensions per length, N/mm [N]", [0.0, 0.0, "-1 kN"]
    )
    at: tuple[Coordinate, Coordinate, Coordinate] | None = entry(
        "point at which it acts, tied to the boundary; without it its centroid [mm]",
        [0.0, 0.0, "50 mm"],
        default=None,
    )
    tie: Tie = TIE

    def described(self) -> fe.BoundaryForce:
        """Return the load as the structure takes it."""
        from fe_models.loads.applied_loads import BoundaryForce

        at = None if self.at is None else np.array(self.at)
        return BoundaryForce(self.group, np.array(self.force), at, rigid=self.tie == "rigid")


class MomentLoad(MeshLoad):
    """Moment on a boundary."""

    kind: Literal["moment"] = entry(KINDS, "moment")
    group: Name = entry("boundary", "blade_top")
    moment: tuple[MomentComponent, MomentComponent, MomentComponent] = entry(
        "moment about the global axes; in two dimensions about y and per length, N [N mm]",
        [0.0, "5 N m", 0.0],
    )
    tie: Tie = TIE

    def described(self) -> fe.BoundaryForce:
        """Return the load as the structure takes it."""
        from fe_models.loads.applied_loads import BoundaryForce

        moment = np.array(self.moment)
        return BoundaryForce(self.group, np.zeros(3), moment=moment, rigid=self.tie == "rigid")


class DisplacementLoad(MeshLoad):
    """Displacement of a boundary, imposed along its direction and free across it.

    Several displacements of one boundary add up as vectors: make them perpendicular.
    """

    kind: Literal["displacement"] = entry(KINDS, "displacement")
    group: Name = entry("boundary", "blade_top")
    displacement: tuple[DisplacementComponent, DisplacementComponent, DisplacementComponent] = (
        entry("displacement along the global axes [mm]", ["10 um", 0.0, 0.0])
    )

    @model_validator(mode="after")
    def _moves(self) -> DisplacementLoad:
        if not any(self.displacement):
            raise disagreement("no displacement; allowed: one that is not zero", "displacement")
        return self

    @property
    def ties(self) -> bool:
        return True

    def described(self) -> fe.Displacement:
        """Return the load as the structure takes it."""
        from fe_models.loads.applied_loads import Displacement

        return Displacement(self.group, np.array(self.displacement))


class RemoteDisplacementLoad(MeshLoad):
    """Small displacement and rotation of a point tied to a boundary.

    Several displacements of one point add up.
    """

    kind: Literal["remote_displacement"] = entry(KINDS, "remote_displacement")
    group: Name = entry("boundary", "blade_top")
    at: tuple[Coordinate, Coordinate, Coordinate] = entry("the point [mm]", [0.0, 0.0, "50 mm"])
    displacement: tuple[DisplacementComponent, DisplacementComponent, DisplacementComponent] = (
        entry(
            "displacement of the point along the global axes [mm]",
            ["10 um", 0.0, 0.0],
            default=(0, 0, 0),
        )
    )
    rotation: tuple[Angle, Angle, Angle] = entry(
        "rotation about the global axes; in two dimensions about y [rad]",
        [0.0, "0.1 deg", 0.0],
        default=(0, 0, 0),
    )
    free: tuple[Motion, ...] = entry(
        "components of x, y, z, rotation_x, rotation_y and rotation_z that are not imposed",
        ["z"],
        default=(),
    )
    tie: Tie = TIE

    @model_validator(mode="after")
    def _is_given_or_free(self) -> RemoteDisplacementLoad:
        if len(set(self.free)) < len(self.free):
            raise disagreement("a component twice; allowed: each once", "free")
        if len(self.free) == len(MOTIONS):
            raise disagreement("all six; allowed: at most five, or no such load", "free")
        for name, size in zip(MOTIONS, (*self.displacement, *self.rotation), strict=True):
            if name in self.free and size:
                key = "rotation" if name.startswith("rotation") else "displacement"
                raise disagreement(
                    f"{name} is given, and free; allowed: 0 where it is free", "free", key
                )
        return self

    @property
    def ties(self) -> bool:
        return True

    @property
    def how(self) -> str:
        free = f", {' and '.join(self.free).replace('_', ' about ')} free" if self.free else ""
        return free + super().how

    def described(self) -> fe.RemoteDisplacement:
        """Return the load as the structure takes it."""
        from fe_models.loads.applied_loads import RemoteDisplacement

        motion = np.array([*self.displacement, *self.rotation])
        free = np.array([name in self.free for name in MOTIONS])
        return RemoteDisplacement(self.group, np.array(self.at), motion, free, self.tie == "rigid")


class RotationLoad(MeshLoad):
    """Rotation of all bodies; the path is that of the speed, and forces follow its square."""

    kind: Literal["rotation"] = entry(KINDS, "rotation")
    axis: Direction = entry("direction of the axis [1]", [0.0, 1.0, 0.0])
    through: tuple[Coordinate, Coordinate, Coordinate] = entry(
        "a point on the axis [mm]", [0.0, 0.0, 0.0]
    )
    speed: AngularSpeed = entry("[rad/s]", "6000 rpm")

    def described(self) -> fe.Rotation:
        """Return the load as the structure takes it."""
        from fe_models.loads.applied_loads import Rotation

        return Rotation(np.array(self.axis), np.array(self.through), self.speed)


class AccelerationLoad(MeshLoad):
    """Acceleration of the frame of reference, which pulls all bodies in the opposite direction."""

    kind: Literal["acceleration"] = entry(KINDS, "acceleration")
    acceleration: tuple[AccelerationComponent, AccelerationComponent, AccelerationComponent] = (
        entry("acceleration along the global axes [mm/s^2]", [0.0, 0.0, "9.81 m/s^2"])
    )

    def described(self) -> fe.Acceleration:
        """Return the load as the structure takes it."""
        from fe_models.loads.applied_loads import Acceleration

        return Acceleration(np.array(self.acceleration))


Load = Annotated[
    PressureLoad
    | ForceLoad
    | MomentLoad
    | DisplacementLoad
    | RemoteDisplacementLoad
    | RotationLoad
    | AccelerationLoad
    | TemperatureLoad
    | NodalTemperatureLoad
    | PretensionLoad
    | ShorteningLoad,
    Field(discriminator="kind"),
]
